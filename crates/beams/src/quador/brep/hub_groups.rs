//! The boundary of single hubs with their half-beams, closed where these are divided: equal ones are written once.

use core::f64::consts::FRAC_1_SQRT_2;
use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Vec3, add, cross, dot, scale, sub};

use super::super::Quadors;
use super::super::bezier::Bezier;
use super::super::hub::HalfBeam;
use super::super::integral::unresolved_face;
use super::super::slice::SlicePlane;
use super::outline::Outline;
use super::{Brep, EdgeUse, Frame, Kind};

/// Distance within which planes coincide, and by which one that coincides with the end of a half-beam is moved back, in typical radii:
/// far below what is noticed and above the rounding of positions.
const COINCIDENT: f64 = 1e-6;
/// Rounding of distances of planes before comparison, in typical radii.
const DIGITS: f64 = 1e9;

/// Hubs that are equal up to translation, and equally cut.
pub(crate) struct HubGroup {
    /// Its hubs; the first stands for all.
    pub hubs: Vec<u32>,
    /// The planes that may cut the first.
    planes: Vec<SlicePlane>,
}

impl HubGroup {
    /// Whether planes may cut it.
    pub(crate) fn is_cut(&self) -> bool {
        !self.planes.is_empty()
    }
}

impl Quadors {
    /// Typical radius of beams, mm.
    pub(crate) fn typical_radius(&self) -> f64 {
        self.scale
    }

    /// The kinds of hubs with their half-beams that are behind all of some planes, or cut by them.
    pub(crate) fn hub_groups(&self, planes: &[SlicePlane]) -> Vec<HubGroup> {
        let classes = self.classes();
        let mut known: HashMap<(u32, Vec<(usize, i64)>), usize> = HashMap::new();
        let mut out: Vec<HubGroup> = Vec::new();
        'hubs: for hub in 0..self.len() {
            let (bounds, center) = (self.balls[hub].part, self.center(hub));
            let mut cutting = Vec::new();
            for (index, plane) in planes.iter().enumerate() {
                let corner = |most: bool| {
                    [0, 1, 2].map(|a| if (plane.normal[a] > 0.0) == most { bounds.max[a] } else { bounds.min[a] })
                };
                let above = |x: Vec3| dot(sub(x, plane.origin), plane.normal);
                if above(corner(false)) >= 0.0 {
                    continue 'hubs;
                }
                if above(corner(true)) > 0.0 {
                    cutting.push((index, (above(center) * DIGITS / self.scale).round() as i64));
                }
            }
            let of = cutting.iter().map(|(index, _)| planes[*index]).collect();
            let number = *known.entry((classes.of[hub], cutting)).or_insert_with(|| {
                out.push(HubGroup { hubs: Vec::new(), planes: of });
                out.len() - 1
            });
            out[number].hubs.push(hub as u32);
        }
        out
    }

    /// The boundary of the first of some equal hubs, relative to its centre.
    ///
    /// # Errors
    /// As for `brep`.
    pub(crate) fn group_brep(&self, group: &HubGroup) -> Result<Brep<'_>, Fault> {
        let hub = group.hubs[0];
        let mut brep =
            Brep { quadors: self, origin: [0.0; 3], corners: Vec::new(), edges: Vec::new(), faces: Vec::new() };
        brep.hub(hub)?;
        brep.set_surfaces()?;
        brep.close(hub).ok_or_else(|| unresolved_face(hub as usize))?;
        let (near, center) = (COINCIDENT * self.scale, self.center(hub as usize));
        let half_beams = self.hub(hub as usize).half_beams;
        let moved: Vec<SlicePlane> = (group.planes.iter())
            .map(|plane| {
                let coincides = half_beams.iter().any(|s| {
                    let along = dot(s.axis, plane.normal);
                    let end = add(center, scale(s.axis, s.split));
                    1.0 - along.abs() < 1e-12 && dot(sub(end, plane.origin), plane.normal).abs() < near
                });
                if coincides { plane.moved(-2.0 * near) } else { *plane }
            })
            .collect();
        brep.trim(&moved)?;
        brep.divide_edges();
        brep.origin = center;
        Ok(brep)
    }
}

impl Brep<'_> {
    /// Fills in the faces of one hub, those of its half-beams up to their split planes.
    fn hub(&mut self, hub: u32) -> Result<(), Fault> {
        let of = self.quadors.hub(hub as usize);
        let outline = Outline::new(&of, &self.quadors.complex(hub as usize)?);
        for mut face in self.place(hub, 0, &outline) {
            let Kind::Beam(half_beam) = face.kind else {
                self.faces.push(face);
                continue;
            };
            let s = &of.half_beams[half_beam as usize];
            let plane = self.plane_along(s.axis, &[&face]);
            let end = self.end_circle(hub, s, cross(s.axis, plane.normal));
            face.loops.push(end);
            let made = self.faces.len() as u32;
            self.faces.push(face);
            self.cut(made, &plane).ok_or_else(|| unresolved_face(hub as usize))?;
        }
        Ok(())
    }

    /// The circle in which a half-beam ends, in quarters from a direction, with the half-beam on its left seen from outside.
    fn end_circle(&mut self, hub: u32, s: &HalfBeam, from: Vec3) -> Vec<EdgeUse> {
        let (center, radius) = (scale(s.axis, s.split), s.radius_squared(s.split).sqrt());
        let next = cross(from, s.axis);
        let around = [from, next, scale(from, -1.0), scale(next, -1.0)].map(|d| scale(d, radius));
        let corners = around.map(|d| self.push_corner(hub, add(center, d)));
        let quarter = |k: usize| {
            let (p, q) = (around[k], around[(k + 1) % 4]);
            let points = [p, add(p, q), q].map(|d| add(center, d));
            let ends = [corners[k], corners[(k + 1) % 4]];
            (self.push_edge(hub, ends, Bezier { points, weight: FRAC_1_SQRT_2 }), true)
        };
        (0..4).map(quarter).collect()
    }

    /// Adds planar faces at the ends of the half-beams of a hub; `None` if something else is open.
    fn close(&mut self, hub: u32) -> Option<()> {
        let all: Vec<u32> = (0..self.faces.len() as u32).collect();
        let mut open = self.open_edges(&all);
        let (half_beams, frame) = (self.quadors.hub(hub as usize).half_beams, Frame { hub, other: hub, by: [0.0; 3] });
        let center = self.center(hub);
        for s in half_beams {
            let plane = SlicePlane::new(add(center, scale(s.axis, s.split)), s.axis).ok()?;
            let near = COINCIDENT * self.quadors.scale;
            let in_plane = |edge: &u32| {
                let curve = self.curve((*edge, true), &frame);
                curve.points.iter().all(|p| (dot(*p, s.axis) - s.split).abs() < near)
            };
            let (here, left) = open.into_iter().partition(|(edge, _)| in_plane(edge));
            open = left;
            let caps = self.caps(&plane, &here)?;
            self.faces.extend(caps);
        }
        open.is_empty().then_some(())
    }
}
