//! Lighter meshes: fewer triangles, within a stated distance, every guarantee kept.
//!
//! Edges are taken away one by one, in the order of what it costs by quadrics, each replaced by the vertex of least cost
//! that keeps the volume. A collapse is done only if
//!
//! - the mesh stays closed and manifold: the ends have no common neighbours but the two corners opposite the edge;
//! - no new triangle is a needle, or folds;
//! - sharp edges and borders of cuts stay: they are shortened along themselves, and where they meet nothing moves;
//! - no point of the surface has moved farther than the tolerance from where it started (see `deviation`: a proof, and so
//!   a bound of the distance in both directions);
//! - the new triangles meet no others, decided exactly for positions rounded to single precision.
//!
//! All positions are rounded to single precision first, so that a file of either precision holds what was tested. The
//! work is done in one order, whatever the number of threads.

use std::collections::HashSet;

use crate::fault::{Fault, counted, number};
use crate::math::Vec3;
use crate::measure;
use crate::mesh::Mesh;
use crate::progress::{Progress, Stopped};
use crate::remesh::half_edge_mesh::HalfEdgeMesh;
use crate::remesh::{gathered, in_order};
use crate::surface_mesh::SurfaceMesh;

mod bucket_queue;
mod collapse;
mod deviation;
mod error_quadric;

use collapse::Simplification;

/// Candidates between two reports of progress.
const STRIDE: u64 = 4096;

/// How far a mesh is to be simplified. With both, whichever is reached first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// The most that any point of the surface may move, mm.
    pub tolerance: Option<f64>,
    /// The number of triangles to come down to.
    pub triangles: Option<usize>,
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Triangles before and after.
    pub triangles: [usize; 2],
    /// A proven bound of the distance between the two surfaces, in both directions, mm.
    pub deviation: f64,
    /// Volume before and after, mm³.
    pub volume: [f64; 2],
    /// Area before and after, mm².
    pub area: [f64; 2],
}

/// The surface with fewer triangles.
///
/// A mesh that has no more triangles than asked for comes back as it is.
///
/// # Errors
/// A goal that is none; a mesh that is not closed, manifold and free of self-intersection after rounding to single
/// precision; an interruption.
pub fn simplify(surface: &SurfaceMesh, goal: &Goal, progress: &dyn Progress) -> Result<(SurfaceMesh, Report), Stopped> {
    let (tolerance, target) = checked(goal).map_err(Stopped::Refused)?;
    let mesh = &surface.mesh;
    let size = |m: &Mesh| (m.triangles.len(), m.volume(), m.area());
    let before = size(mesh);
    let report = |after: (usize, f64, f64), deviation| Report {
        triangles: [before.0, after.0],
        deviation,
        volume: [before.1, after.1],
        area: [before.2, after.2],
    };
    if before.0 <= target {
        return Ok((surface.clone(), report(before, 0.0)));
    }
    let rounding = mesh.single_rounding();
    if tolerance < 2.0 * rounding {
        return Err(Stopped::Refused(Fault::new(
            "tolerance",
            format!(
                "{} mm is less than single precision resolves in a mesh of this size; use {} mm or more",
                number(tolerance),
                number(4.0 * rounding)
            ),
        )));
    }
    let ordered = in_order(surface);
    let exact = &ordered.mesh.vertices;
    let positions: Vec<Vec3> = exact.iter().map(|p| p.map(|x| f64::from(x as f32) + 0.0)).collect();
    let rounded = Mesh { vertices: positions, triangles: ordered.mesh.triangles.clone() };
    let half_edges = sound(&rounded).map_err(Stopped::Refused)?;
    let mut work = Simplification::new(half_edges, rounded.vertices, exact, &ordered.cut, tolerance);
    // Three candidates a vertex, and six more for each one that goes.
    let likely = 9 * before.0 as u64 / 2;
    let mut tried = 0u64;
    while work.count > target && work.step().is_some() {
        tried += 1;
        if tried.is_multiple_of(STRIDE) {
            let (done, total) = if target > 0 {
                ((before.0 - work.count) as u64, (before.0 - target) as u64)
            } else {
                (tried, likely.max(tried))
            };
            if !progress.step(done, total) {
                return Err(Stopped::Interrupted);
            }
        }
    }
    let deviation = work.deviation();
    let made = gathered(&work.half_edges, &work.positions, &ordered.cut);
    let report = report(size(&made.mesh), deviation);
    Ok((made, report))
}

/// The tolerance and the number of triangles of a goal.
fn checked(goal: &Goal) -> Result<(f64, usize), Fault> {
    if goal.tolerance.is_none() && goal.triangles.is_none() {
        return Err(Fault::new("", "no goal is set: give a tolerance (mm), a number of triangles, or both"));
    }
    let tolerance = goal.tolerance.unwrap_or(f64::INFINITY);
    if goal.tolerance.is_some_and(|t| !(t.is_finite() && t > 0.0)) {
        return Err(Fault::new(
            "tolerance",
            format!("is {}; it must be a finite length greater than 0, mm", number(tolerance)),
        ));
    }
    let target = goal.triangles.unwrap_or(0);
    if goal.triangles.is_some() && target < 4 {
        return Err(Fault::new("triangles", format!("is {target}; a closed mesh has at least 4")));
    }
    Ok((tolerance, target))
}

/// The half-edge structure of a valid mesh; otherwise its defects.
fn sound(mesh: &Mesh) -> Result<HalfEdgeMesh, Fault> {
    let refuse = |what: String| {
        Err(Fault::new(
            "",
            format!(
                "a mesh must be closed, manifold and free of self-intersection, after rounding to single precision; this one has {what}"
            ),
        ))
    };
    if mesh.triangles.len() as u64 * 3 >= u64::from(u32::MAX) {
        return refuse("more than 1.4e9 triangles, too many".into());
    }
    let mut used = vec![false; mesh.vertices.len()];
    for &v in mesh.triangles.iter().flatten() {
        used[v as usize] = true;
    }
    let positions: HashSet<[u64; 3]> =
        (0..used.len()).filter(|v| used[*v]).map(|v| mesh.vertices[v].map(f64::to_bits)).collect();
    let n = used.iter().filter(|u| **u).count();
    if positions.len() < n {
        return refuse(format!("{} at the position of another vertex", counted(n - positions.len(), "duplicate")));
    }
    let half_edges = HalfEdgeMesh::new(mesh.triangles.clone(), mesh.vertices.len());
    let pinched = measure::non_manifold_vertices(mesh);
    let (Some(half_edges), 0) = (half_edges, pinched) else {
        let d = measure::defects(mesh);
        return refuse(format!(
            "{} with one triangle, {} with more than two, {} with two of the same direction, {pinched} non-manifold vertices",
            counted(d.open_edges, "edge"),
            d.crowded_edges,
            d.flipped_edges,
        ));
    };
    const SHOWN: usize = 1000;
    let crossings = measure::self_intersections(mesh, SHOWN);
    let flat = measure::defects(mesh).degenerate_triangles;
    if crossings > 0 || flat > 0 {
        let or_more = if crossings == SHOWN { " or more" } else { "" };
        return refuse(format!(
            "{crossings}{or_more} intersecting pairs of triangles and {flat} triangles of zero area"
        ));
    }
    Ok(half_edges)
}
