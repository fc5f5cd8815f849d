//! The boundary complex of a hub: faces on quadrics, conic arcs in the planes between them, and vertices.
//!
//! A face is identified by its *label*, the set of active half-beams. Across a seam one half-beam becomes active or
//! inactive (in a sharp hub one replaces another), where an affine function vanishes. `seam_tracing` finds the complex
//! by following seams from event to event.

use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, norm, scale, sub, unit};
use geometry::union_find::{find, unite};

use super::affine_function::AffineFunction;
use super::bezier::{Bezier, curves};
use super::conic::Conic;
use super::gauss::gauss;
use super::hub::Hub;
use super::hub_quadric::Quadric;

mod coincident_arcs;
mod seam_tracing;

pub(super) use coincident_arcs::CoincidentArc;
use seam_tracing::SeamTracer;
pub(super) use seam_tracing::perturbation;

/// A point where seams meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position relative to the hub's centre, mm.
    pub at: Vec3,
    key: Key,
}

/// Identity of a vertex: the labels around it, and which of the two intersections of a line with a quadric it is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    labels_around: [u64; 4],
    far: bool,
}

/// A seam between two vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamArc {
    /// Its vertices; equal if it is closed.
    pub ends: [u32; 2],
    /// The labels on its left and right, seen from outside.
    pub labels: [u64; 2],
    /// The conic, from the first to the second vertex.
    pub(crate) conic: Conic,
    /// The plane of the seam.
    pub(crate) plane: AffineFunction,
}

impl SeamArc {
    /// The conic as rational quadratic Bézier curves, from the first to the second vertex.
    pub fn curves(&self) -> Vec<Bezier<3>> {
        curves(&self.conic, 0.0, self.conic.end)
    }
}

/// A face: a connected piece of one quadric.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadricFace {
    /// The active half-beams, as a bit mask: none on the ball, one on a half-beam, two on a fillet, more in a corner.
    pub label: u64,
    /// The quadric, in the hub's frame.
    pub quadric: Quadric,
    /// Boundary loops with the face on the left: arcs, each with whether it is traversed from its first vertex.
    pub loops: Vec<Vec<(u32, bool)>>,
    /// The half-beam whose end circle, in the split plane, also bounds the face.
    pub end_circle: Option<u32>,
}

/// The boundary complex of a hub.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Complex {
    /// The vertices.
    pub vertices: Vec<Vertex>,
    /// The arcs.
    pub arcs: Vec<SeamArc>,
    /// The faces.
    pub faces: Vec<QuadricFace>,
}

/// Length below which an arc is collapsed to a point, in hub radii: far above the perturbation, far below any feature.
const COLLAPSE_LENGTH: f64 = 1e-7;

const NONE: u32 = u32::MAX;

impl Complex {
    /// The boundary complex of a hub.
    ///
    /// # Errors
    /// More than 64 beams, and hubs whose seams do not close (beams inside each other).
    pub fn new(hub: &Hub) -> Result<Complex, Fault> {
        if hub.half_beams.len() > 64 {
            return Err(Fault::new(
                "",
                format!("the hub has {} beams; closed forms support at most 64", hub.half_beams.len()),
            ));
        }
        let unresolved = || {
            Fault::new(
                "",
                "beams lie inside each other, so that the surface of the hub cannot be resolved: make them thinner, or use the field",
            )
        };
        // A different, larger perturbation may separate events that coincided within rounding.
        for seed in 0..4 {
            let mut tracer = SeamTracer::new(hub, seed);
            if tracer.trace_all().is_none() {
                continue;
            }
            if let Some(complex) = tracer.assemble() {
                return Ok(complex);
            }
        }
        Err(unresolved())
    }

    /// V − E + F, where a face counts one less for each loop beyond its first and end circles are capped: 2, as for a
    /// sphere.
    pub fn euler(&self) -> i64 {
        let faces: i64 = self.faces.iter().map(|f| 2 - f.loops.len() as i64).sum();
        self.vertices.len() as i64 - self.arcs.len() as i64 + faces
    }
}

impl Complex {
    /// The centre of a spherical face with one boundary loop: of a cap, or of the complement of a cap.
    pub(super) fn pole(&self, face: &QuadricFace) -> Vec3 {
        let (mut sum, mut arrow) = ([0.0; 3], [0.0; 3]);
        for &(arc, forward) in face.loops.iter().flatten() {
            let conic = &self.arcs[arc as usize].conic;
            for &(t, w) in gauss(4) {
                let (x, dx) = conic.with_derivative(t * conic.end);
                let turn = w * conic.end * if forward { 1.0 } else { -1.0 };
                sum = add(sum, scale(unit(x), w * conic.end * norm(dx)));
                arrow = add(arrow, scale(cross(x, dx), turn));
            }
        }
        // The loop may be longer than a great circle: its vector area still points to the face.
        let flat = norm(arrow) <= 1e-3 * norm(sum);
        let p = unit(if flat { sum } else { arrow });
        scale(p, face.quadric.ray_exit(p))
    }

    /// The complex with arcs shorter than `least` (mm) collapsed.
    fn collapsed(self, least: f64) -> Complex {
        let mut to: Vec<u32> = (0..self.vertices.len() as u32).collect();
        let mut short = vec![false; self.arcs.len()];
        for (i, a) in self.arcs.iter().enumerate() {
            let [p, q] = a.ends;
            let chord = |v: Vec3| norm(sub(v, self.vertices[p as usize].at));
            if p != q && chord(self.vertices[q as usize].at) < least && chord(a.conic.at(a.conic.end / 2.0)) < least {
                short[i] = true;
                unite(&mut to, p, q);
            }
        }
        if !short.contains(&true) {
            return self;
        }
        let mut new_vertex = vec![NONE; to.len()];
        let mut vertices = Vec::new();
        for (v, n) in new_vertex.iter_mut().enumerate() {
            if to[v] == v as u32 {
                *n = vertices.len() as u32;
                vertices.push(self.vertices[v]);
            }
        }
        let mut new_arc = vec![NONE; short.len()];
        let mut arcs = Vec::new();
        for (i, a) in self.arcs.iter().enumerate() {
            if !short[i] {
                new_arc[i] = arcs.len() as u32;
                arcs.push(SeamArc { ends: a.ends.map(|v| new_vertex[find(&mut to, v) as usize]), ..*a });
            }
        }
        let mut faces = self.faces;
        for l in faces.iter_mut().flat_map(|f| &mut f.loops) {
            l.retain(|(a, _)| !short[*a as usize]);
            l.iter_mut().for_each(|(a, _)| *a = new_arc[*a as usize]);
        }
        faces.retain(|f| f.loops.is_empty() || f.loops.iter().any(|l| !l.is_empty()));
        Complex { vertices, arcs, faces }
    }
}
