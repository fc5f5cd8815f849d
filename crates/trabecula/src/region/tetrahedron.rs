//! A tetrahedron: four half-spaces, joined sharply or by a smooth maximum.

use std::sync::Arc;

use super::primitive::{along, field, rounded};
use super::{BuildRegion, Context, HalfSpace, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, cross, dot, norm, scale, sub};
use geometry::similarity::Similarity;
use geometry::tetmesh::FACES;

/// A height of less than this share of the longest edge is none.
const FLAT: f64 = 1e-6;

/// A tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "Tetrahedron")]
pub struct TetrahedronKind {
    /// Its four corners, in any order.
    #[kind(unit = "mm")]
    corners: [Vec3; 4],
    /// With it faces are joined by a smooth maximum (LogSumExp) of this sharpness, which draws edges back by ln 2 over it and
    /// corners by ln 3: smooth, but with gaps between neighbours, so for a single tetrahedron only.
    #[kind(unit = "per mm", above = 0.0)]
    sharpness: Option<f64>,
}

impl BuildRegion for TetrahedronKind {
    fn build(&self, _: &mut Context) -> Result<Region, Fault> {
        Ok(Arc::new(Tetrahedron::new(self.corners, self.sharpness)?))
    }
}

/// A tetrahedron.
///
/// Its function is the greatest of the distances d_i to its planes: exact inside, and outside a lower bound of the distance.
/// With a sharpness k (per mm) it is ln(Σ exp(k d_i))/k instead, which is smooth and never less: edges draw back by ln 2/k,
/// corners by ln 3/k, measured along each of their planes' normals, and faces by less than that. So such tetrahedra side by
/// side leave gaps between them: for a single one, never for a tiling.
///
/// Source of the second form: Chen, Kabaria, Nelaturi, Lew, Piecewise hierarchical implicit surface structures constructed
/// using tetrahedron-based unit cells, equation 9, here of planes with unit normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tetrahedron {
    corners: [Vec3; 4],
    planes: [HalfSpace; 4],
    sharpness: Option<f64>,
}

impl Tetrahedron {
    /// The tetrahedron of four corners (mm) in any order.
    ///
    /// # Errors
    /// A coordinate that is not finite; corners in one plane; a sharpness that is not above zero, or at which nothing is left.
    pub fn new(corners: [Vec3; 4], sharpness: Option<f64>) -> Result<Self, Fault> {
        TetrahedronKind { corners, sharpness }.valid()?;
        let [a, b, c, d] = corners;
        let six = dot(cross(sub(b, a), sub(c, a)), sub(d, a));
        let corners = if six < 0.0 { [a, c, b, d] } else { corners };
        let faces = FACES.map(|f| f.map(|i| corners[i]));
        let normals = faces.map(|[a, b, c]| cross(sub(b, a), sub(c, a)));
        let longest = faces.iter().flatten().map(|p| norm(sub(*p, corners[0]))).fold(0.0, f64::max);
        // Six volumes over twice a face is the height upon it.
        let flat = |n: &Vec3| six.abs() <= FLAT * longest * norm(*n);
        if longest == 0.0 || normals.iter().any(|n| norm(*n) == 0.0 || flat(n)) {
            let message = "the four corners lie in one plane: a tetrahedron needs a volume";
            return Err(Fault::new("corners", message));
        }
        let plane = |i: usize| HalfSpace::new(faces[i][0], normals[i]);
        let planes = [plane(0)?, plane(1)?, plane(2)?, plane(3)?];
        if let Some(k) = sharpness {
            // At the middle of the inscribed ball all distances are −r, and ln(4 exp(−k r)) must be negative.
            let inner = six.abs() / normals.iter().map(|n| norm(*n)).sum::<f64>();
            let least = 4f64.ln() / inner;
            if k <= least {
                let message = format!(
                    "{} is no sharpness (per mm) for this tetrahedron: its inscribed ball has a radius of {} mm, so nothing is left \
                     of it at {} or less; give a finite number well above",
                    number(k),
                    number(inner),
                    number(least)
                );
                return Err(Fault::new("sharpness", message));
            }
        }
        Ok(Tetrahedron { corners, planes, sharpness })
    }

    /// The distances joined.
    #[inline]
    fn joined(&self, d: [f64; 4]) -> f64 {
        let most = d.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
        match self.sharpness {
            // Less the greatest, so that nothing overflows.
            Some(k) => most + d.iter().map(|v| (k * (v - most)).exp()).sum::<f64>().ln() / k,
            None => most,
        }
    }

