//! Maps of given orientation and wavelength: three phases whose gradients are nearest to three target gradients.
//!
//! Where orientation and wavelength vary there is mostly no phase with ∇Φᵢ = Kᵢ, Kᵢ = R eᵢ / λᵢ: least squares. The
//! phases are solved on a coarse grid over the region's bounds and carried between its nodes by splines.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::distortion::{self, Distortion, Misfit};
use super::frame::{self, Frames, Orientation, in_mm};
use super::pace;
use super::phase_grid::Grid;
use super::poisson::Poisson;
use super::smooth_frames::Smoothing;
use super::spline::{self, Spline};
use super::tilt::Tilt;
use super::{Mapping, Rows, inverse};
use crate::field::{Block, Field};
use crate::grade::Grade;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, IDENTITY, Mat3, Vec3, add, determinant, dot, norm, scale, spectral_norm, sub, transpose};
use geometry::progress::{Cancellation, checkpoint};
use geometry::random::low_discrepancy;

/// Weights fall off outside the region by e² for each of this many steps.
const FALL: f64 = 3.0;
/// Most nodes at which a solution is compared with the target.
const COMPARED: usize = 60_000;
/// And most points between nodes.
const BETWEEN: usize = 30_000;
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
    /// The length over which directions, frames and stresses are smoothed, mm.
    pub smooth: Option<f64>,
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
    /// The greatest difference of two principal values of a stress, at the nodes.
    stress_range: f64,
    /// The mean wavelengths along the three axes of the cell, mm.
    mean: Vec3,
    /// A Lipschitz bound in the region's bounds, turns per mm.
    max_lipschitz: f64,
    distortion: Distortion,
    extremes: [Mat3; 2],
    steps: usize,
    hasty: Option<String>,
    frames: OnceLock<Arc<[Mat3]>>,
}

