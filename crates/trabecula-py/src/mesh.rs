//! Meshes: arrays, figures, files, pictures.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use geometry::formats;
use geometry::math::Vec3;
use geometry::measure;
use geometry::render::{
    Amount, Background, Colours, Lines, Marks, Page, PlaneGrid, Projection, RenderOptions, SectionColours,
    SectionPlane, Shares, Tint, View, line_drawing, line_drawing_fits, png, render,
};
use geometry::simplify::{Goal, simplify};
use geometry::smooth::smooth;
use geometry::surface_mesh::SurfaceMesh;
use geometry::transform::Transform;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use trabecula::analysis;
use trabecula::corner_normals::corner_normals;
use trabecula::report::MeshReport;
use trabecula::surface_maker::Figures;

use crate::arrays::table;
use crate::error;
use crate::file;
use crate::region::Region;
use crate::report::report;
use crate::run::{run, run_apart};
use crate::solid::Solid;

/// A triangle mesh.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Mesh {
    surface: SurfaceMesh,
    /// Whether it is known which triangles are cuts.
    split: bool,
    design: String,
}

// Each of these is a tuple in Python.

/// Lines of a picture; of each line the number of its name and its points (mm); half their width (mm).
#[derive(FromPyObject)]
struct NamedLines {
    #[pyo3(item(0))]
    caption: String,
    #[pyo3(item(1))]
    names: Vec<String>,
    #[pyo3(item(2))]
    lines: Vec<(usize, Vec<Vec3>)>,
    #[pyo3(item(3))]
    radius: f64,
}

/// A scale: a number at each vertex, and the build direction if it is of overhang.
#[derive(FromPyObject)]
struct ScaleColours {
    #[pyo3(item(0))]
    title: String,
    #[pyo3(item(1))]
    values: Vec<f64>,
    #[pyo3(item(2))]
    span: [f64; 2],
    #[pyo3(item(3))]
    up: Option<Vec3>,
}

/// Shares of named parts at each vertex.
#[derive(FromPyObject)]
struct NamedShares {
    #[pyo3(item(0))]
    title: String,
    #[pyo3(item(1))]
    names: Vec<String>,
    #[pyo3(item(2))]
    values: Vec<f64>,
}

/// The colours of a section: numbers or shares at the points of a grid.
#[derive(FromPyObject)]
struct GridColours {
    #[pyo3(item(0))]
    origin: Vec3,
    #[pyo3(item(1))]
    steps: [Vec3; 2],
    #[pyo3(item(2))]
    counts: [usize; 2],
    #[pyo3(item(3))]
    values: Vec<f64>,
}

/// The size in pixels, the direction in degrees, and the projection of a picture.
#[derive(FromPyObject)]
struct Camera {
    #[pyo3(item(0))]
    width: usize,
    #[pyo3(item(1))]
    height: usize,
    #[pyo3(item(2))]
    azimuth: f64,
    #[pyo3(item(3))]
    elevation: f64,
    #[pyo3(item(4))]
    orthographic: bool,
}

/// What is added to a picture: a section by its normal and offset, a scale bar, axes.
#[derive(FromPyObject)]
struct Annotations {
    #[pyo3(item(0))]
    section: Option<(Vec3, f64)>,
    #[pyo3(item(1))]
    scale_bar: bool,
    #[pyo3(item(2))]
    axes: bool,
}

/// The page of a line drawing.
#[derive(FromPyObject)]
struct DrawingPage {
    #[pyo3(item(0))]
    size: [f64; 2],
    #[pyo3(item(1))]
    unit: String,
    #[pyo3(item(2))]
    line_width: Option<f64>,
}

impl Camera {
    fn view(&self) -> View {
        let projection = if self.orthographic { Projection::Orthographic } else { Projection::Perspective };
        View { size: [self.width, self.height], azimuth: self.azimuth, elevation: self.elevation, projection }
    }
}

