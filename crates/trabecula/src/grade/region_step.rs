//! A smooth step across the surface of a region.

use std::sync::Arc;

use super::{Depth, Grade, Sigmoid};
use crate::field::Field;
use geometry::fault::{Fault, number};

/// The smooth step from 0 outside a region to 1 inside, one half on its surface, over `width` (mm) across it. `region` is a
/// signed distance (mm, negative inside).
///
/// # Errors
/// A width that is not a finite length greater than 0.
pub fn region_step(region: Arc<dyn Field>, width: f64) -> Result<Sigmoid, Fault> {
    if !(width > 0.0 && width.is_finite()) {
        let message = format!("width is {} mm; it must be a finite length greater than 0", number(width));
        return Err(Fault::new("width", message));
    }
    // The depth itself, where it matters.
    let depth = Depth::new(region, vec![[-width, -width], [width, width]])?;
    Sigmoid::new(Grade::from(depth), 0.0, width)
}
