//! The surface in one tile.
//!
//! Where a single smooth surface crosses a cell, which is nearly everywhere: marching cubes, with every vertex strictly inside
//! its own grid edge. Then the mesh is closed, manifold, free of self-intersection and of degenerate triangles by construction
//! (see `cube_table`), whatever the surface does; and rounding to f32 preserves that, because rounding is monotone: it maps the
//! grid to a grid and edges to edges.
//!
//! Two steps move these vertices, only ever along their edges:
//! - a bracketed Newton iteration puts them on the true surface;
//! - a chord lies on one side of a curved surface, so a mesh with its vertices on the surface has a volume error of first order
//!   in curvature · h². For each triangle the distance from the surface is estimated from the normals at its corners, and its
//!   vertices share the move that cancels its volume error. What remains is of fourth order.
//!
//! Where surfaces meet, `feature_cells` cuts the cell. Where a flat surface of the solid is a plane of the grid, `planar_caps`
//! closes it.
//!
//! A tile includes a halo of one cell. All that is computed there is a function of the grid edge or triangle alone, in the same
//! order, so that adjacent tiles find bit-identical vertices.

mod count;
mod edge_vertices;
mod holes;
mod plain_triangles;
mod volume_balance;

use std::cell::Cell;
use std::ops::Range;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::field::Block;
use crate::implicit::{Surface, SurfacePair};
use geometry::fault::Fault;
use geometry::math::Vec3;

use super::block_nodes::BlockNodes;
use super::feature_cells::{FeatureCells, FeatureMesh};
use super::feature_edges::{DividedFaces, EdgeStore, SurfaceContext};
use super::planar_caps;
use super::sampling_grid::{GridPlane, LocalSolid, SamplingGrid, Sides, TILE};
use super::sign_words::{Signs, below, bits, negative};
use super::vertex_id::VertexId;
use super::vertex_numbers::VertexNumbers;
pub(super) use count::count;
use edge_vertices::{list_vertices, solve};
use holes::hole;
use plain_triangles::list_triangles;
use volume_balance::balance;

/// The surface of one tile.
#[derive(Default)]
pub(super) struct TileSurface {
    /// Vertex positions.
    pub vertices: Vec<Vec3>,
    /// For each vertex, its id among all tiles if an adjacent one may use it too.
    pub shared: Vec<Option<u128>>,
    /// Triangles of the tile's own cells.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, whether it is a cut.
    pub cut: Vec<bool>,
}

/// Buffers that one thread uses again and again.
#[derive(Default)]
pub(super) struct TileBuffers {
    /// Values of the live surfaces at the nodes.
    samples: Vec<Vec<f32>>,
    signs: Signs,
    numbers: Vec<VertexNumbers>,
    points: Vec<Vec3>,
    values: Vec<f64>,
    gradients: Vec<Vec3>,
    vertices: Vec<EdgeVertex>,
    plain: Plain,
    /// Positions of all vertices: those on grid edges, then the extra ones.
    positions: Vec<Vec3>,
    /// Unit normals of the vertices on edges.
    normals: Vec<[f32; 3]>,
    /// For each vertex on an edge: the volume it is to lose, and three times what it loses per mm along its edge.
    moments: Vec<(f32, f32)>,
    extra: FeatureMesh,
    edges: EdgeStore,
    divided_faces: DividedFaces,
}

/// What plain cells make.
#[derive(Default)]
struct Plain {
    /// Ordered by surface.
    triangles: Vec<[u32; 3]>,
    /// Number of triangles of each surface.
    counts: Vec<usize>,
    kinds: Vec<TriangleRole>,
    /// What lies on the sides of each triangle, if the solid has several parts.
    sides: Vec<Sides>,
    seams: Vec<Seam>,
}

/// A plain cell adjacent to a feature cell, and its surface.
type Seam = ([usize; 3], usize);

/// What a triangle of a plain cell is for.
#[derive(Clone, Copy, PartialEq, Eq)]
enum TriangleRole {
    /// Only to balance its neighbours: it belongs to another tile, or something finer takes its position.
    Neighbour,
    /// The lattice's surface.
    Lattice,
    /// The region's surface.
    Cut,
}

/// A vertex on a grid edge. Compact, as a tile has ten thousand of them: what follows from the block is not stored.
#[derive(Clone, Copy)]
struct EdgeVertex {
    /// The lower node of the edge.
    node: [u8; 3],
    axis: u8,
    surface: u8,
    /// Whether the solid end is the lower one.
    up: bool,
    /// Whether a feature cell has the edge too: then that places the vertex.
    fixed: bool,
    /// Position on the edge from the solid end (0) to the void end (1). Rounding moves the vertex by 1e-7 of the edge.
    t: f32,
}

