//! Triangle meshes: indexed, in f64, counter-clockwise seen from outside.

use crate::math::{Aabb, Vec3, cross, dot, norm, sub};

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, mm.
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The corners of triangle `i`.
    #[inline]
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.vertices[v as usize])
    }

    /// Enclosed volume, mm³: Σ a·(b × c)/6 about the middle of the bounds (positive when oriented outwards).
    pub fn volume(&self) -> f64 {
        if self.triangles.is_empty() {
            return 0.0;
        }
        let o = self.bounds().center();
        let six: f64 = (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i).map(|p| sub(p, o));
                dot(a, cross(b, c))
            })
            .sum();
        six / 6.0
    }

    /// Surface area, mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                norm(cross(sub(b, a), sub(c, a))) / 2.0
            })
            .sum()
    }

    /// Bounds of the vertices that triangles use.
    pub fn bounds(&self) -> Aabb {
        self.triangles
            .iter()
            .flatten()
            .fold(Aabb::EMPTY, |b, &v| b.with(self.vertices[v as usize]))
    }
}
