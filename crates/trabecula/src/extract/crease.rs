//! Edges that a face has of its own, such as those of a mesh: where it alone makes the surface, and (`fit`) where it meets
//! others.
//!
//! The line in which a face meets the side of a cell runs straight from one grid edge to another. Where an edge of the
//! face pierces the side it gets a corner there, if it lies nearer to the face and its edges with it. A grid edge that the
//! face crosses twice, for one of its edges is close by, gets both points. The patch is then the cone over its rim from a
//! point of the face's edge inside the cell, or several where edges divide it. A rim is a simple curve on the boundary of a
//! convex cell, so one cone cannot meet itself; several are looked at. What a side or a grid edge gets depends on nothing but
//! what all cells around it see alike.
//!
//! Source: corners in the sides of cells after C. Ho, F. Wu, B. Chen, Y. Chuang and M. Ouhyoung, Cubical marching squares,
//! Comput. Graph. Forum 24 (2005) 537.

mod chord;
mod fill;
mod fit;
mod follow;
mod patch;
mod polygon;
mod rim;
mod side;
mod twice;
mod volume;
mod wall;
mod web;

use std::cmp::Ordering;

use rustc_hash::FxHashMap;

use crate::field::Field;
use geometry::math::{Vec3, add, dot, scale, sub};

use super::grid::{Grid, Local};
use super::key::Key;
use super::signs::{Signs, bits};
use super::tile::Nodes;
pub(super) use chord::Chord;
pub(super) use fit::Fits;
use follow::cell_of;
pub(super) use follow::{Wide, by_tile};

/// An edge of a face that passes a grid edge this near may pierce a side in which the face does not show, in multiples of what
/// points keep from nodes: a wedge of 15° whose tip is as far beyond a grid edge crosses it in two points too near to keep.
const BESIDE: f64 = 8.0;

/// Edges of faces in the cells of a block.
#[derive(Default)]
pub(super) struct Edges {
    /// For each row of cells: those that are filled by their rims.
    pub cells: Vec<u64>,
    /// Those of them in which the face meets others, and which face that is.
    fitted: Vec<u64>,
    fitted_to: Option<usize>,
    /// The face that has the edges.
    pub face: FxHashMap<usize, usize>,
    /// The chords of sides, by the lowest node of the side and the axis normal to it.
    sides: FxHashMap<(usize, usize), Vec<Chord>>,
    /// Grid edges that a face crosses twice, by the face, their lower nodes and axes: the lower point first.
    twice: FxHashMap<(usize, usize, usize), [Vec3; 2]>,
    /// The places of points that nothing else has.
    points: FxHashMap<Key, Vec3>,
    /// Where edges of live faces pierce sides.
    pierced: Vec<(usize, (usize, usize), Vec3)>,
    /// Pieces of edges in cells, by the face and the cells' lowest nodes.
    pieces: FxHashMap<(usize, usize), Vec<[Vec3; 2]>>,
    /// Places where edges end, meet or bend, and how many are there, likewise.
    corners: FxHashMap<(usize, usize), Vec<(Vec3, usize)>>,
    /// The corner that the patch of a cell has in a cell beside it, likewise.
    beyond: FxHashMap<usize, Vec3>,
    /// For each row of nodes: those within two cells of a piece of an edge.
    near: Vec<u64>,
}

/// A block, and a face in it.
pub(super) struct Seen<'a, P: Fn(usize, usize) -> Option<Vec3>> {
    pub grid: &'a Grid,
    pub local: &'a Local,
    pub nodes: &'a Nodes<'a>,
    pub signs: &'a Signs,
    /// The face's number among the live ones, its samples and its field.
    pub face: usize,
    pub samples: &'a [f32],
    pub field: &'a dyn Field,
    /// The vertices of plain cells: by the lower node of their grid edge, and its axis.
    pub place: P,
}

impl Edges {
    pub fn clear(&mut self, shape: [usize; 3]) {
        self.cells.clear();
        self.cells.resize(shape[1] * shape[2], 0);
        self.fitted_to = None;
        self.fitted.clear();
        self.fitted.resize(shape[1] * shape[2], 0);
        self.face.clear();
        self.sides.clear();
        self.twice.clear();
        self.points.clear();
        self.pierced.clear();
        self.pieces.clear();
        self.corners.clear();
        self.beyond.clear();
        self.near.clear();
        self.near.resize(shape[1] * shape[2], 0);
    }

