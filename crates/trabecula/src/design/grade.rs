//! Numbers that may vary: data to [`Grade`].

use super::data::*;
use super::place::Place;
use super::{region, samples};
use crate::field::Field;
use crate::grade::{
    Depth, Formula, Grade, Linear, Polyline, Radial, Rbf, Remapped, Samples, Sigmoid, Varying, region_step,
};
use crate::kind::{DesignError, Key, Table};
use crate::region::Notes;
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Interval, Vec3, scale};

/// A number that is asked for: where it stands, its limits, and whether `1 − value` is meant.
pub(super) struct Asked<'a> {
    pub path: String,
    pub place: &'a Place<'a>,
    pub key: Key,
    pub complement: bool,
}

/// The declaration of a key of a table.
pub(super) fn key_of<T: Table>(name: &str) -> Key {
    T::keys().into_iter().find(|k| k.name == name).unwrap_or(Key::NONE)
}

impl<'a> Asked<'a> {
    /// A number at `path`, under a key of these limits.
    pub fn new(path: impl Into<String>, place: &'a Place<'a>, key: Key) -> Self {
        Asked { path: path.into(), place, key, complement: false }
    }

    fn below(&self, key: &str) -> Self {
        Asked { path: format!("{}.{key}", self.path), ..*self }
    }

    fn turned(&self, v: f64) -> f64 {
        if self.complement { 1.0 - v } else { v }
    }

    fn stops(&self, stops: &Stops) -> Vec<[f64; 2]> {
        stops.0.iter().map(|&[at, v]| [at, self.turned(v)]).collect()
    }

    /// A grade whose values cannot be checked where they are declared: they are sampled in the region.
    fn checked(&self, grade: Grade) -> Result<Grade, DesignError> {
        self.check(&grade, |v, position| self.key.admit_at(v, position))?;
        Ok(grade)
    }

    /// Any other function of position; values are sampled.
    fn function<V: Varying + 'static>(&self, of: Result<V, Fault>) -> Result<Grade, DesignError> {
        let of = of.map_err(|f| DesignError::fault(&self.path, f))?;
        self.checked(if self.complement { Grade::from(Rest(of)) } else { Grade::from(of) })
    }

    /// A function of position whose stops were checked.
    fn made<V: Varying + 'static>(&self, of: Result<V, Fault>) -> Result<Grade, DesignError> {
        of.map(Grade::from).map_err(|f| DesignError::fault(&self.path, f))
    }

    /// Checks a number at the positions of the region where it is least and greatest, of some thousands.
    pub fn check(&self, grade: &Grade, admit: impl Fn(f64, &str) -> Result<(), Fault>) -> Result<(), DesignError> {
        let Place { region, points, .. } = *self.place;
        let bounds = region.bounds();
        let corner = |i: usize| core::array::from_fn(|a| if i >> a & 1 == 0 { bounds.min[a] } else { bounds.max[a] });
        let corners: Vec<[f64; 3]> = (0..8).map(corner).collect();
        let mut distance = [0.0; 8];
        region.values(&corners, &mut distance);
        let in_corners = corners.iter().zip(distance).filter(|(_, d)| *d <= 1e-9).map(|(c, _)| *c);
        let points: Vec<[f64; 3]> = points.iter().copied().chain(in_corners).collect();
        let mut values = vec![0.0; points.len()];
        grade.values(&points, &mut values);
        let order = |a: &usize, b: &usize| self.turned(values[*a]).total_cmp(&self.turned(values[*b]));
        // Not a number comes first or last in this order.
        let ends = [(0..values.len()).min_by(order), (0..values.len()).max_by(order)];
        for i in ends.into_iter().flatten() {
            let [x, y, z] = points[i];
            admit(self.turned(values[i]), &format!(" at ({x:.4}, {y:.4}, {z:.4}) mm"))
                .map_err(|f| DesignError::fault(&self.path, f))?;
        }
        Ok(())
    }
}

impl GradeSpec {
    /// The grade; its constants and stops have been checked.
    pub(super) fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        match self {
            GradeSpec::Constant(v) => Ok(Grade::Constant(asked.turned(*v))),
            GradeSpec::Kind(kind) => kind.family().build(&asked.below(kind.key())),
        }
    }
}

/// A kind of grade, as it is declared.
pub(super) trait BuildGrade {
    /// The grade. `asked.path` is that of the kind's table.
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError>;
}

impl BuildGrade for LinearSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        asked.made(Linear::new(self.along, asked.stops(&self.stops)))
    }
}

impl BuildGrade for DepthSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        asked.made(Depth::new(asked.place.region.clone(), asked.stops(&self.stops)))
    }
}

impl BuildGrade for RadialSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        asked.made(Radial::new(self.center, self.axis, asked.stops(&self.stops)))
    }
}

