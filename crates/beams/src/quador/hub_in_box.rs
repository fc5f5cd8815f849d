//! What of a hub matters in a box, the range of its value there, and its values at positions in it.

use geometry::math::{Aabb, Interval, Vec3, dot, scale, sub};

use super::Quadors;
use super::active_in_box::{CentredBox, HalfBeamSet, PackedHalfBeams};
use super::affine_function::AffineFunction;
use super::hub::Hub;

/// Largest number of positions of which values are lowered at a time.
pub(super) const MOST_POINTS: usize = 32;

/// What of a hub matters in a box.
#[derive(Clone, Copy)]
pub(super) struct HubInBox {
    pub hub: u32,
    /// Lower bound of its value, mm.
    pub least: f64,
    /// The half-beams that can be active.
    active: HalfBeamSet,
    /// The half-beams past whose cut planes values may be raised.
    ending: HalfBeamSet,
    /// Whether the bounds of the hub contain the box.
    contains: bool,
}

impl HubInBox {
    /// A hub of which nothing is known.
    pub(super) fn anywhere(hub: u32) -> HubInBox {
        HubInBox { hub, least: f64::NEG_INFINITY, active: HalfBeamSet::ALL, ending: HalfBeamSet::ALL, contains: false }
    }
}

impl Quadors {
    /// The range of one hub's value over a box.
    pub(crate) fn hub_bound(&self, i: usize, b: &Aabb) -> Interval {
        self.hub_in_box(&HubInBox::anywhere(i as u32), b, &mut PackedHalfBeams::default()).1
    }

    /// What of a hub matters in a box, and the range of its value there, from what matters in a box around it.
    pub(super) fn hub_in_box(&self, outer: &HubInBox, b: &Aabb, few: &mut PackedHalfBeams) -> (HubInBox, Interval) {
        let ball = &self.balls[outer.hub as usize];
        let hub = self.hub(outer.hub as usize);
        let half = scale(b.size(), 0.5);
        let around = CentredBox { at: sub(b.center(), ball.center), half };
        let x = around.at;
        few.take_active(&hub, outer.active, &around);
        let [lo, hi] = few.of(&hub).range(&around, ball.curvature);
        let (mut lo, mut hi) = (self.length(lo), self.length(hi));
        // Lengths are computed from squares: a few roundings of the largest.
        let slack = 1e-12 * (1.0 + dot(x, x) / self.scale);
        // What is past the cut planes raises no value unless it exceeds the least.
        let (mut ending, unraised) = (HalfBeamSet::NONE, lo - slack);
        for i in outer.ending.of(hub.half_beams.len()) {
            let s = &hub.half_beams[i];
            let (along, along_reach) = (dot(s.axis, x) - s.cut, around.reach(s.axis));
            if along + along_reach <= unraised {
                continue;
            }
            let (g, g_reach) = (s.g.at(x), around.reach(s.g.a));
            let past = (along + along_reach).min(g + g_reach);
            if past <= unraised {
                continue;
            }
            ending.add(i);
            hi = hi.max(past);
            let raised = (along - along_reach).min(g - g_reach);
            if raised > lo {
                // Half-beams that are not its own may have the larger G there.
                let leads = |o: &AffineFunction| g - o.at(x) - around.reach(sub(s.g.a, o.a));
                let others = hub.half_beams.iter().filter(|o| !std::ptr::eq(*o, s));
                lo = lo.max(others.map(|o| leads(&o.g)).fold(raised, f64::min));
            }
        }
        let farthest = [0, 1, 2].map(|a| (ball.bounds.min[a] - b.min[a]).max(b.max[a] - ball.bounds.max[a]).max(0.0));
        let apart = self.apart(outer.hub, b);
        if apart > 0.0 {
            lo = lo.max(apart);
        }
        let farthest = dot(farthest, farthest).sqrt();
        if farthest > 0.0 {
            hi = hi.max(farthest);
        }
        let (hub, active, contains) = (outer.hub, few.set(), farthest == 0.0);
        let within = HubInBox { hub, least: lo - slack, active, ending, contains };
        (within, Interval::new(within.least, hi + slack))
    }

