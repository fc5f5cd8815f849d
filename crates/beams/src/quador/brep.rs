//! The boundary of a quador lattice as faces, edges and vertices: the form in which CAD systems exchange solids.
//!
//! An edge is one rational quadratic Bézier curve, and both its faces use it. The two half-beams of a beam are one face
//! around its axis. Such faces are cut along the axis, and spherical ones through two of their meridians, so that no
//! face closes on itself or contains a pole of its surface. Positions are relative to hubs, so that equal hubs have the
//! same numbers.

use geometry::fault::Fault;
use geometry::math::{Vec3, add, sub};
use geometry::union_find::{find, unite};

use super::Quadors;
use super::bezier::Bezier;
use super::hub_quadric::Quadric;
use super::slice::SlicePlane;
use super::stereographic::Stereographic;

mod cuts;
mod face_surfaces;
mod hub_groups;
mod outline;
mod parameter_curves;
mod plane_trim;
mod volume;

pub(crate) use hub_groups::HubGroup;
pub(crate) use parameter_curves::CurveKey;

const NONE: u32 = u32::MAX;

/// A point of the boundary where edges meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// The hub to whose centre it is relative.
    pub hub: u32,
    /// The position, mm.
    pub at: Vec3,
}

/// An edge.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    /// The hub to whose centre it is relative.
    pub hub: u32,
    /// Its corners.
    pub ends: [u32; 2],
    /// The curve from the first to the second corner.
    pub curve: Bezier<3>,
    /// The edges that it was divided into, if it was.
    parts: [u32; 2],
}

/// A use of an edge by a face: its number, and whether it is traversed from its first corner.
pub(crate) type EdgeUse = (u32, bool);

/// What a face is part of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// The ball; with the axis of a half-beam that leaves it inside a boundary loop.
    Ball(Vec3),
    /// A beam, given as a half-beam at the face's hub.
    Beam(u32),
    /// A fillet, with the axis of one of its half-beams.
    Fillet(Vec3),
    /// A planar face where the lattice is trimmed.
    Cap,
}

/// The surface of a face, in the frame of its hub.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Surface {
    /// A circular cylinder whose axis passes through the hub's centre.
    Cylinder { axis: Vec3, side: Vec3, radius: f64 },
    /// A circular cone whose axis passes through the hub's centre, with the radius there, that widens along the axis.
    Cone { axis: Vec3, side: Vec3, radius: f64, half_angle: f64 },
    /// The ball, with its poles on the axis.
    Sphere { axis: Vec3, side: Vec3, radius: f64 },
    /// A quadric of revolution about an axis through the hub's centre, by its meridian in the half-plane of `side`, along
    /// the axis.
    Revolution { axis: Vec3, side: Vec3, meridian: Bezier<3> },
    /// Any quadric as a rational biquadratic patch over ranges of s and t.
    Rational { chart: Stereographic, range: [[f64; 2]; 2] },
    /// A plane, by one of its points, and by unit vectors along u and v; u × v points out of the solid.
    Plane { origin: Vec3, axes: [Vec3; 2] },
}

/// The frame of a face: relative to the centre of a hub. That of a beam also refers to its other hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// The hub.
    pub hub: u32,
    /// The other hub of a beam, or the same.
    other: u32,
    /// The vector from the hub's centre to the other's, to the last bit the same for equal beams.
    by: Vec3,
}

/// A face.
#[derive(Clone, Debug)]
pub(crate) struct BrepFace {
    /// Its frame.
    pub frame: Frame,
    /// Its quadric.
    pub quadric: Quadric,
    /// Boundary loops with the face on the left, seen from outside.
    pub loops: Vec<Vec<EdgeUse>>,
    /// Its surface.
    pub surface: Surface,
    kind: Kind,
    /// The class of its hub, and its number there: equal faces have the same.
    class: [u32; 2],
}

/// The boundary of a quador lattice.
pub(crate) struct Brep<'a> {
    quadors: &'a Quadors,
    /// The position that all are relative to, mm.
    origin: Vec3,
    /// The corners.
    pub corners: Vec<Corner>,
    edges: Vec<Edge>,
    /// The faces.
    pub faces: Vec<BrepFace>,
}

impl Quadors {
    /// The boundary as faces, edges and vertices, of what is behind all of some planes: on the side away from their normals.
    ///
    /// # Errors
    /// Beams that intersect without a common hub or overlap too far, hubs whose seams do not close, and faces that
    /// have no rational form; planes that touch the boundary and cut nothing there.
    pub(crate) fn brep(&self, planes: &[SlicePlane]) -> Result<Brep<'_>, Fault> {
        self.require_brep()?;
        let mut brep =
            Brep { quadors: self, origin: [0.0; 3], corners: Vec::new(), edges: Vec::new(), faces: Vec::new() };
        brep.outline()?;
        brep.set_surfaces()?;
        brep.trim(planes)?;
        brep.divide_edges();
        Ok(brep)
    }

    /// # Errors
    /// Beams that intersect without a common hub or overlap too far.
    pub(crate) fn require_brep(&self) -> Result<(), Fault> {
        self.require_closed_forms()?;
        if let Some(found) = self.collisions().first() {
            let [a, b] = found.beams;
            return Err(Fault::new(
                format!("beams[{a}]"),
                format!(
                    "beams {a} and {b} intersect without a common hub, so the boundary has no closed form: join them in a hub"
                ),
            ));
        }
        Ok(())
    }
}

