//! The edges of a mesh at which it turns.

use std::collections::HashMap;

use crate::distance::triangle::normal;
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, ends};
use crate::union_find;

/// A straight piece of a crease.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its ends, mm.
    pub ends: [Vec3; 2],
    /// The angle by which the normal turns across it, radians.
    pub turn: f64,
    /// Length of the straight line that it makes together with its neighbours, mm.
    pub run: f64,
}

/// The creases of a surface: curves across which its normal is discontinuous.
#[derive(Debug, Default)]
pub struct Creases {
    /// Straight pieces.
    pub segments: Vec<Segment>,
    /// Points where creases end, meet or bend (mm), and the number of pieces there.
    pub corners: Vec<(Vec3, usize)>,
}

/// The least turn of the normal across a crease, radians (10°): below it a rounded edge is off by a twentieth of a step.
pub const TURN: f64 = 0.175;
/// Two creases that meet and turn by more than this, radians (20°), meet in a corner.
const BEND: f64 = 0.35;
/// Two that turn by less than this, radians (1°), are pieces of one straight line: rounding turns them by far less, and the
/// sides of what is round by more.
const STRAIGHT: f64 = 0.0175;

/// The creases that end at a vertex: how many, the sum of their directions, and the last of them.
#[derive(Clone, Copy, Default)]
struct VertexCreases {
    count: usize,
    sum: Vec3,
    last: u32,
}

impl VertexCreases {
    /// Whether two meet there and turn by no more than an angle.
    fn runs_on(&self, angle: f64) -> bool {
        self.count == 2 && norm(self.sum) <= 2.0 * (angle / 2.0).sin()
    }
}

/// The creases of a mesh: edges of two triangles whose normals differ.
pub fn creases(mesh: &Mesh) -> Creases {
    let mut creases = Creases::default();
    let mut about: HashMap<u32, VertexCreases> = HashMap::new();
    // Which creases go on in a straight line.
    let mut straight: Vec<(u32, [u32; 2])> = Vec::new();
    for edge in Edges::of(&mesh.triangles).each() {
        let [a, b] = edge else { continue };
        let [m, n] = [a, b].map(|h| normal(mesh.corners(*h as usize / 3)));
        let turn = norm(cross(m, n)).atan2(dot(m, n));
        if turn < TURN {
            continue;
        }
        let ends = ends(&mesh.triangles, *a);
        let [p, q] = ends.map(|v| mesh.vertices[v as usize]);
        let number = creases.segments.len() as u32;
        let along = sub(q, p);
        let run = norm(along);
        creases.segments.push(Segment { ends: [p, q], turn, run });
        let along = scale(along, 1.0 / run);
        for (v, way) in ends.into_iter().zip([along, scale(along, -1.0)]) {
            let at = about.entry(v).or_default();
            if at.count == 1 {
                straight.push((v, [at.last, number]));
            }
            *at = VertexCreases { count: at.count + 1, sum: add(at.sum, way), last: number };
        }
    }
    straight.retain(|(v, _)| about[v].runs_on(STRAIGHT));
    measure_runs(&mut creases.segments, straight.iter().map(|s| s.1));
    let corners = about.iter().filter(|a| !a.1.runs_on(BEND));
    let mut corners: Vec<(u32, usize)> = corners.map(|(v, at)| (*v, at.count)).collect();
    corners.sort_unstable();
    let place = |(v, count): (u32, usize)| (mesh.vertices[v as usize], count);
    creases.corners = corners.into_iter().map(place).collect();
    creases
}

/// Makes the run of each piece the length of all that go on in a straight line, pair by pair.
fn measure_runs(segments: &mut [Segment], pairs: impl Iterator<Item = [u32; 2]>) {
    let mut root: Vec<u32> = (0..segments.len() as u32).collect();
    for [a, b] in pairs {
        union_find::unite(&mut root, a, b);
    }
    let mut runs = vec![0.0; segments.len()];
    for (i, s) in (0..).zip(&*segments) {
        runs[union_find::find(&mut root, i) as usize] += s.run;
    }
    for (i, s) in (0..).zip(segments) {
        s.run = runs[union_find::find(&mut root, i) as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_on_a_straight_edge_leaves_its_run() {
        // A roof whose ridge is in three pieces, and its mirror image below: the outline bends, the ridges do not.
        let mesh = Mesh {
            vertices: vec![
                [0.0, 0.0, 1.0],
                [1.0, 0.0, 1.0],
                [3.0, 0.0, 1.0],
                [6.0, 0.0, 1.0],
                [3.0, 2.0, 0.0],
                [3.0, -2.0, 0.0],
            ],
            triangles: vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 4, 5], [3, 5, 4]],
        };
        let found = creases(&mesh);
        let of_ridge = |s: &&Segment| s.ends.iter().all(|p| p[1] == 0.0);
        let runs: Vec<f64> = found.segments.iter().filter(of_ridge).map(|s| s.run).collect();
        assert_eq!(runs, [6.0; 3]);
        let other = found.segments.iter().filter(|s| !of_ridge(s));
        assert!(other.clone().count() > 0);
        for s in other {
            assert_eq!(s.run, norm(sub(s.ends[1], s.ends[0])));
        }
    }
}
