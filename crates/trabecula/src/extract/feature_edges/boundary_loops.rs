//! Cells filled from their boundary loops.

use std::collections::HashMap;

use super::polygon_triangulation::triangles;
use super::surface_patch::PatchCandidates;
use crate::extract::feature_cells::FeatureCells;
use crate::extract::sampling_grid::Sides;
use crate::extract::vertex_id::VertexId;
use geometry::math::{add, scale, sub};
use geometry::mesh::exact::drop_axis;

/// Size of the inner cell, as a share of the cell, up to which shells of several loops are kept apart.
const INNER: f64 = 0.5;

/// A part of a boundary loop within one cell face: from a point on the face's boundary, perhaps over others, to another.
pub(super) struct Step {
    from: VertexId,
    via: Vec<VertexId>,
    to: VertexId,
    /// The face: its axis, and whether it is the upper one.
    face: (usize, bool),
}

impl Step {
    pub fn path(&self) -> Vec<VertexId> {
        let ends = (std::iter::once(self.from), std::iter::once(self.to));
        ends.0.chain(self.via.iter().copied()).chain(ends.1).collect()
    }
}

impl FeatureCells<'_> {
    /// Fills a cell that one surface with a feature edge crosses.
    pub fn fill_edge_cell(&mut self, cell: [usize; 3], surface: usize) {
        let steps = self.steps(cell, surface);
        let boundary_loops = boundary_loops(&steps.iter().map(Step::path).collect::<Vec<_>>());
        let (node, sides) = (self.nodes.index(cell), self.sides_of(cell, surface));
        let (edges, of) = (self.edges, self.cell_of(cell, surface));
        let patches: Vec<PatchCandidates> = boundary_loops
            .iter()
            .map(|keys| match (self.boundary_loop(cell, keys), boundary_loops.len()) {
                (boundary_loop, 1) => edges.patches(of, &boundary_loop, edges.neighbour_corners(of)),
                (boundary_loop, _) => edges.patches_among(of, &boundary_loop),
            })
            .collect();
        let any = patches.iter().any(|p| p.divided.is_some());
        let first = self.extra.triangles.len();
        for divided in [true, false].into_iter().skip(usize::from(!any)) {
            for (keys, patches) in boundary_loops.iter().zip(&patches) {
                let patch = patches.best(divided);
                let mut names: Vec<u32> = keys.iter().map(|k| self.vertex(*k)).collect();
                let inner = patch.inner.iter();
                names.extend(inner.map(|p| self.push(VertexId::center(node, 7), *p)));
                let triangles = patch.triangles.iter();
                let vertex_at = triangles.map(|t| (t.map(|i| names[i]), sides));
                self.extra.triangles.extend(vertex_at);
            }
            // A single cone cannot intersect itself; several patches may intersect each other.
            let single = !divided && boundary_loops.len() == 1;
            if single || !(self.self_intersects_rounded(first) || self.self_intersects(first, |x| x)) {
                return;
            }
            self.extra.triangles.truncate(first);
        }
        self.fill_by_shell(cell, surface, &steps, sides);
    }

    /// The parts of all loops in the faces of a cell, counter-clockwise seen from the void.
    pub(super) fn steps(&self, cell: [usize; 3], surface: usize) -> Vec<Step> {
        let node = self.nodes.index(cell);
        let mut steps = Vec::new();
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            if let Some(face) = self.divided_faces.face((low, axis)) {
                steps.extend(face.contours().map(|c| {
                    let mut path = c.to_vec();
                    if !upper {
                        path.reverse();
                    }
                    let last = path.len() - 1;
                    Step { from: path[0], via: path[1..last].to_vec(), to: path[last], face: (axis, upper) }
                }));
                continue;
            }
            if let Some(contours) = self.edges.contours.get(&(low, axis)) {
                steps.extend(contours.iter().map(|c| Step {
                    from: if upper { c.from } else { c.to },
                    via: if upper {
                        c.via.iter().map(|v| v.0).collect()
                    } else {
                        c.via.iter().rev().map(|v| v.0).collect()
                    },
                    to: if upper { c.to } else { c.from },
                    face: (axis, upper),
                }));
                continue;
            }
            let (mut enters, mut leaves) = (Vec::new(), Vec::new());
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (du, dv) = (self.nodes.stride[u], self.nodes.stride[v]);
            let ring = [low, low + du, low + du + dv, low + dv];
            for i in 0..4 {
                let (a, b) = (ring[i], ring[(i + 1) % 4]);
                let [p, q] = [a, b].map(|n| self.signs.is_negative(surface, n));
                let along = if i % 2 == 0 { u } else { v };
                let key = VertexId::new(a.min(b), &[1 << along], &[surface]);
                // From where the boundary enters the solid, seen from outside the cell.
                if p != q {
                    (if q == upper { &mut enters } else { &mut leaves }).push(key);
                }
            }
            let mut across = cell;
            across[axis] = across[axis].wrapping_add(if upper { 1 } else { usize::MAX });
            let featured = across[axis] < self.nodes.shape[axis] - 1 && self.signs.is_feature(across);
            for from in enters {
                let (via, to) = if featured {
                    self.trace(cell, axis, upper, surface, from)
                } else {
                    (Vec::new(), leaves.first().copied())
                };
                let Some(to) = to else { continue };
                steps.push(Step { from, via, to, face: (axis, upper) });
            }
        }
        steps
    }

    /// Fills a cell with several loops without looking at the surface inside: strips run from the loops half-way to the centre
    /// of the cell, where they end at the solid part of the boundary of a smaller cell. Strips of loops that do not meet do not
    /// meet either.
    fn fill_by_shell(&mut self, cell: [usize; 3], surface: usize, steps: &[Step], sides: Sides) {
        let node = self.nodes.index(cell);
        let ends = [node, node + self.offset(7)].map(|n| self.nodes.position(n));
        let center = scale(add(ends[0], ends[1]), 0.5);
        let mut inner: HashMap<VertexId, u32> = HashMap::new();
        let mut pairs: HashMap<VertexId, u32> = HashMap::new();
        let mut keys: Vec<VertexId> = Vec::new();
        for s in steps {
            keys.push(s.from);
            keys.extend(&s.via);
            keys.push(s.to);
        }
        let polygons: Vec<((usize, bool), Vec<VertexId>)> = self.solid_polygons(cell, surface, steps);
        for &key in &keys {
            let v = self.vertex(key);
            pairs.insert(key, v);
        }
        keys.extend(polygons.iter().flat_map(|p| p.1.iter().copied()));
        for key in keys {
            if inner.contains_key(&key) {
                continue;
            }
            let position = match pairs.get(&key) {
                Some(v) => self.positions[*v as usize],
                None => self.nodes.position(key.node()),
            };
            let position = add(center, scale(sub(position, center), INNER));
            let v = self.push(VertexId::center(node, 7), position);
            inner.insert(key, v);
        }
        for s in steps {
            for w in s.path().windows(2) {
                let (a, b) = (pairs[&w[0]], pairs[&w[1]]);
                let (c, d) = (inner[&w[0]], inner[&w[1]]);
                self.extra.triangles.push(([c, a, b], sides));
                self.extra.triangles.push(([c, b, d], sides));
            }
        }
        for ((axis, upper), ring) in polygons {
            let mut names: Vec<u32> = ring.iter().map(|k| inner[k]).collect();
            if upper {
                names.reverse();
            }
            self.flat(&names, axis, sides);
        }
    }

    /// Adds a simple polygon normal to an axis by its vertices; it need not be convex.
    pub(super) fn flat(&mut self, names: &[u32], axis: usize, sides: Sides) {
        let flat: Vec<[f64; 2]> =
            names.iter().map(|v| drop_axis(self.positions[*v as usize].map(|x| f64::from(x as f32)), axis)).collect();
        for t in triangles(&flat, 0) {
            self.extra.triangles.push((t.map(|i| names[i]), sides));
        }
    }

    /// The solid parts of the faces of a cell: polygons, counter-clockwise about the face's axis.
    fn solid_polygons(&self, cell: [usize; 3], surface: usize, steps: &[Step]) -> Vec<((usize, bool), Vec<VertexId>)> {
        let node = self.nodes.index(cell);
        let mut all = Vec::new();
        for (axis, upper) in [0, 1, 2].into_iter().flat_map(|a| [(a, false), (a, true)]) {
            let low = node + self.offset(usize::from(upper) << axis);
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (du, dv) = (self.nodes.stride[u], self.nodes.stride[v]);
            let ring = [low, low + du, low + du + dv, low + dv];
            // The boundary of the face: nodes, and crossings.
            let mut boundary: Vec<VertexId> = Vec::new();
            for i in 0..4 {
                let (a, b) = (ring[i], ring[(i + 1) % 4]);
                let along = if i % 2 == 0 { u } else { v };
                boundary.push(VertexId::new(a, &[], &[]));
                let [p, q] = [a, b].map(|n| self.signs.is_negative(surface, n));
                if p != q {
                    boundary.push(VertexId::new(a.min(b), &[1 << along], &[surface]));
                } else if self.edges.double_crossings.contains_key(&(surface, a.min(b), along)) {
                    let order = if i < 2 { [0, 1] } else { [1, 0] };
                    let key = |n| VertexId::crossing(a.min(b), along, surface, n);
                    boundary.extend(order.map(key));
                }
            }
            let here: Vec<(VertexId, Vec<VertexId>, VertexId)> = steps
                .iter()
                .filter(|s| s.face == (axis, upper))
                .map(|s| {
                    let mut via = s.via.clone();
                    if upper {
                        (s.from, via, s.to)
                    } else {
                        via.reverse();
                        (s.to, via, s.from)
                    }
                })
                .collect();
            if here.is_empty() {
                if self.signs.is_negative(surface, low) {
                    all.push(((axis, upper), boundary));
                }
                continue;
            }
            let mut open: Vec<VertexId> = here.iter().map(|c| c.0).collect();
            while let Some(first) = open.pop() {
                let mut polygon = Vec::new();
                let mut enter = first;
                loop {
                    // Along the boundary to where it leaves the solid, then back along the contour.
                    let mut i = boundary.iter().position(|k| *k == enter).unwrap_or(0);
                    let contour = loop {
                        polygon.push(boundary[i]);
                        i = (i + 1) % boundary.len();
                        if let Some(c) = here.iter().find(|c| c.2 == boundary[i]) {
                            break c;
                        }
                        if polygon.len() > boundary.len() {
                            break &here[0];
                        }
                    };
                    polygon.push(contour.2);
                    polygon.extend(contour.1.iter().rev());
                    enter = contour.0;
                    if enter == first || polygon.len() > 64 {
                        break;
                    }
                    open.retain(|k| *k != enter);
                }
                all.push(((axis, upper), polygon));
            }
        }
        all
    }
}

/// The closed loops that some paths make.
pub(super) fn boundary_loops(paths: &[Vec<VertexId>]) -> Vec<Vec<VertexId>> {
    let mut used = vec![false; paths.len()];
    let mut boundary_loops = Vec::new();
    for first in 0..paths.len() {
        let (mut boundary_loop, mut at) = (Vec::new(), first);
        while !used[at] {
            used[at] = true;
            let path = &paths[at];
            boundary_loop.extend(&path[..path.len() - 1]);
            match paths.iter().rposition(|p| p[0] == path[path.len() - 1]) {
                Some(n) => at = n,
                None => break,
            }
        }
        if !boundary_loop.is_empty() {
            boundary_loops.push(boundary_loop);
        }
    }
    boundary_loops
}
