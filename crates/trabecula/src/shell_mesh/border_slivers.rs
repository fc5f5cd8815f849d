//! Short edges at the border of a shell, merged: where the region's boundary cuts a triangle off by a corner.

use std::collections::BTreeSet;

use geometry::math::{Aabb, Vec3, add, cross, dot, norm, sub};
use geometry::mesh::Mesh;

use super::{border, planes};

/// Edges at the border that are shorter than this share of the grid spacing are merged.
const SHORT: f64 = 0.2;
/// Cosine of the most that a triangle may be turned from the mean of those about the edge.
const TURN: f64 = 0.7;

/// Merges the ends of short edges at the border, where the mesh stays a manifold, no triangle lies across the others, and the border
/// stays on its bounding planes and keeps its corners on two of them.
pub(super) fn merge(mesh: &mut Mesh, bounds: &Aabb, edge: f64) {
    let mut about: Vec<BTreeSet<u32>> = vec![BTreeSet::new(); mesh.vertices.len()];
    for (t, corners) in (0..).zip(&mesh.triangles) {
        corners.iter().for_each(|v| _ = about[*v as usize].insert(t));
    }
    let outer: BTreeSet<[u32; 2]> =
        border(&mesh.triangles).into_iter().map(|(t, k)| ends(mesh.triangles[t as usize], k as usize)).collect();
    let mut on_border = vec![false; mesh.vertices.len()];
    outer.iter().flatten().for_each(|v| on_border[*v as usize] = true);
    let on: Vec<u8> =
        (0..on_border.len()).map(|v| if on_border[v] { planes(mesh.vertices[v], bounds) } else { 0 }).collect();
    let mut work = BorderMesh { mesh, about, outer, on_border, on };
    let all = 0..work.mesh.triangles.len() as u32;
    for t in all {
        // Until the triangle has no edge to merge, or is merged away itself.
        while let Some([from, to]) = work.short(t, SHORT * edge) {
            work.collapse(from, to);
        }
    }
    work.mesh.triangles.retain(|t| t[0] != u32::MAX);
    *mesh = compact(mesh);
}

/// An edge by its ends, the lower one first.
fn ends(t: [u32; 3], k: usize) -> [u32; 2] {
    let (a, b) = (t[k], t[(k + 1) % 3]);
    [a.min(b), a.max(b)]
}

struct BorderMesh<'a> {
    mesh: &'a mut Mesh,
    /// The triangles about each vertex.
    about: Vec<BTreeSet<u32>>,
    outer: BTreeSet<[u32; 2]>,
    on_border: Vec<bool>,
    /// The bounding planes that each vertex of the border is on.
    on: Vec<u8>,
}

impl BorderMesh<'_> {
    fn at(&self, v: u32) -> Vec3 {
        self.mesh.vertices[v as usize]
    }

    /// The vertices that have an edge with `v`.
    fn around(&self, v: u32) -> BTreeSet<u32> {
        let of = self.about[v as usize].iter().flat_map(|t| self.mesh.triangles[*t as usize]);
        of.filter(|w| *w != v).collect()
    }

    /// The shortest edge of a triangle, if it is at the border, shorter than `least` and may be merged: the end that goes and the one that
    /// stays.
    fn short(&self, t: u32, least: f64) -> Option<[u32; 2]> {
        let corners = self.mesh.triangles[t as usize];
        if corners[0] == u32::MAX {
            return None;
        }
        let long = |k: usize| norm(sub(self.at(corners[(k + 1) % 3]), self.at(corners[k])));
        let k = (0..3).fold(0, |m, k| if long(k) < long(m) { k } else { m });
        if long(k) >= least {
            return None;
        }
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        [[a, b], [b, a]].into_iter().find(|pair| self.may(*pair, ends(corners, k)))
    }

    /// Whether `from` may become `to`.
    fn may(&self, [from, to]: [u32; 2], edge: [u32; 2]) -> bool {
        let is_outer = self.outer.contains(&edge);
        if !self.on_border[to as usize] || (self.on_border[from as usize] && !is_outer) {
            return false;
        }
        // What leaves a plane would take the border with it.
        if self.on[from as usize] & !self.on[to as usize] != 0 {
            return false;
        }
        let common = self.around(from).intersection(&self.around(to)).count();
        if common != if is_outer { 1 } else { 2 } {
            return false;
        }
        // Slivers have no normal to speak of: all are held against the mean one.
        let normal = |corners: [u32; 3], moved: bool| {
            let [p, q, r] = corners.map(|v| self.at(if moved && v == from { to } else { v }));
            cross(sub(q, p), sub(r, p))
        };
        let both = self.about[from as usize].union(&self.about[to as usize]);
        let mean = both.fold([0.0; 3], |sum, t| add(sum, normal(self.mesh.triangles[*t as usize], false)));
        self.about[from as usize].iter().all(|t| {
            let corners = self.mesh.triangles[*t as usize];
            let after = normal(corners, true);
            corners.contains(&to) || dot(mean, after) > TURN * norm(mean) * norm(after)
        })
    }

    fn collapse(&mut self, from: u32, to: u32) {
        for w in self.around(from) {
            if self.outer.remove(&[from.min(w), from.max(w)]) && w != to {
                self.outer.insert([to.min(w), to.max(w)]);
            }
        }
        for t in std::mem::take(&mut self.about[from as usize]) {
            let corners = self.mesh.triangles[t as usize];
            if corners.contains(&to) {
                corners.iter().for_each(|v| _ = self.about[*v as usize].remove(&t));
                self.mesh.triangles[t as usize] = [u32::MAX; 3];
            } else {
                self.mesh.triangles[t as usize] = corners.map(|v| if v == from { to } else { v });
                self.about[to as usize].insert(t);
            }
        }
    }
}

/// The mesh without vertices that no triangle has.
fn compact(mesh: &Mesh) -> Mesh {
    let mut names = vec![u32::MAX; mesh.vertices.len()];
    let mut out = Mesh::default();
    for t in &mesh.triangles {
        out.triangles.push(t.map(|v| {
            let name = &mut names[v as usize];
            if *name == u32::MAX {
                *name = out.vertices.len() as u32;
                out.vertices.push(mesh.vertices[v as usize]);
            }
            *name
        }));
    }
    out
}
