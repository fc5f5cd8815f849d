//! Feature cells: grid cells where several implicit surfaces meet (edges and corners of the solid, thin walls), or where one
//! surface has several patches.
//!
//! Such a cell is divided into the six tetrahedra between its lowest and its highest corner. In a tetrahedron each surface is
//! taken as the plane of its values at the four corners, so that the solid is exactly a polyhedron there: the tetrahedron is
//! cut by one plane after the other, and a facet between a solid and a void fragment is surface. Smooth surfaces, and the
//! curves and points where they meet, are approximated to second order; nothing depends on a node lying inside a wedge.
//! Adjacent tetrahedra have the same planes on their common facet. A plain neighbour of a feature cell becomes a cone from a
//! point inside over its boundary loop, to which the points on the diagonal of the common face are added.
//!
//! Invariant: the id of a vertex is the simplex of nodes in which it lies and the surfaces that meet there, and its position is
//! computed from the id alone; so it is the same from whichever cell, tile or thread.
//!
//! Source: planes in tetrahedra, as X. Du, Q. Zhou, N. Carr and T. Ju, Robust computation of implicit surface networks for
//! piecewise linear functions, ACM Trans. Graph. 41 (2022) 41; the division after H. Freudenthal (1942).

mod fragments;
mod simplex_cut;

use std::cell::Cell;
use std::ops::Range;

use geometry::math::{Vec3, add, scale};
use geometry::mesh::{Mesh, is_embedded};
use rustc_hash::{FxHashMap, FxHashSet};

use super::block_nodes::BlockNodes;
use super::cube_table::{CASES, EDGES};
use super::feature_edges::{DividedFaces, EdgeStore};
use super::sampling_grid::{LocalSolid, SamplingGrid, Sides};
use super::sign_words::Signs;
use super::vertex_id::VertexId;
use super::vertex_numbers::{VertexNumbers, numbered};
pub(super) use fragments::{CutVertex, Fragments};
pub(super) use simplex_cut::{Simplex, section};

/// Vertices and triangles that marching cubes does not make.
#[derive(Default)]
pub(super) struct FeatureMesh {
    names: FxHashMap<VertexId, u32>,
    /// The ids of the vertices.
    pub keys: Vec<VertexId>,
    /// Triangles, and what lies on their sides.
    pub triangles: Vec<([u32; 3], Sides)>,
    /// The middle of a cell of the tile that self-intersects in single precision in every attempt.
    pub self_intersection: Option<Vec3>,
}

impl FeatureMesh {
    pub fn clear(&mut self) {
        self.names.clear();
        self.keys.clear();
        self.triangles.clear();
        self.self_intersection = None;
    }
}

/// A block while the vertices and triangles of feature cells, fitted cells and caps are added to it.
pub(super) struct FeatureCells<'a> {
    pub nodes: &'a BlockNodes<'a>,
    pub grid: &'a SamplingGrid,
    pub local: &'a LocalSolid,
    pub samples: &'a [Vec<f32>],
    pub signs: &'a Signs,
    pub numbers: &'a [VertexNumbers],
    pub positions: &'a mut Vec<Vec3>,
    pub extra: &'a mut FeatureMesh,
    pub edges: &'a EdgeStore,
    /// Nodes at which the surfaces are perturbed, and in which attempt.
    pub perturbed_nodes: FxHashMap<usize, usize>,
    pub divided_faces: DividedFaces,
    /// Buffers for the simplex that is being cut.
    pub fragments: Cell<Fragments>,
}

/// Most attempts to perturb the surfaces at a node.
const ATTEMPTS: usize = 8;

/// The six paths from the lowest corner of a cell to the highest, as sets of axes; and whether the tetrahedron on each is
/// right-handed.
const PATHS: [([usize; 2], bool); 6] =
    [([1, 3], true), ([2, 6], true), ([4, 5], true), ([1, 5], false), ([2, 3], false), ([4, 6], false)];

/// The centroid of some points.
pub(super) fn middle(points: &[Vec3]) -> Vec3 {
    let sum = points.iter().fold([0.0; 3], |s, p| add(s, *p));
    scale(sum, 1.0 / points.len() as f64)
}

