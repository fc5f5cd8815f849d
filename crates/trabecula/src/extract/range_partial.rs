//! What is known of a range of tiles once they are extracted: their components, joined where the range alone says how, and what the
//! tiles around it need. It goes to other processes, and into files, as bytes.
//!
//! Totals stay those of each tile: they are summed in the order of the tiles, whatever the ranges, and so to the same bits.

use geometry::fault::Fault;
use geometry::math::Aabb;
use geometry::union_find::{find, unite};
use rustc_hash::FxHashMap;
use std::ops::Range;

use super::packed::{Packer, Unpacker, damaged};
use super::sampling_grid::{SamplingGrid, TILE};
use super::tile_components::{LINES, TileComponents};
use super::tile_figures::FigureSums;
use crate::surface_maker::{ComponentGraph, NONE, Totals};

/// The first bytes; the last one is the number of the layout.
const MAGIC: [u8; 4] = *b"TRP\x01";

/// Lines of a row of tiles, and the components that they meet; NONE where they are in no solid.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct RowLines {
    /// The row: the tiles' numbers in y and z.
    pub row: [u64; 2],
    pub lines: Vec<(u32, u32)>,
}

/// The components of the tiles in a range.
#[derive(Clone, Debug, Default)]
pub(super) struct Partial {
    /// For each component of each tile, in order.
    pub totals: Vec<Totals>,
    /// Components that are one surface, or one solid: each with the lowest of its own.
    pub surface: Vec<(u32, u32)>,
    pub solid: Vec<(u32, u32)>,
    /// For each layer of tiles, the border vertices that were met first in it and that tiles outside the range may use: name, in
    /// ascending order, and component.
    pub layers: Vec<(u64, Vec<(u128, u32)>)>,
    /// The first row, if it has surface: lines that come into the range inside the solid, and the component where they first leave it.
    pub enters: Option<RowLines>,
    /// The last row, if it has surface: lines that were met, and the component at which they entered the solid, if they are inside.
    pub leaves: Option<RowLines>,
    /// What is measured besides, if it is.
    pub figures: Option<FigureSums>,
}

/// Joins the components of a range of tiles as they come, in order. See `TileSweep`, which knows all tiles before.
pub(super) struct RangeSweep {
    range: Range<usize>,
    graph: ComponentGraph,
    here: FxHashMap<u128, u32>,
    below: FxHashMap<u128, u32>,
    /// The layers of tiles of both.
    at: [usize; 2],
    layers: Vec<(u64, Vec<(u128, u32)>)>,
    enters: Option<RowLines>,
    row: Option<[u64; 2]>,
    /// For each line of the current row, the component at which it entered the solid, if it is inside; UNMET where it was not met.
    open: Vec<u32>,
}

/// A line that no tile of the range has met yet.
const UNMET: u32 = NONE - 1;

impl RangeSweep {
    pub fn new(range: Range<usize>) -> RangeSweep {
        RangeSweep {
            range,
            graph: ComponentGraph::default(),
            here: FxHashMap::default(),
            below: FxHashMap::default(),
            at: [0; 2],
            layers: Vec::new(),
            enters: None,
            row: None,
            open: Vec::new(),
        }
    }

    /// Adds the components of the next tile.
    pub fn add(&mut self, grid: &SamplingGrid, tile: TileComponents) -> Result<(), Fault> {
        let base = self.graph.add(&tile.totals, 0)?;
        let layer = tile.tile[2];
        if layer != self.at[0] {
            self.put_below(grid);
            (self.below, self.at[1]) = (std::mem::take(&mut self.here), self.at[0]);
            if layer != self.at[1] + 1 {
                self.put_below(grid);
            }
            self.at[0] = layer;
        }
        tile.join(&mut self.graph, base, &self.below, &mut self.here);
        let solid = &mut self.graph.solid;
        let row = [tile.tile[1] as u64, tile.tile[2] as u64];
        if self.row != Some(row) {
            // Tiles of a later row come after the first of their row, which nothing enters.
            let first = self.row.is_none() && !self.range.start.is_multiple_of(grid.tiles()[0]);
            let unmet = if first { UNMET } else { NONE };
            self.enters = self.enters.take().or_else(|| first.then(|| RowLines { row, lines: Vec::new() }));
            self.row = Some(row);
            self.open.clear();
            self.open.resize(LINES, unmet);
        }
        for line in &tile.lines {
            let open = &mut self.open[line.row as usize];
            match (*open, &mut self.enters) {
                (UNMET, Some(enters)) if line.first != NONE => enters.lines.push((line.row, base + line.first)),
                (NONE | UNMET, _) => {}
                (open, _) if line.first != NONE => {
                    unite(solid, base + line.first, open);
                }
                _ => {}
            }
            *open = if line.last == NONE { NONE } else { base + line.last };
        }
        Ok(())
    }

    /// Puts the vertices of the layer below aside, those that tiles outside the range may use.
    fn put_below(&mut self, grid: &SamplingGrid) {
        let inside = |name: u128| {
            let [first, last] = users(grid, name);
            self.range.contains(&first) && self.range.contains(&last)
        };
        let mut kept: Vec<(u128, u32)> = self.below.drain().filter(|(name, _)| !inside(*name)).collect();
        if !kept.is_empty() {
            kept.sort_unstable();
            self.layers.push((self.at[1] as u64, kept));
        }
    }

