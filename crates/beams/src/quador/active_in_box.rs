//! The half-beams of a hub that can be active in a box: where they are one or two, N takes a few operations.
//!
//! With half-beams i and j alone N is that of all, at every position of a box, if no other half-beam k has G above Ry there: of
//! i alone (G_k < τ_ik G_i), of j alone where it can have the larger G, and of both. These differences are affine functions of the
//! position, so their maxima over a box are exact.

use geometry::math::{Vec3, dot, scale, sub};

use super::hub::{AffineFunction, Hub};
use super::smooth_union::{ROUNDING, largest};

/// Bound of the rounding of an affine function and of its maximum, relative to the sum of its terms' magnitudes.
const SLACK: f64 = 1e-12;

/// The half-beams that can be active in a box, by their numbers in the hub.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum ActiveInBox {
    /// None: there the hub is its ball.
    None,
    /// This one, with a positive G throughout.
    One(usize),
    /// One of these two or both, in ascending order; the larger G is positive throughout.
    Two(usize, usize),
    /// Any.
    Any,
}

/// A box in the frame of a hub: its centre and half its edges.
#[derive(Clone, Copy)]
pub(super) struct Around {
    pub at: Vec3,
    pub half: Vec3,
}

impl Around {
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

impl Hub<'_> {
    /// The half-beams that can be active in a box, of those that can be in a box around it.
    pub(super) fn active_in_box(&self, outer: ActiveInBox, around: &Around) -> ActiveInBox {
        match outer {
            ActiveInBox::Any => self.with_g(around.at, |g| self.active_of_all(largest(g), around)),
            ActiveInBox::Two(i, j) if self.is_alone(i, j, around) => ActiveInBox::One(i),
            ActiveInBox::Two(i, j) if self.is_alone(j, i, around) => ActiveInBox::One(j),
            _ => outer,
        }
    }

    /// Whether half-beam k is surely not active where i alone is, and smaller.
    #[inline]
    fn is_below(&self, k: usize, i: usize, around: &Around) -> bool {
        let (of, leader) = (&self.g[k], &self.g[i]);
        around.is_negative(&of.plus(-self.tau(i, k), leader), &[of, leader], 1.0)
    }

    #[inline]
    fn is_positive(&self, i: usize, around: &Around) -> bool {
        let g = &self.g[i];
        around.is_negative(&AffineFunction { a: scale(g.a, -1.0), b: -g.b }, &[g], 1.0)
    }

    #[inline]
    fn is_alone(&self, i: usize, other: usize, around: &Around) -> bool {
        self.is_positive(i, around) && self.is_below(other, i, around)
    }

    fn active_of_all(&self, (first, most): (usize, f64), around: &Around) -> ActiveInBox {
        if most <= 0.0 {
            let all = self.g.iter().all(|g| around.is_negative(g, &[g], 1.0));
            return if all { ActiveInBox::None } else { ActiveInBox::Any };
        }
        if !self.is_positive(first, around) {
            return ActiveInBox::Any;
        }
        let all = 0..self.g.len();
        let mut above = all.clone().filter(|k| *k != first && !self.is_below(*k, first, around));
        let Some(second) = above.next() else {
            return ActiveInBox::One(first);
        };
        if above.next().is_some() {
            return ActiveInBox::Any;
        }
        let (of, with) = (&self.g[first], &self.g[second]);
        let leads = !around.is_negative(&with.plus(-1.0, of), &[with, of], 1.0);
        let tau = self.tau(first, second);
        // y of the second of the two.
        let large = 1.0 / ((1.0 - tau) * (1.0 + tau));
        let y = (!self.sharp()).then(|| AffineFunction::default().plus(large, &with.plus(-tau, of)));
        let apart = all.filter(|k| *k != first && *k != second).all(|k| {
            let g = &self.g[k];
            (!leads || self.is_below(k, second, around))
                && y.is_none_or(|y| {
                    let (own, other) = (self.tau(k, first), self.tau(k, second));
                    let over = g.plus(-own, &of.plus(-tau, &y)).plus(-other, &y);
                    around.is_negative(&over, &[g, of, with], 2.0 * large)
                })
        });
        if apart { ActiveInBox::Two(first.min(second), first.max(second)) } else { ActiveInBox::Any }
    }

    /// N where only two half-beams with these G can be active.
    #[inline]
    pub(super) fn union_of_two(tau: f64, p: f64, q: f64) -> f64 {
        let (most, other) = if q > p { (q, p) } else { (p, q) };
        let over = other - tau * most;
        if over > ROUNDING * most {
            let with = over / ((1.0 - tau) * (1.0 + tau));
            (most - tau * with) * most + with * other
        } else {
            most * most
        }
    }

    /// S − N and its gradient at x, where only these half-beams can be active, and an upper bound of half the second derivative of N.
    #[inline]
    pub(super) fn gradient_of(&self, active: ActiveInBox, x: Vec3, curvature: f64) -> (f64, Vec3, f64) {
        let s = dot(x, x) - self.radius * self.radius;
        match active {
            ActiveInBox::None => (s, scale(x, 2.0), 0.0),
            ActiveInBox::One(i) => {
                let g = &self.g[i];
                let y = g.at(x);
                (s - y * y, sub(scale(x, 2.0), scale(g.a, 2.0 * y)), dot(g.a, g.a))
            }
            _ => {
                let (value, gradient) = self.gradient(x);
                (value, gradient, curvature)
            }
        }
    }
}
