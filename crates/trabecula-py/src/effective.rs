//! Effective figures of a periodic cell.

use std::path::PathBuf;

use geometry::progress::{Progress, Stopped};
use homogenise::Material;
use pyo3::prelude::*;
use serde::Serialize;
use trabecula::design::Design;
use trabecula::effective::{Resolution, SheetSide, UnitCell};

use crate::error;
use crate::folder::Folder;
use crate::report::report;
use crate::run::{run, run_apart};
use crate::solid::Solid;

/// Threads, and the listener to progress.
type Work = (Option<usize>, Option<Py<PyAny>>);

/// The periodic cell of a solid.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Cell {
    cell: UnitCell,
}

impl Cell {
    fn report<'py, T: Serialize + Send, E: Into<Stopped> + Send>(
        &self,
        py: Python<'py>,
        class: &str,
        (threads, progress): Work,
        work: impl FnOnce(&UnitCell, &dyn Progress) -> Result<T, E> + Send,
    ) -> PyResult<Bound<'py, PyAny>> {
        let cell = &self.cell;
        let made = run(py, threads, progress, |p| work(cell, p).map_err(Into::into))?.map_err(error::stopped)?;
        report(py, class, &made)
    }
}

#[pymethods]
impl Cell {
    /// The cell of a solid; `folder` is where relative paths start.
    #[staticmethod]
    fn of(py: Python<'_>, solid: Py<Solid>, folder: PathBuf) -> PyResult<Cell> {
        let own = solid.clone_ref(py);
        let made = run_apart(py, None, move || {
            let solid = own.get();
            Design::from_toml(solid.text()).and_then(|design| solid.built().unit_cell(&design, &Folder(folder)))
        })?;
        // The text is the design's own, in which no one looks up a line.
        made.map(|cell| Cell { cell })
            .map_err(|e| error::design(py, &trabecula::design::DesignError { line: None, ..e }))
    }

    /// The edges, mm, one row each.
    #[getter]
    fn edges(&self) -> [[f64; 3]; 3] {
        self.cell.edges
    }

    /// The volume, mm³.
    #[getter]
    fn volume(&self) -> f64 {
        self.cell.volume()
    }

    /// The stiffness, as `reports.StiffnessReport`: of an isotropic solid (E, nu), or of a 6 x 6 stiffness.
    fn stiffness<'py>(
        &self,
        py: Python<'py>,
        grid: (usize, bool),
        isotropic: (f64, f64),
        general: Option<[[f64; 6]; 6]>,
        work: Work,
    ) -> PyResult<Bound<'py, PyAny>> {
        let material = match general {
            Some(c) => Material::general(c),
            None => Material::isotropic(isotropic.0, isotropic.1),
        };
        let material = material.map_err(error::fault)?;
        let resolution = Resolution { n: grid.0, plain: grid.1 };
        self.report(py, "StiffnessReport", work, move |cell, p| cell.stiffness(&material, resolution, p))
    }

    /// The conductivity, as `reports.ConductivityReport`, where the pore conducts `pore` times as well as the solid.
    fn conductivity<'py>(
        &self,
        py: Python<'py>,
        grid: (usize, bool),
        pore: f64,
        work: Work,
    ) -> PyResult<Bound<'py, PyAny>> {
        let resolution = Resolution { n: grid.0, plain: grid.1 };
        self.report(py, "ConductivityReport", work, move |cell, p| cell.conductivity(pore, resolution, p))
    }

    /// The area of the wall in the cell, mm².
    fn area(&self, py: Python<'_>, n: usize, threads: Option<usize>) -> PyResult<f64> {
        let cell = &self.cell;
        run(py, threads, None, |p| cell.area(n, p))?.map_err(error::stopped)
    }

    /// The permeability of the pore, as `reports.PermeabilityReport`; `upper` is the side of a sheet, or both.
    fn permeability<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        upper: Option<bool>,
        work: Work,
    ) -> PyResult<Bound<'py, PyAny>> {
        let side = upper.map(|up| if up { SheetSide::Upper } else { SheetSide::Lower });
        self.report(py, "PermeabilityReport", work, move |cell, p| cell.permeability(n, side, p))
    }
}
