//! Orientations smoothed over a length, in representations that have neither signs nor order.
//!
//! Values of a solver are noisy. Noise has no mean, but the directions of a noisy stress have: where two principal values agree it sets
//! them apart, and confidence in their directions with them. So a stress is averaged as a tensor first, over a shorter length.
//! Principal directions have neither sign nor order, so these cannot be
//! averaged as vectors. An axis v is averaged as the tensor v vᵀ, a frame as the harmonic polynomial of degree four
//! X⁴ + Y⁴ + Z⁴ − ⅗ r⁴ in the coordinates X, Y, Z along its axes, which the 24 rotations of a cube leave as it is (Ray, Sokolov and Lévy,
//! *Practical 3D frame field generation*, ACM Trans. Graph. 35, 2016). Where two principal values agree, the mean over the turns about
//! the third axis stands in its place, (7/4) Z⁴ − (3/2) r² Z² + (3/20) r⁴; where all do, nothing.
//!
//! The average at a node is φ = (1 − ℓ²Δ)⁻¹ (c q), with the confidence c of each node: it falls off as e^{−d/ℓ}, and only its direction
//! counts. With mirrored faces the cosines of the DCT-I are the eigenvectors, so a component is one transform forth and back.

use super::cube_rotations::{cube, nearest};
use super::phase_grid::PhaseGrid;
use super::poisson::Poisson;
use geometry::math::{IDENTITY, Mat3, Vec3, add, cross, determinant, dot, norm, rotation, scale, sub, transpose};
use geometry::progress::checkpoint;

/// The gaps of axes that are given. Less would leave one of them a little surer than the others.
pub(super) const GIVEN: Vec3 = [f64::INFINITY; 3];
/// A gap between principal values, over the range of a stress in the part, at which a direction is half trusted.
const HALF_TRUSTED: f64 = 0.05;
/// The share of the smoothing length over which stresses are averaged: the deviation of what falls off as (1 − ℓ²Δ)⁻¹ is √2 ℓ, half the
/// length.
const OF_STRESS: f64 = 0.5 * core::f64::consts::FRAC_1_SQRT_2;
/// A share of the largest average below which a node has none: rounding of the transforms.
pub(super) const LEAST_AVERAGE: f64 = 1e-9;
/// Most steps to the nearest frame, and the change at which they end.
const STEPS: usize = 60;
const CHANGE: f64 = 1e-10;
/// The relative difference of two such sums that is more than rounding.
const BETTER: f64 = 1e-9;
/// The share of the greatest sum that there can be above which a frame is taken as found: halfway between two it is two thirds.
const CLEAR: f64 = 0.9;

/// A smoothing length, and the weight of each node's own value.
#[derive(Clone, Copy)]
pub(super) struct Smoothing<'a> {
    /// ℓ, mm.
    pub length: f64,
    /// The length that is asked for, mm, if one is: frames that are aligned with a surface are averaged without as well.
    pub asked: Option<f64>,
    /// From 0 to 1: less outside the region.
    pub weight: &'a [f64],
}

