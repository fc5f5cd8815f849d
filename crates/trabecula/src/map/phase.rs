//! Maps of given orientation and wavelength: three phases whose gradients are nearest to three target gradients.
//!
//! Where orientation and wavelength vary there is mostly no phase with ∇Φᵢ = Kᵢ, Kᵢ = R eᵢ / λᵢ: least squares. The
//! phases are solved on a coarse grid over the region's bounds and carried between its nodes by splines.

use rayon::prelude::*;

use super::distortion::{self, Distortion, Misfit};
use super::frame::{Orientation, in_mm};
use super::phase_grid::Grid;
use super::poisson::Poisson;
use super::spline::{self, Spline};
use super::tilt::Tilt;
use super::{Mapping, Rows, inverse};
use crate::field::{Block, Field};
use crate::grade::Grade;
use geometry::fault::{Fault, number};
use geometry::math::{
    Aabb, IDENTITY, Mat3, Vec3, add, determinant, dot, norm, scale, spectral_norm, sub, transpose, unit,
};

/// Most nodes of a grid that is chosen, and of one that the design requests.
const NODES: [f64; 2] = [2.2e6, 4e7];
/// Nodes on a wavelength.
const FINE: f64 = 4.0;
/// The greatest ratio of wavelengths at adjacent nodes.
const ABRUPT: f64 = 1.5;
/// Weights fall off outside the region by e² for each of this many steps.
const FALL: f64 = 3.0;
/// Most nodes at which a solution is compared with the target.
const COMPARED: usize = 60_000;
/// Least ratio of what angle and spacing count, and the inverse of the greatest: conjugate gradients take its root of steps.
const LEAST_RATIO: f64 = 0.001;
/// Least root of a weight.
const LEAST_ROOT: f64 = 1e-3;

/// The target of a map.
#[derive(Clone)]
pub struct Wanted {
    /// Cell edges (mm) along the cell's axes.
    pub wavelength: [Grade; 3],
    /// Orientation of the cells.
    pub orientation: Orientation,
    /// Relative weight of the map's error; the same everywhere if none.
    pub weight: Option<Grade>,
    /// What an error of angle counts, for the same error of spacing (squares of the parts of ∇Φ − K across and along K); 1 if
    /// both count alike.
    pub angle_weight: f64,
    /// Moves the lattice (mm).
    pub offset: Vec3,
}

/// How a map is solved for.
#[derive(Clone, Copy, Default)]
pub struct Settings<'a> {
    /// Spacing of the grid (mm); chosen if not given.
    pub step: Option<f64>,
    /// Signed distance of the region that counts; all of the box if none.
    pub region: Option<&'a dyn Field>,
    /// Whether the map may fold (det J ≤ 0).
    pub folds: bool,
}

/// A solved map.
pub struct Phase {
    spline: Spline,
    wanted: Wanted,
    shift: Vec3,
    /// Least and greatest target wavelength, mm.
    wavelengths: [f64; 2],
    /// The mean wavelengths along the three axes of the cell, mm.
    mean: Vec3,
    /// A Lipschitz bound in the region's bounds, turns per mm.
    max_lipschitz: f64,
    distortion: Distortion,
    extremes: [Mat3; 2],
    steps: usize,
}

