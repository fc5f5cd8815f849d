//! A number that may vary in space.

use crate::field::Field;
use crate::math::{Aabb, Interval, Vec3};
use std::sync::Arc;

mod formula;
pub use formula::Formula;

/// A number that may vary in space. Its unit is that of the key it stands under.
#[derive(Clone)]
pub enum Grade {
    /// The same everywhere.
    Constant(f64),
    /// Piecewise linear in s = along · x (mm), constant beyond the first and last stop.
    Linear {
        /// Direction; s is measured in multiples of its length.
        along: Vec3,
        /// (s, value), s ascending.
        stops: Vec<[f64; 2]>,
    },
    /// Piecewise linear in the depth (mm) below the surface of a region, constant beyond the stops.
    Depth {
        /// Signed distance of the region, negative inside.
        region: Arc<dyn Field>,
        /// (depth, value), depth ascending.
        stops: Vec<[f64; 2]>,
    },
    /// A formula in x, y, z (mm).
    Formula(Formula),
}

impl Grade {
    /// The value everywhere, if it does not vary.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Grade::Constant(v) => Some(*v),
            _ => None,
        }
    }

    /// Fills `out[i]` with the value at `points[i]` (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let _ = (points, out);
        todo!()
    }

    /// Fills values and gradients (per mm).
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let _ = (points, values, gradients);
        todo!()
    }

    /// An interval that contains every value in the box (may be loose, never too small).
    pub fn bound(&self, b: &Aabb) -> Interval {
        let _ = b;
        todo!()
    }
}
