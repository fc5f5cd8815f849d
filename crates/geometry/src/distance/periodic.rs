//! The signed distance of a solid that repeats in space.

use super::triangle::Triangle;
use super::triangle_bvh::TriangleBvh;
use super::{MeshDistance, UNKNOWN};
use crate::fault::Fault;
use crate::math::{Aabb, Vec3, add, norm, scale, sub};

/// How near to a face of the period, in its edges, a triangle lies on it.
const FLUSH: f64 = 1e-6;

/// A solid in one period of space, and the boundary of all its copies together.
#[derive(Debug)]
pub struct PeriodicDistance {
    solid: MeshDistance,
    boundary: TriangleBvh,
}

impl PeriodicDistance {
    /// The solid, which lies within `cell`, repeated along the three axes. Its faces on the cell's faces where it goes on into the
    /// next copy are no boundary.
    ///
    /// # Errors
    /// Nothing is left of the boundary: the copies fill space.
    pub fn new(solid: MeshDistance, cell: Aabb) -> Result<Self, Fault> {
        let size = cell.size();
        let goes_on = |t: &Triangle| {
            (0..3).any(|a| {
                let on = |face: f64| t.corners.iter().all(|p| (p[a] - face).abs() <= FLUSH * size[a]);
                let across = if on(cell.min[a]) {
                    1.0
                } else if on(cell.max[a]) {
                    -1.0
                } else {
                    return false;
                };
                let mut beyond = scale(t.corners.into_iter().fold([0.0; 3], add), 1.0 / 3.0);
                beyond[a] += across * (1.0 - 2.0 * FLUSH) * size[a];
                solid.value(beyond) < 0.0
            })
        };
        let own: Vec<Triangle> = solid.triangles().iter().filter(|t| !goes_on(t)).copied().collect();
        // The nearest copy of a point is within half a period of it along each axis.
        let near = Aabb {
            min: std::array::from_fn(|a| cell.min[a] - 0.5 * size[a]),
            max: std::array::from_fn(|a| cell.max[a] + 0.5 * size[a]),
        };
        let mut copies = Vec::new();
        for n in 0..27 {
            let by: Vec3 = std::array::from_fn(|a| size[a] * (f64::from(n / [1, 3, 9][a] % 3) - 1.0));
            let moved = own.iter().map(|t| Triangle { corners: t.corners.map(|p| add(p, by)), ..*t });
            let reaches = |t: &Triangle| {
                let b = t.bounds();
                (0..3).all(|a| b.min[a] <= near.max[a] && b.max[a] >= near.min[a])
            };
            copies.extend(moved.filter(reaches));
        }
        if copies.is_empty() {
            return Err(Fault::new("", "the solid and its copies fill space, so there is no surface"));
        }
        Ok(PeriodicDistance { solid, boundary: TriangleBvh::new(&copies) })
    }

    /// Fills signed distances (mm) of points of the period, positive inside; fastest for points that follow each other closely.
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut seed, mut known) = (0, UNKNOWN);
        for (o, p) in out.iter_mut().zip(points) {
            let hit = self.boundary.nearest(*p, seed);
            seed = hit.triangle;
            // No boundary lies between a point and another that is nearer to it than the boundary.
            let same_side = norm(sub(*p, known.0)) < known.1.abs();
            let inside = if same_side { known.1 > 0.0 } else { self.solid.value(*p) < 0.0 };
            *o = if inside { hit.square.sqrt() } else { -hit.square.sqrt() };
            known = (*p, *o);
        }
    }
}
