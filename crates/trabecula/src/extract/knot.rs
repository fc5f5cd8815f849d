//! Cells where faces of the solid meet: its edges and corners, thin walls, and patches that are not plain.
//!
//! Such a cell is divided into the six tetrahedra between its lowest and its highest corner. In a tetrahedron each face
//! is taken as the plane of its values at the four corners, so that the solid is a polyhedron, exactly: the tetrahedron
//! is cut by one plane after the other, and what lies between a solid and a void piece is surface. Faces of second
//! order smoothness are met to second order, and so are the curves and points where they meet, for nothing depends on
//! a node of the grid lying within a wedge. Neighbouring tetrahedra see the same planes on their common side. A plain
//! neighbour of a knotted cell gets a vertex inside and the cone from it over its rim, to which the points on the
//! common side's diagonal are added.
//!
//! A vertex is named by the simplex of nodes that it lies in and the faces that meet there, and its place is computed
//! from these alone; so it is the same from whichever cell, tile or thread.
//!
//! Source: planes in tetrahedra, as X. Du, Q. Zhou, N. Carr and T. Ju, Robust computation of implicit surface networks
//! for piecewise linear functions, ACM Trans. Graph. 41 (2022) 41; the division after H. Freudenthal (1942).

use std::collections::{HashMap, HashSet};
use std::hash::BuildHasherDefault;
use std::ops::Range;

use crate::math::{Vec3, add, cross, scale, sub};
use crate::measure::is_embedded;
use crate::mesh::Mesh;

use super::grid::{Grid, Local};
use super::islands::Spread;
use super::signs::{Signs, bits};
use super::table::{CASES, EDGES};
use super::tile::{Nodes, Numbers};

/// The name of a vertex in a block: the lowest node of its simplex, the steps (sets of axes, each within the next) to
/// the others, and the faces that meet in it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(super) struct Key(u64);

impl Key {
    const NODE: u32 = 18;
    const FACE: u32 = 7;
    /// The first two steps of the point inside a plain cell or its side: no simplex repeats a step.
    const CENTER: u64 = 0o11;

    pub fn new(node: usize, steps: &[usize], faces: &[usize]) -> Key {
        let steps = steps.iter().rev().fold(0, |w, s| w << 3 | *s as u64);
        let faces = faces
            .iter()
            .rev()
            .fold(0, |w, f| w << Key::FACE | (*f as u64 + 1));
        Key(node as u64 | (steps | faces << 9) << Key::NODE)
    }

    /// The point in the middle of the patch in a cell, or in a side of it, that spans some axes.
    fn center(node: usize, span: usize) -> Key {
        Key(node as u64 | (Key::CENTER * span as u64) << Key::NODE)
    }

    pub fn node(self) -> usize {
        (self.0 & ((1 << Key::NODE) - 1)) as usize
    }

    fn steps(self) -> u64 {
        self.0 >> Key::NODE & 0o777
    }

    pub fn faces(self) -> impl Iterator<Item = usize> {
        (0..3).filter_map(move |i| {
            let f = self.0 >> (Key::NODE + 9 + i * Key::FACE) & ((1 << Key::FACE) - 1);
            (f > 0).then(|| f as usize - 1)
        })
    }

    /// The axes along which the simplex extends, as bits.
    pub fn spans(self) -> u64 {
        let s = self.steps();
        (s | s >> 3 | s >> 6) & 7
    }

    /// Whether this is a point of a grid edge along an axis.
    pub fn is_along(self, axis: usize) -> bool {
        self.steps() == 1 << axis
    }

    /// The name among all tiles.
    pub fn global(self, node: u128, face: impl Fn(usize) -> usize) -> u128 {
        let faces = self
            .faces()
            .fold(0u128, |w, f| w << 16 | (face(f) as u128 + 1));
        node << 57 | u128::from(self.steps()) << 48 | faces
    }
}

