//! A boundary loop in a cell, and patches that fill it.

use super::{BlockNodes, SamplingGrid, within};
use crate::field::Field;
use geometry::math::{Vec3, add, scale};

/// A cell and the surface whose patch it contains.
#[derive(Clone, Copy)]
pub(super) struct SurfaceCell<'a> {
    pub grid: &'a SamplingGrid,
    pub nodes: &'a BlockNodes<'a>,
    /// The lowest node.
    pub node: usize,
    pub surface: usize,
    pub field: &'a dyn Field,
}

/// The boundary loop of a patch.
pub(super) struct BoundaryLoop {
    /// Its points, counter-clockwise seen from the void.
    pub positions: Vec<Vec3>,
    /// The faces of the cell on which each point lies, as bits; a contour corner lies on one.
    pub faces: Vec<u8>,
}

/// Triangles that fill a loop. Indices below the number of its points are these; the others are `inner`.
pub(super) struct LoopPatch {
    pub inner: Vec<Vec3>,
    pub triangles: Vec<[usize; 3]>,
    /// Polylines along the dividing feature edges, from one point of the loop to another.
    pub routes: Vec<Vec<usize>>,
}

impl LoopPatch {
    pub fn cone(boundary_loop: &BoundaryLoop, apex: Vec3) -> LoopPatch {
        let n = boundary_loop.positions.len();
        LoopPatch { inner: vec![apex], triangles: (0..n).map(|i| [n, i, (i + 1) % n]).collect(), routes: Vec::new() }
    }
}

impl SurfaceCell<'_> {
    /// A point clamped to the interior of the cell.
    pub fn within(&self, p: Vec3) -> Vec3 {
        let at = self.nodes.at(self.node);
        [0, 1, 2].map(|a| within(self.grid, self.nodes.axes[a], at[a], p[a]))
    }

    /// Sum of squared distances of the surface from the midpoints between a point and others.
    pub fn off(&self, from: Vec3, to: &[Vec3]) -> f64 {
        let middles: Vec<Vec3> = to.iter().map(|p| scale(add(from, *p), 0.5)).collect();
        let mut off = vec![0.0; middles.len()];
        self.field.values(&middles, &mut off);
        off.iter().map(|d| d * d).sum()
    }
}
