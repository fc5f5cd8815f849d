//! Meshing without a grid: the faces of each hub in triangles, joined by the numbers of the points they share.
//!
//! The circle in which a beam is parted belongs to the beam, and both its hubs use its points; a seam belongs to the hub and
//! both its faces use its points. So the mesh is closed by construction. Sides are halved until they and the triangles are
//! within the chord error of the surface. Hubs that are equal but for their place are meshed once.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use rayon::prelude::*;

use crate::fault::{Fault, number};
use crate::math::{Vec3, add, cross, dot, scale, sub, unit};
use crate::mesh::Mesh;

use super::Quadors;
use super::classes::Classes;
use super::complex::Complex;
use super::facets::Facets;
use super::hub::{Hub, Stub};
use super::integral::tangled;

/// A hub in triangles.
struct Part {
    /// Places about the centre: those of its rims first, stub by stub.
    points: Vec<Vec3>,
    rims: usize,
    triangles: Vec<[u32; 3]>,
    /// How far the triangles are from the surface, mm.
    error: f64,
}

/// A direction across an axis, the same for an axis and its opposite. Where it changes no usual direction lies, so that beams that
/// are equal but for rounding have it in common.
pub(super) fn across(axis: Vec3) -> Vec3 {
    let pole = if axis[0].abs() < 0.618_034 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    unit(sub(pole, scale(axis, dot(pole, axis))))
}

impl Quadors {
    /// Points on the rim of a beam for a chord error.
    fn ring(&self, beam: usize, chord: f64) -> usize {
        let p = &self.pencils[beam];
        let r = p.squared(p.split()).max(0.0).sqrt();
        let half = (1.0 - chord / r).clamp(-1.0, 1.0).acos();
        ((PI / half).ceil() as usize).max(8)
    }

    /// The surface as triangles that stay within `chord` (mm) of it where they were asked to, and how far they do stay, mm.
    ///
    /// # Errors
    /// A chord error that is no length, beams that overlap too far, and more points than 32 bits can number.
    pub fn mesh(&self, chord: f64) -> Result<(Mesh, f64), Fault> {
        if !(chord > 0.0 && chord.is_finite()) {
            return Err(Fault::new(
                "chord",
                format!(
                    "{} mm is no chord error: give a finite number above zero",
                    number(chord)
                ),
            ));
        }
        self.exact()?;
        let classes = self.classes();
        // Where beams that nearly touch would cross, all is drawn finer.
        for finer in [1.0, 0.5, 0.25, 0.125] {
            let chord = chord * finer;
            let each = |&i: &usize| {
                let hub = self.hub(i);
                let rings: Vec<usize> = (hub.stubs.iter())
                    .map(|s| self.ring(s.beam as usize, chord))
                    .collect();
                Part::new(&hub, &self.complex(i)?, &rings, chord).ok_or_else(|| tangled(i))
            };
            let parts = classes.sample.par_iter().map(each);
            let parts: Vec<Part> = parts.collect::<Result<_, _>>()?;
            if !self.crossed(&classes, &parts, chord) {
                let error = parts.iter().map(|p| p.error).fold(0.0, f64::max);
                return Ok((self.laid(0..self.len(), &classes, &parts, chord)?, error));
            }
        }
        Err(Fault::new(
            "chord",
            "beams run so close to one another that triangles of this size cross: ask for a smaller chord error",
        ))
    }

    /// Whether triangles of hubs that are joined cross: those of beams that nearly touch, drawn coarsely. Within a hub they
    /// cannot.
    fn crossed(&self, classes: &Classes, parts: &[Part], chord: f64) -> bool {
        let beside = |i: usize| {
            let other = |s: &Stub| self.ends[s.beam as usize][1 - s.end] as usize;
            self.hub(i).stubs.iter().map(other).collect::<Vec<usize>>()
        };
        // Each hub with those beside it, as far as they differ by their classes.
        let mut kinds: HashMap<Vec<u32>, usize> = HashMap::new();
        for i in 0..self.len() {
            let key = core::iter::once(i).chain(beside(i));
            kinds
                .entry(key.map(|j| classes.of[j]).collect())
                .or_insert(i);
        }
        let crosses = |hubs: &[usize]| {
            let mesh = self.laid(hubs.iter().copied(), classes, parts, chord);
            mesh.is_ok_and(|m| crate::mesh::self_intersections(&m, 1) > 0)
        };
        // Where nearly all differ it is less work to look at the whole at once.
        if kinds.len() > 64 && 4 * kinds.len() > self.len() {
            let all: Vec<usize> = (0..self.len()).collect();
            return crosses(&all);
        }
        let kinds: Vec<usize> = kinds.into_values().collect();
        kinds.into_par_iter().any(|i| {
            let mut hubs = beside(i);
            hubs.push(i);
            hubs.sort_unstable();
            hubs.dedup();
            crosses(&hubs)
        })
    }

    /// Parts in their places, joined by the points of the rims between them.
    fn laid(
        &self,
        hubs: impl Iterator<Item = usize>,
        classes: &Classes,
        parts: &[Part],
        chord: f64,
    ) -> Result<Mesh, Fault> {
        let mut first: HashMap<u32, u32> = HashMap::new();
        let mut mesh = Mesh::default();
        for i in hubs {
            let (part, hub, center) = (&parts[classes.of[i] as usize], self.hub(i), self.center(i));
            let mut names = Vec::with_capacity(part.points.len());
            for s in hub.stubs {
                let b = s.beam as usize;
                let n = self.ring(b, chord);
                let from = *first.entry(s.beam).or_insert_with(|| {
                    let p = &self.pencils[b];
                    let ends = self.ends[b].map(|h| self.center(h as usize));
                    let axis = scale(sub(ends[1], ends[0]), 1.0 / p.length);
                    let middle = add(ends[0], scale(axis, p.split()));
                    let from = mesh.vertices.len() as u32;
                    let radius = p.squared(p.split()).max(0.0).sqrt();
                    mesh.vertices
                        .extend(circle(axis, n, radius).map(|x| add(middle, x)));
                    from
                });
                names.extend(from..from + n as u32);
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
            mesh.triangles
                .extend(part.triangles.iter().map(|t| t.map(|v| names[v as usize])));
        }
        Ok(mesh)
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
    fn new(hub: &Hub, complex: &Complex, rings: &[usize], chord: f64) -> Option<Part> {
        let rims: Vec<Vec<Vec3>> = (hub.stubs.iter().zip(rings))
            .map(|(s, &n)| {
                // The beam's own frame runs from its first end.
                let axis = if s.end == 0 {
                    s.axis
                } else {
                    scale(s.axis, -1.0)
                };
                let radius = s.squared(s.split).max(0.0).sqrt();
                let middle = scale(s.axis, s.split);
                circle(axis, n, radius).map(|x| add(middle, x)).collect()
            })
            .collect();
        let mut facets = Facets::new(hub, complex, &rims)?;
        let error = facets.refine(chord)?;
        Some(Part {
            rims: rings.iter().sum(),
            points: facets.points,
            triangles: facets.triangles,
            error,
        })
    }
}
