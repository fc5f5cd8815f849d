//! A triangle with its normal, and its nearest point to another one.

use crate::math::{Aabb, Vec3, cross, dot, scale, sub, unit};

/// The part of a triangle that is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Its inside.
    Face,
    /// The edge from corner k to the next.
    Edge(u8),
    /// Corner k.
    Corner(u8),
}

/// A triangle with its unit normal.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners, mm.
    pub corners: [Vec3; 3],
    /// Unit normal, outward; exact along the coordinate axes.
    pub normal: Vec3,
}

/// The unit normal of a triangle, exact along the axes.
pub fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let n = cross(sub(b, a), sub(c, a));
    if n.iter().filter(|x| **x != 0.0).count() == 1 {
        return n.map(|x| if x == 0.0 { 0.0 } else { x.signum() });
    }
    // The longest component first, so that small triangles do not underflow.
    let largest = n.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    unit(n.map(|x| x / largest))
}

impl Triangle {
    /// The triangle of these corners, which has area.
    pub fn new(corners: [Vec3; 3]) -> Triangle {
        Triangle { corners, normal: normal(corners) }
    }

    /// Its bounds.
    pub fn bounds(&self) -> Aabb {
        self.corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p))
    }

    /// The nearest point of the triangle to `p`: squared distance, vector from it to `p`, feature.
    ///
    /// Over the inside the distance is that to the plane, which is exact for planes normal to an axis.
    /// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
    #[inline]
    pub fn nearest(&self, p: Vec3) -> (f64, Vec3, Feature) {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
        let (d1, d2) = (dot(ab, ap), dot(ac, ap));
        let at = |away: Vec3, f: Feature| (dot(away, away), away, f);
        if d1 <= 0.0 && d2 <= 0.0 {
            return at(ap, Feature::Corner(0));
        }
        let bp = sub(p, b);
        let (d3, d4) = (dot(ab, bp), dot(ac, bp));
        if d3 >= 0.0 && d4 <= d3 {
            return at(bp, Feature::Corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return at(sub(ap, scale(ab, d1 / (d1 - d3))), Feature::Edge(0));
        }
        let cp = sub(p, c);
        let (d5, d6) = (dot(ab, cp), dot(ac, cp));
        if d6 >= 0.0 && d5 <= d6 {
            return at(cp, Feature::Corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return at(sub(ap, scale(ac, d2 / (d2 - d6))), Feature::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return at(sub(bp, scale(sub(c, b), t)), Feature::Edge(1));
        }
        let d = dot(ap, self.normal);
        (d * d, scale(self.normal, d), Feature::Face)
    }
}
