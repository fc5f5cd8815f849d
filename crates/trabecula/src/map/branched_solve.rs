//! Least squares for phases with branches: Σ w |M⁻¹ uⱼ − uᵢ − h (Kᵢ + S⁻¹Kⱼ)/2|² / h² over the grid's edges, M: u → S u + t what
//! phases become along an edge (`branch_cuts`).
//!
//! By conjugate gradients on all three phases together, with multigrid as preconditioner that turns phases where they cross cuts.
//! What remains free are the whole numbers t. The error is a quadratic form in them, and those near its least are tried.

use rayon::prelude::*;

use super::branch_cuts::{BranchCuts, PhaseMotion};
use super::conjugate_gradients::{self, Solved, sums};
use super::multigrid::Multigrid;
use super::phase_grid::PhaseGrid;
use geometry::math::{IDENTITY, Vec3, add, apply, dot, scale, sub, transpose};

/// The error, relative to that of no phases, at which conjugate gradients end: of a map, and of what tells which whole numbers have the
/// least error.
const RESIDUAL: f64 = 1e-6;
const ROUGH: f64 = 1e-3;
/// Most steps of conjugate gradients.
const STEPS: usize = 600;

/// An edge across a cut: its lower node and axis, and what phases become along it.
struct CutCrossing {
    node: usize,
    axis: usize,
    to: PhaseMotion,
}

/// The problem on a grid.
pub(super) struct Branched<'a> {
    grid: &'a PhaseGrid,
    k: &'a [Vec<Vec3>; 3],
    /// What the square of a difference along each edge counts.
    edges: [Vec<f64>; 3],
    crossings: Vec<CutCrossing>,
    multigrid: Multigrid,
}

impl<'a> Branched<'a> {
    /// With what edges count, and the cuts.
    pub fn new(grid: &'a PhaseGrid, k: &'a [Vec<Vec3>; 3], edges: [Vec<f64>; 3], cuts: &BranchCuts) -> Branched<'a> {
        let strides = grid.strides();
        let mut crossings = Vec::new();
        for (axis, stride) in strides.into_iter().enumerate() {
            let crossed = |n: &usize| grid.index(*n)[axis] + 1 < grid.shape[axis] && cuts.any([*n, n + stride]);
            let crossing = |node| CutCrossing { node, axis, to: cuts.between([node, node + stride]) };
            let found = (0..grid.len()).into_par_iter().filter(crossed).map(crossing);
            crossings.par_extend(found);
        }
        let turn = |ends| cuts.any(ends).then(|| cuts.between(ends).turn);
        let multigrid = Multigrid::new(grid.shape, grid.step, edges.clone(), Vec::new()).turned(turn);
        Branched { grid, k, edges, crossings, multigrid }
    }

    /// Takes the translations of the same cuts anew.
    fn translate(&mut self, cuts: &BranchCuts) {
        let strides = self.grid.strides();
        self.crossings.par_iter_mut().for_each(|c| c.to = cuts.between([c.node, c.node + strides[c.axis]]));
    }

    /// The phases at the nodes for the translations of the cuts, and how many steps they took.
    pub fn phases(&mut self, cuts: &BranchCuts) -> (Vec<Vec3>, usize) {
        self.translate(cuts);
        let (u, _, taken) = self.fit(&self.steps(|m| m.by, true), RESIDUAL);
        (u, taken)
    }

    /// What phases are to rise by along each edge above a node, in the branch of the node: of the target, or of the translations alone.
    fn steps(&self, with: impl Fn(&PhaseMotion) -> Vec3, target: bool) -> [Vec<Vec3>; 3] {
        let (grid, strides) = (self.grid, self.grid.strides());
        let at = |n: usize, a: usize| [0, 1, 2].map(|i| self.k[i][n][a]);
        let mut steps: [Vec<Vec3>; 3] = core::array::from_fn(|a| {
            let one = |n: usize| {
                if !target || grid.index(n)[a] + 1 == grid.shape[a] {
                    return [0.0; 3];
                }
                scale(add(at(n, a), at(n + strides[a], a)), 0.5 * grid.step[a])
            };
            (0..grid.len()).into_par_iter().map(one).collect()
        });
        for c in &self.crossings {
            let (a, n) = (c.axis, c.node);
            let back = transpose(&c.to.turn);
            let mut s = apply(&back, with(&c.to));
            if target {
                s = add(s, scale(add(at(n, a), apply(&back, at(n + strides[a], a))), 0.5 * grid.step[a]));
            }
            steps[a][n] = s;
        }
        steps
    }

    /// The phases at the nodes to a residual, what is left of the steps along edges, and how many steps it took.
    fn fit(&self, steps: &[Vec<Vec3>; 3], residual: f64) -> (Vec<Vec3>, [Vec<Vec3>; 3], usize) {
        let (strides, len) = (self.grid.strides(), self.grid.len());
        let mut right = vec![[0.0; 3]; len];
        for (a, stride) in strides.into_iter().enumerate() {
            let of = |n: usize| scale(steps[a][n], self.edges[a][n]);
            right.par_iter_mut().enumerate().for_each(|(n, r)| {
                *r = sub(*r, of(n));
                if let Some(m) = n.checked_sub(stride) {
                    *r = add(*r, of(m));
                }
            });
        }
        // In the branch of the upper node.
        for c in &self.crossings {
            let (s, m) = (scale(steps[c.axis][c.node], self.edges[c.axis][c.node]), c.node + strides[c.axis]);
            right[m] = add(right[m], sub(apply(&c.to.turn, s), s));
        }
        let columns: Vec<f64> = (0..3).flat_map(|i| right.iter().map(move |v| v[i])).collect();
        let operator = |x: &[f64], out: &mut [f64]| self.multigrid.apply(x, out);
        let Solved { x, steps: taken, .. } = conjugate_gradients::solve(
            columns,
            vec![0.0; 3 * len],
            operator,
            self.multigrid.cycle(),
            (residual, STEPS),
        );
        let u: Vec<Vec3> = (0..len).map(|n| [x[n], x[len + n], x[2 * len + n]]).collect();
        let mut left: [Vec<Vec3>; 3] = core::array::from_fn(|a| {
            let one = |n: usize| match self.grid.index(n)[a] + 1 < self.grid.shape[a] {
                true => sub(sub(u[n + strides[a]], u[n]), steps[a][n]),
                false => [0.0; 3],
            };
            (0..len).into_par_iter().map(one).collect()
        });
        for c in &self.crossings {
            let m = c.node + strides[c.axis];
            left[c.axis][c.node] = sub(sub(apply(&transpose(&c.to.turn), u[m]), u[c.node]), steps[c.axis][c.node]);
        }
        (u, left, taken)
    }

    /// The sum of products of steps, as errors count.
    fn product(&self, a: &[Vec<Vec3>; 3], b: &[Vec<Vec3>; 3]) -> f64 {
        let of = |axis: usize| sums(self.grid.len(), |n| self.edges[axis][n] * dot(a[axis][n], b[axis][n]));
        (0..3).map(of).sum()
    }
}

