//! Layers of a solid: contours as arrays.

use geometry::formats::LAYER_FORMATS;
use geometry::layer::Layer;
use geometry::math::Aabb;
use geometry::progress::Cancellation;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;
use trabecula::layers::{Adaptive, Plan, Slicer};

use crate::error;
use crate::run::run;
use crate::solid::Solid;

/// Height of the section, lower and upper face (mm), closed contours (n, 2), area (mm²).
type Section<'py> = (f64, f64, f64, Vec<Bound<'py, PyArray2<f64>>>, f64);

/// A solid that is ready to be sliced.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Layers {
    pub slicer: Slicer,
    pub bounds: Aabb,
}

fn section<'py>(py: Python<'py>, layer: &Layer) -> PyResult<Section<'py>> {
    let closed = |l: &Vec<[f64; 2]>| {
        let flat: Vec<f64> = l.iter().chain(l.first()).flatten().copied().collect();
        flat.into_pyarray(py).reshape([l.len() + 1, 2])
    };
    let loops = layer.loops.iter().map(closed).collect::<PyResult<_>>()?;
    Ok((layer.z, layer.bottom, layer.top, loops, layer.area()))
}

#[pymethods]
impl Layers {
    /// Of a solid: thickness of layers, tolerance, edge of the cells of the sampling grid, begin and end (mm), greatest
    /// cusp and least thickness where it follows the slope (mm).
    #[staticmethod]
    #[pyo3(signature = (solid, layer, tolerance, step, begin=None, end=None, adaptive=None))]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    fn of(
        py: Python<'_>,
        solid: &Solid,
        layer: f64,
        tolerance: f64,
        step: f64,
        begin: Option<f64>,
        end: Option<f64>,
        adaptive: Option<[f64; 2]>,
    ) -> PyResult<Layers> {
        let solid = solid.solid();
        let adaptive = adaptive.map(|[cusp, least]| Adaptive { cusp, least });
        let plan = Plan { layer, tolerance, step, adaptive, range: [begin, end] };
        let slicer = run(py, None, None, |_| Slicer::new(solid, &plan))?.map_err(error::fault)?;
        Ok(Layers { slicer, bounds: solid.region.bounds() })
    }

    /// Where layers begin, and the end of the last one, mm.
    #[getter]
    fn heights(&self) -> Vec<f64> {
        self.slicer.heights().to_vec()
    }

    /// Some layers in a row.
    #[pyo3(signature = (first, count, threads=None))]
    fn some<'py>(
        &self,
        py: Python<'py>,
        first: usize,
        count: usize,
        threads: Option<usize>,
    ) -> PyResult<Vec<Section<'py>>> {
        let end = self.slicer.len().min(first.saturating_add(count));
        let made: Vec<Layer> = run(py, threads, None, |_| {
            let request = Cancellation::current();
            (first..end).into_par_iter().map(|i| request.enter(|| self.slicer.layer(i))).collect()
        })?;
        made.iter().map(|l| section(py, l)).collect()
    }

    /// The section at a height, mm.
    fn at<'py>(&self, py: Python<'py>, z: f64) -> PyResult<Section<'py>> {
        section(py, &run(py, None, None, |_| self.slicer.at(z))?)
    }
}

/// The formats of layers: suffix and title, whether it holds pictures, whether all layers have one thickness.
pub fn formats() -> Vec<(&'static str, &'static str, bool, bool)> {
    LAYER_FORMATS.iter().map(|f| (f.suffix, f.title, f.pictures, f.uniform)).collect()
}
