//! Cells in which a face with edges meets others, and how their sides are divided.
//!
//! Such a cell is divided into tetrahedra so that the patch of the face with edges is made of sides of them: each side of
//! the cell is cut along its chords and into triangles, and the tetrahedra run from these to a point inside. So the face
//! needs no values there. Every other face is the plane of its values at a tetrahedron's corners, as in a knot, but these
//! corners are points of the edges as well as nodes.
//!
//! On a grid edge the other faces stay what their values at its two nodes make of them, and at points inside a side or
//! a cell they keep between their values at the nodes around: then none shows where a neighbour would not see it.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use super::{Edges, Others, Seen};
use crate::extract::grid::Local;
use crate::extract::key::Key;
use crate::extract::knot::{Knots, Simplex, Spot};
use crate::extract::signs::{Signs, bits};
use crate::extract::tile::Nodes;
use crate::math::Vec3;
use crate::mesh::exact::{drop_axis, orient2d};

/// Points that are no nodes, and the sides of cells that they divide.
#[derive(Default)]
pub(in crate::extract) struct Fits {
    /// Places of the points.
    places: Vec<Vec3>,
    /// Values of all live faces at them.
    values: Vec<Vec<f64>>,
    /// The first of those that are the same point, with other values.
    first: Vec<usize>,
    numbers: HashMap<Key, usize>,
    /// By the lowest node and the axis normal to the side.
    pub sides: HashMap<(usize, usize), Rc<Side>>,
}

impl Fits {
    pub fn place(&self, point: usize) -> Vec3 {
        self.places[point]
    }

    pub fn value(&self, point: usize, face: usize) -> f64 {
        self.values[point][face]
    }
}

/// A side of a cell, cut along its chords and into triangles.
pub(in crate::extract) struct Side {
    /// Its nodes and the points in it: number behind that of the nodes, number in the side, and name.
    pub(super) corners: Vec<Corner>,
    pub(super) parts: Vec<Part>,
    /// The parts cut by all other faces, as the sides of a knotted cell are.
    pub pieces: Vec<(u64, Vec<Key>)>,
    /// The chords with the points where other faces cross them.
    pub chords: Vec<Vec<Key>>,
    /// How often it was divided anew.
    pub(super) tries: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub id: usize,
    /// Nodes from 0 on, points of the four grid edges from 4 on in pairs, corners of chords from 12 on.
    code: usize,
    key: Key,
}

/// A triangle of a side.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// Among the corners, in rising order.
    pub corners: [usize; 3],
    /// Whether they run counter-clockwise about the side's axis.
    pub left: bool,
    /// Whether the face is negative in it.
    pub inside: bool,
    /// Whether the line across from each corner is part of a chord.
    pub walls: [bool; 3],
}

const AXES: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The faces that are negative in a polygon, and the names and places of its corners.
type Polygon = (u64, Vec<(Key, Vec3)>);

/// How often a side is divided anew with other values at its points, if single precision muddles it.
const TRIES: usize = 8;

/// The grid edges of a side that a corner lies on, as bits.
fn lines(code: usize) -> u8 {
    match code {
        0..4 => 1 << code | 1 << ((code + 3) % 4),
        4..12 => 1 << ((code - 4) / 2),
        _ => 0,
    }
}

impl Edges {
    /// Takes the cells in which a face with edges meets others out of those to be cut as knots.
    pub fn fit(&mut self, local: &Local, signs: &mut Signs, nodes: &Nodes, face: usize) {
        let mixed = |signs: &Signs, [i, j, k]: [usize; 3]| {
            !matches!(signs.corners(face, i, j, k), 0 | 0xff)
        };
        let mut found: Vec<[usize; 3]> = signs.knotted_cells().collect();
        found.retain(|c| mixed(signs, *c));
        for &node in self.pieces.keys() {
            let cell = nodes.at(node);
            let others = Others::of(local, signs, face, cell);
            if !mixed(signs, cell)
                && others.varies != 0
                && !others.leave_all()
                && !others.leave_none()
            {
                found.push(cell);
            }
        }
        for cell in found {
            let [i, j, k] = cell;
            let row = k * nodes.shape[1] + j;
            for plain in &mut signs.plain {
                plain[row] &= !(1 << i);
            }
            signs.plain[face][row] |= 1 << i;
            signs.knotted[row] |= 1 << i;
            self.cells[row] |= 1 << i;
            self.fitted[row] |= 1 << i;
            self.face.insert(nodes.index(cell), face);
        }
    }

