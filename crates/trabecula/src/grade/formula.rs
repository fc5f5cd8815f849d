//! Formulas.
use crate::fault::Fault;
use crate::math::{Aabb, Interval, Vec3};

/// A parsed formula in x, y, z (mm).
#[derive(Clone, Debug)]
pub struct Formula;

impl Formula {
    /// Parses; never evaluates anything but mathematics.
    pub fn parse(text: &str) -> Result<Formula, Fault> {
        let _ = text;
        todo!()
    }
    /// Value and gradient at a point.
    pub fn gradient(&self, p: Vec3) -> (f64, Vec3) {
        let _ = p;
        todo!()
    }
    /// Contains every value in the box.
    pub fn bound(&self, b: &Aabb) -> Interval {
        let _ = b;
        todo!()
    }
}
