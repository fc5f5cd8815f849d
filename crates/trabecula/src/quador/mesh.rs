//! Meshing without a grid: the faces of each hub in triangles, joined by the numbers of the points they share.
//!
//! The circle in which a beam is parted belongs to the beam, and both its hubs use its points; a seam belongs to the hub and
//! both its faces use its points. So the mesh is closed by construction. Sides are halved until the middle of each is within
//! the chord error of the surface. Hubs that are equal but for their place are meshed once.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use rayon::prelude::*;

use crate::fault::{Fault, number};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;

use super::Quadors;
use super::complex::Complex;
use super::hub::Hub;
use super::integral::tangled;
use super::tiling::{Seams, Side, Tiles, middle};

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
fn across(axis: Vec3) -> Vec3 {
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
        // Fillets fold over seams in ways that halving sides does not yet follow everywhere: never a wrong part.
        if !self.sharp && self.balls.iter().any(|b| b.last - b.first > 1) {
            return Err(Fault::new(
                "fillet",
                "hubs with fillets are meshed by way of the field: extract it on a grid, or ask for no fillets",
            ));
        }
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
                let turn = 0.2;
                [turn, turn / 2.0, turn / 4.0]
                    .iter()
                    .find_map(|&turn| part(&hub, &complex, &rings, chord, turn))
                    .ok_or_else(|| tangled(i))
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

/// A hub in triangles, its seams first drawn with turns below `turn`.
fn part(hub: &Hub, complex: &Complex, rings: &[usize], chord: f64, turn: f64) -> Option<Part> {
    let mut seams = Seams::new(complex, turn);
    // Rims take the first numbers.
    let shift: usize = rings.iter().sum();
    let mut points = Vec::new();
    let mut error = 0.0f64;
    for (s, &n) in hub.stubs.iter().zip(rings) {
        let r = s.squared(s.split).max(0.0).sqrt();
        // The beam's own frame runs from its first end.
        let axis = if s.end == 0 {
            s.axis
        } else {
            scale(s.axis, -1.0)
        };
        let center = scale(s.axis, s.split);
        points.extend(circle(axis, n, r).map(|x| add(center, x)));
        error = error.max(r * (1.0 - (PI / n as f64).cos()));
    }
    points.extend(seams.points.iter());
    seams
        .chains
        .iter_mut()
        .flatten()
        .for_each(|p| p.0 += shift as u32);
    seams.points = points;
    let mut tiles = Tiles::new(&seams);
    let mut first = 0u32;
    let firsts: Vec<u32> = rings
        .iter()
        .map(|&n| {
            let f = first;
            first += n as u32;
            f
        })
        .collect();
    for (number, face) in complex.faces.iter().enumerate() {
        let number = number as u32;
        match face.rim {
            Some(stub) => {
                let stub = stub as usize;
                let ring: Vec<u32> = (0..rings[stub] as u32).map(|k| firsts[stub] + k).collect();
                for k in 0..ring.len() {
                    let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
                    tiles.sides.insert([a.min(b), a.max(b)], Side::Rim);
                }
                let strip = strip(
                    hub.stubs[stub].axis,
                    &seams.points,
                    &seams.walk(face.loops.first()?),
                    &ring,
                );
                tiles
                    .triangles
                    .extend(strip.into_iter().map(|t| (t, number)));
            }
            None if face.loops.is_empty() => {
                // A ball starts as an octahedron.
                let (r, n) = (hub.radius, tiles.points.len() as u32);
                for a in 0..6 {
                    let mut p = [0.0; 3];
                    p[a % 3] = if a < 3 { r } else { -r };
                    tiles.points.push(p);
                }
                for k in 0..8u32 {
                    let [x, y, z] = [k & 1, k >> 1 & 1, k >> 2].map(|s| 3 * s);
                    let t = [n + x, n + 1 + y, n + 2 + z];
                    let t = if k.count_ones() % 2 == 0 {
                        t
                    } else {
                        [t[0], t[2], t[1]]
                    };
                    tiles.triangles.push((t, number));
                }
            }
            None => {
                let middle = middle(complex, face);
                tiles.put(seams.triangles(face, middle)?, middle, number);
            }
        }
    }
    tiles.refine(complex, &|away, _| away > chord)?;
    for &(t, face) in &tiles.triangles {
        let q = &complex.faces[face as usize].quadric;
        let [a, b, c] = t.map(|v| tiles.points[v as usize]);
        let up = unit(
            [a, b, c]
                .iter()
                .fold([0.0; 3], |u, x| add(u, unit(q.half_slope(*x)))),
        );
        // A triangle that lies on its back was cut across a fold: the seams are drawn finer and it is tried again.
        let flat = cross(sub(b, a), sub(c, a));
        if dot(flat, up) < -0.2 * norm(flat) && norm(flat) > chord * chord {
            return None;
        }
        for x in [
            scale(add(a, add(b, c)), 1.0 / 3.0),
            scale(add(a, b), 0.5),
            scale(add(b, c), 0.5),
            scale(add(c, a), 0.5),
        ] {
            error = error.max(q.along(x, up).abs());
        }
    }
    if error.is_nan() || error >= 3.0 * chord {
        return None;
    }
    let triangles = tiles.triangles.into_iter().map(|(t, _)| t).collect();
    Some(Part {
        points: tiles.points,
        rims: shift,
        triangles,
        error,
    })
}

/// Triangles between a loop around an axis and the rim beyond it, by azimuth.
fn strip(axis: Vec3, points: &[Vec3], inner: &[u32], ring: &[u32]) -> Vec<[u32; 3]> {
    let side = across(axis);
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
