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
//! All positions are rounded to single precision first, so that a file of either precision holds what was tested.
//!
//! A large mesh is cut into blocks of space (`blocks`) that are simplified apart from each other, each strictly within itself,
//! so that memory is bounded beyond the mesh itself and all processors have work. What the faces of the blocks hold back is
//! taken up by later passes, whose blocks lie elsewhere and, with fewer triangles left, are larger. Where a number of triangles
//! is asked for, all of the mesh is one block. The result is the same for any number of threads.

use std::borrow::Cow;
use std::collections::HashSet;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::fault::{Fault, counted, number};
use crate::measure;
use crate::mesh::Mesh;
use crate::progress::{Progress, Stage, Stopped};
use crate::remesh::edited_mesh::single;
use crate::remesh::half_edge_mesh::NONE;
use crate::surface_mesh::SurfaceMesh;

mod blocks;
mod bucket_queue;
mod collapse;
mod deviation;
mod error_quadric;
mod piece;

use blocks::Blocks;
use collapse::Simplification;
use piece::{BlockResult, PassState, Piece, Tracked};

/// Candidates between two reports of progress.
const STRIDE: u64 = 4096;

/// The shift of each pass's blocks, in edges, and the shares of the work between which it is done.
const PASSES: [(f64, [f64; 2]); 4] = [(0.0, [0.0, 0.8]), (0.5, [0.8, 0.9]), (0.25, [0.9, 0.95]), (0.7, [0.95, 1.0])];

/// How far a mesh is to be simplified. With both, whichever is reached first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// The most that any point of the surface may move, mm.
    pub tolerance: Option<f64>,
    /// The number of triangles to come down to.
    pub triangles: Option<usize>,
}

/// What simplification did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct SimplifyReport {
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles: usize,
    /// Proven bound of the distance between the two surfaces, in both directions, mm.
    pub deviation: f64,
    /// Volume before, mm³.
    pub volume_before: f64,
    /// Volume after, mm³.
    pub volume: f64,
    /// Area before, mm².
    pub area_before: f64,
    /// Area after, mm².
    pub area: f64,
}

