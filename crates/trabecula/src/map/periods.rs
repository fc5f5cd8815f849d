//! Whole numbers of cells round holes: Φᵢ = Sᵢ + Σ nᵢₕ θₕ, S single-valued, θₕ the angle about the line through hole h.
//!
//! The problem is linear in S and n: S is that of the target less Σ n times that of ∇θ, by the same least squares, and what is left of the
//! error in the region is a quadratic form in n. Its least for real n is what least squares asks for; whole numbers near it are tried
//! from the least error on, and the first that does not fold is taken.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::edge_squares::{gradient, slopes};
use super::integral::Problem;
use super::phase_grid::PhaseGrid;
use super::region_holes::Hole;
use super::solution::Solution;
use super::spline::MapSpline;
use super::winding::Winding;
use geometry::dense::{factorise, substitute};
use geometry::fault::position;
use geometry::math::{Vec3, sub};
use geometry::progress::checkpoint;

/// Whole numbers that are kept for each axis, and sets for all three that are tried.
const KEPT: [usize; 2] = [4, 12];
/// The part of a step of the grid within which Jacobians do not grow further towards a line.
const CORE: f64 = 0.25;

/// The whole numbers of cells round a hole of the region.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "PeriodReport")]
pub struct Period {
    /// A point in the hole, on the line through it that cells go round, mm.
    pub at: [f64; 3],
    /// Direction of the line there.
    pub along: [f64; 3],
    /// Whole cells round the line along each axis of the cell; negative against a right-handed screw.
    pub cells: [i64; 3],
    /// The numbers that least squares ask for.
    pub asked: [f64; 3],
}

/// What was tried to keep a map from folding: cells round holes.
pub(super) fn tried_periods(periods: &[Period]) -> String {
    let one = |p: &Period| {
        let [a, b, c] = p.asked.map(|v| format!("{:.2}", v + 0.0));
        format!("the hole at {} ({a}, {b} and {c} are asked for along the cell's axes)", position(p.at))
    };
    let some: Vec<String> = periods.iter().take(3).map(one).collect();
    match periods.len() - some.len() {
        _ if some.is_empty() => String::new(),
        0 => format!(", whatever whole numbers of cells go round {}", some.join(" and ")),
        rest => format!(", whatever whole numbers of cells go round {} and {rest} more", some.join(", ")),
    }
}

/// The angles about the holes of a region, and their single-valued parts.
pub(super) struct HoleAngles {
    holes: Vec<Hole>,
    /// For each hole the functions whose gradients are nearest to ∇θ, one for each axis or one for all.
    fits: Vec<Vec<Vec<f64>>>,
    /// For each axis the quadratic form of the error in (1, n), row by row.
    error: [Vec<f64>; 3],
    /// What least squares ask for, for each axis and hole.
    asked: [Vec<f64>; 3],
}

impl HoleAngles {
    /// The angles of holes, in addition to the single-valued solution `single` of the whole target.
    pub fn new(problem: &Problem, holes: Vec<Hole>, single: &[Vec<f64>; 3]) -> HoleAngles {
        let grid = &problem.grid;
        let angles: Vec<Vec<Vec3>> = holes.iter().map(|hole| turns(grid, hole)).collect();
        // Where errors of angle and of spacing count alike, one for all axes.
        let (mut fits, mut left) = (vec![Vec::new(); holes.len()], Vec::new());
        let error = core::array::from_fn(|axis| {
            let tilt = problem.tilt(axis);
            if axis == 0 || tilt.is_some() {
                left.clear();
                for (angle, fits) in angles.iter().zip(&mut fits) {
                    checkpoint();
                    let fit = problem.fit(angle, tilt.as_ref());
                    left.push(less(angle, &gradient(grid, &fit)));
                    fits.push(fit);
                }
            }
            let of_target = less(&gradient(grid, &single[axis]), &slopes(grid, &problem.k[axis]));
            let all: Vec<&Vec<Vec3>> = core::iter::once(&of_target).chain(&left).collect();
            let pairs = all.iter().flat_map(|a| all.iter().map(move |b| (a, b)));
            pairs.map(|(a, b)| problem.product(a, b, tilt.as_ref())).collect::<Vec<f64>>()
        });
        let asked = error.each_ref().map(|m| least(m, holes.len()));
        HoleAngles { holes, fits, error, asked }
    }

