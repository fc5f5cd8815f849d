//! Regions: where the part may be. Signed distance in mm, negative inside.

use std::sync::Arc;

use crate::field::Field;
use crate::math::Aabb;

mod csg;
mod mesh;
mod primitive;

pub use csg::{Difference, Intersection, Offset, Union};
pub use mesh::MeshRegion;
pub use primitive::{Cuboid, Cylinder, HalfSpace, Sphere};

/// A signed distance function (1-Lipschitz; exact for primitives and meshes, a lower bound of the
/// absolute distance for combinations), with what a mesher and a report need beside it.
pub trait Shape: Field {
    /// Bounds of the solid; infinite along unbounded directions.
    fn bounds(&self) -> Aabb;

    /// Adds to `out` the coordinates of faces of the shape that are planes normal to `axis` (0, 1, 2).
    ///
    /// On such a plane, within the face, the signed distance computes to exactly 0.0 for a point whose
    /// coordinate equals the number given here, so that a grid plane laid on it reproduces the face exactly.
    fn planes(&self, axis: usize, out: &mut Vec<f64>);

    /// Exact volume (mm³) where it is known in closed form.
    fn volume(&self) -> Option<f64>;
}

/// A shared region.
pub type Region = Arc<dyn Shape>;
