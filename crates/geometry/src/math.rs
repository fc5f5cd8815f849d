//! Three-vectors and 3×3 matrices on plain arrays, boxes and intervals.

use serde::Serialize;

use crate::dense::diagonalise;

/// A point or vector in space (mm) or phase (turns).
pub type Vec3 = [f64; 3];
/// A 3×3 matrix, row by row.
pub type Mat3 = [[f64; 3]; 3];

/// The identity matrix.
pub const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// a + b.
#[inline]
pub fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline]
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// s · a.
#[inline]
pub fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// a · b.
#[inline]
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
#[inline]
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// |a|.
#[inline]
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// a / |a|; a zero vector stays zero.
#[inline]
pub fn unit(a: Vec3) -> Vec3 {
    let n = norm(a);
    if n > 0.0 { scale(a, 1.0 / n) } else { a }
}

/// A unit vector across a unit vector: the axis farthest from it, less what lies along it.
pub fn across(n: Vec3) -> Vec3 {
    let k = (0..3).fold(0, |k, a| if n[a].abs() < n[k].abs() { a } else { k });
    let mut e = [0.0; 3];
    e[k] = 1.0;
    unit(sub(e, scale(n, dot(e, n))))
}

/// M x.
#[inline]
pub fn apply(m: &Mat3, x: Vec3) -> Vec3 {
    [dot(m[0], x), dot(m[1], x), dot(m[2], x)]
}

/// Mᵀ.
pub fn transpose(m: &Mat3) -> Mat3 {
    let mut t = *m;
    for i in 0..3 {
        for j in 0..3 {
            t[i][j] = m[j][i];
        }
    }
    t
}

/// A B.
pub fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    let bt = transpose(b);
    let mut m = *a;
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] = dot(a[i], bt[j]);
        }
    }
    m
}

/// det M.
pub fn determinant(m: &Mat3) -> f64 {
    dot(m[0], cross(m[1], m[2]))
}

/// M⁻¹, by cofactors. The caller guarantees that M is invertible.
pub fn inverse(m: &Mat3) -> Mat3 {
    let d = 1.0 / determinant(m);
    let (a, b, c) = (cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    transpose(&[scale(a, d), scale(b, d), scale(c, d)])
}

/// What counts as zero off a diagonal, as a share of it: far below rounding.
const NEAR: f64 = 1e-18;

/// The largest singular value of M, from the eigenvalues of MᵀM.
pub fn spectral_norm(m: &Mat3) -> f64 {
    let mut a = product(&transpose(m), m);
    diagonalise(&mut a, &mut [], NEAR);
    a[0][0].max(a[1][1]).max(a[2][2]).max(0.0).sqrt()
}

/// Eigenvalues, ascending, and unit eigenvectors of a symmetric matrix.
pub fn eigen(m: &Mat3) -> (Vec3, Mat3) {
    let (mut a, mut vectors) = (*m, IDENTITY);
    diagonalise(&mut a, &mut vectors, NEAR);
    debug_assert!((norm(apply(m, vectors[0])) - a[0][0].abs()).abs() <= 1e-6 * (1.0 + a[0][0].abs()));
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (order.map(|i| a[i][i]), order.map(|i| vectors[i]))
}

/// R = Rx Ry Rz for angles in degrees: z is turned first, then y, then x, about fixed axes.
///
/// Exact (no rounding) at multiples of 90 degrees, so that a lattice turned onto the axes stays separable.
/// Source: SPARTAN equations 1.3 to 1.5.
pub fn rotation(degrees: Vec3) -> Mat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] = degrees.map(|d| sin_cos_turns(d / 360.0));
    let rx = [[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]];
    let ry = [[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]];
    let rz = [[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]];
    product(&rx, &product(&ry, &rz))
}

/// A vector turned about a unit vector n by an angle of this sine and cosine, by the right-hand rule: v cos + (n × v) sin + n (n·v) (1 − cos),
/// Rodrigues' formula.
pub fn turned(v: Vec3, n: Vec3, (sine, cosine): (f64, f64)) -> Vec3 {
    add(add(scale(v, cosine), scale(cross(n, v), sine)), scale(n, (1.0 - cosine) * dot(n, v)))
}

/// A complex number (re, im).
pub type Complex = (f64, f64);

