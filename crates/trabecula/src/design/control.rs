//! Numbers made of control points, regions and other numbers: data to [`Grade`].

use std::sync::Arc;

use super::data::*;
use super::grade::{Allowed, grade};
use super::level::check_varied;
use super::place::{Place, finite};
use super::region;
use super::samples;
use crate::field::Field;
use crate::grade::{Grade, Polyline, Rbf, Sigmoid, Varying, region_step};
use crate::kind::DesignError;
use crate::region::Notes;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Interval, Vec3, norm, scale};

/// One less a number.
struct Rest(Arc<dyn Varying>);

impl Field for Rest {
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

impl Varying for Rest {}

/// The grade, checked in the region against what is allowed; `1 − value` if `complement`.
pub(super) fn checked(
    of: Arc<dyn Varying>,
    path: &str,
    place: &Place,
    allowed: Allowed,
    complement: bool,
) -> Result<Grade, DesignError> {
    let of = if complement { Arc::new(Rest(of)) } else { of };
    let made = Grade::Varying(of);
    check_varied(&made, path, allowed, complement, place)?;
    Ok(made)
}

/// A smooth step of another number.
pub(super) fn sigmoid(spec: &SigmoidSpec, path: &str, place: &Place) -> Result<Sigmoid, DesignError> {
    let of = grade(&spec.of, &format!("{path}.of"), place, Allowed::Finite, false)?;
    let at = finite(&format!("{path}.at"), spec.at)?;
    Sigmoid::new(of, at, width(spec.width, path)?).map_err(|f| DesignError::fault(path, f))
}

/// A width that is one.
fn width(v: f64, path: &str) -> Result<f64, DesignError> {
    let path = format!("{path}.width");
    if v == 0.0 || v.is_subnormal() {
        return Err(DesignError::new(path, "the width is 0; a step needs room to rise in").found(number(v)));
    }
    finite(&path, v)
}

/// 1 inside a region and 0 outside.
pub(super) fn within(spec: &WithinSpec, path: &str, place: &Place) -> Result<Sigmoid, DesignError> {
    let wide = width(spec.width, path)?;
    if wide < 0.0 {
        let message = format!("width is {} mm; it must be greater than 0", number(wide));
        return Err(DesignError::new(format!("{path}.width"), message).found(number(wide)));
    }
    let mut notes = Notes::default();
    let region = region::region(&spec.of, &format!("{path}.of"), place.loader, &mut notes)?;
    region_step(region, wide).map_err(|f| DesignError::fault(path, f))
}

/// The control points, and their values if a file has a fourth column.
pub(super) fn control(
    spec: &ControlSpec,
    path: &str,
    place: &Place,
) -> Result<(Vec<Vec3>, Option<Vec<f64>>), DesignError> {
    match spec {
        ControlSpec::Path(file) => samples::control(file, &format!("{path}.path"), place),
        ControlSpec::Points(points) => {
            for (i, v) in points.iter().enumerate().flat_map(|(i, p)| p.iter().map(move |v| (i, v))) {
                finite(&format!("{path}.points[{i}]"), *v)?;
            }
            Ok((points.clone(), None))
        }
    }
}

fn direction(axis: Option<[f64; 3]>, path: &str) -> Result<Option<Vec3>, DesignError> {
    let path = format!("{path}.axis");
    let Some(axis) = axis else { return Ok(None) };
    for v in axis {
        finite(&path, v)?;
    }
    if norm(axis) == 0.0 {
        return Err(DesignError::new(path, "the direction is zero; give one such as [0, 0, 1]"));
    }
    Ok(Some(axis))
}

/// A fault of control points stands where they do.
pub(super) fn wrong(spec: &ControlSpec, path: &str, f: Fault) -> DesignError {
    let f = match spec {
        ControlSpec::Path(_) if f.at == "points" => Fault { at: "path".into(), ..f },
        _ => f,
    };
    DesignError::fault(path, f)
}

/// Distance to a line.
pub(super) fn distance(spec: &DistanceSpec, path: &str, place: &Place) -> Result<Polyline, DesignError> {
    let (points, _) = control(&spec.points, path, place)?;
    let axis = direction(spec.axis, path)?;
    Polyline::new(points, spec.closed, axis, spec.sharpness).map_err(|f| wrong(&spec.points, path, f))
}

/// Radial basis functions.
pub(super) fn rbf(spec: &RbfSpec, path: &str, place: &Place) -> Result<Rbf, DesignError> {
    let (points, beside) = control(&spec.points, path, place)?;
    let ones = || vec![1.0; points.len()];
    let values = spec.values.clone().or(beside).unwrap_or_else(ones);
    if values.len() != points.len() {
        let message = format!("{} values for {} points; give one for each", values.len(), points.len());
        return Err(DesignError::new(format!("{path}.values"), message));
    }
    for (i, v) in values.iter().enumerate() {
        finite(&format!("{path}.values[{i}]"), *v)?;
    }
    let axis = direction(spec.axis, path)?;
    Rbf::new(points, &values, spec.delta, axis).map_err(|f| wrong(&spec.points, path, f))
}
