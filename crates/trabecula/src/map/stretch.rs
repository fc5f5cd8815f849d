//! Bounds on how much cells are stretched: the map nearest to its target of those whose cells keep to a range.
//!
//! J K⁻¹ is what a map makes of a cell that has the size and the axes asked for; its singular values are one over the cell's principal
//! stretches, and a map that folds has a negative determinant there. Of all maps Φ with ∇Φ in the set C of Jacobians whose determinant
//! is positive and whose stretches are in the range, the one with the least ∫ w |∇Φ − K|² is sought by the alternating direction
//! method of multipliers (Boyd, Parikh, Chu, Peleato, Eckstein, Distributed optimization and statistical learning via the alternating
//! direction method of multipliers, Found. Trends Mach. Learn. 3, 2011): a global step, the same least squares with another target; a
//! local one, the nearest element of C in each cell of the grid, as in the local–global methods for meshes (Aigerman, Lipman, Injective
//! and bounded distortion mappings in 3D, ACM Trans. Graph. 32, 2013). C is not convex, so what leaving it costs is raised step by step,
//! and what is reached is judged afterwards.

use rayon::prelude::*;

use super::distortion::{Distortion, stretch};
use super::edge_squares::gradient;
use super::grid_cells::GridCells;
use super::integral::Problem;
use super::solution::Solution;
use super::spline::MapSpline;
use geometry::fault::{Fault, number, position};
use geometry::math::{
    Mat3, Vec3, add, apply, cross, determinant, dot, eigen, inverse, norm, product, scale, sub, transpose,
};
use geometry::progress::checkpoint;

/// Most global steps.
const ROUNDS: usize = 120;
/// Steps after which what leaving the range costs is doubled, and the most of it, relative to the same distance from the target.
const DOUBLED: usize = 10;
const DEAREST: f64 = 1000.0;
/// What multipliers keep from step to step: all of it, as for a convex set, makes rotations swing.
const KEPT: f64 = 0.9;
/// What the range is narrowed by in the middles of the grid's cells, of its logarithm, so that points off them keep to it: the first, and
/// more where points do not. What is short of it by less than `SLACK` is enough.
pub(super) const MARGINS: [f64; 3] = [0.15, 0.35, 0.55];
const SLACK: f64 = 0.075;

/// The least and the greatest principal stretch of cells: the ratio of a length to the one asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    least: f64,
    most: f64,
}

impl Stretch {
    /// From the least to the greatest.
    ///
    /// # Errors
    /// A range that is not positive, not finite or does not have 1 within it.
    pub fn new([least, most]: [f64; 2]) -> Result<Stretch, Fault> {
        if !(least > 0.0 && least < 1.0 && most > 1.0 && most.is_finite()) {
            let message = format!(
                "[{}, {}]; the stretch of cells goes from above 0 and below 1 to above 1, such as [0.67, 1.5]",
                number(least),
                number(most)
            );
            return Err(Fault::new("stretch", message));
        }
        Ok(Stretch { least, most })
    }

    /// The range.
    pub fn range(&self) -> [f64; 2] {
        [self.least, self.most]
    }

    /// A range within this one, by a part of its logarithm.
    fn narrowed(&self, by: f64) -> Stretch {
        Stretch { least: self.least.powf(1.0 - by), most: self.most.powf(1.0 - by) }
    }

    /// The Jacobian nearest to `j` (in units of the target `k`) that does not turn cells inside out and stretches them within the range.
    fn nearest(&self, j: &Mat3, k: &Mat3) -> Mat3 {
        let f = product(j, &inverse(k));
        // From the greatest singular value down; the last axis follows from the others, so that both sets are right-handed.
        let (_, [_, b, a]) = eigen(&product(&transpose(&f), &f));
        let v = [a, b, cross(a, b)];
        let images = v.map(|v| apply(&f, v));
        let size = norm(images[0]);
        if size.is_nan() || size <= 0.0 {
            return *k;
        }
        let first = scale(images[0], 1.0 / size);
        let rest = sub(images[1], scale(first, dot(first, images[1])));
        let second = if norm(rest) > 1e-12 * size { scale(rest, 1.0 / norm(rest)) } else { any_normal(first) };
        let u = [first, second, cross(first, second)];
        let found: Mat3 = core::array::from_fn(|i| {
            core::array::from_fn(|c| {
                (0..3).map(|s| dot(u[s], images[s]).clamp(1.0 / self.most, 1.0 / self.least) * u[s][i] * v[s][c]).sum()
            })
        });
        product(&found, k)
    }

