//! A smooth step: how a weight passes from 0 to 1 across a boundary.

use super::{BuildGrade, Grade, GradeSpec, Quantity, VaryingNumber};
use crate::field::Field;
use crate::kind::{DesignError, Key, Kind};
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, scale};

/// The share of a logistic curve that is left out at either end, so that the step has ends.
const TAIL: f64 = 0.02;

/// A smooth step from 0 to 1 of another number: the logistic function, with ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Sigmoid", noun = "a smooth step")]
pub struct SigmoidKind {
    /// The number that it is a step of.
    pub(crate) of: Box<GradeSpec>,
    /// From where it is 0 to where it is 1, in the unit of the number; a negative width falls.
    width: f64,
    /// Where it is one half.
    #[kind(default = 0.0)]
    at: f64,
}

impl BuildGrade for SigmoidKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let inner = self.of.build(&Quantity::new(format!("{}.of", of.path), of.environment, Key::NONE))?;
        of.function(Sigmoid::new(inner, self.at, self.width))
    }
}

/// The logistic function of a number, 1/(1 + e^(−k (v − at))), as in equation 17 of the hybrid paper as corrected: stretched
/// by a fiftieth at either end so that it is 0 below at − width/2 and 1 above at + width/2. A negative width falls.
pub struct Sigmoid {
    of: Grade,
    at: f64,
    width: f64,
}

impl Sigmoid {
    /// The step of `of` about `at` (where it is one half) over `width`, both in the unit of `of`.
    ///
    /// # Errors
    /// Numbers that are not finite; a width of 0.
    pub fn new(of: Grade, at: f64, width: f64) -> Result<Sigmoid, Fault> {
        if !at.is_finite() {
            return Err(Fault::new("at", format!("found {at}; give a finite number")));
        }
        if width == 0.0 || width.is_subnormal() || !width.is_finite() {
            let message =
                format!("the width is {}; a step needs a finite width that is not 0 to rise in", number(width));
            return Err(Fault::new("width", message).found(number(width)));
        }
        Ok(Sigmoid { of, at, width })
    }

    /// Value and slope where the number is `v`.
    fn step(&self, v: f64) -> (f64, f64) {
        // From −1 to 1 across the step.
        let s = 2.0 * (v - self.at) / self.width;
        if s <= -1.0 {
            return (0.0, 0.0);
        }
        if s >= 1.0 {
            return (1.0, 0.0);
        }
        let k = (1.0 / TAIL - 1.0).ln();
        let l = 1.0 / (1.0 + (-k * s).exp());
        let whole = 1.0 - 2.0 * TAIL;
        let value = ((l - TAIL) / whole).clamp(0.0, 1.0);
        (value, l * (1.0 - l) * k / whole * 2.0 / self.width)
    }
}

impl Field for Sigmoid {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.of.values(points, out);
        out.iter_mut().for_each(|v| *v = self.step(*v).0);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.of.gradients(points, values, gradients);
        for (v, g) in values.iter_mut().zip(gradients) {
            let (value, slope) = self.step(*v);
            (*v, *g) = (value, scale(*g, slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let r = self.of.bound(b);
        let ends = [self.step(r.lo).0, self.step(r.hi).0];
        // Rounding is not quite monotone; at the ends it is exact.
        let widen = |v: f64, by: f64| {
            if v == 0.0 || v == 1.0 { v } else { (v + by).clamp(0.0, 1.0) }
        };
        Interval::new(widen(ends[0].min(ends[1]), -1e-13), widen(ends[0].max(ends[1]), 1e-13))
    }
}

impl VaryingNumber for Sigmoid {}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_half_in_the_middle_and_ends() {
        let s = Sigmoid::new(Grade::Constant(0.0), 2.0, 4.0).unwrap();
        assert_eq!([0.0, 2.0, 4.0, 9.0].map(|v| s.step(v).0), [0.0, 0.5, 1.0, 1.0]);
        for i in 1..40 {
            let v = 0.1 * f64::from(i);
            let (lo, hi) = (s.step(v - 1e-6).0, s.step(v + 1e-6).0);
            assert!((s.step(v).1 - (hi - lo) / 2e-6).abs() < 1e-5, "{v}");
            // Point-symmetric about its middle.
            assert!((s.step(v).0 + s.step(4.0 - v).0 - 1.0).abs() < 1e-14);
        }
        let falls = Sigmoid::new(Grade::Constant(0.0), 2.0, -4.0).unwrap();
        assert_eq!([0.0, 2.0, 4.0].map(|v| falls.step(v).0), [1.0, 0.5, 0.0]);
    }
}
