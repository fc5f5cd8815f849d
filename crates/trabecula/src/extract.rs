//! Extraction of surfaces and voxels from a solid, tile by tile.
//!
//! A tile depends on nothing but the solid, the grid and its index. Tiles are extracted in parallel, a few at a time,
//! and taken in order, so the result does not depend on the number of threads and memory is bounded by the tiles in
//! flight plus the output.

use std::collections::HashMap;
use std::io;
use std::sync::Mutex;

use rayon::prelude::*;

use crate::fault::Fault;
use crate::field::{Block, Field};
use crate::io::stl;
use crate::math::{Vec3, cross, dot, norm, sub};
use crate::mesh::Mesh;
use crate::solid::Solid;

mod cap;
mod grid;
mod knot;
mod signs;
mod table;
mod tile;

use grid::Grid;
use tile::{Scratch, View};

/// Told how far the work is; answers whether to go on.
pub trait Progress: Sync {
    /// `done` of `total` equal steps. `false` stops the work.
    fn step(&self, done: u64, total: u64) -> bool;
}

/// Never stops, says nothing.
pub struct Silent;

impl Progress for Silent {
    fn step(&self, _: u64, _: u64) -> bool {
        true
    }
}

/// Why an extraction ended without a result.
#[derive(Debug)]
pub enum Stopped {
    /// The progress said so.
    Interrupted,
    /// The output could not be written.
    Io(io::Error),
    /// The request cannot be met (a spacing too fine for single precision, an unbounded region …).
    Refused(Fault),
}

/// A surface mesh and which of its triangles lie on the region's boundary rather than on the lattice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// The mesh.
    pub mesh: Mesh,
    /// For each triangle, whether it is a cut (on the region's boundary).
    pub cut: Vec<bool>,
}

/// What a streamed extraction wrote.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Number of triangles.
    pub triangles: u64,
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Area on the lattice, mm².
    pub area_lattice: f64,
    /// Area on the region's boundary, mm².
    pub area_cut: f64,
}

/// What a request will take, found by sampling the solid on a coarse grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Grid cells along each axis.
    pub cells: [u64; 3],
    /// Triangles, roughly.
    pub triangles: f64,
    /// Bytes that an indexed mesh needs in memory, roughly.
    pub memory: f64,
    /// Bytes of a binary STL, roughly.
    pub stl: f64,
}

/// Estimates the work for a grid spacing `edge` (mm) from a few tiles spread over the grid.
///
/// # Errors
/// A spacing or region for which no grid can be made.
pub fn estimate(solid: &Solid, edge: f64) -> Result<Estimate, Fault> {
    const SAMPLES: usize = 24;
    let grid = Grid::new(solid, edge)?;
    let total: usize = grid.tiles().iter().product();
    let sampled = total.min(SAMPLES);
    let found: usize = (0..sampled)
        .into_par_iter()
        .map_init(Scratch::default, |scratch, i| {
            // Odd multiples of a share of the whole: the middles of equal runs of tiles.
            let index = (2 * i + 1) * total / (2 * sampled);
            tile::extract(&grid, grid.tile(index), scratch).map_or(0, |v| v.triangles().count())
        })
        .sum();
    let triangles = found as f64 * total as f64 / sampled as f64;
    Ok(Estimate {
        cells: grid.cells().map(|n| n as u64),
        triangles,
        // Half as many vertices of 24 bytes, 12 bytes of indices and a flag, twice over while vectors grow.
        memory: triangles * 2.0 * (12.0 + 12.0 + 1.0),
        stl: 84.0 + 50.0 * triangles,
    })
}

/// A used buffer, or a new one. Memory that is not returned to the system need not be cleared by it again.
fn borrow<T: Default>(pool: &Mutex<Vec<T>>) -> T {
    pool.lock()
        .ok()
        .and_then(|mut p| p.pop())
        .unwrap_or_default()
}

fn give_back<T>(pool: &Mutex<Vec<T>>, buffer: T) {
    if let Ok(mut p) = pool.lock() {
        p.push(buffer);
    }
}

