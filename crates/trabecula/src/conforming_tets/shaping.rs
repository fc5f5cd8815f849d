//! A mesh whose shapes are being improved: its tetrahedra at each node, and which of them are badly shaped.

use rayon::prelude::*;

use super::node_surfaces::{SurfaceSet, onto, tangent};
use super::partition::images;
use super::tet_change::Change;
use super::tet_shape::shape;
use crate::implicit::Surface;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::progress::checkpoint;
use geometry::tetmesh::FACES;

/// Shapes better than this are left as they are: dihedral angles of 22 to 149 degrees.
pub(crate) const GOOD: f64 = 4.2;
/// For shapes worse than this all directions are tried: dihedral angles of 15 to 159 degrees.
pub(super) const POOR: f64 = 1.9;
/// Rounds of moves, collapses and flips.
const ROUNDS: usize = 8;
/// Passes of moves in each.
const PASSES: usize = 3;
/// Step lengths tried, as fractions of the mean edge at the node.
const STEPS: [f64; 4] = [0.3, 0.15, 0.07, 0.03];
/// The least relative gain.
const GAIN: f64 = 1.001;
/// A tetrahedron that was removed.
pub(crate) const GONE: [u32; 4] = [u32::MAX; 4];

/// A mesh that is being improved.
pub(crate) struct Shaping<'a> {
    pub surfaces: &'a [Surface],
    pub nodes: Vec<Vec3>,
    /// The surfaces on which each node stays.
    pub on: Vec<SurfaceSet>,
    /// The next periodic image of each node.
    pub next: Vec<u32>,
    pub tets: Vec<[u32; 4]>,
    pub domain: Vec<u8>,
    /// The tetrahedra at each node.
    pub around: Vec<Vec<u32>>,
    /// The shape of each tetrahedron.
    pub shapes: Vec<f64>,
    /// What was changed while a neighbourhood is being mended.
    pub(super) changes: Option<Vec<Change>>,
}

