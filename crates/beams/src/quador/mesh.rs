//! Meshing without a grid: the faces of each hub in triangles, joined by the numbers of the points they share.
//!
//! The circle in which a beam is parted belongs to the beam, and both its hubs use its points; a seam belongs to the hub and
//! both its faces use its points. So the mesh is closed by construction. Sides are halved until they and the triangles are
//! within the chord error of the surface. Hubs that are equal but for their place are meshed once.

use std::collections::HashMap;

use rayon::prelude::*;

use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, add, dot, sub};
use geometry::mesh::Mesh;

use super::Quadors;
use super::drawn::{Drawn, Part};
use super::hub::Stub;
use super::integral::tangled;

/// Kinds of hubs that are looked at to tell how many triangles there will be.
const LOOKS: usize = 16;
/// The least chord error, of the typical radius, at which they are counted: beyond it they grow as it says.
const COARSE: f64 = 0.01;

fn check(chord: f64) -> Result<(), Fault> {
    if chord > 0.0 && chord.is_finite() {
        return Ok(());
    }
    Err(Fault::new("chord", format!("{} mm is no chord error: give a finite number above zero", number(chord))))
}

impl Quadors {
    /// How many triangles there will be, about, in all and in one hub of each class: of some kinds of hubs, at a coarser chord error if
    /// need be.
    ///
    /// # Errors
    /// As for `drawn`.
    pub fn expected(&self, chord: f64) -> Result<[f64; 2], Fault> {
        check(chord)?;
        self.exact()?;
        // Halving the chord error doubles the triangles.
        let coarse = chord.max(COARSE * self.scale);
        let classes = self.classes();
        let step = classes.sample.len().div_ceil(LOOKS);
        let each = (0..classes.sample.len()).into_par_iter().step_by(step).map(|c| {
            let part = self.part(classes.sample[c], coarse)?;
            let n = classes.count[c] as f64;
            Ok([n * part.triangles.len() as f64, n])
        });
        let each = each.collect::<Result<Vec<[f64; 2]>, Fault>>()?;
        let sum = |k: usize| each.iter().map(|e| e[k]).sum::<f64>();
        let hub = sum(0) / sum(1) * coarse / chord;
        Ok([hub * self.len() as f64, hub * classes.sample.len() as f64])
    }

    /// A hub in triangles.
    fn part(&self, hub: usize, chord: f64) -> Result<Part, Fault> {
        let of = self.hub(hub);
        let ring = |s: &Stub| self.ring(s.beam as usize, chord);
        let rings: Vec<usize> = of.stubs.iter().map(ring).collect();
        Part::new(&of, &self.complex(hub)?, &rings, chord).ok_or_else(|| tangled(hub))
    }

    /// The surface as triangles that stay within `chord` (mm) of it, and how far they do, mm.
    ///
    /// # Errors
    /// As for `drawn`, and more points than 32 bits can number.
    pub fn mesh(&self, chord: f64) -> Result<(Mesh, f64), Fault> {
        let drawn = self.drawn(chord)?;
        Ok((drawn.mesh()?, drawn.error()))
    }

    /// The surface as triangles that stay within `chord` (mm) of it, those of each class of hubs once.
    ///
    /// # Errors
    /// A chord error that is no length, beams that overlap too far, and beams that nearly touch, whose triangles would cross.
    pub fn drawn(&self, chord: f64) -> Result<Drawn<'_>, Fault> {
        check(chord)?;
        self.exact()?;
        let mut drawn = Drawn { quadors: self, classes: self.classes(), parts: Vec::new(), chord };
        // Where beams that nearly touch would cross, all is drawn finer.
        for finer in [1.0, 0.5, 0.25, 0.125] {
            drawn.chord = chord * finer;
            let parts = (drawn.classes.sample.par_iter()).map(|&i| self.part(i, drawn.chord));
            drawn.parts = parts.collect::<Result<_, _>>()?;
            if !drawn.crossed() {
                return Ok(drawn);
            }
        }
        Err(Fault::new(
            "chord",
            "beams run so close to one another that triangles of this size cross: ask for a smaller chord error",
        ))
    }
}

impl Drawn<'_> {
    /// Whether triangles of hubs that are joined, or that a third one joins, cross: those of beams that nearly touch, drawn
    /// coarsely. Within a hub they cannot.
    fn crossed(&self) -> bool {
        let (quadors, parts) = (self.quadors, &self.parts);
        let mut pairs: HashMap<[i64; 5], [usize; 2]> = HashMap::new();
        let per = 1e6 / quadors.scale;
        for i in 0..quadors.len() {
            let hub = quadors.hub(i);
            let other = |s: &Stub| quadors.ends[s.beam as usize][1 - s.end] as usize;
            let near: Vec<usize> = core::iter::once(i).chain(hub.stubs.iter().map(other)).collect();
            for (n, &a) in near.iter().enumerate() {
                for &b in &near[n + 1..] {
                    let [a, b] = [a.min(b), a.max(b)];
                    let [ca, cb] = [a, b].map(|i| self.classes.of[i] as usize);
                    let by = sub(quadors.center(b), quadors.center(a));
                    let apart = (0..3).any(|k| {
                        let (p, q) = (parts[ca].bounds, parts[cb].bounds);
                        p.max[k] < by[k] + q.min[k] || p.min[k] > by[k] + q.max[k]
                    });
                    if !apart {
                        let [x, y, z] = by.map(|v| (v * per).round() as i64);
                        pairs.entry([ca as i64, cb as i64, x, y, z]).or_insert([a, b]);
                    }
                }
            }
        }
        let pairs: Vec<[usize; 2]> = pairs.into_values().collect();
        pairs.into_par_iter().any(|[a, b]| self.cross(a, b))
    }

    /// Whether triangles of two hubs cross. What lies on different sides of the plane in which their beam is parted does not,
    /// nor what lies where only one of them is.
    fn cross(&self, a: usize, b: usize) -> bool {
        let quadors = self.quadors;
        let of = |i: usize| (self.part(i), quadors.center(i));
        let ends = [a, b].map(of);
        let parted = [(a, b), (b, a)].map(|(i, other)| {
            let hub = quadors.hub(i);
            let mut from = 0;
            for s in hub.stubs {
                let n = quadors.ring(s.beam as usize, self.chord);
                if quadors.ends[s.beam as usize][1 - s.end] as usize == other {
                    // All but the points of this rim are short of the plane.
                    let short = |(k, p): (usize, &Vec3)| {
                        (from..from + n).contains(&k) || dot(*p, s.axis) < s.split - 1e-9 * quadors.scale
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
            .map(|(part, center)| Aabb { min: add(part.bounds.min, center), max: add(part.bounds.max, center) })
            .into_iter()
            .reduce(Aabb::intersection)
            .unwrap_or(Aabb::EMPTY);
        self.joined([a, b].into_iter()).is_ok_and(|mut mesh| {
            let v = &mesh.vertices;
            mesh.triangles.retain(|t| {
                let of = t.iter().fold(Aabb::EMPTY, |b, n| b.with(v[*n as usize]));
                !of.intersection(common).is_empty()
            });
            geometry::mesh::self_intersections(&mesh, 1) > 0
        })
    }
}
