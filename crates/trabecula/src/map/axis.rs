//! The direction of an axis of cells: a vector, or a line whose sign is arbitrary.

use rayon::prelude::*;

use super::grade_values::grade_values;
use super::phase_grid::PhaseGrid;
use super::principal::Principal;
use super::smooth_frames::{LEAST_AVERAGE, Smoothing};
use crate::grade::Grade;
use geometry::fault::{Fault, position};
use geometry::math::{Vec3, dot, norm, scale, unit};

/// The direction of an axis.
#[derive(Clone)]
pub enum Axis {
    /// Along a vector v.
    Vector([Grade; 3]),
    /// Along the principal direction of the greatest value of a tensor v vᵀ, given as 11, 22, 33, 23, 13, 12: for vectors whose signs
    /// are arbitrary, which vanish between two opposite ones.
    Line([Grade; 6]),
}

/// The least cosine of an axis that is given and one of a combed frame that it stands for.
const MEANT: f64 = 0.9;

impl Axis {
    /// What axes without signs are made to agree with first.
    pub(super) const UP: Vec3 = [1e-6, 1e-3, 1.0];

    /// Unit vectors at points; those of lines have arbitrary signs.
    pub(super) fn vectors(&self, points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
        match self {
            Axis::Vector(of) => vectors(of, points, key),
            Axis::Line(of) => along(&grade_values(of, points, key)?, points, key),
        }
    }

    pub(super) fn is_constant(&self) -> bool {
        match self {
            Axis::Vector(of) => constant(of),
            Axis::Line(of) => constant(of),
        }
    }

    /// Whether a unit vector is what is given at one of the points.
    pub(super) fn meaning(&self, points: &[Vec3], key: &str) -> Result<Box<dyn Fn(usize, Vec3) -> bool + Sync>, Fault> {
        Ok(match self {
            Axis::Vector(_) => {
                let given = self.vectors(points, key)?;
                Box::new(move |n, v| dot(given[n], v) > MEANT)
            }
            Axis::Line(of) => {
                let given = grade_values(of, points, key)?;
                Box::new(move |n, v| {
                    let [xx, yy, zz, yz, xz, xy] = given[n];
                    let [x, y, z] = square(v).as_chunks::<3>().0[0];
                    let [p, q, r] = square(v).as_chunks::<3>().0[1];
                    let along = xx * x + yy * y + zz * z + 2.0 * (yz * p + xz * q + xy * r);
                    along > MEANT * MEANT * (xx + yy + zz)
                })
            }
        })
    }

    /// Unit vectors at the nodes of a grid, smoothed, of arbitrary signs.
    pub(super) fn smoothed(
        &self,
        grid: &PhaseGrid,
        nodes: &[Vec3],
        key: &str,
        smoothing: &Smoothing,
    ) -> Result<Vec<Vec3>, Fault> {
        let tensors: Vec<[f64; 6]> = self.vectors(nodes, key)?.iter().map(|v| square(*v)).collect();
        let averages = smoothing.axes(grid, &tensors);
        let size = |t: &[f64; 6]| t[0] + t[1] + t[2];
        let least = LEAST_AVERAGE * averages.iter().map(size).fold(0.0, f64::max);
        // Far from the region nothing is left of the averages: a node there keeps its own direction.
        let kept = averages.into_iter().zip(tensors).map(|(mean, own)| if size(&mean) > least { mean } else { own });
        along(&kept.collect::<Vec<_>>(), nodes, key)
    }
}

/// v vᵀ as 11, 22, 33, 23, 13, 12.
fn square([x, y, z]: Vec3) -> [f64; 6] {
    [x * x, y * y, z * z, y * z, x * z, x * y]
}

/// The one of v and −v that is nearer to another vector.
pub(super) fn toward(v: Vec3, to: Vec3) -> Vec3 {
    if dot(v, to) < 0.0 { scale(v, -1.0) } else { v }
}

/// Whether all are the same everywhere.
pub(super) fn constant(of: &[Grade]) -> bool {
    of.iter().all(|g| g.constant().is_some())
}

/// The principal directions of the greatest values of tensors v vᵀ or sums of such.
fn along(tensors: &[[f64; 6]], points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
    let one = |(t, p): (&[f64; 6], &Vec3)| {
        let Principal { frame, values, .. } = Principal::of(t);
        let i = (0..3).fold(0, |m, i| if values[i] > values[m] { i } else { m });
        if values[i] < 1e-12 * (t[0] + t[1] + t[2]).max(f64::MIN_POSITIVE) {
            return Err(no_direction(key, *p));
        }
        Ok([frame[0][i], frame[1][i], frame[2][i]])
    };
    tensors.par_iter().zip(points).map(one).collect()
}

fn no_direction(key: &str, p: Vec3) -> Fault {
    Fault::new(key, format!("the vector is zero at {}; it needs a direction all over the region's bounds", position(p)))
}

/// Unit vectors.
fn vectors(of: &[Grade; 3], points: &[Vec3], key: &str) -> Result<Vec<Vec3>, Fault> {
    let mut found = grade_values(of, points, key)?;
    for (v, p) in found.iter_mut().zip(points) {
        if norm(*v) < 1e-12 {
            return Err(no_direction(key, *p));
        }
        *v = unit(*v);
    }
    Ok(found)
}
