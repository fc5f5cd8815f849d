//! Ray casting: the first intersection of a ray with the lattice, in closed form.
//!
//! Along a line S is quadratic and each G is linear, so N is quadratic between the parameters at which a half-beam
//! becomes active or inactive, which are roots of linear functions. Each interval is one quadratic equation.

use geometry::math::{Aabb, Vec3, add, dot, scale, sub, unit};

use super::Quadors;
use super::hub::Hub;
use super::hub_quadric::piece_quadric;

/// Intersection of a ray with the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in lengths of its direction.
    pub distance: f64,
    /// Position, mm.
    pub at: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Index of the hub.
    pub hub: usize,
}

/// The first parameter in [from, to] at which a line enters a hub's part, and the outward normal.
fn first_entry(hub: &Hub, o: Vec3, v: Vec3, from: f64, to: f64) -> Option<(f64, Vec3)> {
    let (mut t, size) = (from, to - from);
    // Each half-beam becomes active or inactive at most twice along a line.
    for _ in 0..4 * hub.half_beams.len() + 4 {
        if t >= to {
            return None;
        }
        // Slightly ahead, for the label of the interval that begins here.
        let label = hub.smooth_union(add(o, scale(v, t + 1e-9 * size))).active;
        let (q, sigma) = piece_quadric(hub, label);
        let mut end = to;
        for (i, s) in hub.half_beams.iter().enumerate() {
            let f = if hub.sharp {
                let lead =
                    if label == 0 { Default::default() } else { hub.half_beams[label.trailing_zeros() as usize].g };
                s.g.plus(-1.0, &lead)
            } else {
                s.g.plus(-s.blend, &sigma)
            };
            let root = -f.at(o) / dot(f.a, v);
            if (!hub.sharp || label >> i & 1 == 0) && root > t + 1e-9 * size && root < end {
                end = root;
            }
        }
        if hub.sharp && label != 0 {
            let g = hub.half_beams[label.trailing_zeros() as usize].g;
            let root = -g.at(o) / dot(g.a, v);
            if root > t + 1e-9 * size && root < end {
                end = root;
            }
        }
        let (none, one, two) = (q.at(o), dot(q.half_gradient(o), v), q.form(v, v));
        let square = one * one - two * none;
        if square >= 0.0 {
            let w = -(one + square.sqrt().copysign(one));
            let mut roots = [w / two, none / w];
            roots.sort_by(f64::total_cmp);
            for r in roots {
                let x = add(o, scale(v, r));
                let slope = q.half_gradient(x);
                if r >= t && r <= end && dot(slope, v) < 0.0 && hub.is_before_split(x) {
                    return Some((r, unit(slope)));
                }
            }
        }
        t = end;
    }
    None
}

/// The parameters at which a line enters and leaves a box.
pub(super) fn clip_line(b: &Aabb, o: Vec3, v: Vec3) -> Option<(f64, f64)> {
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for a in 0..3 {
        if v[a] == 0.0 {
            if o[a] < b.min[a] || o[a] > b.max[a] {
                return None;
            }
            continue;
        }
        let (p, q) = ((b.min[a] - o[a]) / v[a], (b.max[a] - o[a]) / v[a]);
        from = from.max(p.min(q));
        to = to.min(p.max(q));
    }
    (from <= to && to > 0.0).then_some((from, to))
}

impl Quadors {
    /// The first intersection beyond `origin` (mm) at which a ray along `direction` enters the solid; `None` if there
    /// is none. A ray that starts inside has to leave first.
    pub fn ray(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut seen = Vec::new();
        self.index.along(origin, direction, &mut |items, until| {
            for &i in items {
                if seen.contains(&i) {
                    continue;
                }
                seen.push(i);
                let ball = &self.balls[i as usize];
                let Some((from, to)) = clip_line(&ball.bounds, origin, direction) else {
                    continue;
                };
                let hub = self.hub(i as usize);
                if let Some((t, normal)) = first_entry(&hub, sub(origin, ball.center), direction, from.max(0.0), to)
                    && best.is_none_or(|b| t < b.distance)
                {
                    best = Some(Hit { distance: t, at: add(origin, scale(direction, t)), normal, hub: i as usize });
                }
            }
            best.is_none_or(|b| b.distance > until)
        });
        best
    }
}
