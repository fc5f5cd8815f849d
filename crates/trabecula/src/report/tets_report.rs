//! Figures of tetrahedral meshes and of the lattices over them.

use std::collections::BTreeMap;

use geometry::tetmesh::TetQuality;
use schemars::JsonSchema;
use serde::Serialize;

use super::Varying;
use crate::kind::Warning;
use crate::mesher::{FitReport, MadeLayers};
use crate::tiling::{WallCreases, WallSpread};

/// The figures of a tetrahedral mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TetMeshReport {
    /// What made it: background, ftetwild, or the file's name.
    pub mesher: String,
    /// Shapes and sizes.
    pub quality: TetQuality,
    /// How it fits its region; None without one, and within the report of a lattice, which has it itself.
    pub fit: Option<FitReport>,
    /// Volume of its region as described, mm³; None without one.
    pub region_volume: Option<f64>,
    /// Its layers of prisms, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layers: Option<MadeLayers>,
    /// Possible mistakes; None within the report of a design, which has them itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warnings: Option<Vec<Warning>>,
}

/// A lattice over a tetrahedral mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TilingReport {
    /// How its surface is made: explicit, in each tetrahedron apart, or implicit, on a grid over the part.
    pub method: &'static str,
    /// Why it is made on a grid, with the place if it is for one; None where it is not.
    pub method_reason: Option<String>,
    /// Number of tetrahedra.
    pub count: usize,
    /// The mesh.
    pub mesh: TetMeshReport,
    /// Mean length of edges, mm.
    pub edge: f64,
    /// Volume of its flat tetrahedra with their nodes on the surface, mm³; where `trabecula tets` writes them they balance about it.
    pub volume: f64,
    /// Solid fraction of the lattice in its flat tetrahedra, without net or rounding.
    pub solid_fraction: f64,
    /// Solid fraction of the finished part, with net, rounding and tetrahedra that are bent onto the surface; None where it is
    /// `solid_fraction`.
    pub finished_fraction: Option<f64>,
    /// The zones by the number or the name in the design, where zones have cells of their own.
    pub zones: Option<BTreeMap<String, ZoneReport>>,
    /// Number of connected components, predicted from values at small steps; None with a skin or kept zones, and where more than 20 000
    /// tetrahedra differ (4 000 with an overlap): the mesh tells it then.
    pub pieces: Option<usize>,
    /// Which zones join, where zones have cells of their own.
    pub joins: Option<Vec<ZoneJoin>>,
    /// Overlap of tetrahedra, 0 to 0.2 of their size.
    pub overlap: f64,
    /// How the lattice ends at the part's surface: capped, open, net or rounded.
    pub surface: &'static str,
    /// Radius of the net's rods, or of rounded ends, mm; None with flat ends.
    pub end_radius: Option<Varying>,
    /// What the net covers; None without one.
    pub net: Option<NetReport>,
    /// Thickness of the walls, mm; None for networks and for zones.
    pub thickness: Option<WallSpread>,
    /// Number of ports on each face of a tetrahedron; None for zones.
    pub ports: Option<usize>,
    /// Share of a tetrahedron's face that is solid; None for zones.
    pub face_fraction: Option<Varying>,
    /// Angles between walls at faces of tetrahedra; None where there are none.
    pub creases: Option<WallCreases>,
}

/// What the net on a part's surface covers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NetReport {
    /// Number of ports where it is.
    pub ports: usize,
    /// Number of those that no rod reaches.
    pub untied: usize,
    /// Position of one of these, mm.
    #[serde(skip)]
    pub untied_at: Option<[f64; 3]>,
    /// Diameter of the largest disc on the surface between its rods, mm.
    pub opening: f64,
    /// Middle of that disc, mm.
    pub opening_at: [f64; 3],
}

/// A zone of a tetrahedral mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ZoneReport {
    /// Name of its cell.
    pub cell: String,
    /// Numbers of its tetrahedra in the mesh: several, where elements of a group are of other groups too.
    pub numbers: Vec<i64>,
    /// Number of tetrahedra.
    pub count: usize,
    /// Volume, mm³.
    pub volume: f64,
    /// Solid fraction of the lattice in the zone's flat tetrahedra, without net or rounding.
    pub solid_fraction: f64,
    /// Solid fraction of the finished part in the zone, skin and keep zones included, by samples; None where it is `solid_fraction`, and
    /// for a zone too small to be sampled.
    pub finished_fraction: Option<f64>,
}

/// Two zones with faces in common.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct ZoneJoin {
    /// Numbers of the zones.
    pub zones: [i64; 2],
    /// Number of faces between them.
    pub faces: usize,
    /// Number of those that solid passes through.
    pub open: usize,
    /// Share of a face that is solid in both cells.
    pub ports: f64,
    /// Whether the largest components of both are connected.
    pub joined: bool,
}