/// The whole numbers that are free, and the error of the phases for them.
pub(super) struct FreeIntegers {
    /// The cut and the axis of each.
    pub free: Vec<(usize, usize)>,
    /// The quadratic form of the error in (1, n), row by row.
    pub form: Vec<f64>,
}

impl FreeIntegers {
    /// Of the phases with these gradients over cuts that have no translations yet.
    pub fn new(grid: &PhaseGrid, k: &[Vec<Vec3>; 3], edges: [Vec<f64>; 3], cuts: &mut BranchCuts) -> FreeIntegers {
        let free = free(cuts);
        let mut problem = Branched::new(grid, k, edges, cuts);
        let left = |problem: &Branched, steps: &[Vec<Vec3>; 3]| problem.fit(steps, ROUGH).1;
        let mut all = vec![left(&problem, &problem.steps(|_| [0.0; 3], true))];
        for (line, axis) in &free {
            let plain = cuts.step(*line);
            let mut by = [0.0; 3];
            by[*axis] = 1.0;
            cuts.set(*line, PhaseMotion { by, ..plain });
            problem.translate(cuts);
            cuts.set(*line, plain);
            all.push(left(&problem, &problem.steps(|m| m.by, false)));
        }
        let pairs = all.iter().flat_map(|a| all.iter().map(move |b| (a, b)));
        FreeIntegers { free, form: pairs.map(|(a, b)| problem.product(a, b)).collect() }
    }

    /// Gives cuts their translations.
    pub fn set(&self, numbers: &[i64], cuts: &mut BranchCuts) {
        (0..cuts.len()).for_each(|line| cuts.set(line, PhaseMotion { by: [0.0; 3], ..cuts.step(line) }));
        for ((line, axis), n) in self.free.iter().zip(numbers) {
            let mut step = cuts.step(*line);
            step.by[*axis] = *n as f64;
            cuts.set(*line, step);
        }
    }
}

