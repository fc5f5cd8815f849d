//! The nearest points of the mid-surface f = 0, in space, to the nodes of a grid on the torus.
//!
//! Nodes adjacent to the surface start from its crossings with the grid's edges. Nearest points are propagated to neighbours,
//! while that shortens the distance (vector distance transform: Danielsson, Euclidean distance mapping, Computer Graphics and
//! Image Processing 14, 1980). Then each is refined to a foot point, at which the vector to the node is normal to the
//! surface, by Newton's method. Foot points are stored as vectors (mm) from the node, so period boundaries need no special case.

use rayon::prelude::*;

use super::foot_point::LevelSurface;
use super::series::Series;
use geometry::math::{Mat3, Vec3, add, apply, dot, inverse, norm, scale, transpose};

/// The nearest points of the surface to the nodes of a grid.
pub(super) struct NearestSearch<'a> {
    series: &'a Series,
    surface: LevelSurface<'a>,
    shape: [usize; 3],
    /// From a node to its 26 neighbours: steps in the grid and in space.
    around: Vec<([i32; 3], Vec3)>,
    /// One step along each axis of the grid, mm.
    spacing: Mat3,
    /// Longest diagonal of a grid cell, mm.
    diagonal: f64,
}

/// Nothing found yet.
const NONE: Vec3 = [f64::INFINITY; 3];

