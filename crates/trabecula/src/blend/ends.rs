//! The two ends of the solid interval [lo, hi], and their quantiles.

use geometry::math::{Vec3, add, scale, sub};

/// The lower end and the upper end, as indices.
pub(super) const LOW: usize = 0;
pub(super) const HIGH: usize = 1;

/// The quantiles [a, b] of a lattice's ends at a point, and their gradients (per mm).
#[derive(Clone, Copy, Default)]
pub(super) struct EndQuantiles {
    pub quantiles: [f64; 2],
    pub slopes: [Vec3; 2],
}

/// The quantiles of a blend's ends: A = Σ wᵢ aᵢ and max(A, 0) + Σ wᵢ (bᵢ − max(aᵢ, 0)), so that the fraction between them is
/// the weighted mean of the lattices' fractions.
pub(super) fn blended(w: &[f64], each: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut a, mut p) = (0.0, 0.0);
    for (w, [lo, hi]) in w.iter().zip(each) {
        a += w * lo;
        p += w * (hi - lo.max(0.0));
    }
    [a, a.max(0.0) + p]
}

/// One end of [`blended`] and its gradient (per mm); `dw` are the gradients of the shares.
pub(super) fn blended_gradient(w: &[f64], dw: &[Vec3], ends: &[EndQuantiles], end: usize) -> (f64, Vec3) {
    let q = blended(w, ends.iter().map(|e| e.quantiles));
    let (mut da, mut dp) = ([0.0; 3], [0.0; 3]);
    for ((w, dw), e) in w.iter().zip(dw).zip(ends) {
        let ([lo, hi], [dlo, dhi]) = (e.quantiles, e.slopes);
        let (from, dfrom) = if lo > 0.0 { (lo, dlo) } else { (0.0, [0.0; 3]) };
        da = add(da, add(scale(*dw, lo), scale(dlo, *w)));
        dp = add(dp, add(scale(*dw, hi - from), scale(sub(dhi, dfrom), *w)));
    }
    match end {
        LOW => (q[LOW], da),
        _ if q[LOW] > 0.0 => (q[HIGH], add(da, dp)),
        _ => (q[HIGH], dp),
    }
}
