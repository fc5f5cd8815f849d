//! The solid fraction of a tiling whose tetrahedra overlap.
//!
//! Where functions of several tetrahedra are blended, values crowd towards their mean, and the cell's own table of fractions
//! no longer holds: at an overlap of 0.2 it is off by up to 0.07. So the blended function is sampled in the mesh itself, and
//! levels follow from that.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Level, Tiling};
use crate::cell::Part;
use crate::cell::tet::FractionTable;
use geometry::random::random;

/// Number of points in all, and the least in a tetrahedron: the standard error of a share is below 0.001.
const POINTS: usize = 400_000;
const FEWEST: usize = 400;
/// Steps of an evenly spread sequence in the cube: powers of the root of x⁴ = x + 1 (Roberts 2018).
const EVEN: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];

impl Tiling {
    /// The tiling whose solid has the fractions asked for (one, or one for each node; `None` keeps the levels) with its
    /// tetrahedra overlapping; without an overlap, itself. Of several cells all levels are moved by one number, until the
    /// fraction of the whole is the mean asked for.
    #[must_use]
    pub fn meeting(mut self, fractions: Option<&[f64]>) -> Tiling {
        if self.map.overlap() <= 0.0 {
            return self;
        }
        if self.cells.len() == 1 {
            let table = self.sampled(|f, _| f);
            if let Some(asked) = fractions {
                let levels: Vec<f64> = asked.iter().map(|v| table.iso(self.part, *v)).collect();
                self.level = match levels[..] {
                    [one] => Level::Same(one),
                    _ => Level::Nodes(Arc::new(levels)),
                };
            }
            self.blended = Some(Arc::new(table));
        } else if let (Some(asked), Level::Nodes(levels)) = (fractions, &self.level) {
            let at = |n: u32| asked[(n as usize).min(asked.len() - 1)];
            let mean = |t: usize| self.map.tet(t).map(at).iter().sum::<f64>() / 4.0;
            let all = (0..self.map.len()).map(|t| (self.map.volume(t), mean(t)));
            let (volume, solid) = all.fold((0.0, 0.0), |(v, s), (of, share)| (v + of, s + of * share));
            let table = self.sampled(|f, t| self.cut.value(f, t));
            let by = table.iso(Part::Lower, solid / volume);
            let by = if self.part == Part::Upper { -by } else { by };
            // The half-level of a sheet stays one.
            let least = if self.part == Part::Sheet { 1e-6 } else { f64::NEG_INFINITY };
            self.level = Level::Nodes(Arc::new(levels.iter().map(|v| (v + by).max(least)).collect()));
            self.moved = by;
        }
        self
    }

    /// The table of shares of a function of f and t, from points evenly spread over evenly spread tetrahedra.
    fn sampled(&self, of: impl Fn(f64, f64) -> f64 + Sync) -> FractionTable {
        let count = self.map.len().min(POINTS / FEWEST);
        let each = POINTS / count;
        let tet = |i: usize| {
            let t = i * self.map.len() / count;
            let c = self.map.corners(t);
            let mut state = t as u64;
            let shift = [0; 3].map(|_| random(&mut state));
            let point = |k: usize| {
                // The gaps between three sorted numbers are uniform in the tetrahedron.
                let mut cuts: [f64; 3] = core::array::from_fn(|a| (shift[a] + k as f64 * EVEN[a]).rem_euclid(1.0));
                cuts.sort_unstable_by(f64::total_cmp);
                let l = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]];
                [0, 1, 2].map(|a| (0..4).map(|i| l[i] * c[i][a]).sum())
            };
            let points: Vec<[f64; 3]> = (0..each).map(point).collect();
            let values = self.known(&points).iter().map(|k| of(k.f, k.t)).collect();
            (self.map.volume(t), values)
        };
        let sample: Vec<(f64, Vec<f64>)> = (0..count).into_par_iter().map(tet).collect();
        FractionTable::sampled(&sample)
    }
}
