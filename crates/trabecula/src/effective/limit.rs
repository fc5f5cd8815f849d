//! Richardson's extrapolation of a tensor from up to three grids.

use crate::kind::Warning;

/// A limit.
pub struct Limit {
    /// The extrapolated entries, or the finest grid's.
    pub tensor: Vec<f64>,
    /// Distance of the extrapolated entries from the finest grid's, over the size of `tensor`; more where the grids do not converge
    /// by a power of the edge.
    pub error: f64,
    /// The exponent of the voxel's edge.
    pub order: f64,
    /// Whether the entries are the finest grid's, the grids being too far apart for an extrapolation.
    pub finest: bool,
}

/// Order that is taken where it cannot be observed.
const USUAL: f64 = 2.0;
/// Observed orders beyond these are not trusted.
const ORDERS: [f64; 2] = [1.0, 3.0];
/// How far beyond them steps are still taken to fall by a power.
const TRUSTED: f64 = 0.5;
/// Share of an entry of the diagonal by which an extrapolation may change it: the expansion in powers of the edge begins well below one.
const FARTHEST: f64 = 0.5;
/// Share of the largest entry of the diagonal below which one is rounding.
const ROUNDING: f64 = 1e-9;

/// The limit of tensors on grids of these shapes, the finest first: with the order that the differences show, if there are three whose
/// differences point the same way, else with the usual one. Where it would change an entry of the diagonal, which is not negative, by more
/// than half, it is not taken.
pub fn limit(grids: &[([usize; 3], Vec<f64>)]) -> Limit {
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let voxels = |s: &[usize; 3]| s.iter().product::<usize>() as f64;
    let [(shape, finest), rest @ ..] = grids else {
        return Limit { tensor: Vec::new(), error: 0.0, order: USUAL, finest: false };
    };
    let Some((coarse, next)) = rest.first() else {
        return Limit { tensor: finest.clone(), error: f64::INFINITY, order: USUAL, finest: true };
    };
    let ratio = (voxels(shape) / voxels(coarse)).cbrt();
    let step: Vec<f64> = finest.iter().zip(next).map(|(a, b)| a - b).collect();
    let (order, doubt) = match rest.get(1) {
        None => (USUAL, 0.0),
        Some((_, last)) => {
            let before: Vec<f64> = next.iter().zip(last).map(|(a, b)| a - b).collect();
            let along: f64 = step.iter().zip(&before).map(|(a, b)| a * b).sum();
            let alike = along > 0.5 * size(&step) * size(&before);
            let seen = (size(&before) / size(&step)).ln() / ratio.ln();
            let order = if alike && seen.is_finite() { seen.clamp(ORDERS[0], ORDERS[1]) } else { USUAL };
            // Steps that fall by no power of the edge, as where walls lie along the voxels, may be small by chance: the error is then at
            // least what is left of the one before at the usual order.
            let by = ratio.powf(USUAL);
            let regular = alike && seen <= ORDERS[1] + TRUSTED;
            (order, if regular { 0.0 } else { size(&before) / by / (by - 1.0) })
        }
    };
    let share = 1.0 / (ratio.powf(order) - 1.0);
    let diagonal: Vec<usize> = (0..finest.len()).step_by(finest.len().isqrt() + 1).collect();
    let largest = diagonal.iter().fold(0.0f64, |m, i| m.max(finest[*i]).max(next[*i]));
    let far = |i: usize| share * step[i].abs() > FARTHEST * finest[i].max(ROUNDING * largest);
    if diagonal.iter().any(|i| far(*i)) {
        // Nothing on the finest grid and something on the next: wrong by all of it.
        let whole = if size(finest) > 0.0 { size(finest) } else { share * size(&step) };
        return Limit { tensor: finest.clone(), error: share * size(&step) / whole, order, finest: true };
    }
    let tensor: Vec<f64> = finest.iter().zip(&step).map(|(c, d)| c + share * d).collect();
    let error = (share * size(&step)).max(doubt) / size(&tensor).max(f64::MIN_POSITIVE);
    Limit { tensor, error, order, finest: false }
}

impl Limit {
    /// A warning if the figures at this path, from `n` voxels along an edge, are no limit.
    pub fn doubt(&self, path: &str, n: usize) -> Option<Warning> {
        let (by, need) = (100.0 * self.error, 2 * n);
        let message = format!(
            "the grids differ too much for an extrapolation: the figures are those of the finest, with an error of {by:.0} %; take n = {need}"
        );
        (self.finest && self.error.is_finite()).then(|| Warning { path: path.into(), message })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_power_of_the_edge_is_removed_exactly() {
        for order in [1.0, 1.6, 2.0] {
            let grid = |n: usize| {
                let h = 1.0 / n as f64;
                ([n; 3], vec![2.0 + 0.3 * h.powf(order), -1.0 + 0.1 * h.powf(order)])
            };
            let found = limit(&[grid(64), grid(32), grid(16)]);
            assert!((found.order - order).abs() < 1e-9);
            assert!((found.tensor[0] - 2.0).abs() < 1e-12 && (found.tensor[1] + 1.0).abs() < 1e-12);
        }
    }

    /// Walls along the voxels: the last step is small by chance, and the error is that of the step before.
    #[test]
    fn steps_that_follow_no_power_leave_the_error_of_those_before() {
        let grid = |n: usize, k: f64| ([n; 3], vec![k]);
        for next in [0.1593, 0.1595] {
            let found = limit(&[grid(48, 0.1594), grid(24, next), grid(12, 0.1469)]);
            assert!(found.error > 0.006 && found.error < 0.008, "{}", found.error);
        }
        let regular = limit(&[grid(48, 1.01), grid(24, 1.04), grid(12, 1.16)]);
        assert!((regular.error - 0.01).abs() < 1e-3, "{}", regular.error);
    }

    /// Where a power of the edge would take a positive figure to nothing or beyond, the finest grid's stands, and the error says how far.
    #[test]
    fn a_positive_figure_stays_positive() {
        let grid = |n: usize, k: [f64; 3]| ([n; 3], vec![k[0], 0.1, 0.0, 0.1, k[1], 0.0, 0.0, 0.0, k[2]]);
        for (found, size) in [
            (limit(&[grid(32, [1.0; 3]), grid(16, [9.0; 3]), grid(8, [18.0; 3])]), 7.9),
            (limit(&[grid(32, [1.0, 1.0, 0.1]), grid(16, [1.1, 1.1, 0.9])]), 0.18),
            (limit(&[grid(32, [1.0, 1.0, 0.0]), grid(16, [1.0, 1.0, 0.5])]), 0.1),
        ] {
            assert!(found.finest && found.doubt("", 32).is_some());
            assert!([0, 4, 8].iter().all(|i| found.tensor[*i] >= 0.0));
            assert!(found.error > size && found.error.is_finite(), "{}", found.error);
        }
        let nothing = limit(&[([32; 3], vec![0.0]), ([16; 3], vec![3.0])]);
        assert!(nothing.tensor == [0.0] && nothing.error == 1.0);
        // A direction in which nothing goes but rounding is no obstacle to the others.
        let found = limit(&[grid(32, [1.0, 1.0, 1e-17]), grid(16, [1.3, 1.3, -2e-17])]);
        assert!(!found.finest && (found.tensor[0] - 0.9).abs() < 1e-12);
    }
}
