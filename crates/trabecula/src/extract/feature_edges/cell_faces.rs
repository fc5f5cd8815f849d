//! Faces of fitted cells, cut along contours and into triangles.
//!
//! Invariant: the division of a face depends on the face alone, so that both adjacent cells, in whichever tiles, agree. Where
//! it would self-intersect in single precision it is divided again, into other triangles with pseudo-random values of the same
//! signs at its points: its grid edges stay as they are.

use std::ops::Range;

use super::divided_faces::{CellFace, FaceScratch, FaceTriangle, PolygonCorner, PolygonList};
use super::polygon_triangulation::triangles;
use crate::extract::feature_cells::{CutVertex, FeatureCells, Simplex};
use crate::extract::sign_words::bits;
use crate::extract::vertex_id::VertexId;
use geometry::math::{Vec3, add, cross, scale, sub};
use geometry::mesh::exact::drop_axis;

/// Most attempts to divide a face that self-intersects in single precision.
const TRIES: usize = 8;
/// Least share of a segment at which another one intersects it, where rounding says that it does so beyond its end.
const INSIDE: f64 = 1e-3;

/// The grid edges of a face on which a corner lies, as bits.
fn lines(code: usize) -> u8 {
    match code {
        0..4 => 1 << code | 1 << ((code + 3) % 4),
        4..12 => 1 << ((code - 4) / 2),
        _ => 0,
    }
}

/// Where two segments in a plane normal to an axis intersect: a point inside the first one.
fn intersection([p, q]: [Vec3; 2], [r, s]: [Vec3; 2], axis: usize) -> Vec3 {
    let across = |a: Vec3, b: Vec3| cross(a, b)[axis];
    let (along, other) = (sub(q, p), sub(s, r));
    let share = across(sub(r, p), other) / across(along, other);
    let share = if share.is_nan() { 0.5 } else { share.clamp(INSIDE, 1.0 - INSIDE) };
    add(p, scale(along, share))
}

