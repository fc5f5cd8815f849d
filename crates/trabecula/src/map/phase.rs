//! Maps of given orientation and wavelength: three phases whose gradients are nearest to three target gradients.
//!
//! Where orientation and wavelength vary there is mostly no phase with ∇Φᵢ = Kᵢ, Kᵢ = R eᵢ / λᵢ: least squares. The
//! phases are solved on a coarse grid over the region's bounds and carried between its nodes by splines.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::core_solve::{Cores, Covered};
use super::distortion::{self, Distortion, Misfit};
use super::edge_squares::EdgeSquares;
use super::fixed_faces::fixed;
use super::fold_advice::{folded, remedy};
use super::grid_choice;
use super::integral::{Integral, Problem};
use super::periods::{HoleAngles, Period, tried_periods};
use super::phase_candidate::Candidate;
use super::phase_request::{PhaseRequest, SolverOptions};
use super::phase_target::{SolveDomain, Target};
use super::region_holes::{HoleSearch, MOST};
use super::singular_lines::{SingularLine, singular_lines};
use super::solution::Solution;
use super::solution_quality::{SolutionQuality, fold_at_node, fold_between, targets};
use super::spline::MapSpline;
use super::stretch::{MARGINS, Stretch, bounded};
use super::winding::Winding;
use super::{Mapping, PhaseRows};
use crate::field::{Block, Field};
use geometry::fault::Fault;
use geometry::math::{Aabb, IDENTITY, Mat3, Vec3, add, norm, scale, spectral_norm};
use geometry::progress::checkpoint;

/// The error |∇Φ − K|² of phases of one value, relative to |K|², above which cells round holes are considered though none fold, and the
/// share of it that is left where they are taken. A grating of three that cannot close misses less than a third: it may follow its target
/// nearly all the way round, and be torn in one place.
const MISSED: [f64; 2] = [0.02, 0.5];
/// The distance over which roots of weights of nodes fall off by e where phases grow round holes, in steps: there edges count by what the
/// region has of them.
const SHARP: f64 = 0.5;

/// Nodes beyond the bounds of a part whose cells are held within a range of stretches.
const PADDING: usize = 2;

/// A solved map.
pub struct Phase {
    solution: Solution,
    periods: Vec<Period>,
    wanted: PhaseRequest,
    shift: Vec3,
    /// Least and greatest target wavelength, mm.
    wavelengths: [f64; 2],
    /// Least and greatest of the smallest target wavelength at nodes in the region, mm.
    edges: [f64; 2],
    /// The greatest difference of two principal values of a stress, at the nodes.
    stress_range: f64,
    /// The mean wavelengths along the three axes of the cell, mm.
    mean: Vec3,
    /// A Lipschitz bound in the region's bounds, turns per mm.
    max_lipschitz: f64,
    distortion: Distortion,
    extremes: [Mat3; 2],
    steps: usize,
    undersampled: Option<String>,
    frames: OnceLock<Arc<[Mat3]>>,
    /// How far nodes are outside the region, mm, if they are made again.
    outside: Option<Vec<f64>>,
    /// The wavelengths at the nodes along the axes of the frames, where they are given along others.
    lengths: Option<Vec<Vec3>>,
    /// The cores of singular lines.
    cores: Option<Cores>,
}

impl Phase {
    /// Solves for the map in a box.
    ///
    /// # Errors
    /// Numbers that are not finite, wavelengths that are not positive or that change faster than the grid can carry, a
    /// grid that is too coarse or too large; a map that folds.
    pub fn solve(bounds: &Aabb, wanted: &PhaseRequest, settings: &SolverOptions) -> Result<Phase, Fault> {
        let Some(range) = wanted.stretch else {
            return Phase::solved_once(bounds, wanted, settings);
        };
        // The grid for a range is another one, and cells held in it may fold or be stretched by more than those of the map without:
        // that is taken where it keeps to the range, or comes nearer to it.
        let free = Phase::solved_once(bounds, &PhaseRequest { stretch: None, ..wanted.clone() }, settings);
        let excess = |made: &Phase| range.excess(made.distortion.stretch);
        let free = free.map(|made| Phase { wanted: wanted.clone(), ..made });
        if free.as_ref().is_ok_and(|free| excess(free) <= 1.0) {
            return free;
        }
        match (Phase::solved_once(bounds, wanted, settings), free) {
            (Ok(held), Ok(free)) => Ok(if excess(&held) <= excess(&free) { held } else { free }),
            (Err(folds), Ok(free)) if folds.at.is_empty() => Ok(free),
            (held, _) => held,
        }
    }

