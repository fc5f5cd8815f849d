//! Facets made finer until they are as near to the surface as is asked for.
//!
//! What is too far off is turned before it is halved: of the two ways across four corners one often runs along the surface where the
//! other cuts through it, as on a beam all that runs along it. So triangles become long where the surface is straight.

use geometry::math::{Vec3, add, cross, dot, norm, root, scale, sub};

use super::super::complex::Face;
use super::{Facets, Side, key, turn};

/// A turned side is this share as far off as before at most, so that turning comes to an end.
const WORTH: f64 = 0.8;
/// The most triangles of a hub.
const MANY: usize = 1 << 22;
/// Rounds of halving: each makes what is too far off four times nearer.
const ROUNDS: usize = 60;

/// Two triangles on either side of a side, by number, and the corners across from it.
struct Pair {
    one: u32,
    two: u32,
    c: u32,
    d: u32,
}

impl Facets<'_> {
    /// How far a place near the surface is from it, to first order.
    #[inline]
    pub(super) fn off(&self, x: Vec3) -> f64 {
        let (value, slope) = self.hub.gradient(x);
        value.abs() / norm(slope)
    }

    /// How far a side is from the surface: at its quarters.
    fn side_off(&self, a: u32, b: u32) -> f64 {
        let (p, q) = (self.points[a as usize], self.points[b as usize]);
        [0.25, 0.5, 0.75].map(|s| self.off(add(scale(p, 1.0 - s), scale(q, s)))).into_iter().fold(0.0, f64::max)
    }

    /// How far a triangle is from the surface in its middle.
    fn middle_off(&self, t: [u32; 3]) -> f64 {
        let [a, b, c] = self.corners(t);
        self.off(scale(add(a, add(b, c)), 1.0 / 3.0))
    }

    /// The place on the surface in a direction: on the quadric of a face if that is the surface there.
    fn lift(&self, p: Vec3, face: u32) -> Vec3 {
        let hub = self.hub;
        let x = scale(p, self.complex.faces[face as usize].quadric.exit(p));
        if hub.value(x).abs() < 1e-11 * dot(x, x) {
            return x;
        }
        let value = |t: f64| hub.value(scale(p, t));
        // Inside before the exit, so the first change of sign from within is bracketed from the chord's place.
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
        let near = [0.0, 4.0 * f64::EPSILON];
        scale(p, root([lo, hi], (lo + hi) / 2.0, true, near, along))
    }

    /// Turns sides, or halves them, the farthest off first, until the quarters of none and the middle of no triangle is further than
    /// the chord error from the surface. `None` if that does not come to an end. Returns the greatest distance met that was
    /// left, but for the rims, which stay.
    pub fn refine(&mut self) -> Option<f64> {
        let chord = self.chord;
        let mut error = 0.0f64;
        for _ in 0..ROUNDS {
            // What is as it was has been looked at.
            let mut fresh = core::mem::take(&mut self.fresh);
            fresh.sort_unstable();
            fresh.dedup();
            let new = |n: u32| fresh.binary_search(&n).is_ok();
            let mut todo: Vec<(f64, [u32; 2])> = Vec::new();
            for &n in &fresh {
                let t = self.triangles[n as usize];
                let mut far = false;
                let mut worst = (-1.0, [0, 0]);
                for k in 0..3 {
                    let (i, j) = (t[k], t[(k + 1) % 3]);
                    if self.sides.get(&key(i, j)) == Some(&Side::Rim) {
                        continue;
                    }
                    let off = self.side_off(i, j);
                    if off > worst.0 {
                        worst = (off, key(i, j));
                    }
                    if off <= chord {
                        error = error.max(off);
                        continue;
                    }
                    far = true;
                    if i < j || !self.left.get(&[j, i]).is_some_and(|n| new(*n)) {
                        todo.push((off, key(i, j)));
                    }
                }
                if far {
                    continue;
                }
                let off = self.middle_off(t);
                if off <= chord {
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
                if done.insert([a, b]) && !self.turn_nearer(a, b) {
                    self.split(a, b);
                }
            }
            if self.triangles.len() > MANY {
                return None;
            }
        }
        None
    }

    /// What lies on both sides of a side, if it is still there.
    fn pair(&self, a: u32, b: u32) -> Option<Pair> {
        let (one, two) = (*self.left.get(&[a, b])?, *self.left.get(&[b, a])?);
        let apex = |n: u32| {
            let t = self.triangles[n as usize];
            t.into_iter().find(|&v| v != a && v != b)
        };
        let (c, d) = (apex(one)?, apex(two)?);
        Some(Pair { one, two, c, d })
    }

    /// Halves a side, if it is still there.
    fn split(&mut self, a: u32, b: u32) {
        let Some(Pair { one, two, c, d }) = self.pair(a, b) else {
            return;
        };
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let sound = |x: Vec3| {
            // Not so near to turned that rounding to single precision could turn it.
            let good = |u: Vec3, v: Vec3, w: Vec3| turn(u, v, w) > 1e-4 * norm(u) * norm(cross(sub(v, u), sub(w, u)));
            good(p, x, r) && good(x, q, r) && good(q, x, s) && good(x, p, s)
        };
        let side = self.sides.get(&key(a, b)).copied();
        let mut middle = self.lift(scale(add(p, q), 0.5), self.faces[one as usize]);
        let mut halves = None;
        if let Some(Side::Arc(arc, from, to)) = side {
            let half = (from + to) / 2.0;
            let x = self.complex.arcs[arc as usize].conic.at(half);
            if sound(x) {
                middle = x;
                halves = Some((arc, from, half, to));
            }
        }
        let m = self.points.len() as u32;
        self.points.push(middle);
        self.sides.remove(&key(a, b));
        if let Some((arc, from, half, to)) = halves {
            // Numbers grow: the new point has the greatest.
            self.sides.insert([a.min(b), m], Side::Arc(arc, from, half));
            self.sides.insert([a.max(b), m], Side::Arc(arc, to, half));
        }
        self.left.remove(&[a, b]);
        self.left.remove(&[b, a]);
        let (f, g) = (self.faces[one as usize], self.faces[two as usize]);
        self.set(one, [a, m, c]);
        self.put([m, b, c], f);
        self.set(two, [b, m, d]);
        self.put([m, a, d], g);
        for (u, v) in [(a, c), (c, b), (b, d), (d, a)] {
            self.flip(u, v);
        }
    }

    /// Turns sides until none is worth it: ears along a seam that curves little, seen from the centre, stand on the surface.
    pub(super) fn settle(&mut self) {
        for _ in 0..100 {
            let mut any = false;
            for k in 0..self.triangles.len() {
                for side in 0..3 {
                    let t = self.triangles[k];
                    any |= self.flip(t[side], t[(side + 1) % 3]);
                }
            }
            if !any {
                return;
            }
        }
    }

    /// The triangles at a side that may be turned: inside a face, and where the other way across is sound.
    fn turnable(&self, a: u32, b: u32) -> Option<Pair> {
        if self.sides.contains_key(&key(a, b)) {
            return None;
        }
        let pair = self.pair(a, b)?;
        let Pair { one, two, c, d } = pair;
        if self.faces[one as usize] != self.faces[two as usize]
            || c == d
            || self.left.contains_key(&[c, d])
            || self.left.contains_key(&[d, c])
        {
            return None;
        }
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let good = |u: Vec3, v: Vec3, w: Vec3| turn(u, v, w) > 1e-3 * norm(u) * norm(cross(sub(v, u), sub(w, u)));
        (good(r, s, q) && good(s, r, p)).then_some(pair)
    }

    /// How well two triangles lie on their face with a side as it is, and turned.
    fn lying(&self, a: u32, b: u32, pair: &Pair) -> [f64; 2] {
        let [p, q, r, s] = [a, b, pair.c, pair.d].map(|i| self.points[i as usize]);
        let face = &self.complex.faces[self.faces[pair.one as usize] as usize];
        [lies(face, [p, q, r]).min(lies(face, [q, p, s])), lies(face, [r, s, q]).min(lies(face, [s, r, p]))]
    }

    /// How far a side and its triangles are from the surface.
    fn pair_off(&self, a: u32, b: u32, [c, d]: [u32; 2]) -> f64 {
        let both = self.middle_off([a, b, c]).max(self.middle_off([b, a, d]));
        self.side_off(a, b).max(both)
    }

    fn turned(&mut self, a: u32, b: u32, Pair { one, two, c, d }: Pair) {
        self.left.remove(&[a, b]);
        self.left.remove(&[b, a]);
        self.set(one, [c, d, b]);
        self.set(two, [d, c, a]);
    }

    /// Turns a side inside a face if that brings it and its triangles nearer to the surface.
    fn turn_nearer(&mut self, a: u32, b: u32) -> bool {
        let Some(pair) = self.turnable(a, b) else {
            return false;
        };
        let [before, after] = self.lying(a, b, &pair);
        let across = [pair.c, pair.d];
        if after < before.min(0.7) || self.pair_off(pair.d, pair.c, [a, b]) > WORTH * self.pair_off(a, b, across) {
            return false;
        }
        self.turned(a, b, pair);
        true
    }

    /// Turns a side inside a fillet, a corner or the ball if that makes its two triangles better.
    fn flip(&mut self, a: u32, b: u32) -> bool {
        let Some(pair) = self.turnable(a, b) else {
            return false;
        };
        let [p, q, r, s] = [a, b, pair.c, pair.d].map(|i| self.points[i as usize]);
        let open = |x: Vec3, u: Vec3, v: Vec3| {
            let (u, v) = (sub(u, x), sub(v, x));
            norm(cross(u, v)).atan2(dot(u, v))
        };
        // Worth it where they stand on the surface, or where angles are wide.
        let [before, after] = self.lying(a, b, &pair);
        // Along a stub angles are to be wide: it is straight, or nearly.
        let rim = self.complex.faces[self.faces[pair.one as usize] as usize].rim;
        let wide = rim.is_none() && open(r, p, q) + open(s, p, q) > core::f64::consts::PI + 0.05;
        let better = before < 0.5 && after > before + 0.1
            || wide && after > before.min(0.8) && self.pair_off(pair.d, pair.c, [a, b]) <= self.chord;
        if better {
            self.turned(a, b, pair);
        }
        better
    }
}

/// The cosine between a triangle and the face that it is to lie on.
pub(super) fn lies(face: &Face, [a, b, c]: [Vec3; 3]) -> f64 {
    let up = face.quadric.half_slope(scale(add(a, add(b, c)), 1.0 / 3.0));
    let flat = cross(sub(b, a), sub(c, a));
    dot(flat, up) / (norm(flat) * norm(up)).max(f64::MIN_POSITIVE)
}
