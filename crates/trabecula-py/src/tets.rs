//! Tetrahedral meshes: arrays, figures, files; and the meshers and formats that are Python's.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats;
use geometry::math::Vec3;
use geometry::surface_mesh::SurfaceMesh;
use geometry::transform::Transform;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use trabecula::design::{BuiltTets, CellJoin, DesignError, Node, TetFileKind, Unit};

use crate::arrays::table;
use crate::error;
use crate::file;
use crate::folder::Folder;
use crate::mesh::Mesh;
use crate::node::node;
use crate::report::report;
use crate::run::{run, run_apart};

/// A number for each tetrahedron.
type Numbers<'py> = Bound<'py, PyArray1<f64>>;
/// A tetrahedral mesh, checked.
#[pyclass(frozen, module = "trabecula._core")]
pub struct TetMesh {
    tets: BuiltTets,
}

#[pymethods]
impl TetMesh {
    /// The tetrahedral mesh of a lattice (the first that has one) of a design, as text; `folder` is where paths start.
    #[staticmethod]
    #[pyo3(signature = (text, json, file, folder, lattice=None, threads=None))]
    fn from_text(
        py: Python<'_>,
        text: String,
        json: bool,
        file: String,
        folder: PathBuf,
        lattice: Option<String>,
        threads: Option<usize>,
    ) -> PyResult<TetMesh> {
        let made = run_apart(py, threads, move || {
            let node = if json { Node::from_json(&text)? } else { Node::from_toml(&text)? };
            BuiltTets::in_design(&node, lattice.as_deref(), &Folder(folder))
        })?;
        of(py, made.map_err(|e: DesignError| e.in_file(&file)))
    }

    /// The same of a design as data.
    #[staticmethod]
    #[pyo3(signature = (data, folder, lattice=None, threads=None))]
    fn from_data(
        py: Python<'_>,
        data: &Bound<'_, PyAny>,
        folder: PathBuf,
        lattice: Option<String>,
        threads: Option<usize>,
    ) -> PyResult<TetMesh> {
        let node = node(data, 0)?;
        let made = run_apart(py, threads, move || BuiltTets::in_design(&node, lattice.as_deref(), &Folder(folder)))?;
        of(py, made)
    }

    /// The tetrahedral mesh in a file; hexahedra, wedges and pyramids are cut up with `split`, else refused.
    #[staticmethod]
    #[pyo3(signature = (path, folder, unit=None, split=false))]
    fn read(py: Python<'_>, path: String, folder: PathBuf, unit: Option<&str>, split: bool) -> PyResult<TetMesh> {
        let unit = unit.map(str::parse::<Unit>).transpose();
        let unit = unit.map_err(|e| PyValueError::new_err(format!("unit: {}", e.message)))?;
        let spec = TetFileKind { path, unit, split, joined: CellJoin::default() };
        let made = run_apart(py, None, move || BuiltTets::in_file(&spec, &Folder(folder)))?;
        of(py, made)
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.tets.mesh.nodes.clone())
    }

    /// Nodes of each tetrahedron (m, 4), all of positive volume.
    #[getter]
    fn tets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        table(py, self.tets.mesh.tets.clone())
    }

    /// The zone of each tetrahedron; empty where there are none.
    #[getter]
    fn zones<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.tets.mesh.zones.clone().into_pyarray(py)
    }

    /// Numbers of zones with names, from the file.
    #[getter]
    fn zone_names(&self) -> Vec<(i64, String)> {
        self.tets.names.clone()
    }

    /// Numbers of nodes and tetrahedra.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        (self.tets.mesh.nodes.len(), self.tets.mesh.tets.len())
    }

    /// (path, message) of what may not be meant.
    #[getter]
    fn warnings(&self) -> Vec<(String, String)> {
        let each = self.tets.warnings.iter();
        each.map(|w| (w.path.clone(), w.message.clone())).collect()
    }

    /// The figures, as `reports.TetMeshReport`.
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report(py, "TetMeshReport", &self.tets.report())
    }

    /// The boundary: a closed surface, all of it cut.
    fn boundary(&self, py: Python<'_>) -> PyResult<Mesh> {
        let mesh = run(py, None, None, |_| self.tets.mesh.boundary())?;
        let cut = vec![true; mesh.triangles.len()];
        Ok(Mesh::new(SurfaceMesh { mesh, cut }, String::new()))
    }

    /// Its image under x ↦ M (x − c) + c + t.
    fn transformed(&self, py: Python<'_>, matrix: [Vec3; 3], center: Vec3, shift: Vec3) -> PyResult<TetMesh> {
        let by = Transform { matrix, center, shift };
        let made = run(py, None, None, |_| self.tets.transformed(&by))?;
        made.map(|tets| TetMesh { tets }).map_err(|e| PyValueError::new_err(e.message))
    }

    /// The least dihedral angle (degrees) and the size (mm) of each tetrahedron.
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<(Numbers<'py>, Numbers<'py>)> {
        let (angles, sizes) = run(py, None, None, |_| self.tets.mesh.shapes())?;
        Ok((angles.into_pyarray(py), sizes.into_pyarray(py)))
    }

    /// Writes the mesh as VTU, with the least dihedral angle and the size of each tetrahedron.
    fn write_vtu(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let done = run(py, None, None, |_| {
            let (angles, sizes) = self.tets.mesh.shapes();
            let mut out = BufWriter::new(file::anew(&path)?);
            formats::write_vtu(&self.tets.mesh, &[("least_dihedral", angles), ("size", sizes)], &mut out)?;
            out.flush()
        })?;
        Ok(done?)
    }
}

fn of(py: Python<'_>, made: Result<BuiltTets, DesignError>) -> PyResult<TetMesh> {
    let tets = made.map_err(|e| error::design(py, &e))?;
    Ok(TetMesh { tets })
}
