//! Beams in triangles, hubs that are equal but for their place once: joined to one mesh, or handed out hub by hub.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::mesh::Mesh;
use geometry::union_find::unite;

use super::Quadors;
use super::classes::Classes;
use super::complex::Complex;
use super::facets::{Facets, TAKEN};
use super::hub::{Hub, Stub};

/// Beams in triangles.
pub struct Drawn<'a> {
    pub(super) quadors: &'a Quadors,
    pub(super) classes: Classes,
    pub(super) parts: Vec<Part>,
    /// The chord error that rims are drawn to, mm.
    pub(super) chord: f64,
}

/// What is told of a surface in triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// How many there are.
    pub triangles: usize,
    /// What they enclose, mm³.
    pub volume: f64,
    /// Their area, mm².
    pub area: f64,
    /// Corners less sides plus triangles.
    pub euler: i64,
    /// Bodies: none has a cavity, as every hub is seen whole from its centre.
    pub pieces: usize,
}

/// A hub in triangles.
pub(super) struct Part {
    /// Places about the centre: those of its rims first, stub by stub.
    pub points: Vec<Vec3>,
    pub rims: usize,
    pub triangles: Vec<[u32; 3]>,
    pub bounds: Aabb,
    /// How far the triangles are from the surface, mm.
    pub error: f64,
}

/// A direction across an axis, the same for an axis and its opposite. Where it changes no usual direction lies, so that beams that
/// are equal but for rounding have it in common.
pub(super) fn across(axis: Vec3) -> Vec3 {
    let pole = if axis[0].abs() < 0.618_034 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    unit(sub(pole, scale(axis, dot(pole, axis))))
}

impl Quadors {
    /// Points on the rim of a beam for a chord error.
    pub(super) fn ring(&self, beam: usize, chord: f64) -> usize {
        let p = &self.pencils[beam];
        let r = p.squared(p.split()).max(0.0).sqrt();
        let half = (1.0 - TAKEN * chord / r).clamp(-1.0, 1.0).acos();
        ((PI / half).ceil() as usize).max(8)
    }

    /// The points of a beam's rim, the same for both its hubs.
    fn rim(&self, beam: usize, chord: f64) -> impl Iterator<Item = Vec3> {
        let p = &self.pencils[beam];
        let ends = self.ends[beam].map(|h| self.center(h as usize));
        let axis = scale(sub(ends[1], ends[0]), 1.0 / p.length);
        let middle = add(ends[0], scale(axis, p.split()));
        let radius = p.squared(p.split()).max(0.0).sqrt();
        circle(axis, self.ring(beam, chord), radius).map(move |x| add(middle, x))
    }
}

impl Quadors {
    /// How many there are of what beams join.
    fn pieces(&self) -> usize {
        let mut to: Vec<u32> = (0..self.len() as u32).collect();
        let joined = self.ends.iter().filter(|[a, b]| unite(&mut to, *a, *b));
        self.len() - joined.count()
    }
}

