//! A closed or open mesh in the course of being changed edge by edge: its positions and adjacency, the edges that stay, and whether new
//! triangles would meet others.

use super::half_edge_mesh::{HalfEdgeMesh, NONE, next, prev};
use super::kept_edges;
use super::refit_tree::{Bounds, Prism, Query, RefitTree};
use crate::math::Vec3;

/// A position in single precision, so that a file of either precision holds what was tested; −0 is 0.
pub fn single(p: Vec3) -> Vec3 {
    p.map(|x| f64::from(x as f32) + 0.0)
}

/// A mesh that is being changed. Its vertices keep their numbers, and collapsed triangles theirs.
pub struct EditedMesh {
    /// Positions, numbers of single precision.
    pub positions: Vec<Vec3>,
    /// Adjacency.
    pub half_edges: HalfEdgeMesh,
    /// For each half-edge, whether its edge stays.
    pub kept: Vec<bool>,
    /// For each vertex, the number of its edges that stay.
    pub kept_at: Vec<u8>,
    /// Triangles left.
    pub count: usize,
    tree: RefitTree,
    /// Triangles when the tree was built.
    indexed: usize,
    // Scratch of one test, kept to save allocations.
    mark: Vec<u32>,
    marked: u32,
    prisms: Vec<Prism>,
    query: Query,
}

/// What surrounds an edge: the loop of vertices opposite to its ends, and the triangles between.
#[derive(Default)]
pub struct EdgeRing {
    /// The loop, counter-clockwise, from the corner left of the edge on.
    pub ring: Vec<u32>,
    /// The half-edge of each triangle from one vertex of the loop to the next.
    pub outer: Vec<u32>,
    /// Where in the loop the corner right of the edge is: triangles before it have the edge's first end.
    pub turn: usize,
}

impl EditedMesh {
    /// Starts from linked triangles.
    pub fn new(half_edges: HalfEdgeMesh, positions: Vec<Vec3>, kept: Vec<bool>) -> EditedMesh {
        let count = half_edges.triangles.len();
        let mut mesh = EditedMesh {
            kept_at: kept_edges::count(&half_edges, &kept, positions.len()),
            positions,
            half_edges,
            kept,
            count,
            tree: RefitTree::new(0, &[], |_| Bounds::of(&[])),
            indexed: 0,
            mark: vec![0; count],
            marked: 0,
            prisms: Vec::new(),
            query: Query::default(),
        };
        mesh.rebuild_tree();
        mesh
    }

    /// Rebuilds the tree: its boxes have grown and hold collapsed triangles.
    fn rebuild_tree(&mut self) {
        let triangles = &self.half_edges.triangles;
        let live: Vec<u32> = (0..triangles.len() as u32).filter(|t| triangles[*t as usize][0] != NONE).collect();
        let positions = &self.positions;
        self.tree =
            RefitTree::new(triangles.len(), &live, |t| Bounds::of(&triangles[t].map(|v| positions[v as usize])));
        self.indexed = live.len();
    }

