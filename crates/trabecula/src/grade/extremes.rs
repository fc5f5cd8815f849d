//! Where in a region a number is least and greatest.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::Grade;
use crate::environment::Environment;
use crate::region::Region;
use geometry::math::{Aabb, Vec3, scale, sub};

/// Boxes that are halved in the search for one end, at most.
const MOST: usize = 1000;
/// The share of the greatest number by which an end may be missed.
const CLOSE: f64 = 1e-9;

/// A box in which the number may be as great as `bound`, made by `halvings`.
struct SearchBox {
    bound: f64,
    halvings: usize,
    within: Aabb,
}

impl Ord for SearchBox {
    fn cmp(&self, other: &Self) -> Ordering {
        // Of those that promise as much the smallest: many do along a face on which the number is the same.
        self.bound.total_cmp(&other.bound).then(self.halvings.cmp(&other.halvings))
    }
}

impl PartialOrd for SearchBox {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for SearchBox {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for SearchBox {}

impl Grade {
    /// Those positions at which the number is least and greatest that a search finds, and points inside the region of an environment.
    pub(crate) fn check_points(&self, environment: &Environment) -> Vec<Vec3> {
        [&self.extremes(environment.region)[..], environment.points].concat()
    }

    /// Positions in a bounded region at which the number is least and greatest, or not a number, found by branch and bound: of the boxes that
    /// may hold an end the most promising is halved. None of a number that does not vary.
    pub(crate) fn extremes(&self, region: &Region) -> Vec<Vec3> {
        match self {
            Grade::Constant(_) => Vec::new(),
            Grade::Varying(_) => [-1.0, 1.0].into_iter().filter_map(|sign| self.extreme(region, sign)).collect(),
        }
    }

