//! Data to solid: values are checked, pieces are joined, and what may not be meant is warned of.

use std::sync::Arc;

use super::data::*;
use super::error::DesignError;
use super::report::Varied;
use super::{Built, Design, Loader, Warning, level, region, sample};
use crate::cell::{Cell, Part, Series, Term, named};
use crate::field::Field;
use crate::lattice::Lattice;
use crate::map::{Affine, Map};
use crate::region::Region;
use crate::solid::Solid;

/// Points at which a design is looked at.
pub(super) const LOOKS: usize = 8_000;

/// Where a part of a lattice stands, and the region it is to fill.
pub(super) struct Place<'a> {
    pub path: String,
    pub region: &'a Region,
    /// Points inside the region.
    pub points: &'a [[f64; 3]],
}

impl From<PartSpec> for Part {
    fn from(p: PartSpec) -> Part {
        match p {
            PartSpec::Sheet => Part::Sheet,
            PartSpec::Lower => Part::Lower,
            PartSpec::Upper => Part::Upper,
        }
    }
}

/// `v`, or an error that says it is not a finite number.
pub(super) fn finite(path: &str, v: f64) -> Result<f64, DesignError> {
    if v.is_finite() {
        Ok(v)
    } else {
        Err(
            DesignError::new(path, format!("expected a finite number, found {v}"))
                .found(v.to_string()),
        )
    }
}

pub(super) fn design(d: &Design, loader: &dyn Loader) -> Result<Built, DesignError> {
    let mut notes = region::Notes::default();
    let space = region::region(&d.region, "region", loader, &mut notes)?;
    let region::Notes {
        mut warnings,
        repairs,
    } = notes;
    let bounds = space.bounds();
    if bounds.is_empty() {
        return Err(DesignError::new("region", "the region is empty"));
    }
    if !bounds.is_finite() {
        let message = "the region has no end; intersect it with a box or another bounded region";
        return Err(DesignError::new("region", message));
    }
    let (mut points, _) = sample::inside(&space, LOOKS);
    if points.is_empty() {
        let [x, y, z] = bounds.size();
        let message = format!(
            "the region is empty: no point inside was found within its bounds, {x} × {y} × {z} mm"
        );
        return Err(DesignError::new("region", message));
    }
    points.extend(sample::nodes(&space));
    let largest = bounds.size().into_iter().fold(0.0, f64::max);
    if !(0.1..=2000.0).contains(&largest) && !warnings.iter().any(|w| w.message.contains("unit")) {
        let message = format!("the region is {largest:.4} mm across; is its unit right?");
        warnings.push(Warning {
            path: "region".into(),
            message,
        });
    }
    let mut lattices = Vec::new();
    for (name, spec) in &d.lattice {
        let path = format!("lattice.{name}");
        let place = Place {
            path: path.clone(),
            region: &space,
            points: &points,
        };
        let built = Arc::new(lattice(spec, &place)?);
        check_solid(&built, &place, spec)?;
        warn(&built, &place, spec, &mut warnings);
        lattices.push((name.clone(), built));
    }
    let Some((_, first)) = lattices.first() else {
        return Err(DesignError::new("lattice", "no lattice given; give one"));
    };
    if let Some((name, _)) = lattices.get(1) {
        let message = "several lattices need a blend, which comes in a later version; keep one";
        return Err(DesignError::new(format!("lattice.{name}"), message));
    }
    let solid = Solid {
        region: space.clone(),
        field: Some(first.clone()),
        wavelength: first.map.wavelength(),
    };
    Ok(Built {
        solid,
        lattices,
        warnings,
        repairs,
    })
}

fn lattice(spec: &LatticeSpec, place: &Place) -> Result<Lattice, DesignError> {
    let below = |key: &str| format!("{}.{key}", place.path);
    let (name, cell) = cell(&spec.cell, &below("cell"))?;
    let cell = Arc::new(cell);
    let map = map(&spec.map, &below("map"))?;
    let here = Place {
        path: below("level"),
        region: place.region,
        points: place.points,
    };
    let level = level::level(&spec.level, spec.part, name, &cell, &map, &here)?;
    Ok(Lattice::new(cell, map, spec.part.into(), level))
}

/// The cell, and its name if it has one.
pub(super) fn cell<'a>(
    spec: &'a CellSpec,
    path: &str,
) -> Result<(Option<&'a str>, Cell), DesignError> {
    let (name, terms, at) = match spec {
        CellSpec::Name(name) => {
            let known = named(name).ok_or_else(|| {
                let names: Vec<&str> = crate::cell::catalogue().iter().map(|n| n.name).collect();
                DesignError::unknown(path, "cell", name, &names)
            })?;
            (Some(name.as_str()), known.terms(), path.to_string())
        }
        CellSpec::Kind(CellKind::Series(s)) => {
            let at = format!("{path}.series");
            for (i, t) in s.terms.iter().enumerate() {
                finite(&format!("{at}.terms[{i}].amplitude"), t.amplitude)?;
                finite(&format!("{at}.terms[{i}].phase"), t.phase)?;
            }
            let term = |t: &TermSpec| Term {
                hkl: t.hkl,
                amplitude: t.amplitude,
                phase: t.phase,
            };
            (None, s.terms.iter().map(term).collect(), at)
        }
    };
    let series = Series::new(terms).map_err(|f| DesignError::fault(&at, f))?;
    Ok((name, Cell::new(series)))
}

