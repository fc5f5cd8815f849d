//! Cells: functions on the torus R³/Z³, positions in turns.

mod connect;
mod named;
mod quantile;
mod series;
mod thickness;

pub use connect::{Connectivity, connectivity};
pub use named::{Named, catalogue, named};
pub use series::{Series, Term};

use std::sync::OnceLock;

use crate::math::{Interval, Mat3, Vec3};

/// Which part of space about the level is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Part {
    /// |f| ≤ t.
    Sheet,
    /// f ≤ t.
    Lower,
    /// f ≥ t.
    Upper,
}

/// A cell: a Fourier series with what can be known of it once and for all.
pub struct Cell {
    series: Series,
    table: OnceLock<quantile::Quantile>,
    connect: [OnceLock<Connectivity>; 3],
}

impl Cell {
    /// A cell from its series.
    pub fn new(series: Series) -> Cell {
        Cell { series, table: OnceLock::new(), connect: Default::default() }
    }

    /// The series.
    pub fn series(&self) -> &Series {
        &self.series
    }

    /// Least and greatest value of f.
    pub fn range(&self) -> Interval {
        todo!()
    }

    /// Solid volume fraction on the torus of the part at level `iso`.
    pub fn fraction(&self, part: Part, iso: f64) -> f64 {
        let _ = (part, iso);
        todo!()
    }

    /// The level at which the part has this solid fraction (0 < fraction < 1), and d(iso)/d(fraction).
    pub fn iso(&self, part: Part, fraction: f64) -> (f64, f64) {
        let _ = (part, fraction);
        todo!()
    }

    /// The intervals of solid fraction in which the periodic solid is one piece in R³.
    pub fn connected_fraction(&self, part: Part) -> Vec<[f64; 2]> {
        let _ = part;
        todo!()
    }

    /// Minimum wall thickness (sheet) or narrowest neck diameter (lower, upper) at level `iso`, in mm, where
    /// phases relate to millimetres by u = `to_phase` · x. `None` where the part is empty or full.
    pub fn thickness(&self, part: Part, iso: f64, to_phase: &Mat3) -> Option<f64> {
        let _ = (part, iso, to_phase);
        todo!()
    }

    /// Values and gradients (per turn) at phases `u`.
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.series.gradients(u, values, gradients);
    }
}
