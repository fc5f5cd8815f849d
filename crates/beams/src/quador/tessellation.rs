//! Tessellation of a quador lattice: triangles stored once for each class of equal hubs, joined into one mesh or
//! iterated hub by hub.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use geometry::mesh::Mesh;
use geometry::union_find::unite;

use super::Quadors;
use super::complex::Complex;
use super::facets::{Facets, SEAM_SHARE};
use super::hub::{HalfBeam, Hub};
use super::hub_classes::HubClasses;
use super::perpendicular::perpendicular;

/// Shares of the chord error that are tried for triangles before their vertices are moved.
const SHARES: [f64; 8] = [1.0, 0.7, 0.5, 0.35, 0.84, 0.6, 0.42, 0.25];

/// A triangulated surface of beams.
pub struct Tessellation<'a> {
    pub(super) quadors: &'a Quadors,
    pub(super) classes: HubClasses,
    pub(super) meshes: Vec<HubMesh>,
    /// The chord error used for the end circles, mm.
    pub(super) chord: f64,
}

/// Measures of a triangulated surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// Number of triangles.
    pub triangles: usize,
    /// Enclosed volume, mm³.
    pub volume: f64,
    /// Area, mm².
    pub area: f64,
    /// Euler number V − E + F.
    pub euler: i64,
    /// Number of connected components; none has a cavity, since every hub is star-shaped about its centre.
    pub components: usize,
}

/// The mesh of one hub.
pub(super) struct HubMesh {
    /// Vertices relative to the centre: those of its end circles first, by half-beam.
    pub points: Vec<Vec3>,
    pub circle_vertices: usize,
    pub triangles: Vec<[u32; 3]>,
    pub bounds: Aabb,
    /// Maximum distance from the surface, mm.
    pub error: f64,
}

impl Quadors {
    /// Number of vertices on the end circle of a beam, for a chord error in mm.
    pub(super) fn circle_size(&self, beam: usize, chord: f64) -> usize {
        let p = &self.pencils[beam];
        let r = p.radius_squared(p.split()).max(0.0).sqrt();
        let half = (1.0 - SEAM_SHARE * chord / r).clamp(-1.0, 1.0).acos();
        ((PI / half).ceil() as usize).max(8)
    }

    /// The vertices on a beam's end circle, the same for both its hubs.
    fn end_circle(&self, beam: usize, chord: f64) -> impl Iterator<Item = Vec3> {
        let p = &self.pencils[beam];
        let ends = self.ends[beam].map(|h| self.center(h as usize));
        let axis = scale(sub(ends[1], ends[0]), 1.0 / p.length);
        let middle = add(ends[0], scale(axis, p.split()));
        let radius = p.radius_squared(p.split()).max(0.0).sqrt();
        let n = self.circle_size(beam, chord);
        circle(axis, n, radius * equal_area(n)).map(move |x| add(middle, x))
    }
}

impl Quadors {
    /// Number of connected components of the graph.
    fn components(&self) -> usize {
        let mut to: Vec<u32> = (0..self.len() as u32).collect();
        let joined = self.ends.iter().filter(|[a, b]| unite(&mut to, *a, *b));
        self.len() - joined.count()
    }
}

