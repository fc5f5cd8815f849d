//! Files of beams: lattices of frusta, graphs.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats::{Companions, Indexed};
use geometry::progress::Stopped;
use pyo3::prelude::*;

use crate::error;
use crate::file;
use crate::mesh::{Mesh, metadata};
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// Writes the beams of a solid as 3MF with the beam lattice extension: frusta whose radii are within `tolerance` (mm) of those of the
/// beams, with the mesh by which they are cut and the one that is shown. Gives its `reports.BeamsFileReport`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
#[pyo3(signature = (solid, path, title, tolerance=None, clip=None, shown=None, threads=None))]
pub fn write_beam_lattice<'py>(
    py: Python<'py>,
    solid: &Solid,
    path: PathBuf,
    title: String,
    tolerance: Option<f64>,
    clip: Option<Py<Mesh>>,
    shown: Option<Py<Mesh>>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let meta = metadata(title, solid.text().to_string());
    fn mesh(of: &Option<Py<Mesh>>) -> Option<&dyn Indexed> {
        of.as_ref().map(|m| m.get().mesh() as &dyn Indexed)
    }
    let meshes = Companions { clip: mesh(&clip), shown: mesh(&shown) };
    let made = run(py, threads, None, |_| {
        let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path).map_err(Stopped::Io)?);
        let mut aside = file::nameless(&path, ".1").map_err(Stopped::Io)?;
        let made = solid.built().write_beam_lattice(tolerance, meshes, &meta, &mut aside, &mut out)?;
        out.flush().map_err(Stopped::Io)?;
        Ok(made)
    })?;
    report(py, "BeamsFileReport", &made.map_err(error::stopped)?)
}