/// Refuses an empty surface, which no part is.
fn not_empty(triangles: u64, edge: f64) -> Result<(), Stopped> {
    if triangles > 0 {
        return Ok(());
    }
    let message = format!(
        "no surface was found with grid steps of {edge} mm: the solid is thinner than they are; use a smaller edge"
    );
    Err(Stopped::Refused(Fault::new("edge", message)))
}

/// Extracts all tiles, a few at a time, and hands what `cook` makes of them to `take` in order.
fn each_tile<T: Send>(
    grid: &Grid,
    progress: &dyn Progress,
    cook: impl Fn(View) -> T + Sync,
    mut take: impl FnMut(T) -> Result<(), Stopped> + Send,
) -> Result<(), Stopped> {
    let total: usize = grid.tiles().iter().product();
    let scratch = Mutex::new(Vec::<Scratch>::new());
    let work = |tiles: std::ops::Range<usize>| -> Vec<Option<T>> {
        tiles
            .into_par_iter()
            .with_max_len(1)
            .map(|i| {
                let mut mine = borrow(&scratch);
                let found = tile::extract(grid, grid.tile(i), &mut mine).map(&cook);
                give_back(&scratch, mine);
                found
            })
            .collect()
    };
    // Enough tiles that threads seldom wait for each other, few enough that they fit in some tens of megabytes.
    let batch = 16 * rayon::current_num_threads();
    let mut ready: Vec<Option<T>> = Vec::new();
    let mut next = 0;
    loop {
        let tiles = next..(next + batch).min(total);
        next = tiles.end;
        // While one batch is taken the following one is extracted.
        let (done, found) = rayon::join(
            || ready.drain(..).flatten().try_for_each(&mut take),
            || work(tiles.clone()),
        );
        done?;
        if !progress.step(next as u64, total as u64) {
            return Err(Stopped::Interrupted);
        }
        ready = found;
        if tiles.is_empty() {
            return Ok(());
        }
    }
}

/// The surface at grid spacing `edge` (mm), held in memory. Same bytes for any number of threads.
///
/// # Errors
/// A spacing or region for which no grid can be made; an interruption; more than 2³² vertices.
pub fn surface(solid: &Solid, edge: f64, progress: &dyn Progress) -> Result<Surface, Stopped> {
    let grid = Grid::new(solid, edge).map_err(Stopped::Refused)?;
    let mut out = Surface::default();
    // Vertices on the borders of tiles, by grid edge.
    let mut border: HashMap<u128, u32> = HashMap::new();
    each_tile(
        &grid,
        progress,
        |view| view.patch(),
        |patch| {
            let mut names = Vec::with_capacity(patch.vertices.len());
            for ((v, key), shared) in patch.vertices.iter().zip(&patch.keys).zip(&patch.shared) {
                let vertices = &mut out.mesh.vertices;
                let new = u32::try_from(vertices.len()).map_err(|_| {
                    Stopped::Refused(Fault::new(
                        "edge",
                        "more than 2^32 vertices; use a larger edge, or STL",
                    ))
                })?;
                let name = if *shared {
                    *border.entry(*key).or_insert(new)
                } else {
                    new
                };
                if name == new {
                    vertices.push(*v);
                }
                names.push(name);
            }
            out.mesh
                .triangles
                .extend(patch.triangles.iter().map(|t| t.map(|v| names[v as usize])));
            out.cut.extend_from_slice(&patch.cut);
            Ok(())
        },
    )?;
    not_empty(out.mesh.triangles.len() as u64, edge)?;
    Ok(out)
}

