//! Connected components of a solid: the option `islands` and the figures reported.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trabecula::surface_maker::{Components, Islands};

/// What a word stands for.
pub fn named(word: &str) -> PyResult<Islands> {
    Islands::named(word)
        .ok_or_else(|| PyValueError::new_err(format!(r#"islands is "{word}"; it must be "keep", "drop" or "error""#)))
}

/// The figures of the result, under `islands` those of all pieces but the largest; and these in words.
pub fn told<'py>(py: Python<'py>, p: &Components) -> PyResult<(Bound<'py, PyDict>, String)> {
    let islands = PyDict::new(py);
    islands.set_item("found", p.others)?;
    islands.set_item("dropped", p.dropped)?;
    islands.set_item("border", p.border)?;
    islands.set_item("volume", p.volume)?;
    islands.set_item("share", p.share())?;
    let largest = p.second.map(|i| {
        let largest = PyDict::new(py);
        largest.set_item("volume", i.volume)?;
        largest.set_item("place", i.center())?;
        largest.set_item("bounds", i.bounds)?;
        Ok::<_, PyErr>(largest)
    });
    islands.set_item("largest", largest.transpose()?)?;
    let d = PyDict::new(py);
    d.set_item("euler", p.euler)?;
    d.set_item("pieces", p.count)?;
    d.set_item("cavities", p.cavities)?;
    d.set_item("islands", islands)?;
    Ok((d, p.words()))
}
