//! Solids: field, surface, voxels, figures.

use std::io::BufWriter;
use std::path::PathBuf;

use geometry::formats::part21::{Protocol, Title};
use geometry::progress::Stopped;
use geometry::repair::Repaired;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trabecula::analysis;
use trabecula::design::Built;
use trabecula::extract::{self, SpaceMade};
use trabecula::field::Field;
use trabecula::map::{Misfit, Phase};
use trabecula::report::{IslandsReport, MeshReport, SurfaceReport};
use trabecula::solid::Space;
use trabecula::surface_maker::{self, Estimate, Islands, ScratchStores, SurfaceMaker, SurfaceOptions};
use trabecula::truss::Beams;

use crate::arrays::{self, values};
use crate::error;
use crate::file;
use crate::mesh::{Mesh, metadata};
use crate::quadors::Quadors;
use crate::region::Region;
use crate::report::report;
use crate::run::{run, run_apart};
use crate::voxels::Voxels;

/// A region and the lattice in it.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Solid {
    built: Built,
    design: String,
}

impl Solid {
    pub fn new(built: Built, design: String) -> Self {
        Solid { built, design }
    }

    /// Negative in the solid.
    pub fn as_field(&self) -> &dyn Field {
        &self.built.solid
    }

    /// The solid itself.
    pub fn solid(&self) -> &trabecula::Solid {
        &self.built.solid
    }

    /// What was built.
    pub fn built(&self) -> &Built {
        &self.built
    }

    /// The design as TOML text.
    pub fn text(&self) -> &str {
        &self.design
    }

    /// The solved map of a lattice.
    fn solved(&self, lattice: &str) -> PyResult<&Phase> {
        let found = self.built.lattices.iter().find(|(name, _)| name == lattice);
        let missing = || PyValueError::new_err(format!("lattice.{lattice} has no map that was solved for"));
        found.and_then(|(_, l)| l.map.solved()).ok_or_else(missing)
    }
}

/// A number and a 3 × 3 matrix for each point.
type CellAt<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray3<f64>>);
/// Names, and a column of numbers (n, names) for each.
type NamedColumns<'py> = (Vec<String>, Bound<'py, PyArray2<f64>>);

/// Name, centres (n, 3), radii (n,), ends (m, 2).
type BeamArrays<'py> = (String, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<u32>>);

/// Reports of a surface, the quality of its triangles, and its other connected components.
pub type Measured<'py> = (Bound<'py, PyAny>, Option<Bound<'py, PyAny>>, Bound<'py, PyAny>);

/// What is to become of the connected components other than the largest.
pub fn islands_word(word: &str) -> PyResult<Islands> {
    Islands::named(word).ok_or_else(|| {
        PyValueError::new_err(format!(r#"islands is "{word}"; it must be "keep", "drop-small", "drop" or "error""#))
    })
}

/// What is measured of a surface in a region of this volume (mm³), as reports.
pub fn measured<'py>(py: Python<'py>, made: &surface_maker::Measured, region: f64) -> PyResult<Measured<'py>> {
    let quality = made.quality.map(|q| report(py, "QualityReport", &q));
    Ok((
        report(py, "MeshReport", &MeshReport::of(&made.figures, true, Some(region)))?,
        quality.transpose()?,
        report(py, "IslandsReport", &IslandsReport::from(&made.components))?,
    ))
}

#[pymethods]
impl Solid {
    /// (path, message) of possible mistakes in the design.
    #[getter]
    fn warnings(&self) -> Vec<(String, String)> {
        self.built.warnings.iter().map(|w| (w.path.clone(), w.message.clone())).collect()
    }

