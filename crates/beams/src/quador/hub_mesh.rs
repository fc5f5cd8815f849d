//! Meshing without a grid: construction and checks of the tessellation.
//!
//! The end circle of a half-beam belongs to the beam, and both hubs use its points; a seam belongs to the hub, and both
//! adjacent faces use its points. So the mesh is closed by construction. Edges are bisected until edges and triangles
//! are within the chord error of the surface. Hubs that are equal up to translation are meshed once.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::graph::position_text;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, add, dot, sub};
use geometry::mesh::Mesh;
use geometry::progress::Cancellation;

use super::Quadors;
use super::collisions::Collision;
use super::hub::HalfBeam;
use super::integral::{DEFAULT_ORDER, hub_mass};
use super::tessellation::{HubMesh, Tessellation};

/// Number of representative hubs meshed to estimate the number of triangles.
const ESTIMATE_HUBS: usize = 16;
/// Minimum chord error used for the estimate, in typical radii; below it the number is extrapolated.
const MIN_ESTIMATE_CHORD: f64 = 0.01;

/// Shares of the chord error that are tried, where a hub cannot be triangulated within it or triangles of beams that nearly touch cross.
const FINER: [f64; 8] = [1.0, 0.8, 0.6, 0.5, 0.35, 0.25, 0.125, 0.06];

/// Distance of beams within which their triangles may cross, in chord errors: vertices are at most one off the surface, and so are
/// chords.
const NEAR: f64 = 4.0;

fn check(chord: f64) -> Result<(), Fault> {
    if chord > 0.0 && chord.is_finite() {
        return Ok(());
    }
    Err(Fault::new("chord", format!("chord error must be positive and finite, found {} mm", number(chord))))
}

impl Quadors {
    /// Estimated number of triangles, in total and over one hub of each class, from some representative hubs at a
    /// coarser chord error if needed.
    ///
    /// # Errors
    /// As for `tessellation`.
    pub fn estimated_triangles(&self, chord: f64) -> Result<[f64; 2], Fault> {
        check(chord)?;
        self.require_closed_forms()?;
        // Halving the chord error doubles the number of triangles.
        let coarse = chord.max(MIN_ESTIMATE_CHORD * self.scale);
        let classes = self.classes();
        let step = classes.sample.len().div_ceil(ESTIMATE_HUBS);
        let request = Cancellation::current();
        let each = (0..classes.sample.len()).into_par_iter().step_by(step).map(|c| {
            let n = classes.count[c] as f64;
            let triangles = |finer: f64| {
                let mesh = request.enter(|| self.hub_mesh(classes.sample[c], finer * coarse))?;
                Ok(finer * mesh.triangles.len() as f64)
            };
            let made = triangles(FINER[0]);
            let finer = || FINER[1..].iter().find_map(|finer| triangles(*finer).ok());
            Ok([n * made.or_else(|fault: Fault| finer().ok_or(fault))?, n])
        });
        let each = each.collect::<Result<Vec<[f64; 2]>, Fault>>()?;
        let sum = |k: usize| each.iter().map(|e| e[k]).sum::<f64>();
        let hub = sum(0) / sum(1) * coarse / chord;
        Ok([hub * self.len() as f64, hub * classes.sample.len() as f64])
    }

    /// The mesh of one hub.
    fn hub_mesh(&self, hub: usize, chord: f64) -> Result<HubMesh, Fault> {
        let of = self.hub(hub);
        let circle_size = |s: &HalfBeam| self.circle_size(s.beam as usize, chord);
        let rings: Vec<usize> = of.half_beams.iter().map(circle_size).collect();
        let complex = self.complex(hub)?;
        let volume = hub_mass::<false>(&of, &complex, DEFAULT_ORDER).map(|m| m.volume);
        HubMesh::new(&of, &complex, &rings, chord, volume).ok_or_else(|| {
            let message = format!(
                "the surface of the hub at ({}) mm could not be triangulated within {} mm: give another chord error, or the spacing of \
                 a grid (edge)",
                self.center(hub).map(number).join(", "),
                number(chord)
            );
            Fault::new("chord", message)
        })
    }

    /// The surface as one triangle mesh within `chord` (mm) of it, and the greatest distance found, mm.
    ///
    /// # Errors
    /// As for `tessellation`, and more vertices than 32-bit indices allow.
    pub fn mesh(&self, chord: f64) -> Result<(Mesh, f64), Fault> {
        let tessellation = self.tessellation(chord)?;
        Ok((tessellation.mesh()?, tessellation.error()))
    }

