//! The nearest triangle to a point.

use super::disc::Disc;
use super::triangle::{Feature, Triangle};
use crate::bvh::{Bvh, BvhNode, Split, WideBvh};
use crate::math::{Aabb, Vec3, norm, sub};

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

/// The triangles of which one is nearest to any point of a ball.
#[derive(Debug, Default)]
pub struct Candidates {
    center: Vec3,
    /// Distances from the centre (mm), rising, and positions in the tree's order.
    of: Vec<(f64, u32)>,
}

/// A bounding-volume hierarchy over triangles, which are reordered so that a leaf's lie together.
#[derive(Debug)]
pub struct TriangleBvh {
    bvh: Bvh,
    wide: WideBvh,
    triangles: Vec<Triangle>,
    discs: Vec<Disc>,
    rounding: f64,
}

impl TriangleBvh {
    /// Builds the tree by the surface-area heuristic.
    pub fn new(triangles: &[Triangle]) -> TriangleBvh {
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::bounds).collect();
        let bvh = Bvh::new(&boxes, (0..triangles.len() as u32).collect(), Split::SurfaceArea);
        let all = bvh.nodes().first().map_or(Aabb { min: [0.0; 3], max: [0.0; 3] }, |n| n.bounds);
        let largest = all.min.iter().chain(&all.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let triangles: Vec<Triangle> = bvh.order().iter().map(|i| triangles[*i as usize]).collect();
        let boxes: Vec<Aabb> = triangles.iter().map(Triangle::bounds).collect();
        let wide = WideBvh::new(&bvh, &boxes);
        let discs = triangles.iter().map(Disc::new).collect();
        TriangleBvh { bvh, wide, triangles, discs, rounding: 16.0 * f64::EPSILON * largest }
    }

    /// The rounding that a distance to the mesh carries, mm.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The nodes, each before its children.
    pub fn nodes(&self) -> &[BvhNode] {
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

    /// Whether `test` holds for one of the triangles in leaves whose boxes touch `b`.
    pub fn any_touching(&self, b: &Aabb, test: impl Fn(&Triangle) -> bool) -> bool {
        let mut found = false;
        self.bvh.overlapping_leaves(b, |leaf| found = found || self.triangles[leaf].iter().any(&test));
        found
    }

    /// The nearest triangle; of several at the same computed distance the first. `seed` is a triangle that may be
    /// near: it makes the search shorter and never changes the answer.
    pub fn nearest(&self, p: Vec3, seed: u32) -> Nearest {
        let (square, away, feature) = self.triangles[seed as usize].nearest(p);
        let mut best = Nearest { square, away, triangle: seed, feature };
        let reach = |square: f64| self.reach(p, square);
        let mut limit = reach(square);
        self.wide.nearest(p, limit, |k| {
            if self.discs[k].is_beyond(p, limit) {
                return limit;
            }
            let (square, away, feature) = self.triangles[k].nearest(p);
            let k = k as u32;
            if square < best.square || (square == best.square && k < best.triangle) {
                if square < best.square {
                    limit = reach(square);
                }
                best = Nearest { square, away, triangle: k, feature };
            }
            limit
        });
        best
    }

    /// That of some triangles which lies nearest by its middle: a seed.
    pub fn seed(&self, p: Vec3, of: [u32; 4]) -> u32 {
        let each = of.map(|k| (self.discs[k as usize].square_from_center(p), k));
        each.into_iter().fold(each[0], |least, one| if one.0 < least.0 { one } else { least }).1
    }

    /// The squared distance to which boxes are searched if the nearest triangle yet is at a squared distance of `square`: they
    /// may hold a tie, so that rounding cannot make the order of the search matter.
    fn reach(&self, p: Vec3, square: f64) -> f64 {
        let d = self.at_most(p, square.sqrt());
        d * d
    }

    /// A computed distance d (mm) with what rounding may hide.
    fn at_most(&self, p: Vec3, d: f64) -> f64 {
        let largest = p.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        d * (1.0 + 1e-12) + self.rounding + 1e-14 * largest
    }

    /// Finds the candidates of the ball about `center`, whose nearest triangle is `hit`: those at most twice the radius farther
    /// off. Gives up, and says so by false, if there are more than `most`.
    pub fn candidates(&self, center: Vec3, hit: &Nearest, radius: f64, most: usize, found: &mut Candidates) -> bool {
        found.center = center;
        found.of.clear();
        let reach = self.at_most(center, hit.square.sqrt() + 2.0 * radius);
        let limit = reach * reach;
        self.wide.nearest(center, limit, |k| {
            if !self.discs[k].is_beyond(center, limit)
                && let square = self.triangles[k].nearest(center).0
                && square <= limit
            {
                found.of.push((square.sqrt(), k as u32));
            }
            if found.of.len() > most { -1.0 } else { limit }
        });
        found.of.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        found.of.len() <= most
    }

    /// As `nearest`, of a point in the ball of the candidates.
    pub fn nearest_of(&self, candidates: &Candidates, p: Vec3) -> Nearest {
        let off = norm(sub(p, candidates.center));
        let mut best = Nearest { square: f64::INFINITY, away: [0.0; 3], triangle: u32::MAX, feature: Feature::Face };
        let mut most = f64::INFINITY;
        for &(d, k) in &candidates.of {
            if d - off > most {
                break;
            }
            if self.discs[k as usize].is_beyond(p, most * most) {
                continue;
            }
            let (square, away, feature) = self.triangles[k as usize].nearest(p);
            if square < best.square || (square == best.square && k < best.triangle) {
                best = Nearest { square, away, triangle: k, feature };
                most = self.at_most(p, square.sqrt());
            }
        }
        best
    }
}
