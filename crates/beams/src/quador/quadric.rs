//! Quadrics, and the conics that planes cut out of them.

use geometry::math::{Mat3, Vec3, add, apply, determinant, dot, inverse, scale};

use super::hub::{Affine, Hub};

/// x ↦ xᵀMx + 2 b·x + c.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quadric {
    /// M, symmetric.
    pub m: Mat3,
    /// b.
    pub b: Vec3,
    /// c.
    pub c: f64,
}

impl Quadric {
    /// The value at x.
    #[inline]
    pub fn at(&self, x: Vec3) -> f64 {
        dot(x, add(apply(&self.m, x), scale(self.b, 2.0))) + self.c
    }

    /// Half the gradient at x.
    #[inline]
    pub fn half_slope(&self, x: Vec3) -> Vec3 {
        add(apply(&self.m, x), self.b)
    }

    /// uᵀMv.
    #[inline]
    pub fn form(&self, u: Vec3, v: Vec3) -> f64 {
        dot(u, apply(&self.m, v))
    }

    /// Adds w g².
    pub fn square(&mut self, w: f64, g: &Affine) {
        for i in 0..3 {
            for j in 0..3 {
                self.m[i][j] += w * g.a[i] * g.a[j];
            }
            self.b[i] += w * g.a[i] * g.b;
        }
        self.c += w * g.b * g.b;
    }

    /// The factor t > 0 that takes a point out of the hub's centre to the surface, t p; infinite where there is none.
    #[inline]
    pub fn exit(&self, p: Vec3) -> f64 {
        let (one, two) = (dot(self.b, p), self.form(p, p));
        // c < 0 at the centre: of the two roots 1/t the greater is the first exit.
        -self.c / (one + (one * one - self.c * two).max(0.0).sqrt())
    }

    /// The places whose normals are along an axis, both ways; `None` on cylinders and paraboloids, which need not have them.
    pub(super) fn extremes(&self) -> Option<[Vec3; 6]> {
        let size = self.m.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
        if determinant(&self.m).abs() < 1e-9 * size.powi(3) {
            return None;
        }
        let inverse = inverse(&self.m);
        let middle = scale(apply(&inverse, self.b), -1.0);
        // Mx + b = s e with Q = 0; NaN where no place has that normal.
        let rest = -self.at(middle);
        Some(core::array::from_fn(|k| {
            let a = k / 2;
            let s = (rest / inverse[a][a]).sqrt() * if k % 2 == 0 { 1.0 } else { -1.0 };
            add(middle, scale(inverse[a], s))
        }))
    }

    /// How far along n from p the nearer of the two places on the quadric lies; NaN if there is none.
    #[inline]
    pub fn along(&self, p: Vec3, n: Vec3) -> f64 {
        let (none, one, two) = (self.at(p), dot(self.half_slope(p), n), self.form(n, n));
        -none / (one + (one * one - two * none).sqrt().copysign(one))
    }
}

/// What a hub is made of where the stubs of `label` are active: its quadric, and σ.
pub fn piece(hub: &Hub, label: u64) -> (Quadric, Affine) {
    let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.0; 3], c: -hub.radius * hub.radius };
    let (mut sigma, mut t) = (Affine::default(), 1.0);
    for (i, s) in hub.stubs.iter().enumerate() {
        if label >> i & 1 == 0 {
            continue;
        }
        if hub.sharp {
            q.square(-1.0, &s.g);
        } else {
            q.square(-s.weight, &s.g);
            sigma = sigma.plus(s.share * s.weight, &s.g);
            t += s.share * s.share * s.weight;
        }
    }
    if !hub.sharp {
        q.square(1.0 / t, &sigma);
        sigma = Affine::default().plus(1.0 / t, &sigma);
    }
    (q, sigma)
}

/// An arc of a conic: from a place on it, by the angle θ of the lines through that place, from its tangent on.
///
/// X(θ) = v − q sinθ (cosθ e₁ + sinθ e₂)/(m₁₁ cos² + 2 m₁₂ sin cos + m₂₂ sin²). On a circle θ is half the arc.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conic {
    /// Where it starts.
    pub v: Vec3,
    /// The tangent there, and its normal in the plane.
    pub e: [Vec3; 2],
    /// Derivative of the quadric along e₂, at v.
    pub q: f64,
    /// The form in the plane: m₁₁, m₁₂, m₂₂.
    pub m: [f64; 3],
    /// Where it ends; π if it closes.
    pub end: f64,
}

impl Conic {
    /// The conic of a quadric in the plane normal to `normal`, from `v`, which lies on both, along `tangent`; `None` where it is
    /// a straight line.
    pub fn new(q: &Quadric, normal: Vec3, v: Vec3, tangent: Vec3) -> Option<Conic> {
        let m11 = q.form(tangent, tangent);
        let mut e2 = geometry::math::cross(normal, tangent);
        let mut slope = 2.0 * dot(q.half_slope(v), e2);
        // Growing θ moves along +e₁: −q/m₁₁ > 0.
        if slope * m11 > 0.0 {
            (e2, slope) = (scale(e2, -1.0), -slope);
        }
        let m = [m11, q.form(tangent, e2), q.form(e2, e2)];
        let size = m[1].abs() + m[2].abs();
        (m11.abs() > 1e-13 * size && slope != 0.0).then_some(Conic {
            v,
            e: [tangent, e2],
            q: slope,
            m,
            end: core::f64::consts::PI,
        })
    }

