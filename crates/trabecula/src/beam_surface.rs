//! Surface maker for beams alone: triangles of the beams' own patches to a chord error, without a grid.

use std::sync::Arc;

use beams::quador::Quadors;
use geometry::fault::Fault;
use geometry::formats::{self, stl};
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;

use crate::surface_maker::{
    Components, Estimate, Islands, MeshedSurface, Resolved, Store, Summary, SurfaceMaker, SurfaceOptions, SurfaceSink,
    Totals,
};

/// Triangulates uncut beams; the resolution is the chord error. Hubs that are equal but for their position are triangulated
/// once.
pub struct BeamSurface(pub Arc<Quadors>);

impl BeamSurface {
    /// Connected components are not looked for: refuses to drop any. None is small and cut off by a region's boundary.
    fn check(options: &SurfaceOptions) -> Result<(), Stopped> {
        if matches!(options.islands, Islands::Keep | Islands::DropSmall) {
            return Ok(());
        }
        let message =
            "connected components are found on a grid only: give the spacing of a grid instead of a chord error";
        Err(Stopped::Refused(Fault::new("islands", message)))
    }
}

impl SurfaceMaker for BeamSurface {
    /// The mesh is held in memory.
    fn make(
        &self,
        options: &SurfaceOptions,
        out: &mut dyn SurfaceSink,
        progress: &dyn Progress,
    ) -> Result<Resolved, Stopped> {
        let made = self.mesh(options, progress)?;
        let SurfaceMesh { mesh, cut } = &made.surface;
        out.add(&mesh.vertices, &mesh.triangles, cut).map_err(Stopped::Io)?;
        let totals = Totals {
            triangles: mesh.triangles.len() as u64,
            vertices: mesh.vertices.len() as u64,
            volume: mesh.volume(),
            area: [mesh.area(), 0.0],
            bounds: mesh.bounds(),
        };
        let parts = vec![(totals.triangles, true)];
        let components = made.components;
        Ok(Resolved { parts, first: vec![0], walls: Vec::new(), totals, components, error: made.error })
    }

    fn mesh(&self, options: &SurfaceOptions, _: &dyn Progress) -> Result<MeshedSurface, Stopped> {
        Self::check(options)?;
        let tessellation = self.0.tessellation(options.resolution).map_err(Stopped::Refused)?;
        let mesh = tessellation.mesh().map_err(Stopped::Refused)?;
        let measures = tessellation.measures();
        let components =
            Components { count: measures.components as u64, euler: measures.euler, ..Components::default() };
        let surface = SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh };
        Ok(MeshedSurface { surface, components, error: Some(tessellation.error()) })
    }

    /// Only distinct hubs are held in memory.
    fn stream_stl(
        &self,
        options: &SurfaceOptions,
        mut out: &mut dyn Store,
        _: &dyn Progress,
    ) -> Result<Summary, Stopped> {
        Self::check(options)?;
        let tessellation = self.0.tessellation(options.resolution).map_err(Stopped::Refused)?;
        let hub = |i: usize, put: &mut dyn FnMut([[f64; 3]; 3])| tessellation.hub(i).for_each(put);
        formats::write_stl_pieces(tessellation.triangles(), tessellation.hubs(), hub, &mut out).map_err(Stopped::Io)?;
        let measures = tessellation.measures();
        Ok(Summary {
            triangles: measures.triangles as u64,
            volume: measures.volume,
            area_lattice: measures.area,
            area_cut: 0.0,
            components: Components {
                count: measures.components as u64,
                euler: measures.euler,
                ..Components::default()
            },
            error: Some(tessellation.error()),
        })
    }

    /// Estimated from some of the distinct hubs, at a coarser chord error if need be.
    fn estimate(&self, chord: f64) -> Result<Estimate, Fault> {
        let [triangles, held] = self.0.estimated_triangles(chord)?;
        Ok(Estimate {
            cells: [0; 3],
            triangles,
            held,
            // Half as many vertices as triangles, of three f64 each.
            memory: triangles * (12.0 + 12.0 + 1.0),
            stl: stl::HEADER as f64 + triangles * stl::RECORD as f64,
        })
    }
}