impl Phase {
    /// Solves for the map in a box.
    ///
    /// # Errors
    /// Numbers that are not finite, wavelengths that are not positive or that change faster than the grid can carry, a
    /// grid that is too coarse or too large; a map that folds.
    pub fn solve(bounds: &Aabb, wanted: &Wanted, settings: &Settings) -> Result<Phase, Fault> {
        let grid = grid(bounds, wanted, settings.step)?;
        let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
        let wavelength = wavelengths(&wanted.wavelength, &nodes)?;
        let frames = wanted.orientation.frames(&grid, &nodes)?;
        let mut depth = vec![f64::NEG_INFINITY; grid.len()];
        if let Some(region) = settings.region {
            let chunks = depth.par_chunks_mut(4096).zip(nodes.par_chunks(4096));
            chunks.for_each(|(d, p)| region.values(p, d));
        }
        let reach = 1e-9 * norm(bounds.size());
        let inside: Vec<bool> = depth.iter().map(|d| *d <= reach).collect();
        check_pace(&grid, &wanted.wavelength, &wavelength, &inside)?;
        let k: [Vec<Vec3>; 3] = core::array::from_fn(|i| {
            let of = frames.iter().zip(&wavelength);
            of.map(|(f, w)| scale([f[0][i], f[1][i], f[2][i]], 1.0 / w[i])).collect()
        });
        let close = closeness(&grid, &depth, wanted.weight.as_ref(), &nodes)?;
        let ratio = wanted.angle_weight;
        if !(LEAST_RATIO..=1.0 / LEAST_RATIO).contains(&ratio) {
            let message = format!(
                "{}; an angle counts from {LEAST_RATIO} to {} times as much as a spacing",
                number(ratio),
                number(1.0 / LEAST_RATIO)
            );
            return Err(Fault::new("angle_weight", message));
        }
        let (values, mean, steps) = integrate(&grid, &k, close.as_deref(), ratio);
        let spline = Spline::through(grid, values);
        let within: Vec<usize> = (0..grid.len()).filter(|&n| inside[n]).collect();
        // The density at every node; the other measures, which cost more, at some tens of thousands.
        let density: Vec<f64> = within
            .par_iter()
            .map(|&n| {
                let cells = determinant(&spline.jacobian(nodes[n]).1);
                cells * wavelength[n].iter().product::<f64>()
            })
            .collect();
        let keep = COMPARED as f64 / within.len().max(1) as f64;
        let compared: Vec<usize> =
            (within.iter().copied()).filter(|n| (*n as f64 * 0.618_033_988_749_895).fract() < keep).collect();
        let jacobians: Vec<Mat3> = compared.par_iter().map(|&n| spline.jacobian(nodes[n]).1).collect();
        let found: Vec<_> = (compared.par_iter().zip(&jacobians))
            .map(|(&n, j)| {
                let wanted = [k[0][n], k[1][n], k[2][n]];
                distortion::compare(j, &wanted)
            })
            .collect();
        let curl = (compared.par_iter()).map(|&n| distortion::curl(&grid, &k, n));
        let range =
            wavelength.iter().flatten().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], w| [a.min(*w), b.max(*w)]);
        let turn = distortion::turning(&grid, &frames, &inside, range[1]);
        let order = |a: &usize, b: &usize| density[*a].total_cmp(&density[*b]);
        let least = (0..density.len()).min_by(order);
        let most = (0..density.len()).max_by(order);
        let distortion = Distortion {
            density: [least, most].map(|n| n.map_or(1.0, |n| density[n])),
            least_at: least.map_or(bounds.center(), |n| nodes[within[n]]),
            ..Distortion::of(&found, curl.collect(), turn)
        };
        if !settings.folds {
            refuse_folds(&grid, &spline, &distortion, &inside)?;
        }
        let shift = mean.map(|m| -dot(m, wanted.offset));
        let average = (within.iter()).fold([0.0; 3], |s, &n| add(s, wavelength[n]));
        let max_lipschitz = spline.lipschitz(bounds);
        let lengths: Vec<f64> = jacobians.par_iter().map(spectral_norm).collect();
        let by_length = |a: &usize, b: &usize| lengths[*a].total_cmp(&lengths[*b]);
        let typical = spline.jacobian(bounds.center()).1;
        let extremes = [(0..lengths.len()).min_by(by_length), (0..lengths.len()).max_by(by_length)];
        Ok(Phase {
            spline,
            wanted: wanted.clone(),
            shift,
            wavelengths: range,
            mean: if within.is_empty() { wavelength[0] } else { scale(average, 1.0 / within.len() as f64) },
            max_lipschitz,
            distortion,
            extremes: extremes.map(|n| n.map_or(typical, |n| jacobians[n])),
            steps,
        })
    }

    /// Deviation of the map from the target.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Deviation of the map from the target at points (mm) within the box. The target is evaluated at the points,
    /// with the signs and axes that are nearest to the map's.
    ///
    /// # Errors
    /// Numbers that are not finite, vectors without a direction.
    pub fn misfits(&self, points: &[Vec3]) -> Result<Vec<Misfit>, Fault> {
        let jacobians: Vec<Mat3> = points.par_iter().map(|p| self.jacobian(*p)).collect();
        let own = |j: &Mat3| transpose(&j.map(unit));
        let like: Vec<Mat3> = jacobians.iter().map(own).collect();
        let frames = self.wanted.orientation.frames_near(points, &like)?;
        let wavelength = wavelengths(&self.wanted.wavelength, points)?;
        let of = jacobians.iter().zip(frames.iter().zip(&wavelength));
        Ok(of
            .map(|(j, (f, w))| {
                let k = transpose(f);
                distortion::compare(j, &[0, 1, 2].map(|i| scale(k[i], 1.0 / w[i])))
            })
            .collect())
    }

    /// Nodes of the grid along each axis, and the steps of conjugate gradients that were taken.
    pub fn effort(&self) -> ([usize; 3], usize) {
        (self.spline.grid().shape, self.steps)
    }
}

