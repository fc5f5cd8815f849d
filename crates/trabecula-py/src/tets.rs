//! Tetrahedral meshes: arrays, figures, files; and the meshers and formats that are Python's.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats::{self, Elements};
use geometry::surface_mesh::SurfaceMesh;
use geometry::tetmesh::TetMesh as Core;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use trabecula::design::{DesignError, Joined, Node, TetFileSpec, Tets, Unit};

use crate::design::Folder;
use crate::error;
use crate::file;
use crate::mesh::Mesh;
use crate::run::run;

/// A number for each tetrahedron.
type Numbers<'py> = Bound<'py, PyArray1<f64>>;
/// Points, connectivity, ends, kinds and zones of elements that Python read.
type Read<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u64>,
    PyReadonlyArray1<'py, u8>,
    PyReadonlyArray1<'py, u32>,
);

/// A tetrahedral mesh, checked.
#[pyclass(frozen, module = "trabecula._core")]
pub struct TetMesh {
    tets: Tets,
}

#[pymethods]
impl TetMesh {
    /// The tetrahedral mesh of a lattice (the first that has one) of a design, as text; `folder` is where paths start.
    #[staticmethod]
    #[pyo3(signature = (text, json, file, folder, lattice=None, threads=None))]
    fn from_text(
        py: Python<'_>,
        text: &str,
        json: bool,
        file: String,
        folder: PathBuf,
        lattice: Option<&str>,
        threads: Option<usize>,
    ) -> PyResult<TetMesh> {
        let made = run(py, threads, None, |_| {
            let node = if json { Node::from_json(text)? } else { Node::from_toml(text)? };
            Tets::in_design(&node, lattice, &Folder(folder))
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
        lattice: Option<&str>,
        threads: Option<usize>,
    ) -> PyResult<TetMesh> {
        let node = crate::design::node(data, 0)?;
        let made = run(py, threads, None, |_| Tets::in_design(&node, lattice, &Folder(folder)))?;
        of(py, made)
    }

    /// The tetrahedral mesh in a file; hexahedra, wedges and pyramids are cut up with `split`, else refused.
    #[staticmethod]
    #[pyo3(signature = (path, folder, unit=None, split=false))]
    fn read(py: Python<'_>, path: String, folder: PathBuf, unit: Option<&str>, split: bool) -> PyResult<TetMesh> {
        let unit = unit.map(str::parse::<Unit>).transpose();
        let unit = unit.map_err(|e| pyo3::exceptions::PyValueError::new_err(format!("unit: {}", e.message)))?;
        let spec = TetFileSpec { path, unit, split, joined: Joined::default() };
        let made = run(py, None, None, |_| Tets::in_file(&spec, &Folder(folder)))?;
        of(py, made)
    }

    /// Nodes (n, 3), mm.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let nodes = self.tets.mesh.nodes.clone();
        let n = nodes.len();
        nodes.into_flattened().into_pyarray(py).reshape([n, 3])
    }

    /// Nodes of each tetrahedron (m, 4), all of positive volume.
    #[getter]
    fn tets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let tets = self.tets.mesh.tets.clone();
        let m = tets.len();
        tets.into_flattened().into_pyarray(py).reshape([m, 4])
    }

    /// The zone of each tetrahedron; empty where there are none.
    #[getter]
    fn zones<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        self.tets.mesh.zones.clone().into_pyarray(py)
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

    /// The figures as JSON text.
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        run(py, None, None, |_| self.tets.to_json().to_string())
    }

    /// The boundary: a closed surface, all of it cut.
    fn boundary(&self, py: Python<'_>) -> PyResult<Mesh> {
        let mesh = run(py, None, None, |_| self.tets.mesh.boundary())?;
        let cut = vec![true; mesh.triangles.len()];
        Ok(Mesh::new(SurfaceMesh { mesh, cut }, String::new()))
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

fn of(py: Python<'_>, made: Result<Tets, DesignError>) -> PyResult<TetMesh> {
    let tets = made.map_err(|e| error::design(py, &e))?;
    Ok(TetMesh { tets })
}

/// What an exception says.
fn words(py: Python<'_>, e: &PyErr) -> String {
    e.value(py).to_string()
}

/// The elements of a file of a format that Python reads.
pub fn elements(path: &str) -> Result<(Elements, Vec<u32>), String> {
    Python::attach(|py| {
        let read = || -> PyResult<(Elements, Vec<u32>)> {
            let read = py.import("trabecula.elements")?.getattr("read")?.call1((path,))?;
            let (points, connectivity, ends, kinds, zones): Read<'_> = read.extract()?;
            let elements = Elements {
                points: rows(&points),
                connectivity: connectivity.as_array().to_vec(),
                ends: ends.as_array().iter().map(|e| *e as usize).collect(),
                kinds: kinds.as_array().to_vec(),
            };
            Ok((elements, zones.as_array().to_vec()))
        };
        read().map_err(|e| words(py, &e))
    })
}

/// The tetrahedra that a mesher of Python's makes of a surface.
pub fn tetrahedra(name: &str, surface: &geometry::mesh::Mesh, size: f64, limit: f64) -> Result<Core, String> {
    Python::attach(|py| {
        let make = || -> PyResult<Core> {
            let flat = surface.vertices.clone().into_flattened().into_pyarray(py);
            let points = flat.reshape([surface.vertices.len(), 3])?;
            let flat = surface.triangles.clone().into_flattened().into_pyarray(py);
            let triangles = flat.reshape([surface.triangles.len(), 3])?;
            let call = py.import("trabecula.meshers")?.getattr("tetrahedra")?;
            let made = call.call1((name, points, triangles, size, limit))?;
            let (nodes, tets): (PyReadonlyArray2<'_, f64>, PyReadonlyArray2<'_, u32>) = made.extract()?;
            let tets = tets.as_array();
            Ok(Core {
                nodes: rows(&nodes),
                tets: tets.rows().into_iter().map(|r| [r[0], r[1], r[2], r[3]]).collect(),
                zones: Vec::new(),
            })
        };
        make().map_err(|e| words(py, &e))
    })
}

fn rows(of: &PyReadonlyArray2<'_, f64>) -> Vec<[f64; 3]> {
    of.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect()
}