/// The surface with fewer triangles.
///
/// A mesh that has no more triangles than asked for comes back as it is.
///
/// # Errors
/// A goal that is none; a mesh that is not closed, manifold and free of self-intersection after rounding to single
/// precision; an interruption.
pub fn simplify(
    surface: &SurfaceMesh,
    goal: &Goal,
    progress: &dyn Progress,
) -> Result<(SurfaceMesh, SimplifyReport), Stopped> {
    let (tolerance, target) = checked(goal).map_err(Stopped::Refused)?;
    let mesh = &surface.mesh;
    let size = |m: &Mesh| (m.triangles.len(), m.volume(), m.area());
    let before = size(mesh);
    let report = |after: (usize, f64, f64), deviation| SimplifyReport {
        triangles_before: before.0,
        triangles: after.0,
        deviation,
        volume_before: before.1,
        volume: after.1,
        area_before: before.2,
        area: after.2,
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
    if before.0 as u64 * 3 >= u64::from(u32::MAX) {
        return Err(Stopped::Refused(Fault::new(
            "",
            "a mesh has more than 1.4e9 triangles, too many to be simplified",
        )));
    }
    let mut state = PassState { surface: Cow::Borrowed(surface), known: None };
    for (pass, (shift, [from, to])) in PASSES.into_iter().enumerate() {
        let all = state.surface.mesh.triangles.len();
        let blocks = match target {
            0 => Blocks::new(&state.surface.mesh, shift, if pass == 0 { margin(mesh) } else { 0.0 }),
            _ => Blocks::one(all),
        };
        let last = blocks.count() == 1;
        let stage = Stage { whole: progress, from, to: if last { 1.0 } else { to } };
        let done = run(&state, &blocks, tolerance, target, &stage)?;
        state = joined(&state.surface.mesh, done);
        if last {
            break;
        }
    }
    let made = state.surface.into_owned();
    let displacements = state.known.iter().flat_map(|k| &k.displacements);
    let deviation = displacements.fold(0.0, |m, d| f64::max(m, d.longest()));
    let report = report(size(&made.mesh), deviation);
    Ok((made, report))
}

/// The width of what must be known around a block to tell its sharp edges: a few edges, mm.
fn margin(mesh: &Mesh) -> f64 {
    const EDGES: f64 = 4.0;
    EDGES * (mesh.area() / mesh.triangles.len().max(1) as f64).sqrt() * 1.52
}

/// Simplifies all blocks.
fn run(
    state: &PassState,
    blocks: &Blocks,
    tolerance: f64,
    target: usize,
    progress: &dyn Progress,
) -> Result<Vec<BlockResult>, Stopped> {
    let vertices = state.surface.mesh.vertices.len();
    let all = state.surface.mesh.triangles.len();
    // Three candidates a vertex, and six more for each one that goes.
    let likely = 9 * all as u64 / 2;
    let total = Mutex::new(0u64);
    let step = |tried: u64, of: Option<(usize, usize)>| {
        // Under the lock, so that progress rises.
        let mut total = total.lock().unwrap_or_else(PoisonError::into_inner);
        *total += tried;
        match of {
            Some((done, all)) => progress.step(done as u64, all as u64),
            None => progress.step((*total).min(likely), likely),
        }
    };
    // Tables of names, one a thread.
    let tables: Mutex<Vec<Vec<u32>>> = Mutex::new(Vec::new());
    let simplified = |b: usize| -> Result<BlockResult, Stopped> {
        let table = tables.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut names = table.unwrap_or_else(|| vec![NONE; vertices]);
        let piece = Piece::new(&state.surface, blocks, b, &mut names);
        tables.lock().unwrap_or_else(PoisonError::into_inner).push(names);
        let half_edges = match state.known {
            None => piece.sound(&blocks.around(b)),
            Some(_) => piece.linked(),
        };
        let half_edges = half_edges.ok_or_else(|| Stopped::Refused(unsound(&state.surface.mesh)))?;
        let (mesh, motion) = piece.start(state, half_edges);
        let mut work = Simplification::new(mesh, motion, tolerance);
        let mut tried = 0u64;
        while work.mesh.count > target && work.step().is_some() {
            tried += 1;
            let reached = (target > 0).then(|| (all - work.mesh.count, all - target));
            if tried.is_multiple_of(STRIDE) && !step(STRIDE, reached) {
                return Err(Stopped::Interrupted);
            }
        }
        Ok(piece.finish(&work, blocks, b))
    };
    let occupied: Vec<usize> = (0..blocks.count()).filter(|b| !blocks.members(*b).is_empty()).collect();
    occupied.into_par_iter().map(simplified).collect()
}

/// The surface that blocks make up, whose vertices were those of `before`.
fn joined(before: &Mesh, done: Vec<BlockResult>) -> PassState<'static> {
    let mut names = vec![NONE; before.vertices.len()];
    let mut surface = SurfaceMesh::default();
    let mut known = Tracked::default();
    let mut all_moved = Vec::new();
    for block in done {
        for triangle in &block.triangles {
            surface.mesh.triangles.push(triangle.map(|v| {
                let name = &mut names[v as usize];
                if *name == NONE {
                    *name = surface.mesh.vertices.len() as u32;
                    surface.mesh.vertices.push(single(before.vertices[v as usize]));
                }
                *name
            }));
        }
        surface.cut.extend_from_slice(&block.cut);
        known.kept.extend_from_slice(&block.kept);
        known.displacements.extend_from_slice(&block.displacements);
        all_moved.push(block.moved);
    }
    known.kept_moved = vec![0.0; surface.mesh.vertices.len()];
    for (v, position, kept_moved) in all_moved.iter().flatten() {
        let name = names[*v as usize] as usize;
        surface.mesh.vertices[name] = *position;
        known.kept_moved[name] = *kept_moved;
    }
    PassState { surface: Cow::Owned(surface), known: Some(known) }
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

/// What keeps a mesh from being simplified.
fn unsound(mesh: &Mesh) -> Fault {
    let refuse = |what: String| {
        Fault::new(
            "",
            format!(
                "a mesh must be closed, manifold and free of self-intersection, after rounding to single precision; this one has {what}"
            ),
        )
    };
    let mesh =
        &Mesh { vertices: mesh.vertices.iter().map(|p| single(*p)).collect(), triangles: mesh.triangles.clone() };
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
    let d = measure::defects(mesh);
    let pinched = measure::non_manifold_vertices(mesh);
    if d.open_edges + d.crowded_edges + d.flipped_edges + pinched > 0 {
        return refuse(format!(
            "{} with one triangle, {} with more than two, {} with two of the same direction, {pinched} non-manifold vertices",
            counted(d.open_edges, "edge"),
            d.crowded_edges,
            d.flipped_edges,
        ));
    }
    const SHOWN: usize = 1000;
    let crossings = measure::self_intersections(mesh, SHOWN);
    let or_more = if crossings == SHOWN { " or more" } else { "" };
    refuse(format!(
        "{crossings}{or_more} intersecting pairs of triangles and {} triangles of zero area",
        d.degenerate_triangles
    ))
}
