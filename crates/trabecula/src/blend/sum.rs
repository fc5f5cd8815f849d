//! The weighted sum F = Σ wᵢ gᵢ and the interval [LO, HI] of it that is solid.

use std::sync::Arc;

use super::constituent::Constituent;
use super::ends::{HIGH, LOW};
use super::levels::BlendLevels;
use super::summand::Summand;
use super::weights::Weights;
use super::windows::{Phases, Windows};
use crate::kind::Kind;
use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, apply, inverse, norm, sub};

/// Largest number of lattices: one bit of a word for each.
const MOST: usize = 64;
/// Sample positions for the root mean square of a core.
const SAMPLES: usize = 4096;

/// What a blend keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Kind)]
#[kind(name = "By", noun = "word")]
pub enum BlendRule {
    /// The solid fractions: each lattice's own where it is alone, their weighted mean between.
    #[default]
    Fraction,
    /// The weighted sum of the fields as it comes; material is lost half-way.
    Value,
}

/// One of the two inequalities of a blend with sheets in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlendBound {
    /// F ≤ HI.
    High,
    /// F ≥ LO.
    Low,
}

/// A blend of lattices, as a field: the greater of F − HI and LO − F.
#[derive(Clone)]
pub struct Blend {
    pub(super) summands: Arc<[Summand]>,
    pub(super) weights: Weights,
    /// Set where the fraction is kept.
    pub(super) levels: Option<Arc<BlendLevels>>,
    /// Whether any summand is a sheet, so that there is a lower end.
    pub(super) two_sided: bool,
    /// Set for one side alone.
    pub(super) side: Option<BlendBound>,
    /// A Lipschitz bound, per mm.
    pub(super) lipschitz: f64,
    /// The covariance of each pair of summands, where one distribution serves everywhere.
    pub(super) covariance: Option<Arc<Covariance>>,
}

/// The covariance of each pair of summands, row by row, and the positions (mm) at which it was sampled.
pub(super) struct Covariance {
    of: Vec<f64>,
    positions: Vec<Vec3>,
}

impl Blend {
    /// The blend of these lattices in a part with these bounds (mm).
    ///
    /// # Errors
    /// Fewer than two lattices, more than 64, or another number of them than of weights.
    pub fn new(of: Vec<Constituent>, weights: Weights, by: BlendRule, bounds: &Aabb) -> Result<Blend, Fault> {
        if of.len() < 2 || of.len() != weights.len() || of.len() > MOST {
            let message = format!(
                "{} lattices and {} weights; a blend is of 2 to {} lattices with a weight each",
                of.len(),
                weights.len(),
                MOST
            );
            return Err(Fault::new("", message));
        }
        let windows = Windows::new(&of, bounds);
        let normalise = by == BlendRule::Fraction;
        let (summands, covariance) = summands(of, normalise, &windows, bounds);
        let summands: Arc<[Summand]> = summands.into();
        let levels = normalise.then(|| Arc::new(BlendLevels::new(&summands, windows, &weights)));
        // Half as much again for the gradients of the shares: transitions are longer than cells.
        let lipschitz = summands.iter().map(Summand::lipschitz).fold(0.0, f64::max) * 1.5;
        Ok(Blend {
            two_sided: summands.iter().any(Summand::is_sheet),
            summands,
            weights,
            levels,
            side: None,
            lipschitz,
            covariance: covariance.map(Arc::new),
        })
    }

    /// The shares.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// The greatest length of a cell, mm.
    pub fn longest(&self) -> f64 {
        self.summands.iter().map(Summand::longest).fold(0.0, f64::max)
    }

