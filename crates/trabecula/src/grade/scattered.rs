//! Numbers at scattered points, from a table.

use super::csv::table;
use super::remapped::sampled;
use super::result::percent;
use super::{BuildGrade, Grade, Quantity, Samples, Stops};
use crate::environment::Environment;
use crate::kind::{DesignError, Kind, Unit, Warning};
use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, norm, scale};

/// The share of the region's bounds along each axis that a table of tensors has to reach over: middles of large elements do.
const COVERED: f64 = 0.5;

/// The same for numbers, of which a few may do: the region has to hold some of them, or lie between them.
const TOUCHED: f64 = 0.0;

/// Refuses points that reach over less than a share of the bounds along an axis, but for one along which they do not vary. `unit` is
/// the one given for them.
fn check_reach(positions: &[Vec3], bounds: &Aabb, least: f64, unit: Option<Unit>) -> Result<(), Fault> {
    let all = positions.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let (size, met) = (bounds.size(), all.intersection(*bounds).size());
    if (0..3).all(|a| all.size()[a] == 0.0 || met[a] >= least * size[a]) {
        return Ok(());
    }
    let hint = if unit.is_none() { "; are they in mm? give their unit, such as unit = \"m\"" } else { "" };
    let message = format!(
        "the points reach from {:?} to {:?} mm, the region from {:?} to {:?}{hint}",
        all.min, all.max, bounds.min, bounds.max
    );
    Err(Fault::new("", message))
}

/// The share of the region along every axis over which points have to reach at least not to be doubted.
const TINY: f64 = 0.1;

/// Units that positions may be in by mistake.
const UNITS: [(&str, Unit); 2] = [("metres", Unit::M), ("inches", Unit::Inch)];

/// Doubts points that lie close together in the region: they may be in another unit.
fn doubt(positions: &[Vec3], bounds: &Aabb) -> Option<String> {
    let all = positions.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let size = bounds.size();
    if all.size() == [0.0; 3] || (0..3).any(|a| all.size()[a] > TINY * size[a]) {
        return None;
    }
    let covers = |unit: Unit| {
        let scaled = Aabb { min: scale(all.min, unit.in_mm()), max: scale(all.max, unit.in_mm()) };
        let met = scaled.intersection(*bounds).size();
        (0..3).all(|a| met[a] >= COVERED * size[a].max(scaled.size()[a]))
    };
    let why = match UNITS.iter().find(|(_, unit)| covers(*unit)) {
        Some((name, unit)) => format!("in {name} they would cover it: give unit = \"{}\" if they are", unit.names()[0]),
        None => "are they in mm?".into(),
    };
    Some(format!(
        "the points reach from {:?} to {:?} mm, over less than a tenth of the region, from {:?} to {:?}; {why}",
        all.min, all.max, bounds.min, bounds.max
    ))
}

/// The share of the region beyond the points from which on it is said.
const BEYOND: f64 = 0.25;

/// Says that much of the region lies farther out than the points by more than they are apart.
fn beyond(positions: &[Vec3], environment: &Environment) -> Option<String> {
    let all = positions.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    let reach = all.grown(norm(all.size()) / (positions.len() as f64).cbrt());
    let out = environment.points.iter().filter(|p| reach.distance(**p) > 0.0).count();
    let share = out as f64 / environment.points.len().max(1) as f64;
    let message = format!(
        "the points reach from {:?} to {:?} mm: {} of the region is beyond, where the numbers of the nearest count",
        all.min,
        all.max,
        percent(share)
    );
    (share > BEYOND).then_some(message)
}

/// Numbers at scattered points, from a file: the mean of the nearest, weighted by one over the square of the distance.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Points", noun = "a grade at points")]
pub struct PointsKind {
    /// Path of a table (csv) of x, y, z, value, relative to the design file.
    path: String,
    /// Number of nearest points that count.
    #[kind(default = 8, min = 1.0, max = 64.0)]
    neighbours: u32,
    /// The values that the numbers map to: pairs [number, value], number rising, linear between.
    remap: Option<Stops>,
    /// The names, in the table's first line, of x, y, z and the value; unless given, the table has these four columns alone.
    columns: Option<[String; 4]>,
    /// Unit of the coordinates (mm unless given).
    unit: Option<Unit>,
}

impl BuildGrade for PointsKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let (environment, at) = (of.environment, format!("{}.path", of.path));
        let file = environment.load(&self.path, &at)?;
        let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", self.path, f.message)).found(&self.path);
        let columns = self.columns.as_ref().map(<[_; 4]>::as_slice);
        let rows = table(&String::from_utf8_lossy(&file), columns, &[4], self.unit).map_err(wrong)?;
        let (positions, values): (Vec<Vec3>, Vec<[f64; 1]>) = rows.iter().map(|r| ([r[0], r[1], r[2]], [r[3]])).unzip();
        let bounds = environment.region.bounds();
        check_reach(&positions, &bounds, TOUCHED, self.unit).map_err(wrong)?;
        let doubted = self.unit.is_none().then(|| doubt(&positions, &bounds)).flatten();
        if let Some(message) = doubted.or_else(|| beyond(&positions, environment)) {
            let message = format!("{}: {message}", self.path);
            environment.notes.borrow_mut().warnings.push(Warning { path: at.clone(), message });
        }
        let [one] = Samples::scattered(&positions, &values, self.neighbours as usize, &bounds).map_err(wrong)?;
        sampled(one, &self.remap, of)
    }
}

/// Tensors at scattered points, from a file: the mean of the nearest, weighted by one over the square of the distance.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Table", noun = "a table of tensors")]
pub struct TableKind {
    /// Path of a table (csv), relative to the design file.
    path: String,
    /// The names, in the table's first line, of x, y, z and the components 11, 22, 33, 23, 13, 12; unless given, the table has these nine
    /// columns alone, in this order.
    columns: Option<[String; 9]>,
    /// Unit of the coordinates (mm unless given).
    unit: Option<Unit>,
    /// Number of nearest points that count.
    #[kind(default = 8, min = 1.0, max = 64.0)]
    neighbours: u32,
}

impl TableKind {
    /// The components 11, 22, 33, 23, 13, 12.
    pub(crate) fn grades(&self, path: &str, environment: &Environment) -> Result<[Grade; 6], DesignError> {
        let at = format!("{path}.path");
        let file = environment.load(&self.path, &at)?;
        let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", self.path, f.message)).found(&self.path);
        let columns = self.columns.as_ref().map(<[_; 9]>::as_slice);
        let rows = table(&String::from_utf8_lossy(&file), columns, &[9], self.unit).map_err(wrong)?;
        let of = |r: &Vec<f64>| ([r[0], r[1], r[2]], [r[3], r[4], r[5], r[6], r[7], r[8]]);
        let (positions, values): (Vec<Vec3>, Vec<[f64; 6]>) = rows.iter().map(of).unzip();
        let bounds = environment.region.bounds();
        check_reach(&positions, &bounds, COVERED, self.unit).map_err(wrong)?;
        let made = Samples::scattered(&positions, &values, self.neighbours as usize, &bounds).map_err(wrong)?;
        Ok(made.map(Grade::from))
    }
}
