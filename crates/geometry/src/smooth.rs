//! Better triangles: slivers and needles taken out of a closed mesh, every guarantee kept.
//!
//! A cut of a grid leaves triangles as thin as chance has it. Each triangle whose smallest angle is below [`GOAL`] is
//! worked on by three local changes, in this order, until nothing improves:
//!
//! - *flip*: its longest edge gives way to the other diagonal (C. L. Lawson, 1977);
//! - *merge*: the ends of its shortest edge become one vertex;
//! - *relocation*: a corner moves towards the middle of its neighbours (D. A. Field, Laplacian smoothing and Delaunay
//!   triangulations, 1988), or over the middle of an edge that it sees at too small an angle.
//!
//! A change is made only if the smallest angle of the triangles that it replaces grows, and
//!
//! - the mesh stays closed and manifold;
//! - sharp edges and borders of cuts stay: vertices move along them only from one vertex to another, and where they meet
//!   nothing moves; plane faces stay in their planes;
//! - no triangle turns by more than 45 degrees against the face that it stands for, unless an edge is merged that is
//!   negligible against the triangle's others;
//! - the new triangles meet no others, decided exactly for positions rounded to single precision.
//!
//! So the smallest angle of the mesh does not get smaller. (Of several needles at one place the first to be merged may leave
//! another one thinner, but of fewer.) Each change also keeps the enclosed volume: a vertex moves in the
//! plane normal to the area vector of its triangles, to which the volume is linear; what a flip or a sharp edge changes is
//! given back by the vertices around. A surface that was balanced against the chords of its triangles so stays balanced,
//! and vertices leave it by no more than such chords do: (2h)²κ/8 for curvature κ and edges h.
//!
//! All positions are rounded to single precision first, so that a file of either precision holds what was tested. The
//! work is done in one order, whatever the number of threads.

use schemars::JsonSchema;
use serde::Serialize;

use crate::fault::Fault;
use crate::math::Vec3;
use crate::measure::{self, TriangleQuality};
use crate::mesh::Mesh;
use crate::progress::{Progress, Stopped};
use crate::remesh::edited_mesh::single;
use crate::remesh::half_edge_mesh::HalfEdgeMesh;
use crate::remesh::{gathered, in_order};
use crate::surface_mesh::SurfaceMesh;

mod diagonals;
mod relocation;
mod short_edges;
mod volume_debt;
mod working_mesh;

use working_mesh::{WorkingMesh, sine};

/// The smallest angle, degrees, from which on a triangle is left as it is.
pub const GOAL: f64 = 25.0;
/// The smallest angle, degrees, below which the shortest edge of a triangle may be merged.
pub const POOR: f64 = 20.0;
/// Most times that all triangles are gone through.
const ROUNDS: usize = 8;
/// Triangles between two reports of progress.
const STRIDE: usize = 4096;

/// What smoothing did to the triangles of a mesh. Angles are the smallest of each triangle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SmoothReport {
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles: usize,
    /// Smallest angle before, degrees.
    pub smallest_angle_before: f64,
    /// Smallest angle after, degrees.
    pub smallest_angle: f64,
    /// 5th percentile of the smallest angles before, degrees.
    pub smallest_angle_p05_before: f64,
    /// 5th percentile of the smallest angles after, degrees.
    pub smallest_angle_p05: f64,
    /// Volume before, mm³.
    pub volume_before: f64,
    /// Volume after, mm³.
    pub volume: f64,
    /// Number of edges flipped.
    pub flipped: usize,
    /// Number of edges whose ends were merged.
    pub merged: usize,
    /// Number of moves of vertices.
    pub moved: usize,
}

