//! Faces cut into triangles by their seams alone: what quadrature and meshing start from.
//!
//! A hub is seen whole from its centre, so a face is a region of the sphere of directions. It is drawn on a plane by
//! stereographic projection from opposite its middle, where it cannot overlap itself, and its outline is cut ear by ear.

use std::collections::HashMap;

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::complex::{Complex, Face};
use super::quadric::{Conic, Quadric};

/// Seams of a hub as chains of points.
#[derive(Clone, Debug, Default)]
pub struct Seams {
    /// The vertices, then the places inside arcs.
    pub points: Vec<Vec3>,
    /// For each arc, the points along it, both ends included, and the angle of each.
    pub chains: Vec<Vec<(u32, f64)>>,
}

impl Seams {
    /// Arcs in pieces over which the tangent turns by less than `turn` (radians).
    pub fn new(complex: &Complex, turn: f64) -> Seams {
        let mut points: Vec<Vec3> = complex.vertices.iter().map(|v| v.at).collect();
        let least = turn.cos();
        let chains = complex
            .arcs
            .iter()
            .map(|a| {
                let direction = |t: f64| unit(a.conic.with_slope(t).1);
                let mut chain = vec![(a.ends[0], 0.0)];
                // Halved from the left: the pieces still to be looked at, nearest last.
                let mut todo = vec![a.conic.end];
                let mut from = (0.0, direction(0.0));
                while let Some(&to) = todo.last() {
                    let there = direction(to);
                    let mid = direction((from.0 + to) / 2.0);
                    let plain = dot(from.1, mid) > least
                        && dot(mid, there) > least
                        && dot(from.1, there) > least;
                    if !plain && todo.len() < 12 {
                        todo.push((from.0 + to) / 2.0);
                        continue;
                    }
                    todo.pop();
                    if todo.is_empty() {
                        chain.push((a.ends[1], to));
                    } else {
                        chain.push((points.len() as u32, to));
                        points.push(a.conic.at(to));
                    }
                    from = (to, there);
                }
                chain
            })
            .collect();
        Seams { points, chains }
    }

    /// The points of a loop as it is walked, without the last, which is the first.
    pub fn walk(&self, walked: &[(u32, bool)]) -> Vec<u32> {
        let mut out = Vec::new();
        for &(arc, forward) in walked {
            let chain = &self.chains[arc as usize];
            let n = chain.len() - 1;
            out.extend((0..n).map(|k| chain[if forward { k } else { n - k }].0));
        }
        out
    }

    /// Triangles over the points of a face's seams, counter-clockwise from outside; `None` if the outline crosses itself, as it
    /// may where seams are drawn too coarsely. `MIDDLE` stands for the middle, where a fan from it stays nearer to the surface than
    /// any cut from seam to seam. Not for faces with a rim.
    pub fn triangles(&self, face: &Face, middle: Vec3) -> Option<Vec<[u32; 3]>> {
        let place = |i: u32| {
            if i == MIDDLE {
                middle
            } else {
                self.points[i as usize]
            }
        };
        let worst = |triangles: &[[u32; 3]]| {
            let mut seam = std::collections::HashSet::new();
            for l in &face.loops {
                let w = self.walk(l);
                (0..w.len()).for_each(|k| {
                    seam.insert(key(w[k], w[(k + 1) % w.len()]));
                });
            }
            let sides = triangles
                .iter()
                .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
            let inner = sides.filter(|&(a, b)| !seam.contains(&key(a, b)));
            inner
                .map(|(a, b)| closeness(face, place(a), place(b)))
                .fold(1.0, f64::min)
        };
        let cut = self.cut(face, middle);
        if cut
            .as_ref()
            .is_some_and(|c| face.label != 0 && worst(c) > 0.4)
        {
            return cut;
        }
        let fan = self.fan(face, middle);
        match (cut, fan) {
            (Some(c), Some(f)) => Some(if face.label == 0 || worst(&f) > worst(&c) {
                f
            } else {
                c
            }),
            (c, f) => f.or(c),
        }
    }

    /// A fan from the middle, if the seams go round it without turning back.
    fn fan(&self, face: &Face, middle: Vec3) -> Option<Vec<[u32; 3]>> {
        let [walked] = &face.loops[..] else {
            return None;
        };
        let w = self.walk(walked);
        let place = |i: u32| self.points[i as usize];
        let all = (0..w.len()).map(|k| [MIDDLE, w[k], w[(k + 1) % w.len()]]);
        let round = all
            .clone()
            .all(|[_, a, b]| dot(middle, cross(place(a), place(b))) > 0.0);
        (round && w.len() > 2).then(|| all.collect())
    }

