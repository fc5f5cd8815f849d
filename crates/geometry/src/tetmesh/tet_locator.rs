//! Which points a tetrahedral mesh covers.

use super::{FACES, TetMesh};
use crate::bvh::{Bvh, Split};
use crate::math::{Aabb, Vec3, cross, dot, norm, sub};

/// The tetrahedra of a mesh by their places.
pub struct TetLocator<'a> {
    mesh: &'a TetMesh,
    tree: Bvh,
}

impl<'a> TetLocator<'a> {
    /// A tree over the tetrahedra.
    pub fn new(mesh: &'a TetMesh) -> Self {
        let bounds = |i: usize| mesh.corners(i).iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let boxes: Vec<Aabb> = (0..mesh.tets.len()).map(bounds).collect();
        TetLocator { mesh, tree: Bvh::new(&boxes, (0..boxes.len() as u32).collect(), Split::Median) }
    }

    /// Whether a point is in a tetrahedron or on its surface, within rounding.
    pub fn covers(&self, p: Vec3) -> bool {
        let mut found = false;
        self.tree.overlapping(&Aabb { min: p, max: p }, |items| {
            found = found || items.iter().any(|i| holds(self.mesh.corners(*i as usize), p));
        });
        found
    }
}

/// Whether a point is in a tetrahedron, within rounding.
fn holds(t: [Vec3; 4], p: Vec3) -> bool {
    FACES.iter().all(|&[a, b, c]| {
        let n = cross(sub(t[b], t[a]), sub(t[c], t[a]));
        dot(sub(p, t[a]), n) <= 1e-12 * norm(n) * norm(sub(t[b], t[a]))
    })
}
