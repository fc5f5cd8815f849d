//! What a solved map is asked for, and how it is solved for.

use super::cube_rotations::cube;
use super::frame::Orientation;
use super::singular_core::CoreOptions;
use super::singular_lines::FrameEquivalence;
use super::stretch::Stretch;
use super::surface_frames::Aligned;
use crate::field::Field;
use crate::grade::Grade;
use crate::region::Region;
use geometry::fault::{Fault, number};
use geometry::math::{Mat3, Vec3, dot};

/// Least ratio of what angle and spacing count, and the inverse of the greatest: conjugate gradients take its root of steps.
const LEAST_RATIO: f64 = 0.001;
/// The target of a map.
#[derive(Clone)]
pub struct PhaseRequest {
    /// Cell edges (mm) along the cell's axes, or the principal directions of a stress.
    pub wavelength: [Grade; 3],
    /// Whether they are those along the principal directions of a stress, the greatest value's first.
    pub by_principal: bool,
    /// Orientation of the cells.
    pub orientation: Orientation,
    /// Relative weight of the map's error; the same everywhere if none.
    pub weight: Option<Grade>,
    /// What an error of angle counts, for the same error of spacing (squares of the parts of ∇Φ − K across and along K); 1 if
    /// both count alike.
    pub angle_weight: f64,
    /// The length over which directions, frames and stresses are smoothed, mm.
    pub smooth: Option<f64>,
    /// Alignment of an axis of the cells with the region's surface, within a depth.
    pub align: Option<Aligned>,
    /// The range in which cells may be stretched; any if none.
    pub stretch: Option<Stretch>,
    /// Regions on whose parts of the surface the phase along the normal is a whole number.
    pub fix: Vec<Region>,
    /// Moves the lattice (mm).
    pub offset: Vec3,
    /// How singular lines are covered, if they are.
    pub core: Option<CoreOptions>,
}

impl PhaseRequest {
    /// Cells of these edges (mm) along their axes, turned so, and nothing else.
    pub fn new(wavelength: [Grade; 3], orientation: Orientation) -> PhaseRequest {
        PhaseRequest {
            wavelength,
            by_principal: false,
            orientation,
            weight: None,
            angle_weight: 1.0,
            smooth: None,
            align: None,
            stretch: None,
            fix: Vec::new(),
            offset: [0.0; 3],
            core: None,
        }
    }

    /// The length over which frames are averaged, mm, if they are.
    pub(super) fn averaged(&self) -> Option<f64> {
        self.align.map(|a| a.length(self.smooth)).or(self.smooth)
    }

    /// What moves phases whose target has a mean.
    pub(super) fn shift(&self, mean: &Mat3) -> Vec3 {
        mean.map(|m| -dot(m, self.offset))
    }

    /// What counts as the same axes.
    pub(super) fn alike(&self) -> FrameEquivalence {
        if self.align.is_some() { FrameEquivalence::Turned(cube()) } else { self.orientation.alike() }
    }

    /// What an error of angle counts, if it is in its range.
    pub(super) fn ratio(&self) -> Result<f64, Fault> {
        let ratio = self.angle_weight;
        if !(LEAST_RATIO..=1.0 / LEAST_RATIO).contains(&ratio) {
            let message = format!(
                "{}; an angle counts from {LEAST_RATIO} to {} times as much as a spacing",
                number(ratio),
                number(1.0 / LEAST_RATIO)
            );
            return Err(Fault::new("angle_weight", message));
        }
        Ok(ratio)
    }
}

/// How a map is solved for.
#[derive(Clone, Copy, Default)]
pub struct SolverOptions<'a> {
    /// Spacing of the grid (mm); chosen if not given.
    pub step: Option<f64>,
    /// Signed distance of the region that counts; all of the box if none.
    pub region: Option<&'a dyn Field>,
    /// Whether the map may fold (det J ≤ 0).
    pub folds: bool,
}
