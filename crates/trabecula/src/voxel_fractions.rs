//! Solid fractions of voxels.
//!
//! A voxel's fraction is exact where no surface passes through it, by the proven bounds. Where one does, it is the volume below the plane of the
//! value and gradient at the centre, in closed form, less ∫ f / |∇f| over the part of that plane within the voxel (f is zero on the
//! surface, so this is the volume between both, to first order): quadratic functions are integrated exactly. The error of a voxel
//! of edge h is O(h²) of its volume, O(h⁵) mm³; planes are exact. Where surfaces meet, voxels are divided, and the smallest
//! ones cut by all planes.

mod finite_elements;
mod plane_cut;
mod simplex_volume;

use geometry::math::{Aabb, Vec3, add};
use geometry::progress::{Progress, Stopped};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use crate::csg_tree::{CsgSolid, CsgTree, Sign};
use crate::implicit::Surface;
pub use finite_elements::voxel_elements;
use plane_cut::{LinearFunction, below, patch};
use simplex_volume::volume;

/// A grid of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Lowest corner.
    pub origin: Vec3,
    /// Edges of a voxel.
    pub step: Vec3,
    /// Voxels along each axis.
    pub shape: [usize; 3],
}

/// Voxels along each edge of the blocks that are done at a time.
const BLOCK: usize = 8;
/// Times that a voxel is halved, where surfaces meet or bend.
const DEPTH: usize = 3;
/// Greatest deviation from the plane, in units of its rise from the centre of a voxel to its corner, without division.
const BENT: f64 = 0.15;

/// The solid fraction of each voxel of a grid, x fastest.
///
/// # Errors
/// An interruption.
pub fn voxel_fractions(solid: &CsgSolid, grid: &VoxelGrid, progress: &dyn Progress) -> Result<Vec<f64>, Stopped> {
    let [nx, ny, nz] = grid.shape;
    let blocks = grid.shape.map(|n| n.div_ceil(BLOCK));
    let total: usize = blocks.iter().product();
    let (done, stopped) = (AtomicU64::new(0), AtomicBool::new(false));
    let each: Vec<Vec<f64>> = (0..total)
        .into_par_iter()
        .map(|i| {
            if stopped.load(Relaxed) || !progress.step(done.fetch_add(1, Relaxed), total as u64) {
                stopped.store(true, Relaxed);
                return Vec::new();
            }
            let first = [i % blocks[0], i / blocks[0] % blocks[1], i / blocks[0] / blocks[1]].map(|b| b * BLOCK);
            let size = [0, 1, 2].map(|a| BLOCK.min(grid.shape[a] - first[a]));
            let mut block = VoxelBlock { solid, grid, first, size, out: vec![0.0; size.iter().product()] };
            block.fill([0; 3], size, &solid.tree);
            block.out
        })
        .collect();
    if stopped.into_inner() {
        return Err(Stopped::Interrupted);
    }
    let mut out = vec![0.0; nx * ny * nz];
    for (i, values) in each.into_iter().enumerate() {
        let first = [i % blocks[0], i / blocks[0] % blocks[1], i / blocks[0] / blocks[1]].map(|b| b * BLOCK);
        let width = BLOCK.min(nx - first[0]);
        let height = BLOCK.min(ny - first[1]);
        for (row, values) in values.chunks(width).enumerate() {
            let at = ((first[2] + row / height) * ny + first[1] + row % height) * nx + first[0];
            out[at..at + width].copy_from_slice(values);
        }
    }
    Ok(out)
}

/// A block of voxels.
struct VoxelBlock<'a> {
    solid: &'a CsgSolid,
    grid: &'a VoxelGrid,
    first: [usize; 3],
    size: [usize; 3],
    out: Vec<f64>,
}

impl VoxelBlock<'_> {
    /// Fills the voxels from `low` to `high` where the solid is `tree`.
    fn fill(&mut self, low: [usize; 3], high: [usize; 3], tree: &CsgTree) {
        let corner =
            |i: [usize; 3]| [0, 1, 2].map(|a| self.grid.origin[a] + self.grid.step[a] * (self.first[a] + i[a]) as f64);
        let bounds = Aabb { min: corner(low), max: corner(high) };
        let tree = known(&self.solid.surfaces, tree, &bounds);
        let single = (0..3).all(|a| high[a] - low[a] == 1);
        let value = match &tree {
            t if *t == CsgTree::FULL => Some(1.0),
            t if *t == CsgTree::EMPTY => Some(0.0),
            t if single => Some(fraction(&self.solid.surfaces, t, &bounds, 0).clamp(0.0, 1.0)),
            _ => None,
        };
        let Some(value) = value else {
            let axis = (0..3).max_by_key(|a| high[*a] - low[*a]).unwrap_or(0);
            let middle = (low[axis] + high[axis]) / 2;
            let (mut end, mut start) = (high, low);
            (end[axis], start[axis]) = (middle, middle);
            self.fill(low, end, &tree);
            return self.fill(start, high, &tree);
        };
        for z in low[2]..high[2] {
            for y in low[1]..high[1] {
                let at = (z * self.size[1] + y) * self.size[0];
                self.out[at + low[0]..at + high[0]].fill(value);
            }
        }
    }
}

