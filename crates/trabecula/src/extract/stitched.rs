//! The patches of tiles, stitched to one mesh.

use geometry::fault::Fault;
use geometry::math::Vec3;
use geometry::progress::Stopped;
use geometry::surface_mesh::SurfaceMesh;
use rustc_hash::FxHashMap;

use super::tile::Patch;
use super::tile_components::{TileComponents, TileSweep};
use crate::surface_maker::{self, Made, Options, not_empty};

/// A mesh that grows by one tile after the other.
#[derive(Default)]
pub(super) struct Stitched {
    out: SurfaceMesh,
    sweep: TileSweep,
    /// Vertices on the borders of tiles, by name.
    border: FxHashMap<u128, u32>,
}

impl Stitched {
    /// Adds the patch of the next tile.
    pub fn add(&mut self, (patch, components): (Patch, TileComponents)) -> Result<(), Stopped> {
        let Stitched { out, border, .. } = self;
        let mut numbers = Vec::with_capacity(patch.vertices.len());
        for (v, shared) in patch.vertices.iter().zip(&patch.shared) {
            let vertices: &mut Vec<Vec3> = &mut out.mesh.vertices;
            let new = u32::try_from(vertices.len()).map_err(|_| {
                Stopped::Refused(Fault::new("edge", "more than 2^32 vertices; use a larger edge, or STL"))
            })?;
            let number = match shared {
                Some(key) => *border.entry(*key).or_insert(new),
                None => new,
            };
            if number == new {
                vertices.push(*v);
            }
            numbers.push(number);
        }
        out.mesh.triangles.extend(patch.triangles.iter().map(|t| t.map(|v| numbers[v as usize])));
        out.cut.extend_from_slice(&patch.cut);
        self.sweep.add(components).map_err(Stopped::Refused)
    }

    /// The whole mesh, once all tiles are added.
    pub fn finish(self, options: &Options) -> Result<Made, Stopped> {
        not_empty(self.out.mesh.triangles.len() as u64, options.resolution)?;
        let found = self.sweep.resolve(options.islands, options.resolution).map_err(Stopped::Refused)?;
        Ok(Made { surface: surface_maker::kept(self.out, &found), components: found.components, error: None })
    }
}
