//! Multigrid for the normal equations of weighted differences along the edges of a grid.
//!
//! A V-cycle: Chebyshev polynomials of Jacobi's iteration as smoothers, trilinear interpolation, and on each coarser grid the seven
//! points of the same form whose edges count what the edges about them count together, Galerkin's operator with its mass lumped. The
//! cycle is symmetric, so it can precondition conjugate gradients, and neither its order nor its sums depend on the number of threads.
//!
//! Three values at a node may turn along edges, as phases with branches do across cuts: on each grid, and on the way from one to the next,
//! they turn as they would straight from the one node to the other. Coarse grids that do not know what lies across a cut leave waves
//! along it to conjugate gradients, in steps that grow with the grid.

use multiversion::multiversion;
use rayon::prelude::*;

use geometry::math::{Mat3, Vec3, apply, scale, sub, transpose};

/// Degree of the smoothers, and the least eigenvalue of D⁻¹A that they are for; no eigenvalue exceeds 2, by Gershgorin's circles.
const SMOOTHER: (usize, f64) = (3, 0.3);
/// The same for the coarsest grid.
const COARSEST: (usize, f64) = (24, 0.02);
/// Fewest nodes along an axis that is halved, and the ratio of steps up to which one is: weak axes wait for the strong.
const LEAST: usize = 5;
const APART: f64 = 1.5;
/// Rows that are worked on in one go.
const ROWS: usize = 8;
/// Fewest numbers that are worth another thread: on coarse grids that takes longer to start than they do.
const SHARED: usize = 16_384;

/// A grid and the grids coarser than it.
pub(super) struct Multigrid {
    levels: Vec<GridLevel>,
    /// Values at each node.
    parts: usize,
}

/// Two nodes, the second of another level where values are interpolated; what that counts; and what values of the first are turned by on
/// the way to the second.
struct Coupling {
    ends: [usize; 2],
    counts: f64,
    turn: Mat3,
}

/// Σ w (Φⱼ − Φᵢ)² over the edges of a grid, x running fastest, and Σ m Φᵢ² over its nodes.
pub(super) struct GridLevel {
    shape: [usize; 3],
    /// For the edge above each node along each axis what the square of a difference counts; zero where there is no edge.
    pub edges: [Vec<f64>; 3],
    /// What the square of a node's value counts; empty if nothing anywhere.
    mass: Vec<f64>,
    /// One over the sum of a node's edges and its mass; zero where it has none.
    inverse: Vec<f64>,
    /// The axes along which the next level has half as many nodes.
    halved: [bool; 3],
    /// Edges along which values turn, which `edges` lacks.
    turned: Vec<Coupling>,
    /// Nodes of the next level whose values turn on the way to nodes of this one.
    shared: Vec<Coupling>,
}

/// Vectors of one level: the right-hand side, the solution, its last change, and what is left.
struct LevelVectors {
    right: Vec<f64>,
    x: Vec<f64>,
    change: Vec<f64>,
    left: Vec<f64>,
}

impl Multigrid {
    /// For what the square of a difference along each edge counts, and what that of a node's value does (empty if nothing); `step` is the
    /// length of the edges along each axis.
    pub fn new(shape: [usize; 3], step: [f64; 3], edges: [Vec<f64>; 3], mass: Vec<f64>) -> Multigrid {
        let (mut levels, mut step) = (vec![GridLevel::new(shape, edges, mass)], step);
        while let Some(coarser) = levels.last_mut().and_then(|l| l.coarsened(&mut step)) {
            levels.push(coarser);
        }
        Multigrid { levels, parts: 1 }
    }

    /// The same for three values at each node, one after the other for all nodes, which on the way between two near nodes are `turned`.
    pub fn turned(mut self, turn: impl Fn([usize; 2]) -> Option<Mat3> + Sync) -> Multigrid {
        self.parts = 3;
        let mut nodes: Vec<usize> = (0..self.finest().inverse.len()).collect();
        for l in 0..self.levels.len() {
            let (above, below) = self.levels.split_at_mut(l + 1);
            let level = &mut above[l];
            level.cut(|ends| turn(ends.map(|n| nodes[n])));
            let Some(next) = below.first() else { break };
            let here: Vec<usize> = (0..next.inverse.len()).map(|n| nodes[level.under(next, n)]).collect();
            level.shared = level.interpolated(next, |[n, m]| turn([nodes[n], here[m]]));
            nodes = here;
        }
        self
    }

