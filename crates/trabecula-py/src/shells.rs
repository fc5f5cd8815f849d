//! Shells on the mid-surface of a sheet: arrays, sets, figures, files.

use std::path::PathBuf;

use geometry::formats::SHELL_FORMATS;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use trabecula::report::ShellReport;
use trabecula::shell_mesh::{MeshedShell, ShellMeshOptions};

use crate::arrays::table;
use crate::error;
use crate::fe_arrays::{Field, Forces, LoadArgument, Members, forces, members, text, write_as};
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// Shells on the mid-surface of a sheet.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Shells {
    made: MeshedShell,
    edge: f64,
}

#[pymethods]
impl Shells {
    /// Of a solid: grid spacing (mm), and whether triangles are quadratic.
    #[staticmethod]
    #[pyo3(signature = (solid, edge, quadratic, threads=None, progress=None))]
    fn make(
        py: Python<'_>,
        solid: &Solid,
        edge: f64,
        quadratic: bool,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Shells> {
        let options = ShellMeshOptions { edge, quadratic };
        let made = run(py, threads, progress, |p| solid.built().shell_mesh(&options, p))?;
        Ok(Shells { made: made.map_err(error::stopped)?, edge })
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.made.mesh.nodes.clone())
    }

    /// Nodes of each triangle (m, 3) or (m, 6), in the order of VTK.
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let mesh = &self.made.mesh;
        let width = if mesh.middles.is_empty() { 3 } else { 6 };
        let nodes: Vec<u32> = (0..mesh.triangles.len()).flat_map(|i| mesh.nodes_of(i)).collect();
        nodes.into_pyarray(py).reshape([mesh.triangles.len(), width])
    }

    /// The thickness at each node, mm.
    #[getter]
    fn thickness<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.made.mesh.thickness.clone().into_pyarray(py)
    }

    /// What should be known about it: key and message.
    #[getter]
    fn warning(&self) -> Option<(String, String)> {
        self.made.warning.as_ref().map(|f| (f.at.clone(), f.message.clone()))
    }

    /// The names of the sets.
    #[getter]
    fn sets(&self) -> Vec<String> {
        self.made.mesh.sets.iter().map(|s| s.name.clone()).collect()
    }

    /// Nodes, triangles, and edges on the border (triangle, the corner from which it goes to the next one) of a set; None without it.
    fn set<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Members<'py>>> {
        self.made.mesh.set(name).map(|set| members(py, set)).transpose()
    }

    /// The figures, as `reports.ShellReport`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, "ShellReport", &ShellReport::new(&self.made, self.edge))
    }

    /// Nodes of a set's edges and the forces (N) at them, (n, 3), of a load; None without the set.
    fn forces<'py>(&self, py: Python<'py>, name: &str, load: LoadArgument) -> PyResult<Option<Forces<'py>>> {
        self.made.mesh.set(name).map(|set| forces(py, self.made.mesh.nodal_forces(set, load.into()))).transpose()
    }

    /// Writes a file, given as path, suffix and title; Young's modulus (MPa) and Poisson's ratio of the solid; sets that are held, and sets
    /// with their loads.
    #[allow(clippy::too_many_arguments)] // The pieces of a file.
    fn write(
        &self,
        py: Python<'_>,
        file: (PathBuf, String, String),
        elastic: Vec<[f64; 2]>,
        held: Vec<String>,
        loads: Vec<(String, LoadArgument)>,
        fields: Vec<Field>,
    ) -> PyResult<()> {
        let text = text(elastic, held, loads, fields);
        write_as(py, &self.made.mesh, &SHELL_FORMATS, file, text)
    }
}

/// The formats of shells: suffix and title.
pub fn formats() -> Vec<(&'static str, &'static str)> {
    SHELL_FORMATS.iter().map(|f| (f.0, f.1)).collect()
}
