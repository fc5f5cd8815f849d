//! A grade, each number mapped by a piecewise linear function.

use super::{Grade, Quantity, Samples, Stops, VaryingNumber};
use crate::field::Field;
use crate::kind::DesignError;
use geometry::math::{Aabb, Interval, Vec3, scale};

/// Piecewise linear in the numbers of a grade, constant beyond the first and last stop.
pub struct Remapped {
    of: Grade,
    stops: Stops,
}

impl Remapped {
    /// The numbers, and checked stops `[number, value]`.
    pub fn new(of: impl Into<Grade>, stops: Stops) -> Remapped {
        Remapped { of: of.into(), stops }
    }
}

/// The grade of samples.
pub(super) fn sampled(samples: Samples, remap: &Option<Stops>, of: &Quantity) -> Result<Grade, DesignError> {
    let stops = match (remap, of.complement) {
        (None, false) => return of.checked(samples),
        (None, true) => {
            let r = samples.bound(&Aabb::ALL);
            // One stop would do where all numbers are the same.
            Stops(vec![[r.lo, r.lo], [r.hi.max(r.lo + 1.0), r.hi.max(r.lo + 1.0)]])
        }
        (Some(stops), _) => stops.clone(),
    };
    of.checked(Remapped::new(samples, of.stops(stops)))
}

impl Field for Remapped {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.of.values(points, out);
        out.iter_mut().for_each(|v| *v = self.stops.at(*v).0);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.of.gradients(points, values, gradients);
        for (v, g) in values.iter_mut().zip(gradients) {
            let (value, slope) = self.stops.at(*v);
            (*v, *g) = (value, scale(*g, slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.stops.range(self.of.bound(b))
    }
}

impl VaryingNumber for Remapped {
    fn varies(&self) -> [bool; 3] {
        self.of.varies()
    }

    fn likely_extreme(&self, b: &Aabb) -> Vec3 {
        self.of.likely_extreme(b)
    }
}
