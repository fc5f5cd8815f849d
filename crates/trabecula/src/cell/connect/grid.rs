//! A grid of the torus, cut into tetrahedra along the diagonals.

use rayon::prelude::*;

use super::critical::Function;
use super::sublattice::Int3;
use crate::math::{Vec3, norm, sub};

/// The directions of edges from a node: direction k has the bits of k + 1 along x, y, z (Freudenthal).
pub(super) const DIRECTIONS: [Int3; 7] = [
    [1, 0, 0],
    [0, 1, 0],
    [1, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [0, 1, 1],
    [1, 1, 1],
];

/// Samples of a function on n³ nodes of the torus.
pub(super) struct Grid {
    /// Nodes along each axis.
    pub n: usize,
    /// Values, x fastest.
    pub values: Vec<f64>,
    /// Lengths of the gradients, per turn.
    pub slopes: Vec<f64>,
    /// How far the linear interpolant may be from the function: 3h²/8 times its largest second derivative.
    pub error: f64,
    /// About the largest second derivative, per turn².
    pub bend: f64,
}

impl Grid {
    /// Samples f as finely as its steepness asks for, within 48³ and 96³ nodes.
    pub(super) fn sample(f: Function) -> Grid {
        let coarse = Grid::of(f, 48);
        // A hundredth of the range keeps apart what an engineer would call apart.
        let wanted = (48.0 * (coarse.error / (0.02 * coarse.range())).sqrt() / 8.0).ceil() * 8.0;
        if wanted > 48.0 {
            Grid::of(f, wanted.min(96.0) as usize)
        } else {
            coarse
        }
    }

    fn of(f: Function, n: usize) -> Grid {
        let h = 1.0 / n as f64;
        let mut values = vec![0.0; n * n * n];
        let mut slopes = vec![[0.0; 3]; n * n * n];
        values
            .par_chunks_mut(n * n)
            .zip(slopes.par_chunks_mut(n * n))
            .enumerate()
            .for_each(|(z, (v, g))| {
                let points: Vec<Vec3> = (0..n * n)
                    .map(|i| [(i % n) as f64 * h, (i / n) as f64 * h, z as f64 * h])
                    .collect();
                f(&points, v, g);
            });
        let steepness = slopes.iter().map(|g| norm(*g)).collect();
        let mut grid = Grid {
            n,
            values,
            slopes: steepness,
            error: 0.0,
            bend: 0.0,
        };
        let bend = (0..slopes.len() as u32).into_par_iter().map(|i| {
            let change =
                |d: Int3| norm(sub(slopes[grid.step(i, d).0 as usize], slopes[i as usize])) / h;
            change(DIRECTIONS[0])
                .max(change(DIRECTIONS[1]))
                .max(change(DIRECTIONS[3]))
        });
        grid.bend = bend.reduce(|| 0.0, f64::max);
        grid.error = 0.375 * h * h * grid.bend;
        grid
    }

    /// Greatest less least value.
    pub(super) fn range(&self) -> f64 {
        let ends = self
            .values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(*v), b.max(*v))
            });
        ends.1 - ends.0
    }

    /// Phase of a node.
    pub(super) fn position(&self, node: u32) -> Vec3 {
        let (i, n) = (node as usize, self.n);
        [i % n, i / n % n, i / (n * n)].map(|c| c as f64 / n as f64)
    }

    /// The node one step on, and the period it stands in.
    pub(super) fn step(&self, node: u32, d: Int3) -> (u32, Int3) {
        let n = self.n as i32;
        let i = node as i32;
        let at = [i % n + d[0], i / n % n + d[1], i / (n * n) + d[2]];
        let wrap = at.map(|c| if c < 0 { -1 } else { i32::from(c >= n) });
        let on = [0, 1, 2].map(|a| at[a] - n * wrap[a]);
        (((on[2] * n + on[1]) * n + on[0]) as u32, wrap)
    }

    /// The nodes at the corners of the grid cell that holds a phase, with their periods.
    pub(super) fn corners(&self, u: Vec3) -> [(u32, Int3); 8] {
        let n = self.n as i32;
        let low = u.map(|v| (v * self.n as f64).floor() as i32);
        core::array::from_fn(|k| {
            let at = [0, 1, 2].map(|a| low[a] + (k as i32 >> a & 1));
            let on = at.map(|c| c.rem_euclid(n));
            (
                ((on[2] * n + on[1]) * n + on[0]) as u32,
                at.map(|c| c.div_euclid(n)),
            )
        })
    }

    /// The number of the edge from `node` along direction k, after all nodes.
    pub(super) fn edge(&self, node: u32, k: usize) -> u32 {
        self.values.len() as u32 + node * 7 + k as u32
    }
}
