//! Weighted least squares for a gradient on a grid: Σ w (Φⱼ − Φᵢ − h g)² / h² over the grid's edges, g the target's slope along each, by
//! conjugate gradients with multigrid as preconditioner.
//!
//! Targets are slopes along edges and not vectors at nodes, so that they may be those of an angle, which is no function. An edge's
//! square stands for the box between the middles of the faces about it; where a region's boundary cuts the face at right angles to it, it
//! counts by what the region has of that face. The normal equations then say that as much flows in as out of each node's share
//! of the region, and nothing through its boundary, which is second order without a node on the boundary (Ng, Min, Gibou, An efficient
//! fluid–solid coupling algorithm for single-phase flows, J. Comput. Phys. 228, 2009).

use rayon::prelude::*;

use super::angle_weight::AngleWeight;
use super::conjugate_gradients::{self, Solved, sums};
use super::multigrid::Multigrid;
use super::phase_grid::PhaseGrid;
use geometry::math::Vec3;

/// The energy of the error, relative to the first, of which conjugate gradients end at the square.
const RESIDUAL: f64 = 1e-7;
/// Most steps of conjugate gradients.
const STEPS: usize = 400;
/// What edges count that have no share in the region.
const BEYOND: f64 = 1e-5;
/// Least squares on the edges of a grid.
pub(super) struct EdgeSquares {
    grid: PhaseGrid,
    multigrid: Multigrid,
}

/// What was found: values at the nodes, the number of steps taken, and the error left, relative to the first.
pub(super) struct LeastSquaresSolution {
    pub values: Vec<f64>,
    pub steps: usize,
    #[cfg_attr(not(test), expect(dead_code))]
    pub left: f64,
}

impl EdgeSquares {
    /// Edges that count as the product of `roots` at their ends and by their share of the grid's box, and, if the `depth` of nodes below
    /// the surface of a region is given (mm, positive outside), of the region.
    pub fn new(grid: PhaseGrid, roots: &[f64], depth: Option<&[f64]>) -> EdgeSquares {
        let edges = weights(grid, roots, depth);
        EdgeSquares { grid, multigrid: Multigrid::new(grid.shape, grid.step, edges, Vec::new()) }
    }

    /// The function whose steps are nearest to none and whose values are near to those given, where they count: Σ m (Φᵢ − vᵢ)² is added.
    pub fn pulled(&self, mass: Vec<f64>, values: &[f64], tilt: Option<&AngleWeight>) -> Vec<f64> {
        let right = mass.iter().zip(values).map(|(m, v)| m * v).collect();
        let multigrid = Multigrid::new(self.grid.shape, self.grid.step, self.multigrid.finest().edges.clone(), mass);
        EdgeSquares { grid: self.grid, multigrid }.solve(right, vec![0.0; values.len()], tilt).values
    }

    /// What the squares of all differences at a node count.
    pub fn about(&self, node: usize) -> f64 {
        let edges = &self.multigrid.finest().edges;
        let below = |a: usize| node.checked_sub(self.grid.strides()[a]).map_or(0.0, |m| edges[a][m]);
        (0..3).map(|a| edges[a][node] + below(a)).sum()
    }

    /// The sum of the products of two sets of slopes along the edges above nodes, as errors count.
    pub fn product(&self, a: &[Vec3], b: &[Vec3], tilt: Option<&AngleWeight>) -> f64 {
        let (h, edges) = (self.grid.step.map(|h| h * h), &self.multigrid.finest().edges);
        let of = |n: usize| (0..3).map(|i| edges[i][n] * h[i] * a[n][i] * b[n][i]).sum::<f64>();
        sums(a.len(), of) + tilt.map_or(0.0, |t| t.product(a, b))
    }

    /// The function whose steps along the edges above the nodes are nearest to those of slopes, from `start` on; errors across the target
    /// count more or less than those along it, if there is a tilt.
    pub fn fit(&self, slopes: &[Vec3], start: Vec<f64>, tilt: Option<&AngleWeight>) -> LeastSquaresSolution {
        let mut right = flow(&self.grid, &self.multigrid.finest().edges, slopes);
        if let Some(tilt) = tilt {
            right.par_iter_mut().zip(tilt.wanted(slopes)).for_each(|(r, more)| *r += more);
        }
        self.solve(right, start, tilt)
    }

    /// The solution of the normal equations, from `start` on.
    fn solve(&self, right: Vec<f64>, start: Vec<f64>, tilt: Option<&AngleWeight>) -> LeastSquaresSolution {
        let operator = |x: &[f64], out: &mut [f64]| {
            self.multigrid.apply(x, out);
            if let Some(tilt) = tilt {
                out.par_iter_mut().zip(tilt.apply(x)).for_each(|(o, more)| *o += more);
            }
        };
        let Solved { x, steps, left } =
            conjugate_gradients::solve(right, start, operator, self.multigrid.cycle(), (RESIDUAL, STEPS));
        LeastSquaresSolution { values: x, steps, left }
    }
}

