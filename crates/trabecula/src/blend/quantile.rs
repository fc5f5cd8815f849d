//! Quantiles of many numbers: counted in steps of their range, and tabulated.

use multiversion::multiversion;

/// Steps of a quantile function between its knots. What a step holds is so small a share of all that in it the function
/// may be anything: the fraction is off by a part of a step, a few thousandths, at the very ends, and far less elsewhere.
pub(super) const KNOTS: usize = 64;
/// Steps in which values are counted.
const STEPS: usize = 512;

/// How many of some values lie below each of even steps of their range. Linear within a step, whose number makes the
/// range that what looking at some places leaves open is far more.
pub(super) struct Counted {
    low: f64,
    step: f64,
    /// Counts below the ends of the steps.
    below: [u32; STEPS + 1],
}

impl Counted {
    /// Counts values.
    pub fn of(values: &[f32]) -> Counted {
        let (lo, hi) = range(values);
        let mut below = [0; STEPS + 1];
        let per = if hi > lo { STEPS as f32 / (hi - lo) } else { 0.0 };
        for v in values {
            below[1 + (((v - lo) * per) as usize).min(STEPS - 1)] += 1;
        }
        for k in 0..STEPS {
            below[k + 1] += below[k];
        }
        Counted { low: f64::from(lo), step: f64::from(hi - lo) / STEPS as f64, below }
    }

    /// The value below which a share of all lies.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = share.clamp(0.0, 1.0) * f64::from(self.below[STEPS]);
        let k = self.below.partition_point(|n| f64::from(*n) < wanted).clamp(1, STEPS);
        let [a, b] = [k - 1, k].map(|k| f64::from(self.below[k]));
        self.low + self.step * ((k - 1) as f64 + ((wanted - a) / (b - a).max(1.0)).clamp(0.0, 1.0))
    }

    /// Fills the knots of the quantile function.
    pub fn knots(&self, out: &mut [f32]) {
        for (k, o) in out.iter_mut().enumerate() {
            *o = self.quantile(k as f64 / KNOTS as f64) as f32;
        }
    }

    /// Greatest less least value.
    pub fn whole(&self) -> f64 {
        self.step * STEPS as f64
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn range(values: &[f32]) -> (f32, f32) {
    const LANES: usize = 16;
    let (mut lo, mut hi) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    let rows = values.chunks_exact(LANES);
    let rest = rows.remainder();
    for row in rows {
        for l in 0..LANES {
            lo[l] = if row[l] < lo[l] { row[l] } else { lo[l] };
            hi[l] = if row[l] > hi[l] { row[l] } else { hi[l] };
        }
    }
    let least = lo.iter().chain(rest).fold(f32::INFINITY, |a, b| a.min(*b));
    (least, hi.iter().chain(rest).fold(f32::NEG_INFINITY, |a, b| a.max(*b)))
}

/// Adds w times the values.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_times(sum: &mut [f32], w: f32, values: &[f32]) {
    sum.iter_mut().zip(values).for_each(|(o, v)| *o += w * v);
}

/// Where a share lies among the knots of quantile functions: between which two, and how far past the first. Below none a
/// function falls on as steeply as it rises in all.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    knots: [usize; 2],
    past: f64,
    /// The second less the first, per share.
    per: f64,
}

impl Spot {
    /// Where the share q lies.
    #[inline]
    pub fn of(q: f64) -> Spot {
        if q < 0.0 {
            let knots = [0, KNOTS];
            return Spot { knots, past: q, per: 1.0 };
        }
        let x = (q * KNOTS as f64).min(KNOTS as f64);
        // The conversion to a short number is the fastest.
        let k = (x as i32 as usize).min(KNOTS - 1);
        Spot { knots: [k, k + 1], past: x - k as f64, per: KNOTS as f64 }
    }

    /// Value and slope of a quantile function there, from its knots.
    #[inline]
    pub fn ask(&self, knots: &[f32]) -> (f64, f64) {
        let [a, b] = self.knots.map(|k| f64::from(knots[k]));
        (a + (b - a) * self.past, (b - a) * self.per)
    }
}

/// Value and slope of a quantile function at the share q, from its knots.
#[inline]
pub(super) fn quantile(knots: &[f32], q: f64) -> (f64, f64) {
    Spot::of(q).ask(knots)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers whose quantiles are known: v² of even v, and one number alone.
    #[test]
    fn quantiles_are_those_of_the_numbers() {
        let values: Vec<f32> = (0..4099).map(|i| (i as f32 / 4098.0).powi(2) - 0.25).collect();
        let counted = Counted::of(&values);
        let mut knots = [0f32; KNOTS + 1];
        counted.knots(&mut knots);
        assert!((counted.whole() - 1.0).abs() < 1e-6);
        for i in 0..=100 {
            let q = f64::from(i) / 100.0;
            let want = q * q - 0.25;
            // A step of the range is as wide as what its own numbers are apart at most.
            assert!((counted.quantile(q) - want).abs() < 1.5e-3, "{q}: {}", counted.quantile(q));
            assert!((quantile(&knots, q).0 - want).abs() < 2.5e-3, "{q}: {}", quantile(&knots, q).0);
        }
        assert!((counted.quantile(0.0) + 0.25).abs() < 1e-6 && (counted.quantile(1.0) - 0.75).abs() < 1e-6);
        let (below, slope) = quantile(&knots, -0.1);
        assert!((below + 0.35).abs() < 1e-6 && (slope - 1.0).abs() < 1e-6);
        let same = Counted::of(&[2.5; 7]);
        assert_eq!([0.0, 0.3, 1.0].map(|q| same.quantile(q)), [2.5; 3]);
    }
}