impl Mapping for Phase {
    /// Those of the target.
    fn wavelengths(&self) -> [f64; 2] {
        self.wavelengths
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        self.spline.values(points, out);
        out.iter_mut().for_each(|u| *u = add(*u, self.shift));
    }

    fn jacobian(&self, at: Vec3) -> Mat3 {
        self.spline.jacobian(at).1
    }

    fn solved(&self) -> Option<&Phase> {
        Some(self)
    }

    /// That of the mean wavelengths.
    fn typical(&self) -> Mat3 {
        core::array::from_fn(|a| scale(IDENTITY[a], 1.0 / self.mean[a]))
    }

    /// At nodes in the region.
    fn extremes(&self) -> Vec<Mat3> {
        self.extremes.to_vec()
    }

    fn lipschitz(&self, b: &Aabb) -> f64 {
        self.spline.lipschitz(b)
    }

    /// In the region's bounds.
    fn max_lipschitz(&self) -> f64 {
        self.max_lipschitz
    }

    fn position(&self, u: Vec3, near: Vec3) -> Option<Vec3> {
        inverse::search(self, u, near)
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        inverse::searched(self, b)
    }

    fn rows<'a>(&'a self, block: &Block<'a>) -> Box<dyn Rows + 'a> {
        Box::new(SplineRows { rows: self.spline.rows(block), shift: self.shift })
    }
}

/// The phases of a solved map along the rows of a block.
struct SplineRows<'a> {
    rows: spline::Rows<'a>,
    shift: Vec3,
}

impl Rows for SplineRows<'_> {
    fn enter_layer(&mut self, k: usize) {
        self.rows.enter_layer(k);
    }

    fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]) {
        self.rows.fill(j, out);
        for (out, shift) in out.iter_mut().zip(self.shift) {
            if shift != 0.0 {
                out.iter_mut().for_each(|u| *u += shift);
            }
        }
    }
}

/// The grid that resolves the least wavelength, or has the requested spacing `step` (mm).
fn grid(bounds: &Aabb, wanted: &Wanted, step: Option<f64>) -> Result<Grid, Fault> {
    let size = bounds.size();
    let coarse: Vec<Vec3> = {
        let g = Grid::over(bounds, [13; 3]);
        (0..g.len()).map(|n| g.node(n)).collect()
    };
    let all = wavelengths(&wanted.wavelength, &coarse)?;
    let least = all.iter().flatten().fold(f64::INFINITY, |m: f64, w| m.min(*w));
    let shape = |h: f64| size.map(|s| Grid::handy(((s / h - 1e-6).ceil().max(0.0) as usize + 1).max(spline::LEAST)));
    let count = |shape: [usize; 3]| shape.map(|n| n as f64).iter().product::<f64>();
    match step {
        Some(h) => {
            if !(h > 0.0 && h.is_finite()) {
                return Err(Fault::new(
                    "step",
                    format!("{} mm; the spacing of the grid is a positive, finite length", number(h)),
                ));
            }
            let rough = size.iter().map(|s| s / h).product::<f64>();
            if rough > NODES[1] || count(shape(h)) > NODES[1] {
                let enough = (size.iter().product::<f64>() / NODES[1]).cbrt();
                return Err(Fault::new(
                    "step",
                    format!(
                        "{} mm makes a grid of {rough:.1e} nodes; at most {:.0e} are possible: use a step above {enough:.3} mm, or leave it out",
                        number(h),
                        NODES[1]
                    ),
                ));
            }
            Ok(Grid::over(bounds, shape(h)))
        }
        None => {
            let mut h = (least / FINE).max((size.iter().product::<f64>() / NODES[0]).cbrt());
            while count(shape(h)) > 1.3 * NODES[0] {
                h *= 1.05;
            }
            Ok(Grid::over(bounds, shape(h)))
        }
    }
}