    /// The position at which the number times `sign` is greatest, if one was found in the region.
    fn extreme(&self, region: &Region, sign: f64) -> Option<Vec3> {
        let all = region.bounds();
        let reach = 1e-9 * all.size().into_iter().fold(0.0, f64::max);
        let whole = self.bound(&all);
        let size = whole.lo.abs().max(whole.hi.abs());
        let close = if size.is_finite() { CLOSE * size } else { 0.0 };
        let mut heap = BinaryHeap::new();
        let mut best: Option<(f64, Vec3)> = None;
        let mut halves = vec![all];
        for halvings in 0..MOST {
            for within in halves.drain(..) {
                let at = onto(region, self.likely_extreme(&within));
                if region.value(at) <= reach {
                    let mut v = [0.0];
                    self.values(&[at], &mut v);
                    // What is not a number is the worst of all.
                    let v = if v[0].is_nan() { f64::INFINITY } else { sign * v[0] };
                    if best.is_none_or(|(most, _)| v > most) {
                        best = Some((v, at));
                    }
                }
                if region.bound(&within).lo <= reach {
                    let range = self.bound(&within);
                    let bound = if sign > 0.0 { range.hi } else { -range.lo };
                    heap.push(SearchBox { bound, halvings, within });
                }
            }
            let Some(SearchBox { bound, within, .. }) = heap.pop() else { break };
            if best.is_some_and(|(most, _)| bound <= most + close.max(CLOSE * most.abs())) {
                break;
            }
            halves.extend(within.halves());
        }
        best.map(|(_, at)| at)
    }
}

/// The position, or of one outside the region that on its surface which the gradient leads to.
fn onto(region: &Region, p: Vec3) -> Vec3 {
    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
    region.gradients(&[p], &mut v, &mut g);
    if v[0] > 0.0 { sub(p, scale(g[0], v[0])) } else { p }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::grade::{Formula, Remapped, Samples, Stops};
    use crate::region::{Cuboid, Sphere};
    use geometry::random::random;

    fn range(grade: &Grade, region: &Region) -> [f64; 2] {
        let ends = grade.extremes(region);
        assert!(ends.len() == 2 && ends.iter().all(|p| region.value(*p) <= 1e-8), "{ends:?}");
        let mut v = [0.0; 2];
        grade.values(&ends, &mut v);
        v
    }

    /// A grid of 0.3 on [-10, 10]³ with other numbers at some nodes.
    fn grid(n: usize, nodes: &[([usize; 3], f64)]) -> Samples {
        let mut values = vec![0.3; n * n * n];
        nodes.iter().for_each(|([i, j, k], v)| values[(k * n + j) * n + i] = *v);
        Samples::new([-10.0; 3], [20.0 / (n - 1) as f64; 3], [n; 3], values).unwrap()
    }

    /// One node of 68921 and one of 8 millions are met, in the region and on its surface; those beyond it do not count.
    #[test]
    fn single_nodes_of_a_grid_are_found() {
        let cube: Region = Arc::new(Cuboid::new([-10.0; 3], [10.0; 3]).unwrap());
        let ball: Region = Arc::new(Sphere::new([0.0; 3], 10.0).unwrap());
        for n in [41, 201] {
            let [a, b] = [[n / 6, 3 * n / 4, n / 3], [n / 2, n / 2, 2]];
            let spikes = Grade::from(grid(n, &[(a, 1.3), (b, -0.5), ([0; 3], 7.0), ([n - 1; 3], -7.0)]));
            for (region, ends) in [(&ball, [-0.5, 1.3]), (&cube, [-7.0, 7.0])] {
                let found = range(&spikes, region);
                assert!((0..2).all(|i| (found[i] - ends[i]).abs() < 1e-12), "{n}: {found:?} for {ends:?}");
            }
            // A peak between the stops of a remap, on the flank of a spike.
            let hidden = Stops(vec![[0.3, 0.3], [0.55, 0.6], [0.56, 0.2], [1.3, 0.2]]);
            let [least, most] = range(&Remapped::new(grid(n, &[(a, 1.3)]), hidden).into(), &ball);
            assert!((least - 0.2).abs() < 1e-9 && (most - 0.6).abs() < 1e-6, "{least} {most}");
        }
    }

    /// Of random numbers on a grid the ends in a ball are those that a fine sample finds, or beyond, and within the numbers near it.
    #[test]
    fn no_sample_is_beyond_the_ends_of_random_grids() {
        let mut seed = 5;
        for n in [2, 3, 7, 12] {
            let step = [0, 1, 2].map(|_| (3.0 + random(&mut seed)) / (n - 1) as f64);
            let values: Vec<f64> = (0..n * n * n).map(|_| random(&mut seed)).collect();
            let grade = Grade::from(Samples::new([-1.9; 3], step, [n; 3], values.clone()).unwrap());
            let ball: Region = Arc::new(Sphere::new([0.1, 0.0, -0.1], 1.2).unwrap());
            let [least, most] = range(&grade, &ball);
            for _ in 0..20_000 {
                let p = [0.1, 0.0, -0.1].map(|c| c + 1.2 * random(&mut seed));
                let mut v = [0.0];
                grade.values(&[p], &mut v);
                assert!(ball.value(p) > 0.0 || (least - 1e-7..=most + 1e-7).contains(&v[0]), "{n} {p:?} {v:?}");
            }
        }
    }

    /// Narrow peaks of formulas, ends on curved surfaces, and places where a formula is not a number.
    #[test]
    fn narrow_peaks_of_formulas_are_found() {
        let ball: Region = Arc::new(Sphere::new([0.0; 3], 10.0).unwrap());
        let of = |text: &str| range(&Formula::parse(text).unwrap().into(), &ball);
        let [least, most] = of("0.3 + 0.9*exp(-((x-3.33)^2+(y+2.2)^2+(z-1.7)^2)/0.01)");
        assert!((least - 0.3).abs() < 1e-9 && (most - 1.2).abs() < 1e-6, "{least} {most}");
        let [least, most] = of("x + 2*y - z");
        let end = 10.0 * 6f64.sqrt();
        assert!((least + end).abs() < 1e-3 && (most - end).abs() < 1e-3, "{least} {most}");
        assert!(of("sqrt(abs(x-3.33)+abs(y+2.2)+abs(z-1.7)-0.001)").iter().any(|v| v.is_nan()));
    }
}
