//! Caps: the parts of the solid's flat faces that are planes of the grid.
//!
//! Such a face bounds everything solid, so on its far side there is nothing, and what the solid's cells show of
//! themselves on the plane is surface.

use std::ops::Range;

use super::key::Key;
use super::knot::Knots;
use super::signs::{Signs, bits};

/// Adds the cap of a laid face on the tile's own cells.
pub(super) fn close(knots: &mut Knots, flat: usize, own: &[Range<usize>; 3]) {
    let face = &knots.local.flat[flat];
    let (axis, upper, plane) = (face.axis, face.below, face.at);
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
    let solid = solid_nodes(knots, axis, plane);
    let mut names = [[u32::MAX; 64]; 64];
    for b in own[v].clone() {
        let both = solid[b] & solid[b + 1];
        for a in own[u].clone() {
            let cell = at(layer, a, b);
            if knots.signs.is_knotted(cell) {
                continue;
            }
            let whole = both >> a & 3 == 3 && holds(knots, cell);
            if !whole || beside_knot(knots, cell, [u, v]) {
                plain(knots, cell, axis, upper);
                continue;
            }
            // Nearly all of a cap: squares of nodes.
            let mut ring = [(a, b), (a + 1, b), (a + 1, b + 1), (a, b + 1)].map(|(a, b)| {
                let name = &mut names[b][a];
                if *name == u32::MAX {
                    let node = knots.nodes.index(at(plane, a, b));
                    *name = knots.vertex(Key::new(node, &[], &[]));
                }
                *name
            });
            if !upper {
                ring.reverse();
            }
            let [p, q, r, s] = ring;
            knots.extra.triangles.extend([([p, q, r], true), ([p, r, s], true)]);
        }
    }
}

/// Whether a cell lies on the solid side of all laid faces.
fn holds(knots: &Knots, [i, j, k]: [usize; 3]) -> bool {
    let flats = 0..knots.local.flat.len();
    let beside = |f| Signs::beside(knots.local, f, j, k);
    flats.fold(u64::MAX, |w, f| w & beside(f)) >> i & 1 == 1
}

/// Whether a cell has a knotted neighbour in its layer, which may divide a common edge.
fn beside_knot(knots: &Knots, cell: [usize; 3], sides: [usize; 2]) -> bool {
    sides.into_iter().any(|side| {
        [cell[side].wrapping_sub(1), cell[side] + 1].into_iter().any(|n| {
            let mut beside = cell;
            beside[side] = n;
            n < knots.signs.shape[side] - 1 && knots.signs.is_knotted(beside)
        })
    })
}

/// Where the other faces are solid on a plane of nodes: a word along the next axis, for each node along the last.
fn solid_nodes(knots: &Knots, axis: usize, plane: usize) -> [u64; 64] {
    let signs = knots.signs;
    let [_, ny, nz] = signs.shape;
    let row = |j: usize, k: usize| {
        knots.local.tree.solid(&|f| {
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

/// The cap of a cell that at most one face crosses: a polygon of nodes and of points on grid edges.
fn plain(knots: &mut Knots, cell: [usize; 3], axis: usize, upper: bool) {
    let [i, j, k] = cell;
    let signs = knots.signs;
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |du: usize, dv: usize| {
        let mut at = cell;
        at[axis] += usize::from(upper);
        at[u] += du;
        at[v] += dv;
        at
    };
    let live = knots.local.live.len();
    let solid = |at: [usize; 3]| {
        let row = at[2] * signs.shape[1] + at[1];
        let negative = |f: usize| match f.checked_sub(live) {
            Some(flat) => Signs::beside(knots.local, flat, j, k) >> i,
            None => signs.negative[f][row] >> at[0],
        };
        knots.local.tree.solid(&negative) & 1 == 1
    };
    // Counter-clockwise seen from above the axis.
    let ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
    let inside = ring.map(solid);
    if !inside.contains(&true) {
        return;
    }
    let row = k * signs.shape[1] + j;
    let crossing = (0..live).find(|&f| signs.plain[f][row] >> i & 1 == 1);
    let mut polygon: Vec<Key> = Vec::with_capacity(5);
    // A knotted cell beside this one divides the common edge wherever any face crosses it.
    let mut divided = false;
    for c in 0..4 {
        let (here, next) = (ring[c], ring[(c + 1) % 4]);
        if inside[c] {
            polygon.push(Key::new(knots.nodes.index(here), &[], &[]));
        }
        if !inside[c] && !inside[(c + 1) % 4] {
            continue;
        }
        let (along, side) = if c % 2 == 0 { (u, v) } else { (v, u) };
        let mut beside = cell;
        beside[side] = if c == 1 || c == 2 { beside[side] + 1 } else { beside[side].wrapping_sub(1) };
        let knotted = beside[side] < signs.shape[side] - 1 && signs.is_knotted(beside);
        let low = [0, 1, 2].map(|a| here[a].min(next[a]));
        let mut points = knots.edge_points(knots.nodes.index(low), along);
        if here[along] > next[along] {
            points.reverse();
        }
        let mut solid = inside[c];
        for (f, key) in points {
            let ends = crossing == Some(f) && inside[c] != inside[(c + 1) % 4];
            if ends || (knotted && solid) {
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
        let low = knots.nodes.index(ring[0]);
        knots.flat_polygon(low, 1 << u | 1 << v, &polygon);
    } else {
        knots.polygon(&polygon, true);
    }
}
