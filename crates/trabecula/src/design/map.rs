//! Maps: data to [`Map`], and what is to be said of a solved one.

use std::sync::Arc;

use super::Warning;
use super::data::*;
use super::grade::{Allowed, grade};
use super::place::{Place, finite};
use super::{control, samples};
use crate::field::Field;
use crate::grade::Grade;
use crate::kind::DesignError;
use crate::map::{Affine, Map, Orientation, Path, Phase, Round, Settings, Sweep, Wanted};
use geometry::fault::number;
use geometry::math::{dot, norm, scale, sub, unit};

/// A turn within one cell (degrees) above which it is warned of: cells are torn out of shape.
const TURN: f64 = 45.0;
/// The share of places and axes with spacings outside 1/1.5 to 1.5 above which it is warned of.
const OUTSIDE: f64 = 0.05;

/// The kind of map, as it is written.
pub(super) fn kind(spec: &MapSpec) -> &'static str {
    match spec {
        MapSpec::Affine(_) => "affine",
        MapSpec::Spartan(_) => "spartan",
        MapSpec::Phase(_) => "phase",
        MapSpec::Cylinder(_) => "cylinder",
        MapSpec::Sphere(_) => "sphere",
        MapSpec::Sweep(_) => "sweep",
        MapSpec::Tets(_) => "tets",
    }
}

pub(super) fn map(spec: &MapSpec, place: &Place) -> Result<Map, DesignError> {
    let path = format!("{}.{}", place.path, kind(spec));
    let (wavelength, rotate, offset) = match spec {
        MapSpec::Affine(a) => (a.wavelength, a.rotate, a.offset),
        MapSpec::Spartan(s) => (s.wavelength, s.rotate, s.offset),
        MapSpec::Phase(p) => return phase(p, &path, place),
        MapSpec::Tets(_) => {
            let message = "a map over tetrahedra goes with a tetrahedral cell ([lattice.NAME.cell.tet]); other cells do not fit \
                           face to face";
            return Err(DesignError::new(path, message));
        }
        MapSpec::Cylinder(c) => {
            let wavelength = match c.wavelength {
                OneOrTwo::One(w) => [w; 2],
                OneOrTwo::Two(two) => two,
            };
            let radii = radii(c.center, c.axis, place);
            let map = Round::cylinder(c.center, c.axis, wavelength, c.around, radii);
            return map.map(|m| Arc::new(m) as Map).map_err(|f| DesignError::fault(&path, f));
        }
        MapSpec::Sweep(s) => return sweep(s, &path, place),
        MapSpec::Sphere(s) => {
            let radii = radii(s.center, s.axis, place);
            let map = Round::sphere(s.center, s.axis, s.wavelength, s.around, radii);
            return map.map(|m| Arc::new(m) as Map).map_err(|f| DesignError::fault(&path, f));
        }
    };
    let below = |key: &str| format!("{path}.{key}");
    for (i, v) in wavelength.three().into_iter().enumerate() {
        if !(v.is_finite() && v > 0.0) {
            let at = match wavelength {
                OneOrThree::One(_) => below("wavelength"),
                OneOrThree::Three(_) => format!("{}[{i}]", below("wavelength")),
            };
            let message = format!("wavelength is {}; it must be a finite number of mm greater than 0", number(v));
            return Err(DesignError::new(at, message).found(number(v)));
        }
    }
    for (key, three) in [("rotate", rotate), ("offset", offset)] {
        for v in three {
            finite(&below(key), v)?;
        }
    }
    let affine = match spec {
        MapSpec::Affine(a) => {
            let axis = |c: u8| usize::from(c - b'x');
            let mut skew = Vec::new();
            for (name, angle) in a.skew.named() {
                let at = below(&format!("skew.{name}"));
                finite(&at, angle)?;
                if angle.abs() >= 89.0 {
                    let message = format!("a shear of {} degrees; it must be between -89 and 89", number(angle));
                    return Err(DesignError::new(at, message).found(number(angle)));
                }
                if angle != 0.0 {
                    let n = name.as_bytes();
                    skew.push((axis(n[0]), axis(n[1]), angle));
                }
            }
            Affine::rigid(wavelength.three(), rotate, offset, &skew)
        }
        _ => Affine::spartan(wavelength.three(), rotate, offset),
    };
    affine.map(|m| Arc::new(m) as Map).map_err(|f| DesignError::fault(&path, f))
}