    /// The surface as triangles within `chord` (mm) of it, stored once for each class of equal hubs.
    ///
    /// # Errors
    /// A chord error that is not positive and finite, beams that overlap too far, and beams so close that their
    /// triangles cross.
    pub fn tessellation(&self, chord: f64) -> Result<Tessellation<'_>, Fault> {
        check(chord)?;
        self.require_closed_forms()?;
        let mut tessellation = Tessellation { quadors: self, classes: self.classes(), meshes: Vec::new(), chord };
        let misses = self.near_misses(NEAR * chord);
        // If triangles of beams that nearly touch cross, or vertices cannot be moved, everything is refined.
        let (mut fault, request) = (None, Cancellation::current());
        for finer in FINER {
            tessellation.chord = chord * finer;
            let one = |&i: &usize| request.enter(|| self.hub_mesh(i, tessellation.chord));
            let meshes = tessellation.classes.sample.par_iter().map(one);
            match meshes.collect::<Result<_, _>>() {
                Ok(meshes) => tessellation.meshes = meshes,
                Err(found) => {
                    fault = Some(found);
                    continue;
                }
            }
            if !tessellation.has_crossings(&misses) {
                return Ok(tessellation);
            }
        }
        if let Some(fault) = fault {
            return Err(fault);
        }
        let place = misses.first().map_or(String::new(), |m| {
            let [a, b] = m.beams;
            format!(" (beams {a} and {b} come near at {})", position_text(m.at))
        });
        let message = format!(
            "triangles of beams that nearly touch intersect at this chord error{place}: use a smaller one, give the spacing of a grid \
             (edge), or move the beams apart"
        );
        Err(Fault::new("chord", message))
    }
}

impl Tessellation<'_> {
    /// Whether triangles of two hubs cross that are adjacent, have a common neighbour or beams that nearly miss each other: those of
    /// beams that nearly touch, at a coarse chord error. Within a hub triangles cannot cross.
    fn has_crossings(&self, misses: &[Collision]) -> bool {
        let (quadors, meshes) = (self.quadors, &self.meshes);
        let mut pairs: HashMap<[i64; 5], [usize; 2]> = HashMap::new();
        let per = 1e6 / quadors.scale;
        let mut meet = |a: usize, b: usize| {
            let [a, b] = [a.min(b), a.max(b)];
            let [ca, cb] = [a, b].map(|i| self.classes.of[i] as usize);
            let by = sub(quadors.center(b), quadors.center(a));
            let apart = (0..3).any(|k| {
                let (p, q) = (meshes[ca].bounds, meshes[cb].bounds);
                p.max[k] < by[k] + q.min[k] || p.min[k] > by[k] + q.max[k]
            });
            if !apart {
                let [x, y, z] = by.map(|v| (v * per).round() as i64);
                pairs.entry([ca as i64, cb as i64, x, y, z]).or_insert([a, b]);
            }
        };
        for i in 0..quadors.len() {
            let hub = quadors.hub(i);
            let other = |s: &HalfBeam| quadors.ends[s.beam as usize][1 - s.end] as usize;
            let near: Vec<usize> = core::iter::once(i).chain(hub.half_beams.iter().map(other)).collect();
            for (n, &a) in near.iter().enumerate() {
                near[n + 1..].iter().for_each(|&b| meet(a, b));
            }
        }
        for miss in misses {
            let [p, q] = miss.beams.map(|b| quadors.ends[b as usize].map(|h| h as usize));
            p.iter().for_each(|&a| q.iter().for_each(|&b| meet(a, b)));
        }
        let pairs: Vec<[usize; 2]> = pairs.into_values().collect();
        pairs.into_par_iter().any(|[a, b]| self.hubs_cross(a, b))
    }

    /// Whether triangles of two hubs cross. Triangles on different sides of the split plane of their common beam do
    /// not, nor do triangles outside the common box.
    fn hubs_cross(&self, a: usize, b: usize) -> bool {
        let quadors = self.quadors;
        let of = |i: usize| (self.hub_mesh(i), quadors.center(i));
        let ends = [a, b].map(of);
        let separated = [(a, b), (b, a)].map(|(i, other)| {
            let hub = quadors.hub(i);
            let mut from = 0;
            for s in hub.half_beams {
                let n = quadors.circle_size(s.beam as usize, self.chord);
                if quadors.ends[s.beam as usize][1 - s.end] as usize == other {
                    // All other points must lie before the split plane.
                    let short = |(k, p): (usize, &Vec3)| {
                        (from..from + n).contains(&k) || dot(*p, s.axis) < s.split - 1e-9 * quadors.scale
                    };
                    return of(i).0.points.iter().enumerate().all(short);
                }
                from += n;
            }
            false
        });
        if separated == [true, true] {
            return false;
        }
        let common = ends
            .map(|(mesh, center)| Aabb { min: add(mesh.bounds.min, center), max: add(mesh.bounds.max, center) })
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
