//! What went wrong, as Python's exceptions.

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use trabecula::design::DesignError;
use trabecula::extract::Stopped;
use trabecula::fault::Fault;

/// `trabecula.DesignError` with the fields of the core's own.
pub fn design(py: Python<'_>, e: &DesignError) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let class = py.import("trabecula.errors")?.getattr("DesignError")?;
        let args = (
            e.to_string(),
            &e.path,
            e.line,
            &e.message,
            &e.found,
            &e.nearest,
        );
        Ok(PyErr::from_value(class.call1(args)?))
    };
    make().unwrap_or_else(|_| PyValueError::new_err(e.to_string()))
}

/// A refused request.
pub fn fault(f: Fault) -> PyErr {
    PyValueError::new_err(f.to_string())
}

/// An extraction that ended without a result.
pub fn stopped(s: Stopped) -> PyErr {
    match s {
        Stopped::Interrupted => PyKeyboardInterrupt::new_err("stopped"),
        Stopped::Io(e) => e.into(),
        Stopped::Refused(f) => fault(f),
    }
}

/// A mistake of ours, caught before it takes the interpreter along.
pub fn internal(what: Box<dyn std::any::Any + Send>) -> PyErr {
    let text = what
        .downcast_ref::<&str>()
        .map(|s| s.to_string())
        .or_else(|| what.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".into());
    PyRuntimeError::new_err(format!("internal error in the core: {text}"))
}
