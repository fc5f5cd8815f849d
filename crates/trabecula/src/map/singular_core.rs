//! The cores of singular lines, as a design describes them.

use crate::kind::Kind;

/// What the core of a singular line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Kind)]
#[kind(noun = "core")]
pub enum CoreFill {
    /// Solid.
    Solid,
    /// Void.
    Void,
}

/// How singular lines are covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoreOptions {
    /// What their cores are.
    pub fill: CoreFill,
    /// The radius of the cores, mm; half the wavelength at the lines if none.
    pub radius: Option<f64>,
}
