//! The mesh while its triangles are improved: what a change needs to know.

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::edited_mesh::EditedMesh;
use crate::remesh::half_edge_mesh::HalfEdgeMesh;
use crate::remesh::kept_edges;

/// A change is worth it if the smallest angle's sine grows by this factor.
pub const GAIN: f64 = 1.02;
/// Cosine of the most, 45 degrees, that a triangle may turn against the face that it stands for.
const TURN: f64 = 0.707;
/// Cosine of the most, 20 degrees, that it may turn against the triangle that it replaces, where the face turns more by itself.
const TURN_OF_ONE: f64 = 0.94;

/// A mesh in the course of being smoothed.
pub struct WorkingMesh {
    /// The mesh as it is now.
    pub mesh: EditedMesh,
    /// For each vertex, the volume (mm³) that changes have taken and it is to give back.
    pub owed: Vec<f64>,
    /// For each triangle, whether it is a cut.
    pub cut: Vec<bool>,
    /// What rounding moves a coordinate by at most, mm.
    pub rounding: f64,
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

impl WorkingMesh {
    /// Starts from linked triangles.
    pub fn new(half_edges: HalfEdgeMesh, positions: Vec<Vec3>, cut: &[bool], rounding: f64) -> WorkingMesh {
        let kept = kept_edges::kept(&half_edges, &positions, cut);
        let owed = vec![0.0; positions.len()];
        WorkingMesh { mesh: EditedMesh::new(half_edges, positions, kept), owed, cut: cut.to_vec(), rounding }
    }

    /// The vertices around `v`, counter-clockwise.
    pub fn ring(&self, v: u32) -> Vec<u32> {
        self.mesh.half_edges.leaving(v).map(|h| self.mesh.half_edges.to(h)).collect()
    }

    /// Six times the derivative of the volume by the position of a vertex with this ring: its direction is outward.
    pub fn slope(&self, ring: &[u32]) -> Vec3 {
        let o = self.mesh.at(ring[0]);
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        pairs.fold([0.0; 3], |g, (a, b)| add(g, cross(sub(self.mesh.at(*a), o), sub(self.mesh.at(*b), o))))
    }

    /// Whether a vertex at `p` and its ring lie in the plane normal to `slope` but for rounding.
    pub fn is_flat(&self, p: Vec3, ring: &[u32], slope: Vec3) -> bool {
        let n = unit(slope);
        ring.iter().all(|r| dot(sub(self.mesh.at(*r), p), n).abs() <= 4.0 * self.rounding)
    }

    /// `p` with those coordinates of `from` that its whole ring shares: a face normal to an axis stays so to the last bit.
    pub fn on_axis_planes(&self, mut p: Vec3, from: Vec3, ring: &[u32]) -> Vec3 {
        for k in 0..3 {
            if ring.iter().all(|r| self.mesh.at(*r)[k] == from[k]) {
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
        let height = ring.iter().map(|r| dot(sub(self.mesh.at(*r), p), n).abs()).fold(0.0, f64::max);
        let most = height / 4.0 * norm(slope) / 6.0;
        owed.clamp(-most, most)
    }

    /// The triangles around `v`, in the order of its ring.
    pub fn fan(&self, v: u32) -> Vec<u32> {
        self.mesh.half_edges.leaving(v).map(|h| h / 3).collect()
    }
}
