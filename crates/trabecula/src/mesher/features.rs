//! Feature edges and corners of the region: nodes near them are moved onto them.
//!
//! If the tangent planes of the region near a node differ, they meet in a point or a line, and the node moves to the
//! nearest point on all of them: the least squares of dual contouring (Ju et al. 2002).

use rayon::prelude::*;

use super::work::Work;
use crate::field::Field;
use geometry::math::{Mat3, Vec3, add, apply, cross, dot, norm, scale, sub};

/// Normals that differ by less than this (degrees) belong to one smooth face.
const SMOOTH: f64 = 25.0;
/// Maximum displacement of a node, as a fraction of its shortest boundary edge.
const REACH: f64 = 0.9;
/// Scale of the second sampling relative to the first: there a smooth bend is flat and an edge is not.
const CLOSER: f64 = 0.1;

/// A tangent plane of the region: a point and its normal.
pub(super) type Plane = (Vec3, Vec3);

/// Moves boundary nodes onto feature edges and corners of the region, if no tetrahedron gets worse than `least` or than
/// the worst at its node was.
pub(super) fn features(work: &mut Work, least: f64) {
    let (region, mesh) = (work.region, &work.mesh);
    let faces = mesh.boundary_faces();
    let points: Vec<Vec3> = faces
        .iter()
        .map(|f| scale(f.iter().fold([0.0; 3], |s, n| add(s, mesh.nodes[*n as usize])), 1.0 / 3.0))
        .collect();
    let planes = touching(region, &points);
    let mut at: Vec<Vec<u32>> = vec![Vec::new(); mesh.nodes.len()];
    for (i, f) in faces.iter().enumerate() {
        f.iter().for_each(|n| at[*n as usize].push(i as u32));
    }
    let nodes: Vec<usize> = (0..mesh.nodes.len())
        .filter(|n| !at[*n].is_empty() && work.held[*n] == 0 && !work.bars(mesh.nodes[*n]))
        .collect();
    let mut moves: Vec<(usize, f64, usize, Vec3)> = nodes
        .into_par_iter()
        .filter_map(|n| {
            let p = mesh.nodes[n];
            let near: Vec<Plane> = at[n].iter().map(|f| planes[*f as usize]).collect();
            let (target, rank) = meeting(region, p, &near)?;
            let others = at[n].iter().flat_map(|f| faces[*f as usize]).filter(|m| *m as usize != n);
            let shortest = others.map(|m| norm(sub(mesh.nodes[m as usize], p))).fold(f64::INFINITY, f64::min);
            let distance = norm(sub(target, p));
            let near = distance < REACH * shortest && region.value(target).abs() < 0.02 * shortest;
            near.then_some((rank, distance / shortest, n, target))
        })
        .collect();
    moves.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    for (rank, _, n, target) in moves {
        let bar = least.min(work.worst(n).0);
        let old = core::mem::replace(&mut work.mesh.nodes[n], target);
        if work.worst(n).0 < bar {
            work.mesh.nodes[n] = old;
        } else {
            work.held[n] = rank;
        }
    }
}

/// The point nearest to `p` where tangent planes of the region near it meet, and the number of constrained directions;
/// `None` if they belong to one smooth face.
pub(super) fn meeting(region: &dyn Field, p: Vec3, near: &[Plane]) -> Option<(Vec3, usize)> {
    let near = distinct(near)?;
    let (first, _) = nearest(p, &near);
    let closer: Vec<Vec3> = near.iter().map(|(q, _)| add(first, scale(sub(*q, first), CLOSER))).collect();
    Some(nearest(first, &distinct(&touching(region, &closer))?))
}

/// The tangent planes of the region nearest to points.
pub(super) fn touching(region: &dyn Field, points: &[Vec3]) -> Vec<Plane> {
    const BATCH: usize = 256;
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    v.par_chunks_mut(BATCH)
        .zip(g.par_chunks_mut(BATCH))
        .zip(points.par_chunks(BATCH))
        .for_each(|((v, g), p)| region.gradients(p, v, g));
    let foot = points.iter().zip(&v).zip(&g);
    foot.map(|((p, v), g)| (sub(*p, scale(*g, *v)), *g)).collect()
}

/// One plane per normal direction; `None` if all belong to one smooth face.
fn distinct(planes: &[Plane]) -> Option<Vec<Plane>> {
    let alike = (SMOOTH / 2.0).to_radians().cos();
    let mut kept: Vec<Plane> = Vec::new();
    for (q, n) in planes {
        if kept.iter().all(|(_, m)| dot(*n, *m) < alike) {
            kept.push((*q, *n));
        }
    }
    let differ = SMOOTH.to_radians().cos();
    let edge = kept.iter().any(|(_, n)| dot(*n, kept[0].1) < differ);
    edge.then_some(kept)
}

/// The point nearest to `p` on all planes, and the number of constrained directions.
fn nearest(p: Vec3, planes: &[Plane]) -> (Vec3, usize) {
    // Two planes: their line. More: least squares, by the system of the three that differ most.
    let n = |i: usize| planes[i].1;
    let mut best = (0.0, [0, 1, 1]);
    for i in 0..planes.len() {
        for j in 0..i {
            for k in 0..j {
                let volume = dot(cross(n(i), n(j)), n(k)).abs();
                if volume > best.0 {
                    best = (volume, [i, j, k]);
                }
            }
        }
    }
    let away = |i: usize| dot(n(i), sub(planes[i].0, p));
    // Three planes closer than this belong to a curved edge.
    if best.0 > 0.2 {
        let [i, j, k] = best.1;
        let m: Mat3 = [n(i), n(j), n(k)];
        let d = [away(i), away(j), away(k)];
        return (add(p, apply(&geometry::math::inverse(&m), d)), 3);
    }
    let mut pair = (f64::INFINITY, [0, 0]);
    for i in 0..planes.len() {
        for j in 0..i {
            let c = dot(n(i), n(j));
            if c < pair.0 {
                pair = (c, [i, j]);
            }
        }
    }
    let [i, j] = pair.1;
    let c = dot(n(i), n(j));
    let s = 1.0 - c * c;
    if s < 1e-6 {
        return (p, 0);
    }
    let (a, b) = (away(i), away(j));
    let (x, y) = ((a - c * b) / s, (b - c * a) / s);
    (add(p, add(scale(n(i), x), scale(n(j), y))), 2)
}