    fn solved_once(bounds: &Aabb, wanted: &PhaseRequest, settings: &SolverOptions) -> Result<Phase, Fault> {
        let chosen = grid_choice::choose(bounds, wanted, settings.step, settings.region)?;
        // A part mostly touches its bounds: there cells are held within a range only if the grid has some on both sides.
        let grid = match (wanted.stretch, settings.region) {
            (Some(_), Some(_)) => chosen.grid.padded(PADDING),
            _ => chosen.grid,
        };
        let domain = SolveDomain::over(bounds, grid, wanted, settings.region)?;
        checkpoint();
        let target = Target::new(&domain, wanted)?;
        checkpoint();
        grid_choice::check_pace(&domain.grid, &wanted.wavelength, &domain.given, &domain.inside)?;
        chosen.refuse()?;
        let ratio = wanted.ratio()?;
        checkpoint();
        if let Some(core) = wanted.core {
            let lines = lines(&domain, wanted, &target);
            let step = domain.grid.step.into_iter().fold(f64::INFINITY, f64::min);
            let covered = match lines.is_empty() {
                true => None,
                false => core.solve(bounds, wanted, settings, (step, &lines))?,
            };
            if let Some(Covered { domain, mut found, lines, cores }) = covered {
                found.quality.distortion.singular = lines;
                let made = Phase::of(bounds, wanted, settings, (domain, found), (chosen.undersampled, String::new()))?;
                return Ok(Phase { cores: Some(cores), ..made });
            }
        }
        let problem = Problem::new(domain.grid, &target.k, target.roots(&domain, wanted)?, ratio);
        let (Integral { values, mean, steps }, weights) = (problem.solve(), problem.weights);
        checkpoint();
        let solution =
            Solution { spline: MapSpline::through(domain.grid, values), winding: Winding::default(), branches: None };
        let quality = SolutionQuality::of(&domain, wanted, settings.region, &target, &solution)?;
        let mut found = Candidate { target, weights, solution, periods: Vec::new(), mean, steps, quality };
        let mut tried = String::new();
        if found.quality.fold.is_some() || found.quality.missed > MISSED[0] {
            let (closed, words) = closed(&domain, wanted, settings, (ratio, &found.target))?;
            tried = words;
            if let Some(closed) = closed.filter(|c| c.is_better_than(&found)) {
                found = closed;
            }
        }
        if let Some(range) = wanted.stretch {
            found = found.bounded(&domain, wanted, settings.region, range)?;
        }
        if let (false, Some(region)) = (wanted.fix.is_empty(), settings.region) {
            found = found.fixed(&domain, wanted, region)?;
        }
        found.quality.distortion.singular = lines(&domain, wanted, &found.target);
        Phase::of(bounds, wanted, settings, (domain, found), (chosen.undersampled, tried))
    }

