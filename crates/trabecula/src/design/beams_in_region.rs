//! Beams in their region: whether all of them lie in it, whether they are all there is, and their share of it.

use rayon::prelude::*;

use super::{Built, sample};
use crate::environment::Environment;
use crate::field::Field;
use crate::kind::DesignError;
use crate::truss::Beams;
use ::beams::pattern::PatternField;
use ::beams::quador::Quadors;
use geometry::math::{Vec3, norm};

/// Whether all beams lie in a region.
pub(super) fn whole(quadors: &Quadors, region: &dyn Field) -> bool {
    // A hub and its stubs lie within a box, and that within a ball.
    (0..quadors.len()).into_par_iter().all(|i| {
        let b = quadors.hub_bounds(i);
        region.bound(&b).hi <= 0.0 || region.value(b.center()) + 0.5 * norm(b.size()) <= 0.0
    })
}

/// Refuses beams that leave the region empty or fill it.
pub(super) fn check_open(field: &dyn Field, environment: &Environment) -> Result<(), DesignError> {
    let share = |points: &[Vec3]| {
        let mut values = vec![0.0; points.len()];
        field.values(points, &mut values);
        values.iter().filter(|v| **v <= 0.0).count() as f64 / points.len().max(1) as f64
    };
    let mixed = |v: f64| v > 0.0 && v < 1.0;
    if mixed(share(environment.points)) {
        return Ok(());
    }
    match share(&sample::inside(environment.region, 10 * sample::COUNT).0) {
        v if v >= 1.0 => Err(DesignError::new(
            format!("{}.radius", environment.path),
            "the beams are so thick that the region is solid everywhere: nothing is open",
        )),
        // All samples may miss a few thin beams.
        _ => Ok(()),
    }
}

/// Whether a design is one graph of beams and nothing else.
pub(super) fn lone(built: &Built) -> bool {
    built.beams.len() == 1 && built.lattices.is_empty() && built.tilings.is_empty() && built.solid.filled.is_empty()
}

/// Whether all beams lie in the region: of a large pattern, by the box that holds it.
pub(super) fn held(beams: &Beams, built: &Built) -> bool {
    match beams {
        Beams::Truss(truss) => truss.whole,
        Beams::Pattern(laid) => inside(laid, built),
    }
}

/// As `held`, for a pattern.
pub(super) fn inside(laid: &PatternField, built: &Built) -> bool {
    let region = &*built.solid.region;
    region.bound(&laid.bounds()).hi <= 0.0 || laid.expanded_if_small().is_some_and(|all| whole(&all, region))
}

/// The solid share of the region, and whether it is exact: where beams of that volume are all there is, and the region's volume is known.
pub(super) fn share(
    volume: Option<f64>,
    whole: bool,
    built: &Built,
    sampled: &dyn core::ops::Deref<Target = f64>,
) -> (f64, bool) {
    match (volume, built.solid.region.volume()) {
        (Some(solid), Some(region)) if whole && lone(built) => (solid / region, true),
        _ => (**sampled, false),
    }
}
