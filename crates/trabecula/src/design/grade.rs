//! Numbers that may vary: data to [`Grade`], values checked.

use std::sync::Arc;

use super::data::{GradeKind, GradeSpec};
use super::place::{Place, finite};
use super::{control, samples};
use crate::grade::{Depth, Formula, Grade, Linear, Radial, Varying};
use crate::kind::DesignError;
use geometry::fault::{Fault, number};
use geometry::math::norm;

/// What values an amount may take.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Allowed {
    /// Any finite number.
    Finite,
    /// Greater than 0 and less than 1.
    Share(&'static str),
    /// Greater than 0 and at most the greatest wavelength (mm).
    Length(&'static str, f64),
    /// Greater than 0 (mm).
    Positive(&'static str),
}

impl Allowed {
    pub fn check(self, path: &str, v: f64, place: &str) -> Result<f64, DesignError> {
        match self {
            Allowed::Finite => finite(path, v),
            Allowed::Share(name) if !(v > 0.0 && v < 1.0) => {
                let message = format!(
                    "{name} is {}{place}; it must be greater than 0 and less than 1{}",
                    number(v),
                    hint(name, v)
                );
                Err(DesignError::new(path, message).found(number(v)))
            }
            Allowed::Length(name, most) if !(v > 0.0 && v <= most) => {
                let message =
                    format!("{name} is {v} mm{place}; it must be greater than 0 and at most the wavelength, {most} mm");
                Err(DesignError::new(path, message).found(v.to_string()))
            }
            Allowed::Positive(name) if !(v > 0.0 && v.is_finite()) => {
                let message = format!("{name} is {} mm{place}; it must be a finite number greater than 0", number(v));
                Err(DesignError::new(path, message).found(number(v)))
            }
            Allowed::Share(_) | Allowed::Length(..) | Allowed::Positive(_) => Ok(v),
        }
    }
}

fn hint(name: &str, v: f64) -> String {
    match (name, v) {
        ("fraction", 0.0) | ("porosity", 1.0) => " (nothing would be solid)".into(),
        ("fraction", 1.0) | ("porosity", 0.0) => " (all would be solid)".into(),
        (_, v) if v > 1.0 && v <= 100.0 => {
            format!(" (for {} per cent write {})", number(v), number(v / 100.0))
        }
        _ => String::new(),
    }
}

/// The grade of a kind; a fault of its constructor stands below `path`.
fn made<G: Varying + 'static>(path: &str, made: Result<G, Fault>) -> Result<Grade, DesignError> {
    made.map(Grade::from).map_err(|f| DesignError::fault(path, f))
}

/// The grade, with `1 − value` instead of the value if `complement`. Stops are checked here; a formula is checked
/// where it is sampled.
pub(super) fn grade(
    spec: &GradeSpec,
    path: &str,
    place: &Place,
    allowed: Allowed,
    complement: bool,
) -> Result<Grade, DesignError> {
    let turn = |v: f64| if complement { 1.0 - v } else { v };
    let kind = match spec {
        GradeSpec::Constant(v) => return Ok(Grade::Constant(turn(allowed.check(path, *v, "")?))),
        GradeSpec::Kind(kind) => kind,
    };
    let stops = |path: &str, stops: &[[f64; 2]]| {
        if stops.is_empty() {
            return Err(DesignError::new(path, "no stops given; give at least one [position, value]"));
        }
        let mut out = Vec::with_capacity(stops.len());
        let mut last = f64::NEG_INFINITY;
        for (i, &[at, value]) in stops.iter().enumerate() {
            let path = format!("{path}[{i}]");
            finite(&path, at)?;
            if at <= last {
                let message =
                    format!("positions must rise from stop to stop, found {} after {}", number(at), number(last));
                return Err(DesignError::new(path, message).found(number(at)));
            }
            last = at;
            out.push([at, turn(allowed.check(&path, value, &format!(" at position {}", number(at)))?)]);
        }
        Ok(out)
    };
    match kind {
        GradeKind::Linear(l) => {
            let below = format!("{path}.linear.along");
            for v in l.along {
                finite(&below, v)?;
            }
            if l.along == [0.0; 3] {
                return Err(DesignError::new(below, "the direction is zero; give one such as [0, 0, 1]"));
            }
            let stops = stops(&format!("{path}.linear.stops"), &l.stops)?;
            made(path, Linear::new(l.along, stops))
        }
        GradeKind::Depth(d) => {
            let stops = stops(&format!("{path}.depth.stops"), &d.stops)?;
            made(path, Depth::new(place.region.clone(), stops))
        }
        GradeKind::Radial(r) => {
            let below = |key: &str| format!("{path}.radial.{key}");
            for v in r.center {
                finite(&below("center"), v)?;
            }
            if let Some(axis) = r.axis {
                for v in axis {
                    finite(&below("axis"), v)?;
                }
                if norm(axis) == 0.0 {
                    let message = "the direction is zero; give one such as [0, 0, 1]";
                    return Err(DesignError::new(below("axis"), message));
                }
            }
            made(path, Radial::new(r.center, r.axis, stops(&below("stops"), &r.stops)?))
        }
        GradeKind::Grid(g) => {
            let at = format!("{path}.grid");
            let of = samples::grid(g, &at, place)?;
            samples::grade(of, &g.remap, &at, place, allowed, complement)
        }
        GradeKind::Points(p) => {
            let at = format!("{path}.points");
            let of = samples::points(p, &at, place)?;
            samples::grade(of, &p.remap, &at, place, allowed, complement)
        }
        GradeKind::Field(f) => {
            let at = format!("{path}.field");
            let of = samples::field(f, &at, place)?;
            samples::grade(of, &f.remap, &at, place, allowed, complement)
        }
        GradeKind::Sigmoid(s) => {
            let at = format!("{path}.sigmoid");
            let of = Arc::new(control::sigmoid(s, &at, place)?);
            control::checked(of, &at, place, allowed, complement)
        }
        GradeKind::Region(r) => {
            let at = format!("{path}.region");
            let of = Arc::new(control::within(r, &at, place)?);
            control::checked(of, &at, place, allowed, complement)
        }
        GradeKind::Distance(d) => {
            let at = format!("{path}.distance");
            let of = Arc::new(control::distance(d, &at, place)?);
            control::checked(of, &at, place, allowed, complement)
        }
        GradeKind::Rbf(r) => {
            let at = format!("{path}.rbf");
            let of = Arc::new(control::rbf(r, &at, place)?);
            control::checked(of, &at, place, allowed, complement)
        }
        GradeKind::Formula(text) => {
            let place = format!("{path}.formula");
            let own = Formula::parse(text).map_err(|f| DesignError::fault(&place, f).found(text))?;
            if !complement {
                return Ok(Grade::from(own));
            }
            let turned = format!("1 - ({text})");
            Formula::parse(&turned).map(Grade::from).map_err(|f| DesignError::fault(&place, f).found(text))
        }
    }
}
