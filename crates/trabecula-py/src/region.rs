//! Regions: where a part may be.

use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use trabecula::design::{self, Node};
use trabecula::extract;
use trabecula::field::Field;

use crate::arrays::{points, values};
use crate::error;
use crate::folder::Folder;
use crate::mesh::Mesh;
use crate::node::node;
use crate::run::{run, run_apart};

/// Where a part may be: a signed distance.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Region {
    pub region: trabecula::region::Region,
}

#[pymethods]
impl Region {
    /// The region of a design, or of a file with the key `region` alone, as text; `folder` is where paths start.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: String, json: bool, file: String, folder: PathBuf) -> PyResult<Region> {
        let region = run_apart(py, None, move || {
            let node = if json { Node::from_json(&text)? } else { Node::from_toml(&text)? };
            design::region(&node, &Folder(folder))
        })?;
        region.map(|region| Region { region }).map_err(|e| error::design(py, &e.in_file(&file)))
    }

    /// The region under the key `region` of a dictionary.
    #[staticmethod]
    fn from_data(py: Python<'_>, data: &Bound<'_, PyAny>, folder: PathBuf) -> PyResult<Region> {
        let node = node(data, 0)?;
        let region = run_apart(py, None, move || design::region(&node, &Folder(folder)))?;
        region.map(|region| Region { region }).map_err(|e| error::design(py, &e))
    }

    /// Signed distance at points (n, 3), mm, negative inside.
    fn distance<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let region: &dyn Field = &*self.region;
        values(py, region, self::points(&points)?)
    }

    /// Lower and upper corner of the bounds, mm.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let b = self.region.bounds();
        (b.min, b.max)
    }

    /// Volume, mm³, as `extract::region_volume` at grid spacing `edge` (mm).
    fn volume(&self, py: Python<'_>, edge: f64) -> PyResult<f64> {
        run(py, None, None, |p| extract::region_volume(&self.region, edge, p))?.map_err(error::stopped)
    }

    /// The boundary as a mesh: that of a region that is a mesh as it is, of others at grid spacing `edge` (mm).
    fn mesh(&self, py: Python<'_>, edge: f64) -> PyResult<Mesh> {
        if let Some(of) = self.region.as_mesh() {
            return Ok(Mesh::bare(of.mesh().clone()));
        }
        let full = trabecula::solid::Solid::new(self.region.clone(), None, edge);
        let surface = run(py, None, None, |p| extract::surface(&full, edge, p))?;
        Ok(Mesh::bare(surface.map_err(error::stopped)?.mesh))
    }
}
