//! Parametrisation of a quadric by projection from one of its own points, the pole A: the line from A through a point B of
//! a plane meets the quadric again in X = Q(B, B) A − 2 Q(A, B) B, with Q the bilinear form in homogeneous coordinates.
//! With B linear in (s, t) this has degree two, so a biquadratic Bézier patch represents it exactly; for a sphere it is
//! stereographic projection. Its inverse is linear in homogeneous coordinates.

use core::f64::consts::TAU;

use geometry::math::{Vec3, add, apply, cross, dot, inverse, norm, scale, sub, unit};

use super::hub_quadric::Quadric;

/// The projection of a quadric from a pole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stereographic {
    /// The quadric.
    pub quadric: Quadric,
    /// The pole A.
    pub pole: Vec3,
    /// The point of the quadric with s = t = 0.
    pub origin: Vec3,
    /// Unit vectors along s and t, parallel to the tangent plane at the pole.
    pub axes: [Vec3; 2],
}

impl Stereographic {
    /// The projection from a pole, with s = t = 0 at a point of the quadric.
    pub(super) fn new(quadric: Quadric, pole: Vec3, origin: Vec3) -> Stereographic {
        let n = unit(quadric.half_gradient(pole));
        let u = perpendicular(n);
        Stereographic { quadric, pole, origin, axes: [u, cross(n, u)] }
    }

    /// The point at (s, t).
    pub(super) fn at(&self, [s, t]: [f64; 2]) -> Vec3 {
        let b = add(self.origin, add(scale(self.axes[0], s), scale(self.axes[1], t)));
        let (bb, ab) = (self.quadric.at(b), 2.0 * self.polar());
        scale(sub(scale(self.pole, bb), scale(b, ab)), 1.0 / (bb - ab))
    }

    /// Q(A, B), constant on the plane.
    fn polar(&self) -> f64 {
        let (q, a) = (&self.quadric, self.pole);
        dot(self.origin, q.half_gradient(a)) + dot(q.b, a) + q.c
    }

    /// (s, t) of a point, and its weight in the projection.
    pub(crate) fn project(&self, x: Vec3) -> ([f64; 2], f64) {
        let n = self.quadric.half_gradient(self.pole);
        let (direction, far) = (sub(x, self.pole), dot(sub(self.origin, self.pole), n));
        let weight = dot(direction, n) / far;
        let b = sub(add(self.pole, scale(direction, 1.0 / weight)), self.origin);
        ([dot(b, self.axes[0]), dot(b, self.axes[1])], weight)
    }

    /// Control points and weights of the biquadratic Bézier patch over ranges [min, max] of s and t, s first.
    pub(crate) fn net(&self, [s, t]: [[f64; 2]; 2]) -> ([[Vec3; 3]; 3], [[f64; 3]; 3]) {
        let (q, [u, v]) = (&self.quadric, self.axes);
        let h = q.half_gradient(self.origin);
        let ab = 2.0 * self.polar();
        // Polar forms of 1, s, s² at the parameter pairs of the control points.
        let blossom = |[a, b]: [f64; 2]| [[1.0, a, a * a], [1.0, (a + b) / 2.0, a * b], [1.0, b, b * b]];
        let (ss, tt) = (blossom(s), blossom(t));
        let mut net = ([[[0.0; 3]; 3]; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let (s, t) = (ss[i], tt[j]);
                let bb = q.at(self.origin)
                    + 2.0 * (s[1] * dot(h, u) + t[1] * dot(h, v))
                    + s[2] * q.form(u, u)
                    + 2.0 * s[1] * t[1] * q.form(u, v)
                    + t[2] * q.form(v, v);
                let b = add(self.origin, add(scale(u, s[1]), scale(v, t[1])));
                net.1[i][j] = bb - ab;
                net.0[i][j] = scale(sub(scale(self.pole, bb), scale(b, ab)), 1.0 / (bb - ab));
            }
        }
        net
    }
}

/// A unit vector perpendicular to a unit vector.
fn perpendicular(n: Vec3) -> Vec3 {
    unit(cross(n, if n[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }))
}

/// Points of a quadric opposite one of its points, from which a face around that point may be projected: across the
/// quadric's centre, across the hub, along the normal, and near there.
pub(super) fn opposite_poles(quadric: &Quadric, origin: Vec3) -> impl Iterator<Item = Vec3> {
    let q = *quadric;
    let normal = unit(q.half_gradient(origin));
    let u = perpendicular(normal);
    let v = cross(normal, u);
    let middle = scale(apply(&inverse(&q.m), q.b), -1.0);
    let normal = scale(normal, -1.0);
    let inward = [sub(middle, origin), unit(scale(origin, -1.0)), normal];
    let tilts = (0..8).flat_map(move |k| {
        let (sin, cos) = (TAU * f64::from(k) / 8.0).sin_cos();
        [0.3, 0.8, 2.0].map(|by| add(normal, scale(add(scale(u, cos), scale(v, sin)), by)))
    });
    inward.into_iter().chain(tilts).filter_map(move |direction| {
        // The origin is one root; this is the other.
        let t = -2.0 * dot(q.half_gradient(origin), direction) / q.form(direction, direction);
        let pole = add(origin, scale(direction, t));
        (t.is_finite() && norm(pole) < 1e6 * norm(origin)).then_some(pole)
    })
}