impl<'a> NearestSearch<'a> {
    pub(super) fn new(series: &'a Series, to_phase: &Mat3, shape: [usize; 3]) -> NearestSearch<'a> {
        let to_space = inverse(to_phase);
        let around: Vec<([i32; 3], Vec3)> = (0..27)
            .map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1])
            .filter(|d| *d != [0; 3])
            .map(|d| {
                let turns = core::array::from_fn(|a| f64::from(d[a]) / shape[a] as f64);
                (d, apply(&to_space, turns))
            })
            .collect();
        let diagonal = around.iter().map(|a| norm(a.1)).fold(0.0, f64::max);
        let columns = transpose(&to_space);
        let spacing = core::array::from_fn(|a| scale(columns[a], 1.0 / shape[a] as f64));
        let surface = LevelSurface::new(series, 0.0, to_phase, 3.0 * diagonal);
        NearestSearch { series, surface, shape, around, spacing, diagonal }
    }

    /// One step along each axis of the grid, mm.
    pub(super) fn spacing(&self) -> &Mat3 {
        &self.spacing
    }

    /// Longest diagonal of a grid cell, mm.
    pub(super) fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// From a node to its 26 neighbours: steps in the grid and in space (mm).
    pub(super) fn around(&self) -> &[([i32; 3], Vec3)] {
        &self.around
    }

    /// The node some steps from one at an index.
    pub(super) fn moved(&self, at: [usize; 3], d: [i32; 3]) -> usize {
        let [i, j, k]: [usize; 3] =
            core::array::from_fn(|a| (at[a] as i32 + d[a]).rem_euclid(self.shape[a] as i32) as usize);
        (k * self.shape[1] + j) * self.shape[0] + i
    }

    /// The node a step from another, and its period relative to that.
    pub(super) fn stepped(&self, node: u32, d: [i32; 3]) -> (u32, [i32; 3]) {
        let at = self.index(node as usize);
        let wrap = core::array::from_fn(|a| (at[a] as i32 + d[a]).div_euclid(self.shape[a] as i32));
        (self.moved(at, d) as u32, wrap)
    }

    /// The node nearest to a phase along each axis, and the vector (mm) from it to the phase.
    pub(super) fn nearest_node(&self, u: Vec3) -> (u32, Vec3) {
        let along: Vec3 = core::array::from_fn(|a| u[a] * self.shape[a] as f64);
        let from = (0..3).fold([0.0; 3], |s, a| add(s, scale(self.spacing[a], along[a] - along[a].round())));
        (self.moved([0; 3], along.map(|c| c.round() as i32)) as u32, from)
    }

    fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// The index of a node along the axes.
    pub(super) fn index(&self, node: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        [node % nx, node / nx % ny, node / nx / ny]
    }

    /// The steps along an axis from one index to another, by the shorter way round.
    pub(super) fn between(&self, axis: usize, from: usize, to: usize) -> i32 {
        let n = self.shape[axis] as i32;
        (to as i32 - from as i32 + n / 2).rem_euclid(n) - n / 2
    }

    /// The phase of a node.
    pub(super) fn phase(&self, node: usize) -> Vec3 {
        let i = self.index(node);
        core::array::from_fn(|a| i[a] as f64 / self.shape[a] as f64)
    }

    pub(super) fn neighbour(&self, [i, j, k]: [usize; 3], d: [i32; 3]) -> usize {
        let [nx, ny, nz] = self.shape;
        let go = |at: usize, step: i32, n: usize| match step {
            1 if at + 1 == n => 0,
            -1 if at == 0 => n - 1,
            1 => at + 1,
            -1 => at - 1,
            _ => at,
        };
        (go(k, d[2], nz) * ny + go(j, d[1], ny)) * nx + go(i, d[0], nx)
    }

    /// Signed distances at the nodes.
    pub(super) fn distances(&self) -> Vec<f64> {
        let (f, feet) = self.feet();
        f.iter().zip(&feet).map(|(f, foot)| norm(*foot).min(self.surface.edge()).copysign(*f)).collect()
    }

    /// Values of f at the nodes, and the vector (mm) from each to the nearest point of the surface.
    pub(super) fn feet(&self) -> (Vec<f64>, Vec<Vec3>) {
        let u: Vec<Vec3> = (0..self.count()).map(|i| self.phase(i)).collect();
        let (mut f, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
        f.par_chunks_mut(4096)
            .zip(g.par_chunks_mut(4096))
            .zip(u.par_chunks(4096))
            .for_each(|((f, g), u)| self.series.gradients(u, f, g));
        drop(g);
        let mut feet = self.adjacent_feet(&f);
        let mut changed: Vec<usize> = (0..feet.len()).filter(|i| feet[*i][0].is_finite()).collect();
        self.propagate(&mut feet, changed);
        // A propagated foot is that of a neighbour; once refined, it may be nearer to other nodes too, so both alternate.
        changed = (0..feet.len()).collect();
        for _ in 0..6 {
            let sharp: Vec<Vec3> = changed.par_iter().map(|&i| self.surface.nearest(u[i], feet[i])).collect();
            for (i, foot) in changed.iter().zip(sharp) {
                feet[*i] = foot;
            }
            changed = self.propagate(&mut feet, changed);
            if changed.is_empty() {
                break;
            }
        }
        (f, feet)
    }

    /// Feet (from the node, mm) of nodes adjacent to the surface, from its crossings with the grid's edges.
    fn adjacent_feet(&self, f: &[f64]) -> Vec<Vec3> {
        (0..f.len())
            .into_par_iter()
            .map(|node| {
                let (at, u) = (self.index(node), self.phase(node));
                let mut best = NONE;
                for (d, step) in &self.around {
                    let other = f[self.neighbour(at, *d)];
                    let faces = d.iter().filter(|c| **c != 0).count() == 1;
                    if !faces || (f[node] < 0.0) == (other < 0.0) {
                        continue;
                    }
                    let share = f[node] / (f[node] - other);
                    let Some(on) = self.surface.onto(u, scale(*step, share)) else {
                        continue;
                    };
                    let foot = self.surface.nearest(u, on);
                    if dot(foot, foot) < dot(best, best) {
                        best = foot;
                    }
                }
                best
            })
            .collect()
    }

    /// Propagates feet from the nodes `from` to neighbours they are nearer to, until none changes. Returns the nodes that changed.
    fn propagate(&self, feet: &mut [Vec3], from: Vec<usize>) -> Vec<usize> {
        let mut served = vec![false; feet.len()];
        let mut visited = vec![0u32; feet.len()];
        let mut from = from;
        for round in 1.. {
            let mut nodes = Vec::new();
            for &node in &from {
                let at = self.index(node);
                for (d, _) in &self.around {
                    let n = self.neighbour(at, *d);
                    if visited[n] != round {
                        visited[n] = round;
                        nodes.push(n);
                    }
                }
            }
            // All read the feet of the previous round: the result does not depend on the order of the work.
            let better: Vec<(usize, Vec3)> = nodes
                .par_iter()
                .filter_map(|&node| {
                    let at = self.index(node);
                    let own = dot(feet[node], feet[node]) * (1.0 - 1e-9);
                    let mut best = (own, NONE);
                    for (d, step) in &self.around {
                        let foot = add(feet[self.neighbour(at, *d)], *step);
                        let length = dot(foot, foot);
                        if length < best.0 {
                            best = (length, foot);
                        }
                    }
                    best.1[0].is_finite().then_some((node, best.1))
                })
                .collect();
            if better.is_empty() {
                break;
            }
            from = better.iter().map(|b| b.0).collect();
            for (node, foot) in better {
                feet[node] = foot;
                served[node] = true;
            }
        }
        (0..feet.len()).filter(|i| served[*i]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::distance::tests::{series, stretched, surface};
    use super::*;
    use geometry::math::sub;

    /// Feet lie on the surface, and no point of it is nearer, in any period.
    #[test]
    fn feet_are_the_nearest_points_of_the_surface() {
        for name in ["iwp", "lidinoid", "frd"] {
            let (s, m) = (series(name), stretched([1.0, 1.5, 2.5], [0.0; 3]));
            let search = NearestSearch::new(&s, &m, [24; 3]);
            let (_, feet) = search.feet();
            let points = surface(&s, &m, 3000);
            let to_space = inverse(&m);
            for i in (0..feet.len()).step_by(97) {
                let u = search.phase(i);
                let (f, g, _) = search.surface.second(u, feet[i]);
                assert!(f.abs() < 1e-6 * norm(g), "{name} {u:?}: {f}");
                let distance = |p: &(Vec3, Vec3)| {
                    (0..27)
                        .map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1].map(f64::from))
                        .map(|k| add(sub(p.0, u).map(|c| c - c.round()), k))
                        .map(|d| norm(apply(&to_space, d)))
                        .fold(f64::INFINITY, f64::min)
                };
                let nearest = points.iter().map(distance).fold(f64::INFINITY, f64::min);
                let found = norm(feet[i]);
                assert!(found <= nearest + 1e-9, "{name} {u:?}: {found} {nearest}");
            }
        }
    }
}
