//! Solid fractions of the voxels of a cell and interfaces through them, with the symmetry of its solid.

use geometry::math::{Mat3, Vec3, dot};
use geometry::progress::{Cancellation, Progress, Stopped, checkpoint};
use homogenise::Interface;
use rayon::prelude::*;

use crate::csg_tree::CsgSolid;
use crate::field::Field;
use crate::implicit::Surface;
use crate::voxel_fractions::{VoxelGrid, voxel_fractions};

/// Points along an edge at which a solid is compared with itself.
const POINTS: usize = 24;
/// Voxels whose interfaces are found at a time.
const BATCH: usize = 256;
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
                    let orbit = orbit(n, at(x, y, z));
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

/// The interfaces through the voxels that are neither full nor empty.
pub fn interfaces(solid: &CsgSolid, edges: &Mat3, shape: [usize; 3], fractions: &[f64]) -> Vec<Interface> {
    let n = shape[0];
    let cyclic = shape == [n; 3] && is_cube(edges) && is_cyclic(solid);
    let cut = |i: &usize| fractions[*i] > 0.0 && fractions[*i] < 1.0;
    // Of three that are the same, one is found.
    let first = |i: &usize| !cyclic || orbit(n, *i).iter().all(|other| i <= other);
    let voxels: Vec<usize> = (0..fractions.len()).filter(cut).filter(first).collect();
    let request = Cancellation::current();
    let each = |voxels| request.enter(|| interfaces_in(solid, shape, voxels));
    let mut found: Vec<Interface> = voxels.par_chunks(BATCH).flat_map_iter(each).collect();
    if cyclic {
        let others = |i: Interface| {
            let [own, next, last] = orbit(n, i.voxel);
            let [a, b, c] = i.slope;
            let turned = [(next, [b, c, a]), (last, [c, a, b])];
            turned.into_iter().filter(move |(v, _)| *v != own).map(move |(voxel, slope)| Interface {
                voxel,
                slope,
                ..i
            })
        };
        found.extend(found.clone().into_iter().flat_map(others));
        found.sort_unstable_by_key(|i| i.voxel);
    }
    found
}

/// The voxel and those that a cyclic change of the axes makes of it: at (y, z, x) and (z, x, y).
fn orbit(n: usize, voxel: usize) -> [usize; 3] {
    let [x, y, z] = [voxel % n, voxel / n % n, voxel / n / n];
    [voxel, (x * n + z) * n + y, (y * n + x) * n + z]
}

/// The interfaces through these voxels: the surfaces that decide there by their planes at the centre.
fn interfaces_in(solid: &CsgSolid, [nx, ny, nz]: [usize; 3], voxels: &[usize]) -> Vec<Interface> {
    checkpoint();
    let half = [nx, ny, nz].map(|n| 0.5 / n as f64);
    let centre = |i: &usize| [0, 1, 2].map(|a| half[a] * (2 * [i % nx, i / nx % ny, i / nx / ny][a] + 1) as f64);
    let points: Vec<Vec3> = voxels.iter().map(centre).collect();
    let planes = |surface: &Surface| {
        let (mut values, mut slopes) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        surface.field.gradients(&points, &mut values, &mut slopes);
        slopes.iter_mut().for_each(|s| *s = [0, 1, 2].map(|a| s[a] * half[a]));
        (values, slopes)
    };
    let each: Vec<(Vec<f64>, Vec<Vec3>)> = solid.surfaces.iter().map(planes).collect();
    let interface = |(n, voxel): (usize, &usize)| {
        let value = |f: usize| each[f].0[n];
        let rise = |f: usize| each[f].1[n].iter().map(|s| s.abs()).sum::<f64>();
        let bits = |set: bool| if set { u64::MAX } else { 0 };
        let mut deciding = Vec::new();
        solid.tree.deciding(1, &|f| bits(value(f) < rise(f)), &|f| bits(value(f) <= -rise(f)), &mut |f, here| {
            if here != 0 && !deciding.contains(&f) {
                deciding.push(f);
            }
        });
        let nearest = if deciding.len() == 1 { Some(deciding[0]) } else { solid.tree.value(&value).1 };
        nearest.map(|f| Interface { voxel: *voxel, slope: each[f].1[n], alone: deciding.len() < 2 })
    };
    voxels.iter().enumerate().filter_map(interface).collect()
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
