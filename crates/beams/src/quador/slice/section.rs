//! The section of one hub by a plane: its conics, followed from label to label.
//!
//! The region of one label is a convex polygon in the plane. The polygons are visited from neighbour to neighbour, and
//! the crossings of their conics with their edges are the starting points of loops; from there the next event along a
//! conic is the smallest root of a few quadratics. As in `seam_tracing` the G of each half-beam is perturbed, for the
//! seams alone, by a few 1e-12 of the radius, which separates the events of symmetric hubs; each arc lies on the
//! unperturbed quadric.

use geometry::math::{Vec3, add, dot, norm, scale, sub};

use super::super::affine_function::AffineFunction;
use super::super::bezier::{Bezier, Path, section_tangent};
use super::super::complex::perturbation;
use super::super::hub::{HalfBeam, Hub};
use super::super::hub_quadric::{Quadric, QuadricPiece, piece};
use super::{ConicArc, SlicePlane};

/// Intersection of the plane with the disc in the split plane of a half-beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum DiscSection {
    /// Two points on the end circle: where the section enters the hub's part, and where it leaves it.
    Crossed([Vec3; 2]),
    /// None.
    Missed,
    /// The planes are parallel; whether the section plane lies before the split plane.
    Parallel(bool),
}

/// An arc of the section of a hub.
#[derive(Clone, Debug)]
pub(super) struct SectionArc {
    label: u64,
    quadric: Quadric,
    height: f64,
    curves: Vec<Bezier<3>>,
}

impl SectionArc {
    /// The arc in the coordinates of the plane.
    pub(super) fn in_plane(self, hub: u32, about: [f64; 2], plane: &SlicePlane) -> ConicArc {
        let (q, [u, v]) = (&self.quadric, plane.axes);
        let o = scale(plane.normal, self.height);
        let slope = q.half_gradient(o);
        let flat = |p: Vec3| {
            let [u, v] = plane.project(p);
            [about[0] + u, about[1] + v]
        };
        ConicArc {
            hub,
            half_beams: self.label,
            conic: [q.form(u, u), q.form(u, v), q.form(v, v), dot(slope, u), dot(slope, v), q.at(o)],
            about,
            curves: self.curves.iter().map(|c| Bezier { points: c.points.map(flat), weight: c.weight }).collect(),
        }
    }
}

/// Consecutive arcs.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// The half-beams at whose end circles it starts and ends; `None` if it is closed.
    pub ends: Option<[u32; 2]>,
    /// Its arcs.
    pub arcs: Vec<SectionArc>,
}

/// The event at the end of an arc.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A change to another label.
    To(u64),
    /// The end circle of the half-beam of the label.
    EndCircle,
}

/// The region of a label in the plane.
#[derive(Clone, Debug)]
struct Region {
    label: u64,
    quadric: Quadric,
    /// The labels across its edges, each with a function that is negative on this side.
    guards: Vec<(u64, AffineFunction)>,
}

/// A point where a seam of the hub crosses the plane.
#[derive(Clone, Copy, Debug)]
struct SeamCrossing {
    from: u64,
    to: u64,
    at: Vec3,
    used: bool,
}

/// Tolerance of S − N in the middle of an arc, relative to its squared distance: far above rounding.
const VALUE_TOLERANCE: f64 = 1e-10;

pub(super) struct Section<'a> {
    hub: &'a Hub<'a>,
    /// Perturbed G of the half-beams.
    g: Vec<AffineFunction>,
    disc_sections: &'a [DiscSection],
    plane: &'a SlicePlane,
    height: f64,
    reach: f64,
    regions: Vec<Region>,
    crossings: Vec<SeamCrossing>,
}

