//! Beams in a region: their graph, their field, and statistics of how the graph was made.

use std::sync::Arc;

mod beam_fields;
mod fill_region;
mod in_region;

pub use fill_region::fill;
pub use in_region::{beams_in, within};

use crate::implicit::Implicit;
use beams::graph::{Cleaned, Graph, Trim, Trimmed, WireframeReport, Within};
use beams::pattern::PatternField;
use beams::quador::{Collision, Quadors, Shortfall};

/// The beams of a design.
#[derive(Clone)]
pub enum Beams {
    /// An explicit graph.
    Truss(Arc<Truss>),
    /// A pattern of repeats.
    Pattern(Arc<PatternField>),
}

impl Beams {
    /// The solid as an implicit function; a small pattern as its hubs, which are evaluated over whole blocks of points.
    pub fn field(&self) -> Arc<dyn Implicit> {
        match self {
            Beams::Truss(t) => t.quadors.clone(),
            Beams::Pattern(p) => match p.expanded_if_small() {
                Some(quadors) => quadors,
                None => p.clone(),
            },
        }
    }

    /// Length scale for grids, mm.
    pub fn wavelength(&self) -> f64 {
        match self {
            Beams::Truss(t) => t.wavelength,
            Beams::Pattern(p) => p.wavelength(),
        }
    }
}

/// A graph of beams in a region.
#[derive(Clone, Debug)]
pub struct Truss {
    /// The graph.
    pub graph: Graph,
    /// Its solid.
    pub quadors: Arc<Quadors>,
    /// The unit cell it was made from, if any.
    pub cell: Option<&'static str>,
    /// Radius of the beams (mm) that was solved for from a fraction; `None` where it is given.
    pub solved_radius: Option<f64>,
    /// Length scale for grids, mm: the minimum wavelength of the map, or the mean strut length.
    pub wavelength: f64,
    /// Whether that is of what repeats, rather than of struts listed one by one, whose length says nothing of their detail.
    pub repeats: bool,
    /// What of the graph is in the region.
    pub within: Within,
    /// Statistics of that.
    pub report: WireframeReport,
    /// Minimum and maximum fillet radius in the tightest crotches of hubs inside the region, mm; `None` without
    /// fillets.
    pub fillet: Option<[f64; 2]>,
    /// Hubs inside the region with a fillet smaller than asked for, that with the tightest crotch first.
    pub shortfalls: Vec<Shortfall>,
    /// Whether all beams lie inside the region.
    pub whole: bool,
    /// Counts of the clean-up.
    pub cleaned: Cleaned,
    /// What is done with struts that leave the region.
    pub trim: Trim,
    /// Counts of the trim.
    pub trimmed: Trimmed,
    /// Number of nodes inside the region with a single strut.
    pub dangling: usize,
    /// Beams that intersect inside the region without a common hub.
    pub collisions: Vec<Collision>,
}
