//! Beams as a graph: hub balls, and beams between them.

mod catalogue;
mod check;
mod clean;
mod radii;
mod table;
mod trim;
mod wire;

pub use catalogue::{Link, Net, Unit, catalogue, named};
pub use clean::Cleaned;
pub use radii::place;
pub use radii::{Radii, sized};
pub use table::{Nodes, nodes, struts};
pub use trim::{Trim, Trimmed};
pub use wire::{Facts, Wire};

use geometry::math::Vec3;

/// Most struts of a frame: beyond it the memory goes into gigabytes.
pub const MOST: f64 = 1e7;

/// A hub: a ball that beams meet in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    /// Its centre (mm).
    pub center: Vec3,
    /// Its radius (mm).
    pub radius: f64,
}

/// Which of the quadrics of revolution tangent to both hubs a beam is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// The one with this radius at mid length (mm).
    Mid(f64),
    /// The cone; a cylinder between equal hubs.
    Cone,
    /// The cylinder between equal hubs.
    Cylinder,
    /// The one whose thinnest place has this radius (mm).
    Waist(f64),
    /// By the parameter of the pencil.
    Lambda(f64),
}

/// A beam between two hubs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Its hubs.
    pub ends: [u32; 2],
    /// Its profile.
    pub profile: Profile,
}

/// A graph of beams.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// The hubs.
    pub hubs: Vec<Hub>,
    /// The beams.
    pub beams: Vec<Beam>,
}