    /// What is known of the range.
    pub fn finish(mut self, grid: &SamplingGrid, figures: Option<FigureSums>) -> Partial {
        self.put_below(grid);
        (self.below, self.at[1]) = (std::mem::take(&mut self.here), self.at[0]);
        self.put_below(grid);
        let ComponentGraph { totals, mut surface, mut solid } = self.graph;
        let met = |(n, open): (usize, &u32)| (*open != UNMET).then_some((n as u32, *open));
        let leaves =
            self.row.map(|row| RowLines { row, lines: self.open.iter().enumerate().filter_map(met).collect() });
        Partial {
            surface: joined(&mut surface),
            solid: joined(&mut solid),
            totals,
            layers: self.layers,
            enters: self.enters,
            leaves,
            figures,
        }
    }
}

/// Numbers that are not the lowest of their own, with that.
fn joined(root: &mut [u32]) -> Vec<(u32, u32)> {
    (0..root.len() as u32).filter_map(|v| Some((v, find(root, v))).filter(|(v, low)| v != low)).collect()
}

/// The first and the last of the tiles that may use a border vertex, by its name (`VertexId::global`).
fn users(grid: &SamplingGrid, name: u128) -> [usize; 2] {
    let steps = (name >> 48 & 0o777) as u64;
    let spans = (steps | steps >> 3 | steps >> 6) & 7;
    let mut node = (name >> 57) as usize;
    let tiles = grid.tiles();
    let (mut first, mut last) = ([0; 3], [0; 3]);
    for a in 0..3 {
        let at = node % grid.axes[a].len();
        node /= grid.axes[a].len();
        let last_tile = tiles[a] - 1;
        // Two tiles meet in a node plane.
        let both = at.is_multiple_of(TILE) && spans >> a & 1 == 0;
        last[a] = (at / TILE).min(last_tile);
        first[a] = if both { (at / TILE).saturating_sub(1) } else { last[a] };
    }
    [grid.number(first), grid.number(last)]
}

impl Partial {
    /// As bytes.
    pub fn pack(&self) -> Vec<u8> {
        let mut out = Packer(MAGIC.to_vec());
        out.count(self.totals.len());
        for t in &self.totals {
            out.whole(t.triangles.into());
            out.whole(t.vertices.into());
            let Aabb { min, max } = t.bounds;
            [t.volume, t.area[0], t.area[1]].iter().chain(&min).chain(&max).for_each(|v| out.real(*v));
        }
        for pairs in [&self.surface, &self.solid] {
            out.count(pairs.len());
            pairs.iter().flat_map(|(a, b)| [*a, *b]).for_each(|v| out.whole(v.into()));
        }
        out.count(self.layers.len());
        for (layer, border) in &self.layers {
            out.whole((*layer).into());
            out.count(border.len());
            let mut before = 0;
            for (name, component) in border {
                out.whole(name - before);
                out.whole((*component).into());
                before = *name;
            }
        }
        for row in [&self.enters, &self.leaves] {
            out.count(usize::from(row.is_some()));
            let Some(RowLines { row, lines }) = row else { continue };
            row.iter().for_each(|v| out.whole((*v).into()));
            out.count(lines.len());
            for (line, component) in lines {
                out.whole((*line).into());
                // In no solid is 0.
                out.whole(if *component == NONE { 0 } else { u128::from(*component) + 1 });
            }
        }
        out.count(usize::from(self.figures.is_some()));
        if let Some(figures) = &self.figures {
            figures.pack(&mut out);
        }
        out.0
    }

    /// From bytes.
    ///
    /// # Errors
    /// Bytes that are damaged or of another version.
    pub fn unpack(bytes: &[u8]) -> Result<Partial, Fault> {
        let mut from = Unpacker(bytes);
        if from.take()? != MAGIC {
            return Err(damaged());
        }
        let count = from.count()?;
        let total = |from: &mut Unpacker| {
            let (triangles, vertices) = (from.word()?, from.word()?);
            let [volume, lattice, cut] = from.reals()?;
            let bounds = Aabb { min: from.reals()?, max: from.reals()? };
            Ok(Totals { triangles, vertices, volume, area: [lattice, cut], bounds })
        };
        let totals = (0..count).map(|_| total(&mut from)).collect::<Result<Vec<_>, Fault>>()?;
        let limit = count as u128;
        let mut pairs = || {
            let pairs = from.count()?;
            (0..pairs).map(|_| Ok((from.below(limit)?, from.below(limit)?))).collect::<Result<Vec<_>, Fault>>()
        };
        let (surface, solid) = (pairs()?, pairs()?);
        let mut layers = Vec::new();
        for _ in 0..from.count()? {
            let (layer, names) = (from.word()?, from.count()?);
            let mut border = Vec::with_capacity(names);
            let mut name = 0u128;
            for _ in 0..names {
                name = name.checked_add(from.whole()?).ok_or_else(damaged)?;
                border.push((name, from.below(limit)?));
            }
            layers.push((layer, border));
        }
        let mut row = || -> Result<Option<RowLines>, Fault> {
            if from.whole()? == 0 {
                return Ok(None);
            }
            let row = [from.word()?, from.word()?];
            let lines = from.count()?;
            let line = |from: &mut Unpacker| Ok((from.below(LINES as u128)?, from.below(limit + 1)?.wrapping_sub(1)));
            let lines = (0..lines).map(|_| line(&mut from)).collect::<Result<Vec<_>, Fault>>()?;
            Ok(Some(RowLines { row, lines }))
        };
        let (enters, leaves) = (row()?, row()?);
        let figures = match from.whole()? {
            0 => None,
            _ => Some(FigureSums::unpack(&mut from, count)?),
        };
        if !from.0.is_empty() {
            return Err(damaged());
        }
        Ok(Partial { totals, surface, solid, layers, enters, leaves, figures })
    }
}
