//! The nearest triangle to a point.

use super::triangle::{Feature, Triangle};
use crate::bvh::{Bvh, Node, Split};
use crate::math::{Aabb, Vec3};

/// The nearest point of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Squared distance, mm².
    pub square: f64,
    /// From the nearest point to the query.
    pub away: Vec3,
    /// Position of the triangle in the tree's order.
    pub triangle: u32,
    /// Where on the triangle.
    pub feature: Feature,
}

/// A bounding-volume hierarchy over triangles, which are reordered so that a leaf's lie together.
#[derive(Debug)]
pub struct TriangleBvh {
    bvh: Bvh,
    triangles: Vec<Triangle>,
    rounding: f64,
}

impl TriangleBvh {
    /// Builds the tree by the surface-area heuristic.
    pub fn new(triangles: &[Triangle]) -> TriangleBvh {
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::bounds).collect();
        let bvh = Bvh::new(&boxes, (0..triangles.len() as u32).collect(), Split::SurfaceArea);
        let all = bvh.nodes().first().map_or(Aabb { min: [0.0; 3], max: [0.0; 3] }, |n| n.bounds);
        let largest = all.min.iter().chain(&all.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let triangles = bvh.order().iter().map(|i| triangles[*i as usize]).collect();
        TriangleBvh { bvh, triangles, rounding: 16.0 * f64::EPSILON * largest }
    }

    /// The rounding that a distance to the mesh carries, mm.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The nodes, each before its children.
    pub fn nodes(&self) -> &[Node] {
        self.bvh.nodes()
    }

    /// The triangles in the tree's order.
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// For each triangle in the tree's order its index among those given.
    pub fn order(&self) -> &[u32] {
        self.bvh.order()
    }

    /// The nearest triangle; of several at the same computed distance the first. `seed` is a triangle that may be
    /// near: it makes the search shorter and never changes the answer.
    pub fn nearest(&self, p: Vec3, seed: u32) -> Nearest {
        let (square, away, feature) = self.triangles[seed as usize].nearest(p);
        let mut best = Nearest { square, away, triangle: seed, feature };
        // Boxes are searched while they may hold a tie, so that rounding cannot make the seed matter.
        let reach = |square: f64| {
            let largest = p.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let d = square.sqrt() * (1.0 + 1e-12) + self.rounding + 1e-14 * largest;
            d * d
        };
        let mut limit = reach(square);
        self.bvh.nearest(p, limit, |items| {
            for k in items {
                let (square, away, feature) = self.triangles[k].nearest(p);
                let k = k as u32;
                if square < best.square || (square == best.square && k < best.triangle) {
                    if square < best.square {
                        limit = reach(square);
                    }
                    best = Nearest { square, away, triangle: k, feature };
                }
            }
            limit
        });
        best
    }
}
