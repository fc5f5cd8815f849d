//! The sides of cells that are fitted to a face: cut along its chords and into triangles.
//!
//! What becomes of a side follows from the side alone, so that the cells beside it, in whichever tiles, agree. Where single
//! precision muddles it, it is divided again into other triangles, with other values at its points, by chance, but of the same
//! signs: then its grid edges stay what they are.

use std::ops::Range;
use std::rc::Rc;

use super::polygon::triangles;
use crate::extract::key::Key;
use crate::extract::knot::{Knots, Simplex, Spot};
use crate::extract::signs::bits;
use geometry::math::Vec3;
use geometry::mesh::exact::{drop_axis, orient2d};

/// A side of a cell, cut along its chords and into triangles.
pub(in crate::extract) struct Side {
    /// Its nodes and the points in it: number behind that of the nodes, number in the side, and name.
    pub(super) corners: Vec<Corner>,
    pub(super) parts: Vec<Part>,
    /// The parts cut by all other faces, as the sides of a knotted cell are: the names of all their corners, and for each
    /// the faces that are negative in it and where its names end.
    names: Vec<Key>,
    ends: Vec<(u64, usize)>,
    /// The chords with the points where other faces cross them.
    pub chords: Vec<Vec<Key>>,
    /// How often it was divided anew.
    pub(super) tries: usize,
}

#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub id: usize,
    /// Nodes from 0 on, points of the four grid edges from 4 on in pairs, corners of chords from 12 on.
    pub code: usize,
    pub key: Key,
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

impl Side {
    /// The parts cut by all other faces: those that are negative, and the corners counter-clockwise about the side's axis.
    pub fn pieces(&self) -> impl Iterator<Item = (u64, &[Key])> {
        let starts = [0].into_iter().chain(self.ends.iter().map(|e| e.1));
        let each = starts.zip(&self.ends);
        each.map(|(start, (negative, end))| (*negative, &self.names[start..*end]))
    }
}

const AXES: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The faces that are negative in a polygon, and the names and places of its corners.
type Polygon = (u64, Vec<(Key, Vec3)>);

/// How often a side is divided anew if single precision muddles it.
const TRIES: usize = 8;

