//! Stresses of one load case or several, and their principal directions.
//!
//! Several tensors σ with weights w rarely have principal directions in common. Those of their mean are the frame e₁, e₂, e₃ in which
//! the mean square of the shear stresses is least: as Σ w σ:σ is the same in all frames, Σ w Σ_k (e_k·σ e_k)² is greatest there. Neither
//! the sign of a stress nor the order of its principal values comes in, so opposite loads do not cancel, and three loads along x, y, z have
//! these as their directions, where any one tensor made of them is the same in all directions. Twice the strain energy of a cubic
//! material is S₁₂ (tr σ)² + ½ S₄₄ σ:σ + (S₁₁ − S₁₂ − ½ S₄₄) Σ_k σ_kk² in its own axes: for cells of cubic symmetry that are stiffest
//! along their axes the frame has the least mean strain energy over all cases.
//!
//! The frame is found by turns in the planes of two axes, each the best one there (Cardoso and Souloumiac, *Jacobi angles for simultaneous
//! diagonalization*, SIAM J. Matrix Anal. Appl. 17, 1996), from the principal directions of each case; the best of these counts.

use rayon::prelude::*;

use super::grade_values::grade_values;
use super::principal::{Principal, matrix};
use crate::grade::Grade;
use crate::kind::Kind;
use geometry::fault::{Fault, number};
use geometry::math::{Mat3, Vec3, angle_turns, product, sin_cos_turns, transpose};

/// Most rounds of turns, and the turn at which they end.
const ROUNDS: usize = 60;
const CHANGE: f64 = 1e-12;
/// A share of the sum of squares by which it has to vary with the frame, or to grow for another frame: above its rounding.
const ROUNDING: f64 = 1e-12;

/// What counts of several load cases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(noun = "choice")]
pub enum CasesBy {
    /// All: the directions in which the mean square of the shear stresses is least.
    #[default]
    Mean,
    /// At each point the one of the greatest absolute principal value, times its weight.
    Worst,
}

/// A stress tensor, of one load case or several.
#[derive(Clone)]
pub struct Stress {
    /// Those of positive weight: the components 11, 22, 33, 23, 13, 12 and the weight over the greatest.
    cases: Vec<([Grade; 6], f64)>,
    by: CasesBy,
}

impl From<[Grade; 6]> for Stress {
    fn from(of: [Grade; 6]) -> Stress {
        Stress { cases: vec![(of, 1.0)], by: CasesBy::Mean }
    }
}

impl Stress {
    /// Of several cases, each with its weight. Cases of weight zero do not count; only ratios of weights matter.
    ///
    /// # Errors
    /// No weight above 0; weights that are negative or not finite.
    pub fn new(cases: Vec<([Grade; 6], f64)>, by: CasesBy) -> Result<Stress, Fault> {
        if let Some((i, (_, w))) = cases.iter().enumerate().find(|(_, (_, w))| !(*w >= 0.0 && w.is_finite())) {
            let message = format!("weight is {}; it must be a finite number from 0 up", number(*w));
            return Err(Fault::new(format!("weights[{i}]"), message));
        }
        let most = cases.iter().map(|(_, w)| *w).fold(0.0, f64::max);
        if most == 0.0 {
            return Err(Fault::new("weights", "all weights are 0; give at least one case a weight above 0"));
        }
        let counted = cases.into_iter().filter(|(_, w)| *w > 0.0);
        Ok(Stress { cases: counted.map(|(of, w)| (of, w / most)).collect(), by })
    }

    /// Whether it is the same everywhere.
    pub(super) fn is_constant(&self) -> bool {
        self.cases.iter().all(|(of, _)| of.iter().all(|g| g.constant().is_some()))
    }

    /// The tensors of each case at points.
    pub(super) fn tensors(&self, points: &[Vec3]) -> Result<Vec<Vec<[f64; 6]>>, Fault> {
        self.cases.iter().map(|(of, _)| grade_values(of, points, "stress")).collect()
    }

    /// The principal directions at points.
    pub(super) fn principal(&self, points: &[Vec3]) -> Result<Vec<Principal>, Fault> {
        self.tensors(points).map(|all| self.directions(&all))
    }

