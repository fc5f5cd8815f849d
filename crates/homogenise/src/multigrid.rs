//! Geometric multigrid in single precision: the preconditioner.
//!
//! A coarse voxel has the mean weight of its eight voxels; where these are equal its element is the exact Galerkin product. Smoothing
//! is by Chebyshev polynomials of D⁻¹A, whose largest eigenvalue is bounded by that of one element (`element.rs`), so that nothing
//! is estimated. The cycle is symmetric.

use rayon::prelude::*;

use crate::element::Element;
use crate::fields::combine;
use crate::operator::Operator;

/// The smoother damps eigenvalues from 1/RANGE of the largest on.
const RANGE: f64 = 6.0;
/// Steps of smoothing before and after a coarse correction.
const STEPS: usize = 2;
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
    product: Vec<f32>,
}

/// A hierarchy of grids.
pub struct Multigrid<const NC: usize> {
    levels: Vec<Level<NC>>,
    largest: f64,
}

impl<const NC: usize> Multigrid<NC> {
    /// The hierarchy of a grid of weights.
    pub fn new(mut shape: [usize; 3], weights: &[f64], element: &Element) -> Self {
        let mut weights: Vec<f32> = weights.iter().map(|w| *w as f32).collect();
        let mut element = element.clone();
        let largest = element.largest_eigenvalue();
        let mut levels = Vec::new();
        loop {
            let next = coarsened(shape, &weights);
            let operator = Operator::new(shape, weights, &element);
            let field = || vec![0f32; operator.len()];
            levels.push(Level {
                inverse_diagonal: operator.inverse_diagonal(&element),
                solution: field(),
                residual: field(),
                step: field(),
                product: field(),
                operator,
            });
            let Some((coarse, means)) = next else { break };
            (shape, weights, element) = (coarse, means, element.doubled());
        }
        Multigrid { levels, largest }
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
        let Some(next) = coarse.first_mut() else {
            let (range, steps) = COARSEST;
            level.solution.fill(0.0);
            return level.smooth(self.largest, range, steps, false);
        };
        level.solution.par_chunks_mut(1 << 14).for_each(|p| p.fill(0.0));
        level.smooth(self.largest, RANGE, STEPS, true);
        restrict::<NC>(&level.residual, level.operator.shape, &mut next.residual, next.operator.shape);
        self.cycle(at + 1);
        let (fine, coarse) = self.levels.split_at_mut(at + 1);
        let (level, next) = (&mut fine[at], &coarse[0]);
        prolong::<NC>(&next.solution, next.operator.shape, &mut level.step, level.operator.shape);
        combine(&mut level.step, &level.inverse_diagonal, |s, d| if d == 0.0 { 0.0 } else { s });
        combine(&mut level.solution, &level.step, |x, s| x + s);
        level.operator.apply(&level.step, &mut level.product);
        combine(&mut level.residual, &level.product, |r, p| r - p);
        level.smooth(self.largest, RANGE, STEPS, false);
    }
}

impl<const NC: usize> Level<NC> {
    /// Chebyshev's iteration on the eigenvalues from `largest` / `range` to `largest`. The residual is that before the last step,
    /// unless it is `kept` up to date.
    fn smooth(&mut self, largest: f64, range: f64, steps: usize, kept: bool) {
        let (low, high) = (largest / range, largest);
        let (center, half) = (0.5 * (high + low), 0.5 * (high - low));
        let sigma = center / half;
        let mut rho = 1.0 / sigma;
        let Level { operator, inverse_diagonal, solution, residual, step, product } = self;
        let first = (1.0 / center) as f32;
        step.par_chunks_mut(1 << 14)
            .zip(residual.par_chunks(1 << 14))
            .zip(inverse_diagonal.par_chunks(1 << 14))
            .for_each(|((s, r), d)| s.iter_mut().zip(r.iter().zip(d)).for_each(|(s, (r, d))| *s = first * r * d));
        combine(solution, step, |x, s| x + s);
        for done in 1..=steps {
            if done == steps && !kept {
                return;
            }
            operator.apply(step, product);
            combine(residual, product, |r, p| r - p);
            if done == steps {
                return;
            }
            let next = 1.0 / (2.0 * sigma - rho);
            let (old, new) = ((next * rho) as f32, (2.0 * next / half) as f32);
            rho = next;
            step.par_chunks_mut(1 << 14)
                .zip(residual.par_chunks(1 << 14))
                .zip(inverse_diagonal.par_chunks(1 << 14))
                .for_each(|((s, r), d)| {
                    s.iter_mut().zip(r.iter().zip(d)).for_each(|(s, (r, d))| *s = old * *s + new * r * d);
                });
            combine(solution, step, |x, s| x + s);
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
