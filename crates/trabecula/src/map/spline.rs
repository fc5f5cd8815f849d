//! Three cubic splines through the nodes of a grid in a box: a map with two continuous derivatives.
//!
//! End conditions are not-a-knot: no knot at the second and last but one node, so that a cubic is reproduced exactly and the
//! gradient keeps its order up to the faces. Beyond the box it is extended linearly. Coefficients are those of B-splines.

use multiversion::multiversion;
use rayon::prelude::*;

use super::phase_grid::PhaseGrid;
use crate::field::Block;
use geometry::cubic_spline::{EndCondition, coefficients, slopes, weights};
use geometry::math::{Aabb, Mat3, Vec3, spectral_norm};

/// Fewest nodes along an axis.
pub(super) const LEAST: usize = 6;

/// Intervals along each side of a block that has one bound.
const BLOCK: usize = 4;

/// A map u(x) through values at the nodes of a grid.
pub(super) struct MapSpline {
    grid: PhaseGrid,
    /// Coefficients along each axis: two more than nodes.
    shape: [usize; 3],
    /// The coefficients of the three functions, x fastest; entry m belongs to node m − 1.
    coefficients: [Vec<f64>; 3],
    /// For each block of intervals between nodes, x fastest: a bound of |J − J₀| (Frobenius) and one of |J₀| (spectral), J₀ the
    /// middle of what the entries can be.
    lipschitz: Vec<[f32; 2]>,
    /// J₀ of each block.
    middles: Vec<Mat3>,
}

/// Where a coordinate falls: the interval, and the weights of its four coefficients in the value and in the slope.
#[derive(Clone, Copy)]
struct SplineStencil {
    first: usize,
    value: [f64; 4],
    slope: [f64; 4],
}

impl MapSpline {
    pub fn through(grid: PhaseGrid, values: [Vec<f64>; 3]) -> MapSpline {
        let shape = grid.shape.map(|n| n + 2);
        let coefficients = {
            let [a, b, c] = values;
            let made: Vec<Vec<f64>> =
                [a, b, c].into_par_iter().map(|v| coefficients(v, grid.shape, EndCondition::NotAKnot)).collect();
            let mut made = made.into_iter();
            core::array::from_fn(|_| made.next().unwrap_or_default())
        };
        let mut spline = MapSpline { grid, shape, coefficients, lipschitz: Vec::new(), middles: Vec::new() };
        let [nx, ny, nz] = spline.blocks();
        (spline.lipschitz, spline.middles) =
            (0..nx * ny * nz).into_par_iter().map(|i| spline.lipschitz_of([i % nx, i / nx % ny, i / nx / ny])).unzip();
        spline
    }