impl FeatureCells<'_> {
    /// The vertex with this id; made if it is new.
    pub fn vertex(&mut self, key: VertexId) -> u32 {
        if let Some(&n) = self.extra.names.get(&key) {
            return n;
        }
        let n = self.numbered(key).unwrap_or_else(|| {
            let own = self.edges.position(key);
            self.push(key, own.unwrap_or_else(|| self.position(key)))
        });
        self.extra.names.insert(key, n);
        n
    }

    /// The vertex with this id at this position; made if it is new.
    pub fn vertex_at(&mut self, key: VertexId, position: Vec3) -> u32 {
        if let Some(&n) = self.extra.names.get(&key) {
            return n;
        }
        let n = self.push(key, position);
        self.extra.names.insert(key, n);
        n
    }

    /// The number of a vertex that a plain cell has as well.
    pub fn numbered(&self, key: VertexId) -> Option<u32> {
        numbered(self.numbers, self.nodes, key)
    }

    pub fn push(&mut self, key: VertexId, position: Vec3) -> u32 {
        self.positions.push(position);
        self.extra.keys.push(key);
        self.positions.len() as u32 - 1
    }

    /// Adds a convex polygon by the ids of its vertices.
    pub fn polygon(&mut self, ring: &[VertexId], sides: Sides) {
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        self.fan(&names, sides);
    }

    /// Adds a convex polygon by its vertices.
    pub fn fan(&mut self, names: &[u32], sides: Sides) {
        for i in 2..names.len() {
            self.extra.triangles.push(([names[0], names[i - 1], names[i]], sides));
        }
    }

    /// Fills a plain cell that is adjacent to a feature cell.
    pub fn seam(&mut self, cell: [usize; 3], surface: usize) {
        let [i, j, k] = cell;
        let node = self.nodes.index(cell);
        let case = &CASES[self.signs.corners(surface, i, j, k)];
        let n = case.ring.len();
        let mut ring: Vec<VertexId> = Vec::with_capacity(2 * n);
        let ends = |e: u8| {
            let (corner, axis) = EDGES[e as usize];
            (corner, corner | 1 << axis)
        };
        for at in 0..n {
            let (e, next) = (case.ring[at], case.ring[(at + 1) % n]);
            let ((a, b), (c, d)) = (ends(e), ends(next));
            ring.push(VertexId::new(node + self.offset(a), &[a ^ b], &[surface]));
            // The face on which both edges lie, and the cell across it.
            let Some(axis) = (0..3).find(|x| [b, c, d].iter().all(|m| (m ^ a) >> x & 1 == 0)) else {
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
            if !self.signs.is_feature(across) {
                continue;
            }
            let key = |k: &Self, c: usize, d: usize| VertexId::new(node + k.offset(c & d), &[c ^ d], &[surface]);
            let from = key(self, a, b);
            ring.extend(self.trace(cell, axis, upper, surface, from).0);
        }
        let sides = self.sides_of(cell, surface);
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        if names.len() == n {
            // Nothing was added: the plain patch serves.
            let name = |e: u8| case.ring.iter().position(|r| *r == e).map_or(0, |at| names[at]);
            self.extra.triangles.extend(case.triangles[..case.count].iter().map(|t| (t.map(name), sides)));
            return;
        }
        let boundary_loop: Vec<Vec3> = names.iter().map(|v| self.positions[*v as usize]).collect();
        self.cone(VertexId::center(node, 7), middle(&boundary_loop), &names, sides);
    }

    /// Adds the cone over a ring of vertices from a new one.
    pub fn cone(&mut self, apex: VertexId, position: Vec3, ring: &[u32], sides: Sides) {
        let middle = self.push(apex, position);
        for at in 0..ring.len() {
            let (a, b) = (ring[at], ring[(at + 1) % ring.len()]);
            self.extra.triangles.push(([middle, a, b], sides));
        }
    }

    /// Adds a polygon in a cell face that spans two axes; it may have straight angles.
    pub fn flat_polygon(&mut self, low: usize, span: usize, ring: &[VertexId], part: u8) {
        let names: Vec<u32> = ring.iter().map(|k| self.vertex(*k)).collect();
        let boundary_loop: Vec<Vec3> = names.iter().map(|v| self.positions[*v as usize]).collect();
        self.cone(VertexId::center(low, span), middle(&boundary_loop), &names, Sides::cut(part));
    }

    /// Whether cells are fitted to a surface.
    pub fn is_fitted(&self, surface: usize) -> bool {
        self.grid.fitted == Some(self.local.live[surface])
    }

    /// The part of the solid where these surfaces are negative in a cell: 0 is void, the parts count from 1.
    pub fn part_in(&self, [i, j, k]: [usize; 3], negative: u64) -> u8 {
        let live = self.local.live.len();
        let sign = |f: usize| match f.checked_sub(live) {
            Some(flat) => Signs::adjacent(self.local, flat, j, k) >> i,
            None => negative >> f,
        };
        self.local.part(&sign)
    }

    /// Whether no surface is needed in a simplex: the part is the same whichever of the `mixed` surfaces are negative.
    pub fn is_uniform(&self, [i, j, k]: [usize; 3], (negative, mixed): (u64, u64)) -> bool {
        let live = self.local.live.len();
        let sign = |f: usize, mask: u64| match f.checked_sub(live) {
            Some(flat) => Signs::adjacent(self.local, flat, j, k) >> i,
            None => mask >> f,
        };
        let (some, all) = (|f: usize| sign(f, negative | mixed), |f: usize| sign(f, negative));
        self.local.trees.iter().all(|t| (t.possible(&some, &all) ^ t.certain(&some, &all)) & 1 == 0)
    }

    /// What lies on the sides of a surface where some surfaces are negative in a cell.
    pub fn sides(&self, cell: [usize; 3], negative: u64, surface: usize) -> Sides {
        Sides {
            behind: self.part_in(cell, negative | 1 << surface),
            ahead: self.part_in(cell, negative & !(1 << surface)),
            cut: self.grid.surfaces[self.local.live[surface]].cut,
        }
    }

    /// What lies on the sides of the only surface of a cell.
    pub fn sides_of(&self, cell: [usize; 3], surface: usize) -> Sides {
        let [behind, ahead] = self.signs.parts_beside(self.local, surface, cell);
        Sides { behind, ahead, cut: self.grid.surfaces[self.local.live[surface]].cut }
    }

    /// Cuts a feature cell.
    pub fn cell(&mut self, cell: [usize; 3]) {
        let node = self.nodes.index(cell);
        let signs = self.signs.at_corners(cell);
        let mut fragments = self.fragments.take();
        let mut known: Vec<(VertexId, u32)> = Vec::with_capacity(32);
        for ([one, two], right) in PATHS {
            let corners = [0, one, two, 7];
            let (negative, mixed) = signs.among(corners);
            if mixed == 0 {
                continue;
            }
            let simplex = self.simplex(node, &corners[1..]);
            if mixed.is_power_of_two() {
                let f = mixed.trailing_zeros() as usize;
                let section = section(right, signs.pattern(f, corners)).iter();
                let vertices = section.map(|corners| CutVertex { corners: *corners, surfaces: mixed });
                self.facet(cell, &simplex, (negative, f), vertices, &mut known);
            } else if !self.is_uniform(cell, (negative, mixed)) {
                self.cut(&simplex, right, (negative, mixed), [None; 4], &mut fragments);
                for (negative, f, facet) in fragments.negative_facets() {
                    let vertices = facet.iter().map(|v| fragments.vertices[usize::from(*v)]);
                    self.facet(cell, &simplex, (negative, f), vertices, &mut known);
                }
            }
        }
        self.fragments.set(fragments);
        for flat in &self.local.grid_planes {
            let layer = if flat.below { flat.at - 1 } else { flat.at };
            if cell[flat.axis] == layer {
                self.cap_face(cell, flat.axis, flat.below);
            }
        }
    }

    /// Adds a facet of a fragment, on a surface, if it bounds a part of the solid. `known` are vertices of the cell.
    fn facet(
        &mut self,
        cell: [usize; 3],
        simplex: &Simplex,
        (negative, surface): (u64, usize),
        vertices: impl Iterator<Item = CutVertex>,
        known: &mut Vec<(VertexId, u32)>,
    ) {
        let sides = self.sides(cell, negative, surface);
        if sides.behind == sides.ahead {
            return;
        }
        let mut first = None;
        let mut last = None;
        for vertex in vertices {
            let key = self.key(simplex, vertex);
            // Adjacent tetrahedra share most vertices: the few of one cell are found sooner than those of the block.
            let name = known.iter().find(|k| k.0 == key).map(|k| k.1).unwrap_or_else(|| {
                let name = self.vertex(key);
                known.push((key, name));
                name
            });
            if let (Some(first), Some(last)) = (first, last) {
                self.extra.triangles.push(([first, last, name], sides));
            }
            last = first.and(Some(name));
            first = first.or(Some(name));
        }
    }

    /// Cuts all feature cells of the block and keeps what belongs to the tile.
    ///
    /// In exact arithmetic the fragments meet only where they should. Planes may, however, pass so near to each other's common
    /// points that single precision mixes them up. Where that happens in a cell, the surfaces are perturbed at its nodes by far
    /// less than a grid step, and the cells there are cut again; more than once at nodes that no adjacent tile has.
    pub fn all(&mut self, own: &[Range<usize>; 3]) {
        let fitted = |c: &[usize; 3]| self.edges.claims.is_fitted(self.nodes, *c);
        let cells = self.signs.feature_cells().filter(|c| !fitted(c));
        let cells: Vec<[usize; 3]> = cells.collect();
        let mine = |c: &[usize; 3]| (0..3).all(|a| own[a].contains(&c[a]));
        // All cells are tested before any node is perturbed: the result for a cell must not depend on other cells, which an
        // adjacent tile may not have.
        let mut perturbed_nodes = FxHashSet::default();
        let mut ends = Vec::with_capacity(cells.len());
        for c in &cells {
            let first = self.extra.triangles.len();
            self.cell(*c);
            if self.self_intersects_rounded(first) {
                perturbed_nodes.extend(self.corners_of(*c));
            }
            if !mine(c) {
                self.extra.triangles.truncate(first);
            }
            ends.push(self.extra.triangles.len());
        }
        if perturbed_nodes.is_empty() {
            return;
        }
        self.perturbed_nodes = perturbed_nodes.into_iter().map(|n| (n, 0)).collect();
        let plain = self.positions.len() - self.extra.keys.len();
        let positions = self.positions.split_off(plain);
        let before = std::mem::take(&mut *self.extra);
        let inside = |at: [usize; 3]| (0..3).all(|a| own[a].start < at[a] && at[a] < own[a].end);
        for attempt in 1..=ATTEMPTS {
            let mut failed = Vec::new();
            let mut first = 0;
            for (c, end) in cells.iter().zip(&ends).filter(|(c, _)| mine(c)) {
                if self.corners_of(*c).iter().any(|n| self.perturbed_nodes.contains_key(n)) {
                    let from = self.extra.triangles.len();
                    self.cell(*c);
                    if self.self_intersects_rounded(from) {
                        failed.push(*c);
                    }
                } else {
                    for (t, sides) in &before.triangles[first..*end] {
                        let again = t.map(|v| match (v as usize).checked_sub(plain) {
                            Some(v) => self.vertex_at(before.keys[v], positions[v]),
                            None => v,
                        });
                        self.extra.triangles.push((again, *sides));
                    }
                }
                first = *end;
            }
            let movable = failed.iter().flat_map(|c| self.corners_of(*c)).filter(|n| inside(self.nodes.at(*n)));
            let movable: Vec<usize> = movable.collect();
            if attempt == ATTEMPTS || movable.is_empty() {
                self.extra.self_intersection = failed.first().map(|c| self.center_of(*c));
                return;
            }
            self.perturbed_nodes.extend(movable.into_iter().map(|n| (n, attempt)));
            self.positions.truncate(plain);
            self.extra.clear();
        }
    }

    /// The nodes at the corners of a cell.
    fn corners_of(&self, cell: [usize; 3]) -> [usize; 8] {
        let node = self.nodes.index(cell);
        [0, 1, 2, 3, 4, 5, 6, 7].map(|corner| node + self.offset(corner))
    }

    /// Whether the triangles from `first` on intersect after rounding to single precision.
    pub fn self_intersects_rounded(&self, first: usize) -> bool {
        self.self_intersects(first, |x| f64::from(x as f32))
    }

    /// Whether the triangles from `first` on intersect after some rounding.
    pub fn self_intersects(&self, first: usize, rounded: impl Fn(f64) -> f64) -> bool {
        let triangles = &self.extra.triangles[first..];
        let mut mesh = Mesh::default();
        let mut names: Vec<u32> = Vec::with_capacity(32);
        for (t, _) in triangles {
            mesh.triangles.push(t.map(|v| {
                let at = names.iter().position(|n| *n == v).unwrap_or_else(|| {
                    names.push(v);
                    mesh.vertices.push(self.positions[v as usize].map(&rounded));
                    names.len() - 1
                });
                at as u32
            }));
        }
        let same = |i: usize| mesh.vertices[..i].contains(&mesh.vertices[i]);
        (1..names.len()).any(same) || !is_embedded(&mesh)
    }

    /// A face of a cell divided by the surfaces that cross it: the fragments of its two triangles with the surfaces that are
    /// negative there, counter-clockwise seen from outside the cell.
    pub(super) fn face_fragments(&self, cell: [usize; 3], axis: usize, upper: bool) -> Vec<(u64, Vec<VertexId>)> {
        let mut all = Vec::with_capacity(4);
        self.each_face_fragment(cell, axis, upper, None, &mut |negative, ring| all.push((negative, ring.to_vec())));
        all
    }

    /// Calls `found` with these; only with those of the triangles that a surface crosses, if it is given.
    fn each_face_fragment(
        &self,
        cell: [usize; 3],
        axis: usize,
        upper: bool,
        surface: Option<usize>,
        found: &mut impl FnMut(u64, &[VertexId]),
    ) {
        let node = self.nodes.index(cell) + self.offset(usize::from(upper) << axis);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let mut cut = self.fragments.take();
        let mut keys: Vec<VertexId> = Vec::with_capacity(8);
        for (step, right) in [(u, true), (v, false)] {
            let simplex = self.simplex(node, &[step, u | v]);
            let signs = self.signs_of(&simplex);
            if surface.is_some_and(|f| signs.1 >> f & 1 == 0) {
                continue;
            }
            self.cut_triangle(&simplex, if right == upper { [0, 1, 2] } else { [2, 1, 0] }, signs, &mut cut);
            for (negative, _, ring) in cut.facets() {
                keys.clear();
                keys.extend(ring.iter().map(|v| self.key(&simplex, cut.vertices[usize::from(*v)])));
                found(negative, &keys);
            }
        }
        self.fragments.set(cut);
    }

    /// The cap of a feature cell on its lower or upper face along an axis.
    fn cap_face(&mut self, cell: [usize; 3], axis: usize, upper: bool) {
        for (negative, ring) in self.face_fragments(cell, axis, upper) {
            let part = self.part_in(cell, negative);
            if part > 0 {
                self.polygon(&ring, Sides::cut(part));
            }
        }
    }

    /// Follows the contour of a surface in a cell face from a point up to the next grid edge: the points between, and the one
    /// there.
    pub fn trace(
        &self,
        cell: [usize; 3],
        axis: usize,
        upper: bool,
        surface: usize,
        from: VertexId,
    ) -> (Vec<VertexId>, Option<VertexId>) {
        let mut steps: Vec<(VertexId, VertexId)> = Vec::new();
        let on = |k: &VertexId| k.surfaces().any(|f| f == surface);
        let low = self.nodes.index(cell) + self.offset(usize::from(upper) << axis);
        let fitted = self.divided_faces.face((low, axis));
        if let Some(facet) = fitted.filter(|_| self.is_fitted(surface)) {
            steps.extend(facet.contours().flat_map(|c| c.windows(2).map(|w| (w[0], w[1]))));
        } else {
            let mut add = |negative: u64, ring: &[VertexId]| {
                if negative >> surface & 1 == 1 {
                    let edges = (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]));
                    steps.extend(edges.filter(|(a, b)| on(a) && on(b)));
                }
            };
            match fitted {
                Some(facet) => facet.fragments().for_each(|(n, ring)| add(n, ring)),
                None => self.each_face_fragment(cell, axis, upper, Some(surface), &mut add),
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
                Some(n) if (0..3).any(|a| n.is_along(a)) => return (path, Some(n)),
                Some(n) => {
                    path.push(n);
                    (before, at) = (at, n);
                }
                None => break,
            }
        }
        (path, None)
    }
}
