//! Beams, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{GradeSpec, MapSpec, is_default, is_one, one};
use crate::design::schema;

/// Named graphs of beams.
pub type BeamsSpecs = BTreeMap<String, BeamsSpec>;

/// A graph of beams: a unit cell on a map, or nodes and struts of your own.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamsSpec {
    /// A ready unit cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(schema_with = "schema::beam_cell")]
    pub cell: Option<String>,
    /// Where the cells lie: nodes are carried, beams stay straight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<MapSpec>,
    /// Nodes of your own, instead of a cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nodes: Option<NodesSpec>,
    /// The nodes that each beam joins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub struts: Option<StrutsSpec>,
    /// A program of repeats, instead of a cell or a graph.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternSpec>,
    /// Radius of a beam at mid length (mm), taken there. It may be left out where all hubs have radii.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<GradeSpec>,
    /// Radius of the balls in which beams meet (mm), taken at their centres; the largest radius of the beams that meet
    /// there unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hub: Option<GradeSpec>,
    /// Which of the quadrics of revolution tangent to both balls a beam is; the one with the radius at mid length unless
    /// given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfileSpec>,
    /// How beams are rounded into one another.
    #[serde(default, skip_serializing_if = "is_default")]
    pub fillet: FilletSpec,
    /// What becomes of beams that leave the region.
    #[serde(default, skip_serializing_if = "is_default")]
    pub trim: TrimSpec,
    /// What becomes of beams with a free end inside the region.
    #[serde(default, skip_serializing_if = "is_default")]
    pub dangling: DanglingSpec,
    /// Nodes so near to each other (mm) are one; a millionth of the mean beam's length unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub merge: Option<f64>,
}

/// Nodes in a file or in the design.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum NodesSpec {
    /// Path of a table (csv) of id, x, y, z (mm) and perhaps a hub's radius (mm), relative to the design file.
    Path(String),
    /// Rows of x, y, z (mm) and perhaps a hub's radius (mm); their ids are 0, 1, 2 …
    Rows(Vec<RowSpec>),
}

/// A node: x, y, z (mm) and perhaps a radius (mm).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum RowSpec {
    /// x, y, z.
    Place([f64; 3]),
    /// x, y, z, radius.
    Ball([f64; 4]),
}

/// Struts in a file or in the design.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum StrutsSpec {
    /// Path of a table (csv) of pairs of node ids, relative to the design file.
    Path(String),
    /// Pairs of node ids, whole numbers from 0.
    Rows(Vec<[u32; 2]>),
}

/// A graph that is repeated by up to three steps: what is at [i, j, k] is the first step done i times, then the second j
/// times, then the third k times. It is not written out, however often it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatternSpec {
    /// Rows of x, y, z (mm) and perhaps a hub's radius (mm), at [0, 0, 0]; their ids are 0, 1, 2 …
    pub nodes: Vec<RowSpec>,
    /// Rows of two ids and how many repeats on, along each step, the second node lies (0 unless given).
    #[schemars(schema_with = "schema::pattern_struts")]
    pub struts: Vec<[i32; 5]>,
    /// One to three steps.
    #[schemars(length(min = 1, max = 3))]
    pub repeat: Vec<RepeatSpec>,
}

/// A step of a pattern: scaled and turned about a point, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepeatSpec {
    /// How often what is repeated is there, the original counted.
    pub count: f64,
    /// By how much each is moved from the last (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub by: [f64; 3],
    /// Angles about x, y, z (degrees): z is turned first, then y, then x.
    #[serde(default, skip_serializing_if = "is_default")]
    pub rotate: [f64; 3],
    /// How many times as large each is as the last.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// The point about which it is turned and scaled (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub about: [f64; 3],
}

/// Which quadric a beam is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ProfileSpec {
    /// The cone: what covers both balls most tightly.
    Cone,
    /// The cylinder; hubs must be equal.
    Cylinder,
    /// The hyperboloid whose thinnest place has this radius (mm).
    Waist(f64),
    /// By the parameter of the pencil of quadrics: 1 for a cylinder or paraboloid, less for a barrel, more for a waist.
    Lambda(f64),
}

/// How beams are rounded into one another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FilletSpec {
    /// Not: they meet in creases.
    #[default]
    None,
    /// The largest that each hub allows.
    Auto,
    /// With this radius (mm) in the tightest place; where it cannot be had, with the largest that can, and a warning.
    Radius(f64),
    /// By τ, from 0 up to 1, exclusive: nearly 1 is a small fillet.
    Tau(f64),
    /// By α, above 0 and up to ½: a larger one is a larger fillet; τ = (1 − 4α²)/(1 + 4α²).
    Alpha(f64),
    /// By β = 1/(4α), from ½ on: a larger one is a smaller fillet.
    Beta(f64),
}

/// What becomes of beams that leave the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TrimSpec {
    /// They are cut by the region's surface.
    #[default]
    Cut,
    /// They are left out.
    Drop,
    /// They end on the surface.
    Snap,
}

/// What becomes of beams with a free end inside the region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum DanglingSpec {
    /// They stay, with a warning.
    #[default]
    Keep,
    /// They are left out, one after the other.
    Drop,
}
