//! Points near each other, by a hash of the cubes that they lie in.

use rustc_hash::FxHashMap;

use crate::math::Vec3;

/// Points by cubes of four times the distance at which two are one: nearly always a search is in one cube.
pub struct PointHash {
    within: f64,
    edge: f64,
    cubes: FxHashMap<[u64; 3], Vec<u32>>,
}

impl PointHash {
    /// No point yet, for searches within a distance (mm) of zero or more.
    pub fn new(within: f64) -> PointHash {
        PointHash { within, edge: (4.0 * within).max(f64::MIN_POSITIVE), cubes: FxHashMap::default() }
    }

    /// Adds a point.
    pub fn insert(&mut self, p: Vec3, index: u32) {
        let cube = p.map(|x| self.cube(x).to_bits());
        self.cubes.entry(cube).or_default().push(index);
    }

    /// Calls `found` with the points added of every cube within the distance of `p`: all that near, and some farther off.
    pub fn near(&self, p: Vec3, mut found: impl FnMut(u32)) {
        let ends = p.map(|x| [self.cube(x - self.within), self.cube(x + self.within)]);
        let count = ends.map(|[low, high]| if low == high { 1 } else { 2 });
        for i in 0..count[0] {
            for j in 0..count[1] {
                for k in 0..count[2] {
                    let cube = [ends[0][i], ends[1][j], ends[2][k]].map(f64::to_bits);
                    self.cubes.get(&cube).into_iter().flatten().for_each(|index| found(*index));
                }
            }
        }
    }

    /// The number of a cube along an axis; −0 becomes 0.
    fn cube(&self, x: f64) -> f64 {
        (x / self.edge).floor() + 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, sub};
    use crate::random::random;

    #[test]
    fn all_points_within_the_distance_are_found() {
        let mut seed = 2;
        let points: Vec<Vec3> = (0..2000).map(|_| [0; 3].map(|_| random(&mut seed))).collect();
        let mut hash = PointHash::new(0.1);
        (0..).zip(&points).for_each(|(i, p)| hash.insert(*p, i));
        let mut total = 0;
        for p in &points {
            let near = |i: &u32| norm(sub(points[*i as usize], *p)) <= 0.1;
            let mut found = Vec::new();
            hash.near(*p, |i| found.push(i));
            found.retain(near);
            found.sort_unstable();
            assert!(found.iter().copied().eq((0..2000).filter(near)));
            total += found.len();
        }
        assert!(total > 3000);
    }
}
