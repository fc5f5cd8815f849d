//! Python data as the tree that every text of a design becomes.

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use trabecula::design::{Node, Value};

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
