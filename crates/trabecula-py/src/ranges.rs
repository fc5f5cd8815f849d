//! The surface of a solid range by range of tiles, for other processes and later runs, and the ranges joined.

use std::sync::{Arc, Mutex};

use geometry::formats::{npy_head, pvti, stl, vti_frame};
use geometry::progress::{Progress, Silent, Stopped};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use trabecula::design::Built;
use trabecula::extract::{JoinedRanges, RangeMade, VoxelCentres};
use trabecula::report::SurfaceReport;
use trabecula::surface_maker::SurfaceOptions;

use crate::error;
use crate::report::report;
use crate::run::{run, run_apart};
use crate::solid::{Measured, Solid, islands_word, measured};

/// A range: its first item and the one after its last, its bytes of the output, its partial result.
type Range<'py> = (usize, usize, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// What a range is handed over to: its first item and the one after its last, its bytes of the output, its partial result.
pub type HandOver<'a> = dyn Fn(usize, usize, &[u8], &[u8]) -> Result<(), Stopped> + Sync + 'a;

/// Does work that hands ranges over to `take`, from another thread; what that raises ends the work.
pub fn handing_over(
    py: Python<'_>,
    threads: Option<usize>,
    take: &Py<PyAny>,
    work: impl FnOnce(&HandOver, &dyn Progress) -> Result<(), Stopped> + Send,
) -> PyResult<()> {
    let raised: Mutex<Option<PyErr>> = Mutex::default();
    let made = run(py, threads, None, |p| {
        work(&|first, next, data, partial| hand_over(take, &raised, (first, next, data, partial)), p)
    })?;
    match raised.into_inner().ok().flatten() {
        Some(e) => Err(e),
        None => made.map_err(error::stopped),
    }
}

/// Calls `take` with a range; what it raises is put aside.
fn hand_over(
    take: &Py<PyAny>,
    raised: &Mutex<Option<PyErr>>,
    range: (usize, usize, &[u8], &[u8]),
) -> Result<(), Stopped> {
    let call = Python::attach(|py| {
        let range: Range<'_> = (range.0, range.1, PyBytes::new(py, range.2), PyBytes::new(py, range.3));
        take.call1(py, range).map(drop)
    });
    call.map_err(|e| {
        if let Ok(mut raised) = raised.lock() {
            *raised = Some(e);
        }
        Stopped::Interrupted
    })
}

/// A solid on its grid, whose tiles are taken range by range.
#[pyclass(frozen, module = "trabecula._core")]
pub struct TileRanges {
    tiles: Arc<trabecula::extract::TileRanges>,
    figures: bool,
    /// By how much a level is moved on this grid.
    #[pyo3(get)]
    moved: f64,
}

#[pymethods]
impl TileRanges {
    /// The tiles of a solid at grid spacing `edge` (mm), for its triangles or for its `figures`; a ValueError for a solid that is not
    /// meshed on a grid. `moved` is what others of the same solid and spacing have found by measuring it.
    #[staticmethod]
    #[pyo3(signature = (solid, edge, figures=false, moved=None))]
    fn of(solid: Py<Solid>, py: Python<'_>, edge: f64, figures: bool, moved: Option<f64>) -> PyResult<TileRanges> {
        let work = move || {
            let built: &Built = solid.get().built();
            built.on_grid().map_err(Stopped::Refused)?;
            let moved = moved.map_or_else(|| built.grid_move(edge, &Silent), Ok)?;
            let tiles = trabecula::extract::TileRanges::new(&built.grid_solid(moved), edge);
            Ok((Arc::new(tiles.map_err(Stopped::Refused)?), moved))
        };
        let (tiles, moved) = run_apart(py, None, work)?.map_err(error::stopped)?;
        Ok(TileRanges { tiles, figures, moved })
    }

    /// Number of tiles.
    #[getter]
    fn count(&self) -> usize {
        self.tiles.tiles()
    }

    /// The surface in the tiles from `start` to before `end`, in ranges that end at multiples of `size`: calls `take` for each, in order
    /// and from another thread, with its first tile, the one after its last, its triangles as records of a binary STL (none for
    /// figures) and its partial result. What `take` raises ends the work.
    #[pyo3(signature = (start, end, size, take, threads=None))]
    fn each(
        &self,
        py: Python<'_>,
        start: usize,
        end: usize,
        size: usize,
        take: Py<PyAny>,
        threads: Option<usize>,
    ) -> PyResult<()> {
        handing_over(py, threads, &take, |hand, p| {
            let taken = |m: RangeMade| hand(m.tiles.start, m.tiles.end, &m.records, &m.partial);
            match self.figures {
                false => self.tiles.surface(start..end, size, p, taken),
                true => self.tiles.figures(start..end, size, p, taken),
            }
        })
    }
}