impl Phase {
    /// Solves for the map in a box.
    ///
    /// # Errors
    /// Numbers that are not finite, wavelengths that are not positive or that change faster than the grid can carry, a
    /// grid that is too coarse or too large; a map that folds.
    pub fn solve(bounds: &Aabb, wanted: &Wanted, settings: &Settings) -> Result<Phase, Fault> {
        let chosen = pace::choose(bounds, wanted, settings.step, settings.region)?;
        let grid = chosen.grid;
        let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
        let wavelength = wavelengths(&wanted.wavelength, &nodes)?;
        checkpoint();
        let mut depth = vec![f64::NEG_INFINITY; grid.len()];
        if let Some(region) = settings.region {
            let chunks = depth.par_chunks_mut(4096).zip(nodes.par_chunks(4096));
            chunks.for_each(|(d, p)| region.values(p, d));
        }
        let weight: Vec<f64> = depth.iter().map(|d| nearness(&grid, *d).powi(2)).collect();
        let smoothing = wanted.smooth.map(|length| Smoothing { length, weight: &weight });
        let Frames { at_nodes: frames, trust } = wanted.orientation.frames(&grid, &nodes, smoothing.as_ref())?;
        checkpoint();
        let range = wanted.orientation.stress_range(&nodes)?;
        let reach = 1e-9 * norm(bounds.size());
        let inside: Vec<bool> = depth.iter().map(|d| *d <= reach).collect();
        pace::check_pace(&grid, &wanted.wavelength, &wavelength, &inside)?;
        chosen.refuse()?;
        let k: [Vec<Vec3>; 3] = core::array::from_fn(|i| {
            let of = frames.iter().zip(&wavelength);
            of.map(|(f, w)| scale([f[0][i], f[1][i], f[2][i]], 1.0 / w[i])).collect()
        });
        let mut close = closeness(&grid, &depth, wanted.weight.as_ref(), &nodes)?;
        if let Some(trust) = trust {
            let roots = close.get_or_insert_with(|| vec![1.0; nodes.len()]);
            roots.iter_mut().zip(&trust).for_each(|(root, t)| *root = (*root * t.sqrt()).max(LEAST_ROOT));
        }
        let ratio = wanted.angle_weight;
        if !(LEAST_RATIO..=1.0 / LEAST_RATIO).contains(&ratio) {
            let message = format!(
                "{}; an angle counts from {LEAST_RATIO} to {} times as much as a spacing",
                number(ratio),
                number(1.0 / LEAST_RATIO)
            );
            return Err(Fault::new("angle_weight", message));
        }
        checkpoint();
        let (values, mean, steps) = integrate(&grid, &k, close.as_deref(), ratio);
        checkpoint();
        let spline = Spline::through(grid, values);
        checkpoint();
        let within: Vec<usize> = (0..grid.len()).filter(|&n| inside[n]).collect();
        // The density at every node; the other measures, which cost more, at some tens of thousands.
        let density: Vec<f64> = within
            .par_iter()
            .map(|&n| {
                let cells = determinant(&spline.jacobian(nodes[n]).1);
                cells * wavelength[n].iter().product::<f64>()
            })
            .collect();
        checkpoint();
        let (compared, between) = compared(&grid, &inside, settings.region);
        let positions: Vec<Vec3> = compared.iter().map(|n| nodes[*n]).chain(between.iter().copied()).collect();
        let jacobians: Vec<Mat3> = positions.par_iter().map(|p| spline.jacobian(*p).1).collect();
        let off_nodes = targets(wanted, range, &grid, &frames, &between)?;
        let at_nodes = compared.iter().map(|&n| [k[0][n], k[1][n], k[2][n]]);
        let asked: Vec<Mat3> = at_nodes.chain(off_nodes).collect();
        let found: Vec<_> = jacobians.par_iter().zip(&asked).map(|(j, k)| distortion::compare(j, k)).collect();
        let curl: Vec<f64> = (compared.par_iter()).map(|&n| distortion::curl(&grid, &k, n)).collect();
        let lengths_range =
            wavelength.iter().flatten().fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], w| [a.min(*w), b.max(*w)]);
        let turn = distortion::turning(&grid, &frames, &inside, lengths_range[1]);
        let order = |a: &usize, b: &usize| density[*a].total_cmp(&density[*b]);
        let least = (0..density.len()).min_by(order);
        let most = (0..density.len()).max_by(order);
        let mut distortion = Distortion {
            density: [least, most].map(|n| n.map_or(1.0, |n| density[n])),
            least_at: least.map_or(bounds.center(), |n| nodes[within[n]]),
            ..Distortion::of(&found, compared.len(), &curl, turn)
        };
        distortion.widen_density(&found, &positions);
        if !settings.folds {
            refuse_folds(&grid, &spline, &distortion, &inside, &remedy(wanted, lengths_range[1]))?;
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
            wavelengths: lengths_range,
            stress_range: range,
            mean: if within.is_empty() { wavelength[0] } else { scale(average, 1.0 / within.len() as f64) },
            max_lipschitz,
            distortion,
            extremes: extremes.map(|n| n.map_or(typical, |n| jacobians[n])),
            steps,
            hasty: chosen.hasty,
            frames: if wanted.smooth.is_some() { OnceLock::from(Arc::<[Mat3]>::from(frames)) } else { OnceLock::new() },
        })
    }

    /// Deviation of the map from the target.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// Deviation of the map from the target at points (mm) within the box. The target is evaluated at the points,
    /// with the signs and axes of the nodes about them.
    ///
    /// # Errors
    /// Numbers that are not finite, vectors without a direction.
    pub fn misfits(&self, points: &[Vec3]) -> Result<Vec<Misfit>, Fault> {
        let jacobians: Vec<Mat3> = points.par_iter().map(|p| self.jacobian(*p)).collect();
        let targets = targets(&self.wanted, self.stress_range, self.spline.grid(), &self.combed()?, points)?;
        Ok(jacobians.iter().zip(&targets).map(|(j, k)| distortion::compare(j, k)).collect())
    }

    /// The frames at the nodes, made again where points need them for their signs and axes.
    fn combed(&self) -> Result<Arc<[Mat3]>, Fault> {
        if let Some(frames) = self.frames.get() {
            return Ok(frames.clone());
        }
        if !self.wanted.orientation.is_combed() {
            return Ok(Arc::default());
        }
        let grid = self.spline.grid();
        let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
        let made: Arc<[Mat3]> = self.wanted.orientation.frames(grid, &nodes, None)?.at_nodes.into();
        Ok(self.frames.get_or_init(|| made).clone())
    }

    /// A target that varies faster than cells of its size can, in words; `None` where the solution's grid carries it.
    pub fn hasty(&self) -> Option<&str> {
        self.hasty.as_deref()
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

    fn phases_and_jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        self.spline.jacobians(points, u, j);
        u.iter_mut().for_each(|u| *u = add(*u, self.shift));
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

/// Where a solution is compared with its target: nodes in the region, and points in the region, one in a cell of the grid.
fn compared(grid: &Grid, inside: &[bool], region: Option<&dyn Field>) -> (Vec<usize>, Vec<Vec3>) {
    let within = inside.iter().filter(|i| **i).count().max(1) as f64;
    let some = |most: usize| {
        let keep = most as f64 / within;
        (0..grid.len()).filter(move |n| (*n as f64 * 0.618_033_988_749_895).fract() < keep)
    };
    let far: usize = grid.strides().iter().sum();
    let cell = |n: &usize| (0..3).all(|a| grid.index(*n)[a] + 1 < grid.shape[a]) && (inside[*n] || inside[n + far]);
    let off = |n: usize| -> Vec3 {
        let s = low_discrepancy(n + 1);
        core::array::from_fn(|a| grid.node(n)[a] + s[a] * grid.step[a])
    };
    let mut between: Vec<Vec3> = some(BETWEEN).filter(cell).map(off).collect();
    if let Some(region) = region {
        let mut depth = vec![0.0; between.len()];
        region.values(&between, &mut depth);
        let mut depth = depth.into_iter();
        between.retain(|_| depth.next().is_some_and(|d| d <= 0.0));
    }
    (some(COMPARED).filter(|n| inside[*n]).collect(), between)
}

/// The target gradients at points; `frames` are those of the nodes, from which points have their signs and axes, or, if they are
/// smoothed, their frames.
fn targets(wanted: &Wanted, range: f64, grid: &Grid, frames: &[Mat3], points: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
    let smooth = wanted.smooth.is_some();
    let like: Vec<Mat3> = match smooth || wanted.orientation.is_combed() {
        true => points.par_iter().map(|p| frame::interpolated(grid, frames, *p)).collect(),
        false => Vec::new(),
    };
    let frames = if smooth { like } else { wanted.orientation.frames_near(points, &like, range)? };
    let wavelength = wavelengths(&wanted.wavelength, points)?;
    let each = frames.iter().zip(&wavelength).map(|(f, w)| {
        let k = transpose(f);
        [0, 1, 2].map(|i| scale(k[i], 1.0 / w[i]))
    });
    Ok(each.collect())
}

/// The three wavelengths at points.
pub(super) fn wavelengths(of: &[Grade; 3], points: &[Vec3]) -> Result<Vec<Vec3>, Fault> {
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

/// The roots of the weights of nodes: closeness to the region times the target's weight. `None` if all are one.
fn closeness(grid: &Grid, depth: &[f64], weight: Option<&Grade>, nodes: &[Vec3]) -> Result<Option<Vec<f64>>, Fault> {
    let fall = fall(grid);
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
    let roots = roots.iter().zip(depth).map(|(w, d)| (w * nearness(grid, *d)).max(LEAST_ROOT));
    Ok(Some(roots.collect()))
}

/// The root of the weight of a node at a signed distance from the region.
fn nearness(grid: &Grid, distance: f64) -> f64 {
    (-distance.max(0.0) / fall(grid)).exp()
}

/// The distance over which roots of weights fall off by e, mm.
fn fall(grid: &Grid) -> f64 {
    FALL * grid.step.into_iter().fold(0.0, f64::max)
}

/// The three phases at the nodes, the mean of the rows of K, and the number of steps. With K̄ the mean of K, that of
/// Φ − K̄ x is zero; means and squares are weighted by the trapezoid rule and by s².
fn integrate(grid: &Grid, k: &[Vec<Vec3>; 3], s: Option<&[f64]>, ratio: f64) -> ([Vec<f64>; 3], Mat3, usize) {
    let even = (ratio != 1.0 && s.is_none()).then(|| vec![1.0; grid.len()]);
    let s = s.or(even.as_deref());
    let weights: Vec<f64> = (0..grid.len()).map(|n| grid.trapezoid(n) * s.map_or(1.0, |s| s[n] * s[n])).collect();
    let whole: f64 = weights.iter().sum();
    let poisson = Poisson::new(*grid);
    let request = Cancellation::current();
    let solved = k.par_iter().map(|k| {
        request.enter(|| {
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
    });
    let solved: Vec<(Vec<f64>, Vec3, usize)> = solved.collect();
    let mean = [solved[0].1, solved[1].1, solved[2].1];
    let steps = solved.iter().map(|s| s.2).max().unwrap_or(0);
    let mut values = solved.into_iter().map(|s| s.0);
    (core::array::from_fn(|_| values.next().unwrap_or_default()), mean, steps)
}

/// What may keep a map from folding.
fn remedy(wanted: &Wanted, longest: f64) -> String {
    match (&wanted.orientation, wanted.smooth) {
        (Orientation::Angles(_), _) => "Let orientation and wavelength vary more slowly".into(),
        (of, None) => format!(
            "Smooth the {} over a length, such as smooth = {}, let orientation and wavelength vary more slowly",
            of.key(),
            number(longest)
        ),
        (_, Some(length)) => {
            format!("Use a smooth of more than {} mm, let orientation and wavelength vary more slowly", number(length))
        }
    }
}

/// Refuses a map whose det J is not positive at a node or between nodes in the region.
fn refuse_folds(
    grid: &Grid,
    spline: &Spline,
    distortion: &Distortion,
    inside: &[bool],
    remedy: &str,
) -> Result<(), Fault> {
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
                "the map folds at {}: cells turn inside out there. {remedy}, or allow it with folds = true",
                in_mm(p)
            ),
        )),
    }
}

#[cfg(test)]
mod tests;