    /// The solutions of the best whole numbers, the one with the least error first.
    pub fn solutions<'a>(
        &'a self,
        grid: &'a PhaseGrid,
        single: &'a [Vec<f64>; 3],
    ) -> impl Iterator<Item = (Solution, Vec<Period>)> + 'a {
        self.choices().into_iter().map(move |cells| self.solution(grid, single, &cells))
    }

    /// The solution for whole numbers of cells, for each axis and hole.
    fn solution(&self, grid: &PhaseGrid, single: &[Vec<f64>; 3], cells: &[Vec<i64>; 3]) -> (Solution, Vec<Period>) {
        checkpoint();
        let values = core::array::from_fn(|i| {
            let mut values = single[i].clone();
            for (fits, n) in self.fits.iter().zip(&cells[i]).filter(|(_, n)| **n != 0) {
                let n = *n as f64;
                values.iter_mut().zip(&fits[i.min(fits.len() - 1)]).for_each(|(v, f)| *v -= n * f);
            }
            values
        });
        let round = |h: usize| [0, 1, 2].map(|i| cells[i][h]);
        let lines = self.holes.iter().enumerate().flat_map(|(h, hole)| {
            let n = round(h).map(|n| n as f64);
            hole.lines.iter().map(move |line| (line.clone(), n))
        });
        let core = CORE * grid.step.into_iter().fold(f64::INFINITY, f64::min);
        let solution =
            Solution { spline: MapSpline::through(*grid, values), winding: Winding::new(lines, core), branches: None };
        let periods = self.holes.iter().enumerate().map(|(h, hole)| {
            let (at, along) = hole.lines[0].place();
            Period { at, along, cells: round(h), asked: [0, 1, 2].map(|i| self.asked[i][h]) }
        });
        (solution, periods.collect())
    }

    /// Whole numbers for the three axes, by the sum of their errors.
    fn choices(&self) -> Vec<[Vec<i64>; 3]> {
        let each: [Vec<(f64, Vec<i64>)>; 3] = core::array::from_fn(|i| nearest(&self.error[i], &self.asked[i]));
        let [a, b, c] = &each;
        let mut all: Vec<(f64, [Vec<i64>; 3])> = Vec::new();
        for (ea, a) in a {
            for (eb, b) in b {
                all.extend(c.iter().map(|(ec, c)| (ea + eb + ec, [a.clone(), b.clone(), c.clone()])));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        all.into_iter().take(KEPT[1]).map(|(_, n)| n).collect()
    }
}

/// The slopes of the angle about a hole along the edges above the nodes, turns per mm: exact steps but for whole numbers, which an edge
/// does not turn by.
fn turns(grid: &PhaseGrid, hole: &Hole) -> Vec<Vec3> {
    let angle = |n: usize| hole.lines.iter().map(|line| line.angle(grid.node(n))).sum();
    let mut slopes = gradient(grid, &(0..grid.len()).into_par_iter().map(angle).collect::<Vec<f64>>());
    slopes.par_iter_mut().for_each(|s| {
        for (s, h) in s.iter_mut().zip(grid.step) {
            *s -= (*s * h).round() / h;
        }
    });
    slopes
}

fn less(a: &[Vec3], b: &[Vec3]) -> Vec<Vec3> {
    a.par_iter().zip(b).map(|(a, b)| sub(*a, *b)).collect()
}

/// The error for numbers of cells.
fn error(form: &[f64], n: &[i64]) -> f64 {
    let v: Vec<f64> = core::iter::once(1.0).chain(n.iter().map(|n| *n as f64)).collect();
    let m = v.len();
    (0..m * m).map(|i| form[i] * v[i / m] * v[i % m]).sum()
}

/// Where a quadratic form in (1, n) is least; zero where nothing counts.
pub(super) fn least(form: &[f64], holes: usize) -> Vec<f64> {
    let m = holes + 1;
    let mut a: Vec<Vec<f64>> = (1..m).map(|i| form[i * m + 1..][..holes].to_vec()).collect();
    let mut least: Vec<f64> = (1..m).map(|i| -form[i * m]).collect();
    let scale = (0..holes).map(|i| a[i][i]).fold(0.0, f64::max);
    let root = |_, rest: f64| Some(if rest <= 1e-12 * scale { f64::INFINITY } else { rest.sqrt() });
    if factorise(&mut a, root).is_some() {
        substitute(&a, &mut least);
    }
    least
}

/// Whole numbers near the least of a form, the least error first: the rounded ones, improved by single steps, and what single steps and
/// pairs of steps lead to from there.
pub(super) fn nearest(form: &[f64], asked: &[f64]) -> Vec<(f64, Vec<i64>)> {
    let holes = asked.len();
    let mut best: Vec<i64> = asked.iter().map(|v| v.round() as i64).collect();
    let moves: Vec<(usize, i64)> = (0..holes).flat_map(|h| [(h, 1), (h, -1)]).collect();
    let moved = |n: &[i64], (h, by): (usize, i64)| {
        let mut n = n.to_vec();
        n[h] += by;
        n
    };
    loop {
        let next = moves.iter().map(|m| moved(&best, *m)).min_by(|a, b| error(form, a).total_cmp(&error(form, b)));
        match next {
            Some(next) if error(form, &next) < error(form, &best) => best = next,
            _ => break,
        }
    }
    let one: Vec<Vec<i64>> = moves.iter().map(|m| moved(&best, *m)).collect();
    let two = one.iter().flat_map(|n| moves.iter().map(|m| moved(n, *m)));
    let mut all: Vec<Vec<i64>> = two.chain(one.iter().cloned()).chain([best]).collect();
    all.sort();
    all.dedup();
    let mut all: Vec<(f64, Vec<i64>)> = all.into_iter().map(|n| (error(form, &n), n)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    all.truncate(KEPT[0]);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A form with its least at a given place, of which rounding is not the best whole one.
    #[test]
    fn whole_numbers_with_the_least_error_come_first() {
        // (n − a)ᵀ A (n − a), A long and narrow.
        let (a, at) = ([[1.0, 0.95], [0.95, 1.0]], [3.4, -1.45]);
        let mut form = vec![0.0; 9];
        for i in 0..2 {
            for j in 0..2 {
                form[(i + 1) * 3 + j + 1] += a[i][j];
                form[(i + 1) * 3] -= a[i][j] * at[j];
                form[j + 1] -= a[i][j] * at[i];
                form[0] += a[i][j] * at[i] * at[j];
            }
        }
        let asked = least(&form, 2);
        assert!((asked[0] - at[0]).abs() < 1e-12 && (asked[1] - at[1]).abs() < 1e-12);
        let found = nearest(&form, &asked);
        let every = (-9..9).flat_map(|i| (-9..9).map(move |j| vec![i, j]));
        let best = every.min_by(|a, b| error(&form, a).total_cmp(&error(&form, b)));
        assert_eq!(Some(&found[0].1), best.as_ref());
        assert!(found.windows(2).all(|w| w[0].0 <= w[1].0));
    }
}
