//! Local thickness: at each point the diameter of the largest ball that lies in the solid, or in the pores, and covers
//! the point.
//!
//! T. Hildebrand and P. Rüegsegger, A new method for the model-independent assessment of thickness in three-dimensional
//! images, J. Microsc. 185 (1997) 67. Sampled on cubic voxels; distances are those to the triangles.
//!
//! Conventions, as in micro-CT software: a solid's balls end at all of its surface, cuts by the region included. Balls of
//! the pores have their centres within the region and end at the solid alone: the region's boundary is no wall, and a
//! ball may reach beyond it. Voxels count equally.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::field::Block;
use crate::region::Region;
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Vec3};
use geometry::measure::{defects, size};
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;

mod balls;
mod bits;
mod lines;
mod nearest_site;

use balls::BallSpace;
use bits::Bits;
use lines::{LineCrossings, MeshInSteps};

/// Bytes of memory that a voxel takes at most, sites of the surface included.
pub const BYTES_PER_VOXEL: f64 = 16.0;
/// The error of a mean, in steps, where walls are two and a half steps or more: the most that gyroids showed
/// against limits extrapolated from finer steps.
const ACCURACY: f64 = 0.2;
/// The share of a step to which a centre is on the region's boundary, and bounds are a whole number of steps: more than what coordinates in
/// files of single precision are rounded by.
const ON: f64 = 1e-3;
/// The most voxels.
const MOST: f64 = (1u64 << 33) as f64;
/// Steps in the mean wall, 2 V / A, if nothing is asked for.
const STEPS: f64 = 8.0;
/// The most voxels if nothing is asked for.
const USUAL: f64 = (1u64 << 24) as f64;
/// Bars of a histogram, about.
const BARS: f64 = 50.0;

/// The distribution of local thickness over a volume.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct ThicknessSpread {
    /// Minimum between opposite sides, mm; sharp edges, where local thickness ends at 0, are left out.
    pub min: f64,
    /// 5th percentile, mm.
    pub p05: f64,
    /// Mean, mm.
    pub mean: f64,
    /// Standard deviation, mm.
    pub sd: f64,
    /// Maximum, mm.
    pub max: f64,
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Accuracy of these figures, mm.
    pub accuracy: f64,
    /// Shares of the volume by thickness.
    pub histogram: Histogram,
}

/// A histogram.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Histogram {
    /// Ends of the bars, ascending from 0, mm.
    pub edges: Vec<f64>,
    /// Share of the volume in each bar.
    pub share: Vec<f64>,
}

/// Local thickness: at each point the diameter of the largest ball that fits in and covers the point.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "ThicknessReport")]
pub struct Thickness {
    /// Of the solid, mm.
    pub wall_thickness: ThicknessSpread,
    /// Of the pores, mm; None without a region.
    pub pore_size: Option<ThicknessSpread>,
}

/// Voxels over a mesh.
struct SolidVoxels {
    /// Centre of the first voxel, mm.
    first: Vec3,
    step: f64,
    shape: [usize; 3],
    solid: Bits,
}

impl SolidVoxels {
    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.shape[1] + y) * self.shape[0] + x
    }

    fn place(&self, v: [usize; 3]) -> Vec3 {
        core::array::from_fn(|a| self.first[a] + v[a] as f64 * self.step)
    }
}

/// Counts steps of the work, from any thread, and knows whether it is to stop.
struct Watch<'a> {
    progress: &'a dyn Progress,
    done: AtomicU64,
    total: u64,
    stop: AtomicBool,
}

