//! Where the periodic solid is one piece in R³.
use super::Part;
use crate::math::Vec3;

/// How a part's connectivity changes with its level.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    /// Intervals of the level, as amounts of solid grow, in which the periodic solid is one piece in R³:
    /// [from, to] in iso (for `Upper` from ≥ to).
    pub intervals: Vec<[f64; 2]>,
    /// Saddles by which separate pieces, or a piece and its lattice translate, join: (phase in turns, level).
    pub necks: Vec<(Vec3, f64)>,
}

/// Analyses the part of the cell function `f` (values and gradients per turn at phases).
pub fn connectivity(
    f: &(dyn Fn(&[Vec3], &mut [f64], &mut [Vec3]) + Sync),
    part: Part,
) -> Connectivity {
    let _ = (f, part);
    todo!()
}
