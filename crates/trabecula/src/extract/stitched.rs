//! The patches of tiles, stitched to one mesh.

use geometry::math::Vec3;
use geometry::progress::Stopped;
use rustc_hash::FxHashMap;

use super::tile::TileSurface;
use super::tile_components::{TileComponents, TileSweep};
use crate::surface_maker::{Resolved, SurfaceOptions, SurfaceSink, next_vertex, not_empty};

/// A mesh that grows by one tile after the other, in order. It holds the names of the border vertices of two layers of tiles.
pub(super) struct Stitched<'a> {
    out: &'a mut dyn SurfaceSink,
    sweep: TileSweep,
    vertices: usize,
    triangles: u64,
    /// Vertices on the borders of tiles of the current layer and of the one below it, by name.
    border: [FxHashMap<u128, u32>; 2],
    layer: usize,
    // Buffers, kept to save allocations.
    new: Vec<Vec3>,
    numbers: Vec<u32>,
}

impl<'a> Stitched<'a> {
    /// An empty mesh, which goes to `out`.
    pub fn new(out: &'a mut dyn SurfaceSink) -> Stitched<'a> {
        Stitched {
            out,
            sweep: TileSweep::default(),
            vertices: 0,
            triangles: 0,
            border: Default::default(),
            layer: 0,
            new: Vec::new(),
            numbers: Vec::new(),
        }
    }

    /// Adds the patch of the next tile.
    pub fn add(&mut self, (mut patch, components): (TileSurface, TileComponents)) -> Result<(), Stopped> {
        let layer = components.tile[2];
        if layer != self.layer {
            // A vertex is shared within a layer of tiles or with the layer below.
            let below = std::mem::take(&mut self.border[0]);
            self.border[1] = if layer == self.layer + 1 { below } else { FxHashMap::default() };
            self.layer = layer;
        }
        let [here, below] = &mut self.border;
        self.new.clear();
        self.numbers.clear();
        for (v, shared) in patch.vertices.iter().zip(&patch.shared) {
            let new = next_vertex(self.vertices)?;
            let number = match shared {
                Some(key) => below.get(key).copied().unwrap_or_else(|| *here.entry(*key).or_insert(new)),
                None => new,
            };
            if number == new {
                self.new.push(*v);
                self.vertices += 1;
            }
            self.numbers.push(number);
        }
        for t in &mut patch.triangles {
            *t = t.map(|v| self.numbers[v as usize]);
        }
        self.triangles += patch.triangles.len() as u64;
        self.out.add(&self.new, &patch.triangles, &patch.cut).map_err(Stopped::Io)?;
        self.sweep.add(components).map_err(Stopped::Refused)
    }

    /// The components of the whole mesh, once all tiles are added.
    pub fn finish(self, options: &SurfaceOptions) -> Result<Resolved, Stopped> {
        not_empty(self.triangles, options.resolution)?;
        self.sweep.resolve(options.islands, options.resolution).map_err(Stopped::Refused)
    }
}
