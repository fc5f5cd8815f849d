//! Solid fractions of the voxels of a cell, with the symmetry of its solid.

use geometry::math::{Mat3, Vec3, dot};
use geometry::progress::{Progress, Stopped};

use crate::csg_tree::CsgSolid;
use crate::field::Field;
use crate::voxel_fractions::{VoxelGrid, voxel_fractions};

/// Points along an edge at which a solid is compared with itself.
const POINTS: usize = 24;
/// Values that differ by no more, relative to the largest, are the same.
const SAME: f64 = 1e-7;

/// The solid fraction of each voxel of a cell with these edges (rows). Quadrature of cut voxels depends on the order of the axes, to its own
/// error; where a cyclic change of the axes changes nothing in the solid it changes nothing in the fractions: they are means over it, and
/// fewer load cases are to be solved.
///
/// # Errors
/// An interruption.
pub fn fractions(
    solid: &CsgSolid,
    edges: &Mat3,
    shape: [usize; 3],
    progress: &dyn Progress,
) -> Result<Vec<f64>, Stopped> {
    let grid = VoxelGrid { origin: [0.0; 3], step: shape.map(|n| 1.0 / n as f64), shape };
    let mut found = voxel_fractions(solid, &grid, progress)?;
    let n = shape[0];
    if shape == [n; 3] && is_cube(edges) && is_cyclic(solid) {
        let at = |x: usize, y: usize, z: usize| (z * n + y) * n + x;
        for z in 0..n {
            for y in 0..n {
                for x in 0..n {
                    let orbit = [at(x, y, z), at(y, z, x), at(z, x, y)];
                    // Each orbit once, in the order of its least member: the same bits for all three.
                    if orbit[0] <= orbit[1] && orbit[0] <= orbit[2] {
                        let mean = orbit.iter().map(|i| found[*i]).sum::<f64>() / 3.0;
                        orbit.into_iter().for_each(|i| found[i] = mean.clamp(0.0, 1.0));
                    }
                }
            }
        }
    }
    Ok(found)
}

/// Whether edges are of one length and at right angles.
fn is_cube(edges: &Mat3) -> bool {
    let size = dot(edges[0], edges[0]);
    (0..9).all(|i| (dot(edges[i / 3], edges[i % 3]) - if i % 4 == 0 { size } else { 0.0 }).abs() <= 1e-9 * size)
}

/// Whether a solid, in coordinates of its cell, is the same after a cyclic change of the axes.
fn is_cyclic(solid: &CsgSolid) -> bool {
    let along = |i: usize| (i as f64 + 0.37) / POINTS as f64;
    let count = POINTS.pow(3);
    let points: Vec<Vec3> =
        (0..count).map(|i| [along(i % POINTS), along(i / POINTS % POINTS), along(i / POINTS / POINTS)]).collect();
    let mut values = vec![0.0; count];
    solid.values(&points, &mut values);
    let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let turned = |i: usize| (i % POINTS * POINTS + i / POINTS / POINTS) * POINTS + i / POINTS % POINTS;
    (0..count).all(|i| (values[i] - values[turned(i)]).abs() <= SAME * largest)
}