    /// The place at θ.
    #[inline]
    pub fn at(&self, theta: f64) -> Vec3 {
        let (s, c) = theta.sin_cos();
        let f = -self.q * s / (self.m[0] * c * c + 2.0 * self.m[1] * s * c + self.m[2] * s * s);
        add(self.v, add(scale(self.e[0], f * c), scale(self.e[1], f * s)))
    }

    /// The place at θ and its derivative.
    #[inline]
    pub fn with_slope(&self, theta: f64) -> (Vec3, Vec3) {
        let (s, c) = theta.sin_cos();
        let d = self.m[0] * c * c + 2.0 * self.m[1] * s * c + self.m[2] * s * s;
        let dd = 2.0 * ((self.m[2] - self.m[0]) * s * c + self.m[1] * (c * c - s * s));
        let f = -self.q / d;
        let g = f * dd / d;
        let at = add(self.v, add(scale(self.e[0], f * s * c), scale(self.e[1], f * s * s)));
        let slope =
            add(scale(self.e[0], f * (c * c - s * s) - g * s * c), scale(self.e[1], 2.0 * f * s * c - g * s * s));
        (at, slope)
    }

    /// The angles in (0, π) where a function of the plane vanishes, given its value at v and its derivatives along e₁, e₂,
    /// in order. With `zero` the start itself, where the function is known to vanish, is not among them.
    pub fn roots(&self, f: [f64; 3], zero: bool) -> impl Iterator<Item = f64> {
        let f0 = if zero { 0.0 } else { f[0] };
        let c = [f0 * self.m[0], 2.0 * f0 * self.m[1] - self.q * f[1], f0 * self.m[2] - self.q * f[2]];
        let found = if zero { [angle(-c[1], c[2]), f64::NAN] } else { angles(c) };
        let (a, b) = (found[0].min(found[1]), found[0].max(found[1]));
        let keep = move |t: &f64| *t > 0.0 && *t < core::f64::consts::PI;
        [a, if found[0].is_nan() || found[1].is_nan() { f64::NAN } else { b }].into_iter().filter(keep)
    }

    /// The cotangent of the first angle of `roots`, which falls from ∞ at 0 to −∞ at π; −∞ if there is none.
    #[inline]
    pub fn first(&self, f: [f64; 3], zero: bool) -> f64 {
        let f0 = if zero { 0.0 } else { f[0] };
        greatest([f0 * self.m[0], 2.0 * f0 * self.m[1] - self.q * f[1], f0 * self.m[2] - self.q * f[2]])
    }

    /// The cotangent of `open`, −∞ if there is none.
    pub fn opening(&self) -> f64 {
        greatest([self.m[0], 2.0 * self.m[1], self.m[2]])
    }

    /// Where it first runs to infinity.
    pub fn open(&self) -> Option<f64> {
        let [a, b] = angles([self.m[0], 2.0 * self.m[1], self.m[2]]);
        let t = a.min(b);
        (t > 0.0).then_some(t)
    }
}

/// Part of a conic by a number of 0 to 1, in its plane: the line through the start turns from one place to the other as its direction
/// goes straight from one to the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    q: f64,
    m: [f64; 3],
    from: [f64; 2],
    by: [f64; 2],
}

impl Run {
    /// The place, along e₁ and e₂ from v, and its derivative.
    #[inline(always)]
    pub fn at(&self, t: f64) -> ([f64; 2], [f64; 2]) {
        let ([dc, ds], [m11, m12, m22]) = (self.by, self.m);
        let (c, s) = (self.from[0] + t * dc, self.from[1] + t * ds);
        let d = m11 * c * c + 2.0 * m12 * s * c + m22 * s * s;
        let dd = 2.0 * (m11 * c * dc + m12 * (s * dc + c * ds) + m22 * s * ds);
        let over = 1.0 / d;
        let f = -self.q * over;
        let g = f * dd * over;
        let slope = [f * (ds * c + s * dc) - g * s * c, s * (2.0 * f * ds - g * s)];
        ([f * s * c, f * s * s], slope)
    }
}

impl Conic {
    /// The part between two angles less than half a turn apart.
    pub(super) fn run(&self, from: f64, to: f64) -> Run {
        let ((s, c), (s1, c1)) = (from.sin_cos(), to.sin_cos());
        Run { q: self.q, m: self.m, from: [c, s], by: [c1 - c, s1 - s] }
    }

    /// A vector of the plane.
    #[inline(always)]
    pub(super) fn plane(&self, [x, y]: [f64; 2]) -> Vec3 {
        add(scale(self.e[0], x), scale(self.e[1], y))
    }
}

/// atan(s/c) in [0, π).
fn angle(s: f64, c: f64) -> f64 {
    let t = s.atan2(c);
    if t < 0.0 {
        t + core::f64::consts::PI
    } else if t >= core::f64::consts::PI {
        0.0
    } else {
        t
    }
}

/// The greatest finite root of c₀x² + c₁x + c₂; −∞ if there is none.
fn greatest([c0, c1, c2]: [f64; 3]) -> f64 {
    let square = c1 * c1 - 4.0 * c0 * c2;
    if square < 0.0 {
        return f64::NEG_INFINITY;
    }
    let q = -(c1 + square.sqrt().copysign(c1)) / 2.0;
    let finite = |x: f64| if x.is_finite() { x } else { f64::NEG_INFINITY };
    finite(q / c0).max(finite(c2 / q))
}

/// The angles at which c₀ cos² + c₁ sin cos + c₂ sin² vanishes.
fn angles([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    let square = c1 * c1 - 4.0 * c0 * c2;
    if square < 0.0 {
        return [f64::NAN; 2];
    }
    let q = -(c1 + square.sqrt().copysign(c1)) / 2.0;
    [angle(q, c2), angle(c0, q)]
}
