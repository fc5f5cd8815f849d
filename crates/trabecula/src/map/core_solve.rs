//! Solid rods or bores about singular lines, at which no phases are continuous.

use super::branch_cuts::BranchCuts;
use super::branched_solve::{Branched, FreeIntegers};
use super::core_branches::{labels, rotations};
use super::cut_cells::{self, CutCells};
use super::edge_squares::weights;
use super::grid_choice;
use super::periods::{least, nearest};
use super::phase_candidate::Candidate;
use super::phase_request::{PhaseRequest, SolverOptions};
use super::phase_target::{LEAST_ROOT, SolveDomain, Target, wavelengths};
use super::singular_core::{CoreFill, CoreOptions};
use super::singular_lines::{FrameEquivalence, SingularLine, singular_lines};
use super::solution::Solution;
use super::solution_quality::{SolutionQuality, fold_at_node, fold_between};
use super::winding::Winding;
use crate::field::Field;
use crate::region::{OutsideTube, Tube, smoothed};
use geometry::fault::{Fault, number, position};
use geometry::math::{Aabb, IDENTITY, Mat3, Vec3, add, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;

/// Steps of the grid in the radius of a core: cells are torn within 2 √2 steps of a line, which is known to most of a step.
const FINE: f64 = 4.0;
/// Nodes of the grid beyond the part.
const PADDING: usize = 3;
/// The most lines that are covered: each but the first takes two more solutions.
pub(super) const MOST: usize = 12;
/// How deep the end of a line may lie in the part, in steps: lines are found between nodes in the part.
const END: f64 = 3.0;

/// Least cosine of the angle between the ends of lines that face each other and the way from one to the other.
const FACING: f64 = 0.7;

/// The cores of a map.
#[derive(Clone, Debug)]
pub struct Cores {
    /// What they are.
    pub fill: CoreFill,
    /// All points that are at most the radius away from a line.
    pub tube: Tube,
}

/// A map of one value but for the branches at covered lines.
pub(super) struct Covered {
    pub domain: SolveDomain,
    pub found: Candidate,
    pub lines: Vec<SingularLine>,
    pub cores: Cores,
}

impl CoreOptions {
    /// The map outside the cores of `lines`, which are those on a coarser grid; `None` where a finer one has none.
    pub(super) fn solve(
        &self,
        bounds: &Aabb,
        wanted: &PhaseRequest,
        settings: &SolverOptions,
        (coarse, lines): (f64, &[SingularLine]),
    ) -> Result<Option<Covered>, Fault> {
        refuse(wanted)?;
        let radius = self.radius(wanted, lines)?;
        let step = settings.step.unwrap_or(coarse).min(radius / FINE);
        let chosen = grid_choice::choose(bounds, wanted, Some(step), settings.region)
            .map_err(|f| if f.at == "step" { too_fine(radius) } else { f })?;
        let domain = SolveDomain::over(bounds, chosen.grid.padded(PADDING), wanted, settings.region)?;
        checkpoint();
        let mut target = Target::new(&domain, wanted)?;
        checkpoint();
        let least_length = 0.5 * shortest(&domain);
        let lines = singular_lines(&domain.grid, &target.frames, &domain.inside, &wanted.alike(), least_length, radius);
        let pieces = lines
            .iter()
            .map(|l| Ok((path(l, &domain, wanted, settings)?, l.turn)))
            .collect::<Result<Vec<_>, Fault>>()?;
        let mut paths = joined(pieces);
        paths.iter_mut().for_each(|p| lead_on(p, radius + END * domain.longest()));
        if paths.is_empty() {
            return Ok(None);
        }
        if paths.len() > MOST {
            let message = format!(
                "axes do not come back to themselves round {} lines; {MOST} at most are covered: {}, or leave core out",
                paths.len(),
                wanted.smoother()
            );
            return Err(Fault::new("core", message));
        }
        let mut cuts = BranchCuts::new(&domain.grid, &mut paths);
        let tube = Tube::new(&paths, radius);
        let outside: Vec<bool> =
            (domain.nodes.iter().zip(&domain.inside)).map(|(p, i)| *i && tube.value(*p) > 0.0).collect();
        if !outside.contains(&true) {
            let message =
                format!("{} mm; cores of this radius cover the whole part: give a smaller one", number(radius));
            return Err(Fault::new("core_radius", message));
        }
        let alike = wanted.alike();
        let labels = labels(&domain, &target, &outside, &cuts, &alike);
        target.relabel(&labels, &domain.given);
        rotations(&domain, &target, &outside, &mut cuts, wanted)?;
        let cores = Cores { fill: self.fill, tube };
        let found = found(SolveDomain { inside: outside, ..domain }, wanted, settings, target, cuts, &cores)?;
        Ok(Some(Covered { domain: found.0, found: found.1, lines, cores }))
    }

    /// The radius of cores, mm.
    fn radius(&self, wanted: &PhaseRequest, lines: &[SingularLine]) -> Result<f64, Fault> {
        if let Some(radius) = self.radius {
            return Ok(radius);
        }
        let points: Vec<Vec3> = lines.iter().flat_map(|l| l.points.iter().copied()).collect();
        let longest = wavelengths(&wanted.wavelength, &points)?.into_iter().flatten().fold(0.0, f64::max);
        Ok(0.5 * longest)
    }
}

fn shortest(domain: &SolveDomain) -> f64 {
    domain.given.iter().flatten().fold(f64::INFINITY, |m: f64, w| m.min(*w))
}

fn too_fine(radius: f64) -> Fault {
    let message = format!(
        "{} mm; the grid needs {FINE} steps in the radius of a core, and in a part of this size these are too many: give a larger core_radius",
        number(radius)
    );
    Fault::new("core_radius", message)
}

/// Refuses what does not go with cores.
pub(super) fn refuse(wanted: &PhaseRequest) -> Result<(), Fault> {
    let clash = |key: &str, why: &str| {
        let message = format!("core covers singular lines here, and {why}; leave {key} or core out");
        Err(Fault::new(key, message))
    };
    if matches!(wanted.alike(), FrameEquivalence::Line) {
        let message = "a direction alone comes back reversed round a line, and says nothing of the cell's other two axes there: core needs \
                       a stress or a frame; give one of these, or leave core out";
        return Err(Fault::new("core", message));
    }
    if wanted.stretch.is_some() {
        return clash("stretch", "cells round them are not held within a range");
    }
    if !wanted.fix.is_empty() {
        return clash("fix", "phases are fixed by the lines");
    }
    if wanted.angle_weight != 1.0 {
        return clash("angle_weight", "errors of angle and of spacing count alike round them");
    }
    if wanted.offset != [0.0; 3] {
        return clash("offset", "phases are fixed by the lines");
    }
    Ok(())
}

/// A smooth polyline along a singular line, from surface to surface.
fn path(
    line: &SingularLine,
    domain: &SolveDomain,
    wanted: &PhaseRequest,
    settings: &SolverOptions,
) -> Result<Vec<Vec3>, Fault> {
    if line.is_closed() {
        let message = format!(
            "a singular line is closed, {}: core covers lines from surface to surface; {}, or leave core out",
            line.description(1),
            wanted.smoother()
        );
        return Err(Fault::new("core", message));
    }
    let path = smoothed(&line.points, domain.longest());
    let Aabb { min, max } = domain.bounds;
    let box_depth = |p: Vec3| (0..3).map(|a| (min[a] - p[a]).max(p[a] - max[a])).fold(f64::NEG_INFINITY, f64::max);
    for p in [path[0], path[path.len() - 1]] {
        if settings.region.map_or_else(|| box_depth(p), |r| r.value(p)) < -END * domain.longest() {
            let message = format!(
                "a singular line ends within the part at {}, where lines meet or directions are not clear: core covers lines from surface to \
                 surface; {}, or leave core out",
                position(p),
                wanted.smoother()
            );
            return Err(Fault::new("core", message));
        }
    }
    Ok(path)
}

/// Lines, each with its turn, of which one leaves the part and another of the same turn enters it again ahead, as one: whatever lies between,
/// phases have one branch about both.
fn joined(mut lines: Vec<(Vec<Vec3>, f64)>) -> Vec<Vec<Vec3>> {
    let outward = |l: &[Vec3], last: bool| {
        let n = l.len();
        if last { (l[n - 1], unit(sub(l[n - 1], l[n - 2]))) } else { (l[0], unit(sub(l[0], l[1]))) }
    };
    // How far apart two ends are that face each other.
    let gap = |a: (Vec3, Vec3), b: (Vec3, Vec3)| {
        let (way, length) = (sub(b.0, a.0), norm(sub(b.0, a.0)));
        (dot(way, a.1) > FACING * length && -dot(way, b.1) > FACING * length).then_some(length)
    };
    loop {
        let ends: Vec<(usize, bool)> = (0..lines.len()).flat_map(|i| [(i, false), (i, true)]).collect();
        let pairs = ends.iter().flat_map(|a| ends.iter().filter(move |b| a.0 < b.0).map(move |b| (*a, *b)));
        let pairs = pairs.filter(|(a, b)| lines[a.0].1 == lines[b.0].1);
        let facing =
            pairs.filter_map(|(a, b)| Some((gap(outward(&lines[a.0].0, a.1), outward(&lines[b.0].0, b.1))?, a, b)));
        let Some((_, a, b)) = facing.min_by(|x, y| x.0.total_cmp(&y.0)) else {
            return lines.into_iter().map(|l| l.0).collect();
        };
        let mut second = lines.swap_remove(b.0).0;
        let first = &mut lines[a.0].0;
        if !a.1 {
            first.reverse();
        }
        if b.1 {
            second.reverse();
        }
        first.extend(second);
    }
}

/// Leads a line on beyond both ends.
fn lead_on(line: &mut [Vec3], by: f64) {
    let n = line.len();
    for (end, next) in [(0, 1), (n - 1, n - 2)] {
        line[end] = add(line[end], scale(unit(sub(line[end], line[next])), by));
    }
}

/// The map for the whole numbers with the least error that does not fold outside the cores, and the grid whose nodes in the cores do not
/// count.
fn found(
    domain: SolveDomain,
    wanted: &PhaseRequest,
    settings: &SolverOptions,
    target: Target,
    mut cuts: BranchCuts,
    cores: &Cores,
) -> Result<(SolveDomain, Candidate), Fault> {
    let Cores { tube, .. } = cores;
    let plain = || vec![1.0; domain.grid.len()];
    let mut roots = target.roots(&domain, wanted)?.unwrap_or_else(plain);
    for (root, p) in roots.iter_mut().zip(&domain.nodes) {
        let near = (tube.from_lines(*p) / tube.radius).min(1.0).powi(2);
        *root = (*root * near).max(LEAST_ROOT);
    }
    let edges = weights(domain.grid, &roots, None);
    let mean = target.mean(&roots);
    // Every other node is enough to find the numbers with the least error.
    let numbers = {
        let (half, nodes) = domain.grid.halved();
        let k = target.k.each_ref().map(|k| nodes.iter().map(|n| k[*n]).collect());
        let roots: Vec<f64> = nodes.iter().map(|n| roots[*n]).collect();
        FreeIntegers::new(&half, &k, weights(half, &roots, None), &mut cuts.at(&nodes))
    };
    let asked = least(&numbers.form, numbers.free.len());
    let part = OutsideTube { region: settings.region, tube };
    let mut problem = Branched::new(&domain.grid, &target.k, edges, &cuts);
    let (mut first, mut steps) = (None, 0);
    for (_, given) in nearest(&numbers.form, &asked) {
        checkpoint();
        numbers.set(&given, &mut cuts);
        let (mut values, taken) = problem.phases(&cuts);
        steps = steps.max(taken);
        anchor(&mut values, &domain, &cuts, &mean, &roots);
        let (spline, branches) = cut_cells::through(domain.grid, &values, cuts.clone());
        torn(&branches, &part, tube.radius, wanted)?;
        let solution = Solution { spline, winding: Winding::default(), branches: Some(branches) };
        let fold = fold_at_node(&solution, &domain).or_else(|| fold_between(&solution, &domain.inside));
        if fold.is_none() || first.is_none() {
            first = Some(solution);
        }
        if fold.is_none() {
            break;
        }
    }
    let Some(solution) = first else { return Err(Fault::new("core", "no map was found")) };
    let quality = SolutionQuality::of(&domain, wanted, Some(&part), &target, &solution)?;
    Ok((domain, Candidate { target, weights: None, solution, periods: Vec::new(), mean, steps, quality }))
}

/// Moves phases that no rotation fixes so that their mean is that of K̄ x, as where there are no lines.
fn anchor(values: &mut [Vec3], domain: &SolveDomain, cuts: &BranchCuts, mean: &Mat3, roots: &[f64]) {
    let free = |a: &usize| (0..cuts.len()).all(|line| cuts.step(line).turn[*a] == IDENTITY[*a]);
    let whole: f64 = roots.iter().map(|r| r * r).sum();
    for a in (0..3).filter(free) {
        let off = |n: usize| roots[n] * roots[n] * (values[n][a] - dot(mean[a], domain.nodes[n]));
        let off = (0..values.len()).map(off).sum::<f64>() / whole;
        values.iter_mut().for_each(|u| u[a] -= off);
    }
}

/// Refuses cells of the part that are torn: those next to lines that are not in the cores.
fn torn(branches: &CutCells, part: &dyn Field, radius: f64, wanted: &PhaseRequest) -> Result<(), Fault> {
    // The corners and the middle of a cell, which is at most a fourth of the radius across.
    let out = branches.torn().find_map(|b| {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 0 { b.min[a] } else { b.max[a] });
        (0..8).map(corner).chain([b.center()]).find(|p| part.value(*p) < 0.0)
    });
    out.map_or(Ok(()), |p| {
        let message = format!(
            "{} mm; cells do not fit together at {}, outside the cores, where lines are near to each other or bend sharply: give a larger \
             core_radius, or {}",
            number(radius),
            position(p),
            wanted.smoother()
        );
        Err(Fault::new("core_radius", message))
    })
}
