//! What is near some faces of the part.

use std::sync::Arc;

use super::{BuildRegion, Context, Region, SignedDistance, cad, halving, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use crate::kind::Kind;
use geometry::distance::triangle::Triangle;
use geometry::distance::triangle_bvh::TriangleBvh;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, norm, scale};
use geometry::similarity::Similarity;

/// All points within a distance of faces of the design's region, as its STEP file names them.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Faces", noun = "faces of the part")]
pub struct FacesKind {
    /// The faces, each by its name, its colour such as "#ff0000", or its number in the file.
    #[kind(least = 1)]
    named: Vec<String>,
    /// Distance from them.
    #[kind(unit = "mm", above = 0.0)]
    within: f64,
}

impl BuildRegion for FacesKind {
    fn build(&self, context: &mut Context) -> Result<Region, Fault> {
        self.valid()?;
        let set = FaceSet::new(context.part(), &self.named).map_err(|f| f.under("named"))?;
        Ok(Arc::new(NearFaces { set, within: self.within }))
    }
}

/// Faces of a part, as triangles.
#[derive(Clone, Debug)]
pub struct FaceSet {
    names: Vec<String>,
    tree: Arc<TriangleBvh>,
    bounds: Aabb,
}

impl FaceSet {
    /// The faces of a part that go by any of some names.
    ///
    /// # Errors
    /// A part from no file of a CAD system; a name of no face: `Fault::at` is its index, such as `[1]`.
    pub fn new(part: Option<&Region>, names: &[String]) -> Result<FaceSet, Fault> {
        Ok(FaceSet::of(names, cad::faces(part, names)?))
    }

    fn of(names: &[String], corners: Vec<[Vec3; 3]>) -> FaceSet {
        let bounds = corners.iter().flatten().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let triangles: Vec<Triangle> = corners.into_iter().map(Triangle::new).collect();
        FaceSet { names: names.to_vec(), tree: Arc::new(TriangleBvh::new(&triangles)), bounds }
    }

    /// The names that they go by.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether a triangle lies on them, to within `off` mm.
    pub(super) fn hold(&self, f: &Triangle, off: f64) -> bool {
        let near = self.bounds.grown(off);
        let middle = scale(f.corners.iter().fold([0.0; 3], |s, p| geometry::math::add(s, *p)), 1.0 / 3.0);
        let on = |p: &Vec3| near.distance(*p) == 0.0 && self.tree.nearest(*p, 0).square <= off * off;
        f.corners.iter().all(on) && on(&middle)
    }
}

/// All points within a distance of faces.
struct NearFaces {
    set: FaceSet,
    within: f64,
}

impl NearFaces {
    fn values_from(&self, p: Vec3, seed: &mut u32) -> f64 {
        let hit = self.set.tree.nearest(p, *seed);
        *seed = hit.triangle;
        hit.square.sqrt() - self.within
    }
}

impl Field for NearFaces {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut seed = 0;
        out.iter_mut().zip(points).for_each(|(o, p)| *o = self.values_from(*p, &mut seed));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut seed = 0;
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let hit = self.set.tree.nearest(*p, seed);
            seed = hit.triangle;
            let d = hit.square.sqrt();
            *v = d - self.within;
            // On a face either side's direction is a subgradient.
            let normal = || self.set.tree.triangles()[hit.triangle as usize].normal;
            *g = if d > self.set.tree.rounding() { scale(hit.away, 1.0 / d) } else { normal() };
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(-self.within, f64::INFINITY);
        }
        let d = self.set.tree.nearest(b.center(), 0).square.sqrt();
        let reach = norm(b.size()) / 2.0 * (1.0 + 1e-12) + 2.0 * self.set.tree.rounding() + 1e-14 * d;
        Interval::new((d - reach).max(0.0) - self.within, d + reach - self.within)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl SignedDistance for NearFaces {
    fn bounds(&self) -> Aabb {
        self.set.bounds.grown(self.within)
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        let mut seed = 0;
        halving::fill(block, level, out, |b| self.bound(b), |p| self.values_from(p, &mut seed));
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        let within = self.within + by;
        if within <= 0.0 {
            return CsgTree::EMPTY;
        }
        one_surface(Arc::new(NearFaces { set: self.set.clone(), within }), out)
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        let corners = self.set.tree.triangles().iter().map(|f| f.corners.map(|p| by.point(p)));
        let set = FaceSet::of(&self.set.names, corners.collect());
        Ok(Arc::new(NearFaces { set, within: self.within * by.scale() }))
    }

    fn volume(&self) -> Option<f64> {
        None
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
