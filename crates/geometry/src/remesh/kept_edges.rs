//! Which edges are kept: sharp ones, and borders between the lattice's surface and cuts.

use super::half_edge_mesh::{HalfEdgeMesh, NONE, next, prev};
use crate::math::{Vec3, add, cross, dot, norm, sub};

/// Cosine of the turn, 30 degrees, from which an edge counts as sharp.
const SHARP: f64 = 0.866_025_403_784_438_6;
/// A run of sharp edges that ends freely on both sides is a flaw of the grid if it has no more edges than this.
const SPECK: usize = 4;

/// For each half-edge, whether its edge is kept.
///
/// An edge is sharp if its two triangles turn by more than 30 degrees, and so do their surroundings, the triangles with
/// their other neighbours: the normal of a sliver alone says little. No edge on the boundary of an open mesh is kept.
pub fn kept(half_edges: &HalfEdgeMesh, positions: &[Vec3], cut: &[bool]) -> Vec<bool> {
    let normal = |t: u32| {
        let [a, b, c] = half_edges.triangles[t as usize].map(|v| positions[v as usize]);
        cross(sub(b, a), sub(c, a))
    };
    let turns = |a: Vec3, b: Vec3| dot(a, b) < SHARP * norm(a) * norm(b);
    let about = |h: u32| {
        let beyond = |g: u32| match half_edges.twin(g) {
            NONE => [0.0; 3],
            twin => normal(twin / 3),
        };
        add(normal(h / 3), add(beyond(next(h)), beyond(prev(h))))
    };
    let mut kept = vec![false; 3 * half_edges.triangles.len()];
    for h in 0..kept.len() as u32 {
        let g = half_edges.twin(h);
        if h > g || g == NONE {
            continue;
        }
        let (s, t) = (h / 3, g / 3);
        let sharp = turns(normal(s), normal(t)) && turns(about(h), about(g));
        if sharp || cut[s as usize] != cut[t as usize] {
            kept[h as usize] = true;
            kept[g as usize] = true;
        }
    }
    drop_specks(half_edges, cut, &mut kept);
    kept
}

/// Releases short runs of sharp edges that end freely on both sides.
fn drop_specks(half_edges: &HalfEdgeMesh, cut: &[bool], kept: &mut [bool]) {
    let kept_from =
        |kept: &[bool], v: u32| -> Vec<u32> { half_edges.leaving(v).filter(|h| kept[*h as usize]).collect() };
    for h in 0..kept.len() as u32 {
        let start = half_edges.from(h);
        if !kept[h as usize] || kept_from(kept, start).len() != 1 || !half_edges.is_inner(start) {
            continue;
        }
        let mut run = vec![h];
        let mut end = h;
        let free = loop {
            let on = kept_from(kept, half_edges.to(end));
            match on.len() {
                _ if !half_edges.is_inner(half_edges.to(end)) => break false,
                1 => break true,
                2 if run.len() < SPECK => {
                    let back = half_edges.twin(end);
                    end = if on[0] == back { on[1] } else { on[0] };
                    run.push(end);
                }
                _ => break false,
            }
        };
        let border = |h: &u32| cut[(h / 3) as usize] != cut[(half_edges.twin(*h) / 3) as usize];
        if free && !run.iter().any(border) {
            for h in run {
                kept[h as usize] = false;
                kept[half_edges.twin(h) as usize] = false;
            }
        }
    }
}

/// How many kept edges end at each vertex.
pub fn count(half_edges: &HalfEdgeMesh, kept: &[bool], vertices: usize) -> Vec<u8> {
    let mut count = vec![0u8; vertices];
    for h in 0..kept.len() as u32 {
        if kept[h as usize] && half_edges.from(h) != NONE {
            let c = &mut count[half_edges.from(h) as usize];
            *c = c.saturating_add(1);
        }
    }
    count
}
