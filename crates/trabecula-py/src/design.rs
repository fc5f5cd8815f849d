//! Designs: from text or Python data, to a solid.

use std::path::{Path, PathBuf};

use geometry::formats::Elements;
use geometry::mesh::Mesh;
use geometry::tetmesh::TetMesh;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use trabecula::design::{self, Loader, Node, Value};

use crate::error;
use crate::run::run;
use crate::solid::Solid;

/// A design whose keys, kinds and words have been checked.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Design {
    design: design::Design,
    file: Option<String>,
}

/// Files below a folder.
pub struct Folder(pub PathBuf);

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
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

    fn elements(&self, path: &str) -> Result<(Elements, Vec<u32>), String> {
        crate::tets::elements(&self.0.join(Path::new(path)).to_string_lossy())
    }

    fn tetrahedra(&self, name: &str, surface: &Mesh, size: f64, limit: f64) -> Result<TetMesh, String> {
        crate::tets::tetrahedra(name, surface, size, limit)
    }
}

#[pymethods]
impl Design {
    /// Reads TOML or JSON text; `file` is named in errors.
    #[staticmethod]
    #[pyo3(signature = (text, json=false, file=None))]
    fn from_text(py: Python<'_>, text: &str, json: bool, file: Option<String>) -> PyResult<Design> {
        let read = if json { design::Design::from_json(text) } else { design::Design::from_toml(text) };
        match read {
            Ok(design) => Ok(Design { design, file }),
            Err(e) => Err(named(py, e, &file)),
        }
    }

    /// Reads dictionaries, lists, numbers, texts.
    #[staticmethod]
    fn from_data(py: Python<'_>, data: &Bound<'_, PyAny>) -> PyResult<Design> {
        let design = design::Design::from_node(&node(data, 0)?).map_err(|e| error::design(py, &e))?;
        Ok(Design { design, file: None })
    }

    /// The design as TOML text.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        self.design.to_toml().map_err(|e| error::design(py, &e))
    }

    /// The design as JSON text.
    fn to_json(&self) -> String {
        self.design.to_json().to_string()
    }

    /// Builds the solid; `folder` is where relative paths start.
    fn build(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Solid> {
        let built = run(py, None, None, |_| {
            let built = self.design.build(&Folder(folder))?;
            let warnings = built.warnings.iter().map(|w| (w.path.clone(), w.message.clone())).collect();
            Ok((built, warnings))
        })?;
        match built {
            Ok((built, warnings)) => {
                let text = self.design.to_toml().unwrap_or_default();
                Ok(Solid::built(built, warnings, text))
            }
            Err(e) => Err(named(py, e, &self.file)),
        }
    }
}

fn named(py: Python<'_>, e: design::DesignError, file: &Option<String>) -> PyErr {
    match file {
        Some(file) => error::design(py, &e.in_file(file)),
        None => error::design(py, &e),
    }
}

/// Python data as the core's tree. Anything with `tolist` (numpy's arrays and scalars) goes through it.
pub fn node(data: &Bound<'_, PyAny>, depth: usize) -> PyResult<Node> {
    if depth > 64 {
        return Err(pyo3::exceptions::PyValueError::new_err(
            "a design is at most 64 levels deep; does it hold itself?",
        ));
    }
    let items = |items: &mut dyn Iterator<Item = Bound<'_, PyAny>>| {
        items.map(|i| node(&i, depth + 1)).collect::<PyResult<Vec<Node>>>().map(Value::List)
    };
    let value = if data.is_instance_of::<PyBool>() {
        Value::Bool(data.extract()?)
    } else if data.is_instance_of::<PyFloat>() || data.is_instance_of::<PyInt>() {
        match data.extract() {
            Ok(number) => Value::Number(number),
            Err(_) => Value::Other("a whole number beyond 1e308".into()),
        }
    } else if let Ok(text) = data.cast::<PyString>() {
        Value::Text(text.to_string_lossy().into_owned())
    } else if let Ok(list) = data.cast::<PyList>() {
        items(&mut list.iter())?
    } else if let Ok(tuple) = data.cast::<PyTuple>() {
        items(&mut tuple.iter())?
    } else if let Ok(dict) = data.cast::<PyDict>() {
        let mut entries = Vec::with_capacity(dict.len());
        for (k, v) in dict.iter() {
            entries.push((k.str()?.to_string(), None, node(&v, depth + 1)?));
        }
        Value::Table(entries)
    } else if let Ok(tolist) = data.getattr("tolist") {
        return node(&tolist.call0()?, depth + 1);
    } else if data.hasattr("__fspath__")? {
        Value::Text(data.call_method0("__fspath__")?.extract()?)
    } else {
        Value::Other(format!("{} of type {}", data.repr()?, data.get_type().name()?))
    };
    Ok(value.into())
}
