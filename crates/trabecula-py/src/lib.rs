//! The Python door: thin. Data in, arrays out; long calls let other threads run, report progress and stop on Ctrl-C.

use pyo3::prelude::*;

mod design;
mod error;
mod file;
mod islands;
mod machine;
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

    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        crate::error::watch();
        Ok(())
    }

    /// Version of the core.
    #[pymodule_export]
    #[allow(non_upper_case_globals)]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    /// The bytes of a file; what is no regular file, or more than memory can hold, is refused.
    #[pyfunction]
    fn read_file(
        py: Python<'_>,
        path: std::path::PathBuf,
    ) -> PyResult<Bound<'_, pyo3::types::PyBytes>> {
        let bytes = py.detach(|| crate::file::read(&path))?;
        Ok(pyo3::types::PyBytes::new(py, &bytes))
    }

    /// Bytes of memory that may yet be taken, or None where the system does not tell; `root` is that of its files.
    #[pyfunction]
    #[pyo3(signature = (root=std::path::PathBuf::from("/")))]
    fn free_memory(root: std::path::PathBuf) -> Option<f64> {
        crate::machine::free_memory(&root)
    }

    /// Histograms one above the other as PNG bytes: (title, edges, shares, marks).
    #[pyfunction]
    #[allow(clippy::type_complexity)]
    fn charts<'py>(
        py: Python<'py>,
        charts: Vec<(String, Vec<f64>, Vec<f64>, Vec<(String, f64)>)>,
        width: usize,
        height: usize,
    ) -> PyResult<Bound<'py, pyo3::types::PyBytes>> {
        use trabecula::render::{self, Chart};
        let bytes = crate::run::run(py, None, None, |_| {
            let charts: Vec<Chart> = charts
                .into_iter()
                .map(|(title, edges, share, marks)| Chart {
                    title,
                    edges,
                    share,
                    marks,
                })
                .collect();
            let size = [width, height];
            render::png(&render::charts(&charts, size), size)
        })?;
        Ok(pyo3::types::PyBytes::new(py, &bytes))
    }

    /// The JSON Schema of a design, as JSON text.
    #[pyfunction]
    fn schema() -> String {
        trabecula::design::schema().to_string()
    }

    /// A space group: its number, its name, and its operations as rotations and translations (in parts of 24).
    #[pyfunction]
    #[allow(clippy::type_complexity)] // what Python gets, and nothing else uses
    fn group(symbol: &str) -> PyResult<(Option<u16>, String, Vec<([[i32; 3]; 3], [i32; 3])>)> {
        let group = trabecula::symmetry::Group::named(symbol).map_err(crate::error::fault)?;
        let operations = group.operations.iter();
        let operations = operations.map(|o| (o.rotation, o.translation)).collect();
        Ok((group.number, group.name, operations))
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

    /// The levels (`to_iso`) of the solid fractions `values`, or the fractions of the levels, of a part of a cell.
    #[pyfunction]
    fn levels(
        py: Python<'_>,
        cell: &Bound<'_, PyAny>,
        part: &str,
        values: Vec<f64>,
        to_iso: bool,
    ) -> PyResult<Vec<f64>> {
        use trabecula::cell::Part;
        let part = match part {
            "sheet" => Part::Sheet,
            "lower" => Part::Lower,
            "upper" => Part::Upper,
            _ => {
                let message = format!("part is \"{part}\"; it must be sheet, lower or upper");
                return Err(pyo3::exceptions::PyValueError::new_err(message));
            }
        };
        let bad = |v: &&f64| {
            if to_iso {
                !(**v > 0.0 && **v < 1.0)
            } else {
                !v.is_finite()
            }
        };
        if let Some(v) = values.iter().find(bad) {
            let name = if to_iso { "fraction" } else { "iso" };
            let allowed = if to_iso {
                "greater than 0 and less than 1"
            } else {
                "a finite number"
            };
            return Err(pyo3::exceptions::PyValueError::new_err(format!(
                "{name} is {v}; it must be {allowed}"
            )));
        }
        let node = crate::design::node(cell, 0)?;
        let done = crate::run::run(py, None, None, |_| {
            let cell = trabecula::design::cell(&node)?;
            let one = |v: &f64| {
                if to_iso {
                    cell.iso(part, *v).0
                } else {
                    cell.fraction(part, *v)
                }
            };
            Ok(values.iter().map(one).collect())
        })?;
        done.map_err(|e| crate::error::design(py, &e))
    }
}
