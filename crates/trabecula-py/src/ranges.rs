//! The surface of a solid range by range of tiles, for other processes and later runs, and the ranges joined.

use std::sync::{Arc, Mutex};

use geometry::formats::stl;
use geometry::progress::Stopped;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use trabecula::design::Built;
use trabecula::extract::{JoinedRanges, RangeMade};
use trabecula::report::SurfaceReport;
use trabecula::surface_maker::Options;

use crate::error;
use crate::report::report;
use crate::run::{run, run_apart};
use crate::solid::{Solid, islands_word};

/// A solid on its grid, whose tiles are taken range by range.
#[pyclass(frozen, module = "trabecula._core")]
pub struct TileRanges {
    tiles: Arc<trabecula::extract::TileRanges>,
}

/// First and last-but-one tile, triangles as records of a binary STL, partial result.
type Range<'py> = (usize, usize, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

fn given<'py>(py: Python<'py>, made: &RangeMade) -> Range<'py> {
    (made.tiles.start, made.tiles.end, PyBytes::new(py, &made.records), PyBytes::new(py, &made.partial))
}

#[pymethods]
impl TileRanges {
    /// The tiles of a solid at grid spacing `edge` (mm); a ValueError for a solid that is not meshed on a grid.
    #[staticmethod]
    fn of(solid: Py<Solid>, py: Python<'_>, edge: f64) -> PyResult<TileRanges> {
        let work = move || {
            let built: &Built = solid.get().built();
            built.on_grid()?;
            trabecula::extract::TileRanges::new(&built.solid, edge)
        };
        Ok(TileRanges { tiles: Arc::new(run_apart(py, None, work)?.map_err(error::fault)?) })
    }

    /// Number of tiles.
    #[getter]
    fn tiles(&self) -> usize {
        self.tiles.tiles()
    }

    /// The surface in the tiles from `start` to before `end`, in ranges that end at multiples of `size`: calls `take` for each, in order
    /// and from another thread, with its first tile, the one after its last, its triangles as records of a binary STL and its
    /// partial result. What `take` raises ends the work.
    #[pyo3(signature = (start, end, size, take, threads=None, progress=None))]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    fn each(
        &self,
        py: Python<'_>,
        start: usize,
        end: usize,
        size: usize,
        take: Py<PyAny>,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<()> {
        let raised: Mutex<Option<PyErr>> = Mutex::default();
        let taken = |made: RangeMade| {
            Python::attach(|py| take.call1(py, given(py, &made))).map(drop).map_err(|e| {
                if let Ok(mut raised) = raised.lock() {
                    *raised = Some(e);
                }
                Stopped::Interrupted
            })
        };
        let ended = run(py, threads, progress, |p| self.tiles.each(start..end, size, p, taken))?;
        match raised.into_inner().ok().flatten() {
            Some(e) => Err(e),
            None => ended.map_err(error::stopped),
        }
    }
}

/// Ranges of tiles that are joined, in order.
#[pyclass(module = "trabecula._core")]
#[derive(Default)]
pub struct Joined {
    ranges: Option<JoinedRanges>,
}

/// Report of the surface, its other connected components in words, ranges of the triangles that stay, triangles before any are
/// dropped.
type Whole<'py> = (Bound<'py, PyAny>, String, Vec<(u64, u64)>, u64);

#[pymethods]
impl Joined {
    #[new]
    fn new() -> Joined {
        Joined { ranges: Some(JoinedRanges::default()) }
    }

    /// Adds the partial result of the next range; a ValueError for bytes that are none.
    fn add(&mut self, py: Python<'_>, partial: &[u8]) -> PyResult<()> {
        let ranges = self.ranges.as_mut().ok_or_else(ended)?;
        py.detach(|| ranges.add(partial)).map_err(error::fault)
    }

    /// The whole surface: its `reports.SurfaceReport`, its other connected components in words, the triangles that stay as ranges of
    /// their numbers, and how many there are before any are dropped.
    fn finish<'py>(&mut self, py: Python<'py>, edge: f64, islands: &str) -> PyResult<Whole<'py>> {
        let options = Options { resolution: edge, islands: islands_word(islands)? };
        let ranges = self.ranges.take().ok_or_else(ended)?;
        let made = py.detach(|| ranges.finish(&options)).map_err(error::stopped)?;
        let kept = made.kept.iter().map(|r| (r.start, r.end)).collect();
        let told = report(py, "SurfaceReport", &SurfaceReport::from(&made.summary))?;
        Ok((told, made.summary.components.words(), kept, made.triangles))
    }
}

fn ended() -> PyErr {
    PyValueError::new_err("the ranges are joined already")
}

/// The first bytes of a binary STL of so many triangles.
pub fn stl_header(triangles: u32) -> [u8; stl::HEADER] {
    stl::header(triangles)
}