/// The tree in a box: without surfaces that have one sign there.
fn known(surfaces: &[Surface], tree: &CsgTree, bounds: &Aabb) -> CsgTree {
    tree.simplified(&|i| {
        let b = surfaces[i].field.bound(bounds);
        if b.hi <= 0.0 {
            Sign::Negative
        } else if b.lo >= 0.0 {
            Sign::Positive
        } else {
            Sign::Varies(i)
        }
    })
}

/// The solid fraction of a box in which no surface of the tree is known to have one sign.
fn fraction(surfaces: &[Surface], tree: &CsgTree, bounds: &Aabb, depth: usize) -> f64 {
    let mut names = Vec::new();
    tree.for_each(&mut |i| names.push(i));
    names.sort_unstable();
    names.dedup();
    let cuts: Vec<SurfaceCut> = names.iter().map(|i| SurfaceCut::new(&surfaces[*i], bounds)).collect();
    let name = |i: usize| names.binary_search(&i).unwrap_or(0);
    if (depth == DEPTH || cuts.iter().all(|c| !c.is_bent()))
        && let Some(sum) = apart(tree, &cuts, &name)
    {
        return sum;
    }
    if depth == DEPTH {
        let planes: Vec<LinearFunction> = cuts.iter().map(|c| c.plane).collect();
        return volume(&planes, &|signs| tree.solid(&|i| if signs[name(i)] { u64::MAX } else { 0 }) & 1 == 1);
    }
    let half = bounds.size().map(|s| 0.5 * s);
    let part = |i: usize| {
        let min = add(bounds.min, [0, 1, 2].map(|a| if i >> a & 1 == 1 { half[a] } else { 0.0 }));
        let bounds = Aabb { min, max: add(min, half) };
        match known(surfaces, tree, &bounds) {
            t if t == CsgTree::FULL => 1.0,
            t if t == CsgTree::EMPTY => 0.0,
            t => fraction(surfaces, &t, &bounds, depth + 1),
        }
    };
    (0..8).map(part).sum::<f64>() / 8.0
}

/// A surface in a box.
struct SurfaceCut {
    plane: LinearFunction,
    /// Greatest deviation of the function from its plane at the corners.
    deviation: f64,
    /// Volume fraction of the negative side.
    negative: f64,
}

impl SurfaceCut {
    fn new(surface: &Surface, bounds: &Aabb) -> SurfaceCut {
        let (center, half) = (bounds.center(), bounds.size().map(|s| 0.5 * s));
        let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
        surface.field.gradients(&[center], &mut value, &mut gradient);
        let plane = LinearFunction { value: value[0], slope: [0, 1, 2].map(|a| gradient[0][a] * half[a]) };
        let at = |p: Vec3| [0, 1, 2].map(|a| center[a] + half[a] * p[a]);
        let corners: [Vec3; 8] = std::array::from_fn(|i| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 1.0 } else { -1.0 }));
        let mut found = [0.0; 8];
        surface.field.values(&corners.map(at), &mut found);
        let off = corners.iter().zip(found).map(|(p, f)| (f - plane.at(*p)).abs());
        let deviation = off.fold(0.0, f64::max);
        let mut negative = below(&plane);
        let (points, weights) = patch(&plane);
        if !points.is_empty() {
            let mut values = vec![0.0; points.len()];
            let points: Vec<Vec3> = points.into_iter().map(at).collect();
            surface.field.values(&points, &mut values);
            let moved: f64 = values.iter().zip(&weights).map(|(f, w)| f * w).sum();
            negative = (negative - moved / (8.0 * plane.steepness())).clamp(0.0, 1.0);
        }
        SurfaceCut { plane, deviation, negative }
    }

    /// Whether the plane is no good approximation: the surface bends, or it may pass where the plane does not.
    fn is_bent(&self) -> bool {
        let rise = self.plane.rise();
        let gap = self.plane.value.abs() - rise;
        self.deviation > BENT * rise || (gap > 0.0 && gap < self.deviation)
    }
}

/// The solid fraction where the surfaces' empty sides (in an intersection) or solid sides (in a union) do not overlap: then
/// they add up. `None` if they may.
fn apart(tree: &CsgTree, cuts: &[SurfaceCut], name: &impl Fn(usize) -> usize) -> Option<f64> {
    let (of, all) = match tree {
        CsgTree::Leaf(i) => return Some(cuts[name(*i)].negative),
        CsgTree::Outside(i) => return Some(1.0 - cuts[name(*i)].negative),
        CsgTree::Intersection(of) => (of, true),
        CsgTree::Union(of) => (of, false),
    };
    // The side that must not overlap, as a plane that is positive there, and its volume.
    let side = |t: &CsgTree| match t {
        CsgTree::Leaf(i) => Some((&cuts[name(*i)], all)),
        CsgTree::Outside(i) => Some((&cuts[name(*i)], !all)),
        _ => None,
    };
    let sides: Vec<(&SurfaceCut, bool)> = of.iter().map(side).collect::<Option<_>>()?;
    for (n, (a, up)) in sides.iter().enumerate() {
        for (b, other) in &sides[..n] {
            if !a.plane.oriented(*up).excludes(&b.plane.oriented(*other)) {
                return None;
            }
        }
    }
    let sum: f64 = sides.iter().map(|(c, up)| if *up { 1.0 - c.negative } else { c.negative }).sum();
    Some(if all { 1.0 - sum } else { sum })
}

#[cfg(test)]
mod tests;