    pub fn finest(&self) -> &GridLevel {
        &self.levels[0]
    }

    /// A x on the finest level.
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        self.finest().apply(x, out, None);
    }

    /// A cycle: what takes residuals of the finest level to corrections.
    pub fn cycle(&self) -> impl FnMut(&[f64], &mut [f64]) + '_ {
        let zeros = |l: &GridLevel| {
            let zeros = || vec![0.0; self.parts * l.inverse.len()];
            LevelVectors { right: zeros(), x: zeros(), change: zeros(), left: zeros() }
        };
        let mut work: Vec<LevelVectors> = self.levels.iter().map(zeros).collect();
        move |r, z| {
            work[0].right.copy_from_slice(r);
            descend(&self.levels, &mut work);
            z.copy_from_slice(&work[0].x);
        }
    }
}

fn descend(levels: &[GridLevel], work: &mut [LevelVectors]) {
    let ([level, coarser @ ..], [own, below @ ..]) = (levels, work) else { return };
    let ([_, ..], [next, ..]) = (coarser, &mut *below) else { return level.smooth(own, COARSEST, true) };
    level.smooth(own, SMOOTHER, true);
    let LevelVectors { right, x, left, .. } = own;
    level.apply(x, left, Some(right));
    level.restrict(&coarser[0], left, &mut next.right);
    descend(coarser, below);
    level.prolong(&coarser[0], &below[0].x, &mut own.x);
    level.smooth(own, SMOOTHER, false);
}

impl GridLevel {
    fn new(shape: [usize; 3], edges: [Vec<f64>; 3], mass: Vec<f64>) -> GridLevel {
        let strides = [1, shape[0], shape[0] * shape[1]];
        let sum = |n: usize| -> f64 {
            let around =
                (0..3).map(|a| edges[a][n] + n.checked_sub(strides[a]).map_or(0.0, |m| edges[a][m])).sum::<f64>();
            around + mass.get(n).copied().unwrap_or(0.0)
        };
        let all = shape.iter().product();
        let inverse = (0..all).into_par_iter().map(sum).map(|s| if s > 0.0 { 1.0 / s } else { 0.0 }).collect();
        GridLevel { shape, edges, mass, inverse, halved: [false; 3], turned: Vec::new(), shared: Vec::new() }
    }

    /// The next level; `None` where no axis can be halved.
    fn coarsened(&mut self, step: &mut [f64; 3]) -> Option<GridLevel> {
        let long = |a: usize| self.shape[a] >= LEAST;
        let least = (0..3).filter(|a| long(*a)).map(|a| step[a]).fold(f64::INFINITY, f64::min);
        self.halved = core::array::from_fn(|a| long(a) && step[a] < APART * least);
        if !self.halved.contains(&true) {
            return None;
        }
        let shape = core::array::from_fn(|a| if self.halved[a] { self.shape[a] / 2 + 1 } else { self.shape[a] });
        (0..3).filter(|a| self.halved[*a]).for_each(|a| step[a] *= 2.0);
        let strides = [1, self.shape[0], self.shape[0] * self.shape[1]];
        // Along the edge two finer ones in a row, a half of the difference each; across it all whose ends have a share of this line.
        let edge = |a: usize, n: usize| {
            let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            if at[a] + 1 == shape[a] {
                return 0.0;
            }
            let (b, c) = ((a + 1) % 3, (a + 2) % 3);
            let first = if self.halved[a] { 2 * at[a] } else { at[a] };
            let parts = if self.halved[a] { &[(0, 0.25), (1, 0.25)][..] } else { &[(0, 1.0)] };
            let mut sum = 0.0;
            for (k, wk) in self.taps(c, at[c]) {
                for (j, wj) in self.taps(b, at[b]) {
                    for (i, wi) in parts.iter().filter(|(i, _)| first + i < self.shape[a]) {
                        sum += wi * wj * wk * self.edges[a][(first + i) * strides[a] + j * strides[b] + k * strides[c]];
                    }
                }
            }
            sum
        };
        let all: usize = shape.iter().product();
        let edges = core::array::from_fn(|a| (0..all).into_par_iter().map(|n| edge(a, n)).collect());
        let mut next = GridLevel::new(shape, edges, Vec::new());
        if !self.mass.is_empty() {
            let mut mass = vec![0.0; all];
            self.restrict(&next, &self.mass, &mut mass);
            next = GridLevel::new(shape, next.edges, mass);
        }
        Some(next)
    }