/// What is not on plain cells' edges.
#[derive(Default)]
pub(super) struct Extra {
    names: HashMap<Key, u32, BuildHasherDefault<Spread>>,
    /// The names of the extra vertices.
    pub keys: Vec<Key>,
    /// Triangles, and whether they lie on the region's surface.
    pub triangles: Vec<([u32; 3], bool)>,
}

impl Extra {
    pub fn clear(&mut self) {
        self.names.clear();
        self.keys.clear();
        self.triangles.clear();
    }
}

/// The block as it is while extra vertices and triangles are added.
pub(super) struct Knots<'a> {
    pub nodes: &'a Nodes<'a>,
    pub grid: &'a Grid,
    pub local: &'a Local,
    pub samples: &'a [Vec<f32>],
    pub signs: &'a Signs,
    pub numbers: &'a [Numbers],
    pub places: &'a mut Vec<Vec3>,
    pub extra: &'a mut Extra,
    /// Nodes at which the faces are moved a little.
    pub moved: HashSet<usize>,
}

/// Vertices of a simplex of the grid, in rising order.
#[derive(Clone, Copy)]
struct Simplex {
    nodes: [usize; 4],
    count: usize,
}

/// A vertex while a simplex is cut: the corners of the side that it lies in, and the faces that meet there, as bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Spot {
    corners: u8,
    faces: u64,
}

/// A side of a piece, counter-clockwise seen from outside.
#[derive(Clone)]
struct Side {
    /// The face it lies on; none if it is part of the simplex's own side.
    face: Option<usize>,
    ring: Vec<Spot>,
}

/// A convex piece of a tetrahedron.
struct Piece {
    /// The faces that are negative in it.
    negative: u64,
    sides: Vec<Side>,
}

/// How far the faces are moved at the nodes of a cell that single precision cannot hold, in steps.
const SHIFT: f64 = 1.0 / 512.0;

/// The six ways from the lowest corner of a cell to the highest, as sets of axes; and whether the tetrahedron they make
/// is right-handed.
const PATHS: [([usize; 2], bool); 6] = [
    ([1, 3], true),
    ([2, 6], true),
    ([4, 5], true),
    ([1, 5], false),
    ([2, 3], false),
    ([4, 6], false),
];

