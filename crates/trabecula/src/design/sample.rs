//! Points inside a region, by a deterministic low-discrepancy sequence (Halton).

use crate::region::Region;
use geometry::math::{Aabb, Vec3};

/// Number of sample points of a design.
pub(super) const COUNT: usize = 8_000;

/// About `count` points inside the region, spread evenly: Halton's sequence in bases 2, 3 and 5 over the bounds, which
/// is in phase with no lattice, unlike a grid. Fewer come where the region is a tiny share of its bounds. Also the
/// share of the bounds that is inside.
pub(super) fn inside(region: &Region, count: usize) -> (Vec<Vec3>, f64) {
    let bounds = region.bounds();
    let trial = (count / 8).clamp(2_000, 50_000);
    let hits = filter(region, &bounds, 0, trial).len();
    if hits == 0 {
        let points = filter(region, &bounds, 0, 64 * trial);
        let share = points.len() as f64 / (64 * trial) as f64;
        return (points, share);
    }
    let tries = (count as f64 * trial as f64 / hits as f64).ceil() as usize;
    let tries = tries.min(count * 64);
    let points = filter(region, &bounds, 0, tries);
    let share = points.len() as f64 / tries as f64;
    (points, share)
}

/// Nodes of a coarse grid over the bounds, ends included, that lie in the region or on its surface: where a number
/// that varies takes its extremes in a box, and near them elsewhere.
pub(super) fn nodes(region: &Region) -> Vec<Vec3> {
    const N: usize = 12;
    let (b, size) = (region.bounds(), region.bounds().size());
    let at = |i: usize, a: usize| {
        if i == N { b.max[a] } else { b.min[a] + size[a] * i as f64 / N as f64 }
    };
    let count = (N + 1).pow(3);
    let grid = (0..count).map(|i| [at(i % (N + 1), 0), at(i / (N + 1) % (N + 1), 1), at(i / (N + 1).pow(2), 2)]);
    let reach = 1e-9 * size.into_iter().fold(0.0, f64::max);
    grid.filter(|p| region.value(*p) <= reach).collect()
}

fn filter(region: &Region, bounds: &Aabb, from: usize, tries: usize) -> Vec<Vec3> {
    const BATCH: usize = 4096;
    let mut kept = Vec::new();
    let mut points = Vec::with_capacity(BATCH);
    let mut values = vec![0.0; BATCH];
    let mut i = from;
    while i < from + tries {
        let n = BATCH.min(from + tries - i);
        points.clear();
        points.extend((i..i + n).map(|i| halton(bounds, i)));
        region.values(&points, &mut values[..n]);
        kept.extend(points.iter().zip(&values).filter(|(_, v)| **v < 0.0).map(|(p, _)| *p));
        i += n;
    }
    kept
}

/// Point `i` of Halton's sequence in the box.
fn halton(b: &Aabb, i: usize) -> Vec3 {
    let size = b.size();
    core::array::from_fn(|a| b.min[a] + size[a] * mirrored(i + 1, [2, 3, 5][a]))
}

/// The digits of `i` in `base`, mirrored at the point: van der Corput's sequence, in (0, 1).
fn mirrored(mut i: usize, base: usize) -> f64 {
    let (mut v, mut digit) = (0.0, 1.0);
    while i > 0 {
        digit /= base as f64;
        v += digit * (i % base) as f64;
        i /= base;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_fills_a_box_evenly() {
        let b = Aabb { min: [-1.0, 0.0, 2.0], max: [1.0, 3.0, 6.0] };
        let mut counts = [0usize; 64];
        for i in 0..64_000 {
            let p = halton(&b, i);
            let k: [usize; 3] = core::array::from_fn(|a| ((p[a] - b.min[a]) / b.size()[a] * 4.0) as usize);
            counts[k[0] + 4 * k[1] + 16 * k[2]] += 1;
        }
        for c in counts {
            assert!(c.abs_diff(1000) < 20, "{c}");
        }
    }
}
