//! The half-beams of a hub that can be active in a box: mostly few of them, and N over these few is N.
//!
//! A half-beam whose G is negative is not active, since no τ is. Nor is half-beam k where another, i, is active alone and
//! G_k < τ_ik G_i. N is that of half-beams i and j alone if no other has G above Ry there: of i alone, of j alone where it can
//! have the larger G, and of both. These differences are affine functions of the position, so their maxima over a box are exact.

use geometry::math::{Vec3, scale};

use super::affine_function::AffineFunction;
use super::hub::Hub;
use super::smooth_union::ROUNDING;

/// Bound of the rounding of an affine function and of its maximum, relative to the sum of its terms' magnitudes.
const SLACK: f64 = 1e-12;

/// A set of half-beams of a hub: a bit for each of the first 63, and one for all others.
#[derive(Clone, Copy)]
pub(super) struct HalfBeamSet(u64);

impl HalfBeamSet {
    pub(super) const NONE: HalfBeamSet = HalfBeamSet(0);
    pub(super) const ALL: HalfBeamSet = HalfBeamSet(u64::MAX);

    pub(super) fn add(&mut self, i: usize) {
        self.0 |= 1 << i.min(63);
    }

    /// Those of `all` half-beams that it has, in ascending order.
    #[inline]
    pub(super) fn of(self, all: usize) -> impl Iterator<Item = usize> {
        let mut left = if all < 64 { self.0 & !(u64::MAX << all) } else { self.0 };
        let mut beyond = if left >> 63 == 1 { 63..all } else { 0..0 };
        left &= u64::MAX >> 1;
        core::iter::from_fn(move || {
            let i = left.trailing_zeros() as usize;
            if left == 0 {
                return beyond.next();
            }
            left &= left - 1;
            Some(i)
        })
    }
}

/// A box in the frame of a hub: its centre and half its edges.
#[derive(Clone, Copy)]
pub(super) struct CentredBox {
    pub at: Vec3,
    pub half: Vec3,
}

impl CentredBox {
    /// The largest magnitude of the change of a linear function with this gradient from the centre.
    #[inline]
    pub(super) fn reach(&self, a: Vec3) -> f64 {
        a[0].abs() * self.half[0] + a[1].abs() * self.half[1] + a[2].abs() * self.half[2]
    }

    /// Whether an affine function, a sum of `terms` times `factor` at most, is surely negative throughout.
    #[inline]
    fn is_negative(&self, f: &AffineFunction, terms: &[&AffineFunction], factor: f64) -> bool {
        let magnitude = |g: &AffineFunction| {
            let along = |i: usize| g.a[i].abs() * (self.at[i].abs() + self.half[i]);
            along(0) + along(1) + along(2) + g.b.abs()
        };
        let rounding = SLACK * factor * terms.iter().map(|g| magnitude(g)).sum::<f64>();
        f.at(self.at) + self.reach(f.a) < -rounding
    }
}

/// Half-beams of a hub by their numbers in it, in ascending order, with their G and R close together in memory.
#[derive(Default)]
pub(super) struct PackedHalfBeams {
    numbers: Vec<usize>,
    g: Vec<AffineFunction>,
    taus: Vec<f64>,
}

impl PackedHalfBeams {
    pub(super) fn set(&self) -> HalfBeamSet {
        let mut set = HalfBeamSet::NONE;
        self.numbers.iter().for_each(|i| set.add(*i));
        set
    }

    /// The hub as if it had no other half-beams that can be active.
    pub(super) fn of<'a>(&'a self, hub: &Hub<'a>) -> Hub<'a> {
        Hub { g: &self.g, taus: &self.taus, ..*hub }
    }

    /// Takes the half-beams of a set.
    pub(super) fn take(&mut self, hub: &Hub, set: HalfBeamSet) {
        self.numbers.clear();
        self.numbers.extend(set.of(hub.g.len()));
        self.gather(hub);
    }

    /// Takes the half-beams that can be active in a box, of those that can be in a box around it.
    pub(super) fn take_active(&mut self, hub: &Hub, outer: HalfBeamSet, around: &CentredBox) {
        self.numbers.clear();
        let (mut first, mut most) = (usize::MAX, f64::NEG_INFINITY);
        for i in outer.of(hub.g.len()) {
            let g = hub.g[i].at(around.at);
            if around.is_negative(&hub.g[i], &[&hub.g[i]], 1.0) {
                continue;
            }
            if g > most {
                (first, most) = (i, g);
            }
            self.numbers.push(i);
        }
        if self.numbers.len() > 1 && most > 0.0 && hub.is_positive(first, around) {
            self.keep_alone(hub, first, around);
        }
        self.gather(hub);
    }

