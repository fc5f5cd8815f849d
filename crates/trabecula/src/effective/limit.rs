//! Richardson's extrapolation from up to three grids: of arrays as a whole, and of symmetric tensors mode by mode.

use crate::kind::Warning;
use geometry::dense::eigen;

/// A limit.
pub struct Limit {
    /// The extrapolated entries, or the finest grid's.
    pub tensor: Vec<f64>,
    /// Distance of the extrapolated entries from the finest grid's, over the size of `tensor`; more where the grids do not converge
    /// by a power of the edge.
    pub error: f64,
    /// The exponent of the voxel's edge; of modes, that of the one that changes most.
    pub order: f64,
    /// Whether the grids are too far apart for an extrapolation: the entries are the finest grid's, or a mode is changed by half.
    pub finest: bool,
    /// The modes of a symmetric tensor.
    pub modes: Vec<Mode>,
}

/// An eigenvector of a tensor.
pub struct Mode {
    vector: Vec<f64>,
    /// Its limit.
    value: f64,
    /// The estimated error of that.
    error: f64,
}

/// Order that is taken where it cannot be observed.
const USUAL: f64 = 2.0;
/// Observed orders beyond these are not trusted: linear elements and fractions of cut voxels are of the second order at most, and where a
/// step is smaller than that the one before was of a grid too coarse for the walls.
const ORDERS: [f64; 2] = [1.0, 2.0];
/// Orders up to this are still taken for a fall by a power.
const TRUSTED: f64 = 3.5;
/// Share of an entry of the diagonal by which an extrapolation may change it: the expansion in powers of the edge begins well below one.
const FARTHEST: f64 = 0.5;
/// Share of the largest entry of the diagonal below which one is rounding.
const ROUNDING: f64 = 1e-9;

