//! Meshing without a grid: the faces of each hub in triangles, joined by the numbers of the points they share.
//!
//! The circle in which a beam is parted belongs to the beam, and both its hubs use its points; a seam belongs to the hub and
//! both its faces use its points. So the mesh is closed by construction. Sides are halved until the middle of each is within
//! the chord error of the surface. Hubs that are equal but for their place are meshed once.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use rayon::prelude::*;

use crate::fault::{Fault, number};
use crate::math::{Vec3, add, cross, dot, scale, sub, unit};
use crate::mesh::Mesh;

use super::Quadors;
use super::complex::Complex;
use super::facets::Facets;
use super::hub::Hub;
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

/// A direction across an axis, the same for an axis and its opposite.
pub(super) fn across(axis: Vec3) -> Vec3 {
    let pole = if axis[0].abs() < 0.6 {
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
        // Hubs that are equal to a billionth, one of each.
        let mut classes: HashMap<Vec<i64>, usize> = HashMap::new();
        let mut samples = Vec::new();
        let class: Vec<usize> = (0..self.len())
            .map(|i| {
                let hub = self.hub(i);
                let mut key = vec![(hub.radius * 1e9).round() as i64];
                for s in hub.stubs {
                    let numbers = [
                        s.axis[0],
                        s.axis[1],
                        s.axis[2],
                        s.g.b,
                        s.contact,
                        s.split,
                        s.section[0],
                        s.section[1],
                        s.section[2],
                        s.share,
                    ];
                    key.extend(numbers.map(|v| (v * 1e9).round() as i64));
                    key.push(s.end as i64);
                }
                *classes.entry(key).or_insert_with(|| {
                    samples.push(i);
                    samples.len() - 1
                })
            })
            .collect();
        let parts: Vec<Part> = samples
            .par_iter()
            .map(|&i| {
                let hub = self.hub(i);
                let complex = self.complex(i)?;
                let rings: Vec<usize> = hub
                    .stubs
                    .iter()
                    .map(|s| self.ring(s.beam as usize, chord))
                    .collect();
                part(&hub, &complex, &rings, chord).ok_or_else(|| tangled(i))
            })
            .collect::<Result<_, _>>()?;
        let mut first = Vec::with_capacity(self.pencils.len());
        let mut mesh = Mesh::default();
        for (i, p) in self.pencils.iter().enumerate() {
            first.push(mesh.vertices.len());
            let ends = self.ends[i].map(|h| self.center(h as usize));
            let axis = scale(sub(ends[1], ends[0]), 1.0 / p.length);
            let center = add(ends[0], scale(axis, p.split()));
            mesh.vertices.extend(
                circle(
                    axis,
                    self.ring(i, chord),
                    p.squared(p.split()).max(0.0).sqrt(),
                )
                .map(|x| add(center, x)),
            );
        }
        let mut error = 0.0f64;
        for (i, &c) in class.iter().enumerate() {
            let (part, hub, center) = (&parts[c], self.hub(i), self.center(i));
            error = error.max(part.error);
            let mut names = Vec::with_capacity(part.points.len());
            for s in hub.stubs {
                let n = self.ring(s.beam as usize, chord);
                names.extend((0..n).map(|k| (first[s.beam as usize] + k) as u32));
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
        Ok((mesh, error))
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

/// A hub in triangles.
fn part(hub: &Hub, complex: &Complex, rings: &[usize], chord: f64) -> Option<Part> {
    let rims: Vec<Vec<Vec3>> = (hub.stubs.iter().zip(rings))
        .map(|(s, &n)| {
            // The beam's own frame runs from its first end.
            let axis = if s.end == 0 {
                s.axis
            } else {
                scale(s.axis, -1.0)
            };
            let (r, center) = (
                s.squared(s.split).max(0.0).sqrt(),
                scale(s.axis, s.split),
            );
            circle(axis, n, r).map(|x| add(center, x)).collect()
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
