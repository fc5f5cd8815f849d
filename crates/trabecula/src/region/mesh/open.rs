//! A mesh without its triangles on some planes: how far it is to the rest of its surface.

use std::sync::Arc;

use super::{MeshRegion, one_surface};
use crate::field::{Block, Field};
use crate::region::{HalfSpace, Offset, Region, Shape};
use geometry::distance::UNKNOWN;
use geometry::distance::triangle::Triangle;
use geometry::distance::triangle_bvh::{Nearest, TriangleBvh};
use geometry::math::{Aabb, Interval, Vec3, dot, norm, scale};

/// Corners of a triangle on a plane may be this far off it, as a share of the mesh's size: files hold coordinates in
/// single precision.
const OFF: f64 = 1e-6;
/// The least cosine between the normals of a plane and of a triangle on it.
const FACING: f64 = 1.0 - 1e-6;

/// Minus the distance to the triangles that are left, inside the mesh and on the far side of the planes; the distance
/// elsewhere. There is no surface where triangles are missing, so the function runs on smoothly through the gap.
struct OpenMesh {
    whole: Arc<MeshRegion>,
    /// The triangles that are left.
    rest: TriangleBvh,
    cuts: Vec<HalfSpace>,
}

/// The mesh without its triangles on the planes of `cuts`; `None` if there are none.
pub(super) fn opened(whole: Arc<MeshRegion>, cuts: &[HalfSpace], found: &mut [bool]) -> Option<Region> {
    let off = OFF * norm(whole.bounds.size());
    let on = |f: &Triangle, c: &HalfSpace| {
        dot(f.normal, c.normal()) >= FACING && f.corners.iter().all(|p| c.value(*p).abs() <= off)
    };
    let mut rest = Vec::with_capacity(whole.distance.triangles().len());
    let mut used = vec![false; cuts.len()];
    for f in whole.distance.triangles() {
        match cuts.iter().position(|c| on(f, c)) {
            Some(i) => used[i] = true,
            None => rest.push(*f),
        }
    }
    if rest.is_empty() || !used.contains(&true) {
        return None;
    }
    found.iter_mut().zip(&used).for_each(|(f, used)| *f |= used);
    let here = cuts.iter().zip(used).filter(|(_, used)| *used);
    let cuts = here.map(|(c, _)| *c).collect();
    let rest = TriangleBvh::new(&rest);
    Some(Arc::new(OpenMesh { whole, rest, cuts }))
}

impl OpenMesh {
    /// The nearest triangle that is left, and the sign of the distance to it.
    fn nearest(&self, p: Vec3, seeds: &mut [u32; 2]) -> (Nearest, f64) {
        let hit = self.rest.nearest(p, seeds[0]);
        seeds[0] = hit.triangle;
        if self.cuts.iter().any(|c| c.value(p) >= 0.0) {
            return (hit, -1.0);
        }
        let whole = self.whole.distance.nearest(p, seeds[1]);
        seeds[1] = whole.triangle;
        let inside = self.whole.distance.signed(&whole, p, UNKNOWN) <= 0.0;
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
        // Outside the mesh the sign changes at a plane.
        let parted = self.cuts.iter().any(|c| {
            let side = c.bound(b);
            side.lo <= 0.0 && side.hi >= 0.0
        });
        if parted { r.union(-r) } else { r }
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl Shape for OpenMesh {
    fn bounds(&self) -> Aabb {
        self.whole.bounds
    }

    fn level_planes(&self, _: usize, _: f64, _: &mut Vec<f64>) {}

    /// Halves the block until a part lies on one side of the level or is eight nodes: most nodes are never evaluated.
    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        if !block.is_empty() {
            let widest = |axis: &[f64]| axis.windows(2).fold(0.0f64, |m, w| m.max(w[1] - w[0]));
            let cell = norm(block.axes.map(widest));
            self.fill_part(block, level, cell, [[0; 3], block.shape()], out);
        }
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<crate::implicit::Surface>) -> crate::csg_tree::CsgTree {
        match Offset::new(self.clone(), by) {
            Ok(moved) => one_surface(Arc::new(moved), out),
            Err(_) => one_surface(self, out),
        }
    }

    fn volume(&self) -> Option<f64> {
        None
    }
}

impl OpenMesh {
    fn fill_part(&self, block: &Block, level: f64, cell: f64, [lo, hi]: [[usize; 3]; 2], out: &mut [f32]) {
        let ends = [0, 1, 2].map(|a| [block.axes[a][lo[a]], block.axes[a][hi[a] - 1]]);
        let b = Aabb { min: ends.map(|e| e[0]), max: ends.map(|e| e[1]) };
        let r = self.bound(&b);
        let far = (r.lo - level > cell).then_some(r.lo - level);
        let far = far.or_else(|| (r.hi - level < -cell).then_some(r.hi - level));
        let [nx, ny, _] = block.shape();
        let size = b.size();
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        let few = (0..3).map(|a| hi[a] - lo[a]).product::<usize>() <= 8;
        if far.is_none() && !few && hi[longest] - lo[longest] > 1 {
            let middle = (lo[longest] + hi[longest]) / 2;
            let (mut end, mut begin) = (hi, lo);
            end[longest] = middle;
            begin[longest] = middle;
            self.fill_part(block, level, cell, [lo, end], out);
            self.fill_part(block, level, cell, [begin, hi], out);
            return;
        }
        let mut seeds = [0; 2];
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    let value = far.unwrap_or_else(|| {
                        let p = [block.axes[0][i], block.axes[1][j], block.axes[2][k]];
                        let (hit, sign) = self.nearest(p, &mut seeds);
                        sign * hit.square.sqrt() - level
                    });
                    out[(k * ny + j) * nx + i] = value as f32;
                }
            }
        }
    }
}
