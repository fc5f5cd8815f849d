//! Orientation tests that are right for every f64 input: a floating-point filter, then exact expansions.
//!
//! J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, 1997.

use core::cmp::Ordering;

use crate::math::Vec3;

/// Half a unit in the last place of 1.
const EPS: f64 = f64::EPSILON / 2.0;

/// The sign of a number.
fn sign(v: f64) -> i8 {
    match v.partial_cmp(&0.0) {
        Some(Ordering::Greater) => 1,
        Some(Ordering::Less) => -1,
        _ => 0,
    }
}

/// The side of the plane through a, b, c on which d lies: 1 where a, b, c run clockwise seen from d (det[a−d, b−d,
/// c−d] > 0), 0 on the plane.
pub fn orient3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i8 {
    let [p, q, r] = [a, b, c].map(|v| [v[0] - d[0], v[1] - d[1], v[2] - d[2]]);
    let (qr, rq) = (q[0] * r[1], r[0] * q[1]);
    let (rp, pr) = (r[0] * p[1], p[0] * r[1]);
    let (pq, qp) = (p[0] * q[1], q[0] * p[1]);
    let det = p[2] * (qr - rq) + q[2] * (rp - pr) + r[2] * (pq - qp);
    let size =
        (qr.abs() + rq.abs()) * p[2].abs() + (rp.abs() + pr.abs()) * q[2].abs() + (pq.abs() + qp.abs()) * r[2].abs();
    if det.abs() > (7.0 + 56.0 * EPS) * EPS * size {
        return sign(det);
    }
    exact3d(a, b, c, d)
}

#[cold]
fn exact3d(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i8 {
    let [p, q, r] = [a, b, c].map(|v| [0, 1, 2].map(|k| Expansion::difference(v[k], d[k])));
    let minor = |u: &[Expansion; 3], v: &[Expansion; 3]| u[0].times(&v[1]).minus(&v[0].times(&u[1]));
    p[2].times(&minor(&q, &r)).plus(&q[2].times(&minor(&r, &p))).plus(&r[2].times(&minor(&p, &q))).sign()
}

/// The turn a → b → c in the plane: 1 left, −1 right, 0 straight.
pub fn orient2d(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i8 {
    let left = (a[0] - c[0]) * (b[1] - c[1]);
    let right = (a[1] - c[1]) * (b[0] - c[0]);
    let det = left - right;
    if det.abs() > (3.0 + 16.0 * EPS) * EPS * (left.abs() + right.abs()) {
        return sign(det);
    }
    let [p, q] = [a, b].map(|v| [0, 1].map(|k| Expansion::difference(v[k], c[k])));
    p[0].times(&q[1]).minus(&p[1].times(&q[0])).sign()
}

/// The point without its coordinate `axis`.
pub fn drop_axis(p: Vec3, axis: usize) -> [f64; 2] {
    [p[(axis + 1) % 3], p[(axis + 2) % 3]]
}

/// An axis along which the triangle projects to one with area; `None` where it has none.
pub fn plane_axis(a: Vec3, b: Vec3, c: Vec3) -> Option<usize> {
    (0..3).find(|&k| orient2d(drop_axis(a, k), drop_axis(b, k), drop_axis(c, k)) != 0)
}

/// An exact number: a sum of f64 that do not overlap, in growing order, without zeros.
#[derive(Clone, Debug, Default)]
struct Expansion(Vec<f64>);

impl Expansion {
    fn difference(a: f64, b: f64) -> Expansion {
        let mut e = Expansion(Vec::with_capacity(2));
        e.grow(a);
        e.grow(-b);
        e
    }

    /// Adds one number exactly (Shewchuk's grow-expansion with zeros left out).
    fn grow(&mut self, b: f64) {
        let mut sum = b;
        let mut kept = 0;
        for i in 0..self.0.len() {
            let (high, low) = two_sum(sum, self.0[i]);
            sum = high;
            if low != 0.0 {
                self.0[kept] = low;
                kept += 1;
            }
        }
        self.0.truncate(kept);
        if sum != 0.0 {
            self.0.push(sum);
        }
    }

    fn plus(mut self, o: &Expansion) -> Expansion {
        o.0.iter().for_each(|v| self.grow(*v));
        self
    }

    fn minus(mut self, o: &Expansion) -> Expansion {
        o.0.iter().for_each(|v| self.grow(-*v));
        self
    }

    fn times(&self, o: &Expansion) -> Expansion {
        let mut e = Expansion(Vec::with_capacity(2 * self.0.len() * o.0.len()));
        for a in &self.0 {
            for b in &o.0 {
                let high = a * b;
                e.grow(a.mul_add(*b, -high));
                e.grow(high);
            }
        }
        e
    }

    fn sign(&self) -> i8 {
        self.0.last().map_or(0, |v| sign(*v))
    }
}

/// a + b as a rounded sum and its error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let from_b = sum - a;
    (sum, (a - (sum - from_b)) + (b - from_b))
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
                let u = EPS;
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
            assert_eq!(exact3d(f[0], f[1], f[2], f[3]), det.signum() as i8);
        }
    }
}
