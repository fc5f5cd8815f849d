//! The named cells.

use pyo3::prelude::*;
use trabecula::cell;

/// A named cell.
#[pyclass(frozen, get_all, module = "trabecula._core")]
pub struct NamedCell {
    name: &'static str,
    title: &'static str,
    /// f as text.
    formula: &'static str,
    /// Its space group.
    group: &'static str,
    /// Where it is from.
    source: &'static str,
}

impl NamedCell {
    pub fn of(cell: &cell::NamedCell) -> NamedCell {
        let cell::NamedCell { name, title, formula, group, source, .. } = *cell;
        NamedCell { name, title, formula, group, source }
    }
}
