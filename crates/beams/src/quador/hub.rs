//! A hub: a ball and the stubs of the beams that meet in it, joined by quadrics.
//!
//! With S = |x|² − r² and G affine and growing along its stub, a stub is S ≤ G². All of them at once are S ≤ N(G), where
//! N(g) = max over y ≥ 0 of 2 y·g − yᵀRy and R is 1 on its diagonal and τ off it. N is convex, once differentiable and a
//! quadratic form on each of finitely many cones, so every piece of the hub is a quadric, every separator a plane, every
//! seam a conic and every join tangent. τ = 1 is the sharp union, where N is the square of the greatest G. Two stubs give
//! the fillet S − (a² − 2τab + b²)/(1 − τ²) of Cirak and Sabin (2019) with τ = (β − α)/(β + α).
//!
//! τ of a pair is the product of a number t of each stub. Then R is always positive definite, and the stubs that shape a
//! point are those with g > tσ, where σ = Σ t (g − tσ)/(1 − t²) over them: one equation for one number.

use geometry::math::{Aabb, Vec3, add, dot, norm, scale, sub};

/// An affine function of the place in a hub's frame: a·x + b.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Affine {
    /// Its gradient.
    pub a: Vec3,
    /// Its value at the hub's centre.
    pub b: f64,
}

impl Affine {
    /// The value at x.
    #[inline]
    pub fn at(&self, x: Vec3) -> f64 {
        dot(self.a, x) + self.b
    }

    /// self + s · o.
    #[inline]
    pub fn plus(&self, s: f64, o: &Affine) -> Affine {
        Affine { a: add(self.a, scale(o.a, s)), b: self.b + s * o.b }
    }
}

/// The half of a beam that belongs to a hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stub {
    /// The beam, and which of its ends is here.
    pub beam: u32,
    /// 0 or 1.
    pub end: usize,
    /// From the hub's centre to the other's.
    pub axis: Vec3,
    /// G = √λ (axis · x − contact).
    pub g: Affine,
    /// Where the contact circle lies along the axis, mm.
    pub contact: f64,
    /// [A, B, C] of ρ² = A z² + B z + C.
    pub section: [f64; 3],
    /// Where the beam is parted between its hubs, along the axis, mm.
    pub split: f64,
    /// How far the hub's own formula is followed beyond, inside the beam, mm.
    pub cut: f64,
    /// t.
    pub share: f64,
    /// 1/(1 − t²).
    pub weight: f64,
}

impl Stub {
    /// ρ² at z.
    #[inline]
    pub fn squared(&self, z: f64) -> f64 {
        let [a, b, c] = self.section;
        (a * z + b) * z + c
    }

    /// Sets t.
    pub fn set_share(&mut self, t: f64) {
        (self.share, self.weight) = (t, 1.0 / ((1.0 - t) * (1.0 + t)));
    }

    /// The greatest radius between the centre and the cut, mm.
    pub fn thickest(&self) -> f64 {
        let [a, b, _] = self.section;
        let ends = self.squared(0.0).max(self.squared(self.cut));
        let top = -b / (2.0 * a);
        if a < 0.0 && top > 0.0 && top < self.cut { ends.max(self.squared(top)) } else { ends }.max(0.0).sqrt()
    }
}

/// A hub with its stubs. Places are relative to its centre.
#[derive(Clone, Copy, Debug)]
pub struct Hub<'a> {
    /// Radius of the ball, mm.
    pub radius: f64,
    /// The stubs.
    pub stubs: &'a [Stub],
    /// Whether stubs meet in creases (τ = 1).
    pub sharp: bool,
}

/// Everything that shapes a hub at one place: N, its gradient, and which stubs it is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grown {
    /// N, mm².
    pub value: f64,
    /// Its gradient, mm.
    pub gradient: Vec3,
    /// A bit for each of the first 64 stubs that N is made of.
    pub active: u64,
}

