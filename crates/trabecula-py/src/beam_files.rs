//! Files of beams: lattices of frusta, graphs.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use beams::graph::UnitCell;
use geometry::formats::{CompanionMeshes, GRAPH_FORMATS, Indexed};
use geometry::math::Vec3;
use geometry::progress::Stopped;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::table;
use crate::error;
use crate::file;
use crate::mesh::{Mesh, metadata};
use crate::report::report;
use crate::run::run;
use crate::solid::Solid;

/// A cell of the catalogue of beams.
#[pyclass(frozen, get_all, module = "trabecula._core")]
pub struct BeamCell {
    name: &'static str,
    title: &'static str,
    /// Its space group.
    group: &'static str,
    /// Ratios of the cell's edges.
    aspect: [f64; 3],
    /// Nodes, in edges.
    nodes: Vec<Vec3>,
    /// The nodes of each beam.
    ends: Vec<[usize; 2]>,
    /// The cell in which the second node of each beam lies.
    shifts: Vec<[i32; 3]>,
    /// The number of beams at each node.
    valences: Vec<usize>,
    /// Maxwell's count.
    maxwell: i64,
    /// Length of all beams in a cell with edges as `aspect` says.
    length: f64,
}

impl BeamCell {
    pub fn of(cell: &UnitCell) -> PyResult<BeamCell> {
        let graph = cell.graph().map_err(error::fault)?;
        Ok(BeamCell {
            name: cell.name,
            title: cell.title,
            group: cell.group,
            aspect: cell.aspect,
            ends: graph.beams.iter().map(|b| b.ends).collect(),
            shifts: graph.beams.iter().map(|b| b.shift).collect(),
            valences: graph.valences(),
            maxwell: graph.maxwell(),
            length: graph.lengths(cell.aspect).iter().sum(),
            nodes: graph.nodes,
        })
    }
}

/// The formats of graphs, in the order in which texts name them: suffix and title, whether it is written.
#[pyfunction]
pub fn graph_formats() -> Vec<(&'static str, &'static str, bool)> {
    GRAPH_FORMATS.iter().map(|f| (f.suffix, f.title, f.writes())).collect()
}

/// Writes the beams of a solid as a graph in the format of a suffix. Gives its `reports.BeamsFileReport`.
#[pyfunction]
pub fn write_graph<'py>(py: Python<'py>, solid: &Solid, path: PathBuf, suffix: &str) -> PyResult<Bound<'py, PyAny>> {
    let made = run(py, None, None, |_| {
        let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path).map_err(Stopped::Io)?);
        let made = solid.built().write_graph(suffix, &mut out)?;
        out.flush().map_err(Stopped::Io)?;
        Ok(made)
    })?;
    report(py, "BeamsFileReport", &made.map_err(error::stopped)?)
}

/// Nodes (n, 3), their radii (n,) or none, beams (m, 2), their radii (m, 2) or none, whether lengths are in mm, remarks.
type GraphFileArrays<'py> = (
    Bound<'py, PyArray2<f64>>,
    Option<Bound<'py, PyArray1<f64>>>,
    Bound<'py, PyArray2<u32>>,
    Option<Bound<'py, PyArray2<f64>>>,
    bool,
    Vec<String>,
);

/// The graph in the bytes of a file whose name ends in `suffix`.
#[pyfunction]
pub fn read_graph<'py>(py: Python<'py>, bytes: &[u8], suffix: &str) -> PyResult<GraphFileArrays<'py>> {
    let read = run(py, None, None, |_| geometry::formats::read_graph(bytes, suffix))?;
    let graph = read.map_err(|f| PyValueError::new_err(f.to_string()))?;
    let radii = (!graph.radii.is_empty()).then(|| graph.radii.into_pyarray(py));
    let of_beams = (!graph.beam_radii.is_empty()).then(|| table(py, graph.beam_radii)).transpose()?;
    Ok((table(py, graph.nodes)?, radii, table(py, graph.beams)?, of_beams, graph.in_mm, graph.remarks))
}

/// Writes the beams of a solid as 3MF with the beam lattice extension: frusta whose radii are within `tolerance` (mm) of those of the
/// beams, with the mesh by which they are cut and the one that is shown. Gives its `reports.BeamsFileReport`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // The keyword arguments of Python.
#[pyo3(signature = (solid, path, title, tolerance=None, clip=None, shown=None, threads=None))]
pub fn write_beam_lattice<'py>(
    py: Python<'py>,
    solid: &Solid,
    path: PathBuf,
    title: String,
    tolerance: Option<f64>,
    clip: Option<Py<Mesh>>,
    shown: Option<Py<Mesh>>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let meta = metadata(title, solid.text().to_string());
    fn mesh(of: &Option<Py<Mesh>>) -> Option<&dyn Indexed> {
        of.as_ref().map(|m| m.get().mesh() as &dyn Indexed)
    }
    let meshes = CompanionMeshes { clip: mesh(&clip), shown: mesh(&shown) };
    let made = run(py, threads, None, |_| {
        let mut out = BufWriter::with_capacity(1 << 20, file::anew(&path).map_err(Stopped::Io)?);
        let mut aside = file::nameless(&path, ".1").map_err(Stopped::Io)?;
        let made = solid.built().write_beam_lattice(tolerance, meshes, &meta, &mut aside, &mut out)?;
        out.flush().map_err(Stopped::Io)?;
        Ok(made)
    })?;
    report(py, "BeamsFileReport", &made.map_err(error::stopped)?)
}
