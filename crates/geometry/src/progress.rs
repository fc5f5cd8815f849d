//! Progress of long computations, and how they end early.

use std::io;

use crate::fault::Fault;

/// Receives the progress of a computation and may stop it.
pub trait Progress: Sync {
    /// `done` of `total` equal steps. `false` stops the work.
    fn step(&self, done: u64, total: u64) -> bool;
}

/// Reports nothing and never stops.
pub struct Silent;

impl Progress for Silent {
    fn step(&self, _: u64, _: u64) -> bool {
        true
    }
}

/// Why a computation ended without a result.
#[derive(Debug)]
pub enum Stopped {
    /// The progress said so.
    Interrupted,
    /// The output could not be written.
    Io(io::Error),
    /// The request cannot be met (a spacing too fine for single precision, an unbounded region …).
    Refused(Fault),
}