    /// Lowers values at positions in a box (at most `MOST_POINTS`, by coordinate) to those of a hub. They are the least of the
    /// same values as one by one, to the last bit.
    pub(super) fn lower(&self, within: &HubInBox, points: [&[f64]; 3], least: &mut [f64], few: &mut PackedHalfBeams) {
        let (ball, hub) = (&self.balls[within.hub as usize], self.hub(within.hub as usize));
        let mut values = [0.0; MOST_POINTS];
        let values = &mut values[..least.len()];
        let square = hub.radius * hub.radius;
        few.take(&hub, within.active);
        let own = few.of(&hub);
        match *own.g {
            [] => self.lengths(ball.center, points, square, values, |_| 0.0),
            [g] => self.lengths(ball.center, points, square, values, |x| {
                let g = g.at(x).max(0.0);
                g * g
            }),
            [p, q] => {
                let tau = own.tau(0, 1);
                self.lengths(ball.center, points, square, values, |x| Hub::union_of_two(tau, p.at(x), q.at(x)));
            }
            _ => {
                for (k, (v, least)) in values.iter_mut().zip(&*least).enumerate() {
                    let x = sub([0, 1, 2].map(|a| points[a][k]), ball.center);
                    *v = own.with_g(x, |g| self.length_below(&own, x, g, *least));
                }
            }
        }
        for (k, (v, least)) in values.iter().zip(least).enumerate() {
            if *v >= *least {
                continue;
            }
            let p = [0, 1, 2].map(|a| points[a][k]);
            let outside = if within.contains { 0.0 } else { ball.bounds.distance(p) };
            if outside > 0.0 && outside >= *least {
                continue;
            }
            let x = sub(p, ball.center);
            let is_past = |i: usize| dot(hub.half_beams[i].axis, x) - hub.half_beams[i].cut > *v;
            let raised = within.ending.of(hub.half_beams.len()).any(is_past);
            let v = if raised { hub.past_cut(x, *v).0 } else { *v };
            *least = least.min(if outside > 0.0 { v.max(outside) } else { v });
        }
    }

    /// The lengths of a hub about `center`, of this radius squared and with this N in its frame, at positions.
    #[inline]
    fn lengths(&self, center: Vec3, points: [&[f64]; 3], square: f64, out: &mut [f64], union: impl Fn(Vec3) -> f64) {
        let [xs, ys, zs] = points.map(|p| &p[..out.len()]);
        for (k, out) in out.iter_mut().enumerate() {
            let x = sub([xs[k], ys[k], zs[k]], center);
            *out = self.length(dot(x, x) - square - union(x));
        }
    }
}

impl Hub<'_> {
    /// Bounds of S − N over a box, for an upper bound of half the second derivative of N.
    fn range(&self, around: &CentredBox, curvature: f64) -> [f64; 2] {
        let (x, h2) = (around.at, dot(around.half, around.half));
        let s = dot(x, x) - self.radius * self.radius;
        let (q, slope, curvature) = match *self.g {
            [] => (s, scale(x, 2.0), 0.0),
            [g] => {
                let y = g.at(x).max(0.0);
                (s - y * y, sub(scale(x, 2.0), scale(g.a, 2.0 * y)), dot(g.a, g.a))
            }
            [a, b] if !self.sharp() => {
                let (q, slope) = self.gradient(x);
                (q, slope, curvature_of_two(self.tau(0, 1), a.a, b.a))
            }
            _ => {
                let (q, slope) = self.gradient(x);
                (q, slope, curvature)
            }
        };
        // N is convex: S − N lies below its tangent plus |δ|². Its second derivative is at most twice the curvature bound.
        let hi = q + around.reach(slope) + h2;
        if !self.sharp() || self.g.len() < 2 {
            return [q - around.reach(slope) - (curvature - 1.0).max(0.0) * h2, hi];
        }
        let least = |lo: f64, f: &AffineFunction| {
            let g = f.at(x);
            if g + around.reach(f.a) <= 0.0 {
                return lo;
            }
            let slope = sub(scale(x, 2.0), scale(f.a, 2.0 * g));
            lo.min(s - g * g - around.reach(slope) - (dot(f.a, f.a) - 1.0).max(0.0) * h2)
        };
        [self.g.iter().fold(s - around.reach(scale(x, 2.0)), least), hi]
    }
}

/// The largest half second derivative of N where two half-beams are active, from the gradients of their G: the larger
/// eigenvalue of (p pᵀ − τ (p qᵀ + q pᵀ) + q qᵀ)/(1 − τ²).
fn curvature_of_two(tau: f64, p: Vec3, q: Vec3) -> f64 {
    let (pp, pq, qq, rest) = (dot(p, p), dot(p, q), dot(q, q), (1.0 - tau) * (1.0 + tau));
    let (half, product) = ((pp - 2.0 * tau * pq + qq) / (2.0 * rest), (pp * qq - pq * pq) / rest);
    half + (half * half - product).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::{Fillet, tests};
    use super::*;

    /// Small boxes, many of which creases cross: there N has more than one gradient.
    #[test]
    fn bounds_of_small_boxes_hold_every_value_near_creases_and_fillets() {
        let mut random = tests::Random(21);
        for n in [2, 3, 6] {
            for fillet in [Fillet::None, Fillet::Auto, Fillet::Tau(0.9)] {
                for _ in 0..60 {
                    let q = Quadors::new(&tests::random_star(&mut random, n), fillet).expect("a star");
                    for _ in 0..100 {
                        let center = scale(random.direction(), 3.0 * random.next());
                        let half = [(); 3].map(|()| 0.15 * random.next());
                        let at = |k: usize| {
                            let o = [k % 3, k / 3 % 3, k / 9];
                            [0, 1, 2].map(|a| center[a] + half[a] * (o[a] as f64 - 1.0))
                        };
                        let bound = q.bound(&Aabb { min: at(0), max: at(26) });
                        for v in (0..27).map(|k| q.value(at(k))) {
                            assert!(bound.lo <= v && v <= bound.hi, "{n} {fillet:?} {center:?}: {v} {bound:?}");
                        }
                    }
                }
            }
        }
    }
}
