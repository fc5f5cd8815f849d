//! Refinement of a triangulation to a chord error.
//!
//! An edge that is too far from the surface is flipped before it is bisected: of the two diagonals of a quadrilateral
//! one often follows the surface where the other cuts through it. So triangles become long along straight directions of
//! the surface.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use geometry::progress::checkpoint;
use geometry::roots::{Bracket, Tolerance};

use super::super::complex::QuadricFace;
use super::{EdgeCurve, Facets, edge_key, orientation};

/// A flip must reduce the distance to this fraction at most, so that flipping terminates.
const MIN_GAIN: f64 = 0.8;
/// Maximum number of triangles of a hub.
const MAX_TRIANGLES: usize = 1 << 22;
/// Maximum number of rounds: each bisection divides the distance by about four.
const MAX_ROUNDS: usize = 60;

/// The two triangles at an edge, and the vertices opposite it.
struct Pair {
    one: u32,
    two: u32,
    c: u32,
    d: u32,
}

impl Facets<'_> {
    /// Distance from a nearby point to the surface, to first order, mm.
    #[inline]
    pub(super) fn distance(&self, x: Vec3) -> f64 {
        let (value, slope) = self.hub.gradient(x);
        value.abs() / norm(slope)
    }

    /// Distance from an edge to the surface, at its quarter points, mm.
    pub(super) fn edge_distance(&self, a: u32, b: u32) -> f64 {
        let (p, q) = (self.points[a as usize], self.points[b as usize]);
        [0.25, 0.5, 0.75].map(|s| self.distance(add(scale(p, 1.0 - s), scale(q, s)))).into_iter().fold(0.0, f64::max)
    }

    /// Distance from a triangle's centroid to the surface, mm.
    fn centroid_distance(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(t);
        self.distance(scale(add(a, add(b, c)), 1.0 / 3.0))
    }

    /// The surface point in a direction: on the quadric of a face if that is the surface there.
    fn surface_point(&self, p: Vec3, face: u32) -> Vec3 {
        let hub = self.hub;
        let x = scale(p, self.complex.faces[face as usize].quadric.ray_exit(p));
        if hub.value(x).abs() < 1e-11 * dot(x, x) {
            return x;
        }
        let value = |t: f64| hub.value(scale(p, t));
        // Brackets the first sign change outwards from the position of the chord.
        let (mut lo, mut hi) = (1.0, 1.0);
        while value(lo) > 0.0 {
            lo *= 0.97;
        }
        if lo == 1.0 {
            while value(hi) < 0.0 && hi < 1e3 {
                (lo, hi) = (hi, hi * 1.02);
            }
        } else {
            hi = lo / 0.97;
        }
        let along = |t: f64| {
            let (value, slope) = hub.gradient(scale(p, t));
            [value, dot(slope, p)]
        };
        scale(p, Bracket::of_signs(lo, hi).newton((lo + hi) / 2.0, Tolerance::ROUNDING, along))
    }

    /// Flips or bisects edges, the farthest first, until the quarter points of all edges and the centroids of all
    /// triangles are within the chord error. `None` if the limits are reached. Returns the greatest distance found, end
    /// circles excepted, mm.
    pub(crate) fn refine(&mut self) -> Option<f64> {
        let chord = self.chord;
        let mut error = 0.0f64;
        for _ in 0..MAX_ROUNDS {
            checkpoint();
            // Unchanged triangles have been checked.
            let mut changed = core::mem::take(&mut self.changed);
            changed.sort_unstable();
            changed.dedup();
            let new = |n: u32| changed.binary_search(&n).is_ok();
            let mut todo: Vec<(f64, [u32; 2])> = Vec::new();
            for &n in &changed {
                let t = self.triangles[n as usize];
                let (mut far, mut within) = (false, chord);
                let mut worst = (-1.0, [0, 0]);
                for k in 0..3 {
                    let (i, j) = (t[k], t[(k + 1) % 3]);
                    if self.boundary.get(&edge_key(i, j)) == Some(&EdgeCurve::EndCircle) {
                        within = self.at_circles.max(chord);
                        continue;
                    }
                    let off = self.edge_distance(i, j);
                    if off > worst.0 {
                        worst = (off, edge_key(i, j));
                    }
                    if off <= chord {
                        error = error.max(off);
                        continue;
                    }
                    far = true;
                    if i < j || !self.left_of.get(&[j, i]).is_some_and(|n| new(*n)) {
                        todo.push((off, edge_key(i, j)));
                    }
                }
                if far {
                    continue;
                }
                let off = self.centroid_distance(t);
                if off <= within {
                    error = error.max(off);
                } else if worst.0 >= 0.0 {
                    todo.push((off, worst.1));
                }
            }
            if todo.is_empty() {
                return Some(error);
            }
            todo.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let mut done = std::collections::HashSet::new();
            for (_, [a, b]) in todo {
                if done.insert([a, b]) && !self.flip_closer(a, b) {
                    self.bisect(a, b);
                }
            }
            if self.triangles.len() > MAX_TRIANGLES {
                return None;
            }
        }
        None
    }

    /// The triangles on both sides of an edge, if it still exists.
    fn pair(&self, a: u32, b: u32) -> Option<Pair> {
        let (one, two) = (*self.left_of.get(&[a, b])?, *self.left_of.get(&[b, a])?);
        let apex = |n: u32| {
            let t = self.triangles[n as usize];
            t.into_iter().find(|&v| v != a && v != b)
        };
        let (c, d) = (apex(one)?, apex(two)?);
        Some(Pair { one, two, c, d })
    }

    /// Bisects an edge, if it still exists.
    fn bisect(&mut self, a: u32, b: u32) {
        let Some(Pair { one, two, c, d }) = self.pair(a, b) else {
            return;
        };
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let sound = |x: Vec3| {
            // With a margin such that rounding to single precision inverts no triangle.
            let good =
                |u: Vec3, v: Vec3, w: Vec3| orientation(u, v, w) > 1e-4 * norm(u) * norm(cross(sub(v, u), sub(w, u)));
            good(p, x, r) && good(x, q, r) && good(q, x, s) && good(x, p, s)
        };
        let side = self.boundary.get(&edge_key(a, b)).copied();
        let mut middle = self.surface_point(scale(add(p, q), 0.5), self.faces[one as usize]);
        let mut halves = None;
        if let Some(EdgeCurve::Arc(arc, from, to)) = side {
            let half = (from + to) / 2.0;
            let x = self.complex.arcs[arc as usize].conic.at(half);
            if sound(x) {
                middle = x;
                halves = Some((arc, from, half, to));
            }
        }
        let m = self.points.len() as u32;
        self.points.push(middle);
        self.boundary.remove(&edge_key(a, b));
        if let Some((arc, from, half, to)) = halves {
            // The new vertex has the highest number.
            self.boundary.insert([a.min(b), m], EdgeCurve::Arc(arc, from, half));
            self.boundary.insert([a.max(b), m], EdgeCurve::Arc(arc, to, half));
        }
        self.left_of.remove(&[a, b]);
        self.left_of.remove(&[b, a]);
        let (f, g) = (self.faces[one as usize], self.faces[two as usize]);
        self.set_triangle(one, [a, m, c]);
        self.push_triangle([m, b, c], f);
        self.set_triangle(two, [b, m, d]);
        self.push_triangle([m, a, d], g);
        for (u, v) in [(a, c), (c, b), (b, d), (d, a)] {
            self.flip_better(u, v);
        }
    }

    /// Flips edges until no flip improves: ears along a nearly straight seam may be at a large angle to the surface.
    pub(super) fn flip_all(&mut self) {
        for _ in 0..100 {
            let mut any = false;
            for k in 0..self.triangles.len() {
                for side in 0..3 {
                    let t = self.triangles[k];
                    any |= self.flip_better(t[side], t[(side + 1) % 3]);
                }
            }
            if !any {
                return;
            }
        }
    }

    /// The triangles at an edge that may be flipped: inside a face, and with a valid other diagonal.
    fn flippable(&self, a: u32, b: u32) -> Option<Pair> {
        if self.boundary.contains_key(&edge_key(a, b)) {
            return None;
        }
        let pair = self.pair(a, b)?;
        let Pair { one, two, c, d } = pair;
        if self.faces[one as usize] != self.faces[two as usize]
            || c == d
            || self.left_of.contains_key(&[c, d])
            || self.left_of.contains_key(&[d, c])
        {
            return None;
        }
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let good =
            |u: Vec3, v: Vec3, w: Vec3| orientation(u, v, w) > 1e-3 * norm(u) * norm(cross(sub(v, u), sub(w, u)));
        (good(r, s, q) && good(s, r, p)).then_some(pair)
    }

    /// Alignment of two triangles with their face, before and after a flip.
    fn alignments(&self, a: u32, b: u32, pair: &Pair) -> [f64; 2] {
        let [p, q, r, s] = [a, b, pair.c, pair.d].map(|i| self.points[i as usize]);
        let face = &self.complex.faces[self.faces[pair.one as usize] as usize];
        [
            alignment(face, [p, q, r]).min(alignment(face, [q, p, s])),
            alignment(face, [r, s, q]).min(alignment(face, [s, r, p])),
        ]
    }

    /// Distance of an edge and its two triangles from the surface, mm.
    fn pair_distance(&self, a: u32, b: u32, [c, d]: [u32; 2]) -> f64 {
        let both = self.centroid_distance([a, b, c]).max(self.centroid_distance([b, a, d]));
        self.edge_distance(a, b).max(both)
    }

    fn apply_flip(&mut self, a: u32, b: u32, Pair { one, two, c, d }: Pair) {
        self.left_of.remove(&[a, b]);
        self.left_of.remove(&[b, a]);
        self.set_triangle(one, [c, d, b]);
        self.set_triangle(two, [d, c, a]);
    }

    /// Flips an edge inside a face if that brings the triangles closer to the surface.
    fn flip_closer(&mut self, a: u32, b: u32) -> bool {
        let Some(pair) = self.flippable(a, b) else {
            return false;
        };
        let [before, after] = self.alignments(a, b, &pair);
        let opposite = [pair.c, pair.d];
        if after < before.min(0.7)
            || self.pair_distance(pair.d, pair.c, [a, b]) > MIN_GAIN * self.pair_distance(a, b, opposite)
        {
            return false;
        }
        self.apply_flip(a, b, pair);
        true
    }

    /// Flips an edge inside a face if that improves the shape of its triangles.
    fn flip_better(&mut self, a: u32, b: u32) -> bool {
        let Some(pair) = self.flippable(a, b) else {
            return false;
        };
        let [p, q, r, s] = [a, b, pair.c, pair.d].map(|i| self.points[i as usize]);
        let open = |x: Vec3, u: Vec3, v: Vec3| {
            let (u, v) = (sub(u, x), sub(v, x));
            norm(cross(u, v)).atan2(dot(u, v))
        };
        // If they are at a large angle to the surface, or opposite angles are wide.
        let [before, after] = self.alignments(a, b, &pair);
        // On the face of a half-beam wide angles are wanted: it is straight, or nearly.
        let end_circle = self.complex.faces[self.faces[pair.one as usize] as usize].end_circle;
        let wide = end_circle.is_none() && open(r, p, q) + open(s, p, q) > core::f64::consts::PI + 0.05;
        let better = before < 0.5 && after > before + 0.1
            || wide && after > before.min(0.8) && self.pair_distance(pair.d, pair.c, [a, b]) <= self.chord;
        if better {
            self.apply_flip(a, b, pair);
        }
        better
    }
}

/// The cosine of the angle between a triangle and its face.
pub(super) fn alignment(face: &QuadricFace, [a, b, c]: [Vec3; 3]) -> f64 {
    let up = face.quadric.half_gradient(scale(add(a, add(b, c)), 1.0 / 3.0));
    let flat = cross(sub(b, a), sub(c, a));
    dot(flat, up) / (norm(flat) * norm(up)).max(f64::MIN_POSITIVE)
}
