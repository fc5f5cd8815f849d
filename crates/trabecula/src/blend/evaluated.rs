//! A summand evaluated at points.

use super::ends::EndQuantiles;
use super::sum::Blend;
use geometry::math::Vec3;

/// The values gᵢ and the upper ends of a summand at points with their gradients (per mm), and the quantiles of both ends where
/// levels vary.
pub(super) struct Evaluated {
    pub values: Vec<f64>,
    pub gradients: Vec<Vec3>,
    pub high: Vec<f64>,
    pub high_gradients: Vec<Vec3>,
    pub quantiles: Vec<EndQuantiles>,
}

/// Buffers of values and gradients.
pub(super) fn zeros(n: usize) -> (Vec<f64>, Vec<Vec3>) {
    (vec![0.0; n], vec![[0.0; 3]; n])
}

impl Evaluated {
    /// The i-th summand at the points where it has a weight, zeros elsewhere.
    pub fn where_weighted(blend: &Blend, i: usize, points: &[Vec3], weighted: impl Fn(usize) -> bool) -> Evaluated {
        let n = points.len();
        if (0..n).all(&weighted) {
            return Evaluated::at(blend, i, points);
        }
        let here: Vec<usize> = (0..n).filter(|k| weighted(*k)).collect();
        let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
        Evaluated::at(blend, i, &at).scatter(&here, n)
    }

    fn at(blend: &Blend, i: usize, points: &[Vec3]) -> Evaluated {
        let (mut values, mut gradients) = zeros(points.len());
        let (mut high, mut high_gradients) = zeros(points.len());
        let mut quantiles = Vec::new();
        let summand = &blend.summands[i];
        summand.gradients(points, &mut values, &mut gradients);
        if let Some(levels) = blend.varied() {
            quantiles.resize(points.len(), EndQuantiles::default());
            if !summand.end_gradients(points, &mut high, &mut high_gradients, &mut quantiles) {
                for (q, p) in quantiles.iter_mut().zip(points) {
                    *q = levels.measured_quantiles(&blend.summands, *p, i);
                }
            }
        } else {
            summand.upper_end_gradients(points, &mut high, &mut high_gradients);
        }
        Evaluated { values, gradients, high, high_gradients, quantiles }
    }

    /// The same as entries `here` of `n`.
    fn scatter(self, here: &[usize], n: usize) -> Evaluated {
        fn scattered<T: Copy + Default>(of: &[T], here: &[usize], n: usize) -> Vec<T> {
            let mut all = vec![T::default(); n];
            here.iter().zip(of).for_each(|(k, v)| all[*k] = *v);
            all
        }
        Evaluated {
            values: scattered(&self.values, here, n),
            gradients: scattered(&self.gradients, here, n),
            high: scattered(&self.high, here, n),
            high_gradients: scattered(&self.high_gradients, here, n),
            quantiles: scattered(&self.quantiles, here, n),
        }
    }
}