impl Tessellation<'_> {
    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        let each = self.meshes.iter().zip(&self.classes.count);
        each.map(|(p, n)| p.triangles.len() * n).sum()
    }

    /// Maximum distance from the surface, mm, found at the quarter points of edges and the centroids of triangles.
    pub fn error(&self) -> f64 {
        self.meshes.iter().map(|p| p.error).fold(0.0, f64::max)
    }

    /// Number of hubs.
    pub fn hubs(&self) -> usize {
        self.quadors.len()
    }

    /// The triangles of a hub, in mm. Those of all hubs together are closed: vertices shared by two hubs are equal to
    /// the last bit.
    pub fn hub(&self, hub: usize) -> impl Iterator<Item = [Vec3; 3]> {
        let (mesh, center) = (self.hub_mesh(hub), self.quadors.center(hub));
        let mut vertices = Vec::with_capacity(mesh.points.len());
        for s in self.quadors.hub(hub).half_beams {
            vertices.extend(self.quadors.end_circle(s.beam as usize, self.chord));
        }
        vertices.extend(mesh.points[mesh.circle_vertices..].iter().map(|p| add(center, *p)));
        let each = mesh.triangles.iter();
        each.map(move |t| t.map(|v| vertices[v as usize]))
    }

    /// Measures of the whole, from those of each class.
    pub fn measures(&self) -> Measures {
        let (mut volume, mut area, mut euler) = (0.0, 0.0, 0i64);
        for (c, (mesh, count)) in self.meshes.iter().zip(&self.classes.count).enumerate() {
            let (hub, n) = (self.quadors.hub(self.classes.sample[c]), *count as f64);
            let (mut six, mut twice) = (0.0, 0.0);
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| mesh.points[v as usize]);
                six += dot(a, cross(b, c));
                twice += norm(cross(sub(b, a), sub(c, a)));
            }
            six += 6.0 * below_circles(&hub);
            volume += n * six / 6.0;
            area += n * twice / 2.0;
            // Every end circle has as many vertices as edges, so that a hub counts as a sphere with a hole for each.
            euler += *count as i64 * (2 - hub.half_beams.len() as i64);
        }
        Measures { triangles: self.triangles(), volume, area, euler, components: self.quadors.components() }
    }

    pub(super) fn hub_mesh(&self, hub: usize) -> &HubMesh {
        &self.meshes[self.classes.of[hub] as usize]
    }

    /// The mesh of some hubs, joined at the vertices of their common end circles.
    pub(super) fn joined(&self, hubs: impl Iterator<Item = usize>) -> Result<Mesh, Fault> {
        let mut first: HashMap<u32, u32> = HashMap::new();
        let mut mesh = Mesh::default();
        let quadors = self.quadors;
        for i in hubs {
            let (part, center) = (self.hub_mesh(i), quadors.center(i));
            let mut names = Vec::with_capacity(part.points.len());
            for s in quadors.hub(i).half_beams {
                let n = quadors.circle_size(s.beam as usize, self.chord) as u32;
                let from = *first.entry(s.beam).or_insert_with(|| {
                    let from = mesh.vertices.len() as u32;
                    mesh.vertices.extend(quadors.end_circle(s.beam as usize, self.chord));
                    from
                });
                names.extend(from..from + n);
            }
            for p in &part.points[part.circle_vertices..] {
                names.push(mesh.vertices.len() as u32);
                mesh.vertices.push(add(center, *p));
            }
            if mesh.vertices.len() > u32::MAX as usize / 2 {
                return Err(Fault::new(
                    "chord",
                    "the mesh would have more than two billion vertices: use a larger chord error",
                ));
            }
            mesh.triangles.extend(part.triangles.iter().map(|t| t.map(|v| names[v as usize])));
        }
        Ok(mesh)
    }

    /// The whole as one mesh.
    ///
    /// # Errors
    /// More vertices than 32-bit indices allow.
    pub fn mesh(&self) -> Result<Mesh, Fault> {
        self.joined(0..self.hubs())
    }
}

/// Volume of the cones from the centre of a hub to its end circles, mm³, and to the polygons of their areas.
fn below_circles(hub: &Hub) -> f64 {
    hub.half_beams.iter().map(|s| PI * s.radius_squared(s.split).max(0.0) * s.split / 3.0).sum()
}

/// Distance of the vertices of a regular polygon from its centre, in radii of the circle of its area.
fn equal_area(n: usize) -> f64 {
    let angle = TAU / n as f64;
    (angle / angle.sin()).sqrt()
}

/// `n` points on a circle about an axis through the origin.
fn circle(axis: Vec3, n: usize, r: f64) -> impl Iterator<Item = Vec3> {
    let side = perpendicular(axis);
    let other = cross(axis, side);
    (0..n).map(move |k| {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        add(scale(side, r * cos), scale(other, r * sin))
    })
}

impl HubMesh {
    /// Meshes a hub, with the given number of vertices on each end circle, so that the triangles enclose its `volume` (mm³), if it is
    /// known; `None` if a boundary polygon intersects itself, or vertices cannot be moved.
    pub(super) fn new(
        hub: &Hub,
        complex: &Complex,
        circle_sizes: &[usize],
        chord: f64,
        volume: Option<f64>,
    ) -> Option<HubMesh> {
        let end_circles: Vec<Vec<Vec3>> = (hub.half_beams.iter().zip(circle_sizes))
            .map(|(s, &n)| {
                // The frame of a beam starts at its first end.
                let axis = if s.end == 0 { s.axis } else { scale(s.axis, -1.0) };
                let radius = s.radius_squared(s.split).max(0.0).sqrt();
                let middle = scale(s.axis, s.split);
                circle(axis, n, radius).map(|x| add(middle, x)).collect()
            })
            .collect();
        let circles: Vec<(usize, f64)> = circle_sizes.iter().map(|&n| (n, equal_area(n))).collect();
        // Where vertices are moved as others are, triangles may be farther from the surface than before.
        let (facets, error) = SHARES.iter().find_map(|share| {
            let mut facets = Facets::new(hub, complex, &end_circles, [share * chord, chord])?;
            facets.refine()?;
            let error = facets.balance(&circles, below_circles(hub), volume)?;
            (error <= chord).then_some((facets, error))
        })?;
        // Maximum distance of the end circles' vertices and chords.
        let off = |(s, &n): (&HalfBeam, &usize)| {
            let wide = equal_area(n);
            s.radius_squared(s.split).max(0.0).sqrt() * (wide - 1.0).max(1.0 - wide * (PI / n as f64).cos())
        };
        let circles_off = hub.half_beams.iter().zip(circle_sizes).map(off).fold(0.0, f64::max);
        Some(HubMesh {
            circle_vertices: circle_sizes.iter().sum(),
            bounds: facets.points.iter().fold(Aabb::EMPTY, |b, p| b.with(*p)),
            points: facets.points,
            triangles: facets.triangles,
            error: error.max(circles_off),
        })
    }
}
