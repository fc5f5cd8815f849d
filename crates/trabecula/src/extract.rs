//! Marching cubes on a grid: surface meshes and voxels of any solid, tile by tile.
//!
//! A tile depends on nothing but the solid, the grid and its index. Tiles are extracted in parallel and consumed in order,
//! so the result does not depend on the number of threads, and memory is bounded by the tiles in flight plus the output.

use std::sync::Mutex;

use geometry::fault::Fault;
use geometry::formats::stl;
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use rayon::prelude::*;

use crate::region::Region;
use crate::solid::Solid;
use crate::surface_maker::{
    self, Estimate, Islands, Measured, Resolved, StlStream, Store, Summary, SurfaceMaker, SurfaceOptions, SurfaceSink,
    not_empty,
};

mod block_nodes;
mod cube_table;
mod feature_cells;
mod feature_edges;
mod joined_ranges;
mod packed;
mod planar_caps;
mod range_partial;
mod sampling_grid;
mod sign_words;
mod spaces;
mod stitched;
mod tile;
mod tile_components;
mod tile_figures;
mod tile_queue;
mod tile_ranges;
mod vertex_id;
mod vertex_numbers;
mod voxelize;

pub use joined_ranges::{JoinedRanges, WholeSurface};
use sampling_grid::SamplingGrid;
pub use sampling_grid::{MOST_CELLS, MOST_STEPS, TILE};
pub use spaces::{SpaceMade, spaces};
use stitched::Stitched;
use tile::{TileBuffers, View};
use tile_components::{TileComponents, TileSweep};
use tile_figures::{FigureSums, TileFigures};
use tile_queue::{borrow, each_tile, give_back};
pub use tile_ranges::{RangeMade, TileRanges};
pub use voxelize::{VoxelCentres, voxels};

/// Meshes a solid on a grid whose spacing is the resolution.
pub struct GridSurface<'a>(pub &'a Solid);

/// The surface of a solid at grid spacing `edge` (mm) with all connected components, held in memory.
///
/// # Errors
/// As `SurfaceMaker::mesh`.
pub fn surface(solid: &Solid, edge: f64, progress: &dyn Progress) -> Result<SurfaceMesh, Stopped> {
    let options = SurfaceOptions { resolution: edge, islands: Islands::Keep };
    Ok(GridSurface(solid).mesh(&options, progress)?.surface)
}

/// Steps along the longest side of a region for its volume.
const REGION_STEPS: f64 = 200.0;

/// Volume of a region, mm³: exact where it is known in closed form, else of its surface at grid spacing `edge` (mm), or a 200th of its longest
/// side if that is more.
///
/// # Errors
/// As `surface`.
pub fn region_volume(region: &Region, edge: f64, progress: &dyn Progress) -> Result<f64, Stopped> {
    if let Some(volume) = region.volume() {
        return Ok(volume);
    }
    let longest = region.bounds().size().into_iter().fold(0.0, f64::max);
    let edge = edge.max(longest / REGION_STEPS);
    let full = Solid::new(region.clone(), None, edge);
    Ok(surface(&full, edge, progress)?.mesh.volume())
}

/// Of an estimate: most tiles that are searched, most that a surface may cross, triangles that are enough, tiles at a time, deviations of the
/// mean that are enough to be sure.
const LOOKED_AT: usize = 1024;
const WORKED: usize = 64;
const FOUND: usize = 1_000_000;
const BATCH: usize = 16;
const SURE: f64 = 4.0;

