//! Solids: field, surface, voxels, figures.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats;
use geometry::progress::Stopped;
use geometry::repair::Repaired;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use trabecula::analysis;
use trabecula::design::{self, Built, Node};
use trabecula::extract;
use trabecula::field::Field;
use trabecula::map::{Map, Misfit};
use trabecula::surface_maker::{Options, SurfaceMaker};
use trabecula::truss::Beams;

use crate::design::Folder;
use crate::error;
use crate::file;
use crate::islands;
use crate::mesh::Mesh;
use crate::quadors::Quadors;
use crate::run::run;

/// A region and the lattice in it.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Solid {
    built: Built,
    warnings: Vec<(String, String)>,
    design: String,
}

impl Solid {
    pub fn built(built: Built, warnings: Vec<(String, String)>, design: String) -> Self {
        Solid { built, warnings, design }
    }
}

/// Number, volume, volume and place of the largest, neck, step.
type Bits = (usize, f64, Option<(f64, [f64; 3])>, f64, f64);

/// Name, centres (n, 3), radii (n,), ends (m, 2).
type Graph<'py> = (String, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<u32>>);

/// Points of Python (n, 3) as the core's.
pub fn points(p: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let a = p.as_array();
    if a.ncols() != 3 {
        return Err(PyValueError::new_err(format!("points must have shape (n, 3), found {:?}", a.shape())));
    }
    let points: Vec<[f64; 3]> = a.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
    match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(i) => Err(PyValueError::new_err(format!(
            "points[{i}] is {:?}; a position is three finite numbers, mm",
            points[i]
        ))),
        None => Ok(points),
    }
}

fn values<'py>(py: Python<'py>, field: &dyn Field, points: Vec<[f64; 3]>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    const BATCH: usize = 4096;
    let out = run(py, None, None, |_| {
        let mut out = vec![0.0; points.len()];
        out.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(o, p)| field.values(p, o));
        out
    })?;
    Ok(out.into_pyarray(py))
}

#[pymethods]
impl Solid {
    /// (path, message) of what may not be meant.
    #[getter]
    fn warnings(&self) -> Vec<(String, String)> {
        self.warnings.clone()
    }

