//! Where a part of a design stands: what every reader of data needs to know of the rest.

use super::Loader;
use crate::csg_tree::CsgSolid;
use crate::kind::DesignError;
use crate::region::Region;
use geometry::fault::number;

/// Number of sample points of a design.
pub(super) const LOOKS: usize = 8_000;

/// Where a part of a lattice stands, and the region it is to fill.
pub(super) struct Place<'a> {
    pub path: String,
    pub region: &'a Region,
    /// Points inside the region.
    pub points: &'a [[f64; 3]],
    /// What is solid in the region whatever the lattice says.
    pub filled: &'a [CsgSolid],
    /// Hands over files.
    pub loader: &'a dyn Loader,
}

/// `v`, or an error that says it is not a finite number.
pub(super) fn finite(path: &str, v: f64) -> Result<f64, DesignError> {
    if v.is_finite() {
        Ok(v)
    } else {
        Err(DesignError::new(path, format!("expected a finite number, found {}", number(v))).found(number(v)))
    }
}
