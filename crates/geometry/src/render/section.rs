//! Sections: what lies beyond a plane is left out, and the solid that the plane cuts is seen in it.

use super::{Camera, Projection};
use crate::math::{Aabb, Vec3, add, dot, norm, scale, sub};
use crate::mesh::Mesh;

/// A plane; what lies where `normal` · p > `offset` is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// A unit vector.
    pub normal: Vec3,
    /// Distance from the origin along the normal (mm).
    pub offset: f64,
}

impl SectionPlane {
    /// Height of a point above the plane (mm).
    pub(super) fn height(&self, p: Vec3) -> f64 {
        dot(self.normal, p) - self.offset
    }

    /// The plane a hair before: by 1/100 000 of the diagonal of these bounds, which no picture shows, but more than the rounding of depths.
    /// A face that lies in the plane is then cut as a whole, where it would be in part.
    pub(super) fn before_faces(&self, bounds: &Aabb) -> SectionPlane {
        SectionPlane { offset: self.offset - 1e-5 * norm(bounds.size()), ..*self }
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

/// Points in a plane: rows of a grid, one after another.
#[derive(Clone, Debug)]
pub struct PlaneGrid {
    /// The first point (mm).
    pub origin: Vec3,
    /// From a point to the next of its row, and to that of the next row (mm); orthogonal.
    pub steps: [Vec3; 2],
    /// Points of a row, and rows.
    pub counts: [usize; 2],
}

impl PlaneGrid {
    /// The four points about a place, by number, and their weights; beyond the grid those of its border.
    pub(super) fn weights(&self, p: Vec3) -> [(usize, f64); 4] {
        let off = sub(p, self.origin);
        let [(i, s), (j, t)] = [0, 1].map(|k| {
            let step = self.steps[k];
            let place = dot(off, step) / dot(step, step);
            let last = self.counts[k].saturating_sub(1) as f64;
            let place = if place.is_finite() { place.clamp(0.0, last) } else { 0.0 };
            let first = place.floor().min((last - 1.0).max(0.0));
            (first as usize, place - first)
        });
        let at = |i: usize, j: usize| {
            j.min(self.counts[1].saturating_sub(1)) * self.counts[0] + i.min(self.counts[0].saturating_sub(1))
        };
        [
            (at(i, j), (1.0 - s) * (1.0 - t)),
            (at(i + 1, j), s * (1.0 - t)),
            (at(i, j + 1), (1.0 - s) * t),
            (at(i + 1, j + 1), s * t),
        ]
    }
}

/// A section as a camera sees it. The height above the plane, by a lens times the inverse distance, is affine in column, row and depth; `of`
/// has its coefficients, the constant first.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenSection {
    of: [f64; 4],
}

impl SeenSection {
    pub(super) fn new(section: &SectionPlane, camera: &Camera) -> SeenSection {
        let [right, up, out] = camera.axes.map(|a| dot(section.normal, a));
        let (across, down) = (right / camera.focal, -up / camera.focal);
        let constant = -out - across * camera.middle[0] - down * camera.middle[1];
        let d = camera.distance;
        let of = match camera.projection {
            Projection::Perspective => {
                [constant, across, down, section.height(add(camera.center, scale(camera.axes[2], d)))]
            }
            Projection::Orthographic => {
                [section.height(camera.center) + d * constant, d * across, d * down, d * d * out]
            }
        };
        SeenSection { of }
    }

    /// Whether the section leaves out the point behind a sample.
    #[inline]
    pub(super) fn removes(&self, x: f64, y: f64, near: f32) -> bool {
        let [a, b, c, d] = self.of;
        a + b * x + c * y + d * f64::from(near) > 0.0
    }

    /// Whether the eye is in front of the plane, where it sees what is cut.
    pub(super) fn faces_the_eye(&self) -> bool {
        self.of[3] > 0.0
    }

    /// The depth of the plane behind a sample, if the eye is in front of it.
    pub(super) fn near(&self, x: f64, y: f64) -> Option<f32> {
        let [a, b, c, d] = self.of;
        self.faces_the_eye().then(|| (-(a + b * x + c * y) / d) as f32)
    }
}