    /// What was repaired in each mesh of the region, by the path of its table.
    #[getter]
    fn repairs<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyDict>)>> {
        let dict = |(path, done): &(String, Repaired)| {
            let d = PyDict::new(py);
            for (key, count) in [
                ("joined", done.joined),
                ("split", done.split),
                ("degenerate", done.degenerate),
                ("duplicates", done.duplicates),
                ("turned", done.turned),
                ("bodies_turned", done.bodies_turned),
                ("holes", done.holes),
                ("crossings", done.crossings),
                ("inner", done.inner),
            ] {
                d.set_item(key, count)?;
            }
            d.set_item("hole_length", done.hole_length)?;
            d.set_item("hole_area", done.hole_area)?;
            d.set_item("hole_share", done.hole_share)?;
            Ok((path.clone(), d))
        };
        self.built.repairs.iter().map(dict).collect()
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

    /// The figures of the design without meshing it, as JSON text.
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        run(py, None, None, |_| self.built.report().to_string())
    }

    /// The transitions between the lattices of a blend, as JSON text.
    fn transitions(&self, py: Python<'_>) -> PyResult<String> {
        run(py, None, None, |_| self.built.transitions().to_string())
    }

    /// Bits that hang by necks thinner than half of `neck` (mm): number, volume, volume and place of the largest, the neck,
    /// the distance between points.
    #[pyo3(signature = (neck, threads=None, progress=None))]
    fn dangling(
        &self,
        py: Python<'_>,
        neck: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bits> {
        let found =
            run(py, threads, progress, |p| analysis::dangling(&self.built.solid, neck, p))?.map_err(error::stopped)?;
        Ok((found.count, found.volume, found.largest, found.neck, found.step))
    }

    /// The solid share of the region, by points inside, and the region's volume (mm³), exact where that is known.
    fn expected(&self, py: Python<'_>) -> PyResult<(f64, f64)> {
        run(py, None, None, |_| self.built.expected())
    }

    /// The graphs of beams: name, centres and radii of hubs, the hubs that each beam joins.
    #[getter]
    fn beams<'py>(&self, py: Python<'py>) -> PyResult<Vec<Graph<'py>>> {
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

    /// The beams of a name as quadrics.
    fn quadors(&self, py: Python<'_>, name: &str) -> PyResult<Quadors> {
        match self.built.beams.iter().find(|b| b.0 == name) {
            Some((_, Beams::Truss(truss))) => Ok(Quadors { quadors: truss.quadors.clone() }),
            Some((_, Beams::Pattern(laid))) => {
                let written = run(py, None, None, |_| laid.expand())?;
                let written = written.map_err(|f| error::fault(f.under(&format!("beams.{name}"))))?;
                Ok(Quadors { quadors: written.into() })
            }
            None => Err(PyValueError::new_err(format!("there are no beams named {name}"))),
        }
    }

    /// Values at points (n, 3): negative in the solid.
    fn field<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        values(py, &self.built.solid, self::points(&points)?)
    }

    /// How far the solved map of a lattice is from what was asked for, at points (n, 3): per point the worst angle
    /// (degrees), the worst spacing ratio or its inverse, det J over the one asked for.
    fn misfits<'py>(
        &self,
        py: Python<'py>,
        lattice: &str,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = self.built.lattices.iter().find(|(name, _)| name == lattice);
        let Some(Map::Phase(map)) = found.map(|(_, l)| &l.map) else {
            let message = format!("lattice.{lattice} has no map that was solved for");
            return Err(PyValueError::new_err(message));
        };
        let points = self::points(&points)?;
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

    /// What a spacing will take: cells along each axis, triangles, bytes in memory, bytes of a binary STL.
    fn estimate<'py>(&self, py: Python<'py>, edge: f64) -> PyResult<Bound<'py, PyDict>> {
        let e = run(py, None, None, |_| self.built.surface().estimate(edge))?.map_err(error::fault)?;
        let d = PyDict::new(py);
        d.set_item("cells", e.cells)?;
        d.set_item("triangles", e.triangles)?;
        d.set_item("memory", e.memory)?;
        d.set_item("stl", e.stl)?;
        Ok(d)
    }

    /// The surface at grid spacing `edge` (mm), and what its pieces are, also in words.
    #[pyo3(signature = (edge, threads=None, progress=None, islands="keep"))]
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        edge: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        islands: &str,
    ) -> PyResult<(Mesh, Bound<'py, PyDict>, String)> {
        let islands = islands::named(islands)?;
        let options = Options { resolution: edge, islands };
        let made = run(py, threads, progress, |p| self.built.surface().mesh(&options, p))?.map_err(error::stopped)?;
        let mesh = Mesh::new(made.surface, self.design.clone());
        let (told, words) = islands::told(py, &made.components)?;
        Ok((mesh, told, words))
    }

    /// About how many triangles the surface of beams alone has within `chord` (mm) of their patches, and of how many all others
    /// are copies.
    fn expected_beams(&self, py: Python<'_>, chord: f64) -> PyResult<[f64; 2]> {
        let e = run(py, None, None, |_| self.built.beam_surface()?.estimate(chord))?.map_err(error::fault)?;
        Ok([e.triangles, e.held])
    }

    /// Streams the surface of beams alone to a binary STL at `path`, triangles within `chord` (mm) of their patches; gives what is
    /// told of it.
    #[pyo3(signature = (path, chord, threads=None))]
    fn stream_beams<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        chord: f64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let made = run(py, threads, None, |p| {
            let beams = self.built.beam_surface().map_err(Stopped::Refused)?;
            let mut out = file::anew(&path).map_err(Stopped::Io)?;
            beams.stream_stl(&Options::new(chord), &mut out, p)
        })?;
        let s = made.map_err(error::stopped)?;
        let d = PyDict::new(py);
        d.set_item("triangles", s.triangles)?;
        d.set_item("volume", s.volume)?;
        d.set_item("area", s.area_lattice)?;
        d.set_item("area_lattice", s.area_lattice)?;
        d.set_item("area_cut", 0.0)?;
        d.set_item("euler", s.components.euler)?;
        d.set_item("pieces", s.components.count)?;
        d.set_item("cavities", 0)?;
        d.set_item("islands", py.None())?;
        d.set_item("chord_error", s.error)?;
        Ok(d)
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
            self.built.beam_surface().map_err(Stopped::Refused)?.mesh(&Options::new(chord), p)
        })?;
        let made = made.map_err(error::stopped)?;
        Ok((Mesh::new(made.surface, self.design.clone()), made.error.unwrap_or(0.0)))
    }

    /// Streams the surface to a binary STL at `path`; memory stays bounded. Gives triangles, volume, areas and
    /// pieces, these also in words.
    #[pyo3(signature = (path, edge, threads=None, progress=None, islands="keep"))]
    fn stream_stl<'py>(
        &self,
        py: Python<'py>,
        path: PathBuf,
        edge: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
        islands: &str,
    ) -> PyResult<(Bound<'py, PyDict>, String)> {
        let islands = islands::named(islands)?;
        let summary = run(py, threads, progress, |p| {
            // Whole tiles are written at once: a buffer would only copy them.
            let mut out = file::anew(&path).map_err(Stopped::Io)?;
            let options = Options { resolution: edge, islands };
            self.built.surface().stream_stl(&options, &mut out, p)
        })?;
        let s = summary.map_err(error::stopped)?;
        let d = PyDict::new(py);
        d.set_item("triangles", s.triangles)?;
        d.set_item("volume", s.volume)?;
        d.set_item("area", s.area_lattice + s.area_cut)?;
        d.set_item("area_lattice", s.area_lattice)?;
        d.set_item("area_cut", s.area_cut)?;
        let (told, words) = islands::told(py, &s.components)?;
        d.update(told.as_mapping())?;
        Ok((d, words))
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

/// Where a part may be: a signed distance.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Region {
    pub region: trabecula::region::Region,
}

