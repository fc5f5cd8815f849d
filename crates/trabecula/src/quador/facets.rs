//! Faces in triangles whose corners lie on the surface.
//!
//! A hub is seen whole from its centre, so its surface is a height over the sphere of directions. Triangles that turn the
//! right way seen from there, and together go once round it, cannot meet but where they share corners. So a face's outline
//! is cut ear by ear on the sphere, where a turn is the sign of det(a, b, c), and a side is halved by the place on the surface
//! above its middle, which turns nothing round. Places on a seam are preferred where they turn nothing round either.

use core::f64::consts::TAU;
use std::collections::HashMap;

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::complex::{Complex, Face, MERGE};
use super::hub::Hub;

/// What a side of a triangle lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    /// An arc, between two of its angles: that of the point of lower number first.
    Arc(u32, f64, f64),
    /// A rim, which is not divided.
    Rim,
}

/// An arc that lies where an earlier one does.
#[derive(Clone, Copy, Debug)]
struct Twin {
    of: u32,
    /// Whether both have the same direction.
    same: bool,
    /// The face between them.
    face: usize,
}

/// Triangles on the surface of a hub.
pub(super) struct Facets<'a> {
    hub: &'a Hub<'a>,
    complex: &'a Complex,
    /// Places: those of rims first.
    pub points: Vec<Vec3>,
    /// Triangles, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The face of each.
    faces: Vec<u32>,
    /// Sides that are not inside a face.
    sides: HashMap<[u32; 2], Side>,
    /// The triangle to the left of each directed side.
    left: HashMap<[u32; 2], u32>,
}