    fn cut(&self, face: &Face, middle: Vec3) -> Option<Vec<[u32; 3]>> {
        let m = unit(middle);
        let side = unit(cross(
            m,
            if m[0].abs() < 0.6 {
                [1.0, 0.0, 0.0]
            } else {
                [0.0, 1.0, 0.0]
            },
        ));
        let other = cross(m, side);
        let drawn = |i: u32| {
            let p = unit(self.points[i as usize]);
            let f = 1.0 / (1.0 + dot(p, m)).max(1e-12);
            [dot(p, side) * f, dot(p, other) * f]
        };
        let mut loops: Vec<Vec<(u32, [f64; 2])>> = face
            .loops
            .iter()
            .map(|l| self.walk(l).into_iter().map(|i| (i, drawn(i))).collect())
            .collect();
        loops.retain(|l| l.len() > 2);
        let mut outline = loops.pop()?;
        // A ring is opened along the shortest bridge.
        for inner in loops {
            let gap = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let pairs = (0..outline.len()).flat_map(|i| (0..inner.len()).map(move |j| (i, j)));
            let (i, j) = pairs.min_by(|&(a, b), &(c, d)| {
                gap(&outline[a].1, &inner[b].1).total_cmp(&gap(&outline[c].1, &inner[d].1))
            })?;
            let bridge: Vec<_> = inner[j..]
                .iter()
                .chain(&inner[..=j])
                .chain(&outline[i..=i])
                .copied()
                .collect();
            outline.splice(i + 1..i + 1, bridge);
        }
        ears(outline, &|a, c| {
            closeness(face, self.points[a as usize], self.points[c as usize])
        })
    }
}

/// The number of a face's middle before it has one.
pub const MIDDLE: u32 = u32::MAX;

/// Cuts a polygon into triangles, the best shaped ear first.
fn ears(
    mut outline: Vec<(u32, [f64; 2])>,
    fit: &impl Fn(u32, u32) -> f64,
) -> Option<Vec<[u32; 3]>> {
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let mut out = Vec::with_capacity(outline.len());
    while outline.len() > 3 {
        let n = outline.len();
        let mut best = (0.0, None);
        for i in 0..n {
            let (a, b, c) = (outline[(i + n - 1) % n], outline[i], outline[(i + 1) % n]);
            let area = turn(a.1, b.1, c.1);
            let edge = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
            let mut shape = area / (edge(a.1, b.1) + edge(b.1, c.1) + edge(c.1, a.1));
            if shape > best.0 && n > 3 {
                // A chord that leaves the quadric is the last resort.
                shape *= fit(a.0, c.0).powi(2) + 1e-6;
            }
            if shape <= best.0 || a.0 == b.0 || b.0 == c.0 || c.0 == a.0 {
                continue;
            }
            let free = outline.iter().all(|p| {
                p.0 == a.0
                    || p.0 == b.0
                    || p.0 == c.0
                    || turn(a.1, b.1, p.1) < 0.0
                    || turn(b.1, c.1, p.1) < 0.0
                    || turn(c.1, a.1, p.1) < 0.0
            });
            if free {
                best = (shape, Some(i));
            }
        }
        let i = best.1?;
        out.push([
            outline[(i + n - 1) % n].0,
            outline[i].0,
            outline[(i + 1) % n].0,
        ]);
        outline.remove(i);
    }
    let [a, b, c] = [outline[0], outline[1], outline[2]];
    if turn(a.1, b.1, c.1) <= 0.0 {
        return None;
    }
    out.push([a.0, b.0, c.0]);
    Some(out)
}

/// A place on a face, in the middle of its seams: on the ball the far side of a lone cap.
pub fn middle(complex: &Complex, face: &Face) -> Vec3 {
    let (mut sum, mut arrow) = ([0.0; 3], [0.0; 3]);
    for &(arc, forward) in face.loops.iter().flatten() {
        let conic = &complex.arcs[arc as usize].conic;
        for &(t, w) in super::integral::gauss(4) {
            let (x, dx) = conic.with_slope(t * conic.end);
            let turn = w * conic.end * if forward { 1.0 } else { -1.0 };
            sum = add(sum, scale(unit(x), w * conic.end * norm(dx)));
            arrow = add(arrow, scale(cross(x, dx), turn));
        }
    }
    // Where seams go round more than half the sphere their middle is on the wrong side.
    let p = if face.label == 0 && dot(sum, arrow) < 0.0 || norm(sum) < 1e-9 {
        arrow
    } else {
        sum
    };
    let p = unit(p);
    let at = face.quadric.exit(p);
    scale(p, if at.is_finite() { at } else { 1.0 })
}

