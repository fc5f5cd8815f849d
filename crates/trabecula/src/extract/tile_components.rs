//! Connected components of a tile's surface, and how they are joined across tiles.
//!
//! Each tile adds up the totals of its own components, where its triangles are at hand. A component continues into other
//! tiles through border vertices, which have the same name there. The solid is traced along the grid lines in x, on which
//! the surface alternately enters and leaves it: both ends of an interval of solid bound the same solid component, which
//! joins a cavity to the solid around it. That is enough: from the point of a cavity that is farthest in +x a line runs
//! through solid to the outer boundary, or to another cavity that reaches still farther.

use geometry::fault::Fault;
use geometry::formats::stl;
use geometry::math::{Vec3, cross, dot, norm, sub};
use geometry::union_find::{find, unite};

use rustc_hash::FxHashMap;

use super::sampling_grid::TILE;
use super::sign_words::{bits, within};
use super::tile::{TileSurface, View};
use crate::surface_maker::{ComponentGraph, Islands, NONE, Resolved, Totals};

/// The components that a grid line in x crosses in a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GridLine {
    /// The line's number among those of the tile.
    pub row: u32,
    /// The component where it first leaves the solid, if it enters the tile inside the solid.
    pub first: u32,
    /// The component where it last enters the solid, if it leaves the tile inside it.
    pub last: u32,
}

/// Lines that belong to a tile.
pub(super) const LINES: usize = TILE * TILE;

/// The surface components of a tile, in the order of their first vertices.
#[derive(Debug)]
pub(super) struct TileComponents {
    pub tile: [usize; 3],
    /// Triangles, volumes and areas are added up while the triangles are taken.
    pub totals: Vec<Totals>,
    /// Vertices that other tiles may use: name and component.
    pub border: Vec<(u128, u32)>,
    /// Pairs of components with an interval of solid between them.
    pub adjacent: Vec<(u32, u32)>,
    pub lines: Vec<GridLine>,
    /// For each component, the longest interval of void adjacent to it that was met on a line: length (mm) and middle.
    pub gaps: Vec<Gap>,
}

/// An interval of void: length, mm, and middle; of no length where there is none.
pub(super) type Gap = (f64, Vec3);

impl TileComponents {
    /// As `each_triangle`, of the whole solid; its triangles go to the end of `records`, as those of a binary STL.
    pub fn with_records(view: &View, middle: Vec3, records: &mut Vec<u8>) -> TileComponents {
        let positions = view.positions();
        TileComponents::each_triangle(view, 0, middle, |t, _| {
            stl::push_record(records, t.map(|v| positions[v as usize].map(|x| x as f32)));
        })
    }

    /// Finds the components of the surface of a part of the solid in a tile and calls `take` for its triangles, component by component, so that what is
    /// removed later is contiguous: with the numbers of the vertices, and whether the triangle is a cut. `middle` is the
    /// apex of the cones by which volumes are summed.
    pub fn each_triangle(
        view: &View,
        part: usize,
        middle: Vec3,
        mut take: impl FnMut([u32; 3], bool),
    ) -> TileComponents {
        let positions = view.positions();
        let mut root = vec![NONE; positions.len()];
        view.triangles(part).for_each(|(t, _)| join(&mut root, t));
        let (component, mut totals) = number(root, positions);
        let mut add = |sum: &mut Totals, t: [u32; 3], cut: bool| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            let n = cross(sub(b, a), sub(c, a));
            sum.triangles += 1;
            sum.volume += dot(sub(a, middle), n) / 6.0;
            sum.area[usize::from(cut)] += norm(n) / 2.0;
            take(t, cut);
        };
        // A local sum stays in registers.
        if let [sum] = &mut totals[..] {
            let mut whole = *sum;
            view.triangles(part).for_each(|(t, cut)| add(&mut whole, t, cut));
            *sum = whole;
        } else {
            let sorted = sorted(view, part, &component, totals.len());
            for (sum, triangles) in totals.iter_mut().zip(sorted) {
                let mut whole = *sum;
                for (t, cut) in triangles {
                    add(&mut whole, t, cut);
                }
                *sum = whole;
            }
        }
        let border = border(view, &component, &mut totals);
        let mut gaps = vec![(0.0, [0.0; 3]); totals.len()];
        let (lines, adjacent) = lines(view, part, &component, &mut gaps);
        TileComponents { tile: view.tile(), border, adjacent, lines, gaps, totals }
    }
}

impl TileComponents {
    /// Joins its components, numbered from `base` on, with those of the tiles before it, whose border vertices are `here`, in its own layer,
    /// and `below`; adds its own vertices to `here`.
    pub fn join(
        &self,
        graph: &mut ComponentGraph,
        base: u32,
        below: &FxHashMap<u128, u32>,
        here: &mut FxHashMap<u128, u32>,
    ) {
        for (name, component) in &self.border {
            let component = base + component;
            let known = below.get(name).copied();
            let first = known.unwrap_or_else(|| *here.entry(*name).or_insert(component));
            if first == component && known.is_none() {
                graph.totals[component as usize].vertices += 1;
            } else {
                unite(&mut graph.surface, component, first);
            }
        }
        for (a, b) in &self.adjacent {
            unite(&mut graph.solid, base + a, base + b);
        }
    }
}