impl Smoothing<'_> {
    /// The averages of several components of each node, the component that a node has multiplied by its weight.
    pub fn averages<const N: usize>(&self, grid: &PhaseGrid, values: &[[f64; N]]) -> Vec<[f64; N]> {
        let (poisson, shift) = (Poisson::new(*grid), 1.0 / (self.length * self.length));
        let mut out = vec![[0.0; N]; values.len()];
        let mut one = Vec::with_capacity(values.len());
        for c in 0..N {
            checkpoint();
            one.clear();
            one.extend(values.iter().zip(self.weight).map(|(v, w)| v[c] * w * shift));
            poisson.solve(&mut one, shift);
            out.iter_mut().zip(&one).for_each(|(o, v)| o[c] = *v);
        }
        out
    }

    /// What averages stresses before their directions are taken.
    pub fn of_stresses(&self) -> Option<Self> {
        self.asked.map(|length| Smoothing { length: OF_STRESS * length, ..*self })
    }

    /// Tensors at the nodes, averaged; zero where nothing is left of the weights.
    pub fn tensors(&self, grid: &PhaseGrid, of: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let own: Vec<[f64; 7]> = of.iter().map(|s| core::array::from_fn(|c| if c < 6 { s[c] } else { 1.0 })).collect();
        let all = self.averages(grid, &own);
        let least = LEAST_AVERAGE * all.iter().fold(0.0f64, |m, s| m.max(s[6]));
        let mean = |s: &[f64; 7]| core::array::from_fn(|c| if s[6] > least { s[c] / s[6] } else { 0.0 });
        all.iter().map(mean).collect()
    }

    /// The tensors v vᵀ (11, 22, 33, 23, 13, 12) of axes, averaged.
    pub fn axes(&self, grid: &PhaseGrid, tensors: &[[f64; 6]]) -> Vec<[f64; 6]> {
        self.averages(grid, tensors)
    }

    /// The frames at the nodes, averaged.
    pub fn frames(&self, grid: &PhaseGrid, frame: impl Fn(usize) -> Octahedral) -> Averages {
        let own: Vec<[f64; 10]> = (0..grid.len()).map(|n| frame(n).0).collect();
        let all = self.averages(grid, &own);
        let most = all.iter().fold(0.0f64, |m, q| m.max(q[9]));
        let whole = self.averages(grid, &vec![[1.0]; own.len()]).into_iter().map(|[w]| w).collect();
        Averages { all, whole, least: LEAST_AVERAGE * most }
    }
}

/// Averaged frames at the nodes of a grid.
pub(super) struct Averages {
    all: Vec<[f64; 10]>,
    /// The averages if all nodes were sure.
    whole: Vec<f64>,
    least: f64,
}

impl Averages {
    /// The sum of the confidences about a node: the larger, the surer its frame.
    pub fn confidence(&self, node: usize) -> f64 {
        self.all[node][9]
    }

    /// The mean confidence about each node, from 0 to 1.
    pub fn trust(&self) -> Vec<f64> {
        let share = |(q, w): (&[f64; 10], &f64)| if q[9] > self.least { (q[9] / w).clamp(0.0, 1.0) } else { 0.0 };
        self.all.iter().zip(&self.whole).map(share).collect()
    }

    /// The frame of the first node.
    pub fn first(&self, node: usize) -> Mat3 {
        let q = Octahedral(self.all[node]);
        if q.0[9] > self.least { q.best() } else { IDENTITY }
    }

    /// The frame of a node that is reached from one with the frame `to`, as a direction of ascent from it.
    pub fn settled(&self, node: usize, to: &Mat3) -> Mat3 {
        let q = Octahedral(self.all[node]);
        if q.0[9] > self.least { q.nearest(to) } else { *to }
    }
}

/// Confidence in a direction whose principal values differ by this gap.
pub(super) fn trusted(gap: f64) -> f64 {
    1.0 / (1.0 + (HALF_TRUSTED / gap).powi(2))
}

/// A harmonic polynomial of degree four, by the coefficients of x⁴, x³y, x²y², xy³, y⁴, x³z, x²yz, xy²z, y³z, from which those with
/// higher powers of z follow; and the sum of the confidences of the frames that it is made of.
#[derive(Clone)]
pub(super) struct Octahedral([f64; 10]);

impl Octahedral {
    /// Of a frame, times its confidence. `gaps` are those of its principal values to the nearest other, over the greatest difference in
    /// the part.
    pub fn of(frame: &Mat3, gaps: &Vec3) -> Octahedral {
        // The axis whose value is farthest from the others, and the confidence in the other two.
        let k = (0..3).fold(0, |m, i| if gaps[i] > gaps[m] { i } else { m });
        let sure = trusted(gaps[k]);
        let pair = trusted(gaps[0].min(gaps[1]).min(gaps[2]));
        let axes = transpose(frame);
        let mut out = [0.0; 10];
        for (i, u) in axes.iter().enumerate() {
            let alone = if i == k { 1.75 * (1.0 - pair) } else { 0.0 };
            let (fourth, second) = (fourth_power(*u), second_power(*u));
            for c in 0..9 {
                out[c] += (pair + alone) * fourth[c] - if i == k { 1.5 * (1.0 - pair) * second[c] } else { 0.0 };
            }
        }
        let radial = 0.15 * (1.0 - pair) - 0.6 * pair;
        (out[0], out[2], out[4]) = (out[0] + radial, out[2] + 2.0 * radial, out[4] + radial);
        out.iter_mut().for_each(|c| *c *= sure);
        out[9] = sure;
        Octahedral(out)
    }

