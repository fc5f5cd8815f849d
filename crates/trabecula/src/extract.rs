//! Extraction of surfaces and voxels from a solid, tile by tile.
//!
//! A tile depends on nothing but the solid, the grid and its index. Tiles are extracted in parallel, a few at a time,
//! and taken in order, so the result does not depend on the number of threads and memory is bounded by the tiles in
//! flight plus the output.

use std::collections::HashMap;
use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::Scope;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::field::{Block, Field};
use crate::solid::Solid;
use geometry::fault::Fault;
use geometry::formats::stl;
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use geometry::voxels::Voxels;

mod bodies;
mod cap;
mod crease;
mod grid;
mod islands;
mod key;
mod knot;
mod sift;
mod signs;
mod table;
mod tets;
mod tile;

use bodies::Bodies;
use grid::Grid;
use islands::{Census, Found};
pub use islands::{Island, Islands, Pieces};
pub use sift::Store;
pub use tets::{Foretold, Join, foretold};
use tile::{Scratch, View};

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
    /// What the solid falls into.
    pub pieces: Pieces,
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
    if let Some(tiling) = solid.explicit() {
        return tets::estimate(tiling, edge);
    }
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
    pool.lock().ok().and_then(|mut p| p.pop()).unwrap_or_default()
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

/// Tiles that may be extracted before their turn to be taken, for each thread: so few that they stay in the cache.
const AHEAD: usize = 4;

/// What the threads at work on the tiles share.
struct Queue<T> {
    /// The next tile to extract.
    next: usize,
    /// The next tile to take.
    turn: usize,
    /// Tiles that wait for their turn.
    ready: HashMap<usize, Option<T>>,
    /// Whether a thread is taking tiles.
    taking: bool,
    /// Threads that have stopped because too many tiles wait.
    resting: usize,
    ended: Result<(), Stopped>,
}

/// Extracts all tiles and hands what `cook` makes of them to `take` in order.
///
/// Every thread extracts the next tile, and takes what is ready if no other does. A thread that is too far ahead ends,
/// and is started again when a tile has been taken: none ever waits, which might block what it waits for.
fn each_tile<T: Send>(
    grid: &Grid,
    progress: &dyn Progress,
    cook: impl Fn(View) -> T + Sync,
    take: impl FnMut(T) -> Result<(), Stopped> + Send,
) -> Result<(), Stopped> {
    let total: usize = grid.tiles().iter().product();
    let threads = rayon::current_num_threads();
    let work = Work {
        grid,
        progress,
        total,
        ahead: AHEAD * threads,
        scratch: Mutex::default(),
        cook,
        take: Mutex::new(take),
        queue: Mutex::new(Queue { next: 0, turn: 0, ready: HashMap::new(), taking: false, resting: 0, ended: Ok(()) }),
    };
    rayon::scope(|scope| (0..threads).for_each(|_| scope.spawn(|scope| work.run(scope))));
    let queue = work.queue.into_inner();
    queue.unwrap_or_else(PoisonError::into_inner).ended
}

/// The work on all tiles.
struct Work<'a, T, C, K> {
    grid: &'a Grid,
    progress: &'a dyn Progress,
    total: usize,
    ahead: usize,
    scratch: Mutex<Vec<Scratch>>,
    cook: C,
    take: Mutex<K>,
    queue: Mutex<Queue<T>>,
}

impl<T, C, K> Work<'_, T, C, K>
where
    T: Send,
    C: Fn(View) -> T + Sync,
    K: FnMut(T) -> Result<(), Stopped> + Send,
{
    /// No thread panics while it holds the queue.
    fn queue(&self) -> MutexGuard<'_, Queue<T>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run<'s>(&'s self, scope: &Scope<'s>) {
        let mut scratch = borrow(&self.scratch);
        while let Some(i) = self.claim() {
            let found = tile::extract(self.grid, self.grid.tile(i), &mut scratch).map(&self.cook);
            self.queue().ready.insert(i, found);
            self.take_ready(scope);
        }
        give_back(&self.scratch, scratch);
    }

    /// The next tile to extract, if there is one and not too many wait.
    fn claim(&self) -> Option<usize> {
        let mut q = self.queue();
        if q.next == self.total || q.ended.is_err() {
            return None;
        }
        if q.next >= q.turn + self.ahead {
            q.resting += 1;
            return None;
        }
        q.next += 1;
        Some(q.next - 1)
    }

    /// Takes the tiles whose turn it is, unless another thread does.
    fn take_ready<'s>(&'s self, scope: &Scope<'s>) {
        let mut q = self.queue();
        if q.taking {
            return;
        }
        q.taking = true;
        while q.ended.is_ok() {
            let turn = q.turn;
            let Some(found) = q.ready.remove(&turn) else {
                break;
            };
            drop(q);
            let taken = match (found, self.take.lock()) {
                (Some(found), Ok(mut take)) => take(found),
                _ => Ok(()),
            };
            let go_on = self.progress.step(turn as u64 + 1, self.total as u64);
            q = self.queue();
            q.turn += 1;
            if q.ended.is_ok() {
                q.ended = taken.and(if go_on { Ok(()) } else { Err(Stopped::Interrupted) });
            }
            if q.resting > 0 {
                q.resting -= 1;
                scope.spawn(|scope| self.run(scope));
            }
        }
        q.taking = false;
    }
}