/// The grid edges of a side that a corner lies on, as bits.
fn lines(code: usize) -> u8 {
    match code {
        0..4 => 1 << code | 1 << ((code + 3) % 4),
        4..12 => 1 << ((code - 4) / 2),
        _ => 0,
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
            corners.push(Corner { id: ring[i], code: i, key: Key::new(ring[i], &[], &[]) });
            let (node, along) = (ring[i].min(ring[(i + 1) % 4]), if i % 2 == 0 { u } else { v });
            let mut points: Vec<_> = self.points_of(node, along, face).into_iter().enumerate().collect();
            if i > 1 {
                points.reverse();
            }
            for (n, (key, place)) in points {
                solid = !solid;
                boundary.push((corners.len(), Some(solid)));
                let id = self.point(key, place, |k| {
                    let share = k.share_of(node, along, place);
                    let faces = 0..k.local.live.len();
                    faces.map(|f| k.value_along(f, node, along, share)).collect()
                });
                let code = 4 + 2 * i + n;
                corners.push(Corner { id, code, key });
            }
        }
        if boundary.len() == 4 {
            return None;
        }
        let chords = self.chords_of((low, axis), &ring, &mut corners, &boundary);
        let solid = self.signs.is_negative(face, low);
        let mut side = Side {
            parts: self.parts(axis, &corners, &boundary, &chords, (solid, 0)),
            corners,
            names: Vec::new(),
            ends: Vec::new(),
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
            let again = (solid, side.tries);
            side.parts = self.parts(axis, &side.corners, &boundary, &chords, again);
            pieces = self.cut_parts(at, face, &side);
        }
        side.ends.reserve(pieces.len());
        side.names.reserve(pieces.iter().map(|p| p.1.len()).sum());
        for (negative, ring) in pieces {
            for (key, place) in ring {
                if key.is_between() {
                    self.named(key, place);
                }
                side.names.push(key);
            }
            side.ends.push((negative, side.names.len()));
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
        let line = (0..3).find(|a| key.is_along(*a)).map(|a| (key.node(), a));
        let id = self.add_point(place, line, values);
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
                    corners.push(Corner { id, code: 12 + via, key });
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

    /// The triangles between the boundary of a side and its chords; other ones each time it is divided anew, where there are
    /// others. `solid`: whether the face is negative at the side's first node.
    fn parts(
        &self,
        axis: usize,
        corners: &[Corner],
        boundary: &[(usize, Option<bool>)],
        chords: &[Vec<usize>],
        (solid, tries): (bool, usize),
    ) -> Vec<Part> {
        let flat: Vec<[f64; 2]> = corners.iter().map(|c| drop_axis(self.place_of(c.id), axis)).collect();
        let is_wall = |a: usize, b: usize| {
            chords.iter().any(|c| c.windows(2).any(|w| (w[0], w[1]) == (a, b) || (w[1], w[0]) == (a, b)))
        };
        let mut parts = Vec::new();
        let mut add = |polygon: &[usize], inside: bool| {
            let places: Vec<[f64; 2]> = polygon.iter().map(|c| flat[*c]).collect();
            for t in triangles(&places, tries) {
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
                        let ends = |c: &&Vec<usize>| (if inside { c[c.len() - 1] } else { c[0] }) == boundary[i].0;
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
            let simplex = Simplex { nodes: [a, b, c, a], count: 3 };
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
    pub(super) fn side_key(&self, (low, axis): (usize, usize), side: &Side, corners: &[usize], spot: Spot) -> Key {
        let (mut all, mut count) = ([side.corners[0]; 3], 0);
        for c in bits(u64::from(spot.corners)) {
            all[count] = side.corners[corners[c]];
            count += 1;
        }
        let between = &mut all[..count];
        if let [only] = between {
            return only.key;
        }
        between.sort_by_key(|c| c.code);
        let line = between.iter().fold(15, |l, c| l & lines(c.code));
        let (mut faces, mut met) = ([0; 3], 0);
        for f in bits(spot.faces).take(3) {
            faces[met] = f;
            met += 1;
        }
        let faces = &faces[..met];
        if line != 0 {
            let lines = super::lines_of(self.nodes, (low, axis));
            let (node, along) = lines[line.trailing_zeros() as usize];
            return Key::new(node, &[1 << along], faces);
        }
        let codes = all.map(|c| c.code);
        Key::between(low, 7 & !(1 << axis), &codes[..count], faces)
    }

    /// A chord with the points where faces cross it.
    fn crossed(&mut self, at: (usize, usize), face: usize, side: &Side, chord: &[usize]) -> Vec<Key> {
        let mut path = vec![side.corners[chord[0]].key];
        for w in chord.windows(2) {
            let mut ends = [w[0], w[1]];
            ends.sort_by_key(|c| side.corners[*c].code);
            let simplex = Simplex { nodes: [ends[0], ends[1], ends[0], ends[0]].map(|c| side.corners[c].id), count: 2 };
            let mut found = self.crossings(&simplex);
            found.retain(|c| c.1 != face);
            if ends[0] != w[0] {
                found.reverse();
            }
            path.extend(found.into_iter().map(|(_, f)| {
                let spot = Spot { corners: 3, faces: 1 << f };
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
    let way = orient2d([0.0, 0.0], drop_axis(AXES[(axis + 1) % 3], axis), drop_axis(AXES[(axis + 2) % 3], axis));
    pieces.iter().all(|(_, ring)| {
        let at = |i: usize| drop_axis(ring[i].1.map(|x| f64::from(x as f32)), axis);
        (2..ring.len()).all(|i| orient2d(at(0), at(i - 1), at(i)) == way)
    })
}
