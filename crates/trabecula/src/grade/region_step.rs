//! A smooth step across the surface of a region.

use super::{BuildGrade, Depth, Grade, Quantity, Remapped, Sigmoid, Stops};
use crate::kind::{DesignError, Kind};
use crate::region::{Region, RegionKind};
use geometry::fault::{Fault, number};

/// 1 inside a region and 0 outside, with a smooth step at its surface.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Within", noun = "a region as a number")]
pub struct WithinKind {
    /// The region.
    of: Box<RegionKind>,
    /// Width of the step, half of it on either side of the surface.
    #[kind(unit = "mm", above = 0.0)]
    width: f64,
    /// The values that the numbers map to: pairs [number, value], number rising, linear between: [[0, outside], [1, inside]].
    remap: Option<Stops>,
}

impl BuildGrade for WithinKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        let region = of.environment.region(&self.of, &format!("{}.of", of.path))?;
        let step = region_step(region, self.width);
        let Some(stops) = &self.remap else { return of.function(step) };
        let step = step.map_err(|f| DesignError::fault(&of.path, f))?;
        of.checked(Remapped::new(step, of.stops(stops.clone())))
    }
}

/// The smooth step from 0 outside a region to 1 inside, one half on its surface, over `width` (mm) across it.
///
/// # Errors
/// A width that is not a finite length greater than 0.
pub fn region_step(region: Region, width: f64) -> Result<Sigmoid, Fault> {
    if !(width > 0.0 && width.is_finite()) {
        let message = format!("width is {} mm; it must be a finite length greater than 0", number(width));
        return Err(Fault::new("width", message));
    }
    // The depth itself, where it matters.
    let depth = Depth::new(region, vec![[-width, -width], [width, width]])?;
    Sigmoid::new(Grade::from(depth), 0.0, width)
}