/// The surface at grid spacing `edge` (mm), held in memory. Same bytes for any number of threads.
///
/// # Errors
/// A spacing or region for which no grid can be made; an interruption; more than 2³² vertices.
pub fn surface(solid: &Solid, edge: f64, progress: &dyn Progress) -> Result<SurfaceMesh, Stopped> {
    Ok(surface_of(solid, edge, Islands::Keep, progress)?.0)
}

/// The surface at grid spacing `edge` (mm), held in memory, with all pieces of the solid or the largest only; and what
/// they are. Same bytes for any number of threads.
///
/// # Errors
/// As `surface`; several pieces, if `islands` says so.
pub fn surface_of(
    solid: &Solid,
    edge: f64,
    islands: Islands,
    progress: &dyn Progress,
) -> Result<(SurfaceMesh, Pieces), Stopped> {
    if let Some(tiling) = solid.explicit() {
        return tets::surface(tiling, edge, islands, progress);
    }
    let grid = Grid::new(solid, edge).map_err(Stopped::Refused)?;
    let middle = solid.region.bounds().center();
    let mut out = SurfaceMesh::default();
    let mut census = Census::default();
    // Vertices on the borders of tiles, by name.
    let mut border: FxHashMap<u128, u32> = FxHashMap::default();
    let cook = |view: View| view.patch(middle);
    each_tile(&grid, progress, cook, |(patch, bodies)| {
        let mut names = Vec::with_capacity(patch.vertices.len());
        for (v, shared) in patch.vertices.iter().zip(&patch.shared) {
            let vertices = &mut out.mesh.vertices;
            let new = u32::try_from(vertices.len()).map_err(|_| {
                Stopped::Refused(Fault::new("edge", "more than 2^32 vertices; use a larger edge, or STL"))
            })?;
            let name = match shared {
                Some(key) => *border.entry(*key).or_insert(new),
                None => new,
            };
            if name == new {
                vertices.push(*v);
            }
            names.push(name);
        }
        out.mesh.triangles.extend(patch.triangles.iter().map(|t| t.map(|v| names[v as usize])));
        out.cut.extend_from_slice(&patch.cut);
        census.add(bodies).map_err(Stopped::Refused)
    })?;
    not_empty(out.mesh.triangles.len() as u64, edge)?;
    let found = census.judge(islands).map_err(Stopped::Refused)?;
    if found.pieces.dropped > 0 {
        out = out.select(&sift::runs(&found.parts));
    }
    Ok((out, found.pieces))
}

/// Steps told while records move up, for each step told while they were made: they move that much faster.
const SIFTED: u64 = 16;

/// Progress of work that has something to do after its tiles.
struct Sifting<'a>(&'a dyn Progress);

impl Sifting<'_> {
    fn moved(&self, share: f64) -> bool {
        const FINE: f64 = 1000.0;
        let tiles = FINE * SIFTED as f64;
        self.0.step((tiles + share * FINE) as u64, (tiles + FINE) as u64)
    }
}

impl Progress for Sifting<'_> {
    fn step(&self, done: u64, total: u64) -> bool {
        self.0.step(done * SIFTED, total * (SIFTED + 1))
    }
}

