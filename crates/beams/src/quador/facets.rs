//! Triangulation of a hub's faces, with vertices on the surface.
//!
//! A hub is star-shaped about its centre, so its surface is a radial function over the sphere of directions. Triangles
//! that are positively oriented seen from the centre and together cover the sphere once can meet in common vertices and
//! edges only. A face's boundary polygon is therefore triangulated by ear clipping on the sphere, where orientation is
//! the sign of det(a, b, c), and edges are bisected at the surface point above their midpoint, which inverts no
//! triangle. Points on a seam are preferred where they invert none either.

use std::collections::HashMap;

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::complex::{CoincidentArc, Complex, SeamArc};
use super::hub::Hub;
use ear_clipping::strip;

mod balance;
mod ear_clipping;
mod refinement;

/// The curve that an edge approximates.
#[derive(Clone, Copy, Debug, PartialEq)]
enum EdgeCurve {
    /// An arc between two of its angles; that of the lower-numbered vertex first.
    Arc(u32, f64, f64),
    /// An end circle, which is not subdivided.
    EndCircle,
}

/// A triangulation of the surface of a hub.
pub(super) struct Facets<'a> {
    hub: &'a Hub<'a>,
    complex: &'a Complex,
    /// Vertices: those of end circles first.
    pub points: Vec<Vec3>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// The face of each triangle.
    faces: Vec<u32>,
    /// Edges on the boundary of a face.
    boundary: HashMap<[u32; 2], EdgeCurve>,
    /// The triangle on the left of each directed edge.
    left_of: HashMap<[u32; 2], u32>,
    /// Triangles changed since they were last checked.
    changed: Vec<u32>,
    /// Chord error, mm.
    chord: f64,
    /// Chord error by which end circles are divided, mm: triangles at their edges are no nearer to the surface.
    at_circles: f64,
}

/// Orientation of a triangle seen from the centre, and six times the volume below it.
#[inline]
fn orientation(a: Vec3, b: Vec3, c: Vec3) -> f64 {
    dot(a, cross(b, c))
}

fn edge_key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The solid angle of a triangle at the centre, sr.
fn solid_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let (a, b, c) = (unit(a), unit(b), unit(c));
    2.0 * orientation(a, b, c).atan2(1.0 + dot(a, b) + dot(b, c) + dot(c, a))
}

/// Maximum turning angle of seams between vertices, radians: reduced until boundary polygons do not intersect
/// themselves.
const MAX_TURNING: [f64; 6] = [1.0, 0.5, 0.25, 0.12, 0.06, 0.03];
/// Fraction of the chord error allowed for edges on seams and end circles; edges inside faces use the rest.
pub(super) const SEAM_SHARE: f64 = 0.75;
/// Number of samples of a seam's curvature.
const SAMPLES: usize = 32;

