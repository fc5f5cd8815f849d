//! A solid: a field and a region.

use std::sync::Arc;

use crate::field::Field;
use crate::math::{Aabb, Interval, Vec3};
use crate::region::Region;

/// What a design means: the part of the region in which the field is negative.
#[derive(Clone)]
pub struct Solid {
    /// Where the part may be.
    pub region: Region,
    /// The lattice; `None` leaves the region full.
    pub field: Option<Arc<dyn Field>>,
    /// The smallest wavelength (mm); grid spacings are given by it.
    pub wavelength: f64,
}

impl Field for Solid {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let _ = (points, out);
        todo!()
    }
    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let _ = (points, values, gradients);
        todo!()
    }
    fn bound(&self, b: &Aabb) -> Interval {
        let _ = b;
        todo!()
    }
}
