//! Blends, as data.

use std::collections::BTreeMap;

use super::GradeSpec;
use crate::blend::BlendRule;
use crate::kind::{Fault, Key, Kind};

/// Several lattices in one part: which of them is where.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Blend", noun = "a blend")]
pub struct BlendSpec {
    /// The lattices and their weights.
    #[kind(flatten)]
    pub lattices: BlendKind,
    /// What the blend keeps between one lattice and another.
    #[kind(default)]
    pub by: BlendRule,
}

/// The lattices of a blend: two and one weight, or any number with a weight each.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(noun = "a blend", alternatives)]
pub enum BlendKind {
    /// Two.
    Between(BetweenSpec),
    /// Any number.
    Of(WeightsSpec),
}

/// Two lattices.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(check = BetweenSpec::different)]
pub struct BetweenSpec {
    /// The names of two lattices.
    pub between: [String; 2],
    /// Weight of the second, from 0 to 1; what is below or above counts as 0 or 1.
    pub weight: GradeSpec,
}

impl BetweenSpec {
    fn different(&self, _: &Key) -> Result<(), Fault> {
        let [a, b] = &self.between;
        match a == b {
            true => Err(Fault::new("between[1]", format!("\"{b}\" is named twice; a blend is between two lattices"))),
            false => Ok(()),
        }
    }
}

/// Any number of lattices.
#[derive(Clone, Debug, PartialEq, Kind)]
pub struct WeightsSpec {
    /// Weight of each lattice, by name; divided by their sum. What is below 0 counts as 0.
    #[kind(least = 2)]
    pub of: BTreeMap<String, GradeSpec>,
}
