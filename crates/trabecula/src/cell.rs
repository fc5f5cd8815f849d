//! Cells: functions on the torus R³/Z³, positions in turns.

mod curvature;
mod cut;
mod distance;
mod foot_point;
mod named;
mod nearest;
mod periodic_components;
mod periodic_spline;
mod pore;
mod pore_level;
mod quantile;
mod series;
pub mod tet;
mod thickness;
mod throat;
mod turned;

pub(crate) use cut::Cut;
pub use distance::Distance;
pub use named::{NamedCell, catalogue, named};
use periodic_components::{Openings, openings};
pub use periodic_components::{connected, necks};
pub use pore_level::NoPore;
pub use series::{Series, Term};

use std::sync::OnceLock;

use geometry::math::{Interval, Mat3, Vec3, add, apply, norm, scale, spectral_norm, transpose};
use geometry::once::computed;
use geometry::progress::Cancellation;

/// Which part of space about the level is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// |f| ≤ t.
    Sheet,
    /// f ≤ t.
    Lower,
    /// f ≥ t.
    Upper,
}

/// A cell: a Fourier series with what can be known of it once and for all.
pub struct Cell {
    series: Series,
    /// The series without common factors of its indices, and the factors: what does not depend on lengths is found on
    /// it, since the finer one only repeats it.
    plain: Series,
    repeats: [i32; 3],
    truncation: Option<f64>,
    range: OnceLock<Interval>,
    table: OnceLock<quantile::Quantile>,
    connected: [OnceLock<Vec<[f64; 2]>>; 3],
    necks: [OnceLock<Vec<(Vec3, f64)>>; 3],
    openings: [OnceLock<Openings>; 3],
    alternates: OnceLock<bool>,
}

impl Cell {
    /// A cell from its series.
    pub fn new(series: Series) -> Cell {
        let (plain, repeats) = series.reduced();
        Cell {
            series,
            plain,
            repeats,
            truncation: None,
            range: OnceLock::new(),
            table: OnceLock::new(),
            connected: Default::default(),
            necks: Default::default(),
            openings: Default::default(),
            alternates: OnceLock::new(),
        }
    }

    /// The same cell, known to leave out this share (root mean square) of a function that was given.
    pub fn truncated(mut self, share: f64) -> Cell {
        self.truncation = Some(share);
        self
    }

    /// The share (root mean square) of a given function that the series leaves out.
    pub fn truncation(&self) -> Option<f64> {
        self.truncation
    }

    /// The series.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// The series without common factors of its indices, which the cell repeats.
    pub fn plain(&self) -> &Series {
        &self.plain
    }

    /// Periods of the function along each edge of the cell: common factors of the indices of its waves.
    pub fn repeats(&self) -> [i32; 3] {
        self.repeats
    }

    /// Least and greatest value of f on the torus: the extremes of a grid, improved by climbing from each.
    pub fn range(&self) -> Interval {
        *computed(&self.range, || {
            let (u, v, g) = torus(&self.plain, 48);
            let climb = |sign: f64| {
                let best = (0..v.len()).max_by(|&a, &b| (sign * v[a]).total_cmp(&(sign * v[b]))).unwrap_or(0);
                let (mut p, mut top, mut slope) = (u[best], sign * v[best], g[best]);
                // A step along the gradient of length |g| / curvature never overshoots a maximum.
                let step = sign / self.plain.curvature();
                for _ in 0..400 {
                    let q = add(p, scale(slope, step));
                    let (mut w, mut h) = ([0.0], [[0.0; 3]]);
                    self.plain.gradients(&[q], &mut w, &mut h);
                    (p, top, slope) = (q, top.max(sign * w[0]), h[0]);
                }
                sign * top
            };
            Interval::new(climb(-1.0), climb(1.0))
        })
    }

    /// Solid volume fraction on the torus of the part at level `iso`.
    pub fn fraction(&self, part: Part, iso: f64) -> f64 {
        let range = self.range();
        // Extremes of the same function by two methods differ by rounding.
        let slack = 1e-12 * (range.hi - range.lo);
        let all = match part {
            Part::Lower => iso >= range.hi - slack,
            Part::Upper => iso <= range.lo + slack,
            Part::Sheet => iso >= range.abs().hi - slack,
        };
        let none = match part {
            Part::Lower => iso < range.lo,
            Part::Upper => iso > range.hi,
            Part::Sheet => iso < range.abs().lo,
        };
        if all {
            1.0
        } else if none {
            0.0
        } else {
            self.table().fraction(part, iso)
        }
    }

