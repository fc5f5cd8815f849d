//! Points inside a region, by a deterministic low-discrepancy sequence.

use rayon::prelude::*;

use crate::region::Region;
use geometry::math::{Aabb, Vec3};
use geometry::random::low_discrepancy;

/// Number of sample points of a design.
pub(super) const COUNT: usize = 8_000;

/// About `count` points inside the region, spread evenly over the bounds by a sequence that is in phase with no lattice, unlike a grid, and
/// unlike one that divides by small numbers: of 16 000 points of Halton's a beam lattice got a tenth too many. Fewer come where the region is a tiny share of its bounds. Also the
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

/// The values at points of a field, in parallel.
pub(super) fn values(points: &[Vec3], fill: impl Fn(&[Vec3], &mut [f64]) + Sync) -> Vec<f64> {
    const BATCH: usize = 256;
    let mut values = vec![0.0; points.len()];
    // The first one alone: tables that are made at first use are made in parallel, and must not come to wait for themselves.
    if let [first, ..] = points {
        fill(&[*first], &mut values[..1]);
    }
    let batches = points.par_chunks(BATCH).zip(values.par_chunks_mut(BATCH));
    batches.for_each(|(points, values)| fill(points, values));
    values
}

/// Those of the points `from` to `from + tries` of the sequence that are inside.
fn filter(region: &Region, bounds: &Aabb, from: usize, tries: usize) -> Vec<Vec3> {
    const BATCH: usize = 1 << 16;
    let mut kept = Vec::new();
    for first in (from..from + tries).step_by(BATCH) {
        let points: Vec<Vec3> =
            (first..(first + BATCH).min(from + tries)).map(|i| bounds.at(low_discrepancy(i))).collect();
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        // What regions compute at first use is computed before they are asked in parallel, as in `values`.
        region.value(points[0]);
        let mut inside = those_inside(region, &points, &mut order);
        inside.sort_unstable();
        kept.extend(inside.into_iter().map(|i| points[i as usize]));
    }
    kept
}

/// Those of the points `of` that are inside. Most are known by the bound over a box: distances are evaluated near the surface
/// alone, and for points that follow each other closely.
fn those_inside(region: &Region, points: &[Vec3], of: &mut [u32]) -> Vec<u32> {
    const FEW: usize = 8;
    /// More are divided among threads.
    const PARALLEL: usize = 512;
    let at = |i: &u32| points[*i as usize];
    if of.len() <= FEW {
        let mut values = [0.0; FEW];
        let here: Vec<Vec3> = of.iter().map(at).collect();
        region.values(&here, &mut values[..of.len()]);
        return of.iter().zip(values).filter(|(_, v)| *v < 0.0).map(|(i, _)| *i).collect();
    }
    let bounds = of.iter().fold(Aabb::EMPTY, |b, i| b.with(at(i)));
    let range = region.bound(&bounds);
    if range.hi < 0.0 || range.lo >= 0.0 {
        return if range.hi < 0.0 { of.to_vec() } else { Vec::new() };
    }
    let size = bounds.size();
    let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
    let middle = of.len() / 2;
    of.select_nth_unstable_by(middle, |a, b| at(a)[longest].total_cmp(&at(b)[longest]));
    let parallel = of.len() > PARALLEL;
    let (low, high) = of.split_at_mut(middle);
    let (mut low, mut high) = (|| those_inside(region, points, low), || those_inside(region, points, high));
    let (mut found, more) = if parallel { rayon::join(low, high) } else { (low(), high()) };
    found.extend(more);
    found
}
