//! Merges: the two ends of a short edge become one vertex.

use super::working_mesh::{GAIN, WorkingMesh, faces, normal, sine};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::edited_mesh::{EdgeRing, single};
use crate::remesh::half_edge_mesh::next;

/// Most triangles around a vertex.
const CROWD: usize = 24;
/// Most distance of a vertex that is merged away from the sharp edge without it, as a share of the edge that replaces it.
const GAP: f64 = 0.05;

/// An edge is negligible if it is shorter than this share of another side of its triangle: merging moves the surface by no more
/// than its length, so that neither faces nor sharp edges are tested.
const NEGLIGIBLE: f64 = 0.02;
/// What a merge of a negligible edge may leave of the smallest angle's sine: of several needles at one place the first to go
/// may leave the next one thinner.
const LEFT: f64 = 0.5;

impl WorkingMesh {
    /// Merges the ends of an edge if that improves the triangles around it and is allowed.
    pub fn merge(&mut self, h: u32) -> bool {
        let g = self.mesh.half_edges.twin(h);
        let (u, v) = (self.mesh.half_edges.from(h), self.mesh.half_edges.from(g));
        let negligible = self.is_negligible(h);
        let mut patch = EdgeRing::default();
        if !negligible && self.mesh.joins_kept(h) || !self.mesh.ring_of_edge(h, CROWD, &mut patch) {
            return false;
        }
        let slope = self.slope(&patch.ring);
        let before = self.worst_of(&patch, h);
        let mut best = (before * if negligible { LEFT } else { GAIN }, None);
        for p in self.candidates(h, &patch, slope, negligible) {
            let pairs = patch.ring.iter().zip(patch.ring.iter().cycle().skip(1));
            let made = pairs.map(|(a, b)| sine([p, self.mesh.at(*a), self.mesh.at(*b)])).fold(f64::INFINITY, f64::min);
            let keeps = || negligible || (self.keeps_sharp_edges(h, p) && self.keeps_faces(h, &patch, p));
            if made > best.0 && keeps() {
                best = (made, Some(p));
            }
        }
        let Some(p) = best.1 else { return false };
        let old = patch.outer.iter().map(|e| e / 3).chain([h / 3, g / 3]);
        let pairs = patch.ring.iter().zip(patch.ring.iter().cycle().skip(1));
        let new: Vec<_> = pairs.map(|(a, b)| ([u, *a, *b], [p, self.mesh.at(*a), self.mesh.at(*b)])).collect();
        if !self.mesh.is_clear(old, new, false) {
            return false;
        }
        let gained = self.gained(&patch, [u, v], p);
        self.mesh.collapse(h, p);
        self.mesh.refit(patch.outer.iter().map(|e| e / 3));
        let owed = self.owed[u as usize] + self.owed[v as usize] - gained;
        (self.owed[u as usize], self.owed[v as usize]) = (0.0, 0.0);
        if self.mesh.kept_at[u as usize] == 0 {
            self.owed[u as usize] = owed;
        } else {
            self.owe(owed, &patch.ring);
        }
        true
    }

    fn worst_of(&self, patch: &EdgeRing, h: u32) -> f64 {
        let ends = [h / 3, self.mesh.half_edges.twin(h) / 3];
        let all = patch.outer.iter().map(|e| e / 3).chain(ends);
        all.map(|t| sine(self.mesh.corners(t))).fold(f64::INFINITY, f64::min)
    }

    /// Whether the edge is negligible in its triangle.
    fn is_negligible(&self, h: u32) -> bool {
        let square = |e: u32| {
            let d = sub(self.mesh.at(self.mesh.half_edges.to(e)), self.mesh.at(self.mesh.half_edges.from(e)));
            dot(d, d)
        };
        square(h) <= NEGLIGIBLE * NEGLIGIBLE * square(next(h))
    }

    /// Whether `p` is in the planes of all cuts around `v`.
    fn is_in_cuts(&self, v: u32, p: Vec3) -> bool {
        let x = self.mesh.at(v);
        self.mesh.half_edges.leaving(v).map(|h| h / 3).filter(|t| self.cut[*t as usize]).all(|t| {
            let n = unit(normal(self.mesh.corners(t)));
            dot(sub(p, x), n).abs() <= 4.0 * self.rounding
        })
    }