    /// The nodes along an axis in which node `i` of the next level has a share, with the shares.
    fn taps(&self, axis: usize, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (first, all) = match self.halved[axis] {
            true => (2 * i, &[(-1, 0.5), (0, 1.0), (1, 0.5)][..]),
            false => (i, &[(0, 1.0)][..]),
        };
        let there = move |(by, w): &(isize, f64)| first.checked_add_signed(*by).map(|n| (n, *w));
        all.iter().filter_map(there).filter(move |(n, _)| *n < self.shape[axis])
    }

    /// The nodes of the next level along an axis that have a share in node `i`, with the shares.
    fn sources(&self, axis: usize, i: usize) -> [(usize, f64); 2] {
        match (self.halved[axis], i % 2) {
            (true, 1) => [(i / 2, 0.5), (i / 2 + 1, 0.5)],
            (true, _) => [(i / 2, 1.0), (i / 2, 0.0)],
            _ => [(i, 1.0), (i, 0.0)],
        }
    }

    /// Takes edges along which values turn out of the others.
    fn cut(&mut self, turn: impl Fn([usize; 2]) -> Option<Mat3> + Sync) {
        let strides = [1, self.shape[0], self.shape[0] * self.shape[1]];
        for (edges, stride) in self.edges.iter_mut().zip(strides) {
            let link = |(n, counts): (usize, &f64)| link([n, n + stride], *counts, &turn);
            let found: Vec<Coupling> = edges.par_iter().enumerate().filter_map(link).collect();
            found.iter().for_each(|l| edges[l.ends[0]] = 0.0);
            self.turned.extend(found);
        }
    }

    /// The nodes of this level and those of the next that have a share in them, where values turn on the way.
    fn interpolated(&self, next: &GridLevel, turn: impl Fn([usize; 2]) -> Option<Mat3> + Sync) -> Vec<Coupling> {
        let ([nx, ny, _], [cx, cy, _]) = (self.shape, next.shape);
        let of = |n: usize| {
            let [x, y, z] = [n % nx, n / nx % ny, n / nx / ny];
            let mut all = Vec::new();
            for (k, wz) in self.sources(2, z) {
                for (j, wy) in self.sources(1, y) {
                    let along = self.sources(0, x).into_iter();
                    all.extend(along.filter_map(|(i, wx)| link([n, (k * cy + j) * cx + i], wx * wy * wz, &turn)));
                }
            }
            all
        };
        (0..self.inverse.len()).into_par_iter().flat_map_iter(of).collect()
    }

    /// The node at which node `n` of the next level is, or the nearest to it.
    fn under(&self, next: &GridLevel, n: usize) -> usize {
        let at = [n % next.shape[0], n / next.shape[0] % next.shape[1], n / next.shape[0] / next.shape[1]];
        let [i, j, k]: [usize; 3] =
            core::array::from_fn(|a| if self.halved[a] { (2 * at[a]).min(self.shape[a] - 1) } else { at[a] });
        (k * self.shape[1] + j) * self.shape[0] + i
    }