/// A step through `n` things that comes to all of them and leaves them evenly filled on the way: coprime to n, near its golden
/// section.
fn stride(n: usize) -> usize {
    let coprime = |s: &usize| {
        let (mut a, mut b) = (*s, n);
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    ((0.618_033_988_75 * n as f64) as usize..).find(coprime).unwrap_or(1)
}

impl SurfaceMaker for GridSurface<'_> {
    fn make(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn SurfaceSink,
        progress: &dyn Progress,
    ) -> Result<Resolved, Stopped> {
        let grid = SamplingGrid::new(self.0, options.resolution).map_err(Stopped::Refused)?;
        let middle = self.0.region.bounds().center();
        let mut out = Stitched::new(out);
        each_tile(
            (&grid, &Mutex::default()),
            grid.all(),
            progress,
            |view: View| view.patch(0, middle),
            |patch| out.add(patch),
        )?;
        out.finish(options)
    }

    fn stream_stl(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn Store,
        progress: &dyn Progress,
    ) -> Result<Summary, Stopped> {
        let grid = SamplingGrid::new(self.0, options.resolution).map_err(Stopped::Refused)?;
        let middle = self.0.region.bounds().center();
        let mut sweep = TileSweep::default();
        let mut triangles = 0;
        let mut stream = StlStream::new(out, options.islands, progress)?;
        let spare = Mutex::new(Vec::<Vec<u8>>::new());
        let map = |view: View| {
            let mut records = borrow(&spare);
            let components = TileComponents::with_records(&view, middle, &mut records);
            (components, records)
        };
        let scaled = stream.progress();
        each_tile((&grid, &Mutex::default()), grid.all(), &scaled, map, |(components, mut records)| {
            triangles += (records.len() / stl::RECORD) as u64;
            surface_maker::check_count(triangles)?;
            sweep.add(components).map_err(Stopped::Refused)?;
            stream.write(&records)?;
            records.clear();
            give_back(&spare, records);
            Ok(())
        })?;
        not_empty(triangles, options.resolution)?;
        let found = sweep.resolve(options.islands, options.resolution).map_err(Stopped::Refused)?;
        stream.finish(found, triangles)
    }

    /// Measured tile by tile: memory is bounded as when an STL is streamed.
    fn measure(&self, options: &SurfaceOptions, progress: &dyn Progress) -> Result<Measured, Stopped> {
        let grid = SamplingGrid::new(self.0, options.resolution).map_err(Stopped::Refused)?;
        let middle = self.0.region.bounds().center();
        let (mut sweep, mut sums, mut triangles) = (TileSweep::default(), FigureSums::default(), 0);
        each_tile(
            (&grid, &Mutex::default()),
            grid.all(),
            progress,
            |view: View| TileFigures::of(&view, middle),
            |tile| {
                let components = sums.add(tile);
                triangles += components.totals.iter().map(|t| t.triangles).sum::<u64>();
                sweep.add(components).map_err(Stopped::Refused)
            },
        )?;
        not_empty(triangles, options.resolution)?;
        Ok(sums.finish(sweep.resolve(options.islands, options.resolution).map_err(Stopped::Refused)?))
    }

    fn estimate(&self, edge: f64) -> Result<Estimate, Fault> {
        self.sampled(edge, 0.0)
    }

    fn exceeding(&self, edge: f64, triangles: f64) -> Result<Option<Estimate>, Fault> {
        Ok(Some(self.sampled(edge, triangles)?).filter(|e| e.triangles > triangles))
    }
}

impl GridSurface<'_> {
    /// Estimated from tiles that are spread evenly over the grid, until enough of them may hold a surface, enough triangles were found, or
    /// there are fewer than `below` by some deviations: the work is bounded, and the same on every machine. The deviation of the mean
    /// is that of the tiles over the root of their number.
    fn sampled(&self, edge: f64, below: f64) -> Result<Estimate, Fault> {
        let grid = SamplingGrid::new(self.0, edge)?;
        let total: usize = grid.tiles().iter().product();
        let (most, stride) = (total.min(LOOKED_AT), stride(total));
        let (mut sampled, mut worked, mut found, mut squares) = (0, 0, 0, 0.0);
        while sampled < most && worked < WORKED && found < FOUND {
            let batch = sampled..(sampled + BATCH).min(most);
            sampled = batch.end;
            let each = batch.into_par_iter().map_init(TileBuffers::default, |scratch, i| {
                let tile = grid.tile((total / 2 + i * stride) % total);
                tile::count(&grid, tile, scratch)
            });
            let each: Vec<usize> = each.flatten_iter().collect();
            worked += each.len();
            found += each.iter().sum::<usize>();
            squares += each.iter().map(|n| (*n as f64).powi(2)).sum::<f64>();
            let (mean, n) = (found as f64 / sampled as f64, sampled as f64);
            let deviation = ((squares / n - mean * mean).max(0.0) / n).sqrt();
            if worked >= BATCH && (mean + SURE * deviation) * (total as f64) < below {
                break;
            }
        }
        let triangles = found as f64 * total as f64 / sampled as f64;
        Ok(Estimate {
            cells: grid.cells().map(|n| n as u64),
            triangles,
            held: 0.0,
            // Half as many vertices of 24 bytes, 12 bytes of indices and a flag, twice over while vectors grow.
            memory: triangles * 2.0 * (12.0 + 12.0 + 1.0),
            stl: 84.0 + 50.0 * triangles,
        })
    }
}