    /// From coefficients at the nodes; beyond the grid they go on in straight lines. Some cells, by their first nodes, are evaluated with
    /// others, x fastest: bounds hold for these.
    pub fn of<'a>(
        grid: PhaseGrid,
        at_nodes: &[Vec3],
        other: impl Fn(usize) -> Option<&'a [Vec3; 64]> + Sync,
    ) -> MapSpline {
        let shape = grid.shape.map(|n| n + 2);
        let at = |m: usize, i: usize| {
            let index = [m % shape[0], m / shape[0] % shape[1], m / shape[0] / shape[1]];
            // The two nodes of the straight line along each axis, and what each counts.
            let line = |a: usize| match index[a] {
                0 => [(0, 2.0), (1, -1.0)],
                j if j > grid.shape[a] => [(j - 2, 2.0), (j - 3, -1.0)],
                j => [(j - 1, 1.0), (j - 1, 0.0)],
            };
            let [x, y, z] = [line(0), line(1), line(2)];
            let mut sum = 0.0;
            for (k, wz) in z {
                for (j, wy) in y {
                    for (l, wx) in x.iter().filter(|(_, w)| w * wy * wz != 0.0) {
                        sum += wx * wy * wz * at_nodes[l + grid.shape[0] * (j + grid.shape[1] * k)][i];
                    }
                }
            }
            sum
        };
        let all: usize = shape.iter().product();
        let coefficients = core::array::from_fn(|i| (0..all).into_par_iter().map(|m| at(m, i)).collect());
        let mut spline = MapSpline { grid, shape, coefficients, lipschitz: Vec::new(), middles: Vec::new() };
        let [nx, ny, nz] = spline.blocks();
        let of_block = |i: usize| {
            let at = [i % nx, i / nx % ny, i / nx / ny];
            let cells = (0..BLOCK.pow(3)).filter_map(|c| {
                let n = [c % BLOCK, c / BLOCK % BLOCK, c / BLOCK / BLOCK];
                let [x, y, z]: [usize; 3] = core::array::from_fn(|a| BLOCK * at[a] + n[a]);
                let within = [x, y, z].iter().zip(grid.shape).all(|(i, n)| i + 1 < n);
                within.then_some(x + grid.shape[0] * (y + grid.shape[1] * z))
            });
            let (plain, middle) = spline.lipschitz_of(at);
            if !cells.clone().any(|n| other(n).is_some()) {
                return (plain, middle);
            }
            let each = cells.map(|n| match other(n) {
                Some(c) => steepest(c, grid.step),
                None => steepest(&spline.about(n), grid.step),
            });
            ([(each.fold(0.0, f64::max) * (1.0 + 1e-6)) as f32, 0.0], [[0.0; 3]; 3])
        };
        (spline.lipschitz, spline.middles) = (0..nx * ny * nz).into_par_iter().map(of_block).unzip();
        spline
    }

    /// The coefficients of the cell above a node, x fastest.
    fn about(&self, node: usize) -> [Vec3; 64] {
        let ([x, y, z], [_, sy, sz]) = (self.grid.index(node), self.strides());
        let at = |c: usize| x + c % 4 + (y + c / 4 % 4) * sy + (z + c / 16) * sz;
        core::array::from_fn(|c| self.coefficients.each_ref().map(|of| of[at(c)]))
    }

    /// The values at the nodes.
    pub fn at_nodes(&self) -> [Vec<f64>; 3] {
        let nodes: Vec<Vec3> = (0..self.grid.len()).map(|n| self.grid.node(n)).collect();
        let mut u = vec![[0.0; 3]; nodes.len()];
        self.values(&nodes, &mut u);
        core::array::from_fn(|i| u.iter().map(|u| u[i]).collect())
    }

    pub fn grid(&self) -> &PhaseGrid {
        &self.grid
    }

    fn strides(&self) -> [usize; 3] {
        [1, self.shape[0], self.shape[0] * self.shape[1]]
    }

    /// Where the coordinate `x` falls along an axis.
    #[inline(always)]
    fn stencil(&self, x: f64, axis: usize) -> SplineStencil {
        let h = self.grid.step[axis];
        let s = (x - self.grid.origin[axis]) / h;
        let last = self.grid.shape[axis] - 1;
        let inside = s.clamp(0.0, last as f64);
        let first = (inside as usize).min(last - 1);
        let t = inside - first as f64;
        let (mut value, slope) = (weights(t), slopes(t));
        let beyond = s - inside;
        for (v, d) in value.iter_mut().zip(slope) {
            *v += beyond * d;
        }
        let per = 1.0 / h;
        SplineStencil { first, value, slope: slope.map(|d| d * per) }
    }

    /// u at points.
    pub fn values(&self, points: &[Vec3], out: &mut [Vec3]) {
        values(self, points, out);
    }

    /// u and its Jacobian ∂uᵢ/∂xⱼ at a point.
    pub fn jacobian(&self, p: Vec3) -> (Vec3, Mat3) {
        let (mut u, mut m) = ([[0.0; 3]], [[[0.0; 3]; 3]]);
        self.jacobians(&[p], &mut u, &mut m);
        (u[0], m[0])
    }

    /// u, the same as that of `values`, and its Jacobian at points.
    pub fn jacobians(&self, points: &[Vec3], u: &mut [Vec3], m: &mut [Mat3]) {
        jacobians(self, points, u, m);
    }

    /// For each function the sums over its coefficients about a point: for each pair of lists of weights, y and z, four numbers
    /// along x.
    #[inline(always)]
    fn sums<const Y: usize, const N: usize>(
        &self,
        first: [usize; 3],
        [y, z]: [[&[f64; 4]; Y]; 2],
        pairs: [(usize, usize); N],
    ) -> [[[f64; 4]; N]; 3] {
        let [_, sy, sz] = self.strides();
        let base = first[0] + first[1] * sy + first[2] * sz;
        let mut sums = [[[0.0; 4]; N]; 3];
        for (sums, c) in sums.iter_mut().zip(&self.coefficients) {
            for k in 0..4 {
                let mut planes = [[0.0; 4]; Y];
                for j in 0..4 {
                    let row = c[base + j * sy + k * sz..].first_chunk::<4>().unwrap_or(&[0.0; 4]);
                    for (plane, y) in planes.iter_mut().zip(y) {
                        for i in 0..4 {
                            plane[i] += y[j] * row[i];
                        }
                    }
                }
                for (sum, (b, c)) in sums.iter_mut().zip(pairs) {
                    for i in 0..4 {
                        sum[i] += z[c][k] * planes[b][i];
                    }
                }
            }
        }
        sums
    }

    /// Blocks of intervals along each axis.
    fn blocks(&self) -> [usize; 3] {
        self.grid.shape.map(|n| (n - 1).div_ceil(BLOCK))
    }

    /// [|J − J₀|, |J₀|] over a block, and J₀. A derivative is a mean of differences of coefficients along its axis.
    fn lipschitz_of(&self, at: [usize; 3]) -> ([f32; 2], Mat3) {
        let s = self.strides();
        let base = BLOCK * (at[0] + at[1] * s[1] + at[2] * s[2]);
        // Coefficients that count.
        let n: [usize; 3] = core::array::from_fn(|a| BLOCK.min(self.grid.shape[a] - 1 - BLOCK * at[a]) + 3);
        let (mut middle, mut half) = ([[0.0; 3]; 3], 0.0);
        for (i, c) in self.coefficients.iter().enumerate() {
            for a in 0..3 {
                let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
                let count = |b: usize| n[b] - usize::from(a == b);
                for z in 0..count(2) {
                    for y in 0..count(1) {
                        let row = base + y * s[1] + z * s[2];
                        for x in row..row + count(0) {
                            let v = c[x + s[a]] - c[x];
                            (lo, hi) = (lo.min(v), hi.max(v));
                        }
                    }
                }
                let h = self.grid.step[a];
                middle[i][a] = 0.5 * (lo + hi) / h;
                half += (0.5 * (hi - lo) / h).powi(2);
            }
        }
        // Rounded up, and by more than the rounding of the sums.
        let up = |v: f64| (v * (1.0 + 1e-6)) as f32;
        ([up(half.sqrt()), up(longest(&middle))], middle)
    }

    /// A bound of |J| (spectral norm) in the box.
    pub fn lipschitz(&self, b: &Aabb) -> f64 {
        self.greatest(b, |block, beyond| {
            let [half, middle] = self.lipschitz[block];
            f64::from(half) * beyond + f64::from(middle)
        })
    }

    /// A bound of |J + M| (spectral norm) in the box.
    pub fn lipschitz_beside(&self, b: &Aabb, m: &Mat3) -> f64 {
        self.greatest(b, |block, beyond| {
            let middle = self.middles[block];
            let both = core::array::from_fn(|i| geometry::math::add(middle[i], m[i]));
            // As those that are kept, which are rounded up.
            f64::from(self.lipschitz[block][0]) * beyond + longest(&both) * (1.0 + 1e-6)
        })
    }

    /// The greatest of a number for each block that meets the box, and for how much weights add up to beyond the grid.
    fn greatest(&self, b: &Aabb, of: impl Fn(usize, f64) -> f64) -> f64 {
        let mut range = [(0, 0); 3];
        // Beyond a face the weights are those of a straight line; they add up to one, their sizes to more.
        let mut beyond = 1.0;
        for a in 0..3 {
            let at = |x: f64| (x - self.grid.origin[a]) / self.grid.step[a];
            let last = (self.grid.shape[a] - 1) as f64;
            let [lo, hi] = [at(b.min[a]), at(b.max[a])];
            let out = (-lo).max(hi - last).max(0.0);
            // A straight line weighs with at most a half and its distance on either side.
            beyond *= 1.0 + out;
            let inside = |s: f64| (s.clamp(0.0, last) as usize).min(self.grid.shape[a] - 2) / BLOCK;
            range[a] = (inside(lo), inside(hi));
        }
        let [nx, ny, _] = self.blocks();
        let mut most = 0.0f64;
        for k in range[2].0..=range[2].1 {
            for j in range[1].0..=range[1].1 {
                for i in range[0].0..=range[0].1 {
                    most = most.max(of((k * ny + j) * nx + i, beyond));
                }
            }
        }
        most
    }

    /// The map on the rows of a block.
    pub fn rows<'a>(&'a self, block: &Block<'a>) -> SplineRows<'a> {
        let [x, y, z] = [0, 1, 2].map(|a| {
            let stencils = block.axes[a].iter().map(|&x| self.stencil(x, a));
            stencils.collect::<Vec<SplineStencil>>()
        });
        let range = |s: &[SplineStencil]| {
            let first = s.iter().map(|s| s.first).min().unwrap_or(0);
            let last = s.iter().map(|s| s.first).max().unwrap_or(0);
            (first, last - first + 4)
        };
        let (along_x, along_y) = (range(&x), range(&y));
        // On an interval a spline is a cubic; beyond the box it is another one, which is straight.
        let last = self.grid.shape[0] - 1;
        let in_steps = |x: &f64| (x - self.grid.origin[0]) / self.grid.step[0];
        let runs = block.axes[0].iter().zip(&x).map(|(at, stencil)| {
            let s = in_steps(at);
            let beyond = if s < 0.0 {
                0
            } else if s > last as f64 {
                2
            } else {
                1
            };
            let t = match beyond {
                0 => s,
                2 => s - last as f64,
                _ => s - stencil.first as f64,
            };
            (beyond, stencil.first - along_x.0, t)
        });
        let mut segments: Vec<RowSegment> = Vec::new();
        let mut t = Vec::with_capacity(x.len());
        for (n, (beyond, first, at)) in runs.enumerate() {
            t.push(at);
            match segments.last_mut() {
                Some(p) if p.first == first && p.beyond == beyond => p.to = n + 1,
                _ => segments.push(RowSegment { beyond, first, from: n, to: n + 1 }),
            }
        }
        SplineRows {
            spline: self,
            along_x,
            along_y,
            y,
            z,
            t,
            segments,
            layer: core::array::from_fn(|_| vec![0.0; along_x.1 * along_y.1]),
            line: vec![0.0; along_x.1],
        }
    }
}

