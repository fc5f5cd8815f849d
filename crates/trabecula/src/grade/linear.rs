//! A grade along a direction.

use super::{BuildGrade, Grade, Quantity, Stops, VaryingNumber, directed};
use crate::field::Field;
use crate::kind::{DesignError, Key, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, dot, scale};

/// A direction along which a position is measured: s = along · x, in mm times the length of `along`.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(check = Along::directed)]
pub struct Along(pub Vec3);

impl Along {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        directed("", Some(self.0))
    }

    /// s at a point.
    #[inline]
    pub fn at(&self, p: Vec3) -> f64 {
        dot(self.0, p)
    }

    /// ∇s.
    pub fn gradient(&self) -> Vec3 {
        self.0
    }

    /// The axes along which s changes.
    pub fn varies(&self) -> [bool; 3] {
        self.0.map(|c| c != 0.0)
    }

    /// The least and the greatest s in a box. Rounded sums and products are monotone, so these ends hold for every
    /// rounded s as well.
    pub fn range(&self, b: &Aabb) -> Interval {
        let end = |low: bool| {
            let term = |a: usize| match self.0[a] {
                0.0 => 0.0,
                c if (c > 0.0) == low => c * b.min[a],
                c => c * b.max[a],
            };
            term(0) + term(1) + term(2)
        };
        Interval::new(end(true), end(false))
    }
}

/// Along a direction: piecewise linear in s = along · x, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a linear grade")]
pub struct Linear {
    /// The direction [x, y, z]; s is measured in multiples of its length.
    along: Along,
    /// Pairs [s, value], s rising.
    #[kind(inherit)]
    stops: Stops,
}

impl Linear {
    /// Along a direction, in multiples of whose length s is measured; stops `[s, value]`.
    ///
    /// # Errors
    /// A direction that is zero or not finite; stops that are none, not finite or not rising in s.
    pub fn new(along: Vec3, stops: Vec<[f64; 2]>) -> Result<Linear, Fault> {
        let made = Linear { along: Along(along), stops: Stops(stops) };
        made.valid()?;
        Ok(made)
    }
}

impl BuildGrade for Linear {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        Ok(Linear { along: self.along, stops: of.stops(self.stops.clone()) }.into())
    }
}

impl Field for Linear {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.stops.at(self.along.at(*p)).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let (value, slope) = self.stops.at(self.along.at(*p));
            (*v, *g) = (value, scale(self.along.gradient(), slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.stops.range(self.along.range(b))
    }
}

impl VaryingNumber for Linear {
    fn varies(&self) -> [bool; 3] {
        self.along.varies()
    }
}
