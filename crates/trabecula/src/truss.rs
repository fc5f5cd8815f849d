//! A graph of beams in a region, as a field, and how it came about.

use std::sync::Arc;

mod field;
mod fill;

pub use fill::{expected, fill};

use crate::implicit::Implicit;
use beams::graph::{Cleaned, Facts, Graph, Trimmed};
use beams::pattern::Laid;
use beams::quador::Quadors;
use beams::quador::collide::Collision;

/// Beams as they fill a region.
#[derive(Clone)]
pub enum Beams {
    /// A graph.
    Truss(Arc<Truss>),
    /// A program of repeats.
    Pattern(Arc<Laid>),
}

impl Beams {
    /// The solid.
    pub fn field(&self) -> Arc<dyn Implicit> {
        match self {
            Beams::Truss(t) => t.quadors.clone(),
            Beams::Pattern(p) => p.clone(),
        }
    }

    /// A length to which grids are fitted, mm.
    pub fn wavelength(&self) -> f64 {
        match self {
            Beams::Truss(t) => t.wavelength,
            Beams::Pattern(p) => p.wavelength(),
        }
    }
}

/// Beams in a region.
#[derive(Clone, Debug)]
pub struct Truss {
    /// The graph.
    pub graph: Graph,
    /// Its solid.
    pub quadors: Arc<Quadors>,
    /// The unit cell that it was made of, if it was.
    pub cell: Option<&'static str>,
    /// A length to which grids are fitted, mm: the least wavelength of the map, or the mean length of struts.
    pub wavelength: f64,
    /// What is told of the frame.
    pub facts: Facts,
    /// Least and greatest of the hubs' fillets in their tightest places (mm), of hubs inside the region; none without.
    pub fillet: Option<[f64; 2]>,
    /// Whether all of it lies in the region.
    pub whole: bool,
    /// What was taken out of it.
    pub cleaned: Cleaned,
    /// What was trimmed.
    pub trimmed: Trimmed,
    /// Nodes inside the region with a single strut.
    pub dangling: usize,
    /// Beams that meet in the region without a common hub.
    pub collisions: Vec<Collision>,
}
