//! Affine functions of the position, such as the G of half-beams.

use geometry::math::{Vec3, add, dot, scale};

/// An affine function of the position x in a hub's frame: a·x + b.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AffineFunction {
    /// Gradient a.
    pub a: Vec3,
    /// Value b at the hub's centre.
    pub b: f64,
}

impl AffineFunction {
    /// The value at x.
    #[inline]
    pub(crate) fn at(&self, x: Vec3) -> f64 {
        dot(self.a, x) + self.b
    }

    /// self + s · o.
    #[inline]
    pub(crate) fn plus(&self, s: f64, o: &AffineFunction) -> AffineFunction {
        AffineFunction { a: add(self.a, scale(o.a, s)), b: self.b + s * o.b }
    }
}

/// The first of the largest values, if one is positive, and that value.
#[inline]
pub(super) fn largest(g: &[f64]) -> (usize, f64) {
    let (mut first, mut most) = (0, 0.0);
    for (i, g) in g.iter().enumerate() {
        if *g > most {
            (first, most) = (i, *g);
        }
    }
    (first, most)
}
