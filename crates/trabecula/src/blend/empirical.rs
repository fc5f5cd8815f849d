//! Empirical distributions: the histogram of a sample, and its quantile function tabulated at equally spaced fractions.
//!
//! The quantile function T(q) of a sample is the value below which a fraction q of it lies. It is linear within a bin of the
//! histogram, whose width is the range over `BINS`, and is tabulated at q = k/`SEGMENTS`, linear between.

use multiversion::multiversion;

/// Segments of a tabulated quantile function. Between two of its fractions the true function may be anything monotone: the
/// fraction is off by part of a segment, a few thousandths, at the very ends, and far less elsewhere.
pub(super) const SEGMENTS: usize = 64;
/// Bins of a histogram over the range of the values: finer than the error of sampling at some thousand positions.
const BINS: usize = 512;

/// The cumulative histogram of a sample.
pub(super) struct Empirical {
    least: f64,
    bin: f64,
    /// Number of values below the ends of the bins.
    below: [u32; BINS + 1],
}

impl Empirical {
    pub fn new(values: &[f32]) -> Empirical {
        let (lo, hi) = range(values);
        let mut below = [0; BINS + 1];
        let per = if hi > lo { BINS as f32 / (hi - lo) } else { 0.0 };
        for v in values {
            below[1 + (((v - lo) * per) as usize).min(BINS - 1)] += 1;
        }
        for k in 0..BINS {
            below[k + 1] += below[k];
        }
        Empirical { least: f64::from(lo), bin: f64::from(hi - lo) / BINS as f64, below }
    }

    /// T(q), the value below which a fraction q of the sample lies.
    pub fn quantile(&self, q: f64) -> f64 {
        let wanted = q.clamp(0.0, 1.0) * f64::from(self.below[BINS]);
        let k = self.below.partition_point(|n| f64::from(*n) < wanted).clamp(1, BINS);
        let [a, b] = [k - 1, k].map(|k| f64::from(self.below[k]));
        self.least + self.bin * ((k - 1) as f64 + ((wanted - a) / (b - a).max(1.0)).clamp(0.0, 1.0))
    }

    /// Fills a table of T at the fractions k/`SEGMENTS`, k = 0 … `SEGMENTS`.
    pub fn tabulate(&self, out: &mut [f32]) {
        for (k, o) in out.iter_mut().enumerate() {
            *o = self.quantile(k as f64 / SEGMENTS as f64) as f32;
        }
    }

    /// The greatest less the least value.
    pub fn range(&self) -> f64 {
        self.bin * BINS as f64
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

/// Adds w times the values to a sum.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_times(sum: &mut [f32], w: f32, values: &[f32]) {
    sum.iter_mut().zip(values).for_each(|(o, v)| *o += w * v);
}

/// The segment of tabulated quantile functions in which a fraction lies, and the position in it. Below q = 0 a function continues
/// with the mean slope of the whole table.
#[derive(Clone, Copy)]
pub(super) struct QuantileSegment {
    /// Indices of its ends in a table.
    ends: [usize; 2],
    /// Position from the first end, in lengths of the segment.
    position: f64,
    /// Segments per unit of q.
    per: f64,
}

impl QuantileSegment {
    /// The segment of the fraction q.
    #[inline]
    pub fn at(q: f64) -> QuantileSegment {
        if q < 0.0 {
            return QuantileSegment { ends: [0, SEGMENTS], position: q, per: 1.0 };
        }
        let x = (q * SEGMENTS as f64).min(SEGMENTS as f64);
        // Conversion through i32 is the fastest.
        let k = (x as i32 as usize).min(SEGMENTS - 1);
        QuantileSegment { ends: [k, k + 1], position: x - k as f64, per: SEGMENTS as f64 }
    }

    /// T and dT/dq there, from the table of T.
    #[inline]
    pub fn value_and_slope(&self, table: &[f32]) -> (f64, f64) {
        let [a, b] = self.ends.map(|k| f64::from(table[k]));
        (a + (b - a) * self.position, (b - a) * self.per)
    }
}

/// T(q) from a table of T.
#[inline]
pub(super) fn quantile(table: &[f32], q: f64) -> f64 {
    QuantileSegment::at(q).value_and_slope(table).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples whose quantiles are known: squares of equally spaced numbers, and a constant.
    #[test]
    fn quantiles_are_those_of_the_numbers() {
        let values: Vec<f32> = (0..4099).map(|i| (i as f32 / 4098.0).powi(2) - 0.25).collect();
        let distribution = Empirical::new(&values);
        let mut table = [0f32; SEGMENTS + 1];
        distribution.tabulate(&mut table);
        assert!((distribution.range() - 1.0).abs() < 1e-6);
        for i in 0..=100 {
            let q = f64::from(i) / 100.0;
            let want = q * q - 0.25;
            // Within a bin the quantile is off by the width of the bin at most.
            assert!((distribution.quantile(q) - want).abs() < 1.5e-3, "{q}: {}", distribution.quantile(q));
            assert!((quantile(&table, q) - want).abs() < 2.5e-3, "{q}: {}", quantile(&table, q));
        }
        assert!((distribution.quantile(0.0) + 0.25).abs() < 1e-6 && (distribution.quantile(1.0) - 0.75).abs() < 1e-6);
        let (below, slope) = QuantileSegment::at(-0.1).value_and_slope(&table);
        assert!((below + 0.35).abs() < 1e-6 && (slope - 1.0).abs() < 1e-6);
        let same = Empirical::new(&[2.5; 7]);
        assert_eq!([0.0, 0.3, 1.0].map(|q| same.quantile(q)), [2.5; 3]);
    }
}
