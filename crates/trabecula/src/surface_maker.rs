//! Surface makers: methods that turn a solid into a closed triangle mesh.
//!
//! There are three: marching cubes on a grid (`extract`), direct cutting of a tetrahedral mesh (`tiling::surface`), and
//! triangulation of the beams' own patches (`beam_surface`). A built design says which of them it can use.

use std::io;

use schemars::JsonSchema;
use serde::Serialize;

use geometry::fault::Fault;
use geometry::formats::stl;
use geometry::math::Vec3;
use geometry::progress::{Progress, Stage, Stopped};
use geometry::surface_mesh::SurfaceMesh;

mod compact;
mod components;
mod measured;
mod spool;

pub use compact::Store;
pub use components::{CRUMB, Component, Components, DUST, Islands, Resolved, SMALL};
pub(crate) use components::{ComponentGraph, NONE, Totals};
pub use measured::{Figures, Measured};
pub use spool::{ScratchStores, stream_mesh};

/// What takes a surface piece by piece: memory, or files.
pub trait SurfaceSink: Send {
    /// Adds vertices, numbered on from those before, and triangles of any vertices so far, each with whether it is a cut.
    ///
    /// # Errors
    /// Failures of the files.
    fn add(&mut self, vertices: &[Vec3], triangles: &[[u32; 3]], cut: &[bool]) -> io::Result<()>;
}

impl SurfaceSink for SurfaceMesh {
    fn add(&mut self, vertices: &[Vec3], triangles: &[[u32; 3]], cut: &[bool]) -> io::Result<()> {
        self.mesh.vertices.extend_from_slice(vertices);
        self.mesh.triangles.extend_from_slice(triangles);
        self.cut.extend_from_slice(cut);
        Ok(())
    }
}

/// A method of meshing one solid.
pub trait SurfaceMaker {
    /// Makes the surface piece by piece, with all its connected components; says which of them stay. Memory is bounded by the
    /// pieces in flight. Same pieces for any number of threads.
    ///
    /// # Errors
    /// A resolution at which no mesh can be made; an interruption; more than 2³² vertices; several connected components, if
    /// the options refuse them; failures of `out`.
    fn make(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn SurfaceSink,
        progress: &dyn Progress,
    ) -> Result<Resolved, Stopped>;

    /// The surface, held in memory. Same bytes for any number of threads.
    ///
    /// # Errors
    /// As `make`.
    fn mesh(&self, options: &SurfaceOptions, progress: &dyn Progress) -> Result<MeshedSurface, Stopped> {
        let mut surface = SurfaceMesh::default();
        let found = self.make(options, &mut surface, progress)?;
        Ok(MeshedSurface { surface: kept(surface, &found), components: found.components, error: found.error })
    }

    /// The surface, streamed as binary STL without holding the mesh. The 84-byte header is rewritten at the end. Same bytes
    /// for any number of threads.
    ///
    /// # Errors
    /// As `mesh`; failures of `out`; more triangles than the format can count (2³²).
    fn stream_stl(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn Store,
        progress: &dyn Progress,
    ) -> Result<Summary, Stopped>;

    /// The figures of the surface that `mesh` makes.
    ///
    /// # Errors
    /// As `mesh`.
    fn measure(&self, options: &SurfaceOptions, progress: &dyn Progress) -> Result<Measured, Stopped> {
        Ok(Measured::of(&self.mesh(options, progress)?))
    }

    /// The work and memory that a resolution (mm) requires, estimated.
    ///
    /// # Errors
    /// A resolution at which no mesh can be made.
    fn estimate(&self, resolution: f64) -> Result<Estimate, Fault>;

    /// The same where it takes more than this number of triangles; `None` where it surely takes fewer.
    ///
    /// # Errors
    /// As `estimate`.
    fn exceeding(&self, resolution: f64, triangles: f64) -> Result<Option<Estimate>, Fault> {
        Ok(Some(self.estimate(resolution)?).filter(|e| e.triangles > triangles))
    }
}

/// How a surface is to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceOptions {
    /// Grid spacing, or chord error for beams, mm.
    pub resolution: f64,
    /// Treatment of all connected components but the largest.
    pub islands: Islands,
}

impl SurfaceOptions {
    /// This resolution (mm), all else as it is by default.
    pub fn new(resolution: f64) -> SurfaceOptions {
        SurfaceOptions { resolution, islands: Islands::default() }
    }
}

