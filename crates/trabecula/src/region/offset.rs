//! The offset of a region: grown or shrunk by a distance (mm).

use std::sync::Arc;

use super::{BuildRegion, CadMesh, Context, Region, RegionKind, SignedDistance, joint};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3};
use geometry::random::low_discrepancy;
use geometry::similarity::Similarity;

/// A region grown or shrunk by a distance.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Offset", noun = "an offset")]
pub struct OffsetKind {
    /// The region.
    of: Box<RegionKind>,
    /// Distance; positive grows.
    #[kind(unit = "mm")]
    by: f64,
}

impl BuildRegion for OffsetKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        let of = context.below("of", |context| self.of.build(context))?;
        if let Some(place) = divided(&of, self.by) {
            context.warn(format!("shrinking divides it {place}"));
        }
        Ok(Arc::new(Offset::new(of, self.by)?))
    }
}

/// Where a region is divided when it is shrunk, since parts of it only touch there, in words.
fn divided(region: &Region, by: f64) -> Option<String> {
    const SAMPLES: usize = 4096;
    let bounds = region.bounds();
    if by >= 0.0 || !bounds.is_finite() {
        return None;
    }
    let points: Vec<Vec3> = (0..SAMPLES).map(|k| bounds.at(low_discrepancy(k))).collect();
    joint(region, &points, f64::INFINITY, -by)
}

/// A region grown (positive) or shrunk (negative): d − by.
pub struct Offset {
    of: Region,
    by: f64,
    /// Values closer to zero than this are zero, so that a flat face moved to a rounded coordinate stays exact.
    snap: f64,
}

impl Offset {
    /// The region moved outwards by `by` mm. Errors if `by` is not finite.
    pub fn new(of: Region, by: f64) -> Result<Self, Fault> {
        if !by.is_finite() {
            return Err(Fault::new("by", format!("by is {} mm; it must be finite", number(by))).found(number(by)));
        }
        let mut planes = Vec::new();
        (0..3).for_each(|axis| of.planes(axis, &mut planes));
        // The moved coordinate, the distance and the difference each round once.
        let snap = planes.iter().fold(0.0f64, |s, c| s.max(4.0 * f64::EPSILON * (c.abs() + by.abs())));
        Ok(Offset { of, by, snap })
    }

    fn snapped(&self, v: f64) -> f64 {
        if v.abs() <= self.snap { 0.0 } else { v }
    }
}

impl Field for Offset {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.of.values(points, out);
        out.iter_mut().for_each(|v| *v = self.snapped(*v - self.by));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.of.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v = self.snapped(*v - self.by));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let r = self.of.bound(b);
        Interval::new(self.snapped(r.lo - self.by), self.snapped(r.hi - self.by))
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl SignedDistance for Offset {
    fn bounds(&self) -> Aabb {
        self.of.bounds().grown(self.by)
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        self.of.level_planes(axis, self.by + level, out);
    }

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        self.of.fill_level(block, self.by + level, out);
        let snap = self.snap as f32;
        out.iter_mut().filter(|v| v.abs() <= snap).for_each(|v| *v = 0.0);
    }

    fn is_searched(&self) -> bool {
        self.of.is_searched()
    }

    fn cad(&self, out: &mut Vec<Arc<CadMesh>>) {
        self.of.cad(out);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        self.of.clone().surfaces(self.by + by, out)
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        Ok(Arc::new(Offset::new(self.of.clone().moved(by)?, self.by * by.scale())?))
    }

    fn volume(&self) -> Option<f64> {
        if self.by == 0.0 { self.of.volume() } else { None }
    }
}
