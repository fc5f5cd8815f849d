//! Figures of tetrahedral meshes and of the lattices over them.

use std::collections::BTreeMap;

use geometry::tetmesh::surface_fit::{Distances, LostFeature};
use geometry::tetmesh::{Dihedral, Quality, Spread};
use schemars::JsonSchema;
use serde::Serialize;

use super::Varying;
use crate::kind::Warning;
use crate::mesher::{Fit, MadeLayers};
use crate::tiling::Spread as Walls;

/// The figures of a tetrahedral mesh.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TetMeshReport {
    /// What made it: background, ftetwild, or the file's name.
    pub mesher: String,
    /// Shapes and sizes.
    pub quality: TetQualityReport,
    /// How it fits its region; None without one, and within the report of a lattice, which has it itself.
    pub fit: Option<FitReport>,
    /// Volume of its region as described, mm³; None without one.
    pub region_volume: Option<f64>,
    /// Its layers of prisms, if any.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layers: Option<LayersMade>,
    /// Possible mistakes; None within the report of a design, which has them itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warnings: Option<Vec<Warning>>,
}

/// Layers of prisms along the surface of a tetrahedral mesh.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct LayersMade {
    /// Number of prisms and wedges, each cut into tetrahedra.
    pub prisms: usize,
    /// Mean over their area of their heights in those asked for, where layers do not taper to their end.
    pub mean: f64,
    /// Share of that area where they are lower than nine tenths of these.
    pub lower: f64,
    /// The least of these heights.
    pub least: f64,
    /// Where it is, mm.
    pub at: [f64; 3],
}

/// Minimum, mean and maximum.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct MinMeanMax {
    /// Minimum.
    pub min: f64,
    /// Mean.
    pub mean: f64,
    /// Maximum.
    pub max: f64,
}

/// Dihedral angles, degrees: 70.53 in a regular tetrahedron.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DihedralReport {
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// 5th percentile of each tetrahedron's least angle.
    pub min_p05: f64,
    /// Median of each tetrahedron's least angle.
    pub min_p50: f64,
    /// Median of each tetrahedron's greatest angle.
    pub max_p50: f64,
    /// 95th percentile of each tetrahedron's greatest angle.
    pub max_p95: f64,
    /// Number of angles (six for each tetrahedron) in steps of ten degrees from 0 to 180.
    pub histogram: Vec<usize>,
}

/// Shapes and sizes of a mesh's tetrahedra.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TetQualityReport {
    /// Number of tetrahedra.
    pub tets: usize,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of triangles of the boundary.
    pub boundary_triangles: usize,
    /// Number of components connected by faces.
    pub pieces: usize,
    /// Lower and upper corner of the bounds, mm.
    pub bounds: [[f64; 3]; 2],
    /// Volume, mm³.
    pub volume: f64,
    /// Lengths of edges, mm, each counted once for each tetrahedron that has it.
    pub edge: MinMeanMax,
    /// Sizes, mm: the edge of a regular tetrahedron of the same volume.
    pub size: MinMeanMax,
    /// Dihedral angles, degrees.
    pub dihedral: DihedralReport,
    /// Longest edge over √24 times the radius of the inscribed ball; 1 for a regular tetrahedron.
    pub aspect: MinMeanMax,
    /// Number of tetrahedra with a dihedral angle below 10° or above 170°.
    pub slivers: usize,
    /// Number of tetrahedra of negative volume.
    pub inverted: usize,
}

/// How a tetrahedral mesh fits its region.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FitReport {
    /// Distances from the boundary of the mesh to the region's surface.
    pub to_part: DistanceReport,
    /// Distances from the region's surface to the boundary of the mesh.
    pub from_part: DistanceReport,
    /// Volume of tetrahedra outside the region, mm³.
    pub gained: f64,
    /// Volume of the region outside the tetrahedra, mm³.
    pub missed: f64,
    /// Features of the region that the mesh does not keep, the deepest first: where its surface is farther than an eighth of a
    /// tetrahedron's size from the boundary.
    pub lost: Vec<LostFeatureReport>,
    /// Share of the region that no tetrahedron covers.
    pub uncovered: f64,
    /// Greatest depth of such a point below the region's surface, mm.
    pub uncovered_depth: f64,
    /// Position of that point, mm.
    pub uncovered_at: [f64; 3],
    /// Volume left out where the boundary would meet itself, and of fragments, mm³.
    pub mended: f64,
}

