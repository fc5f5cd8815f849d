//! Designs: from text or Python data, to a solid.

use std::path::PathBuf;

use pyo3::prelude::*;
use trabecula::design;

use crate::error;
use crate::folder::Folder;
use crate::node::node;
use crate::run::run_apart;
use crate::solid::Solid;

/// A design whose keys, kinds and words have been checked.
#[pyclass(frozen, module = "trabecula._core")]
pub struct Design {
    design: design::Design,
    file: Option<String>,
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

    /// The design with other values at paths, and without a sweep.
    fn varied(&self, py: Python<'_>, values: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<Design> {
        let values: Vec<_> = values.iter().map(|(path, v)| Ok((path.clone(), node(v, 0)?))).collect::<PyResult<_>>()?;
        let design = self.design.varied(&values).map_err(|e| error::design(py, &e))?;
        Ok(Design { design, file: None })
    }

    /// Builds the solid; `folder` is where relative paths start.
    fn build(slf: Py<Self>, py: Python<'_>, folder: PathBuf) -> PyResult<Solid> {
        let own = slf.clone_ref(py);
        let built = run_apart(py, None, move || own.get().design.build(&Folder(folder)))?;
        let Design { design, file } = slf.get();
        let built = built.map_err(|e| named(py, e, file))?;
        Ok(Solid::new(built, design.to_toml().unwrap_or_default()))
    }
}

fn named(py: Python<'_>, e: design::DesignError, file: &Option<String>) -> PyErr {
    match file {
        Some(file) => error::design(py, &e.in_file(file)),
        None => error::design(py, &e),
    }
}
