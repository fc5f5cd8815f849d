//! Arrays of points in, arrays of numbers out.

use geometry::spatial_order::spatial_order;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use trabecula::field::Field;

use crate::run::run;

/// Points of Python (n, 3) as the core's.
pub fn points(p: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let a = p.as_array();
    if a.ncols() != 3 {
        return Err(PyValueError::new_err(format!("points must have shape (n, 3), found {:?}", a.shape())));
    }
    let points: Vec<[f64; 3]> = a.rows().into_iter().map(|r| [r[0], r[1], r[2]]).collect();
    match points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(i) => Err(PyValueError::new_err(format!(
            "points[{i}] is {:?}; a position is three finite numbers, mm",
            points[i]
        ))),
        None => Ok(points),
    }
}

/// Rows of numbers as an array (n, N).
pub fn table<T: Element, const N: usize>(py: Python<'_>, rows: Vec<[T; N]>) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [rows.len(), N];
    rows.into_flattened().into_pyarray(py).reshape(shape)
}

/// Values of a field at points.
pub fn values<'py>(py: Python<'py>, field: &dyn Field, points: Vec<[f64; 3]>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let out = run(py, None, None, |_| evaluated(&points, field.is_large(), |p, out| field.values(p, out)))?;
    Ok(out.into_pyarray(py))
}

/// What a function gives at points, by all threads; it gets them in an order in which neighbours follow each other if
/// `in_order` is set.
pub fn evaluated<T: Copy + Default + Send>(
    points: &[[f64; 3]],
    in_order: bool,
    evaluate: impl Fn(&[[f64; 3]], &mut [T]) + Sync,
) -> Vec<T> {
    const BATCH: usize = 4096;
    let mut out = vec![T::default(); points.len()];
    if !in_order {
        out.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(o, p)| evaluate(p, o));
        return out;
    }
    let order = spatial_order(points);
    let mut found = out.clone();
    found.par_chunks_mut(BATCH).zip(order.par_chunks(BATCH)).for_each(|(o, numbers)| {
        let points: Vec<[f64; 3]> = numbers.iter().map(|n| points[*n as usize]).collect();
        evaluate(&points, o);
    });
    order.iter().zip(found).for_each(|(n, v)| out[*n as usize] = v);
    out
}