    fn gather(&mut self, hub: &Hub) {
        self.g.clear();
        self.g.extend(self.numbers.iter().map(|i| hub.g[*i]));
        self.taus.clear();
        if !hub.sharp() && self.numbers.len() > 1 {
            for i in &self.numbers {
                self.taus.extend(self.numbers.iter().map(|j| hub.tau(*i, *j)));
            }
        }
    }

    /// Keeps one or two half-beams if they alone can be active in a box, one of them with a positive G throughout.
    fn keep_alone(&mut self, hub: &Hub, first: usize, around: &CentredBox) {
        let mut above = self.numbers.iter().copied().filter(|k| *k != first && !hub.is_below(*k, first, around));
        let (second, third) = (above.next(), above.next());
        if third.is_some() {
            return;
        }
        let rest = self.numbers.iter().copied().filter(|k| *k != first && Some(*k) != second);
        let alone = match second {
            Some(second) => hub.are_alone(first, second, rest, around),
            None => true,
        };
        if alone {
            self.numbers.retain(|k| *k == first || Some(*k) == second);
        }
    }
}

impl Hub<'_> {
    /// Whether half-beam k is surely not active where i alone is, and smaller.
    #[inline]
    fn is_below(&self, k: usize, i: usize, around: &CentredBox) -> bool {
        let (of, leader) = (&self.g[k], &self.g[i]);
        around.is_negative(&of.plus(-self.tau(i, k), leader), &[of, leader], 1.0)
    }

    #[inline]
    fn is_positive(&self, i: usize, around: &CentredBox) -> bool {
        let g = &self.g[i];
        around.is_negative(&AffineFunction { a: scale(g.a, -1.0), b: -g.b }, &[g], 1.0)
    }

    /// Whether none of `rest`, which are below `first`, is active in a box where only it and `second` can be.
    fn are_alone(
        &self,
        first: usize,
        second: usize,
        mut rest: impl Iterator<Item = usize>,
        around: &CentredBox,
    ) -> bool {
        let (of, with) = (&self.g[first], &self.g[second]);
        let leads = !around.is_negative(&with.plus(-1.0, of), &[with, of], 1.0);
        let tau = self.tau(first, second);
        // y of the second of the two.
        let large = 1.0 / ((1.0 - tau) * (1.0 + tau));
        let y = (!self.sharp()).then(|| AffineFunction::default().plus(large, &with.plus(-tau, of)));
        rest.all(|k| {
            let g = &self.g[k];
            (!leads || self.is_below(k, second, around))
                && y.is_none_or(|y| {
                    let (own, other) = (self.tau(k, first), self.tau(k, second));
                    let over = g.plus(-own, &of.plus(-tau, &y)).plus(-other, &y);
                    around.is_negative(&over, &[g, of, with], 2.0 * large)
                })
        })
    }

    /// N where only two half-beams with these G can be active.
    #[inline]
    pub(super) fn union_of_two(tau: f64, p: f64, q: f64) -> f64 {
        let (most, other) = if q > p { (q, p) } else { (p, q) };
        let most = most.max(0.0);
        let over = other - tau * most;
        if over > ROUNDING * most {
            let with = over / ((1.0 - tau) * (1.0 + tau));
            (most - tau * with) * most + with * other
        } else {
            most * most
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_gives_back_its_half_beams_and_all_from_the_64th_on_together() {
        for all in [0, 1, 10, 63, 64, 65, 90] {
            assert!(HalfBeamSet::ALL.of(all).eq(0..all), "{all}");
            let few: Vec<usize> = (0..all.min(63)).filter(|i| i % 7 == 3).collect();
            let mut set = HalfBeamSet::NONE;
            few.iter().for_each(|i| set.add(*i));
            assert!(set.of(all).eq(few.iter().copied()), "{all}");
            set.add(80);
            assert!(set.of(all).eq(few.into_iter().chain(63..all)), "{all}");
        }
    }
}
