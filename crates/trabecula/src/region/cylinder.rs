//! A cylinder, as an exact signed distance.

use core::f64::consts::PI;
use std::sync::Arc;

use super::halfspace::flat;
use super::primitive::{along, apart, coordinate_axis, direction, field, fill_rows, joined, joined_gradient, rounded};
use super::{BuildRegion, Context, HalfSpace, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::similarity::Similarity;

/// A straight round cylinder.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Cylinder")]
pub struct CylinderKind {
    /// Middle of the lower face.
    #[kind(unit = "mm")]
    base: Vec3,
    /// Radius.
    #[kind(unit = "mm", above = 0.0)]
    radius: f64,
    /// Height along the axis.
    #[kind(unit = "mm", above = 0.0)]
    height: f64,
    /// Direction from the lower to the upper face; its length does not matter.
    #[kind(default = [0.0, 0.0, 1.0])]
    axis: Vec3,
}

impl BuildRegion for CylinderKind {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(Cylinder::new(self.base, self.axis, self.radius, self.height)?))
    }
}

/// A solid cylinder of circular section with flat caps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    base: Vec3,
    axis: Vec3,
    radius: f64,
    height: f64,
    /// Coordinate axis that the cylinder runs along and the coordinates of its caps there, if it does.
    aligned: Option<(usize, [f64; 2])>,
}

impl Cylinder {
    /// The cylinder from the middle of its base (mm) along `axis` (any length). Errors if a number is not
    /// finite, the axis is zero, or radius or height is not above zero.
    pub fn new(base: Vec3, axis: Vec3, radius: f64, height: f64) -> Result<Self, Fault> {
        CylinderKind { base, radius, height, axis }.valid()?;
        let axis = direction("axis", axis)?;
        let aligned = coordinate_axis(axis).map(|a| {
            let (from, to) = (base[a], base[a] + axis[a] * height);
            (a, [from.min(to), from.max(to)])
        });
        Ok(Cylinder { base, axis, radius, height, aligned })
    }

    /// Signed distances to the barrel and to the caps.
    #[inline]
    pub(super) fn sides(&self, p: Vec3) -> [f64; 2] {
        let d = sub(p, self.base);
        match self.aligned {
            Some((a, [lo, hi])) => {
                let (u, v) = (d[(a + 1) % 3], d[(a + 2) % 3]);
                [(u * u + v * v).sqrt() - self.radius, (lo - p[a]).max(p[a] - hi)]
            }
            None => {
                let h = dot(d, self.axis);
                [norm(sub(d, scale(self.axis, h))) - self.radius, (-h).max(h - self.height)]
            }
        }
    }

    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        joined(self.sides(p))
    }

    /// The direction away from the axis.
    pub(super) fn radial(&self, p: Vec3) -> Vec3 {
        let d = sub(p, self.base);
        let radial = unit(sub(d, scale(self.axis, dot(d, self.axis))));
        if radial == [0.0; 3] {
            // On the axis every radial direction is as good: take one square to it.
            let least = (0..3).fold(0, |m, a| if self.axis[a].abs() < self.axis[m].abs() { a } else { m });
            let mut e = [0.0; 3];
            e[least] = 1.0;
            return unit(cross(self.axis, e));
        }
        radial
    }

    pub(super) fn gradient(&self, p: Vec3) -> Vec3 {
        let cap =
            if dot(sub(p, self.base), self.axis) * 2.0 < self.height { scale(self.axis, -1.0) } else { self.axis };
        joined_gradient(self.sides(p), [self.radial(p), cap])
    }

    /// Barrel and cap distances bounded apart; the distance grows with both.
    pub(super) fn range(&self, b: &Aabb) -> Interval {
        let [r, h] = self.ranges(b);
        Interval::new(joined([r.lo, h.lo]), joined([r.hi, h.hi]))
    }

    /// Bounds of the distances to the barrel and to the caps.
    pub(super) fn ranges(&self, b: &Aabb) -> [Interval; 2] {
        let (r, h) = match self.aligned {
            Some((a, [lo, hi])) => {
                let middle = ((lo + hi) / 2.0).clamp(b.min[a], b.max[a]);
                let cap = |v: f64| (lo - v).max(v - hi);
                let ends = [b.min[a], b.max[a]].map(cap);
                let low = ends[0].min(ends[1]).min(cap(middle));
                (apart(b, self.base, &[(a + 1) % 3, (a + 2) % 3]), Interval::new(low, ends[0].max(ends[1])))
            }
            None => {
                let far = norm(b.size()) / 2.0;
                let r = self.sides(b.center())[0] + self.radius;
                // Rounding of a projection: a few ulps of the lengths that enter it.
                let far = far + 1e-14 * (far + norm(sub(b.center(), self.base)));
                let h = along(b, self.base, self.axis);
                let cap = |v: f64| (-v).max(v - self.height);
                let low = cap((self.height / 2.0).clamp(h.lo, h.hi)).min(cap(h.lo)).min(cap(h.hi));
                (Interval::new((r - far).max(0.0), r + far), Interval::new(low, cap(h.lo).max(cap(h.hi))))
            }
        };
        [Interval::new(r.lo - self.radius, r.hi - self.radius), h]
    }
}