impl BuildGrade for FormulaSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        let parse = |text: &str| {
            let parsed = Formula::parse(text).map(Grade::from);
            parsed.map_err(|f| DesignError::fault(&asked.path, f).found(&self.0))
        };
        let made = parse(&self.0)?;
        let made = if asked.complement { parse(&format!("1 - ({})", self.0))? } else { made };
        if asked.key.allowed().is_some() { asked.checked(made) } else { Ok(made) }
    }
}

impl BuildGrade for GridSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        sampled(samples::grid(self, &asked.path, asked.place)?, &self.remap, asked)
    }
}

impl BuildGrade for PointsSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        sampled(samples::points(self, &asked.path, asked.place)?, &self.remap, asked)
    }
}

impl BuildGrade for FieldSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        sampled(samples::field(self, &asked.path, asked.place)?, &self.remap, asked)
    }
}

/// The grade of samples.
fn sampled(samples: Samples, remap: &Option<Stops>, asked: &Asked) -> Result<Grade, DesignError> {
    let mut stops = remap.as_ref().map_or(Vec::new(), |s| s.0.clone());
    if asked.complement {
        if stops.is_empty() {
            let r = samples.bound(&Aabb::ALL);
            // One stop would do where all numbers are the same.
            stops = vec![[r.lo, r.lo], [r.hi.max(r.lo + 1.0), r.hi.max(r.lo + 1.0)]];
        }
        stops.iter_mut().for_each(|s| s[1] = 1.0 - s[1]);
    }
    let made = match stops.is_empty() {
        true => Grade::from(samples),
        false => Grade::from(Remapped::new(samples, stops).map_err(|f| DesignError::fault(&asked.path, f))?),
    };
    asked.checked(made)
}

impl BuildGrade for SigmoidSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        let of = self.of.build(&Asked::new(format!("{}.of", asked.path), asked.place, Key::NONE))?;
        asked.function(Sigmoid::new(of, self.at, self.width))
    }
}

impl BuildGrade for WithinSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        let mut notes = Notes::default();
        let region = region::region(&self.of, &format!("{}.of", asked.path), asked.place.loader, &mut notes)?;
        asked.function(region_step(region, self.width))
    }
}

impl BuildGrade for DistanceSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        let (points, _) = self.points.read(&asked.path, asked.place)?;
        let line = Polyline::new(points, self.closed, self.axis, self.sharpness);
        asked.function(Ok(line.map_err(|f| self.points.fault(&asked.path, f))?))
    }
}

impl BuildGrade for RbfSpec {
    fn build(&self, asked: &Asked) -> Result<Grade, DesignError> {
        asked.function(Ok(self.functions(&asked.path, asked.place)?))
    }
}

impl RbfSpec {
    /// The functions.
    pub(super) fn functions(&self, path: &str, place: &Place) -> Result<Rbf, DesignError> {
        let (points, column) = self.points.read(path, place)?;
        let ones = || vec![1.0; points.len()];
        let values = self.values.clone().or(column).unwrap_or_else(ones);
        if values.len() != points.len() {
            let message =
                format!("{} for {}; give one for each", counted(values.len(), "value"), counted(points.len(), "point"));
            return Err(DesignError::new(format!("{path}.values"), message));
        }
        Rbf::new(points, &values, self.delta, self.axis).map_err(|f| self.points.fault(path, f))
    }
}

impl ControlSpec {
    /// The control points, and their values if a file has a fourth column; `path` is that of the table with the key.
    pub(super) fn read(&self, path: &str, place: &Place) -> Result<(Vec<Vec3>, Option<Vec<f64>>), DesignError> {
        match self {
            ControlSpec::Path(file) => samples::control(file, &format!("{path}.path"), place),
            ControlSpec::Points(points) => Ok((points.clone(), None)),
        }
    }

    /// A fault of control points stands where they do.
    pub(super) fn fault(&self, path: &str, f: Fault) -> DesignError {
        let f = match self {
            ControlSpec::Path(_) if f.at == "points" => Fault { at: "path".into(), ..f },
            _ => f,
        };
        DesignError::fault(path, f)
    }
}

/// One less a number.
struct Rest<V>(V);

impl<V: Varying> Varying for Rest<V> {
    fn varies(&self) -> [bool; 3] {
        self.0.varies()
    }
}

impl<V: Varying> Field for Rest<V> {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
        out.iter_mut().for_each(|v| *v = 1.0 - *v);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v = 1.0 - *v);
        gradients.iter_mut().for_each(|g| *g = scale(*g, -1.0));
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let r = self.0.bound(b);
        Interval::new(1.0 - r.hi, 1.0 - r.lo)
    }
}
