//! What a lattice is made of, for files that hold functions.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use trabecula::cell::Part;
use trabecula::grade::Formula;

use crate::solid::Solid;

/// M (turns per mm) and b (turns) of an affine map u = M x + b.
type Affine = ([[f64; 3]; 3], [f64; 3]);

/// A lattice f(M x + b) cut at a level.
#[pyclass(frozen, get_all)]
pub struct LatticeTerms {
    /// Waves (h, k, l), amplitude, phase (turns) of f(u) = Σ amplitude · cos 2π(h·u + phase).
    waves: Vec<([i32; 3], f64, f64)>,
    /// The map, if it is affine.
    affine: Option<Affine>,
    /// The part: sheet, lower or upper.
    part: &'static str,
    /// The level t of f, where it does not vary.
    level: Option<f64>,
    /// Whether f is replaced by the distance to f = 0, because the level is a thickness.
    distance: bool,
}

/// A formula in x, y and z after the order of its work, as `Formula::postfix`.
#[pyfunction]
pub fn formula_terms(text: &str) -> PyResult<Vec<(&'static str, f64)>> {
    let made = Formula::parse(text).map_err(|f| PyValueError::new_err(f.to_string()))?;
    Ok(made.postfix())
}

/// The terms of the lattice of a name.
#[pyfunction]
pub fn lattice_terms(solid: &Solid, name: &str) -> PyResult<LatticeTerms> {
    let found = solid.built().lattices.iter().find(|(n, _)| n == name);
    let (_, lattice) = found.ok_or_else(|| PyValueError::new_err(format!("there is no lattice named {name}")))?;
    Ok(LatticeTerms {
        waves: lattice.cell.series().terms().iter().map(|t| (t.hkl, t.amplitude, t.phase)).collect(),
        affine: lattice.map.affine().map(|a| (a.matrix, a.shift)),
        part: match lattice.part {
            Part::Sheet => "sheet",
            Part::Lower => "lower",
            Part::Upper => "upper",
        },
        level: lattice.uniform(),
        distance: lattice.distance().is_some(),
    })
}