    /// Of a frame that is sure, by its coefficients.
    pub fn sure(of: [f64; 9]) -> Octahedral {
        let mut all = [1.0; 10];
        all[..9].copy_from_slice(&of);
        Octahedral(all)
    }

    /// The first nine coefficients.
    pub fn coefficients(&self) -> [f64; 9] {
        core::array::from_fn(|c| self.0[c])
    }

    pub fn times(self, by: f64) -> Octahedral {
        Octahedral(self.0.map(|c| c * by))
    }

    pub fn plus(self, other: Octahedral) -> Octahedral {
        Octahedral(core::array::from_fn(|c| self.0[c] + other.0[c]))
    }

    /// The gradient at a position, of the polynomial plus ⅗ r⁴ times the confidence: a sum of convex polynomials.
    fn convex_gradient(&self, [x, y, z]: Vec3) -> Vec3 {
        let [a, b, c, d, e, f, g, h, i, sure] = self.0;
        // p = p₀ + p₁ z + p₂ z² + p₃ z³ + p₄ z⁴ with Δp = 0: p₂ = −Δp₀/2, p₃ = −Δp₁/6, p₄ = Δ²p₀/24.
        let (l, m, n) = (12.0 * a + 2.0 * c, 6.0 * b + 6.0 * d, 12.0 * e + 2.0 * c);
        let (o, q) = (6.0 * f + 2.0 * h, 2.0 * g + 6.0 * i);
        let (zz, zzz) = (z * z, z * z * z);
        let dx = 4.0 * a * x * x * x
            + 3.0 * b * x * x * y
            + 2.0 * c * x * y * y
            + d * y * y * y
            + z * (3.0 * f * x * x + 2.0 * g * x * y + h * y * y)
            - zz * (l * x + 0.5 * m * y)
            - zzz * o / 6.0;
        let dy = b * x * x * x
            + 2.0 * c * x * x * y
            + 3.0 * d * x * y * y
            + 4.0 * e * y * y * y
            + z * (g * x * x + 2.0 * h * x * y + 3.0 * i * y * y)
            - zz * (n * y + 0.5 * m * x)
            - zzz * q / 6.0;
        let dz = f * x * x * x + g * x * x * y + h * x * y * y + i * y * y * y
            - z * (l * x * x + m * x * y + n * y * y)
            - zz * 0.5 * (o * x + q * y)
            + zzz * (l + n) / 3.0;
        let radial = 2.4 * sure * (x * x + y * y + z * z);
        [dx + radial * x, dy + radial * y, dz + radial * z]
    }

    /// The frame at which that sum is greatest of all; where several are as good, the one that is reached from the coordinate axes.
    pub fn best(&self) -> Mat3 {
        let found: Vec<Mat3> = spread().iter().map(|from| self.nearest(from)).collect();
        let better =
            |best: Mat3, next: &Mat3| if self.sum(next) > self.sum(&best) * (1.0 + BETTER) { *next } else { best };
        let best = found[1..].iter().fold(found[0], better);
        nearest(&best, &IDENTITY, &cube())
    }

    /// The frame that is reached from another, or the best where that is not nearly a frame of these axes, as halfway between two: of those
    /// alike the one nearest to the other.
    pub fn settled(&self, like: &Mat3) -> Mat3 {
        let found = self.nearest(like);
        if self.sum(&found) > CLEAR * 3.0 * self.0[9] { found } else { nearest(&self.best(), like, &cube()) }
    }

