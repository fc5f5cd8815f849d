//! A grade in steps along a direction.

use super::linear::Along;
use super::{BuildGrade, Grade, Quantity, Stops, VaryingNumber};
use crate::field::Field;
use crate::kind::{DesignError, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3};

/// In steps along a direction: piecewise constant in s = along · x, the value of the last stop at or below s; before the first
/// stop its value. Its gradient is 0 everywhere.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a grade in steps")]
pub struct Steps {
    /// The direction [x, y, z]; s is measured in multiples of its length.
    along: Along,
    /// Pairs [s, value], s rising: the value from s on.
    #[kind(inherit)]
    stops: Stops,
}

impl Steps {
    /// Along a direction, in multiples of whose length s is measured; stops `[s, value]`.
    ///
    /// # Errors
    /// A direction that is zero or not finite; stops that are none, not finite or not rising in s.
    pub fn new(along: Vec3, stops: Vec<[f64; 2]>) -> Result<Steps, Fault> {
        let made = Steps { along: Along(along), stops: Stops(stops) };
        made.valid()?;
        Ok(made)
    }
}

impl BuildGrade for Steps {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        Ok(Steps { along: self.along, stops: of.stops(self.stops.clone()) }.into())
    }
}

impl Field for Steps {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.stops.step(self.along.at(*p));
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.values(points, values);
        gradients.fill([0.0; 3]);
    }

    /// Exact: the least and the greatest value in the box.
    fn bound(&self, b: &Aabb) -> Interval {
        self.stops.step_range(self.along.range(b))
    }
}

impl VaryingNumber for Steps {
    fn varies(&self) -> [bool; 3] {
        self.along.varies()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn layers() -> Steps {
        Steps::new([0.0, 0.0, 2.0], vec![[1.0, 0.2], [3.0, 0.7], [4.0, 0.4]]).unwrap()
    }

    #[test]
    fn a_step_has_the_value_of_the_last_stop_at_or_below() {
        let just_below = 1.5f64.next_down();
        for (z, want) in [(-9.0, 0.2), (0.0, 0.2), (0.5, 0.2), (just_below, 0.2), (1.5, 0.7), (2.0, 0.4), (9.0, 0.4)] {
            assert_eq!(layers().value([7.0, -3.0, z]), want, "z = {z}");
        }
    }

    #[test]
    fn gradients_vanish_and_only_the_direction_varies() {
        let (mut v, mut g) = ([f64::NAN; 2], [[f64::NAN; 3]; 2]);
        layers().gradients(&[[0.0, 0.0, 1.5], [0.0, 0.0, 0.7]], &mut v, &mut g);
        assert_eq!((v, g), ([0.7, 0.2], [[0.0; 3]; 2]));
        assert_eq!(layers().varies(), [false, false, true]);
    }

    #[test]
    fn bounds_are_the_values_taken_in_the_box() {
        let at = |lo: f64, hi: f64| layers().bound(&Aabb { min: [-1.0, -1.0, lo], max: [1.0, 1.0, hi] });
        for (lo, hi, want) in [
            (-5.0, 1.5f64.next_down(), [0.2, 0.2]),
            (-5.0, 1.5, [0.2, 0.7]),
            (1.5, 1.5, [0.7, 0.7]),
            (1.5, 2.0, [0.4, 0.7]),
            (2.0, 8.0, [0.4, 0.4]),
            (-5.0, 8.0, [0.2, 0.7]),
        ] {
            let found = at(lo, hi);
            assert_eq!([found.lo, found.hi], want, "z from {lo} to {hi}");
        }
        let all = layers().bound(&Aabb::ALL);
        assert_eq!([all.lo, all.hi], [0.2, 0.7]);
    }
}
