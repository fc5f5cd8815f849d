//! Beams as finite elements: arrays, sets, figures, files.

use std::path::PathBuf;

use geometry::formats::{BEAM_FORMATS, FeText};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use trabecula::beam_mesh::{BeamMeshOptions, MeshedBeams};
use trabecula::report::BeamMeshReport;

use crate::arrays::table;
use crate::error;
use crate::fe_arrays::{Field, Forces, LoadArgument, Members, forces, members, text, write_as};
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// Beams as finite elements.
#[pyclass(frozen, module = "trabecula._core")]
pub struct BeamElements {
    made: MeshedBeams,
}

#[pymethods]
impl BeamElements {
    /// Of a solid: longest element (mm; four to a beam without it), whether elements are quadratic, whether the longest connected component
    /// alone is kept.
    #[staticmethod]
    #[pyo3(signature = (solid, edge, quadratic, largest, threads=None))]
    fn make(
        py: Python<'_>,
        solid: &Solid,
        edge: Option<f64>,
        quadratic: bool,
        largest: bool,
        threads: Option<usize>,
    ) -> PyResult<BeamElements> {
        let options = BeamMeshOptions { edge, quadratic, largest };
        let made = run(py, threads, None, |_| solid.built().beam_mesh(&options))?;
        Ok(BeamElements { made: made.map_err(error::fault)? })
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.made.mesh.nodes.clone())
    }

    /// Nodes of each element (m, 2) or (m, 3), in the order of VTK.
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let mesh = &self.made.mesh;
        let width = if mesh.middles.is_empty() { 2 } else { 3 };
        let nodes: Vec<u32> = (0..mesh.elements.len()).flat_map(|i| mesh.nodes_of(i)).collect();
        nodes.into_pyarray(py).reshape([mesh.elements.len(), width])
    }

    /// The radius of each element, mm.
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.made.mesh.radii.clone().into_pyarray(py)
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

    /// Nodes, elements, and ends (element, 0 or 1) of a set; None without it.
    fn set<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Members<'py>>> {
        self.made.mesh.set(name).map(|set| members(py, set)).transpose()
    }

    /// The figures, as `reports.BeamMeshReport`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, "BeamMeshReport", &BeamMeshReport::from(&self.made))
    }

    /// Nodes of a set's ends and the forces (N) at them, (n, 3), of a load; None without the set.
    fn forces<'py>(&self, py: Python<'py>, name: &str, load: LoadArgument) -> PyResult<Option<Forces<'py>>> {
        self.made.mesh.set(name).map(|set| forces(py, self.made.mesh.nodal_forces(set, load.into()))).transpose()
    }

    /// Writes a file, given as path, suffix and title; Young's modulus (MPa) and Poisson's ratio of the solid; sets that are held, sets
    /// with their loads, and fields; whether it is for Abaqus where CalculiX differs.
    #[allow(clippy::too_many_arguments)] // The pieces of a file.
    fn write(
        &self,
        py: Python<'_>,
        file: (PathBuf, String, String),
        elastic: Vec<[f64; 2]>,
        held: Vec<String>,
        loads: Vec<(String, LoadArgument)>,
        fields: Vec<Field>,
        abaqus: bool,
    ) -> PyResult<()> {
        let text = FeText { abaqus, ..text(elastic, held, loads, fields) };
        write_as(py, &self.made.mesh, &BEAM_FORMATS, file, text)
    }
}

/// The formats of beams as finite elements: suffix and title.
pub fn formats() -> Vec<(&'static str, &'static str)> {
    BEAM_FORMATS.iter().map(|f| (f.0, f.1)).collect()
}