/// The surface at grid spacing `edge` (mm), streamed as binary STL; memory is bounded by the tiles in flight and a few
/// numbers for each body of each tile. The 84-byte header is rewritten at the end.
///
/// What is to be dropped is known only when all has been seen. It is written like the rest, body by body within each
/// tile, and taken out of the file in the end: that costs the moving of some bytes, where a second extraction would cost
/// the whole time again.
///
/// # Errors
/// As `surface_of`; failures of `out`; more triangles than the format can count (2³²).
pub fn stream_stl<W: Store>(
    solid: &Solid,
    edge: f64,
    islands: Islands,
    out: &mut W,
    progress: &dyn Progress,
) -> Result<Summary, Stopped> {
    if let Some(tiling) = solid.explicit() {
        return tets::stream_stl(tiling, edge, islands, out, progress);
    }
    let grid = Grid::new(solid, edge).map_err(Stopped::Refused)?;
    let middle = solid.region.bounds().center();
    let mut census = Census::default();
    let mut triangles = 0;
    out.write_all(&[0; stl::HEADER]).map_err(Stopped::Io)?;
    let spare = Mutex::new(Vec::<Vec<u8>>::new());
    let cook = |view: View| {
        let mut records = borrow(&spare);
        let places = view.places();
        let bodies = Bodies::each_triangle(&view, middle, |t, _| {
            let corners = t.map(|v| places[v as usize].map(|x| x as f32));
            stl::push_record(&mut records, corners);
        });
        (bodies, records)
    };
    let sifting = Sifting(progress);
    let sifts = islands == Islands::Drop;
    let told: &dyn Progress = if sifts { &sifting } else { progress };
    each_tile(&grid, told, cook, |(bodies, mut records)| {
        triangles += (records.len() / stl::RECORD) as u64;
        if triangles > u64::from(u32::MAX) {
            let message = "more than 2^32 triangles, the most an STL can count; use a larger edge";
            return Err(Stopped::Refused(Fault::new("edge", message)));
        }
        census.add(bodies).map_err(Stopped::Refused)?;
        out.write_all(&records).map_err(Stopped::Io)?;
        records.clear();
        give_back(&spare, records);
        Ok(())
    })?;
    not_empty(triangles, edge)?;
    let found = census.judge(islands).map_err(Stopped::Refused)?;
    finish(found, triangles, sifts.then_some(&sifting), out)
}

/// Takes out of a stream of records what is not to stay, and writes its header.
fn finish<W: Store>(found: Found, triangles: u64, sifting: Option<&Sifting>, out: &mut W) -> Result<Summary, Stopped> {
    let moved = |share: f64| sifting.is_none_or(|s| s.moved(share));
    if found.pieces.dropped > 0 {
        let runs = sift::runs(&found.parts);
        let go_on = |record: u64| moved(record as f64 / triangles as f64);
        let (head, size) = (stl::HEADER as u64, stl::RECORD as u64);
        if !sift::sift(out, head, size, &runs, go_on).map_err(Stopped::Io)? {
            return Err(Stopped::Interrupted);
        }
    }
    if !moved(1.0) {
        return Err(Stopped::Interrupted);
    }
    let header = stl::header(found.sum.triangles as u32);
    out.seek(io::SeekFrom::Start(0))
        .and_then(|_| out.write_all(&header))
        .and_then(|()| out.flush())
        .map_err(Stopped::Io)?;
    Ok(Summary {
        triangles: found.sum.triangles,
        volume: found.sum.volume,
        area_lattice: found.sum.area[0],
        area_cut: found.sum.area[1],
        pieces: found.pieces,
    })
}

/// The surface of a ready tetrahedral cell at its own fraction, in a regular tetrahedron of edge 1 mm cut into `steps` steps.
///
/// # Errors
/// Steps below 4 or above 64.
pub fn stencil(ready: &crate::cell::tet::Ready, steps: usize, progress: &dyn Progress) -> Result<SurfaceMesh, Stopped> {
    tets::stencil(ready, steps, progress)
}

/// Voxels of edge `step` (mm) that cover the region's bounds, centred on them.
///
/// # Errors
/// A step or region for which no grid can be made; more than 2³³ voxels; an interruption.
pub fn voxels(solid: &Solid, step: f64, progress: &dyn Progress) -> Result<Voxels, Stopped> {
    Grid::new(solid, step).map_err(|f| Stopped::Refused(Fault::new("step", f.message)))?;
    let bounds = solid.region.bounds();
    let shape = bounds.size().map(|s| (s / step - 1e-9).ceil().max(1.0) as usize);
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
    let axes = [0, 1, 2].map(|a| (0..shape[a]).map(|i| origin[a] + (i as f64 + 0.5) * step).collect::<Vec<f64>>());
    let mut out = Voxels { origin, step, shape, solid: vec![0; shape.iter().product()] };
    let layer = shape[0] * shape[1];
    let slab = (layer * rayon::current_num_threads()).max(1);
    for (n, layers) in out.solid.chunks_mut(slab).enumerate() {
        layers.par_chunks_mut(layer).enumerate().for_each(|(i, layer)| {
            let z = n * rayon::current_num_threads() + i;
            let block = Block { axes: [&axes[0], &axes[1], &axes[2][z..=z]] };
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
