//! Reports of the core as the classes of `trabecula.reports`.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::Serialize;
use serde_json::Value;

/// A report as the class of this name.
pub fn report<'py>(py: Python<'py>, class: &str, told: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let data = python(py, &serde_json::to_value(told).unwrap_or(Value::Null))?;
    py.import("trabecula.reports")?.getattr(class)?.call1((data,))
}

/// Plain data as Python's; what is no number is None.
fn python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(b) => b.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(n) => match (n.as_i64(), n.as_u64()) {
            (Some(i), _) => i.into_pyobject(py)?.into_any(),
            (_, Some(u)) => u.into_pyobject(py)?.into_any(),
            _ => n.as_f64().into_pyobject(py)?.into_any(),
        },
        Value::String(s) => s.into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let items = items.iter().map(|v| python(py, v)).collect::<PyResult<Vec<_>>>()?;
            PyList::new(py, items)?.into_any()
        }
        Value::Object(entries) => {
            let out = PyDict::new(py);
            for (key, v) in entries {
                out.set_item(key, python(py, v)?)?;
            }
            out.into_any()
        }
    })
}