    /// The map of what was found, if it does not fold.
    fn of(
        bounds: &Aabb,
        wanted: &PhaseRequest,
        settings: &SolverOptions,
        (domain, found): (SolveDomain, Candidate),
        (undersampled, mut tried): (Option<String>, String),
    ) -> Result<Phase, Fault> {
        let wavelength = found.target.wavelength(&domain);
        let mean_length = mean_within(&domain.inside, wavelength);
        let edges = edges_within(&domain.inside, wavelength);
        let lengths_range =
            (wavelength.iter().flatten()).fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], w| [a.min(*w), b.max(*w)]);
        if let (Some(p), false) = (found.quality.fold, settings.folds) {
            if found.solution.branches.is_some() {
                let remedy = remedy(wanted, lengths_range[1], true, &[]);
                return Err(folded(p, &remedy, ", outside the cores of its singular lines"));
            }
            let distortion = &found.quality.distortion;
            tried += &distortion.winds();
            return Err(folded(p, &remedy(wanted, lengths_range[1], false, &distortion.singular), &tried));
        }
        let undersampled = undersampled.or_else(|| grid_choice::thin(&domain.grid, found.quality.deepest));
        let Candidate {
            target,
            solution,
            periods,
            mean,
            steps,
            quality: SolutionQuality { distortion, jacobians, .. },
            ..
        } = found;
        let stress_range = target.range;
        let shift = wanted.shift(&mean);
        let corner = norm(domain.grid.step);
        let max_lipschitz = solution.max_lipschitz(bounds, |n| domain.depth[n] <= corner);
        let lengths: Vec<f64> = jacobians.par_iter().map(spectral_norm).collect();
        let by_length = |a: &usize, b: &usize| lengths[*a].total_cmp(&lengths[*b]);
        let typical = solution.jacobian(bounds.center());
        let extremes = [(0..lengths.len()).min_by(by_length), (0..lengths.len()).max_by(by_length)];
        let keep =
            wanted.averaged().is_some() || wanted.by_principal || !periods.is_empty() || solution.branches.is_some();
        let Target { frames, outside, lengths, .. } = target;
        Ok(Phase {
            solution,
            periods,
            wanted: wanted.clone(),
            shift,
            wavelengths: lengths_range,
            edges,
            stress_range,
            mean: mean_length,
            max_lipschitz,
            distortion,
            extremes: extremes.map(|n| n.map_or(typical, |n| jacobians[n])),
            steps,
            undersampled,
            frames: if keep { OnceLock::from(Arc::<[Mat3]>::from(frames)) } else { OnceLock::new() },
            outside: outside.filter(|_| !keep),
            lengths,
            cores: None,
        })
    }

    /// The cores of singular lines, where they are covered.
    pub fn cores(&self) -> Option<&Cores> {
        self.cores.as_ref()
    }

    /// The rotations of phases that a cell has to be the same after, about an axis that has phase zero.
    pub fn turns(&self) -> Vec<Mat3> {
        self.solution.branches.as_ref().map_or_else(Vec::new, |b| b.turns())
    }

    /// Deviation of the map from the target.
    pub fn distortion(&self) -> &Distortion {
        &self.distortion
    }

    /// The whole numbers of cells round the holes of the region, one for each hole that the grid sees.
    pub fn periods(&self) -> &[Period] {
        &self.periods
    }

    /// The least and the greatest of the smallest wavelength that is asked for in the region, mm; the same where none varies.
    pub fn edges(&self) -> [f64; 2] {
        match self.lengths.is_none() && self.wanted.wavelength.iter().all(|w| w.constant().is_some()) {
            true => [self.wavelengths[0]; 2],
            false => self.edges,
        }
    }

    /// Whether phases grow round a hole, so that one place has many phases.
    pub fn winds(&self) -> bool {
        !self.solution.winding.is_empty()
    }

    /// Phases (turns) at `p` that continue those at a near point without a jump.
    pub(super) fn continued(&self, u: Vec3, from: Vec3, p: Vec3) -> Vec3 {
        self.solution.continued(u, from, p)
    }

    /// The gradients Kᵢ that are asked for (rows, turns per mm) at points (mm) within the box. The target is evaluated at the points, with
    /// the signs and axes of the nodes about them.
    ///
    /// # Errors
    /// Numbers that are not finite, vectors without a direction.
    pub fn asked(&self, points: &[Vec3]) -> Result<Vec<Mat3>, Fault> {
        let (grid, frames) = (self.solution.grid(), self.combed()?);
        let cuts = self.solution.branches.as_ref();
        targets(&self.wanted, self.stress_range, grid, &frames, self.lengths.as_deref(), cuts, points)
    }

    /// Deviation of the map from what is asked for at points (mm) within the box.
    ///
    /// # Errors
    /// Those of `asked`.
    pub fn misfits(&self, points: &[Vec3]) -> Result<Vec<Misfit>, Fault> {
        let jacobians: Vec<Mat3> = points.par_iter().map(|p| self.jacobian(*p)).collect();
        Ok(jacobians.iter().zip(&self.asked(points)?).map(|(j, k)| distortion::compare(j, k)).collect())
    }

    /// The frames at the nodes, made again where points need them for their signs and axes.
    fn combed(&self) -> Result<Arc<[Mat3]>, Fault> {
        if let Some(frames) = self.frames.get() {
            return Ok(frames.clone());
        }
        if !self.wanted.orientation.is_combed() {
            return Ok(Arc::default());
        }
        let grid = self.solution.grid();
        let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
        let made: Arc<[Mat3]> =
            self.wanted.orientation.frames(grid, &nodes, None, None, self.outside.as_deref())?.at_nodes.into();
        Ok(self.frames.get_or_init(|| made).clone())
    }

    /// A target that varies faster than cells of its size can, in words; `None` where the solution's grid carries it.
    pub fn undersampled(&self) -> Option<&str> {
        self.undersampled.as_deref()
    }

    /// What makes its directions vary more slowly, in words.
    pub fn smoother(&self) -> &'static str {
        self.wanted.smoother()
    }

    /// Cells that are stretched beyond the range that was given, in words.
    pub fn overstretched(&self) -> Option<String> {
        self.wanted.stretch.and_then(|s| s.exceeded(&self.distortion))
    }

    /// Nodes of the grid along each axis, and the steps of conjugate gradients that were taken.
    pub fn effort(&self) -> ([usize; 3], usize) {
        (self.solution.grid().shape, self.steps)
    }
}

