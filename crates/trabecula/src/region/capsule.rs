//! A capsule, as an exact signed distance.

use core::f64::consts::PI;
use std::sync::Arc;

use super::primitive::{field, fill_rows};
use super::{BuildRegion, Context, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::{Key, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, cross, dot, norm, scale, sub, unit};
use geometry::similarity::Similarity;

/// A capsule: all points within a distance of a straight segment.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(noun = "a capsule", check = Capsule::long)]
pub struct Capsule {
    /// One end of the segment, the centre of a hemisphere.
    #[kind(unit = "mm", hints("from", "base"))]
    start: Vec3,
    /// The other end of the segment.
    #[kind(unit = "mm", hints("to"))]
    end: Vec3,
    /// Radius.
    #[kind(unit = "mm", above = 0.0)]
    radius: f64,
}

impl BuildRegion for Capsule {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        self.valid()?;
        Ok(Arc::new(*self))
    }
}

impl Capsule {
    fn long(&self, _: &Key) -> Result<(), Fault> {
        match self.start == self.end {
            true => Err(Fault::new("end", "start and end coincide; move one of them, or use a sphere")),
            false => Ok(()),
        }
    }

    /// From the nearest point of the segment to `p`.
    #[inline]
    fn offset(&self, p: Vec3) -> Vec3 {
        let (d, axis) = (sub(p, self.start), sub(self.end, self.start));
        let t = (dot(d, axis) / dot(axis, axis)).clamp(0.0, 1.0);
        sub(d, scale(axis, t))
    }

    #[inline]
    fn distance(&self, p: Vec3) -> f64 {
        norm(self.offset(p)) - self.radius
    }

    fn gradient(&self, p: Vec3) -> Vec3 {
        let direction = unit(self.offset(p));
        if direction != [0.0; 3] {
            return direction;
        }
        // On the segment every direction normal to it is a subgradient.
        let axis = sub(self.end, self.start);
        let least = (0..3).fold(0, |m, a| if axis[a].abs() < axis[m].abs() { a } else { m });
        let mut e = [0.0; 3];
        e[least] = 1.0;
        unit(cross(axis, e))
    }

    /// The distance to the segment changes by no more than the distance between two points; widened by rounding.
    fn range(&self, b: &Aabb) -> Interval {
        let d = norm(self.offset(b.center()));
        let reach = norm(b.size()) / 2.0;
        let reach = reach + 1e-14 * (reach + norm(sub(b.center(), self.start)) + norm(sub(self.end, self.start)));
        Interval::new((d - reach).max(0.0) - self.radius, d + reach - self.radius)
    }
}

impl SignedDistance for Capsule {
    fn bounds(&self) -> Aabb {
        Aabb::EMPTY.with(self.start).with(self.end).grown(self.radius)
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        let radius = self.radius + by;
        if radius <= 0.0 {
            return CsgTree::EMPTY;
        }
        one_surface(Arc::new(Capsule { radius, ..*self }), out)
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        let (start, end) = (by.point(self.start), by.point(self.end));
        let made = Capsule { start, end, radius: self.radius * by.scale() };
        made.valid()?;
        Ok(Arc::new(made))
    }

    fn volume(&self) -> Option<f64> {
        let length = norm(sub(self.end, self.start));
        Some(PI * self.radius.powi(2) * (length + 4.0 / 3.0 * self.radius))
    }
}
field!(Capsule);

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::region::tests::check_shape;

    #[test]
    fn a_capsule_keeps_the_laws_of_a_shape_and_known_values() {
        let oblique = Capsule { start: [-0.6, -0.3, -0.5], end: [0.5, 0.4, 0.7], radius: 0.8 };
        check_shape("capsule", &oblique, 3.0, 1.0);
        let upright = Capsule { start: [0.0; 3], end: [0.0, 0.0, 5.0], radius: 2.0 };
        let at = [[3.0, 4.0, 2.0], [3.0, 0.0, 9.0], [0.0, 0.0, 1.0], [0.0, 0.0, -3.0]];
        assert_eq!(at.map(|p| upright.value(p)), [3.0, 3.0, -2.0, 1.0]);
        assert_eq!(upright.gradient([0.0, 0.0, 1.0])[2], 0.0);
        assert_eq!(upright.volume(), Some(PI * 4.0 * (5.0 + 8.0 / 3.0)));
    }

    #[test]
    fn a_capsule_without_length_or_radius_is_refused() {
        let at = |start, end, radius| Capsule { start, end, radius }.valid().unwrap_err().at;
        assert_eq!(at([1.0; 3], [1.0; 3], 1.0), "end");
        assert_eq!(at([0.0; 3], [1.0; 3], 0.0), "radius");
        assert_eq!(at([0.0, f64::NAN, 0.0], [1.0; 3], 1.0), "start[1]");
    }
}
