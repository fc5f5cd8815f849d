//! Deviation of a solved map from its target: angle, spacing, shear, anisotropy and density of cells.

use std::cmp::Ordering;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::cut_cells::CutCells;
use super::phase_grid::PhaseGrid;
use super::singular_lines::SingularLine;
use geometry::math::{Aabb, Mat3, Vec3, cross, determinant, dot, norm, product, spectral_norm, transpose};

/// Mean, 95th percentile and maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct MapSpread {
    /// Mean.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Maximum.
    pub max: f64,
}

impl MapSpread {
    /// The mean and the 95th percentile of `values` from index `from` on, the greatest of all.
    fn of(values: &[f64], from: usize) -> MapSpread {
        let mut evenly = values[from..].to_vec();
        if evenly.is_empty() {
            return MapSpread::default();
        }
        let n = evenly.len();
        let mean = evenly.iter().sum::<f64>() / n as f64;
        evenly.sort_by(f64::total_cmp);
        let max = values.iter().copied().fold(evenly[n - 1], f64::max);
        MapSpread { mean, p95: evenly[(95 * (n - 1)).div_ceil(100)], max }
    }
}

/// Deviation of a solved map's gradients ∇Φᵢ from the wanted ones Kᵢ.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "DistortionReport")]
pub struct Distortion {
    /// Angle between ∇Φᵢ and Kᵢ for each axis, degrees.
    pub angle: [MapSpread; 3],
    /// |∇Φᵢ| / |Kᵢ| for each axis: above one, cells are smaller than asked for. p95 and max are of the ratio or its inverse,
    /// whichever is greater.
    pub spacing: [MapSpread; 3],
    /// Share of points and axes with a spacing ratio outside 1/1.5 to 1.5.
    pub outside: f64,
    /// Greatest deviation from a right angle between two gradients, degrees.
    pub shear: MapSpread,
    /// Greatest over least stretch of a cell.
    pub anisotropy: MapSpread,
    /// Least and greatest length of a cell over the one asked for, along any direction.
    pub stretch: [f64; 2],
    /// Where these are, mm.
    #[serde(skip)]
    pub stretch_at: [Vec3; 2],
    /// Least and greatest det J over the one asked for; 0 or less where the map folds.
    pub density: [f64; 2],
    /// Where the density is least, mm.
    #[serde(skip)]
    pub least_at: Vec3,
    /// |curl Kᵢ| λᵢ², what no map can follow.
    pub curl: MapSpread,
    /// Greatest turn of the wanted orientation within a cell, or twice that within half a cell or less, degrees.
    pub turn: f64,
    /// Where that is, mm.
    #[serde(skip)]
    pub turn_at: Vec3,
    /// The lines round which the target's axes do not come back to themselves.
    #[serde(skip)]
    pub singular: Vec<SingularLine>,
}

/// Deviation of the gradients from the targets at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Angle between ∇Φᵢ and Kᵢ, degrees, for each axis.
    pub angle: Vec3,
    /// |∇Φᵢ| / |Kᵢ| for each axis.
    pub spacing: Vec3,
    /// The greatest deviation from a right angle between two gradients, degrees.
    pub shear: f64,
    /// Greatest over least stretch of a cell.
    pub anisotropy: f64,
    /// The least and the greatest length of a cell over the one asked for, along any direction.
    pub stretch: [f64; 2],
    /// det J over that of the target.
    pub density: f64,
}

/// Compares J with K (rows of both: the three gradients) at a position.
pub(super) fn compare(j: &Mat3, k: &Mat3) -> Misfit {
    let angle = |a: Vec3, b: Vec3| {
        let c = dot(a, b) / (norm(a) * norm(b));
        c.clamp(-1.0, 1.0).acos().to_degrees()
    };
    // J K⁻¹, K being D Rᵀ: its inverse is R / D = Kᵀ / |Kᵢ|².
    let mut back = transpose(k);
    for row in &mut back {
        for i in 0..3 {
            row[i] /= dot(k[i], k[i]);
        }
    }
    let relative = product(j, &back);
    let density = determinant(&relative);
    let stretch = stretch(&relative);
    let shear = [(0, 1), (0, 2), (1, 2)].map(|(a, b)| (angle(j[a], j[b]) - 90.0).abs()).into_iter().fold(0.0, f64::max);
    Misfit {
        angle: core::array::from_fn(|i| angle(j[i], k[i])),
        spacing: core::array::from_fn(|i| norm(j[i]) / norm(k[i])),
        shear,
        anisotropy: if density == 0.0 { f64::INFINITY } else { stretch[1] / stretch[0] },
        stretch,
        density,
    }
}

/// The least and the greatest length of a cell over the one asked for, of J K⁻¹: one over its singular values.
pub(super) fn stretch(relative: &Mat3) -> [f64; 2] {
    let [a, b, c] = relative;
    // |det| is the product of all three; the least is one over the greatest of the inverse.
    let cofactors = [cross(*b, *c), cross(*c, *a), cross(*a, *b)];
    [1.0 / spectral_norm(relative), (spectral_norm(&cofactors) / determinant(relative).abs()).min(f64::MAX)]
}