    /// The root mean square of F with these shares, over that of independent lattices, √(wᵀCw / Σ wᵢ² Cᵢᵢ); near 0 they cancel.
    /// `None` where phases drift, and between two sheets: the negative of a sheet is the same sheet.
    pub fn kept(&self, w: &[f64]) -> Option<f64> {
        let n = self.summands.len();
        let c = &self.covariance.as_ref()?.of;
        let (all, alone) = (0..n).fold((0.0, 0.0), |(all, alone), i| {
            let row: f64 = (0..n).map(|j| w[j] * c[n * i + j]).sum();
            (all + w[i] * row, alone + w[i] * w[i] * c[n * i + i])
        });
        let sheets = (0..n).filter(|i| w[*i] > 0.0).all(|i| self.summands[i].is_sheet());
        (alone > 0.0 && !sheets).then(|| (all.max(0.0) / alone).sqrt())
    }

    /// The `offset` (mm) of lattice `b`, in eighths of its cell, at which its core correlates best with that of `a`; the nearest to
    /// none of several. `None` where no one distribution serves everywhere, and where they correlate at no offset.
    pub fn offset_in_step(&self, a: usize, b: usize) -> Option<Vec3> {
        /// Positions that are used, steps on a cell, the least correlation, and differences of it that count as none.
        const POSITIONS: usize = 1024;
        const STEPS: i32 = 8;
        const LEAST: f64 = 0.1;
        const EQUAL: f64 = 1e-3;
        let covariance = self.covariance.as_ref()?;
        let positions = &covariance.positions[..covariance.positions.len().min(POSITIONS)];
        let map = self.summands[b].lattice()?.map.affine()?;
        let back = inverse(&map.matrix);
        let centred = |summand: &Summand, moved: Vec3| -> Vec<f64> {
            let at: Vec<Vec3> = positions.iter().map(|p| sub(*p, moved)).collect();
            let mut values = vec![0.0; at.len()];
            summand.values(&at, &mut values);
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            values.iter().map(|v| v - mean).collect()
        };
        let dot = |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
        let fixed = centred(&self.summands[a], [0.0; 3]);
        let each = (0..STEPS.pow(3)).map(|n| {
            let turns = [n % STEPS, n / STEPS % STEPS, n / STEPS / STEPS].map(|n| f64::from(n) / f64::from(STEPS));
            let moved = centred(&self.summands[b], apply(&back, turns));
            let size = (dot(&fixed, &fixed) * dot(&moved, &moved)).sqrt();
            // From −1/2, exclusive, to 1/2.
            let whole = sub(turns, map.shift).map(|u| u - (u - 0.5).ceil());
            (dot(&fixed, &moved) / size, apply(&back, whole))
        });
        let each: Vec<(f64, Vec3)> = each.collect();
        let most = each.iter().map(|e| e.0).fold(LEAST, f64::max);
        let best = each.iter().filter(|e| e.0 > most - EQUAL).map(|e| e.1);
        best.min_by(|a, b| norm(*a).total_cmp(&norm(*b)))
    }

    /// Whether its lattices have the same shares everywhere.
    pub fn is_uniform(&self) -> bool {
        self.weights.are_constant()
    }

    /// Which phases meet, where the fraction is kept.
    pub fn phases(&self) -> Option<Phases> {
        self.levels.as_ref().map(|l| l.windows.phases)
    }

    /// Fills the fraction asked for at points (mm), Σ wᵢ pᵢ. That of a field that is no lattice is measured in the windows about the
    /// point; by value there are none, and where such a field has a weight the fraction is NaN.
    pub fn fractions(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.summands.len();
        let mut w = vec![0.0; n * points.len()];
        self.weights.values(points, &mut w);
        let mut own = vec![0.0; points.len()];
        out.fill(0.0);
        for (i, s) in self.summands.iter().enumerate() {
            match (s.lattice(), &self.levels) {
                (Some(l), _) => l.fractions(points, &mut own),
                (None, Some(levels)) => {
                    for (k, o) in own.iter_mut().enumerate().filter(|(k, _)| w[k * n + i] > 0.0) {
                        let [a, b] = levels.measured_quantiles(&self.summands, points[k], i).quantiles;
                        *o = b - a.max(0.0);
                    }
                }
                (None, None) => own.fill(f64::NAN),
            }
            for (k, (o, p)) in out.iter_mut().zip(&own).enumerate() {
                if w[k * n + i] > 0.0 {
                    *o += w[k * n + i] * p;
                }
            }
        }
    }

