//! The complement of a number: 1 − value.

use super::VaryingNumber;
use crate::field::Field;
use geometry::math::{Aabb, Interval, Vec3, scale};

/// One less a number.
pub(super) struct Complement<V>(pub V);

impl<V: VaryingNumber> VaryingNumber for Complement<V> {
    fn varies(&self) -> [bool; 3] {
        self.0.varies()
    }

    fn likely_extreme(&self, b: &Aabb) -> Vec3 {
        self.0.likely_extreme(b)
    }
}

impl<V: VaryingNumber> Field for Complement<V> {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
        out.iter_mut().for_each(|v| *v = 1.0 - *v);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v = 1.0 - *v);
        gradients.iter_mut().for_each(|g| *g = scale(*g, -1.0));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let r = self.0.bound(b);
        Interval::new(1.0 - r.hi, 1.0 - r.lo)
    }
}
