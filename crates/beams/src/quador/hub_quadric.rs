//! Quadrics in a hub's frame.

use geometry::math::{Mat3, Vec3, add, apply, determinant, dot, inverse, scale};

use super::hub::{AffineFunction, Hub};

/// The quadratic function x ↦ xᵀMx + 2 b·x + c.
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
    pub fn half_gradient(&self, x: Vec3) -> Vec3 {
        add(apply(&self.m, x), self.b)
    }

    /// uᵀMv.
    #[inline]
    pub fn form(&self, u: Vec3, v: Vec3) -> f64 {
        dot(u, apply(&self.m, v))
    }

    /// Adds w g².
    pub(crate) fn add_square(&mut self, w: f64, g: &AffineFunction) {
        for i in 0..3 {
            for j in 0..3 {
                self.m[i][j] += w * g.a[i] * g.a[j];
            }
            self.b[i] += w * g.a[i] * g.b;
        }
        self.c += w * g.b * g.b;
    }

    /// The factor t > 0 at which the ray t p from the hub's centre leaves the quadric; infinite if it does not.
    #[inline]
    pub fn ray_exit(&self, p: Vec3) -> f64 {
        let (one, two) = (dot(self.b, p), self.form(p, p));
        // c < 0 at the centre: the larger of the two roots 1/t is the first exit.
        -self.c / (one + (one * one - self.c * two).max(0.0).sqrt())
    }

    /// The points whose normals are parallel to a coordinate axis, two each; `None` on cylinders and paraboloids, which
    /// may have none.
    pub(super) fn axis_extremes(&self) -> Option<[Vec3; 6]> {
        let size = self.m.iter().flatten().fold(0.0f64, |a, v| a.max(v.abs()));
        if determinant(&self.m).abs() < 1e-9 * size.powi(3) {
            return None;
        }
        let inverse = inverse(&self.m);
        let middle = scale(apply(&inverse, self.b), -1.0);
        // Mx + b = s e with Q = 0; NaN where no point has that normal.
        let rest = -self.at(middle);
        Some(core::array::from_fn(|k| {
            let a = k / 2;
            let s = (rest / inverse[a][a]).sqrt() * if k % 2 == 0 { 1.0 } else { -1.0 };
            add(middle, scale(inverse[a], s))
        }))
    }

    /// Distance along n from p to the nearer intersection with the quadric; NaN if there is none.
    #[inline]
    pub fn intersection_along(&self, p: Vec3, n: Vec3) -> f64 {
        let (none, one, two) = (self.at(p), dot(self.half_gradient(p), n), self.form(n, n));
        -none / (one + (one * one - two * none).sqrt().copysign(one))
    }
}

/// The quadric of a hub where exactly the half-beams of `label` are active, and σ.
pub(super) fn piece_quadric(hub: &Hub, label: u64) -> (Quadric, AffineFunction) {
    let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.0; 3], c: -hub.radius * hub.radius };
    let (mut sigma, mut t) = (AffineFunction::default(), 1.0);
    for (i, s) in hub.half_beams.iter().enumerate() {
        if label >> i & 1 == 0 {
            continue;
        }
        if hub.sharp {
            q.add_square(-1.0, &s.g);
        } else {
            q.add_square(-s.weight, &s.g);
            sigma = sigma.plus(s.blend * s.weight, &s.g);
            t += s.blend * s.blend * s.weight;
        }
    }
    if !hub.sharp {
        q.add_square(1.0 / t, &sigma);
        sigma = AffineFunction::default().plus(1.0 / t, &sigma);
    }
    (q, sigma)
}