    /// In words where cells of a map are stretched beyond the range; `None` if nowhere.
    pub(super) fn exceeded(&self, d: &Distortion) -> Option<String> {
        if self.excess(d.stretch) <= 1.0 {
            return None;
        }
        let [low, high] = d.stretch;
        let worst = usize::from(high / self.most > self.least / low);
        let (found, at) = (d.stretch[worst], d.stretch_at[worst]);
        let [least, most] = self.range().map(number);
        Some(format!(
            "cells are {found:.2} times as long as asked for at {}, and stretch = [{least}, {most}]: no map that keeps to that range \
             without folding was found. Let orientation and wavelength vary more slowly, or give a wider range",
            position(at)
        ))
    }

    /// The factor by which a least and a greatest stretch leave the range, the worse of the two; at most 1 within it.
    pub(super) fn excess(&self, [low, high]: [f64; 2]) -> f64 {
        (self.least / low).max(high / self.most)
    }

    /// Whether the stretches of a Jacobian are in the range.
    fn holds(&self, stretches: Option<[f64; 2]>) -> bool {
        stretches.is_some_and(|[a, b]| a >= self.least && b <= self.most)
    }
}

/// The least and the greatest principal stretch of a cell that has the axes and lengths of `k` where it is not stretched; `None` where
/// cells are turned inside out.
pub(super) fn stretches(j: &Mat3, k: &Mat3) -> Option<[f64; 2]> {
    let f = product(j, &inverse(k));
    (determinant(&f) > 0.0).then(|| stretch(&f))
}

/// A unit vector at right angles to one.
fn any_normal(v: Vec3) -> Vec3 {
    let a = (0..3).fold(0, |m, i| if v[i].abs() < v[m].abs() { i } else { m });
    let mut e = [0.0; 3];
    e[a] = 1.0;
    let n = cross(v, e);
    scale(n, 1.0 / norm(n))
}

/// The map near to `solution` whose stretches are in a range, narrowed by a `margin`, in the cells of the grid of which a node `counts`.
pub(super) fn bounded(
    problem: &Problem,
    counts: &[bool],
    (range, margin): (Stretch, f64),
    solution: &Solution,
) -> Solution {
    let grid = *solution.grid();
    let mut values = solution.spline.at_nodes();
    let cells = GridCells::new(grid);
    let middles: Vec<Vec3> = (0..cells.len()).map(|c| cells.middle(c)).collect();
    let mut wound = vec![[[0.0; 3]; 3]; middles.len()];
    solution.winding.add_jacobians(&middles, &mut wound);
    let k: Vec<Mat3> = (0..cells.len()).into_par_iter().map(|c| cells.mean(c, |n| problem.target(n))).collect();
    let counts: Vec<bool> =
        (0..cells.len()).into_par_iter().map(|c| cells.corners(c).iter().any(|n| counts[*n])).collect();
    let [inner, enough] = [margin, margin - SLACK].map(|by| range.narrowed(by));
    let mut dual = vec![[[0.0; 3]; 3]; cells.len()];
    let mut penalty = 1.0;
    for round in 0..ROUNDS {
        checkpoint();
        let slopes = values.each_ref().map(|v| gradient(&grid, v));
        let jacobian = |c: usize| -> Mat3 { core::array::from_fn(|i| add(cells.slope(c, &slopes[i]), wound[c][i])) };
        let now: Vec<Mat3> = (0..cells.len()).into_par_iter().map(jacobian).collect();
        if (0..cells.len()).into_par_iter().all(|c| !counts[c] || enough.holds(stretches(&now[c], &k[c]))) {
            break;
        }
        if round > 0 && round % DOUBLED == 0 && penalty < DEAREST {
            penalty *= 2.0;
            dual.par_iter_mut().for_each(|d| *d = d.map(|r| scale(r, 0.5)));
        }
        // What the next map's gradient is to differ by from this one's.
        let off: Vec<Mat3> = dual
            .par_iter_mut()
            .enumerate()
            .map(|(c, dual)| {
                let (j, k) = (&now[c], &k[c]);
                let mut toward = *j;
                if counts[c] {
                    let lifted: Mat3 = core::array::from_fn(|i| add(j[i], dual[i]));
                    let near = inner.nearest(&lifted, k);
                    *dual = core::array::from_fn(|i| scale(sub(lifted[i], near[i]), KEPT));
                    toward = core::array::from_fn(|i| sub(near[i], dual[i]));
                }
                let step = |i: usize| add(sub(k[i], j[i]), scale(sub(toward[i], j[i]), penalty));
                core::array::from_fn(|i| scale(step(i), 1.0 / (1.0 + penalty)))
            })
            .collect();
        for (axis, values) in values.iter_mut().enumerate() {
            let change = problem.nearest(axis, &cells.on_edges(&off, axis));
            values.par_iter_mut().zip(&change).for_each(|(v, d)| *v += d);
        }
    }
    Solution { spline: MapSpline::through(grid, values), winding: solution.winding.clone(), branches: None }
}
