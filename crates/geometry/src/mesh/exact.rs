//! Orientation of points, right for every f64 input whose products neither overflow nor underflow (crate `robust`).
//!
//! J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997.

use robust::{Coord, Coord3D};

use crate::math::Vec3;

/// The sign of a number; 0 for NaN, which coordinates near the limits of f64 give.
fn sign(v: f64) -> i8 {
    i8::from(v > 0.0) - i8::from(v < 0.0)
}

/// The side of the plane through a, b, c on which d lies: 1 where a, b, c run clockwise seen from d (det[a−d, b−d,
/// c−d] > 0), 0 on the plane.
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i8 {
    let [a, b, c, d] = [a, b, c, d].map(|[x, y, z]| Coord3D { x, y, z });
    sign(robust::orient3d(a, b, c, d))
}

/// The turn a → b → c in the plane: 1 left, −1 right, 0 straight.
pub fn orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i8 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    sign(robust::orient2d(a, b, c))
}

/// The point without its coordinate `axis`.
pub fn drop_axis(p: Vec3, axis: usize) -> [f64; 2] {
    [p[(axis + 1) % 3], p[(axis + 2) % 3]]
}

/// An axis along which the triangle projects to one with area; `None` where it has none.
pub fn plane_axis(a: Vec3, b: Vec3, c: Vec3) -> Option<usize> {
    (0..3).find(|&k| orient2d(drop_axis(a, k), drop_axis(b, k), drop_axis(c, k)) != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_of_plain_cases() {
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(orient3d(o, x, y, z), -1);
        assert_eq!(orient3d(o, y, x, z), 1);
        assert_eq!(orient3d(o, x, y, [0.3, 0.4, 0.0]), 0);
        assert_eq!(orient2d([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]), 1);
        assert_eq!(plane_axis(o, x, y), Some(2));
        assert_eq!(plane_axis(o, [0.1; 3], [0.7; 3].map(|v: f64| v / 7.0)), None);
    }

    #[test]
    fn the_last_bit_decides() {
        // Points on the diagonal of a grid of neighbouring floats about 0.5 (Kettner et al.'s classroom example).
        for i in 0..64i32 {
            for j in 0..64i32 {
                let u = f64::EPSILON / 2.0;
                let p = [0.5 + f64::from(i) * u, 0.5 + f64::from(j) * u];
                let want = (j - i).signum() as i8;
                assert_eq!(orient2d([12.0, 12.0], [24.0, 24.0], p), want, "{i} {j}");
                let lift = |p: [f64; 2]| [p[0], p[1], 0.0];
                let side = orient3d([12.0, 12.0, 0.0], [24.0, 24.0, 0.0], lift(p), [7.0, 7.0, 1e-300]);
                assert_eq!(side, -orient3d([24.0, 24.0, 0.0], [12.0, 12.0, 0.0], lift(p), [7.0, 7.0, 1e-300]));
                assert_eq!(orient3d([12.0, 12.0, 1.0], [24.0, 24.0, 3.0], lift(p), [12.0, 12.0, -5.0]), want);
            }
        }
    }

    #[test]
    fn exact_tests_are_antisymmetric_and_agree_with_integers() {
        let mut s = 1u64;
        let mut next = || {
            s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (s >> 60) as i128 - 8
        };
        for _ in 0..20_000 {
            let p: [[i128; 3]; 4] = [0; 4].map(|_| [0; 3].map(|_| next()));
            let d = [0, 1, 2].map(|i| [0, 1, 2].map(|k| p[i][k] - p[3][k]));
            let det = d[0][2] * (d[1][0] * d[2][1] - d[2][0] * d[1][1])
                + d[1][2] * (d[2][0] * d[0][1] - d[0][0] * d[2][1])
                + d[2][2] * (d[0][0] * d[1][1] - d[1][0] * d[0][1]);
            // A shift far from the origin keeps the numbers exact and makes the filter fail often.
            let f = p.map(|v| v.map(|c| c as f64 * 2f64.powi(-20) + 3.0));
            assert_eq!(orient3d(f[0], f[1], f[2], f[3]), det.signum() as i8);
        }
    }
}
