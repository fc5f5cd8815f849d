//! Control points, in the design or in a table.

use super::csv::table;
use crate::environment::Environment;
use crate::kind::{DesignError, Kind, Unit};
use geometry::fault::Fault;
use geometry::math::Vec3;

/// Control points: here, or in a file.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "list of control points")]
pub enum ControlPoints {
    /// The points [x, y, z], mm.
    #[kind(unit = "mm")]
    Points(Vec<[f64; 3]>),
    /// Path of a table (csv) of x, y, z (mm), relative to the design file.
    Path(String),
}

impl ControlPoints {
    /// The control points, and their values if a file has a fourth column; `path` is that of the table with the key.
    pub(crate) fn read(
        &self,
        path: &str,
        environment: &Environment,
    ) -> Result<(Vec<Vec3>, Option<Vec<f64>>), DesignError> {
        match self {
            ControlPoints::Path(file) => {
                let at = format!("{path}.path");
                let text = environment.load(file, &at)?;
                let rows = table(&String::from_utf8_lossy(&text), None, &[3, 4], Some(Unit::Mm))
                    .map_err(|f| DesignError::new(&at, format!("{file}: {}", f.message)).found(file))?;
                let points = rows.iter().map(|r| [r[0], r[1], r[2]]).collect();
                Ok((points, rows.iter().map(|r| r.get(3).copied()).collect()))
            }
            ControlPoints::Points(points) => Ok((points.clone(), None)),
        }
    }

    /// A fault of control points, at their path.
    pub(crate) fn fault(&self, path: &str, f: Fault) -> DesignError {
        let f = match self {
            ControlPoints::Path(_) if f.at == "points" => Fault { at: "path".into(), ..f },
            _ => f,
        };
        DesignError::fault(path, f)
    }
}
