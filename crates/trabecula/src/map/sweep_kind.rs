//! The map along a line, as it is declared.

use super::{BuildMap, Map, Path, Sweep};
use crate::environment::Environment;
use crate::grade::ControlPoints;
use crate::kind::{DesignError, Kind, OneOrThree};
use std::sync::Arc;

/// Along a line, in a frame that does not rotate about it: a cubic spline through control points, straight on beyond the ends
/// of an open one; u = (a/λ₁, b/λ₂, s/λ₃), a and b across it, s along it.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Sweep", noun = "a map along a line")]
pub struct SweepKind {
    /// Cell edge, one number or three: two across the line and one along it. Along a closed line it is made to fit.
    #[kind(unit = "mm", above = 0.0, hints("cell_size", "unit_cell", "unit_cell_size", "cell_edge", "period", "size"))]
    wavelength: OneOrThree,
    /// The control points.
    #[kind(flatten)]
    points: ControlPoints,
    /// Whether the last point is followed by the first.
    #[kind(default = false)]
    closed: bool,
    /// Direction of the cell's x axis at the start, up to its component along the line; chosen if not given.
    normal: Option<[f64; 3]>,
}

impl BuildMap for SweepKind {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let (points, _) = self.points.read(path, environment)?;
        let line = Path { points, closed: self.closed, wavelength: self.wavelength.three(), normal: self.normal };
        let made = Sweep::new(&line, &**environment.region, environment.points);
        made.map(|s| Arc::new(s) as Map).map_err(|f| self.points.fault(path, f))
    }
}