/// The product of two complex numbers.
#[inline]
pub fn complex_product(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

/// (sin 2πu, cos 2πu) for a phase u in turns; error below 4e-16, exact at quarter turns.
///
/// Plain polynomials on an eighth of a turn: every system gives the same bits and the loops vectorise.
#[inline(always)]
pub fn sin_cos_turns(u: f64) -> (f64, f64) {
    // Adding and taking away 1.5·2⁵² rounds to the nearest integer without a library call.
    const ROUND: f64 = 6755399441055744.0;
    let q = (u * 4.0 + ROUND) - ROUND;
    let r = (u * 4.0 - q) * core::f64::consts::FRAC_PI_2; // |r| ≤ π/4
    let w = r * r;
    let s = r
        * (1.0
            + w * (-1.0 / 6.0
                + w * (1.0 / 120.0
                    + w * (-1.0 / 5040.0
                        + w * (1.0 / 362880.0
                            + w * (-1.0 / 39916800.0 + w * (1.0 / 6227020800.0 - w / 1307674368000.0)))))));
    let c = 1.0
        + w * (-0.5
            + w * (1.0 / 24.0
                + w * (-1.0 / 720.0
                    + w * (1.0 / 40320.0
                        + w * (-1.0 / 3628800.0
                            + w * (1.0 / 479001600.0 + w * (-1.0 / 87178291200.0 + w / 20922789888000.0)))))));
    // The quadrant modulo 4, as a float, so that no integer conversion breaks the vector loop.
    let k = q - 4.0 * ((q * 0.25 - 0.375 + ROUND) - ROUND);
    let odd = k == 1.0 || k == 3.0;
    let (s, c) = if odd { (c, s) } else { (s, c) };
    let s = if k >= 2.0 { -s } else { s };
    let c = if k == 1.0 || k == 2.0 { -c } else { c };
    (s, c)
}

/// eˣ for x from −708 to 709, and beyond these as at them; relative error below 5e-16, exact at 0.
///
/// As `sin_cos_turns`, the same bits everywhere, and in vectors: a polynomial over half an octave about each power of two.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    const ROUND: f64 = 6755399441055744.0;
    // ln 2 as a number of 33 bits, whose products with whole numbers are exact, and the rest.
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    let x = x.clamp(-708.0, 709.0);
    let shifted = x * core::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN_2[0]) - k * LN_2[1]; // |r| ≤ ½ ln 2
    let tail = 1.0 / 5040.0
        + r * (1.0 / 40320.0
            + r * (1.0 / 362880.0
                + r * (1.0 / 3628800.0 + r * (1.0 / 39916800.0 + r * (1.0 / 479001600.0 + r * (1.0 / 6227020800.0))))));
    let p = 1.0
        + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0 + r * tail))))));
    // The last bits of `shifted` are k: as an exponent they are 2ᵏ.
    p * f64::from_bits((shifted.to_bits() << 52).wrapping_add(1023 << 52))
}

/// The angle of (x, y) in turns, from −½ to ½ and zero at the origin; error below 1e-16.
///
/// As `sin_cos_turns`, the same bits everywhere, and in vectors: a rational function (Moshier, Cephes, `atan`) on an eighth of
/// a turn, divided once more at its middle.
#[inline(always)]
pub fn angle_turns(y: f64, x: f64) -> f64 {
    let (ax, ay) = (x.abs(), y.abs());
    let (high, low) = if ax > ay { (ax, ay) } else { (ay, ax) };
    let far = low > 0.66 * high;
    let (num, den) = if far { (low - high, low + high) } else { (low, high) };
    let t = num / if den > 0.0 { den } else { 1.0 };
    let z = t * t;
    let p = -64.85021904942025
        + z * (-122.88666844901361 + z * (-75.00855792314705 + z * (-16.157537187333652 - z * 0.8750608600031904)));
    let q = 194.5506571482614
        + z * (485.3903996359137 + z * (432.88106049129027 + z * (165.02700983169885 + z * (24.858464901423062 + z))));
    let angle = (t * (z * p / q) + t) / core::f64::consts::TAU;
    let eighth = if far { angle + 0.125 } else { angle };
    let quarter = if ax > ay { eighth } else { 0.25 - eighth };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    let half = if high > 0.0 { half } else { 0.0 };
    if y < 0.0 { -half } else { half }
}

/// An axis-aligned box; empty when any `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(into = "[Vec3; 2]")]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl From<Aabb> for [Vec3; 2] {
    fn from(of: Aabb) -> Self {
        [of.min, of.max]
    }
}