impl Hub<'_> {
    /// N at x.
    #[inline]
    pub fn grown(&self, x: Vec3) -> Grown {
        if self.sharp {
            let mut best = Grown::default();
            let mut most = 0.0;
            for (i, s) in self.stubs.iter().enumerate() {
                let g = s.g.at(x);
                if g > most {
                    most = g;
                    best = Grown { value: g * g, gradient: scale(s.g.a, 2.0 * g), active: 1 << (i & 63) };
                }
            }
            return best;
        }
        let sigma = self.sigma(x);
        let mut out = Grown::default();
        for (i, s) in self.stubs.iter().enumerate() {
            let g = s.g.at(x);
            let f = g - s.share * sigma;
            if f > 0.0 {
                let y = f * s.weight;
                out.value += y * g;
                out.gradient = add(out.gradient, scale(s.g.a, 2.0 * y));
                out.active |= 1 << (i & 63);
            }
        }
        out
    }

    /// N at x alone.
    #[inline]
    pub fn grown_value(&self, x: Vec3) -> f64 {
        if self.sharp {
            let g = self.stubs.iter().fold(0.0, |m: f64, s| m.max(s.g.at(x)));
            return g * g;
        }
        let sigma = self.sigma(x);
        let mut n = 0.0;
        for s in self.stubs {
            let g = s.g.at(x);
            n += (g - s.share * sigma).max(0.0) * s.weight * g;
        }
        n
    }

    /// σ at x: the root of a convex, falling, piecewise linear function, by Newton's steps from zero, which only rise and
    /// stop when the stubs above t σ no longer change.
    #[inline]
    fn sigma(&self, x: Vec3) -> f64 {
        let (mut sigma, mut count) = (0.0, usize::MAX);
        loop {
            let (mut top, mut bottom, mut n) = (0.0, 1.0, 0);
            for s in self.stubs {
                let g = s.g.at(x);
                if g > s.share * sigma {
                    let w = s.share * s.weight;
                    top += w * g;
                    bottom += w * s.share;
                    n += 1;
                }
            }
            if n >= count || n == 0 {
                return sigma;
            }
            (sigma, count) = (top / bottom, n);
            if n == 1 {
                // A single stub keeps itself: g > t σ always, as t² < 1.
                return sigma;
            }
        }
    }

    /// S − N at x, mm²: negative inside.
    #[inline]
    pub fn value(&self, x: Vec3) -> f64 {
        dot(x, x) - self.radius * self.radius - self.grown_value(x)
    }

    /// S − N at x and its gradient.
    #[inline]
    pub fn gradient(&self, x: Vec3) -> (f64, Vec3) {
        let n = self.grown(x);
        (dot(x, x) - self.radius * self.radius - n.value, sub(scale(x, 2.0), n.gradient))
    }

    /// How far x lies beyond where the hub's formula holds (positive beyond), mm: along the stub that it is nearest to in the
    /// sense of G, or by how much that stub leads.
    #[inline]
    pub fn beyond(&self, x: Vec3) -> (f64, Vec3) {
        let (mut first, mut second) = (0.0, 0.0);
        for s in self.stubs {
            let g = s.g.at(x);
            if g > first {
                (second, first) = (first, g);
            } else if g > second {
                second = g;
            }
        }
        let mut most = (f64::NEG_INFINITY, [0.0; 3]);
        for s in self.stubs {
            let (g, along) = (s.g.at(x), dot(s.axis, x) - s.cut);
            let lead = g - if g == first { second } else { first };
            if along.min(lead) > most.0 {
                most = if along < lead { (along, s.axis) } else { (lead, s.g.a) };
            }
        }
        most
    }

    /// Whether x, relative to the centre, is in the hub's part of the lattice: inside, and before the split of the stub that
    /// leads.
    pub fn holds(&self, x: Vec3) -> bool {
        self.value(x) < 0.0 && self.before_split(x)
    }

    /// Whether x lies before the split of the stub that leads there.
    pub fn before_split(&self, x: Vec3) -> bool {
        let mut first = (0.0, None);
        for s in self.stubs {
            let g = s.g.at(x);
            if g > first.0 {
                first = (g, Some(s));
            }
        }
        first.1.is_none_or(|s| dot(s.axis, x) <= s.split)
    }

    /// A box that holds the hub's part with the stubs up to their cuts: fillets lie in the hull of ball and stubs.
    pub fn bounds(&self) -> Aabb {
        let r = self.radius;
        let mut b = Aabb { min: [-r; 3], max: [r; 3] };
        for s in self.stubs {
            let thick = s.thickest();
            for a in 0..3 {
                let side = thick * (1.0 - s.axis[a] * s.axis[a]).max(0.0).sqrt();
                let end = s.axis[a] * s.cut;
                b.min[a] = b.min[a].min(end.min(0.0) - side);
                b.max[a] = b.max[a].max(end.max(0.0) + side);
            }
        }
        b
    }

    /// A bound of the curvature of N: half its second derivative along any unit vector is at most this.
    pub fn bend(&self) -> f64 {
        if self.sharp {
            return self.stubs.iter().map(|s| dot(s.g.a, s.g.a)).fold(0.0, f64::max);
        }
        let mut m = [[0.0; 3]; 3];
        let (mut sum, mut t) = ([0.0; 3], 1.0);
        let mut tensor = |v: Vec3, w: f64| {
            for i in 0..3 {
                for j in 0..3 {
                    m[i][j] += w * v[i] * v[j];
                }
            }
        };
        for s in self.stubs {
            tensor(s.g.a, s.weight);
            sum = add(sum, scale(s.g.a, s.share * s.weight));
            t += s.share * s.share * s.weight;
        }
        tensor(sum, -1.0 / t);
        geometry::math::spectral_norm(&m)
    }

    /// The middle of the crotch of two stubs, where they would have met in a crease, and the fillet's radius of curvature there
    /// (infinite where it is not hollow); `None` if they do not meet.
    pub fn crotch(&self, i: usize, j: usize, tau: f64) -> Option<(Vec3, f64)> {
        let (p, q) = (&self.stubs[i], &self.stubs[j]);
        let (kp, kq) = (norm(p.g.a), norm(q.g.a));
        let cos = dot(p.axis, q.axis);
        let across = sub(q.axis, scale(p.axis, cos));
        let sin = norm(across);
        if sin < 1e-9 {
            return None;
        }
        let across = scale(across, 1.0 / sin);
        // Where G is g for both: (u, v) = o + g e along the first axis and across it.
        let (o, e) = ([p.contact, (q.contact - cos * p.contact) / sin], [1.0 / kp, (1.0 / kq - cos / kp) / sin]);
        let two = e[0] * e[0] + e[1] * e[1] - 2.0 / (1.0 + tau);
        let (one, none) = (o[0] * e[0] + o[1] * e[1], o[0] * o[0] + o[1] * o[1] - self.radius * self.radius);
        if none >= 0.0 {
            return None;
        }
        let root = one * one - two * none;
        if root < 0.0 {
            return None;
        }
        // The first place outwards where the sign turns: −none / (one + √root) is positive as none < 0.
        let g = -none / (one + root.sqrt());
        if !(g > 0.0 && g.is_finite()) {
            return None;
        }
        let x = [o[0] + g * e[0], o[1] + g * e[1]];
        let (a, b) = ([kp, 0.0], [kq * cos, kq * sin]);
        let y = g / (1.0 + tau);
        let slope = [2.0 * (x[0] - y * (a[0] + b[0])), 2.0 * (x[1] - y * (a[1] + b[1]))];
        let steep = slope[0].hypot(slope[1]);
        let along = [-slope[1] / steep, slope[0] / steep];
        let (ta, tb) = (a[0] * along[0] + a[1] * along[1], b[0] * along[0] + b[1] * along[1]);
        let second = 2.0 - 2.0 * (ta * ta - 2.0 * tau * ta * tb + tb * tb) / (1.0 - tau * tau);
        let radius = if second < 0.0 { -steep / second } else { f64::INFINITY };
        Some((add(scale(p.axis, x[0]), scale(across, x[1])), radius))
    }

    /// Pairs of stubs that meet in a crease or the fillet that fills it.
    pub fn neighbours(&self) -> Vec<(usize, usize)> {
        let mut out = Vec::new();
        for i in 0..self.stubs.len() {
            for j in 0..i {
                let Some((x, _)) = self.crotch(i, j, 1.0 - 1e-12) else {
                    continue;
                };
                let g = self.stubs[i].g.at(x);
                let led = |(k, s): (usize, &Stub)| k != i && k != j && s.g.at(x) > g * (1.0 + 1e-9);
                if !self.stubs.iter().enumerate().any(led) {
                    out.push((j, i));
                }
            }
        }
        out
    }

    /// The least τ for which the fillet of stub i with stub j ends before `z` along stub i and stays away up to its split: the
    /// greatest G_j/G_i there along the side that faces j.
    pub fn least_tau(&self, i: usize, j: usize, z: f64) -> f64 {
        let (p, q) = (&self.stubs[i], &self.stubs[j]);
        let cos = dot(p.axis, q.axis);
        let sin = norm(sub(q.axis, scale(p.axis, cos)));
        let ratio = |z: f64| {
            let rho = p.squared(z).max(0.0).sqrt();
            let g = norm(q.g.a) * (z * cos + rho * sin - q.contact);
            g / (norm(p.g.a) * (z - p.contact))
        };
        let mut most = ratio(z).max(ratio(p.split));
        // Where the ratio is stationary: sin (m z + n) = (d_i cos − d_j) ρ, as (ρ²)'/2 (z − d) − ρ² is linear in z.
        let ([a, b, c], d) = (p.section, p.contact);
        let (m, n) = (sin * (-a * d - b / 2.0), sin * (-b * d / 2.0 - c));
        let w = d * cos - q.contact;
        let (two, one, none) = (m * m - w * w * a, 2.0 * m * n - w * w * b, n * n - w * w * c);
        let root = (one * one - 4.0 * two * none).max(0.0).sqrt();
        let s = -(one + root.copysign(one)) / 2.0;
        for at in [s / two, none / s] {
            if at > z && at < p.split {
                most = most.max(ratio(at));
            }
        }
        most
    }
}
