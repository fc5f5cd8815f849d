//! Caps: the parts of the solid's flat surfaces that are planes of the grid.
//!
//! The whole solid lies on one side of such a plane, so the solid cross-section of the adjacent layer of cells is surface.

use std::ops::Range;

use super::feature_cells::FeatureCells;
use super::sampling_grid::{GridPlane, LocalSolid, Sides};
use super::sign_words::{Signs, bits, within};
use super::vertex_id::VertexId;
use crate::csg_tree::CsgTree;

/// Adds the cap of a grid-aligned plane on the tile's own cells.
pub(super) fn close(features: &mut FeatureCells, flat: usize, own: &[Range<usize>; 3]) {
    let surface = &features.local.grid_planes[flat];
    let (axis, upper, plane) = (surface.axis, surface.below, surface.at);
    let layer = if upper { plane - 1 } else { plane };
    if !own[axis].contains(&layer) {
        return;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let at = |layer: usize, a: usize, b: usize| {
        let mut at = [layer; 3];
        (at[u], at[v]) = (a, b);
        at
    };
    let trees = features.local.trees.iter();
    let parts: Vec<[u64; 64]> = trees.map(|t| solid_nodes(features.signs, t, axis, plane)).collect();
    let mut names = [[u32::MAX; 64]; 64];
    for b in own[v].clone() {
        let both: Vec<u64> = parts.iter().map(|solid| solid[b] & solid[b + 1]).collect();
        for a in own[u].clone() {
            let cell = at(layer, a, b);
            if features.signs.is_feature(cell) {
                continue;
            }
            let whole = both.iter().position(|w| w >> a & 3 == 3).filter(|_| is_solid(features, cell));
            let Some(part) = whole.filter(|_| !is_next_to_feature(features, cell, [u, v])) else {
                (0..parts.len()).for_each(|part| plain(features, cell, axis, upper, part));
                continue;
            };
            // Nearly all of a cap: squares of nodes.
            let mut ring = [(a, b), (a + 1, b), (a + 1, b + 1), (a, b + 1)].map(|(a, b)| {
                let name = &mut names[b][a];
                if *name == u32::MAX {
                    let node = features.nodes.index(at(plane, a, b));
                    *name = features.vertex(VertexId::new(node, &[], &[]));
                }
                *name
            });
            if !upper {
                ring.reverse();
            }
            let [p, q, r, s] = ring;
            let sides = Sides::cut(part as u8 + 1);
            features.extra.triangles.extend([([p, q, r], sides), ([p, r, s], sides)]);
        }
    }
}

/// About as many triangles as the cap of the first part of the solid has in the tile's own cells.
pub(super) fn count(signs: &Signs, local: &LocalSolid, flat: &GridPlane, own: &[Range<usize>; 3]) -> usize {
    let layer = if flat.below { flat.at - 1 } else { flat.at };
    if !own[flat.axis].contains(&layer) {
        return 0;
    }
    let (u, v) = ((flat.axis + 1) % 3, (flat.axis + 2) % 3);
    let solid = solid_nodes(signs, &local.trees[0], flat.axis, flat.at);
    let mine = within(&own[u]);
    let squares = own[v].clone().map(|b| {
        let corners = [solid[b], solid[b] >> 1, solid[b + 1], solid[b + 1] >> 1];
        let each = corners.map(|w| (w & mine).count_ones() as usize);
        let whole = corners.into_iter().fold(mine, |w, c| w & c).count_ones() as usize;
        // A polygon of n nodes and two points on edges has n triangles, a square two.
        each.into_iter().sum::<usize>() - 2 * whole
    });
    squares.sum()
}

/// Whether a cell lies on the solid side of all grid-aligned planes.
fn is_solid(features: &FeatureCells, [i, j, k]: [usize; 3]) -> bool {
    let flats = 0..features.local.grid_planes.len();
    let adjacent = |f| Signs::adjacent(features.local, f, j, k);
    flats.fold(u64::MAX, |w, f| w & adjacent(f)) >> i & 1 == 1
}

/// Whether a cell has an adjacent feature cell in its layer, which may divide a common edge.
fn is_next_to_feature(features: &FeatureCells, cell: [usize; 3], faces: [usize; 2]) -> bool {
    faces.into_iter().any(|face| {
        [cell[face].wrapping_sub(1), cell[face] + 1].into_iter().any(|n| {
            let mut adjacent = cell;
            adjacent[face] = n;
            n < features.signs.shape[face] - 1 && features.signs.is_feature(adjacent)
        })
    })
}

/// Where the other surfaces make a plane of nodes one part of the solid: a word along the next axis, for each node along the last.
fn solid_nodes(signs: &Signs, tree: &CsgTree, axis: usize, plane: usize) -> [u64; 64] {
    let [_, ny, nz] = signs.shape;
    let row = |j: usize, k: usize| {
        tree.solid(&|f| {
            let negative = signs.negative.get(f);
            negative.map_or(u64::MAX, |n| n[k * ny + j])
        })
    };
    let mut words = [0; 64];
    match axis {
        0 => {
            for (k, word) in words[..nz].iter_mut().enumerate() {
                *word = (0..ny).fold(0, |w, j| w | (row(j, k) >> plane & 1) << j);
            }
        }
        1 => {
            for k in 0..nz {
                for i in bits(row(plane, k)) {
                    words[i] |= 1 << k;
                }
            }
        }
        _ => {
            for (j, word) in words[..ny].iter_mut().enumerate() {
                *word = row(j, plane);
            }
        }
    }
    words
}

/// The cap of a part of the solid in a cell that at most one surface crosses: a polygon of nodes and of points on grid edges.
fn plain(features: &mut FeatureCells, cell: [usize; 3], axis: usize, upper: bool, part: usize) {
    let [i, j, k] = cell;
    let signs = features.signs;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |du: usize, dv: usize| {
        let mut at = cell;
        at[axis] += usize::from(upper);
        at[u] += du;
        at[v] += dv;
        at
    };
    let live = features.local.live.len();
    let solid = |at: [usize; 3]| {
        let row = at[2] * signs.shape[1] + at[1];
        let negative = |f: usize| match f.checked_sub(live) {
            Some(flat) => Signs::adjacent(features.local, flat, j, k) >> i,
            None => signs.negative[f][row] >> at[0],
        };
        features.local.trees[part].solid(&negative) & 1 == 1
    };
    // Counter-clockwise seen from above the axis.
    let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    let inside = ring.map(solid);
    if !inside.contains(&true) {
        return;
    }
    let row = k * signs.shape[1] + j;
    let crossing = (0..live).find(|&f| signs.plain[f][row] >> i & 1 == 1);
    let mut polygon: Vec<VertexId> = Vec::with_capacity(5);
    // A feature cell adjacent to this one divides the common edge wherever any surface crosses it.
    let mut divided = false;
    for c in 0..4 {
        let (here, next) = (ring[c], ring[(c + 1) % 4]);
        if inside[c] {
            polygon.push(VertexId::new(features.nodes.index(here), &[], &[]));
        }
        if !inside[c] && !inside[(c + 1) % 4] {
            continue;
        }
        let (along, face) = if c % 2 == 0 { (u, v) } else { (v, u) };
        let mut adjacent = cell;
        adjacent[face] = if c == 1 || c == 2 { adjacent[face] + 1 } else { adjacent[face].wrapping_sub(1) };
        let featured = adjacent[face] < signs.shape[face] - 1 && signs.is_feature(adjacent);
        let low = [0, 1, 2].map(|a| here[a].min(next[a]));
        let mut points = features.edge_points(features.nodes.index(low), along);
        if here[along] > next[along] {
            points.reverse();
        }
        let mut solid = inside[c];
        for (f, key) in points {
            let ends = crossing == Some(f) && inside[c] != inside[(c + 1) % 4];
            if ends || (featured && solid) {
                polygon.push(key);
                divided |= !ends;
            }
            solid ^= ends;
        }
    }
    if !upper {
        polygon.reverse();
    }
    if divided {
        let low = features.nodes.index(ring[0]);
        features.flat_polygon(low, 1 << u | 1 << v, &polygon, part as u8 + 1);
    } else {
        features.polygon(&polygon, Sides::cut(part as u8 + 1));
    }
}