impl EdgeVertex {
    /// The lower node, as an index in the block.
    #[inline]
    fn low(&self, nodes: &BlockNodes) -> usize {
        nodes.index(self.node.map(usize::from))
    }

    /// Signed length of the edge from its solid to its void end.
    #[inline]
    fn reach(&self, nodes: &BlockNodes) -> f64 {
        let axis = usize::from(self.axis) % 3;
        let length = nodes.steps[axis][usize::from(self.node[axis]) % 64];
        if self.up { length } else { -length }
    }

    #[inline]
    fn at(&self, nodes: &BlockNodes, t: f64) -> Vec3 {
        let s = if self.up { t } else { 1.0 - t };
        core::array::from_fn(|a| {
            let n = usize::from(self.node[a]) % 64;
            let share = if a == usize::from(self.axis) { s } else { 0.0 };
            nodes.positions[a][n] + share * nodes.steps[a][n]
        })
    }
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 512;

/// The surface found in a tile, in the buffers of its thread.
pub(super) struct View<'a> {
    s: &'a TileBuffers,
    pub nodes: BlockNodes<'a>,
    grid: &'a SamplingGrid,
    local: LocalSolid,
    /// First node of the block.
    from: [usize; 3],
    /// Cells of the tile itself, in block coordinates.
    pub own: [Range<usize>; 3],
    /// A position at which there is no wall between the spaces adjacent to it.
    pub hole: Option<Vec3>,
}

/// Extracts the surface of a tile; `None` when bounds or signs show that there is none.
///
/// # Errors
/// A surface that crosses itself when it is rounded to single precision, far from the origin.
pub(super) fn extract<'a>(
    grid: &'a SamplingGrid,
    tile: [usize; 3],
    s: &'a mut TileBuffers,
) -> Result<Option<View<'a>>, Fault> {
    let block = grid.block(tile);
    let range = grid.nodes(tile);
    let Some(local) = grid.local(&range, &block.bounds()) else {
        return Ok(None);
    };
    let nodes = BlockNodes::new(&block);
    let from = range.map(|r| r.start);
    let own = grid.own(tile);
    trace_edges(s, grid, &local, &nodes, tile);
    sample(s, grid, &local, &block, &nodes);
    let hole = grid.faces.and_then(|faces| hole(s, &local, &nodes, faces));
    let crossed = s.signs.sort(&local);
    if !crossed && local.grid_planes.is_empty() {
        return Ok(None);
    }
    claim_cells(s, grid, &local, &nodes);
    list_vertices(s, &nodes);
    let mut first = 0;
    for (i, &surface) in local.live.iter().enumerate() {
        let count = s.vertices[first..].iter().take_while(|v| usize::from(v.surface) == i).count();
        solve(s, &nodes, &*grid.surfaces[surface].field, i, first..first + count);
        first += count;
    }
    let margin = grid.margin as f32;
    s.positions.clear();
    s.positions.extend(s.vertices.iter_mut().map(|v| {
        v.t = v.t.clamp(margin, 1.0 - margin);
        v.at(&nodes, f64::from(v.t))
    }));
    let snapped = s.edges.claims.any() && s.signs.has_features();
    if snapped {
        // Contours are grid-aligned between the points that stay.
        let (mut features, vertices, _) = features(s, grid, &local, &nodes);
        snap(&mut features, vertices);
        s.divided_faces = features.divided_faces;
    }
    edges(s, grid, &local, &nodes);
    if snapped {
        // Vertices are balanced from the positions found before snapping: which of them snap is known to a tile in its own
        // cells only.
        for (position, v) in s.positions.iter_mut().zip(&s.vertices) {
            *position = v.at(&nodes, f64::from(v.t));
        }
    }
    list_triangles(s, grid, &local, &own);
    balance(s, grid, &local, &nodes, &own);
    finish(s, grid, &local, &nodes, &own);
    if let Some(at) = s.extra.self_intersection {
        return Err(grid.too_far(at));
    }
    let own_triangles = s.plain.kinds.iter().any(|k| *k != TriangleRole::Neighbour) || !s.extra.triangles.is_empty();
    Ok((own_triangles || hole.is_some()).then_some(View { s, nodes, grid, local, from, own, hole }))
}