    /// The principal directions of the tensors of each case.
    pub(super) fn directions(&self, all: &[Vec<[f64; 6]>]) -> Vec<Principal> {
        if let [one] = all {
            return one.par_iter().map(Principal::of).collect();
        }
        let weights = || self.cases.iter().map(|(_, w)| *w);
        let at = |n: usize| match self.by {
            CasesBy::Mean => common(&all.iter().zip(weights()).map(|(of, w)| (of[n], w)).collect::<Vec<_>>()),
            CasesBy::Worst => worst(all.iter().zip(weights()).map(|(of, w)| of[n].map(|v| w * v))),
        };
        (0..all[0].len()).into_par_iter().map(at).collect()
    }
}

/// The principal directions of the tensor of the greatest absolute value; the first of equal ones.
fn worst(tensors: impl Iterator<Item = [f64; 6]>) -> Principal {
    let found = tensors.map(|t| Principal::of(&t));
    found.reduce(|a, b| if b.greatest > a.greatest { b } else { a }).unwrap_or_else(|| Principal::of(&[0.0; 6]))
}

/// The frame of several weighted tensors. Two directions are apart by the root of what the mean square of the difference of their values
/// falls by where they turn by an eighth; of one tensor that is the difference itself.
fn common(tensors: &[([f64; 6], f64)]) -> Principal {
    let all: f64 = tensors.iter().map(|(_, w)| w).sum();
    let weighted: Vec<(Mat3, f64)> = tensors.iter().map(|(t, w)| (matrix(t), w / all)).collect();
    let own: Vec<Principal> = tensors.iter().map(|(t, _)| Principal::of(t)).collect();
    let mut best = RotatedTensors::from(&own[0].frame, &weighted);
    for p in &own[1..] {
        let next = RotatedTensors::from(&p.frame, &weighted);
        if next.score() > (1.0 + ROUNDING) * best.score() {
            best = next;
        }
    }
    let sizes: f64 = own.iter().zip(&weighted).map(|(p, (_, w))| w * p.greatest * p.greatest).sum();
    Principal {
        frame: best.frame,
        values: best.squares().map(f64::sqrt),
        apart: [0, 1, 2].map(|i| {
            let [a, _, c] = best.moments((i + 1) % 3, (i + 2) % 3);
            (a - c).max(0.0).sqrt()
        }),
        greatest: sizes.sqrt(),
    }
}

/// A frame, and weighted tensors in its coordinates.
struct RotatedTensors {
    frame: Mat3,
    tensors: Vec<(Mat3, f64)>,
}

impl RotatedTensors {
    /// The frame that turns in its planes do not improve, from a first one on.
    fn from(first: &Mat3, tensors: &[(Mat3, f64)]) -> RotatedTensors {
        let back = transpose(first);
        let seen = tensors.iter().map(|(t, w)| (product(&back, &product(t, first)), *w));
        let mut made = RotatedTensors { frame: *first, tensors: seen.collect() };
        for _ in 0..ROUNDS {
            let most = [[1, 2], [0, 2], [0, 1]].map(|[k, l]| made.improve(k, l)).into_iter().fold(0.0, f64::max);
            if most < CHANGE {
                break;
            }
        }
        made
    }

    /// Makes the best turn in the plane of two axes; its angle, in turns.
    fn improve(&mut self, k: usize, l: usize) -> f64 {
        let [a, b, c] = self.moments(k, l);
        let (along, across) = (a - c, 2.0 * b);
        if along.hypot(across) <= ROUNDING * (a + c) {
            return 0.0;
        }
        // The sum is ½ (a + c) + ½ (a − c) cos 4θ + b sin 4θ.
        let angle = angle_turns(across, along) / 4.0;
        let (sine, cosine) = sin_cos_turns(angle);
        let turned = |a: f64, b: f64| (cosine * a + sine * b, cosine * b - sine * a);
        let columns = |m: &mut Mat3| m.iter_mut().for_each(|row| (row[k], row[l]) = turned(row[k], row[l]));
        columns(&mut self.frame);
        for (t, _) in &mut self.tensors {
            columns(t);
            (0..3).for_each(|j| (t[k][j], t[l][j]) = turned(t[k][j], t[l][j]));
        }
        angle.abs()
    }

    /// The weighted means of d², d s, s² with d = σ_kk − σ_ll and s = 2 σ_kl: turned by θ, d becomes d cos 2θ + s sin 2θ.
    fn moments(&self, k: usize, l: usize) -> [f64; 3] {
        self.tensors.iter().fold([0.0; 3], |[a, b, c], (t, w)| {
            let (d, s) = (t[k][k] - t[l][l], 2.0 * t[k][l]);
            [a + w * d * d, b + w * d * s, c + w * s * s]
        })
    }

