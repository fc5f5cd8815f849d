//! Occupancy on cubic voxels.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats;
use geometry::math::Vec3;
use numpy::{IntoPyArray, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::file;
use crate::run::run;

/// Occupancy on a grid of cubic voxels.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Voxels {
    pub voxels: geometry::voxels::Voxels,
}

#[pymethods]
impl Voxels {
    /// Lower corner of the first voxel, mm.
    #[getter]
    fn origin(&self) -> [f64; 3] {
        self.voxels.origin
    }

    /// Edge of a voxel, mm.
    #[getter]
    fn step(&self) -> f64 {
        self.voxels.step
    }

    /// Voxels along x, y, z.
    #[getter]
    fn shape(&self) -> [usize; 3] {
        self.voxels.shape
    }

    /// 1 where solid, indexed [z, y, x].
    #[getter]
    fn solid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let [nx, ny, nz] = self.voxels.shape;
        self.voxels.solid.clone().into_pyarray(py).reshape([nz, ny, nx])
    }

    /// The same voxels with another origin and step, mm.
    fn placed(&self, origin: Vec3, step: f64) -> Voxels {
        Voxels { voxels: geometry::voxels::Voxels { origin, step, ..self.voxels.clone() } }
    }

    /// Writes the voxels to `path` as `npy` (indexed [x, y, z]) or `vti`.
    fn write(&self, py: Python<'_>, path: PathBuf, extension: &str) -> PyResult<()> {
        let v = &self.voxels;
        let written = run(py, None, None, |_| {
            let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path)?);
            match extension {
                "npy" => formats::write_npy(v.shape, &v.solid, &mut out)?,
                _ => formats::write_vti(v, &mut out)?,
            }
            out.flush()
        })?;
        Ok(written?)
    }
}
