//! Merges: the two ends of a short edge become one vertex.

use super::working_mesh::{GAIN, WorkingMesh, faces, normal, rounded, sine};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::half_edge_mesh::{next, prev};

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

/// What surrounds an edge: the loop of vertices opposite to its ends, and the triangles between.
struct Patch {
    /// The loop, counter-clockwise, from the corner left of the edge on.
    ring: Vec<u32>,
    /// The half-edge of each triangle from one vertex of the loop to the next.
    outer: Vec<u32>,
    /// Where in the loop the corner right of the edge is: triangles before it have the edge's first end.
    turn: usize,
}

impl WorkingMesh {
    /// Merges the ends of an edge if that improves the triangles around it and is allowed.
    pub fn merge(&mut self, h: u32) -> bool {
        let g = self.half_edges.twin(h);
        let (u, v) = (self.half_edges.from(h), self.half_edges.from(g));
        let negligible = self.is_negligible(h);
        let Some(patch) = self.patch(h, negligible) else { return false };
        let slope = self.slope(&patch.ring);
        let before = self.worst_of(&patch, h);
        let mut best = (before * if negligible { LEFT } else { GAIN }, None);
        for p in self.candidates(h, &patch, slope, negligible) {
            let pairs = patch.ring.iter().zip(patch.ring.iter().cycle().skip(1));
            let made = pairs.map(|(a, b)| sine([p, self.at(*a), self.at(*b)])).fold(f64::INFINITY, f64::min);
            let keeps = || negligible || (self.keeps_sharp_edges(h, p) && self.keeps_faces(h, &patch, p));
            if made > best.0 && keeps() {
                best = (made, Some(p));
            }
        }
        let Some(p) = best.1 else { return false };
        let mut old: Vec<u32> = patch.outer.iter().map(|e| e / 3).collect();
        old.extend([h / 3, g / 3]);
        let pairs = patch.ring.iter().zip(patch.ring.iter().cycle().skip(1));
        let new: Vec<_> = pairs.map(|(a, b)| ([u, *a, *b], [p, self.at(*a), self.at(*b)])).collect();
        if !self.is_clear(&old, &new) {
            return false;
        }
        let gained = self.gained(&patch, [u, v], p);
        self.join(h, p);
        self.refit(patch.outer.iter().map(|e| e / 3));
        let owed = self.owed[u as usize] + self.owed[v as usize] - gained;
        (self.owed[u as usize], self.owed[v as usize]) = (0.0, 0.0);
        if self.kept_at[u as usize] == 0 {
            self.owed[u as usize] = owed;
        } else {
            self.owe(owed, &patch.ring);
        }
        true
    }

    /// The loop about an edge; `None` if merging would not leave a closed manifold, or two sharp edges would become one.
    fn patch(&self, h: u32, negligible: bool) -> Option<Patch> {
        let g = self.half_edges.twin(h);
        let kept = |e: u32| self.kept[e as usize];
        if !negligible && [h, g].iter().any(|e| kept(next(*e)) && kept(prev(*e))) {
            return None;
        }
        let mut patch = Patch { ring: Vec::with_capacity(12), outer: Vec::with_capacity(12), turn: 0 };
        for (start, end) in [(h, g), (g, h)] {
            let mut e = self.half_edges.turned(start);
            let stop = next(end);
            while e != stop {
                let r = self.half_edges.to(e);
                if patch.ring.contains(&r) || patch.ring.len() == CROWD {
                    return None;
                }
                patch.ring.push(r);
                patch.outer.push(next(e));
                e = self.half_edges.turned(e);
            }
            if start == h {
                patch.turn = patch.ring.len();
            }
        }
        (patch.ring.len() >= 3 && patch.turn > 0 && patch.turn < patch.ring.len()).then_some(patch)
    }

    fn worst_of(&self, patch: &Patch, h: u32) -> f64 {
        let ends = [h / 3, self.half_edges.twin(h) / 3];
        let all = patch.outer.iter().map(|e| e / 3).chain(ends);
        all.map(|t| sine(self.corners(t))).fold(f64::INFINITY, f64::min)
    }

    /// Whether the edge is negligible in its triangle.
    fn is_negligible(&self, h: u32) -> bool {
        let square = |e: u32| {
            let d = sub(self.at(self.half_edges.to(e)), self.at(self.half_edges.from(e)));
            dot(d, d)
        };
        square(h) <= NEGLIGIBLE * NEGLIGIBLE * square(next(h))
    }

    /// Whether `p` is in the planes of all cuts around `v`.
    fn is_in_cuts(&self, v: u32, p: Vec3) -> bool {
        let x = self.at(v);
        self.half_edges.leaving(v).map(|h| h / 3).filter(|t| self.cut[*t as usize]).all(|t| {
            let n = unit(normal(self.corners(t)));
            dot(sub(p, x), n).abs() <= 4.0 * self.rounding
        })
    }

