//! Of many fields that are joined, the few that decide at some points.

use geometry::math::{Aabb, Interval, Vec3};

/// Lists up to this length are evaluated as they are.
pub(super) const MANY: usize = 8;
/// Points or fields that are too few to be divided further.
const FEW: usize = 4;

/// Calls `each` with parts of the points, by index, and those of `count` fields, in order, of which one decides at each of them.
/// `narrow` gives those of a list of which one decides anywhere in a box.
pub(super) fn divided(
    points: &[Vec3],
    count: usize,
    narrow: &dyn Fn(&[usize], &Aabb) -> Vec<usize>,
    each: &mut dyn FnMut(&[usize], &[usize]),
) {
    let mut order: Vec<usize> = (0..points.len()).collect();
    divide(points, &mut order, &Vec::from_iter(0..count), narrow, each);
}

fn divide(
    points: &[Vec3],
    order: &mut [usize],
    of: &[usize],
    narrow: &dyn Fn(&[usize], &Aabb) -> Vec<usize>,
    each: &mut dyn FnMut(&[usize], &[usize]),
) {
    let bounds = order.iter().fold(Aabb::EMPTY, |b, i| b.with(points[*i]));
    if !bounds.is_finite() {
        return each(order, of);
    }
    let kept = narrow(of, &bounds);
    if kept.len() <= FEW || order.len() <= FEW {
        return each(order, &kept);
    }
    let size = bounds.size();
    let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |i, j| points[*i][longest].total_cmp(&points[*j][longest]));
    let (low, high) = order.split_at_mut(middle);
    divide(points, low, &kept, narrow, each);
    divide(points, high, &kept, narrow, each);
}

/// Those of a list of which one has the least value anywhere in a box; `bound` contains the values of each there.
pub(super) fn least(of: &[usize], bound: impl Fn(usize) -> Interval) -> Vec<usize> {
    let ranges: Vec<Interval> = of.iter().map(|i| bound(*i)).collect();
    let most = ranges.iter().fold(f64::INFINITY, |m, r| m.min(r.hi));
    of.iter().zip(&ranges).filter(|(_, r)| r.lo <= most).map(|(i, _)| *i).collect()
}
