//! Values and gradients of a blend at points.

use super::ends::{EndQuantiles, HIGH, LOW};
use super::evaluated::{Evaluated, zeros};
use super::level_offset::Position;
use super::share_grid::ShareSimplex;
use super::sum::Blend;
use super::window_cache::WindowCache;
use geometry::math::{Vec3, add, scale, sub};

/// Points evaluated at a time.
const BATCH: usize = 1024;

impl Blend {
    /// Fills values at points (mm).
    pub(super) fn values_at(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.summands.len();
        let mut position = Position::default();
        for (points, out) in points.chunks(BATCH).zip(out.chunks_mut(BATCH)) {
            let all = || vec![0.0; n * points.len()];
            let (mut w, mut high, mut f) = (all(), all(), vec![0.0; points.len()]);
            let mut quantiles = vec![[0.0; 2]; n * points.len()];
            self.weights.values(points, &mut w);
            for (i, s) in self.summands.iter().enumerate() {
                let here: Vec<usize> = (0..points.len()).filter(|k| w[k * n + i] > 0.0).collect();
                let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
                let (mut g, mut own) = (vec![0.0; at.len()], vec![0.0; at.len()]);
                let mut q = vec![[0.0; 2]; at.len()];
                s.values(&at, &mut g);
                self.ends_of(i, &at, &mut own, &mut q);
                for (j, k) in here.into_iter().enumerate() {
                    f[k] += w[k * n + i] * g[j];
                    (high[k * n + i], quantiles[k * n + i]) = (own[j], q[j]);
                }
            }
            for (k, (o, p)) in out.iter_mut().zip(points).enumerate() {
                let w = &w[k * n..][..n];
                let own = (w, &high[k * n..][..n]);
                position.quantiles.clear();
                position.quantiles.extend_from_slice(&quantiles[k * n..][..n]);
                *o = self.value_at(*p, f[k], own, &mut position);
            }
        }
    }

    /// Fills values and gradients (per mm).
    pub(super) fn gradients_at(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        // One function, compiled for the numbers of lattices and windows that are frequent.
        let one = self.levels.as_deref().is_none_or(|l| l.windows.len() == 1);
        let of = match (self.summands.len(), one) {
            (2, false) => Blend::gradients_of::<2, 8>,
            (3, false) => Blend::gradients_of::<3, 8>,
            (_, false) => Blend::gradients_of::<0, 8>,
            (2, true) => Blend::gradients_of::<2, 1>,
            (3, true) => Blend::gradients_of::<3, 1>,
            (_, true) => Blend::gradients_of::<0, 1>,
        };
        of(self, points, values, gradients);
    }

    /// The value at a point with shares `w`, where the sum is `f` and the upper ends are `high`; `at` has the quantiles already.
    fn value_at(&self, p: Vec3, f: f64, (w, high): (&[f64], &[f64]), at: &mut Position) -> f64 {
        let alone = w.contains(&1.0);
        let levels = self.levels.as_deref().filter(|_| !alone);
        if let Some(levels) = levels {
            levels.grid.locate(w, &mut at.simplex);
        }
        let mut ends = [0.0; 2];
        for &end in self.ends() {
            for (i, s) in self.summands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                ends[end] += w[i] * s.end(end, high[i], alone);
            }
            if let Some(levels) = levels {
                ends[end] += levels.offset(&self.summands, p, w, at, end);
            }
        }
        self.value_of([f, ends[LOW], ends[HIGH]])
    }

    /// The same of N lattices, or of any number if N is 0, with C windows about each point.
    fn gradients_of<const N: usize, const C: usize>(
        &self,
        points: &[Vec3],
        values: &mut [f64],
        gradients: &mut [Vec3],
    ) {
        let n = if N > 0 { N } else { self.summands.len() };
        let summands = &self.summands[..n];
        let (mut w, mut dw) = zeros(n * points.len());
        self.weights.gradients(points, &mut w, &mut dw);
        let evaluate = |i: usize| Evaluated::where_weighted(self, i, points, |k| w[k * n + i] > 0.0);
        let evaluated: Vec<Evaluated> = (0..n).map(evaluate).collect();
        let varied = self.varied().is_some();
        let mut quantiles = vec![EndQuantiles::default(); if varied { n } else { 0 }];
        let mut simplex = ShareSimplex::default();
        let mut windows = self.levels.as_deref().map(|l| WindowCache::<C>::new(l, summands));
        for (k, p) in points.iter().enumerate() {
            let (w, dw) = (&w[k * n..][..n], &dw[k * n..][..n]);
            let present = || evaluated.iter().enumerate().filter(|(i, _)| w[*i] > 0.0);
            let (mut f, mut df) = (0.0, [0.0; 3]);
            for (i, of) in present() {
                f += w[i] * of.values[k];
                let own = add(scale(of.gradients[k], w[i]), scale(dw[i], of.values[k]));
                df = add(df, own);
            }
            if varied {
                (quantiles.iter_mut().zip(&evaluated)).for_each(|(q, of)| *q = of.quantiles[k]);
            }
            let alone = w.contains(&1.0);
            let levels = self.levels.as_deref().filter(|_| !alone);
            if let (Some(levels), Some(windows)) = (levels, &mut windows) {
                levels.grid.locate(w, &mut simplex);
                windows.move_to(*p);
            }
            for (e, &end) in self.ends().iter().enumerate() {
                let (mut level, mut slope) = (0.0, [0.0; 3]);
                for (i, of) in present() {
                    let s = &summands[i];
                    let v = s.end(end, of.high[k], alone);
                    level += w[i] * v;
                    let own = scale(of.high_gradients[k], w[i] * s.end_slope(end));
                    slope = add(slope, add(own, scale(dw[i], v)));
                }
                if let (Some(levels), Some(windows)) = (levels, &mut windows) {
                    let own = (w, dw, &simplex);
                    let offset = levels.offset_gradients(summands, windows, own, &quantiles, end);
                    (level, slope) = (level + offset.0, add(slope, offset.1));
                }
                let (v, g) = match end == HIGH {
                    true => (f - level, sub(df, slope)),
                    false => (level - f, sub(slope, df)),
                };
                if e == 0 || v > values[k] {
                    (values[k], gradients[k]) = (v, g);
                }
            }
        }
    }
}