    /// The sum over the axes of a frame of the polynomial and ⅗ r⁴ times the confidence: thrice the confidence at a frame that it is of.
    fn sum(&self, f: &Mat3) -> f64 {
        transpose(f).iter().map(|u| 0.25 * dot(*u, self.convex_gradient(*u))).sum()
    }

    /// The frame at which the sum of the polynomial over its axes is greatest, from a first one on: axes go to their gradients, made
    /// orthonormal, which does not lower the sum of a convex function. Near the end each step cubes the error of a single frame.
    pub fn nearest(&self, to: &Mat3) -> Mat3 {
        let mut axes = transpose(to);
        for _ in 0..STEPS {
            let next = orthonormal(axes.map(|u| self.convex_gradient(u)));
            let change: f64 = (0..3).map(|i| norm(sub(next[i], axes[i]))).sum();
            // Not where the gradients span no frame.
            if change.is_nan() {
                break;
            }
            axes = next;
            if change < CHANGE {
                break;
            }
        }
        // Far from the end a step can take two axes past each other; the sum does not know a left-handed frame from a right-handed one.
        let hand = determinant(&axes).signum();
        transpose(&axes.map(|u| scale(u, hand)))
    }
}

/// Frames such that every frame is within 32 degrees of one of them or of one that a cube cannot tell from it: the axes themselves, turned
/// by 45 degrees about one of them, and by 60 about a diagonal of the cube.
fn spread() -> Vec<Mat3> {
    let about_axes = [[45.0, 0.0, 0.0], [0.0, 45.0, 0.0], [0.0, 0.0, 45.0]].map(rotation);
    let diagonals = [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]];
    // By 60 degrees about (1, 1, 1)/√3: 2/3 on the diagonal, then -1/3 and 2/3 in turn.
    let about_diagonals = diagonals.map(|d| {
        core::array::from_fn(|i| {
            core::array::from_fn(|j| if i == j { 2.0 } else if (i + 1) % 3 == j { -1.0 } else { 2.0 } * d[i] * d[j] / 3.0)
        })
    });
    [IDENTITY].into_iter().chain(about_axes).chain(about_diagonals).collect()
}

/// The orthonormal matrix nearest to one, given and returned by rows, by Newton's iteration; NaN for a singular one.
fn orthonormal(m: Mat3) -> Mat3 {
    let size = m.as_flattened().iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let mut x = m.map(|row| scale(row, 1.0 / size));
    for _ in 0..40 {
        let inverse = 0.5 / determinant(&x);
        let cofactors = [cross(x[1], x[2]), cross(x[2], x[0]), cross(x[0], x[1])];
        let next = [0, 1, 2].map(|i| add(scale(x[i], 0.5), scale(cofactors[i], inverse)));
        let change: f64 = (0..3).map(|i| norm(sub(next[i], x[i]))).sum();
        x = next;
        if change.is_nan() || change <= 1e-12 {
            break;
        }
    }
    x
}

/// (u·x)⁴ by its first nine coefficients.
fn fourth_power([a, b, c]: Vec3) -> [f64; 9] {
    let (aa, bb) = (a * a, b * b);
    [
        aa * aa,
        4.0 * aa * a * b,
        6.0 * aa * bb,
        4.0 * a * b * bb,
        bb * bb,
        4.0 * aa * a * c,
        12.0 * aa * b * c,
        12.0 * a * bb * c,
        4.0 * b * bb * c,
    ]
}

