//! Richardson's extrapolation of a tensor from up to three grids.

/// A limit.
pub struct Limit {
    /// The extrapolated entries.
    pub tensor: Vec<f64>,
    /// Its distance from the finest grid's over its size.
    pub error: f64,
    /// The exponent of the voxel's edge.
    pub order: f64,
}

/// Order that is taken where it cannot be observed.
const USUAL: f64 = 2.0;
/// Observed orders beyond these are not trusted.
const ORDERS: [f64; 2] = [1.0, 3.0];

/// The limit of tensors on grids of these shapes, the finest first: with the order that the differences show, if there are three whose
/// differences point the same way, else with the usual one.
pub fn limit(grids: &[([usize; 3], Vec<f64>)]) -> Limit {
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let voxels = |s: &[usize; 3]| s.iter().product::<usize>() as f64;
    let [(shape, finest), rest @ ..] = grids else {
        return Limit { tensor: Vec::new(), error: 0.0, order: USUAL };
    };
    let Some((coarse, next)) = rest.first() else {
        return Limit { tensor: finest.clone(), error: f64::INFINITY, order: USUAL };
    };
    let ratio = (voxels(shape) / voxels(coarse)).cbrt();
    let step: Vec<f64> = finest.iter().zip(next).map(|(a, b)| a - b).collect();
    let order = match rest.get(1) {
        None => USUAL,
        Some((_, last)) => {
            let before: Vec<f64> = next.iter().zip(last).map(|(a, b)| a - b).collect();
            let along: f64 = step.iter().zip(&before).map(|(a, b)| a * b).sum();
            let alike = along > 0.5 * size(&step) * size(&before);
            let seen = (size(&before) / size(&step)).ln() / ratio.ln();
            if alike && seen.is_finite() { seen.clamp(ORDERS[0], ORDERS[1]) } else { USUAL }
        }
    };
    let share = 1.0 / (ratio.powf(order) - 1.0);
    let tensor: Vec<f64> = finest.iter().zip(&step).map(|(c, d)| c + share * d).collect();
    let error = share * size(&step) / size(&tensor).max(f64::MIN_POSITIVE);
    Limit { tensor, error, order }
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
}
