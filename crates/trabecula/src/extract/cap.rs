//! Caps: the parts of the solid's flat faces that are planes of the grid.
//!
//! Such a face bounds everything solid, so on its far side there is nothing, and what the solid's cells show of
//! themselves on the plane is surface.

use std::ops::Range;

use super::knot::{Key, Knots};
use super::signs::Signs;

/// Adds the cap of a laid face on the tile's own cells.
pub(super) fn close(knots: &mut Knots, flat: usize, own: &[Range<usize>; 3]) {
    let face = &knots.local.flat[flat];
    let axis = face.axis;
    let layer = if face.below { face.at - 1 } else { face.at };
    if !own[axis].contains(&layer) {
        return;
    }
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    for b in own[v].clone() {
        for a in own[u].clone() {
            let mut cell = [0; 3];
            (cell[axis], cell[u], cell[v]) = (layer, a, b);
            if !knots.signs.is_knotted(cell) {
                plain(knots, cell, axis, face.below);
            }
        }
    }
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
        beside[side] = if c == 1 || c == 2 {
            beside[side] + 1
        } else {
            beside[side].wrapping_sub(1)
        };
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