    /// What was repaired in each mesh of the region, by the path of its table, as `reports.RepairReport`.
    #[getter]
    fn repairs<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        let reported = |(path, done): &(String, Repaired)| Ok((path.clone(), report(py, "RepairReport", done)?));
        self.built.repairs.iter().map(reported).collect()
    }

    /// The design as TOML text.
    #[getter]
    fn design(&self) -> &str {
        &self.design
    }

    /// The smallest wavelength, mm.
    #[getter]
    fn wavelength(&self) -> f64 {
        self.built.solid.wavelength
    }

    /// The least thickness of the skin, mm, if there is one.
    #[getter]
    fn skin(&self) -> Option<f64> {
        self.built.skin
    }

    /// Lower and upper corner of the region's bounds, mm.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let b = self.built.solid.region.bounds();
        (b.min, b.max)
    }

    /// The region.
    #[getter]
    fn region(&self) -> Region {
        Region { region: self.built.solid.region.clone() }
    }

    /// The figures of the design without meshing it, as `reports.DesignReport`.
    fn report(slf: Py<Self>, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        report(py, "DesignReport", &run_apart(py, None, move || slf.get().built.report())?)
    }

    /// The transitions between the lattices of a blend, each as `reports.TransitionReport`.
    fn transitions<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let found = run(py, None, None, |_| self.built.transitions())?;
        found.iter().map(|t| report(py, "TransitionReport", t)).collect()
    }

    /// Fragments attached by necks thinner than half of `neck` (mm), as `reports.DanglingReport`.
    #[pyo3(signature = (neck, threads=None, progress=None))]
    fn dangling<'py>(
        &self,
        py: Python<'py>,
        neck: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let found =
            run(py, threads, progress, |p| analysis::dangling(&self.built.solid, neck, p))?.map_err(error::stopped)?;
        report(py, "DanglingReport", &found)
    }

    /// The solid share of the region, by points inside, and the region's volume (mm³), exact where that is known.
    fn expected(&self, py: Python<'_>) -> PyResult<(f64, f64)> {
        run(py, None, None, |_| self.built.expected())
    }

    /// The relative error to expect of the volume of lattices in a mesh at grid spacing `edge` (mm), if any is meshed on a grid.
    fn volume_error(slf: Py<Self>, py: Python<'_>, edge: f64) -> PyResult<Option<f64>> {
        run_apart(py, None, move || slf.get().built.volume_error(edge))
    }

    /// What is wrong with a surface made in steps of `edge` (mm) that encloses `volume` (mm³) and has this number of `pieces`, for a lattice
    /// over tetrahedra, and the step that suffices.
    fn coarse_steps(&self, py: Python<'_>, edge: f64, volume: f64, pieces: usize) -> PyResult<Option<String>> {
        run(py, None, None, |_| self.built.coarse_steps(edge, volume, pieces))
    }

    /// The graphs of beams: name, centres and radii of hubs, the hubs that each beam joins.
    #[getter]
    fn beams<'py>(&self, py: Python<'py>) -> PyResult<Vec<BeamArrays<'py>>> {
        let graph = |(name, beams): &(String, Beams)| {
            let graph = match beams {
                Beams::Truss(truss) => truss.graph.clone(),
                Beams::Pattern(laid) => laid.pattern().expanded().map_err(error::fault)?,
            };
            let (hubs, beams) = (&graph.hubs, &graph.beams);
            let centers: Vec<f64> = hubs.iter().flat_map(|h| h.center).collect();
            let radii: Vec<f64> = hubs.iter().map(|h| h.radius).collect();
            let ends: Vec<u32> = beams.iter().flat_map(|b| b.ends).collect();
            Ok((
                name.clone(),
                centers.into_pyarray(py).reshape([hubs.len(), 3])?,
                radii.into_pyarray(py),
                ends.into_pyarray(py).reshape([beams.len(), 2])?,
            ))
        };
        self.built.beams.iter().map(graph).collect()
    }

    /// Whether the beams of a name are all that the design is: not cut, nothing added. Of a large pattern, by a box that holds it.
    fn whole_beams(&self, name: &str) -> bool {
        self.built.whole_beams(name)
    }

    /// Whether the region cuts beams of a design that is made of beams alone; a ValueError for others.
    fn cuts_beams(slf: Py<Self>, py: Python<'_>) -> PyResult<bool> {
        run_apart(py, None, move || slf.get().built.cuts_beams())?.map_err(error::fault)
    }

    /// The beams of a name as quadrics.
    fn quadors(&self, py: Python<'_>, name: &str) -> PyResult<Quadors> {
        match self.built.beams.iter().find(|b| b.0 == name) {
            Some((_, Beams::Truss(truss))) => Ok(Quadors { quadors: truss.quadors.clone() }),
            Some((_, Beams::Pattern(laid))) => {
                let written = run(py, None, None, |_| laid.expand())?;
                let written = written.map_err(|f| error::fault(f.under(&format!("beams.{name}"))))?;
                Ok(Quadors { quadors: written })
            }
            None => Err(PyValueError::new_err(format!("there are no beams named {name}"))),
        }
    }

    /// Values at points (n, 3): negative in the solid.
    fn field<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        values(py, &self.built.solid, arrays::points(&points)?)
    }

    /// Deviation of the solved map of a lattice from the one asked for, at points (n, 3): the worst angle (degrees), the worst
    /// spacing ratio or its inverse, det J over the one asked for.
    fn map_error<'py>(
        &self,
        py: Python<'py>,
        lattice: &str,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let map = self.solved(lattice)?;
        let points = arrays::points(&points)?;
        let found = run(py, None, None, |_| map.misfits(&points))?.map_err(error::fault)?;
        let array = |of: &dyn Fn(&Misfit) -> f64| {
            let values: Vec<f64> = found.iter().map(of).collect();
            values.into_pyarray(py)
        };
        let worst = |v: [f64; 3]| v.into_iter().fold(0.0, f64::max);
        let d = PyDict::new(py);
        d.set_item("angle", array(&|m| worst(m.angle)))?;
        let either = |m: &Misfit| worst(m.spacing.map(|s| s.max(1.0 / s)));
        d.set_item("spacing", array(&either))?;
        d.set_item("density", array(&|m| m.density))?;
        Ok(d)
    }

    /// The gradients (n, 3, 3) that the solved map of a lattice was asked for at points (n, 3), turns per mm.
    fn map_asked<'py>(
        &self,
        py: Python<'py>,
        lattice: &str,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let map = self.solved(lattice)?;
        let points = arrays::points(&points)?;
        let found = run(py, None, None, |_| map.asked(&points))?.map_err(error::fault)?;
        let flat: Vec<f64> = found.iter().flatten().flatten().copied().collect();
        flat.into_pyarray(py).reshape([found.len(), 3, 3])
    }

    /// The cell of a lattice at points (n, 3): its solid fraction (n,), and the gradients of its three phases (n, 3, 3), turns per mm;
    /// None without that lattice.
    fn cell_at<'py>(
        &self,
        py: Python<'py>,
        lattice: &str,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Option<CellAt<'py>>> {
        let Some((_, found)) = self.built.lattices.iter().find(|(n, _)| n == lattice) else { return Ok(None) };
        let points = arrays::points(&points)?;
        let n = points.len();
        let (fractions, gradients) = run(py, None, None, |_| {
            let (mut fractions, mut phases, mut gradients) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[[0.0; 3]; 3]; n]);
            found.fractions(&points, &mut fractions);
            found.map.phases_and_jacobians(&points, &mut phases, &mut gradients);
            (fractions, gradients)
        })?;
        let flat: Vec<f64> = gradients.into_iter().flatten().flatten().collect();
        Ok(Some((fractions.into_pyarray(py), flat.into_pyarray(py).reshape([n, 3, 3])?)))
    }

    /// The names of the lattices of a blend and their shares (n, names) at points (n, 3); None without a blend.
    fn shares<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Option<NamedColumns<'py>>> {
        let points = arrays::points(&points)?;
        let Some(blended) = &self.built.blend else { return Ok(None) };
        let n = blended.names.len();
        let shares = run(py, None, None, |_| {
            let mut shares = vec![0.0; n * points.len()];
            blended.blend.weights().values(&points, &mut shares);
            shares
        })?;
        Ok(Some((blended.names.clone(), shares.into_pyarray(py).reshape([points.len(), n])?)))
    }

    /// The grid spacing of a mesh without a request, where that of the report makes too many triangles: what is used and what the
    /// walls need, mm, and about how many triangles that would make.
    fn coarser_spacing(slf: Py<Self>, py: Python<'_>) -> PyResult<Option<(f64, f64, f64)>> {
        let found = run_apart(py, None, move || slf.get().built.coarser_spacing())?;
        Ok(found.map(|c| (c.spacing, c.wanted, c.triangles)))
    }

    /// What a surface at grid spacing `edge` (mm) takes, as `reports.EstimateReport`. It is counted on a grid of at least
    /// `coarse` (mm), or as fine as transitions need, and scaled from there: triangles grow as the spacing to the power −2.
    fn estimate(slf: Py<Self>, py: Python<'_>, edge: f64, coarse: f64) -> PyResult<Bound<'_, PyAny>> {
        let counted = edge.max(coarse.min(slf.get().built.solid.transition.unwrap_or(f64::INFINITY)));
        let work = move || slf.get().built.surface().estimate(counted);
        let made = run_apart(py, None, work)?.map_err(error::fault)?;
        let times = (counted / edge).powi(2);
        let scaled =
            Estimate { triangles: made.triangles * times, memory: made.memory * times, stl: made.stl * times, ..made };
        report(py, "EstimateReport", &scaled)
    }

    /// The surface at grid spacing `edge` (mm), its other connected components as `reports.IslandsReport`, and these in words.
    #[pyo3(signature = (edge, threads=None, progress=None, islands="drop-small"))]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        edge: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        islands: &str,
    ) -> PyResult<(Mesh, Bound<'py, PyAny>, String)> {
        let options = SurfaceOptions { resolution: edge, islands: islands_word(islands)? };
        let made = run(py, threads, progress, |p| self.built.surface().mesh(&options, p))?.map_err(error::stopped)?;
        let others = report(py, "IslandsReport", &IslandsReport::from(&made.components))?;
        Ok((Mesh::new(made.surface, self.design.clone()), others, made.components.description()))
    }

    /// The figures of the surface at grid spacing `edge` (mm), in a region of this volume (mm³), taken while it is made:
    /// `reports.MeshReport`, `reports.QualityReport`; its other connected components as `reports.IslandsReport`.
    #[pyo3(signature = (edge, region, threads=None, progress=None))]
    fn measure<'py>(
        &self,
        py: Python<'py>,
        edge: f64,
        region: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Measured<'py>> {
        let made = run(py, threads, progress, |p| self.built.surface().measure(&SurfaceOptions::new(edge), p))?;
        let made = made.map_err(error::stopped)?;
        measured(py, &made, region)
    }

    /// Names of what is solid whatever the lattice says.
    #[getter]
    fn bodies(&self) -> Vec<String> {
        self.built.bodies.clone()
    }

    /// Whether files of its mesh have no caps on the region's boundary.
    #[getter]
    fn open_ends(&self) -> bool {
        self.built.is_open()
    }

    /// The chord error at which a mesh is made unless another resolution is asked for, mm; None on a grid.
    #[getter]
    fn default_chord(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        run(py, None, None, |_| self.built.default_chord())
    }

    /// Some of the solids into which a sheet divides the region, at grid spacing `edge` (mm): each with its connected components
    /// as `reports.IslandsReport`, and these in words. With `whole`, each must be in one piece.
    #[pyo3(signature = (names, edge, threads=None, progress=None, whole=false))]
    fn parts<'py>(
        &self,
        py: Python<'py>,
        names: Vec<String>,
        edge: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        whole: bool,
    ) -> PyResult<Vec<(Mesh, Bound<'py, PyAny>, String)>> {
        let of = |name: &String| {
            let found = Space::ALL.into_iter().find(|s| s.name() == name);
            found.ok_or_else(|| PyValueError::new_err(format!("no part is named {name}: wall, lower, upper")))
        };
        let wanted = names.iter().map(of).collect::<PyResult<Vec<Space>>>()?;
        let made = run(py, threads, progress, |p| extract::spaces(&self.built.solid, &wanted, edge, whole, p))?;
        let made = made.map_err(error::stopped)?.into_iter();
        made.map(|SpaceMade { made, .. }| {
            let others = report(py, "IslandsReport", &IslandsReport::from(&made.components))?;
            Ok((Mesh::new(made.surface, self.design.clone()), others, made.components.description()))
        })
        .collect()
    }

    /// About how many triangles the surface of beams alone has within `chord` (mm) of their patches, and of how many all others
    /// are copies.
    fn expected_beams(&self, py: Python<'_>, chord: f64) -> PyResult<[f64; 2]> {
        let e = run(py, None, None, |_| self.built.beam_surface()?.estimate(chord))?.map_err(error::fault)?;
        Ok([e.triangles, e.held])
    }

    /// Streams the surface of beams alone to a binary STL at `path`, triangles within `chord` (mm) of their patches; gives
    /// its `reports.SurfaceReport`.
    #[pyo3(signature = (path, chord, threads=None))]
    fn stream_beams<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        chord: f64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let made = run(py, threads, None, |p| {
            let beams = self.built.beam_surface().map_err(Stopped::Refused)?;
            let mut out = file::anew(&path).map_err(Stopped::Io)?;
            beams.stream_stl(&SurfaceOptions::new(chord), &mut out, p)
        })?;
        report(py, "SurfaceReport", &SurfaceReport::from(&made.map_err(error::stopped)?))
    }

    /// Writes a STEP file at `path`, of a product's name and a protocol ("ap214", "ap242"): beams alone exactly, lattices in a box as
    /// patches within `tolerance` (mm); gives its `reports.StepReport`. `assembly`: whether beams are written hub by hub.
    #[pyo3(signature = (path, title, tolerance=None, assembly=None, threads=None, progress=None))]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    fn write_step<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        title: (String, String),
        tolerance: Option<f64>,
        assembly: Option<bool>,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (name, protocol) = &title;
        let known =
            || PyValueError::new_err(format!("protocol is {protocol}; it must be {}", Protocol::NAMES.join(" or ")));
        let title = Title { name, protocol: Protocol::of(protocol).ok_or_else(known)? };
        let made = run(py, threads, progress, |p| {
            let mut out = BufWriter::new(file::anew(&path).map_err(Stopped::Io)?);
            self.built.write_step(title, tolerance, assembly, &mut out, p)
        })?;
        report(py, "StepReport", &made.map_err(error::stopped)?)
    }

    /// The surface of beams alone, from their patches, within `chord` (mm) of them; and how far it is from them, mm.
    #[pyo3(signature = (chord, threads=None, progress=None))]
    fn mesh_beams(
        &self,
        py: Python<'_>,
        chord: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Mesh, f64)> {
        let made = run(py, threads, progress, |p| {
            self.built.beam_surface().map_err(Stopped::Refused)?.mesh(&SurfaceOptions::new(chord), p)
        })?;
        let made = made.map_err(error::stopped)?;
        Ok((Mesh::new(made.surface, self.design.clone()), made.error.unwrap_or(0.0)))
    }

    /// Streams the surface to a file, given as path, extension and title; memory stays bounded. Gives its `reports.SurfaceReport`,
    /// and the other connected components in words.
    #[pyo3(signature = (file, edge, threads=None, progress=None, islands="drop-small"))]
    fn stream<'py>(
        &self,
        py: Python<'py>,
        file: (PathBuf, String, String),
        edge: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        islands: &str,
    ) -> PyResult<(Bound<'py, PyAny>, String)> {
        let islands = islands_word(islands)?;
        let (path, extension, title) = file;
        let meta = metadata(title, self.design.clone());
        let summary = run(py, threads, progress, |p| {
            let (maker, options) = (self.built.surface(), SurfaceOptions { resolution: edge, islands });
            let mut out = file::anew(&path).map_err(Stopped::Io)?;
            if extension == "stl" {
                // Whole tiles are written at once: a buffer would only copy them.
                return maker.stream_stl(&options, &mut out, p);
            }
            let aside = |ending| file::nameless(&path, ending).map_err(Stopped::Io);
            let [mut vertices, mut triangles, mut text] = [aside(".1")?, aside(".2")?, aside(".3")?];
            let scratch: ScratchStores = [&mut vertices, &mut triangles, &mut text];
            let mut out = BufWriter::with_capacity(1 << 20, out);
            surface_maker::stream_mesh(&*maker, &options, (&extension, &meta), scratch, &mut out, p)
        })?;
        let s = summary.map_err(error::stopped)?;
        Ok((report(py, "SurfaceReport", &SurfaceReport::from(&s))?, s.components.description()))
    }

    /// Along which axes the region begins and ends in plane faces.
    #[getter]
    fn flat_axes(&self) -> [bool; 3] {
        let (region, bounds) = (&self.built.solid.region, self.built.solid.region.bounds());
        [0, 1, 2].map(|a| {
            let mut planes = Vec::new();
            region.planes(a, &mut planes);
            [bounds.min[a], bounds.max[a]].iter().all(|end| planes.contains(end))
        })
    }

    /// Occupancy on cubic voxels of edge `step` (mm).
    #[pyo3(signature = (step, threads=None, progress=None))]
    fn voxels(
        &self,
        py: Python<'_>,
        step: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Voxels> {
        let voxels = run(py, threads, progress, |p| extract::voxels(&self.built.solid, step, p))?;
        Ok(Voxels { voxels: voxels.map_err(error::stopped)? })
    }
}
