//! How a solution compares with its target: at nodes of its grid and between them, in the region.

use rayon::prelude::*;

use super::cut_cells::CutCells;
use super::distortion::{self, Distortion, FrameField};
use super::frame;
use super::phase_grid::PhaseGrid;
use super::phase_request::PhaseRequest;
use super::phase_target::{SolveDomain, Target, wavelengths};
use super::solution::Solution;
use super::surface_feet::feet;
use crate::field::Field;
use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, add, determinant, norm, scale, sub, transpose};
use geometry::progress::checkpoint;
use geometry::random::low_discrepancy;

/// Most nodes at which a solution is compared with the target.
const COMPARED: usize = 60_000;
/// And most points between nodes.
const BETWEEN: usize = 30_000;
/// Points in a region that is thin or small for the grid, of which more are looked for where fewer are found.
const FEW: usize = 100;
/// How a solution compares with its target.
pub(super) struct SolutionQuality {
    pub distortion: Distortion,
    /// Jacobians where they were compared.
    pub jacobians: Vec<Mat3>,
    /// |∇Φ − K|² over |K|², all three in the mean over points between nodes.
    pub missed: f64,
    /// Where det J is not positive.
    pub fold: Option<Vec3>,
    /// How deep below the surface of the region nodes and points are, mm, at most; infinite without a region.
    pub deepest: f64,
}

impl SolutionQuality {
    pub fn of(
        domain: &SolveDomain,
        wanted: &PhaseRequest,
        region: Option<&dyn Field>,
        target: &Target,
        solution: &Solution,
    ) -> Result<SolutionQuality, Fault> {
        let (SolveDomain { grid, nodes, inside, depth, .. }, wavelength) = (domain, target.wavelength(domain));
        let within: Vec<usize> = (0..grid.len()).filter(|&n| inside[n]).collect();
        // The density at every node; the other measures, which cost more, at some tens of thousands.
        let density: Vec<f64> = within
            .par_iter()
            .map(|&n| {
                let cells = determinant(&solution.jacobian(nodes[n]));
                cells * wavelength[n].iter().product::<f64>()
            })
            .collect();
        checkpoint();
        let (compared, between) = compared(grid, depth, inside, region);
        let positions: Vec<Vec3> = compared.iter().map(|n| nodes[*n]).chain(between.iter().copied()).collect();
        let mut jacobians: Vec<Mat3> = positions.par_iter().map(|p| solution.jacobian(*p)).collect();
        let cuts = solution.branches.as_ref();
        if let Some(cuts) = cuts {
            compared.iter().zip(&mut jacobians).for_each(|(n, j)| *j = cuts.of_node(*n, j));
        }
        let off_nodes = targets(wanted, target.range, grid, &target.frames, target.lengths.as_deref(), cuts, &between)?;
        let k = &target.k;
        let at_nodes = compared.iter().map(|&n| [k[0][n], k[1][n], k[2][n]]);
        let asked: Vec<Mat3> = at_nodes.chain(off_nodes).collect();
        let found: Vec<_> = jacobians.par_iter().zip(&asked).map(|(j, k)| distortion::compare(j, k)).collect();
        // Differences across cuts say nothing.
        let whole = |n: &&usize| cuts.is_none_or(|c| !c.is_near(**n));
        let curl: Vec<f64> = (compared.par_iter()).filter(whole).map(|&n| distortion::curl(grid, k, n)).collect();
        let longest = wavelength.iter().flatten().fold(0.0, |m: f64, w| m.max(*w));
        let turn = FrameField { grid, frames: &target.frames, cuts, inside }.turning(longest);
        let order = |a: &usize, b: &usize| density[*a].total_cmp(&density[*b]);
        let least = (0..density.len()).min_by(order);
        let most = (0..density.len()).max_by(order);
        let mut distortion = Distortion {
            // Without a node in the region that of the points alone.
            density: [least.map_or(f64::INFINITY, |n| density[n]), most.map_or(0.0, |n| density[n])],
            least_at: least.map_or(domain.bounds.center(), |n| nodes[within[n]]),
            ..Distortion::of(&found, compared.len(), &curl, turn)
        };
        distortion.widen(&found, &positions);
        let squares = |m: &Mat3| m.as_flattened().iter().map(|v| v * v).sum::<f64>();
        let even = || jacobians.iter().zip(&asked).skip(compared.len());
        let off: f64 = even().map(|(j, k)| squares(&core::array::from_fn(|i| sub(j[i], k[i])))).sum();
        let missed = off / even().map(|(_, k)| squares(k)).sum::<f64>().max(f64::MIN_POSITIVE);
        let worst = (distortion.density[0] <= 0.0).then_some(distortion.least_at);
        let fold = worst.or_else(|| fold_between(solution, inside));
        let at_nodes = depth.iter().fold(0.0, |m: f64, d| m.max(-d));
        let deepest = values(region, &between).into_iter().fold(at_nodes, |m, d| m.max(-d));
        Ok(SolutionQuality { distortion, jacobians, missed, fold, deepest })
    }
}

/// A node in the region where det J is not positive.
pub(super) fn fold_at_node(solution: &Solution, domain: &SolveDomain) -> Option<Vec3> {
    let nodes = domain.nodes.par_iter().zip(&domain.inside).filter(|(_, inside)| **inside);
    nodes.map(|(p, _)| *p).find_first(|p| determinant(&solution.jacobian(*p)) <= 0.0)
}

