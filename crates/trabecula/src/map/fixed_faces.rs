//! Faces of the region on which a phase is a whole number, so that the lattice ends there with whole cells.
//!
//! Of the nodes next to such a face each knows the phase on the face: its own, less what lies between along the normal. That is pulled to
//! a whole number by a heavy weight in the same least squares: on the largest face to the one nearest to its mean, on others so that as
//! many cells lie between as is nearest to what there were.

use super::integral::Problem;
use super::phase_target::SolveDomain;
use super::solution::Solution;
use super::spline::MapSpline;
use crate::field::Field;
use crate::region::Region;
use geometry::fault::{Fault, number, position};
use geometry::math::{Vec3, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;
use geometry::union_find::{labels, singles, unite};

/// Nodes count that are at most this many steps from a face.
const NEAR: f64 = 1.0;
/// What the phase on a face counts, relative to all differences at the node.
const PULL: f64 = 1e3;
/// The cosine of the greatest angle between the normals of adjacent nodes of one face, and of that between a face's normal and the
/// gradient of the phase that is fixed on it.
const SMOOTH: f64 = 0.8;
const ALONG: f64 = 0.866;
/// Share of the nodes of the largest face in a region below which another one there does not count.
const SLIVER: f64 = 0.25;
/// Solutions: what lies between a node and the face follows from the Jacobian of the last.
const PASSES: usize = 3;

/// A node next to a face.
struct Near {
    node: usize,
    /// Its signed distance from the surface, mm, and the outward normal.
    distance: f64,
    normal: Vec3,
}

/// A face, and the axis of the cell along its normal.
struct FixedFace {
    /// The number of its region among those given.
    index: usize,
    nodes: Vec<Near>,
    axis: usize,
    /// The mean phase on it before it is fixed, and the whole number that it gets.
    mean: f64,
    whole: f64,
}

/// The solution whose phases, `shift` added, are whole on the parts of the surface of `region` that lie in the regions of `fix`.
///
/// # Errors
/// A region that holds no part of the surface; cells that do not lie along a normal; faces too near to each other for a whole cell.
pub(super) fn fixed(
    problem: &Problem,
    domain: &SolveDomain,
    region: &dyn Field,
    fix: &[Region],
    shift: Vec3,
    solution: Solution,
) -> Result<Solution, Fault> {
    let mut faces = Vec::new();
    for (i, of) in fix.iter().enumerate() {
        faces.extend(faces_in(domain, region, &**of, i)?.into_iter().map(|nodes| face(nodes, domain, &solution, i)));
    }
    let mut faces = faces.into_iter().collect::<Result<Vec<FixedFace>, Fault>>()?;
    for face in &mut faces {
        let sum: f64 = face.nodes.iter().map(|n| on_face(n, face.axis, domain, &solution, shift)).sum();
        face.mean = sum / face.nodes.len() as f64;
    }
    (0..3).for_each(|axis| number_faces(&mut faces, axis));
    check_apart(&faces, domain)?;
    let mut solution = solution;
    for _ in 0..PASSES {
        checkpoint();
        let mut values = solution.spline.at_nodes();
        for (axis, values) in values.iter_mut().enumerate() {
            let (mut mass, mut off) = (vec![0.0; values.len()], vec![0.0; values.len()]);
            for face in faces.iter().filter(|f| f.axis == axis) {
                for n in &face.nodes {
                    (mass[n.node], off[n.node]) = (PULL, face.whole - on_face(n, axis, domain, &solution, shift));
                }
            }
            if mass.iter().any(|m| *m > 0.0) {
                let change = problem.pulled(axis, mass, &off);
                values.iter_mut().zip(change).for_each(|(v, d)| *v += d);
            }
        }
        solution =
            Solution { spline: MapSpline::through(domain.grid, values), winding: solution.winding, branches: None };
    }
    Ok(solution)
}

/// Gives the faces along an axis their whole numbers. A phase may be moved by any constant: what counts is how many cells there are
/// between faces, from the largest one on.
fn number_faces(faces: &mut [FixedFace], axis: usize) {
    let own = || faces.iter().filter(|f| f.axis == axis);
    let first = own().max_by_key(|f| f.nodes.len()).map_or(0.0, |f| f.mean);
    for face in faces.iter_mut().filter(|f| f.axis == axis) {
        face.whole = first.round() + (face.mean - first).round();
    }
}

/// Refuses two sides of a wall between which there is less than half a cell: no whole cell can be there.
fn check_apart(faces: &[FixedFace], domain: &SolveDomain) -> Result<(), Fault> {
    for (i, b) in faces.iter().enumerate() {
        let opposite = |a: &&FixedFace| {
            a.axis == b.axis && a.whole == b.whole && dot(a.nodes[0].normal, b.nodes[0].normal) < -SMOOTH
        };
        if let Some(a) = faces[..i].iter().find(opposite) {
            let message = format!(
                "only {:.2} cells lie between the face at {} and that of fix[{}] at {}: no whole cell can be there. Use smaller cells, or fix \
                 one of them only",
                (b.mean - a.mean).abs(),
                position(domain.nodes[b.nodes[0].node]),
                a.index,
                position(domain.nodes[a.nodes[0].node])
            );
            return Err(Fault::new(format!("fix[{}]", b.index), message));
        }
    }
    Ok(())
}

/// The phase on the face at the foot of a node.
fn on_face(near: &Near, axis: usize, domain: &SolveDomain, solution: &Solution, shift: Vec3) -> f64 {
    let p = domain.nodes[near.node];
    let mut u = [[0.0; 3]];
    solution.phases(&[p], &mut u);
    u[0][axis] + shift[axis] - near.distance * dot(solution.jacobian(p)[axis], near.normal)
}

/// A face, with the axis whose phase changes most along its normal.
fn face(nodes: Vec<Near>, domain: &SolveDomain, solution: &Solution, index: usize) -> Result<FixedFace, Fault> {
    let mut along = [0.0; 3];
    for n in &nodes {
        let j = solution.jacobian(domain.nodes[n.node]);
        (0..3).for_each(|i| along[i] += dot(j[i], n.normal).abs() / norm(j[i]) / nodes.len() as f64);
    }
    let axis = (0..3).fold(0, |m, i| if along[i] > along[m] { i } else { m });
    if along[axis] < ALONG {
        let degrees = along[axis].min(1.0).acos().to_degrees();
        let message = format!(
            "no axis of the cells is along the normal of the surface at {}: the nearest is {degrees:.0} degrees off, and at most {:.0} can be \
             taken. Turn the cells along it (align = \"surface\", direction), or leave it out",
            position(domain.nodes[nodes[0].node]),
            ALONG.acos().to_degrees()
        );
        return Err(Fault::new(format!("fix[{index}]"), message));
    }
    Ok(FixedFace { index, nodes, axis, mean: 0.0, whole: 0.0 })
}

/// The faces of the surface that lie in a region, by the nodes next to each, without slivers.
fn faces_in(domain: &SolveDomain, region: &dyn Field, of: &dyn Field, index: usize) -> Result<Vec<Vec<Near>>, Fault> {
    let (grid, reach) = (&domain.grid, NEAR * domain.longest());
    let close: Vec<usize> = (0..grid.len()).filter(|n| domain.depth[*n].abs() <= reach).collect();
    let points: Vec<Vec3> = close.iter().map(|n| domain.nodes[*n]).collect();
    let (mut distance, mut gradient) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    region.gradients(&points, &mut distance, &mut gradient);
    let feet: Vec<Vec3> = points.iter().zip(&distance).zip(&gradient).map(|((p, d), g)| foot(*p, *d, *g)).collect();
    let mut inside = vec![0.0; points.len()];
    of.values(&feet, &mut inside);
    let mut at = vec![usize::MAX; grid.len()];
    let mut found: Vec<Near> = Vec::new();
    for (i, node) in close.into_iter().enumerate() {
        if inside[i] <= 0.0 && norm(gradient[i]) > 0.5 {
            at[node] = found.len();
            found.push(Near { node, distance: distance[i], normal: unit(gradient[i]) });
        }
    }
    if found.is_empty() {
        let message = format!(
            "the region holds no part of the surface that the phase grid sees (steps of {} mm); give one that the face lies in",
            number(domain.longest())
        );
        return Err(Fault::new(format!("fix[{index}]"), message));
    }
    let mut faces = parts(domain, found, &at);
    // A region about a face holds slivers of those next to it too.
    let least = faces.iter().map(Vec::len).max().unwrap_or(0) as f64 * SLIVER;
    faces.retain(|f| f.len() as f64 >= least);
    Ok(faces)
}

/// The point of the surface nearest to one.
fn foot(p: Vec3, distance: f64, gradient: Vec3) -> Vec3 {
    sub(p, scale(gradient, distance / dot(gradient, gradient).max(f64::MIN_POSITIVE)))
}

/// Nodes by the face that they are next to: adjacent ones with nearly the same normal.
fn parts(domain: &SolveDomain, found: Vec<Near>, at: &[usize]) -> Vec<Vec<Near>> {
    let mut root = singles(found.len());
    for (i, near) in found.iter().enumerate() {
        let index = domain.grid.index(near.node);
        for (a, stride) in domain.grid.strides().into_iter().enumerate() {
            if index[a] + 1 == domain.grid.shape[a] {
                continue;
            }
            let j = at[near.node + stride];
            if j != usize::MAX && dot(near.normal, found[j].normal) > SMOOTH {
                unite(&mut root, i as u32, j as u32);
            }
        }
    }
    let (label, count) = labels(&mut root);
    let mut faces: Vec<Vec<Near>> = (0..count).map(|_| Vec::new()).collect();
    found.into_iter().zip(label).for_each(|(near, face)| faces[face as usize].push(near));
    faces
}