impl Distortion {
    /// All but the density. What was found from index `from` on is spread evenly; |curl Kᵢ| λᵢ² is separate.
    pub(super) fn of(found: &[Misfit], from: usize, curl: &[f64], (turn, turn_at): (f64, Vec3)) -> Distortion {
        let from = if from < found.len() { from } else { 0 };
        let axis = |f: &dyn Fn(&Misfit) -> f64| MapSpread::of(&found.iter().map(f).collect::<Vec<f64>>(), from);
        let even = &found[from..];
        let outside = even.iter().flat_map(|f| f.spacing).filter(|s| s.max(1.0 / s) > 1.5).count();
        Distortion {
            angle: [0, 1, 2].map(|i| axis(&|f| f.angle[i])),
            spacing: [0, 1, 2].map(|i| MapSpread {
                mean: axis(&|f| f.spacing[i]).mean,
                ..axis(&|f| f.spacing[i].max(1.0 / f.spacing[i]))
            }),
            outside: outside as f64 / (3 * even.len()).max(1) as f64,
            shear: axis(&|f| f.shear),
            anisotropy: axis(&|f| f.anisotropy),
            curl: MapSpread::of(curl, 0),
            turn,
            turn_at,
            stretch: [1.0; 2],
            ..Distortion::default()
        }
    }

    /// The singular lines in words that continue a sentence; nothing where there is none.
    pub(super) fn winds(&self) -> String {
        match self.singular.first() {
            None => String::new(),
            Some(longest) => {
                format!("; axes do not come back to themselves round {}", longest.description(self.singular.len()))
            }
        }
    }

    /// Takes the stretch and the density at points into their ranges.
    pub(super) fn widen(&mut self, found: &[Misfit], at: &[Vec3]) {
        for (f, p) in found.iter().zip(at) {
            if f.stretch[0] < self.stretch[0] {
                (self.stretch[0], self.stretch_at[0]) = (f.stretch[0], *p);
            }
            if f.stretch[1] > self.stretch[1] {
                (self.stretch[1], self.stretch_at[1]) = (f.stretch[1], *p);
            }
            self.density[1] = self.density[1].max(f.density);
            if f.density < self.density[0] {
                (self.density[0], self.least_at) = (f.density, *p);
            }
        }
    }
}

/// |curl Kᵢ| / |Kᵢ|², the greatest of the three gratings, by differences at a node.
pub(super) fn curl(grid: &PhaseGrid, k: &[Vec<Vec3>; 3], n: usize) -> f64 {
    let (at, strides) = (grid.index(n), grid.strides());
    let mut most = 0.0f64;
    for k in k {
        let slope = |a: usize| {
            let lo = if at[a] > 0 { n - strides[a] } else { n };
            let hi = if at[a] + 1 < grid.shape[a] { n + strides[a] } else { n };
            let span = (hi - lo) as f64 / strides[a] as f64 * grid.step[a];
            [0, 1, 2].map(|c| (k[hi][c] - k[lo][c]) / span)
        };
        let d = [slope(0), slope(1), slope(2)];
        let curl = [d[1][2] - d[2][1], d[2][0] - d[0][2], d[0][1] - d[1][0]];
        most = most.max(norm(curl) / dot(k[n], k[n]));
    }
    most
}

/// Frames at the nodes of a grid.
pub(super) struct FrameField<'a> {
    pub grid: &'a PhaseGrid,
    pub frames: &'a [Mat3],
    /// Across these they turn by what is left after the rotation there.
    pub cuts: Option<&'a CutCells>,
    /// Which nodes count.
    pub inside: &'a [bool],
}

impl FrameField<'_> {
    /// The most that they turn within one cell of edge `length` (mm), degrees, or twice what they turn within half of one or less, and
    /// where.
    pub fn turning(&self, length: f64) -> (f64, Vec3) {
        let mut most = (0.0, self.grid.origin);
        for cells in [1.0, 0.5, 0.25, 0.125] {
            let found = (0..3).map(|axis| self.turning_along(axis, cells, length));
            most = found.fold(most, |m, f| if f.0 > m.0 { f } else { m });
        }
        most
    }

    /// The same along an axis between nodes `cells` cells apart.
    fn turning_along(&self, a: usize, cells: f64, length: f64) -> (f64, Vec3) {
        let FrameField { grid, frames, cuts, inside } = *self;
        let strides = grid.strides();
        // Nodes nearly that far apart; where that is less than a step, what a step turns is shared out.
        let apart = ((cells * length / grid.step[a]).round() as usize).clamp(1, grid.shape[a] - 1);
        let share = (length / (apart as f64 * grid.step[a])).min(1.0 / cells).min(2.0);
        let angle = |n: usize| {
            let m = n + apart * strides[a];
            if !(inside[n] && grid.index(n)[a] + apart < grid.shape[a] && inside[m]) {
                return (0.0, n);
            }
            let there = match cuts {
                None => frames[m],
                // Not from one side of a core to the other.
                Some(_) if !inside[n + apart / 2 * strides[a]] => return (0.0, n),
                Some(cuts) => product(&frames[m], &cuts.between([n, m]).turn),
            };
            let pairs = frames[n].as_flattened().iter().zip(there.as_flattened());
            let trace: f64 = pairs.map(|(a, b)| a * b).sum();
            let angle = ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees();
            (angle * share, n)
        };
        // Of equals the first, whatever the threads do.
        let greater = |a: (f64, usize), b: (f64, usize)| match a.0.total_cmp(&b.0) {
            Ordering::Less => b,
            Ordering::Equal if b.1 < a.1 => b,
            _ => a,
        };
        let (turn, n) = (0..grid.len()).into_par_iter().map(angle).reduce(|| (0.0, usize::MAX), greater);
        if turn == 0.0 {
            return (0.0, grid.origin);
        }
        let (p, q) = (grid.node(n), grid.node(n + apart * strides[a]));
        (turn, Aabb::EMPTY.with(p).with(q).center())
    }
}
