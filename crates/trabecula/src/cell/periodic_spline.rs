//! Tricubic B-splines on the torus: a function given at the nodes of a grid, with two continuous derivatives and a
//! value that costs 64 multiplications.
//!
//! The coefficients of the interpolating spline are kept in f32: they define the function, in whatever precision it is
//! evaluated.

use multiversion::multiversion;

use geometry::cubic_spline::{EndCondition, bends, coefficients, slopes, weights};
use geometry::math::{Interval, Mat3, Vec3, apply, norm, transpose};

/// Coefficients per axis, besides that of its own node, on which the spline in a knot interval depends.
const PAD: usize = 3;
/// Points handled at once; the compiler turns each loop over them into vector instructions.
const LANES: usize = 8;

/// A tricubic B-spline of period one along each axis.
pub(super) struct PeriodicSpline {
    /// Knots along each axis.
    shape: [usize; 3],
    /// Coefficients, x fastest, those at the ends repeated so that four in a row never wrap.
    padded: Vec<f32>,
    /// Distance between neighbours along y and z.
    stride: [usize; 2],
}

impl PeriodicSpline {
    /// The spline that has `values` (x fastest) at the nodes k / shape.
    pub(super) fn through(values: Vec<f64>, shape: [usize; 3]) -> PeriodicSpline {
        let [nx, ny, _] = shape;
        let values = coefficients(values, shape, EndCondition::Periodic);
        PeriodicSpline::from_coefficients(|[i, j, k]| values[(k * ny + j) * nx + i], shape)
    }

    fn from_coefficients(c: impl Fn([usize; 3]) -> f64, shape: [usize; 3]) -> PeriodicSpline {
        let [sx, sy, sz] = shape.map(|n| n + PAD);
        // Entry m holds coefficient m − 1: interval i needs i − 1 to i + 2.
        let wrap = |m: usize, a: usize| (m + shape[a] - 1) % shape[a];
        let padded = (0..sx * sy * sz)
            .map(|i| c([wrap(i % sx, 0), wrap(i / sx % sy, 1), wrap(i / sx / sy, 2)]) as f32)
            .collect();
        PeriodicSpline { shape, padded, stride: [sx, sx * sy] }
    }

    /// The entry of `padded` for coefficient (i, j, k) − 1.
    fn entry(&self, at: [usize; 3]) -> usize {
        at[0] + at[1] * self.stride[0] + at[2] * self.stride[1]
    }

    /// Knots along each axis.
    pub(super) fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// An interval that contains every value: a spline lies in the hull of its coefficients.
    pub(super) fn range(&self) -> Interval {
        let fold = |(lo, hi): (f32, f32), v: &f32| (lo.min(*v), hi.max(*v));
        let (lo, hi) = self.padded.iter().fold((f32::INFINITY, f32::NEG_INFINITY), fold);
        Interval::new(f64::from(lo), f64::from(hi))
    }

    /// A Lipschitz bound: an upper bound of |∂S/∂x| (per mm) where phases are u = `to_phase` · x.
    ///
    /// In one knot interval the spline is a polynomial with Bernstein's coefficients, and each derivative a mean of their
    /// differences along its axis. So the gradient lies in the box that the differences span, and is longest at a corner.
    pub(super) fn lipschitz(&self, to_phase: &Mat3) -> f64 {
        use rayon::prelude::*;
        let back = transpose(to_phase);
        let [nx, ny, nz] = self.shape;
        let longest = |sides: [[f64; 2]; 3]| {
            (0..8)
                .map(|corner| core::array::from_fn(|a| sides[a][corner >> a & 1] * self.shape[a] as f64))
                .map(|g| norm(apply(&back, g)))
                .fold(0.0, f64::max)
        };
        let layer = |k: usize| {
            (0..nx * ny).fold(0.0f64, |most, i| {
                let mut block = self.block([i % nx, i / nx, k]);
                // The coefficients' own differences span more, but are at hand: most intervals need no other bound.
                if longest(differences(&block, 1.0)) <= most {
                    return most;
                }
                bernstein(&mut block);
                most.max(longest(differences(&block, 3.0)))
            })
        };
        (0..nz).into_par_iter().map(layer).reduce(|| 0.0, f64::max)
    }

