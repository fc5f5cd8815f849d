//! Voxels as finite elements: arrays, sets, figures, files.

use std::path::PathBuf;

use geometry::fe_mesh::HexMesh;
use geometry::formats::HEX_FORMATS;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use trabecula::report::VoxelElementsReport;

use crate::arrays::table;
use crate::error;
use crate::fe_arrays::{Field, Forces, LoadArgument, Members, forces, members, text, write_as};
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// Voxels as finite elements.
#[pyclass(frozen, module = "trabecula._core")]
pub struct VoxelElements {
    mesh: HexMesh,
}

#[pymethods]
impl VoxelElements {
    /// Of a solid: edge of a voxel (mm), and the least solid fraction of one.
    #[staticmethod]
    #[pyo3(signature = (solid, step, least, threads=None, progress=None))]
    fn make(
        py: Python<'_>,
        solid: &Solid,
        step: f64,
        least: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<VoxelElements> {
        let mesh = run(py, threads, progress, |p| solid.built().voxel_elements((step, least), p))?;
        Ok(VoxelElements { mesh: mesh.map_err(error::stopped)? })
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.mesh.nodes.clone())
    }

    /// Nodes of each hexahedron (m, 8), in the order of VTK.
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        table(py, self.mesh.hexes.clone())
    }

    /// The share of each hexahedron that is solid.
    #[getter]
    fn fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.mesh.fraction.clone().into_pyarray(py)
    }

    /// The names of the sets.
    #[getter]
    fn sets(&self) -> Vec<String> {
        self.mesh.sets.iter().map(|s| s.name.clone()).collect()
    }

    /// Nodes, hexahedra, and faces (hexahedron, number from 0 of S1 to S6 of Abaqus) of a set; None without it.
    fn set<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Option<Members<'py>>> {
        self.mesh.set(name).map(|set| members(py, set)).transpose()
    }

    /// The figures, as `reports.VoxelElementsReport`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, "VoxelElementsReport", &VoxelElementsReport::from(&self.mesh))
    }

    /// Nodes of a set's faces and the forces (N) at them, (n, 3), of a load; None without the set.
    fn forces<'py>(&self, py: Python<'py>, name: &str, load: LoadArgument) -> PyResult<Option<Forces<'py>>> {
        self.mesh.set(name).map(|set| forces(py, self.mesh.nodal_forces(set, load.into()))).transpose()
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
        write_as(py, &self.mesh, &HEX_FORMATS, file, text)
    }
}

/// The formats of voxels as finite elements: suffix and title.
pub fn formats() -> Vec<(&'static str, &'static str)> {
    HEX_FORMATS.iter().map(|f| (f.0, f.1)).collect()
}