impl Mapping for Phase {
    /// Those of the target.
    fn wavelengths(&self) -> [f64; 2] {
        self.wavelengths
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        self.solution.phases(points, out);
        out.iter_mut().for_each(|u| *u = add(*u, self.shift));
    }

    fn jacobian(&self, at: Vec3) -> Mat3 {
        self.solution.jacobian(at)
    }

    fn move_phases(&mut self, by: Vec3) {
        self.shift = add(self.shift, by);
    }

    fn phases_and_jacobians(&self, points: &[Vec3], u: &mut [Vec3], j: &mut [Mat3]) {
        self.solution.jacobians(points, u, j);
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
        self.solution.lipschitz(b)
    }

    /// In the region's bounds.
    fn max_lipschitz(&self) -> f64 {
        self.max_lipschitz
    }

    fn position(&self, u: Vec3, near: Vec3) -> Option<Vec3> {
        self.search(u, near)
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        self.searched(b)
    }

    fn rows<'a>(&'a self, block: &Block<'a>) -> Box<dyn PhaseRows + 'a> {
        self.solution.rows(block, self.shift)
    }
}

/// The singular lines of a target, but for short ones.
fn lines(domain: &SolveDomain, wanted: &PhaseRequest, target: &Target) -> Vec<SingularLine> {
    let least = 0.5 * target.wavelength(domain).iter().flatten().fold(f64::INFINITY, |m: f64, w| m.min(*w));
    let mut found = singular_lines(&domain.grid, &target.frames, &domain.inside, &wanted.alike(), least, 0.0);
    // Two that undo each other within a few steps are none for cells.
    found.retain(|l| l.turn > 0.0);
    found
}

/// The mean of lengths at the nodes in a region; of all nodes if none is.
fn mean_within(inside: &[bool], of: &[Vec3]) -> Vec3 {
    let within = inside.iter().zip(of).filter(|(inside, _)| **inside);
    let (count, sum) = within.fold((0, [0.0; 3]), |(n, s), (_, w)| (n + 1, add(s, *w)));
    if count == 0 { mean_within(&vec![true; of.len()], of) } else { scale(sum, 1.0 / f64::from(count)) }
}

/// The least and the greatest of the smallest lengths at the nodes in a region; at all nodes if none is in it.
fn edges_within(inside: &[bool], of: &[Vec3]) -> [f64; 2] {
    let none = !inside.contains(&true);
    let within = inside.iter().zip(of).filter(|(inside, _)| **inside || none);
    let smallest = within.map(|(_, w)| w.iter().copied().fold(f64::INFINITY, f64::min));
    smallest.fold([f64::INFINITY, 0.0], |[a, b], w| [a.min(w), b.max(w)])
}

impl Candidate {
    /// Whether it is taken where phases of one value would be: its error is far less, and it does not fold where they do not.
    fn is_better_than(&self, single: &Candidate) -> bool {
        let (own, other) = (&self.quality, &single.quality);
        (own.fold.is_none() || other.fold.is_some()) && own.missed <= MISSED[1] * other.missed
    }

    /// The solution with whole phases on faces.
    fn fixed(self, domain: &SolveDomain, wanted: &PhaseRequest, region: &dyn Field) -> Result<Candidate, Fault> {
        let Candidate { target, weights, solution, periods, mean, steps, .. } = self;
        let problem = Problem { grid: domain.grid, k: &target.k, weights, ratio: wanted.ratio()? };
        let solution = fixed(&problem, domain, region, &wanted.fix, wanted.shift(&mean), solution)?;
        let weights = problem.weights;
        let quality = SolutionQuality::of(domain, wanted, Some(region), &target, &solution)?;
        Ok(Candidate { target, weights, solution, periods, mean, steps, quality })
    }