    #[inline]
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        self.joined(self.planes.map(|h| h.distance(p)))
    }

    pub(super) fn gradient(&self, p: Vec3) -> Vec3 {
        let d = self.planes.map(|h| h.distance(p));
        let first = (0..4).fold(0, |m, i| if d[i] > d[m] { i } else { m });
        let Some(k) = self.sharpness else {
            return self.planes[first].normal;
        };
        let w = d.map(|v| (k * (v - d[first])).exp());
        let sum: f64 = w.iter().sum();
        (0..4).fold([0.0; 3], |g, i| add(g, scale(self.planes[i].normal, w[i] / sum)))
    }

    /// The joined function grows with each distance.
    pub(super) fn range(&self, b: &Aabb) -> Interval {
        let each = self.planes.map(|h| along(b, h.point, h.normal));
        Interval::new(self.joined(each.map(|i| i.lo)), self.joined(each.map(|i| i.hi)))
    }
}

impl SignedDistance for Tetrahedron {
    fn bounds(&self) -> Aabb {
        self.corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p))
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        if self.sharpness.is_none() {
            for plane in self.planes {
                plane.level_planes(axis, level, out);
            }
        }
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        if self.sharpness.is_none() {
            return CsgTree::Intersection(self.planes.map(|h| Arc::new(h).surfaces(by, out)).to_vec());
        }
        if by == 0.0 { one_surface(self, out) } else { rounded(self, by, out) }
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        let sharpness = self.sharpness.map(|k| k / by.scale());
        Ok(Arc::new(Tetrahedron::new(self.corners.map(|p| by.point(p)), sharpness)?))
    }

    fn half_spaces(&self) -> Option<Vec<HalfSpace>> {
        self.sharpness.is_none().then(|| self.planes.to_vec())
    }

    fn volume(&self) -> Option<f64> {
        let [a, b, c, d] = self.corners;
        let volume = dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0;
        self.sharpness.is_none().then_some(volume)
    }
}

field!(Tetrahedron);

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::region::tests::check_shape;

    const CORNERS: [Vec3; 4] = [[-1.0, -0.8, -1.0], [1.2, -0.9, -1.0], [0.1, 1.4, -1.0], [0.2, 0.1, 1.5]];

    #[test]
    fn both_forms_keep_the_laws_of_a_shape() {
        let sharp = Tetrahedron::new(CORNERS, None).unwrap();
        check_shape("tetrahedron", &sharp, 2.0, 0.0);
        let soft = Tetrahedron::new(CORNERS, Some(8.0)).unwrap();
        check_shape("soft tetrahedron", &soft, 2.0, 0.0);
        // Any order of corners is the same solid.
        let [a, b, c, d] = CORNERS;
        let turned = Tetrahedron::new([b, a, c, d], None).unwrap();
        assert!((sharp.value([0.1, 0.2, 0.3]) - turned.value([0.1, 0.2, 0.3])).abs() < 1e-15);
        // A product of three differences, rounded otherwise.
        let [v, w] = [&sharp, &turned].map(|t| t.volume().unwrap());
        assert!((v - w).abs() < 1e-14 * v);
    }

    #[test]
    fn a_smooth_maximum_draws_back_from_edges_and_corners() {
        // A regular one: the other planes are so far off that they count for nothing at this sharpness.
        let regular = [[1.0; 3], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let k = 60.0;
        let soft = Tetrahedron::new(regular, Some(k)).unwrap();
        let edge: Vec3 = [1.0, 0.0, 0.0];
        assert!((soft.value(edge) - 2f64.ln() / k).abs() < 1e-12);
        assert!((soft.value([1.0; 3]) - 3f64.ln() / k).abs() < 1e-12);
        // The middle of a face is a third of the height, √(2/3) of the edge, from the other three.
        let face = scale(add(add(regular[1], regular[2]), regular[3]), 1.0 / 3.0);
        let k = 4.0;
        let softer = Tetrahedron::new(regular, Some(k)).unwrap();
        let far = 8f64.sqrt() * (2f64 / 3.0).sqrt() / 3.0;
        let back = (3.0 * (-k * far).exp()).ln_1p() / k;
        assert!((softer.value(face) - back).abs() < 1e-12);
        // Far outside nothing overflows.
        assert!(soft.value([1e6; 3]).is_finite());
    }

    #[test]
    fn what_is_none_is_refused() {
        let mut flat = CORNERS;
        flat[3][2] = -1.0;
        assert_eq!(Tetrahedron::new(flat, None).unwrap_err().at, "corners");
        for k in [0.0, -1.0, f64::NAN, 1.0] {
            assert_eq!(Tetrahedron::new(CORNERS, Some(k)).unwrap_err().at, "sharpness");
        }
    }
}
