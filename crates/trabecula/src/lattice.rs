//! A lattice: cell, map, part, level. The only file where cell and map meet.

use std::sync::Arc;

use crate::cell::{Cell, Part};
use crate::fault::Fault;
use crate::field::{Block, Field};
use crate::grade::Grade;
use crate::map::Map;
use crate::math::{Aabb, Interval, Vec3};

/// How much of the cell is solid.
#[derive(Clone)]
pub enum Level {
    /// The field value t; for a sheet the half-level.
    Iso(Grade),
    /// Solid volume fraction of the cell on the torus.
    Fraction(Grade),
}

/// A lattice as a field: sheet |f| − t, lower f − t, upper t − f.
#[derive(Clone)]
pub struct Lattice {
    /// The cell.
    pub cell: Arc<Cell>,
    /// The map.
    pub map: Map,
    /// The part.
    pub part: Part,
    /// The level.
    pub level: Level,
}

impl Lattice {
    /// Checks and joins the pieces.
    pub fn new(cell: Arc<Cell>, map: Map, part: Part, level: Level) -> Result<Lattice, Fault> {
        Ok(Lattice { cell, map, part, level })
    }

    /// Fills the level t at points (mm).
    pub fn isos(&self, points: &[Vec3], out: &mut [f64]) {
        let _ = (points, out);
        todo!()
    }
}

impl Field for Lattice {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let _ = (points, out);
        todo!()
    }
    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let _ = (points, values, gradients);
        todo!()
    }
    fn bound(&self, b: &Aabb) -> Interval {
        let _ = b;
        todo!()
    }
    fn fill(&self, block: &Block, out: &mut [f32]) {
        let _ = (block, out);
        todo!()
    }
}
