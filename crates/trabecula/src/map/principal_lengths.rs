//! Wavelengths along the principal directions of a stress, by the order of its values.
//!
//! A cell's axes are combed so that neighbours agree, not by the order of the principal values, so which axis of the cell lies along the
//! greatest changes from place to place. Lengths are therefore carried by a tensor without axes of its own, M = Σ ln Lₖ vₖ vₖᵀ with
//! vₖ the principal directions: the length along an axis e of the cell is exp(eᵀ M e). Where two values agree their directions are any
//! pair in a plane, and M has the mean of both logarithms there.

use rayon::prelude::*;

use super::frame::DOUBT;
use super::phase_grid::PhaseGrid;
use super::principal::Principal;
use super::smooth_frames::{Smoothing, trusted};
use geometry::math::{Mat3, Vec3, exp, transpose};

/// The lengths along the axes of the frames at nodes, of those along the principal directions of a stress in descending order of its
/// values (tension positive); smoothed as the frames are.
pub(super) fn along_axes(
    grid: &PhaseGrid,
    of: &[Principal],
    range: f64,
    lengths: &[Vec3],
    frames: &[Mat3],
    smoothing: Option<&Smoothing>,
) -> Vec<Vec3> {
    let mut tensors: Vec<[f64; 7]> = of.par_iter().zip(lengths).map(|(p, l)| logarithms(p, range, l)).collect();
    if let Some(smoothing) = smoothing {
        let averages = smoothing.averages(grid, &tensors);
        let most = averages.iter().fold(0.0f64, |m, t| m.max(t[6]));
        // Far from the region nothing is left of the averages: a node there keeps its own.
        tensors.iter_mut().zip(averages).filter(|(_, mean)| mean[6] > 1e-9 * most).for_each(|(t, mean)| *t = mean);
    }
    let along = |(t, frame): (&[f64; 7], &Mat3)| {
        let [xx, yy, zz, yz, xz, xy, sure] = *t;
        transpose(frame).map(|[x, y, z]| {
            let quadratic = xx * x * x + yy * y * y + zz * z * z + 2.0 * (yz * y * z + xz * x * z + xy * x * y);
            exp(quadratic / sure)
        })
    };
    tensors.par_iter().zip(frames).map(along).collect()
}

/// M as 11, 22, 33, 23, 13, 12, times how sure the directions are, and that.
fn logarithms(p: &Principal, range: f64, lengths: &Vec3) -> [f64; 7] {
    let size = p.size(range);
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| p.values[*b].total_cmp(&p.values[*a]));
    // 1 where two values agree, 0 where they differ by twice what counts as agreement.
    let alike = |i: usize, j: usize| {
        let t = (1.0 - (p.values[order[i]] - p.values[order[j]]).abs() / (2.0 * DOUBT * size)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let axes = transpose(&p.frame);
    let sure = trusted(p.difference() / range).max(1e-6);
    let mut out = [0.0; 7];
    for k in 0..3 {
        let (sum, count) = (0..3).fold((0.0, 0.0), |(s, n), j| (s + alike(k, j) * lengths[j].ln(), n + alike(k, j)));
        let ([x, y, z], log) = (axes[order[k]], sure * sum / count);
        for (o, v) in out.iter_mut().zip([x * x, y * y, z * z, y * z, x * z, x * y]) {
            *o += log * v;
        }
    }
    out[6] = sure;
    out
}
