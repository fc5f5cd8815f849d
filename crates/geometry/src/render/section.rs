//! Sections: what lies beyond a plane is left out, and the solid that the plane cuts is seen in it.

use super::Camera;
use crate::math::{Vec3, add, dot, scale};

/// A plane; what lies where `normal` · p > `offset` is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// A unit vector.
    pub normal: Vec3,
    /// Distance from the origin along the normal (mm).
    pub offset: f64,
}

/// A section as a camera sees it. The inverse distance times the height above the plane is affine in column, row and inverse
/// distance; `of` has its coefficients, the constant first.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenSection {
    of: [f64; 4],
}

impl SeenSection {
    pub(super) fn new(section: &Section, camera: &Camera) -> SeenSection {
        let [right, up, out] = camera.axes.map(|a| dot(section.normal, a));
        let eye = add(camera.center, scale(camera.axes[2], camera.distance));
        let (across, down) = (right / camera.focal, -up / camera.focal);
        let constant = -out - across * camera.middle[0] - down * camera.middle[1];
        SeenSection { of: [constant, across, down, dot(section.normal, eye) - section.offset] }
    }

    /// Whether the section leaves out the point behind a sample.
    #[inline]
    pub(super) fn removes(&self, x: f64, y: f64, near: f32) -> bool {
        let [a, b, c, d] = self.of;
        a + b * x + c * y + d * f64::from(near) > 0.0
    }

    /// The inverse distance of the plane behind a sample, if the eye is in front of it.
    pub(super) fn near(&self, x: f64, y: f64) -> Option<f32> {
        let [a, b, c, d] = self.of;
        (d > 0.0).then(|| (-(a + b * x + c * y) / d) as f32)
    }
}