fn render_options(
    Annotations { section, scale_bar, axes }: Annotations,
    tint: Option<ScaleColours>,
    shares: Option<NamedShares>,
    lines: Option<NamedLines>,
    inside: Option<GridColours>,
) -> RenderOptions {
    let scale = tint.map(|ScaleColours { title, values, span, up }| {
        let amount = up.map_or_else(|| Amount::AtVertices(values), Amount::Overhang);
        Colours::Scale(Tint { title, amount, span })
    });
    let parts = shares.map(|NamedShares { title, names, values }| Colours::Shares(Shares { title, names, values }));
    RenderOptions {
        colours: scale.or(parts),
        lines: lines.map(|NamedLines { caption, names, lines, radius }| Lines { caption, names, lines, radius }),
        section: section.map(|(normal, offset)| SectionPlane { normal, offset }),
        section_colours: inside.map(|GridColours { origin, steps, counts, values }| SectionColours {
            grid: PlaneGrid { origin, steps, counts },
            values,
        }),
        marks: Marks { scale_bar, axes },
        ..RenderOptions::default()
    }
}

/// A row of the table of mesh formats.
#[pyclass(frozen, get_all)]
pub struct MeshFormat {
    /// End of the file's name.
    suffix: &'static str,
    /// Whether meshes are written in it.
    writes: bool,
    /// Whether numbers are bytes rather than text in what is written.
    binary: bool,
    /// Bytes of a file for each triangle and each vertex.
    bytes: [f64; 2],
}

impl MeshFormat {
    pub fn of(row: &formats::Format) -> Self {
        let writer = row.writer.as_ref();
        MeshFormat {
            suffix: row.suffix,
            writes: writer.is_some(),
            binary: writer.is_some_and(|w| w.binary),
            bytes: writer.map_or([0.0; 2], |w| w.bytes),
        }
    }
}

/// What is written of a mesh into formats that carry it.
pub fn metadata(title: String, design: String) -> formats::Metadata {
    formats::Metadata { title, design, application: format!("Trabecula {}", env!("CARGO_PKG_VERSION")) }
}

impl Mesh {
    pub fn new(surface: SurfaceMesh, design: String) -> Self {
        Mesh { surface, split: true, design }
    }

    /// The triangles.
    pub fn mesh(&self) -> &geometry::mesh::Mesh {
        &self.surface.mesh
    }

    /// A mesh of which nothing more is known.
    pub fn bare(mesh: geometry::mesh::Mesh) -> Self {
        let cut = vec![false; mesh.triangles.len()];
        Mesh { surface: SurfaceMesh { mesh, cut }, split: false, design: String::new() }
    }
}

#[pymethods]
impl Mesh {
    /// Reads the bytes of a mesh file; `extension` names the format, `object` one of the objects of a 3MF.
    #[staticmethod]
    #[pyo3(signature = (bytes, extension, object=None))]
    fn read(py: Python<'_>, bytes: &[u8], extension: &str, object: Option<&str>) -> PyResult<Mesh> {
        let by_place = formats::Format::of(extension).is_some_and(|f| f.soup);
        let read = run(py, None, None, |_| match object {
            Some(name) => formats::read_object(bytes, name),
            None => {
                let loaded = formats::read_mesh(bytes, extension)?;
                Ok(if by_place { loaded.mesh.joined_where_open() } else { loaded.mesh })
            }
        })?;
        read.map(Mesh::bare).map_err(|f| PyValueError::new_err(f.to_string()))
    }

    /// The names of the objects that a 3MF places; empty where they have none.
    #[staticmethod]
    fn objects(py: Python<'_>, bytes: &[u8]) -> PyResult<Vec<String>> {
        let found = run(py, None, None, |_| formats::object_names(bytes))?;
        found.map_err(|f| PyValueError::new_err(f.to_string()))
    }

