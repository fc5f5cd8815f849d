//! Rays: the first hit of a line with the lattice, in closed form.
//!
//! Along a line S is a quadratic and each G a line, so N is a quadratic between the places where a stub joins or leaves, each
//! of which is the root of a line. Each stretch is one quadratic to be solved.

use geometry::math::{Aabb, Vec3, add, dot, scale, sub, unit};

use super::Quadors;
use super::hub::Hub;
use super::quadric::piece;

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How far along, in lengths of the direction.
    pub distance: f64,
    /// The place, mm.
    pub at: Vec3,
    /// The outward normal there.
    pub normal: Vec3,
    /// The hub it belongs to.
    pub hub: usize,
}

/// Where a line enters a hub's part after `from`: the parameter and the outward normal.
fn enters(hub: &Hub, o: Vec3, v: Vec3, from: f64, to: f64) -> Option<(f64, Vec3)> {
    let (mut t, size) = (from, to - from);
    // Each change of stubs takes the line on; a stub changes at most twice along a line.
    for _ in 0..4 * hub.stubs.len() + 4 {
        if t >= to {
            return None;
        }
        // A hair on, so that the stubs are those of the stretch that begins here.
        let label = hub.grown(add(o, scale(v, t + 1e-9 * size))).active;
        let (q, sigma) = piece(hub, label);
        let mut end = to;
        for (i, s) in hub.stubs.iter().enumerate() {
            let f = if hub.sharp {
                let lead = if label == 0 { Default::default() } else { hub.stubs[label.trailing_zeros() as usize].g };
                s.g.plus(-1.0, &lead)
            } else {
                s.g.plus(-s.share, &sigma)
            };
            let root = -f.at(o) / dot(f.a, v);
            if (!hub.sharp || label >> i & 1 == 0) && root > t + 1e-9 * size && root < end {
                end = root;
            }
        }
        if hub.sharp && label != 0 {
            let g = hub.stubs[label.trailing_zeros() as usize].g;
            let root = -g.at(o) / dot(g.a, v);
            if root > t + 1e-9 * size && root < end {
                end = root;
            }
        }
        let (none, one, two) = (q.at(o), dot(q.half_slope(o), v), q.form(v, v));
        let square = one * one - two * none;
        if square >= 0.0 {
            let w = -(one + square.sqrt().copysign(one));
            let mut roots = [w / two, none / w];
            roots.sort_by(f64::total_cmp);
            for r in roots {
                let x = add(o, scale(v, r));
                let slope = q.half_slope(x);
                if r >= t && r <= end && dot(slope, v) < 0.0 && hub.before_split(x) {
                    return Some((r, unit(slope)));
                }
            }
        }
        t = end;
    }
    None
}

/// Where a line is in a box.
pub(super) fn crossed(b: &Aabb, o: Vec3, v: Vec3) -> Option<(f64, f64)> {
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
    /// The first place beyond `origin` where a ray along `way` enters the solid, with its outward normal; `None` if it does not.
    /// A ray that starts inside first has to leave.
    pub fn ray(&self, origin: Vec3, way: Vec3) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        let mut seen = Vec::new();
        self.index.along(origin, way, &mut |items, until| {
            for &i in items {
                if seen.contains(&i) {
                    continue;
                }
                seen.push(i);
                let ball = &self.balls[i as usize];
                let Some((from, to)) = crossed(&ball.bounds, origin, way) else {
                    continue;
                };
                let hub = self.hub(i as usize);
                if let Some((t, normal)) = enters(&hub, sub(origin, ball.center), way, from.max(0.0), to)
                    && best.is_none_or(|b| t < b.distance)
                {
                    best = Some(Hit { distance: t, at: add(origin, scale(way, t)), normal, hub: i as usize });
                }
            }
            best.is_none_or(|b| b.distance > until)
        });
        best
    }
}
