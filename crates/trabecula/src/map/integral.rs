//! Three functions on a grid whose gradients are nearest to three targets.

use rayon::prelude::*;

use super::angle_weight::AngleWeight;
use super::edge_squares::{EdgeSquares, LeastSquaresSolution, slopes};
use super::phase_grid::PhaseGrid;
use super::poisson::Poisson;
use geometry::math::{Mat3, Vec3, add, dot, norm, scale, sub};
use geometry::progress::Cancellation;

/// The roots of the weights of nodes, and the edges' squares; `None` where all count alike.
pub(super) type EdgeWeights = Option<(Vec<f64>, EdgeSquares)>;

/// Targets at the nodes of a grid, and what errors count.
pub(super) struct Problem<'a> {
    pub grid: PhaseGrid,
    pub k: &'a [Vec<Vec3>; 3],
    pub weights: EdgeWeights,
    /// What an error of angle counts.
    pub ratio: f64,
}

/// What a problem has as its solution.
pub(super) struct Integral {
    /// The functions at the nodes. With K̄ the mean of K, that of Φ − K̄ x is zero; means are weighted by the trapezoid rule and the
    /// weights of nodes.
    pub values: [Vec<f64>; 3],
    /// The mean of the rows of K.
    pub mean: Mat3,
    /// Steps of conjugate gradients.
    pub steps: usize,
}

impl<'a> Problem<'a> {
    /// With the roots of the weights of nodes, if they differ.
    pub fn new(grid: PhaseGrid, k: &'a [Vec<Vec3>; 3], roots: Option<Vec<f64>>, ratio: f64) -> Problem<'a> {
        let even = || (ratio != 1.0).then(|| vec![1.0; grid.len()]);
        let weights = roots.or_else(even).map(|roots| {
            let squares = EdgeSquares::new(grid, &roots, None);
            (roots, squares)
        });
        Problem { grid, k, weights, ratio }
    }

    /// What errors across the target of an axis count more or less than those along it.
    pub fn tilt(&self, axis: usize) -> Option<AngleWeight> {
        self.weights.as_ref().and_then(|(roots, _)| AngleWeight::new(self.grid, &self.k[axis], self.ratio, roots))
    }

    /// The function whose steps are nearest to slopes along edges.
    pub fn fit(&self, slopes: &[Vec3], tilt: Option<&AngleWeight>) -> Vec<f64> {
        let start = vec![0.0; slopes.len()];
        self.weights.as_ref().map_or_else(Vec::new, |(_, squares)| squares.fit(slopes, start, tilt).values)
    }

    /// The sum of products of two sets of slopes along edges, as errors count.
    pub fn product(&self, a: &[Vec3], b: &[Vec3], tilt: Option<&AngleWeight>) -> f64 {
        self.weights.as_ref().map_or(0.0, |(_, squares)| squares.product(a, b, tilt))
    }

    /// The target at a node.
    pub fn target(&self, node: usize) -> Mat3 {
        [0, 1, 2].map(|i| self.k[i][node])
    }

    /// The function whose steps are nearest to slopes along edges, as errors of an axis count, but for a constant.
    pub fn nearest(&self, axis: usize, slopes: &[Vec3]) -> Vec<f64> {
        match &self.weights {
            None => Poisson::new(self.grid).nearest(slopes),
            Some(_) => self.fit(slopes, self.tilt(axis).as_ref()),
        }
    }

    /// The function whose steps are nearest to none, as errors of an axis count, and which is pulled to values at nodes: `pull` is what
    /// they count, relative to all differences at the node.
    pub fn pulled(&self, axis: usize, pull: Vec<f64>, values: &[f64]) -> Vec<f64> {
        let even;
        let squares = match &self.weights {
            Some((_, squares)) => squares,
            None => {
                even = EdgeSquares::new(self.grid, &vec![1.0; self.grid.len()], None);
                &even
            }
        };
        let mass = pull.iter().enumerate().map(|(n, m)| if *m > 0.0 { m * squares.about(n) } else { 0.0 }).collect();
        squares.pulled(mass, values, self.tilt(axis).as_ref())
    }

    pub fn solve(&self) -> Integral {
        let grid = &self.grid;
        let root = |n: usize| self.weights.as_ref().map_or(1.0, |(s, _)| s[n] * s[n]);
        let weights: Vec<f64> = (0..grid.len()).map(|n| grid.trapezoid(n) * root(n)).collect();
        let whole: f64 = weights.iter().sum();
        let poisson = Poisson::new(*grid);
        let request = Cancellation::current();
        let solved = (0..3usize).into_par_iter().map(|axis| {
            request.enter(|| {
                let k = &self.k[axis];
                // From a first value on, so that a K that does not vary has exactly itself as its mean.
                let first = k[0];
                let off = k.iter().zip(&weights).fold([0.0; 3], |m, (k, w)| add(m, scale(sub(*k, first), *w)));
                let mean = add(first, scale(off, 1.0 / whole));
                let rest: Vec<Vec3> = k.iter().map(|k| sub(*k, mean)).collect();
                let (mut f, steps) = match &self.weights {
                    _ if rest.iter().all(|r| norm(*r) <= 1e-15 * norm(mean)) => (vec![0.0; k.len()], 0),
                    None => (poisson.integrate(&rest), 0),
                    Some((_, squares)) => {
                        let tilt = self.tilt(axis);
                        let LeastSquaresSolution { values, steps, .. } =
                            squares.fit(&slopes(grid, &rest), poisson.integrate(&rest), tilt.as_ref());
                        (values, steps)
                    }
                };
                let off = f.iter().zip(&weights).map(|(f, w)| f * w).sum::<f64>() / whole;
                for (n, f) in f.iter_mut().enumerate() {
                    *f += dot(mean, grid.node(n)) - off;
                }
                (f, mean, steps)
            })
        });
        let solved: Vec<(Vec<f64>, Vec3, usize)> = solved.collect();
        let mean = [solved[0].1, solved[1].1, solved[2].1];
        let steps = solved.iter().map(|s| s.2).max().unwrap_or(0);
        let mut values = solved.into_iter().map(|s| s.0);
        Integral { values: core::array::from_fn(|_| values.next().unwrap_or_default()), mean, steps }
    }
}
