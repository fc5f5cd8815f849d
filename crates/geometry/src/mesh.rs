//! Triangle meshes: indexed, in f64, counter-clockwise seen from outside.

use crate::math::{Aabb, Vec3, cross, dot, norm, sub};
use crate::weld::PointHash;

pub(crate) mod edges;
mod embedded;
pub mod exact;
pub mod samples;
mod self_intersections;
pub mod surface_samples;

pub use edges::EdgeCounts;
pub use embedded::is_embedded;
pub use self_intersections::{meet, near_pairs, self_intersections};

/// An indexed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, mm.
    pub vertices: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The box from `min` to `max` of twelve triangles.
    pub fn cuboid(min: Vec3, max: Vec3) -> Mesh {
        let corner = |i: usize| core::array::from_fn(|a| if i >> a & 1 == 1 { max[a] } else { min[a] });
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Mesh {
            vertices: (0..8).map(corner).collect(),
            triangles: quads.iter().flat_map(|q: &[u32; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
        }
    }

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
        self.triangles.iter().flatten().fold(Aabb::EMPTY, |b, &v| b.with(self.vertices[v as usize]))
    }

    /// The rounding that single precision gives coordinates of this size, mm: what a file of `f32` leaves between
    /// two readings of one point.
    pub fn single_rounding(&self) -> f64 {
        let b = self.bounds();
        let largest = b.min.iter().chain(&b.max).fold(0.0f64, |m, x| m.max(x.abs()));
        largest * f64::from(f32::EPSILON)
    }

    /// The mesh with vertices merged that differ by no more than the rounding of single precision, if it has open edges that
    /// this closes: files that store triangles by the positions of their corners, as STL does, leave such edges.
    ///
    /// Coordinates must be finite. Time and memory are linear in the mesh.
    pub fn joined_where_open(self) -> Mesh {
        let open = EdgeCounts::count(&self).open;
        if open == 0 {
            return self;
        }
        let joined = self.joined(self.single_rounding());
        if EdgeCounts::count(&joined).open < open { joined } else { self }
    }

    /// The mesh with vertices closer than `tolerance` (mm) merged, without the triangles that collapse.
    ///
    /// A vertex is merged into the first kept one within the tolerance, in order. Coordinates must be finite; a tolerance that
    /// is not above zero merges nothing.
    pub fn joined(&self, tolerance: f64) -> Mesh {
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return self.clone();
        }
        let mut kept = PointHash::new(tolerance);
        let mut vertices: Vec<Vec3> = Vec::with_capacity(self.vertices.len());
        let mut to = Vec::with_capacity(self.vertices.len());
        for &p in &self.vertices {
            let mut first = vertices.len() as u32;
            kept.near(p, |v| {
                if v < first && norm(sub(vertices[v as usize], p)) <= tolerance {
                    first = v;
                }
            });
            if first as usize == vertices.len() {
                kept.insert(p, first);
                vertices.push(p);
            }
            to.push(first);
        }
        let moved = self.triangles.iter().map(|t| t.map(|v| to[v as usize]));
        let triangles = moved.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        Mesh { vertices, triangles }
    }
}

/// Whether triangle `i` has two equal vertices or exactly no area.
pub fn degenerate(mesh: &Mesh, i: usize) -> bool {
    let [a, b, c] = mesh.corners(i);
    exact::plane_axis(a, b, c).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn close_vertices_join_and_thin_triangles_go() {
        let mesh = Mesh {
            vertices: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-1e-9, 1e-9, -1e-9],
                [1.0, 1.0, 0.0],
                [1.0 + 1e-6, 0.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [3, 2, 4], [0, 3, 1], [5, 4, 2]],
        };
        let joined = mesh.joined(1e-8);
        assert_eq!(joined.triangles, [[0, 1, 2], [0, 2, 3], [4, 3, 2]]);
        assert_eq!(joined.vertices.len(), 5);
        assert_eq!(mesh.joined(1e-5).vertices.len(), 4);
        assert_eq!(mesh.joined(0.0), mesh);
        assert!((mesh.single_rounding() - 1.000001 * 2f64.powi(-23)).abs() < 1e-20);
    }
}
