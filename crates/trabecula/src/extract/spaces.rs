//! The solids into which a sheet divides its region, from one grid.
//!
//! All are made in one pass: cells are classified by what decides between any two of them, and each triangle has one of them or
//! void on either side. A triangle between two is the same for both, turned round; so no gap or overlap is possible, and the
//! volumes add up to that of the region.

use std::sync::Mutex;

use geometry::fault::{Fault, number};
use geometry::progress::{Progress, Stopped};
use geometry::surface_mesh::SurfaceMesh;

use super::sampling_grid::SamplingGrid;
use super::stitched::Stitched;
use super::tile::View;
use super::tile_queue::each_tile;
use crate::solid::{Solid, Space};
use crate::surface_maker::{Islands, MeshedSurface, Resolved, SurfaceOptions, kept};

/// One of the solids that a sheet makes of its region.
pub struct SpaceMade {
    /// Which it is.
    pub space: Space,
    /// Its surface and its connected components, of which none is dropped.
    pub made: MeshedSurface,
}

/// The surfaces of some of the solids into which a sheet divides its region, at grid spacing `edge` (mm), in the order of
/// `wanted`; all connected components are kept, since a dropped one would leave a gap. With `in_one_piece`, each must be.
///
/// Vertices and triangles between two of them are the same in both, bit by bit, the triangles turned round.
///
/// # Errors
/// As `SurfaceMaker::mesh`; a solid that is not a sheet; a wall without thickness somewhere, which separates nothing there;
/// none of the region in one of the solids.
pub fn spaces(
    solid: &Solid,
    wanted: &[Space],
    edge: f64,
    in_one_piece: bool,
    progress: &dyn Progress,
) -> Result<Vec<SpaceMade>, Stopped> {
    let grid = SamplingGrid::of_spaces(solid, edge).map_err(Stopped::Refused)?;
    let middle = solid.region.bounds().center();
    let mut surfaces = vec![SurfaceMesh::default(); wanted.len()];
    let mut all: Vec<Stitched> = surfaces.iter_mut().map(|s| Stitched::new(s)).collect();
    let map = |view: View| match view.hole {
        Some(at) => Err(at),
        None => Ok(wanted.iter().map(|s| view.patch(*s as usize, middle)).collect::<Vec<_>>()),
    };
    each_tile((&grid, &Mutex::default()), grid.all(), progress, map, |patches| {
        let patches = patches.map_err(|at| Stopped::Refused(no_wall(at)))?;
        all.iter_mut().zip(patches).try_for_each(|(out, patch)| out.add(patch))
    })?;
    let islands = if in_one_piece { Islands::Error } else { Islands::Keep };
    let finished = wanted.iter().zip(all).map(|(space, out)| {
        out.finish(&SurfaceOptions { resolution: edge, islands }).map_err(|stopped| match stopped {
            Stopped::Refused(fault) => Stopped::Refused(of_space(*space, fault)),
            other => other,
        })
    });
    let found = finished.collect::<Result<Vec<Resolved>, Stopped>>()?;
    let made = wanted.iter().zip(surfaces).zip(found).map(|((space, surface), found)| {
        let made = MeshedSurface { surface: kept(surface, &found), components: found.components, error: None };
        SpaceMade { space: *space, made }
    });
    Ok(made.collect())
}

/// A fault of one of the solids.
fn of_space(space: Space, fault: Fault) -> Fault {
    Fault { message: format!("of the parts, {}: {}", space.name(), fault.message), ..fault }
}

fn no_wall(at: [f64; 3]) -> Fault {
    let message = format!(
        "the wall has no thickness at ({}) mm, so lower and upper are one there; keep its level above 0 in the whole region",
        at.map(number).join(", ")
    );
    Fault::new("parts", message)
}