    /// The ends (`LOW`, `HIGH`) whose inequalities this field has.
    pub(super) fn ends(&self) -> &'static [usize] {
        self.ends_on(self.side)
    }

    /// The same of a side.
    pub(super) fn ends_on(&self, side: Option<BlendBound>) -> &'static [usize] {
        match side {
            Some(BlendBound::High) => &[HIGH],
            Some(BlendBound::Low) => &[LOW],
            None if self.two_sided => &[HIGH, LOW],
            None => &[HIGH],
        }
    }

    /// The levels, where quantiles vary in space.
    pub(super) fn varied(&self) -> Option<&BlendLevels> {
        self.levels.as_deref().filter(|l| !l.is_uniform())
    }

    /// Fills the upper end of summand `s` at points (mm), and the quantiles of both ends where levels vary.
    pub(super) fn ends_of(&self, s: usize, points: &[Vec3], high: &mut [f64], quantiles: &mut [[f64; 2]]) {
        let summand = &self.summands[s];
        let Some(levels) = self.varied() else {
            return summand.upper_ends(points, high);
        };
        if !summand.ends(points, high, quantiles) {
            for (q, p) in quantiles.iter_mut().zip(points) {
                *q = levels.measured_quantiles(&self.summands, *p, s).quantiles;
            }
        }
    }

    /// The value where F, LO and HI are these.
    pub(super) fn value_of(&self, of: [f64; 3]) -> f64 {
        self.value_on(self.side, of)
    }

    /// The same on a side.
    #[inline]
    fn value_on(&self, side: Option<BlendBound>, [f, lo, hi]: [f64; 3]) -> f64 {
        match side {
            Some(BlendBound::High) => f - hi,
            Some(BlendBound::Low) => lo - f,
            None if self.two_sided => (f - hi).max(lo - f),
            None => f - hi,
        }
    }

    /// The value on a side where summand `s` is alone, with value `g` and upper end `high`.
    #[inline]
    pub(super) fn alone(&self, side: Option<BlendBound>, s: usize, g: f64, high: f64) -> f64 {
        self.value_on(side, [g, self.summands[s].lower_end_alone(high), high])
    }
}

/// The summands; if `normalise`, with their cores divided by their root mean square deviation from the mean. And their covariance,
/// where one window serves everywhere.
fn summands(
    of: Vec<Constituent>,
    normalise: bool,
    windows: &Windows,
    bounds: &Aabb,
) -> (Vec<Summand>, Option<Covariance>) {
    let mut points = match windows.phases {
        Phases::Drifting => Vec::new(),
        Phases::Locked | Phases::Independent => windows.samples(0),
    };
    if points.is_empty() {
        let each = SAMPLES.div_ceil(windows.len()).max(64);
        // Of windows evenly spaced among all.
        let some = (SAMPLES / each).min(windows.len()).max(1);
        let sampled =
            (0..some).flat_map(|i| windows.samples((2 * i + 1) * windows.len() / (2 * some)).into_iter().take(each));
        points.extend(sampled);
    } else {
        points.truncate(SAMPLES);
    }
    let mut centred = Vec::new();
    let each = of.into_iter().map(|c| {
        let mut values = vec![0.0; points.len()];
        c.cores(&points, &mut values);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let square = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        let scale = if normalise && square > 0.0 { square.sqrt() } else { 1.0 };
        let made = Summand::new(c, scale, &values, bounds);
        centred.push(values.into_iter().map(|v| made.scaled_value(v - mean)).collect::<Vec<f64>>());
        made
    });
    let made: Vec<Summand> = each.collect();
    let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
    let of = || centred.iter().flat_map(|a| centred.iter().map(|b| product(a, b))).collect();
    let covariance = (windows.phases != Phases::Drifting).then(of);
    (made, covariance.map(|of| Covariance { of, positions: points }))
}