    /// The position of a vertex.
    #[inline]
    pub fn at(&self, v: u32) -> Vec3 {
        self.positions[v as usize]
    }

    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, t: u32) -> [Vec3; 3] {
        self.half_edges.triangles[t as usize].map(|v| self.at(v))
    }

    /// The vertex opposite to a half-edge in its triangle.
    pub fn opposite(&self, h: u32) -> u32 {
        self.half_edges.to(next(h))
    }

    /// Whether the edge from `a` to `b` exists.
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.half_edges.leaving(a).any(|h| self.half_edges.to(h) == b)
    }

    /// Whether a collapse of the edge would make one of two edges that stay.
    pub fn joins_kept(&self, h: u32) -> bool {
        let kept = |e: u32| self.kept[e as usize];
        [h, self.half_edges.twin(h)].iter().any(|e| kept(next(*e)) && kept(prev(*e)))
    }

    /// Fills in what surrounds an edge; false if a collapse would not leave a closed manifold, or the loop is longer than `most`.
    pub fn ring_of_edge(&self, h: u32, most: usize, of: &mut EdgeRing) -> bool {
        let g = self.half_edges.twin(h);
        of.ring.clear();
        of.outer.clear();
        for (start, end) in [(h, g), (g, h)] {
            // About the vertex that `start` leaves, from the corner left of it on.
            let mut e = self.half_edges.turned(start);
            let stop = next(end);
            while e != stop {
                let r = self.half_edges.to(e);
                if of.ring.len() == most || of.ring.contains(&r) {
                    return false;
                }
                of.ring.push(r);
                of.outer.push(next(e));
                e = self.half_edges.turned(e);
            }
            if start == h {
                of.turn = of.ring.len();
            }
        }
        of.ring.len() >= 3 && of.turn > 0 && of.turn < of.ring.len()
    }

    /// Whether the edge to vertex `i` of the ring would stay when the ring's edge is collapsed.
    pub fn is_kept_spoke(&self, of: &EdgeRing, i: usize) -> bool {
        let spoke = prev(of.outer[i]);
        // At the two corners opposite the edge, two edges become one.
        let other = if i == 0 || i == of.turn { prev(self.half_edges.twin(spoke)) } else { spoke };
        self.kept[spoke as usize] || self.kept[other as usize]
    }

    /// Whether new triangles, given by vertices and positions, meet no triangle that stays when the `old` ones go; nor each other, unless they
    /// are known to be `disjoint`. They may share vertices and edges.
    pub fn is_clear(
        &mut self,
        old: impl IntoIterator<Item = u32>,
        new: impl IntoIterator<Item = ([u32; 3], [Vec3; 3])>,
        disjoint: bool,
    ) -> bool {
        self.prisms.clear();
        let mut all = Bounds::of(&[]);
        for (names, positions) in new {
            let prism = Prism::new(names, positions);
            if !disjoint && self.prisms.iter().any(|p| p.meets(names, positions, &prism.bounds)) {
                return false;
            }
            all.grow(&prism.bounds);
            self.prisms.push(prism);
        }
        self.marked += 1;
        for t in old {
            self.mark[t as usize] = self.marked;
        }
        let stays = |t: u32| self.mark[t as usize] != self.marked;
        let mesh = (&self.half_edges.triangles[..], &self.positions[..]);
        !self.tree.meets(&self.prisms, &all, mesh, stays, &mut self.query)
    }

    /// Collapses an edge into its first end, then at `p`. The caller has found its ring and refits the ring's triangles.
    pub fn collapse(&mut self, h: u32, p: Vec3) {
        let g = self.half_edges.twin(h);
        let u = self.half_edges.from(h);
        let wings = [self.opposite(h), self.opposite(g)];
        // Of each of the two triangles that go, two edges become one, which is kept if one of them was.
        for e in [h, g] {
            let pair = [next(e), prev(e)].map(|s| self.half_edges.twin(s));
            let kept = pair.iter().any(|s| self.kept[*s as usize]);
            pair.iter().for_each(|s| self.kept[*s as usize] = kept);
        }
        self.half_edges.collapse(h);
        self.count -= 2;
        self.positions[u as usize] = p;
        for w in [u, wings[0], wings[1]] {
            let kept = self.half_edges.leaving(w).filter(|e| self.kept[*e as usize]).count();
            self.kept_at[w as usize] = kept.min(255) as u8;
        }
    }

    /// Makes the tree hold triangles that have changed.
    pub fn refit(&mut self, changed: impl IntoIterator<Item = u32>) {
        for t in changed {
            let bounds = Bounds::of(&self.corners(t));
            self.tree.grow(t as usize, &bounds);
        }
        if 4 * self.count < 3 * self.indexed {
            self.rebuild_tree();
        }
    }
}
