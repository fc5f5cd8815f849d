//! Where a wall does not keep the spaces adjacent to it apart.

use super::{BlockNodes, TileBuffers};
use crate::extract::sampling_grid::LocalSolid;
use crate::extract::sign_words::{Signs, below, bits};
use geometry::math::Vec3;

/// A node of the region at which a wall is not thicker than rounding lets it be and nothing else separates its sides.
pub(super) fn hole(s: &TileBuffers, local: &LocalSolid, nodes: &BlockNodes, faces: [usize; 2]) -> Option<Vec3> {
    let at = |f: usize| local.live.iter().position(|live| *live == f);
    let [a, b] = [&s.samples[at(faces[0])?], &s.samples[at(faces[1])?]];
    let [nx, ny, nz] = nodes.shape;
    for (j, k) in (0..nz - 1).flat_map(|k| (0..ny - 1).map(move |j| (j, k))) {
        let row = k * ny + j;
        let sign = |f: usize| match f.checked_sub(local.live.len()) {
            Some(flat) => Signs::adjacent(local, flat, j, k),
            None => s.signs.negative[f][row],
        };
        let beside = local.trees[1..].iter().fold(0, |w, t| w | t.solid(&sign));
        for node in bits(beside & below(nx - 1)).map(|i| row * nx + i) {
            if a[node] + b[node] >= 0.0 {
                return Some(nodes.position(node));
            }
        }
    }
    None
}