impl<'a> Watch<'a> {
    fn new(progress: &'a dyn Progress, total: u64) -> Watch<'a> {
        Watch { progress, done: AtomicU64::new(0), total, stop: AtomicBool::new(false) }
    }

    /// One step more; whether to go on.
    fn tick(&self) -> bool {
        let done = self.done.fetch_add(1, Relaxed) + 1;
        if !self.progress.step(done.min(self.total), self.total) {
            self.stop.store(true, Relaxed);
        }
        !self.stop.load(Relaxed)
    }

    fn check(&self) -> Result<(), Stopped> {
        if self.stop.load(Relaxed) {
            return Err(Stopped::Interrupted);
        }
        Ok(())
    }
}

/// The bounds that the voxels cover.
fn bounds(surface: &SurfaceMesh, region: Option<&Region>) -> Aabb {
    let own = surface.mesh.bounds();
    region.map_or(own, |r| own.union(r.bounds()))
}

/// The step (mm) that is taken if none is asked for: an eighth of the mean wall 2 V / A, or more, so that there are at
/// most 2²⁴ voxels.
pub fn usual_step(surface: &SurfaceMesh, region: Option<&Region>) -> f64 {
    let wall = 2.0 * surface.mesh.volume() / surface.mesh.area();
    let [x, y, z] = bounds(surface, region).size();
    (wall / STEPS).max((x * y * z / USUAL).cbrt())
}

/// Voxels along each axis for a step (mm).
///
/// # Errors
/// A step that is no length, too coarse to show anything, or so fine that there would be more than 2³³ voxels; bounds
/// that are not finite.
pub fn voxels_for(surface: &SurfaceMesh, region: Option<&Region>, step: f64) -> Result<[usize; 3], Fault> {
    let refuse = |message: String| Err(Fault::new("step", message));
    if !(step.is_finite() && step > 0.0) {
        return refuse(format!("is {step}; it must be a finite number greater than 0, mm"));
    }
    let b = bounds(surface, region);
    if b.is_empty() || !b.is_finite() {
        let message = "the mesh is empty, or the region has no end; there is nothing to lay voxels over";
        return Err(Fault::new("", message));
    }
    let size = b.size();
    let count = size.iter().map(|s| (s / step).ceil().max(1.0)).product::<f64>();
    if count > MOST {
        let better = step * (count / (0.9 * MOST)).cbrt();
        return refuse(format!(
            "{step} mm makes {count:.2e} voxels; at most 8.6e9 are possible: use a step above {better:.3} mm"
        ));
    }
    Ok(size.map(|s| (s / step - ON).ceil().max(1.0) as usize))
}

/// Local thickness of the solid that a closed mesh bounds and, if a region is given, of the pores: what the solid leaves
/// of the region. `cut` of the surface tells which triangles are the region's; voxels have edge `step` (mm).
///
/// For planes, cylinders and spheres the balls are exact up to the mesh; `docs/concepts/measures.md` has the rates. Memory is
/// `BYTES_PER_VOXEL` at most; the same figures for any number of threads.
///
/// # Errors
/// A mesh that is not closed or is inside out; steps as in `voxels_for`, or so coarse that no voxel's centre is in the
/// solid; an interruption.
pub fn thickness(
    surface: &SurfaceMesh,
    region: Option<&Region>,
    step: f64,
    progress: &dyn Progress,
) -> Result<Thickness, Stopped> {
    in_solid(surface, region, step, progress, |space, watch| {
        let wall_thickness = spread(&space, watch)?;
        let mut pore_size = None;
        if let Some(region) = region {
            let pores = pores(space.grid, region);
            let room = |v: [usize; 3]| -region.value(space.grid.place(v)) / step;
            if pores.count() > 0 {
                pore_size = Some(spread(&BallSpace { inside: &pores, side: 1.0, open: Some(&room), ..space }, watch)?);
            }
        }
        Ok(Thickness { wall_thickness, pore_size })
    })
}

/// Local thickness (mm) of the solid at each vertex of its closed mesh, on voxels of edge `step` (mm): the largest of
/// the eight voxels around the vertex, else of the 27 nearest. NaN where none of those has its centre in the solid: it is
/// thinner than a step there.
///
/// # Errors
/// As for `thickness`.
pub fn thickness_at_vertices(surface: &SurfaceMesh, step: f64, progress: &dyn Progress) -> Result<Vec<f64>, Stopped> {
    in_solid(surface, None, step, progress, |space, watch| {
        let balls = space.needed(&space.balls(watch)?);
        let radii = space.paint(&balls, watch)?;
        Ok(surface.mesh.vertices.par_iter().map(|p| 2.0 * step * radius_at(space.grid, &radii, *p)).collect())
    })
}

/// The local radius (steps) at a point of the surface.
fn radius_at(grid: &SolidVoxels, radii: &[f32], p: Vec3) -> f64 {
    let at: Vec3 = core::array::from_fn(|a| (p[a] - grid.first[a]) / grid.step);
    let radius = |v: [i64; 3]| {
        let within = (0..3).all(|a| (0..grid.shape[a] as i64).contains(&v[a]));
        if within { f64::from(radii[grid.index(v.map(|c| c as usize))]) } else { 0.0 }
    };
    // A voxel that its ball just misses has a smaller one, so the largest counts.
    let corners = (0..8).map(|k| radius(core::array::from_fn(|a| at[a].floor() as i64 + (k >> a & 1))));
    let most = corners.fold(0.0, f64::max);
    if most > 0.0 {
        return most;
    }
    let about = (0..27i64).map(|k| {
        let off = [k % 3, k / 3 % 3, k / 9];
        radius(core::array::from_fn(|a| at[a].round() as i64 + off[a] - 1))
    });
    let most = about.fold(0.0, f64::max);
    if most > 0.0 { most } else { f64::NAN }
}

/// Voxels of edge `step` (mm) over a closed mesh and the region, if there is one, and their nearest places of the surface:
/// what `work` makes of the solid's.
fn in_solid<T>(
    surface: &SurfaceMesh,
    region: Option<&Region>,
    step: f64,
    progress: &dyn Progress,
    work: impl FnOnce(BallSpace, &Watch) -> Result<T, Stopped>,
) -> Result<T, Stopped> {
    let refuse = |message: String| Err(Stopped::Refused(Fault::new("", message)));
    let mesh = &surface.mesh;
    let about = size(mesh);
    if !about.closed {
        let d = defects(mesh);
        let wrong = counted(d.open_edges + d.crowded_edges + d.flipped_edges, "edge");
        return refuse(format!(
            "the mesh is not closed ({wrong} without just two triangles of opposite direction), so it has no inside"
        ));
    }
    if about.volume <= 0.0 && !mesh.triangles.is_empty() {
        return refuse(
            "the mesh is inside out or flat: its triangles must run counter-clockwise seen from outside".into(),
        );
    }
    let shape = voxels_for(surface, region, step).map_err(Stopped::Refused)?;
    let nz = shape[2];
    let middle = bounds(surface, region).center();
    let first = [0, 1, 2].map(|a| middle[a] - (shape[a] - 1) as f64 * step / 2.0);
    let steps = nearest_site::PASSES.iter().zip(shape).map(|(p, n)| p * n).sum::<usize>();
    let painted = nz * if region.is_some() { 4 } else { 2 };
    let watch = Watch::new(progress, (steps + painted) as u64);

    let scaled = MeshInSteps::new(mesh, first, step);
    let (x, (y, z)) = rayon::join(
        || LineCrossings::new(&scaled, shape, 0),
        || rayon::join(|| LineCrossings::new(&scaled, shape, 1), || LineCrossings::new(&scaled, shape, 2)),
    );
    let mut lines = [x, y, z];
    let mut sites = Vec::new();
    lines.iter_mut().for_each(|l| l.file(&mut sites));
    if sites.len() >= lines::NONE as usize {
        return refuse("the surface is too large for this step; use a larger step".into());
    }
    let mut grid = SolidVoxels { first, step, shape, solid: Bits::new(shape) };
    fill(&mut grid, &lines[0], &sites);
    if grid.solid.count() == 0 {
        return refuse(format!(
            "no voxel of {step} mm has its centre in the solid: it is thinner than they are; use a smaller step"
        ));
    }
    let nearest = nearest_site::nearest_sites(shape, &sites, &lines, &watch)?;
    drop(lines);

    let lattice = surface.cut.iter().any(|c| !*c);
    let space = BallSpace {
        grid: &grid,
        shape: &scaled,
        sites: &sites,
        nearest: &nearest,
        cut: if lattice { &surface.cut } else { &[] },
        inside: &grid.solid,
        side: -1.0,
        open: None,
    };
    work(space, &watch)
}

/// The voxels whose centres are in the solid.
fn fill(grid: &mut SolidVoxels, lines: &LineCrossings, sites: &[lines::Site]) {
    let nx = grid.shape[0];
    let stride = grid.solid.stride;
    grid.solid.words.par_chunks_mut(stride).enumerate().for_each(|(line, row)| {
        for ends in sites[lines.of(line)].chunks(2) {
            let [a, b] = [0, 1].map(|k| {
                let at = ends.get(k).map_or(nx as f32, |s| s.point[0]);
                at.ceil().clamp(0.0, nx as f32) as usize
            });
            for (w, mask) in bits::masks(a..b) {
                row[w] |= mask;
            }
        }
    });
}

/// The voxels whose centres are in the region and not in the solid.
fn pores(grid: &SolidVoxels, region: &Region) -> Bits {
    let [nx, ny, _] = grid.shape;
    let axes =
        [0, 1, 2].map(|a| (0..grid.shape[a]).map(|i| grid.first[a] + i as f64 * grid.step).collect::<Vec<f64>>());
    let mut pores = Bits::new(grid.shape);
    let stride = pores.stride;
    pores.words.par_chunks_mut(stride * ny).zip(grid.solid.words.par_chunks(stride * ny)).enumerate().for_each_init(
        || vec![0f32; nx * ny],
        |values, (z, (layer, solid))| {
            let block = Block { axes: [&axes[0], &axes[1], &axes[2][z..=z]] };
            region.fill(&block, values);
            // A layer of centres in a face of the region would count with balls of no size.
            for (i, _) in values.iter().enumerate().filter(|(_, v)| f64::from(**v) < -ON * grid.step) {
                layer[i / nx * stride + i % nx / 64] |= 1 << (i % nx % 64);
            }
            layer.iter_mut().zip(solid).for_each(|(p, s)| *p &= !s);
        },
    );
    pores
}

/// The distribution over a space.
fn spread(space: &BallSpace, watch: &Watch) -> Result<ThicknessSpread, Stopped> {
    let balls = space.balls(watch)?;
    let least = balls.iter().filter_map(|b| b.wall).reduce(f32::min).map(|d| d / 2.0);
    let balls = space.needed(&balls);
    let mut radii = space.paint(&balls, watch)?;
    drop(balls);
    radii.retain(|r| *r > 0.0);
    let (n, step) = (radii.len().max(1), space.grid.step);
    let diameter = |r: f32| 2.0 * f64::from(r) * step;
    let (_, p05, _) = match radii.len() {
        0 => return Ok(ThicknessSpread { step, accuracy: ACCURACY * step, ..ThicknessSpread::default() }),
        len => radii.select_nth_unstable_by(len / 20, f32::total_cmp),
    };
    let p05 = diameter(*p05);
    let low = radii.iter().fold(f32::INFINITY, |m, r| m.min(*r));
    let high = radii.iter().fold(0f32, |m, r| m.max(*r));
    let mean = radii.iter().map(|r| diameter(*r)).sum::<f64>() / n as f64;
    let square = radii.iter().map(|r| (diameter(*r) - mean).powi(2)).sum::<f64>() / n as f64;
    let width = round_up(diameter(high) / BARS);
    let bars = (diameter(high) / width).floor() as usize + 1;
    let mut counts = vec![0u64; bars];
    for r in &radii {
        counts[((diameter(*r) / width) as usize).min(bars - 1)] += 1;
    }
    Ok(ThicknessSpread {
        min: diameter(least.unwrap_or(low)),
        p05,
        mean,
        sd: square.sqrt(),
        max: diameter(high),
        step,
        accuracy: ACCURACY * step,
        histogram: Histogram {
            edges: (0..=bars).map(|i| i as f64 * width).collect(),
            share: counts.iter().map(|c| *c as f64 / n as f64).collect(),
        },
    })
}

/// The next of 1, 2, 5, 10 … with any power of ten.
fn round_up(v: f64) -> f64 {
    let unit = 10f64.powf(v.log10().floor());
    let of = [1.0, 2.0, 5.0].into_iter().find(|k| k * unit >= v * (1.0 - 1e-12));
    of.unwrap_or(10.0) * unit
}
