//! A grade by distance from a point or a line.

use super::{BuildGrade, Grade, Quantity, Stops, VaryingNumber, directed};
use crate::field::Field;
use crate::kind::{DesignError, Key, Kind};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, dot, norm, scale, sub, unit};

/// By the distance from a point or a line: piecewise linear, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Radial", noun = "a radial grade", check = RadialKind::directed)]
pub struct RadialKind {
    /// Pairs [distance in mm, value], distance rising.
    #[kind(inherit)]
    stops: Stops,
    /// The point, or a point on the line.
    #[kind(unit = "mm", default = [0.0; 3])]
    center: Vec3,
    /// Direction of the line; without it, distances are from the point.
    axis: Option<Vec3>,
}

impl RadialKind {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        directed("axis", self.axis)
    }

    fn made(self) -> Radial {
        Radial { center: self.center, axis: self.axis.map(unit), stops: self.stops }
    }
}

impl BuildGrade for RadialKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        Ok(RadialKind { stops: of.stops(self.stops.clone()), ..*self }.made().into())
    }
}

/// Piecewise linear in the distance (mm) from a point, or from a line through it, constant beyond the first and last stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Radial {
    center: Vec3,
    /// Direction of the line, a unit vector.
    axis: Option<Vec3>,
    stops: Stops,
}

impl Radial {
    /// About `center` (mm), or the line through it along `axis`; stops `[distance, value]`.
    ///
    /// # Errors
    /// A point or a direction that is not finite, a direction that is zero; stops that are none, not finite or not
    /// rising in distance.
    pub fn new(center: Vec3, axis: Option<Vec3>, stops: Vec<[f64; 2]>) -> Result<Radial, Fault> {
        let kind = RadialKind { center, axis, stops: Stops(stops) };
        kind.valid()?;
        Ok(kind.made())
    }

    /// From the point, or from the nearest point of the line, to `p`.
    fn offset(&self, p: Vec3) -> Vec3 {
        let d = sub(p, self.center);
        match self.axis {
            None => d,
            Some(n) => sub(d, scale(n, dot(d, n))),
        }
    }
}

impl Field for Radial {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.stops.at(norm(self.offset(*p))).0;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let offset = self.offset(*p);
            let (value, slope) = self.stops.at(norm(offset));
            (*v, *g) = (value, scale(unit(offset), slope));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return self.stops.range(Interval::new(0.0, f64::INFINITY));
        }
        // A distance from a point or a line is 1-Lipschitz.
        let r = norm(self.offset(b.center()));
        let reach = norm(b.size()) / 2.0 * (1.0 + 1e-12) + 1e-12 * r;
        self.stops.range(Interval::new((r - reach).max(0.0), r + reach))
    }
}

impl VaryingNumber for Radial {}
