//! A frame about an axis.

use geometry::math::{Vec3, dot, scale, sub, unit};

/// A unit vector perpendicular to an axis, the same for an axis and its opposite. It is discontinuous only away from
/// common directions, so that beams that are equal up to rounding have it in common.
pub(super) fn perpendicular(axis: Vec3) -> Vec3 {
    let pole = if axis[0].abs() < 0.618_034 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    unit(sub(pole, scale(axis, dot(pole, axis))))
}