    /// The coefficients that count in a knot interval, x fastest.
    fn block(&self, at: [usize; 3]) -> [f64; 64] {
        let first = self.entry(at);
        core::array::from_fn(|i| f64::from(self.row(first, i / 4 % 4, i / 16)[i % 4]))
    }

    /// The spline whose value at a point is, to fourth order in `h`, the mean of this one over the cube of edge `h`
    /// (turns) about the point.
    pub(super) fn averaged(&self, h: f64) -> PeriodicSpline {
        // The mean is S + h²/24 ΔS, and a second difference of coefficients is a second derivative.
        let weight = self.shape.map(|n| (h * n as f64).powi(2) / 24.0);
        let steps = [1, self.stride[0], self.stride[1]];
        let value = |at: usize| f64::from(self.padded[at]);
        let mean = |[i, j, k]: [usize; 3]| {
            // Coefficient m is entry m + 1, between its neighbours.
            let at = self.entry(core::array::from_fn(|a| [i, j, k][a] + 1));
            (0..3).fold(value(at), |sum, a| {
                let bend = value(at - steps[a]) - 2.0 * value(at) + value(at + steps[a]);
                sum + weight[a] * bend
            })
        };
        PeriodicSpline::from_coefficients(mean, self.shape)
    }

    /// Values at phases `u` (turns).
    pub(super) fn values(&self, u: &[Vec3], out: &mut [f64]) {
        values(self, u, out);
    }

    /// Values, the same as those of `values`, and gradients (per turn) at phases `u` (turns).
    pub(super) fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        fill_gradients(self, u, values, gradients);
    }

    /// As `gradients`, with second derivatives.
    pub(super) fn second(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3], second: &mut [Mat3]) {
        fill_second(self, u, values, gradients, second);
    }

    /// Fills sums over the coefficients that count from entry `first` on: for each pair of lists of weights, y and z, four
    /// numbers along x.
    #[inline(always)]
    fn sums<const Y: usize, const N: usize>(
        &self,
        first: usize,
        [y, z]: [[[f64; 4]; Y]; 2],
        pairs: [(usize, usize); N],
        out: &mut [[f64; 4]; N],
    ) {
        *out = [[0.0; 4]; N];
        for k in 0..4 {
            let mut plane = [[0.0; 4]; Y];
            for j in 0..4 {
                let mut row = [0.0; 4];
                for (r, c) in row.iter_mut().zip(self.row(first, j, k)) {
                    *r = f64::from(*c);
                }
                for (plane, y) in plane.iter_mut().zip(&y) {
                    for i in 0..4 {
                        plane[i] += y[j] * row[i];
                    }
                }
            }
            for (sum, (b, c)) in out.iter_mut().zip(pairs) {
                for i in 0..4 {
                    sum[i] += z[c][k] * plane[b][i];
                }
            }
        }
    }

    /// Values at the phases `base + x · along`, one for each of `xs`, in single precision.
    pub(super) fn fill_row(&self, base: Vec3, along: Vec3, xs: &[f64], out: &mut [f32]) {
        if along[1] == 0.0 && along[2] == 0.0 {
            fill_straight(self, base, along[0], xs, out);
        } else {
            fill_row(self, [base, along], xs, out);
        }
    }

    /// The entry of the first of the coefficients that count at `u`, and the position in the knot interval (0 to 1).
    #[inline(always)]
    fn interval(&self, u: Vec3) -> (usize, Vec3) {
        let mut at = [0; 3];
        let mut t = [0.0; 3];
        for a in 0..3 {
            let n = self.shape[a] as f64;
            let s = (u[a] - u[a].floor()) * n;
            // A phase just below a whole number may round up to it.
            let i = s.min(n - 1.0).floor();
            (at[a], t[a]) = (i as usize, s - i);
        }
        (self.entry(at), t)
    }

    /// Four coefficients along x.
    #[inline(always)]
    fn row(&self, first: usize, j: usize, k: usize) -> &[f32] {
        let at = first + j * self.stride[0] + k * self.stride[1];
        &self.padded[at..at + 4]
    }
}