/// The voxels of a solid, taken range by range of layers.
#[pyclass(frozen, module = "trabecula._core")]
pub struct VoxelRanges {
    solid: Py<Solid>,
    grid: VoxelCentres,
}

#[pymethods]
impl VoxelRanges {
    /// Voxels of edge `step` (mm) of a solid.
    #[staticmethod]
    fn of(solid: Py<Solid>, step: f64) -> PyResult<VoxelRanges> {
        let grid = VoxelCentres::new(solid.get().solid(), step).map_err(error::fault)?;
        Ok(VoxelRanges { solid, grid })
    }

    /// Number of layers.
    #[getter]
    fn count(&self) -> usize {
        self.grid.shape[2]
    }

    /// Voxels along x, y, z.
    #[getter]
    fn shape(&self) -> [usize; 3] {
        self.grid.shape
    }

    /// Lower corner of the first voxel, mm.
    #[getter]
    fn origin(&self) -> [f64; 3] {
        self.grid.origin
    }

    /// What precedes and what follows the voxels of the layers from `start` to before `end` in a file, `npy` or `vti`.
    fn frame<'py>(&self, py: Python<'py>, extension: &str, start: usize, end: usize) -> [Bound<'py, PyBytes>; 2] {
        let (VoxelCentres { origin, step, shape, .. }, layers) = (&self.grid, start..end.max(start));
        let [head, tail] = match extension {
            "npy" => [npy_head([shape[0], shape[1], layers.len()]), Vec::new()],
            _ => vti_frame(*origin, *step, *shape, layers),
        };
        [PyBytes::new(py, &head), PyBytes::new(py, &tail)]
    }

    /// The file (PVTI) by which programs open files of layers as one: their names, first layers and those after their last ones.
    fn index(&self, files: Vec<(String, usize, usize)>) -> String {
        let files: Vec<_> = files.into_iter().map(|(name, start, end)| (name, start..end)).collect();
        pvti(self.grid.origin, self.grid.step, self.grid.shape, &files)
    }

    /// As `TileRanges.each`, of layers: their voxels, x fastest, and the number of those that are solid as eight bytes, the lowest first.
    #[pyo3(signature = (start, end, size, take, threads=None))]
    fn each(
        &self,
        py: Python<'_>,
        start: usize,
        end: usize,
        size: usize,
        take: Py<PyAny>,
        threads: Option<usize>,
    ) -> PyResult<()> {
        let (end, size) = (end.min(self.count()), size.max(1));
        let solid = self.solid.get().solid();
        handing_over(py, threads, &take, |hand, p| {
            let mut at = start;
            while at < end {
                let next = ((at / size + 1) * size).min(end);
                let voxels = self.grid.layers(solid, at..next, p)?;
                let count = voxels.iter().map(|v| u64::from(*v)).sum::<u64>();
                hand(at, next, &voxels, &count.to_le_bytes())?;
                at = next;
            }
            Ok(())
        })
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
        let ranges = self.ranges.as_mut().ok_or_else(joined_already)?;
        py.detach(|| ranges.add(partial)).map_err(error::fault)
    }

    /// The whole surface: its `reports.SurfaceReport`, its other connected components in words, the triangles that stay as ranges of
    /// their numbers, and how many there are before any are dropped.
    fn finish<'py>(&mut self, py: Python<'py>, edge: f64, islands: &str) -> PyResult<Whole<'py>> {
        let options = SurfaceOptions { resolution: edge, islands: islands_word(islands)? };
        let ranges = self.ranges.take().ok_or_else(joined_already)?;
        let made = py.detach(|| ranges.finish(&options)).map_err(error::stopped)?;
        let kept = made.kept.iter().map(|r| (r.start, r.end)).collect();
        let summary = report(py, "SurfaceReport", &SurfaceReport::from(&made.summary))?;
        Ok((summary, made.summary.components.description(), kept, made.triangles))
    }

    /// The figures of the whole surface, in a region of this volume (mm³): as `Solid.measure`.
    fn measured<'py>(&mut self, py: Python<'py>, edge: f64, region: f64) -> PyResult<Measured<'py>> {
        let ranges = self.ranges.take().ok_or_else(joined_already)?;
        let made = py.detach(|| ranges.measured(&SurfaceOptions::new(edge))).map_err(error::stopped)?;
        measured(py, &made, region)
    }
}

fn joined_already() -> PyErr {
    PyValueError::new_err("the ranges are joined already")
}

/// The first bytes of a binary STL, given the number of its triangles.
pub fn stl_header(triangles: u32) -> [u8; stl::HEADER] {
    stl::header(triangles)
}
