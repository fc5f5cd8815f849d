//! A disc that contains a triangle: its distance is a lower bound of the triangle's that is quick to find, and close to it where
//! a box along the axes is not, as around triangles aslant.

use super::triangle::Triangle;
use crate::math::{Vec3, add, dot, norm, scale, sub};

/// The disc.
#[derive(Debug)]
pub(super) struct Disc {
    center: Vec3,
    normal: Vec3,
    radius: f64,
    /// Greatest distance of the triangle from the disc's plane, which rounding leaves, mm.
    thickness: f64,
}

impl Disc {
    /// The smallest disc around a triangle.
    pub fn new(of: &Triangle) -> Disc {
        let [a, b, c] = of.corners;
        // Squares of the sides opposite the corners.
        let squares = [sub(c, b), sub(a, c), sub(b, a)].map(|s| dot(s, s));
        let total: f64 = squares.iter().sum();
        let acute = squares.iter().all(|s| 2.0 * s < total);
        let longest = squares.into_iter().fold(0.0, f64::max);
        // Barycentric coordinates of the circumcentre, or of the middle of the longest side.
        let weights = squares.map(|s| if acute { s * (total - 2.0 * s) } else { f64::from(u8::from(s < longest)) });
        let sum: f64 = weights.iter().sum();
        let center = add(a, add(scale(sub(b, a), weights[1] / sum), scale(sub(c, a), weights[2] / sum)));
        let from = of.corners.map(|p| sub(p, center));
        let radius = from.iter().map(|v| norm(*v)).fold(0.0, f64::max) * (1.0 + 1e-12);
        let thickness = from.iter().map(|v| dot(*v, of.normal).abs()).fold(0.0, f64::max) * (1.0 + 1e-12);
        Disc { center, normal: of.normal, radius, thickness }
    }

    /// Squared distance of the disc's centre from `p`, mm².
    #[inline]
    pub fn square_from_center(&self, p: Vec3) -> f64 {
        let away = sub(p, self.center);
        dot(away, away)
    }

    /// Whether the triangle is certainly farther from `p` than the root of `limit` (mm²).
    #[inline]
    pub fn is_beyond(&self, p: Vec3, limit: f64) -> bool {
        let away = sub(p, self.center);
        let (square, height) = (dot(away, away), dot(away, self.normal));
        // More than rounding makes of the squares.
        let error = 1e-14 * square;
        let beside = square - height * height - error;
        let height = (height.abs() - self.thickness).max(0.0);
        let left = limit - height * height + error;
        left < 0.0 || beside > (self.radius + left.sqrt()).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    #[test]
    fn what_is_beyond_is_farther_and_plump_triangles_fill_their_discs() {
        let mut seed = 4;
        for flat in [1.0, 1e-3, 1e-9] {
            let (mut near, mut passed) = (0, 0);
            for _ in 0..10_000 {
                let mut point = || [0; 3].map(|_| random(&mut seed));
                let (a, along, aside) = (point(), point(), point());
                let [b, c] = [(1.0, 0.0), (0.4, flat)].map(|(u, v)| add(a, add(scale(along, u), scale(aside, v))));
                let triangle = Triangle::new([a, b, c]);
                let p = scale(point(), 3.0);
                let limit = 4.0 * random(&mut seed).powi(2);
                let is_near = triangle.nearest(p).0 <= limit;
                let is_beyond = Disc::new(&triangle).is_beyond(p, limit);
                assert!(!(is_near && is_beyond), "{triangle:?} {p:?} {limit}");
                near += usize::from(is_near);
                passed += usize::from(!is_beyond);
            }
            // The discs of plump triangles are near to no more than twice as many points; slivers are within theirs.
            assert!(near > 500 && (flat < 1.0 || passed < 2 * near), "{flat} {near} {passed}");
        }
    }

    #[test]
    fn the_disc_of_a_right_angle_is_about_the_middle_of_its_longest_side() {
        let disc = Disc::new(&Triangle::new([[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]));
        assert!(norm(sub(disc.center, [1.5, 2.0, 0.0])) < 1e-12 && (disc.radius - 2.5).abs() < 1e-11);
    }
}
