//! How far boundary faces are from the surface.

use super::domains::Domains;
use crate::conforming_tets::{SurfaceSet, distances, members};
use crate::field::Field;
use geometry::fe_mesh::FeMesh;
use geometry::math::{Vec3, add, cross, norm, scale, sub, unit};
use rayon::prelude::*;

/// Faces at a time.
const BATCH: usize = 256;
/// A distance of first order is believed up to this part of the face's longest edge; beyond, the surface is looked for along the face's
/// normal and the field's gradient.
const NEAR: f64 = 0.2;
/// Positions along each at which it is looked for, to either side.
const STEPS: u32 = 16;

/// The greatest distance of faces on curved surfaces from them (mm), at corners, edges and centroids. `faces` are tetrahedron and
/// corner, their surfaces, whether only one tetrahedron has them.
pub(super) fn deviation(mesh: &FeMesh, faces: &[((u32, u8), SurfaceSet, bool)], domains: &Domains) -> f64 {
    let mut by_surface: Vec<(usize, (u32, u8))> = faces
        .iter()
        .filter_map(|(f, set, _)| {
            let curved = |s: &usize| domains.surfaces[*s].plane.is_none();
            members(*set).find(curved).filter(|_| members(*set).all(|s| curved(&s))).map(|s| (s, *f))
        })
        .collect();
    by_surface.par_sort_unstable();
    let greatest = |chunk: &[(usize, (u32, u8))]| {
        let mut most = 0.0f64;
        for same in chunk.chunk_by(|a, b| a.0 == b.0) {
            let surface = &domains.surfaces[same[0].0];
            let points: Vec<[Vec3; 7]> = same.iter().map(|(_, f)| points(mesh, *f)).collect();
            let mut off = distances(surface, points.as_flattened());
            for of in &points {
                let [p, q, r, ..] = *of;
                let longest = norm(sub(p, q)).max(norm(sub(q, r))).max(norm(sub(p, r)));
                for (at, d) in of.iter().zip(off.by_ref()) {
                    let believed = d.abs() <= NEAR * longest;
                    let normal = || unit(cross(sub(q, p), sub(r, p)));
                    let d = if believed { d.abs() } else { farther(&*surface.field, *at, normal(), longest) };
                    most = most.max(d);
                }
            }
        }
        most
    };
    by_surface.par_chunks(BATCH).map(greatest).reduce(|| 0.0, f64::max)
}

/// Corners, edges and centroid of a face.
fn points(mesh: &FeMesh, face: (u32, u8)) -> [Vec3; 7] {
    let [p, q, r] = mesh.face(face).map(|n| mesh.nodes[n as usize]);
    let mean = |a: Vec3, b: Vec3| scale(add(a, b), 0.5);
    match mesh.face_middles(face) {
        Some(m) => {
            let [a, b, c] = m.map(|n| mesh.nodes[n as usize]);
            // The centroid of a quadratic triangle.
            let at = core::array::from_fn(|k| (4.0 * (a[k] + b[k] + c[k]) - p[k] - q[k] - r[k]) / 9.0);
            [p, q, r, a, b, c, at]
        }
        None => [p, q, r, mean(p, q), mean(q, r), mean(p, r), scale(add(add(p, q), r), 1.0 / 3.0)],
    }
}

/// The distance along the normal of a face or the gradient of a field, to either side, at which the field changes sign, in steps; at most
/// `reach`. Where a face bridges a thin strut, its normal may run along that and meet nothing.
fn farther(field: &dyn Field, p: Vec3, normal: Vec3, reach: f64) -> f64 {
    let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
    field.gradients(&[p], &mut value, &mut gradient);
    let solid = value[0] < 0.0;
    let crosses = |d: f64, along: Vec3| (field.value(add(p, scale(along, d))) < 0.0) != solid;
    let ahead = (1..=STEPS).map(|k| reach * f64::from(k) / f64::from(STEPS));
    let ways = [normal, unit(gradient[0])];
    ahead.into_iter().find(|d| ways.iter().any(|a| crosses(*d, *a) || crosses(-d, *a))).unwrap_or(reach)
}
