//! A solution of phases, and the target it was found for.

use super::integral::EdgeWeights;
use super::periods::Period;
use super::phase_target::Target;
use super::solution::Solution;
use super::solution_quality::SolutionQuality;
use geometry::math::Mat3;

/// A solution, and what it was found for.
pub(super) struct Candidate {
    pub target: Target,
    /// What errors count.
    pub weights: EdgeWeights,
    pub solution: Solution,
    pub periods: Vec<Period>,
    /// The mean of the rows of K.
    pub mean: Mat3,
    pub steps: usize,
    pub quality: SolutionQuality,
}