    /// Whether a live face has edges here.
    pub fn has(&self, face: usize) -> bool {
        self.pierced.iter().any(|p| p.0 == face) || self.face.values().any(|f| *f == face)
    }

    /// Whether there are any.
    pub fn any(&self) -> bool {
        !self.face.is_empty()
    }

    /// The ends of all chords.
    pub fn chord_ends(&self) -> impl Iterator<Item = Key> {
        let chords = self.sides.values().flatten();
        chords.flat_map(|c| [c.from, c.to])
    }

    /// The place of a point that is none of a plain or a knotted cell.
    pub fn place(&self, key: Key) -> Option<Vec3> {
        self.points.get(&key).copied()
    }

    /// Takes the cells that a face with edges alone crosses, in several patches, out of those to be cut up: such are
    /// beside edges, mostly, where distances at nodes say little of where the face is.
    pub fn take(&mut self, local: &Local, signs: &mut Signs, nodes: &Nodes, face: usize) {
        let knotted: Vec<[usize; 3]> = signs.knotted_cells().collect();
        for cell in knotted {
            let [i, j, k] = cell;
            let (row, node) = (k * nodes.shape[1] + j, nodes.index(cell));
            let crossed = !matches!(signs.corners(face, i, j, k), 0 | 0xff);
            if crossed && decides(local, signs, face, cell) {
                signs.knotted[row] &= !(1 << i);
                signs.plain[face][row] |= 1 << i;
                self.cells[row] |= 1 << i;
                self.face.insert(node, face);
            }
        }
    }

    /// Adds the edges of a face that were followed.
    pub fn find<P: Fn(usize, usize) -> Option<Vec3>>(&mut self, seen: &Seen<P>) {
        let nodes = seen.nodes;
        let of = &seen.grid.faces[seen.local.live[seen.face]].creases;
        if seen.is_fitted() {
            let own = self.pieces.keys().filter(|p| p.0 == seen.face);
            let cells: Vec<usize> = own.map(|p| p.1).collect();
            self.find_twice(seen, cells);
        }
        // In the order of the segments where they pierce one side.
        let mut at: FxHashMap<(usize, usize), Vec<Vec3>> = FxHashMap::default();
        for (_, side, p) in self.pierced.iter().filter(|p| p.0 == seen.face) {
            at.entry(*side).or_default().push(seen.inside(*side, *p));
        }
        // Sides whose four grid edges are all crossed.
        for &node in self.face.iter().filter(|f| *f.1 == seen.face).map(|f| f.0) {
            for axis in 0..3 {
                at.entry((node, axis)).or_default();
                at.entry((node + nodes.stride[axis], axis)).or_default();
            }
        }
        for &(_, node, axis) in self.twice.keys().filter(|t| t.0 == seen.face) {
            for side in sides_around(nodes, (node, axis)) {
                at.entry(side).or_default();
            }
        }
        let beside = self.beside(seen, &at);
        for side in beside.keys() {
            at.entry(*side).or_default();
        }
        for (&side, pierced) in &at {
            let also = beside.get(&side).map_or(&[][..], |p| p);
            let Some(chords) = self.chords(seen, side, pierced, also) else {
                continue;
            };
            let mut cell = nodes.at(side.0);
            for _ in 0..2 {
                if seen.alone(cell) {
                    self.cells[cell[2] * nodes.shape[1] + cell[1]] |= 1 << cell[0];
                    self.face.insert(nodes.index(cell), seen.face);
                }
                cell[side.1] = cell[side.1].wrapping_sub(1);
            }
            for c in &chords {
                self.points.extend(c.via.iter().copied());
            }
            self.sides.insert(side, chords);
        }
        if self.any() {
            for p in &of.corners {
                if let Some(cell) = cell_of(nodes.axes, p.0) {
                    let here = (seen.face, nodes.index(cell));
                    self.corners.entry(here).or_default().push(*p);
                }
            }
            self.find_beyond(seen, &at);
        }
    }

