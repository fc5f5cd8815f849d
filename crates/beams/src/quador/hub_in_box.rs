//! What of a hub matters in a box, the range of its value there, and its values at positions in it.

use geometry::math::{Aabb, Interval, Vec3, dot, scale, sub};

use super::Quadors;
use super::active_in_box::{ActiveInBox, Around};
use super::hub::{HalfBeam, Hub};

/// Largest number of positions of which values are lowered at a time.
pub(super) const MOST_POINTS: usize = 32;

/// What of a hub matters in a box.
#[derive(Clone, Copy)]
pub(super) struct HubInBox {
    pub hub: u32,
    active: ActiveInBox,
    /// Upper bound of the distance past the cut planes, mm.
    past: f64,
    /// Whether the bounds of the hub contain the box.
    contains: bool,
}

impl HubInBox {
    /// A hub of which nothing is known.
    pub(super) fn anywhere(hub: u32) -> HubInBox {
        HubInBox { hub, active: ActiveInBox::Any, past: f64::INFINITY, contains: false }
    }

    /// Whether its values in the box take few operations.
    pub(super) fn is_simple(&self) -> bool {
        self.active != ActiveInBox::Any
    }
}

impl Quadors {
    /// The range of one hub's value over a box.
    pub(crate) fn hub_bound(&self, i: usize, b: &Aabb) -> Interval {
        self.hub_in_box(&HubInBox::anywhere(i as u32), b).1
    }

    /// What of a hub matters in a box, and the range of its value there, from what matters in a box around it.
    pub(super) fn hub_in_box(&self, outer: &HubInBox, b: &Aabb) -> (HubInBox, Interval) {
        let ball = &self.balls[outer.hub as usize];
        let hub = self.hub(outer.hub as usize);
        let half = scale(b.size(), 0.5);
        let around = Around { at: sub(b.center(), ball.center), half };
        let (x, h2) = (around.at, dot(half, half));
        let active = hub.active_in_box(outer.active, &around);
        let (q, g, curvature) = hub.gradient_of(active, x, ball.curvature);
        // N is convex: S − N lies below its tangent plus |δ|². Its second derivative is at most twice the curvature
        // bound.
        let hi = q + around.reach(g) + h2;
        let lo = if active == ActiveInBox::Any && hub.sharp() {
            let s = dot(x, x) - ball.radius * ball.radius;
            let ball_lo = s - around.reach(scale(x, 2.0));
            hub.half_beams.iter().fold(ball_lo, |lo, half_beam| {
                let g = half_beam.g.at(x);
                if g + around.reach(half_beam.g.a) <= 0.0 {
                    return lo;
                }
                let slope = sub(scale(x, 2.0), scale(half_beam.g.a, 2.0 * g));
                let curvature = (dot(half_beam.g.a, half_beam.g.a) - 1.0).max(0.0);
                lo.min(s - g * g - around.reach(slope) - curvature * h2)
            })
        } else {
            q - around.reach(g) - (curvature - 1.0).max(0.0) * h2
        };
        let (mut lo, mut hi) = (self.length(lo), self.length(hi));
        // What is past the cut planes raises no value unless it exceeds the least.
        let mut past = outer.past;
        if past > lo {
            past = f64::NEG_INFINITY;
            for s in hub.half_beams {
                let (along, g) = (dot(s.axis, x) - s.cut, s.g.at(x));
                let (along_reach, g_reach) = (around.reach(s.axis), around.reach(s.g.a));
                past = past.max((along + along_reach).min(g + g_reach));
                let raised = (along - along_reach).min(g - g_reach);
                if raised > lo {
                    // Half-beams that are not its own may have the larger G there.
                    let leads = |o: &HalfBeam| g - o.g.at(x) - around.reach(sub(s.g.a, o.g.a));
                    let others = hub.half_beams.iter().filter(|o| !std::ptr::eq(*o, s));
                    lo = lo.max(others.map(leads).fold(raised, f64::min));
                }
            }
        }
        hi = hi.max(past);
        let farthest = [0, 1, 2].map(|a| (ball.bounds.min[a] - b.min[a]).max(b.max[a] - ball.bounds.max[a]).max(0.0));
        let apart = self.apart(outer.hub, b);
        if apart > 0.0 {
            lo = lo.max(apart);
        }
        let farthest = dot(farthest, farthest).sqrt();
        if farthest > 0.0 {
            hi = hi.max(farthest);
        }
        // Lengths are computed from squares: a few roundings of the largest.
        let slack = 1e-12 * (1.0 + dot(x, x) / self.scale);
        let within = HubInBox { hub: outer.hub, active, past: past + slack, contains: farthest == 0.0 };
        (within, Interval::new(lo - slack, hi + slack))
    }

    /// Lowers values at positions in a box (at most `MOST_POINTS`, by coordinate) to those of a hub that is simple there.
    /// They are the least of the same values as one by one, to the last bit.
    pub(super) fn lower(&self, within: &HubInBox, points: [&[f64]; 3], least: &mut [f64]) {
        let (ball, hub) = (&self.balls[within.hub as usize], self.hub(within.hub as usize));
        let mut values = [0.0; MOST_POINTS];
        let values = &mut values[..least.len()];
        let square = hub.radius * hub.radius;
        match within.active {
            ActiveInBox::Any => return,
            ActiveInBox::None => self.lengths(ball.center, points, square, values, |_| 0.0),
            ActiveInBox::One(i) => {
                let g = hub.g[i];
                self.lengths(ball.center, points, square, values, |x| {
                    let g = g.at(x);
                    g * g
                });
            }
            ActiveInBox::Two(i, j) => {
                let (p, q, tau) = (hub.g[i], hub.g[j], hub.tau(i, j));
                self.lengths(ball.center, points, square, values, |x| Hub::union_of_two(tau, p.at(x), q.at(x)));
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
            let v = if *v < within.past { hub.past_cut(sub(p, ball.center), *v).0 } else { *v };
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