impl Knots<'_> {
    fn offset(&self, step: usize) -> usize {
        (0..3)
            .filter(|a| step >> a & 1 == 1)
            .map(|a| self.nodes.stride[a])
            .sum()
    }

    /// The value of a face at a node, kept away from zero: a plane that passed through a node would leave needles.
    fn value(&self, face: usize, node: usize) -> f64 {
        let id = self.local.live[face];
        let scale = self.grid.faces[id].slope * self.grid.step;
        let (v, least) = (
            f64::from(self.samples[face][node]),
            self.grid.margin * scale,
        );
        let v = if self.moved.contains(&node) {
            v + SHIFT * scale * self.chance(id, node)
        } else {
            v
        };
        if self.signs.is_negative(face, node) {
            v.min(-least)
        } else {
            v.max(least)
        }
    }

    /// A number between −1 and 1 that depends on the face and the node alone.
    fn chance(&self, id: usize, node: usize) -> f64 {
        let mix = |h: u64, x: u64| (h ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        let bits = self.nodes.place(node).map(f64::to_bits);
        let h = mix(bits.into_iter().fold(id as u64 + 1, mix), 0x5851_f42d);
        (h >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn simplex(&self, node: usize, steps: &[usize]) -> Simplex {
        let mut nodes = [node; 4];
        for (n, s) in nodes[1..].iter_mut().zip(steps) {
            *n = node + self.offset(*s);
        }
        Simplex {
            nodes,
            count: 1 + steps.len(),
        }
    }

    fn key_simplex(&self, key: Key) -> Simplex {
        let all = [0, 3, 6].map(|shift| (key.steps() >> shift & 7) as usize);
        let count = all.iter().take_while(|s| **s != 0).count();
        self.simplex(key.node(), &all[..count])
    }

    /// The name of a spot of a simplex.
    fn key(&self, simplex: &Simplex, spot: Spot) -> Key {
        let mut nodes = (0..4)
            .filter(|c| spot.corners >> c & 1 == 1)
            .map(|c| simplex.nodes[c]);
        let Some(first) = nodes.next() else {
            return Key::new(0, &[], &[]);
        };
        let (mut steps, mut count) = ([0; 3], 0);
        let at = self.nodes.at(first);
        for n in nodes {
            let to = self.nodes.at(n);
            steps[count] = (0..3).filter(|a| to[*a] > at[*a]).map(|a| 1 << a).sum();
            count += 1;
        }
        let (mut faces, mut met) = ([0; 3], 0);
        for f in bits(spot.faces).take(3) {
            faces[met] = f;
            met += 1;
        }
        Key::new(first, &steps[..count], &faces[..met])
    }

    /// The shares of its corners in the point of a simplex where as many faces vanish as it has dimensions.
    fn shares(&self, simplex: &Simplex, faces: &[usize]) -> [f64; 4] {
        let v = |f: usize| {
            [0, 1, 2, 3].map(|c| {
                if c < simplex.count {
                    self.value(faces[f], simplex.nodes[c])
                } else {
                    0.0
                }
            })
        };
        let w = match faces.len() {
            0 => [1.0, 0.0, 0.0, 0.0],
            1 => {
                let [a, b, ..] = v(0);
                [b, -a, 0.0, 0.0]
            }
            2 => {
                let ([a0, a1, a2, _], [b0, b1, b2, _]) = (v(0), v(1));
                let [x, y, z] = cross([a0, a1, a2], [b0, b1, b2]);
                [x, y, z, 0.0]
            }
            _ => {
                let m = [v(0), v(1), v(2)];
                [0, 1, 2, 3].map(|skip| {
                    let c: Vec<usize> = (0..4).filter(|c| *c != skip).collect();
                    let row = |r: usize| [m[r][c[0]], m[r][c[1]], m[r][c[2]]];
                    let d = crate::math::dot(row(0), cross(row(1), row(2)));
                    if skip % 2 == 0 { d } else { -d }
                })
            }
        };
        let sum: f64 = w.iter().sum();
        w.map(|x| (x / sum).clamp(0.0, 1.0))
    }

    /// The value of a face at a spot.
    fn at(&self, simplex: &Simplex, spot: Spot, face: usize) -> f64 {
        let mut part = Simplex {
            nodes: [0; 4],
            count: 0,
        };
        for c in (0..4).filter(|c| spot.corners >> c & 1 == 1) {
            part.nodes[part.count] = simplex.nodes[c];
            part.count += 1;
        }
        let mut faces = [0; 3];
        let mut met = 0;
        for f in bits(spot.faces).take(3) {
            faces[met] = f;
            met += 1;
        }
        let shares = self.shares(&part, &faces[..met]);
        (0..part.count)
            .map(|c| shares[c] * self.value(face, part.nodes[c]))
            .sum()
    }

    /// The place of a vertex: a function of its name and the samples at its nodes alone.
    pub fn place(&self, key: Key) -> Vec3 {
        let simplex = self.key_simplex(key);
        let (mut faces, mut met) = ([0; 3], 0);
        for f in key.faces() {
            faces[met] = f;
            met += 1;
        }
        let shares = self.shares(&simplex, &faces[..met]);
        // Steps from the first corner: coordinates that all corners share come out exactly.
        let first = self.nodes.place(simplex.nodes[0]);
        (1..simplex.count).fold(first, |p, c| {
            add(
                p,
                scale(sub(self.nodes.place(simplex.nodes[c]), first), shares[c]),
            )
        })
    }

    /// Where faces cross the edge between two nodes, in order, as shares of it.
    fn crossings(&self, edge: &Simplex) -> Vec<(f64, usize)> {
        let mut found: Vec<(f64, usize)> = Vec::with_capacity(4);
        for f in 0..self.local.live.len() {
            let (a, b) = (self.value(f, edge.nodes[0]), self.value(f, edge.nodes[1]));
            if (a <= 0.0) != (b <= 0.0) {
                found.push((a / (a - b), f));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }

    /// The names of the points where faces cross the grid edge along `axis` from a node, in order.
    pub fn edge_points(&self, node: usize, axis: usize) -> Vec<(usize, Key)> {
        let edge = self.simplex(node, &[1 << axis]);
        let name = |(_, f)| (f, Key::new(node, &[1 << axis], &[f]));
        self.crossings(&edge).into_iter().map(name).collect()
    }

    /// The vertex of a name; made if it is new.
    pub fn vertex(&mut self, key: Key) -> u32 {
        if let Some(&n) = self.extra.names.get(&key) {
            return n;
        }
        let n = self
            .numbered(key)
            .unwrap_or_else(|| self.push(key, self.place(key)));
        self.extra.names.insert(key, n);
        n
    }

    /// The number of a vertex that a plain cell has too.
    fn numbered(&self, key: Key) -> Option<u32> {
        let steps = key.steps();
        if !(steps.is_power_of_two() && steps < 8) {
            return None;
        }
        let [i, j, k] = self.nodes.at(key.node());
        let row = k * self.nodes.shape[1] + j;
        self.numbers[key.faces().next()?].get(steps.trailing_zeros() as usize, row, i)
    }

    fn push(&mut self, key: Key, place: Vec3) -> u32 {
        self.places.push(place);
        self.extra.keys.push(key);
        self.places.len() as u32 - 1
    }

    /// Adds a convex polygon by its vertices' names.
    pub fn polygon(&mut self, ring: &[Key], cut: bool) {
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        for i in 2..names.len() {
            self.extra
                .triangles
                .push(([names[0], names[i - 1], names[i]], cut));
        }
    }

    /// Fills a plain cell beside a knotted one.
    pub fn seam(&mut self, cell: [usize; 3], face: usize) {
        let [i, j, k] = cell;
        let node = self.nodes.index(cell);
        let case = &CASES[self.signs.corners(face, i, j, k)];
        let n = case.ring.len();
        let mut ring: Vec<Key> = Vec::with_capacity(2 * n);
        let ends = |e: u8| {
            let (corner, axis) = EDGES[e as usize];
            (corner, corner | 1 << axis)
        };
        for at in 0..n {
            let (e, next) = (case.ring[at], case.ring[(at + 1) % n]);
            let ((a, b), (c, d)) = (ends(e), ends(next));
            ring.push(Key::new(node + self.offset(a), &[a ^ b], &[face]));
            // The side that both edges lie in, and the cell across it.
            let Some(axis) = (0..3).find(|x| [b, c, d].iter().all(|m| (m ^ a) >> x & 1 == 0))
            else {
                continue;
            };
            let upper = a >> axis & 1 == 1;
            let mut across = cell;
            if upper {
                across[axis] += 1;
            } else if across[axis] > 0 {
                across[axis] -= 1;
            } else {
                continue;
            }
            if !self.signs.is_knotted(across) {
                continue;
            }
            let key =
                |k: &Self, c: usize, d: usize| Key::new(node + k.offset(c & d), &[c ^ d], &[face]);
            let (from, to) = (key(self, a, b), key(self, c, d));
            ring.extend(self.trace(cell, axis, upper, face, from, to));
        }
        let cut = self.grid.faces[self.local.live[face]].cut;
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        if names.len() == n {
            // Nothing was added: the plain patch will do.
            let name = |e: u8| {
                case.ring
                    .iter()
                    .position(|r| *r == e)
                    .map_or(0, |at| names[at])
            };
            self.extra.triangles.extend(
                case.triangles[..case.count]
                    .iter()
                    .map(|t| (t.map(name), cut)),
            );
            return;
        }
        self.cone(Key::center(node, 7), &names, cut);
    }

    /// Adds the cone over a ring of vertices from the point in their middle.
    fn cone(&mut self, middle: Key, ring: &[u32], cut: bool) {
        let sum = ring
            .iter()
            .fold([0.0; 3], |s, v| add(s, self.places[*v as usize]));
        let middle = self.push(middle, scale(sum, 1.0 / ring.len() as f64));
        for at in 0..ring.len() {
            let (a, b) = (ring[at], ring[(at + 1) % ring.len()]);
            self.extra.triangles.push(([middle, a, b], cut));
        }
    }

    /// Adds a polygon in the side of a cell that spans two axes; it may have straight angles.
    pub fn flat_polygon(&mut self, low: usize, span: usize, ring: &[Key]) {
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        self.cone(Key::center(low, span), &names, true);
    }

    /// Which signs are solid in a cell.
    fn holds(&self, [i, j, k]: [usize; 3], negative: u64) -> bool {
        let live = self.local.live.len();
        let sign = |f: usize| match f.checked_sub(live) {
            Some(flat) => Signs::beside(self.local, flat, j, k) >> i,
            None => negative >> f,
        };
        self.local.tree.solid(&sign) & 1 == 1
    }

    /// The faces that are negative at all of the corners, and those that change sign between them.
    fn faces_of(&self, simplex: &Simplex) -> (u64, u64) {
        let (mut all, mut some) = (0, 0);
        for f in 0..self.local.live.len() {
            let count = simplex.nodes[..simplex.count]
                .iter()
                .filter(|n| self.signs.is_negative(f, **n))
                .count();
            all |= u64::from(count == simplex.count) << f;
            some |= u64::from(count > 0) << f;
        }
        (all, some & !all)
    }

    /// Cuts up a knotted cell.
    pub fn cell(&mut self, cell: [usize; 3]) {
        let node = self.nodes.index(cell);
        for ([one, two], right) in PATHS {
            let simplex = self.simplex(node, &[one, two, 7]);
            let (negative, mixed) = self.faces_of(&simplex);
            if mixed == 0 || self.holds(cell, negative) == self.holds(cell, negative | mixed) {
                continue;
            }
            for piece in self.cut(&simplex, right, negative, mixed) {
                if !self.holds(cell, piece.negative) {
                    continue;
                }
                for side in &piece.sides {
                    let Some(f) = side.face else { continue };
                    if self.holds(cell, piece.negative & !(1 << f)) {
                        continue;
                    }
                    let ring: Vec<Key> = side.ring.iter().map(|s| self.key(&simplex, *s)).collect();
                    let cut = self.grid.faces[self.local.live[f]].cut;
                    self.polygon(&ring, cut);
                }
            }
        }
        for flat in &self.local.flat {
            let layer = if flat.below { flat.at - 1 } else { flat.at };
            if cell[flat.axis] == layer {
                self.cut_side(cell, flat.axis, flat.below);
            }
        }
    }

    /// Cuts up all knotted cells of the block, and keeps what belongs to the tile.
    ///
    /// Exact arithmetic would end here: the pieces of a tetrahedron meet only where they should. But planes may pass so
    /// near to each other's common points that single precision mixes them up. Where that happens in a cell the faces
    /// are moved by chance at its nodes, by far less than the cell is wide, and the cells there are cut again.
    pub fn all(&mut self, own: &[Range<usize>; 3]) {
        let cells: Vec<[usize; 3]> = self.signs.knotted_cells().collect();
        let mine = |c: &[usize; 3]| (0..3).all(|a| own[a].contains(&c[a]));
        // Not moved before all have been looked at: what is found in a cell must not depend on the cells before it, which
        // a neighbouring tile may not see.
        let mut moved = HashSet::new();
        for c in &cells {
            let first = self.extra.triangles.len();
            self.cell(*c);
            if self.muddled(first) {
                let node = self.nodes.index(*c);
                let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| node + self.offset(corner));
                moved.extend(corners);
            }
            if !mine(c) {
                self.extra.triangles.truncate(first);
            }
        }
        self.moved = moved;
        if !self.moved.is_empty() {
            self.places
                .truncate(self.places.len() - self.extra.keys.len());
            self.extra.clear();
            for c in cells.iter().filter(|c| mine(c)) {
                self.cell(*c);
            }
        }
    }

    /// Whether the triangles from the `first` on touch where they should not, once rounded to single precision.
    fn muddled(&self, first: usize) -> bool {
        let triangles = &self.extra.triangles[first..];
        let mut mesh = Mesh::default();
        let mut names: Vec<u32> = Vec::with_capacity(32);
        for (t, _) in triangles {
            mesh.triangles.push(t.map(|v| {
                let at = names.iter().position(|n| *n == v).unwrap_or_else(|| {
                    names.push(v);
                    mesh.vertices
                        .push(self.places[v as usize].map(|x| f64::from(x as f32)));
                    names.len() - 1
                });
                at as u32
            }));
        }
        let same = |i: usize| mesh.vertices[..i].contains(&mesh.vertices[i]);
        (1..names.len()).any(same) || !is_embedded(&mesh)
    }

    /// The side of a cell along an axis, divided by the faces that cross it: the pieces of its two triangles with the
    /// faces that are negative there, counter-clockwise seen from outside the cell.
    fn side_pieces(&self, cell: [usize; 3], axis: usize, upper: bool) -> Vec<(u64, Vec<Key>)> {
        let node = self.nodes.index(cell) + self.offset(usize::from(upper) << axis);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let mut all = Vec::new();
        for (step, right) in [(u, true), (v, false)] {
            let simplex = self.simplex(node, &[step, u | v]);
            let (negative, mixed) = self.faces_of(&simplex);
            let mut ring: Vec<Spot> = (0..3)
                .map(|c| Spot {
                    corners: 1 << c,
                    faces: 0,
                })
                .collect();
            if right != upper {
                ring.reverse();
            }
            let mut pieces = vec![(negative, ring)];
            for f in bits(mixed) {
                let mut next = Vec::with_capacity(2 * pieces.len());
                for (negative, ring) in pieces {
                    let (inside, outside, _) = self.split(&simplex, &ring, f);
                    if inside.len() > 2 {
                        next.push((negative | 1 << f, inside));
                    }
                    if outside.len() > 2 {
                        next.push((negative, outside));
                    }
                }
                pieces = next;
            }
            all.extend(pieces.into_iter().map(|(negative, ring)| {
                (
                    negative,
                    ring.iter().map(|s| self.key(&simplex, *s)).collect(),
                )
            }));
        }
        all
    }

    /// The cap of a knotted cell on its lower or upper side along an axis.
    fn cut_side(&mut self, cell: [usize; 3], axis: usize, upper: bool) {
        for (negative, ring) in self.side_pieces(cell, axis, upper) {
            if self.holds(cell, negative) {
                self.polygon(&ring, true);
            }
        }
    }

    /// The points between two others on the line in which a face crosses the side of a cell.
    fn trace(
        &self,
        cell: [usize; 3],
        axis: usize,
        upper: bool,
        face: usize,
        from: Key,
        to: Key,
    ) -> Vec<Key> {
        let mut steps: Vec<(Key, Key)> = Vec::new();
        let on = |k: &Key| k.faces().any(|f| f == face);
        for (negative, ring) in self.side_pieces(cell, axis, upper) {
            if negative >> face & 1 == 1 {
                let edges = (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]));
                steps.extend(edges.filter(|(a, b)| on(a) && on(b)));
            }
        }
        let mut path = Vec::new();
        let (mut before, mut at) = (from, from);
        while path.len() <= steps.len() {
            let next = steps.iter().find_map(|&(a, b)| match at {
                _ if a == at && b != before => Some(b),
                _ if b == at && a != before => Some(a),
                _ => None,
            });
            match next {
                Some(n) if n != to => {
                    path.push(n);
                    (before, at) = (at, n);
                }
                _ => break,
            }
        }
        path
    }

    /// The pieces of a tetrahedron between the planes of the mixed faces.
    fn cut(&self, simplex: &Simplex, right: bool, negative: u64, mixed: u64) -> Vec<Piece> {
        let sides = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].map(|mut c: [u8; 3]| {
            if !right {
                c.swap(1, 2);
            }
            Side {
                face: None,
                ring: c
                    .map(|c| Spot {
                        corners: 1 << c,
                        faces: 0,
                    })
                    .to_vec(),
            }
        });
        let mut pieces = vec![Piece {
            negative,
            sides: sides.to_vec(),
        }];
        for f in bits(mixed) {
            let mut next = Vec::with_capacity(2 * pieces.len());
            for piece in pieces {
                let (mut inside, mut outside) = (Vec::new(), Vec::new());
                // The new edges, from end to end as the inside's new side has them.
                let mut edges: Vec<(Spot, Spot)> = Vec::new();
                for side in &piece.sides {
                    let (a, b, edge) = self.split(simplex, &side.ring, f);
                    for (part, to) in [(a, &mut inside), (b, &mut outside)] {
                        if part.len() > 2 {
                            to.push(Side {
                                face: side.face,
                                ring: part,
                            });
                        }
                    }
                    edges.extend(edge);
                }
                let mut ring = Vec::with_capacity(edges.len());
                if let Some(&(start, mut at)) = edges.first() {
                    ring.push(start);
                    while at != start && ring.len() <= edges.len() {
                        ring.push(at);
                        at = edges.iter().find(|e| e.0 == at).map_or(start, |e| e.1);
                    }
                }
                if !inside.is_empty() {
                    if ring.len() > 2 {
                        inside.push(Side {
                            face: Some(f),
                            ring: ring.clone(),
                        });
                    }
                    next.push(Piece {
                        negative: piece.negative | 1 << f,
                        sides: inside,
                    });
                }
                if !outside.is_empty() {
                    if ring.len() > 2 {
                        ring.reverse();
                        outside.push(Side {
                            face: Some(f),
                            ring,
                        });
                    }
                    next.push(Piece {
                        negative: piece.negative,
                        sides: outside,
                    });
                }
            }
            pieces = next;
        }
        pieces
    }

    /// The parts of a polygon where a face is negative and positive, and the edge between them, as the new side of
    /// the negative part runs along it.
    #[allow(clippy::type_complexity)]
    fn split(
        &self,
        simplex: &Simplex,
        ring: &[Spot],
        f: usize,
    ) -> (Vec<Spot>, Vec<Spot>, Option<(Spot, Spot)>) {
        let signs: Vec<bool> = ring
            .iter()
            .map(|s| self.at(simplex, *s, f) <= 0.0)
            .collect();
        let (mut inside, mut outside) = (Vec::with_capacity(6), Vec::with_capacity(6));
        let (mut leave, mut enter) = (None, None);
        for i in 0..ring.len() {
            let next = (i + 1) % ring.len();
            (if signs[i] { &mut inside } else { &mut outside }).push(ring[i]);
            if signs[i] != signs[next] {
                let new = Spot {
                    corners: ring[i].corners | ring[next].corners,
                    faces: (ring[i].faces & ring[next].faces) | 1 << f,
                };
                inside.push(new);
                outside.push(new);
                *(if signs[i] { &mut leave } else { &mut enter }) = Some(new);
            }
        }
        (inside, outside, enter.zip(leave))
    }
}