fn size(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// The exponent of the edge by which steps fall, the last and that before it between grids whose edges have this ratio, and the least
/// error to be believed after both. The usual exponent where they point different ways, or there is one alone.
fn fall(step: &[f64], before: Option<&[f64]>, ratio: f64) -> (f64, f64) {
    let Some(before) = before else { return (USUAL, 0.0) };
    let along: f64 = step.iter().zip(before).map(|(a, b)| a * b).sum();
    let alike = along > 0.5 * size(step) * size(before);
    let seen = (size(before) / size(step)).ln() / ratio.ln();
    let order = if alike && seen.is_finite() { seen.clamp(ORDERS[0], ORDERS[1]) } else { USUAL };
    // Steps that fall by no power of the edge, as where walls lie along the voxels, may be small by chance: the error is then at
    // least what is left of the one before at the usual order.
    let by = ratio.powf(USUAL);
    let regular = alike && seen <= TRUSTED;
    (order, if regular { 0.0 } else { size(before) / by / (by - 1.0) })
}

/// Ratio of the edges of the voxels of two grids.
fn ratio(fine: &[usize; 3], coarse: &[usize; 3]) -> f64 {
    let voxels = |s: &[usize; 3]| s.iter().product::<usize>() as f64;
    (voxels(fine) / voxels(coarse)).cbrt()
}

/// The limit of arrays on grids of these shapes, the finest first, with one order for all their entries. Where it would change an entry of
/// the diagonal, which is not negative, by more than half, it is not taken.
pub fn limit(grids: &[([usize; 3], Vec<f64>)]) -> Limit {
    let Some((shape, finest)) = grids.first() else { return none(Vec::new(), 0.0) };
    let Some((coarse, next)) = grids.get(1) else { return none(finest.clone(), f64::INFINITY) };
    let ratio = ratio(shape, coarse);
    let step = difference(finest, next);
    let before = grids.get(2).map(|(_, last)| difference(next, last));
    let (order, doubt) = fall(&step, before.as_deref(), ratio);
    let share = 1.0 / (ratio.powf(order) - 1.0);
    let diagonal: Vec<usize> = (0..finest.len()).step_by(finest.len().isqrt() + 1).collect();
    let largest = diagonal.iter().fold(0.0f64, |m, i| m.max(finest[*i]).max(next[*i]));
    let far = |i: usize| share * step[i].abs() > FARTHEST * finest[i].max(ROUNDING * largest);
    if diagonal.iter().any(|i| far(*i)) {
        // Nothing on the finest grid and something on the next: wrong by all of it.
        let whole = if size(finest) > 0.0 { size(finest) } else { share * size(&step) };
        return Limit { order, finest: true, ..none(finest.clone(), share * size(&step) / whole) };
    }
    let tensor: Vec<f64> = finest.iter().zip(&step).map(|(c, d)| c + share * d).collect();
    let error = (share * size(&step)).max(doubt) / size(&tensor).max(f64::MIN_POSITIVE);
    Limit { order, ..none(tensor, error) }
}

/// Entries that are not extrapolated.
fn none(tensor: Vec<f64>, error: f64) -> Limit {
    Limit { tensor, error, order: USUAL, finest: error.is_infinite(), modes: Vec::new() }
}

/// The limit of symmetric, positive semidefinite tensors, each eigenvalue with an order and an error of its own: soft modes, in which
/// members bend, converge later than stiff ones, and their errors are lost in the size of the whole. An eigenvalue changes by half at most.
///
/// The eigenvectors are those of the finest grid; what the others have between them falls by the usual order.
pub fn modal_limit(grids: &[([usize; 3], Vec<f64>)]) -> Limit {
    let Some((shape, finest)) = grids.first() else { return none(Vec::new(), 0.0) };
    let n = finest.len().isqrt();
    let (values, vectors) = eigen(finest.chunks(n).map(<[f64]>::to_vec).collect());
    let Some((coarse, _)) = grids.get(1) else { return none(finest.clone(), f64::INFINITY) };
    let ratio = ratio(shape, coarse);
    // The tensor of a grid between two of the eigenvectors.
    let between = |(_, t): &([usize; 3], Vec<f64>), i: usize, j: usize| -> f64 {
        (0..n)
            .flat_map(|a| (0..n).map(move |b| (a, b)))
            .map(|(a, b)| vectors[i][a] * t[n * a + b] * vectors[j][b])
            .sum()
    };
    let largest = (0..n).fold(0.0f64, |m, i| m.max(values[i]).max(between(&grids[1], i, i)));
    let mut out = Limit { modes: Vec::with_capacity(n), finest: false, ..none(Vec::new(), 0.0) };
    let (mut squares, mut most) = (0.0, -1.0);
    let mut tensor = vec![0.0; n * n];
    let mut add = |i: usize, j: usize, by: f64| {
        (0..n * n).for_each(|k| tensor[k] += by * vectors[i][k / n] * vectors[j][k % n]);
    };
    for i in 0..n {
        let [at, next] = [values[i], between(&grids[1], i, i)];
        let before = grids.get(2).map(|g| [next - between(g, i, i)]);
        let (order, doubt) = fall(&[at - next], before.as_ref().map(|b| &b[..]), ratio);
        let by = (at - next) / (ratio.powf(order) - 1.0);
        let far = by.abs() > FARTHEST * at.max(ROUNDING * largest);
        let most_by = FARTHEST * at.max(0.0);
        let value = at + if far { by.clamp(-most_by, most_by) } else { by };
        let error = by.abs().max(doubt);
        if error > most {
            (most, out.order) = (error, order);
        }
        out.finest |= far;
        squares += error * error;
        add(i, i, value);
        out.modes.push(Mode { vector: vectors[i].clone(), value, error });
    }
    // What is between modes is kept so small that the tensor stays positive (Gershgorin).
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).filter(|(i, j)| i != j) {
        let by = -between(&grids[1], i, j) / (ratio.powf(USUAL) - 1.0);
        let product = out.modes[i].value.max(0.0) * out.modes[j].value.max(0.0);
        let most = FARTHEST / (n - 1) as f64 * product.sqrt();
        out.finest |= by.abs() > most + ROUNDING * largest;
        squares += by * by;
        add(i, j, by.clamp(-most, most));
    }
    out.tensor = tensor;
    let whole = if size(&out.tensor) > 0.0 { size(&out.tensor) } else { squares.sqrt().max(f64::MIN_POSITIVE) };
    out.error = squares.sqrt() / whole;
    out
}

impl Limit {
    /// The estimated relative error of a · T a for the tensor T, but for what is between modes: 1 where nothing is left of it, 0 where
    /// there is nothing but rounding.
    pub fn error_along(&self, a: &[f64]) -> f64 {
        let sums = self.sums(a, |_| 1.0);
        if sums.iter().all(|s| *s <= ROUNDING * self.largest()) { 0.0 } else { sums[1] / sums[0].max(sums[1]) }
    }

    /// The estimated relative error of 1 / (a · T⁻¹ a), to first order, but for what is between modes.
    pub fn error_of_inverse(&self, a: &[f64]) -> f64 {
        let least = ROUNDING * self.largest();
        // d(1/v) = −dv/v².
        let [value, error] = self.sums(a, |v| if v > least { 1.0 / (v * v) } else { 0.0 });
        if value > 0.0 { error / value } else { 0.0 }
    }

    fn largest(&self) -> f64 {
        self.modes.iter().fold(0.0, |m, mode| m.max(mode.value))
    }

    /// The limits and the errors of modes, summed by their squared parts in a times a factor.
    fn sums(&self, a: &[f64], factor: impl Fn(f64) -> f64) -> [f64; 2] {
        self.modes.iter().fold([0.0; 2], |[value, error], mode| {
            let along: f64 = mode.vector.iter().zip(a).map(|(v, a)| v * a).sum();
            let share = along * along * factor(mode.value);
            [value + share * mode.value.max(0.0), error + share * mode.error]
        })
    }

