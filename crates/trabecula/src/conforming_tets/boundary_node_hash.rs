//! Sheets of the boundary that nearly touch: they are no neighbours in the mesh, so that they are found by place.

use rustc_hash::{FxHashMap, FxHashSet};

use super::shaping::{GONE, Shaping};
use geometry::math::{Aabb, Vec3, norm, sub};
use geometry::mesh::{Mesh, meet, near_pairs, self_intersections};
use geometry::tetmesh::{EDGES, FACES};
use rayon::prelude::*;

/// The most pairs of triangles that cross that are counted.
const COUNTED: usize = 1000;

/// A cell of `BoundaryNodeHash`.
type HashCell = [i64; 3];

/// The nodes of the boundary by the cell of a grid that they are in.
pub(super) struct BoundaryNodeHash {
    /// Edge of the cells (mm): that of the longest edge of the boundary.
    pub edge: f64,
    nodes: FxHashMap<HashCell, Vec<u32>>,
}

impl BoundaryNodeHash {
    pub fn new(shaping: &Shaping) -> BoundaryNodeHash {
        let length = |i: usize| {
            let p = shaping.corners(i as u32);
            let on = shaping.tets[i].map(|n| shaping.on[n as usize] != 0);
            let outer = EDGES.iter().filter(|[a, b]| on[*a] && on[*b]);
            outer.map(|[a, b]| norm(sub(p[*a], p[*b]))).fold(0.0, f64::max)
        };
        let there = |i: &usize| shaping.tets[*i] != GONE;
        let edge = (0..shaping.tets.len()).into_par_iter().filter(there).map(length).reduce(|| 0.0, f64::max);
        let mut node_hash = BoundaryNodeHash { edge, nodes: FxHashMap::default() };
        for n in (0..shaping.nodes.len()).filter(|n| shaping.on[*n] != 0 && !shaping.around[*n].is_empty()) {
            node_hash.nodes.entry(node_hash.cell(shaping.nodes[n])).or_default().push(n as u32);
        }
        node_hash
    }

    /// The cell of a position.
    fn cell(&self, p: Vec3) -> HashCell {
        p.map(|x| (x / self.edge).floor() as i64)
    }

    /// The nodes of all triangles that may meet one within a box.
    pub fn near(&self, within: &Aabb) -> Vec<u32> {
        let (lo, hi) = (self.cell(within.min), self.cell(within.max));
        let mut found = Vec::new();
        for z in lo[2] - 1..=hi[2] + 1 {
            for y in lo[1] - 1..=hi[1] + 1 {
                for x in lo[0] - 1..=hi[0] + 1 {
                    found.extend(self.nodes.get(&[x, y, z]).into_iter().flatten());
                }
            }
        }
        found
    }

    /// The nodes of all triangles that may meet one at these nodes.
    pub fn near_to(&self, nodes: &[u32], shaping: &Shaping) -> Vec<u32> {
        let mut at: Vec<HashCell> = nodes.iter().map(|n| self.cell(shaping.nodes[*n as usize])).collect();
        at.sort_unstable();
        at.dedup();
        let middle = |c: HashCell| c.map(|i| (i as f64 + 0.5) * self.edge);
        let mut near: Vec<u32> = at.into_iter().flat_map(|c| self.near(&Aabb::EMPTY.with(middle(c)))).collect();
        near.extend(nodes);
        near.sort_unstable();
        near.dedup();
        near
    }
}

impl Shaping<'_> {
    /// The number of pairs of triangles that cross among those of the boundary at some nodes.
    pub(super) fn crossings(&self, nodes: &[u32]) -> usize {
        self_intersections(&self.boundary_at(nodes).0, COUNTED)
    }

    /// The nodes of triangles that cross others among those of the boundary at some nodes.
    pub(super) fn crossing_nodes(&self, nodes: &[u32]) -> Vec<u32> {
        let (mesh, numbers) = self.boundary_at(nodes);
        let pairs = near_pairs(&mesh, 0.0, |i, j| meet(&mesh, i, j).then_some([i, j]));
        let triangles = pairs.into_iter().flatten().map(|t| mesh.triangles[t]);
        let mut found: Vec<u32> = triangles.flat_map(|t| t.map(|n| numbers[n as usize])).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The triangles of the boundary at some nodes, and the nodes that are their vertices.
    fn boundary_at(&self, nodes: &[u32]) -> (Mesh, Vec<u32>) {
        let near: FxHashSet<u32> = nodes.iter().copied().collect();
        let mut at: Vec<u32> = nodes.iter().flat_map(|n| &self.around[*n as usize]).copied().collect();
        at.sort_unstable();
        at.dedup();
        let faces = at.into_iter().flat_map(|t| FACES.map(|f| (f.map(|k| self.tets[t as usize][k]), t)));
        // All tetrahedra of a face at one of these nodes are among them.
        let whole = |f: &[u32; 3]| f.iter().all(|n| self.on[*n as usize] != 0) && f.iter().any(|n| near.contains(n));
        let mut faces: Vec<([u32; 3], u32)> = faces.filter(|(face, _)| whole(face)).collect();
        faces.iter_mut().for_each(|(face, _)| face.sort_unstable());
        faces.sort_unstable();
        let of = |t: u32| self.domain[t as usize];
        let bounding = faces.chunk_by(|a, b| a.0 == b.0).filter(|f| f.len() == 1 || of(f[0].1) != of(f[1].1));
        let (mut numbers, mut known) = (Vec::new(), FxHashMap::default());
        let mut number = |n: u32| {
            *known.entry(n).or_insert_with(|| {
                numbers.push(n);
                numbers.len() as u32 - 1
            })
        };
        let triangles = bounding.map(|same| same[0].0.map(&mut number)).collect();
        let vertices = numbers.iter().map(|n| self.nodes[*n as usize]).collect();
        (Mesh { vertices, triangles }, numbers)
    }
}
