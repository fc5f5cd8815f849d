//! Maps: data to [`Map`], and what is to be said of a solved one.

use std::sync::Arc;

use super::Warning;
use super::data::*;
use crate::environment::Environment;
use crate::field::Field;
use crate::grade::Grade;
use crate::grade::several;
use crate::grade::{Quantity, key_of};
use crate::kind::{DesignError, Key};
use crate::map::{Affine, Map, Mapping, Orientation, Path, Phase, Round, Settings, Sweep, Wanted};
use geometry::fault::Fault;
use geometry::math::{dot, norm, scale, sub, unit};

/// A turn within one cell (degrees) above which it is warned of: cells are torn out of shape.
const TURN: f64 = 45.0;
/// The share of places and axes with spacings outside 1/1.5 to 1.5 above which it is warned of.
const OUTSIDE: f64 = 0.05;

/// A kind of map, as it is declared.
pub(super) trait BuildMap {
    /// The map. `path` is that of the kind's table.
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError>;
}

/// The map at `environment.path`.
pub(super) fn map(spec: &MapSpec, environment: &Environment) -> Result<Map, DesignError> {
    spec.family().build(&format!("{}.{}", environment.path, spec.key()), environment)
}

fn shared(made: Result<impl Mapping + 'static, Fault>, path: &str) -> Result<Map, DesignError> {
    made.map(|m| Arc::new(m) as Map).map_err(|f| DesignError::fault(path, f))
}

impl BuildMap for AffineSpec {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        let made = Affine::rigid(self.wavelength.three(), self.rotate, self.offset, &self.skew.shears());
        shared(made, path)
    }
}

impl BuildMap for SpartanSpec {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        let made = Affine::spartan(self.wavelength.three(), self.rotate, self.offset);
        shared(made, path)
    }
}

impl BuildMap for CylinderMapSpec {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let radii = radii(self.center, self.axis, environment);
        let made = Round::cylinder(self.center, self.axis, self.wavelength.two(), self.around.into(), radii);
        shared(made, path)
    }
}

impl BuildMap for SphereMapSpec {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let radii = radii(self.center, self.axis, environment);
        let made = Round::sphere(self.center, self.axis, self.wavelength, self.around.into(), radii);
        shared(made, path)
    }
}

impl BuildMap for SweepSpec {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let (points, _) = self.points.read(path, environment)?;
        let line = Path { points, closed: self.closed, wavelength: self.wavelength.three(), normal: self.normal };
        let made = Sweep::new(&line, &**environment.region, environment.points);
        made.map(|s| Arc::new(s) as Map).map_err(|f| self.points.fault(path, f))
    }
}

impl BuildMap for TetsSpec {
    fn build(&self, path: &str, _: &Environment) -> Result<Map, DesignError> {
        let message = "a map over tetrahedra goes with a tetrahedral cell ([lattice.NAME.cell.tet]); other cells do not fit \
                       face to face";
        Err(DesignError::new(path, message))
    }
}

impl BuildMap for PhaseSpec {
    fn build(&self, path: &str, environment: &Environment) -> Result<Map, DesignError> {
        let below = |key: &str| format!("{path}.{key}");
        let any = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, Key::NONE));
        let length = key_of::<PhaseSpec>("wavelength");
        let length = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, length));
        let wavelength = match &self.wavelength {
            GradeOrThree::One(g) => {
                let one = length(g, below("wavelength"))?;
                [one.clone(), one.clone(), one]
            }
            GradeOrThree::Three(of) => each(of, &below("wavelength"), &length)?,
        };
        let weight = self.weight.as_ref().map(|g| any(g, below("weight")));
        let wanted = Wanted {
            wavelength,
            orientation: self.orientation.build(path, environment)?,
            weight: weight.transpose()?,
            angle_weight: self.angle_weight,
            offset: self.offset,
        };
        let region: &dyn Field = &**environment.region;
        let settings =
            Settings { step: self.step, region: (self.domain == Domain::Region).then_some(region), folds: self.folds };
        let made = Phase::solve(&environment.region.bounds(), &wanted, &settings);
        shared(made, path)
    }
}

