//! Box, ball, half-space and cylinder, as exact signed distances; and the tetrahedron.

mod cylinder;
mod tetrahedron;

use core::f64::consts::PI;
use std::sync::Arc;

use super::{Offset, Shape, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::{Plane, Surface};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, add, dot, norm, scale, sub, unit};

use cylinder::Barrel;
pub use cylinder::Cylinder;
pub use tetrahedron::Tetrahedron;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    min: Vec3,
    max: Vec3,
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    center: Vec3,
    radius: f64,
}

/// Everything on one side of a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    point: Vec3,
    normal: Vec3,
}

/// Refuses numbers that are not finite, naming the first.
fn finite(at: &str, v: Vec3) -> Result<Vec3, Fault> {
    match v.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(Fault::new(at, format!("{} is not a position: give three finite numbers, mm", number(*x)))),
        None => Ok(v),
    }
}

/// Refuses a length that is not finite and positive.
fn length(at: &str, v: f64) -> Result<f64, Fault> {
    if v.is_finite() && v > 0.0 {
        Ok(v)
    } else {
        Err(Fault::new(at, format!("{} mm is not a length: give a finite number above zero", number(v))))
    }
}

/// The unit vector along `v`, exact along the coordinate axes; refuses zero and what is not finite.
fn direction(at: &str, v: Vec3) -> Result<Vec3, Fault> {
    let largest = finite(at, v)?.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Err(Fault::new(at, "[0, 0, 0] has no direction: give a vector with a length"));
    }
    if v.iter().filter(|x| **x != 0.0).count() == 1 {
        return Ok(v.map(|x| if x == 0.0 { 0.0 } else { x.signum() }));
    }
    Ok(unit(v.map(|x| x / largest)))
}

/// The coordinate axis that a unit vector lies along, if any.
fn coordinate_axis(n: Vec3) -> Option<usize> {
    (0..3).find(|&a| n[a].abs() == 1.0 && n[(a + 1) % 3] == 0.0 && n[(a + 2) % 3] == 0.0)
}

/// The range of n · (p − o) over a box; rounding keeps the order of the terms, so it holds for computed values.
fn along(b: &Aabb, o: Vec3, n: Vec3) -> Interval {
    let end = |far: bool| [0, 1, 2].map(|a| if (n[a] > 0.0) == far { b.max[a] } else { b.min[a] });
    Interval::new(dot(sub(end(false), o), n), dot(sub(end(true), o), n))
}

/// The range over a box of the distance from `o` measured in the coordinates `axes` alone.
fn apart(b: &Aabb, o: Vec3, axes: &[usize]) -> Interval {
    let (mut lo, mut hi) = (0.0, 0.0);
    for &a in axes {
        let near = (b.min[a] - o[a]).max(o[a] - b.max[a]).max(0.0);
        let far = (o[a] - b.min[a]).abs().max((b.max[a] - o[a]).abs());
        lo += near * near;
        hi += far * far;
    }
    Interval::new(f64::sqrt(lo), f64::sqrt(hi))
}

/// Distance to a product of convex sets of signed distances `q`: the largest inside, Euclidean outside.
#[inline]
fn joined<const N: usize>(q: [f64; N]) -> f64 {
    let inside = q.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
    if inside <= 0.0 { inside } else { q.iter().map(|v| v.max(0.0).powi(2)).sum::<f64>().sqrt() }
}

/// The gradient of `joined`, the pieces' own gradients being `g`.
fn joined_gradient<const N: usize>(q: [f64; N], g: [Vec3; N]) -> Vec3 {
    let d = joined(q);
    if d > 0.0 {
        (0..N).fold([0.0; 3], |s, i| add(s, scale(g[i], q[i].max(0.0) / d)))
    } else {
        (1..N).fold((q[0], g[0]), |m, i| if q[i] > m.0 { (q[i], g[i]) } else { m }).1
    }
}

/// Fills a block from a function of position that is cheap and can be inlined.
#[inline(always)]
fn fill_rows(block: &Block, out: &mut [f32], f: impl Fn(Vec3) -> f64) {
    let [xs, ys, zs] = block.axes;
    let nodes = zs.iter().flat_map(|&z| ys.iter().map(move |&y| (y, z)));
    for ((y, z), row) in nodes.zip(out.chunks_exact_mut(xs.len().max(1))) {
        for (o, &x) in row.iter_mut().zip(xs) {
            *o = f([x, y, z]) as f32;
        }
    }
}

impl Cuboid {
    /// The box between two corners (mm). Errors if a coordinate is not finite or a side has no length.
    pub fn new(min: Vec3, max: Vec3) -> Result<Self, Fault> {
        finite("min", min)?;
        finite("max", max)?;
        for (a, name) in ["x", "y", "z"].iter().enumerate() {
            if min[a] >= max[a] {
                let found = format!("{name} runs from {} to {} mm", number(min[a]), number(max[a]));
                return Err(Fault::new("max", format!("{found}: each side of a box must have a length above zero")));
            }
        }
        Ok(Cuboid { min, max })
    }

