//! What went wrong, as Python's exceptions.

use std::sync::Mutex;

use geometry::fault::{Fault, brief};
use geometry::progress::Stopped;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use trabecula::design::DesignError;

/// `trabecula.DesignError` with the fields of the core's own.
pub fn design(py: Python<'_>, e: &DesignError) -> PyErr {
    let make = || -> PyResult<PyErr> {
        let class = py.import("trabecula.errors")?.getattr("DesignError")?;
        let args = (e.to_string(), &e.path, e.line, &*brief(&e.message), &e.found, &e.nearest);
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

/// Where the core last failed by a mistake of ours.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Keeps the place of such a failure for the exception, instead of printing it; TRABECULA_DEBUG prints it too.
pub fn watch() {
    let debug = std::env::var_os("TRABECULA_DEBUG").is_some();
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if let Ok(mut last) = LAST.lock() {
            *last = info.to_string().replace('\n', " ");
        }
        if debug {
            usual(info);
        }
    }));
}

/// A mistake of ours, caught before it takes the interpreter along.
pub fn internal(_: Box<dyn std::any::Any + Send>) -> PyErr {
    let what = LAST.lock().map(|l| l.clone()).unwrap_or_default();
    PyRuntimeError::new_err(format!("internal error in the core: {what}"))
}
