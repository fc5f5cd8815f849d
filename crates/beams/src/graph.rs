//! Graphs of beams: hub balls and the beams that join them; unit cells, wireframes, radii, tables.

mod catalogue;
mod clean_up;
mod graph_checks;
mod radii;
mod tables;
mod trim;
mod wireframe;

pub use catalogue::{PeriodicBeam, PeriodicGraph, UnitCell, catalogue, named};
pub use clean_up::Cleaned;
pub use radii::position_text;
pub use radii::{Radii, with_radii};
pub use tables::{Nodes, nodes, struts};
pub use trim::{Trim, Trimmed};
pub use wireframe::{GivenRadii, Wireframe, WireframeReport, Within};

use geometry::math::Vec3;

/// Maximum number of struts of a wireframe; above it memory reaches gigabytes.
pub const MAX_STRUTS: f64 = 1e7;

/// A hub: the ball in which beams meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HubBall {
    /// Centre, mm.
    pub center: Vec3,
    /// Radius, mm; positive and finite.
    pub radius: f64,
}

/// Selects one quadric of revolution from the pencil of quadrics tangent to both hubs of a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// The quadric with this radius at mid length, mm.
    Mid(f64),
    /// The common tangent cone; a cylinder between equal hubs.
    Cone,
    /// The cylinder; only between equal hubs.
    Cylinder,
    /// The quadric with this minimum radius, mm.
    Waist(f64),
    /// The quadric of this pencil parameter λ.
    Lambda(f64),
}

/// A beam between two hubs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Indices of its two hubs.
    pub ends: [u32; 2],
    /// Its profile.
    pub profile: Profile,
}

/// A graph of hubs and beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// The hubs.
    pub hubs: Vec<HubBall>,
    /// The beams.
    pub beams: Vec<Beam>,
}

impl Graph {
    /// Some of the beams, with the hubs that they have.
    pub fn part(&self, kept: &[bool]) -> Graph {
        let mut number = vec![None; self.hubs.len()];
        let beams = || self.beams.iter().zip(kept).filter(|(_, kept)| **kept).map(|(b, _)| *b);
        beams().flat_map(|b| b.ends).for_each(|n| number[n as usize] = Some(0));
        let mut hubs = Vec::new();
        for (number, hub) in number.iter_mut().zip(&self.hubs) {
            if let Some(n) = number {
                *n = hubs.len() as u32;
                hubs.push(*hub);
            }
        }
        let of = |n: u32| number[n as usize].unwrap_or(0);
        Graph { beams: beams().map(|b| Beam { ends: b.ends.map(of), ..b }).collect(), hubs }
    }
}
