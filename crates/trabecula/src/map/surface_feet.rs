//! Points of a region's surface nearest to points of a mesh's boundary, on its sharp edges too.
//!
//! A point on an edge of the boundary mesh has a face on either side. Where the tangent planes of the region near these two faces
//! differ, however near they are taken, the region has a sharp edge there, and the point belongs on both planes.

use rayon::prelude::*;

use crate::field::Field;
use geometry::math::{Vec3, add, dot, norm, scale, sub};

/// Normals that differ by less than this (degrees) belong to one smooth face.
const SMOOTH: f64 = 25.0;
/// How far towards the middles of both faces tangent planes are taken, in three rounds.
const TOWARD: [f64; 3] = [0.35, 0.06, 0.01];
/// Steps to the surface: one reaches it where the function is a distance.
const STEPS: usize = 3;
/// Points that a thread takes at once.
const BATCH: usize = 256;

/// Values and gradients of a field at many points.
fn gradients(field: &dyn Field, points: &[Vec3]) -> (Vec<f64>, Vec<Vec3>) {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    let out = v.par_chunks_mut(BATCH).zip(g.par_chunks_mut(BATCH));
    out.zip(points.par_chunks(BATCH)).for_each(|((v, g), p)| field.gradients(p, v, g));
    (v, g)
}

/// Points (mm) moved to the surface of a region, given by its signed distance.
pub(crate) fn feet(region: &dyn Field, points: &[Vec3]) -> Vec<Vec3> {
    let mut feet = points.to_vec();
    for _ in 0..STEPS {
        let (v, g) = gradients(region, &feet);
        for (p, (v, g)) in feet.iter_mut().zip(v.iter().zip(&g)) {
            *p = sub(*p, scale(*g, *v));
        }
    }
    feet
}

/// As `feet`, of points on or near faces of a boundary mesh with these outward directions.
///
/// On a long chord near an edge of the region its nearest surface may be the other face of that edge: points whose nearest surface
/// faces elsewhere are moved first, against the sign of their distance, until the one that faces as they should is nearest.
pub(crate) fn feet_facing(region: &dyn Field, points: &[Vec3], outward: &[Vec3]) -> Vec<Vec3> {
    /// The least cosine between the direction and the surface's normal.
    const ALIKE: f64 = 0.5;
    /// Steps, as multiples of the distance: beyond the surface.
    const STEP: f64 = 1.2;
    const ROUNDS: usize = 6;
    let mut out = points.to_vec();
    let mut left: Vec<usize> = (0..points.len()).collect();
    for _ in 0..ROUNDS {
        let at: Vec<Vec3> = left.iter().map(|i| out[*i]).collect();
        let (v, g) = gradients(region, &at);
        let elsewhere = |(k, i): (usize, &usize)| (dot(g[k], outward[*i]) < ALIKE).then_some((*i, v[k]));
        let moved: Vec<(usize, f64)> = left.iter().enumerate().filter_map(elsewhere).collect();
        for (i, v) in &moved {
            out[*i] = sub(out[*i], scale(outward[*i], STEP * v));
        }
        left = moved.into_iter().map(|m| m.0).collect();
    }
    // Of those that found none the plain feet.
    left.iter().for_each(|i| out[*i] = points[*i]);
    feet(region, &out)
}

/// The faces on both sides of an edge of a boundary mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeFaces {
    /// Their middles (mm).
    pub middles: [Vec3; 2],
    /// The mean of their outward normals.
    pub outward: Vec3,
}

/// As `feet`, of points on edges of a boundary mesh: on the region's sharp edge, if it has one there.
pub(crate) fn edge_feet(region: &dyn Field, points: &[Vec3], faces: &[EdgeFaces]) -> Vec<Vec3> {
    let outward: Vec<Vec3> = faces.iter().map(|f| f.outward).collect();
    let mut out = feet_facing(region, points, &outward);
    for (i, p) in sharp_feet(region, points, faces) {
        out[i] = p;
    }
    out
}

/// The points of these that belong on a sharp edge of the region, by index, and where.
pub(crate) fn sharp_feet(region: &dyn Field, points: &[Vec3], faces: &[EdgeFaces]) -> Vec<(usize, Vec3)> {
    let mut sharp: Vec<usize> = (0..points.len()).collect();
    let mut at = points.to_vec();
    for toward in TOWARD {
        let seen = |i: &usize| faces[*i].middles.map(|s| add(at[*i], scale(sub(s, points[*i]), toward)));
        let near: Vec<Vec3> = sharp.iter().flat_map(seen).collect();
        let (v, g) = gradients(region, &near);
        let plane = |k: usize| (sub(near[k], scale(g[k], v[k])), g[k]);
        let met =
            sharp.iter().enumerate().filter_map(|(k, i)| Some((*i, meeting(at[*i], plane(2 * k), plane(2 * k + 1))?)));
        let met: Vec<(usize, Vec3)> = met.collect();
        sharp = met.iter().map(|m| m.0).collect();
        for (i, p) in met {
            at[i] = p;
        }
    }
    let found: Vec<Vec3> = sharp.iter().map(|i| at[*i]).collect();
    let mut off = vec![0.0; found.len()];
    region.values(&found, &mut off);
    let close = |(i, off): &(usize, f64)| {
        let [a, b] = faces[*i].middles;
        let near = norm(sub(a, b));
        off.abs() < 1e-3 * near && norm(sub(at[*i], points[*i])) < near
    };
    sharp.into_iter().zip(off).filter(close).map(|(i, _)| (i, at[i])).collect()
}

/// The point nearest to `p` on two planes (a point and the unit normal of each), if these differ.
fn meeting(p: Vec3, a: (Vec3, Vec3), b: (Vec3, Vec3)) -> Option<Vec3> {
    let c = dot(a.1, b.1);
    if c > SMOOTH.to_radians().cos() || c < -0.999 {
        return None;
    }
    let away = |(q, n): (Vec3, Vec3)| dot(n, sub(q, p));
    let (x, y, s) = (away(a), away(b), 1.0 - c * c);
    Some(add(p, add(scale(a.1, (x - c * y) / s), scale(b.1, (y - c * x) / s))))
}
