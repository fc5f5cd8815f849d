//! Sections: what lies beyond a plane is left out, and the solid that the plane cuts is seen in it.

use super::Camera;
use crate::math::{Vec3, add, dot, scale, sub};
use crate::mesh::Mesh;

/// A plane; what lies where `normal` · p > `offset` is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// A unit vector.
    pub normal: Vec3,
    /// Distance from the origin along the normal (mm).
    pub offset: f64,
}

impl Section {
    /// Height of a point above the plane (mm).
    pub(super) fn height(&self, p: Vec3) -> f64 {
        dot(self.normal, p) - self.offset
    }

    /// The vertices of a mesh that are kept, and the points where the plane cuts its edges; all vertices if the plane leaves out all.
    pub(super) fn kept(&self, mesh: &Mesh) -> Vec<Vec3> {
        let heights: Vec<f64> = mesh.vertices.iter().map(|p| self.height(*p)).collect();
        let mut kept: Vec<Vec3> =
            mesh.vertices.iter().zip(&heights).filter(|(_, h)| **h <= 0.0).map(|(p, _)| *p).collect();
        for t in &mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| (a as usize, b as usize)) {
                // Each edge of a closed surface is passed both ways.
                if heights[a] <= 0.0 && heights[b] > 0.0 {
                    let share = heights[a] / (heights[a] - heights[b]);
                    let (p, q) = (mesh.vertices[a], mesh.vertices[b]);
                    kept.push(add(p, scale(sub(q, p), share)));
                }
            }
        }
        if kept.is_empty() { mesh.vertices.clone() } else { kept }
    }
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
        SeenSection { of: [constant, across, down, section.height(eye)] }
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
