//! Fraction ↔ iso: the distribution of a cell's values, or of distances to its mid-surface, on the torus.
//!
//! V(t) = vol{f < t}. The torus is cut into N³ cubes. In each, f is replaced by a ramp with the exact mean of f over
//! the cube (each plane wave times its sinc factors) and the variance that its slope gives, so the error of a cube is
//! of fourth order in its edge; the ramps are summed exactly at every level of the table by two running sums.

use core::ops::Range;

use rayon::prelude::*;

use super::Part;
use super::series::Series;
use geometry::math::Vec3;

/// Cubes along an axis for a wave of index one; finer waves get proportionally more.
const CUBES: usize = 96;
/// Levels of the table.
const LEVELS: usize = 1 << 14;
/// Layers of cubes that are added up as one.
const SLAB: usize = 16;

/// The distribution of a cell's values, tabulated.
pub(super) struct Quantile {
    /// First level and spacing of `lower`.
    start: f64,
    step: f64,
    /// V at the levels.
    lower: Ascending,
    /// vol{|f| ≤ t} at t = i · step.
    sheet: Ascending,
}

/// Ascending shares at equal steps of the level.
struct Ascending {
    shares: Vec<f64>,
    /// How many shares are less than i / LEVELS: where a search for one begins, and where it ends.
    guide: Vec<u32>,
}

/// A function on rows: phases along x, phases along y and z, values, gradients.
pub(super) type RowFunction<'a> = &'a (dyn Fn(&[f64], [f64; 2], &mut [f64], &mut [Vec3]) + Sync);

impl Quantile {
    pub(super) fn new(series: &Series) -> Quantile {
        let n = (CUBES * series.top().div_ceil(2)).clamp(CUBES, 192);
        let mean = series.averaged(1.0 / n as f64);
        Self::of(&|x, yz, v, g| mean.row(x, yz, v, g), n, series.amplitude())
    }