impl Brep<'_> {
    /// The centre of a hub, mm.
    pub(crate) fn center(&self, hub: u32) -> Vec3 {
        sub(self.quadors.center(hub as usize), self.origin)
    }

    /// Number of edges, those included that were divided.
    pub(crate) fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// An edge.
    pub(crate) fn edge(&self, edge: u32) -> &Edge {
        &self.edges[edge as usize]
    }

    /// The boundary loops of a face, where edges that were divided are replaced by their parts.
    pub(crate) fn loops(&self, face: &BrepFace) -> Vec<Vec<EdgeUse>> {
        let whole = |l: &Vec<EdgeUse>| {
            let mut out = Vec::with_capacity(l.len());
            let mut todo: Vec<EdgeUse> = l.iter().rev().copied().collect();
            while let Some((edge, forward)) = todo.pop() {
                match self.edge(edge).parts {
                    [NONE, _] => out.push((edge, forward)),
                    [p, q] if forward => todo.extend([(q, true), (p, true)]),
                    [p, q] => todo.extend([(p, false), (q, false)]),
                }
            }
            out
        };
        face.loops.iter().map(whole).collect()
    }

    /// A point relative to a hub's centre, in a frame.
    fn placed(&self, at: Vec3, hub: u32, frame: &Frame) -> Vec3 {
        match hub {
            _ if hub == frame.hub => at,
            _ if hub == frame.other => add(at, frame.by),
            _ => add(at, sub(self.center(hub), self.center(frame.hub))),
        }
    }

    /// The curve of an edge in a frame, in its direction of traversal.
    pub(crate) fn curve(&self, (edge, forward): EdgeUse, frame: &Frame) -> Bezier<3> {
        let Edge { hub, mut curve, .. } = *self.edge(edge);
        curve.points = curve.points.map(|p| self.placed(p, hub, frame));
        if !forward {
            curve.points.reverse();
        }
        curve
    }

    /// The first corner of an edge in its direction of traversal.
    fn start(&self, (edge, forward): EdgeUse) -> u32 {
        self.edge(edge).ends[usize::from(!forward)]
    }

    /// A corner in a frame.
    fn corner(&self, corner: u32, frame: &Frame) -> Vec3 {
        let Corner { hub, at } = self.corners[corner as usize];
        self.placed(at, hub, frame)
    }

    /// A corner's position, mm.
    pub(crate) fn position(&self, corner: u32) -> Vec3 {
        let Corner { hub, at } = self.corners[corner as usize];
        add(self.center(hub), at)
    }

    /// Appends an edge and gives its number.
    fn push_edge(&mut self, hub: u32, ends: [u32; 2], curve: Bezier<3>) -> u32 {
        self.edges.push(Edge { hub, ends, curve, parts: [NONE; 2] });
        self.edges.len() as u32 - 1
    }

    /// Appends a corner and gives its number.
    fn push_corner(&mut self, hub: u32, at: Vec3) -> u32 {
        self.corners.push(Corner { hub, at });
        self.corners.len() as u32 - 1
    }

    /// Appends edges along consecutive curves between two corners, and gives their numbers.
    fn push_chain(&mut self, frame: &Frame, ends: [u32; 2], curves: &[Bezier<3>]) -> Vec<u32> {
        let mut out = Vec::with_capacity(curves.len());
        let mut from = ends[0];
        for (k, curve) in curves.iter().enumerate() {
            let to = if k + 1 == curves.len() { ends[1] } else { self.push_corner(frame.hub, curve.points[2]) };
            let mut curve = *curve;
            curve.points[0] = self.corner(from, frame);
            curve.points[2] = self.corner(to, frame);
            out.push(self.push_edge(frame.hub, [from, to], curve));
            from = to;
        }
        out
    }

    /// The connected components of the boundary, as numbers of faces.
    pub(crate) fn components(&self) -> Vec<Vec<u32>> {
        let count = self.faces.len();
        let mut to: Vec<u32> = (0..count as u32).collect();
        let mut first: Vec<u32> = vec![NONE; self.edges.len()];
        for (i, face) in (0..).zip(&self.faces) {
            for (edge, _) in self.loops(face).into_iter().flatten() {
                match first[edge as usize] {
                    NONE => first[edge as usize] = i,
                    other => _ = unite(&mut to, other, i),
                }
            }
        }
        let mut number = vec![NONE; count];
        let mut out: Vec<Vec<u32>> = Vec::new();
        for i in 0..count as u32 {
            let root = find(&mut to, i) as usize;
            if number[root] == NONE {
                number[root] = out.len() as u32;
                out.push(Vec::new());
            }
            out[number[root] as usize].push(i);
        }
        out
    }
}

#[cfg(test)]
mod tests;
