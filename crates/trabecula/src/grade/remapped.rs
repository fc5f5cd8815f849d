//! Numbers on a grid, each replaced by what it stands for.

use super::{Samples, Stops, Varying};
use crate::field::Field;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, scale};

/// Piecewise linear in numbers on a grid, constant beyond the first and last stop.
pub struct Remapped {
    of: Samples,
    stops: Stops,
}

impl Remapped {
    /// The numbers, and stops `[number, value]`.
    ///
    /// # Errors
    /// Stops that are none, not finite or not ascending in the number.
    pub fn new(of: Samples, stops: Vec<[f64; 2]>) -> Result<Remapped, Fault> {
        Ok(Remapped { of, stops: Stops::new(stops, "number")? })
    }
}

impl Field for Remapped {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.stops.at(self.of.at(*p).0).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let (number, gradient) = self.of.at(*p);
            let (value, slope) = self.stops.at(number);
            (*v, *g) = (value, scale(gradient, slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.stops.range(self.of.bound(b))
    }
}

impl Varying for Remapped {}