fn sweep(spec: &SweepSpec, path: &str, place: &Place) -> Result<Map, DesignError> {
    let (points, _) = control::control(&spec.points, path, place)?;
    let line = Path { points, closed: spec.closed, wavelength: spec.wavelength.three(), normal: spec.normal };
    Sweep::new(&line, &**place.region, place.points)
        .map(|s| Arc::new(s) as Map)
        .map_err(|f| control::wrong(&spec.points, path, f))
}

/// Least, mean and greatest distance from an axis in the region.
fn radii(center: [f64; 3], axis: [f64; 3], place: &Place) -> [f64; 3] {
    let n = unit(axis);
    let of = place.points.iter().map(|p| {
        let d = sub(*p, center);
        norm(sub(d, scale(n, dot(d, n))))
    });
    let (mut least, mut most, mut sum) = (f64::INFINITY, 0.0f64, 0.0);
    for r in of {
        (least, most, sum) = (least.min(r), most.max(r), sum + r);
    }
    [least, sum / place.points.len() as f64, most]
}

fn phase(spec: &PhaseSpec, path: &str, place: &Place) -> Result<Map, DesignError> {
    let below = |key: &str| format!("{path}.{key}");
    let vary = |spec: &GradeSpec, path: String, allowed| grade(spec, &path, place, allowed, false);
    let any = |spec: &GradeSpec, path: String| vary(spec, path, Allowed::Finite);
    let length = |spec: &GradeSpec, path: String| vary(spec, path, Allowed::Positive("wavelength"));
    let wavelength = match &spec.wavelength {
        GradeOrThree::One(g) => {
            let one = length(g, below("wavelength"))?;
            [one.clone(), one.clone(), one]
        }
        GradeOrThree::Three(of) => each(of, &below("wavelength"), &length)?,
    };
    let vector = |of: &VectorSpec, key: &str| match of {
        VectorSpec::Components(of) => each(of, &below(key), &any),
        VectorSpec::Field(of) => {
            samples::several(&of.field, &below(&format!("{key}.field")), place, |n| (n == 3).then_some([0, 1, 2]))
        }
    };
    let angles = |of: [Option<&GradeSpec>; 3]| {
        let names = ["rotate_x", "rotate_y", "rotate_z"];
        let mut out = [Grade::Constant(0.0), Grade::Constant(0.0), Grade::Constant(0.0)];
        for ((o, g), name) in out.iter_mut().zip(of).zip(names) {
            if let Some(g) = g {
                *o = any(g, below(name))?;
            }
        }
        Ok(out)
    };
    let orientation = if let Some(of) = &spec.rotate {
        Orientation::Angles(each(of, &below("rotate"), &any)?)
    } else if let Some(of) = &spec.direction {
        Orientation::Direction(vector(of, "direction")?)
    } else if let Some(of) = &spec.frame {
        Orientation::Frame { x: vector(&of.x, "frame.x")?, z: vector(&of.z, "frame.z")? }
    } else if let Some(of) = &spec.stress {
        Orientation::Stress(match of {
            TensorSpec::Components(of) => each(of, &below("stress"), &any)?,
            TensorSpec::Field(of) => {
                samples::several(&of.field, &below("stress.field"), place, |n| match (n, of.order) {
                    (9, _) => Some([0, 4, 8, 5, 2, 1]),
                    (6, TensorOrder::Vtk) => Some([0, 1, 2, 4, 5, 3]),
                    (6, TensorOrder::Voigt) => Some([0, 1, 2, 3, 4, 5]),
                    _ => None,
                })?
            }
        })
    } else {
        Orientation::Angles(angles([spec.rotate_x.as_ref(), spec.rotate_y.as_ref(), spec.rotate_z.as_ref()])?)
    };
    for v in spec.offset {
        finite(&below("offset"), v)?;
    }
    let weight = spec.weight.as_ref().map(|g| any(g, below("weight")));
    let wanted = Wanted {
        wavelength,
        orientation,
        weight: weight.transpose()?,
        angle_weight: finite(&below("angle_weight"), spec.angle_weight)?,
        offset: spec.offset,
    };
    let region: &dyn Field = &**place.region;
    let settings =
        Settings { step: spec.step, region: (spec.domain == Domain::Region).then_some(region), folds: spec.folds };
    Phase::solve(&place.region.bounds(), &wanted, &settings)
        .map(|p| Arc::new(p) as Map)
        .map_err(|f| DesignError::fault(path, f))
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
        warnings.push(Warning { path: format!("{lattice}.map.{}", kind(spec)), message });
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