    /// Whether a face meets others in a cell in which it is fitted.
    pub fn is_fitted(&self, nodes: &Nodes, [i, j, k]: [usize; 3]) -> bool {
        self.fitted[k * nodes.shape[1] + j] >> i & 1 == 1
    }

    /// The cells that place the vertices of a face on their grid edges by the values at the nodes.
    pub fn knots<'a>(&self, signs: &'a Signs, face: usize) -> Cow<'a, [u64]> {
        if self.fitted.is_empty() || !self.has(face) {
            return Cow::Borrowed(&signs.knotted);
        }
        let rows = signs.knotted.iter().zip(&self.fitted);
        Cow::Owned(rows.map(|(k, f)| k & !f).collect())
    }

    /// Adds to the nodes at which the other faces are asked for those about pieces of edges.
    pub fn wanted(&self, nodes: &Nodes, wanted: &mut [u64]) {
        for &node in self.pieces.keys() {
            let [i, j, k] = nodes.at(node);
            let around = |x: usize, a: usize| x.saturating_sub(1)..(x + 3).min(nodes.shape[a]);
            let row = around(i, 0).fold(0, |w, i| w | 1u64 << i);
            for k in around(k, 2) {
                for j in around(j, 1) {
                    wanted[k * nodes.shape[1] + j] |= row;
                }
            }
        }
    }

    /// Whether a cell can follow whatever a side or a grid edge of it gets.
    pub(super) fn joins<P: Fn(usize, usize) -> Option<Vec3>>(
        &self,
        seen: &Seen<P>,
        cell: [usize; 3],
    ) -> bool {
        if seen.alone(cell) {
            return true;
        }
        let fits = seen.grid.fitted == Some(seen.local.live[seen.face]);
        let dead = || Others::of(seen.local, seen.signs, seen.face, cell).is_dead();
        fits && (self.is_fitted(seen.nodes, cell) || dead())
    }
}