    /// The weighted mean of the squares of the stress along each axis.
    fn squares(&self) -> Vec3 {
        [0, 1, 2].map(|k| self.tensors.iter().map(|(t, w)| w * t[k][k] * t[k][k]).sum())
    }

    fn score(&self) -> f64 {
        self.squares().iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::cube_rotations::cube;
    use super::*;
    use geometry::math::{IDENTITY, rotation};
    use geometry::random::random;

    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut s = seed;
        move || random(&mut s)
    }

    /// The components of R T Rᵀ.
    fn turned(r: &Mat3, t: &[f64; 6]) -> [f64; 6] {
        let m = product(r, &product(&matrix(t), &transpose(r)));
        [m[0][0], m[1][1], m[2][2], m[1][2], m[0][2], m[0][1]]
    }

    fn found(by: CasesBy, cases: &[([f64; 6], f64)]) -> Principal {
        let of = cases.iter().map(|(t, w)| (t.map(Grade::Constant), *w)).collect();
        Stress::new(of, by).expect("cases").principal(&[[0.0; 3]]).expect("finite")[0]
    }

    /// The sine of half the angle between two frames, but for the turns of a cube.
    fn apart(a: &Mat3, b: &Mat3) -> f64 {
        let between = product(&transpose(a), b);
        let off = |t: &Mat3| {
            let pairs = between.as_flattened().iter().zip(t.as_flattened());
            (pairs.map(|(x, y)| (x - y).powi(2)).sum::<f64>() / 8.0).sqrt()
        };
        cube().iter().map(off).fold(f64::INFINITY, f64::min)
    }

    /// Tensors in random axes with weights.
    fn random_cases(count: usize, next: &mut impl FnMut() -> f64) -> Vec<([f64; 6], f64)> {
        (0..count).map(|_| ([0; 6].map(|_| next()), 0.2 + next().abs())).collect()
    }

    /// How far two frames may be apart: the angle of a maximum is known to the rounding of the values over its curvature, and to the
    /// last turn that was made.
    fn within(p: &Principal) -> f64 {
        let least = p.apart.into_iter().fold(f64::INFINITY, f64::min) / p.greatest;
        1e-9 + 1e-11 / (least * least)
    }

    fn same(a: &Principal, b: &Principal) {
        assert!(apart(&a.frame, &b.frame) < within(a), "{:?} {:?} {}", a.frame, b.frame, within(a));
        let sorted = |v: Vec3| {
            let mut v = v;
            v.sort_by(f64::total_cmp);
            v
        };
        let close = |a: Vec3, b: Vec3| sorted(a).iter().zip(sorted(b)).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(close(a.apart, b.apart) && (a.greatest - b.greatest).abs() < 1e-12, "{:?} {:?}", a.apart, b.apart);
    }

    #[test]
    fn one_case_is_its_tensor_whatever_its_weight() {
        let mut next = numbers(3);
        for _ in 0..100 {
            let ([tensor, other], w) = ([0; 2].map(|_| [0; 6].map(|_| next())), 3.0 * next().abs() + 0.1);
            let plain = Stress::from(tensor.map(Grade::Constant)).principal(&[[0.0; 3]]).expect("finite")[0];
            for by in [CasesBy::Mean, CasesBy::Worst] {
                // Cases of weight 0 do not count.
                for cases in [&[(tensor, w)][..], &[(other, 0.0), (tensor, w)]] {
                    let one = found(by, cases);
                    assert_eq!(
                        (one.frame, one.values, one.apart, one.greatest),
                        (plain.frame, plain.values, plain.apart, plain.greatest)
                    );
                }
            }
        }
    }

    #[test]
    fn neither_signs_nor_order_nor_a_common_factor_of_weights_come_in() {
        let mut next = numbers(5);
        for count in [1, 2, 3, 5] {
            for _ in 0..40 {
                let cases = random_cases(count, &mut next);
                let first = found(CasesBy::Mean, &cases);
                // Opposite loads, in another order.
                let both = cases.iter().rev().chain(&cases);
                let signs: Vec<_> =
                    both.enumerate().map(|(i, (t, w))| (t.map(|v| if i < count { -v } else { v }), *w)).collect();
                same(&first, &found(CasesBy::Mean, &signs));
                // A case that is given twice has twice the weight.
                let twice: Vec<_> = cases.iter().chain(&cases[..1]).copied().collect();
                let heavy: Vec<_> =
                    cases.iter().enumerate().map(|(i, (t, w))| (*t, if i == 0 { 14.0 * w } else { 7.0 * w })).collect();
                same(&found(CasesBy::Mean, &twice), &found(CasesBy::Mean, &heavy));
            }
        }
    }

