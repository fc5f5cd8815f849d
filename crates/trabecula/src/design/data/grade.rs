//! Grades, as data.

use schemars::JsonSchema;
use serde::Serialize;

use super::{OneOrThree, RegionKind, is_default};

/// A number that may vary in space.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum GradeSpec {
    /// The same everywhere.
    Constant(f64),
    /// Varying.
    Kind(GradeKind),
}

/// How a number varies.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GradeKind {
    /// Along a direction.
    Linear(LinearSpec),
    /// By depth (mm) below the region's surface.
    Depth(DepthSpec),
    /// A formula in x, y, z (mm), such as "0.3 + 0.1*sin(x/5)".
    Formula(String),
    /// By the distance (mm) from a point or a line.
    Radial(RadialSpec),
    /// Numbers on a grid, from a file.
    Grid(GridSpec),
    /// Numbers at scattered points, from a file.
    Points(PointsSpec),
    /// An array of a result on a mesh, from a file.
    Field(FieldSpec),
    /// A smooth step of another number.
    Sigmoid(SigmoidSpec),
    /// 1 inside a region and 0 outside, with a smooth step at its surface.
    Region(WithinSpec),
    /// Distance (mm) to a line of control points.
    Distance(DistanceSpec),
    /// Gaussian radial basis functions through control points.
    Rbf(RbfSpec),
}

/// A smooth step from 0 to 1: the logistic function, with ends.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SigmoidSpec {
    /// The number that it is a step of.
    pub of: Box<GradeSpec>,
    /// Where it is one half.
    #[serde(default, skip_serializing_if = "is_default")]
    pub at: f64,
    /// From where it is 0 to where it is 1, in the unit of the number; a negative width falls.
    pub width: f64,
}

/// 1 inside a region and 0 outside.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WithinSpec {
    /// The region.
    pub of: Box<RegionKind>,
    /// Width of the step (mm), half of it on either side of the surface.
    pub width: f64,
}

/// Distance to a chain of straight segments.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceSpec {
    /// The corners of the line (mm), in order.
    #[serde(flatten)]
    pub points: ControlSpec,
    /// Whether the last is joined to the first.
    #[serde(default, skip_serializing_if = "is_default")]
    pub closed: bool,
    /// Direction along which all is seen: the distance is that from a wall through the line. Inside a closed one it is
    /// negative.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// The smooth form instead of the exact distance: at least 10; it is off by at most 0.2785/sharpness of the longest
    /// segment, and has no sign.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sharpness: Option<f64>,
}

/// Gaussian radial basis functions: the sum of β exp(−r²/δ²) over control points.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RbfSpec {
    /// The control points (mm).
    #[serde(flatten)]
    pub points: ControlSpec,
    /// The values that are taken at them: 1 at all unless given here or as a fourth column of the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<f64>>,
    /// δ, mm; unless given one and a half times the mean distance of a point from its nearest neighbour.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delta: Option<f64>,
    /// Direction along which all is seen, so that a point stands for a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
}

/// Control points: here, or in a file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ControlSpec {
    /// [x, y, z] each, mm.
    Points(Vec<[f64; 3]>),
    /// Path of a table (csv) of x, y, z (mm), relative to the design file.
    Path(String),
}

/// Piecewise linear in s = along · x, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinearSpec {
    /// Direction; s is measured in multiples of its length.
    pub along: [f64; 3],
    /// (s, value), s rising.
    pub stops: Vec<[f64; 2]>,
}

/// Piecewise linear in depth, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DepthSpec {
    /// (depth in mm, value), depth rising.
    pub stops: Vec<[f64; 2]>,
}

/// Piecewise linear in the distance from a point or a line, constant beyond the ends.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RadialSpec {
    /// The point, or a point on the line (mm).
    #[serde(default, skip_serializing_if = "is_default")]
    pub center: [f64; 3],
    /// Direction of the line; without it, distances are from the point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// (distance in mm, value), distance rising.
    pub stops: Vec<[f64; 2]>,
}

/// Numbers on a grid, linear between them.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    /// Path of the file (npy, vti, vtk), relative to the design file; or of grey pictures one above the other (png, tif), where
    /// a * in the last part stands for anything: "scan/*.png". Columns run along x, rows along y, pictures along z.
    pub path: String,
    /// Name of the array, where a file has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub array: Option<String>,
    /// Place of the first number (mm), of pictures the middle of the first pixel; VTI and VTK files say it themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
    /// Distance between numbers (mm), one or three; VTI and VTK files say it themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<OneOrThree>,
    /// What the numbers stand for: (number, value), number rising, linear between.
    #[serde(default, skip_serializing_if = "is_default")]
    pub remap: Vec<[f64; 2]>,
}

/// Numbers at scattered points: between them the mean of the nearest, by one over the square of the distance.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointsSpec {
    /// Path of a table (csv) of x, y, z (mm), value, relative to the design file.
    pub path: String,
    /// How many of the nearest points count.
    #[serde(default = "eight", skip_serializing_if = "is_eight")]
    pub neighbours: f64,
    /// What the numbers stand for: (number, value), number rising, linear between.
    #[serde(default, skip_serializing_if = "is_default")]
    pub remap: Vec<[f64; 2]>,
}

/// An array of a result on a mesh of volume elements.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldSpec {
    /// Path of the file (vtu, vtk, vti), relative to the design file. Coordinates are mm.
    pub path: String,
    /// Name of the array, of points or cells.
    pub array: String,
    /// Which of its numbers, from 0, where it has several for each point or cell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub component: Option<f64>,
    /// What the numbers stand for: (number, value), number rising, linear between.
    #[serde(default, skip_serializing_if = "is_default")]
    pub remap: Vec<[f64; 2]>,
}

fn eight() -> f64 {
    8.0
}

fn is_eight(v: &f64) -> bool {
    *v == eight()
}