impl FeatureCells<'_> {
    /// Divides the faces of fitted cells in and around the tile's own cells.
    pub fn divide_faces(&mut self, own: &[Range<usize>; 3]) {
        let ny = self.nodes.shape[1];
        let mine = |c: &[usize; 3]| (0..3).all(|a| own[a].contains(&c[a]));
        for row in 0..self.edges.claims.fitted.len() {
            for i in bits(self.edges.claims.fitted[row]) {
                let cell = [i, row % ny, row / ny];
                let surface = self.edges.claims.surface[&self.nodes.index(cell)];
                for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
                    let mut across = cell;
                    across[axis] = across[axis].wrapping_add(if upper { 1 } else { usize::MAX });
                    if !mine(&cell) && !mine(&across) {
                        continue;
                    }
                    let low = self.nodes.index(cell) + self.offset(usize::from(upper) << axis);
                    if self.divided_faces.face((low, axis)).is_none() {
                        let mut face = self.divided_faces.take_next();
                        let is_crossed = self.divide_face((low, axis), surface, &mut face);
                        self.divided_faces.put_next(face, is_crossed.then_some((low, axis)));
                    }
                }
            }
        }
    }

    /// Divides a face; false if the surface does not cross it.
    fn divide_face(&mut self, (low, axis): (usize, usize), surface: usize, face: &mut CellFace) -> bool {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (du, dv) = (self.nodes.stride[u], self.nodes.stride[v]);
        let ring = [low, low + du, low + du + dv, low + dv];
        let mut corners = std::mem::take(&mut face.corners);
        corners.clear();
        // Counter-clockwise: nodes, and crossings with whether the boundary enters the solid there.
        let mut boundary: Vec<(usize, Option<bool>)> = Vec::with_capacity(8);
        let mut solid = self.signs.is_negative(surface, low);
        for i in 0..4 {
            boundary.push((corners.len(), None));
            corners.push(PolygonCorner { id: ring[i], code: i, key: VertexId::new(ring[i], &[], &[]) });
            let (node, along) = (ring[i].min(ring[(i + 1) % 4]), if i % 2 == 0 { u } else { v });
            let points = self.points_of(node, along, surface);
            let order = if i > 1 { [1, 0] } else { [0, 1] };
            for (n, (key, position)) in order.into_iter().filter_map(|n| Some((n, points[n]?))) {
                solid = !solid;
                boundary.push((corners.len(), Some(solid)));
                let share = self.share_of(node, along, position);
                let id = self.point(key, position, |k, f| k.value_along(f, node, along, share));
                let code = 4 + 2 * i + n;
                corners.push(PolygonCorner { id, code, key });
            }
        }
        if boundary.len() == 4 {
            face.corners = corners;
            return false;
        }
        let contours = self.contours_of((low, axis), &ring, &mut corners, &boundary);
        let solid = self.signs.is_negative(surface, low);
        let mut scratch = std::mem::take(&mut self.divided_faces.scratch);
        (face.corners, face.tries) = (corners, 0);
        let at = (low, axis);
        loop {
            self.parts(axis, &face.corners, &boundary, &contours, (solid, face.tries), &mut scratch);
            std::mem::swap(&mut face.parts, &mut scratch.parts);
            self.cut_parts(at, surface, face, &mut scratch.fragments);
            if scratch.fragments.are_sound(axis) || face.tries == TRIES {
                break;
            }
            face.tries += 1;
            for i in 0..face.corners.len() {
                face.corners[i].id = self.perturbed(low, &face.corners[i], face.tries);
            }
        }
        for &(key, position) in scratch.fragments.corners.iter().filter(|c| c.0.is_between()) {
            self.vertex_at(key, position);
        }
        face.names.clear();
        face.names.extend(scratch.fragments.corners.iter().map(|c| c.0));
        std::mem::swap(&mut face.ends, &mut scratch.fragments.ends);
        self.divided_faces.scratch = scratch;
        let (mut along, mut ends) = (std::mem::take(&mut face.along), std::mem::take(&mut face.along_ends));
        along.clear();
        ends.clear();
        for contour in &contours {
            self.crossed(at, surface, face, contour, &mut along);
            ends.push(along.len());
        }
        (face.along, face.along_ends) = (along, ends);
        true
    }

    fn point(&mut self, key: VertexId, position: Vec3, value: impl Fn(&Self, usize) -> f64) -> usize {
        if let Some(id) = self.divided_faces.numbers.get(&key) {
            return *id;
        }
        let line = (0..3).find(|a| key.is_along(*a)).map(|a| (key.node(), a));
        let id = self.add_point(position, line, value);
        self.divided_faces.numbers.insert(key, id);
        id
    }

    /// The contours of a face by its corners, from where its boundary enters the solid to where it leaves it.
    fn contours_of(
        &mut self,
        face: (usize, usize),
        ring: &[usize],
        corners: &mut Vec<PolygonCorner>,
        boundary: &[(usize, Option<bool>)],
    ) -> Vec<Vec<usize>> {
        let edges = self.edges;
        if let Some(contours) = edges.contours.get(&face) {
            let mut via = 0;
            let mut all = Vec::with_capacity(contours.len());
            for c in contours {
                let end = |corners: &[PolygonCorner], key: VertexId| corners.iter().position(|c| c.key == key);
                let mut path: Vec<usize> = end(corners, c.from).into_iter().collect();
                for &(key, position) in &c.via {
                    let id = self.point(key, position, |k, f| k.value_between(f, position, ring));
                    path.push(corners.len());
                    corners.push(PolygonCorner { id, code: 12 + via, key });
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

    /// Finds the triangles between the boundary of a face and its contours, others for each attempt where there are others. `solid`
    /// is whether the surface is negative at the face's first node.
    fn parts(
        &self,
        axis: usize,
        corners: &[PolygonCorner],
        boundary: &[(usize, Option<bool>)],
        contours: &[Vec<usize>],
        (solid, tries): (bool, usize),
        FaceScratch { flat, polygon, positions, parts, .. }: &mut FaceScratch,
    ) {
        flat.clear();
        flat.extend(corners.iter().map(|c| drop_axis(self.position_of(c.id), axis)));
        let is_on_contour = |a: usize, b: usize| {
            contours.iter().any(|c| c.windows(2).any(|w| (w[0], w[1]) == (a, b) || (w[1], w[0]) == (a, b)))
        };
        parts.clear();
        let mut add = |polygon: &[usize], inside: bool| {
            positions.clear();
            positions.extend(polygon.iter().map(|c| flat[*c]));
            for t in triangles(positions, tries) {
                let t = t.map(|i| polygon[i]);
                let mut sorted = t;
                sorted.sort_by_key(|c| corners[*c].code);
                let turns = (0..3).any(|k| sorted == [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]);
                let [a, b, c] = sorted;
                parts.push(FaceTriangle {
                    corners: sorted,
                    left: turns,
                    inside,
                    on_contour: [is_on_contour(b, c), is_on_contour(a, c), is_on_contour(a, b)],
                });
            }
        };
        if contours.is_empty() {
            polygon.clear();
            polygon.extend(boundary.iter().map(|b| b.0));
            return add(polygon, solid);
        }
        // A solid polygon runs along the boundary from where that enters the solid, and back along a contour; a void one along
        // the boundary from where that leaves the solid, and on along a contour.
        for inside in [true, false] {
            let start = |c: &Vec<usize>| if inside { c[0] } else { c[c.len() - 1] };
            let mut open: Vec<usize> = contours.iter().map(start).collect();
            while let Some(first) = open.pop() {
                polygon.clear();
                let mut enter = first;
                loop {
                    let mut i = boundary.iter().position(|b| b.0 == enter).unwrap_or(0);
                    polygon.push(boundary[i].0);
                    let contour = loop {
                        i = (i + 1) % boundary.len();
                        let ends = |c: &&Vec<usize>| (if inside { c[c.len() - 1] } else { c[0] }) == boundary[i].0;
                        if let Some(c) = contours.iter().find(ends) {
                            break c;
                        }
                        if polygon.len() > 32 {
                            break &contours[0];
                        }
                        polygon.push(boundary[i].0);
                    };
                    if inside {
                        polygon.extend(contour[1..].iter().rev());
                    } else {
                        polygon.extend(&contour[..contour.len() - 1]);
                    }
                    enter = start(contour);
                    if enter == first || polygon.len() > 32 {
                        break;
                    }
                    open.retain(|c| *c != enter);
                }
                add(polygon, inside);
            }
        }
    }

    /// Finds the triangles of a face cut by all surfaces but one, counter-clockwise about the face's axis.
    fn cut_parts(&mut self, at: (usize, usize), surface: usize, face: &CellFace, found: &mut PolygonList) {
        found.corners.clear();
        found.ends.clear();
        let mut cut = self.fragments.take();
        for part in &face.parts {
            let [a, b, c] = part.corners.map(|c| face.corners[c].id);
            let simplex = Simplex { nodes: [a, b, c, a], count: 3 };
            let signs = self.others_of(&simplex, surface, part.inside);
            let ring = if part.left { [0, 1, 2] } else { [2, 1, 0] };
            self.cut_triangle(&simplex, ring, signs, &mut cut);
            for (negative, _, ring) in cut.facets() {
                found.corners.extend(ring.iter().map(|v| {
                    let vertex = cut.vertices[usize::from(*v)];
                    let key = self.face_vertex_id(at, face, &part.corners, vertex);
                    (key, self.face_vertex_position(at, face, (&part.corners, &simplex), vertex))
                }));
                found.ends.push((negative, found.corners.len()));
            }
        }
        self.fragments.set(cut);
    }

    /// The position of a cut vertex of a triangle in a face.
    fn face_vertex_position(
        &mut self,
        at: (usize, usize),
        face: &CellFace,
        (corners, simplex): (&[usize], &Simplex),
        vertex: CutVertex,
    ) -> Vec3 {
        let key = self.face_vertex_id(at, face, corners, vertex);
        if !key.is_between() && vertex.surfaces != 0 {
            let v = self.vertex(key);
            return self.positions[v as usize];
        }
        if vertex.corners.count_ones() == 3 {
            // Where two segments intersect: crossings with grid edges may lie elsewhere than the values at the corners say.
            let [f, g] = [vertex.surfaces.trailing_zeros(), 63 - vertex.surfaces.leading_zeros()];
            let [first, second] = [f, g].map(|f| self.segment_in_triangle(at, face, (corners, simplex), f as usize));
            return intersection(first, second, at.1);
        }
        // With each attempt cut vertices keep farther from the points.
        self.vertex_position(simplex, vertex, (1 + 2 * face.tries) as f64)
    }

    /// The ends of the segment in which a surface cuts a triangle in a face.
    fn segment_in_triangle(
        &mut self,
        at: (usize, usize),
        face: &CellFace,
        of: (&[usize], &Simplex),
        surface: usize,
    ) -> [Vec3; 2] {
        let negative = (0..3).fold(0u8, |w, c| w | u8::from(self.is_negative(surface, of.1.nodes[c])) << c);
        // The corner that the segment cuts off.
        let single = if negative.is_power_of_two() { negative } else { 7 & !negative };
        let others = 7 & !single;
        [others & others.wrapping_neg(), others & (others - 1)].map(|other| {
            let vertex = CutVertex { corners: single | other, surfaces: 1 << surface };
            self.face_vertex_position(at, face, of, vertex)
        })
    }

    /// The surfaces that are negative at all corners of a simplex and those that change sign; for the fitted surface `inside`
    /// decides.
    pub(super) fn others_of(&self, simplex: &Simplex, surface: usize, inside: bool) -> (u64, u64) {
        let (negative, mixed) = self.signs_of(simplex);
        let own = 1 << surface;
        (negative & !own | if inside { own } else { 0 }, mixed & !own)
    }

    /// The id of a cut vertex of a triangle, or of an edge, in a face.
    pub(super) fn face_vertex_id(
        &self,
        (low, axis): (usize, usize),
        face: &CellFace,
        corners: &[usize],
        vertex: CutVertex,
    ) -> VertexId {
        let (mut all, mut count) = ([face.corners[0]; 3], 0);
        for c in bits(u64::from(vertex.corners)) {
            all[count] = face.corners[corners[c]];
            count += 1;
        }
        let between = &mut all[..count];
        if let [only] = between {
            return only.key;
        }
        between.sort_by_key(|c| c.code);
        let line = between.iter().fold(15, |l, c| l & lines(c.code));
        let (mut surfaces, mut met) = ([0; 3], 0);
        for f in bits(vertex.surfaces).take(3) {
            surfaces[met] = f;
            met += 1;
        }
        let surfaces = &surfaces[..met];
        if line != 0 {
            let lines = super::lines_of(self.nodes, (low, axis));
            let (node, along) = lines[line.trailing_zeros() as usize];
            return VertexId::new(node, &[1 << along], surfaces);
        }
        let codes = all.map(|c| c.code);
        VertexId::between(low, 7 & !(1 << axis), &codes[..count], surfaces)
    }

    /// Adds a contour with the points where other surfaces cross it.
    fn crossed(
        &self,
        at: (usize, usize),
        surface: usize,
        face: &CellFace,
        contour: &[usize],
        path: &mut Vec<VertexId>,
    ) {
        path.push(face.corners[contour[0]].key);
        for w in contour.windows(2) {
            let mut ends = [w[0], w[1]];
            ends.sort_by_key(|c| face.corners[*c].code);
            let simplex = Simplex { nodes: [ends[0], ends[1], ends[0], ends[0]].map(|c| face.corners[c].id), count: 2 };
            let mut found = self.crossings(&simplex);
            found.retain(|c| c.1 != surface);
            if ends[0] != w[0] {
                found.reverse();
            }
            path.extend(found.into_iter().map(|(_, f)| {
                let vertex = CutVertex { corners: 3, surfaces: 1 << f };
                self.face_vertex_id(at, face, &ends, vertex)
            }));
            path.push(face.corners[w[1]].key);
        }
    }
}