impl Aabb {
    /// The box that contains nothing; growing it by points gives their bounds.
    pub const EMPTY: Aabb = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
    /// The box that contains everything.
    pub const ALL: Aabb = Aabb { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };

    /// The smallest box that holds this one and `p`.
    #[inline]
    pub fn with(mut self, p: Vec3) -> Aabb {
        for a in 0..3 {
            self.min[a] = self.min[a].min(p[a]);
            self.max[a] = self.max[a].max(p[a]);
        }
        self
    }

    /// The smallest box that holds both.
    pub fn union(self, o: Aabb) -> Aabb {
        self.with(o.min).with(o.max)
    }

    /// The box common to both.
    pub fn intersection(mut self, o: Aabb) -> Aabb {
        for a in 0..3 {
            self.min[a] = self.min[a].max(o.min[a]);
            self.max[a] = self.max[a].min(o.max[a]);
        }
        self
    }

    /// The two halves along the longest side.
    #[must_use]
    pub fn halves(self) -> [Aabb; 2] {
        let size = self.size();
        let a = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        let mut halves = [self; 2];
        halves[0].max[a] = self.center()[a];
        halves[1].min[a] = halves[0].max[a];
        halves
    }

    /// The box grown by `by` on every side.
    pub fn grown(self, by: f64) -> Aabb {
        Aabb { min: self.min.map(|v| v - by), max: self.max.map(|v| v + by) }
    }

    /// The point at these shares of its edges, each from 0 to 1.
    pub fn at(&self, share: Vec3) -> Vec3 {
        let size = self.size();
        core::array::from_fn(|a| self.min[a] + size[a] * share[a])
    }

    /// Its middle.
    pub fn center(&self) -> Vec3 {
        scale(add(self.min, self.max), 0.5)
    }

    /// Its edge lengths.
    pub fn size(&self) -> Vec3 {
        sub(self.max, self.min)
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|a| self.min[a] > self.max[a])
    }

    /// Whether `p` lies in it, not on its faces.
    #[inline]
    pub fn holds_inside(&self, p: Vec3) -> bool {
        (0..3).all(|a| self.min[a] < p[a] && p[a] < self.max[a])
    }

    /// Whether all six numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.min.iter().chain(&self.max).all(|v| v.is_finite())
    }

    /// Whether two boxes have a point in common, faces included.
    #[inline]
    pub fn touches(&self, o: &Aabb) -> bool {
        (0..3).all(|a| self.min[a] <= o.max[a] && o.min[a] <= self.max[a])
    }

    /// Distance from `p` to the box, zero inside.
    #[inline]
    pub fn distance(&self, p: Vec3) -> f64 {
        let mut s = 0.0;
        for a in 0..3 {
            let d = (self.min[a] - p[a]).max(p[a] - self.max[a]).max(0.0);
            s += d * d;
        }
        s.sqrt()
    }
}

/// A closed range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Least value.
    pub lo: f64,
    /// Greatest value.
    pub hi: f64,
}

impl Interval {
    /// [lo, hi].
    pub fn new(lo: f64, hi: f64) -> Self {
        Interval { lo, hi }
    }

    /// The range of |v|.
    pub fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            Interval::new(-self.hi, -self.lo)
        } else {
            Interval::new(0.0, self.hi.max(-self.lo))
        }
    }

    /// The smallest interval that holds both.
    pub fn union(self, o: Self) -> Self {
        Interval::new(self.lo.min(o.lo), self.hi.max(o.hi))
    }

    /// Range of max(a, b).
    pub fn max(self, o: Self) -> Self {
        Interval::new(self.lo.max(o.lo), self.hi.max(o.hi))
    }

    /// Range of min(a, b).
    pub fn min(self, o: Self) -> Self {
        Interval::new(self.lo.min(o.lo), self.hi.min(o.hi))
    }
}