impl Knots<'_> {
    /// Divides the sides of the fitted cells in and around the tile's own.
    pub fn fit_sides(&mut self, own: &[Range<usize>; 3]) {
        let ny = self.nodes.shape[1];
        let mine = |c: &[usize; 3]| (0..3).all(|a| own[a].contains(&c[a]));
        for row in 0..self.edges.fitted.len() {
            for i in bits(self.edges.fitted[row]) {
                let cell = [i, row % ny, row / ny];
                let face = self.edges.face[&self.nodes.index(cell)];
                for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
                    let mut across = cell;
                    across[axis] = across[axis].wrapping_add(if upper { 1 } else { usize::MAX });
                    if !mine(&cell) && !mine(&across) {
                        continue;
                    }
                    let low = self.nodes.index(cell) + self.offset(usize::from(upper) << axis);
                    if !self.fits.sides.contains_key(&(low, axis))
                        && let Some(side) = self.fit_side((low, axis), face)
                    {
                        self.fits.sides.insert((low, axis), Rc::new(side));
                    }
                }
            }
        }
    }

    /// A value kept away from zero, as those at nodes are.
    pub(super) fn kept(&self, face: usize, v: f64) -> f64 {
        let id = self.local.live[face];
        let least = self.grid.margin * self.grid.faces[id].slope * self.grid.step;
        if v <= 0.0 {
            v.min(-least)
        } else {
            v.max(least)
        }
    }

    /// The value of a face at a share of a grid edge: between those at its nodes.
    fn value_along(&self, face: usize, node: usize, axis: usize, share: f64) -> f64 {
        let [a, b] = [node, node + self.offset(1 << axis)].map(|n| self.value(face, n));
        self.kept(face, a + (b - a) * share)
    }

    /// Where on a grid edge a place is.
    fn share_of(&self, node: usize, axis: usize, place: Vec3) -> f64 {
        let (axis_nodes, at) = (self.nodes.axes[axis], self.nodes.at(node)[axis]);
        (place[axis] - axis_nodes[at]) / (axis_nodes[at + 1] - axis_nodes[at])
    }

    /// The points in which the face with edges crosses a grid edge, the lower one first.
    fn points_of(&self, node: usize, axis: usize, face: usize) -> Vec<(Key, Vec3)> {
        if let Some(points) = self.edges.twice.get(&(node, axis)) {
            return (0..2)
                .map(|i| (Key::crossing(node, axis, face, i), points[i]))
                .collect();
        }
        let ends = [node, node + self.offset(1 << axis)];
        let [p, q] = ends.map(|n| self.signs.is_negative(face, n));
        let key = Key::new(node, &[1 << axis], &[face]);
        match self.numbered(key) {
            Some(v) if p != q => vec![(key, self.places[v as usize])],
            _ if p != q => vec![(key, self.place(key))],
            _ => Vec::new(),
        }
    }

    /// Where the others than the fitted face cross a grid edge that this crosses too: as their values at its nodes say, but
    /// on their side of its points, and apart from these and from each other.
    pub fn spaced(&self, key: Key) -> Option<Vec3> {
        let axis = (0..3).find(|a| key.is_along(*a))?;
        let fitted = self.grid.fitted?;
        let fitted = self.local.live.iter().position(|f| *f == fitted)?;
        let (node, face) = (key.node(), key.faces().next()?);
        if face == fitted {
            return None;
        }
        let points = self.points_of(node, axis, fitted);
        if points.is_empty() {
            return None;
        }
        let at: Vec<f64> = points
            .iter()
            .map(|p| self.share_of(node, axis, p.1))
            .collect();
        let stretch = |f: usize| {
            let same = |s: &&f64| {
                (self.value_along(f, node, axis, **s) <= 0.0) == (self.value(f, node) <= 0.0)
            };
            at.iter().take_while(same).count()
        };
        let here = stretch(face);
        let edge = self.simplex(node, &[1 << axis]);
        let others = self.crossings(&edge).into_iter();
        let mut all: Vec<(f64, usize)> = others
            .filter(|(_, f)| *f != fitted && stretch(*f) == here)
            .collect();
        let low = if here == 0 { 0.0 } else { at[here - 1] };
        let high = at.get(here).copied().unwrap_or(1.0);
        let count = all.len();
        let apart = self.grid.margin.min((high - low) / (count + 1) as f64);
        let mut before = low;
        for s in &mut all {
            s.0 = s.0.max(before + apart);
            before = s.0;
        }
        let mut after = high;
        for s in all.iter_mut().rev() {
            s.0 = s.0.min(after - apart);
            after = s.0;
        }
        let share = all.iter().find(|s| s.1 == face)?.0;
        let mut place = self.nodes.place(node);
        let (axis_nodes, i) = (self.nodes.axes[axis], self.nodes.at(node)[axis]);
        place[axis] += share * (axis_nodes[i + 1] - axis_nodes[i]);
        Some(place)
    }

    /// Adds a point that is no node; gives its number.
    pub(super) fn add_point(&mut self, place: Vec3, values: Vec<f64>) -> usize {
        self.fits.places.push(place);
        self.fits.values.push(values);
        let id = self.nodes.count() + self.fits.places.len() - 1;
        self.fits.first.push(id);
        id
    }

    /// The number that stands for a node or a point and those that are the same.
    pub(super) fn first_of(&self, id: usize) -> usize {
        id.checked_sub(self.nodes.count())
            .map_or(id, |p| self.fits.first[p])
    }

    /// The same point with other values of the same signs, by chance.
    fn shaken(&mut self, low: usize, corner: &Corner, attempt: usize) -> usize {
        let Some(point) = corner.id.checked_sub(self.nodes.count()) else {
            return corner.id;
        };
        let faces = 0..self.local.live.len();
        let shaken = faces.map(|f| {
            let seed = self.local.live[f] + 64 * (corner.code + 16 * attempt);
            self.kept(
                f,
                self.fits.values[point][f] * (1.0 + 0.7 * self.chance(seed, low)),
            )
        });
        let values = shaken.collect();
        let id = self.add_point(self.fits.places[point], values);
        let first = self.fits.first[point];
        self.fits.first[id - self.nodes.count()] = first;
        id
    }

    /// The values of all live faces at a place, between those at some nodes.
    pub(super) fn values_between(&self, place: Vec3, around: &[usize]) -> Vec<f64> {
        let value = |f: usize| {
            let at = around.iter().map(|n| self.value(f, *n));
            let (low, high) = at.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
            if (low <= 0.0) == (high <= 0.0) {
                return low;
            }
            let id = self.local.live[f];
            self.kept(f, self.grid.faces[id].field.value(place).clamp(low, high))
        };
        (0..self.local.live.len()).map(value).collect()
    }

    /// Divides a side, if the face shows in it.
    fn fit_side(&mut self, (low, axis): (usize, usize), face: usize) -> Option<Side> {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (du, dv) = (self.nodes.stride[u], self.nodes.stride[v]);
        let ring = [low, low + du, low + du + dv, low + dv];
        let mut corners: Vec<Corner> = Vec::with_capacity(8);
        // Counter-clockwise: corners, and for points whether the boundary enters the solid there.
        let mut boundary: Vec<(usize, Option<bool>)> = Vec::with_capacity(8);
        let mut solid = self.signs.is_negative(face, low);
        for i in 0..4 {
            boundary.push((corners.len(), None));
            corners.push(Corner {
                id: ring[i],
                code: i,
                key: Key::new(ring[i], &[], &[]),
            });
            let (node, along) = (
                ring[i].min(ring[(i + 1) % 4]),
                if i % 2 == 0 { u } else { v },
            );
            let mut points: Vec<_> = self
                .points_of(node, along, face)
                .into_iter()
                .enumerate()
                .collect();
            if i > 1 {
                points.reverse();
            }
            for (n, (key, place)) in points {
                solid = !solid;
                boundary.push((corners.len(), Some(solid)));
                let id = self.point(key, place, |k| {
                    let share = k.share_of(node, along, place);
                    let faces = 0..k.local.live.len();
                    faces
                        .map(|f| k.value_along(f, node, along, share))
                        .collect()
                });
                let code = 4 + 2 * i + n;
                corners.push(Corner { id, code, key });
            }
        }
        if boundary.len() == 4 {
            return None;
        }
        let chords = self.chords_of((low, axis), &ring, &mut corners, &boundary);
        let parts = self.parts(
            axis,
            &corners,
            &boundary,
            &chords,
            self.signs.is_negative(face, low),
        );
        let mut side = Side {
            corners,
            parts,
            pieces: Vec::new(),
            chords: Vec::new(),
            tries: 0,
        };
        let at = (low, axis);
        let mut pieces = self.cut_parts(at, face, &side);
        while !is_sound(&pieces, axis) && side.tries < TRIES {
            side.tries += 1;
            for i in 0..side.corners.len() {
                side.corners[i].id = self.shaken(low, &side.corners[i], side.tries);
            }
            pieces = self.cut_parts(at, face, &side);
        }
        for (negative, ring) in pieces {
            let keys = ring.into_iter().map(|(key, place)| {
                if key.is_between() {
                    self.named(key, place);
                }
                key
            });
            side.pieces.push((negative, keys.collect()));
        }
        let chords = chords.iter().map(|c| self.crossed(at, face, &side, c));
        side.chords = chords.collect();
        Some(side)
    }

    fn point(&mut self, key: Key, place: Vec3, values: impl Fn(&Self) -> Vec<f64>) -> usize {
        if let Some(id) = self.fits.numbers.get(&key) {
            return *id;
        }
        let values = values(self);
        let id = self.add_point(place, values);
        self.fits.numbers.insert(key, id);
        id
    }

    /// The chords of a side as corners, from where its boundary enters the solid to where it leaves it.
    fn chords_of(
        &mut self,
        side: (usize, usize),
        ring: &[usize],
        corners: &mut Vec<Corner>,
        boundary: &[(usize, Option<bool>)],
    ) -> Vec<Vec<usize>> {
        let edges = self.edges;
        if let Some(chords) = edges.sides.get(&side) {
            let mut via = 0;
            let mut all = Vec::with_capacity(chords.len());
            for c in chords {
                let end = |corners: &[Corner], key: Key| corners.iter().position(|c| c.key == key);
                let mut path: Vec<usize> = end(corners, c.from).into_iter().collect();
                for &(key, place) in &c.via {
                    let id = self.point(key, place, |k| k.values_between(place, ring));
                    path.push(corners.len());
                    corners.push(Corner {
                        id,
                        code: 12 + via,
                        key,
                    });
                    via += 1;
                }
                path.extend(end(corners, c.to));
                all.push(path);
            }
            return all;
        }
        let ends: Vec<(usize, bool)> = boundary.iter().filter_map(|b| Some((b.0, b.1?))).collect();
        let next = |i: usize| vec![ends[i].0, ends[(i + 1) % ends.len()].0];
        (0..ends.len()).filter(|i| ends[*i].1).map(next).collect()
    }

    /// The triangles between the boundary of a side and its chords.
    fn parts(
        &self,
        axis: usize,
        corners: &[Corner],
        boundary: &[(usize, Option<bool>)],
        chords: &[Vec<usize>],
        solid: bool,
    ) -> Vec<Part> {
        let flat: Vec<[f64; 2]> = corners
            .iter()
            .map(|c| drop_axis(self.place_of(c.id), axis))
            .collect();
        let is_wall = |a: usize, b: usize| {
            chords.iter().any(|c| {
                c.windows(2)
                    .any(|w| (w[0], w[1]) == (a, b) || (w[1], w[0]) == (a, b))
            })
        };
        let mut parts = Vec::new();
        let mut add = |polygon: &[usize], inside: bool| {
            let places: Vec<[f64; 2]> = polygon.iter().map(|c| flat[*c]).collect();
            for t in super::rim::ears(&places) {
                let t = t.map(|i| polygon[i]);
                let mut sorted = t;
                sorted.sort_by_key(|c| corners[*c].code);
                let turns = (0..3).any(|k| sorted == [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]);
                let [a, b, c] = sorted;
                parts.push(Part {
                    corners: sorted,
                    left: turns,
                    inside,
                    walls: [is_wall(b, c), is_wall(a, c), is_wall(a, b)],
                });
            }
        };
        if chords.is_empty() {
            let all: Vec<usize> = boundary.iter().map(|b| b.0).collect();
            add(&all, solid);
            return parts;
        }
        // What is solid runs from where the boundary enters it along the boundary, and back along a chord; what is void
        // from where it leaves the solid, and on along a chord.
        for inside in [true, false] {
            let start = |c: &Vec<usize>| if inside { c[0] } else { c[c.len() - 1] };
            let mut open: Vec<usize> = chords.iter().map(start).collect();
            while let Some(first) = open.pop() {
                let mut polygon = Vec::new();
                let mut enter = first;
                loop {
                    let mut i = boundary.iter().position(|b| b.0 == enter).unwrap_or(0);
                    polygon.push(boundary[i].0);
                    let chord = loop {
                        i = (i + 1) % boundary.len();
                        let ends = |c: &&Vec<usize>| {
                            (if inside { c[c.len() - 1] } else { c[0] }) == boundary[i].0
                        };
                        if let Some(c) = chords.iter().find(ends) {
                            break c;
                        }
                        if polygon.len() > 32 {
                            break &chords[0];
                        }
                        polygon.push(boundary[i].0);
                    };
                    if inside {
                        polygon.extend(chord[1..].iter().rev());
                    } else {
                        polygon.extend(&chord[..chord.len() - 1]);
                    }
                    enter = start(chord);
                    if enter == first || polygon.len() > 32 {
                        break;
                    }
                    open.retain(|c| *c != enter);
                }
                add(&polygon, inside);
            }
        }
        parts
    }

    /// The triangles of a side cut by all faces but one: the faces that are negative, and names and places, counter-clockwise
    /// about the side's axis.
    fn cut_parts(&mut self, at: (usize, usize), face: usize, side: &Side) -> Vec<Polygon> {
        let mut pieces = Vec::with_capacity(side.parts.len());
        for part in &side.parts {
            let [a, b, c] = part.corners.map(|c| side.corners[c].id);
            let simplex = Simplex {
                nodes: [a, b, c, a],
                count: 3,
            };
            let (negative, mixed) = self.others_of(&simplex, face, part.inside);
            let mut ring = [1, 2, 4].map(|corners| Spot { corners, faces: 0 });
            if !part.left {
                ring.reverse();
            }
            for (negative, ring) in self.split_by(&simplex, negative, mixed, ring.to_vec()) {
                let ring = ring.iter().map(|s| {
                    let key = self.side_key(at, side, &part.corners, *s);
                    (key, self.side_place(key, side, &simplex, *s))
                });
                pieces.push((negative, ring.collect()));
            }
        }
        pieces
    }

    /// The place of a spot of a triangle in a side.
    fn side_place(&mut self, key: Key, side: &Side, simplex: &Simplex, spot: Spot) -> Vec3 {
        if key.is_between() || spot.faces == 0 {
            // The more often a side is divided, the farther spots keep from its points.
            return self.spot_place(simplex, spot, (1 + 2 * side.tries) as f64);
        }
        let v = self.vertex(key);
        self.places[v as usize]
    }

    /// The faces but one that are negative at all corners of a simplex, with that one if it is; and those that vary.
    pub(super) fn others_of(&self, simplex: &Simplex, face: usize, inside: bool) -> (u64, u64) {
        let (negative, mixed) = self.faces_of(simplex);
        let own = 1 << face;
        (negative & !own | if inside { own } else { 0 }, mixed & !own)
    }

    /// The name of a spot of a triangle in a side, or of a line in it.
    pub(super) fn side_key(
        &self,
        (low, axis): (usize, usize),
        side: &Side,
        corners: &[usize],
        spot: Spot,
    ) -> Key {
        let between = bits(u64::from(spot.corners)).map(|c| side.corners[corners[c]]);
        let mut between: Vec<Corner> = between.collect();
        if let [only] = between[..] {
            return only.key;
        }
        between.sort_by_key(|c| c.code);
        let line = between.iter().fold(15, |l, c| l & lines(c.code));
        let faces: Vec<usize> = bits(spot.faces).collect();
        if line != 0 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (du, dv) = (self.nodes.stride[u], self.nodes.stride[v]);
            let lines = [(low, u), (low + du, v), (low + dv, u), (low, v)];
            let (node, along) = lines[line.trailing_zeros() as usize];
            return Key::new(node, &[1 << along], &faces);
        }
        let codes: Vec<usize> = between.iter().map(|c| c.code).collect();
        Key::between(low, 7 & !(1 << axis), &codes, &faces)
    }

    /// A chord with the points where faces cross it.
    fn crossed(
        &mut self,
        at: (usize, usize),
        face: usize,
        side: &Side,
        chord: &[usize],
    ) -> Vec<Key> {
        let mut path = vec![side.corners[chord[0]].key];
        for w in chord.windows(2) {
            let mut ends = [w[0], w[1]];
            ends.sort_by_key(|c| side.corners[*c].code);
            let simplex = Simplex {
                nodes: [ends[0], ends[1], ends[0], ends[0]].map(|c| side.corners[c].id),
                count: 2,
            };
            let mut found = self.crossings(&simplex);
            found.retain(|c| c.1 != face);
            if ends[0] != w[0] {
                found.reverse();
            }
            path.extend(found.into_iter().map(|(_, f)| {
                let spot = Spot {
                    corners: 3,
                    faces: 1 << f,
                };
                self.side_key(at, side, &ends, spot)
            }));
            path.push(side.corners[w[1]].key);
        }
        path
    }
}

/// Whether all polygons of a side are what they are meant to be in single precision: then they do not overlap either, for
/// together they fill the side.
fn is_sound(pieces: &[Polygon], axis: usize) -> bool {
    pieces.iter().all(|(_, ring)| {
        let at = |i: usize| drop_axis(ring[i].1.map(|x| f64::from(x as f32)), axis);
        let way = orient2d(
            [0.0, 0.0],
            drop_axis(AXES[(axis + 1) % 3], axis),
            drop_axis(AXES[(axis + 2) % 3], axis),
        );
        (2..ring.len()).all(|i| orient2d(at(0), at(i - 1), at(i)) == way)
    })
}
