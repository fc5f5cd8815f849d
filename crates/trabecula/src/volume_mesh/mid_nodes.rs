//! Nodes on the edges of quadratic tetrahedra: those of boundary edges lie on the surface.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::conforming_tets::edge_images;
use crate::conforming_tets::{SurfaceSet, members, only, onto};
use crate::implicit::Surface;
use geometry::fe_mesh::{Pair, jacobian};
use geometry::math::{Vec3, add, norm, scale, sub};
use geometry::tetmesh::{EDGES, volume};

/// Greatest distance of a node from the midpoint of its edge, as a fraction of the edge.
const REACH: f64 = 0.2;
/// The least det J at corners and edges, as a fraction of that of the straight tetrahedron.
const LEAST: f64 = 0.2;

/// What was made.
pub(super) struct MidNodes {
    pub nodes: Vec<Vec3>,
    /// The edge of each, by corners.
    pub edges: Vec<[u32; 2]>,
    /// Those of each tetrahedron, numbered from 0, in the order of `EDGES`.
    pub of: Vec<[u32; 6]>,
    /// Edges that stayed straight because a tetrahedron would be distorted.
    pub straight: usize,
}

/// The nodes on all edges; `faces` are those on surfaces, each with its surfaces.
pub(super) fn mid_nodes(
    surfaces: &[Surface],
    corners: &[Vec3],
    next: &[u32],
    tets: &[[u32; 4]],
    faces: &[([u32; 3], SurfaceSet)],
) -> MidNodes {
    let sorted = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut edges: Vec<[u32; 2]> = tets.par_iter().flat_map_iter(|t| EDGES.map(|[a, b]| sorted(t[a], t[b]))).collect();
    edges.par_sort_unstable();
    edges.dedup();
    let number = |e: [u32; 2]| edges.binary_search(&e).unwrap_or(0) as u32;
    let mut on = vec![0; edges.len()];
    for ([a, b, c], set) in faces {
        for e in [sorted(*a, *b), sorted(*b, *c), sorted(*a, *c)] {
            on[number(e) as usize] |= set;
        }
    }
    let middle = |[a, b]: [u32; 2]| scale(add(corners[a as usize], corners[b as usize]), 0.5);
    // Edges with images move as the first of them.
    let first = |e: [u32; 2]| {
        let images = edge_images(corners, next, e).into_iter().map(|[a, b]| sorted(a, b));
        images.filter(|o| edges.binary_search(o).is_ok()).fold(e, |m, o| m.min(o))
    };
    let shift = |i: usize| -> Vec3 {
        let own = first(edges[i]);
        let set: SurfaceSet = on[number(own) as usize];
        if members(set).all(|s| surfaces[s].plane.is_some()) {
            return [0.0; 3];
        }
        let [p, q] = own.map(|n| corners[n as usize]);
        let to = onto(surfaces, set, middle(own), REACH * norm(sub(p, q)));
        // Where the surface leaves the region through a plane, chords end in the plane.
        let others = (0..).zip(surfaces).filter(|(s, _)| set & only(*s) == 0);
        let planes = others.filter_map(|(_, surface)| surface.bounding_plane());
        let stays = |to: &Vec3| planes.clone().all(|plane| !plane.is_left(middle(own), *to));
        to.filter(stays).map_or([0.0; 3], |to| sub(to, middle(own)))
    };
    let mut shifts: Vec<Vec3> = (0..edges.len()).into_par_iter().map(shift).collect();
    let of: Vec<[u32; 6]> = tets.par_iter().map(|t| EDGES.map(|[a, b]| number(sorted(t[a], t[b])))).collect();
    let mut straight = 0;
    loop {
        let distorted = |i: usize| {
            let p = tets[i].map(|n| corners[n as usize]);
            if of[i].iter().all(|e| shifts[*e as usize] == [0.0; 3]) {
                return false;
            }
            let ten: [Vec3; 10] = core::array::from_fn(|k| match k {
                0..4 => p[k],
                _ => {
                    let [a, b] = EDGES[k - 4];
                    add(scale(add(p[a], p[b]), 0.5), shifts[of[i][k - 4] as usize])
                }
            });
            let corner = |c: usize| core::array::from_fn(|k| f64::from(u8::from(k == c)));
            let half = |[a, b]: [usize; 2]| core::array::from_fn(|k| if k == a || k == b { 0.5 } else { 0.0 });
            let least = (0..4).map(corner).chain(EDGES.map(half)).map(|at| jacobian(&ten, at));
            least.fold(f64::INFINITY, f64::min) < LEAST * 6.0 * volume(p)
        };
        let bad: Vec<usize> = (0..tets.len()).into_par_iter().filter(|i| distorted(*i)).collect();
        if bad.is_empty() {
            break;
        }
        let wrong: FxHashSet<u32> = bad.into_iter().flat_map(|i| of[i]).collect();
        let mut all: Vec<u32> = wrong.into_iter().filter(|e| shifts[*e as usize] != [0.0; 3]).collect();
        let twins: Vec<u32> = all
            .iter()
            .flat_map(|e| edge_images(corners, next, edges[*e as usize]))
            .map(|[a, b]| number(sorted(a, b)))
            .collect();
        all.extend(twins);
        all.sort_unstable();
        all.dedup();
        straight += all.len();
        all.into_iter().for_each(|e| shifts[e as usize] = [0.0; 3]);
    }
    let nodes = edges.iter().zip(&shifts).map(|(e, by)| add(middle(*e), *by)).collect();
    MidNodes { nodes, edges, of, straight }
}

/// Pairs of edges' nodes, numbered from 0: each is tied to that of the image that lies in no upper plane. `along` says in which upper
/// planes a corner lies.
pub(super) fn tied(mids: &MidNodes, corners: &[Vec3], next: &[u32], along: impl Fn(u32) -> [bool; 3]) -> Vec<Pair> {
    let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let both = |[a, b]: [u32; 2]| -> [bool; 3] { core::array::from_fn(|k| along(a)[k] && along(b)[k]) };
    let mut out = Vec::new();
    for (node, e) in (0..).zip(&mids.edges) {
        if both(*e) == [false; 3] {
            continue;
        }
        let image = edge_images(corners, next, *e).into_iter().find(|e| both(*e) == [false; 3]);
        let number = image.and_then(|e| mids.edges.binary_search(&sorted(e)).ok());
        out.extend(number.map(|i| Pair { node, image: i as u32, along: both(*e) }));
    }
    out
}
