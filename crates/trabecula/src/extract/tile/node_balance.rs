//! The values at the nodes of feature cells, moved by what the planes between them miss.
//!
//! In a tetrahedron of a feature cell a surface is the plane of its values at the corners. Of a function that is locally quadratic this
//! plane is off by Σ H(e, e) / 40 on average over the tetrahedron, e its edges and H the second derivative: of a curved surface always
//! outwards or always inwards, so that the volume is off by the second order. Over the six tetrahedra of a cell the mean is
//! (Σ H(a, a) + Σ H(a, b)) / 12, a and b the steps along different axes. With values that are less by this, the planes lie above the
//! surface as much as below it, and what is left of the volume's error changes its sign from cell to cell.
//!
//! The move depends on the surface and the node alone, so all tiles agree; and values keep their signs, so the same cells are
//! crossed.

use std::f64::consts::SQRT_2;

use super::{BATCH, Nodes, Scratch};
use crate::extract::sampling_grid::{Grid, LocalSolid};
use crate::extract::sign_words::bits;
use geometry::math::Vec3;

/// A node and four points around it, in steps along the axes: the differences of value add up to 2 (Σ H(a, a) + Σ H(a, b)).
const POINTS: [Vec3; 5] = [[0.0; 3], [3.0 * NEAR; 3], [NEAR, -FAR, -FAR], [-FAR, NEAR, -FAR], [-FAR, -FAR, NEAR]];
const NEAR: f64 = SQRT_2 / 3.0;
const FAR: f64 = 2.0 * NEAR;
/// The region's curvature varies little from node to node, and its distances are dear: it is found at every fourth node.
const COARSE: usize = 4;
/// Of distances, a turn of more than this within a step is a crease, not curvature; radians (29°).
const CREASE: f64 = 0.5;

/// Moves the values of surfaces at the nodes of the feature cells that they cross. `from` is the first node of the block.
pub(super) fn balance_nodes(s: &mut Scratch, grid: &Grid, local: &LocalSolid, nodes: &Nodes, from: [usize; 3]) {
    let Scratch { signs, samples, points, values, .. } = s;
    if !signs.has_features() {
        return;
    }
    for (surface, &id) in local.live.iter().enumerate() {
        let of = &grid.surfaces[id];
        // Planes have no curvature, and patches of surfaces with known creases need no values.
        if of.plane.is_some() || grid.has_creases(id) {
            continue;
        }
        let coarse = if of.cut { COARSE } else { 1 };
        let place = |node: usize| {
            let at = nodes.at(node);
            [2, 1, 0].map(|a| ((from[a] + at[a] + coarse / 2) / coarse * coarse).min(grid.axes[a].len() - 1))
        };
        let words = signs.nodes_of_features(surface);
        let here = words.iter().enumerate().flat_map(|(row, w)| bits(*w).map(move |i| row * nodes.shape[0] + i));
        let mut here: Vec<([usize; 3], usize)> = here.map(|node| (place(node), node)).collect();
        here.sort_unstable();
        let places: Vec<&[([usize; 3], usize)]> = here.chunk_by(|a, b| a.0 == b.0).collect();
        let most = if of.has_creases { CREASE * of.lipschitz * grid.step / 12.0 } else { f64::INFINITY };
        for some in places.chunks(BATCH / POINTS.len()) {
            points.clear();
            points.extend(some.iter().flat_map(|with| around(grid, with[0].0)));
            values.resize(points.len(), 0.0);
            of.field.values(points, values);
            for (with, values) in some.iter().zip(values.chunks_exact(POINTS.len())) {
                let missed = (values[1..].iter().sum::<f64>() - 4.0 * values[0]) / 24.0;
                if missed.abs() > most {
                    continue;
                }
                for (_, node) in *with {
                    let sample = &mut samples[surface][*node];
                    *sample = less(*sample, missed);
                }
            }
        }
    }
}

/// A node of the grid, its indices given from the last axis to the first, and the points around it.
fn around(grid: &Grid, [k, j, i]: [usize; 3]) -> impl Iterator<Item = Vec3> {
    let at = [i, j, k];
    let center = [0, 1, 2].map(|a| grid.axes[a][at[a]]);
    let step = [0, 1, 2].map(|a| grid.step_at(a, at[a]));
    POINTS.into_iter().map(move |p| [0, 1, 2].map(|a| center[a] + step[a] * p[a]))
}

/// A value less a small amount, with the same sign.
fn less(value: f32, by: f64) -> f32 {
    let moved = (f64::from(value) - by) as f32;
    if value == 0.0 {
        value
    } else if (moved < 0.0) == (value < 0.0) && moved != 0.0 {
        moved
    } else {
        f32::MIN_POSITIVE.copysign(value)
    }
}
