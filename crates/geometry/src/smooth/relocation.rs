//! Relocations: a vertex moves within its face.

use super::working_mesh::{GAIN, WorkingMesh, faces, normal, sine};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::edited_mesh::single;

/// The shares of the way to a target that are tried.
const STEPS: [f64; 3] = [1.0, 0.5, 0.25];

impl WorkingMesh {
    /// Moves a vertex if that improves the triangles around it and is allowed.
    pub fn relocate(&mut self, v: u32) -> bool {
        if self.mesh.kept_at[v as usize] > 0 {
            return false;
        }
        let ring = self.ring(v);
        let x = self.mesh.at(v);
        let slope = self.slope(&ring);
        let worst = |work: &WorkingMesh, p: Vec3| {
            let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
            pairs.map(|(a, b)| sine([p, work.mesh.at(*a), work.mesh.at(*b)])).fold(f64::INFINITY, f64::min)
        };
        let now = worst(self, x);
        let flat = self.is_flat(x, &ring, slope);
        let owed = if flat { 0.0 } else { self.payable(x, &ring, slope, self.owed[v as usize]) };
        let mut best = (GAIN * now, None);
        for target in self.targets(x, &ring, slope) {
            for share in STEPS {
                let p = add(x, scale(sub(target, x), share));
                let p = self.balanced(p, x, slope, owed);
                let p = single(self.on_axis_planes(p, x, &ring));
                let made = worst(self, p);
                if made > best.0 {
                    best = (made, Some(p));
                }
            }
        }
        best.1.is_some_and(|p| self.place(v, &ring, p, slope))
    }

    /// The middle of the ring, and the place from which the edge that is seen at the smallest angle is seen at 60 degrees.
    fn targets(&self, x: Vec3, ring: &[u32], slope: Vec3) -> [Vec3; 2] {
        let middle = ring.iter().fold([0.0; 3], |s, r| add(s, self.mesh.at(*r)));
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        let ends = pairs.map(|(a, b)| [self.mesh.at(*a), self.mesh.at(*b)]);
        let poorest = ends.min_by(|s, t| sine([x, s[0], s[1]]).total_cmp(&sine([x, t[0], t[1]])));
        let above = poorest.map_or(x, |[a, b]| {
            let inward = unit(cross(slope, sub(b, a)));
            add(scale(add(a, b), 0.5), scale(inward, 0.75f64.sqrt() * norm(sub(b, a))))
        });
        [scale(middle, 1.0 / ring.len() as f64), above]
    }

    /// Puts a vertex with this ring at `p` if its triangles then neither turn too far nor meet others.
    pub fn place(&mut self, v: u32, ring: &[u32], p: Vec3, slope: Vec3) -> bool {
        let x = self.mesh.at(v);
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        let new: Vec<_> = pairs.map(|(a, b)| ([v, *a, *b], [p, self.mesh.at(*a), self.mesh.at(*b)])).collect();
        if !new.iter().all(|(_, t)| faces(normal(*t), slope, normal([x, t[1], t[2]]))) {
            return false;
        }
        let fan = self.fan(v);
        if !self.mesh.is_clear(fan.iter().copied(), new, false) {
            return false;
        }
        self.owed[v as usize] -= dot(slope, sub(p, x)) / 6.0;
        self.mesh.positions[v as usize] = p;
        self.mesh.refit(fan);
        true
    }
}