impl<'a> Shaping<'a> {
    pub fn new(
        surfaces: &'a [Surface],
        (nodes, on, next): (Vec<Vec3>, Vec<SurfaceSet>, Vec<u32>),
        (tets, domain): (Vec<[u32; 4]>, Vec<u8>),
    ) -> Shaping<'a> {
        let mut count = vec![0; nodes.len()];
        tets.iter().flatten().for_each(|n| count[*n as usize] += 1);
        let mut around: Vec<Vec<u32>> = count.into_iter().map(Vec::with_capacity).collect();
        for (i, t) in (0..).zip(&tets) {
            t.iter().for_each(|n| around[*n as usize].push(i));
        }
        let shapes = tets.par_iter().map(|t| shape(t.map(|n| nodes[n as usize]))).collect();
        Shaping { surfaces, nodes, on, next, tets, domain, around, shapes, changes: None }
    }

    /// Moves nodes, collapses edges and flips until shapes are good or nothing helps; false if `goes_on` was.
    pub fn improve(&mut self, goes_on: &dyn Fn() -> bool) -> bool {
        for _ in 0..ROUNDS {
            let mut changed = false;
            if !goes_on() {
                return false;
            }
            for _ in 0..PASSES {
                changed |= self.move_nodes();
            }
            changed |= self.change_topology();
            if !changed {
                return true;
            }
        }
        self.move_nodes();
        goes_on()
    }

    /// The corners of a tetrahedron.
    pub fn corners(&self, t: u32) -> [Vec3; 4] {
        self.tets[t as usize].map(|n| self.nodes[n as usize])
    }

    /// The tetrahedra that are badly shaped, the worst first.
    pub fn bad(&self) -> Vec<u32> {
        let mut bad: Vec<u32> =
            (0..self.tets.len() as u32).into_par_iter().filter(|t| self.shapes[*t as usize] < GOOD).collect();
        bad.retain(|t| self.tets[*t as usize] != GONE);
        bad.sort_unstable_by(|a, b| self.shapes[*a as usize].total_cmp(&self.shapes[*b as usize]).then(a.cmp(b)));
        bad
    }

    /// Moves the nodes of badly shaped tetrahedra, independent ones at a time; whether any moved.
    fn move_nodes(&mut self) -> bool {
        let mut seen = vec![false; self.nodes.len()];
        let mut left: Vec<u32> = Vec::new();
        for n in self.bad().into_iter().flat_map(|t| self.tets[t as usize]) {
            let first = images(&self.next, n).min().unwrap_or(n);
            if !core::mem::replace(&mut seen[first as usize], true) {
                left.push(first);
            }
        }
        let mut taken = vec![0u32; self.tets.len()];
        let (mut round, mut changed) = (0, false);
        while !left.is_empty() {
            checkpoint();
            round += 1;
            let (mut now, mut later) = (Vec::new(), Vec::new());
            for n in left {
                let of = || images(&self.next, n).flat_map(|n| self.around[n as usize].iter());
                if of().any(|t| taken[*t as usize] == round) {
                    later.push(n);
                } else {
                    of().for_each(|t| taken[*t as usize] = round);
                    now.push(n);
                }
            }
            let moves: Vec<Option<Vec3>> = now.par_iter().map(|n| self.better(*n)).collect();
            for (n, by) in now.into_iter().zip(moves) {
                if let Some(by) = by {
                    changed = true;
                    self.displace(n, by);
                }
            }
            left = later;
        }
        changed
    }

    /// Displaces a node and its images.
    pub(super) fn displace(&mut self, n: u32, by: Vec3) {
        for n in images(&self.next, n) {
            if let Some(changes) = &mut self.changes {
                changes.push(Change::Moved(n, self.nodes[n as usize]));
            }
            self.nodes[n as usize] = add(self.nodes[n as usize], by);
        }
        for n in images(&self.next, n) {
            for t in &self.around[n as usize] {
                self.shapes[*t as usize] = shape(self.tets[*t as usize].map(|n| self.nodes[n as usize]));
            }
        }
    }

    /// The worst shape at a node and its images if it is displaced; `None` if it is no better than `bar`.
    pub(super) fn worst(&self, n: u32, by: Vec3, bar: f64) -> Option<f64> {
        let mut worst = f64::INFINITY;
        for n in images(&self.next, n) {
            for t in &self.around[n as usize] {
                let t = self.tets[*t as usize];
                let p = t.map(|m| if m == n { add(self.nodes[m as usize], by) } else { self.nodes[m as usize] });
                worst = worst.min(shape(p));
                if worst <= bar {
                    return None;
                }
            }
        }
        Some(worst)
    }

    /// The displacement of a node that improves the worst shape at it most, if there is one: of nodes on surfaces along them.
    pub(super) fn better(&self, n: u32) -> Option<Vec3> {
        let (start, on) = (self.nodes[n as usize], self.on[n as usize]);
        let images: Vec<u32> = images(&self.next, n).collect();
        let of = || images.iter().flat_map(|n| self.around[*n as usize].iter().map(|t| (*n, *t)));
        let (mut worst, mut which) = (f64::INFINITY, None);
        for (n, t) in of() {
            if self.shapes[t as usize] < worst {
                (worst, which) = (self.shapes[t as usize], Some((n, t)));
            }
        }
        let ((at, t), before) = (which?, worst);
        if before >= GOOD {
            return None;
        }
        let directions = self.directions(&images, (at, t))?;
        // Images differ in the bounding planes they lie on, which are parallel.
        let along = tangent(self.surfaces, on, start);
        let (directions, edge) = directions;
        let (mut best, mut best_by) = (before * GAIN, None);
        let many = if before < POOR { 26 } else { 0 };
        let everywhere = (0..27).filter(|i| *i != 13).take(many).map(|i: i32| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]);
        let everywhere: Vec<Vec3> = everywhere.map(|d| d.map(f64::from)).collect();
        for step in STEPS {
            for d in directions.iter().chain(&everywhere) {
                let d = along.part(*d);
                let length = norm(d);
                if length < 1e-3 {
                    continue;
                }
                let by = scale(d, step * edge / length);
                if let Some(w) = self.worst(n, by, best) {
                    (best, best_by) = (w, Some(by));
                }
            }
        }
        let by = best_by?;
        if on == 0 {
            return Some(by);
        }
        let to = onto(self.surfaces, on, add(start, by), 0.3 * edge)?;
        let by = sub(to, start);
        self.worst(n, by, before * GAIN).map(|_| by)
    }

    /// Directions in which to move a node: to the mean of its neighbours, and from, to and along the opposite face of its worst
    /// tetrahedron `t`, of which image `at` is a node; and its mean edge.
    fn directions(&self, images: &[u32], (at, t): (u32, u32)) -> Option<([Vec3; 5], f64)> {
        let (mut sum, mut length, mut count) = ([0.0; 3], 0.0, 0.0);
        for n in images {
            for t in &self.around[*n as usize] {
                for m in self.tets[*t as usize].into_iter().filter(|m| m != n) {
                    let d = sub(self.nodes[m as usize], self.nodes[*n as usize]);
                    (sum, length, count) = (add(sum, d), length + norm(d), count + 1.0);
                }
            }
        }
        let t = self.tets[t as usize];
        let here = t.iter().position(|m| *m == at)?;
        let [a, b, c] = FACES[here].map(|k| self.nodes[t[k] as usize]);
        let off = unit(cross(sub(b, a), sub(c, a)));
        let middle = sub(scale(add(add(a, b), c), 1.0 / 3.0), self.nodes[at as usize]);
        let along = unit(sub(middle, scale(off, dot(middle, off))));
        let made = [unit(sum), off, scale(off, -1.0), along, scale(along, -1.0)];
        let finite = |d: Vec3| if d.iter().all(|x| x.is_finite()) { d } else { [0.0; 3] };
        Some((made.map(finite), length / count))
    }
}
