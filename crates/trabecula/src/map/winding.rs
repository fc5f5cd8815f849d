//! Angles about lines: phases that grow by whole numbers round holes.
//!
//! The angle θ(x) about a line, in turns, is many-valued: round the line it grows by one, and phases are periodic, so whole steps of it
//! do not show. About a bent line it is its solid angle over 4π, the sum over its segments of those of a strip that goes to infinity on
//! one side (van Oosterom and Strackee, The solid angle of a plane triangle, IEEE Trans. Biomed. Eng. 30, 1983); ∇θ is the field of
//! a current along the line (Biot and Savart).

use core::f64::consts::{PI, TAU};

use multiversion::multiversion;

use crate::field::Block;
use geometry::math::{Aabb, Mat3, Vec3, across, add, angle_turns, cross, dot, norm, scale, sub, unit};

/// Distances from a line below this (mm) count as this: the gradient stays finite.
const NEAR: f64 = 1e-9;
/// The direction in which the strips of bent lines go to infinity: at right angles to no edge and no face of a grid.
const ASIDE: Vec3 = [0.547_723_1, -0.316_227_9, 0.774_596_4];

/// A line round which phases grow, outside of the region.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Filament {
    /// A straight line without ends through a point: two directions across and its own.
    Straight { point: Vec3, frame: Mat3 },
    /// Through points; closed, or with ends that go on to infinity in two directions.
    Bent { points: Vec<Vec3>, ends: Option<[Vec3; 2]>, aside: Vec3 },
}

impl Filament {
    pub fn straight(point: Vec3, along: Vec3) -> Filament {
        let along = unit(along);
        let x = across(along);
        Filament::Straight { point, frame: [x, cross(along, x), along] }
    }

    pub fn bent(points: Vec<Vec3>, ends: Option<[Vec3; 2]>) -> Filament {
        Filament::Bent { points, ends, aside: unit(ASIDE) }
    }

    /// The angle at a point, turns, but for a whole number.
    #[inline(always)]
    pub fn angle(&self, p: Vec3) -> f64 {
        match self {
            Filament::Straight { point, frame } => {
                let d = sub(p, *point);
                angle_turns(dot(frame[1], d), dot(frame[0], d))
            }
            Filament::Bent { points, ends, aside } => {
                let (e, mut sum) = (*aside, 0.0);
                for [from, to] in segments(points, ends.is_none()) {
                    let (a, b) = (sub(from, p), sub(to, p));
                    let (la, lb) = (norm(a), norm(b));
                    sum += angle_turns(dot(e, cross(a, b)), la * lb + dot(a, b) + dot(a, e) * lb + dot(b, e) * la);
                }
                if let (Some([first, last]), [p0, .., p1]) = (ends, &points[..]) {
                    for (v, d, sign) in [(p0, first, -1.0), (p1, last, 1.0)] {
                        let a = sub(*v, p);
                        let la = norm(a);
                        let flat = la * (1.0 + dot(*d, e)) + dot(a, *d) + dot(a, e);
                        sum += sign * angle_turns(dot(e, cross(a, *d)), flat);
                    }
                }
                sum
            }
        }
    }

    /// Its gradient, turns per mm.
    #[inline(always)]
    pub fn gradient(&self, p: Vec3) -> Vec3 {
        match self {
            Filament::Straight { point, frame: [x, y, _] } => {
                let d = sub(p, *point);
                let (u, v) = (dot(*x, d), dot(*y, d));
                let per = 1.0 / (TAU * (u * u + v * v).max(NEAR * NEAR));
                sub(scale(*y, u * per), scale(*x, v * per))
            }
            Filament::Bent { points, ends, .. } => {
                let mut sum = [0.0; 3];
                for [from, to] in segments(points, ends.is_none()) {
                    let (a, b) = (sub(from, p), sub(to, p));
                    let (la, lb) = (norm(a), norm(b));
                    let under = la * lb * (la * lb + dot(a, b));
                    sum = add(sum, scale(cross(a, b), (la + lb) / under.max(NEAR.powi(4))));
                }
                if let (Some([first, last]), [p0, .., p1]) = (ends, &points[..]) {
                    for (v, d, sign) in [(p0, first, -1.0), (p1, last, 1.0)] {
                        let a = sub(*v, p);
                        let la = norm(a);
                        let under = la * (la + dot(a, *d));
                        sum = add(sum, scale(cross(a, *d), sign / under.max(NEAR * NEAR)));
                    }
                }
                scale(sum, 1.0 / (2.0 * TAU))
            }
        }
    }