    /// The distribution of a function on the torus with values in [−most, most]. `mean` gives, for rows along x at
    /// some y and z, its means over cubes of edge 1/n about phases, and their gradients.
    pub(super) fn of(mean: RowFunction, n: usize, most: f64) -> Quantile {
        let h = 1.0 / n as f64;
        let most = most * (1.0 + 1e-9);
        let (start, step) = (-most, 2.0 * most / (LEVELS - 1) as f64);
        // Second differences of V at the levels: where ramps start and stop. Slabs of fixed thickness are added in their
        // order: the same sums for any number of threads.
        let weight = h * h * h;
        let slab = |layers: Range<usize>| {
            let (mut constant, mut slope) = (vec![0.0; LEVELS + 1], vec![0.0; LEVELS + 1]);
            let (mut v, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
            for (k, j) in layers.flat_map(|k| (0..n).map(move |j| (k, j))) {
                // Every row is shifted along itself by another amount (multiples of plastic-number fractions), so that
                // cubes do not sample symmetric positions alike and the errors of their ramps average out.
                let shift = (j as f64 * 0.7548776662466927 + k as f64 * 0.5698402909980532).fract();
                let x: Vec<f64> = (0..n).map(|i| (i as f64 + shift) * h).collect();
                let at = [(j as f64 + 0.397) * h, (k as f64 + 0.633) * h];
                mean(&x, at, &mut v, &mut g);
                for (&v, g) in v.iter().zip(&g) {
                    // Width of the uniform distribution with the variance Σ (g h)²/12 of the linear function.
                    let w = ((g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt() * h).max(0.5 * step);
                    let (a, b) = (v - 0.5 * w, v + 0.5 * w);
                    let index = |t: f64| (((t - start) / step).ceil().max(0.0) as usize).min(LEVELS);
                    let (s, c) = (weight / w, -weight * a / w);
                    slope[index(a)] += s;
                    constant[index(a)] += c;
                    slope[index(b)] -= s;
                    constant[index(b)] += weight - c;
                }
            }
            (constant, slope)
        };
        let slabs: Vec<_> =
            (0..n).step_by(SLAB).collect::<Vec<_>>().into_par_iter().map(|k| slab(k..(k + SLAB).min(n))).collect();
        let (mut constant, mut slope) = (vec![0.0; LEVELS + 1], vec![0.0; LEVELS + 1]);
        for (c, s) in slabs {
            constant.iter_mut().zip(c).for_each(|(sum, c)| *sum += c);
            slope.iter_mut().zip(s).for_each(|(sum, s)| *sum += s);
        }
        let (mut c, mut s, mut last) = (0.0, 0.0, 0.0f64);
        let lower: Vec<f64> = (0..LEVELS)
            .map(|i| {
                (c, s) = (c + constant[i], s + slope[i]);
                last = (c + s * (start + step * i as f64)).clamp(last, 1.0);
                last
            })
            .collect();
        let lower = Ascending::new(lower);
        let at = |t: f64| lower.interpolate((t - start) / step);
        let sheet = (0..LEVELS / 2).map(|i| step * i as f64).map(|t| at(t) - at(-t)).collect();
        Quantile { start, step, sheet: Ascending::new(sheet), lower }
    }

    /// Solid fraction of the part at level t.
    pub(super) fn fraction(&self, part: Part, t: f64) -> f64 {
        match part {
            Part::Lower => self.lower.interpolate((t - self.start) / self.step),
            Part::Upper => 1.0 - self.lower.interpolate((t - self.start) / self.step),
            Part::Sheet => self.sheet.interpolate(t.max(0.0) / self.step),
        }
    }

    /// Level t at which the part has the fraction, and dt/dfraction.
    pub(super) fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        match part {
            Part::Lower => {
                let (x, d) = self.lower.invert(fraction);
                (self.start + self.step * x, self.step * d)
            }
            Part::Upper => {
                let (x, d) = self.lower.invert(1.0 - fraction);
                (self.start + self.step * x, -self.step * d)
            }
            Part::Sheet => {
                let (x, d) = self.sheet.invert(fraction);
                (self.step * x, self.step * d)
            }
        }
    }
}

/// Fine cubes along an axis, and along an edge of the blocks that are decided as a whole.
const FINE: usize = 192;
const BLOCK: usize = 4;

/// The solid fraction at one level, to about 1e-7 where the level is not critical: only cubes near the surface are
/// evaluated, and each holds the exact volume under the plane of its mean and slope, so that what is left is the
/// curvature in clipped cubes, of third order in their edge. `None` for series so fine or so long that it would take
/// more than some hundredths of a second.
pub(super) fn fraction(series: &Series, part: Part, t: f64) -> Option<f64> {
    if series.top() > 2 || series.terms().len() > 64 {
        return None;
    }
    Some(match part {
        Part::Lower => below(series, t),
        Part::Upper => 1.0 - below(series, t),
        Part::Sheet => below(series, t) - below(series, -t),
    })
}

/// vol{f < t} on the torus.
fn below(series: &Series, t: f64) -> f64 {
    let blocks = FINE / BLOCK;
    let (wide, h) = (1.0 / blocks as f64, 1.0 / FINE as f64);
    let mean = series.averaged(h);
    // How far f may be from linear at the corner of a block.
    let bend = series.curvature() * 3.0 * wide * wide / 8.0;
    let centres: Vec<f64> = (0..blocks).map(|i| (i as f64 + 0.5) * wide).collect();
    let row = |n: usize| {
        let (y, z) = (centres[n % blocks], centres[n / blocks]);
        let (mut v, mut g) = (vec![0.0; blocks], vec![[0.0; 3]; blocks]);
        series.row(&centres, [y, z], &mut v, &mut g);
        let mut volume = 0.0;
        let mut x = Vec::with_capacity(FINE);
        for (i, (v, g)) in v.iter().zip(&g).enumerate() {
            let reach = g.iter().map(|g| g.abs()).sum::<f64>() * wide / 2.0 + bend;
            if (v - t).abs() <= reach {
                x.extend((0..BLOCK).map(|a| ((i * BLOCK + a) as f64 + 0.5) * h));
            } else if *v < t {
                volume += wide.powi(3);
            }
        }
        let (mut v, mut g) = (vec![0.0; x.len()], vec![[0.0; 3]; x.len()]);
        for cube in 0..BLOCK * BLOCK {
            let middle = |c: f64, i: usize| c + (i as f64 + 0.5) * h - wide / 2.0;
            let at = [middle(y, cube % BLOCK), middle(z, cube / BLOCK)];
            mean.row(&x, at, &mut v, &mut g);
            let parts = v.iter().zip(&g);
            volume += h.powi(3) * parts.map(|(v, g)| under_plane(g, h, t - v)).sum::<f64>();
        }
        volume
    };
    // Summed in order: the same for any number of threads.
    let rows: Vec<f64> = (0..blocks * blocks).into_par_iter().map(row).collect();
    rows.iter().sum()
}

/// The share of a cube of edge h about its middle in which g · x < s.
fn under_plane(g: &[f64; 3], h: f64, s: f64) -> f64 {
    let g = g.map(|g| g.abs() * h);
    let largest = g[0].max(g[1]).max(g[2]);
    if s.abs() >= (g[0] + g[1] + g[2]) / 2.0 {
        return if s > 0.0 { 1.0 } else { 0.0 };
    }
    // Slopes below a hundredth of the largest are raised to it: widths add up in squares.
    let [a, b, c] = g.map(|g| g.max(0.01 * largest) / 2.0);
    let cube = |v: f64| v.max(0.0).powi(3);
    let pair = |v: f64| cube(v + c) - cube(v - c);
    let sum = pair(s + a + b) - pair(s + a - b) - pair(s - a + b) + pair(s - a - b);
    (sum / (48.0 * a * b * c)).clamp(0.0, 1.0)
}

impl Ascending {
    fn new(shares: Vec<f64>) -> Ascending {
        let below = |i: usize| shares.partition_point(|t| *t < i as f64 / LEVELS as f64) as u32;
        let guide = (0..=LEVELS).map(below).collect();
        Ascending { shares, guide }
    }

    /// Piecewise linear value at index x, constant beyond the ends.
    fn interpolate(&self, x: f64) -> f64 {
        let table = &self.shares;
        let x = x.clamp(0.0, (table.len() - 1) as f64);
        let i = (x as usize).min(table.len() - 2);
        let s = x - i as f64;
        table[i] * (1.0 - s) + table[i + 1] * s
    }

    /// Index x of the value v, and dx/dv there (a slope over a few levels, so that it is smooth).
    fn invert(&self, v: f64) -> (f64, f64) {
        let table = &self.shares;
        // A power of two: the product is exact.
        let k = ((v * LEVELS as f64) as usize).min(LEVELS - 1);
        let [from, to] = [self.guide[k], self.guide[k + 1]].map(|i| i as usize);
        // Beyond the last share, as at v > 1, none is greater.
        let to = if k + 1 == LEVELS { table.len() } else { to };
        let i = (from + table[from..to].partition_point(|&t| t < v)).clamp(1, table.len() - 1);
        let (a, b) = (table[i - 1], table[i]);
        let s = if b > a { ((v - a) / (b - a)).clamp(0.0, 1.0) } else { 0.5 };
        let (lo, hi) = (i.saturating_sub(8), (i + 7).min(table.len() - 1));
        let rise = table[hi] - table[lo];
        let slope = if rise > 0.0 { (hi - lo) as f64 / rise } else { 0.0 };
        ((i - 1) as f64 + s, slope)
    }
}
