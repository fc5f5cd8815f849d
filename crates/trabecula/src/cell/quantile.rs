//! Fraction ↔ iso: the distribution of a cell's values, or of distances to its mid-surface, on the torus.
//!
//! V(t) = vol{f < t}. The torus is cut into N³ cubes. In each, f is replaced by a ramp with the exact mean of f over
//! the cube (each plane wave times its sinc factors) and the variance that its slope gives, so the error of a cube is
//! of fourth order in its edge; the ramps are summed exactly at every level of the table by two running sums.

use rayon::prelude::*;

use super::Part;
use super::connect::Function;
use super::series::Series;

/// Cubes along an axis for a wave of index one; finer waves get proportionally more.
const CUBES: usize = 96;
/// Levels of the table.
const LEVELS: usize = 1 << 14;

/// The distribution of a cell's values, tabulated.
pub(super) struct Quantile {
    /// First level and spacing of `lower`.
    start: f64,
    step: f64,
    /// V at the levels.
    lower: Vec<f64>,
    /// vol{|f| ≤ t} at t = i · step.
    sheet: Vec<f64>,
}

impl Quantile {
    pub(super) fn new(series: &Series) -> Quantile {
        let top = series
            .terms()
            .iter()
            .flat_map(|t| t.hkl)
            .map(i32::unsigned_abs)
            .max()
            .unwrap_or(1) as usize;
        let n = (CUBES * top.div_ceil(2)).clamp(CUBES, 192);
        let mean = series.averaged(1.0 / n as f64);
        Self::of(&|u, v, g| mean.gradients(u, v, g), n, series.amplitude())
    }

    /// The distribution of a function on the torus of at most `most` either way. `mean` gives its means over cubes of
    /// edge 1/n about phases, and their gradients.
    pub(super) fn of(mean: Function, n: usize, most: f64) -> Quantile {
        let h = 1.0 / n as f64;
        let most = most * (1.0 + 1e-9);
        let (start, step) = (-most, 2.0 * most / (LEVELS - 1) as f64);
        // Second differences of V at the levels: ramps start and stop. Layers are added in order: same sums always.
        let layers: Vec<Vec<(f64, f64)>> = (0..n)
            .into_par_iter()
            .map(|k| {
                // Every row is shifted along itself by another amount (multiples of plastic-number fractions), so that
                // cubes do not sample symmetric places alike and the errors of their ramps average out.
                let shift = |j: usize| {
                    (j as f64 * 0.7548776662466927 + k as f64 * 0.5698402909980532).fract()
                };
                let node = |i: usize, s: f64| (i as f64 + s) * h;
                let u: Vec<_> = (0..n * n)
                    .map(|i| {
                        [
                            node(i % n, shift(i / n)),
                            node(i / n, 0.397),
                            node(k, 0.633),
                        ]
                    })
                    .collect();
                let (mut v, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
                mean(&u, &mut v, &mut g);
                // Width of the uniform distribution with the variance Σ (g h)²/12 of the linear function.
                let width = |g: &[f64; 3]| (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt() * h;
                v.iter()
                    .zip(&g)
                    .map(|(&v, g)| (v, width(g).max(0.5 * step)))
                    .collect()
            })
            .collect();
        let (mut constant, mut slope) = (vec![0.0; LEVELS + 1], vec![0.0; LEVELS + 1]);
        let weight = h * h * h;
        for (v, w) in layers.into_iter().flatten() {
            let (a, b) = (v - 0.5 * w, v + 0.5 * w);
            let index = |t: f64| (((t - start) / step).ceil().max(0.0) as usize).min(LEVELS);
            let (s, c) = (weight / w, -weight * a / w);
            slope[index(a)] += s;
            constant[index(a)] += c;
            slope[index(b)] -= s;
            constant[index(b)] += weight - c;
        }
        let (mut c, mut s, mut last) = (0.0, 0.0, 0.0f64);
        let lower: Vec<f64> = (0..LEVELS)
            .map(|i| {
                (c, s) = (c + constant[i], s + slope[i]);
                last = (c + s * (start + step * i as f64)).clamp(last, 1.0);
                last
            })
            .collect();
        let at = |t: f64| interpolate(&lower, (t - start) / step);
        let sheet = (0..LEVELS / 2)
            .map(|i| step * i as f64)
            .map(|t| at(t) - at(-t))
            .collect();
        Quantile {
            start,
            step,
            lower,
            sheet,
        }
    }

    /// Solid fraction of the part at level t.
    pub(super) fn fraction(&self, part: Part, t: f64) -> f64 {
        match part {
            Part::Lower => interpolate(&self.lower, (t - self.start) / self.step),
            Part::Upper => 1.0 - interpolate(&self.lower, (t - self.start) / self.step),
            Part::Sheet => interpolate(&self.sheet, t.max(0.0) / self.step),
        }
    }

    /// Level t at which the part has the fraction, and dt/dfraction.
    pub(super) fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        match part {
            Part::Lower => {
                let (x, d) = invert(&self.lower, fraction);
                (self.start + self.step * x, self.step * d)
            }
            Part::Upper => {
                let (x, d) = invert(&self.lower, 1.0 - fraction);
                (self.start + self.step * x, -self.step * d)
            }
            Part::Sheet => {
                let (x, d) = invert(&self.sheet, fraction);
                (self.step * x, self.step * d)
            }
        }
    }
}

/// Piecewise linear value of an ascending table at index x, constant beyond its ends.
fn interpolate(table: &[f64], x: f64) -> f64 {
    let x = x.clamp(0.0, (table.len() - 1) as f64);
    let i = (x as usize).min(table.len() - 2);
    let s = x - i as f64;
    table[i] * (1.0 - s) + table[i + 1] * s
}

/// Index x at which the ascending table has value v, and dx/dv there (a slope over a few levels, so that it is smooth).
fn invert(table: &[f64], v: f64) -> (f64, f64) {
    let i = table.partition_point(|&t| t < v).clamp(1, table.len() - 1);
    let (a, b) = (table[i - 1], table[i]);
    let s = if b > a {
        ((v - a) / (b - a)).clamp(0.0, 1.0)
    } else {
        0.5
    };
    let (lo, hi) = (i.saturating_sub(8), (i + 7).min(table.len() - 1));
    let rise = table[hi] - table[lo];
    let slope = if rise > 0.0 {
        (hi - lo) as f64 / rise
    } else {
        0.0
    };
    ((i - 1) as f64 + s, slope)
}