    /// A bound of how much the gradient changes within `reach` (mm) of a point: an element of the line has the field 1/r², and that
    /// changes by at most 2/r³.
    fn change(&self, p: Vec3, reach: f64) -> f64 {
        match self {
            Filament::Straight { point, frame: [x, y, _] } => {
                let d = sub(p, *point);
                let r = dot(*x, d).hypot(dot(*y, d)).max(NEAR);
                // |1/z − 1/w| = |z − w| / |z| |w|.
                reach / (TAU * r * (r - reach).max(NEAR))
            }
            Filament::Bent { points, ends, .. } => {
                let of = |from: Vec3, to: Vec3, long: f64| {
                    let r = (to_segment(p, from, to) - reach).max(NEAR);
                    (1.0 / (PI * r * r)).min(long / (TAU * r * r * r))
                };
                let inner = segments(points, ends.is_none()).map(|[a, b]| of(a, b, norm(sub(b, a))));
                let mut sum: f64 = inner.sum();
                if let (Some([first, last]), [p0, .., p1]) = (ends, &points[..]) {
                    for (v, d) in [(p0, first), (p1, last)] {
                        // As long as anything that the ray passes.
                        let far = add(*v, scale(*d, 2.0 * (norm(sub(p, *v)) + reach)));
                        sum += of(*v, far, f64::INFINITY);
                    }
                }
                sum * reach
            }
        }
    }

    /// A point on it and its direction there, the middle of a bent one.
    pub fn place(&self) -> (Vec3, Vec3) {
        match self {
            Filament::Straight { point, frame } => (*point, frame[2]),
            Filament::Bent { points, ends, .. } => {
                let all: Vec<[Vec3; 2]> = segments(points, ends.is_none()).collect();
                let [a, b] = all.get(all.len() / 2).copied().unwrap_or_default();
                (scale(add(a, b), 0.5), unit(sub(b, a)))
            }
        }
    }
}

/// The segments between points.
#[inline(always)]
fn segments(points: &[Vec3], closed: bool) -> impl Iterator<Item = [Vec3; 2]> + '_ {
    let n = points.len();
    (0..if closed { n } else { n - 1 }).map(move |i| [points[i], points[(i + 1) % n]])
}

