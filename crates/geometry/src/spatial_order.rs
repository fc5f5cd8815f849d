//! An order of points in which neighbours in space mostly follow each other: what one of them brings into the cache, the next ones
//! find there.

use crate::math::{Aabb, Vec3};

/// Points in a cell of the grid, about.
const POINTS_PER_CELL: usize = 8;
/// Most halvings of the box of the points along each axis.
const MOST_HALVINGS: u32 = 6;

/// The numbers of the points, by cells of a grid along Morton's curve: the same for the same points.
pub fn spatial_order(points: &[Vec3]) -> Vec<u32> {
    let bounds = points.iter().fold(Aabb::EMPTY, |all, p| all.with(*p));
    let halvings = ((points.len() / POINTS_PER_CELL + 1).ilog2() / 3).min(MOST_HALVINGS);
    let cells = 1u32 << halvings;
    let per = bounds.size().map(|s| if s > 0.0 { f64::from(cells) / s } else { 0.0 });
    // Every third bit, for the bits of each axis to be interleaved.
    let spread: Vec<u32> = (0..cells).map(|i| (0..halvings).fold(0, |w, b| w | (i >> b & 1) << (3 * b))).collect();
    let cell = |p: &Vec3| {
        let at = |a: usize| spread[(((p[a] - bounds.min[a]) * per[a]) as u32).min(cells - 1) as usize];
        at(0) | at(1) << 1 | at(2) << 2
    };
    let keys: Vec<u32> = points.iter().map(cell).collect();
    let mut next = vec![0u32; 1 + (1 << (3 * halvings))];
    keys.iter().for_each(|k| next[*k as usize + 1] += 1);
    for i in 1..next.len() {
        next[i] += next[i - 1];
    }
    let mut order = vec![0; points.len()];
    for (i, k) in keys.iter().enumerate() {
        let slot = &mut next[*k as usize];
        order[*slot as usize] = i as u32;
        *slot += 1;
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{norm, sub};
    use crate::random::random;

    #[test]
    fn every_point_is_there_once_and_neighbours_follow_each_other() {
        let mut seed = 5;
        for n in [0, 1, 7, 1000, 40_000] {
            let points: Vec<Vec3> = (0..n).map(|_| [0; 3].map(|_| 50.0 * random(&mut seed) - 20.0)).collect();
            let order = spatial_order(&points);
            let mut all = order.clone();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..n as u32));
            let step = |w: &[u32]| norm(sub(points[w[0] as usize], points[w[1] as usize]));
            let mean = order.windows(2).map(step).sum::<f64>() / n as f64;
            assert!(n < 1000 || mean < 2.0 * 100.0 / (n as f64).cbrt(), "{n}: {mean}");
        }
        let flat = [[f64::NAN; 3], [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]];
        assert_eq!(spatial_order(&flat).len(), 3);
    }
}
