//! Faces in triangles whose corners lie on the surface.
//!
//! A hub is seen whole from its centre, so its surface is a height over the sphere of directions. Triangles that turn the
//! right way seen from there, and together go once round it, cannot meet but where they share corners. So a face's outline
//! is cut ear by ear on the sphere, where a turn is the sign of det(a, b, c), and a side is halved by the place on the surface
//! above its middle, which turns nothing round. Places on a seam are preferred where they turn nothing round either.

use std::collections::HashMap;

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::complex::{Arc, Complex, MERGE};
use super::hub::Hub;
use cover::strip;

mod cover;
mod finer;

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
    /// Triangles that nobody has looked at since they changed.
    fresh: Vec<u32>,
    /// How far they may be from the surface, mm.
    chord: f64,
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

/// How far seams turn between their points at most, radians: less where outlines that coarse would cross.
const TURNS: [f64; 6] = [1.0, 0.5, 0.25, 0.12, 0.06, 0.03];
/// The share of the chord error that the chords of seams and rims take: what runs between their points takes the rest.
pub(super) const TAKEN: f64 = 0.75;
/// Places at which the curvature of a seam is looked at.
const PLACES: usize = 32;

impl<'a> Facets<'a> {
    /// A hub's faces in few triangles, to be made finer up to a chord error, given the points of its rims, stub by stub; `None` if
    /// an outline crosses itself.
    pub fn new(hub: &'a Hub<'a>, complex: &'a Complex, rims: &[Vec<Vec3>], chord: f64) -> Option<Facets<'a>> {
        TURNS.iter().find_map(|&turn| Facets::drawn(hub, complex, rims, (chord, turn)))
    }

    fn drawn(
        hub: &'a Hub<'a>,
        complex: &'a Complex,
        rims: &[Vec<Vec3>],
        (chord, turns): (f64, f64),
    ) -> Option<Facets<'a>> {
        let mut out = Facets {
            hub,
            complex,
            points: rims.iter().flatten().copied().collect(),
            triangles: Vec::new(),
            faces: Vec::new(),
            sides: HashMap::new(),
            left: HashMap::new(),
            fresh: Vec::new(),
            chord,
        };
        let mut firsts = Vec::with_capacity(rims.len());
        let mut first = 0u32;
        for rim in rims {
            let n = rim.len() as u32;
            firsts.push(first);
            for k in 0..n {
                out.sides.insert(key(first + k, first + (k + 1) % n), Side::Rim);
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
            round += (0..rim.len()).map(|k| angle([s.axis, rim[k], rim[(k + 1) % rim.len()]]).abs()).sum::<f64>();
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
        self.fresh.push(number);
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
                    near(scale(center(earlier), 0.5), scale(center(later), 0.5)) && off < MERGE * self.hub.radius
                } else if same {
                    near(p, r) && near(q, s)
                } else {
                    near(p, s) && near(q, r)
                }
            });
            if a != b && twin {
                twins[later as usize] = Some(Twin { of: earlier, same, face: number });
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
        let mut chains: Vec<Vec<u32>> = Vec::with_capacity(self.complex.arcs.len());
        for (number, a) in arcs.iter().enumerate() {
            if let Some(twin) = twins[number] {
                let mut chain = chains[twin.of as usize].clone();
                if !twin.same {
                    chain.reverse();
                }
                chains.push(chain);
                continue;
            }
            let [from, last] = a.ends.map(|v| vertices[v as usize]);
            let mut chain = vec![from];
            let mut before = 0.0;
            for to in self.steps(a, turns) {
                let point = if to == a.conic.end {
                    last
                } else {
                    self.points.push(a.conic.at(to));
                    self.points.len() as u32 - 1
                };
                let (p, q) = ((chain[chain.len() - 1], before), (point, to));
                let (p, q) = if p.0 < q.0 { (p, q) } else { (q, p) };
                let side = Side::Arc(number as u32, p.1, q.1);
                self.sides.insert([p.0, q.0], side);
                chain.push(point);
                before = to;
            }
            chains.push(chain);
        }
        chains
    }

    /// Where an arc is divided, its end included: evenly in the root of the curvature that takes chords off the surface, and so that it
    /// turns no further than told from one to the next.
    fn steps(&self, arc: &Arc, turns: f64) -> Vec<f64> {
        let conic = &arc.conic;
        let at = |k: usize| {
            let (x, dx) = conic.with_slope(conic.end * k as f64 / PLACES as f64);
            (x, unit(dx))
        };
        // A chord of length s is κs²/8 off.
        let per = 1.0 / (8.0 * TAKEN * self.chord).sqrt();
        let mut sums = [0.0; PLACES + 1];
        let mut from = at(0);
        for k in 1..=PLACES {
            let to = at(k);
            let (by, bend) = (norm(sub(to.0, from.0)), sub(to.1, from.1));
            let up = unit(self.hub.gradient(scale(add(from.0, to.0), 0.5)).1);
            let off = per * (dot(bend, up).abs() * by).sqrt();
            sums[k] = sums[k - 1] + off.max(norm(bend) / turns);
            from = to;
        }
        let whole = sums[PLACES];
        // What closes on itself is three sides at least.
        let least = if arc.ends[0] == arc.ends[1] { 3.0 } else { 1.0 };
        let n = (whole - 1e-6).ceil().max(least) as usize;
        let mut k = 1;
        let inner = (1..n).map(|i| {
            let want = whole * i as f64 / n as f64;
            while k < PLACES && sums[k] < want {
                k += 1;
            }
            let part = (want - sums[k - 1]) / (sums[k] - sums[k - 1]);
            conic.end * (k as f64 - 1.0 + part) / PLACES as f64
        });
        inner.chain([conic.end]).collect()
    }
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