    /// The mesh of vertices (n, 3), mm, and triangles (m, 3) by index; which of them are cuts, and the design, if known.
    #[staticmethod]
    #[pyo3(signature = (vertices, triangles, cut=None, design=String::new()))]
    fn of(
        vertices: PyReadonlyArray2<f64>,
        triangles: PyReadonlyArray2<i64>,
        cut: Option<Vec<bool>>,
        design: String,
    ) -> PyResult<Mesh> {
        let wrong = |message: String| Err(PyValueError::new_err(message));
        let (points, corners) = (vertices.as_array(), triangles.as_array());
        if points.ncols() != 3 || corners.ncols() != 3 {
            let (points, corners) = (points.shape(), corners.shape());
            return wrong(format!("expected vertices (n, 3) and triangles (m, 3), found {points:?} and {corners:?}"));
        }
        let mut places = points.rows().into_iter().enumerate();
        if let Some((i, p)) = places.find(|(_, p)| !p.iter().all(|x| x.is_finite())) {
            return wrong(format!("expected finite vertices, found {:?} as vertex {i}", p.to_vec()));
        }
        let known = 0..points.nrows().min(u32::MAX as usize) as i64;
        let mut named = corners.rows().into_iter().enumerate();
        if let Some((i, t)) = named.find(|(_, t)| !t.iter().all(|v| known.contains(v))) {
            return wrong(format!(
                "expected indices of {} vertices, found {:?} as triangle {i}",
                known.end,
                t.to_vec()
            ));
        }
        let rows = points.rows().into_iter();
        let vertices = rows.map(|p| [p[0], p[1], p[2]]).collect();
        let rows = corners.rows().into_iter();
        let triangles = rows.map(|t| [t[0], t[1], t[2]].map(|v| v as u32)).collect();
        let mut made = Mesh::bare(geometry::mesh::Mesh { vertices, triangles });
        if let Some(cut) = cut.filter(|c| c.len() == made.surface.cut.len()) {
            (made.surface.cut, made.split) = (cut, true);
        }
        Ok(Mesh { design, ..made })
    }

    /// Which triangles are cuts, if that is known.
    fn known_cut(&self) -> Option<Vec<bool>> {
        self.split.then(|| self.surface.cut.clone())
    }

    /// The same mesh, its triangles that lie on the region's boundary marked as cuts.
    fn split_by(&self, py: Python<'_>, region: &Region) -> PyResult<Mesh> {
        let (mesh, region) = (&self.surface.mesh, &region.region);
        let surface =
            run(py, None, None, |_| SurfaceMesh { cut: analysis::cut_triangles(mesh, &**region), mesh: mesh.clone() })?;
        Ok(Mesh { surface, split: true, design: self.design.clone() })
    }

    /// The triangles that are no cuts.
    fn uncapped(&self, py: Python<'_>) -> PyResult<Mesh> {
        Ok(Mesh {
            surface: run(py, None, None, |_| self.surface.uncapped())?,
            split: self.split,
            design: self.design.clone(),
        })
    }

    /// Its image under x ↦ M (x − c) + c + t, of no design.
    fn transformed(&self, py: Python<'_>, matrix: [Vec3; 3], center: Vec3, shift: Vec3) -> PyResult<Mesh> {
        let by = Transform { matrix, center, shift };
        let surface = run(py, None, None, |_| self.surface.transformed(&by))?.map_err(error::fault)?;
        Ok(Mesh { surface, split: self.split, design: String::new() })
    }