/// The three wavelengths at points.
fn wavelengths(of: &[Grade; 3], points: &[Vec3]) -> Result<Vec<Vec3>, Fault> {
    let mut out = vec![[0.0; 3]; points.len()];
    let mut values = vec![0.0; points.len()];
    for (i, grade) in of.iter().enumerate() {
        grade.values(points, &mut values);
        for ((o, v), p) in out.iter_mut().zip(&values).zip(points) {
            if !(*v > 0.0 && v.is_finite()) {
                return Err(Fault::new(
                    "wavelength",
                    format!(
                        "{} mm at {}; a wavelength is a positive, finite length all over the region's bounds",
                        number(*v),
                        in_mm(*p)
                    ),
                ));
            }
            o[i] = *v;
        }
    }
    Ok(out)
}

/// Refuses wavelengths that jump between nodes, or whose variation the nodes do not resolve.
fn check_pace(grid: &Grid, of: &[Grade; 3], at: &[Vec3], inside: &[bool]) -> Result<(), Fault> {
    if of.iter().all(|g| g.constant().is_some()) {
        return Ok(());
    }
    let refuse = |a: f64, b: f64, p: Vec3, apart: f64| {
        let message = format!(
            "the wavelength goes from {} to {} mm within {} mm at {}: faster than the grid can carry; let it change over several cells, or give a smaller step",
            number(a),
            number(b),
            number(apart),
            in_mm(p)
        );
        Err(Fault::new("wavelength", message))
    };
    let strides = grid.strides();
    let mut middles = Vec::new();
    for n in (0..grid.len()).filter(|&n| inside[n]) {
        let index = grid.index(n);
        for a in (0..3).filter(|&a| index[a] + 1 < grid.shape[a]) {
            let m = n + strides[a];
            for i in 0..3 {
                let (v, w) = (at[n][i], at[m][i]);
                if inside[m] && v.max(w) > ABRUPT * v.min(w) {
                    return refuse(v, w, grid.node(n), grid.step[a]);
                }
            }
        }
        if (0..3).all(|a| index[a] + 1 < grid.shape[a]) {
            middles.push(n);
        }
    }
    let points: Vec<Vec3> = middles.iter().map(|&n| add(grid.node(n), scale(grid.step, 0.5))).collect();
    let between = wavelengths(of, &points)?;
    for ((n, w), p) in middles.iter().zip(&between).zip(&points) {
        let far = n + strides.iter().sum::<usize>();
        for i in 0..3 {
            let (lo, hi) = (at[*n][i].min(at[far][i]), at[*n][i].max(at[far][i]));
            if inside[far] && (w[i] > ABRUPT * hi || w[i] < lo / ABRUPT) {
                return refuse(at[*n][i], w[i], *p, 0.5 * norm(grid.step));
            }
        }
    }
    Ok(())
}

/// The roots of the weights of nodes: closeness to the region times the target's weight. `None` if all are one.
fn closeness(grid: &Grid, depth: &[f64], weight: Option<&Grade>, nodes: &[Vec3]) -> Result<Option<Vec<f64>>, Fault> {
    let fall = FALL * grid.step.into_iter().fold(0.0, f64::max);
    let mut roots = vec![1.0; nodes.len()];
    if let Some(weight) = weight.filter(|w| w.constant().is_none()) {
        weight.values(nodes, &mut roots);
        let most = roots.iter().copied().fold(0.0, f64::max);
        let wrong = (roots.iter().zip(nodes)).find(|(w, _)| !(**w >= 0.0 && w.is_finite()));
        if let Some((w, p)) = wrong {
            let message = format!(
                "{} at {}; a weight is a finite number from 0 up, all over the region's bounds",
                number(*w),
                in_mm(*p)
            );
            return Err(Fault::new("weight", message));
        }
        if most == 0.0 {
            let message = "the weight is zero everywhere: nothing is asked for";
            return Err(Fault::new("weight", message));
        }
        roots.iter_mut().for_each(|w| *w = (*w / most).sqrt());
    } else if depth.iter().all(|d| *d <= 1e-6 * fall) {
        return Ok(None);
    }
    let near = |d: &f64| (-d.max(0.0) / fall).exp();
    let roots = roots.iter().zip(depth).map(|(w, d)| (w * near(d)).max(LEAST_ROOT));
    Ok(Some(roots.collect()))
}

