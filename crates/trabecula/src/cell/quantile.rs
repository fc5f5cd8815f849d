//! fraction ↔ iso.

/// The distribution of a cell's values.
pub(super) struct Quantile;