    /// The solution whose cells are stretched within a range; where that folds and the one without a range does not, the latter.
    fn bounded(
        self,
        domain: &SolveDomain,
        wanted: &PhaseRequest,
        region: Option<&dyn Field>,
        range: Stretch,
    ) -> Result<Candidate, Fault> {
        let [least, most] = range.range();
        let [low, high] = self.quality.distortion.stretch;
        if self.quality.fold.is_none() && low >= least && high <= most {
            return Ok(self);
        }
        let Candidate { target, weights, solution, periods, mean, steps, quality: before } = self;
        let problem = Problem { grid: domain.grid, k: &target.k, weights, ratio: wanted.ratio()? };
        // The cells of the grid that the region reaches into.
        let reach = norm(domain.grid.step);
        let counts: Vec<bool> = domain.depth.iter().map(|d| *d <= reach).collect();
        let hold = |margin: f64| -> Result<(Solution, SolutionQuality), Fault> {
            let held = bounded(&problem, &counts, (range, margin), &solution);
            let quality = SolutionQuality::of(domain, wanted, region, &target, &held)?;
            Ok((held, quality))
        };
        let excess =
            |of: &SolutionQuality| if of.fold.is_some() { f64::INFINITY } else { range.excess(of.distortion.stretch) };
        let (mut held, mut quality) = hold(MARGINS[0])?;
        for margin in &MARGINS[1..] {
            if excess(&quality) <= 1.0 {
                break;
            }
            let next = hold(*margin)?;
            if excess(&next.1) < excess(&quality) {
                (held, quality) = next;
            }
        }
        let weights = problem.weights;
        // What keeps to no range is no worse than what folds.
        let (solution, quality) = match (before.fold, quality.fold) {
            (None, Some(_)) => (solution, before),
            _ => (held, quality),
        };
        Ok(Candidate { target, weights, solution, periods, mean, steps, quality })
    }
}

/// The map whose phases close round all holes, if the region has some: of the best whole numbers of cells the first that does not fold, or
/// if all do and where they may, the best. Also what was tried, in words.
fn closed(
    domain: &SolveDomain,
    wanted: &PhaseRequest,
    settings: &SolverOptions,
    (ratio, target): (f64, &Target),
) -> Result<(Option<Candidate>, String), Fault> {
    let Some(region) = settings.region else { return Ok((None, String::new())) };
    let search = HoleSearch { grid: &domain.grid, depth: &domain.depth, region };
    let count = search.count();
    if count > MOST {
        return Ok((None, format!("; the region has {count} holes, and phases close round {MOST} at most")));
    }
    let holes = if count > 0 { search.all() } else { Vec::new() };
    if holes.is_empty() {
        return Ok((None, String::new()));
    }
    let ones = || vec![1.0; domain.grid.len()];
    let roots = |steps: f64| -> Result<Vec<f64>, Fault> {
        Ok(domain.roots(wanted.weight.as_ref(), target.trust.as_deref(), steps)?.unwrap_or_else(ones))
    };
    let squares = EdgeSquares::new(domain.grid, &roots(f64::INFINITY)?, Some(&domain.depth));
    let problem = Problem { grid: domain.grid, k: &target.k, weights: Some((roots(SHARP)?, squares)), ratio };
    let Integral { values, mean, steps } = problem.solve();
    let angles = HoleAngles::new(&problem, holes, &values);
    let weights = problem.weights;
    let mut first = None;
    for (solution, periods) in angles.solutions(&domain.grid, &values) {
        checkpoint();
        if fold_at_node(&solution, domain).or_else(|| fold_between(&solution, &domain.inside)).is_none() {
            let quality = SolutionQuality::of(domain, wanted, settings.region, target, &solution)?;
            if quality.fold.is_none() {
                let (words, target) = (tried_periods(&periods), target.clone());
                return Ok((Some(Candidate { target, weights, solution, periods, mean, steps, quality }), words));
            }
        }
        first.get_or_insert((solution, periods));
    }
    let Some((solution, periods)) = first else { return Ok((None, String::new())) };
    let words = tried_periods(&periods);
    if !settings.folds && wanted.stretch.is_none() {
        return Ok((None, words));
    }
    let quality = SolutionQuality::of(domain, wanted, settings.region, target, &solution)?;
    let target = target.clone();
    Ok((Some(Candidate { target, weights, solution, periods, mean, steps, quality }), words))
}

#[cfg(test)]
mod tests;