/// Joins the components of tiles as they come, in order.
///
/// It holds the border vertices of two layers of tiles (the current one and the one below it), and one number for each line
/// of one row of tiles: never the mesh.
#[derive(Default)]
pub(super) struct TileSweep {
    graph: ComponentGraph,
    /// Component of each border vertex of the current layer of tiles, and of the one below it.
    here: FxHashMap<u128, u32>,
    below: FxHashMap<u128, u32>,
    layer: usize,
    /// For each line of the current row of tiles, the component at which it entered the solid, if it is inside.
    open: Vec<u32>,
    row: [usize; 2],
}

impl TileSweep {
    /// Adds the components of the next tile.
    pub fn add(&mut self, tile: TileComponents) -> Result<(), Fault> {
        let base = self.graph.add(&tile.totals, 0)?;
        // A vertex is shared within a layer of tiles or with the layer below, so names need not be kept for longer.
        if tile.tile[2] != self.layer {
            let last = std::mem::take(&mut self.here);
            self.below = if tile.tile[2] == self.layer + 1 { last } else { FxHashMap::default() };
            self.layer = tile.tile[2];
        }
        tile.join(&mut self.graph, base, &self.below, &mut self.here);
        let solid = &mut self.graph.solid;
        if self.row != [tile.tile[1], tile.tile[2]] || self.open.is_empty() {
            self.row = [tile.tile[1], tile.tile[2]];
            self.open.clear();
            self.open.resize(LINES, NONE);
        }
        // Adjacent lines mostly join the same two components.
        let mut joined = (NONE, NONE);
        for line in &tile.lines {
            let open = &mut self.open[line.row as usize];
            if line.first != NONE && *open != NONE && joined != (line.first, *open) {
                joined = (line.first, *open);
                unite(solid, base + line.first, *open);
            }
            *open = if line.last == NONE { NONE } else { base + line.last };
        }
        Ok(())
    }

    /// The components of the whole surface.
    pub fn resolve(self, islands: Islands, spacing: f64) -> Result<Resolved, Fault> {
        self.graph.resolve(islands, spacing)
    }
}

/// Unites the vertices of a triangle; a vertex met for the first time goes straight to the root of the others.
#[inline]
fn join(root: &mut [u32], [a, b, c]: [u32; 3]) {
    let [x, y, z] = [a, b, c].map(|v| root[v as usize]);
    if x == y && y == z && x != NONE {
        return;
    }
    let known = [(x, a), (y, b), (z, c)].into_iter().find(|k| k.0 != NONE);
    let to = known.map_or(a, |(_, v)| find(root, v));
    root[to as usize] = to;
    for (r, v) in [(x, a), (y, b), (z, c)] {
        if r == NONE {
            root[v as usize] = to;
        } else if r != to {
            unite(root, v, to);
        }
    }
}

/// The component of each vertex, and the number and bounds of each component's vertices.
fn number(mut root: Vec<u32>, positions: &[Vec3]) -> (Vec<u32>, Vec<Totals>) {
    let mut component = vec![NONE; root.len()];
    let mut totals: Vec<Totals> = Vec::new();
    for (v, position) in positions.iter().enumerate() {
        if root[v] == NONE {
            continue;
        }
        let top = find(&mut root, v as u32) as usize;
        if component[top] == NONE {
            component[top] = totals.len() as u32;
            totals.push(Totals::ZERO);
        }
        component[v] = component[top];
        let sum = &mut totals[component[v] as usize];
        sum.vertices += 1;
        sum.bounds = sum.bounds.with(*position);
    }
    (component, totals)
}

/// Vertices that other tiles may use, with their components; they are not counted in their tile.
fn border(view: &View, component: &[u32], totals: &mut [Totals]) -> Vec<(u128, u32)> {
    let mut border = Vec::new();
    view.each_shared(&mut |v| {
        let of = component[v as usize];
        if of != NONE {
            border.push((view.name(v as usize), of));
            totals[of as usize].vertices -= 1;
        }
    });
    border
}

/// The triangles of each component, in their order.
fn sorted(view: &View, part: usize, component: &[u32], count: usize) -> Vec<Vec<([u32; 3], bool)>> {
    let mut of = vec![Vec::new(); count];
    view.triangles(part).for_each(|(t, cut)| of[component[t[0] as usize] as usize].push((t, cut)));
    of
}