impl SignedDistance for Cylinder {
    fn bounds(&self) -> Aabb {
        let top = add(self.base, scale(self.axis, self.height));
        let mut b = Aabb::EMPTY.with(self.base).with(top);
        for a in 0..3 {
            // The caps reach out by r·sin of the angle between the axis and this coordinate.
            let reach = self.radius * (1.0 - self.axis[a] * self.axis[a]).max(0.0).sqrt();
            b.min[a] -= reach;
            b.max[a] += reach;
        }
        if let Some((a, [lo, hi])) = self.aligned {
            (b.min[a], b.max[a]) = (lo, hi);
        }
        b
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        if let Some((a, [lo, hi])) = self.aligned
            && a == axis
            && lo - level < hi + level
        {
            out.extend([lo - level, hi + level]);
        }
    }

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        if by > 0.0 {
            return rounded(self, by, out);
        }
        if self.radius + by <= 0.0 {
            return CsgTree::EMPTY;
        }
        let ends = [false, true].map(|top| match self.aligned {
            Some((a, ends)) => flat((a, [ends[0] - by, ends[1] + by][usize::from(top)], top), out),
            None => {
                let normal = scale(self.axis, if top { 1.0 } else { -1.0 });
                let height = if top { self.height + by } else { -by };
                let point = add(self.base, scale(self.axis, height));
                one_surface(Arc::new(HalfSpace { point, normal }), out)
            }
        });
        let [bottom, top] = ends;
        let mut barrel = *self;
        barrel.radius += by;
        CsgTree::Intersection(vec![bottom, top, one_surface(Arc::new(Barrel(barrel)), out)])
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        let [radius, height] = [self.radius, self.height].map(|v| v * by.scale());
        let mut made = Cylinder::new(by.point(self.base), by.direction(self.axis), radius, height)?;
        // Caps that were exactly on a coordinate are exactly on its image.
        if let (Some((from, ends)), Some((to, _))) = (self.aligned, made.aligned) {
            let ends = ends.map(|at| {
                let mut p = self.base;
                p[from] = at;
                by.point(p)[to]
            });
            made.aligned = Some((to, [ends[0].min(ends[1]), ends[0].max(ends[1])]));
        }
        Ok(Arc::new(made))
    }

    fn volume(&self) -> Option<f64> {
        Some(PI * self.radius * self.radius * self.height)
    }
}

/// The endless barrel of a cylinder.
pub(super) struct Barrel(Cylinder);

impl Barrel {
    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        self.0.sides(p)[0]
    }

    pub(super) fn gradient(&self, p: Vec3) -> Vec3 {
        self.0.radial(p)
    }

    pub(super) fn range(&self, b: &Aabb) -> Interval {
        self.0.ranges(b)[0]
    }

    pub(super) fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }
}
field!(Cylinder, Barrel);
