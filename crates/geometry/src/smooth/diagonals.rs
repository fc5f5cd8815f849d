//! Flips: the other diagonal of two adjacent triangles.

use super::working_mesh::{GAIN, WorkingMesh, faces, normal, sine};
use crate::math::{add, cross, dot, norm, sub};
use crate::remesh::half_edge_mesh::{next, prev};

/// Most distance between the two diagonals, as a share of the new one: what a chord of 45 degrees leaves.
const GAP: f64 = 0.1;

impl WorkingMesh {
    /// Flips an edge if that improves its two triangles and is allowed.
    pub fn flip(&mut self, h: u32) -> bool {
        let g = self.mesh.half_edges.twin(h);
        if self.mesh.kept[h as usize] {
            return false;
        }
        let (a, b) = (self.mesh.half_edges.from(h), self.mesh.half_edges.from(g));
        let (c, d) = (self.mesh.opposite(h), self.mesh.opposite(g));
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.mesh.at(v));
        let (old, new) = ([[pa, pb, pc], [pb, pa, pd]], [[pd, pc, pa], [pc, pd, pb]]);
        let worst = |of: [[_; 3]; 2]| sine(of[0]).min(sine(of[1]));
        if worst(new) <= GAIN * worst(old) {
            return false;
        }
        let face = add(normal(old[0]), normal(old[1]));
        if !new.iter().all(|t| faces(normal(*t), face, face)) {
            return false;
        }
        let (across, along) = (sub(pd, pc), cross(sub(pb, pa), sub(pd, pc)));
        let six = dot(sub(pc, pa), along);
        if six.abs() > GAP * norm(across) * norm(along) {
            return false;
        }
        let few = |v: u32| self.mesh.half_edges.leaving(v).take(4).count() < 4;
        if few(a) || few(b) || self.mesh.has_edge(c, d) {
            return false;
        }
        if !self.mesh.is_clear([h / 3, g / 3], [([d, c, a], new[0]), ([c, d, b], new[1])], false) {
            return false;
        }
        let outer = [prev(h), next(g), prev(g), next(h)].map(|e| self.mesh.kept[e as usize]);
        self.mesh.half_edges.flip(h);
        for (e, kept) in [next(h), prev(h), next(g), prev(g)].into_iter().zip(outer) {
            self.mesh.kept[e as usize] = kept;
        }
        self.mesh.refit([h / 3, g / 3]);
        // The tetrahedron between the two surfaces.
        self.owe(-dot(sub(pd, pa), cross(sub(pb, pa), sub(pc, pa))) / 6.0, &[a, b, c, d]);
        true
    }
}