/// The meshed surface of a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshedSurface {
    /// The surface.
    pub surface: SurfaceMesh,
    /// Connected components of the solid.
    pub components: Components,
    /// Greatest distance of triangles from the surface (mm), where the method measures it.
    pub error: Option<f64>,
}

/// What a streamed surface contains.
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
    /// Connected components of the solid.
    pub components: Components,
    /// Greatest distance of triangles from the surface (mm), where the method measures it.
    pub error: Option<f64>,
}

/// What a surface will take, estimated on a coarse grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "EstimateReport")]
pub struct Estimate {
    /// Grid cells along x, y, z.
    pub cells: [u64; 3],
    /// Number of triangles.
    pub triangles: f64,
    /// Number of triangles held in memory while streaming, beyond a bounded number.
    #[serde(skip)]
    pub held: f64,
    /// Bytes of memory of the mesh.
    pub memory: f64,
    /// Bytes of a binary STL.
    pub stl: f64,
}

/// Refuses an empty surface.
pub(crate) fn not_empty(triangles: u64, edge: f64) -> Result<(), Stopped> {
    if triangles > 0 {
        return Ok(());
    }
    let message = format!("no surface was found at grid spacing {edge} mm: all walls are thinner; use a smaller edge");
    Err(Stopped::Refused(Fault::new("edge", message)))
}

/// Refuses more triangles than an STL can count.
pub(crate) fn check_count(triangles: u64) -> Result<(), Stopped> {
    if triangles <= u64::from(u32::MAX) {
        return Ok(());
    }
    let message = "more than 2^32 triangles, the most an STL can count; use a larger edge";
    Err(Stopped::Refused(Fault::new("edge", message)))
}

/// The number of the next vertex, if it has one.
pub(crate) fn next_vertex(count: usize) -> Result<u32, Stopped> {
    u32::try_from(count)
        .map_err(|_| Stopped::Refused(Fault::new("edge", "more than 2^32 vertices; use a larger edge, or STL")))
}

/// The components of a mesh that stay: the mesh without those that were dropped or filled.
pub(crate) fn kept(surface: SurfaceMesh, found: &Resolved) -> SurfaceMesh {
    if found.components.unchanged() {
        return surface;
    }
    surface.select(&compact::ranges(&found.parts))
}

/// An STL that is being streamed. Components that are to be dropped are known only at the end: they are written like the
/// rest and taken out of the file then, which moves bytes but avoids a second extraction.
pub(crate) struct StlStream<'a> {
    out: &'a mut dyn Store,
    progress: &'a dyn Progress,
    compacts: bool,
}

/// The share of the work that compaction takes.
const COMPACTION: f64 = 1.0 / 17.0;

impl<'a> StlStream<'a> {
    pub fn new(out: &'a mut dyn Store, islands: Islands, progress: &'a dyn Progress) -> Result<StlStream<'a>, Stopped> {
        out.write_all(&[0; stl::HEADER]).map_err(Stopped::Io)?;
        Ok(StlStream { out, progress, compacts: matches!(islands, Islands::Drop | Islands::DropSmall) })
    }

    /// The progress of making the surface, which leaves a share for compaction.
    pub fn progress(&self) -> impl Progress + use<'a> {
        let compaction = if self.compacts { COMPACTION } else { 0.0 };
        Stage { whole: self.progress, from: 0.0, to: 1.0 - compaction }
    }

    pub fn write(&mut self, records: &[u8]) -> Result<(), Stopped> {
        self.out.write_all(records).map_err(Stopped::Io)
    }

    /// Removes dropped components and writes the header.
    pub fn finish(self, found: Resolved, triangles: u64) -> Result<Summary, Stopped> {
        let stage = Stage { whole: self.progress, from: 1.0 - COMPACTION, to: 1.0 };
        let moved = |record: u64| !self.compacts || stage.step(record, triangles);
        if !found.components.unchanged() {
            let ranges = compact::ranges(&found.parts);
            let (head, size) = (stl::HEADER as u64, stl::RECORD as u64);
            if !compact::compact(self.out, head, size, &ranges, moved).map_err(Stopped::Io)? {
                return Err(Stopped::Interrupted);
            }
        }
        if !moved(triangles) {
            return Err(Stopped::Interrupted);
        }
        let header = stl::header(found.totals.triangles as u32);
        self.out
            .seek(io::SeekFrom::Start(0))
            .and_then(|_| self.out.write_all(&header))
            .and_then(|()| self.out.flush())
            .map_err(Stopped::Io)?;
        Ok(found.summary())
    }
}
