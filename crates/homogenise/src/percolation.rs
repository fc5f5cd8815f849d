//! In how many directions the solid of a periodic cell goes on without end.

use crate::cell::VoxelCell;

impl VoxelCell {
    /// The number of independent directions, 0 to 3, in which some connected component of the voxels (by faces) with a fraction above
    /// `least` is connected with its own translates.
    pub fn endless_directions(&self, least: f64) -> usize {
        let [nx, ny, _] = self.shape;
        let mut offset: Vec<Option<[i32; 3]>> = vec![None; self.fractions.len()];
        let (mut rank, mut stack) = (0, Vec::new());
        for start in 0..offset.len() {
            if offset[start].is_some() || self.fractions[start] <= least {
                continue;
            }
            offset[start] = Some([0; 3]);
            stack.push(start);
            let mut windings = Vec::new();
            while let Some(at) = stack.pop() {
                let here = offset[at].unwrap_or_default();
                let place = [at % nx, at / nx % ny, at / nx / ny];
                for (axis, up) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
                    let (mut next, mut cell, n) = (place, here, self.shape[axis]);
                    next[axis] = if up { (place[axis] + 1) % n } else { (place[axis] + n - 1) % n };
                    cell[axis] += match up {
                        true if place[axis] + 1 == n => 1,
                        false if place[axis] == 0 => -1,
                        _ => 0,
                    };
                    let to = (next[2] * ny + next[1]) * nx + next[0];
                    if self.fractions[to] <= least {
                        continue;
                    }
                    match offset[to] {
                        None => {
                            offset[to] = Some(cell);
                            stack.push(to);
                        }
                        Some(known) if known != cell => windings.push([0, 1, 2].map(|a| cell[a] - known[a])),
                        Some(_) => {}
                    }
                }
                if windings.len() > 64 {
                    windings = independent(&windings);
                }
            }
            rank = rank.max(independent(&windings).len());
        }
        rank
    }
}

/// Of a list of vectors, those that are independent of the ones before.
fn independent(of: &[[i32; 3]]) -> Vec<[i32; 3]> {
    let mut kept: Vec<[i32; 3]> = Vec::new();
    for v in of {
        let cross = |a: &[i32; 3], b: &[i32; 3]| {
            [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
        };
        let new = match &kept[..] {
            [] => *v != [0; 3],
            [a] => cross(a, v) != [0; 3],
            [a, b] => (0..3).map(|i| cross(a, b)[i] * v[i]).sum::<i32>() != 0,
            _ => false,
        };
        if new {
            kept.push(*v);
        }
    }
    kept
}
