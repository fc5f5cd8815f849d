//! Figures of beams.

use std::collections::BTreeMap;

use ::beams::graph::{Cleaned, Trimmed};
use schemars::JsonSchema;
use serde::Serialize;

/// A graph of beams, or a pattern of them: figures of both first, then those of a graph or of a pattern.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BeamsReport {
    /// Name of the unit cell; None for nodes and struts of your own and for patterns.
    pub cell: Option<&'static str>,
    /// The cell's edge or the mean length of struts, mm.
    pub wavelength: f64,
    /// Solid fraction of the part.
    pub fraction: f64,
    /// Whether the fraction is exact; else it is estimated at points.
    pub fraction_exact: bool,
    /// 1 − fraction.
    pub porosity: f64,
    /// Diameter of the thinnest beam in the region, mm.
    pub thickness: f64,
    /// Least and greatest radius of the hubs of these, mm.
    pub hub_radius: [f64; 2],
    /// Volume with fillets, mm³; None where the region cuts the beams or beams collide.
    pub volume: Option<f64>,
    /// What a graph has besides.
    #[serde(flatten)]
    pub graph: Option<GraphReport>,
    /// What a pattern has besides.
    #[serde(flatten)]
    pub pattern: Option<PatternReport>,
}

/// What is known of a graph of beams alone.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct GraphReport {
    /// Number of hubs whose centre is in the region.
    pub hubs: usize,
    /// Number of beams of which something is in the region: whose axis is somewhere nearer to it than the beam's radius there.
    pub beams: usize,
    /// Radius of beams, mm, solved for from the fraction asked for; None where the radius is given.
    pub solved_radius: Option<f64>,
    /// Least and greatest length of these beams from hub to hub, mm; None where there are none, only fillets of others.
    pub length: Option<[f64; 2]>,
    /// Sum of these lengths, mm: also of beams that the region cuts, in full.
    pub total_length: f64,
    /// Surface area, mm²; None where the volume is.
    pub area: Option<f64>,
    /// Centre of mass, mm.
    pub centroid: Option<[f64; 3]>,
    /// Inertia tensor about the centre of mass for density 1, mm⁵.
    pub inertia: Option<[[f64; 3]; 3]>,
    /// Number of hubs in the region by their number of beams.
    pub valence: BTreeMap<String, usize>,
    /// Least and greatest radius of fillets at their tightest places, mm; None without fillets.
    pub fillet_radius: Option<[f64; 2]>,
    /// Hubs in the region that cannot have the fillets asked for, that with the tightest crotch first.
    pub fillet_shortfalls: Vec<FilletShortfall>,
    /// Least angle between two beams of a node, degrees.
    pub smallest_angle: Option<f64>,
    /// Position of that node, mm.
    pub smallest_angle_at: Option<[f64; 3]>,
    /// Number of connected components of these beams, which are joined at hubs whose ball reaches into the region.
    pub pieces: usize,
    /// Number of nodes inside the region with a single beam.
    pub dangling: usize,
    /// Pairs of beams that run into each other without a common node.
    pub collisions: usize,
    /// What was cleaned.
    pub cleaned: Cleaned,
    /// What the region trimmed.
    pub trimmed: Trimmed,
}

/// A hub with a fillet smaller than asked for. A crotch is where two of its beams meet.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct FilletShortfall {
    /// Number of the hub, as in `Solid.beams` and for `Quadors.hub`.
    pub hub: usize,
    /// Its centre, mm.
    pub position: [f64; 3],
    /// Radius asked for, mm; None if τ, α or β was.
    pub asked_radius: Option<f64>,
    /// τ asked for, also by α or β; None if a radius was.
    pub asked_tau: Option<f64>,
    /// Radius of the smallest and of the largest fillet in its crotches, mm; None if no crotch is concave.
    pub radius: Option<[f64; 2]>,
    /// Least and greatest τ of its crotches; the smallest fillet has the greatest.
    pub tau: [f64; 2],
    /// Number of its crotches.
    pub crotches: usize,
    /// Number of its crotches with a smaller fillet than asked for.
    pub short: usize,
}

/// What is known of a pattern of beams alone.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct PatternReport {
    /// Number of hubs, repeats included.
    pub hubs: f64,
    /// Number of beams, repeats included.
    pub beams: f64,
    /// Repeats of its three steps.
    pub repeats: [u32; 3],
    /// Number of hubs that differ in more than position and scale.
    pub kinds: usize,
    /// Pairs of beams that run into each other without a common node, about one hub of each kind; None if not known.
    pub collisions: Option<usize>,
}

/// What a file of beams contains.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BeamsFileReport {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of beams; of a 3MF the frusta of cones.
    pub beams: usize,
    /// Number of balls at nodes, where a hub is larger than its beams are there.
    pub balls: usize,
    /// Number of beams that are several frusta.
    pub split: usize,
    /// Greatest difference between the radius of a beam and that of its frusta, mm; None for a graph.
    pub error: Option<f64>,
    /// Whether the file has the mesh of the region that cuts the beams.
    pub clipped: bool,
    /// What of the beams the format cannot hold, a sentence each.
    pub lost: Vec<String>,
}
