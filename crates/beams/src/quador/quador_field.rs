//! The quador lattice as an implicit function: the minimum over its hubs of a length derived from S − N.
//!
//! A hub's formula is evaluated past the split planes of its half-beams, where it agrees with the other hub's formula
//! (one quadric is tangent to both balls), so the minimum has no seam there. Past the cut planes the value is raised by
//! the distance past them.

use super::Quadors;
use super::affine_function::largest;
use super::hub::Hub;
use geometry::math::{Aabb, Interval, Vec3, dot, scale, sub};

/// Maximum number of hubs examined for the bound over a box.
const MAX_HUBS_PER_BOX: usize = 96;
/// Bound of the rounding of the squares from which a value is made, relative to the largest of them.
const ROUNDING: f64 = 1e-12;

impl Quadors {
    /// Length derived from q = S − N: ρ − a around a cylinder of the typical radius a. Outside it increases no faster
    /// than the distance; inside it is proportional to q, since a square root would not be smooth.
    #[inline]
    pub(super) fn length(&self, q: f64) -> f64 {
        q / if q < 0.0 { 2.0 * self.scale } else { (q + self.scale * self.scale).sqrt() + self.scale }
    }

    /// The field at one point, mm.
    #[inline]
    pub fn value(&self, p: Vec3) -> f64 {
        self.value_among(p, self.index.near(p), self.cap)
    }

    /// The least value of some hubs at one point, mm; at most `most`.
    #[inline]
    pub(super) fn value_among(&self, p: Vec3, hubs: &[u32], most: f64) -> f64 {
        self.least_among(p, hubs, most).0
    }

    /// The least value of some hubs at one point, and the first of them that has it; none where it is the given upper limit.
    #[inline]
    fn least_among(&self, p: Vec3, hubs: &[u32], most: f64) -> (f64, Option<u32>) {
        let mut least = (most, None);
        // Where one value is small, most others need not be found: mostly the nearest hub has the smallest.
        let (mut nearest, mut away) = (0, f64::INFINITY);
        for (n, &i) in hubs.iter().enumerate() {
            let x = sub(p, self.balls[i as usize].center);
            if dot(x, x) < away {
                (nearest, away) = (n, dot(x, x));
            }
        }
        let (before, rest) = hubs.split_at(nearest.min(hubs.len()));
        let (one, after) = rest.split_at(rest.len().min(1));
        for &i in one.iter().chain(before).chain(after) {
            let ball = &self.balls[i as usize];
            let outside = ball.bounds.distance(p);
            if outside > 0.0 && outside >= least.0 {
                continue;
            }
            let v = self.below(&self.hub(i as usize), sub(p, ball.center), least.0);
            let v = if outside > 0.0 { v.max(outside) } else { v };
            if v < least.0 {
                least = (v, Some(i));
            }
        }
        least
    }

    /// The value of a hub at x in its frame, if less than `least`; else that or more.
    #[inline]
    pub(super) fn below(&self, hub: &Hub, x: Vec3, least: f64) -> f64 {
        hub.with_g(x, |g| {
            let v = self.length_below(hub, x, g, least);
            if v < least { hub.past_cut_of(x, g, v).0 } else { v }
        })
    }

    /// As `below`, not raised past the cut planes, for given G at x.
    #[inline]
    pub(super) fn length_below(&self, hub: &Hub, x: Vec3, g: &[f64], least: f64) -> f64 {
        let from_center = dot(x, x);
        let square = from_center - hub.radius * hub.radius;
        let level = if least < 0.0 { 2.0 * self.scale * least } else { least * (least + 2.0 * self.scale) };
        // What is surely not less stays so after rounding: the least value does not depend on the order of the hubs.
        let enough = square - level - ROUNDING * (from_center + level.abs());
        self.length(square - hub.union_of(g, largest(g), [f64::INFINITY, enough]))
    }

    fn value_and_gradient(&self, p: Vec3) -> (f64, Vec3) {
        let (value, Some(i)) = self.least_among(p, self.index.near(p), self.cap) else {
            return (self.cap, [0.0; 3]);
        };
        let (ball, hub) = (&self.balls[i as usize], self.hub(i as usize));
        let outside = ball.bounds.distance(p);
        if outside > 0.0 && value == outside {
            let out = [0, 1, 2].map(|a| (p[a] - ball.bounds.max[a]).max(0.0) - (ball.bounds.min[a] - p[a]).max(0.0));
            return (value, scale(out, 1.0 / outside));
        }
        let x = sub(p, ball.center);
        let (q, g) = hub.gradient(x);
        let own = self.length(q);
        if value > own {
            return (value, hub.past_cut(x, own).1);
        }
        let steep = if q < 0.0 { self.scale } else { (q + self.scale * self.scale).sqrt() };
        (value, scale(g, 0.5 / steep))
    }

    /// Whether a point (mm) is in the solid.
    pub fn contains(&self, p: Vec3) -> bool {
        self.parts.near(p).iter().any(|&i| {
            let ball = &self.balls[i as usize];
            ball.part.distance(p) == 0.0 && self.hub(i as usize).contains(sub(p, ball.center))
        })
    }

    /// The value of one hub at a point; the field is the minimum over hubs and the cap.
    pub(crate) fn hub_value(&self, i: usize, p: Vec3) -> f64 {
        let ball = &self.balls[i];
        let v = self.below(&self.hub(i), sub(p, ball.center), f64::INFINITY);
        match ball.bounds.distance(p) {
            outside if outside > 0.0 => v.max(outside),
            _ => v,
        }
    }

    /// Bounds of a hub with its half-beams up to their cut planes, mm.
    pub fn hub_bounds(&self, i: usize) -> Aabb {
        self.balls[i].bounds
    }

    /// Distance of a hub's bounds from a box: if positive, a lower bound of its value there, mm.
    #[inline]
    pub(super) fn apart(&self, hub: u32, b: &Aabb) -> f64 {
        let of = &self.balls[hub as usize].bounds;
        let apart = [0, 1, 2].map(|a| (of.min[a] - b.max[a]).max(b.min[a] - of.max[a]).max(0.0));
        dot(apart, apart).sqrt()
    }
}

impl Quadors {
    /// Fills the field (mm) at points (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, &p) in out.iter_mut().zip(points) {
            *o = self.value(p);
        }
    }

    /// Fills the field (mm) and its gradient at points (mm).
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), &p) in values.iter_mut().zip(gradients).zip(points) {
            (*v, *g) = self.value_and_gradient(p);
        }
    }

    /// An interval that contains the field over the box; a proven bound.
    pub fn bound(&self, b: &Aabb) -> Interval {
        let Some(near) = self.index.touching(b, MAX_HUBS_PER_BOX) else {
            return Interval::new(f64::NEG_INFINITY, self.cap);
        };
        let cap = Interval::new(self.cap, self.cap);
        near.into_iter().fold(cap, |least, i| least.min(self.hub_bound(i as usize, b)))
    }

    /// Whether the zero set may have creases: only without fillets.
    pub fn has_creases(&self) -> bool {
        self.taus.is_empty() && !self.half_beams.is_empty()
    }

    /// A Lipschitz bound of the field.
    pub fn lipschitz(&self) -> f64 {
        let thick = self.balls.iter().map(|b| b.radius).fold(self.scale, f64::max);
        2.0 * thick / self.scale
    }
}
