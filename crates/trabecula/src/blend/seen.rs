//! What a lattice of a blend is at points.

use super::Blend;
use super::added::End;
use geometry::math::Vec3;

/// What a lattice of a blend is at points: its core and its upper end with their slopes (per mm), and the quantiles of both
/// ends where levels vary.
pub(super) struct Seen {
    pub core: Vec<f64>,
    pub core_slope: Vec<Vec3>,
    pub high: Vec<f64>,
    pub high_slope: Vec<Vec3>,
    pub quantiles: Vec<End>,
}

/// Buffers of values and slopes.
pub(super) fn zeros(n: usize) -> (Vec<f64>, Vec<Vec3>) {
    (vec![0.0; n], vec![[0.0; 3]; n])
}

impl Seen {
    /// The i-th lattice where it counts; elsewhere nothing.
    pub fn where_counted(blend: &Blend, i: usize, points: &[Vec3], counts: impl Fn(usize) -> bool) -> Seen {
        let n = points.len();
        if (0..n).all(&counts) {
            return Seen::at(blend, i, points);
        }
        let here: Vec<usize> = (0..n).filter(|k| counts(*k)).collect();
        let at: Vec<Vec3> = here.iter().map(|k| points[*k]).collect();
        Seen::at(blend, i, &at).spread(&here, n)
    }

    fn at(blend: &Blend, i: usize, points: &[Vec3]) -> Seen {
        let (mut core, mut core_slope) = zeros(points.len());
        let (mut high, mut high_slope) = zeros(points.len());
        let mut quantiles = Vec::new();
        let strand = &blend.strands[i];
        strand.gradients(points, &mut core, &mut core_slope);
        if let Some(levels) = blend.varied() {
            quantiles.resize(points.len(), End::default());
            if !strand.end_gradients(points, &mut high, &mut high_slope, &mut quantiles) {
                for (q, p) in quantiles.iter_mut().zip(points) {
                    *q = levels.found(&blend.strands, *p, i);
                }
            }
        } else {
            strand.high_gradients(points, &mut high, &mut high_slope);
        }
        Seen { core, core_slope, high, high_slope, quantiles }
    }

    /// The same for `n` points, at index `here`.
    fn spread(self, here: &[usize], n: usize) -> Seen {
        fn among<T: Copy + Default>(of: &[T], here: &[usize], n: usize) -> Vec<T> {
            let mut all = vec![T::default(); n];
            here.iter().zip(of).for_each(|(k, v)| all[*k] = *v);
            all
        }
        Seen {
            core: among(&self.core, here, n),
            core_slope: among(&self.core_slope, here, n),
            high: among(&self.high, here, n),
            high_slope: among(&self.high_slope, here, n),
            quantiles: among(&self.quantiles, here, n),
        }
    }
}
