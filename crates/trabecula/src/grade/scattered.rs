//! Numbers at scattered points, from a table.

use super::csv::table;
use super::remapped::sampled;
use super::{BuildGrade, Grade, Quantity, Samples, Stops};
use crate::kind::{DesignError, Kind};
use geometry::fault::Fault;
use geometry::math::Vec3;

/// Numbers at scattered points, from a file: the mean of the nearest, weighted by one over the square of the distance.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Points", noun = "a grade at points")]
pub struct PointsKind {
    /// Path of a table (csv) of x, y, z (mm), value, relative to the design file.
    path: String,
    /// Number of nearest points that count.
    #[kind(default = 8, min = 1.0, max = 64.0)]
    neighbours: u32,
    /// The values that the numbers map to: pairs [number, value], number rising, linear between.
    remap: Option<Stops>,
}

impl BuildGrade for PointsKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let (environment, at) = (of.environment, format!("{}.path", of.path));
        let file = environment.load(&self.path, &at)?;
        let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", self.path, f.message)).found(&self.path);
        let rows = table(&String::from_utf8_lossy(&file), &[4]).map_err(wrong)?;
        let (positions, values): (Vec<Vec3>, Vec<f64>) = rows.iter().map(|r| ([r[0], r[1], r[2]], r[3])).unzip();
        let samples = Samples::scattered(&positions, &values, self.neighbours as usize, &environment.region.bounds());
        sampled(samples.map_err(wrong)?, &self.remap, of)
    }
}
