//! Faces, edges and corners from the boundary complexes of hubs.

use core::f64::consts::{FRAC_1_SQRT_2, PI};
use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;
use geometry::union_find::{find, unite};
use rayon::prelude::*;

use super::super::bezier::Bezier;
use super::super::complex::{Complex, QuadricFace};
use super::super::hub::Hub;
use super::super::hub_quadric::Quadric;
use super::super::integral::unresolved_face;
use super::super::perpendicular::perpendicular;
use super::cuts::CutPlane;
use super::{Brep, BrepFace, EdgeUse, Frame, Kind, NONE, Surface};

/// Number of planes along a beam from which the one to cut it is chosen.
const PLANES: usize = 16;
/// Sine of the angle about the axis between a corner and a plane within which the plane passes through it.
const AT_CORNER: f64 = 1e-10;
/// Least sine of that angle for other corners.
const CLEARANCE: f64 = 1e-4;
/// What a crossing at a corner, which needs no new corner, counts for in the choice of a plane, compared with that sine.
const CORNER_WORTH: f64 = 1.0;

/// The boundary complex of a hub with divided arcs, without faces of zero width.
pub(super) struct Outline {
    corners: Vec<Vec3>,
    edges: Vec<([u32; 2], Bezier<3>)>,
    faces: Vec<(Quadric, Kind, Vec<Vec<EdgeUse>>)>,
}

impl Outline {
    pub(super) fn new(hub: &Hub, complex: &Complex) -> Outline {
        let coincident = complex.coincident_arcs(hub.radius);
        // Vertices at the ends of coincident arcs are one.
        let mut to: Vec<u32> = (0..complex.vertices.len() as u32).collect();
        for (arc, later) in complex.arcs.iter().zip(&coincident) {
            let Some(later) = later else { continue };
            let of = complex.arcs[later.of as usize].ends;
            let of = if later.same { of } else { [of[1], of[0]] };
            arc.ends.iter().zip(of).for_each(|(p, q)| {
                unite(&mut to, *p, q);
            });
        }
        let mut out = Outline { corners: Vec::new(), edges: Vec::new(), faces: Vec::new() };
        let mut number = vec![NONE; to.len()];
        let mut chains: Vec<Vec<u32>> = Vec::with_capacity(complex.arcs.len());
        for (arc, later) in complex.arcs.iter().zip(&coincident) {
            let mut chain = Vec::new();
            if later.is_none() {
                let ends = arc.ends.map(|v| {
                    let root = find(&mut to, v) as usize;
                    if number[root] == NONE {
                        number[root] = out.corners.len() as u32;
                        out.corners.push(complex.vertices[root].at);
                    }
                    number[root]
                });
                out.push_chain(ends, arc.curves(), &mut chain);
            }
            chains.push(chain);
        }
        for (index, face) in complex.faces.iter().enumerate() {
            if coincident.iter().flatten().any(|c| c.face == index) {
                continue;
            }
            let edges = |&(arc, forward): &EdgeUse| {
                let (mut arc, mut forward) = (arc, forward);
                while let Some(later) = &coincident[arc as usize] {
                    (arc, forward) = (later.of, forward == later.same);
                }
                let mut uses: Vec<EdgeUse> = chains[arc as usize].iter().map(|e| (*e, forward)).collect();
                if !forward {
                    uses.reverse();
                }
                uses
            };
            let loops = face.loops.iter().map(|l| l.iter().flat_map(edges).collect()).collect();
            out.faces.push((face.quadric, kind(hub, complex, face), loops));
        }
        if hub.half_beams.is_empty() {
            out.whole_ball(hub.radius);
        }
        out
    }

    fn push_chain(&mut self, ends: [u32; 2], curves: Vec<Bezier<3>>, chain: &mut Vec<u32>) {
        let (mut from, count) = (ends[0], curves.len());
        for (k, mut curve) in curves.into_iter().enumerate() {
            let to = if k + 1 == count {
                ends[1]
            } else {
                self.corners.push(curve.points[2]);
                self.corners.len() as u32 - 1
            };
            curve.points[0] = self.corners[from as usize];
            curve.points[2] = self.corners[to as usize];
            chain.push(self.edges.len() as u32);
            self.edges.push(([from, to], curve));
            from = to;
        }
    }

    /// A ball without beams, as four lunes about the z axis.
    fn whole_ball(&mut self, radius: f64) {
        let faces = std::mem::take(&mut self.faces);
        let quarter = |p: Vec3, q: Vec3| Bezier { points: [p, add(p, q), q], weight: FRAC_1_SQRT_2 };
        let around = [[radius, 0.0, 0.0], [0.0, radius, 0.0], [-radius, 0.0, 0.0], [0.0, -radius, 0.0]];
        let [low, high] = [[0.0, 0.0, -radius], [0.0, 0.0, radius]];
        self.corners = vec![low, high];
        self.corners.extend(around);
        for (k, side) in around.into_iter().enumerate() {
            let corner = k as u32 + 2;
            self.edges.push(([0, corner], quarter(low, side)));
            self.edges.push(([corner, 1], quarter(side, high)));
        }
        for (quadric, ..) in faces {
            for k in 0..4 {
                let (west, east) = (2 * k, 2 * ((k + 1) % 4));
                let lune = vec![(east, true), (east + 1, true), (west + 1, false), (west, false)];
                self.faces.push((quadric, Kind::Ball([0.0, 0.0, 1.0]), vec![lune]));
            }
        }
    }
}

