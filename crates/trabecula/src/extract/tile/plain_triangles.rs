//! The triangles of plain cells.

use std::ops::Range;

use multiversion::multiversion;

use super::{Plain, TileBuffers, TriangleRole, VertexNumbers};
use crate::extract::cube_table::{CASES, EDGES, MOST};
use crate::extract::sampling_grid::{LocalSolid, SamplingGrid, Sides};
use crate::extract::sign_words::{Signs, within};

/// Lists the triangles of all plain cells of the block, halo included; and the plain cells adjacent to feature cells, which
/// `feature_cells` fills.
pub(super) fn list_triangles(s: &mut TileBuffers, grid: &SamplingGrid, local: &LocalSolid, own: &[Range<usize>; 3]) {
    let TileBuffers { signs, numbers, plain, edges, .. } = s;
    plain.triangles.clear();
    plain.counts.clear();
    plain.kinds.clear();
    plain.seams.clear();
    plain.sides.clear();
    for (surface, numbers) in numbers.iter().enumerate().take(local.live.len()) {
        let kind = if grid.surfaces[local.live[surface]].cut { TriangleRole::Cut } else { TriangleRole::Lattice };
        let before = plain.triangles.len();
        list_patches(signs, local, &edges.claims.cells, numbers, (surface, kind), own, plain);
        plain.counts.push(plain.triangles.len() - before);
    }
}

#[multiversion(targets(
    "x86_64+avx512f+avx512dq+avx512vl+avx512vpopcntdq+bmi1+bmi2+popcnt+lzcnt",
    "x86_64+avx2+bmi1+bmi2+popcnt+lzcnt",
    "aarch64+neon"
))]
fn list_patches(
    signs: &Signs,
    local: &LocalSolid,
    fill_edge_cell: &[u64],
    numbers: &VertexNumbers,
    of: (usize, TriangleRole),
    own: &[Range<usize>; 3],
    out: &mut Plain,
) {
    let (surface, kind) = of;
    let Plain { triangles, kinds, seams, sides, .. } = out;
    let several = local.trees.len() > 1;
    let [_, ny, nz] = signs.shape;
    let cases = &*CASES;
    let mine_x = within(&own[0]);
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            let row = k * ny + j;
            let mut bits = signs.plain[surface][row];
            if bits == 0 {
                continue;
            }
            let mine = if own[1].contains(&j) && own[2].contains(&k) { mine_x } else { 0 };
            let mut seam = 0;
            if mine != 0 {
                let kn = &signs.featured;
                let here = kn[row];
                // The block's last row of words holds no cells, so the upper neighbours exist; the lower ones do for
                // cells of the tile itself, except at the grid's padding.
                let below = if j > 0 { kn[row - 1] } else { 0 } | if k > 0 { kn[row - ny] } else { 0 };
                seam = (here << 1 | here >> 1 | kn[row + 1] | kn[row + ny] | below) & mine & !fill_edge_cell[row];
            }
            // For each edge of a cell, the row of grid edges that it is of: its crossings, and the first one's number.
            let rows = [row, row + 1, row + ny, row + ny + 1];
            // Of edges at the cell's upper nodes along x one step on, so that of each the same crossings come before.
            let mut crossed = EDGES.map(|(corner, axis)| numbers.crossed[axis][rows[corner >> 1]]);
            let mut first = EDGES.map(|(corner, axis)| numbers.offset[axis][rows[corner >> 1]]);
            for (e, (corner, _)) in EDGES.iter().enumerate() {
                if corner & 1 == 1 {
                    first[e] += (crossed[e] & 1) as u32;
                    crossed[e] >>= 1;
                }
            }
            let negative = rows.map(|r| signs.negative[surface][r]);
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let pair = |w: u64| (w >> i & 3) as usize;
                let corners =
                    pair(negative[0]) | pair(negative[1]) << 2 | pair(negative[2]) << 4 | pair(negative[3]) << 6;
                let case = &cases[corners];
                // All edges, crossed or not, and room for the most triangles: to count them takes longer. Sixteen
                // names, so that four bits never lead outside.
                let below = (1u64 << i) - 1;
                let mut names = [0u32; 16];
                for e in 0..EDGES.len() {
                    names[e] = first[e] + (crossed[e] & below).count_ones();
                }
                let mut kind = if mine >> i & 1 == 1 { kind } else { TriangleRole::Neighbour };
                if fill_edge_cell[row] >> i & 1 == 1 {
                    kind = TriangleRole::Neighbour;
                } else if seam >> i & 1 == 1 {
                    seams.push(([i, j, k], surface));
                    kind = TriangleRole::Neighbour;
                }
                let count = triangles.len() + case.count;
                triangles.extend_from_slice(&case.triangles.map(|t| t.map(|e| names[e as usize & 15])));
                triangles.truncate(count);
                kinds.extend_from_slice(&[kind; MOST]);
                kinds.truncate(count);
                if several {
                    let [behind, ahead] = signs.parts_beside(local, surface, [i, j, k]);
                    sides.resize(count, Sides { behind, ahead, cut: kind == TriangleRole::Cut });
                }
            }
        }
    }
}