/// For each axis the least and the greatest difference of neighbours in a block of 4³ numbers, times `factor`.
fn differences(block: &[f64; 64], factor: f64) -> [[f64; 2]; 3] {
    [1, 4, 16].map(|step| {
        let mut sides = [f64::INFINITY, f64::NEG_INFINITY];
        for i in (0..64).filter(|i| i / step % 4 != 3) {
            let rise = factor * (block[i + step] - block[i]);
            sides = [sides[0].min(rise), sides[1].max(rise)];
        }
        sides
    })
}

/// From the coefficients of B-splines to those of Bernstein's polynomials of the same cubic.
fn bernstein(block: &mut [f64; 64]) {
    for step in [1, 4, 16] {
        for i in (0..64).filter(|i| i / step % 4 == 0) {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| block[i + k * step]);
            let ends = [(a + 4.0 * b + c) / 6.0, (b + 4.0 * c + d) / 6.0];
            block[i] = ends[0];
            block[i + step] = (2.0 * b + c) / 3.0;
            block[i + 2 * step] = (b + 2.0 * c) / 3.0;
            block[i + 3 * step] = ends[1];
        }
    }
}

#[inline(always)]
fn along(c: &[f64; 4], w: &[f64; 4]) -> f64 {
    (c[0] * w[0] + c[1] * w[1]) + (c[2] * w[2] + c[3] * w[3])
}

/// A small whole number as an integer, in vectors too.
#[inline(always)]
fn whole(v: f64) -> i32 {
    (v + 6755399441055744.0).to_bits() as i32
}

/// Where points lie: the first of the coefficients that count, and weights of derivatives up to an order along each axis.
struct SplineStencils<const D: usize> {
    first: [i32; LANES],
    /// By axis, derivative, coefficient, point.
    weights: [[[[f64; LANES]; 4]; D]; 3],
}

impl<const D: usize> SplineStencils<D> {
    #[inline(always)]
    fn new(spline: &PeriodicSpline, u: &[Vec3]) -> Self {
        let steps = [1, spline.stride[0] as i32, spline.stride[1] as i32];
        let mut stencils = SplineStencils { first: [0; LANES], weights: [[[[0.0; LANES]; 4]; D]; 3] };
        for a in 0..3 {
            let n = spline.shape[a] as f64;
            let mut at = [0.0; LANES];
            for (at, u) in at.iter_mut().zip(u) {
                *at = u[a];
            }
            for l in 0..LANES {
                // A phase just below a whole number may round up to it.
                let s = (at[l] - at[l].floor()) * n;
                let i = s.min(n - 1.0).floor();
                stencils.first[l] += whole(i) * steps[a];
                let t = s - i;
                let of = [weights(t), slopes(t), bends(t)];
                for d in 0..D {
                    for k in 0..4 {
                        stencils.weights[a][d][k][l] = of[d][k];
                    }
                }
            }
        }
        stencils
    }

    /// The weights along an axis at one point.
    #[inline(always)]
    fn of(&self, a: usize, l: usize) -> [[f64; 4]; D] {
        let mut of = [[0.0; 4]; D];
        for d in 0..D {
            for k in 0..4 {
                of[d][k] = self.weights[a][d][k][l];
            }
        }
        of
    }