impl OrientationSpec {
    fn build(&self, path: &str, environment: &Environment) -> Result<Orientation, DesignError> {
        let below = |key: &str| format!("{path}.{key}");
        let any = |of: &GradeSpec, path: String| of.build(&Quantity::new(path, environment, Key::NONE));
        let angle = |of: &Option<GradeSpec>, key: &str| match of {
            Some(of) => any(of, below(key)),
            None => Ok(Grade::Constant(0.0)),
        };
        let vector = |of: &VectorSpec, key: &str| match of {
            VectorSpec::Components(of) => each(of, &below(key), &any),
            VectorSpec::Field(of) => {
                several(&of.field, &below(&format!("{key}.field")), environment, |n| (n == 3).then_some([0, 1, 2]))
            }
        };
        Ok(match self {
            OrientationSpec::Axes(AxesSpec { rotate_x, rotate_y, rotate_z }) => Orientation::Angles([
                angle(rotate_x, "rotate_x")?,
                angle(rotate_y, "rotate_y")?,
                angle(rotate_z, "rotate_z")?,
            ]),
            OrientationSpec::Rotate(of) => Orientation::Angles(each(&of.rotate, &below("rotate"), &any)?),
            OrientationSpec::Direction(of) => Orientation::Direction(vector(&of.direction, "direction")?),
            OrientationSpec::Frame(FrameAlone { frame }) => {
                Orientation::Frame { x: vector(&frame.x, "frame.x")?, z: vector(&frame.z, "frame.z")? }
            }
            OrientationSpec::Stress(of) => Orientation::Stress(match &of.stress {
                TensorSpec::Components(of) => each(of, &below("stress"), &any)?,
                TensorSpec::Field(of) => {
                    several(&of.field, &below("stress.field"), environment, |n| match (n, of.order) {
                        (9, _) => Some([0, 4, 8, 5, 2, 1]),
                        (6, TensorOrder::Vtk) => Some([0, 1, 2, 4, 5, 3]),
                        (6, TensorOrder::Voigt) => Some([0, 1, 2, 3, 4, 5]),
                        _ => None,
                    })?
                }
            }),
        })
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

/// The same for each, with its index in the path.
fn each<const N: usize>(
    of: &[GradeSpec; N],
    path: &str,
    one: &impl Fn(&GradeSpec, String) -> Result<Grade, DesignError>,
) -> Result<[Grade; N], DesignError> {
    let made = of.iter().enumerate().map(|(i, g)| one(g, format!("{path}[{i}]")));
    let mut made = made.collect::<Result<Vec<Grade>, DesignError>>()?.into_iter();
    Ok(core::array::from_fn(|_| made.next().unwrap_or(Grade::Constant(0.0))))
}

/// Warns of a map that is far from what was asked for.
pub(super) fn warn(map: &Map, spec: &MapSpec, lattice: &str, warnings: &mut Vec<Warning>) {
    let Some(phase) = map.solved() else { return };
    let d = phase.distortion();
    let mut say = |message: String| {
        warnings.push(Warning { path: format!("{lattice}.map.{}", spec.key()), message });
    };
    let at = |[x, y, z]: [f64; 3]| format!("({x:.3}, {y:.3}, {z:.3}) mm");
    if d.turn > TURN {
        say(format!(
            "the orientation turns by {:.0} degrees within one cell at {}: above {TURN} neighbouring cells no longer fit \
             together without being torn out of shape; let it turn more slowly, or use smaller cells",
            d.turn,
            at(d.turn_at)
        ));
    }
    if d.outside > OUTSIDE {
        let worst = d.spacing.iter().fold(0.0, |m: f64, s| m.max(s.max));
        say(format!(
            "no map follows this orientation and wavelength closely: {:.0} % of the spacings are outside 1/1.5 to 1.5 of \
             what is asked for, the worst by a factor of {worst:.2}",
            100.0 * d.outside
        ));
    }
    if d.density[0] <= 0.0 {
        say(format!("the map folds: cells turn inside out at {}", at(d.least_at)));
    }
}