impl<'a> Facets<'a> {
    /// A coarse triangulation of a hub's faces, given the vertices of its end circles by half-beam; to be refined to the first of two chord
    /// errors, those of end circles being divided by the second. `None` if a boundary polygon intersects itself.
    pub(super) fn new(
        hub: &'a Hub<'a>,
        complex: &'a Complex,
        end_circles: &[Vec<Vec3>],
        chords: [f64; 2],
    ) -> Option<Facets<'a>> {
        MAX_TURNING.iter().find_map(|&turn| Facets::coarse(hub, complex, end_circles, (chords, turn)))
    }

    fn coarse(
        hub: &'a Hub<'a>,
        complex: &'a Complex,
        end_circles: &[Vec<Vec3>],
        ([chord, at_circles], turns): ([f64; 2], f64),
    ) -> Option<Facets<'a>> {
        let mut out = Facets {
            hub,
            complex,
            points: end_circles.iter().flatten().copied().collect(),
            triangles: Vec::new(),
            faces: Vec::new(),
            boundary: HashMap::new(),
            left_of: HashMap::new(),
            changed: Vec::new(),
            chord,
            at_circles,
        };
        let mut firsts = Vec::with_capacity(end_circles.len());
        let mut first = 0u32;
        for end_circle in end_circles {
            let n = end_circle.len() as u32;
            firsts.push(first);
            for k in 0..n {
                out.boundary.insert(edge_key(first + k, first + (k + 1) % n), EdgeCurve::EndCircle);
            }
            first += n;
        }
        let coincident_arcs = complex.coincident_arcs(hub.radius);
        let polylines = out.polylines(turns, &coincident_arcs);
        for (number, face) in complex.faces.iter().enumerate() {
            if coincident_arcs.iter().flatten().any(|t| t.face == number) {
                continue;
            }
            let made = match face.end_circle {
                Some(half_beam) => {
                    let (half_beam, first) = (half_beam as usize, firsts[half_beam as usize]);
                    let ring: Vec<u32> = (0..end_circles[half_beam].len() as u32).map(|k| first + k).collect();
                    let inner = loop_vertices(&polylines, face.loops.first()?);
                    let strip = strip(hub.half_beams[half_beam].axis, &out.points, &inner, &ring);
                    let turned = |t: &[u32; 3]| {
                        let [a, b, c] = out.corners(*t);
                        orientation(a, b, c) <= 0.0
                    };
                    if strip.iter().any(turned) {
                        // Where a fillet reaches far along the half-beam, azimuths do not determine a triangulation.
                        out.connected(vec![inner, ring.into_iter().rev().collect()], face)?
                    } else {
                        strip
                    }
                }
                None => out.bounded(&polylines, face)?,
            };
            for t in made {
                if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                    out.push_triangle(t, number as u32);
                }
            }
        }
        // The solid angle is 4π minus that behind the end circles.
        let mut total_angle = 0.0;
        for t in &out.triangles {
            let t = out.corners(*t);
            if orientation(t[0], t[1], t[2]) <= 0.0 {
                return None;
            }
            total_angle += solid_angle(t);
        }
        for (end_circle, s) in end_circles.iter().zip(hub.half_beams) {
            total_angle += (0..end_circle.len())
                .map(|k| solid_angle([s.axis, end_circle[k], end_circle[(k + 1) % end_circle.len()]]).abs())
                .sum::<f64>();
        }
        if (total_angle - 4.0 * core::f64::consts::PI).abs() > 1e-6 {
            return None;
        }
        out.flip_all();
        Some(out)
    }

    fn corners(&self, t: [u32; 3]) -> [Vec3; 3] {
        t.map(|i| self.points[i as usize])
    }

    fn push_triangle(&mut self, t: [u32; 3], face: u32) {
        let number = self.triangles.len() as u32;
        self.triangles.push(t);
        self.faces.push(face);
        self.set_triangle(number, t);
    }

    fn set_triangle(&mut self, number: u32, t: [u32; 3]) {
        self.triangles[number as usize] = t;
        self.changed.push(number);
        for k in 0..3 {
            self.left_of.insert([t[k], t[(k + 1) % 3]], number);
        }
    }

    /// The vertices along each arc, both ends included.
    fn polylines(&mut self, turns: f64, coincident_arcs: &[Option<CoincidentArc>]) -> Vec<Vec<u32>> {
        let arcs = &self.complex.arcs;
        let mut representative: Vec<u32> = (0..self.complex.vertices.len() as u32).collect();
        for (arc, coincident) in arcs.iter().zip(coincident_arcs) {
            let Some(coincident) = coincident else { continue };
            let of = arcs[coincident.of as usize].ends;
            for k in 0..2 {
                let both = [arc.ends[k], of[if coincident.same { k } else { 1 - k }]];
                let [p, q] = both.map(|v| representative[v as usize]);
                let all = representative.iter_mut().filter(|s| **s == p.max(q));
                all.for_each(|s| *s = p.min(q));
            }
        }
        let mut vertices: Vec<u32> = Vec::with_capacity(representative.len());
        for (v, of) in self.complex.vertices.iter().zip(&representative) {
            vertices.push(match vertices.get(*of as usize) {
                Some(point) => *point,
                None => {
                    self.points.push(v.at);
                    self.points.len() as u32 - 1
                }
            });
        }
        let mut polylines: Vec<Vec<u32>> = Vec::with_capacity(self.complex.arcs.len());
        for (number, a) in arcs.iter().enumerate() {
            if let Some(coincident) = coincident_arcs[number] {
                let mut polyline = polylines[coincident.of as usize].clone();
                if !coincident.same {
                    polyline.reverse();
                }
                polylines.push(polyline);
                continue;
            }
            let [from, last] = a.ends.map(|v| vertices[v as usize]);
            let mut polyline = vec![from];
            let mut before = 0.0;
            for to in self.division(a, turns) {
                let point = if to == a.conic.end {
                    last
                } else {
                    self.points.push(a.conic.at(to));
                    self.points.len() as u32 - 1
                };
                let (p, q) = ((polyline[polyline.len() - 1], before), (point, to));
                let (p, q) = if p.0 < q.0 { (p, q) } else { (q, p) };
                let side = EdgeCurve::Arc(number as u32, p.1, q.1);
                self.boundary.insert([p.0, q.0], side);
                polyline.push(point);
                before = to;
            }
            polylines.push(polyline);
        }
        polylines
    }

    /// The parameters at which an arc is divided, its end included: uniform in the integral of the square root of
    /// normal curvature, with a limited turning angle.
    fn division(&self, arc: &SeamArc, turns: f64) -> Vec<f64> {
        let conic = &arc.conic;
        let at = |k: usize| {
            let (x, dx) = conic.with_derivative(conic.end * k as f64 / SAMPLES as f64);
            (x, unit(dx))
        };
        // A chord of length s has sagitta κs²/8.
        let per = 1.0 / (8.0 * SEAM_SHARE * self.chord).sqrt();
        let mut sums = [0.0; SAMPLES + 1];
        let mut from = at(0);
        for k in 1..=SAMPLES {
            let to = at(k);
            let (by, bend) = (norm(sub(to.0, from.0)), sub(to.1, from.1));
            let up = unit(self.hub.gradient(scale(add(from.0, to.0), 0.5)).1);
            let off = per * (dot(bend, up).abs() * by).sqrt();
            sums[k] = sums[k - 1] + off.max(norm(bend) / turns);
            from = to;
        }
        let whole = sums[SAMPLES];
        // A closed arc needs at least three edges.
        let least = if arc.ends[0] == arc.ends[1] { 3.0 } else { 1.0 };
        let n = (whole - 1e-6).ceil().max(least) as usize;
        let mut k = 1;
        let inner = (1..n).map(|i| {
            let want = whole * i as f64 / n as f64;
            while k < SAMPLES && sums[k] < want {
                k += 1;
            }
            let part = (want - sums[k - 1]) / (sums[k] - sums[k - 1]);
            conic.end * (k as f64 - 1.0 + part) / SAMPLES as f64
        });
        inner.chain([conic.end]).collect()
    }
}

/// The vertices of a loop in order, the first not repeated.
fn loop_vertices(polylines: &[Vec<u32>], walked: &[(u32, bool)]) -> Vec<u32> {
    let mut out = Vec::new();
    for &(arc, forward) in walked {
        let polyline = &polylines[arc as usize];
        let n = polyline.len() - 1;
        out.extend((0..n).map(|k| polyline[if forward { k } else { n - k }]));
    }
    out
}
