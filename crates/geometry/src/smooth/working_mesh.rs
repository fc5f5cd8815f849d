//! The mesh while its triangles are improved: what a change needs to know, and whether its triangles meet others.

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::half_edge_mesh::{HalfEdgeMesh, NONE, next};
use crate::remesh::kept_edges;
use crate::remesh::refit_tree::{Bounds, Prism, Query, RefitTree};

/// A change is worth it if the smallest angle's sine grows by this factor.
pub const GAIN: f64 = 1.02;
/// Cosine of the most, 45 degrees, that a triangle may turn against the face that it stands for.
const TURN: f64 = 0.707;
/// Cosine of the most, 20 degrees, that it may turn against the triangle that it replaces, where the face turns more by itself.
const TURN_OF_ONE: f64 = 0.94;

/// A mesh in the course of being smoothed.
pub struct WorkingMesh {
    /// Positions, single-precision numbers.
    pub positions: Vec<Vec3>,
    /// Adjacency.
    pub half_edges: HalfEdgeMesh,
    /// For each half-edge, whether its edge stays.
    pub kept: Vec<bool>,
    /// For each vertex, the number of its edges that stay.
    pub kept_at: Vec<u8>,
    /// For each vertex, the volume (mm³) that changes have taken and it is to give back.
    pub owed: Vec<f64>,
    /// For each triangle, whether it is a cut.
    pub cut: Vec<bool>,
    /// What rounding moves a coordinate by at most, mm.
    pub rounding: f64,
    tree: RefitTree,
    /// Triangles left, and when the tree was built.
    pub count: usize,
    indexed: usize,
    mark: Vec<u32>,
    marked: u32,
    query: Query,
    prisms: Vec<Prism>,
}

/// The sine of the smallest angle of a triangle: 2 area / product of the two longer sides; 0 without area.
pub fn sine([a, b, c]: [Vec3; 3]) -> f64 {
    let (x, y) = (sub(b, a), sub(c, a));
    let mut sides = [dot(x, x), dot(y, y), dot(sub(c, b), sub(c, b))];
    sides.sort_by(f64::total_cmp);
    let longer = (sides[1] * sides[2]).sqrt();
    if longer > 0.0 { norm(cross(x, y)) / longer } else { 0.0 }
}

/// The area vector of a triangle, doubled.
pub fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    cross(sub(b, a), sub(c, a))
}

/// Whether a triangle of this area vector faces as its face does, or as the triangle does that it replaces.
pub fn faces(new: Vec3, face: Vec3, old: Vec3) -> bool {
    let n = unit(new);
    dot(n, unit(face)) >= TURN || dot(n, unit(old)) >= TURN_OF_ONE
}

/// Positions as single precision has them; −0 is 0.
pub fn rounded(p: Vec3) -> Vec3 {
    p.map(|x| f64::from(x as f32) + 0.0)
}

impl WorkingMesh {
    /// Starts from linked triangles.
    pub fn new(half_edges: HalfEdgeMesh, positions: Vec<Vec3>, cut: &[bool], rounding: f64) -> WorkingMesh {
        let n = positions.len();
        let count = half_edges.triangles.len();
        let kept = kept_edges::kept(&half_edges, &positions, cut);
        let kept_at = kept_edges::count(&half_edges, &kept, n);
        let mut work = WorkingMesh {
            positions,
            half_edges,
            kept,
            kept_at,
            owed: vec![0.0; n],
            cut: cut.to_vec(),
            rounding,
            tree: RefitTree::new(0, &[], |_| Bounds::of(&[])),
            count,
            indexed: 0,
            mark: vec![0; count],
            marked: 0,
            query: Query::default(),
            prisms: Vec::new(),
        };
        work.rebuild_tree();
        work
    }

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

    /// The vertices around `v`, counter-clockwise.
    pub fn ring(&self, v: u32) -> Vec<u32> {
        self.half_edges.leaving(v).map(|h| self.half_edges.to(h)).collect()
    }

