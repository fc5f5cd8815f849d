//! Files of a design: read below its folder; formats and meshers that Python has are asked there.

use std::path::{Path, PathBuf};

use geometry::formats::{Data, DataArray, DataSet, Elements};
use geometry::mesh::Mesh;
use geometry::tetmesh::TetMesh;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use trabecula::design::{CadMesh, FaceLabel, Loader, Scan, Tessellation, ZonedElements};

use crate::arrays::table;

/// How names begin that are no files, but bytes in Python's memory.
const IN_MEMORY: &str = "memory:";

/// Files below a folder.
pub struct Folder(pub PathBuf);

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        if path.starts_with(IN_MEMORY) {
            return in_memory(path);
        }
        crate::file::read(&self.0.join(Path::new(path))).map_err(|e| e.to_string())
    }

    fn list(&self, pattern: &str) -> Result<Vec<String>, String> {
        let (folder, name) = pattern.rsplit_once('/').unwrap_or(("", pattern));
        let (before, after) = name.split_once('*').unwrap_or((name, ""));
        let found = std::fs::read_dir(self.0.join(folder)).map_err(|e| format!("{folder}: {e}"))?;
        let names = found.filter_map(|f| f.ok()?.file_name().into_string().ok());
        let long = before.len() + after.len();
        let fits = |n: &String| n.len() >= long && n.starts_with(before) && n.ends_with(after);
        let found: Vec<String> =
            names.filter(fits).map(|n| format!("{folder}{}{n}", if folder.is_empty() { "" } else { "/" })).collect();
        if found.is_empty() {
            return Err(format!("no file is named {pattern}"));
        }
        Ok(found)
    }

    fn scan(&self, path: &str) -> Result<Scan, String> {
        scan(&self.0.join(Path::new(path)).to_string_lossy())
    }

    fn elements(&self, path: &str) -> Result<ZonedElements, String> {
        elements(&self.0.join(Path::new(path)).to_string_lossy())
    }

    fn result(&self, path: &str, array: &str) -> Result<Data, String> {
        result(&self.0.join(Path::new(path)).to_string_lossy(), array)
    }

    fn cad(&self, path: &str, how: &Tessellation) -> Result<CadMesh, String> {
        cad(path, &self.0.join(Path::new(path)).to_string_lossy(), how)
    }

    fn tetrahedra(&self, name: &str, surface: &Mesh, size: f64, limit: f64) -> Result<TetMesh, String> {
        tetrahedra(name, surface, size, limit)
    }
}

/// Points, connectivity, ends, kinds and zones of elements that Python read, and numbers of zones with names.
type Read<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u64>,
    PyReadonlyArray1<'py, u8>,
    PyReadonlyArray1<'py, i64>,
    Vec<(i64, String)>,
);

/// Points, connectivity, ends and kinds of the elements of a result that Python read; name, whether of cells, and number of components of
/// each of its arrays; and the numbers of the one that is asked for, under its index among them.
type ReadResult<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u64>,
    PyReadonlyArray1<'py, u8>,
    Vec<(String, bool, usize)>,
    Option<usize>,
    PyReadonlyArray1<'py, f64>,
);

/// The bytes that Python has under a name.
fn in_memory(name: &str) -> Result<Vec<u8>, String> {
    Python::attach(|py| {
        let read = || -> PyResult<Vec<u8>> {
            let found = py.import("trabecula.base.memory")?.getattr("content")?.call1((name,))?;
            Ok(found.cast::<PyBytes>()?.as_bytes().to_vec())
        };
        read().map_err(|e| message_of(py, &e))
    })
}

/// What an exception says.
fn message_of(py: Python<'_>, e: &PyErr) -> String {
    e.value(py).to_string()
}

/// The elements of a file of a format that Python reads.
fn elements(path: &str) -> Result<ZonedElements, String> {
    Python::attach(|py| {
        let read = || -> PyResult<ZonedElements> {
            let read = py.import("trabecula.io.elements")?.getattr("read")?.call1((path,))?;
            let (points, connectivity, ends, kinds, zones, names): Read<'_> = read.extract()?;
            let elements = made(&points, &connectivity, &ends, &kinds);
            Ok(ZonedElements { elements, zones: zones.as_array().to_vec(), names })
        };
        read().map_err(|e| message_of(py, &e))
    })
}

