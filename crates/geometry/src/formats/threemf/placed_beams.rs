//! The beam lattices of a 3MF file, where its build has them.

use super::beam_lattice::Cap;
use super::model::PlacedObject;
use super::read::{ObjectFilter, place_all};
use crate::fault::{Fault, counted};
use crate::formats::graphs::BeamGraph;
use crate::math::{Mat3, determinant, dot, norm, sub};

/// How far a placement may be from a similarity: files give some seven digits.
const SIMILAR: f64 = 1e-4;

/// Reads the beams that the build places, in mm; if it places none, all where they are defined. Meshes are left out.
pub fn read_beam_lattice(bytes: &[u8]) -> Result<BeamGraph, Fault> {
    let placed = lattices(bytes, ObjectFilter::Placed)?;
    if !placed.beams.is_empty() {
        return Ok(placed);
    }
    let mut defined = lattices(bytes, ObjectFilter::Lattices)?;
    if defined.beams.is_empty() {
        return Err(Fault::new("", "the file has no beam lattice; a mesh is read as a region ([region.mesh])"));
    }
    defined.remarks.push("the build places no beams: read where they are defined".into());
    Ok(defined)
}

/// The beams of some of the objects.
fn lattices(bytes: &[u8], which: ObjectFilter) -> Result<BeamGraph, Fault> {
    let mut graph = BeamGraph { in_mm: true, ..BeamGraph::default() };
    let (mut short, mut clipped, mut triangles) = (0, 0, 0);
    place_all(bytes, which, &mut |placed: &PlacedObject| {
        let Some(lattice) = &placed.object.lattice else { return Ok(()) };
        let factor = similarity(&placed.matrix).ok_or_else(|| {
            Fault::new("", "a beam lattice is placed with a transform that is no similarity: round beams would be oval")
        })? * placed.unit;
        let first = graph.nodes.len() as u32;
        let mut balls = vec![f64::NAN; placed.vertices.len()];
        if lattice.mode == "all" {
            lattice.beams.iter().flat_map(|b| b.ends).for_each(|n| balls[n as usize] = lattice.ball_radius * factor);
        }
        if lattice.mode != "none" {
            let usual = |r: f64| if r.is_nan() { lattice.ball_radius } else { r };
            lattice.balls.iter().for_each(|(n, r)| balls[*n as usize] = usual(*r) * factor);
        }
        graph.nodes.extend(&placed.vertices);
        graph.radii.extend(balls);
        for beam in &lattice.beams {
            let [p, q] = beam.ends.map(|n| placed.object.vertices[n as usize]);
            if norm(sub(p, q)) < lattice.min_length {
                short += 1;
                continue;
            }
            graph.flat.push(beam.caps.map(|c| c != Cap::Sphere));
            graph.beams.push(beam.ends.map(|n| first + n));
            graph.beam_radii.push(beam.radii.map(|r| r * factor));
        }
        clipped += usize::from(lattice.clip.as_ref().is_some_and(|c| c.1 != "none"));
        triangles += placed.object.triangles.len();
        Ok(())
    })?;
    graph.drop_unused();
    for (count, what, done) in [
        (short, "beam", "shorter than the file's minlength left out"),
        (clipped, "mesh", "by which beams are clipped left out: the region cuts them"),
        (triangles, "triangle", "that are joined to beams left out"),
    ] {
        if count > 0 {
            graph.remarks.push(format!("{} {done}", counted(count, what)));
        }
    }
    Ok(graph)
}

/// By how much lengths grow under a similarity; `None` for another map.
fn similarity(m: &Mat3) -> Option<f64> {
    let factor = determinant(m).abs().cbrt();
    let column = |k: usize| [m[0][k], m[1][k], m[2][k]];
    let fits = |i: usize, j: usize| {
        let expected = if i == j { factor * factor } else { 0.0 };
        (dot(column(i), column(j)) - expected).abs() <= SIMILAR * factor * factor
    };
    (factor > 0.0 && (0..3).all(|i| (i..3).all(|j| fits(i, j)))).then_some(factor)
}