/// The distance of a point from a segment.
pub(super) fn to_segment(p: Vec3, from: Vec3, to: Vec3) -> f64 {
    let (d, a) = (sub(to, from), sub(p, from));
    let t = (dot(a, d) / dot(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    norm(sub(a, scale(d, t)))
}

/// A line, the cells round it along the three axes of the cell, and the greatest gradient of its angle that counts, turns per mm.
#[derive(Clone, Debug)]
struct Turn {
    filament: Filament,
    cells: Vec3,
    steepest: f64,
}

/// What phases have in addition to single-valued functions: whole numbers of cells round lines.
#[derive(Clone, Debug, Default)]
pub(super) struct Winding {
    of: Vec<Turn>,
}

impl Winding {
    /// Lines and the cells round them; those without are left out. Nearer to a line than `core` (mm), where there is no region,
    /// Jacobians do not grow further.
    pub fn new(of: impl IntoIterator<Item = (Filament, Vec3)>, core: f64) -> Winding {
        let steepest = 1.0 / (TAU * core);
        let of = of.into_iter().filter(|(_, n)| *n != [0.0; 3]);
        Winding { of: of.map(|(filament, cells)| Turn { filament, cells, steepest }).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Adds the phases at points.
    pub fn add_phases(&self, points: &[Vec3], u: &mut [Vec3]) {
        self.of.iter().for_each(|turn| phases(turn, points, u));
    }

    /// Adds the Jacobians at points.
    pub fn add_jacobians(&self, points: &[Vec3], j: &mut [Mat3]) {
        self.of.iter().for_each(|turn| jacobians(turn, points, j));
    }

    /// The Jacobian at a point.
    pub fn jacobian(&self, p: Vec3) -> Mat3 {
        let mut j = [[[0.0; 3]; 3]];
        self.add_jacobians(&[p], &mut j);
        j[0]
    }

    /// Adds the phases along row (j, k) of a block.
    pub fn add_row(&self, block: &Block, [j, k]: [usize; 2], out: &mut [Vec<f64>; 3]) {
        let yz = [block.axes[1][j], block.axes[2][k]];
        self.of.iter().for_each(|turn| row(turn, block.axes[0], yz, out));
    }

    /// The Jacobian at the middle of a box, and a bound of how much it changes in it (spectral norm).
    pub fn around(&self, b: &Aabb) -> (Mat3, f64) {
        let (center, reach) = (b.center(), norm(b.size()) / 2.0);
        let change = |t: &Turn| norm(t.cells) * t.filament.change(center, reach).min(2.0 * t.steepest);
        (self.jacobian(center), self.of.iter().map(change).sum())
    }

    /// The whole numbers to be added to the phases at one point so that they continue those at a near one, the way between which turns
    /// by less than half about each line.
    pub fn jump(&self, from: Vec3, to: Vec3) -> Vec3 {
        let each = self.of.iter().map(|t| scale(t.cells, (t.filament.angle(from) - t.filament.angle(to)).round()));
        each.fold([0.0; 3], add)
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn phases(turn: &Turn, points: &[Vec3], u: &mut [Vec3]) {
    for (u, p) in u.iter_mut().zip(points) {
        *u = add(*u, scale(turn.cells, turn.filament.angle(*p)));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn jacobians(turn: &Turn, points: &[Vec3], j: &mut [Mat3]) {
    for (j, p) in j.iter_mut().zip(points) {
        let g = turn.filament.gradient(*p);
        let g = scale(g, (turn.steepest / norm(g).max(f64::MIN_POSITIVE)).min(1.0));
        for (row, n) in j.iter_mut().zip(turn.cells) {
            *row = add(*row, scale(g, n));
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn row(turn: &Turn, xs: &[f64], [y, z]: [f64; 2], out: &mut [Vec<f64>; 3]) {
    let ([a, b, c], n) = (out, turn.cells);
    for (((x, a), b), c) in xs.iter().zip(a).zip(b).zip(c) {
        let angle = turn.filament.angle([*x, y, z]);
        *a += n[0] * angle;
        *b += n[1] * angle;
        *c += n[2] * angle;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::random::random;

    fn filaments() -> Vec<Filament> {
        let ring = (0..7).map(|i| {
            let (s, c) = (f64::from(i) / 7.0 * TAU).sin_cos();
            [4.0 * c, 3.0 * s, 0.4 * c * s]
        });
        vec![
            Filament::straight([0.3, -0.2, 1.0], [0.2, 0.5, 1.0]),
            Filament::bent(ring.collect(), None),
            Filament::bent(
                vec![[-3.0, 0.1, 0.0], [0.2, 0.0, 0.3], [0.0, 0.2, 4.0]],
                Some([[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
            ),
            Filament::bent(vec![[0.1, 0.2, -4.0], [0.1, 0.2, 4.0]], Some([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])),
        ]
    }

    fn point(seed: &mut u64) -> Vec3 {
        [0; 3].map(|_| 6.0 * random(seed))
    }

    fn wrapped(v: f64) -> f64 {
        v - v.round()
    }

    #[test]
    fn gradients_agree_with_differences_of_the_angle_wherever_it_jumps() {
        let mut seed = 5;
        for f in filaments() {
            for _ in 0..2000 {
                let p = point(&mut seed);
                let g = f.gradient(p);
                if norm(g) > 1.0 {
                    continue;
                }
                for a in 0..3 {
                    let mut q = [p, p];
                    q[0][a] -= 1e-5;
                    q[1][a] += 1e-5;
                    let d = wrapped(f.angle(q[1]) - f.angle(q[0])) / 2e-5;
                    // Second order in the step where |∇θ| ≤ 1, and the rounding of a difference.
                    assert!((d - g[a]).abs() < 1e-6, "{f:?} at {p:?}: {d} for {}", g[a]);
                }
            }
        }
    }

    /// A bent line that is straight is a straight one, and round each line an angle grows by one.
    #[test]
    fn angles_grow_by_one_round_lines() {
        let f = filaments();
        let straight = Filament::straight([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]);
        let mut seed = 8;
        let first = f[3].angle([1.0, 1.0, 1.0]) - straight.angle([1.0, 1.0, 1.0]);
        for _ in 0..500 {
            let p = point(&mut seed);
            assert!(wrapped(f[3].angle(p) - straight.angle(p) - first).abs() < 1e-9);
            assert!(
                norm(sub(f[3].gradient(p), straight.gradient(p))) < 1e-9 * (1.0 + norm(straight.gradient(p)).powi(2))
            );
        }
        for (f, n) in [(&f[0], 2), (&f[1], 1), (&f[2], 1)] {
            let (at, along) = f.place();
            let Filament::Straight { frame: [x, y, _], .. } = Filament::straight(at, along) else { continue };
            let round = |t: f64| add(at, add(scale(x, 0.5 * (TAU * t).cos()), scale(y, 0.5 * (TAU * t).sin())));
            let steps = 64 * n;
            let sum: f64 = (0..steps)
                .map(|i| wrapped(f.angle(round(f64::from(i + 1) / 64.0)) - f.angle(round(f64::from(i) / 64.0))))
                .sum();
            assert!((sum - f64::from(n)).abs() < 1e-12, "{f:?}: {sum}");
        }
    }

    #[test]
    fn no_gradient_in_a_box_is_farther_from_that_at_its_middle_than_the_bound() {
        let mut seed = 3;
        for f in filaments() {
            let w = Winding::new([(f.clone(), [0.0, 3.0, 4.0])], 0.05);
            for _ in 0..300 {
                let c = point(&mut seed);
                let b = Aabb { min: c, max: c }.grown(0.4 * (1.0 + random(&mut seed)));
                let (middle, change) = w.around(&b);
                for _ in 0..30 {
                    let p = [0, 1, 2].map(|a| c[a] + 0.5 * b.size()[a] * random(&mut seed));
                    let j = w.jacobian(p);
                    let off: Mat3 = core::array::from_fn(|i| sub(j[i], middle[i]));
                    assert!(geometry::math::spectral_norm(&off) <= change * (1.0 + 1e-9));
                }
            }
        }
    }

    #[test]
    fn rows_equal_points() {
        let axes: [Vec<f64>; 3] =
            core::array::from_fn(|a| (0..9).map(|i| f64::from(i) - 3.9 + 0.1 * a as f64).collect());
        let block = Block { axes: [&axes[0], &axes[1], &axes[2]] };
        let w = Winding::new(filaments().into_iter().map(|f| (f, [1.0, -2.0, 0.0])), 0.05);
        let mut out = [vec![0.0; 9], vec![0.0; 9], vec![0.0; 9]];
        w.add_row(&block, [4, 6], &mut out);
        for i in 0..9 {
            let mut u = [[0.0; 3]];
            w.add_phases(&[[axes[0][i], axes[1][4], axes[2][6]]], &mut u);
            assert_eq!(u[0], [out[0][i], out[1][i], out[2][i]]);
        }
    }
}
