//! Conics: plane sections of quadrics, parametrised by an angle.

use geometry::math::{Vec3, add, dot, scale, sub};

use super::hub_quadric::Quadric;

/// An arc of a conic from one of its points v, parametrised by the angle θ between the tangent at v and the line from v
/// to the point.
///
/// X(θ) = v − q sinθ (cosθ e₁ + sinθ e₂)/(m₁₁ cos² + 2 m₁₂ sin cos + m₂₂ sin²). On a circle θ is half the arc angle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Conic {
    /// Start point v.
    pub v: Vec3,
    /// Unit tangent at v, and the unit vector normal to it in the plane.
    pub e: [Vec3; 2],
    /// Derivative of the quadric function along e₂ at v.
    pub q: f64,
    /// The quadratic form in the plane: m₁₁, m₁₂, m₂₂.
    pub m: [f64; 3],
    /// Angle at the end; π if the conic is closed.
    pub end: f64,
}

impl Conic {
    /// The conic of a quadric in the plane normal to `normal`, from a common point `v` along `tangent`; `None` where it
    /// is a straight line.
    pub(crate) fn new(q: &Quadric, normal: Vec3, v: Vec3, tangent: Vec3) -> Option<Conic> {
        let m11 = q.form(tangent, tangent);
        let mut e2 = geometry::math::cross(normal, tangent);
        let mut slope = 2.0 * dot(q.half_gradient(v), e2);
        // Increasing θ moves along +e₁: −q/m₁₁ > 0.
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

    /// The point at θ.
    #[inline]
    pub(crate) fn at(&self, theta: f64) -> Vec3 {
        let (s, c) = theta.sin_cos();
        let f = -self.q * s / (self.m[0] * c * c + 2.0 * self.m[1] * s * c + self.m[2] * s * s);
        add(self.v, add(scale(self.e[0], f * c), scale(self.e[1], f * s)))
    }

    /// The point at θ and its derivative.
    #[inline]
    pub(crate) fn with_derivative(&self, theta: f64) -> (Vec3, Vec3) {
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

    /// The angle of the line from v to a point of the plane, in [0, π).
    pub(crate) fn angle_of(&self, x: Vec3) -> f64 {
        let by = sub(x, self.v);
        angle(dot(by, self.e[1]), dot(by, self.e[0]))
    }

    /// The angles in (0, π), in order, at which an affine function of the plane vanishes, given its value at v and its
    /// derivatives along e₁, e₂. With `zero` the function vanishes at v, and that root is excluded.
    pub(crate) fn roots(&self, f: [f64; 3], zero: bool) -> impl Iterator<Item = f64> {
        let f0 = if zero { 0.0 } else { f[0] };
        let c = [f0 * self.m[0], 2.0 * f0 * self.m[1] - self.q * f[1], f0 * self.m[2] - self.q * f[2]];
        let found = if zero { [angle(-c[1], c[2]), f64::NAN] } else { angles(c) };
        let (a, b) = (found[0].min(found[1]), found[0].max(found[1]));
        let keep = move |t: &f64| *t > 0.0 && *t < core::f64::consts::PI;
        [a, if found[0].is_nan() || found[1].is_nan() { f64::NAN } else { b }].into_iter().filter(keep)
    }

    /// The cotangent of the first angle of `roots`; it decreases from ∞ at 0 to −∞ at π; −∞ if there is none.
    #[inline]
    pub(crate) fn first_root_cotangent(&self, f: [f64; 3], zero: bool) -> f64 {
        let f0 = if zero { 0.0 } else { f[0] };
        largest_root([f0 * self.m[0], 2.0 * f0 * self.m[1] - self.q * f[1], f0 * self.m[2] - self.q * f[2]])
    }

    /// The cotangent of the angle of `asymptote`, −∞ if there is none.
    pub(crate) fn asymptote_cotangent(&self) -> f64 {
        largest_root([self.m[0], 2.0 * self.m[1], self.m[2]])
    }

    /// The first angle at which the conic runs to infinity.
    pub(crate) fn asymptote(&self) -> Option<f64> {
        let [a, b] = angles([self.m[0], 2.0 * self.m[1], self.m[2]]);
        let t = a.min(b);
        (t > 0.0).then_some(t)
    }
}

/// Part of a conic, parametrised by t in [0, 1] in its plane: the direction of the line through v is interpolated
/// linearly.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConicPart {
    q: f64,
    m: [f64; 3],
    from: [f64; 2],
    by: [f64; 2],
}

impl ConicPart {
    /// The point, as coordinates along e₁ and e₂ from v, and its derivative.
    #[inline(always)]
    pub(super) fn at(&self, t: f64) -> ([f64; 2], [f64; 2]) {
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
    /// The part between two angles less than π apart.
    pub(super) fn part(&self, from: f64, to: f64) -> ConicPart {
        let ((s, c), (s1, c1)) = (from.sin_cos(), to.sin_cos());
        ConicPart { q: self.q, m: self.m, from: [c, s], by: [c1 - c, s1 - s] }
    }

    /// A vector of the plane in space.
    #[inline(always)]
    pub(super) fn in_space(&self, [x, y]: [f64; 2]) -> Vec3 {
        add(scale(self.e[0], x), scale(self.e[1], y))
    }
}

/// The angle in [0, π) with tangent s/c.
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

/// The largest finite root of c₀x² + c₁x + c₂; −∞ if there is none.
fn largest_root([c0, c1, c2]: [f64; 3]) -> f64 {
    let square = c1 * c1 - 4.0 * c0 * c2;
    if square < 0.0 {
        return f64::NEG_INFINITY;
    }
    let q = -(c1 + square.sqrt().copysign(c1)) / 2.0;
    let finite = |x: f64| if x.is_finite() { x } else { f64::NEG_INFINITY };
    finite(q / c0).max(finite(c2 / q))
}

/// The angles at which c₀ cos² + c₁ sin cos + c₂ sin² vanishes; NaN if there are none.
fn angles([c0, c1, c2]: [f64; 3]) -> [f64; 2] {
    let square = c1 * c1 - 4.0 * c0 * c2;
    if square < 0.0 {
        return [f64::NAN; 2];
    }
    let q = -(c1 + square.sqrt().copysign(c1)) / 2.0;
    [angle(q, c2), angle(c0, q)]
}
