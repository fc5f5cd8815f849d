//! A half-space, as an exact signed distance.

use std::sync::Arc;

use super::primitive::{along, coordinate_axis, direction, field, fill_rows};
use super::{BuildRegion, Context, FARTHEST, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::{AxisPlane, Surface};
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, cross, dot, norm, scale, sub};
use geometry::similarity::Similarity;

/// One side of a plane; it bounds nothing alone, so combine it.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "HalfSpace", noun = "a half-space")]
pub struct HalfSpaceKind {
    /// A point on the plane.
    #[kind(unit = "mm")]
    point: Vec3,
    /// Normal of the plane; it points out of the solid. Its length does not matter.
    normal: Vec3,
}

/// Everything on one side of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    pub(super) point: Vec3,
    pub(super) normal: Vec3,
}

impl HalfSpaceKind {
    /// The half-space. Errors if a number is not finite or the normal is zero.
    pub fn made(&self) -> Result<HalfSpace, Fault> {
        self.valid()?;
        Ok(HalfSpace { point: self.point, normal: direction("normal", self.normal)? })
    }
}

impl BuildRegion for HalfSpaceKind {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(self.made()?))
    }
}

impl HalfSpace {
    /// The side of the plane through `point` (mm) that `normal` (any length) points away from. Errors if a
    /// number is not finite or the normal is zero.
    pub fn new(point: Vec3, normal: Vec3) -> Result<Self, Fault> {
        HalfSpaceKind { point, normal }.made()
    }

    /// A point on the plane, mm.
    pub fn point(&self) -> Vec3 {
        self.point
    }

    /// The unit normal of the plane; it points out of the solid.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// The half-space that a plane normal to a coordinate axis bounds.
    pub(super) fn of_plane(plane: AxisPlane) -> HalfSpace {
        let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
        (point[plane.axis], normal[plane.axis]) = (plane.at, if plane.below { 1.0 } else { -1.0 });
        HalfSpace { point, normal }
    }

    /// The image of the half-space.
    pub(super) fn image(&self, by: &Similarity) -> HalfSpace {
        HalfSpace { point: by.point(self.point), normal: by.direction(self.normal) }
    }

    /// The other side of the plane.
    pub(super) fn complement(&self) -> HalfSpace {
        HalfSpace { point: self.point, normal: scale(self.normal, -1.0) }
    }

    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        dot(sub(p, self.point), self.normal)
    }

    pub(super) fn gradient(&self, _: Vec3) -> Vec3 {
        self.normal
    }

    pub(super) fn range(&self, b: &Aabb) -> Interval {
        along(b, self.point, self.normal)
    }
}

/// A distance (mm) beyond all parts.
const FAR: f64 = 4.0 * FARTHEST;
/// Sines of angles between planes and lines below which they count as parallel: a hundred times the rounding of their normals.
const PARALLEL: f64 = 1e-13;

/// The bounds of an intersection of half-spaces, infinite where it has no end: those of what is left of the lines in which two planes meet,
/// the planes of a large box included.
pub(super) fn polyhedron_bounds(sides: &[HalfSpace]) -> Aabb {
    let mut planes: Vec<(Vec3, f64)> = sides.iter().map(|s| (s.normal, dot(s.normal, s.point))).collect();
    for a in 0..3 {
        for sign in [-1.0, 1.0] {
            planes.push(([0, 1, 2].map(|b| if a == b { sign } else { 0.0 }), FAR));
        }
    }
    let mut bounds = Aabb::EMPTY;
    for (i, p) in planes.iter().enumerate() {
        for (j, q) in planes.iter().enumerate().take(i) {
            let along = cross(p.0, q.0);
            let square = dot(along, along);
            if square <= PARALLEL {
                continue;
            }
            let from = scale(add(scale(cross(q.0, along), p.1), scale(cross(along, p.0), q.1)), 1.0 / square);
            let along = scale(along, 1.0 / square.sqrt());
            let slack = 1e-12 * (1.0 + norm(from));
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for (_, r) in planes.iter().enumerate().filter(|(k, _)| *k != i && *k != j) {
                let (rise, left) = (dot(r.0, along), r.1 - dot(r.0, from));
                match rise {
                    _ if rise.abs() <= PARALLEL => high = if left < -slack { f64::NEG_INFINITY } else { high },
                    0.0.. => high = high.min(left / rise),
                    _ => low = low.max(left / rise),
                }
            }
            if low <= high + slack {
                bounds = bounds.with(add(from, scale(along, low))).with(add(from, scale(along, high)));
            }
        }
    }
    let ended = |v: f64| if v.abs() < 0.5 * FAR { v } else { v * f64::INFINITY };
    Aabb { min: bounds.min.map(ended), max: bounds.max.map(ended) }
}

impl SignedDistance for HalfSpace {
    fn bounds(&self) -> Aabb {
        let mut b = Aabb::ALL;
        if let Some(a) = coordinate_axis(self.normal) {
            *(if self.normal[a] > 0.0 { &mut b.max[a] } else { &mut b.min[a] }) = self.point[a];
        }
        b
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        if coordinate_axis(self.normal) == Some(axis) {
            out.push(self.point[axis] + self.normal[axis] * level);
        }
    }

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        let point = add(self.point, scale(self.normal, by));
        match coordinate_axis(self.normal) {
            Some(a) => flat((a, point[a], self.normal[a] > 0.0), out),
            None => one_surface(Arc::new(HalfSpace { point, ..*self }), out),
        }
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        Ok(Arc::new(self.image(by)))
    }

    fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
        Some(vec![*self])
    }

    fn volume(&self) -> Option<f64> {
        None
    }
}

field!(HalfSpace);

/// The solid below (or above) a coordinate of an axis.
pub(super) fn flat((axis, at, below): (usize, f64, bool), out: &mut Vec<Surface>) -> CsgTree {
    let plane = AxisPlane { axis, at, below };
    let mut face = Surface::distance(Arc::new(HalfSpace::of_plane(plane)));
    face.plane = Some(plane);
    out.push(face);
    CsgTree::Leaf(out.len() - 1)
}