/// Fills the samples and signs of the live surfaces. Those of the lattice are expensive, so they are evaluated only where the
/// region can contain solid.
fn sample(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, block: &Block, nodes: &BlockNodes) {
    s.signs.shape = block.shape();
    let count = local.live.len();
    if s.samples.len() < count {
        s.samples.resize_with(count, Vec::new);
    }
    s.signs.negative.resize_with(count, Vec::new);
    // Every sample is written, so nothing needs clearing.
    s.samples[..count].iter_mut().for_each(|out| out.resize(block.len(), 0.0));
    let mut wanted = None;
    let mut live = local.live.iter().map(|f| &grid.surfaces[*f]).enumerate().peekable();
    while let Some((i, surface)) = live.next() {
        let is_other = |p: &Arc<dyn SurfacePair>, next: &Surface| next.pair.as_ref().is_some_and(|n| Arc::ptr_eq(p, n));
        let pair = surface.pair.as_ref().filter(|p| live.next_if(|(_, next)| is_other(p, next)).is_some());
        let both = i..i + 1 + usize::from(pair.is_some());
        if surface.cut {
            surface.field.fill(block, &mut s.samples[i]);
        } else {
            let wanted = wanted.get_or_insert_with(|| {
                let known = local.live.iter().filter(|f| grid.surfaces[**f].cut).count();
                let mut wanted = s.signs.wanted(local, known);
                s.edges.traced.wanted(nodes, &mut wanted);
                wanted
            });
            match (pair, &mut s.samples[both.clone()]) {
                (Some(pair), [a, b]) => pair.fill_both(block, wanted, [a, b]),
                (_, out) => out.iter_mut().for_each(|out| surface.field.fill_near(block, wanted, out)),
            }
        }
        for i in both {
            negative(&mut s.signs.negative[i], &s.samples[i], block.shape()[0], surface.cut);
        }
    }
}

/// Traces the feature edges of all live surfaces.
fn trace_edges(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, nodes: &BlockNodes, tile: [usize; 3]) {
    s.edges.clear(nodes.shape);
    let padded = grid.padded(tile);
    for (surface, &id) in local.live.iter().enumerate() {
        if let Some(segments) = grid.creases(id, tile) {
            let of = &grid.surfaces[id].creases;
            s.edges.traced.trace(nodes, &padded, of, surface, segments);
        }
    }
}

/// Claims the cells in which surfaces with feature edges make the surface, alone or with others.
fn claim_cells(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, nodes: &BlockNodes) {
    for (surface, &id) in local.live.iter().enumerate() {
        if grid.has_creases(id) {
            s.edges.claims.claim_sole(local, &mut s.signs, nodes, surface);
        }
    }
    for (surface, &id) in local.live.iter().enumerate() {
        if grid.fitted == Some(id) {
            s.edges.claims.claim_fitted(local, &mut s.signs, nodes, &s.edges.traced, surface);
        }
    }
}

/// Makes the contours of surfaces with feature edges.
fn edges(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, nodes: &BlockNodes) {
    let TileBuffers { edges, samples, signs, numbers, positions, .. } = s;
    for (surface, &id) in local.live.iter().enumerate() {
        if edges.has(surface) {
            let context = SurfaceContext {
                grid,
                local,
                nodes,
                signs,
                surface,
                samples: &samples[surface],
                field: &*grid.surfaces[id].field,
                position: |node, axis| {
                    let [i, j, k] = nodes.at(node);
                    let v = numbers[surface].get(axis, k * nodes.shape[1] + j, i)?;
                    Some(positions[v as usize])
                },
            };
            edges.find(&context);
        }
    }
}

/// The builder of feature and fitted cells; the vertices of plain cells, and the seams.
fn features<'a>(
    s: &'a mut TileBuffers,
    grid: &'a SamplingGrid,
    local: &'a LocalSolid,
    nodes: &'a BlockNodes,
) -> (FeatureCells<'a>, &'a [EdgeVertex], &'a [Seam]) {
    s.extra.clear();
    let mut divided_faces = std::mem::take(&mut s.divided_faces);
    divided_faces.clear(local.live.len());
    let features = FeatureCells {
        nodes,
        grid,
        local,
        samples: &s.samples,
        signs: &s.signs,
        numbers: &s.numbers,
        positions: &mut s.positions,
        extra: &mut s.extra,
        edges: &s.edges,
        perturbed_nodes: FxHashMap::default(),
        divided_faces,
        fragments: Cell::default(),
    };
    (features, &s.vertices, &s.plain.seams)
}

/// Snaps the vertices that plain cells share with feature cells to the positions these give them.
fn snap(features: &mut FeatureCells, vertices: &[EdgeVertex]) {
    for (i, v) in vertices.iter().enumerate().filter(|(_, v)| v.fixed) {
        let low = v.low(features.nodes);
        let key = VertexId::new(low, &[1 << v.axis], &[usize::from(v.surface)]);
        features.positions[i] = features.position(key);
    }
}