    #[test]
    fn what_turns_all_cases_turns_the_frame() {
        let mut next = numbers(7);
        for by in [CasesBy::Mean, CasesBy::Worst] {
            for _ in 0..60 {
                let cases = random_cases(3, &mut next);
                let r = rotation([0; 3].map(|_| 180.0 * next()));
                let moved: Vec<_> = cases.iter().map(|(t, w)| (turned(&r, t), *w)).collect();
                let (was, is) = (found(by, &cases), found(by, &moved));
                same(&Principal { frame: product(&r, &was.frame), ..was }, &is);
            }
        }
    }

    /// The strain energy of a cubic material whose shear compliance is above that of an isotropic one is nowhere less than in the frame, nor
    /// is the mean square of the shear stresses; the reference is the sum over components in the material's axes.
    #[test]
    fn no_frame_has_less_strain_energy() {
        let mut next = numbers(11);
        for count in [1, 2, 4, 7] {
            for _ in 0..20 {
                let cases = random_cases(count, &mut next);
                let [s11, s12] = [1.0, -0.3];
                let s44 = 2.0 * (s11 - s12) * (1.05 + next().abs());
                let energy = |frame: &Mat3| {
                    let each = cases.iter().map(|(t, w)| {
                        let [x, y, z, yz, xz, xy] = turned(&transpose(frame), t);
                        let normal = s11 * (x * x + y * y + z * z) + 2.0 * s12 * (x * y + y * z + z * x);
                        w * (normal + s44 * (yz * yz + xz * xz + xy * xy))
                    });
                    each.sum::<f64>()
                };
                let least = energy(&found(CasesBy::Mean, &cases).frame);
                for _ in 0..200 {
                    assert!(energy(&rotation([0; 3].map(|_| 180.0 * next()))) > least * (1.0 - 1e-12));
                }
            }
        }
    }

    /// Loads along x, y, z in turn: no tensor made of these has directions, their frame has. A difference of values is 1 in two of three
    /// cases.
    #[test]
    fn loads_along_three_axes_have_these_as_directions() {
        let along = |a: usize| (core::array::from_fn(|c| if c == a { 1.0 } else { 0.0 }), 1.0);
        let p = found(CasesBy::Mean, &[along(0), along(1), along(2)]);
        assert!(apart(&p.frame, &IDENTITY) < 1e-12);
        assert!(p.apart.iter().all(|d| (d - (2.0f64 / 3.0).sqrt()).abs() < 1e-12), "{:?}", p.apart);
        // Two uniaxial loads of equal size at 45 degrees: with all turns about their normal they are equally far from cells.
        let two = found(CasesBy::Mean, &[along(0), ([0.5, 0.5, 0.0, 0.0, 0.0, 0.5], 1.0)]);
        assert!(two.gaps().iter().filter(|g| **g > 1e-6).count() == 1, "{:?}", two.apart);
    }

    #[test]
    fn the_worst_case_is_the_one_that_dominates() {
        let mut next = numbers(13);
        for _ in 0..100 {
            let [small, large] = [0; 2].map(|_| [0; 6].map(|_| next()));
            let [a, b] = [&small, &large].map(|t| Principal::of(t).greatest);
            // Its weight makes it the greater one by a hundredth.
            let p = found(CasesBy::Worst, &[(small, 1.0), (large, 1.01 * a / b)]);
            let alone = Principal::of(&large);
            same(
                &Principal {
                    apart: alone.apart.map(|d| d * p.greatest / alone.greatest),
                    greatest: p.greatest,
                    ..alone
                },
                &p,
            );
        }
    }

    #[test]
    fn weights_that_leave_nothing_are_refused() {
        let case = |w: f64| ([1.0, 0.0, 0.0, 0.0, 0.0, 0.0].map(Grade::Constant), w);
        let at = |of: &[f64]| Stress::new(of.iter().map(|w| case(*w)).collect(), CasesBy::Mean).err().map(|f| f.at);
        assert_eq!(at(&[0.0, 0.0]).as_deref(), Some("weights"));
        assert_eq!(at(&[1.0, -0.1]).as_deref(), Some("weights[1]"));
        assert_eq!(at(&[f64::NAN]).as_deref(), Some("weights[0]"));
        assert_eq!(at(&[]).as_deref(), Some("weights"));
        assert_eq!(at(&[0.0, 2.0]), None);
    }
}
