//! Meshing without a grid: the faces of each hub in triangles, joined by the numbers of the points they share.
//!
//! The circle in which a beam is parted belongs to the beam, and both its hubs use its points; a seam belongs to the hub and
//! both its faces use its points. So the mesh is closed by construction. Sides are halved until they and the triangles are
//! within the chord error of the surface. Hubs that are equal but for their place are meshed once.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use rayon::prelude::*;

use crate::fault::{Fault, number};
use crate::math::{Aabb, Vec3, add, cross, dot, scale, sub, unit};
use crate::mesh::Mesh;

use super::Quadors;
use super::classes::Classes;
use super::complex::Complex;
use super::facets::{Facets, TAKEN};
use super::hub::{Hub, Stub};
use super::integral::tangled;

/// A hub in triangles.
struct Part {
    /// Places about the centre: those of its rims first, stub by stub.
    points: Vec<Vec3>,
    rims: usize,
    triangles: Vec<[u32; 3]>,
    bounds: Aabb,
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

/// Kinds of hubs that are looked at to tell how many triangles there will be.
const LOOKS: usize = 64;
/// The least chord error, of the typical radius, at which they are counted: beyond it they grow as it says.
const COARSE: f64 = 0.003;

fn check(chord: f64) -> Result<(), Fault> {
    if chord > 0.0 && chord.is_finite() {
        return Ok(());
    }
    Err(Fault::new(
        "chord",
        format!(
            "{} mm is no chord error: give a finite number above zero",
            number(chord)
        ),
    ))
}

impl Quadors {
    /// Points on the rim of a beam for a chord error.
    fn ring(&self, beam: usize, chord: f64) -> usize {
        let p = &self.pencils[beam];
        let r = p.squared(p.split()).max(0.0).sqrt();
        let half = (1.0 - TAKEN * chord / r).clamp(-1.0, 1.0).acos();
        ((PI / half).ceil() as usize).max(8)
    }

    /// How many triangles `mesh` makes, about: of some kinds of hubs, at a coarser chord error if need be.
    ///
    /// # Errors
    /// As for `mesh`.
    pub fn expected(&self, chord: f64) -> Result<f64, Fault> {
        check(chord)?;
        self.exact()?;
        // Halving the chord error doubles the triangles.
        let coarse = chord.max(COARSE * self.scale);
        let classes = self.classes();
        let step = classes.sample.len().div_ceil(LOOKS);
        let each = (0..classes.sample.len())
            .into_par_iter()
            .step_by(step)
            .map(|c| {
                let i = classes.sample[c];
                let hub = self.hub(i);
                let rings: Vec<usize> = (hub.stubs.iter())
                    .map(|s| self.ring(s.beam as usize, coarse))
                    .collect();
                let part = Part::new(&hub, &self.complex(i)?, &rings, coarse);
                let n = classes.count[c] as f64;
                Ok([
                    n * part.ok_or_else(|| tangled(i))?.triangles.len() as f64,
                    n,
                ])
            });
        let each = each.collect::<Result<Vec<[f64; 2]>, Fault>>()?;
        let sum = |k: usize| each.iter().map(|e| e[k]).sum::<f64>();
        Ok(sum(0) / sum(1) * self.len() as f64 * coarse / chord)
    }

    /// The surface as triangles that stay within `chord` (mm) of it, and how far they do: as found at the quarters of sides and the
    /// middles of triangles, mm.
    ///
    /// # Errors
    /// A chord error that is no length, beams that overlap too far, and more points than 32 bits can number.
    pub fn mesh(&self, chord: f64) -> Result<(Mesh, f64), Fault> {
        check(chord)?;
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

    /// Whether triangles of hubs that are joined, or that a third one joins, cross: those of beams that nearly touch, drawn
    /// coarsely. Within a hub they cannot.
    fn crossed(&self, classes: &Classes, parts: &[Part], chord: f64) -> bool {
        let mut pairs: HashMap<[i64; 5], [usize; 2]> = HashMap::new();
        let per = 1e6 / self.scale;
        for i in 0..self.len() {
            let hub = self.hub(i);
            let other = |s: &Stub| self.ends[s.beam as usize][1 - s.end] as usize;
            let near: Vec<usize> = core::iter::once(i)
                .chain(hub.stubs.iter().map(other))
                .collect();
            for (n, &a) in near.iter().enumerate() {
                for &b in &near[n + 1..] {
                    let [a, b] = [a.min(b), a.max(b)];
                    let (ca, cb) = (classes.of[a] as usize, classes.of[b] as usize);
                    let by = sub(self.center(b), self.center(a));
                    let apart = (0..3).any(|k| {
                        let (p, q) = (parts[ca].bounds, parts[cb].bounds);
                        p.max[k] < by[k] + q.min[k] || p.min[k] > by[k] + q.max[k]
                    });
                    if !apart {
                        let [x, y, z] = by.map(|v| (v * per).round() as i64);
                        pairs
                            .entry([ca as i64, cb as i64, x, y, z])
                            .or_insert([a, b]);
                    }
                }
            }
        }
        let pairs: Vec<[usize; 2]> = pairs.into_values().collect();
        pairs
            .into_par_iter()
            .any(|[a, b]| self.cross(a, b, classes, parts, chord))
    }

    /// Whether triangles of two hubs cross. What lies on different sides of the plane in which their beam is parted does not,
    /// nor what lies where only one of them is.
    fn cross(&self, a: usize, b: usize, classes: &Classes, parts: &[Part], chord: f64) -> bool {
        let of = |i: usize| (&parts[classes.of[i] as usize], self.center(i));
        let ends = [a, b].map(of);
        let parted = [(a, b), (b, a)].map(|(i, other)| {
            let hub = self.hub(i);
            let mut from = 0;
            for s in hub.stubs {
                let n = self.ring(s.beam as usize, chord);
                if self.ends[s.beam as usize][1 - s.end] as usize == other {
                    // All but the points of this rim are short of the plane.
                    let short = |(k, p): (usize, &Vec3)| {
                        (from..from + n).contains(&k)
                            || dot(*p, s.axis) < s.split - 1e-9 * self.scale
                    };
                    return of(i).0.points.iter().enumerate().all(short);
                }
                from += n;
            }
            false
        });
        if parted == [true, true] {
            return false;
        }
        let common = ends
            .map(|(part, center)| Aabb {
                min: add(part.bounds.min, center),
                max: add(part.bounds.max, center),
            })
            .into_iter()
            .reduce(Aabb::intersection)
            .unwrap_or(Aabb::EMPTY);
        self.laid([a, b].into_iter(), classes, parts, chord)
            .is_ok_and(|mut mesh| {
                let v = &mesh.vertices;
                mesh.triangles.retain(|t| {
                    let of = t.iter().fold(Aabb::EMPTY, |b, n| b.with(v[*n as usize]));
                    !of.intersection(common).is_empty()
                });
                crate::mesh::self_intersections(&mesh, 1) > 0
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
        let mut facets = Facets::new(hub, complex, &rims, chord)?;
        // Points of a rim are on its circle.
        let sagitta = |(s, n): (&Stub, &usize)| {
            s.squared(s.split).max(0.0).sqrt() * (1.0 - (PI / *n as f64).cos())
        };
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
