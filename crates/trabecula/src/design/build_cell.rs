//! Cells: data to series.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::Loader;
use super::data::*;
use crate::cell::{Cell, Series, Term, named};
use crate::kind::DesignError;
use geometry::fault::Fault;
use geometry::math::sin_cos_turns;
use geometry::symmetry::{ComplexPart, Group};

mod cell_file;

/// The cell, and its name if it has one.
pub(super) fn cell<'a>(
    spec: &'a CellSpec,
    path: &str,
    loader: &dyn Loader,
) -> Result<(Option<&'a str>, Arc<Cell>), DesignError> {
    let (terms, at) = match spec {
        CellSpec::Name(name) => {
            let known = named(&name.0).ok_or_else(|| DesignError::new(path, "no such cell"))?;
            let cell = known.cell().map_err(|f| DesignError::fault(path, f))?;
            return Ok((Some(name.0.as_str()), cell));
        }
        CellSpec::Kind(CellKind::File(f)) => {
            return Ok((None, Arc::new(cell_file::cell(f, &format!("{path}.file"), loader)?)));
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
            (terms, at)
        }
    };
    let series = Series::new(terms).map_err(|f| DesignError::fault(&at, f))?;
    Ok((None, Arc::new(Cell::new(series))))
}

fn plain_term(t: &TermSpec) -> Term {
    // sin a = cos(a − a quarter turn).
    let behind = match t.component {
        WaveComponent::Re => 0.0,
        WaveComponent::Im => 0.25,
    };
    Term { hkl: t.hkl, amplitude: t.amplitude, phase: t.phase - behind }
}

/// The sum of a term over a space group. A phase mixes its two parts, each of them normalised.
pub(super) fn orbit_terms(group: &Group, t: &TermSpec) -> Result<Vec<Term>, Fault> {
    let (s, c) = sin_cos_turns(t.phase);
    let (parts, word, other) = match t.component {
        WaveComponent::Re => ([(ComplexPart::Re, c), (ComplexPart::Im, -s)], "real", "im"),
        WaveComponent::Im => ([(ComplexPart::Re, s), (ComplexPart::Im, c)], "imaginary", "re"),
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