/// The middle of a cell of the grid in the region where det J is not positive.
pub(super) fn fold_between(solution: &Solution, inside: &[bool]) -> Option<Vec3> {
    let grid = solution.grid();
    let (strides, half) = (grid.strides(), scale(grid.step, 0.5));
    let far: usize = strides.iter().sum();
    (0..grid.len())
        .into_par_iter()
        .filter(|&n| (0..3).all(|a| grid.index(n)[a] + 1 < grid.shape[a]) && inside[n] && inside[n + far])
        .map(|n| add(grid.node(n), half))
        .find_first(|p| determinant(&solution.jacobian(*p)) <= 0.0)
}

/// Where a solution is compared with its target: nodes in the region, and points in the region, one in a cell of the grid.
pub(super) fn compared(
    grid: &PhaseGrid,
    depth: &[f64],
    inside: &[bool],
    region: Option<&dyn Field>,
) -> (Vec<usize>, Vec<Vec3>) {
    let within = inside.iter().filter(|i| **i).count().max(1) as f64;
    let some = |most: usize| {
        let keep = most as f64 / within;
        (0..grid.len()).filter(move |n| (*n as f64 * 0.618_033_988_749_895).fract() < keep)
    };
    // The region may reach into a cell though none of its nodes is in it.
    let reach = norm(grid.step);
    let cell = |n: &usize| (0..3).all(|a| grid.index(*n)[a] + 1 < grid.shape[a]) && depth[*n] <= reach;
    let off = |n: usize| -> Vec3 {
        let s = low_discrepancy(n + 1);
        core::array::from_fn(|a| grid.node(n)[a] + s[a] * grid.step[a])
    };
    let mut between: Vec<Vec3> = some(BETWEEN).filter(cell).map(off).collect();
    if let Some(region) = region {
        between = those_in(region, between);
        if between.len() < FEW {
            between.extend(scattered(grid, region));
        }
    }
    (some(COMPARED).filter(|n| inside[*n]).collect(), between)
}

/// The signed distances of points from a region, if there is one.
fn values(region: Option<&dyn Field>, points: &[Vec3]) -> Vec<f64> {
    let mut depth = vec![f64::NEG_INFINITY; points.len()];
    if let Some(region) = region {
        region.values(points, &mut depth);
    }
    depth
}

/// Those of the points that are in a region.
fn those_in(region: &dyn Field, points: Vec<Vec3>) -> Vec<Vec3> {
    let depth = values(Some(region), &points);
    points.into_iter().zip(depth).filter(|(_, d)| *d <= 0.0).map(|(p, _)| p).collect()
}

/// Points throughout a region that is small or thin for a grid; of one that hardly any point hits, those of its surface.
fn scattered(grid: &PhaseGrid, region: &dyn Field) -> Vec<Vec3> {
    let size = |a: usize| grid.step[a] * (grid.shape[a] - 1) as f64;
    let at = |i: usize| core::array::from_fn(|a| grid.origin[a] + low_discrepancy(i + 1)[a] * size(a));
    let tried: Vec<Vec3> = (0..BETWEEN).map(at).collect();
    let found = those_in(region, tried.clone());
    if found.len() >= FEW {
        return found;
    }
    let near = |(p, d): (Vec3, f64)| (d <= norm(grid.step)).then_some(p);
    let depth = values(Some(region), &tried);
    let on = feet(region, &tried.into_iter().zip(depth).filter_map(near).collect::<Vec<Vec3>>());
    let off = values(Some(region), &on);
    let reached = on.into_iter().zip(off).filter(|(_, d)| d.abs() <= 1e-6 * norm(grid.step)).map(|(p, _)| p);
    found.into_iter().chain(reached).collect()
}

/// The target gradients at points; `lengths` are the wavelengths at the nodes, where they are not those that are given; `frames` are
/// those of the nodes, from which points have their signs and axes, or, if they are smoothed, their frames. Across cuts they are those of
/// the branch of the first node about the point.
pub(super) fn targets(
    wanted: &PhaseRequest,
    range: f64,
    grid: &PhaseGrid,
    frames: &[Mat3],
    lengths: Option<&[Vec3]>,
    cuts: Option<&CutCells>,
    points: &[Vec3],
) -> Result<Vec<Mat3>, Fault> {
    let smooth = wanted.averaged().is_some();
    let like: Vec<Mat3> = match smooth || wanted.orientation.is_combed() {
        true => points.par_iter().map(|p| frame::interpolated(grid, frames, cuts, *p)).collect(),
        false => Vec::new(),
    };
    let frames = if smooth { like } else { wanted.orientation.frames_near(points, &like, range)? };
    let between = |p: &Vec3, of: &[Vec3]| grid.around(*p).iter().fold([0.0; 3], |m, (n, s)| add(m, scale(of[*n], *s)));
    let wavelength = match lengths {
        Some(of) => points.par_iter().map(|p| between(p, of)).collect(),
        None => wavelengths(&wanted.wavelength, points)?,
    };
    let each = frames.iter().zip(&wavelength).map(|(f, w)| {
        let k = transpose(f);
        [0, 1, 2].map(|i| scale(k[i], 1.0 / w[i]))
    });
    Ok(each.collect())
}