/// The sign of a turn on the sphere, and six times the volume under a triangle.
#[inline]
fn turn(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    dot(a, cross(b, c))
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The solid angle of a triangle at the centre.
fn angle([a, b, c]: [Vec3; 3]) -> f64 {
    let (a, b, c) = (unit(a), unit(b), unit(c));
    2.0 * turn(a, b, c).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

/// Turns of directions below this are none: planes of seams may pass through the centre, and vertices are good to a ten-millionth.
const STRAIGHT: f64 = 1e-9;
/// How far seams turn between the first points on them, radians: finer where outlines that coarse would cross.
const TURNS: [f64; 5] = [0.5, 0.25, 0.12, 0.06, 0.03];

impl<'a> Facets<'a> {
    /// A hub's faces in few triangles, given the points of its rims, stub by stub; `None` if an outline crosses itself.
    pub fn new(hub: &'a Hub<'a>, complex: &'a Complex, rims: &[Vec<Vec3>]) -> Option<Facets<'a>> {
        TURNS
            .iter()
            .find_map(|&turn| Facets::drawn(hub, complex, rims, turn))
    }

    fn drawn(
        hub: &'a Hub<'a>,
        complex: &'a Complex,
        rims: &[Vec<Vec3>],
        turns: f64,
    ) -> Option<Facets<'a>> {
        let mut out = Facets {
            hub,
            complex,
            points: rims.iter().flatten().copied().collect(),
            triangles: Vec::new(),
            faces: Vec::new(),
            sides: HashMap::new(),
            left: HashMap::new(),
        };
        let mut firsts = Vec::with_capacity(rims.len());
        let mut first = 0u32;
        for rim in rims {
            let n = rim.len() as u32;
            firsts.push(first);
            for k in 0..n {
                out.sides
                    .insert(key(first + k, first + (k + 1) % n), Side::Rim);
            }
            first += n;
        }
        let twins = out.twins();
        let chains = out.chains(turns, &twins);
        for (number, face) in complex.faces.iter().enumerate() {
            if twins.iter().flatten().any(|t| t.face == number) {
                continue;
            }
            let made = match face.rim {
                Some(stub) => {
                    let (stub, first) = (stub as usize, firsts[stub as usize]);
                    let ring: Vec<u32> = (0..rims[stub].len() as u32).map(|k| first + k).collect();
                    let inner = walk(&chains, face.loops.first()?);
                    let strip = strip(hub.stubs[stub].axis, &out.points, &inner, &ring);
                    let turned = |t: &[u32; 3]| {
                        let [a, b, c] = out.corners(*t);
                        turn(a, b, c) <= 0.0
                    };
                    if strip.iter().any(turned) {
                        // Where a fillet reaches far along the stub its azimuths say too little.
                        out.joined(vec![inner, ring.into_iter().rev().collect()], face)?
                    } else {
                        strip
                    }
                }
                None => out.outlined(&chains, face)?,
            };
            for t in made {
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    out.put(t, number as u32);
                }
            }
        }
        // Once round, less what is behind the rims.
        let mut round = 0.0;
        for t in &out.triangles {
            let t = out.corners(*t);
            if turn(t[0], t[1], t[2]) <= 0.0 {
                return None;
            }
            round += angle(t);
        }
        for (rim, s) in rims.iter().zip(hub.stubs) {
            round += (0..rim.len())
                .map(|k| angle([s.axis, rim[k], rim[(k + 1) % rim.len()]]).abs())
                .sum::<f64>();
        }
        if (round - 4.0 * core::f64::consts::PI).abs() > 1e-6 {
            return None;
        }
        out.settle();
        Some(out)
    }

    fn corners(&self, t: [u32; 3]) -> [Vec3; 3] {
        t.map(|i| self.points[i as usize])
    }

    fn put(&mut self, t: [u32; 3], face: u32) {
        let number = self.triangles.len() as u32;
        self.triangles.push(t);
        self.faces.push(face);
        self.set(number, t);
    }

    fn set(&mut self, number: u32, t: [u32; 3]) {
        self.triangles[number as usize] = t;
        for k in 0..3 {
            self.left.insert([t[k], t[(k + 1) % 3]], number);
        }
    }

    /// For each arc an earlier one in the same place, if there is: both bound a face without width, such as the fillet between
    /// equal cylinders that run straight on, whose other side has none.
    fn twins(&self) -> Vec<Option<Twin>> {
        let arcs = &self.complex.arcs;
        let mut twins = vec![None; arcs.len()];
        for (number, face) in self.complex.faces.iter().enumerate() {
            let walked = face.loops.concat();
            let (&[(a, there), (b, back)], None) = (&walked[..], face.rim) else {
                continue;
            };
            let (earlier, later) = (a.min(b), a.max(b));
            let place = |arc: u32, t: f64| {
                let conic = &arcs[arc as usize].conic;
                conic.at(t * conic.end)
            };
            // Walked there and back: if both have the same direction, one of them is walked against it.
            let same = there != back;
            let near = |p: Vec3, q: Vec3| norm(sub(p, q)) < MERGE * self.hub.radius;
            let closed = face.loops.len() == 2;
            let twin = [0.0, 0.25, 0.5].into_iter().all(|t| {
                let both = [earlier, later].map(|arc| [t, 1.0 - t].map(|t| place(arc, t)));
                let [[p, q], [r, s]] = both;
                if closed {
                    // Those begin anywhere: on one quadric, about one centre, in one plane.
                    let center = |arc: u32| add(place(arc, 0.0), place(arc, 0.5));
                    let plane = &arcs[earlier as usize].plane;
                    let off = (dot(plane.a, r) + plane.b).abs() / norm(plane.a);
                    near(scale(center(earlier), 0.5), scale(center(later), 0.5))
                        && off < MERGE * self.hub.radius
                } else if same {
                    near(p, r) && near(q, s)
                } else {
                    near(p, s) && near(q, r)
                }
            });
            if a != b && twin {
                twins[later as usize] = Some(Twin {
                    of: earlier,
                    same,
                    face: number,
                });
            }
        }
        twins
    }

    /// Points along each arc, both ends included.
    fn chains(&mut self, turns: f64, twins: &[Option<Twin>]) -> Vec<Vec<u32>> {
        let arcs = &self.complex.arcs;
        let mut stands: Vec<u32> = (0..self.complex.vertices.len() as u32).collect();
        for (arc, twin) in arcs.iter().zip(twins) {
            let Some(twin) = twin else { continue };
            let of = arcs[twin.of as usize].ends;
            for k in 0..2 {
                let both = [arc.ends[k], of[if twin.same { k } else { 1 - k }]];
                let [p, q] = both.map(|v| stands[v as usize]);
                let all = stands.iter_mut().filter(|s| **s == p.max(q));
                all.for_each(|s| *s = p.min(q));
            }
        }
        let mut vertices: Vec<u32> = Vec::with_capacity(stands.len());
        for (v, of) in self.complex.vertices.iter().zip(&stands) {
            vertices.push(match vertices.get(*of as usize) {
                Some(point) => *point,
                None => {
                    self.points.push(v.at);
                    self.points.len() as u32 - 1
                }
            });
        }
        let least = turns.cos();
        let mut chains: Vec<Vec<u32>> = Vec::with_capacity(self.complex.arcs.len());
        for (number, a) in self.complex.arcs.iter().enumerate() {
            if let Some(twin) = twins[number] {
                let mut chain = chains[twin.of as usize].clone();
                if !twin.same {
                    chain.reverse();
                }
                chains.push(chain);
                continue;
            }
            let direction = |t: f64| unit(a.conic.with_slope(t).1);
            let mut chain = vec![(vertices[a.ends[0] as usize], 0.0)];
            // Halved from the left: the pieces still to be looked at, nearest last.
            let mut todo = vec![a.conic.end];
            let mut from = (0.0, direction(0.0));
            while let Some(&to) = todo.last() {
                let (mid, there) = (direction((from.0 + to) / 2.0), direction(to));
                let plain = dot(from.1, mid) > least
                    && dot(mid, there) > least
                    && dot(from.1, there) > least;
                if (!plain || a.ends[0] == a.ends[1] && to - from.0 > 1.0) && todo.len() < 12 {
                    todo.push((from.0 + to) / 2.0);
                    continue;
                }
                todo.pop();
                let point = if todo.is_empty() {
                    vertices[a.ends[1] as usize]
                } else {
                    self.points.push(a.conic.at(to));
                    self.points.len() as u32 - 1
                };
                let (p, q) = (chain[chain.len() - 1], (point, to));
                let (p, q) = if p.0 < q.0 { (p, q) } else { (q, p) };
                self.sides
                    .insert([p.0, q.0], Side::Arc(number as u32, p.1, q.1));
                chain.push((point, to));
                from = (to, there);
            }
            chains.push(chain.into_iter().map(|p| p.0).collect());
        }
        chains
    }

    /// Triangles over a face that seams alone bound.
    fn outlined(&mut self, chains: &[Vec<u32>], face: &Face) -> Option<Vec<[u32; 3]>> {
        if face.loops.is_empty() {
            return Some(self.ball());
        }
        let mut loops: Vec<Vec<u32>> = face.loops.iter().map(|l| walk(chains, l)).collect();
        loops.retain(|l| l.len() > 2);
        if let [alone] = &loops[..]
            && face.label == 0
        {
            // A cap, or all but a cap: around the middle.
            let middle = self.complex.pole(face);
            let place = |i: u32| self.points[i as usize];
            let number = self.points.len() as u32;
            let fan: Vec<[u32; 3]> = (0..alone.len())
                .map(|k| [number, alone[k], alone[(k + 1) % alone.len()]])
                .collect();
            if fan
                .iter()
                .all(|t| turn(middle, place(t[1]), place(t[2])) > 0.0)
            {
                self.points.push(middle);
                return Some(fan);
            }
        }
        self.joined(loops, face)
    }

    /// Triangles between loops.
    fn joined(&self, mut loops: Vec<Vec<u32>>, face: &Face) -> Option<Vec<[u32; 3]>> {
        let mut outline = loops.pop().unwrap_or_default();
        while !loops.is_empty() {
            // Rings are opened along the shortest bridge.
            let gap = |a: u32, b: u32| {
                norm(sub(
                    unit(self.points[a as usize]),
                    unit(self.points[b as usize]),
                ))
            };
            let mut best = (f64::INFINITY, 0, 0, 0);
            for (l, inner) in loops.iter().enumerate() {
                for (i, &a) in outline.iter().enumerate() {
                    for (j, &b) in inner.iter().enumerate() {
                        if gap(a, b) < best.0 {
                            best = (gap(a, b), l, i, j);
                        }
                    }
                }
            }
            let (_, l, i, j) = best;
            let inner = loops.swap_remove(l);
            let bridge: Vec<u32> = inner[j..]
                .iter()
                .chain(&inner[..=j])
                .chain(&outline[i..=i])
                .copied()
                .collect();
            outline.splice(i + 1..i + 1, bridge);
        }
        self.ears(outline, face)
    }

    /// An octahedron in a lone ball.
    fn ball(&mut self) -> Vec<[u32; 3]> {
        let (r, n) = (self.hub.radius, self.points.len() as u32);
        for a in 0..6 {
            let mut p = [0.0; 3];
            p[a % 3] = if a < 3 { r } else { -r };
            self.points.push(p);
        }
        let corner = |k: u32| {
            let [x, y, z] = [k & 1, k >> 1 & 1, k >> 2].map(|s| 3 * s);
            let t = [n + x, n + 1 + y, n + 2 + z];
            if k.count_ones().is_multiple_of(2) {
                t
            } else {
                [t[0], t[2], t[1]]
            }
        };
        (0..8).map(corner).collect()
    }

    /// Cuts an outline into triangles, the best ear first.
    fn ears(&self, mut outline: Vec<u32>, face: &Face) -> Option<Vec<[u32; 3]>> {
        let place = |i: u32| self.points[i as usize];
        let worth = |[a, b, c]: [u32; 3]| {
            let [p, q, r] = self.corners([a, b, c]);
            if a == b || b == c || c == a || turn(unit(p), unit(q), unit(r)) <= STRAIGHT {
                return f64::NEG_INFINITY;
            }
            let edge = |p: Vec3, q: Vec3| dot(sub(p, q), sub(p, q));
            let shape = norm(cross(sub(q, p), sub(r, p))) / (edge(p, q) + edge(q, r) + edge(r, p));
            // A chord that leaves the surface is the last resort, or a triangle that stands on it, as one along a seam does.
            let off = self.off(scale(add(p, r), 0.5)) / edge(p, r).sqrt();
            let lies = (lies(face, [p, q, r]) - 0.2).max(1e-4);
            shape * lies / (1.0 + 8.0 * off).powi(2)
        };
        let ear =
            |o: &[u32], i: usize| [o[(i + o.len() - 1) % o.len()], o[i], o[(i + 1) % o.len()]];
        let mut out = Vec::with_capacity(outline.len());
        let mut worths: Vec<f64> = (0..outline.len())
            .map(|i| worth(ear(&outline, i)))
            .collect();
        while outline.len() > 3 {
            let n = outline.len();
            let mut order: Vec<usize> = (0..n).filter(|&i| worths[i] > 0.0).collect();
            order.sort_by(|&i, &j| worths[j].total_cmp(&worths[i]));
            let i = order.into_iter().find(|&i| {
                let [a, b, c] = ear(&outline, i);
                let [p, q, r] = self.corners([a, b, c]);
                // What lies on a side is in the way too: seams may run straight, seen from the centre.
                let [p, q, r] = [p, q, r].map(unit);
                outline.iter().all(|&o| {
                    let x = unit(place(o));
                    o == a
                        || o == b
                        || o == c
                        || turn(p, q, x) < -STRAIGHT
                        || turn(q, r, x) < -STRAIGHT
                        || turn(r, p, x) < -STRAIGHT
                })
            })?;
            out.push(ear(&outline, i));
            outline.remove(i);
            worths.remove(i);
            let n = outline.len();
            for k in [(i + n - 1) % n, i % n] {
                worths[k] = worth(ear(&outline, k));
            }
        }
        if outline.len() == 3 {
            out.push(ear(&outline, 1));
        }
        Some(out)
    }

    /// How far a place near the surface is from it, to first order.
    #[inline]
    fn off(&self, x: Vec3) -> f64 {
        let (value, slope) = self.hub.gradient(x);
        value.abs() / norm(slope)
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
        for _ in 0..60 {
            let mid = (lo + hi) / 2.0;
            if value(mid) < 0.0 { lo = mid } else { hi = mid }
        }
        scale(p, (lo + hi) / 2.0)
    }

    /// Halves sides, the longest first, until the middle of none and of no triangle is further than `chord` from the surface.
    /// `None` if that does not come to an end. Returns the greatest distance left, but for the rims, which stay.
    pub fn refine(&mut self, chord: f64) -> Option<f64> {
        for _ in 0..60 {
            let mut todo: Vec<(f64, [u32; 2])> = Vec::new();
            let mut error = 0.0f64;
            for &t in &self.triangles {
                let [a, b, c] = self.corners(t);
                let mut far = false;
                let mut longest = (0.0, [0, 0]);
                for k in 0..3 {
                    let (i, j) = (t[k], t[(k + 1) % 3]);
                    let (p, q) = (self.points[i as usize], self.points[j as usize]);
                    let length = norm(sub(p, q));
                    if self.sides.get(&key(i, j)) == Some(&Side::Rim) {
                        continue;
                    }
                    let off = [0.25, 0.5, 0.75]
                        .map(|s| self.off(add(scale(p, 1.0 - s), scale(q, s))))
                        .into_iter()
                        .fold(0.0, f64::max);
                    error = error.max(off);
                    if length > longest.0 {
                        longest = (length, key(i, j));
                    }
                    if off > chord {
                        far = true;
                        todo.push((length, key(i, j)));
                    }
                }
                let off = self.off(scale(add(a, add(b, c)), 1.0 / 3.0));
                error = error.max(off);
                if !far && off > chord && longest.0 > 0.0 {
                    todo.push(longest);
                }
            }
            if todo.is_empty() {
                return Some(error);
            }
            todo.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            todo.dedup_by_key(|e| e.1);
            for (_, [a, b]) in todo {
                self.split(a, b);
            }
            if self.triangles.len() > 1 << 22 {
                return None;
            }
        }
        None
    }

    /// Halves a side, if it is still there.
    fn split(&mut self, a: u32, b: u32) {
        let (Some(&one), Some(&two)) = (self.left.get(&[a, b]), self.left.get(&[b, a])) else {
            return;
        };
        let apex = |t: [u32; 3], a: u32, b: u32| t.into_iter().find(|&v| v != a && v != b);
        let (Some(c), Some(d)) = (
            apex(self.triangles[one as usize], a, b),
            apex(self.triangles[two as usize], b, a),
        ) else {
            return;
        };
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let sound = |x: Vec3| {
            // Not so near to turned that rounding to single precision could turn it.
            let good = |u: Vec3, v: Vec3, w: Vec3| {
                turn(u, v, w) > 1e-4 * norm(u) * norm(cross(sub(v, u), sub(w, u)))
            };
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
    fn settle(&mut self) {
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

    /// Turns a side inside a fillet, a corner or the ball if that makes its two triangles better.
    fn flip(&mut self, a: u32, b: u32) -> bool {
        if self.sides.contains_key(&key(a, b)) {
            return false;
        }
        let (Some(&one), Some(&two)) = (self.left.get(&[a, b]), self.left.get(&[b, a])) else {
            return false;
        };
        let face = self.faces[one as usize];
        if face != self.faces[two as usize] {
            return false;
        }
        let apex = |t: [u32; 3]| t.into_iter().find(|&v| v != a && v != b);
        let (Some(c), Some(d)) = (
            apex(self.triangles[one as usize]),
            apex(self.triangles[two as usize]),
        ) else {
            return false;
        };
        if c == d || self.left.contains_key(&[c, d]) || self.left.contains_key(&[d, c]) {
            return false;
        }
        let [p, q, r, s] = [a, b, c, d].map(|i| self.points[i as usize]);
        let open = |x: Vec3, u: Vec3, v: Vec3| {
            let (u, v) = (sub(u, x), sub(v, x));
            norm(cross(u, v)).atan2(dot(u, v))
        };
        let good = |u: Vec3, v: Vec3, w: Vec3| {
            turn(u, v, w) > 1e-3 * norm(u) * norm(cross(sub(v, u), sub(w, u)))
        };
        // Worth it where they stand on the surface, or where angles are wide.
        let face = &self.complex.faces[face as usize];
        let before = lies(face, [p, q, r]).min(lies(face, [q, p, s]));
        let after = lies(face, [r, s, q]).min(lies(face, [s, r, p]));
        // Along a stub angles are to be wide: it is straight, or nearly.
        let wide =
            face.rim.is_none() && open(r, p, q) + open(s, p, q) > core::f64::consts::PI + 0.05;
        let better = before < 0.5 && after > before + 0.1 || wide && after > before.min(0.8);
        if !better || !good(r, s, q) || !good(s, r, p) {
            return false;
        }
        self.left.remove(&[a, b]);
        self.left.remove(&[b, a]);
        self.set(one, [c, d, b]);
        self.set(two, [d, c, a]);
        true
    }
}

/// The cosine between a triangle and the face that it is to lie on.
fn lies(face: &Face, [a, b, c]: [Vec3; 3]) -> f64 {
    let up = face.quadric.half_slope(scale(add(a, add(b, c)), 1.0 / 3.0));
    let flat = cross(sub(b, a), sub(c, a));
    dot(flat, up) / (norm(flat) * norm(up)).max(f64::MIN_POSITIVE)
}

/// The points of a loop as it is walked, without the last, which is the first.
fn walk(chains: &[Vec<u32>], walked: &[(u32, bool)]) -> Vec<u32> {
    let mut out = Vec::new();
    for &(arc, forward) in walked {
        let chain = &chains[arc as usize];
        let n = chain.len() - 1;
        out.extend((0..n).map(|k| chain[if forward { k } else { n - k }]));
    }
    out
}

/// Triangles between a loop around an axis and the rim beyond it, by azimuth.
fn strip(axis: Vec3, points: &[Vec3], inner: &[u32], ring: &[u32]) -> Vec<[u32; 3]> {
    let side = super::mesh::across(axis);
    let other = cross(axis, side);
    let azimuth = |i: u32| dot(points[i as usize], other).atan2(dot(points[i as usize], side));
    let sorted = |of: &[u32]| {
        let mut v: Vec<(f64, u32)> = of.iter().map(|&i| (azimuth(i), i)).collect();
        v.sort_by(|a, b| a.0.total_cmp(&b.0));
        v
    };
    let (low, high) = (sorted(inner), sorted(ring));
    let at = |of: &[(f64, u32)], k: usize| {
        let (a, i) = of[k % of.len()];
        (a + TAU * (k / of.len()) as f64, i)
    };
    let (mut i, mut j, mut out) = (0, 0, Vec::with_capacity(low.len() + high.len()));
    while i < low.len() || j < high.len() {
        let (l, h) = (at(&low, i).1, at(&high, j).1);
        let ((next_low, l2), (next_high, h2)) = (at(&low, i + 1), at(&high, j + 1));
        if j >= high.len() || i < low.len() && next_low < next_high {
            out.push([l, l2, h]);
            i += 1;
        } else {
            out.push([l, h2, h]);
            j += 1;
        }
    }
    out
}