    /// Where the merged vertex may be: on sharp edges and planes one of the two, else also between them, the volume kept.
    fn candidates(&self, h: u32, patch: &EdgeRing, slope: Vec3, negligible: bool) -> Vec<Vec3> {
        let ends = [self.mesh.half_edges.from(h), self.mesh.half_edges.to(h)];
        let [p, q] = ends.map(|w| self.mesh.at(w));
        let along = self.mesh.kept[h as usize];
        match ends.map(|w| self.mesh.kept_at[w as usize]) {
            [0, 0] => {}
            [_, 0] => return vec![p],
            [0, _] => return vec![q],
            [2, 2] if along => return vec![p, q],
            [_, 2] if along => return vec![p],
            [2, _] if along => return vec![q],
            _ if !negligible => return Vec::new(),
            _ => {
                let stays = |from: usize, to: Vec3| self.is_in_cuts(ends[from], to);
                return [(1, p), (0, q)].into_iter().filter(|(from, to)| stays(*from, *to)).map(|c| c.1).collect();
            }
        }
        let flat = ends.map(|w| {
            let ring = self.ring(w);
            self.is_flat(self.mesh.at(w), &ring, self.slope(&ring))
        });
        match flat {
            [true, false] => return vec![p],
            [false, true] => return vec![q],
            _ => {}
        }
        let middle = scale(add(p, q), 0.5);
        if flat == [true, true] {
            return [middle, p, q].map(|w| single(self.on_axis_planes(w, p, &patch.ring))).to_vec();
        }
        // The volume is linear in the vertex: what a candidate gains is taken back along its derivative.
        let owed: f64 = ends.iter().map(|w| self.owed[*w as usize]).sum();
        let owed = self.payable(middle, &patch.ring, slope, owed);
        let balanced = |w: Vec3| {
            let gained = self.gained(patch, ends, w);
            single(self.on_axis_planes(self.balanced(w, w, slope, owed - gained), w, &patch.ring))
        };
        [middle, p, q].map(balanced).to_vec()
    }

    /// The volume that the fan about `w` has more than the patch, mm³.
    fn gained(&self, patch: &EdgeRing, [u, v]: [u32; 2], w: Vec3) -> f64 {
        let o = self.mesh.at(patch.ring[0]);
        let [u, v, w] = [self.mesh.at(u), self.mesh.at(v), w].map(|p| sub(p, o));
        let m = patch.ring.len();
        let mut six = 0.0;
        for i in 0..m {
            let c = cross(sub(self.mesh.at(patch.ring[i]), o), sub(self.mesh.at(patch.ring[(i + 1) % m]), o));
            six += dot(sub(w, if i < patch.turn { u } else { v }), c);
        }
        // The triangle u v x has x in the origin; v u y remains.
        let y = sub(self.mesh.at(patch.ring[patch.turn]), o);
        (six - dot(y, cross(v, u))) / 6.0
    }

    /// Whether the sharp edges through the ends stay where they are, to a share of their length, with the merged vertex at `p`.
    fn keeps_sharp_edges(&self, h: u32, p: Vec3) -> bool {
        if !self.mesh.kept[h as usize] {
            return true;
        }
        let (u, v) = (self.mesh.half_edges.from(h), self.mesh.half_edges.to(h));
        [(u, v), (v, u)].iter().all(|(a, b)| {
            let x = self.mesh.at(*a);
            let on = |e: &u32| self.mesh.kept[*e as usize] && self.mesh.half_edges.to(*e) != *b;
            x == p
                || self.mesh.half_edges.leaving(*a).filter(on).all(|e| {
                    let end = self.mesh.at(self.mesh.half_edges.to(e));
                    let (along, off) = (sub(end, p), sub(x, p));
                    let share = dot(off, along) / dot(along, along);
                    (0.0..=1.0).contains(&share) && norm(sub(off, scale(along, share))) <= GAP * norm(along)
                })
        })
    }

    /// Whether the triangles about `p` face as the faces that they stand for do, from one sharp edge to the next.
    fn keeps_faces(&self, h: u32, patch: &EdgeRing, p: Vec3) -> bool {
        let m = patch.ring.len();
        let spoke = |i: usize| self.mesh.is_kept_spoke(patch, i);
        let first = (0..m).find(|i| spoke(*i)).unwrap_or(0);
        let ends = [h, self.mesh.half_edges.twin(h)].map(|e| normal(self.mesh.corners(e / 3)));
        let mut face = if first == 0 && !spoke(0) { add(ends[0], ends[1]) } else { [0.0; 3] };
        let mut turned: Vec<[Vec3; 2]> = Vec::with_capacity(m);
        for i in (first..first + m).map(|i| i % m) {
            if i != first && spoke(i) {
                if !turned.drain(..).all(|[new, old]| faces(new, face, old)) {
                    return false;
                }
                face = [0.0; 3];
            }
            let old = normal(self.mesh.corners(patch.outer[i] / 3));
            face = add(face, old);
            let [a, b] = [i, (i + 1) % m].map(|k| self.mesh.at(patch.ring[k]));
            turned.push([normal([p, a, b]), old]);
        }
        turned.drain(..).all(|[new, old]| faces(new, face, old))
    }
}
