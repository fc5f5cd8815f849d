//! A box, as an exact signed distance.

use std::sync::Arc;

use super::halfspace::flat;
use super::moved::{Moved, lost};
use super::primitive::{field, fill_rows, joined, joined_gradient, rounded};
use super::{BuildRegion, Context, HalfSpace, Region, SignedDistance};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::{Key, Kind};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, norm, scale, sub};
use geometry::similarity::Similarity;

/// An axis-aligned box, by its size and centre, or by two corners.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Box", noun = "a box", alternatives)]
pub enum BoxKind {
    /// By its size and centre.
    Size(BoxSize),
    /// By two corners.
    Corners(Cuboid),
}

/// A box by its size and centre.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
pub struct BoxSize {
    /// Edge lengths [x, y, z].
    #[kind(unit = "mm", above = 0.0)]
    size: Vec3,
    /// Its middle.
    #[kind(unit = "mm", default = [0.0; 3])]
    center: Vec3,
}

/// A box by two corners.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(check = Cuboid::ordered)]
pub struct Cuboid {
    /// Lower corner.
    #[kind(unit = "mm", keyword)]
    pub(super) min: Vec3,
    /// Upper corner.
    #[kind(unit = "mm")]
    pub(super) max: Vec3,
}

impl BuildRegion for BoxKind {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(match self {
            BoxKind::Size(s) => {
                s.valid()?;
                let half = scale(s.size, 0.5);
                let (min, max) = (sub(s.center, half), add(s.center, half));
                Cuboid::new(min, max).map_err(|_| unresolved(s, min, max))?
            }
            BoxKind::Corners(c) => Cuboid::new(c.min, c.max)?,
        }))
    }
}

/// A box whose size is lost to rounding at its centre.
fn unresolved(s: &BoxSize, min: Vec3, max: Vec3) -> Fault {
    let a = (0..3).find(|a| min[*a] >= max[*a]).unwrap_or(0);
    let [size, center, min, max] = [s.size[a], s.center[a], min[a], max[a]].map(number);
    let message = format!(
        "size {size} mm about {center} mm is lost to rounding: the box would run from {min} to {max} mm; move it nearer to the origin"
    );
    Fault::new("center", message).found(center)
}

impl Cuboid {
    /// The box between two corners (mm). Errors if a coordinate is not finite or a side has no length.
    pub fn new(min: Vec3, max: Vec3) -> Result<Self, Fault> {
        let made = Cuboid { min, max };
        made.valid()?;
        Ok(made)
    }

    fn ordered(&self, _: &Key) -> Result<(), Fault> {
        for (a, axis) in ["x", "y", "z"].iter().enumerate() {
            let [min, max] = [self.min[a], self.max[a]].map(number);
            if self.min[a] >= self.max[a] {
                let message = format!("along {axis}, max is {max} mm and min is {min} mm; max must be the greater");
                return Err(Fault::new("max", message).found(max));
            }
        }
        Ok(())
    }

    fn sides(&self, p: Vec3) -> Vec3 {
        [0, 1, 2].map(|a| (self.min[a] - p[a]).max(p[a] - self.max[a]))
    }

    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        joined(self.sides(p))
    }

    pub(super) fn gradient(&self, p: Vec3) -> Vec3 {
        let mut g = [[0.0; 3]; 3];
        for a in 0..3 {
            g[a][a] = if self.min[a] - p[a] > p[a] - self.max[a] { -1.0 } else { 1.0 };
        }
        joined_gradient(self.sides(p), g)
    }

    /// The side distances are convex and independent, and the distance grows with each: exact.
    pub(super) fn range(&self, b: &Aabb) -> Interval {
        let mut q = [[0.0; 3]; 2];
        for a in 0..3 {
            let middle = ((self.min[a] + self.max[a]) / 2.0).clamp(b.min[a], b.max[a]);
            let ends = [b.min[a], b.max[a], middle].map(|v| (self.min[a] - v).max(v - self.max[a]));
            q[0][a] = ends[0].min(ends[1]).min(ends[2]);
            q[1][a] = ends[0].max(ends[1]);
        }
        Interval::new(joined(q[0]), joined(q[1]))
    }
}

impl SignedDistance for Cuboid {
    fn bounds(&self) -> Aabb {
        Aabb { min: self.min, max: self.max }
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        let (lo, hi) = (self.min[axis] - level, self.max[axis] + level);
        if lo < hi {
            out.extend([lo, hi]);
        }
    }

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        if by > 0.0 {
            return rounded(self, by, out);
        }
        let sides = (0..3).flat_map(|axis| [(axis, self.min[axis] - by, false), (axis, self.max[axis] + by, true)]);
        CsgTree::Intersection(sides.map(|s| flat(s, out)).collect())
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        if !by.keeps_axes() {
            return Ok(Arc::new(Moved::new(self, by)));
        }
        let Aabb { min, max } = Aabb::EMPTY.with(by.point(self.min)).with(by.point(self.max));
        let far = min.iter().chain(&max).fold(0.0f64, |m, x| m.max(x.abs()));
        let made = Cuboid::new(min, max).map_err(|_| lost(far, norm(self.bounds().size()) * by.scale()))?;
        Ok(Arc::new(made))
    }

    fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
        let side = |(axis, upper): (usize, bool)| {
            let mut normal = [0.0; 3];
            normal[axis] = if upper { 1.0 } else { -1.0 };
            HalfSpace { point: if upper { self.max } else { self.min }, normal }
        };
        Some((0..3).flat_map(|a| [(a, false), (a, true)]).map(side).collect())
    }

    fn volume(&self) -> Option<f64> {
        let [x, y, z] = self.bounds().size();
        Some(x * y * z)
    }
}

field!(Cuboid);
