//! The product of two numbers.

use super::{Grade, VaryingNumber};
use crate::field::Field;
use geometry::math::{Aabb, Interval, Vec3, add, scale};

/// One number times another.
pub struct Product([Grade; 2]);

impl Product {
    /// The product, which is constant where both are.
    pub fn of(a: Grade, b: Grade) -> Grade {
        match (a.constant(), b.constant()) {
            (Some(a), Some(b)) => Grade::Constant(a * b),
            _ => Grade::from(Product([a, b])),
        }
    }
}

impl VaryingNumber for Product {
    fn varies(&self) -> [bool; 3] {
        let [a, b] = self.0.each_ref().map(Grade::varies);
        [0, 1, 2].map(|i| a[i] || b[i])
    }
}

impl Field for Product {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let [a, b] = &self.0;
        let mut other = vec![0.0; points.len()];
        a.values(points, out);
        b.values(points, &mut other);
        out.iter_mut().zip(other).for_each(|(a, b)| *a *= b);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let [a, b] = &self.0;
        let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        a.gradients(points, values, gradients);
        b.gradients(points, &mut v, &mut g);
        for ((va, ga), (vb, gb)) in values.iter_mut().zip(gradients).zip(v.into_iter().zip(g)) {
            *ga = add(scale(*ga, vb), scale(gb, *va));
            *va *= vb;
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let [one, other] = self.0.each_ref().map(|g| g.bound(b));
        one.times(other)
    }
}
