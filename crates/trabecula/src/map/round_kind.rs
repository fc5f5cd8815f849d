//! Maps round an axis or about a centre, as they are declared.

use super::{BuildMap, Map, Round, shared};
use crate::environment::Environment;
use crate::kind::{DesignError, Fault, Key, Kind, OneOrTwo};
use geometry::math::{dot, norm, scale, sub, unit};

/// Wrapped round an axis, a whole number of cells, so that the lattice closes: u = (r/λ, around · θ/2π, z/λ).
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "CylinderMap", noun = "a map round an axis")]
pub struct CylinderMapKind {
    /// Cell edge along the radius and along the axis, one number or two.
    #[kind(unit = "mm", above = 0.0, hints("cell_size", "unit_cell", "unit_cell_size", "cell_edge", "period", "size"))]
    wavelength: OneOrTwo,
    /// Number of cells around.
    #[kind(min = 1.0, max = 1e6)]
    around: u32,
    /// A point on the axis.
    #[kind(unit = "mm", default = [0.0; 3])]
    center: [f64; 3],
    /// Direction of the axis.
    #[kind(default = [0.0, 0.0, 1.0])]
    axis: [f64; 3],
    /// Angle round the axis at which a cell begins, by the right-hand rule: from x if the axis is z, else from the coordinate axis
    /// that is most normal to it.
    #[kind(unit = "degrees", min = -360.0, max = 360.0, default = 0.0, hints("rotate", "turn", "angle", "offset", "phase"))]
    start: f64,
}

/// Wrapped about a centre in shells, a whole number of cells round the equator and half as many from pole to pole.
#[derive(Clone, Copy, Debug, PartialEq, Kind)]
#[kind(name = "SphereMap", noun = "a map about a centre", check = SphereMapKind::even)]
pub struct SphereMapKind {
    /// Cell edge along the radius.
    #[kind(unit = "mm", above = 0.0, hints("cell_size", "unit_cell", "unit_cell_size", "cell_edge", "period", "size"))]
    wavelength: f64,
    /// Number of cells round the equator, even.
    #[kind(min = 2.0, max = 1e6)]
    around: u32,
    /// The centre.
    #[kind(unit = "mm", default = [0.0; 3])]
    center: [f64; 3],
    /// Direction from pole to pole.
    #[kind(default = [0.0, 0.0, 1.0])]
    axis: [f64; 3],
}

impl SphereMapKind {
    fn even(&self, _: &Key) -> Result<(), Fault> {
        match self.around % 2 {
            0 => Ok(()),
            _ => Err(Fault::new("around", format!("around is {}; it must be an even number", self.around))
                .found(self.around.to_string())),
        }
    }
}

impl BuildMap for CylinderMapKind {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let radii = radii(self.center, self.axis, environment);
        let made = Round::cylinder(self.center, self.axis, self.wavelength.two(), self.around.into(), radii);
        shared(made.map(|round| round.started(self.start)), path)
    }
}

impl BuildMap for SphereMapKind {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let radii = radii(self.center, self.axis, environment);
        let made = Round::sphere(self.center, self.axis, self.wavelength, self.around.into(), radii);
        shared(made, path)
    }
}

/// Least, mean and greatest distance from an axis in the region.
fn radii(center: [f64; 3], axis: [f64; 3], environment: &Environment) -> [f64; 3] {
    let n = unit(axis);
    let of = environment.points.iter().map(|p| {
        let d = sub(*p, center);
        norm(sub(d, scale(n, dot(d, n))))
    });
    let (mut least, mut most, mut sum) = (f64::INFINITY, 0.0f64, 0.0);
    for r in of {
        (least, most, sum) = (least.min(r), most.max(r), sum + r);
    }
    [least, sum / environment.points.len() as f64, most]
}