    #[inline(always)]
    fn sums<const N: usize>(
        &self,
        spline: &PeriodicSpline,
        count: usize,
        pairs: [(usize, usize); N],
    ) -> [[[f64; 4]; N]; LANES] {
        let mut sums = [[[0.0; 4]; N]; LANES];
        for l in 0..count.min(LANES) {
            spline.sums(self.first[l] as usize, [self.of(1, l), self.of(2, l)], pairs, &mut sums[l]);
        }
        sums
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn values(spline: &PeriodicSpline, u: &[Vec3], out: &mut [f64]) {
    for (u, out) in u.chunks(LANES).zip(out.chunks_mut(LANES)) {
        let stencils = SplineStencils::<1>::new(spline, u);
        let sums = stencils.sums(spline, u.len(), [(0, 0)]);
        for (l, o) in out.iter_mut().enumerate() {
            *o = along(&sums[l][0], &stencils.of(0, l)[0]);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn fill_gradients(spline: &PeriodicSpline, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
    let n = spline.shape.map(|n| n as f64);
    let batches = u.chunks(LANES).zip(values.chunks_mut(LANES)).zip(gradients.chunks_mut(LANES));
    for ((u, values), gradients) in batches {
        let stencils = SplineStencils::<2>::new(spline, u);
        let sums = stencils.sums(spline, u.len(), [(0, 0), (1, 0), (0, 1)]);
        for (l, (o, g)) in values.iter_mut().zip(gradients).enumerate() {
            let ([v, vy, vz], [x, dx]) = (&sums[l], stencils.of(0, l));
            *o = along(v, &x);
            *g = [along(v, &dx) * n[0], along(vy, &x) * n[1], along(vz, &x) * n[2]];
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn fill_second(spline: &PeriodicSpline, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3], second: &mut [Mat3]) {
    let [nx, ny, nz] = spline.shape.map(|n| n as f64);
    let batches =
        u.chunks(LANES).zip(values.chunks_mut(LANES)).zip(gradients.chunks_mut(LANES).zip(second.chunks_mut(LANES)));
    for ((u, values), (gradients, second)) in batches {
        let stencils = SplineStencils::<3>::new(spline, u);
        let sums = stencils.sums(spline, u.len(), [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]);
        for (l, ((o, g), h)) in values.iter_mut().zip(gradients).zip(second).enumerate() {
            let ([v, vy, vz, vyy, vyz, vzz], [x, dx, bx]) = (&sums[l], stencils.of(0, l));
            *o = along(v, &x);
            *g = [along(v, &dx) * nx, along(vy, &x) * ny, along(vz, &x) * nz];
            let [xy, xz, yz] = [along(vy, &dx) * nx * ny, along(vz, &dx) * nx * nz, along(vyz, &x) * ny * nz];
            let [xx, yy, zz] = [along(v, &bx) * nx * nx, along(vyy, &x) * ny * ny, along(vzz, &x) * nz * nz];
            *h = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        }
    }
}

/// On a row along x, y and z are constant: the spline becomes one of x alone.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn fill_straight(spline: &PeriodicSpline, base: Vec3, along: f64, xs: &[f64], out: &mut [f32]) {
    let [line, plane] = spline.stride;
    let (first, t) = spline.interval([0.0, base[1], base[2]]);
    let (y, z) = (weights(t[1]), weights(t[2]));
    let mut row = vec![0f32; line];
    for (k, z) in z.iter().enumerate() {
        for (j, y) in y.iter().enumerate() {
            let (w, at) = ((y * z) as f32, first + k * plane + j * line);
            for (r, c) in row.iter_mut().zip(&spline.padded[at..at + line]) {
                *r += w * c;
            }
        }
    }
    let n = spline.shape[0] as f64;
    for (x, o) in xs.iter().zip(out) {
        let u = base[0] + x * along;
        let s = (u - u.floor()) * n;
        let i = s.min(n - 1.0).floor();
        let t = (s - i) as f32;
        let r = 1.0 - t;
        let i = i as i32 as usize;
        *o = row[i..].first_chunk::<4>().map_or(0.0, |c| {
            let ends = c[0] * (r * r * r) + c[3] * (t * t * t);
            let low = c[1] * (t * t * (3.0 * t - 6.0) + 4.0);
            let high = c[2] * (r * r * (3.0 * r - 6.0) + 4.0);
            (ends + (low + high)) * (1.0 / 6.0)
        });
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn fill_row(spline: &PeriodicSpline, [base, along]: [Vec3; 2], xs: &[f64], out: &mut [f32]) {
    let [line, plane] = spline.stride;
    let steps = [1, line as i32, plane as i32];
    for (xs, out) in xs.chunks(LANES).zip(out.chunks_mut(LANES)) {
        let mut x = [0.0; LANES];
        x[..xs.len()].copy_from_slice(xs);
        let mut first = [0i32; LANES];
        let mut w = [[[0f32; LANES]; 4]; 3];
        for a in 0..3 {
            let n = spline.shape[a] as f64;
            for l in 0..LANES {
                let u = base[a] + x[l] * along[a];
                let s = (u - u.floor()) * n;
                let i = s.min(n - 1.0).floor();
                let t = (s - i) as f32;
                first[l] += i as i32 * steps[a];
                let r = 1.0 - t;
                w[a][0][l] = r * r * r * (1.0 / 6.0);
                w[a][1][l] = (t * t * (3.0 * t - 6.0) + 4.0) * (1.0 / 6.0);
                w[a][2][l] = (r * r * (3.0 * r - 6.0) + 4.0) * (1.0 / 6.0);
                w[a][3][l] = t * t * t * (1.0 / 6.0);
            }
        }
        for (l, o) in out.iter_mut().enumerate() {
            let coefficients = &spline.padded[first[l] as usize..];
            let planes = [0, 1, 2, 3].map(|k| {
                let rows = &coefficients[k * plane..k * plane + 3 * line + 4];
                let [a, b, c, d] = [0, 1, 2, 3].map(|j| {
                    rows[j * line..].first_chunk::<4>().map_or([0.0; 4], |r| {
                        let f = w[1][j][l];
                        [r[0] * f, r[1] * f, r[2] * f, r[3] * f]
                    })
                });
                let f = w[2][k][l];
                [0, 1, 2, 3].map(|i| ((a[i] + b[i]) + (c[i] + d[i])) * f)
            });
            let [a, b, c, d] = planes;
            let s = [0, 1, 2, 3].map(|i| ((a[i] + b[i]) + (c[i] + d[i])) * w[0][i][l]);
            *o = (s[0] + s[1]) + (s[2] + s[3]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    fn wave(u: Vec3) -> f64 {
        (TAU * u[0]).sin() * (TAU * u[1]).cos() + (TAU * (u[1] + 2.0 * u[2])).cos()
    }

    fn spline(n: [usize; 3]) -> PeriodicSpline {
        let at = |i: usize| [i % n[0], i / n[0] % n[1], i / n[0] / n[1]];
        let values = (0..n[0] * n[1] * n[2])
            .map(|i| {
                let k = at(i);
                wave(core::array::from_fn(|a| k[a] as f64 / n[a] as f64))
            })
            .collect();
        PeriodicSpline::through(values, n)
    }

    fn positions(n: usize) -> Vec<Vec3> {
        (0..n).map(|i| [0.7549, 0.5698, 0.4302].map(|s| 9.0 * (s * i as f64).fract() - 4.0)).collect()
    }

    #[test]
    fn errors_fall_as_the_fourth_power() {
        let errors = [16, 32].map(|n| {
            let s = spline([n, n + 2, n + 5]);
            let u = positions(500);
            let mut v = vec![0.0; u.len()];
            s.values(&u, &mut v);
            u.iter().zip(&v).map(|(u, v)| (wave(*u) - v).abs()).fold(0.0, f64::max)
        });
        println!("{errors:?}");
        // Halved nearly: (37/21)⁴ = 9.6 along the finest wave.
        assert!(errors[0] < 2e-2 && errors[0] / errors[1] > 9.0, "{errors:?}");
    }

    #[test]
    fn values_gradients_and_rows_agree_and_bounds_hold() {
        let s = spline([16, 20, 24]);
        let u = positions(300);
        let (mut v, mut w, mut g) = (vec![0.0; 300], vec![0.0; 300], vec![[0.0; 3]; 300]);
        s.values(&u, &mut v);
        s.gradients(&u, &mut w, &mut g);
        assert_eq!(v, w);
        let (mut w, mut k, mut h) = (vec![0.0; 300], vec![[0.0; 3]; 300], vec![[[0.0; 3]; 3]; 300]);
        s.second(&u, &mut w, &mut k, &mut h);
        assert_eq!((&v, &g), (&w, &k));
        let m = [[0.3, 0.1, 0.0], [0.0, 0.5, -0.2], [0.1, 0.0, 0.25]];
        let lipschitz = s.lipschitz(&m);
        for i in 0..300 {
            for a in 0..3 {
                let mut q = [u[i], u[i]];
                (q[0][a], q[1][a]) = (u[i][a] - 1e-5, u[i][a] + 1e-5);
                let mut d = [0.0; 2];
                s.values(&q, &mut d);
                // The third derivative jumps at knots: the difference is of first order in 1e-5 there, times 2π³ squared.
                assert!(((d[1] - d[0]) / 2e-5 - g[i][a]).abs() < 1e-5);
            }
            for a in 0..3 {
                let mut q = [u[i], u[i]];
                (q[0][a], q[1][a]) = (u[i][a] - 1e-5, u[i][a] + 1e-5);
                let (mut d, mut e) = ([0.0; 2], [[0.0; 3]; 2]);
                s.gradients(&q, &mut d, &mut e);
                // At knots the difference is that of two straight lines: of first order, times the jump of the third derivative.
                assert!((0..3).all(|b| ((e[1][b] - e[0][b]) / 2e-5 - h[i][a][b]).abs() < 2e-2));
            }
            assert!(norm(apply(&transpose(&m), g[i])) <= lipschitz);
            assert!(s.range().lo <= v[i] && v[i] <= s.range().hi);
        }
        let xs: Vec<f64> = (0..77).map(|i| 0.13 * f64::from(i) - 5.0).collect();
        for step in [[0.7, -0.4, 0.05], [0.7, 0.0, 0.0], [-0.3, 0.0, 0.0]] {
            let base = [0.3, -0.2, 7.0];
            let mut row = vec![0f32; xs.len()];
            s.fill_row(base, step, &xs, &mut row);
            for (x, r) in xs.iter().zip(&row) {
                let mut d = [0.0];
                s.values(&[core::array::from_fn(|a| base[a] + x * step[a])], &mut d);
                assert!((d[0] - f64::from(*r)).abs() < 2e-6);
            }
        }
        // Phases that round up to a whole number stay in the table.
        s.values(&[[-1e-18, 1.0 - 1e-17, 0.0]], &mut v[..1]);
        assert!((v[0] - wave([0.0; 3])).abs() < 1e-3);
    }

    #[test]
    fn averages_are_those_of_waves() {
        let s = spline([32, 32, 48]);
        let h = 1.0 / 32.0;
        let sinc = |k: f64| (core::f64::consts::PI * k * h).sin() / (core::f64::consts::PI * k * h);
        let (u, mut v) = (positions(100), [0.0]);
        for u in u {
            let want = (TAU * u[0]).sin() * (TAU * u[1]).cos() * sinc(1.0).powi(2)
                + (TAU * (u[1] + 2.0 * u[2])).cos() * sinc(1.0) * sinc(2.0);
            s.averaged(h).values(&[u], &mut v);
            // The spline's own error and the fourth order that is left out: (2π·2/32)⁴ / 384 and as much.
            assert!((v[0] - want).abs() < 3e-4, "{} {want}", v[0]);
        }
    }
}