    /// Six times the derivative of the volume by the position of a vertex with this ring: its direction is outward.
    pub fn slope(&self, ring: &[u32]) -> Vec3 {
        let o = self.at(ring[0]);
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        pairs.fold([0.0; 3], |g, (a, b)| add(g, cross(sub(self.at(*a), o), sub(self.at(*b), o))))
    }

    /// Whether a vertex at `p` and its ring lie in the plane normal to `slope` but for rounding.
    pub fn is_flat(&self, p: Vec3, ring: &[u32], slope: Vec3) -> bool {
        let n = unit(slope);
        ring.iter().all(|r| dot(sub(self.at(*r), p), n).abs() <= 4.0 * self.rounding)
    }

    /// `p` with those coordinates of `from` that its whole ring shares: a face normal to an axis stays so to the last bit.
    pub fn on_axis_planes(&self, mut p: Vec3, from: Vec3, ring: &[u32]) -> Vec3 {
        for k in 0..3 {
            if ring.iter().all(|r| self.at(*r)[k] == from[k]) {
                p[k] = from[k];
            }
        }
        p
    }

    /// `p`, moved along `slope` so that a vertex that goes there from `x` adds the volume `owed` (mm³).
    pub fn balanced(&self, p: Vec3, x: Vec3, slope: Vec3, owed: f64) -> Vec3 {
        let long = dot(slope, slope);
        let off = 6.0 * owed - dot(slope, sub(p, x));
        if long > 0.0 { add(p, scale(slope, off / long)) } else { p }
    }

    /// As much of the volume `owed` (mm³) as a vertex at `p` can give back by moving out of its surface no farther than a chord of
    /// its triangles does: a quarter of its height over its ring.
    pub fn payable(&self, p: Vec3, ring: &[u32], slope: Vec3, owed: f64) -> f64 {
        let n = unit(slope);
        let height = ring.iter().map(|r| dot(sub(self.at(*r), p), n).abs()).fold(0.0, f64::max);
        let most = height / 4.0 * norm(slope) / 6.0;
        owed.clamp(-most, most)
    }

    /// Whether new triangles, in place of the `old` ones, meet neither each other nor any triangle that stays.
    pub fn is_clear(&mut self, old: &[u32], new: &[([u32; 3], [Vec3; 3])]) -> bool {
        self.prisms.clear();
        let mut all = Bounds::of(&[]);
        for (names, positions) in new {
            let prism = Prism::new(*names, *positions);
            let own = |p: &Prism| p.meets(*names, *positions, &prism.bounds);
            if self.prisms.iter().any(own) {
                return false;
            }
            all.grow(&prism.bounds);
            self.prisms.push(prism);
        }
        self.marked += 1;
        for t in old {
            self.mark[*t as usize] = self.marked;
        }
        let stays = |t: u32| self.mark[t as usize] != self.marked;
        let mesh = (&self.half_edges.triangles[..], &self.positions[..]);
        !self.tree.meets(&self.prisms, &all, mesh, stays, &mut self.query)
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

    /// Counts the edges that stay at a vertex anew.
    pub fn recount(&mut self, v: u32) {
        let kept = self.half_edges.leaving(v).filter(|e| self.kept[*e as usize]);
        self.kept_at[v as usize] = kept.count().min(255) as u8;
    }

    /// The triangles around `v`, in the order of its ring.
    pub fn fan(&self, v: u32) -> Vec<u32> {
        self.half_edges.leaving(v).map(|h| h / 3).collect()
    }

    /// Whether the edge from `a` to `b` exists.
    pub fn has_edge(&self, a: u32, b: u32) -> bool {
        self.half_edges.leaving(a).any(|h| self.half_edges.to(h) == b)
    }

    /// The vertex opposite to a half-edge in its triangle.
    pub fn opposite(&self, h: u32) -> u32 {
        self.half_edges.to(next(h))
    }
}