/// Adds all that marching cubes does not make: feature and fitted cells, the seams around them, and caps.
fn finish(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, nodes: &BlockNodes, own: &[Range<usize>; 3]) {
    let featured = s.signs.has_features();
    if !featured && local.grid_planes.is_empty() && !s.edges.claims.any() {
        s.extra.clear();
        return;
    }
    let (mut features, vertices, seams) = features(s, grid, local, nodes);
    if featured {
        // First to where a feature cell alone has them: an adjacent tile may not know the plain cell beyond.
        snap(&mut features, vertices);
        features.all(own);
    }
    snap(&mut features, vertices);
    features.divide_faces(own);
    for &(cell, surface) in seams {
        features.seam(cell, surface);
    }
    for (cell, surface) in features.edges.claims.own(nodes, own) {
        if features.edges.claims.is_fitted(nodes, cell) {
            features.fitted(cell, surface);
        } else {
            features.fill_edge_cell(cell, surface);
        }
    }
    for flat in 0..local.grid_planes.len() {
        planar_caps::close(&mut features, flat, own);
    }
    s.divided_faces = features.divided_faces;
}

impl View<'_> {
    /// Positions of the vertices that `triangles` refers to.
    pub fn positions(&self) -> &[Vec3] {
        &self.s.positions
    }

    /// The triangles of the tile's own cells that bound a part of the solid, and whether they are cuts.
    pub fn triangles(&self, part: usize) -> impl Iterator<Item = ([u32; 3], bool)> {
        let part = part as u8 + 1;
        let Plain { triangles, kinds, sides, .. } = &self.s.plain;
        let plain = triangles.iter().zip(kinds).enumerate().filter(|(_, (_, k))| **k != TriangleRole::Neighbour);
        let plain = plain.filter_map(move |(n, (t, k))| {
            let seen = sides.get(n).map_or(Some(*t), |s| s.seen(*t, part));
            Some((seen?, *k == TriangleRole::Cut))
        });
        let extra = self.s.extra.triangles.iter();
        plain.chain(extra.filter_map(move |(t, s)| Some((s.seen(*t, part)?, s.cut))))
    }

    /// Whether a part of the solid lies where a live surface is positive.
    pub fn is_outside(&self, part: usize, surface: usize) -> bool {
        self.grid.is_outside(part, self.local.live[surface])
    }

    /// The tile's position among the tiles.
    pub fn tile(&self) -> [usize; 3] {
        [0, 1, 2].map(|a| (self.from[a] + self.own[a].start) / TILE)
    }

    /// For each live surface, the numbers of its vertices on grid edges.
    pub fn numbers(&self) -> &[VertexNumbers] {
        &self.s.numbers[..self.local.live.len()]
    }

    /// The signs of a live surface on a row of nodes: bits where it is negative.
    pub fn negative(&self, surface: usize, row: usize) -> u64 {
        self.s.signs.negative[surface][row]
    }

    /// The surfaces that are planes of the grid.
    pub fn flat(&self) -> &[GridPlane] {
        &self.local.grid_planes
    }

    /// The extra vertices, with their ids in the block.
    pub fn extra(&self) -> impl Iterator<Item = (u32, VertexId)> {
        (self.s.vertices.len() as u32..).zip(self.s.extra.keys.iter().copied())
    }

    fn key(&self, v: usize) -> VertexId {
        match self.s.vertices.get(v) {
            Some(v) => VertexId::new(v.low(&self.nodes), &[1 << v.axis], &[usize::from(v.surface)]),
            None => self.s.extra.keys[v - self.s.vertices.len()],
        }
    }

    /// Tells of the vertices that a neighbouring tile may use as well, in their order.
    pub fn each_shared(&self, found: &mut impl FnMut(u32)) {
        let borders = |a: usize| [self.own[a].start, self.own[a].end];
        let at_x = borders(0).into_iter().fold(0, |w, i| w | 1u64 << i);
        let [_, ny, nz] = self.nodes.shape;
        for numbers in self.numbers() {
            for axis in 0..3 {
                for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
                    let whole = (axis != 1 && borders(1).contains(&j)) || (axis != 2 && borders(2).contains(&k));
                    let mask = match axis {
                        _ if whole => u64::MAX,
                        0 => continue,
                        _ => at_x,
                    };
                    let (crossed, first) = numbers.row(axis, k * ny + j);
                    for i in bits(crossed & mask) {
                        found(first + (crossed & below(i)).count_ones());
                    }
                }
            }
        }
        for (v, key) in self.extra() {
            let (at, spans) = (self.nodes.at(key.node()), key.spans());
            if (0..3).any(|a| spans >> a & 1 == 0 && borders(a).contains(&at[a])) {
                found(v);
            }
        }
    }

    /// The id of a vertex among all tiles.
    pub fn name(&self, v: usize) -> u128 {
        let key = self.key(v);
        let at = self.nodes.at(key.node());
        let all = self.grid.axes.each_ref().map(|a| a.len() as u128);
        let at = [0, 1, 2].map(|a| (at[a] + self.from[a]) as u128);
        let node = at[0] + all[0] * (at[1] + all[1] * at[2]);
        key.global(node, |f| self.local.live[f])
    }
}
