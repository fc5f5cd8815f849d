//! The lattice as a field: the least of its hubs, each a length made of S − N.
//!
//! A hub's formula follows its beams past their splits, where the other hub's formula agrees with it (one quadric touches
//! both balls), so the least of all has no seam there. Further on it is held up by how far a point lies beyond.

use super::Quadors;
use geometry::math::{Aabb, Interval, Vec3, dot, scale, sub};

/// Hubs that the bound of a box looks at one by one.
const MOST: usize = 96;

impl Quadors {
    /// A length for S − N: ρ − a around a cylinder of the typical radius a; outside never more than it grows, inside
    /// proportional, as a square root would not be smooth.
    #[inline]
    fn length(&self, q: f64) -> f64 {
        if q < 0.0 { q / (2.0 * self.scale) } else { q / ((q + self.scale * self.scale).sqrt() + self.scale) }
    }

    #[inline]
    fn at(&self, p: Vec3) -> f64 {
        let mut least = self.cap;
        for &i in self.index.near(p) {
            let ball = &self.balls[i as usize];
            let away = ball.bounds.distance(p);
            if away > 0.0 && away >= least {
                continue;
            }
            let hub = self.hub(i as usize);
            let x = sub(p, ball.center);
            let mut v = self.length(hub.value(x));
            if away > 0.0 {
                v = v.max(away);
            }
            if v < least {
                least = least.min(v.max(hub.beyond(x).0));
            }
        }
        least
    }

    fn slope_at(&self, p: Vec3) -> (f64, Vec3) {
        let mut least = (self.cap, [0.0; 3]);
        for &i in self.index.near(p) {
            let ball = &self.balls[i as usize];
            let away = ball.bounds.distance(p);
            if away > 0.0 && away >= least.0 {
                continue;
            }
            let hub = self.hub(i as usize);
            let x = sub(p, ball.center);
            let (q, g) = hub.gradient(x);
            let steep = if q < 0.0 { self.scale } else { (q + self.scale * self.scale).sqrt() };
            let mut here = (self.length(q), scale(g, 0.5 / steep));
            let beyond = hub.beyond(x);
            if beyond.0 > here.0 {
                here = beyond;
            }
            if away > 0.0 && away > here.0 {
                let out =
                    [0, 1, 2].map(|a| (p[a] - ball.bounds.max[a]).max(0.0) - (ball.bounds.min[a] - p[a]).max(0.0));
                here = (away, scale(out, 1.0 / away));
            }
            if here.0 < least.0 {
                least = here;
            }
        }
        least
    }

    /// Whether a point is in the solid: in the part of some hub.
    pub fn contains(&self, p: Vec3) -> bool {
        self.index.near(p).iter().any(|&i| {
            let ball = &self.balls[i as usize];
            ball.bounds.distance(p) == 0.0 && self.hub(i as usize).holds(sub(p, ball.center))
        })
    }

    /// A hub's share of the field at a point: the field is the least of them and the cap.
    pub(crate) fn share(&self, i: usize, p: Vec3) -> f64 {
        let ball = &self.balls[i];
        let (hub, x) = (self.hub(i), sub(p, ball.center));
        let v = self.length(hub.value(x)).max(hub.beyond(x).0);
        match ball.bounds.distance(p) {
            away if away > 0.0 => v.max(away),
            _ => v,
        }
    }

    /// The box that holds a hub and its stubs up to their cuts.
    pub fn hold(&self, i: usize) -> Aabb {
        self.balls[i].bounds
    }

    /// The range of a hub's share of the field over a box.
    pub(crate) fn hub_bound(&self, i: usize, b: &Aabb) -> Interval {
        let ball = &self.balls[i];
        let hub = self.hub(i);
        let half = scale(b.size(), 0.5);
        let x = sub(b.center(), ball.center);
        let h2 = dot(half, half);
        let reach = |g: Vec3| g[0].abs() * half[0] + g[1].abs() * half[1] + g[2].abs() * half[2];
        let (q, g) = hub.gradient(x);
        // N is convex: S − N lies below its tangent plus |δ|². Its second derivative is at most 2 bend.
        let hi = q + reach(g) + h2;
        let lo = if hub.sharp {
            let s = dot(x, x) - ball.radius * ball.radius;
            let ball_lo = s - reach(scale(x, 2.0));
            hub.stubs.iter().fold(ball_lo, |lo, stub| {
                let g = stub.g.at(x);
                if g + reach(stub.g.a) <= 0.0 {
                    return lo;
                }
                let slope = sub(scale(x, 2.0), scale(stub.g.a, 2.0 * g));
                let bend = (dot(stub.g.a, stub.g.a) - 1.0).max(0.0);
                lo.min(s - g * g - reach(slope) - bend * h2)
            })
        } else {
            q - reach(g) - (ball.bend - 1.0).max(0.0) * h2
        };
        let (mut lo, mut hi) = (self.length(lo), self.length(hi));
        let past = hub.stubs.iter().fold(f64::NEG_INFINITY, |m: f64, s| {
            let along = dot(s.axis, x) + reach(s.axis) - s.cut;
            m.max(along.min(s.g.at(x) + reach(s.g.a)))
        });
        hi = hi.max(past);
        let apart = [0, 1, 2].map(|a| (ball.bounds.min[a] - b.max[a]).max(b.min[a] - ball.bounds.max[a]).max(0.0));
        let farthest = [0, 1, 2].map(|a| (ball.bounds.min[a] - b.min[a]).max(b.max[a] - ball.bounds.max[a]).max(0.0));
        let apart = dot(apart, apart).sqrt();
        if apart > 0.0 {
            lo = lo.max(apart);
        }
        let farthest = dot(farthest, farthest).sqrt();
        if farthest > 0.0 {
            hi = hi.max(farthest);
        }
        // Lengths come from squares: a few roundings of the largest.
        let slack = 1e-12 * (1.0 + dot(x, x) / self.scale);
        Interval::new(lo - slack, hi + slack)
    }
}

impl Quadors {
    /// Fills the field at points (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, &p) in out.iter_mut().zip(points) {
            *o = self.at(p);
        }
    }

    /// Fills the field and its gradient (per mm) at points (mm).
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), &p) in values.iter_mut().zip(gradients).zip(points) {
            (*v, *g) = self.slope_at(p);
        }
    }

    /// An interval that contains the field over the box. Proven.
    pub fn bound(&self, b: &Aabb) -> Interval {
        let Some(near) = self.index.touching(b, MOST) else {
            return Interval::new(f64::NEG_INFINITY, self.cap);
        };
        let cap = Interval::new(self.cap, self.cap);
        near.into_iter().fold(cap, |least, i| least.min(self.hub_bound(i as usize, b)))
    }

    /// The field at one point (mm).
    pub fn value(&self, p: Vec3) -> f64 {
        self.at(p)
    }

    /// Whether its zero set may have creases: hubs without fillets have.
    pub fn has_creases(&self) -> bool {
        self.sharp
    }

    /// A Lipschitz bound of the field, per mm.
    pub fn lipschitz(&self) -> f64 {
        let thick = self.balls.iter().map(|b| b.radius).fold(self.scale, f64::max);
        2.0 * thick / self.scale
    }
}