impl<'a> Section<'a> {
    /// Prepares the section by a plane at a height above the hub's centre; `reach` is an upper bound of the size of its
    /// part. Lengths in mm.
    pub(super) fn new(
        hub: &'a Hub,
        plane: &'a SlicePlane,
        height: f64,
        reach: f64,
        disc_sections: &'a [DiscSection],
        seed: u64,
    ) -> Section<'a> {
        let shifted =
            |(i, s): (usize, &HalfBeam)| AffineFunction { a: s.g.a, b: s.g.b + perturbation(i, seed) * hub.radius };
        Section {
            hub,
            g: hub.half_beams.iter().enumerate().map(shifted).collect(),
            disc_sections,
            plane,
            height,
            reach,
            regions: Vec::new(),
            crossings: Vec::new(),
        }
    }

    /// The section: chains between end circles, and closed chains; `None` if it cannot be resolved.
    pub(super) fn run(mut self) -> Option<Vec<Chain>> {
        self.visit_regions();
        let mut out = Vec::new();
        for i in 0..self.hub.half_beams.len() {
            if let DiscSection::Crossed([start, _]) = self.disc_sections[i] {
                let (arcs, exit) = self.follow(1 << i, start, Event::EndCircle, None)?;
                let ends = Some([i as u32, exit?]);
                out.push(Chain { ends, arcs });
            }
        }
        while let Some(c) = self.crossings.iter_mut().find(|c| !c.used) {
            c.used = true;
            let c = *c;
            let (arcs, exit) = self.follow(c.to, c.at, Event::To(c.from), Some([c.from, c.to]))?;
            if exit.is_some() {
                return None;
            }
            out.push(Chain { ends: None, arcs });
        }
        for i in 0..self.regions.len() {
            if let Some(arc) = self.closed_ellipse(i)? {
                out.push(Chain { ends: None, arcs: vec![arc] });
            }
        }
        // A non-empty section has a boundary.
        let o = self.nearest_to_center();
        let lost = out.is_empty() && self.hub.value(o) < 0.0 && self.belongs(o);
        (!lost).then_some(out)
    }

    /// The point of the plane nearest to the centre.
    fn nearest_to_center(&self) -> Vec3 {
        scale(self.plane.normal, self.height)
    }

    /// The index of the region of a label; created if new.
    fn region(&mut self, label: u64) -> usize {
        if let Some(i) = self.regions.iter().position(|c| c.label == label) {
            return i;
        }
        let QuadricPiece { quadric, toggles } = piece(self.hub, label, &|i| self.g[i]);
        let none = AffineFunction::default();
        let mut guards = Vec::with_capacity(self.g.len() + 1);
        if self.hub.sharp() {
            let own = match label {
                0 => none,
                _ => self.g[label.trailing_zeros() as usize],
            };
            for (m, g) in self.g.iter().enumerate() {
                if label != 1 << m {
                    guards.push((1 << m, g.plus(-1.0, &own)));
                }
            }
            if label != 0 {
                guards.push((0, none.plus(-1.0, &own)));
            }
        } else {
            for (m, joins) in toggles.into_iter().enumerate() {
                let stays = label >> m & 1 == 1;
                guards.push((label ^ 1 << m, if stays { none.plus(-1.0, &joins) } else { joins }));
            }
        }
        self.regions.push(Region { label, quadric, guards });
        self.regions.len() - 1
    }

    /// Visits the regions within reach, and finds where conics cross their edges.
    fn visit_regions(&mut self) {
        let [u, v] = self.plane.axes;
        // From an arbitrary point that avoids the symmetry planes of symmetric hubs.
        let (sin, cos) = 0.737_f64.sin_cos();
        let direction = scale(add(scale(u, cos), scale(v, sin)), 0.137 * self.hub.radius);
        let shifted = Hub { g: &self.g, ..*self.hub };
        let first = shifted.smooth_union(add(self.nearest_to_center(), direction)).active;
        self.region(first);
        let mut done = 0;
        while done < self.regions.len() {
            let (beyond, crossings) = self.edges(&self.regions[done]);
            self.crossings.extend(crossings);
            for to in beyond {
                self.region(to);
            }
            done += 1;
        }
    }

    /// The labels across the edges of a region, and where the surface leaves it.
    fn edges(&self, region: &Region) -> (Vec<u64>, Vec<SeamCrossing>) {
        let ([u, v], n) = (self.plane.axes, self.plane.normal);
        let (o, q, r) = (self.nearest_to_center(), &region.quadric, self.reach);
        let point = |p: [f64; 2]| add(o, add(scale(u, p[0]), scale(v, p[1])));
        // The square within reach, clipped by the edges; each vertex has the edge that starts there.
        let mut polygon: Vec<PolygonVertex> = [[-r, -r], [r, -r], [r, r], [-r, r]].map(|p| (p, None)).into();
        for (k, (_, f)) in region.guards.iter().enumerate() {
            clip(&mut polygon, [f.at(o), dot(f.a, u), dot(f.a, v)], k);
        }
        let (mut beyond, mut crossings) = (Vec::new(), Vec::new());
        for k in 0..polygon.len() {
            let Some(side) = polygon[k].1 else { continue };
            let (to, guard) = region.guards[side];
            beyond.push(to);
            let a = point(polygon[k].0);
            let direction = sub(point(polygon[(k + 1) % polygon.len()].0), a);
            let (none, one, two) = (q.at(a), dot(q.half_gradient(a), direction), q.form(direction, direction));
            let w = -(one + (one * one - two * none).sqrt().copysign(one));
            for t in [w / two, none / w] {
                let at = add(a, scale(direction, t));
                if (0.0..=1.0).contains(&t) && dot(guard.a, section_tangent(q, n, at)) > 0.0 && self.belongs(at) {
                    crossings.push(SeamCrossing { from: region.label, to, at, used: false });
                }
            }
        }
        (beyond, crossings)
    }

    /// Follows the surface from a starting point of a label to an end circle or to the crossing `until`; with the
    /// half-beam of that end circle.
    fn follow(
        &mut self,
        label: u64,
        from: Vec3,
        born: Event,
        until: Option<[u64; 2]>,
    ) -> Option<(Vec<SectionArc>, Option<u32>)> {
        let (mut label, mut from, mut born) = (label, from, born);
        let mut arcs = Vec::new();
        for _ in 0..16 * self.hub.half_beams.len() + 16 {
            let region = self.region(label);
            let (path, event) = self.trace(region, from, Some(born))?;
            let mut arc = self.arc(region, &path);
            match event? {
                Event::EndCircle => {
                    let half_beam = label.trailing_zeros();
                    let DiscSection::Crossed([_, exit]) = self.disc_sections[half_beam as usize] else {
                        return None;
                    };
                    let last = arc.curves.last_mut()?;
                    if norm(sub(last.points[2], exit)) > 1e-8 * self.hub.radius {
                        return None;
                    }
                    last.points[2] = exit;
                    arcs.push(arc);
                    return Some((arcs, Some(half_beam)));
                }
                Event::To(next) => {
                    arcs.push(arc);
                    let key = [label, next];
                    let on = |c: &&mut SeamCrossing| [c.from, c.to] == key;
                    if let Some(c) = self.crossings.iter_mut().find(on) {
                        if Some(key) == until {
                            return Some((arcs, None));
                        }
                        if c.used {
                            return None;
                        }
                        c.used = true;
                    }
                    (from, born, label) = (path.at(1.0), Event::To(label), next);
                }
            }
        }
        None
    }

    /// The path of a region's conic from a point on it to its end, and the event there.
    fn trace(&self, region: usize, from: Vec3, born: Option<Event>) -> Option<(Path, Option<Event>)> {
        let (region, n) = (&self.regions[region], self.plane.normal);
        // The arc before ended on a perturbed seam: project onto this quadric.
        let mut from = from;
        for _ in 0..2 {
            let slope = region.quadric.half_gradient(from);
            let slope = sub(slope, scale(n, dot(slope, n)));
            let by = region.quadric.at(from) / (2.0 * dot(slope, slope));
            from = sub(from, scale(slope, by));
        }
        let path = Path::new(&region.quadric, n, from, section_tangent(&region.quadric, n, from))?;
        let mut end: Option<(f64, Event)> = None;
        let mut look = |event: Event, f: &AffineFunction| {
            if let Some(t) = path.first_root(f.at(from), f.a, born == Some(event))
                && end.is_none_or(|e| t < e.0)
            {
                end = Some((t, event));
            }
        };
        for (to, f) in &region.guards {
            look(Event::To(*to), f);
        }
        if region.label.count_ones() == 1 {
            let i = region.label.trailing_zeros() as usize;
            let s = &self.hub.half_beams[i];
            if !matches!(self.disc_sections[i], DiscSection::Parallel(_)) {
                let end_circle = AffineFunction { a: s.axis, b: -s.split };
                look(Event::EndCircle, &end_circle);
            }
        }
        let path = path.ended_at(end.map(|e| e.0))?;
        let x = path.at(0.5);
        let size = dot(x, x) + self.hub.radius * self.hub.radius;
        let good = self.hub.value(x).abs() <= VALUE_TOLERANCE * size && self.belongs(x);
        good.then_some((path, end.map(|e| e.1)))
    }

    /// Whether a point on the surface belongs to the hub's part; the disc between two hubs belongs to one of them.
    fn belongs(&self, x: Vec3) -> bool {
        let mut first = (0.0, None);
        for (i, s) in self.hub.half_beams.iter().enumerate() {
            let g = s.g.at(x);
            if g > first.0 {
                first = (g, Some(i));
            }
        }
        let Some(i) = first.1 else { return true };
        match self.disc_sections[i] {
            DiscSection::Parallel(before) => before,
            _ => dot(self.hub.half_beams[i].axis, x) <= self.hub.half_beams[i].split + 1e-8 * self.hub.radius,
        }
    }

    fn arc(&self, region: usize, path: &Path) -> SectionArc {
        let Region { label, quadric, .. } = self.regions[region];
        SectionArc { label, quadric, height: self.height, curves: path.curves() }
    }

    /// The whole ellipse of a region, if it lies inside.
    fn closed_ellipse(&self, i: usize) -> Option<Option<SectionArc>> {
        let (region, [u, v]) = (&self.regions[i], self.plane.axes);
        let (q, o) = (&region.quadric, self.nearest_to_center());
        let slope = q.half_gradient(o);
        let (a, b, c) = (q.form(u, u), q.form(u, v), q.form(v, v));
        let (d, e) = (dot(slope, u), dot(slope, v));
        let det = a * c - b * b;
        // Its centre, and a point on it along u from there.
        let m = [(b * e - c * d) / det, (b * d - a * e) / det];
        let square = -(q.at(o) + d * m[0] + e * m[1]) / a;
        if det <= 0.0 || square.is_nan() || square <= 0.0 {
            return Some(None);
        }
        let x = add(o, add(scale(u, m[0] + square.sqrt()), scale(v, m[1])));
        if region.guards.iter().any(|(_, f)| f.at(x) > 0.0) || !self.belongs(x) {
            return Some(None);
        }
        let (path, event) = self.trace(i, x, None)?;
        Some(event.is_none().then(|| self.arc(i, &path)))
    }
}

/// A vertex of a polygon, and the index of the edge that starts there.
type PolygonVertex = ([f64; 2], Option<usize>);

/// Clips a convex polygon by f₀ + f₁ u + f₂ v ≤ 0; the new edge gets index `name`.
fn clip(polygon: &mut Vec<PolygonVertex>, f: [f64; 3], name: usize) {
    let at = |p: [f64; 2]| f[0] + f[1] * p[0] + f[2] * p[1];
    let n = polygon.len();
    if polygon.iter().all(|(p, _)| at(*p) <= 0.0) {
        return;
    }
    let mut out = Vec::with_capacity(n + 1);
    for k in 0..n {
        let ((p, side), (q, _)) = (polygon[k], polygon[(k + 1) % n]);
        let (a, b) = (at(p), at(q));
        let crossing = || {
            let t = a / (a - b);
            [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]
        };
        match (a <= 0.0, b <= 0.0) {
            (true, true) => out.push((p, side)),
            (true, false) => {
                out.push((p, side));
                out.push((crossing(), Some(name)));
            }
            (false, true) => out.push((crossing(), side)),
            (false, false) => {}
        }
    }
    *polygon = out;
}
