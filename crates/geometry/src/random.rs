//! Reproducible random numbers, for sampling and tests: the same on every machine.

/// The next number of a sequence, uniform in [−1, 1); `state` is its seed at first.
///
/// The upper 53 bits of a linear congruential generator modulo 2⁶⁴ with Knuth's multiplier (MMIX).
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