    /// The points in which edges pierce sides so near to a grid edge that the face does not cross it twice: the sides around
    /// that one may have their corners there too, or instead.
    fn beside<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        pierced: &FxHashMap<(usize, usize), Vec<Vec3>>,
    ) -> FxHashMap<(usize, usize), Vec<Vec3>> {
        let nodes = seen.nodes;
        let mut found: FxHashMap<(usize, usize), Vec<Vec3>> = FxHashMap::default();
        for (&side, places) in pierced {
            for line in lines_of(nodes, side) {
                let (node, along) = line;
                if !seen.misses(line) || self.twice.contains_key(&(seen.face, node, along)) {
                    continue;
                }
                let (from, across) = (nodes.place(node), 3 - along - side.1);
                let near = BESIDE * seen.grid.margin * seen.length(node, across);
                let is_near = |p: &&Vec3| (p[across] - from[across]).abs() < near;
                for p in places.iter().filter(is_near) {
                    for other in sides_around(nodes, line).into_iter().filter(|s| *s != side) {
                        let mut q = *p;
                        q[other.1] = from[other.1];
                        found.entry(other).or_default().push(seen.inside(other, q));
                    }
                }
            }
        }
        // In an order that is the same in all tiles.
        for places in found.values_mut() {
            places.sort_by(|p, q| p.partial_cmp(q).unwrap_or(Ordering::Equal));
        }
        found
    }

    /// Finds the corners that lie in cells without any other surface, all their edges coming through one side: the patch
    /// behind that side reaches through it. Its rim lies on the boundary of the two cells together, which are convex.
    fn find_beyond<P: Fn(usize, usize) -> Option<Vec3>>(
        &mut self,
        seen: &Seen<P>,
        pierced: &FxHashMap<(usize, usize), Vec<Vec3>>,
    ) {
        let nodes = seen.nodes;
        let mut found: Vec<(usize, Vec3)> = Vec::new();
        for (&(_, node), corners) in self.corners.iter().filter(|c| c.0.0 == seen.face) {
            let cell = nodes.at(node);
            let [(place, count)] = corners[..] else {
                continue;
            };
            let untouched = || seen.alone(cell) && seen.untouched(cell);
            if count < 3 || self.cells[cell[2] * nodes.shape[1] + cell[1]] >> cell[0] & 1 == 1 || !untouched() {
                continue;
            }
            let sides = (0..3).flat_map(|a| [(a, false), (a, true)]);
            let mut open = sides.filter_map(|(axis, upper)| {
                let low = node + if upper { nodes.stride[axis] } else { 0 };
                let here = pierced.get(&(low, axis)).map_or(0, Vec::len);
                (here > 0).then_some((axis, upper, here))
            });
            let (Some((axis, upper, here)), None) = (open.next(), open.next()) else {
                continue;
            };
            let plane = nodes.axes[axis][cell[axis] + usize::from(upper)];
            if here != count || seen.grid.is_laid(axis, plane) {
                continue;
            }
            let behind = if upper {
                node + nodes.stride[axis]
            } else if cell[axis] > 0 {
                node - nodes.stride[axis]
            } else {
                continue;
            };
            let place = [0, 1, 2].map(|a| within(seen.grid, nodes.axes[a], cell[a], place[a]));
            found.push((behind, place));
        }
        // One for each patch.
        found.sort_by_key(|f| f.0);
        for pair in found.chunk_by(|a, b| a.0 == b.0) {
            if let [(behind, place)] = pair {
                self.beyond.insert(*behind, *place);
            }
        }
    }
}

impl<P: Fn(usize, usize) -> Option<Vec3>> Seen<'_, P> {
    /// Whether cells are fitted to the face.
    fn is_fitted(&self) -> bool {
        self.grid.fitted == Some(self.local.live[self.face])
    }

    /// Whether the face alone makes the surface in a cell of the block, or would if it crossed it.
    fn alone(&self, cell: [usize; 3]) -> bool {
        let (signs, [i, j, k]) = (self.signs, cell);
        let row = k * signs.shape[1] + j;
        if signs.knotted[row] >> i & 1 == 1 {
            return false;
        }
        if signs.plain[self.face][row] >> i & 1 == 1 {
            return true;
        }
        let live = self.local.live.len();
        if (0..live).any(|f| signs.plain[f][row] >> i & 1 == 1) {
            return false;
        }
        decides(self.local, signs, self.face, cell)
    }

    /// Whether a grid edge that is not on the border of the block has both ends on the same side of the face.
    fn misses(&self, (node, along): (usize, usize)) -> bool {
        let (at, shape) = (self.nodes.at(node), self.nodes.shape);
        let ends = [node, node + self.nodes.stride[along]];
        (0..3).all(|a| at[a] > 0 && at[a] + 2 <= shape[a]) && {
            let [p, q] = ends.map(|n| self.signs.is_negative(self.face, n));
            p == q
        }
    }

    /// A point of a side kept within it.
    fn inside(&self, (low, axis): (usize, usize), mut p: Vec3) -> Vec3 {
        let at = self.nodes.at(low);
        for a in (0..3).filter(|a| *a != axis) {
            p[a] = within(self.grid, self.nodes.axes[a], at[a], p[a]);
        }
        p
    }
}