    /// A x, or what it leaves of a right-hand side.
    fn apply(&self, x: &[f64], out: &mut [f64], right: Option<&[f64]>) {
        let len = self.inverse.len();
        for (i, (x, out)) in x.chunks(len).zip(out.chunks_mut(len)).enumerate() {
            self.apply_untwisted(x, out, right.map(|r| &r[i * len..]));
        }
        let sign = if right.is_some() { -1.0 } else { 1.0 };
        for Coupling { ends: [n, m], counts, turn } in &self.turned {
            let off = scale(sub(values(x, len, *n), apply(&transpose(turn), values(x, len, *m))), sign * counts);
            add_to(out, len, *n, off);
            add_to(out, len, *m, scale(apply(turn, off), -1.0));
        }
    }

    /// The same for one value at each node, without the edges along which values turn.
    fn apply_untwisted(&self, x: &[f64], out: &mut [f64], right: Option<&[f64]>) {
        let nx = self.shape[0];
        let rows = |(at, out): (usize, &mut [f64])| {
            for (row, out) in (at * ROWS..).zip(out.chunks_mut(nx)) {
                self.row(x, row, out);
                if let Some(right) = right {
                    out.iter_mut().zip(&right[row * nx..]).for_each(|(o, b)| *o = b - *o);
                }
            }
        };
        out.par_chunks_mut(nx * ROWS).enumerate().with_min_len(SHARED.div_ceil(nx * ROWS)).for_each(rows);
    }

    /// Row number `row` of A x.
    fn row(&self, x: &[f64], row: usize, out: &mut [f64]) {
        let [nx, ny, _] = self.shape;
        let from = row * nx;
        let own = &x[from..][..nx];
        along(own, &self.edges[0][from..][..nx], out);
        if let Some(mass) = self.mass.get(from..from + nx) {
            out.iter_mut().zip(mass).zip(own).for_each(|((o, m), x)| *o += m * x);
        }
        for (a, stride, at) in [(1, nx, row % ny), (2, nx * ny, row / ny)] {
            if at + 1 < self.shape[a] {
                across(own, &x[from + stride..][..nx], &self.edges[a][from..][..nx], out);
            }
            if at > 0 {
                across(own, &x[from - stride..][..nx], &self.edges[a][from - stride..][..nx], out);
            }
        }
    }

    /// Improves the solution, or begins it, by a polynomial of D⁻¹A that is least on the eigenvalues from `low` to 2 (Saad, Iterative
    /// methods for sparse linear systems, 2003, algorithm 12.1).
    fn smooth(&self, work: &mut LevelVectors, (degree, low): (usize, f64), anew: bool) {
        let (middle, half) = (0.5 * (2.0 + low), 0.5 * (2.0 - low));
        let LevelVectors { right, x, change, left } = work;
        let mut rho = half / middle;
        for i in 0..degree {
            let (keep, more) = match i {
                0 => (0.0, 1.0 / middle),
                _ => {
                    let next = 1.0 / (2.0 * middle / half - rho);
                    let both = (next * rho, 2.0 * next / half);
                    rho = next;
                    both
                }
            };
            let first = anew && i == 0;
            match first {
                true => left.copy_from_slice(right),
                false => self.apply(x, left, Some(right)),
            }
            let len = self.inverse.len();
            let all = x.chunks_mut(len).zip(change.chunks_mut(len)).zip(left.chunks(len));
            for ((x, change), left) in all {
                let parts = (
                    x.par_chunks_mut(SHARED),
                    change.par_chunks_mut(SHARED),
                    left.par_chunks(SHARED),
                    self.inverse.par_chunks(SHARED),
                );
                parts.into_par_iter().for_each(|(x, change, left, inverse)| {
                    for (((x, c), l), d) in x.iter_mut().zip(change).zip(left).zip(inverse) {
                        *c = if i == 0 { more * d * l } else { keep * *c + more * d * l };
                        *x = if first { *c } else { *x + *c };
                    }
                });
            }
        }
    }

    /// What a vector of this level is on the next: the transpose of `prolong`.
    fn restrict(&self, coarser: &GridLevel, from: &[f64], to: &mut [f64]) {
        let [own, next] = [self, coarser].map(|l| l.inverse.len());
        to.chunks_mut(next).zip(from.chunks(own)).for_each(|(to, from)| self.restrict_untwisted(coarser, from, to));
        for Coupling { ends: [n, m], counts, turn } in &self.shared {
            let r = values(from, own, *n);
            add_to(to, next, *m, scale(sub(apply(turn, r), r), *counts));
        }
    }

