//! Cells of the grid across cuts: there splines have the coefficients of the branch of the cell's first node.
//!
//! Two adjacent cells have the same coefficients but for the motion of phases between their branches, so phases have no seam on their
//! common face but for that motion, which the lattice does not see. Only next to a line, where its cut ends, this fails: such cells are
//! torn, and have to lie in the line's core. Coefficients are v − δ²v/6 along each axis, the interpolating ones at fourth order in
//! the step; unlike those they depend on adjacent nodes alone, and so not on what is behind a cut.

use std::collections::HashMap;

use rayon::prelude::*;

use super::branch_cuts::{BranchCuts, PhaseMotion};
use super::phase_grid::PhaseGrid;
use super::spline::MapSpline;
use geometry::cubic_spline::{slopes, weights};
use geometry::math::{Aabb, Mat3, Vec3, add, norm, product, scale, sub};

/// By how much phases on a face may differ from cell to cell, turns: rounding.
const APART: f64 = 1e-6;

/// A cell's coefficients, x fastest.
type CellCoefficients = [Vec3; 64];

/// Cells that have coefficients of their own.
pub(super) struct CutCells {
    grid: PhaseGrid,
    cuts: BranchCuts,
    cells: HashMap<usize, Box<CellCoefficients>>,
    /// Rows of cells along x in which there are some.
    rows: Vec<bool>,
    /// Torn cells, by their first nodes.
    torn: Vec<bool>,
}

/// A spline through values with branches, and the cells of it that cuts pass.
pub(super) fn through(grid: PhaseGrid, values: &[Vec3], cuts: BranchCuts) -> (MapSpline, CutCells) {
    let at = |n: usize| grid.index(n);
    let offset = |n: usize, by: [isize; 3]| -> Option<usize> {
        let i = at(n);
        let moved = [0, 1, 2].map(|a| i[a].checked_add_signed(by[a]).filter(|i| *i < grid.shape[a]));
        let [x, y, z] = [moved[0]?, moved[1]?, moved[2]?];
        Some(x + grid.shape[0] * (y + grid.shape[1] * z))
    };
    let near = |n: usize, reach: core::ops::RangeInclusive<isize>| {
        let all = reach.clone().flat_map(move |z| {
            let x = reach.clone();
            reach.clone().flat_map(move |y| x.clone().map(move |x| [x, y, z]))
        });
        all.filter_map(move |by| offset(n, by).map(|m| (by, m)))
    };
    let (strides, close) = (grid.strides(), cuts.near(&grid));
    let stencil: [(usize, f64); 27] = core::array::from_fn(|c| {
        let by = [c % 3, c / 3 % 3, c / 9];
        let weight = by.iter().map(|b| if *b == 1 { 4.0 / 3.0 } else { -1.0 / 6.0 }).product();
        ((0..3).map(|a| by[a] * strides[a]).sum(), weight)
    });
    let first: usize = strides.iter().sum();
    let coefficient = |n: usize| {
        if (0..3).any(|a| at(n)[a] == 0 || at(n)[a] + 1 == grid.shape[a]) {
            return values[n];
        }
        stencil.iter().fold([0.0; 3], |sum, (by, weight)| {
            let m = n - first + by;
            let v = if close[n] && cuts.any([n, m]) { cuts.between([m, n]).of(values[m]) } else { values[m] };
            add(sum, scale(v, *weight))
        })
    };
    let coefficients: Vec<Vec3> = (0..grid.len()).into_par_iter().map(coefficient).collect();
    let inner = |n: &usize| (0..3).all(|a| at(*n)[a] > 0 && at(*n)[a] + 2 < grid.shape[a]);
    let local = |n: usize| {
        if !close[n] || !near(n, -1..=2).any(|(_, m)| cuts.any([n, m])) {
            return None;
        }
        let mut own = Box::new([[0.0; 3]; 64]);
        near(n, -1..=2).zip(own.iter_mut()).for_each(|((_, m), c)| *c = cuts.between([m, n]).of(coefficients[m]));
        Some((n, own))
    };
    let cells: HashMap<usize, Box<CellCoefficients>> =
        (0..grid.len()).into_par_iter().filter(inner).filter_map(local).collect();
    let mut rows = vec![false; grid.shape[1] * grid.shape[2]];
    cells.keys().for_each(|n| rows[n / grid.shape[0]] = true);
    let mut torn = vec![false; grid.len()];
    // Whether adjacent cells have the same coefficients but for the motion between them, at the nodes that both have.
    let agree = |axis: usize, [one, other]: [usize; 2]| {
        let (to, own) = (cuts.between([one, other]), [one, other].map(|n| cells.get(&n)));
        near(one, -1..=2).enumerate().all(|(i, (by, m))| {
            let at = |cell: usize, i: usize| own[cell].map_or(coefficients[m], |c| c[i]);
            // The other cell counts the same nodes from a step further on.
            by[axis] < 0 || norm(sub(to.of(at(0, i)), at(1, i - 4usize.pow(axis as u32)))) < APART
        })
    };
    for n in cells.keys() {
        for (a, stride) in strides.into_iter().enumerate() {
            // A cell below that has coefficients of its own is compared from there.
            let below = (!cells.contains_key(&(n - stride))).then(|| [n - stride, *n]);
            for [one, other] in below.into_iter().chain([[*n, n + stride]]) {
                if inner(&one) && inner(&other) && !agree(a, [one, other]) {
                    (torn[one], torn[other]) = (true, true);
                }
            }
        }
    }
    let spline = MapSpline::of(grid, &coefficients, |cell| cells.get(&cell).map(|c| &**c));
    (spline, CutCells { grid, cuts, cells, rows, torn })
}