#[pymethods]
impl Region {
    /// The region of a design, or of a file with the key `region` alone, as text; `folder` is where paths start.
    #[staticmethod]
    fn from_text(py: Python<'_>, text: &str, json: bool, file: String, folder: PathBuf) -> PyResult<Region> {
        let region = run(py, None, None, |_| {
            let node = if json { Node::from_json(text)? } else { Node::from_toml(text)? };
            design::region(&node, &Folder(folder))
        })?;
        region.map(|region| Region { region }).map_err(|e| error::design(py, &e.in_file(&file)))
    }

    /// The region under the key `region` of a dictionary.
    #[staticmethod]
    fn from_data(py: Python<'_>, data: &Bound<'_, PyAny>, folder: PathBuf) -> PyResult<Region> {
        let node = crate::design::node(data, 0)?;
        let region = run(py, None, None, |_| design::region(&node, &Folder(folder)))?;
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

    /// Volume, mm³: exact where it is known in closed form, otherwise of its surface at grid spacing `edge` (mm).
    fn volume(&self, py: Python<'_>, edge: f64) -> PyResult<f64> {
        if let Some(v) = self.region.volume() {
            return Ok(v);
        }
        let full = trabecula::solid::Solid::new(self.region.clone(), None, edge);
        let surface = run(py, None, None, |p| extract::surface(&full, edge, p))?;
        Ok(surface.map_err(error::stopped)?.mesh.volume())
    }
}

/// Occupancy on a grid of cubic voxels.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Voxels {
    voxels: geometry::voxels::Voxels,
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