    /// Vertex positions (n, 3), mm.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, self.surface.mesh.vertices.clone())
    }

    /// Vertex indices (m, 3), counter-clockwise seen from outside.
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        table(py, self.surface.mesh.triangles.clone())
    }

    /// For each triangle, whether it lies on the region's boundary.
    #[getter]
    fn cut<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.surface.cut.clone().into_pyarray(py)
    }

    /// The design it came from, as TOML text.
    #[getter]
    fn design(&self) -> &str {
        &self.design
    }

    /// Numbers of vertices and triangles.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        (self.surface.mesh.vertices.len(), self.surface.mesh.triangles.len())
    }

    /// A lighter mesh within `tolerance` (mm) or of at most `triangles`, and what was done.
    #[pyo3(signature = (tolerance=None, triangles=None, progress=None))]
    fn simplified<'py>(
        &self,
        py: Python<'py>,
        tolerance: Option<f64>,
        triangles: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(Mesh, Bound<'py, PyAny>)> {
        let goal = Goal { tolerance, triangles };
        let (surface, done) =
            run(py, None, progress, |p| simplify(&self.surface, &goal, p))?.map_err(error::stopped)?;
        let mesh = Mesh { surface, split: self.split, design: self.design.clone() };
        Ok((mesh, report(py, "SimplifyReport", &done)?))
    }

    /// The same surface with better triangles, and what was done, as `reports.SmoothReport`.
    #[pyo3(signature = (progress=None))]
    fn smoothed<'py>(&self, py: Python<'py>, progress: Option<Py<PyAny>>) -> PyResult<(Mesh, Bound<'py, PyAny>)> {
        let (surface, done) = run(py, None, progress, |p| smooth(&self.surface, p))?.map_err(error::stopped)?;
        let mesh = Mesh { surface, split: self.split, design: self.design.clone() };
        Ok((mesh, report(py, "SmoothReport", &done)?))
    }

    /// The figures, against a region of this volume (mm³) if one is known, as `reports.MeshReport`.
    #[pyo3(signature = (region=None))]
    fn measure<'py>(&self, py: Python<'py>, region: Option<f64>) -> PyResult<Bound<'py, PyAny>> {
        let made = run(py, None, None, |_| MeshReport::of(&Figures::of(&self.surface), self.split, region))?;
        report(py, "MeshReport", &made)
    }

    /// Enclosed volume, mm³.
    fn volume(&self, py: Python<'_>) -> PyResult<f64> {
        run(py, None, None, |_| self.surface.mesh.volume())
    }

    /// What keeps it from being closed: edges with one triangle, with more than two, with two of the same direction.
    fn flaws(&self, py: Python<'_>) -> PyResult<(usize, usize, usize)> {
        run(py, None, None, |_| {
            let d = measure::defects(&self.surface.mesh);
            (d.open_edges, d.crowded_edges, d.flipped_edges)
        })
    }

    /// The pairs of triangles that meet elsewhere than in common corners or edges, or `limit` if there are as many.
    fn self_intersections(slf: Py<Self>, py: Python<'_>, limit: usize) -> PyResult<usize> {
        run_apart(py, None, move || measure::self_intersections(&slf.get().surface.mesh, limit))
    }

    /// How well shaped the triangles are, as `reports.QualityReport`; None without triangles.
    fn quality<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let found = run(py, None, None, |_| measure::quality(&self.surface.mesh))?;
        found.map(|q| report(py, "QualityReport", &q)).transpose()
    }

    /// Duplicate triangles, triangles without area, vertices where surfaces touch.
    fn oddities(&self, py: Python<'_>) -> PyResult<(usize, usize, usize)> {
        run(py, None, None, |_| {
            let mesh = &self.surface.mesh;
            let d = measure::defects(mesh);
            let touching = measure::non_manifold_vertices(mesh);
            (d.duplicate_triangles, d.degenerate_triangles, touching)
        })
    }

    /// What local thickness takes: the voxel step that is usual, or the one given; voxels along each axis; bytes.
    #[pyo3(signature = (region, step=None))]
    fn thickness_needs(
        &self,
        py: Python<'_>,
        region: Option<&Region>,
        step: Option<f64>,
    ) -> PyResult<(f64, [usize; 3], f64)> {
        let region = region.map(|r| r.region.clone());
        run(py, None, None, |_| {
            let step = step.unwrap_or_else(|| analysis::usual_step(&self.surface, region.as_ref()));
            let shape = analysis::voxels_for(&self.surface, region.as_ref(), step)?;
            let count = shape.iter().map(|n| *n as f64).product::<f64>();
            Ok((step, shape, count * analysis::BYTES_PER_VOXEL))
        })?
        .map_err(error::fault)
    }

    /// Local thickness of the solid, and of the pores if there is a region, on voxels of edge `step` (mm), as
    /// `reports.ThicknessReport`.
    #[pyo3(signature = (region, step, threads=None, progress=None))]
    fn thickness<'py>(
        &self,
        py: Python<'py>,
        region: Option<&Region>,
        step: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let region = region.map(|r| r.region.clone());
        let found = run(py, threads, progress, |p| analysis::thickness(&self.surface, region.as_ref(), step, p))?
            .map_err(error::stopped)?;
        report(py, "ThicknessReport", &found)
    }

    /// Local thickness of the solid at each vertex (n,), mm, on voxels of edge `step` (mm); NaN where it is thinner than a step.
    #[pyo3(signature = (step, threads=None, progress=None))]
    fn thickness_at_vertices<'py>(
        &self,
        py: Python<'py>,
        step: f64,
        threads: Option<usize>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found = run(py, threads, progress, |p| analysis::thickness_at_vertices(&self.surface, step, p))?;
        Ok(found.map_err(error::stopped)?.into_pyarray(py))
    }

    /// Writes meshes, each with its name, to a 3MF at `path` as one object each; the design is that of the first one.
    #[staticmethod]
    fn write_objects(py: Python<'_>, path: PathBuf, objects: Vec<(String, Py<Mesh>)>, title: String) -> PyResult<()> {
        let meta = metadata(title, objects.first().map_or(String::new(), |o| o.1.get().design.clone()));
        let meshes: Vec<_> = objects.iter().map(|(name, mesh)| (name.as_str(), &mesh.get().surface.mesh)).collect();
        let written = run(py, None, None, |_| {
            let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path)?);
            formats::write_objects(&meshes, &meta, &mut out)?;
            out.flush()
        })?;
        Ok(written?)
    }

    /// Writes the mesh to `path` in the format `extension`.
    fn write(&self, py: Python<'_>, path: PathBuf, extension: &str, title: String) -> PyResult<()> {
        let meta = metadata(title, self.design.clone());
        let written = run(py, None, None, |_| {
            let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path)?);
            formats::write_mesh(&self.surface.mesh, extension, &meta, &mut out)?;
            out.flush()
        })?;
        Ok(written?)
    }

    /// A picture as PNG bytes: with a number at each vertex to be seen as a colour, between the two ends of a scale, or with shares of
    /// named parts at each vertex; with named lines; without what lies beyond a plane, by its normal and offset, with the colours `inside`
    /// it; with marks; on a `background` ("shaded", "white" or "transparent"), `dpi` pixels an inch. And whether there is room for its legend and marks.
    /// The field of `solid`, whose surface it is, gives the normals.
    #[pyo3(signature = (seen, cut, solid=None, tint=None, shares=None, lines=None, inside=None, background="shaded", dpi=None))]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    fn png<'py>(
        &self,
        py: Python<'py>,
        seen: Camera,
        cut: Annotations,
        solid: Option<Py<Solid>>,
        tint: Option<ScaleColours>,
        shares: Option<NamedShares>,
        lines: Option<NamedLines>,
        inside: Option<GridColours>,
        background: &str,
        dpi: Option<f64>,
    ) -> PyResult<(Bound<'py, PyBytes>, bool)> {
        let background = match background {
            "white" => Background::White,
            "transparent" => Background::Transparent,
            _ => Background::Shaded,
        };
        let (view, mut options) =
            (seen.view(), RenderOptions { background, ..render_options(cut, tint, shares, lines, inside) });
        let bytes = run(py, None, None, |_| {
            options.normals = solid.map(|s| corner_normals(s.get().as_field(), &self.surface));
            png(&render(&self.surface, &view, &options), view.size, background.channels(), dpi)
        })?;
        Ok((PyBytes::new(py, &bytes), options.fits(&view)))
    }

    /// A line drawing as the text of an SVG file, on a page (size, unit, width of lines) of the aspect of the view; colours and lines as for
    /// `png`.
    #[pyo3(signature = (seen, cut, page, solid=None, tint=None, shares=None, lines=None, inside=None))]
    #[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
    fn svg(
        &self,
        py: Python<'_>,
        seen: Camera,
        cut: Annotations,
        page: DrawingPage,
        solid: Option<Py<Solid>>,
        tint: Option<ScaleColours>,
        shares: Option<NamedShares>,
        lines: Option<NamedLines>,
        inside: Option<GridColours>,
    ) -> PyResult<(String, bool)> {
        let (view, mut options) = (seen.view(), render_options(cut, tint, shares, lines, inside));
        let text = run(py, None, None, |_| {
            options.normals = solid.map(|s| corner_normals(s.get().as_field(), &self.surface));
            line_drawing(
                &self.surface,
                &view,
                &options,
                &Page { size: page.size, unit: &page.unit, line_width: page.line_width },
            )
        })?;
        Ok((text, line_drawing_fits(&options, &view)))
    }
}
