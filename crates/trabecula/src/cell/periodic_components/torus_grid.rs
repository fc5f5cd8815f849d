//! A grid of the torus, divided into tetrahedra along the diagonals (Freudenthal).

use rayon::prelude::*;

use super::critical::Function;
use super::sublattice::Int3;
use geometry::math::{Vec3, norm, sub};

/// The directions of edges from a node: direction k has the bits of k + 1 along x, y, z (Freudenthal).
pub(super) const DIRECTIONS: [Int3; 7] = [[1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]];

/// The neighbours of a node: ahead along each direction, then behind.
pub(in crate::cell) const AROUND: [Int3; 14] = {
    let mut around = [[0; 3]; 14];
    let mut k = 0;
    while k < 7 {
        let [x, y, z] = DIRECTIONS[k];
        around[k] = [x, y, z];
        around[k + 7] = [-x, -y, -z];
        k += 1;
    }
    around
};

/// For each neighbour the ones that it has an edge to, as bits.
const LINK: [u16; 14] = {
    let mut link = [0; 14];
    let mut k = 0;
    while k < 14 * 14 * 14 {
        let (a, b, d) = (AROUND[k % 14], AROUND[k / 14 % 14], AROUND[k / 196]);
        if a[0] + d[0] == b[0] && a[1] + d[1] == b[1] && a[2] + d[2] == b[2] {
            link[k % 14] |= 1 << (k / 14 % 14);
        }
        k += 1;
    }
    link
};

/// Of neighbours (bits), one of each connected component of the graph among them without the node. Joining the node to these
/// joins it to all; a closed path through a triangle has no translation.
pub(super) fn groups(mut present: u16) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        if present == 0 {
            return None;
        }
        let first = present.trailing_zeros() as usize;
        let mut fresh = 1 << first;
        while fresh != 0 {
            present &= !fresh;
            let of = |bits: u16| (0..14).filter(move |k| bits >> k & 1 == 1);
            fresh = of(fresh).fold(0, |near, k| near | LINK[k]) & present;
        }
        Some(first)
    })
}

/// Samples of a function on n³ nodes of the torus.
pub(super) struct TorusGrid {
    /// Nodes along each axis.
    pub n: usize,
    /// Values, x fastest.
    pub values: Vec<f64>,
    /// Lengths of the gradients, per turn.
    pub slopes: Vec<f64>,
    /// How far the linear interpolant may be from the function: 3h²/8 times its largest second derivative.
    pub error: f64,
    /// About the largest second derivative, per turn².
    pub bend: f64,
}

impl TorusGrid {
    /// Samples f as finely as its gradient asks for, within 48³ and 96³ nodes.
    pub(super) fn sample(f: Function) -> TorusGrid {
        let coarse = TorusGrid::of(f, 48);
        // A hundredth of the range keeps apart what an engineer would call apart.
        let wanted = (48.0 * (coarse.error / (0.02 * coarse.range())).sqrt() / 8.0).ceil() * 8.0;
        if wanted > 48.0 { TorusGrid::of(f, wanted.min(96.0) as usize) } else { coarse }
    }

    fn of(f: Function, n: usize) -> TorusGrid {
        let h = 1.0 / n as f64;
        let mut values = vec![0.0; n * n * n];
        let mut slopes = vec![[0.0; 3]; n * n * n];
        values.par_chunks_mut(n * n).zip(slopes.par_chunks_mut(n * n)).enumerate().for_each(|(z, (v, g))| {
            let points: Vec<Vec3> =
                (0..n * n).map(|i| [(i % n) as f64 * h, (i / n) as f64 * h, z as f64 * h]).collect();
            f(&points, v, g);
        });
        let lengths = slopes.iter().map(|g| norm(*g)).collect();
        let mut grid = TorusGrid { n, values, slopes: lengths, error: 0.0, bend: 0.0 };
        let bend = (0..slopes.len() as u32).into_par_iter().map(|i| {
            let step = grid.steps(i);
            let change = |d: Int3| norm(sub(slopes[step(d).0 as usize], slopes[i as usize])) / h;
            change(DIRECTIONS[0]).max(change(DIRECTIONS[1])).max(change(DIRECTIONS[3]))
        });
        grid.bend = bend.reduce(|| 0.0, f64::max);
        grid.error = 0.375 * h * h * grid.bend;
        grid
    }

    /// Greatest less least value.
    pub(super) fn range(&self) -> f64 {
        let ends = self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        ends.1 - ends.0
    }

    /// Phase of a node.
    pub(super) fn position(&self, node: u32) -> Vec3 {
        let (i, n) = (node as usize, self.n);
        [i % n, i / n % n, i / (n * n)].map(|c| c as f64 / n as f64)
    }

    /// The steps from a node: the node one step on, and its period.
    pub(super) fn steps(&self, node: u32) -> impl Fn(Int3) -> (u32, Int3) + use<> {
        let (n, i) = (self.n as i32, node as i32);
        let from = [i % n, i / n % n, i / (n * n)];
        move |d| {
            let at = [from[0] + d[0], from[1] + d[1], from[2] + d[2]];
            let wrap = at.map(|c| i32::from(c >= n) - i32::from(c < 0));
            let on = [0, 1, 2].map(|a| at[a] - n * wrap[a]);
            (((on[2] * n + on[1]) * n + on[0]) as u32, wrap)
        }
    }

    /// The nodes at the corners of the grid cell that holds a phase, with their periods.
    pub(super) fn corners(&self, u: Vec3) -> [(u32, Int3); 8] {
        let n = self.n as i32;
        let low = u.map(|v| (v * self.n as f64).floor() as i32);
        core::array::from_fn(|k| {
            let at = [0, 1, 2].map(|a| low[a] + (k as i32 >> a & 1));
            let on = at.map(|c| c.rem_euclid(n));
            (((on[2] * n + on[1]) * n + on[0]) as u32, at.map(|c| c.div_euclid(n)))
        })
    }

    /// The number of the edge from `node` along direction k, after all nodes.
    pub(super) fn edge(&self, node: u32, k: usize) -> u32 {
        self.values.len() as u32 + node * 7 + k as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_neighbour_of_each_group() {
        for present in 0..1u16 << 14 {
            // Labels spread over edges until nothing changes.
            let mut label: [usize; 14] = core::array::from_fn(|k| k);
            let inside = |k: &usize| present >> k & 1 == 1;
            for _ in 0..14 {
                for a in (0..14).filter(inside) {
                    for b in (0..14).filter(inside) {
                        let apart = [0, 1, 2].map(|c| AROUND[a][c] - AROUND[b][c]);
                        if AROUND.contains(&apart) {
                            label[a] = label[a].min(label[b]);
                        }
                    }
                }
            }
            let first: Vec<usize> = (0..14).filter(inside).filter(|&k| label[k] == k).collect();
            assert_eq!(groups(present).collect::<Vec<_>>(), first);
        }
    }
}
