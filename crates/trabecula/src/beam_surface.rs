//! Surface maker for beams alone: triangles of the beams' own patches to a chord error, without a grid.

use std::sync::Arc;

use beams::quador::Quadors;
use geometry::fault::Fault;
use geometry::formats::{self, stl};
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;

use crate::surface_maker::{Components, Estimate, Islands, Made, Options, Store, Summary, SurfaceMaker};

/// Triangulates uncut beams; the resolution is the chord error. Hubs that are equal but for their position are triangulated
/// once.
pub struct BeamSurface(pub Arc<Quadors>);

impl BeamSurface {
    /// Connected components are not looked for: refuses to drop any.
    fn check(options: &Options) -> Result<(), Stopped> {
        if options.islands == Islands::Keep {
            return Ok(());
        }
        let message =
            "connected components are found on a grid only: give the spacing of a grid instead of a chord error";
        Err(Stopped::Refused(Fault::new("islands", message)))
    }
}

impl SurfaceMaker for BeamSurface {
    fn mesh(&self, options: &Options, _: &dyn Progress) -> Result<Made, Stopped> {
        Self::check(options)?;
        let drawn = self.0.drawn(options.resolution).map_err(Stopped::Refused)?;
        let mesh = drawn.mesh().map_err(Stopped::Refused)?;
        let figures = drawn.figures();
        let components = Components { count: figures.pieces as u64, euler: figures.euler, ..Components::default() };
        let surface = SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh };
        Ok(Made { surface, components, error: Some(drawn.error()) })
    }

    /// Only distinct hubs are held in memory.
    fn stream_stl(&self, options: &Options, mut out: &mut dyn Store, _: &dyn Progress) -> Result<Summary, Stopped> {
        Self::check(options)?;
        let drawn = self.0.drawn(options.resolution).map_err(Stopped::Refused)?;
        let hub = |i: usize, put: &mut dyn FnMut([[f64; 3]; 3])| drawn.hub(i).for_each(put);
        formats::write_stl_pieces(drawn.triangles(), drawn.hubs(), hub, &mut out).map_err(Stopped::Io)?;
        let figures = drawn.figures();
        Ok(Summary {
            triangles: figures.triangles as u64,
            volume: figures.volume,
            area_lattice: figures.area,
            area_cut: 0.0,
            components: Components { count: figures.pieces as u64, euler: figures.euler, ..Components::default() },
            error: Some(drawn.error()),
        })
    }

    /// Estimated from some of the distinct hubs, at a coarser chord error if need be.
    fn estimate(&self, chord: f64) -> Result<Estimate, Fault> {
        let [triangles, held] = self.0.expected(chord)?;
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