    /// The level at which the part has this solid fraction (0 < fraction < 1), and d(iso)/d(fraction).
    pub fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        self.table().iso(part, fraction)
    }

    fn table(&self) -> &quantile::Quantile {
        computed(&self.table, || quantile::Quantile::new(&self.plain))
    }

    /// The level at which the part has this solid fraction (0 < fraction < 1), as exactly as a single level can be
    /// had: `iso`, and one step of Newton's method with the fraction that is really there.
    pub fn level(&self, part: Part, fraction: f64) -> f64 {
        let (t, slope) = self.iso(part, fraction);
        let step = quantile::fraction(&self.plain, part, t).map_or(0.0, |p| slope * (fraction - p));
        // A greater step is none of the table's error, but a fraction at which the slope is not to be trusted.
        let most = 1e-3 * (self.range().hi - self.range().lo);
        if step.abs() <= most { t + step } else { t }
    }

    /// A Lipschitz bound: an upper bound of |∂f/∂x| (per mm) where phases are u = `to_phase` · x: the largest of a grid of samples, plus what
    /// the curvature can add between them.
    pub fn lipschitz(&self, to_phase: &Mat3) -> f64 {
        const N: usize = 24;
        let (_, _, g) = torus(&self.series, N);
        let back = transpose(to_phase);
        let sampled = g.iter().map(|&g| norm(apply(&back, g))).fold(0.0, f64::max);
        let half_diagonal = 3f64.sqrt() / (2.0 * N as f64);
        sampled + spectral_norm(to_phase) * self.series.curvature() * half_diagonal
    }

    /// The intervals of solid fraction in which the periodic solid is connected in R³.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let f = |u: &[Vec3], v: &mut [f64], g: &mut [Vec3]| self.plain.gradients(u, v, g);
        let request = Cancellation::current();
        let found = || request.enter(|| computed(&self.connected[part as usize], || connected(&f, part)));
        // The table is needed next: both are computed in parallel.
        let (intervals, _) = rayon::join(found, || (self.range(), self.table()));
        intervals.iter().map(|i| i.map(|t| self.fraction(part, t).clamp(0.0, 1.0))).collect()
    }

    /// [`necks`] of the part: phases (turns) and levels.
    fn necks(&self, part: Part) -> &[(Vec3, f64)] {
        computed::<Vec<_>>(&self.necks[part as usize], || {
            let mut found = necks(&|u, v, g| self.plain.gradients(u, v, g), part);
            for (at, _) in &mut found {
                *at = [0, 1, 2].map(|a| at[a] / f64::from(self.repeats[a]));
            }
            found
        })
    }

    /// Minimum wall thickness (sheet) or narrowest neck diameter (lower, upper) at level `iso`, in mm, where phases relate to
    /// millimetres by u = `to_phase` · x: of a neck, that of the largest ball that travels through the network, or of a narrower
    /// one about a saddle of f. `None` where the part is empty or full.
    pub fn thickness(&self, part: Part, iso: f64, to_phase: &Mat3) -> Option<f64> {
        match part {
            Part::Sheet => thickness::wall(&|u, v, g| self.gradients(u, v, g), iso, to_phase),
            _ => {
                let neck = thickness::neck(&self.series, part, iso, self.necks(part), to_phase)?;
                // The saddle of f need not be where a strut is narrowest: in the gyroid it is widest there.
                let ball = if neck > 0.0 && self.resolves_pores() { self.pore(part, iso, to_phase) } else { 0.0 };
                Some(if ball > 0.0 { neck.min(ball) } else { neck })
            }
        }
    }

    /// The levels at which the void on a side, f ≤ t (`Lower`) or f ≥ t (`Upper`), is connected with its translates in one, two
    /// and three independent directions, and phases (of the plain series) of the saddles that make it so.
    fn openings(&self, side: Part) -> &Openings {
        computed(&self.openings[side as usize], || openings(&|u, v, g| self.plain.gradients(u, v, g), side))
    }

    /// Values and gradients (per turn) at phases `u`.
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.series.gradients(u, values, gradients);
    }
}

