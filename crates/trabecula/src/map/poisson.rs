//! Least squares for a gradient on a grid: Σ w (Φⱼ − Φᵢ − h (Kᵢ + Kⱼ)/2)² / h² over the grid's edges is made least.
//!
//! With the weights of the trapezoid rule the normal equations are a second difference, mirrored at the faces, and the
//! cosines of the DCT-I are its eigenvectors: one transform forth and one back solve it (the fixed point of the iteration
//! of Rumpf and Pazos, Synthesis of spatially variant lattices, Opt. Express 20, 2012, in one step).

use std::sync::Arc;

use rayon::prelude::*;
use rustfft::{Fft, FftDirection, FftPlannerScalar, num_complex::Complex64};

use super::phase_grid::PhaseGrid;
use geometry::math::Vec3;
use geometry::progress::checkpoint;

/// The mirrored second difference on a grid, and its inverse.
pub(super) struct Poisson {
    grid: PhaseGrid,
    /// Transforms of twice the length less two, one for each axis. Scalar ones: the same bits on every processor.
    plans: [Arc<dyn Fft<f64>>; 3],
    /// 2 (1 − cos(π m / (n − 1))) / h² for each axis.
    modes: [Vec<f64>; 3],
}

impl Poisson {
    pub fn new(grid: PhaseGrid) -> Poisson {
        let mut planner = FftPlannerScalar::new();
        let plans = grid.shape.map(|n| planner.plan_fft(2 * (n - 1), FftDirection::Forward));
        let modes = core::array::from_fn(|a| {
            let n = grid.shape[a];
            let mode = |m: usize| {
                let angle = core::f64::consts::PI * m as f64 / (n - 1) as f64;
                4.0 * (angle / 2.0).sin().powi(2) / grid.step[a].powi(2)
            };
            (0..n).map(mode).collect()
        });
        Poisson { grid, plans, modes }
    }

    /// Φ of zero trapezoid mean whose steps along the edges of the grid are nearest to those of K.
    pub fn integrate(&self, k: &[Vec3]) -> Vec<f64> {
        let mut f = self.divergence(|a, n, m| 0.5 * (k[n][a] + k[m][a]));
        self.solve(&mut f, 0.0);
        f
    }

    /// The same for slopes along the edges above nodes.
    pub fn nearest(&self, slopes: &[Vec3]) -> Vec<f64> {
        let mut f = self.divergence(|a, n, m| slopes[n.min(m)][a]);
        self.solve(&mut f, 0.0);
        f
    }

    /// Minus the mirrored second difference.
    #[cfg(test)]
    pub fn apply(&self, v: &[f64]) -> Vec<f64> {
        let (g, strides) = (&self.grid, self.grid.strides());
        let [nx, ny, _] = g.shape;
        let over = g.step.map(|h| 1.0 / (h * h));
        let mut out = vec![0.0; v.len()];
        out.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            let at = [0, row % ny, row / ny];
            for (i, o) in out.iter_mut().enumerate() {
                let n = row * nx + i;
                for a in 0..3 {
                    let (c, last) = (if a == 0 { i } else { at[a] }, g.shape[a] - 1);
                    let below = if c == 0 { n + strides[a] } else { n - strides[a] };
                    let above = if c == last { n - strides[a] } else { n + strides[a] };
                    *o += over[a] * (2.0 * v[n] - v[below] - v[above]);
                }
            }
        });
        out
    }

    /// The right-hand side: minus the sum over a node's edges of the step along each, over h², edges mirrored at the faces.
    fn divergence(&self, slope: impl Fn(usize, usize, usize) -> f64 + Sync) -> Vec<f64> {
        let (g, strides) = (&self.grid, self.grid.strides());
        (0..g.len())
            .into_par_iter()
            .map(|n| {
                let at = g.index(n);
                let mut sum = 0.0;
                for a in 0..3 {
                    let edge = |m: usize| slope(a, n, m) / g.step[a];
                    sum += match at[a] {
                        0 => -2.0 * edge(n + strides[a]),
                        c if c + 1 == g.shape[a] => 2.0 * edge(n - strides[a]),
                        _ => edge(n - strides[a]) - edge(n + strides[a]),
                    };
                }
                sum
            })
            .collect()
    }

    /// Solves (−Δ + shift) Φ = f for zero trapezoid mean of what constants cannot give; f becomes Φ.
    pub fn solve(&self, f: &mut Vec<f64>, shift: f64) {
        let [nx, ny, nz] = self.grid.shape;
        let mut spare = vec![0.0; f.len()];
        self.transform(f, &mut spare);
        // Three turns of the axes bring their order back.
        let scale = 1.0 / (8 * (nx - 1) * (ny - 1) * (nz - 1)) as f64;
        f.par_chunks_mut(nx).enumerate().for_each(|(row, values)| {
            let yz = self.modes[1][row % ny] + self.modes[2][row / ny] + shift;
            for (v, m) in values.iter_mut().zip(&self.modes[0]) {
                let mode = m + yz;
                *v *= if mode > 0.0 { scale / mode } else { 0.0 };
            }
        });
        self.transform(f, &mut spare);
    }

    /// DCT-I along all three axes.
    fn transform(&self, f: &mut Vec<f64>, spare: &mut Vec<f64>) {
        for (a, plan) in self.plans.iter().enumerate() {
            checkpoint();
            let n = self.grid.shape[a];
            f.par_chunks_mut(2 * n).for_each_init(
                || vec![Complex64::default(); 2 * (n - 1) + plan.get_inplace_scratch_len()],
                |work, lines| pair(&**plan, n, lines, work),
            );
            turn(f, spare, n);
            core::mem::swap(f, spare);
        }
    }
}

