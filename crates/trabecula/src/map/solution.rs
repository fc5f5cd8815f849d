//! Solved phases: single-valued ones by splines, whole numbers of cells round the holes of the region, and branches round lines.

use rayon::prelude::*;

use super::PhaseRows;
use super::cut_cells::CutCells;
use super::phase_grid::PhaseGrid;
use super::spline::{self, MapSpline};
use super::winding::Winding;
use crate::field::Block;
use geometry::math::{Aabb, Mat3, Vec3, add};

/// Three phases (turns) of position (mm), but for a constant.
pub(super) struct Solution {
    pub spline: MapSpline,
    pub winding: Winding,
    /// The cells in which phases have branches of their own, where lines are covered.
    pub branches: Option<CutCells>,
}

impl Solution {
    pub fn grid(&self) -> &PhaseGrid {
        self.spline.grid()
    }

    /// Fills the phases of points.
    pub fn phases(&self, points: &[Vec3], u: &mut [Vec3]) {
        self.spline.values(points, u);
        self.winding.add_phases(points, u);
        if let Some(of) = &self.branches {
            u.iter_mut().zip(points).for_each(|(u, p)| *u = of.phase(*p).unwrap_or(*u));
        }
    }

    /// Fills phases and Jacobians of points.
    pub fn jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        self.spline.jacobians(points, u, j);
        self.winding.add_phases(points, u);
        self.winding.add_jacobians(points, j);
        if let Some(of) = &self.branches {
            for ((u, j), p) in u.iter_mut().zip(j).zip(points) {
                (*u, *j) = of.phase(*p).zip(of.jacobian(*p)).unwrap_or((*u, *j));
            }
        }
    }

    /// The Jacobian at a point.
    pub fn jacobian(&self, p: Vec3) -> Mat3 {
        let mut j = [self.spline.jacobian(p).1];
        self.winding.add_jacobians(&[p], &mut j);
        self.branches.as_ref().and_then(|of| of.jacobian(p)).unwrap_or(j[0])
    }

    /// A bound of |J| (spectral norm) in a box.
    pub fn lipschitz(&self, b: &Aabb) -> f64 {
        if self.branches.as_ref().is_some_and(|of| of.is_torn(b)) {
            return f64::INFINITY;
        }
        if self.winding.is_empty() {
            return self.spline.lipschitz(b);
        }
        let (middle, change) = self.winding.around(b);
        self.spline.lipschitz_beside(b, &middle) + change
    }

    /// A bound of |J| in all of the bounds; where phases grow round holes, in the cells of the grid that are `near` the region.
    pub fn max_lipschitz(&self, bounds: &Aabb, near: impl Fn(usize) -> bool + Sync) -> f64 {
        if self.winding.is_empty() {
            return self.spline.lipschitz(bounds);
        }
        let (grid, shape) = (self.grid(), self.grid().shape);
        let far: usize = grid.strides().iter().sum();
        (0..grid.len())
            .into_par_iter()
            .filter(|n| (0..3).all(|a| grid.index(*n)[a] + 1 < shape[a]) && near(*n))
            .map(|n| self.lipschitz(&Aabb { min: grid.node(n), max: grid.node(n + far) }))
            .reduce(|| 0.0, f64::max)
    }

    /// The phases along the rows of a block, moved by `shift`.
    pub fn rows<'a>(&'a self, block: &Block<'a>, shift: Vec3) -> Box<dyn PhaseRows + 'a> {
        let Solution { spline, winding, branches } = self;
        Box::new(SolutionRows {
            rows: spline.rows(block),
            winding,
            branches: branches.as_ref(),
            block: *block,
            layer: 0,
            shift,
        })
    }

    /// Moves phases that were found at `p` so that they continue those at a near point.
    pub fn continued(&self, u: Vec3, from: Vec3, p: Vec3) -> Vec3 {
        if self.winding.is_empty() { u } else { add(u, self.winding.jump(from, p)) }
    }
}

/// The phases of a solved map along the rows of a block.
struct SolutionRows<'a> {
    rows: spline::SplineRows<'a>,
    winding: &'a Winding,
    branches: Option<&'a CutCells>,
    block: Block<'a>,
    layer: usize,
    shift: Vec3,
}

impl PhaseRows for SolutionRows<'_> {
    fn enter_layer(&mut self, k: usize) {
        self.layer = k;
        self.rows.enter_layer(k);
    }

    fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]) {
        self.rows.fill(j, out);
        self.winding.add_row(&self.block, [j, self.layer], out);
        let [xs, y, z] = [self.block.axes[0], &self.block.axes[1][j..=j], &self.block.axes[2][self.layer..=self.layer]];
        if let Some(of) = self.branches.filter(|of| of.in_row(y[0], z[0])) {
            for (i, x) in xs.iter().enumerate() {
                if let Some(u) = of.phase([*x, y[0], z[0]]) {
                    out.iter_mut().zip(u).for_each(|(out, u)| out[i] = u);
                }
            }
        }
        for (out, shift) in out.iter_mut().zip(self.shift) {
            if shift != 0.0 {
                out.iter_mut().for_each(|u| *u += shift);
            }
        }
    }
}
