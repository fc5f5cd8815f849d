//! Simplices of the grid, cut by the planes of the faces.

use super::Knots;
use crate::extract::key::Key;
use crate::extract::signs::bits;
use geometry::math::{Vec3, add, cross, scale, sub};

/// Vertices of a simplex of the grid, in rising order; or of one of a fitted cell, which may be points as well.
#[derive(Clone, Copy)]
pub(in crate::extract) struct Simplex {
    pub nodes: [usize; 4],
    pub count: usize,
}

/// A vertex while a simplex is cut: the corners of the side that it lies in, and the faces that meet there, as bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::extract) struct Spot {
    pub corners: u8,
    pub faces: u64,
}

/// A side of a piece, counter-clockwise seen from outside.
#[derive(Clone)]
pub(in crate::extract) struct Side {
    /// The face it lies on; none if it is part of the simplex's own side.
    pub face: Option<usize>,
    pub ring: Vec<Spot>,
}

/// A convex piece of a tetrahedron.
pub(in crate::extract) struct Piece {
    /// The faces that are negative in it.
    pub negative: u64,
    pub sides: Vec<Side>,
}

/// How far the faces are moved at the nodes of a cell that single precision cannot hold, in steps.
const SHIFT: f64 = 1.0 / 512.0;

/// A polygon cut in two.
pub(super) struct Halves {
    /// Where the face is negative.
    pub(super) inside: Vec<Spot>,
    pub(super) outside: Vec<Spot>,
    /// The edge between them, as the new side of the inside runs along it.
    edge: Option<(Spot, Spot)>,
}

/// What a face makes of a polygon.
pub(super) enum Parted {
    /// It is negative everywhere.
    Inside(Vec<Spot>),
    /// Nowhere.
    Outside(Vec<Spot>),
    Both(Halves),
}

impl Simplex {
    /// The corners of a tetrahedron's sides, each across from a corner, counter-clockwise seen from outside; `right`: whether
    /// it is right-handed.
    pub fn sides(right: bool) -> [[Spot; 3]; 4] {
        let sides = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        sides.map(|mut c: [u8; 3]| {
            if !right {
                c.swap(1, 2);
            }
            c.map(|c| Spot { corners: 1 << c, faces: 0 })
        })
    }
}