/// What faces but one are at the corners of a cell.
struct Others<'a> {
    local: &'a Local,
    cell: [usize; 3],
    own: u64,
    negative: u64,
    varies: u64,
}

impl<'a> Others<'a> {
    fn of(local: &'a Local, signs: &Signs, face: usize, [i, j, k]: [usize; 3]) -> Others<'a> {
        let (mut varies, mut negative) = (0u64, 0u64);
        for f in (0..local.live.len()).filter(|f| *f != face) {
            match signs.corners(f, i, j, k) {
                0 => {}
                0xff => negative |= 1 << f,
                _ => varies |= 1 << f,
            }
        }
        Others { local, cell: [i, j, k], own: 1 << face, negative, varies }
    }

    fn holds(&self, mask: u64) -> bool {
        let [i, j, k] = self.cell;
        let live = self.local.live.len();
        let sign = |f: usize| match f.checked_sub(live) {
            Some(flat) => Signs::beside(self.local, flat, j, k) >> i,
            None => mask >> f,
        };
        self.local.tree.solid(&sign) & 1 == 1
    }

    /// Whether the face makes all the surface there may be, whatever the others are: the tree never falls when a face becomes
    /// negative, so two cases stand for all.
    fn leave_all(&self) -> bool {
        self.each_case(|without, with| with && !without)
    }

    /// Whether it makes a difference in none of the two cases.
    fn leave_none(&self) -> bool {
        self.each_case(|without, with| with == without)
    }

    fn each_case(&self, is: impl Fn(bool, bool) -> bool) -> bool {
        let cases = [self.negative, self.negative | self.varies];
        cases.iter().all(|n| is(self.holds(*n), self.holds(n | self.own)))
    }

    /// Whether there is no surface at all.
    fn is_dead(&self) -> bool {
        self.holds(self.negative) == self.holds(self.negative | self.varies | self.own)
    }
}

/// Whether a face alone would make the surface in a cell if it crossed it, whatever the other faces are there.
fn decides(local: &Local, signs: &Signs, face: usize, cell: [usize; 3]) -> bool {
    Others::of(local, signs, face, cell).leave_all()
}

/// The point of a segment nearest to another one.
fn nearest([p, q]: [Vec3; 2], to: Vec3) -> Vec3 {
    let along = sub(q, p);
    let square = dot(along, along);
    let t = if square > 0.0 { (dot(sub(to, p), along) / square).clamp(0.0, 1.0) } else { 0.0 };
    add(p, scale(along, t))
}

/// The grid edges of a side: each by its lower node and its axis.
fn lines_of(nodes: &Nodes, (low, axis): (usize, usize)) -> [(usize, usize); 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let (du, dv) = (nodes.stride[u], nodes.stride[v]);
    [(low, u), (low + du, v), (low + dv, u), (low, v)]
}

/// The sides around a grid edge that is not on the border of the block.
fn sides_around(nodes: &Nodes, (node, along): (usize, usize)) -> [(usize, usize); 4] {
    let (u, v) = ((along + 1) % 3, (along + 2) % 3);
    let (du, dv) = (nodes.stride[u], nodes.stride[v]);
    [(node, u), (node - dv, u), (node, v), (node - du, v)]
}

/// A coordinate kept within a step of the grid, away from its ends.
fn within(grid: &Grid, axis: &[f64], at: usize, x: f64) -> f64 {
    let (low, high) = (axis[at], axis[at + 1]);
    let margin = grid.margin * (high - low);
    x.clamp(low + margin, high - margin)
}

/// The cells that have edges, among some.
pub(super) fn cells(edges: &Edges, nodes: &Nodes, own: &[std::ops::Range<usize>; 3]) -> Vec<([usize; 3], usize)> {
    let ny = nodes.shape[1];
    let mut found = Vec::new();
    for (row, w) in edges.cells.iter().enumerate() {
        for i in bits(*w) {
            let cell = [i, row % ny, row / ny];
            if (0..3).all(|a| own[a].contains(&cell[a])) {
                found.push((cell, edges.face[&nodes.index(cell)]));
            }
        }
    }
    found
}
