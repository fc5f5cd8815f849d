//! Reproducible numbers for sampling and tests, the same on every machine: random ones, and a sequence of low discrepancy.

use crate::math::Vec3;

/// The next number of a sequence, uniform in [−1, 1); `state` is its seed at first.
///
/// The upper 53 bits of a linear congruential generator modulo 2⁶⁴ with Knuth's multiplier (MMIX).
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Point `k` of the R₃ sequence: the fractional parts of ½ + k/φ, ½ + k/φ², ½ + k/φ³, φ the root of x⁴ = x + 1, which fill the
/// unit cube evenly from any point on (M. Roberts, 2018, "The unreasonable effectiveness of quasirandom sequences").
pub fn low_discrepancy(k: usize) -> Vec3 {
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3].map(|a| (0.5 + a * k as f64).fract())
}
