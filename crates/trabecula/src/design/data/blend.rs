//! Blends, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::{GradeSpec, is_default};

/// Several lattices in one part: which of them is where.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlendSpec {
    /// The lattices and their weights.
    #[serde(flatten)]
    pub lattices: BlendKind,
    /// What the blend keeps where it passes from one lattice to another.
    #[serde(default, skip_serializing_if = "is_default")]
    pub by: BySpec,
}

/// The lattices of a blend: two and one weight, or any number with a weight each.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum BlendKind {
    /// Two.
    Between(BetweenSpec),
    /// Any number.
    Of(OfSpec),
}

/// Two lattices.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct BetweenSpec {
    /// Their names.
    pub between: [String; 2],
    /// How much the second counts, from 0 to 1; what is below or above counts as 0 or 1.
    pub weight: GradeSpec,
}

/// Any number of lattices.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OfSpec {
    /// How much each counts, by name; divided by their sum. What is below 0 counts as 0.
    #[schemars(extend("minProperties" = 2))]
    pub of: BTreeMap<String, GradeSpec>,
}

/// What a blend keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BySpec {
    /// The solid fractions: each lattice's own where it is alone, their weighted mean between.
    #[default]
    Fraction,
    /// The weighted sum of the fields as it comes; material is lost half-way.
    Value,
}