/// What the square of a difference along each edge counts, as in `EdgeSquares::new`.
pub(super) fn weights(grid: PhaseGrid, roots: &[f64], depth: Option<&[f64]>) -> [Vec<f64>; 3] {
    let strides = grid.strides();
    let weight = |a: usize, n: usize| {
        let at = grid.index(n);
        if at[a] + 1 == grid.shape[a] {
            return 0.0;
        }
        let share = depth.map_or(1.0, |d| share(&grid, d, a, n).max(BEYOND));
        let faces = (0..3).filter(|&b| b != a && (at[b] == 0 || at[b] + 1 == grid.shape[b]));
        faces.fold(share, |w, _| 0.5 * w) * roots[n] * roots[n + strides[a]] / (grid.step[a] * grid.step[a])
    };
    core::array::from_fn(|a| (0..grid.len()).into_par_iter().map(|n| weight(a, n)).collect())
}

/// What slopes along edges give of the right-hand side: for each node those of the edges below less those of the edges above.
fn flow(grid: &PhaseGrid, edges: &[Vec<f64>; 3], slopes: &[Vec3]) -> Vec<f64> {
    let (h, strides) = (grid.step, grid.strides());
    let edge = |a: usize, n: usize| edges[a][n] * h[a] * slopes[n][a];
    let of =
        |n: usize| -> f64 { (0..3).map(|a| n.checked_sub(strides[a]).map_or(0.0, |m| edge(a, m)) - edge(a, n)).sum() };
    (0..slopes.len()).into_par_iter().map(of).collect()
}

/// Half the sum of a gradient at both ends of each edge above a node.
pub(super) fn slopes(grid: &PhaseGrid, k: &[Vec3]) -> Vec<Vec3> {
    let (shape, strides) = (grid.shape, grid.strides());
    let mean = |n: usize, a: usize| match grid.index(n)[a] + 1 < shape[a] {
        true => 0.5 * (k[n][a] + k[n + strides[a]][a]),
        false => 0.0,
    };
    (0..k.len()).into_par_iter().map(|n| [0, 1, 2].map(|a| mean(n, a))).collect()
}

/// The slopes of a function along the edges above the nodes; zero where there is none.
pub(super) fn gradient(grid: &PhaseGrid, f: &[f64]) -> Vec<Vec3> {
    let strides = grid.strides();
    let of = |n: usize| {
        let at = grid.index(n);
        [0, 1, 2].map(|a| if at[a] + 1 < grid.shape[a] { (f[n + strides[a]] - f[n]) / grid.step[a] } else { 0.0 })
    };
    (0..grid.len()).into_par_iter().map(of).collect()
}

/// The region's share of the face at right angles to the edge above a node along an axis, as much of it as is in the grid's box: a plane
/// boundary at the distance and with the slopes of the nodes.
fn share(grid: &PhaseGrid, depth: &[f64], a: usize, n: usize) -> f64 {
    let (at, strides) = (grid.index(n), grid.strides());
    let mut middle = 0.5 * (depth[n] + depth[n + strides[a]]);
    let mut spans = [0.0; 2];
    for (span, b) in spans.iter_mut().zip([(a + 1) % 3, (a + 2) % 3]) {
        let (low, high) = (at[b] > 0, at[b] + 1 < grid.shape[b]);
        let of = |n: usize| {
            let (lo, hi) = (if low { n - strides[b] } else { n }, if high { n + strides[b] } else { n });
            (depth[hi] - depth[lo]) / if low && high { 2.0 } else { 1.0 }
        };
        // What depth changes by from side to side of a whole face.
        let change = 0.5 * (of(n) + of(n + strides[a]));
        match (low, high) {
            (true, true) => *span = change,
            (false, _) => (*span, middle) = (0.5 * change, middle + 0.25 * change),
            (_, false) => (*span, middle) = (0.5 * change, middle - 0.25 * change),
        }
    }
    below(-middle, spans.map(f64::abs))
}

/// The part of a unit square on which p (x − ½) + q (y − ½) ≤ t, p, q ≥ 0: the distribution of the sum of two even ones.
fn below(t: f64, [p, q]: [f64; 2]) -> f64 {
    let (long, short) = (p.max(q), p.min(q));
    let half = |v: f64| 0.5 * v.max(0.0).powi(2);
    let (out, inner) = (0.5 * (long + short), 0.5 * (long - short));
    if t.abs() >= out {
        return if t >= 0.0 { 1.0 } else { 0.0 };
    }
    // Nearly even along one side, the sum is of one.
    if short <= 1e-6 * long {
        return (0.5 + t / long).clamp(0.0, 1.0);
    }
    ((half(t + out) - half(t + inner) - half(t - inner) + half(t - out)) / (long * short)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests;
