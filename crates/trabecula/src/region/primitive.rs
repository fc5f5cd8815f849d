//! Shared code of the exact signed distances of simple shapes.

use std::sync::Arc;

use super::{Offset, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::Block;
use crate::implicit::Surface;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, add, dot, scale, sub, unit};

/// The unit vector along `v`, exact along the coordinate axes; refuses zero.
pub(super) fn direction(at: &str, v: Vec3) -> Result<Vec3, Fault> {
    let largest = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 {
        return Err(Fault::new(at, "[0, 0, 0] has no direction: give a vector with a length"));
    }
    if v.iter().filter(|x| **x != 0.0).count() == 1 {
        return Ok(v.map(|x| if x == 0.0 { 0.0 } else { x.signum() }));
    }
    Ok(unit(v.map(|x| x / largest)))
}

/// The coordinate axis that a unit vector lies along, if any.
pub(super) fn coordinate_axis(n: Vec3) -> Option<usize> {
    (0..3).find(|&a| n[a].abs() == 1.0 && n[(a + 1) % 3] == 0.0 && n[(a + 2) % 3] == 0.0)
}

/// The range of n · (p − o) over a box; rounding keeps the order of the terms, so it holds for computed values.
pub(super) fn along(b: &Aabb, o: Vec3, n: Vec3) -> Interval {
    let end = |far: bool| [0, 1, 2].map(|a| if (n[a] > 0.0) == far { b.max[a] } else { b.min[a] });
    Interval::new(dot(sub(end(false), o), n), dot(sub(end(true), o), n))
}

/// The range over a box of the distance from `o` measured in the coordinates `axes` alone.
pub(super) fn apart(b: &Aabb, o: Vec3, axes: &[usize]) -> Interval {
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
pub(super) fn joined<const N: usize>(q: [f64; N]) -> f64 {
    let inside = q.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
    if inside <= 0.0 { inside } else { q.iter().map(|v| v.max(0.0).powi(2)).sum::<f64>().sqrt() }
}

/// The gradient of `joined`, the operands' own gradients being `g`.
pub(super) fn joined_gradient<const N: usize>(q: [f64; N], g: [Vec3; N]) -> Vec3 {
    let d = joined(q);
    if d > 0.0 {
        (0..N).fold([0.0; 3], |s, i| add(s, scale(g[i], q[i].max(0.0) / d)))
    } else {
        (1..N).fold((q[0], g[0]), |m, i| if q[i] > m.0 { (q[i], g[i]) } else { m }).1
    }
}

/// Fills a block from a function of position that is cheap and can be inlined.
#[inline(always)]
pub(super) fn fill_rows(block: &Block, out: &mut [f32], f: impl Fn(Vec3) -> f64) {
    let [xs, ys, zs] = block.axes;
    let nodes = zs.iter().flat_map(|&z| ys.iter().map(move |&y| (y, z)));
    for ((y, z), row) in nodes.zip(out.chunks_exact_mut(xs.len().max(1))) {
        for (o, &x) in row.iter_mut().zip(xs) {
            *o = f([x, y, z]) as f32;
        }
    }
}

/// A convex shape grown by `by`: its edges become round, so it has one face.
pub(super) fn rounded(of: Arc<dyn SignedDistance>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
    match Offset::new(of, by) {
        Ok(grown) => one_surface(Arc::new(grown), out),
        Err(_) => CsgTree::FULL,
    }
}

/// Implements `Field` for shapes with `distance`, `gradient` and `range`.
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
pub(super) use field;

#[cfg(test)]
mod tests {
    use super::super::{Cuboid, Cylinder, HalfSpace, Sphere};
    use super::*;
    use crate::field::Field;
    use crate::region::tests::check_shape;
    use core::f64::consts::PI;
    use geometry::random::random;
    use std::sync::Arc;

    fn shapes() -> Vec<(&'static str, Arc<dyn SignedDistance>)> {
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
        let at = |s: &dyn SignedDistance, p| s.value(p);
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
        assert_eq!(Cuboid::new([f64::NAN, 0.0, 0.0], [1.0; 3]).unwrap_err().at, "min[0]");
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
