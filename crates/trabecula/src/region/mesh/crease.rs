//! The edges of a mesh at which it turns.

use std::collections::HashMap;

use super::edges::{ends, halves};
use super::tree::normal;
use crate::face::{Creases, Segment};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;

/// The least turn of the normal across a crease, radians (10°): below it a rounded edge is off by a twentieth of a step.
const TURN: f64 = 0.175;
/// Two creases that meet and turn by more than this, radians (20°), meet in a corner.
const BEND: f64 = 0.35;

/// The creases of a mesh: edges of two triangles whose normals differ.
pub fn creases(mesh: &Mesh) -> Creases {
    let halves = halves(mesh);
    let mut creases = Creases::default();
    // At each vertex: how many creases end there, and the sum of their directions.
    let mut about: HashMap<u32, (usize, Vec3)> = HashMap::new();
    for edge in halves.chunk_by(|a, b| a.0 == b.0) {
        let [(_, a), (_, b)] = edge else { continue };
        let [m, n] = [a, b].map(|h| normal(mesh.corners(*h as usize / 3)));
        let turn = norm(cross(m, n)).atan2(dot(m, n));
        if turn < TURN {
            continue;
        }
        let ends = ends(mesh, *a);
        let [p, q] = ends.map(|v| mesh.vertices[v as usize]);
        creases.segments.push(Segment { ends: [p, q], turn });
        let along = sub(q, p);
        let along = scale(along, 1.0 / norm(along));
        for (v, way) in ends.into_iter().zip([along, scale(along, -1.0)]) {
            let at = about.entry(v).or_default();
            *at = (at.0 + 1, add(at.1, way));
        }
    }
    let corner = |at: &(usize, Vec3)| at.0 != 2 || norm(at.1) > 2.0 * (BEND / 2.0).sin();
    let corners = about.iter().filter(|a| corner(a.1));
    let mut corners: Vec<(u32, usize)> = corners.map(|(v, at)| (*v, at.0)).collect();
    corners.sort_unstable();
    let place = |(v, count): (u32, usize)| (mesh.vertices[v as usize], count);
    creases.corners = corners.into_iter().map(place).collect();
    creases
}