impl CutCells {
    /// The first node of the cell about a point, and where the point is in it, in steps.
    fn cell(&self, p: Vec3) -> (usize, Vec3) {
        let g = &self.grid;
        let along = |a: usize| ((p[a] - g.origin[a]) / g.step[a]).clamp(0.0, (g.shape[a] - 1) as f64);
        let first: [usize; 3] = core::array::from_fn(|a| (along(a) as usize).min(g.shape[a] - 2));
        let n = first[0] + g.shape[0] * (first[1] + g.shape[1] * first[2]);
        (n, [0, 1, 2].map(|a| along(a) - first[a] as f64))
    }

    /// The phases at a point of a cell that has coefficients of its own.
    pub fn phase(&self, p: Vec3) -> Option<Vec3> {
        let (n, t) = self.cell(p);
        self.cells.get(&n).map(|c| sum(c, t.map(weights)))
    }

    /// Their Jacobian there.
    pub fn jacobian(&self, p: Vec3) -> Option<Mat3> {
        let (n, t) = self.cell(p);
        let c = self.cells.get(&n)?;
        let along = |a: usize| {
            let w = core::array::from_fn(|b| if a == b { slopes(t[b]) } else { weights(t[b]) });
            scale(sum(c, w), 1.0 / self.grid.step[a])
        };
        Some(geometry::math::transpose(&[along(0), along(1), along(2)]))
    }

    /// A Jacobian found at a node, in the branch of that node: rounding decides which of the cells about it was taken.
    pub fn of_node(&self, node: usize, jacobian: &Mat3) -> Mat3 {
        product(&self.cuts.between([self.cell(self.grid.node(node)).0, node]).turn, jacobian)
    }

    /// Whether a row of points along x may meet such cells.
    pub fn in_row(&self, y: f64, z: f64) -> bool {
        let (n, _) = self.cell([self.grid.origin[0], y, z]);
        self.rows[n / self.grid.shape[0]]
    }

    /// Whether a box meets a torn cell.
    pub fn is_torn(&self, b: &Aabb) -> bool {
        let [lo, hi] = [b.min, b.max].map(|p| self.grid.index(self.cell(p).0));
        let [nx, ny, _] = self.grid.shape;
        (lo[2]..=hi[2]).any(|k| (lo[1]..=hi[1]).any(|j| (lo[0]..=hi[0]).any(|i| self.torn[i + nx * (j + ny * k)])))
    }

    /// The boxes of torn cells.
    pub fn torn(&self) -> impl Iterator<Item = Aabb> + '_ {
        let boxed = |n: usize| {
            let min = self.grid.node(n);
            Aabb { min, max: add(min, self.grid.step) }
        };
        (0..self.torn.len()).filter(|n| self.torn[*n]).map(boxed)
    }

    /// What phases become from one node to a near one.
    pub fn between(&self, ends: [usize; 2]) -> PhaseMotion {
        self.cuts.between(ends)
    }

    /// Whether a cut passes next to a node.
    pub fn is_near(&self, node: usize) -> bool {
        self.cells.contains_key(&node)
    }

    /// The rotations of phases across the cuts.
    pub fn turns(&self) -> Vec<Mat3> {
        (0..self.cuts.len()).map(|line| self.cuts.step(line).turn).collect()
    }
}

fn sum(c: &CellCoefficients, [x, y, z]: [[f64; 4]; 3]) -> Vec3 {
    let mut sum = [0.0; 3];
    for (k, z) in z.iter().enumerate() {
        for (j, y) in y.iter().enumerate() {
            for (i, x) in x.iter().enumerate() {
                sum = add(sum, scale(c[i + 4 * (j + 4 * k)], x * y * z));
            }
        }
    }
    sum
}