impl Drawn<'_> {
    /// How many triangles there are.
    pub fn triangles(&self) -> usize {
        let each = self.parts.iter().zip(&self.classes.count);
        each.map(|(p, n)| p.triangles.len() * n).sum()
    }

    /// How far they are from the surface, mm: as found at the quarters of sides and the middles of triangles.
    pub fn error(&self) -> f64 {
        self.parts.iter().map(|p| p.error).fold(0.0, f64::max)
    }

    /// How many hubs there are.
    pub fn hubs(&self) -> usize {
        self.quadors.len()
    }

    /// The triangles of a hub in their places. Those of all hubs together are closed: what two have in common is the same to the
    /// last bit.
    pub fn hub(&self, hub: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let (part, center) = (self.part(hub), self.quadors.center(hub));
        let mut places = Vec::with_capacity(part.points.len());
        for s in self.quadors.hub(hub).stubs {
            places.extend(self.quadors.rim(s.beam as usize, self.chord));
        }
        places.extend(part.points[part.rims..].iter().map(|p| add(center, *p)));
        let each = part.triangles.iter();
        each.map(move |t| t.map(|v| places[v as usize]))
    }

    /// The figures of all of it, from those of each class.
    pub fn figures(&self) -> Figures {
        let (mut volume, mut area, mut euler) = (0.0, 0.0, 0i64);
        for (c, (part, count)) in self.parts.iter().zip(&self.classes.count).enumerate() {
            let (hub, n) = (self.quadors.hub(self.classes.sample[c]), *count as f64);
            let (mut six, mut twice) = (0.0, 0.0);
            for t in &part.triangles {
                let [a, b, c] = t.map(|v| part.points[v as usize]);
                six += dot(a, cross(b, c));
                twice += norm(cross(sub(b, a), sub(c, a)));
            }
            // The rims are closed by flat polygons.
            for s in hub.stubs {
                let k = self.quadors.ring(s.beam as usize, self.chord) as f64;
                six += s.split * s.squared(s.split) * k * (TAU / k).sin();
            }
            volume += n * six / 6.0;
            area += n * twice / 2.0;
            // As many corners as sides on every rim, so that a hub counts as a ball with a hole for each.
            euler += *count as i64 * (2 - hub.stubs.len() as i64);
        }
        Figures { triangles: self.triangles(), volume, area, euler, pieces: self.quadors.pieces() }
    }

    pub(super) fn part(&self, hub: usize) -> &Part {
        &self.parts[self.classes.of[hub] as usize]
    }

    /// Some hubs as one mesh, joined by the points of the rims between them.
    pub(super) fn joined(&self, hubs: impl Iterator<Item = usize>) -> Result<Mesh, Fault> {
        let mut first: HashMap<u32, u32> = HashMap::new();
        let mut mesh = Mesh::default();
        let quadors = self.quadors;
        for i in hubs {
            let (part, center) = (self.part(i), quadors.center(i));
            let mut names = Vec::with_capacity(part.points.len());
            for s in quadors.hub(i).stubs {
                let n = quadors.ring(s.beam as usize, self.chord) as u32;
                let from = *first.entry(s.beam).or_insert_with(|| {
                    let from = mesh.vertices.len() as u32;
                    mesh.vertices.extend(quadors.rim(s.beam as usize, self.chord));
                    from
                });
                names.extend(from..from + n);
            }
            for p in &part.points[part.rims..] {
                names.push(mesh.vertices.len() as u32);
                mesh.vertices.push(add(center, *p));
            }
            if mesh.vertices.len() > u32::MAX as usize / 2 {
                return Err(Fault::new(
                    "chord",
                    "the mesh would have more than two billion points: allow a larger chord error",
                ));
            }
            mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| names[v as usize])));
        }
        Ok(mesh)
    }

    /// All of it as one mesh.
    ///
    /// # Errors
    /// More points than 32 bits can number.
    pub fn mesh(&self) -> Result<Mesh, Fault> {
        self.joined(0..self.hubs())
    }
}

/// `n` points on a circle about an axis.
fn circle(axis: Vec3, n: usize, r: f64) -> impl Iterator<Item = Vec3> {
    let side = across(axis);
    let other = cross(axis, side);
    (0..n).map(move |k| {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        add(scale(side, r * cos), scale(other, r * sin))
    })
}

impl Part {
    /// A hub in triangles whose rims have as many points as told; `None` if an outline of it crosses itself.
    pub fn new(hub: &Hub, complex: &Complex, rings: &[usize], chord: f64) -> Option<Part> {
        let rims: Vec<Vec<Vec3>> = (hub.stubs.iter().zip(rings))
            .map(|(s, &n)| {
                // The beam's own frame runs from its first end.
                let axis = if s.end == 0 { s.axis } else { scale(s.axis, -1.0) };
                let radius = s.squared(s.split).max(0.0).sqrt();
                let middle = scale(s.axis, s.split);
                circle(axis, n, radius).map(|x| add(middle, x)).collect()
            })
            .collect();
        let mut facets = Facets::new(hub, complex, &rims, chord)?;
        // Points of a rim are on its circle.
        let sagitta = |(s, n): (&Stub, &usize)| s.squared(s.split).max(0.0).sqrt() * (1.0 - (PI / *n as f64).cos());
        let rims_off = hub.stubs.iter().zip(rings).map(sagitta).fold(0.0, f64::max);
        let error = facets.refine()?.max(rims_off);
        Some(Part {
            rims: rings.iter().sum(),
            bounds: facets.points.iter().fold(Aabb::EMPTY, |b, p| b.with(*p)),
            points: facets.points,
            triangles: facets.triangles,
            error,
        })
    }
}