/// Distances from one surface to another, by samples an eighth of a tetrahedron's size apart, mm.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct DistanceReport {
    /// Mean.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
    /// Position of the maximum, mm.
    pub at: [f64; 3],
}

/// A feature of a region that a mesh does not keep.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct LostFeatureReport {
    /// Filled: hole, slot, recess; left out: wall, pin, block.
    pub kind: &'static str,
    /// Where it is farthest from the boundary of the mesh, mm.
    pub at: [f64; 3],
    /// Its width, mm: of a hole or pin the diameter, of a slot or wall the distance between its faces, else the depth.
    pub size: f64,
    /// The greatest distance from the boundary of the mesh, mm.
    pub depth: f64,
}

impl From<&MadeLayers> for LayersMade {
    fn from(m: &MadeLayers) -> Self {
        LayersMade { prisms: m.prisms, mean: m.mean, lower: m.lower, least: m.least, at: m.at }
    }
}

impl From<&Walls> for WallSpread {
    fn from(w: &Walls) -> Self {
        let Walls { min, low, mean, high, max, merged, through } = *w;
        WallSpread { min, low, mean, high, max, merged, through }
    }
}

impl From<Spread> for MinMeanMax {
    fn from(s: Spread) -> Self {
        MinMeanMax { min: s.min, mean: s.mean, max: s.max }
    }
}

impl From<&Dihedral> for DihedralReport {
    fn from(d: &Dihedral) -> Self {
        DihedralReport {
            min: d.min,
            max: d.max,
            min_p05: d.min_p05,
            min_p50: d.min_p50,
            max_p50: d.max_p50,
            max_p95: d.max_p95,
            histogram: d.histogram.clone(),
        }
    }
}

impl From<&Quality> for TetQualityReport {
    fn from(q: &Quality) -> Self {
        TetQualityReport {
            tets: q.tets,
            nodes: q.nodes,
            boundary_triangles: q.boundary_triangles,
            pieces: q.pieces,
            bounds: q.bounds,
            volume: q.volume,
            edge: q.edge.into(),
            size: q.size.into(),
            dihedral: (&q.dihedral).into(),
            aspect: q.aspect.into(),
            slivers: q.slivers,
            inverted: q.inverted,
        }
    }
}

impl From<Distances> for DistanceReport {
    fn from(d: Distances) -> Self {
        DistanceReport { mean: d.mean, p95: d.p95, p99: d.p99, max: d.max, at: d.at }
    }
}

impl From<&LostFeature> for LostFeatureReport {
    fn from(f: &LostFeature) -> Self {
        LostFeatureReport { kind: f.kind.word(), at: f.at, size: f.size, depth: f.depth }
    }
}

impl From<&Fit> for FitReport {
    fn from(f: &Fit) -> Self {
        FitReport {
            to_part: f.to_part.into(),
            from_part: f.from_part.into(),
            gained: f.gained,
            missed: f.missed,
            lost: f.lost.iter().map(LostFeatureReport::from).collect(),
            uncovered: f.uncovered.share,
            uncovered_depth: f.uncovered.depth,
            uncovered_at: f.uncovered.at,
            mended: f.mended,
        }
    }
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
    pub creases: Option<Creases>,
}

/// What the net on a part's surface covers.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct NetReport {
    /// Number of ports where it is.
    pub ports: usize,
    /// Number of those that no rod reaches.
    pub untied: usize,
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

/// Wall thickness over a tetrahedral mesh, along normals of the mid-surface and weighted by its area, mm.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct WallSpread {
    /// Minimum of some thousand.
    pub min: f64,
    /// 5th percentile.
    pub low: f64,
    /// Mean: volume of walls over area of their mid-surface.
    pub mean: f64,
    /// 95th percentile.
    pub high: f64,
    /// Maximum of some thousand.
    pub max: f64,
    /// Share of the mid-surface from which a wall runs into the next one before it ends.
    pub merged: f64,
    /// Mean length of the solid along normals, to where it ends: more than the mean wall where walls run into each other.
    pub through: f64,
}

/// Angles between walls at the faces of tetrahedra, degrees.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Creases {
    /// Mean along all traces, before smoothing by overlap.
    pub mean: f64,
    /// Maximum, before smoothing by overlap.
    pub max: f64,
    /// Maximum after smoothing by overlap, at sampled points of the faces; None without overlap.
    pub smoothed: Option<f64>,
}
