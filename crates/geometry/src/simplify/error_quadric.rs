//! Quadrics: the sum of squared distances to planes, weighted by area.
//!
//! M. Garland and P. S. Heckbert, Surface simplification using quadric error metrics, 1997.

use crate::math::{Vec3, add, cross, dot, scale, sub};

/// In directions that the planes hardly constrain the minimum stays at the middle of the edge: this share of the mean
/// eigenvalue is added to all.
const STAY: f64 = 1e-3;

/// Σ weight · (n·x − d)², as xᵀAx + 2b·x + c.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric {
    /// A: xx, yy, zz, xy, xz, yz.
    a: [f64; 6],
    b: Vec3,
    c: f64,
    /// Sum of the weights of triangles, mm².
    pub area: f64,
}

impl Quadric {
    /// The plane of a triangle, weighted by its area.
    pub fn triangle([p, q, r]: [Vec3; 3]) -> Quadric {
        let n = cross(sub(q, p), sub(r, p));
        let twice = dot(n, n).sqrt();
        let mut made = Quadric::default();
        if twice > 0.0 {
            made = Quadric::plane(scale(n, 1.0 / twice), p, twice / 2.0);
            made.area = twice / 2.0;
        }
        made
    }

    /// The plane through `p` with the unit normal `n`.
    pub fn plane(n: Vec3, p: Vec3, weight: f64) -> Quadric {
        let d = -dot(n, p);
        let [x, y, z] = n;
        Quadric {
            a: [x * x, y * y, z * z, x * y, x * z, y * z].map(|v| weight * v),
            b: scale(n, weight * d),
            c: weight * d * d,
            area: 0.0,
        }
    }

    /// The sum of both.
    #[inline]
    pub fn plus(&self, o: &Quadric) -> Quadric {
        Quadric {
            a: core::array::from_fn(|i| self.a[i] + o.a[i]),
            b: add(self.b, o.b),
            c: self.c + o.c,
            area: self.area + o.area,
        }
    }

    #[inline]
    fn times(&self, v: Vec3) -> Vec3 {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        [xx * v[0] + xy * v[1] + xz * v[2], xy * v[0] + yy * v[1] + yz * v[2], xz * v[0] + yz * v[1] + zz * v[2]]
    }

    /// Its value at `p`; rounding may leave it a little below zero.
    #[inline]
    pub fn at(&self, p: Vec3) -> f64 {
        dot(p, add(self.times(p), scale(self.b, 2.0))) + self.c
    }

    /// (A + εI)⁻¹, with ε a small share of the mean eigenvalue.
    fn inverse(&self) -> Option<Quadric> {
        let [xx, yy, zz, xy, xz, yz] = self.a;
        let e = STAY / 3.0 * (xx + yy + zz);
        let (xx, yy, zz) = (xx + e, yy + e, zz + e);
        let minors = [
            yy * zz - yz * yz,
            xx * zz - xz * xz,
            xx * yy - xy * xy,
            xz * yz - xy * zz,
            xy * yz - xz * yy,
            xy * xz - yz * xx,
        ];
        let det = xx * minors[0] + xy * minors[3] + xz * minors[4];
        (det > 0.0).then(|| Quadric { a: minors.map(|m| m / det), ..Quadric::default() })
    }

    /// The position near `middle` where the value is least.
    pub fn least(&self, middle: Vec3) -> Vec3 {
        match self.inverse() {
            Some(i) => sub(middle, i.times(add(self.times(middle), self.b))),
            None => middle,
        }
    }

    /// The least position near `middle` on the plane g·x = s.
    ///
    /// That plane keeps the volume: P. Lindstrom and G. Turk, Fast and memory efficient polygonal simplification, 1998.
    pub fn least_on(&self, middle: Vec3, g: Vec3, s: f64) -> Vec3 {
        let Some(i) = self.inverse() else {
            return middle;
        };
        let free = sub(middle, i.times(add(self.times(middle), self.b)));
        let along = i.times(g);
        let rise = dot(g, along);
        if rise > 0.0 { add(free, scale(along, (s - dot(g, free)) / rise)) } else { free }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_planes_meet_in_a_corner() {
        let planes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]];
        let corner = [0.3, -2.0, 5.0];
        let q = planes.iter().fold(Quadric::default(), |q, n| q.plus(&Quadric::plane(*n, corner, 2.0)));
        assert!(q.at(corner).abs() < 1e-12);
        let p = [1.3, -1.0, 5.0];
        assert!((q.at(p) - 2.0 * (1.0 + 1.0 + 0.36)).abs() < 1e-12);
        // The share of STAY pulls a little towards the start.
        let least = q.least(p);
        assert!(q.at(least) < 1e-4 && dot(sub(least, corner), sub(least, corner)) < 1e-4);
        let on = q.least_on(p, [0.0, 1.0, 0.0], -1.5);
        assert!((on[1] + 1.5).abs() < 1e-12);
    }

    #[test]
    fn a_flat_patch_stays_in_its_middle() {
        let t = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]];
        let q = Quadric::triangle(t);
        assert_eq!(q.area, 2.0);
        let least = q.least([0.5, 0.25, 1.0]);
        assert!(dot(sub(least, [0.5, 0.25, 1.0]), [1.0; 3]).abs() < 1e-12);
    }
}
