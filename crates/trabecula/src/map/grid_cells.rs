//! The cells of a grid of nodes, and what nodes and edges about them make of a quantity in their middles.

use rayon::prelude::*;

use super::phase_grid::PhaseGrid;
use geometry::math::{Mat3, Vec3, add, scale};

/// The cells of a grid of nodes.
pub(super) struct GridCells {
    grid: PhaseGrid,
    shape: [usize; 3],
}

impl GridCells {
    pub fn new(grid: PhaseGrid) -> GridCells {
        GridCells { grid, shape: grid.shape.map(|n| n - 1) }
    }

    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The cell of this index along each axis; `None` beyond the grid, 0 − 1 wrapped.
    pub fn at(&self, index: [usize; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.shape;
        let [i, j, k] = index;
        (i < nx && j < ny && k < nz).then(|| (k * ny + j) * nx + i)
    }

    /// The first node of a cell.
    fn first(&self, c: usize) -> usize {
        let [nx, ny, _] = self.shape;
        let [_, y, z] = self.grid.strides();
        c % nx + c / nx % ny * y + c / nx / ny * z
    }

    /// The nodes of a cell, x running fastest.
    pub fn corners(&self, c: usize) -> [usize; 8] {
        let (first, strides) = (self.first(c), self.grid.strides());
        core::array::from_fn(|n| first + (0..3).map(|a| (n >> a & 1) * strides[a]).sum::<usize>())
    }

    pub fn middle(&self, c: usize) -> Vec3 {
        add(self.grid.node(self.first(c)), scale(self.grid.step, 0.5))
    }

    /// The mean over the nodes of a cell.
    pub fn mean(&self, c: usize, of: impl Fn(usize) -> Mat3) -> Mat3 {
        let each = self.corners(c).map(of);
        core::array::from_fn(|i| core::array::from_fn(|j| each.iter().map(|m| m[i][j]).sum::<f64>() / 8.0))
    }

    /// The gradient in the middle by the slopes along edges, each kept at the node below it: the mean of four along each axis.
    pub fn slope(&self, c: usize, slopes: &[Vec3]) -> Vec3 {
        let near = self.corners(c);
        [0, 1, 2].map(|a| (0..8).filter(|i| i >> a & 1 == 0).map(|i| 0.25 * slopes[near[i]][a]).sum())
    }

    /// For each edge above a node the mean over the cells about it.
    pub fn on_edges(&self, of: &[Mat3], row: usize) -> Vec<Vec3> {
        let grid = &self.grid;
        let edge = |n: usize, a: usize| {
            let at = grid.index(n);
            if at[a] == self.shape[a] {
                return 0.0;
            }
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let (mut sum, mut count) = (0.0, 0.0);
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut low = at;
                (low[b], low[c]) = (at[b].wrapping_sub(i), at[c].wrapping_sub(j));
                if let Some(cell) = self.at(low) {
                    sum += of[cell][row][a];
                    count += 1.0;
                }
            }
            sum / count
        };
        (0..grid.len()).into_par_iter().map(|n| [0, 1, 2].map(|a| edge(n, a))).collect()
    }
}