/// The nodes (turns) of an n³ grid over the torus, and the values and gradients there.
fn torus(series: &Series, n: usize) -> (Vec<Vec3>, Vec<f64>, Vec<Vec3>) {
    let node = |i: usize| i as f64 / n as f64;
    let x: Vec<f64> = (0..n).map(node).collect();
    let (mut v, mut g) = (vec![0.0; n * n * n], vec![[0.0; 3]; n * n * n]);
    for (i, (v, g)) in v.chunks_mut(n).zip(g.chunks_mut(n)).enumerate() {
        series.row(&x, [node(i % n), node(i / n)], v, g);
    }
    let u = (0..n * n * n).map(|i| [node(i % n), node(i / n % n), node(i / n / n)]);
    (u.collect(), v, g)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(name: &str) -> Cell {
        Cell::new(Series::new(named(name).expect(name).terms()).expect(name))
    }

    /// Levels of the exact table (closed form along one axis, adaptive elsewhere; good to 3e-8 in t).
    #[test]
    fn levels_meet_the_exact_table() {
        let mut worst = 0.0f64;
        for (name, exact) in [
            ("primitive", [1.621288768, 0.699339635, -0.350257343, -1.621288768]),
            ("gyroid", [1.197145736, 0.616271908, -0.310118842, -1.197145736]),
            ("diamond", [0.956046064, 0.486154728, -0.244025551, -0.956046064]),
            ("iwp", [2.690253869, 1.616965106, -0.536676981, -3.004409420]),
            ("neovius", [4.85675248, 0.97441010, -0.45917736, -4.85675248]),
            ("frd", [1.84234279, 1.12393167, -0.15343933, -2.15672535]),
            ("fischer_koch_s", [0.785258, 0.403888, -0.203414, -0.785258]),
        ] {
            let cell = cell(name);
            for (p, t) in [0.1, 0.3, 0.6, 0.9].into_iter().zip(exact) {
                let error = (cell.fraction(Part::Lower, t) - (1.0 - p)).abs();
                println!("{name} {p} {error:.2e}");
                worst = worst.max(error);
                assert!(error < 1e-4, "{name} at porosity {p}: fraction off by {error:.2e}");
            }
        }
        // The promise is 1e-4; cubes of 1/96 cell do several times better.
        assert!(worst < 3e-5, "{worst:.2e}");
    }

    /// One level at a time is exact to what is known of the exact levels: 1e-8 in t or better.
    #[test]
    fn single_levels_meet_the_exact_table_closely() {
        for (name, exact) in [
            ("primitive", [1.621288768, 0.699339635, -0.350257343]),
            ("gyroid", [1.197145736, 0.616271908, -0.310118842]),
            ("diamond", [0.956046064, 0.486154728, -0.244025551]),
            ("iwp", [2.690253869, 1.616965106, -0.536676981]),
        ] {
            let cell = cell(name);
            for (p, t) in [0.1, 0.3, 0.6].into_iter().zip(exact) {
                let found = cell.level(Part::Lower, 1.0 - p);
                let error = (found - t) / cell.iso(Part::Lower, 1.0 - p).1;
                println!("{name} {p} {error:.2e}");
                // Near a critical level (saddles of the diamond at 1, ridges of I-WP at 3) no plane fits the surface.
                let critical = t > 0.95 && t < 1.05 || t > 2.6;
                // Waves of index two have half as many cubes.
                let limit = match (critical, cell.plain().top()) {
                    (true, _) => 2e-6,
                    (_, 1) => 3e-7,
                    _ => 5e-7,
                };
                assert!(error.abs() < limit, "{name} at porosity {p}: {error:.2e}");
            }
            let twice = cell.level(Part::Upper, 0.3);
            assert!((twice - cell.level(Part::Lower, 0.7)).abs() < 1e-12);
        }
    }

    #[test]
    fn iso_inverts_fraction_and_the_parts_make_one() {
        for n in catalogue() {
            let cell = cell(n.name);
            for i in 1..50 {
                let p = f64::from(i) / 50.0;
                for part in [Part::Sheet, Part::Lower, Part::Upper] {
                    let (t, slope) = cell.iso(part, p);
                    assert!((cell.fraction(part, t) - p).abs() < 1e-9, "{} {part:?} {p}", n.name);
                    assert!(slope.is_finite() && slope != 0.0);
                }
                let t = cell.iso(Part::Sheet, p).0;
                let sum =
                    cell.fraction(Part::Sheet, t) + cell.fraction(Part::Lower, -t) + cell.fraction(Part::Upper, t);
                assert!((sum - 1.0).abs() < 1e-6, "{} {p}: {sum}", n.name);
            }
        }
    }

    /// Limits from the exact saddle values; the fractions are good to the table, 3e-5, and 5e-5 of print.
    #[test]
    fn networks_hold_above_their_limits() {
        for (name, part, limit) in [
            ("primitive", Part::Upper, 0.21333),
            ("gyroid", Part::Lower, 0.01666),
            ("diamond", Part::Upper, 0.08059),
            ("iwp", Part::Lower, 0.1005),
            ("neovius", Part::Upper, 0.3354),
            ("frd", Part::Upper, 0.3308),
            ("frd", Part::Lower, 0.2143),
            ("fischer_koch_s", Part::Lower, 0.1148),
        ] {
            let found = cell(name).connected_fraction(part);
            assert!((found[0][0] - limit).abs() < 1e-4, "{name} {part:?}: {found:?}, expected from {limit}");
            assert!((found[found.len() - 1][1] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn ranges_are_those_of_the_formulas() {
        for (name, lo, hi) in [
            ("gyroid", -1.5, 1.5),
            ("diamond", -(2f64.sqrt()), 2f64.sqrt()),
            ("primitive", -3.0, 3.0),
            ("iwp", -5.0, 3.0),
            ("neovius", -13.0, 13.0),
            ("frd", -7.0, 2.0),
        ] {
            let r = cell(name).range();
            assert!((r.lo - lo).abs() < 1e-6 && (r.hi - hi).abs() < 1e-6, "{name} {r:?}");
        }
    }
}
