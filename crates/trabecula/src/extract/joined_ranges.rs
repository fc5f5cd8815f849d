//! The components of ranges of tiles, joined to those of the whole surface: exactly what one process finds that takes all tiles.

use std::ops::Range;

use geometry::fault::Fault;
use geometry::progress::Stopped;
use geometry::union_find::unite;
use rustc_hash::FxHashMap;

use super::packed::damaged;
use super::range_partial::{Partial, RowLines};
use super::tile_components::LINES;
use super::tile_figures::FigureSums;
use crate::surface_maker::{ComponentGraph, Measured, NONE, Summary, SurfaceOptions, not_empty};

/// Joins ranges of tiles as they come, in order. It holds the border vertices of two layers of tiles and a few numbers for each
/// component of each tile.
#[derive(Default)]
pub struct JoinedRanges {
    graph: ComponentGraph,
    triangles: u64,
    /// What is measured besides, if it is of all ranges.
    sums: Option<FigureSums>,
    here: FxHashMap<u128, u32>,
    below: FxHashMap<u128, u32>,
    layer: u64,
    row: [u64; 2],
    /// For each line of the current row of tiles, the component at which it entered the solid, if it is inside.
    open: Vec<u32>,
}

/// The surface of all ranges.
pub struct WholeSurface {
    /// Its figures, once components that do not stay are dropped.
    pub summary: Summary,
    /// The triangles that stay, by their numbers in order.
    pub kept: Vec<Range<u64>>,
    /// Number of triangles before any are dropped.
    pub triangles: u64,
}

impl JoinedRanges {
    /// Adds the partial result of the next range.
    ///
    /// # Errors
    /// Bytes that are none; more components than can be numbered.
    pub fn add(&mut self, partial: &[u8]) -> Result<(), Fault> {
        let range = Partial::unpack(partial)?;
        let base = self.graph.add(&range.totals, 0)?;
        self.sums = match (self.sums.take(), range.figures) {
            (Some(mut sums), Some(next)) => {
                sums.join(next);
                Some(sums)
            }
            (None, first) if base == 0 => first,
            _ => None,
        };
        self.triangles += range.totals.iter().map(|t| t.triangles).sum::<u64>();
        let ComponentGraph { totals, surface, solid } = &mut self.graph;
        for (a, b) in range.surface {
            unite(surface, base + a, base + b);
        }
        for (a, b) in range.solid {
            unite(solid, base + a, base + b);
        }
        for (layer, border) in range.layers {
            if layer != self.layer {
                // A vertex is shared within a layer of tiles or with the layer below.
                let last = std::mem::take(&mut self.here);
                self.below = if layer == self.layer + 1 { last } else { FxHashMap::default() };
                self.layer = layer;
            }
            for (name, component) in border {
                let component = base + component;
                match self.below.get(&name).or_else(|| self.here.get(&name)).copied() {
                    Some(first) => {
                        // It was counted where it was met first.
                        let counted = &mut totals[component as usize].vertices;
                        *counted = counted.saturating_sub(1);
                        unite(surface, component, first);
                    }
                    None => {
                        self.here.insert(name, component);
                    }
                }
            }
        }
        if let Some(enters) = range.enters.filter(|e| e.row == self.row && !self.open.is_empty()) {
            for (line, component) in enters.lines {
                let open = self.open[line as usize];
                if open != NONE {
                    unite(solid, base + component, open);
                }
            }
        }
        if let Some(RowLines { row, lines }) = range.leaves {
            if self.row != row || self.open.is_empty() {
                self.row = row;
                self.open.clear();
                self.open.resize(LINES, NONE);
            }
            for (line, component) in lines {
                self.open[line as usize] = if component == NONE { NONE } else { base + component };
            }
        }
        Ok(())
    }

    /// The whole surface, once all ranges are added.
    ///
    /// # Errors
    /// No surface at all; several connected components, if the options refuse them.
    pub fn finish(self, options: &SurfaceOptions) -> Result<WholeSurface, Stopped> {
        not_empty(self.triangles, options.resolution)?;
        let triangles = self.triangles;
        let found = self.graph.resolve(options.islands, options.resolution).map_err(Stopped::Refused)?;
        Ok(WholeSurface { kept: found.kept(), summary: found.summary(), triangles })
    }

    /// The figures of the whole surface, once all ranges are added.
    ///
    /// # Errors
    /// As `finish`; ranges whose figures were not taken.
    pub fn measured(self, options: &SurfaceOptions) -> Result<Measured, Stopped> {
        not_empty(self.triangles, options.resolution)?;
        let found = self.graph.resolve(options.islands, options.resolution).map_err(Stopped::Refused)?;
        let sums = self.sums.ok_or_else(|| Stopped::Refused(damaged()))?;
        Ok(sums.finish(found))
    }
}
