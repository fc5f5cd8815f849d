//! Geometric multigrid in single precision: the preconditioner.
//!
//! A coarse voxel has the mean weight of its eight voxels; where these are equal its element is the exact Galerkin product. Smoothing
//! is by Chebyshev polynomials of D⁻¹A, whose largest eigenvalue is bounded by that of one element (`element.rs`), so that nothing
//! is estimated. The cycle is symmetric.

use multiversion::multiversion;
use rayon::prelude::*;

use crate::cut_voxels::CutVoxels;
use crate::element::Element;
use crate::fields::{combine, in_pieces};
use crate::operator::Operator;

/// The smoother, two steps before and two after a coarse correction, damps eigenvalues from 1/RANGE of the largest on.
const RANGE: f64 = 6.0;
/// On the coarsest grid: range and steps, which solve it to a tenth.
const COARSEST: (f64, usize) = (400.0, 28);
/// No grid is coarser than this along an axis.
const LEAST: usize = 4;

/// A grid of the hierarchy and its fields.
struct Level<const NC: usize> {
    operator: Operator<f32, NC>,
    inverse_diagonal: Vec<f32>,
    solution: Vec<f32>,
    residual: Vec<f32>,
    step: Vec<f32>,
    /// The step that is being made while `step` is read.
    next: Vec<f32>,
    /// An upper bound of the eigenvalues of D⁻¹A.
    largest: f64,
}

/// A hierarchy of grids.
pub struct Multigrid<const NC: usize> {
    levels: Vec<Level<NC>>,
}

impl<const NC: usize> Multigrid<NC> {
    /// The hierarchy of a grid of weights, on whose finest grid some voxels have elements of their own: coarser ones have their weights.
    pub fn new(mut shape: [usize; 3], weights: &[f64], element: &Element, cut: &CutVoxels<f64>) -> Self {
        let mut weights: Vec<f32> = weights.iter().map(|w| *w as f32).collect();
        let mut element = element.clone();
        let common = element.largest_eigenvalue();
        let mut largest = cut.largest_eigenvalue(common);
        let mut cut = cut.single();
        let mut levels = Vec::new();
        loop {
            let next = coarsened(shape, &weights);
            let operator = Operator::new(shape, weights, &element, cut);
            let field = || vec![0f32; operator.len()];
            levels.push(Level {
                inverse_diagonal: operator.inverse_diagonal(&element),
                solution: field(),
                residual: field(),
                step: field(),
                next: field(),
                operator,
                largest,
            });
            let Some((coarse, means)) = next else { break };
            (shape, weights, element) = (coarse, means, element.doubled());
            (cut, largest) = (CutVoxels::none(), common);
        }
        Multigrid { levels }
    }

    /// An approximate solution of A x = r, zero at nodes without solid.
    pub fn precondition(&mut self, r: &[f64]) -> &[f32] {
        combine(&mut self.levels[0].residual, r, |_, r| r as f32);
        self.cycle(0);
        &self.levels[0].solution
    }

    /// One V-cycle from zero for the residual of a level.
    fn cycle(&mut self, at: usize) {
        let (fine, coarse) = self.levels.split_at_mut(at + 1);
        let level = &mut fine[at];
        let largest = level.largest;
        let Some(next) = coarse.first_mut() else {
            let mut rates = Chebyshev::new(largest, COARSEST.0);
            level.begin(rates.first());
            for step in 1..COARSEST.1 {
                level.smooth(if step == 1 { Solution::Begins } else { Solution::GoesOn }, rates.next());
            }
            return;
        };
        let mut rates = Chebyshev::new(largest, RANGE);
        level.begin(rates.first());
        level.smooth(Solution::Begins, rates.next());
        level.smooth(Solution::Stays, [0.0; 2]);
        restrict::<NC>(&level.residual, level.operator.shape, &mut next.residual, next.operator.shape);
        self.cycle(at + 1);
        let (fine, coarse) = self.levels.split_at_mut(at + 1);
        let (level, next) = (&mut fine[at], &coarse[0]);
        prolong::<NC>(&next.solution, next.operator.shape, &mut level.step, level.operator.shape);
        level.correct();
        let mut rates = Chebyshev::new(largest, RANGE);
        level.smooth(Solution::GoesOn, [0.0, rates.first()]);
        level.smooth(Solution::GoesOn, rates.next());
    }
}

