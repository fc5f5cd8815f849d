//! A half-space, as an exact signed distance.

use std::sync::Arc;

use super::primitive::{along, coordinate_axis, direction, field, fill_rows, flat};
use super::{BuildRegion, Context, Region, Shape, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, dot, scale, sub};

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

impl Shape for HalfSpace {
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

    fn volume(&self) -> Option<f64> {
        None
    }
}

field!(HalfSpace);