/// Nodes of a row in one interval.
#[derive(Clone, Copy, Debug)]
struct RowSegment {
    /// Before the box, in it, after it.
    beyond: u8,
    first: usize,
    from: usize,
    to: usize,
}

/// The map on the rows of a block: coefficients are summed along z once for a layer, along y once for a row, and what is
/// left is a cubic for each interval along x.
pub(in super::super) struct SplineRows<'a> {
    spline: &'a MapSpline,
    /// First coefficient and number of them.
    along_x: (usize, usize),
    along_y: (usize, usize),
    y: Vec<SplineStencil>,
    z: Vec<SplineStencil>,
    t: Vec<f64>,
    segments: Vec<RowSegment>,
    layer: [Vec<f64>; 3],
    line: Vec<f64>,
}

impl SplineRows<'_> {
    /// Makes ready for the rows of layer k.
    pub fn enter_layer(&mut self, k: usize) {
        let [_, sy, sz] = self.spline.strides();
        let (x0, nx) = self.along_x;
        let (y0, ny) = self.along_y;
        let z = self.z[k];
        for (layer, c) in self.layer.iter_mut().zip(&self.spline.coefficients) {
            for j in 0..ny {
                let base = x0 + (y0 + j) * sy + z.first * sz;
                let row = |k: usize| &c[base + k * sz..][..nx];
                blend([row(0), row(1), row(2), row(3)], &z.value, &mut layer[j * nx..][..nx]);
            }
        }
    }

    /// Fills phases of row j of the layer entered last.
    pub fn fill(&mut self, j: usize, out: &mut [Vec<f64>; 3]) {
        let nx = self.along_x.1;
        let y = self.y[j];
        let first = y.first - self.along_y.0;
        for (layer, out) in self.layer.iter().zip(out) {
            let row = |j: usize| &layer[(first + j) * nx..][..nx];
            blend([row(0), row(1), row(2), row(3)], &y.value, &mut self.line);
            cubics(&self.line, &self.segments, &self.t, out);
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn blend(rows: [&[f64]; 4], w: &[f64; 4], out: &mut [f64]) {
    let [a, b, c, d] = rows;
    for ((((o, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *o = w[0] * a + w[1] * b + w[2] * c + w[3] * d;
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn cubics(line: &[f64], segments: &[RowSegment], t: &[f64], out: &mut [f64]) {
    for p in segments {
        let c = &line[p.first..][..4];
        // The powers of t in the value.
        let mut a = [
            (c[0] + 4.0 * c[1] + c[2]) / 6.0,
            (c[2] - c[0]) / 2.0,
            (c[0] - 2.0 * c[1] + c[2]) / 2.0,
            (c[3] - c[0] + 3.0 * (c[1] - c[2])) / 6.0,
        ];
        match p.beyond {
            0 => (a[2], a[3]) = (0.0, 0.0),
            2 => a = [(c[1] + 4.0 * c[2] + c[3]) / 6.0, (c[3] - c[1]) / 2.0, 0.0, 0.0],
            _ => {}
        }
        for (o, t) in out[p.from..p.to].iter_mut().zip(&t[p.from..p.to]) {
            *o = a[0] + t * (a[1] + t * (a[2] + t * a[3]));
        }
    }
}

#[inline(always)]
fn along(row: &[f64; 4], w: &[f64; 4]) -> f64 {
    (row[0] * w[0] + row[1] * w[1]) + (row[2] * w[2] + row[3] * w[3])
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn values(spline: &MapSpline, points: &[Vec3], out: &mut [Vec3]) {
    for (o, p) in out.iter_mut().zip(points) {
        let [x, y, z] = [spline.stencil(p[0], 0), spline.stencil(p[1], 1), spline.stencil(p[2], 2)];
        let sums = spline.sums([x.first, y.first, z.first], [[&y.value], [&z.value]], [(0, 0)]);
        *o = sums.map(|[s]| along(&s, &x.value));
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn jacobians(spline: &MapSpline, points: &[Vec3], u: &mut [Vec3], m: &mut [Mat3]) {
    for ((u, m), p) in u.iter_mut().zip(m).zip(points) {
        let [x, y, z] = [spline.stencil(p[0], 0), spline.stencil(p[1], 1), spline.stencil(p[2], 2)];
        let weights = [[&y.value, &y.slope], [&z.value, &z.slope]];
        let sums = spline.sums([x.first, y.first, z.first], weights, [(0, 0), (1, 0), (0, 1)]);
        *u = sums.map(|[s, ..]| along(&s, &x.value));
        *m = sums.map(|[s, sy, sz]| [along(&s, &x.slope), along(&sy, &x.value), along(&sz, &x.value)]);
    }
}

/// A bound of the spectral norm, at most a seventh above it: λ of the greatest of M Mᵀ, to the eighth, is at most the sum
/// of all.
fn longest(m: &Mat3) -> f64 {
    let mut a = geometry::math::product(m, &geometry::math::transpose(m));
    for _ in 0..2 {
        a = geometry::math::product(&a, &a);
    }
    // tr (A⁴)² = Σ aᵢⱼ², A = M Mᵀ; the eighth root for A, half of it for M.
    let trace: f64 = a.as_flattened().iter().map(|v| v * v).sum();
    trace.powf(1.0 / 16.0)
}

/// A bound of |J| (spectral norm) in a cell with these coefficients: a derivative is a mean of differences along its axis.
fn steepest(c: &[Vec3; 64], step: Vec3) -> f64 {
    let (mut middle, mut half) = ([[0.0; 3]; 3], 0.0);
    for (a, stride) in [1usize, 4, 16].into_iter().enumerate() {
        for i in 0..3 {
            let differences = (0..64).filter(|n| n / stride % 4 < 3).map(|n| c[n + stride][i] - c[n][i]);
            let (lo, hi) = differences.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), d| (lo.min(d), hi.max(d)));
            middle[i][a] = 0.5 * (lo + hi) / step[a];
            half += (0.5 * (hi - lo) / step[a]).powi(2);
        }
    }
    spectral_norm(&middle) + half.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{norm, spectral_norm, sub};

    fn grid() -> PhaseGrid {
        let b = Aabb { min: [-1.0, 0.5, 2.0], max: [2.0, 2.5, 4.4] };
        PhaseGrid::over(&b, [9, 7, 6])
    }

    fn bent(p: Vec3) -> Vec3 {
        let [x, y, z] = p;
        [x + 0.3 * (y + 0.4 * z).sin(), 1.4 * y - 0.2 * (x * 0.8).cos() * z, 0.7 * z + 0.1 * x * y]
    }

    fn spline(f: impl Fn(Vec3) -> Vec3) -> MapSpline {
        let g = grid();
        let at = |i: usize| (0..g.len()).map(|n| f(g.node(n))[i]).collect();
        MapSpline::through(g, [at(0), at(1), at(2)])
    }

    fn positions() -> Vec<Vec3> {
        let mut s = 9u64;
        let mut next = || (geometry::random::random(&mut s) + 1.0) / 2.0;
        // In the box and about it.
        (0..500).map(|_| [-2.0 + 5.0 * next(), 3.5 * next(), 1.0 + 4.5 * next()]).collect()
    }

    #[test]
    fn nodes_are_met_and_cubics_are_met_everywhere() {
        let s = spline(bent);
        let g = grid();
        let cubic = |[x, y, z]: Vec3| [x * y * z - z * z * z, x * x * x * y, 1.0 + y * y * x - z];
        let c = spline(cubic);
        for n in 0..g.len() {
            let mut u = [[0.0; 3]];
            s.values(&[g.node(n)], &mut u);
            assert!(norm(sub(u[0], bent(g.node(n)))) < 1e-13);
        }
        for p in positions() {
            let b = Aabb { min: [-1.0, 0.5, 2.0], max: [2.0, 2.5, 4.4] };
            if b.distance(p) == 0.0 {
                let mut u = [[0.0; 3]];
                c.values(&[p], &mut u);
                // Rounding of coefficients of size a hundred.
                assert!(norm(sub(u[0], cubic(p))) < 1e-11);
            }
        }
    }

    #[test]
    fn derivatives_agree_with_differences_and_rows_with_points_also_outside() {
        let s = spline(bent);
        for p in positions() {
            let (u, m) = s.jacobian(p);
            let mut v = [[0.0; 3]; 2];
            s.values(&[p, p], &mut v);
            assert_eq!(u, v[0]);
            for a in 0..3 {
                let mut q = [p, p];
                q[0][a] -= 1e-6;
                q[1][a] += 1e-6;
                s.values(&q, &mut v);
                for i in 0..3 {
                    assert!(((v[1][i] - v[0][i]) / 2e-6 - m[i][a]).abs() < 1e-7);
                }
            }
        }
        let axis = |from: f64, n: usize| -> Vec<f64> { (0..n).map(|i| from + 0.13 * i as f64).collect() };
        let (x, y, z) = (axis(-2.0, 40), axis(0.0, 25), axis(1.0, 30));
        let block = Block { axes: [&x, &y, &z] };
        let mut rows = s.rows(&block);
        let mut out = [vec![0.0; 40], vec![0.0; 40], vec![0.0; 40]];
        for k in 0..z.len() {
            rows.enter_layer(k);
            for j in 0..y.len() {
                rows.fill(j, &mut out);
                for i in 0..x.len() {
                    let mut u = [[0.0; 3]];
                    s.values(&[[x[i], y[j], z[k]]], &mut u);
                    for a in 0..3 {
                        assert!((u[0][a] - out[a][i]).abs() < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn no_jacobian_in_a_box_is_longer_than_the_bound() {
        let s = spline(bent);
        let p = positions();
        for pair in p.windows(2) {
            let b = Aabb { min: pair[0], max: pair[0] }.with(pair[1]);
            let bound = s.lipschitz(&b);
            for i in 0..27 {
                let t = [i % 3, i / 3 % 3, i / 9].map(|v| f64::from(v) / 2.0);
                let q = core::array::from_fn(|a| b.min[a] + t[a] * (b.max[a] - b.min[a]));
                let here = spectral_norm(&s.jacobian(q).1);
                assert!(here <= bound, "{here} {bound}");
            }
            if s.grid.step.iter().zip(b.size()).all(|(h, s)| s < *h) {
                assert!(bound < 4.0, "{bound}");
            }
        }
    }
}