/// The numbers that are free: of each cut those across the axis of its rotation. Phases are free to move across the axis of the first
/// rotation, which does for its cut.
fn free(cuts: &BranchCuts) -> Vec<(usize, usize)> {
    let turned = |line: usize, a: usize| cuts.step(line).turn[a] != IDENTITY[a];
    let first = (0..cuts.len()).find(|line| (0..3).any(|a| turned(*line, a)));
    let mut free = Vec::new();
    for line in (0..cuts.len()).filter(|line| Some(*line) != first) {
        let plain = (0..3).all(|a| !turned(line, a));
        free.extend((0..3).filter(|a| plain || turned(line, *a)).map(|a| (line, a)));
    }
    free
}

#[cfg(test)]
mod tests {
    use super::super::edge_squares::weights;
    use super::*;
    use core::f64::consts::TAU;
    use geometry::math::{Aabb, unit};

    /// Axes that come back turned by a quarter round three lines: the grid, gradients, what edges count, and the cuts.
    fn example(fine: usize) -> (PhaseGrid, [Vec<Vec3>; 3], [Vec<f64>; 3], BranchCuts) {
        let b = Aabb { min: [-5.0, -4.0, 0.0], max: [5.0, 6.0, 2.0] };
        let grid = PhaseGrid::over(&b, [20 * fine + 1, 20 * fine + 2, 4 * fine + 1]);
        let at = [[1.63, 0.41], [-2.17, 0.33], [0.48, 3.57]];
        let mut lines = at.map(|[x, y]| vec![[x, y, -1.0], [x, y, 1.0], [x, y, 3.0]]);
        let mut cuts = BranchCuts::new(&grid, &mut lines);
        let quarter = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        (0..3).for_each(|line| cuts.set(line, PhaseMotion { turn: quarter, by: [0.0; 3] }));
        let root = |n: usize| {
            let [x, y, _] = grid.node(n);
            let from = |p: [f64; 2]| ((x - p[0]).hypot(y - p[1]) / 0.8).min(1.0).powi(2).max(1e-3);
            at.map(from).iter().product::<f64>() * (-3.0 * fine as f64 * (x.abs() - 4.0).max(0.0)).exp().max(1e-3)
        };
        let roots: Vec<f64> = (0..grid.len()).map(root).collect();
        let one = |n: usize| {
            let [x, y, z] = grid.node(n);
            let (s, c) = (TAU * (0.03 * x * y + 0.05 * z)).sin_cos();
            [[c, s, 0.0], [-s, c, 0.0], unit([0.1 * x, 0.0, 1.0])]
        };
        let k = core::array::from_fn(|i| (0..grid.len()).map(|n| one(n)[i]).collect());
        (grid, k, weights(grid, &roots, None), cuts)
    }

    /// Cuts cost no steps, however fine the grid is.
    #[test]
    fn steps_do_not_grow_with_the_grid() {
        let taken = [1, 2, 4].map(|fine| {
            let (grid, k, edges, cuts) = example(fine);
            Branched::new(&grid, &k, edges, &cuts).phases(&cuts).1
        });
        assert!(taken.iter().all(|n| *n <= 12), "{taken:?}");
    }

    /// What whole numbers add to the error, by which the best are found, is known to a hundredth.
    #[test]
    fn the_error_of_whole_numbers_is_that_of_their_phases() {
        let (grid, k, edges, mut cuts) = example(2);
        let numbers = FreeIntegers::new(&grid, &k, edges.clone(), &mut cuts);
        let mut problem = Branched::new(&grid, &k, edges, &cuts);
        for n in [[0, 0, 1, 0], [1, 0, 0, 1], [2, -1, 1, 3], [-1, 2, 2, 0]] {
            numbers.set(&n, &mut cuts);
            problem.translate(&cuts);
            let (_, left, _) = problem.fit(&problem.steps(|m| m.by, false), RESIDUAL);
            let direct = problem.product(&left, &left);
            let at = |i: usize| n[i] as f64;
            let form: f64 = (0..16).map(|i| at(i / 4) * at(i % 4) * numbers.form[(i / 4 + 1) * 5 + i % 4 + 1]).sum();
            assert!((form / direct - 1.0).abs() < 0.01, "{n:?}: {form}, {direct}");
        }
    }
}