/// The three phases at the nodes, the mean of the rows of K, and the number of steps. With K̄ the mean of K, that of
/// Φ − K̄ x is zero; means and squares are weighted by the trapezoid rule and by s².
fn integrate(grid: &Grid, k: &[Vec<Vec3>; 3], s: Option<&[f64]>, ratio: f64) -> ([Vec<f64>; 3], Mat3, usize) {
    let even = (ratio != 1.0 && s.is_none()).then(|| vec![1.0; grid.len()]);
    let s = s.or(even.as_deref());
    let weights: Vec<f64> = (0..grid.len()).map(|n| grid.trapezoid(n) * s.map_or(1.0, |s| s[n] * s[n])).collect();
    let whole: f64 = weights.iter().sum();
    let poisson = Poisson::new(*grid);
    let solved: Vec<(Vec<f64>, Vec3, usize)> = k
        .par_iter()
        .map(|k| {
            // From a first value on, so that a K that does not vary has exactly itself as its mean.
            let first = k[0];
            let off = k.iter().zip(&weights).fold([0.0; 3], |m, (k, w)| add(m, scale(sub(*k, first), *w)));
            let mean = add(first, scale(off, 1.0 / whole));
            let rest: Vec<Vec3> = k.iter().map(|k| sub(*k, mean)).collect();
            let (mut f, steps) = match s {
                _ if rest.iter().all(|r| norm(*r) <= 1e-15 * norm(mean)) => (vec![0.0; k.len()], 0),
                None => (poisson.integrate(&rest), 0),
                Some(s) => {
                    let tilt = Tilt::new(*grid, k, ratio, s);
                    let (f, steps, _) = poisson.integrate_weighted(&rest, s, tilt.as_ref());
                    (f, steps)
                }
            };
            let off = f.iter().zip(&weights).map(|(f, w)| f * w).sum::<f64>() / whole;
            for (n, f) in f.iter_mut().enumerate() {
                *f += dot(mean, grid.node(n)) - off;
            }
            (f, mean, steps)
        })
        .collect();
    let mean = [solved[0].1, solved[1].1, solved[2].1];
    let steps = solved.iter().map(|s| s.2).max().unwrap_or(0);
    let mut values = solved.into_iter().map(|s| s.0);
    (core::array::from_fn(|_| values.next().unwrap_or_default()), mean, steps)
}

/// Refuses a map whose det J is not positive at a node or between nodes in the region.
fn refuse_folds(grid: &Grid, spline: &Spline, distortion: &Distortion, inside: &[bool]) -> Result<(), Fault> {
    let at_node = (distortion.density[0] <= 0.0).then_some(distortion.least_at);
    let (strides, half) = (grid.strides(), scale(grid.step, 0.5));
    let far: usize = strides.iter().sum();
    let between = || {
        (0..grid.len())
            .into_par_iter()
            .filter(|&n| (0..3).all(|a| grid.index(n)[a] + 1 < grid.shape[a]) && inside[n] && inside[n + far])
            .map(|n| add(grid.node(n), half))
            .find_first(|p| determinant(&spline.jacobian(*p).1) <= 0.0)
    };
    match at_node.or_else(between) {
        None => Ok(()),
        Some(p) => Err(Fault::new(
            "",
            format!(
                "the map folds at {}: cells turn inside out there. Let orientation and wavelength vary more slowly, or allow it with folds = true",
                in_mm(p)
            ),
        )),
    }
}

#[cfg(test)]
mod tests;