impl Interval {
    /// The range of a product. The factors themselves are finite, so nothing times an infinite end is nothing.
    pub fn times(self, o: Self) -> Self {
        let times = |p: f64, q: f64| if p == 0.0 || q == 0.0 { 0.0 } else { p * q };
        let ends = [times(self.lo, o.lo), times(self.lo, o.hi), times(self.hi, o.lo), times(self.hi, o.hi)];
        Interval::new(
            ends.into_iter().fold(f64::INFINITY, f64::min),
            ends.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

impl core::ops::Add for Interval {
    type Output = Interval;
    fn add(self, o: Interval) -> Interval {
        Interval::new(self.lo + o.lo, self.hi + o.hi)
    }
}

impl core::ops::Sub for Interval {
    type Output = Interval;
    fn sub(self, o: Interval) -> Interval {
        Interval::new(self.lo - o.hi, self.hi - o.lo)
    }
}

impl core::ops::Neg for Interval {
    type Output = Interval;
    fn neg(self) -> Interval {
        Interval::new(-self.hi, -self.lo)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_of_ranges_holds_the_products() {
        let ends = [f64::NEG_INFINITY, -2.0, 0.0, 0.5, f64::INFINITY];
        let all = || {
            ends.into_iter()
                .flat_map(|lo| ends.into_iter().map(move |hi| Interval::new(lo, hi)))
                .filter(|i| i.lo <= i.hi)
        };
        for a in all() {
            for b in all() {
                let product = a.times(b);
                assert!(product.lo <= product.hi, "{a:?} {b:?}");
                for p in [-2.0, 0.0, 0.5, 1e9].into_iter().filter(|p| a.lo <= *p && *p <= a.hi) {
                    for q in [-2.0, 0.0, 0.5, 1e9].into_iter().filter(|q| b.lo <= *q && *q <= b.hi) {
                        assert!(product.lo <= p * q && p * q <= product.hi, "{a:?} {b:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn exponentials() {
        assert_eq!((exp(0.0), exp(f64::NEG_INFINITY), exp(f64::INFINITY)), (1.0, exp(-708.0), exp(709.0)));
        assert!(exp(f64::NAN).is_nan());
        for i in -70_800..=70_900 {
            let x = f64::from(i) * 0.01;
            // The polynomial's last sum and product, each half a bit, and that of the library.
            assert!((exp(x) / x.exp() - 1.0).abs() < 5e-16, "{x}");
        }
    }

    #[test]
    fn sine_and_cosine_are_exact_at_quarters_and_near_the_library_elsewhere() {
        for k in -9i32..9 {
            let (s, c) = sin_cos_turns(f64::from(k) / 4.0);
            let want = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][k.rem_euclid(4) as usize];
            assert_eq!((s + 0.0, c + 0.0), want, "{k} quarters");
        }
        for i in 0..20_000 {
            let u = (f64::from(i) - 10_000.0) * 0.000_731;
            let (s, c) = sin_cos_turns(u);
            let (ls, lc) = (core::f64::consts::TAU * (u - u.floor())).sin_cos();
            // The library's own argument 2πu is rounded by up to 4e-16.
            assert!((s - ls).abs() < 1e-15 && (c - lc).abs() < 1e-15, "{u}: {s} {ls} {c} {lc}");
        }
    }

    #[test]
    fn angles_are_exact_on_axes_and_diagonals_and_near_the_library_elsewhere() {
        assert_eq!(angle_turns(0.0, 0.0), 0.0);
        for (k, (y, x)) in [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (1.0, -1.0), (0.0, -1.0)].into_iter().enumerate() {
            for size in [1e-200, 1.0, 3e200] {
                assert_eq!(angle_turns(size * y, size * x), k as f64 / 8.0);
                assert_eq!(angle_turns(-size * y, size * x).abs(), k as f64 / 8.0);
            }
        }
        for i in 0..20_000 {
            let (s, c) = sin_cos_turns(f64::from(i) * 0.000_731 - 3.0);
            let library = s.atan2(c) / core::f64::consts::TAU;
            // Two roundings of the library's, one of half a turn.
            assert!((angle_turns(7.0 * s, 7.0 * c) - library).abs() < 2e-16, "{s} {c}");
        }
    }

    #[test]
    fn inverse_and_spectral_norm() {
        let r = rotation([20.0, 35.0, 50.0]);
        assert!((spectral_norm(&r) - 1.0).abs() < 1e-14);
        let m = product(&r, &[[1.0, 0.2, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 2.0]]);
        let p = product(&m, &inverse(&m));
        for i in 0..3 {
            for j in 0..3 {
                assert!((p[i][j] - IDENTITY[i][j]).abs() < 1e-14);
            }
        }
        assert!((spectral_norm(&m) - 2.0).abs() < 1e-12);
    }
}
