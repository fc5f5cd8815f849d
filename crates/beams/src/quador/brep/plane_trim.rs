//! Trimming of the boundary by planes, with planar faces in them.
//!
//! Faces are cut along their sections with a plane, which are conics, and the parts in front of it go. The edges that only one face
//! is left to use then bound planar faces. A section that closes within one face, where that bulges through the plane, is made to
//! cross an edge: the face is first divided through the point that is farthest along the plane's normal.

use std::collections::{BTreeMap, HashMap};

use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use geometry::progress::checkpoint;

use super::super::hub_quadric::Quadric;
use super::super::perpendicular::perpendicular;
use super::super::slice::{DISPLACEMENTS, SlicePlane};
use super::cuts::CutPlane;
use super::{Brep, BrepFace, Corner, Edge, EdgeUse, Frame, Kind, NONE, Surface};

/// Distance from a plane within which corners are on it, in typical radii: above the perturbation of seams and the length of
/// arcs that are collapsed, and far below what files resolve.
const ON: f64 = 3e-10;
/// The same for the edges of a planar face.
const IN_CAP: f64 = 1e-6;
/// Chord error of polygons by which loops are sorted, in typical radii.
const CHORD: f64 = 1e-2;

/// Corners, edges and faces.
type State = (Vec<Corner>, Vec<Edge>, Vec<BrepFace>);