fn made(
    points: &PyReadonlyArray2<'_, f64>,
    connectivity: &PyReadonlyArray1<'_, u32>,
    ends: &PyReadonlyArray1<'_, u64>,
    kinds: &PyReadonlyArray1<'_, u8>,
) -> Elements {
    Elements {
        points: rows(points),
        connectivity: connectivity.as_array().to_vec(),
        ends: ends.as_array().iter().map(|e| *e as usize).collect(),
        kinds: kinds.as_array().to_vec(),
    }
}

/// The result of a file of a format that Python reads, with the numbers of one array.
fn result(path: &str, array: &str) -> Result<Data, String> {
    let data = Python::attach(|py| {
        let read = || -> PyResult<Data> {
            let read = py.import("trabecula.io.results")?.getattr("read")?.call1((path, array))?;
            let (points, connectivity, ends, kinds, names, chosen, values): ReadResult<'_> = read.extract()?;
            let mut arrays: Vec<DataArray> = names
                .into_iter()
                .map(|(name, of_cells, components)| DataArray { name, of_cells, components, values: Vec::new() })
                .collect();
            if let Some(array) = chosen.and_then(|i| arrays.get_mut(i)) {
                array.values = values.as_array().to_vec();
            }
            Ok(Data { shape: DataSet::Mesh(made(&points, &connectivity, &ends, &kinds)), arrays })
        };
        read().map_err(|e| message_of(py, &e))
    })?;
    data.check().map_err(|f| format!("{path}: {}", f.message))?;
    Ok(data)
}

/// The series of DICOM that Python read.
fn scan(path: &str) -> Result<Scan, String> {
    Python::attach(|py| {
        let read = || -> PyResult<Scan> {
            let read = py.import("trabecula.io.dicom")?.getattr("read")?.call1((path,))?;
            let (shape, origin, step, values): ([usize; 3], [f64; 3], [f64; 3], PyReadonlyArray1<'_, f64>) =
                read.extract()?;
            Ok(Scan { shape, values: values.as_array().to_vec(), placed: Some([origin, step]) })
        };
        read().map_err(|e| message_of(py, &e))
    })
}

/// The part of a CAD system that Python read; `name` is the file as the design names it.
fn cad(name: &str, path: &str, how: &Tessellation) -> Result<CadMesh, String> {
    Python::attach(|py| {
        let read = || -> PyResult<CadMesh> {
            let read = py.import("trabecula.io.cad")?.getattr("read")?;
            let part = read.call1((path, how.chord, how.angle, how.solid.as_deref()))?;
            let points: PyReadonlyArray2<'_, f64> = part.getattr("points")?.extract()?;
            let triangles: PyReadonlyArray2<'_, u32> = part.getattr("triangles")?.extract()?;
            let face: PyReadonlyArray1<'_, u32> = part.getattr("faces")?.extract()?;
            let labels: Vec<(String, String, f64)> = part.getattr("labels")?.extract()?;
            let triangles = triangles.as_array();
            Ok(CadMesh {
                file: name.into(),
                mesh: Mesh {
                    vertices: rows(&points),
                    triangles: triangles.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect(),
                },
                face: face.as_array().to_vec(),
                labels: labels.into_iter().map(|(name, color, _)| FaceLabel { name, color }).collect(),
                chord: part.getattr("chord")?.extract()?,
                angle: part.getattr("angle")?.extract()?,
                volume: part.getattr("volume")?.extract()?,
            })
        };
        read().map_err(|e| message_of(py, &e))
    })
}

/// The tetrahedra that a mesher of Python's makes of a surface.
fn tetrahedra(name: &str, surface: &Mesh, size: f64, limit: f64) -> Result<TetMesh, String> {
    Python::attach(|py| {
        let make = || -> PyResult<TetMesh> {
            let points = table(py, surface.vertices.clone())?;
            let triangles = table(py, surface.triangles.clone())?;
            let call = py.import("trabecula.io.meshers")?.getattr("tetrahedra")?;
            let made = call.call1((name, points, triangles, size, limit))?;
            let (nodes, tets): (PyReadonlyArray2<'_, f64>, PyReadonlyArray2<'_, u32>) = made.extract()?;
            let tets = tets.as_array();
            Ok(TetMesh {
                nodes: rows(&nodes),
                tets: tets.rows().into_iter().map(|r| [r[0], r[1], r[2], r[3]]).collect(),
                zones: Vec::new(),
            })
        };
        make().map_err(|e| message_of(py, &e))
    })
}

fn rows(of: &PyReadonlyArray2<'_, f64>) -> Vec<[f64; 3]> {
    of.as_array().rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect()
}
