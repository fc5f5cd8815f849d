//! Different weights for the errors of a gradient across and along the target.
//!
//! ∇Φ may be off K in length, which is the spacing of cells, or in direction, which is their angle. With K̂ = K/|K| the square of
//! the one is |K̂·(∇Φ − K)|², of the other |(I − K̂K̂ᵀ)(∇Φ − K)|². With r times the second the weight is a tensor,
//! I + (r − 1)(I − K̂K̂ᵀ), or, r < 1, the same over r: I + (1/r − 1) K̂K̂ᵀ. It penalises the gradient along the other axes, after
//! Groen and Sigmund, Homogenization-based topology optimization for high-resolution manufacturable microstructures, Int. J.
//! Numer. Meth. Engng 113, 2018; least squares stay linear.
//!
//! The identity is the edges' part (`edge_squares`). The rest is taken at the middles of the grid's cells, where the gradient is the
//! mean of four differences along each axis: second order, and the edges' part covers the modes that such a mean leaves out.

use rayon::prelude::*;

use super::grid_cells::GridCells;
use super::phase_grid::PhaseGrid;
use geometry::math::{Vec3, add, dot, norm, scale, sub};

/// The part of the weight that is no multiple of the identity.
pub(super) struct AngleWeight {
    grid: PhaseGrid,
    cells: GridCells,
    /// For each cell K̂ and what the part counts.
    of: Vec<(Vec3, f64)>,
    /// Whether the component across K is penalised, or the one along it.
    across: bool,
}

impl AngleWeight {
    /// For the wanted gradient `k` at the nodes, `ratio` between an error of angle and one of spacing, and the roots `s` of the
    /// nodes' weights. `None` where both count alike.
    pub fn new(grid: PhaseGrid, k: &[Vec3], ratio: f64, s: &[f64]) -> Option<AngleWeight> {
        if ratio == 1.0 {
            return None;
        }
        let cells = GridCells::new(grid);
        let across = ratio > 1.0;
        let more = if across { ratio } else { 1.0 / ratio } - 1.0;
        let mut tilt = AngleWeight { grid, cells, of: Vec::new(), across };
        let each = (0..tilt.cells.len()).into_par_iter().map(|c| {
            let near = tilt.cells.corners(c);
            let wanted = near.iter().fold([0.0; 3], |m, n| add(m, k[*n]));
            let root = near.iter().map(|n| s[*n]).sum::<f64>() / 8.0;
            let long = norm(wanted);
            let along = scale(wanted, if long > 0.0 { 1.0 / long } else { 0.0 });
            (along, more * root * root)
        });
        tilt.of = each.collect();
        Some(tilt)
    }

    /// The part applied to a gradient in a cell.
    fn weighted(&self, c: usize, g: Vec3) -> Vec3 {
        let (along, weight) = self.of[c];
        let part = scale(along, dot(along, g));
        scale(if self.across { sub(g, part) } else { part }, weight)
    }

    /// Carries a vector in each cell back to the nodes: the transpose of taking the gradient.
    fn spread(&self, cells: &[Vec3]) -> Vec<f64> {
        let grid = &self.grid;
        let one = |n: usize| {
            let at = grid.index(n);
            let mut sum = 0.0;
            for i in 0..8 {
                // The node is corner i of this cell, if there is one.
                let low = [0, 1, 2].map(|a| at[a].wrapping_sub(i >> a & 1));
                let Some(c) = self.cells.at(low) else { continue };
                let q = cells[c];
                for a in 0..3 {
                    let sign = if i >> a & 1 == 1 { 0.25 } else { -0.25 };
                    sum += sign * q[a] / grid.step[a];
                }
            }
            sum
        };
        (0..grid.len()).into_par_iter().map(one).collect()
    }

    /// The part of the operator: Bᵀ P B Φ.
    pub fn apply(&self, f: &[f64]) -> Vec<f64> {
        let each = (0..self.of.len()).into_par_iter().map(|c| {
            let near = self.cells.corners(c);
            let slope = |a: usize| {
                let sign = |i: usize| if i >> a & 1 == 1 { 0.25 } else { -0.25 };
                (0..8).map(|i| sign(i) * f[near[i]]).sum::<f64>() / self.grid.step[a]
            };
            self.weighted(c, [slope(0), slope(1), slope(2)])
        });
        self.spread(&each.collect::<Vec<Vec3>>())
    }

    /// The part of the right-hand side: Bᵀ P of slopes along the edges above the nodes.
    pub fn wanted(&self, slopes: &[Vec3]) -> Vec<f64> {
        let each = (0..self.of.len()).into_par_iter().map(|c| self.weighted(c, self.cells.slope(c, slopes)));
        self.spread(&each.collect::<Vec<Vec3>>())
    }

    /// The part of the sum of products of two sets of slopes along the edges above the nodes.
    pub fn product(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        let one = |c: usize| dot(self.weighted(c, self.cells.slope(c, a)), self.cells.slope(c, b));
        (0..self.of.len()).into_par_iter().map(one).collect::<Vec<f64>>().iter().sum()
    }
}