impl Brep<'_> {
    /// Keeps what is behind all of some planes.
    ///
    /// # Errors
    /// Planes that touch the boundary and cut nothing there, displaced ones too.
    pub(super) fn trim(&mut self, planes: &[SlicePlane]) -> Result<(), Fault> {
        let whole = self.state();
        let mut failed = None;
        // What one plane touches another may take away: each is the first in turn.
        for first in 0..planes.len() {
            let order = planes[first..].iter().chain(&planes[..first]);
            let touched = order.copied().find(|plane| !self.is_trimmed(plane));
            let Some(touched) = touched else { return Ok(()) };
            failed = failed.or(Some(touched));
            self.restore(&whole);
        }
        let Some(plane) = failed else { return Ok(()) };
        let [n, at] = [plane.normal, plane.origin].map(|v| v.map(|x| number(x + 0.0)).join(", "));
        let message = format!(
            "the plane through ({at}) mm with the normal ({n}) is tangent to the surface of the beams, also displaced by {} mm: move \
             it a little",
            number(DISPLACEMENTS[4].abs() * self.quadors.scale)
        );
        Err(Fault::new("region", message))
    }

    /// Keeps what is behind a plane, or one that is displaced a little; false if they all touch the boundary.
    fn is_trimmed(&mut self, plane: &SlicePlane) -> bool {
        let before = self.state();
        DISPLACEMENTS.iter().any(|by| {
            let done = self.trim_by(&plane.moved(by * self.quadors.scale)).is_some();
            if !done {
                self.restore(&before);
            }
            done
        })
    }

    fn state(&self) -> State {
        (self.corners.clone(), self.edges.clone(), self.faces.clone())
    }

    fn restore(&mut self, state: &State) {
        (self.corners, self.edges, self.faces) = state.clone();
    }

    /// Keeps what is behind a plane; `None` if it touches the boundary without cutting it.
    fn trim_by(&mut self, plane: &SlicePlane) -> Option<()> {
        let mut kept = Vec::with_capacity(self.faces.len());
        for face in 0..self.faces.len() as u32 {
            checkpoint();
            let Frame { hub, .. } = self.faces[face as usize].frame;
            let point = sub(plane.origin, self.center(hub));
            let local = CutPlane { near: ON * self.quadors.scale, ..CutPlane::through(point, plane.normal) };
            for part in self.cut_through(face, &local)? {
                if !self.is_in_front(part, &local)? {
                    kept.push(part);
                }
            }
        }
        let caps = self.caps(plane, &self.open_edges(&kept))?;
        self.faces = kept.iter().map(|f| self.faces[*f as usize].clone()).chain(caps).collect();
        Some(())
    }

    /// Whether a face that a plane does not cross is in front of it; `None` if its edges disagree.
    fn is_in_front(&self, face: u32, plane: &CutPlane) -> Option<bool> {
        let of = &self.faces[face as usize];
        let mut sides = self.loops(of).into_iter().flatten().map(|u| {
            let curve = self.curve(u, &of.frame);
            plane.is_face_above(&of.quadric, &curve)
        });
        let first = sides.next()?;
        sides.all(|s| s == first).then_some(first)
    }

    /// Cuts a face by a plane as `cut` does, also where the section closes within the face.
    fn cut_through(&mut self, face: u32, plane: &CutPlane) -> Option<Vec<u32>> {
        let parts = self.cut(face, plane)?;
        if parts.len() > 1 {
            return Some(parts);
        }
        let in_front = self.is_in_front(face, plane)?;
        let bounds = self.bounds(face);
        let quadric = self.faces[face as usize].quadric;
        let beyond = |x: &Vec3| (plane.at(*x) > plane.near) != in_front && bounds.distance(*x) == 0.0;
        for x in quadric.extremes(plane.normal).into_iter().flatten().filter(beyond) {
            let one = perpendicular(plane.normal);
            let two = cross(plane.normal, one);
            for normal in [one, two, scale(add(one, two), 0.5f64.sqrt()), scale(sub(one, two), 0.5f64.sqrt())] {
                let (count, before) = (self.faces.len(), self.faces[face as usize].clone());
                let cut = self.halved(face, &CutPlane::through(x, normal), plane);
                if cut.as_ref().is_some_and(|parts| parts.len() > 2) {
                    return cut;
                }
                self.faces.truncate(count);
                self.faces[face as usize] = before;
            }
        }
        Some(parts)
    }

    /// Cuts a face by one plane, and its parts by another.
    fn halved(&mut self, face: u32, first: &CutPlane, then: &CutPlane) -> Option<Vec<u32>> {
        let halves = self.cut(face, first)?;
        let mut parts = Vec::new();
        for half in halves {
            parts.extend(self.cut(half, then)?);
        }
        Some(parts)
    }

    /// A box around a face with a margin, as the control points of its edges say, relative to its hub.
    fn bounds(&self, face: u32) -> Aabb {
        let of = &self.faces[face as usize];
        let points = self.loops(of).into_iter().flatten().flat_map(|u| self.curve(u, &of.frame).points);
        let bounds = points.fold(Aabb::EMPTY, Aabb::with);
        bounds.grown(0.5 * norm(bounds.size()))
    }

    /// The edges that just one of some faces uses, and how.
    pub(super) fn open_edges(&self, faces: &[u32]) -> BTreeMap<u32, bool> {
        let mut open = BTreeMap::new();
        for face in faces {
            for (edge, forward) in self.loops(&self.faces[*face as usize]).into_iter().flatten() {
                if open.remove(&edge).is_none() {
                    open.insert(edge, forward);
                }
            }
        }
        open
    }

    /// The planar faces in a plane that open edges bound; `None` if these do not lie in the plane, or touch in a corner.
    pub(super) fn caps(&self, plane: &SlicePlane, open: &BTreeMap<u32, bool>) -> Option<Vec<BrepFace>> {
        let Some(first) = open.keys().next() else {
            return Some(Vec::new());
        };
        let hub = self.edge(*first).hub;
        let point = sub(plane.origin, self.center(hub));
        // Relative to the hub, the point of the plane nearest to it.
        let origin = scale(plane.normal, dot(point, plane.normal));
        let frame = Frame { hub, other: hub, by: [0.0; 3] };
        let surface = Surface::Plane { origin, axes: plane.axes };
        let mut from: HashMap<u32, EdgeUse> = HashMap::new();
        for (&edge, &forward) in open {
            let of = (edge, !forward);
            let curve = self.curve(of, &frame);
            let off = |p: &Vec3| dot(sub(*p, origin), plane.normal).abs() > IN_CAP * self.quadors.scale;
            if curve.points.iter().any(off) || from.insert(self.start(of), of).is_some() {
                return None;
            }
        }
        let mut loops: Vec<Vec<EdgeUse>> = Vec::new();
        for (&edge, &forward) in open {
            let mut next = self.start((edge, !forward));
            let mut traced = Vec::new();
            while let Some(of) = from.remove(&next) {
                traced.push(of);
                next = self.start((of.0, !of.1));
            }
            if let Some(first) = traced.first() {
                if next != self.start(*first) {
                    return None;
                }
                loops.push(traced);
            }
        }
        let b = scale(plane.normal, 0.5);
        let quadric = Quadric { m: [[0.0; 3]; 3], b, c: -dot(origin, plane.normal) };
        let face = |loops| BrepFace { frame, quadric, loops, surface, kind: Kind::Cap, class: [NONE; 2] };
        Some(self.nested(loops, &frame, &surface)?.into_iter().map(face).collect())
    }

    /// Sorts loops in a plane: those around faces, each followed by those of its holes; `None` for a hole outside all.
    fn nested(&self, loops: Vec<Vec<EdgeUse>>, frame: &Frame, plane: &Surface) -> Option<Vec<Vec<Vec<EdgeUse>>>> {
        let mut outer: Vec<Outer> = Vec::new();
        let mut holes: Vec<([f64; 2], Vec<EdgeUse>)> = Vec::new();
        for l in loops {
            let mut polygon: Vec<[f64; 2]> = Vec::new();
            let mut twice = 0.0;
            for of in &l {
                let flat = plane.flattened(&self.curve(*of, frame));
                twice += flat.swept_area_twice([0.0; 2]);
                flat.flatten(CHORD * self.quadors.scale, &mut polygon);
            }
            if twice > 0.0 {
                outer.push(Outer { twice, polygon, loops: vec![l] });
            } else {
                holes.push((*polygon.first()?, l));
            }
        }
        for (at, hole) in holes {
            let around = outer.iter_mut().filter(|o| is_in(&o.polygon, at));
            around.min_by(|p, q| p.twice.total_cmp(&q.twice))?.loops.push(hole);
        }
        Some(outer.into_iter().map(|o| o.loops).collect())
    }
}

/// A loop around a face, with those of its holes.
struct Outer {
    /// Twice the area within it.
    twice: f64,
    /// It, in chords.
    polygon: Vec<[f64; 2]>,
    loops: Vec<Vec<EdgeUse>>,
}

/// Whether a point is in a polygon.
fn is_in(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let mut before = polygon.last().copied().unwrap_or_default();
    let mut inside = false;
    for &p in polygon {
        if (p[1] > y) != (before[1] > y) && x < p[0] + (before[0] - p[0]) * (y - p[1]) / (before[1] - p[1]) {
            inside = !inside;
        }
        before = p;
    }
    inside
}