    fn restrict_untwisted(&self, coarser: &GridLevel, from: &[f64], to: &mut [f64]) {
        let [nx, ny, _] = self.shape;
        let [cx, cy, _] = coarser.shape;
        to.par_chunks_mut(cx).enumerate().with_min_len(SHARED.div_ceil(nx)).for_each(|(row, to)| {
            let mut line = vec![0.0; nx];
            for (k, wk) in self.taps(2, row / cy) {
                for (j, wj) in self.taps(1, row % cy) {
                    let w = wj * wk;
                    line.iter_mut().zip(&from[(k * ny + j) * nx..]).for_each(|(l, f)| *l += w * f);
                }
            }
            for (i, t) in to.iter_mut().enumerate() {
                *t = self.taps(0, i).map(|(n, w)| w * line[n]).sum();
            }
        });
    }

    /// Adds the trilinear interpolation of a vector of the next level.
    fn prolong(&self, coarser: &GridLevel, from: &[f64], to: &mut [f64]) {
        let [own, next] = [self, coarser].map(|l| l.inverse.len());
        to.chunks_mut(own).zip(from.chunks(next)).for_each(|(to, from)| self.prolong_untwisted(coarser, from, to));
        for Coupling { ends: [n, m], counts, turn } in &self.shared {
            let z = values(from, next, *m);
            add_to(to, own, *n, scale(sub(apply(&transpose(turn), z), z), *counts));
        }
    }

    fn prolong_untwisted(&self, coarser: &GridLevel, from: &[f64], to: &mut [f64]) {
        let [nx, ny, _] = self.shape;
        let [cx, cy, _] = coarser.shape;
        to.par_chunks_mut(nx).enumerate().with_min_len(SHARED.div_ceil(nx)).for_each(|(row, to)| {
            let mut line = vec![0.0; cx];
            for (k, wk) in self.sources(2, row / ny) {
                for (j, wj) in self.sources(1, row % ny) {
                    let w = wj * wk;
                    if w != 0.0 {
                        line.iter_mut().zip(&from[(k * cy + j) * cx..]).for_each(|(l, f)| *l += w * f);
                    }
                }
            }
            for (i, t) in to.iter_mut().enumerate() {
                *t += self.sources(0, i).into_iter().map(|(n, w)| w * line[n]).sum::<f64>();
            }
        });
    }
}

/// The link between two nodes if it counts anything and values turn along it.
fn link(ends: [usize; 2], counts: f64, turn: impl Fn([usize; 2]) -> Option<Mat3>) -> Option<Coupling> {
    let turn = if counts > 0.0 { turn(ends)? } else { return None };
    Some(Coupling { ends, counts, turn })
}

/// The three values at a node.
fn values(x: &[f64], len: usize, node: usize) -> Vec3 {
    [0, 1, 2].map(|i| x[i * len + node])
}

/// Adds to the three values at a node.
fn add_to(x: &mut [f64], len: usize, node: usize, by: Vec3) {
    by.iter().enumerate().for_each(|(i, by)| x[i * len + node] += by);
}

/// What the edges along a row give of A x.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn along(x: &[f64], edges: &[f64], out: &mut [f64]) {
    let n = x.len();
    out[n - 1] = 0.0;
    for ((o, w), d) in out.iter_mut().zip(edges).zip(x.windows(2)) {
        *o = w * (d[0] - d[1]);
    }
    for ((o, w), d) in out[1..].iter_mut().zip(edges).zip(x.windows(2)) {
        *o += w * (d[1] - d[0]);
    }
}

/// Adds what edges to another row give of A x.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn across(x: &[f64], other: &[f64], edges: &[f64], out: &mut [f64]) {
    for (((o, x), y), w) in out.iter_mut().zip(x).zip(other).zip(edges) {
        *o += w * (x - y);
    }
}