/// The surface with better triangles.
///
/// Time and memory are linear in the mesh. Self-intersections that it has on entry stay; none is added.
///
/// # Errors
/// A mesh that is empty or not closed and manifold; an interruption.
pub fn smooth(surface: &SurfaceMesh, progress: &dyn Progress) -> Result<(SurfaceMesh, SmoothReport), Stopped> {
    let ordered = in_order(surface);
    let positions: Vec<Vec3> = ordered.mesh.vertices.iter().copied().map(single).collect();
    let rounded = Mesh { vertices: positions, triangles: ordered.mesh.triangles };
    let (half_edges, before) = sound(&rounded).map_err(Stopped::Refused)?;
    let volume = rounded.volume();
    let rounding = rounded.single_rounding();
    let all = rounded.triangles.len();
    let mut work = WorkingMesh::new(half_edges, rounded.vertices, &ordered.cut, rounding);
    let mut changes = [0; 3];
    let goal = GOAL.to_radians().sin();
    for round in 0..ROUNDS {
        let so_far: usize = changes.iter().sum();
        for t in 0..all {
            if t % STRIDE == 0 && !progress.step((round * all + t) as u64, (ROUNDS * all) as u64) {
                return Err(Stopped::Interrupted);
            }
            if work.mesh.half_edges.is_live(3 * t as u32) && sine(work.mesh.corners(t as u32)) < goal {
                improve(&mut work, t as u32, &mut changes);
            }
        }
        // A round that changes next to nothing is the last.
        if (changes.iter().sum::<usize>() - so_far) * 1000 < all {
            break;
        }
    }
    work.settle();
    let made = gathered(&work.mesh, &ordered.cut);
    let after = measure::quality(&made.mesh).unwrap_or(before);
    let [flipped, merged, moved] = changes;
    let report = SmoothReport {
        triangles_before: all,
        triangles: made.mesh.triangles.len(),
        smallest_angle_before: before.smallest_angle,
        smallest_angle: after.smallest_angle,
        smallest_angle_p05_before: before.smallest_angle_p05,
        smallest_angle_p05: after.smallest_angle_p05,
        volume_before: volume,
        volume: made.mesh.volume(),
        flipped,
        merged,
        moved,
    };
    Ok((made, report))
}

/// Makes the first change that improves triangle `t`, and counts it.
fn improve(work: &mut WorkingMesh, t: u32, changes: &mut [usize; 3]) {
    let corners = work.mesh.corners(t);
    let length = |k: usize| {
        let d = crate::math::sub(corners[(k + 1) % 3], corners[k]);
        crate::math::dot(d, d)
    };
    let mut sides = [0usize, 1, 2];
    sides.sort_by(|a, b| length(*a).total_cmp(&length(*b)));
    let edge = |k: usize| 3 * t + k as u32;
    if work.flip(edge(sides[2])) {
        changes[0] += 1;
        return;
    }
    if sine(corners) < POOR.to_radians().sin() && work.merge(edge(sides[0])) {
        changes[1] += 1;
        return;
    }
    for k in 0..3 {
        let v = work.mesh.half_edges.triangles[t as usize][k];
        if work.relocate(v) {
            changes[2] += 1;
            return;
        }
    }
}

/// The half-edge structure and the quality of a closed mesh; otherwise what it lacks.
fn sound(mesh: &Mesh) -> Result<(HalfEdgeMesh, TriangleQuality), Fault> {
    let refuse = |what: &str| {
        Err(Fault::new("", format!("a mesh that is to be smoothed must be closed and manifold; this one {what}")))
    };
    let Some(quality) = measure::quality(mesh) else { return refuse("has no triangles") };
    if mesh.triangles.len() as u64 * 3 >= u64::from(u32::MAX) {
        return refuse("has more than 1.4e9 triangles, too many");
    }
    let Some(half_edges) = HalfEdgeMesh::new(mesh.triangles.clone(), mesh.vertices.len()) else {
        return refuse("has edges with other than two triangles of opposite direction");
    };
    if measure::non_manifold_vertices(mesh) > 0 {
        return refuse("has vertices where surfaces touch");
    }
    Ok((half_edges, quality))
}

#[cfg(test)]
mod tests;