fn map(spec: &MapSpec, path: &str) -> Result<Map, DesignError> {
    let (kind, wavelength, rotate, offset) = match spec {
        MapSpec::Affine(a) => ("affine", a.wavelength, a.rotate, a.offset),
        MapSpec::Spartan(s) => ("spartan", s.wavelength, s.rotate, s.offset),
    };
    let path = format!("{path}.{kind}");
    let below = |key: &str| format!("{path}.{key}");
    for (i, v) in wavelength.three().into_iter().enumerate() {
        if !(v.is_finite() && v > 0.0) {
            let at = match wavelength {
                OneOrThree::One(_) => below("wavelength"),
                OneOrThree::Three(_) => format!("{}[{i}]", below("wavelength")),
            };
            let message =
                format!("wavelength is {v}; it must be a finite number of mm greater than 0");
            return Err(DesignError::new(at, message).found(v.to_string()));
        }
    }
    for (key, three) in [("rotate", rotate), ("offset", offset)] {
        for v in three {
            finite(&below(key), v)?;
        }
    }
    let affine = match spec {
        MapSpec::Spartan(_) => Affine::spartan(wavelength.three(), rotate, offset),
        MapSpec::Affine(a) => {
            let axis = |c: u8| usize::from(c - b'x');
            let mut skew = Vec::new();
            for (name, angle) in a.skew.named() {
                let at = below(&format!("skew.{name}"));
                finite(&at, angle)?;
                if angle.abs() >= 89.0 {
                    let message =
                        format!("a shear of {angle} degrees; it must be between -89 and 89");
                    return Err(DesignError::new(at, message).found(angle.to_string()));
                }
                if angle != 0.0 {
                    let n = name.as_bytes();
                    skew.push((axis(n[0]), axis(n[1]), angle));
                }
            }
            Affine::rigid(wavelength.three(), rotate, offset, &skew)
        }
    };
    affine
        .map(Map::Affine)
        .map_err(|f| DesignError::fault(&path, f))
}

/// The key under which the amount stands.
fn amount_key(spec: &LatticeSpec) -> &'static str {
    match spec.level.amount {
        AmountSpec::Iso(_) => "iso",
        AmountSpec::Fraction(_) => "fraction",
        AmountSpec::Porosity(_) => "porosity",
    }
}

/// Refuses a lattice that leaves the region empty or solid everywhere.
fn check_solid(lattice: &Lattice, place: &Place, spec: &LatticeSpec) -> Result<(), DesignError> {
    let mut values = vec![0.0; place.points.len()];
    lattice.values(place.points, &mut values);
    let path = format!("{}.level.{}", place.path, amount_key(spec));
    if values.iter().any(|v| v.is_nan()) {
        return Err(DesignError::new(
            path,
            "the level is not a number somewhere in the region",
        ));
    }
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    // Too few looks for a sparse lattice or a thin gap: look closer before refusing.
    let (points, _) = sample::inside(place.region, 50 * LOOKS);
    let mut values = vec![0.0; points.len()];
    lattice.values(&points, &mut values);
    let solid = values.iter().filter(|v| **v <= 0.0).count();
    if solid > 0 && solid < values.len() {
        return Ok(());
    }
    let range = lattice.cell.range();
    let what = if solid == 0 {
        "empty: nothing is solid"
    } else {
        "solid everywhere: nothing is open"
    };
    let iso = Varied::of_iso(lattice, place.points);
    let message = format!(
        "the lattice leaves the region {what}; the level t is {iso}, the cell's values run from {:.4} to {:.4}",
        range.lo, range.hi
    );
    Err(DesignError::new(path, message))
}

fn warn(lattice: &Lattice, place: &Place, spec: &LatticeSpec, warnings: &mut Vec<Warning>) {
    let fraction = Varied::of_fraction(lattice, place.points);
    let whole = lattice.cell.connected_fraction(lattice.part);
    let holds = whole
        .iter()
        .any(|w| w[0] <= fraction.min && fraction.max <= w[1]);
    if !holds {
        let ranges: Vec<String> = whole
            .iter()
            .map(|w| format!("{:.4} to {:.4}", w[0], w[1]))
            .collect();
        let limit = match ranges.as_slice() {
            [] => "it is in one piece at no fraction".to_string(),
            some => format!("it is in one piece at fractions {}", some.join(" and ")),
        };
        let message = format!(
            "at solid fraction {fraction} the periodic solid is not one piece in space; {limit}"
        );
        warnings.push(Warning {
            path: format!("{}.level.{}", place.path, amount_key(spec)),
            message,
        });
    }
    let wavelength = lattice.map.wavelength();
    let least = place
        .region
        .bounds()
        .size()
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    if wavelength > least {
        let message = format!(
            "the wavelength, {wavelength} mm, is more than the region's least extent, {least:.4} mm: the part is less than \
             one cell thick and its fraction is not the cell's"
        );
        let kind = if matches!(spec.map, MapSpec::Affine(_)) {
            "affine"
        } else {
            "spartan"
        };
        warnings.push(Warning {
            path: format!("{}.map.{kind}.wavelength", place.path),
            message,
        });
    }
}
