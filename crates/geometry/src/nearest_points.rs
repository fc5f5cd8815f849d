//! The nearest of scattered points.

use crate::bvh::{Bvh, Split, WideBvh};
use crate::math::{Aabb, Vec3, dot, sub};

/// Points, in a tree.
#[derive(Debug)]
pub struct NearestPoints {
    tree: WideBvh,
    /// The points and their numbers in the tree's order.
    points: Vec<(Vec3, u32)>,
}

impl NearestPoints {
    /// A tree of points.
    pub fn new(points: &[Vec3]) -> NearestPoints {
        let boxes: Vec<Aabb> = points.iter().map(|p| Aabb { min: *p, max: *p }).collect();
        let tree = Bvh::new(&boxes, (0..points.len() as u32).collect(), Split::Median);
        let points: Vec<(Vec3, u32)> = tree.order().iter().map(|n| (points[*n as usize], *n)).collect();
        let boxes: Vec<Aabb> = points.iter().map(|(p, _)| Aabb { min: *p, max: *p }).collect();
        NearestPoints { tree: WideBvh::new(&tree, &boxes), points }
    }

    /// The `count` points nearest to `p` (all if there are fewer) as squared distances (mm²) and their numbers, ascending; the lower number first
    /// where distances are equal.
    pub fn nearest(&self, p: Vec3, count: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        self.tree.nearest(p, f64::INFINITY, |i| {
            let (q, n) = self.points[i];
            let new = (dot(sub(q, p), sub(q, p)), n);
            let at = found.partition_point(|old| *old < new);
            if at < count {
                found.insert(at, new);
                found.truncate(count);
            }
            if found.len() < count { f64::INFINITY } else { found.last().map_or(f64::INFINITY, |last| last.0) }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    /// Uniform points, most of them in one place, and some that coincide.
    #[test]
    fn they_are_those_of_a_sort() {
        let mut seed = 3;
        let mut point = |reach: f64| [0; 3].map(|_| reach * random(&mut seed));
        let mut points: Vec<Vec3> = (0..300).map(|_| point(1.0)).collect();
        points.extend((0..900).map(|_| point(1e-3)));
        points.extend_from_within(100..150);
        let tree = NearestPoints::new(&points);
        let mut found = Vec::new();
        for count in [1, 2, 8, 5000] {
            for _ in 0..50 {
                let p = point(1.2);
                let mut want: Vec<(f64, u32)> =
                    points.iter().zip(0..).map(|(q, n)| (dot(sub(*q, p), sub(*q, p)), n)).collect();
                want.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
                want.truncate(count);
                tree.nearest(p, count, &mut found);
                assert_eq!(found, want);
            }
        }
        let none = NearestPoints::new(&[]);
        none.nearest([0.0; 3], 3, &mut found);
        assert!(found.is_empty());
    }
}