    /// Where the merged vertex may be: on sharp edges and planes one of the two, else also between them, the volume kept.
    fn candidates(&self, h: u32, patch: &Patch, slope: Vec3, negligible: bool) -> Vec<Vec3> {
        let ends = [self.half_edges.from(h), self.half_edges.to(h)];
        let [p, q] = ends.map(|w| self.at(w));
        let along = self.kept[h as usize];
        match ends.map(|w| self.kept_at[w as usize]) {
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
            self.is_flat(self.at(w), &ring, self.slope(&ring))
        });
        match flat {
            [true, false] => return vec![p],
            [false, true] => return vec![q],
            _ => {}
        }
        let middle = scale(add(p, q), 0.5);
        if flat == [true, true] {
            return [middle, p, q].map(|w| rounded(self.on_axis_planes(w, p, &patch.ring))).to_vec();
        }
        // The volume is linear in the vertex: what a candidate gains is taken back along its derivative.
        let owed: f64 = ends.iter().map(|w| self.owed[*w as usize]).sum();
        let owed = self.payable(middle, &patch.ring, slope, owed);
        let balanced = |w: Vec3| {
            let gained = self.gained(patch, ends, w);
            rounded(self.on_axis_planes(self.balanced(w, w, slope, owed - gained), w, &patch.ring))
        };
        [middle, p, q].map(balanced).to_vec()
    }

    /// The volume that the fan about `w` has more than the patch, mm³.
    fn gained(&self, patch: &Patch, [u, v]: [u32; 2], w: Vec3) -> f64 {
        let o = self.at(patch.ring[0]);
        let [u, v, w] = [self.at(u), self.at(v), w].map(|p| sub(p, o));
        let m = patch.ring.len();
        let mut six = 0.0;
        for i in 0..m {
            let c = cross(sub(self.at(patch.ring[i]), o), sub(self.at(patch.ring[(i + 1) % m]), o));
            six += dot(sub(w, if i < patch.turn { u } else { v }), c);
        }
        // The triangle u v x has x in the origin; v u y remains.
        let y = sub(self.at(patch.ring[patch.turn]), o);
        (six - dot(y, cross(v, u))) / 6.0
    }

    /// Whether the sharp edges through the ends stay where they are, to a share of their length, with the merged vertex at `p`.
    fn keeps_sharp_edges(&self, h: u32, p: Vec3) -> bool {
        if !self.kept[h as usize] {
            return true;
        }
        let (u, v) = (self.half_edges.from(h), self.half_edges.to(h));
        [(u, v), (v, u)].iter().all(|(a, b)| {
            let x = self.at(*a);
            let on = |e: &u32| self.kept[*e as usize] && self.half_edges.to(*e) != *b;
            x == p
                || self.half_edges.leaving(*a).filter(on).all(|e| {
                    let end = self.at(self.half_edges.to(e));
                    let (along, off) = (sub(end, p), sub(x, p));
                    let share = dot(off, along) / dot(along, along);
                    (0.0..=1.0).contains(&share) && norm(sub(off, scale(along, share))) <= GAP * norm(along)
                })
        })
    }

    /// Whether the triangles about `p` face as the faces that they stand for do, from one sharp edge to the next.
    fn keeps_faces(&self, h: u32, patch: &Patch, p: Vec3) -> bool {
        let m = patch.ring.len();
        let spoke = |i: usize| {
            let spoke = prev(patch.outer[i]);
            // At the two corners opposite the edge, two edges of the patch become one.
            let other = if i == 0 || i == patch.turn { prev(self.half_edges.twin(spoke)) } else { spoke };
            self.kept[spoke as usize] || self.kept[other as usize]
        };
        let first = (0..m).find(|i| spoke(*i)).unwrap_or(0);
        let ends = [h, self.half_edges.twin(h)].map(|e| normal(self.corners(e / 3)));
        let mut face = if first == 0 && !spoke(0) { add(ends[0], ends[1]) } else { [0.0; 3] };
        let mut turned: Vec<[Vec3; 2]> = Vec::with_capacity(m);
        for i in (first..first + m).map(|i| i % m) {
            if i != first && spoke(i) {
                if !turned.drain(..).all(|[new, old]| faces(new, face, old)) {
                    return false;
                }
                face = [0.0; 3];
            }
            let old = normal(self.corners(patch.outer[i] / 3));
            face = add(face, old);
            let [a, b] = [i, (i + 1) % m].map(|k| self.at(patch.ring[k]));
            turned.push([normal([p, a, b]), old]);
        }
        turned.drain(..).all(|[new, old]| faces(new, face, old))
    }

    /// Merges the ends of the edge into its first, at `p`.
    fn join(&mut self, h: u32, p: Vec3) {
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
            self.recount(w);
        }
    }
}