/// The rates of Chebyshev's iteration on the eigenvalues from `largest` / `range` to `largest`.
struct Chebyshev {
    center: f64,
    half: f64,
    rho: f64,
}

impl Chebyshev {
    fn new(largest: f64, range: f64) -> Self {
        let (low, high) = (largest / range, largest);
        let (center, half) = (0.5 * (high + low), 0.5 * (high - low));
        Chebyshev { center, half, rho: half / center }
    }

    /// The share of the preconditioned residual in the first step.
    fn first(&self) -> f32 {
        (1.0 / self.center) as f32
    }

    /// The shares of the last step and of the preconditioned residual in the next one.
    fn next(&mut self) -> [f32; 2] {
        let next = 1.0 / (2.0 * self.center / self.half - self.rho);
        let shares = [next * self.rho, 2.0 * next / self.half];
        self.rho = next;
        shares.map(|v| v as f32)
    }
}

/// What becomes of the solution in a sweep.
#[derive(Clone, Copy, PartialEq)]
enum Solution {
    /// The sum of the last step and the next.
    Begins,
    /// The next step is added.
    GoesOn,
    /// The residual alone is wanted.
    Stays,
}

/// A plane of the fields of a level.
struct Plane<'a> {
    inverse_diagonal: &'a [f32],
    step: &'a [f32],
    residual: &'a mut [f32],
    solution: &'a mut [f32],
    next: &'a mut [f32],
}

impl<const NC: usize> Level<NC> {
    /// The first step of smoothing from zero.
    fn begin(&mut self, first: f32) {
        in_pieces([&mut self.step], [&self.residual, &self.inverse_diagonal], |[s], [r, d]| {
            for (s, (r, d)) in s.iter_mut().zip(r.iter().zip(d)) {
                *s = first * r * d;
            }
        });
    }

    /// Adds `step` to the solution, and leaves it zero where nothing is solid.
    fn correct(&mut self) {
        in_pieces([&mut self.step, &mut self.solution], [&self.inverse_diagonal], |[s, x], [d]| {
            for ((s, x), d) in s.iter_mut().zip(x).zip(d) {
                *s = if *d == 0.0 { 0.0 } else { *s };
                *x += *s;
            }
        });
    }