/// What a side of a triangle lies on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Side {
    /// An arc, between two of its angles.
    Arc(u32, f64, f64),
    /// A rim, which is not divided.
    Rim,
    /// The inside of a face.
    Inner,
}

/// Triangles on the surface of a hub, with their faces.
#[derive(Clone, Debug, Default)]
pub struct Tiles {
    /// Places, those of the seams first.
    pub points: Vec<Vec3>,
    /// Triangles, counter-clockwise from outside, and the face of each.
    pub triangles: Vec<([u32; 3], u32)>,
    /// What the sides lie on that are not inside a face.
    pub sides: HashMap<[u32; 2], Side>,
}

/// A side as a curve over [0, 1].
#[derive(Clone, Copy, Debug)]
pub enum Curve {
    /// Part of a conic, between two angles.
    Conic(Conic, f64, f64),
    /// The section of a quadric by the plane of a chord (its start, the way to its end) and a direction.
    Section(Vec3, Vec3, Vec3, Quadric),
}

impl Curve {
    /// The place at t and its derivative.
    pub fn at(&self, t: f64) -> (Vec3, Vec3) {
        match self {
            Curve::Conic(conic, from, to) => {
                let (x, dx) = conic.with_slope(from + t * (to - from));
                (x, scale(dx, to - from))
            }
            Curve::Section(p, way, up, quadric) => {
                let x = add(*p, scale(*way, t));
                let x = add(x, scale(*up, quadric.along(x, *up)));
                let slope = quadric.half_slope(x);
                (x, sub(*way, scale(*up, dot(slope, *way) / dot(slope, *up))))
            }
        }
    }
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Tiles {
    /// The seams and no triangle.
    pub fn new(seams: &Seams) -> Tiles {
        let mut sides = HashMap::new();
        for (i, chain) in seams.chains.iter().enumerate() {
            for w in chain.windows(2) {
                let (p, q) = (w[0], w[1]);
                let (from, to) = if p.0 < q.0 { (p.1, q.1) } else { (q.1, p.1) };
                sides.insert(key(p.0, q.0), Side::Arc(i as u32, from, to));
            }
        }
        Tiles {
            points: seams.points.clone(),
            triangles: Vec::new(),
            sides,
        }
    }

    /// Adds the triangles of a face, and its middle if they use it.
    pub fn put(&mut self, triangles: Vec<[u32; 3]>, middle: Vec3, face: u32) {
        let number = self.points.len() as u32;
        if triangles.iter().flatten().any(|&i| i == MIDDLE) {
            self.points.push(middle);
        }
        let named = |t: [u32; 3]| t.map(|i| if i == MIDDLE { number } else { i });
        self.triangles
            .extend(triangles.into_iter().map(|t| (named(t), face)));
    }

    /// What a side lies on.
    pub fn side(&self, a: u32, b: u32) -> Side {
        self.sides.get(&key(a, b)).copied().unwrap_or(Side::Inner)
    }

    /// The middle of a side on the surface, and how far it is from the middle of the chord, to first order.
    fn halved(&self, complex: &Complex, face: u32, a: u32, b: u32) -> (Vec3, f64) {
        let (p, q) = (self.points[a as usize], self.points[b as usize]);
        let chord = scale(add(p, q), 0.5);
        match self.side(a, b) {
            Side::Arc(arc, from, to) => {
                let x = complex.arcs[arc as usize].conic.at((from + to) / 2.0);
                (x, norm(sub(x, chord)))
            }
            Side::Rim => (chord, 0.0),
            Side::Inner => {
                let quadric = &complex.faces[face as usize].quadric;
                let up = unit(add(
                    unit(quadric.half_slope(p)),
                    unit(quadric.half_slope(q)),
                ));
                let away = quadric.along(chord, up);
                let x = add(chord, scale(up, away));
                let away = if away.is_nan() {
                    f64::INFINITY
                } else {
                    away.abs()
                };
                (x, away)
            }
        }
    }

    /// The curve of a side on its face, from the first point to the second: its arc, or the section by the plane of the chord
    /// and the mean normal of its ends.
    pub fn curve(&self, complex: &Complex, face: &Face, a: u32, b: u32) -> Curve {
        if let Side::Arc(arc, from, to) = self.side(a, b) {
            let (from, to) = if a < b { (from, to) } else { (to, from) };
            return Curve::Conic(complex.arcs[arc as usize].conic, from, to);
        }
        let (p, q) = (self.points[a as usize], self.points[b as usize]);
        let quadric = &face.quadric;
        let up = unit(add(
            unit(quadric.half_slope(p)),
            unit(quadric.half_slope(q)),
        ));
        Curve::Section(p, sub(q, p), up, *quadric)
    }

    /// Halves sides, seams at their own middle, until none asks for it: `coarse` is told how far the middle of a side is off the
    /// surface and its length. Triangles fall into two, three or four, so nothing hangs. `None` after too many rounds.
    pub fn refine(&mut self, complex: &Complex, coarse: &impl Fn(f64, f64) -> bool) -> Option<()> {
        let mut asked: HashMap<[u32; 2], u32> = HashMap::new();
        let mut fresh: Vec<([u32; 3], u32)> = core::mem::take(&mut self.triangles);
        for _ in 0..40 {
            let mut any = false;
            for &(t, face) in &fresh {
                for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    if asked.contains_key(&key(a, b)) {
                        continue;
                    }
                    // The same from both sides, to the bit.
                    let [a, b] = key(a, b);
                    let (x, away) = self.halved(complex, face, a, b);
                    let length = norm(sub(self.points[a as usize], self.points[b as usize]));
                    let mut middle = u32::MAX;
                    if coarse(away, length) {
                        any = true;
                        middle = self.points.len() as u32;
                        self.points.push(x);
                        match self.side(a, b) {
                            Side::Arc(arc, from, to) => {
                                let half = (from + to) / 2.0;
                                // Keys are in order of their numbers, and the new one is the greatest.
                                self.sides.insert([a, middle], Side::Arc(arc, from, half));
                                self.sides.insert([b, middle], Side::Arc(arc, to, half));
                            }
                            Side::Rim | Side::Inner => {}
                        }
                    }
                    asked.insert(key(a, b), middle);
                }
            }
            if !any {
                self.triangles.extend(fresh);
                return Some(());
            }
            let mut next = Vec::with_capacity(2 * fresh.len());
            for (t, face) in fresh {
                let m = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| asked[&key(a, b)]);
                let mut put = |a, b, c| next.push(([a, b, c], face));
                let n = m.iter().filter(|m| **m != u32::MAX).count();
                // Turned so that what is divided comes first.
                let k = match n {
                    1 => (0..3).find(|&k| m[k] != u32::MAX),
                    2 => (0..3).find(|&k| m[(k + 2) % 3] == u32::MAX),
                    _ => Some(0),
                }?;
                let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                let (p, q, r) = (m[k], m[(k + 1) % 3], m[(k + 2) % 3]);
                match n {
                    0 => put(a, b, c),
                    1 => {
                        put(a, p, c);
                        put(p, b, c);
                    }
                    2 => {
                        put(p, b, q);
                        // The shorter diagonal of what is left.
                        let d = |i: u32, j: u32| {
                            norm(sub(self.points[i as usize], self.points[j as usize]))
                        };
                        if d(a, q) < d(p, c) {
                            put(a, p, q);
                            put(a, q, c);
                        } else {
                            put(a, p, c);
                            put(p, q, c);
                        }
                    }
                    _ => {
                        put(a, p, r);
                        put(p, b, q);
                        put(r, q, c);
                        put(p, q, r);
                    }
                }
            }
            fresh = next;
        }
        None
    }
}

/// How well a chord between two places stays with a face's quadric: 0 if it loses it, 1 if it lies on it.
fn closeness(face: &Face, p: Vec3, q: Vec3) -> f64 {
    let quadric = &face.quadric;
    let up = unit(add(
        unit(quadric.half_slope(p)),
        unit(quadric.half_slope(q)),
    ));
    let away = quadric.along(scale(add(p, q), 0.5), up);
    if away.is_nan() {
        0.0
    } else {
        1.0 / (1.0 + 8.0 * away.abs() / norm(sub(p, q)))
    }
}