/// The components that grid lines in x cross, and the pairs of components with an interval of solid between them. In `gaps` go
/// the intervals of void.
fn lines(view: &View, part: usize, component: &[u32], gaps: &mut [Gap]) -> (Vec<GridLine>, Vec<(u32, u32)>) {
    // Row, position, whether the solid begins there, component, vertex: in parts that are in order already.
    let mut met: Vec<(u32, f64, bool, u32, u32)> = Vec::new();
    view.each_crossing(part, &mut |row, v, x, enters| {
        let component = component[v as usize];
        if component != NONE {
            met.push((row, x, enters, component, v));
        }
    });
    met.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let ends = [view.own[0].start, view.own[0].end].map(|i| view.nodes.axes[0][i]);
    let (mut lines, mut adjacent) = (Vec::new(), Vec::new());
    for on_row in met.chunk_by(|a, b| a.0 == b.0) {
        let row = on_row[0].0;
        let (mut first, mut open) = (NONE, NONE);
        for (n, &(_, x, enters, component, v)) in on_row.iter().enumerate() {
            let (low, high) = match (enters, n.checked_sub(1), on_row.get(n + 1)) {
                (true, before, _) => (before.map_or(ends[0], |b| on_row[b].1), x),
                (false, _, next) => (x, next.map_or(ends[1], |n| n.1)),
            };
            let gap = &mut gaps[component as usize];
            if high - low > gap.0 {
                let [_, y, z] = view.positions()[v as usize];
                *gap = (high - low, [(low + high) / 2.0, y, z]);
            }
            if enters {
                open = component;
                continue;
            }
            if n == 0 {
                first = component;
            } else if open != NONE && open != component && adjacent.last() != Some(&(open, component)) {
                adjacent.push((open, component));
            }
            open = NONE;
        }
        if first != NONE || open != NONE {
            lines.push(GridLine { row, first, last: open });
        }
    }
    (lines, adjacent)
}

impl View<'_> {
    /// The surface of a part of the solid in the tile by components, with what stitching needs; and the components.
    pub fn patch(&self, part: usize, middle: Vec3) -> (TileSurface, TileComponents) {
        let mut patch = TileSurface::default();
        let mut renamed = vec![u32::MAX; self.positions().len()];
        let mut shared = vec![false; self.positions().len()];
        self.each_shared(&mut |v| shared[v as usize] = true);
        let bodies = TileComponents::each_triangle(self, part, middle, |t, cut| {
            patch.cut.push(cut);
            patch.triangles.push(t.map(|v| {
                let slot = &mut renamed[v as usize];
                if *slot == u32::MAX {
                    *slot = patch.vertices.len() as u32;
                    patch.vertices.push(self.positions()[v as usize]);
                    patch.shared.push(shared[v as usize].then(|| self.name(v as usize)));
                }
                *slot
            }));
        });
        (patch, bodies)
    }

    /// Calls `found` for every vertex at which a grid line in x that belongs to the tile may cross the surface of a part of the
    /// solid, with the numbers of the line and the vertex, the position on the line, and whether the line enters the part there.
    fn each_crossing(&self, part: usize, found: &mut impl FnMut(u32, u32, f64, bool)) {
        let mine = within(&self.own[0]);
        let row_of = |j: usize, k: usize| {
            let inside = self.own[1].contains(&j) && self.own[2].contains(&k);
            inside.then(|| ((k - self.own[2].start) * TILE + j - self.own[1].start) as u32)
        };
        let ny = self.nodes.shape[1];
        for (surface, numbers) in self.numbers().iter().enumerate() {
            let outside = self.is_outside(part, surface);
            for k in self.own[2].clone() {
                for j in self.own[1].clone() {
                    let Some(row) = row_of(j, k) else { continue };
                    let solid = self.negative(surface, k * ny + j);
                    let (crossed, first) = numbers.row(0, k * ny + j);
                    for (n, i) in bits(crossed).enumerate() {
                        if mine >> i & 1 == 1 {
                            let v = first + n as u32;
                            found(row, v, self.positions()[v as usize][0], (solid >> i & 1 == 0) != outside);
                        }
                    }
                }
            }
        }
        for (v, key) in self.extra() {
            let [i, j, k] = self.nodes.at(key.node());
            let Some(row) = row_of(j, k) else { continue };
            let enters = if key.is_along(0) && mine >> i & 1 == 1 {
                key.surfaces().next().map(|f| {
                    let falls = (self.negative(f, k * ny + j) >> i & 1 == 0) != (key.index() == 2);
                    falls != self.is_outside(part, f)
                })
            } else if key.spans() == 0 {
                // A node of a cap: on lines that pass through the plane, it is where they do.
                let caps = self.flat().iter().filter(|f| f.axis == 0);
                caps.filter(|f| f.at == i).map(|f| !f.below).next()
            } else {
                None
            };
            if let Some(enters) = enters {
                found(row, v, self.positions()[v as usize][0], enters);
            }
        }
    }
}