/// The surface at grid spacing `edge` (mm), streamed as binary STL; memory is bounded by the tiles in flight.
/// The 84-byte header is rewritten at the end, so `out` must be at its start and seekable.
///
/// # Errors
/// As `surface`; failures of `out`; more triangles than the format can count (2³²).
pub fn stream_stl<W: io::Write + io::Seek + Send>(
    solid: &Solid,
    edge: f64,
    out: &mut W,
    progress: &dyn Progress,
) -> Result<Summary, Stopped> {
    let grid = Grid::new(solid, edge).map_err(Stopped::Refused)?;
    let middle = solid.region.bounds().center();
    let mut summary = Summary::default();
    out.write_all(&[0; 84]).map_err(Stopped::Io)?;
    let spare = Mutex::new(Vec::<Vec<u8>>::new());
    let cook = |view: View| {
        let mut part = Summary::default();
        let mut records = borrow(&spare);
        let places = view.places();
        for (t, cut) in view.triangles() {
            let [a, b, c] = t.map(|v| places[v as usize]);
            let n = cross(sub(b, a), sub(c, a));
            let twice = norm(n);
            part.triangles += 1;
            part.volume += dot(sub(a, middle), n) / 6.0;
            *(if cut {
                &mut part.area_cut
            } else {
                &mut part.area_lattice
            }) += twice / 2.0;
            stl::push_record(&mut records, [a, b, c].map(|p| p.map(|x| x as f32)));
        }
        (part, records)
    };
    each_tile(&grid, progress, cook, |(part, mut records)| {
        summary.triangles += part.triangles;
        summary.volume += part.volume;
        summary.area_lattice += part.area_lattice;
        summary.area_cut += part.area_cut;
        if summary.triangles > u64::from(u32::MAX) {
            let message = "more than 2^32 triangles, the most an STL can count; use a larger edge";
            return Err(Stopped::Refused(Fault::new("edge", message)));
        }
        out.write_all(&records).map_err(Stopped::Io)?;
        records.clear();
        give_back(&spare, records);
        Ok(())
    })?;
    not_empty(summary.triangles, edge)?;
    let header = stl::header(summary.triangles as u32);
    out.seek(io::SeekFrom::Start(0))
        .and_then(|_| out.write_all(&header))
        .and_then(|()| out.flush())
        .map_err(Stopped::Io)?;
    Ok(summary)
}

/// Occupancy on a grid of cubic voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Voxels {
    /// Lower corner of the first voxel, mm.
    pub origin: Vec3,
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Number of voxels along x, y, z.
    pub shape: [usize; 3],
    /// 1 where the voxel's centre is solid, x fastest.
    pub solid: Vec<u8>,
}

/// Voxels of edge `step` (mm) that cover the region's bounds, centred on them.
///
/// # Errors
/// A step or region for which no grid can be made; more than 2³³ voxels; an interruption.
pub fn voxels(solid: &Solid, step: f64, progress: &dyn Progress) -> Result<Voxels, Stopped> {
    Grid::new(solid, step).map_err(|f| Stopped::Refused(Fault::new("step", f.message)))?;
    let bounds = solid.region.bounds();
    let shape = bounds
        .size()
        .map(|s| (s / step - 1e-9).ceil().max(1.0) as usize);
    let count = shape.iter().map(|&n| n as f64).product::<f64>();
    if count > (1u64 << 33) as f64 {
        let message = format!(
            "{step} mm makes {count:.2e} voxels; at most 8.6e9 are possible: use a step above {:.3} mm",
            step * (count / 8e9).cbrt()
        );
        return Err(Stopped::Refused(Fault::new("step", message)));
    }
    let extent = shape.map(|n| n as f64 * step);
    let origin = [0, 1, 2].map(|a| bounds.center()[a] - extent[a] / 2.0);
    let axes = [0, 1, 2].map(|a| {
        (0..shape[a])
            .map(|i| origin[a] + (i as f64 + 0.5) * step)
            .collect::<Vec<f64>>()
    });
    let mut out = Voxels {
        origin,
        step,
        shape,
        solid: vec![0; shape.iter().product()],
    };
    let layer = shape[0] * shape[1];
    let slab = (layer * rayon::current_num_threads()).max(1);
    for (n, layers) in out.solid.chunks_mut(slab).enumerate() {
        layers
            .par_chunks_mut(layer)
            .enumerate()
            .for_each(|(i, layer)| {
                let z = n * rayon::current_num_threads() + i;
                let block = Block {
                    axes: [&axes[0], &axes[1], &axes[2][z..=z]],
                };
                let mut samples = vec![0f32; layer.len()];
                solid.fill(&block, &mut samples);
                for (o, v) in layer.iter_mut().zip(&samples) {
                    *o = u8::from(*v <= 0.0);
                }
            });
        if !progress.step((n + 1) as u64, shape[2].div_ceil(slab / layer) as u64) {
            return Err(Stopped::Interrupted);
        }
    }
    Ok(out)
}
