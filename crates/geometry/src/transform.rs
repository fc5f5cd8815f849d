//! Affine transforms of meshes: orientation and positive volumes are kept.

use crate::fault::{Fault, number};
use crate::math::{Aabb, Mat3, Vec3, add, apply, determinant, sub};
use crate::mesh::Mesh;
use crate::surface_mesh::SurfaceMesh;
use crate::tetmesh::TetMesh;

/// The share of a mesh's greatest extent that the rounding of its coordinates may be: a mesh of a thousand positions along
/// each axis then still has a million rounds between two of them.
const ROUNDING: f64 = 1e-9;

/// The affine transform x ↦ M (x − c) + c + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// M, its determinant not zero.
    pub matrix: Mat3,
    /// The fixed point c of M, mm.
    pub center: Vec3,
    /// The translation t, mm.
    pub shift: Vec3,
}

impl Transform {
    /// Whether it reverses orientation.
    pub fn mirrors(&self) -> bool {
        determinant(&self.matrix) < 0.0
    }

    /// The images of points, rounded to f64. Refused if they are not finite, or so far from the origin that the rounding of
    /// coordinates is seen in the shape.
    fn points(&self, points: &[Vec3]) -> Result<Vec<Vec3>, Fault> {
        let to = |p: &Vec3| add(add(apply(&self.matrix, sub(*p, self.center)), self.center), self.shift);
        let made: Vec<Vec3> = points.iter().map(to).collect();
        let bounds = made.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        // What is subtracted on the way and added again is rounded, too.
        let passed = bounds.min.iter().chain(&bounds.max).chain(&self.center).chain(&self.shift);
        let reach = passed.fold(0.0f64, |m, x| m.max(x.abs()));
        let size = bounds.size().into_iter().fold(0.0f64, f64::max);
        let lost = made.iter().any(|p| p.iter().any(|x| !x.is_finite()));
        if !made.is_empty() && (lost || (size > 0.0 && f64::EPSILON * reach > ROUNDING * size)) {
            let (reach, size) = (number(reach), number(size));
            return Err(Fault::new(
                "",
                format!(
                    "the result would reach coordinates of {reach} mm at a size of {size} mm, where f64 rounds its shape; move it \
                     less, or scale it less"
                ),
            ));
        }
        Ok(made)
    }
}

impl Mesh {
    /// The image of the mesh; triangles are turned over where the transform mirrors, so that a closed mesh stays oriented
    /// outwards.
    pub fn transformed(&self, by: &Transform) -> Result<Mesh, Fault> {
        Ok(self.with_vertices(by.points(&self.vertices)?, by.mirrors()))
    }

    /// The mesh with its vertices at other positions, its triangles turned over if `mirrors`.
    pub fn with_vertices(&self, vertices: Vec<Vec3>, mirrors: bool) -> Mesh {
        let turned = |[a, b, c]: &[u32; 3]| if mirrors { [*a, *c, *b] } else { [*a, *b, *c] };
        Mesh { vertices, triangles: self.triangles.iter().map(turned).collect() }
    }
}

impl SurfaceMesh {
    /// The image of the mesh, its triangles in the same order.
    pub fn transformed(&self, by: &Transform) -> Result<SurfaceMesh, Fault> {
        Ok(SurfaceMesh { mesh: self.mesh.transformed(by)?, cut: self.cut.clone() })
    }
}

impl TetMesh {
    /// The image of the mesh; tetrahedra keep a positive volume where the transform mirrors.
    pub fn transformed(&self, by: &Transform) -> Result<TetMesh, Fault> {
        let nodes = by.points(&self.nodes)?;
        let turned = |[a, b, c, d]: &[u32; 4]| if by.mirrors() { [*a, *b, *d, *c] } else { [*a, *b, *c, *d] };
        Ok(TetMesh { nodes, tets: self.tets.iter().map(turned).collect(), zones: self.zones.clone() })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tetmesh::volume;

    fn scaling(factors: Vec3) -> Transform {
        let matrix = core::array::from_fn(|i| core::array::from_fn(|j| if i == j { factors[i] } else { 0.0 }));
        Transform { matrix, center: [1.0, 0.0, -2.0], shift: [0.0; 3] }
    }

    #[test]
    fn volumes_scale_with_the_size_of_the_determinant() {
        let solid = Mesh::cuboid([0.0; 3], [1.0, 2.0, 4.0]);
        let tets = TetMesh { nodes: solid.vertices.clone(), tets: vec![[0, 1, 2, 4]], zones: Vec::new() };
        for factors in [[2.0, 0.5, 4.0], [-2.0, 0.5, 4.0], [-2.0, -0.5, 4.0], [-2.0, -0.5, -4.0]] {
            // Powers of two: exact.
            assert_eq!(solid.transformed(&scaling(factors)).unwrap().volume(), 4.0 * solid.volume());
            let made = tets.transformed(&scaling(factors)).unwrap();
            assert_eq!(volume(made.corners(0)), 4.0 * volume(tets.corners(0)));
        }
    }

    #[test]
    fn a_shape_that_rounding_would_change_is_refused() {
        let solid = Mesh::cuboid([0.0; 3], [1.0; 3]);
        let far = |x| Transform { shift: [x, 0.0, 0.0], ..scaling([1.0; 3]) };
        assert!(solid.transformed(&far(1e6)).is_ok());
        for x in [1e7, 1e300, f64::INFINITY, f64::NAN] {
            assert!(solid.transformed(&far(x)).unwrap_err().message.contains("f64 rounds its shape"));
        }
        // There and back again.
        let about = Transform { center: [1e16, 0.0, 0.0], ..scaling([1.0; 3]) };
        assert!(solid.transformed(&about).unwrap_err().message.contains("f64 rounds its shape"));
        assert!(Mesh::default().transformed(&far(1e300)).is_ok());
    }
}
