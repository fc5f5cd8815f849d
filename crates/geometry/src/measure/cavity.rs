//! Closed voids: powder or resin cannot leave them.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::components::{self, Components};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;

/// A closed void, from which powder and resin cannot drain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "VoidReport")]
pub struct Cavity {
    /// Volume, mm³.
    pub volume: f64,
    /// A point inside, mm.
    pub point: Vec3,
    /// Lower and upper corner of the bounds, mm.
    #[schemars(with = "[Vec3; 2]")]
    pub bounds: Aabb,
}

/// Chords tried for a point inside.
const TRIES: usize = 12;

/// The closed voids of a mesh, the largest first. Time is linear in the mesh.
pub fn cavities(mesh: &Mesh) -> Vec<Cavity> {
    let apart = components::apart(mesh);
    let mesh = apart.as_ref().unwrap_or(mesh);
    let joined = Components::of(mesh);
    let volumes = joined.volumes(mesh);
    if volumes.iter().all(|v| *v >= 0.0) {
        return Vec::new();
    }
    let (labels, count) = (joined.labels(mesh), volumes.len());
    let mut triangles: Vec<Vec<u32>> = vec![Vec::new(); count];
    let mut bounds = vec![Aabb::EMPTY; count];
    for (i, label) in labels.iter().enumerate() {
        let corners = mesh.corners(i);
        bounds[*label] = corners.iter().fold(bounds[*label], |b, p| b.with(*p));
        triangles[*label].push(i as u32);
    }
    let within =
        |inner: &Aabb, outer: &Aabb| (0..3).all(|a| inner.min[a] >= outer.min[a] && inner.max[a] <= outer.max[a]);
    let mut found: Vec<Cavity> = (0..count)
        .into_par_iter()
        .filter(|&i| volumes[i] < 0.0)
        .map(|i| {
            // Solids that float in it interrupt chords.
            let floating = (0..count).filter(|&j| volumes[j] > 0.0 && within(&bounds[j], &bounds[i]));
            let walls: Vec<[Vec3; 3]> = std::iter::once(i)
                .chain(floating)
                .flat_map(|j| triangles[j].iter().map(|t| mesh.corners(*t as usize)))
                .collect();
            Cavity { volume: -volumes[i], point: inside(&walls, triangles[i].len()), bounds: bounds[i] }
        })
        .collect();
    found.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    found
}

/// The middle of the longest of some chords from wall to wall that lies in the void. The first `own` walls are those
/// that the chords start from.
fn inside(walls: &[[Vec3; 3]], own: usize) -> Vec3 {
    let tries = TRIES.min(own);
    let chords = (0..tries).filter_map(|n| {
        let [a, b, c] = walls[(2 * n + 1) * own / (2 * tries)];
        let from = scale(add(a, add(b, c)), 1.0 / 3.0);
        let along = unit(cross(sub(b, a), sub(c, a)));
        let length = walls.iter().filter_map(|w| hit(w, from, along));
        let length = length.fold(f64::INFINITY, f64::min);
        (length.is_finite() && length > 0.0).then(|| (length, add(from, scale(along, length / 2.0))))
    });
    let mut chords: Vec<(f64, Vec3)> = chords.collect();
    chords.sort_by(|a, b| b.0.total_cmp(&a.0));
    let first = chords.first().map_or(walls[0][0], |c| c.1);
    // A chord may slip through an edge by rounding: then its middle is elsewhere.
    let sound = chords.iter().find(|c| turns(walls, c.1) < -0.5);
    sound.map_or(first, |c| c.1)
}

/// How far along a ray a triangle is hit, if it is: T. Möller and B. Trumbore, Fast, minimum storage ray/triangle
/// intersection (1997).
fn hit([a, b, c]: &[Vec3; 3], from: Vec3, along: Vec3) -> Option<f64> {
    let (ab, ac, s) = (sub(*b, *a), sub(*c, *a), sub(from, *a));
    let p = cross(along, ac);
    let det = dot(ab, p);
    let u = dot(s, p) / det;
    let q = cross(s, ab);
    let (v, t) = (dot(along, q) / det, dot(ac, q) / det);
    let slack = 1e-12;
    let size = norm(ab).max(norm(ac));
    (u >= -slack && v >= -slack && u + v <= 1.0 + slack && t > 1e-9 * size).then_some(t)
}

/// How often the walls go round a point: −1 in the void, 0 elsewhere. By solid angles: A. van Oosterom and J. Strackee,
/// IEEE Trans. Biomed. Eng. 30 (1983) 125.
fn turns(walls: &[[Vec3; 3]], p: Vec3) -> f64 {
    let angle = |w: &[Vec3; 3]| {
        let [a, b, c] = w.map(|v| sub(v, p));
        let [x, y, z] = [a, b, c].map(norm);
        let det = dot(a, cross(b, c));
        2.0 * det.atan2(x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y)
    };
    walls.iter().map(angle).sum::<f64>() / (4.0 * core::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::{cube, flipped, join, torus};

    #[test]
    fn cavities_are_listed_with_volume_and_place_the_largest_first() {
        let solid = join(&[
            cube([0.0; 3], 10.0),
            flipped(cube([1.0; 3], 1.0)),
            flipped(cube([4.0, 4.0, 4.0], 3.0)),
            cube([4.5, 4.5, 4.5], 1.0),
            cube([20.0; 3], 1.0),
        ]);
        let found = cavities(&solid);
        assert_eq!(found.len(), 2);
        assert!((found[0].volume - 27.0).abs() < 1e-12 && (found[1].volume - 1.0).abs() < 1e-12);
        assert_eq!((found[0].bounds.min, found[0].bounds.max), ([4.0; 3], [7.0; 3]));
        for (f, (lo, hi)) in found.iter().zip([(4.0, 7.0), (1.0, 2.0)]) {
            assert!(f.point.iter().all(|x| *x > lo && *x < hi), "{:?}", f.point);
        }
        // Not in what floats there.
        assert!(!found[0].point.iter().all(|x| *x >= 4.5 && *x <= 5.5));
        assert_eq!(cavities(&cube([0.0; 3], 1.0)), []);
        assert_eq!(cavities(&Mesh::default()), []);
    }

    #[test]
    fn the_point_of_a_ring_is_in_the_ring() {
        let ring = flipped(torus(40, 30));
        let found = cavities(&ring);
        let [x, y, z] = found[0].point;
        assert!((x.hypot(y) - 2.0).hypot(z) < 0.5, "{:?}", found[0].point);
    }
}