    /// Takes the last step off the residual and makes the next one: its shares are of the last step and of the preconditioned residual.
    fn smooth(&mut self, becomes: Solution, shares: [f32; 2]) {
        let Level { operator, inverse_diagonal, solution, residual, step, next, .. } = self;
        let plane = operator.plane();
        let fields = inverse_diagonal.chunks(plane).zip(step.chunks(plane));
        let fields = fields.zip(residual.chunks_mut(plane)).zip(solution.chunks_mut(plane)).zip(next.chunks_mut(plane));
        let of = |((((inverse_diagonal, step), residual), solution), next)| Plane {
            inverse_diagonal,
            step,
            residual,
            solution,
            next,
        };
        let mut planes: Vec<Plane> = fields.map(of).collect();
        operator.sweep(step, &mut planes, &|product, plane| advance(plane, product, becomes, shares));
        std::mem::swap(step, next);
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn advance(plane: &mut Plane, product: &[f32], becomes: Solution, [old, new]: [f32; 2]) {
    let n = product.len();
    let (d, s) = (&plane.inverse_diagonal[..n], &plane.step[..n]);
    let (r, x, next) = (&mut plane.residual[..n], &mut plane.solution[..n], &mut plane.next[..n]);
    match becomes {
        Solution::Stays => (0..n).for_each(|i| r[i] -= product[i]),
        Solution::Begins => {
            for i in 0..n {
                r[i] -= product[i];
                next[i] = old * s[i] + new * d[i] * r[i];
                x[i] = s[i] + next[i];
            }
        }
        Solution::GoesOn => {
            for i in 0..n {
                r[i] -= product[i];
                next[i] = old * s[i] + new * d[i] * r[i];
                x[i] += next[i];
            }
        }
    }
}

/// The grid of half the voxels along each axis, with mean weights; `None` for one that is not to be coarsened.
fn coarsened(shape: [usize; 3], weights: &[f32]) -> Option<([usize; 3], Vec<f32>)> {
    if shape.iter().any(|n| n % 2 == 1 || n / 2 < LEAST) {
        return None;
    }
    let half = shape.map(|n| n / 2);
    let mut out = Vec::with_capacity(half.iter().product());
    for z in 0..half[2] {
        for y in 0..half[1] {
            for x in 0..half[0] {
                let mut sum = 0f32;
                for i in 0..8 {
                    let (x, y, z) = (2 * x + (i & 1), 2 * y + (i >> 1 & 1), 2 * z + (i >> 2));
                    sum += weights[(z * shape[1] + y) * shape[0] + x];
                }
                out.push(sum / 8.0);
            }
        }
    }
    Some((half, out))
}

/// The transpose of `prolong`.
fn restrict<const NC: usize>(fine: &[f32], shape: [usize; 3], coarse: &mut [f32], half: [usize; 3]) {
    let [nx, ny, nz] = shape;
    let (plane, small) = (nx * ny, half[0] * half[1]);
    coarse.par_chunks_mut(NC * small).enumerate().for_each_init(
        || (vec![0f32; plane], vec![0f32; nx]),
        |(sheet, line), (z, out)| {
            let zs = [(2 * z + nz - 1) % nz, 2 * z, 2 * z + 1];
            for c in 0..NC {
                let at = |z: usize| &fine[(z * NC + c) * plane..(z * NC + c + 1) * plane];
                let [a, b, d] = zs.map(at);
                for (i, s) in sheet.iter_mut().enumerate() {
                    *s = b[i] + 0.5 * (a[i] + d[i]);
                }
                for y in 0..half[1] {
                    let [a, b, d] = [(2 * y + ny - 1) % ny, 2 * y, 2 * y + 1].map(|y| &sheet[y * nx..(y + 1) * nx]);
                    for (i, s) in line.iter_mut().enumerate() {
                        *s = b[i] + 0.5 * (a[i] + d[i]);
                    }
                    let row = &mut out[c * small + y * half[0]..c * small + (y + 1) * half[0]];
                    for (x, o) in row.iter_mut().enumerate() {
                        *o = line[2 * x] + 0.5 * (line[(2 * x + nx - 1) % nx] + line[2 * x + 1]);
                    }
                }
            }
        },
    );
}

/// Trilinear interpolation from a coarse grid.
fn prolong<const NC: usize>(coarse: &[f32], half: [usize; 3], fine: &mut [f32], shape: [usize; 3]) {
    let [nx, ny, _] = shape;
    let (plane, small) = (nx * ny, half[0] * half[1]);
    fine.par_chunks_mut(NC * plane).enumerate().for_each_init(
        || vec![0f32; half[0] + 1],
        |line, (z, out)| {
            let zs = [z / 2, (z.div_ceil(2)) % half[2]];
            for c in 0..NC {
                let [a, b] = zs.map(|z| &coarse[(z * NC + c) * small..(z * NC + c + 1) * small]);
                for y in 0..ny {
                    let ys = [y / 2 * half[0], (y.div_ceil(2)) % half[1] * half[0]];
                    for x in 0..half[0] {
                        let sum = |of: &[f32]| of[ys[0] + x] + of[ys[1] + x];
                        line[x] = 0.25 * (sum(a) + sum(b));
                    }
                    line[half[0]] = line[0];
                    let row = &mut out[c * plane + y * nx..c * plane + (y + 1) * nx];
                    for (x, o) in row.iter_mut().enumerate() {
                        *o = 0.5 * (line[x / 2] + line[x.div_ceil(2)]);
                    }
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restriction_is_the_transpose_of_interpolation() {
        let (shape, half) = ([8, 12, 16], [4, 6, 8]);
        let mut seed = 3u64;
        let mut random =
            |n: usize| -> Vec<f32> { (0..n).map(|_| geometry::random::random(&mut seed) as f32).collect() };
        let (fine, coarse) = (random(3 * 8 * 12 * 16), random(3 * 4 * 6 * 8));
        let (mut down, mut up) = (vec![0f32; coarse.len()], vec![0f32; fine.len()]);
        restrict::<3>(&fine, shape, &mut down, half);
        prolong::<3>(&coarse, half, &mut up, shape);
        let (a, b) = (crate::fields::dot(&down, &coarse), crate::fields::dot(&fine, &up));
        assert!((a - b).abs() < 1e-4 * a.abs().max(1.0), "{a} {b}");
    }
}