    /// A warning if the figures at this path, from `n` voxels along an edge, are no limit.
    pub fn doubt(&self, path: &str, n: usize) -> Option<Warning> {
        let counts = |m: &&Mode| m.value.max(m.error) > ROUNDING * self.largest();
        let relative = self.modes.iter().filter(counts).map(|m| m.error / m.value.max(m.error));
        let (by, need) = (100.0 * relative.fold(self.error, f64::max), 2 * n);
        let message = format!(
            "the grids differ too much for an extrapolation, and figures may be off by more than it changes them ({by:.0} %); take n = {need}"
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

    /// Each mode has a power and an error of its own: a stiff one that has converged, and a soft one that has not.
    #[test]
    fn soft_modes_have_limits_and_errors_of_their_own() {
        let turn = 0.6f64;
        let (c, s) = (turn.cos(), turn.sin());
        let tensor = |stiff: f64, soft: f64| {
            vec![
                c * c * stiff + s * s * soft,
                c * s * (stiff - soft),
                c * s * (stiff - soft),
                s * s * stiff + c * c * soft,
            ]
        };
        let grid = |n: usize| {
            let h = 1.0 / n as f64;
            ([n; 3], tensor(1.0 + 0.1 * h.powf(1.5), 1e-3 + 2.0 * h * h))
        };
        let found = modal_limit(&[grid(64), grid(32), grid(16)]);
        for (f, e) in found.tensor.iter().zip(tensor(1.0, 1e-3)) {
            assert!((f - e).abs() < 1e-12, "{:?}", found.tensor);
        }
        let (stiff, soft) = (found.error_along(&[c, s]), found.error_of_inverse(&[-s, c]));
        assert!((stiff / (0.1 / 512.0) - 1.0).abs() < 1e-6, "{stiff}");
        assert!((soft / (2.0 / 4096.0 / 1e-3) - 1.0).abs() < 1e-6 && found.error < 1e-3, "{soft}");
        // Nothing on the finest grid and something on the next is wrong by all of it.
        let gone = |k: f64| vec![1.0, 0.0, 0.0, k];
        let found = modal_limit(&[([32; 3], gone(0.0)), ([16; 3], gone(0.5))]);
        assert!(found.error_along(&[0.0, 1.0]) == 1.0 && found.error_along(&[1.0, 0.0]) == 0.0);
        let noise = modal_limit(&[([32; 3], gone(6e-12)), ([16; 3], gone(2e-12))]);
        assert!(noise.error_along(&[0.0, 1.0]) == 0.0);
        // However far the grids are from each other between modes, the limit is positive definite.
        let found = modal_limit(&[([32; 3], gone(0.02)), ([16; 3], vec![1.1, 0.3, 0.3, 0.12])]);
        assert!(found.tensor[0] * found.tensor[3] > found.tensor[1] * found.tensor[2], "{:?}", found.tensor);
        let found = modal_limit(&[grid(64), grid(32), grid(16)]);
        // Along an axis the soft mode is most of the compliance.
        assert!(found.error_of_inverse(&[1.0, 0.0]) > 0.4);
    }

    /// Where a power of the edge would take a positive figure to nothing or beyond, the finest grid's stands, and the error says how far.
    #[test]
    fn a_positive_figure_stays_positive() {
        let grid = |n: usize, k: [f64; 3]| ([n; 3], vec![k[0], 0.1, 0.0, 0.1, k[1], 0.0, 0.0, 0.0, k[2]]);
        for of in [limit, modal_limit] {
            for (found, size) in [
                (of(&[grid(32, [1.0; 3]), grid(16, [9.0; 3]), grid(8, [18.0; 3])]), 7.9),
                (of(&[grid(32, [1.0, 1.0, 0.1]), grid(16, [1.1, 1.1, 0.9])]), 0.18),
                (of(&[grid(32, [1.0, 1.0, 0.0]), grid(16, [1.0, 1.0, 0.5])]), 0.1),
            ] {
                assert!(found.finest && found.doubt("", 32).is_some());
                assert!([0, 4, 8].iter().all(|i| found.tensor[*i] >= 0.0));
                assert!(found.error > size && found.error.is_finite(), "{}", found.error);
            }
        }
        let nothing = limit(&[([32; 3], vec![0.0]), ([16; 3], vec![3.0])]);
        assert!(nothing.tensor == [0.0] && nothing.error == 1.0);
        // A direction in which nothing goes but rounding is no obstacle to the others.
        let found = limit(&[grid(32, [1.0, 1.0, 1e-17]), grid(16, [1.3, 1.3, -2e-17])]);
        assert!(!found.finest && (found.tensor[0] - 0.9).abs() < 1e-12);
    }
}
