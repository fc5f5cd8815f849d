//! Cubic Bézier curves and bicubic Bézier patches.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};

/// The control points of a cubic curve.
pub type Curve = [Vec3; 4];
/// The control points of a bicubic patch, `[i][j]` at u = i/3, v = j/3.
pub type BicubicPatch = [[Vec3; 4]; 4];

/// Nodes and weights of the Gauss rule with five points on [0, 1]: exact for polynomials of degree 9.
pub const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// The Bernstein polynomials of degree 3.
pub fn basis(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

/// Their derivatives.
pub fn slopes(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

/// The sum of points by weights.
pub fn sum(points: &[Vec3; 4], weights: [f64; 4]) -> Vec3 {
    let term = |i: usize| scale(points[i], weights[i]);
    add(add(term(0), term(1)), add(term(2), term(3)))
}

/// The curve walked the other way.
pub fn reversed(c: &Curve) -> Curve {
    [c[3], c[2], c[1], c[0]]
}

/// Position and both derivatives of a patch.
pub fn frame(p: &BicubicPatch, u: f64, v: f64) -> [Vec3; 3] {
    let (b, db) = (basis(v), slopes(v));
    let (across, along) = (p.map(|row| sum(&row, b)), p.map(|row| sum(&row, db)));
    [sum(&across, basis(u)), sum(&across, slopes(u)), sum(&along, basis(u))]
}

/// Unit normal of a patch.
pub fn normal(p: &BicubicPatch, u: f64, v: f64) -> Vec3 {
    let [_, du, dv] = frame(p, u, v);
    let n = cross(du, dv);
    scale(n, 1.0 / norm(n).max(f64::MIN_POSITIVE))
}

/// Parameters of the point at t on a side of a patch: sides in order around the corners (0, 0), (1, 0), (1, 1), (0, 1).
pub fn on_side(side: usize, t: f64) -> [f64; 2] {
    [[t, 0.0], [1.0, t], [1.0 - t, 1.0], [0.0, 1.0 - t]][side]
}

/// The curves along the four sides, in order, of the patch that interpolates them bilinearly (Coons).
pub fn coons(sides: &[Curve; 4]) -> BicubicPatch {
    let [bottom, right, top, left] = [sides[0], sides[1], reversed(&sides[2]), reversed(&sides[3])];
    let at = |i: usize, j: usize| {
        let (u, v) = (i as f64 / 3.0, j as f64 / 3.0);
        let ruled =
            add(add(scale(bottom[i], 1.0 - v), scale(top[i], v)), add(scale(left[j], 1.0 - u), scale(right[j], u)));
        let corners = add(
            add(scale(bottom[0], (1.0 - u) * (1.0 - v)), scale(bottom[3], u * (1.0 - v))),
            add(scale(top[0], (1.0 - u) * v), scale(top[3], u * v)),
        );
        sub(ruled, corners)
    };
    let mut patch: BicubicPatch = core::array::from_fn(|i| core::array::from_fn(|j| at(i, j)));
    for k in 0..4 {
        (patch[k][0], patch[k][3]) = (bottom[k], top[k]);
    }
    for k in 0..4 {
        (patch[0][k], patch[3][k]) = (left[k], right[k]);
    }
    patch
}

/// The volume (mm³) of the cone from a point over a patch: a third of the integral of (S − from) · (Su × Sv), exact.
pub fn cone_volume(p: &BicubicPatch, from: Vec3) -> f64 {
    let mut total = 0.0;
    for (u, a) in GAUSS {
        for (v, b) in GAUSS {
            let [s, du, dv] = frame(p, u, v);
            total += a * b * dot(sub(s, from), cross(du, dv));
        }
    }
    total / 3.0
}

/// The area (mm²) between a curve and the lines from a point to its ends, seen against a normal: half the integral of
/// n · ((C − from) × C′), exact.
pub fn sector_area(c: &Curve, from: Vec3, normal: Vec3) -> f64 {
    let part = |(t, w): (f64, f64)| w * dot(normal, cross(sub(sum(c, basis(t)), from), sum(c, slopes(t))));
    0.5 * GAUSS.into_iter().map(part).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_basis() {
        for t in [0.0, 0.2, 0.7, 1.0] {
            for i in 0..4 {
                let difference = (basis(t + 1e-6)[i] - basis(t - 1e-6)[i]) / 2e-6;
                assert!((difference - slopes(t)[i]).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn a_flat_patch_has_the_volume_of_a_pyramid() {
        let corners = [[0.0, 0.0, 3.0], [2.0, 0.0, 3.0], [2.0, 2.0, 3.0], [0.0, 2.0, 3.0]];
        let line = |a: Vec3, b: Vec3| core::array::from_fn(|k| add(a, scale(sub(b, a), k as f64 / 3.0)));
        let sides: [Curve; 4] = core::array::from_fn(|k| line(corners[k], corners[(k + 1) % 4]));
        let patch = coons(&sides);
        assert!((cone_volume(&patch, [0.5, 0.3, 0.0]) - 4.0).abs() < 1e-14);
        assert!(norm(sub(normal(&patch, 0.3, 0.6), [0.0, 0.0, 1.0])) < 1e-14);
        let area: f64 = sides.iter().map(|c| sector_area(c, [0.0; 3], [0.0, 0.0, 1.0])).sum();
        assert!((area - 4.0).abs() < 1e-14);
        for (k, side) in sides.iter().enumerate() {
            let [u, v] = on_side(k, 0.25);
            assert!(norm(sub(frame(&patch, u, v)[0], sum(side, basis(0.25)))) < 1e-14);
        }
    }
}
