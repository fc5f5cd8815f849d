//! Grades, as data.

use schemars::JsonSchema;
use serde::Serialize;

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
