//! Fit of a mesh to its region: distance of the boundary from the surface, and the uncovered part of the region.

use std::collections::HashMap;

use super::Fit;
use super::isosurface_stuffing::values;
use crate::field::Field;
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};
use geometry::tetmesh::TetMesh;

/// The fit of a mesh to a region, given its signed distance (mm) and points inside it.
pub fn fit(mesh: &TetMesh, region: &dyn Field, inside: &[Vec3]) -> Fit {
    let boundary = mesh.boundary();
    let mut samples = Vec::with_capacity(4 * boundary.triangles.len());
    for i in 0..boundary.triangles.len() {
        let [a, b, c] = boundary.corners(i);
        samples.push(scale(add(add(a, b), c), 1.0 / 3.0));
        samples.extend([(a, b), (b, c), (c, a)].map(|(p, q)| scale(add(p, q), 0.5)));
    }
    let off = values(region, &samples);
    let mut sorted: Vec<f64> = off.iter().map(|v| v.abs()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let p95 = (sorted.len().saturating_sub(1) as f64 * 0.95).round() as usize;
    let far = (0..off.len()).fold(0, |m, i| if off[i].abs() > off[m].abs() { i } else { m });
    let left = uncovered(mesh, inside);
    let depths = values(region, &left);
    let deep = (0..left.len()).fold(0, |m, i| if depths[i] < depths[m] { i } else { m });
    Fit {
        deviation_mean: off.iter().map(|v| v.abs()).sum::<f64>() / off.len().max(1) as f64,
        deviation_p95: sorted.get(p95).copied().unwrap_or_default(),
        deviation: off.get(far).map_or(0.0, |v| v.abs()),
        deviation_at: samples.get(far).copied().unwrap_or_default(),
        lost: left.len() as f64 / inside.len().max(1) as f64,
        lost_depth: depths.get(deep).map_or(0.0, |v| -v),
        lost_at: left.get(deep).copied().unwrap_or_default(),
        mended: 0.0,
    }
}

/// The points that are in no tetrahedron.
fn uncovered(mesh: &TetMesh, points: &[Vec3]) -> Vec<Vec3> {
    let bounds = points.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
    // About one point per cell.
    let [x, y, z] = bounds.size();
    let cell = (x * y * z / points.len().max(1) as f64).cbrt().max(1e-9 * norm(bounds.size()));
    let index = |p: Vec3| p.map(|v| (v / cell).floor() as i64);
    let mut at: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (i, p) in points.iter().enumerate() {
        at.entry(index(*p)).or_default().push(i as u32);
    }
    let mut covered = vec![false; points.len()];
    for i in 0..mesh.tets.len() {
        let p = mesh.corners(i);
        let b = p.iter().fold(Aabb::EMPTY, |b, p| b.with(*p)).intersection(bounds);
        if b.is_empty() {
            continue;
        }
        let (low, high) = (index(b.min), index(b.max));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    for &k in at.get(&[x, y, z]).into_iter().flatten() {
                        covered[k as usize] |= holds(p, points[k as usize]);
                    }
                }
            }
        }
    }
    let left = points.iter().zip(covered).filter(|(_, c)| !c);
    left.map(|(p, _)| *p).collect()
}

/// Whether a point is in a tetrahedron, within rounding.
fn holds(t: [Vec3; 4], p: Vec3) -> bool {
    geometry::tetmesh::FACES.iter().all(|&[a, b, c]| {
        let n = cross(sub(t[b], t[a]), sub(t[c], t[a]));
        dot(sub(p, t[a]), n) <= 1e-12 * norm(n) * norm(sub(t[b], t[a]))
    })
}
