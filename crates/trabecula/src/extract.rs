//! Extraction of surfaces and voxels from a solid.

use std::io;

use crate::fault::Fault;
use crate::mesh::Mesh;
use crate::solid::Solid;

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

/// Estimates the work for a grid spacing `edge` (mm).
pub fn estimate(solid: &Solid, edge: f64) -> Result<Estimate, Fault> {
    let _ = (solid, edge);
    todo!()
}

/// The surface at grid spacing `edge` (mm), held in memory. Same bytes for any number of threads.
pub fn surface(solid: &Solid, edge: f64, progress: &dyn Progress) -> Result<Surface, Stopped> {
    let _ = (solid, edge, progress);
    todo!()
}

/// The surface at grid spacing `edge` (mm), streamed as binary STL; memory is bounded by the tiles in flight.
/// The 84-byte header is rewritten at the end, so `out` must be at its start and seekable.
pub fn stream_stl<W: io::Write + io::Seek + Send>(
    solid: &Solid,
    edge: f64,
    out: &mut W,
    progress: &dyn Progress,
) -> Result<Summary, Stopped> {
    let _ = (solid, edge, out, progress);
    todo!()
}

/// Occupancy on a grid of cubic voxels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Voxels {
    /// Lower corner of the first voxel, mm.
    pub origin: [f64; 3],
    /// Edge of a voxel, mm.
    pub step: f64,
    /// Number of voxels along x, y, z.
    pub shape: [usize; 3],
    /// 1 where the voxel's centre is solid, x fastest.
    pub solid: Vec<u8>,
}

/// Voxels of edge `step` (mm) over the region's bounds.
pub fn voxels(solid: &Solid, step: f64, progress: &dyn Progress) -> Result<Voxels, Stopped> {
    let _ = (solid, step, progress);
    todo!()
}
