//! A mesh without its triangles on some planes or faces: how far it is to the rest of its surface.

use std::sync::Arc;

use super::{MeshRegion, one_surface};
use crate::field::{Block, Field};
use crate::region::moved::Moved;
use crate::region::{HalfSpace, Offset, OpenSurface, Region, SignedDistance, halving};
use geometry::distance::UNKNOWN;
use geometry::distance::triangle::Triangle;
use geometry::distance::triangle_bvh::{Nearest, TriangleBvh};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, dot, norm, scale};
use geometry::similarity::Similarity;

/// Corners of a triangle on a plane may be this far off it, as a share of the mesh's size: files hold coordinates in
/// single precision.
const OFF: f64 = 1e-6;
/// The least cosine between the normals of a plane and of a triangle on it.
const FACING: f64 = 1.0 - 1e-6;

/// A triangle that is left is as near as one that is missing if their squared distances agree so far: a corner of both.
const AS_NEAR: f64 = 1.0 + 1e-12;

/// Minus the distance to the triangles that are left, inside the mesh, on the far side of the planes and where a missing triangle
/// of another face is the nearest; the distance elsewhere. There is no surface where triangles are missing, so the function runs on
/// smoothly through the gap.
struct OpenMesh {
    whole: Arc<MeshRegion>,
    /// The triangles that are left.
    rest: TriangleBvh,
    /// The planes on which triangles are missing.
    planes: Vec<HalfSpace>,
    /// Whether each triangle is missing that is on no plane; empty if none is.
    missing: Vec<bool>,
}

/// The mesh without its triangles on `cuts`; `None` if there are none.
pub(super) fn opened(whole: Arc<MeshRegion>, cuts: &[OpenSurface], found: &mut [bool]) -> Option<Region> {
    let off = OFF * norm(whole.bounds.size());
    let on = |f: &Triangle, c: &OpenSurface| match c {
        OpenSurface::Plane(c) => {
            dot(f.normal, c.normal()) >= FACING && f.corners.iter().all(|p| c.value(*p).abs() <= off)
        }
        OpenSurface::Faces(set) => set.hold(f, off),
    };
    let triangles = whole.distance.triangles();
    let mut rest = Vec::with_capacity(triangles.len());
    let mut missing = vec![false; triangles.len()];
    let mut used = vec![false; cuts.len()];
    for (f, missing) in triangles.iter().zip(&mut missing) {
        match cuts.iter().position(|c| on(f, c)) {
            Some(i) => {
                used[i] = true;
                *missing = matches!(cuts[i], OpenSurface::Faces(_));
            }
            None => rest.push(*f),
        }
    }
    if rest.is_empty() || !used.contains(&true) {
        return None;
    }
    found.iter_mut().zip(&used).for_each(|(f, used)| *f |= used);
    let plane = |(c, used): (&OpenSurface, bool)| match c {
        OpenSurface::Plane(plane) if used => Some(*plane),
        _ => None,
    };
    let planes = cuts.iter().zip(used).filter_map(plane).collect();
    if !missing.contains(&true) {
        missing.clear();
    }
    let rest = TriangleBvh::new(&rest);
    Some(Arc::new(OpenMesh { whole, rest, planes, missing }))
}

impl OpenMesh {
    /// The nearest triangle that is left, and the sign of the distance to it.
    fn nearest(&self, p: Vec3, seeds: &mut [u32; 2]) -> (Nearest, f64) {
        let hit = self.rest.nearest(p, seeds[0]);
        seeds[0] = hit.triangle;
        if self.planes.iter().any(|c| c.value(p) >= 0.0) {
            return (hit, -1.0);
        }
        let whole = self.whole.distance.nearest(p, seeds[1]);
        seeds[1] = whole.triangle;
        let before = self.missing.get(whole.triangle as usize) == Some(&true) && hit.square > whole.square * AS_NEAR;
        let inside = before || self.whole.distance.signed(&whole, p, UNKNOWN) <= 0.0;
        (hit, if inside { -1.0 } else { 1.0 })
    }
}

impl Field for OpenMesh {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut seeds = [0; 2];
        for (o, p) in out.iter_mut().zip(points) {
            let (hit, sign) = self.nearest(*p, &mut seeds);
            *o = sign * hit.square.sqrt();
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut seeds = [0; 2];
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let (hit, sign) = self.nearest(*p, &mut seeds);
            let d = hit.square.sqrt();
            *v = sign * d;
            *g = if d > self.rest.rounding() {
                scale(hit.away, sign / d)
            } else {
                self.rest.triangles()[hit.triangle as usize].normal
            };
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let (hit, sign) = self.nearest(b.center(), &mut [0; 2]);
        let (d, reach) = (hit.square.sqrt(), norm(b.size()) / 2.0);
        let reach = reach * (1.0 + 1e-12) + 2.0 * self.rest.rounding() + 1e-14 * d;
        let r = Interval::new(sign * d - reach, sign * d + reach);
        // Outside the mesh the sign changes at a plane, and between missing faces and others.
        let parted = self.planes.iter().any(|c| {
            let side = c.bound(b);
            side.lo <= 0.0 && side.hi >= 0.0
        });
        let parted = parted || (!self.missing.is_empty() && self.whole.bound(b).hi >= 0.0);
        if parted { r.union(-r) } else { r }
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl SignedDistance for OpenMesh {
    fn bounds(&self) -> Aabb {
        self.whole.bounds
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        let mut seeds = [0; 2];
        let value = |p| {
            let (hit, sign) = self.nearest(p, &mut seeds);
            sign * hit.square.sqrt()
        };
        halving::fill(block, level, out, |b| self.bound(b), value);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<crate::implicit::Surface>) -> crate::csg_tree::CsgTree {
        match Offset::new(self.clone(), by) {
            Ok(moved) => one_surface(Arc::new(moved), out),
            Err(_) => one_surface(self, out),
        }
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        Ok(Arc::new(Moved::new(self, by)))
    }

    fn volume(&self) -> Option<f64> {
        None
    }
}
