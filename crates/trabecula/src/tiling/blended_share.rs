//! The solid fraction of a tiling whose tetrahedra overlap.
//!
//! Where functions of several tetrahedra are blended, values crowd towards their mean, and the cell's own table of fractions
//! no longer holds: at an overlap of 0.2 it is off by up to 0.07. So the blended function is sampled in the mesh itself, and
//! levels follow from that. Law: within 0.002.

use std::sync::Arc;

use rayon::prelude::*;

use super::{NodalLevel, Tiling};
use crate::cell::Part;
use crate::cell::tet::FractionTable;
use geometry::random::{low_discrepancy, random};

/// Number of points in all, and the least in a tetrahedron that is sampled. Points are evenly spread, so their own error is
/// below 0.001; so is the standard error of choosing 4000 tetrahedra of more, whose shares differ by some hundredths.
const POINTS: usize = 400_000;
const FEWEST: usize = 100;
/// Points in a tetrahedron where all are sampled, at least.
const LEAST: usize = 16;

impl Tiling {
    /// The tiling whose solid has the fractions asked for (one, or one for each node; `None` keeps the levels) with its
    /// tetrahedra overlapping; without an overlap, itself. Levels that vary are moved by one number then, until the fraction
    /// of the whole is the mean asked for.
    #[must_use]
    pub fn with_fraction(mut self, fractions: Option<&[f64]>) -> Tiling {
        if self.map.overlap() <= 0.0 {
            return self;
        }
        if self.cells.len() == 1 {
            let table = self.sampled(|f, _| f);
            if let Some(asked) = fractions {
                let levels: Vec<f64> = asked.iter().map(|v| table.iso(self.part, *v)).collect();
                self.level = match levels[..] {
                    [one] => NodalLevel::Same(one),
                    _ => NodalLevel::Nodes(Arc::new(levels)),
                };
            }
            self.blended = Some(Arc::new(table));
        }
        if let (Some(asked), NodalLevel::Nodes(levels)) = (fractions, &self.level) {
            let at = |n: u32| asked[(n as usize).min(asked.len() - 1)];
            let mean = |t: usize| self.map.tet(t).map(at).iter().sum::<f64>() / 4.0;
            let all = (0..self.map.len()).map(|t| (self.map.volume(t), mean(t)));
            let (volume, solid) = all.fold((0.0, 0.0), |(v, s), (of, share)| (v + of, s + of * share));
            let table = self.sampled(|f, t| self.cut.value(f, t));
            let by = table.iso(Part::Lower, solid / volume);
            let by = if self.part == Part::Upper { -by } else { by };
            // The half-level of a sheet stays one.
            let least = if self.part == Part::Sheet { 1e-6 } else { f64::NEG_INFINITY };
            self.level = NodalLevel::Nodes(Arc::new(levels.iter().map(|v| (v + by).max(least)).collect()));
        }
        self
    }

    /// The table of shares of a function of f and t, from points evenly spread over evenly spread tetrahedra.
    fn sampled(&self, of: impl Fn(f64, f64) -> f64 + Sync) -> FractionTable {
        let count = self.map.len().min(POINTS / FEWEST);
        let each = POINTS / count;
        let tet = |i: usize| {
            let t = i * self.map.len() / count;
            let values = self.found(&self.points_in(t, each), false).iter().map(|k| of(k.f, k.t)).collect();
            (self.map.volume(t), values)
        };
        let sample: Vec<(f64, Vec<f64>)> = (0..count).into_par_iter().map(tet).collect();
        FractionTable::sampled(&sample)
    }

    /// The solid share of each tetrahedron, sampled of the blended function.
    pub(super) fn sampled_shares(&self) -> Vec<f64> {
        let each = (POINTS / self.map.len()).max(LEAST);
        let solid = |t: usize| {
            let known = self.found(&self.points_in(t, each), false);
            known.iter().filter(|k| self.cut.value(k.f, k.t) <= 0.0).count() as f64 / each as f64
        };
        (0..self.map.len()).into_par_iter().map(solid).collect()
    }

    /// Points evenly spread over a tetrahedron, mm.
    pub(super) fn points_in(&self, t: usize, count: usize) -> Vec<[f64; 3]> {
        let mut state = t as u64;
        let shift = [0; 3].map(|_| random(&mut state));
        let point = |k: usize| {
            // The gaps between three sorted numbers are uniform in the tetrahedron.
            let even = low_discrepancy(k);
            let mut cuts: [f64; 3] = core::array::from_fn(|a| (shift[a] + even[a]).rem_euclid(1.0));
            cuts.sort_unstable_by(f64::total_cmp);
            let l = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]];
            self.map.place(t, l)
        };
        (0..count).map(point).collect()
    }
}
