//! Where a part of a design stands: what every reader of data needs to know of the rest.

use super::Loader;
use crate::csg_tree::CsgSolid;
use crate::region::Region;

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
