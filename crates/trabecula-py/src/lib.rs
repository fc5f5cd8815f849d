//! The Python door: thin. Data in, arrays out; long calls let other threads run, report progress and stop on Ctrl-C.

use pyo3::prelude::*;

mod design;
mod error;
mod mesh;
mod run;
mod solid;

/// The compiled core of `trabecula`.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::design::Design;
    #[pymodule_export]
    use crate::mesh::Mesh;
    #[pymodule_export]
    use crate::solid::{Region, Solid, Voxels};

    /// Version of the core.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// The JSON Schema of a design, as JSON text.
    #[pyfunction]
    fn schema() -> String {
        trabecula::design::schema().to_string()
    }

    /// The named cells: (name, title, formula, group, source).
    #[pyfunction]
    fn cells() -> Vec<(
        &'static str,
        &'static str,
        &'static str,
        &'static str,
        &'static str,
    )> {
        trabecula::cell::catalogue()
            .iter()
            .map(|n| (n.name, n.title, n.formula, n.group, n.source))
            .collect()
    }

    /// What a named cell can tell: its range, and for each part the fractions in which it is one piece in space.
    #[pyfunction]
    #[allow(clippy::type_complexity)]
    fn cell_facts(
        py: Python<'_>,
        name: &str,
    ) -> PyResult<((f64, f64), Vec<(&'static str, Vec<[f64; 2]>)>)> {
        use trabecula::cell::{Cell, Part, Series};
        let known = trabecula::cell::named(name).ok_or_else(|| {
            pyo3::exceptions::PyKeyError::new_err(format!("no cell is named {name}"))
        })?;
        let series = Series::new(known.terms())
            .map_err(|f| pyo3::exceptions::PyRuntimeError::new_err(format!("cell {name}: {f}")))?;
        crate::run::run(py, None, None, |_| {
            let cell = Cell::new(series);
            let range = cell.range();
            let parts = [
                ("sheet", Part::Sheet),
                ("lower", Part::Lower),
                ("upper", Part::Upper),
            ];
            (
                (range.lo, range.hi),
                parts.map(|(n, p)| (n, cell.connected_fraction(p))).to_vec(),
            )
        })
    }
}
