//! Reports of the core as the classes of `trabecula.reports`.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use serde::Serialize;

/// A report as the class of this name, its figures in the order of their declaration; what is no number is None.
pub fn report<'py>(py: Python<'py>, class: &str, figures: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(figures).map_err(|e| PyRuntimeError::new_err(format!("{class}: {e}")))?;
    let data = py.import("json")?.call_method1("loads", (text,))?;
    py.import("trabecula.reports")?.getattr(class)?.call1((data,))
}