    fn sides(&self, p: Vec3) -> Vec3 {
        [0, 1, 2].map(|a| (self.min[a] - p[a]).max(p[a] - self.max[a]))
    }

    #[inline]
    fn distance(&self, p: Vec3) -> f64 {
        joined(self.sides(p))
    }

    fn gradient(&self, p: Vec3) -> Vec3 {
        let mut g = [[0.0; 3]; 3];
        for a in 0..3 {
            g[a][a] = if self.min[a] - p[a] > p[a] - self.max[a] { -1.0 } else { 1.0 };
        }
        joined_gradient(self.sides(p), g)
    }

    /// The side distances are convex and independent, and the distance grows with each: exact.
    fn range(&self, b: &Aabb) -> Interval {
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

impl Shape for Cuboid {
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

    fn volume(&self) -> Option<f64> {
        let [x, y, z] = self.bounds().size();
        Some(x * y * z)
    }
}

impl Sphere {
    /// The ball about a point (mm). Errors if a number is not finite or the radius not above zero.
    pub fn new(center: Vec3, radius: f64) -> Result<Self, Fault> {
        Ok(Sphere { center: finite("center", center)?, radius: length("radius", radius)? })
    }

    #[inline]
    fn distance(&self, p: Vec3) -> f64 {
        norm(sub(p, self.center)) - self.radius
    }

    fn gradient(&self, p: Vec3) -> Vec3 {
        let g = unit(sub(p, self.center));
        if g == [0.0; 3] { [1.0, 0.0, 0.0] } else { g }
    }

    fn range(&self, b: &Aabb) -> Interval {
        let r = apart(b, self.center, &[0, 1, 2]);
        Interval::new(r.lo - self.radius, r.hi - self.radius)
    }
}

impl Shape for Sphere {
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

    fn volume(&self) -> Option<f64> {
        Some(4.0 / 3.0 * PI * self.radius.powi(3))
    }
}

impl HalfSpace {
    /// The side of the plane through `point` (mm) that `normal` (any length) points away from. Errors if a
    /// number is not finite or the normal is zero.
    pub fn new(point: Vec3, normal: Vec3) -> Result<Self, Fault> {
        Ok(HalfSpace { point: finite("point", point)?, normal: direction("normal", normal)? })
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
    fn distance(&self, p: Vec3) -> f64 {
        dot(sub(p, self.point), self.normal)
    }

    fn gradient(&self, _: Vec3) -> Vec3 {
        self.normal
    }

    fn range(&self, b: &Aabb) -> Interval {
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

/// The solid below (or above) a coordinate of an axis.
fn flat((axis, at, below): (usize, f64, bool), out: &mut Vec<Surface>) -> CsgTree {
    let (mut point, mut normal) = ([0.0; 3], [0.0; 3]);
    (point[axis], normal[axis]) = (at, if below { 1.0 } else { -1.0 });
    let mut face = Surface::distance(Arc::new(HalfSpace { point, normal }));
    face.plane = Some(Plane { axis, at, below });
    out.push(face);
    CsgTree::Leaf(out.len() - 1)
}

/// A convex shape grown by `by`: its edges become round, so it has one face.
fn rounded(of: Arc<dyn Shape>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
    match Offset::new(of, by) {
        Ok(grown) => one_surface(Arc::new(grown), out),
        Err(_) => CsgTree::FULL,
    }
}

macro_rules! field {
    ($($shape:ty),*) => {$(
        impl Field for $shape {
            fn values(&self, points: &[Vec3], out: &mut [f64]) {
                for (o, p) in out.iter_mut().zip(points) {
                    *o = self.distance(*p);
                }
            }

            fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
                self.values(points, values);
                for (g, p) in gradients.iter_mut().zip(points) {
                    *g = self.gradient(*p);
                }
            }

            fn bound(&self, b: &Aabb) -> Interval {
                if !b.is_finite() {
                    return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
                }
                self.range(b)
            }

            fn fill(&self, block: &Block, out: &mut [f32]) {
                self.fill_level(block, 0.0, out);
            }
        }
    )*};
}
field!(Cuboid, Cylinder, Sphere, HalfSpace, Barrel, Tetrahedron);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::region::tests::check_shape;
    use geometry::random::random;
    use std::sync::Arc;

    fn shapes() -> Vec<(&'static str, Arc<dyn Shape>)> {
        vec![
            ("box", Arc::new(Cuboid::new([-1.0, -2.0, 0.1], [1.3, 0.7, 2.0]).unwrap())),
            ("z cylinder", Arc::new(Cylinder::new([0.1, 0.2, -0.3], [0.0, 0.0, 3.0], 0.8, 1.7).unwrap())),
            ("-x cylinder", Arc::new(Cylinder::new([0.1, 0.2, -0.3], [-1.0, 0.0, 0.0], 0.8, 1.7).unwrap())),
            ("cylinder", Arc::new(Cylinder::new([0.1, 0.2, -0.3], [1.0, 2.0, -1.5], 0.8, 1.7).unwrap())),
            ("ball", Arc::new(Sphere::new([0.1, 0.2, -0.3], 1.1).unwrap())),
            ("half-space", Arc::new(HalfSpace::new([0.1, 0.2, -0.3], [1.0, 2.0, -1.5]).unwrap())),
            ("y half-space", Arc::new(HalfSpace::new([0.1, 0.2, -0.3], [0.0, -7.0, 0.0]).unwrap())),
        ]
    }

    #[test]
    fn every_primitive_keeps_the_laws_of_a_shape() {
        for (name, s) in shapes() {
            check_shape(name, s.as_ref(), 3.0, 1.0);
        }
    }

    #[test]
    fn distances_at_known_points() {
        let at = |s: &dyn Shape, p| s.value(p);
        let b = Cuboid::new([0.0; 3], [2.0, 4.0, 6.0]).unwrap();
        assert_eq!(at(&b, [1.0, 2.0, 3.0]), -1.0);
        assert_eq!(at(&b, [5.0, 8.0, 3.0]), 5.0);
        let c = Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 2.0, 10.0).unwrap();
        assert_eq!(at(&c, [0.0, 0.0, 5.0]), -2.0);
        assert_eq!(at(&c, [3.0, 4.0, 14.0]), 5.0);
        assert_eq!(at(&Sphere::new([1.0, 0.0, 0.0], 2.0).unwrap(), [4.0, 4.0, 0.0]), 3.0);
        assert_eq!(at(&HalfSpace::new([0.0, 0.0, 1.0], [0.0, 0.0, 9.0]).unwrap(), [7.0, 8.0, 3.0]), 2.0);
        assert_eq!(b.volume(), Some(48.0));
        assert_eq!(c.volume(), Some(40.0 * PI));
    }

    #[test]
    fn faces_are_exactly_zero_at_any_coordinate() {
        let mut seed = 7;
        for _ in 0..2000 {
            let r = |seed: &mut u64| [0; 3].map(|_| random(seed) * 3.0);
            let (a, b) = (r(&mut seed), r(&mut seed));
            let lo = [0, 1, 2].map(|i| a[i].min(b[i]));
            let hi = [0, 1, 2].map(|i| a[i].max(b[i]));
            let s = Cuboid::new(lo, hi).unwrap();
            let c = Cylinder::new(a, [0.0, -1.0, 0.0], 0.7, 0.1 + b[0].abs()).unwrap();
            for axis in 0..3 {
                let mut planes = Vec::new();
                s.planes(axis, &mut planes);
                for v in planes {
                    let mut p = s.bounds().center();
                    p[axis] = v;
                    assert_eq!(s.value(p), 0.0);
                }
            }
            let mut planes = Vec::new();
            c.planes(1, &mut planes);
            assert_eq!(planes.len(), 2);
            for v in planes {
                assert_eq!(c.value([a[0] + 0.3, v, a[2] - 0.4]), 0.0);
            }
        }
    }

    #[test]
    fn bad_numbers_are_refused_where_they_stand() {
        assert_eq!(Cuboid::new([0.0; 3], [1.0, 0.0, 1.0]).unwrap_err().at, "max");
        assert_eq!(Cuboid::new([f64::NAN, 0.0, 0.0], [1.0; 3]).unwrap_err().at, "min");
        assert_eq!(Sphere::new([0.0; 3], -1.0).unwrap_err().at, "radius");
        assert_eq!(Sphere::new([0.0; 3], f64::INFINITY).unwrap_err().at, "radius");
        assert_eq!(Cylinder::new([0.0; 3], [0.0; 3], 1.0, 1.0).unwrap_err().at, "axis");
        assert_eq!(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 1.0, 0.0).unwrap_err().at, "height");
        assert_eq!(HalfSpace::new([0.0; 3], [0.0; 3]).unwrap_err().at, "normal");
    }

    #[test]
    fn a_direction_of_any_length_is_taken() {
        for s in [1e-200, 1.0, 1e200] {
            let h = HalfSpace::new([0.0; 3], [s, s, 0.0]).unwrap();
            assert!((h.value([1.0, 1.0, 5.0]) - 2f64.sqrt()).abs() < 1e-15);
        }
    }
}
