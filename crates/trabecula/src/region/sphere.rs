//! A ball, as an exact signed distance.

use core::f64::consts::PI;
use std::sync::Arc;

use super::primitive::{apart, field, fill_rows};
use super::{BuildRegion, Context, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, norm, sub, unit};
use geometry::similarity::Similarity;

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
pub struct Sphere {
    /// Radius.
    #[kind(unit = "mm", above = 0.0)]
    radius: f64,
    /// Centre.
    #[kind(unit = "mm", default = [0.0; 3])]
    center: Vec3,
}

impl BuildRegion for Sphere {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(Sphere::new(self.center, self.radius)?))
    }
}

impl Sphere {
    /// The ball about a point (mm). Errors if a number is not finite or the radius not above zero.
    pub fn new(center: Vec3, radius: f64) -> Result<Self, Fault> {
        let made = Sphere { center, radius };
        made.valid()?;
        Ok(made)
    }

    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        norm(sub(p, self.center)) - self.radius
    }

    pub(super) fn gradient(&self, p: Vec3) -> Vec3 {
        let g = unit(sub(p, self.center));
        if g == [0.0; 3] { [1.0, 0.0, 0.0] } else { g }
    }

    pub(super) fn range(&self, b: &Aabb) -> Interval {
        let r = apart(b, self.center, &[0, 1, 2]);
        Interval::new(r.lo - self.radius, r.hi - self.radius)
    }
}

impl SignedDistance for Sphere {
    fn bounds(&self) -> Aabb {
        Aabb { min: self.center, max: self.center }.grown(self.radius)
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        if self.radius + by <= 0.0 {
            return CsgTree::EMPTY;
        }
        let radius = self.radius + by;
        one_surface(Arc::new(Sphere { radius, ..*self }), out)
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        Ok(Arc::new(Sphere::new(by.point(self.center), self.radius * by.scale())?))
    }

    fn volume(&self) -> Option<f64> {
        Some(4.0 / 3.0 * PI * self.radius.powi(3))
    }
}

field!(Sphere);
