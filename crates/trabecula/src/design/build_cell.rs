//! Cells: data to series.

use std::f64::consts::TAU;

use super::Loader;
use super::data::*;
use crate::cell::{Cell, Series, Term, named};
use crate::environment::extension;
use crate::field::Field;
use crate::kind::DesignError;
use crate::region::{MeshRegion, Shape as _};
use geometry::fault::Fault;
use geometry::formats;
use geometry::math::{Vec3, sin_cos_turns};
use geometry::repair::Repair;
use geometry::symmetry::{Group, Side};

/// The cell, and its name if it has one.
pub(super) fn cell<'a>(
    spec: &'a CellSpec,
    path: &str,
    loader: &dyn Loader,
) -> Result<(Option<&'a str>, Cell), DesignError> {
    let (name, terms, at) = match spec {
        CellSpec::Name(name) => {
            let known = named(&name.0).ok_or_else(|| DesignError::new(path, "no such cell"))?;
            (Some(name.0.as_str()), known.terms(), path.to_string())
        }
        CellSpec::Kind(CellKind::File(f)) => {
            return Ok((None, from_file(f, &format!("{path}.file"), loader)?));
        }
        CellSpec::Kind(CellKind::Tet(_)) => {
            let message = "a tetrahedral cell goes with a map over a tetrahedral mesh ([lattice.NAME.map.tets])";
            return Err(DesignError::new(format!("{path}.tet"), message));
        }
        CellSpec::Kind(CellKind::Series(s)) => {
            let at = format!("{path}.series");
            let terms = match &s.group {
                None => s.terms.iter().map(plain_term).collect(),
                Some(GroupSpec(symbol)) => {
                    let wrong = |key: &str, f| DesignError::fault(&format!("{at}.{key}"), f);
                    let group = Group::named(symbol).map_err(|f| wrong("group", f))?;
                    let mut all = Vec::new();
                    for (i, t) in s.terms.iter().enumerate() {
                        let orbit = orbit_terms(&group, t);
                        all.extend(orbit.map_err(|f| wrong(&format!("terms[{i}]"), f))?);
                    }
                    all
                }
            };
            (None, terms, at)
        }
    };
    let series = Series::new(terms).map_err(|f| DesignError::fault(&at, f))?;
    Ok((name, Cell::new(series)))
}

fn plain_term(t: &TermSpec) -> Term {
    // sin a = cos(a − a quarter turn).
    let behind = match t.component {
        Component::Re => 0.0,
        Component::Im => 0.25,
    };
    Term { hkl: t.hkl, amplitude: t.amplitude, phase: t.phase - behind }
}

/// The sum of a term over a space group. A phase mixes its two parts, each of them normalised.
pub(super) fn orbit_terms(group: &Group, t: &TermSpec) -> Result<Vec<Term>, Fault> {
    let (s, c) = sin_cos_turns(t.phase);
    let (parts, word, other) = match t.component {
        Component::Re => ([(Side::Re, c), (Side::Im, -s)], "real", "im"),
        Component::Im => ([(Side::Re, s), (Side::Im, c)], "imaginary", "re"),
    };
    let mut terms = Vec::new();
    for (side, factor) in parts.into_iter().filter(|p| p.1 != 0.0) {
        let waves = group.orbit(t.hkl, side)?;
        terms.extend(waves.into_iter().map(|(hkl, cosine, sine)| Term {
            hkl,
            amplitude: t.amplitude * factor * cosine.hypot(sine),
            phase: (-sine).atan2(cosine) / TAU,
        }));
    }
    if terms.is_empty() {
        let message = format!(
            "the {word} part of the sum of {:?} over {} vanishes; use component = \"{other}\", or another origin choice",
            t.hkl, group.name
        );
        return Err(Fault::new("hkl", message));
    }
    Ok(terms)
}

/// Nodes along an axis of the grid on which a mesh of one cell is sampled.
const CELL: usize = 64;

/// A cell from numbers or a mesh.
fn from_file(spec: &FileCellSpec, path: &str, loader: &dyn Loader) -> Result<Cell, DesignError> {
    let at = format!("{path}.path");
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let file = loader.load(&spec.path).map_err(|m| DesignError::new(&at, m).found(&spec.path))?;
    let kind = extension(&spec.path);
    let (shape, values) = if kind == "npy" {
        let (shape, values) = formats::read_npy(&file).map_err(wrong)?;
        let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
            let message = format!("the array has shape {shape:?}; a cell has three dimensions [x, y, z]");
            wrong(Fault::new("", message))
        })?;
        (shape, values)
    } else if formats::Format::of(&kind).is_some() {
        let mesh = formats::read_mesh(&file, &kind).map_err(wrong)?.mesh;
        let solid = MeshRegion::new(mesh, Repair::Auto).map_err(wrong)?;
        let (b, size) = (solid.bounds(), solid.bounds().size());
        let points: Vec<Vec3> = (0..CELL.pow(3))
            .map(|n| [n % CELL, n / CELL % CELL, n / CELL / CELL])
            .map(|i| core::array::from_fn(|a| b.min[a] + size[a] * (i[a] as f64 + 0.5) / CELL as f64))
            .collect();
        let mut values = vec![0.0; points.len()];
        solid.values(&points, &mut values);
        let inside = |v: &f64| if *v < 0.0 { 1.0 } else { 0.0 };
        ([CELL; 3], values.iter().map(inside).collect())
    } else {
        let known = formats::Format::listed();
        let message = format!("the name must end in npy, {known}; found \"{}\"", spec.path);
        return Err(DesignError::new(at, message).found(&spec.path));
    };
    let (series, share) = Series::sampled(&values, shape, spec.terms as usize).map_err(wrong)?;
    Ok(Cell::new(series).truncated(share))
}
