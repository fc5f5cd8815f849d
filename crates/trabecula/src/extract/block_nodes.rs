//! The nodes of a block of the grid.

use crate::field::Block;
use geometry::math::Vec3;

/// The nodes of a block, indexed.
pub(super) struct BlockNodes<'a> {
    pub axes: [&'a [f64]; 3],
    pub shape: [usize; 3],
    pub stride: [usize; 3],
    /// The coordinates again, and the steps to the next, where any index is within bounds.
    pub positions: [[f64; 64]; 3],
    pub steps: [[f64; 64]; 3],
}

impl<'a> BlockNodes<'a> {
    pub fn new(block: &Block<'a>) -> BlockNodes<'a> {
        let shape = block.shape();
        let (mut positions, mut steps) = ([[0.0; 64]; 3], [[0.0; 64]; 3]);
        for (a, axis) in block.axes.iter().enumerate() {
            positions[a][..axis.len()].copy_from_slice(axis);
            for (step, ends) in steps[a].iter_mut().zip(axis.windows(2)) {
                *step = ends[1] - ends[0];
            }
        }
        BlockNodes { axes: block.axes, shape, stride: [1, shape[0], shape[0] * shape[1]], positions, steps }
    }

    pub fn count(&self) -> usize {
        self.shape[2] * self.stride[2]
    }

    pub fn at(&self, n: usize) -> [usize; 3] {
        // Divisions of short numbers are the faster ones, and a block has few nodes.
        let (n, nx, ny) = (n as u32, self.shape[0] as u32, self.shape[1] as u32);
        let row = n / nx;
        [n - row * nx, row % ny, row / ny].map(|i| i as usize)
    }

    pub fn index(&self, at: [usize; 3]) -> usize {
        at[0] + at[1] * self.stride[1] + at[2] * self.stride[2]
    }

    pub fn position(&self, n: usize) -> Vec3 {
        let at = self.at(n);
        [0, 1, 2].map(|a| self.axes[a][at[a]])
    }
}

/// The node coordinates of a block and of one more node on every side, and the number of nodes before the block.
pub(super) struct PaddedNodes<'a> {
    pub axes: [&'a [f64]; 3],
    pub before: [isize; 3],
}