/// What a face of a hub is part of.
fn kind(hub: &Hub, complex: &Complex, face: &QuadricFace) -> Kind {
    if let Some(half_beam) = face.end_circle {
        return Kind::Beam(half_beam);
    }
    if face.label != 0 {
        return Kind::Fillet(hub.half_beams[face.label.trailing_zeros() as usize].axis);
    }
    let around = face.loops.iter().flatten().flat_map(|(arc, _)| complex.arcs[*arc as usize].labels);
    let label = around.max().unwrap_or(0);
    Kind::Ball(hub.half_beams.get(label.trailing_zeros() as usize).map_or([0.0, 0.0, 1.0], |s| s.axis))
}

impl Brep<'_> {
    /// Fills in the faces of all hubs, and cuts those of beams along their axes.
    pub(super) fn outline(&mut self) -> Result<(), Fault> {
        let quadors = self.quadors;
        let classes = quadors.classes();
        let outlines = classes
            .sample
            .par_iter()
            .map(|&i| Ok(Outline::new(&quadors.hub(i), &quadors.complex(i)?)))
            .collect::<Result<Vec<Outline>, Fault>>()?;
        // The face of a beam, once the first of its hubs is known, with its class and half-beam.
        let mut first: Vec<Option<(BrepFace, [u32; 2])>> = vec![None; quadors.beams()];
        let mut planes: HashMap<[u32; 4], (CutPlane, Vec3)> = HashMap::new();
        for hub in 0..quadors.len() as u32 {
            checkpoint();
            let class = classes.of[hub as usize];
            let outline = &outlines[class as usize];
            for face in self.place(hub, class, outline) {
                let Kind::Beam(half_beam) = face.kind else {
                    self.faces.push(face);
                    continue;
                };
                let beam = quadors.hub(hub as usize).half_beams[half_beam as usize].beam as usize;
                let Some((mut whole, before)) = first[beam].take() else {
                    first[beam] = Some((face, [class, half_beam]));
                    continue;
                };
                let start = whole.frame.hub;
                let (plane, by) = *planes.entry([before[0], before[1], class, half_beam]).or_insert_with(|| {
                    let axis = quadors.hub(classes.sample[before[0] as usize]).half_beams[before[1] as usize].axis;
                    (self.plane_along(axis, &[&whole, &face]), sub(self.center(hub), self.center(start)))
                });
                whole.frame = Frame { hub: start, other: hub, by };
                whole.loops.extend(face.loops);
                let made = self.faces.len() as u32;
                self.faces.push(whole);
                self.cut(made, &plane).ok_or_else(|| unresolved_face(hub as usize))?;
            }
        }
        Ok(())
    }

    /// Adds the corners and edges of a hub, and gives its faces: their surfaces are chosen once all are known.
    pub(super) fn place(&mut self, hub: u32, class: u32, outline: &Outline) -> Vec<BrepFace> {
        let (corner, edge) = (self.corners.len() as u32, self.edges.len() as u32);
        outline.corners.iter().for_each(|at| {
            self.push_corner(hub, *at);
        });
        outline.edges.iter().for_each(|(ends, curve)| {
            self.push_edge(hub, ends.map(|v| v + corner), *curve);
        });
        let numbered = |l: &Vec<EdgeUse>| l.iter().map(|(e, forward)| (e + edge, *forward)).collect();
        let face = |(index, (quadric, kind, loops)): (usize, &(Quadric, Kind, Vec<Vec<EdgeUse>>))| BrepFace {
            frame: Frame { hub, other: hub, by: [0.0; 3] },
            quadric: *quadric,
            loops: loops.iter().map(numbered).collect(),
            surface: Surface::Sphere { axis: [0.0; 3], side: [0.0; 3], radius: 0.0 },
            kind: *kind,
            class: [class, index as u32],
        };
        outline.faces.iter().enumerate().map(face).collect()
    }

    /// The plane along the axis of a beam that meets its boundary loops at corners, where one does, or else far from them.
    pub(super) fn plane_along(&self, axis: Vec3, halves: &[&BrepFace]) -> CutPlane {
        let side = perpendicular(axis);
        let other = cross(axis, side);
        let turned = |k: usize| {
            let (sin, cos) = (PI * k as f64 / PLANES as f64).sin_cos();
            add(scale(side, cos), scale(other, sin))
        };
        let curves: Vec<(u32, Bezier<3>)> = halves
            .iter()
            .enumerate()
            .flat_map(|(half, face)| {
                let uses = face.loops.iter().flatten();
                uses.map(move |u| (half as u32, self.curve(*u, &face.frame)))
            })
            .collect();
        let through = curves.iter().map(|(_, c)| unit(cross(axis, c.points[0])));
        let mut best = (side, f64::NEG_INFINITY);
        for normal in through.chain((0..PLANES).map(turned)) {
            let plane = CutPlane::through([0.0; 3], normal);
            let (mut clearance, mut crossings, mut at_corners) = (1.0f64, [0; 2], 0);
            for (half, curve) in &curves {
                let [p, ..] = curve.points;
                let off = dot(p, normal).abs() / norm(cross(p, axis));
                if off < AT_CORNER {
                    at_corners += 1;
                    crossings[*half as usize] += 1;
                } else {
                    clearance = clearance.min(off);
                }
                crossings[*half as usize] += plane.roots(curve).into_iter().flatten().count();
            }
            let wrong = crossings.iter().filter(|n| **n != 2).count();
            let score = clearance + f64::from(at_corners) * CORNER_WORTH - 10.0 * wrong as f64;
            // A later plane must be better by more than rounding.
            if score > best.1 + 1e-6 && (clearance > CLEARANCE || best.1.is_infinite()) {
                best = (normal, score);
            }
        }
        CutPlane::through([0.0; 3], best.0)
    }
}