/// r² (u·x)² likewise.
fn second_power([a, b, c]: Vec3) -> [f64; 9] {
    let (ab, ac, bc) = (2.0 * a * b, 2.0 * a * c, 2.0 * b * c);
    [a * a, ab, a * a + b * b, ab, b * b, ac, bc, ac, bc]
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::product;

    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut s = seed;
        move || geometry::random::random(&mut s)
    }

    fn angles(random: &mut impl FnMut() -> f64) -> Vec3 {
        [0; 3].map(|_| 180.0 * random())
    }

    /// The polynomial in the frame's own coordinates.
    fn direct(frame: &Mat3, gaps: &Vec3, x: Vec3) -> f64 {
        let k = (0..3).fold(0, |m, i| if gaps[i] > gaps[m] { i } else { m });
        let (sure, pair) = (trusted(gaps[k]), trusted(gaps.iter().copied().fold(1.0, f64::min)));
        let c = transpose(frame).map(|u| dot(u, x));
        let r2 = dot(x, x);
        let cubic = c.iter().map(|v| v.powi(4)).sum::<f64>() - 0.6 * r2 * r2;
        let about = 1.75 * c[k].powi(4) - 1.5 * r2 * c[k] * c[k] + 0.15 * r2 * r2;
        sure * (pair * cubic + (1.0 - pair) * about) + 0.6 * sure * r2 * r2
    }

    #[test]
    fn the_polynomial_is_that_of_the_frame() {
        let mut random = numbers(5);
        for _ in 0..200 {
            let frame = rotation(angles(&mut random));
            let gaps = [random().abs(), random().abs(), random().abs()];
            let q = Octahedral::of(&frame, &gaps);
            let x = [random(), random(), random()];
            // Of degree four: x · gradient is four times the value.
            assert!((dot(x, q.convex_gradient(x)) / 4.0 - direct(&frame, &gaps, x)).abs() < 1e-13);
            // And the gradient is that of the value.
            for a in 0..3 {
                let moved = |by: f64| {
                    let mut y = x;
                    y[a] += by;
                    direct(&frame, &gaps, y)
                };
                let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((slope - q.convex_gradient(x)[a]).abs() < 1e-8);
            }
        }
    }

    /// From any frame less than 30 degrees away the frame itself is found; of a single axis that axis alone, by the least turn.
    #[test]
    fn a_frame_is_found_again_and_an_axis_leaves_the_rest() {
        let mut random = numbers(11);
        for _ in 0..300 {
            let frame = rotation(angles(&mut random));
            let turn = rotation([0; 3].map(|_| 17.0 * random()));
            let from = product(&turn, &frame);
            let found = Octahedral::of(&frame, &[1.0, 0.8, 0.9]).nearest(&from);
            let off = |a: &Mat3, b: &Mat3| (0..3).map(|i| norm(sub(a[i], b[i]))).fold(0.0, f64::max);
            assert!(off(&found, &frame) < 1e-9, "{found:?} {frame:?}");
            let found = Octahedral::of(&frame, &[1.0, 0.0, 0.0]).nearest(&from);
            let [axis, was] = [&found, &frame].map(|f| transpose(f)[0]);
            assert!(norm(sub(axis, was)) < 1e-9);
            assert!(off(&found, &from) < 2.0 * off(&from, &frame) + 1e-9);
            assert!((determinant(&found) - 1.0).abs() < 1e-12);
        }
    }

    /// Without a first frame one is found too, halfway between the axes as well, and from any other the one of those alike that is near.
    #[test]
    fn a_frame_is_found_from_anywhere() {
        let mut random = numbers(17);
        let halfway = [[45.0, 0.0, 0.0], [0.0, 45.0, 0.0], [0.0, 0.0, 45.0], [45.0, 45.0, 0.0], [45.0, 35.0, 45.0]];
        let all: Vec<Vec3> = (0..300).map(|_| angles(&mut random)).chain(halfway).collect();
        for angles in all {
            let frame = rotation(angles);
            let q = Octahedral::of(&frame, &[1.0; 3]);
            let q = Octahedral::sure(q.coefficients());
            let off = |a: &Mat3, b: &Mat3| (0..3).map(|i| norm(sub(a[i], b[i]))).fold(0.0, f64::max);
            let found = q.best();
            let alike = nearest(&frame, &found, &cube());
            assert!(off(&found, &alike) < 1e-8, "{angles:?}: {found:?} {alike:?}");
            let like = rotation([0; 3].map(|_| 180.0 * random()));
            for like in [IDENTITY, like] {
                let found = q.settled(&like);
                assert!((determinant(&found) - 1.0).abs() < 1e-9, "{angles:?}: {found:?}");
                assert!(off(&found, &nearest(&frame, &found, &cube())) < 1e-8, "{angles:?}: {found:?}");
            }
        }
    }
}