/// DCT-I of one line or two lines of length `n` in place: the real and the imaginary part of one transform of the lines
/// continued evenly, both of which stay real.
fn pair(plan: &dyn Fft<f64>, n: usize, lines: &mut [f64], work: &mut [Complex64]) {
    let m = 2 * (n - 1);
    let (line, scratch) = work.split_at_mut(m);
    let (a, b) = lines.split_at_mut(n);
    for i in 0..n {
        line[i] = Complex64::new(a[i], b.get(i).copied().unwrap_or(0.0));
    }
    for i in n..m {
        line[i] = line[m - i];
    }
    plan.process_with_scratch(line, scratch);
    for i in 0..n {
        a[i] = line[i].re;
        if let Some(b) = b.get_mut(i) {
            *b = line[i].im;
        }
    }
}

/// Writes lines of length `n` across: (i, r) becomes (r, i).
fn turn(from: &[f64], to: &mut [f64], n: usize) {
    const SLAB: usize = 8;
    let rows = from.len() / n;
    to.par_chunks_mut(SLAB * rows).enumerate().for_each(|(slab, to)| {
        let width = to.len() / rows;
        for (r, line) in from.chunks_exact(n).enumerate() {
            let strip = &line[slab * SLAB..slab * SLAB + width];
            for (i, v) in strip.iter().enumerate() {
                to[i * rows + r] = *v;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::Aabb;

    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut s = seed;
        move || geometry::random::random(&mut s)
    }

    fn grid(shape: [usize; 3], size: Vec3) -> PhaseGrid {
        let b = Aabb { min: [-1.0, 0.5, 2.0], max: core::array::from_fn(|a| [-1.0, 0.5, 2.0][a] + size[a]) };
        PhaseGrid::over(&b, shape)
    }

    fn largest(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
    }

    /// The iteration of the paper with its signs put right and, for unequal steps, the weights 1/h²: its fixed point is
    /// the direct solution, and it converges to it from zero, for a random K, which no phase has as its gradient.
    #[test]
    fn the_iteration_of_the_paper_ends_where_the_direct_solution_is() {
        let g = grid([9, 11, 8], [2.0, 3.0, 1.4]);
        let mut random = noise(3);
        let k: Vec<Vec3> = (0..g.len()).map(|_| [random(), random(), random()]).collect();
        let direct = Poisson::new(g).integrate(&k);
        let strides = g.strides();
        let weight = g.step.map(|h| 1.0 / (h * h));
        let sweep = |f: &[f64]| -> Vec<f64> {
            (0..g.len())
                .map(|n| {
                    let at = g.index(n);
                    let each = |a: usize| {
                        let (h, s) = (g.step[a], strides[a]);
                        match at[a] {
                            0 => f[n + s] - h / 2.0 * (k[n + s][a] + k[n][a]),
                            c if c + 1 == g.shape[a] => f[n - s] + h / 2.0 * (k[n][a] + k[n - s][a]),
                            _ => (f[n - s] + f[n + s]) / 2.0 - h / 4.0 * (k[n + s][a] - k[n - s][a]),
                        }
                    };
                    (0..3).map(|a| weight[a] * each(a)).sum::<f64>() / weight.iter().sum::<f64>()
                })
                .collect()
        };
        // Rounding of sums of size one.
        assert!(largest(&sweep(&direct), &direct) < 1e-13);
        let mut f = vec![0.0; g.len()];
        for _ in 0..6000 {
            // Half a step: the plain iteration never damps the checkerboard.
            let next = sweep(&f);
            f.iter_mut().zip(&next).for_each(|(f, n)| *f = 0.5 * (*f + n));
        }
        let weights: Vec<f64> = (0..g.len()).map(|n| g.trapezoid(n)).collect();
        let mean = f.iter().zip(&weights).map(|(f, w)| f * w).sum::<f64>() / weights.iter().sum::<f64>();
        f.iter_mut().for_each(|f| *f -= mean);
        assert!(largest(&f, &direct) < 1e-10, "{}", largest(&f, &direct));
    }

    /// A wave of the grid is scaled by its eigenvalue; lengths that are prime or even are no exception.
    #[test]
    fn solving_undoes_the_operator() {
        for shape in [[5, 6, 7], [12, 18, 20], [33, 4, 3]] {
            let g = grid(shape, [2.0, 3.0, 1.4]);
            let p = Poisson::new(g);
            let mut random = noise(7);
            let mut f: Vec<f64> = (0..g.len()).map(|_| random()).collect();
            let whole: f64 = (0..g.len()).map(|n| g.trapezoid(n)).sum();
            let mean = (0..g.len()).map(|n| f[n] * g.trapezoid(n)).sum::<f64>() / whole;
            f.iter_mut().for_each(|f| *f -= mean);
            let mut back = p.apply(&f);
            p.solve(&mut back, 0.0);
            assert!(largest(&back, &f) < 1e-12, "{shape:?}");
        }
    }
}
