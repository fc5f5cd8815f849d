//! A row of nodes of a block.

use super::summand;
use geometry::math::Vec3;

/// A row of nodes along x, and the cores of the summands there.
pub(super) struct GridRow<'a> {
    pub rows: &'a [Option<summand::SummandRows<'a>>],
    pub cores: &'a [Vec<f32>],
    /// Its indices along y and z.
    pub index: [usize; 2],
    /// Its y and z, mm.
    pub at: [f64; 2],
    pub xs: &'a [f64],
}

impl GridRow<'_> {
    /// The position of a node, mm.
    pub fn position(&self, i: usize) -> Vec3 {
        [self.xs[i], self.at[0], self.at[1]]
    }

    /// gₛ at a node.
    #[inline]
    pub fn value(&self, s: usize, i: usize) -> f64 {
        let rows = self.rows[s].as_ref();
        rows.map_or(0.0, |rows| rows.value(self.cores[s][i]))
    }
}