impl Knots<'_> {
    pub(in crate::extract) fn offset(&self, step: usize) -> usize {
        (0..3).filter(|a| step >> a & 1 == 1).map(|a| self.nodes.stride[a]).sum()
    }

    /// The value of a face at a node, kept away from zero: a plane that passed through a node would leave needles.
    pub(in crate::extract) fn value(&self, face: usize, node: usize) -> f64 {
        if let Some(point) = node.checked_sub(self.nodes.count()) {
            return self.fits.value(point, face);
        }
        let id = self.local.live[face];
        let scale = self.grid.faces[id].lipschitz * self.grid.step;
        let (v, least) = (f64::from(self.samples[face][node]), self.grid.margin * scale);
        let v = if self.moved.contains(&node) { v + SHIFT * scale * self.chance(id, node) } else { v };
        if self.signs.is_negative(face, node) { v.min(-least) } else { v.max(least) }
    }

    /// A number between −1 and 1 that depends on the face and the node alone.
    pub(in crate::extract) fn chance(&self, id: usize, node: usize) -> f64 {
        let mix = |h: u64, x: u64| (h ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        let bits = self.nodes.place(node).map(f64::to_bits);
        let h = mix(bits.into_iter().fold(id as u64 + 1, mix), 0x5851_f42d);
        (h >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub(in crate::extract) fn simplex(&self, node: usize, steps: &[usize]) -> Simplex {
        let mut nodes = [node; 4];
        for (n, s) in nodes[1..].iter_mut().zip(steps) {
            *n = node + self.offset(*s);
        }
        Simplex { nodes, count: 1 + steps.len() }
    }

    pub(super) fn key_simplex(&self, key: Key) -> Simplex {
        let all = [0, 3, 6].map(|shift| (key.steps() >> shift & 7) as usize);
        let count = all.iter().take_while(|s| **s != 0).count();
        self.simplex(key.node(), &all[..count])
    }

    /// The name of a spot of a simplex.
    pub(in crate::extract) fn key(&self, simplex: &Simplex, spot: Spot) -> Key {
        let mut nodes = (0..4).filter(|c| spot.corners >> c & 1 == 1).map(|c| simplex.nodes[c]);
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
    pub(super) fn shares(&self, simplex: &Simplex, faces: &[usize]) -> [f64; 4] {
        let v = |f: usize| {
            [0, 1, 2, 3].map(|c| if c < simplex.count { self.value(faces[f], simplex.nodes[c]) } else { 0.0 })
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
                    let d = geometry::math::dot(row(0), cross(row(1), row(2)));
                    if skip % 2 == 0 { d } else { -d }
                })
            }
        };
        let sum: f64 = w.iter().sum();
        w.map(|x| (x / sum).clamp(0.0, 1.0))
    }

    /// The side of a simplex that a spot lies in, and the faces that meet in it.
    fn part(&self, simplex: &Simplex, spot: Spot) -> (Simplex, [usize; 3], usize) {
        let mut part = Simplex { nodes: [simplex.nodes[0]; 4], count: 0 };
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
        (part, faces, met)
    }

    /// Whether a face is negative at a spot.
    fn is_negative_at(&self, simplex: &Simplex, spot: Spot, face: usize) -> bool {
        let (part, faces, met) = self.part(simplex, spot);
        if part.count == 2
            && let Some(is) = self.beside_on_line([part.nodes[0], part.nodes[1]], faces[0], face)
        {
            return is;
        }
        let shares = self.shares(&part, &faces[..met]);
        let value = (0..part.count).map(|c| shares[c] * self.value(face, part.nodes[c]));
        value.sum::<f64>() <= 0.0
    }

    /// The place of a node or a point.
    pub fn place_of(&self, node: usize) -> Vec3 {
        match node.checked_sub(self.nodes.count()) {
            Some(point) => self.fits.place(point),
            None => self.nodes.place(node),
        }
    }

    /// The place of a spot of a simplex. Points may be near to each other: a spot between two keeps away from both,
    /// by `apart` times what crossings keep from nodes.
    pub fn spot_place(&self, simplex: &Simplex, spot: Spot, apart: f64) -> Vec3 {
        let (part, faces, met) = self.part(simplex, spot);
        let first = self.place_of(part.nodes[0]);
        if part.count == 1 {
            return first;
        }
        let mut shares = self.shares(&part, &faces[..met]);
        let mut places = [first; 4];
        for c in 1..part.count {
            places[c] = self.place_of(part.nodes[c]);
        }
        if part.count == 2 {
            let length = sub(places[1], places[0]).map(f64::abs).into_iter().fold(0.0, f64::max);
            let least = (apart * self.grid.margin * self.grid.step / length).min(1.0 / 3.0);
            shares[1] = shares[1].clamp(least, 1.0 - least);
        }
        (1..part.count).fold(places[0], |p, c| add(p, scale(sub(places[c], places[0]), shares[c])))
    }

    /// The place of a vertex: a function of its name and the samples at its nodes alone.
    pub fn place(&self, key: Key) -> Vec3 {
        if let Some(place) = self.spaced(key) {
            return place;
        }
        let simplex = self.key_simplex(key);
        let (mut faces, mut met) = ([0; 3], 0);
        for f in key.faces() {
            faces[met] = f;
            met += 1;
        }
        let shares = self.shares(&simplex, &faces[..met]);
        // Steps from the first corner: coordinates that all corners share come out exactly.
        let first = self.nodes.place(simplex.nodes[0]);
        (1..simplex.count).fold(first, |p, c| add(p, scale(sub(self.nodes.place(simplex.nodes[c]), first), shares[c])))
    }

    /// Where faces cross the edge between two nodes, in order, as shares of it.
    pub(in crate::extract) fn crossings(&self, edge: &Simplex) -> Vec<(f64, usize)> {
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

    fn is_negative(&self, face: usize, node: usize) -> bool {
        match node.checked_sub(self.nodes.count()) {
            Some(point) => self.fits.value(point, face) <= 0.0,
            None => self.signs.is_negative(face, node),
        }
    }

    /// The faces that are negative at all of the corners, and those that change sign between them.
    pub(in crate::extract) fn faces_of(&self, simplex: &Simplex) -> (u64, u64) {
        let (mut all, mut some) = (0, 0);
        for f in 0..self.local.live.len() {
            let count = simplex.nodes[..simplex.count].iter().filter(|n| self.is_negative(f, **n)).count();
            all |= u64::from(count == simplex.count) << f;
            some |= u64::from(count > 0) << f;
        }
        (all, some & !all)
    }

    /// The pieces of a tetrahedron between the planes of the mixed faces. `walls` are faces that its own sides lie on,
    /// each across from a corner.
    pub(in crate::extract) fn cut(
        &self,
        simplex: &Simplex,
        right: bool,
        (negative, mixed): (u64, u64),
        walls: [Option<usize>; 4],
    ) -> Vec<Piece> {
        let sides = Simplex::sides(right).into_iter().zip(walls);
        let sides = sides.map(|(ring, face)| Side { face, ring: ring.to_vec() });
        let mut pieces = vec![Piece { negative, sides: sides.collect() }];
        for f in bits(mixed) {
            let mut next = Vec::with_capacity(2 * pieces.len());
            for piece in pieces {
                let room = piece.sides.len() + 1;
                let (mut inside, mut outside) = (Vec::with_capacity(room), Vec::with_capacity(room));
                // The new edges, from end to end as the inside's new side has them.
                let mut edges: Vec<(Spot, Spot)> = Vec::new();
                for side in piece.sides {
                    let halves = match self.split(simplex, side.ring, f) {
                        Parted::Inside(ring) => {
                            inside.push(Side { ring, ..side });
                            continue;
                        }
                        Parted::Outside(ring) => {
                            outside.push(Side { ring, ..side });
                            continue;
                        }
                        Parted::Both(halves) => halves,
                    };
                    for (part, to) in [(halves.inside, &mut inside), (halves.outside, &mut outside)] {
                        if part.len() > 2 {
                            to.push(Side { face: side.face, ring: part });
                        }
                    }
                    edges.extend(halves.edge);
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
                        inside.push(Side { face: Some(f), ring: ring.clone() });
                    }
                    next.push(Piece { negative: piece.negative | 1 << f, sides: inside });
                }
                if !outside.is_empty() {
                    if ring.len() > 2 {
                        ring.reverse();
                        outside.push(Side { face: Some(f), ring });
                    }
                    next.push(Piece { negative: piece.negative, sides: outside });
                }
            }
            pieces = next;
        }
        pieces
    }

    /// The parts of a polygon between faces, with those that are negative there.
    pub(in crate::extract) fn split_by(
        &self,
        simplex: &Simplex,
        negative: u64,
        mixed: u64,
        ring: Vec<Spot>,
    ) -> Vec<(u64, Vec<Spot>)> {
        let mut pieces = vec![(negative, ring)];
        for f in bits(mixed) {
            let mut next = Vec::with_capacity(2 * pieces.len());
            for (negative, ring) in pieces {
                match self.split(simplex, ring, f) {
                    Parted::Inside(ring) => next.push((negative | 1 << f, ring)),
                    Parted::Outside(ring) => next.push((negative, ring)),
                    Parted::Both(halves) => {
                        if halves.inside.len() > 2 {
                            next.push((negative | 1 << f, halves.inside));
                        }
                        if halves.outside.len() > 2 {
                            next.push((negative, halves.outside));
                        }
                    }
                }
            }
            pieces = next;
        }
        pieces
    }

    /// The parts of a polygon where a face is negative and positive, and the edge between them, as the new side of
    /// the negative part runs along it.
    pub(super) fn split(&self, simplex: &Simplex, ring: Vec<Spot>, f: usize) -> Parted {
        // A side has three corners, and one more for each of at most 64 faces.
        let signs = (0..).zip(&ring).fold(0u128, |w, (i, s)| w | u128::from(self.is_negative_at(simplex, *s, f)) << i);
        if signs == 0 {
            return Parted::Outside(ring);
        }
        if signs.count_ones() as usize == ring.len() {
            return Parted::Inside(ring);
        }
        let is_inside = |i: usize| signs >> i & 1 == 1;
        let room = ring.len() + 1;
        let (mut inside, mut outside) = (Vec::with_capacity(room), Vec::with_capacity(room));
        let (mut leave, mut enter) = (None, None);
        for i in 0..ring.len() {
            let next = (i + 1) % ring.len();
            (if is_inside(i) { &mut inside } else { &mut outside }).push(ring[i]);
            if is_inside(i) != is_inside(next) {
                let new = Spot {
                    corners: ring[i].corners | ring[next].corners,
                    faces: (ring[i].faces & ring[next].faces) | 1 << f,
                };
                inside.push(new);
                outside.push(new);
                *(if is_inside(i) { &mut leave } else { &mut enter }) = Some(new);
            }
        }
        Parted::Both(Halves { inside, outside, edge: enter.zip(leave) })
    }
}
