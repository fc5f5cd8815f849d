//! Numbers on a grid, trilinear between its nodes; resampling of numbers at points or on a mesh to a grid.

use std::collections::VecDeque;

use super::VaryingNumber;
use crate::field::Field;
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Interval, Vec3, cross, determinant, dot, sub};
use geometry::nearest_points::NearestPoints;

/// Cells of the grid along each side of the blocks whose ranges are kept.
const BLOCK: usize = 4;
/// Steps on the longest edge of the bounds, at least: what lies within one of a mesh counts as covered by it.
const COARSEST: f64 = 16.0;
/// Most nodes of a grid that scattered numbers are put on.
const NODES: f64 = 1.0e6;

/// Numbers at the nodes of a grid, linear between them along each axis and constant beyond the last.
pub struct Samples {
    origin: Vec3,
    step: Vec3,
    shape: [usize; 3],
    values: Vec<f64>,
    /// Least and greatest value in each block of cells.
    ranges: Vec<[f64; 2]>,
    blocks: [usize; 3],
}

impl Samples {
    /// Numbers at origin + step · (i, j, k), i running fastest.
    ///
    /// # Errors
    /// Steps that are not positive, a shape that does not fit the numbers, numbers that are not finite.
    pub fn new(origin: Vec3, step: Vec3, shape: [usize; 3], values: Vec<f64>) -> Result<Samples, Fault> {
        if origin.iter().any(|v| !v.is_finite()) {
            return Err(Fault::new("origin", format!("found {origin:?}; give three finite numbers, mm")));
        }
        if step.iter().any(|h| !(*h > 0.0 && h.is_finite())) {
            return Err(Fault::new("step", format!("found {step:?}; a step is a positive, finite length, mm")));
        }
        let [nx, ny, nz] = shape;
        if values.is_empty() || shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m)) != Some(values.len()) {
            return Err(Fault::new(
                "path",
                format!("{} do not fill a grid of {nx} × {ny} × {nz}", counted(values.len(), "number")),
            ));
        }
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            let bad = values.iter().filter(|v| !v.is_finite()).count();
            let message = format!(
                "{} of {} {} not finite, the first at ({}, {}, {}) of the grid: {}; fill them before use",
                bad,
                counted(values.len(), "number"),
                if bad == 1 { "is" } else { "are" },
                n % nx,
                n / nx % ny,
                n / nx / ny,
                values[n]
            );
            return Err(Fault::new("path", message));
        }
        let blocks = shape.map(|n| (n - 1).div_ceil(BLOCK).max(1));
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; blocks.iter().product()];
        for (n, v) in values.iter().enumerate() {
            let at = [n % nx, n / nx % ny, n / nx / ny];
            // A node between blocks belongs to all of them.
            let of = |a: usize| {
                let b = at[a] / BLOCK;
                (if at[a] % BLOCK == 0 { b.saturating_sub(1) } else { b }.min(blocks[a] - 1), b.min(blocks[a] - 1))
            };
            for k in of(2).0..=of(2).1 {
                for j in of(1).0..=of(1).1 {
                    for i in of(0).0..=of(0).1 {
                        let r = &mut ranges[(k * blocks[1] + j) * blocks[0] + i];
                        *r = [r[0].min(*v), r[1].max(*v)];
                    }
                }
            }
        }
        Ok(Samples { origin, step, shape, values, ranges, blocks })
    }

    /// The box that the nodes span.
    pub fn bounds(&self) -> Aabb {
        let far = core::array::from_fn(|a| self.origin[a] + self.step[a] * (self.shape[a] - 1) as f64);
        Aabb { min: self.origin, max: far }
    }

    /// The share of points that no number covers: a number also covers half a step about it.
    pub(super) fn uncovered(&self, points: &[Vec3]) -> f64 {
        let reach = self.step.into_iter().fold(0.0, f64::max) * 0.5 + 1e-9;
        let covered = self.bounds().grown(reach);
        points.iter().filter(|p| covered.distance(**p) > 0.0).count() as f64 / points.len() as f64
    }

    /// Steps between nodes, mm.
    pub fn step(&self) -> Vec3 {
        self.step
    }

    /// The interval of a coordinate, the fraction within it (0 to 1), and whether the coordinate is within the grid.
    #[inline]
    fn interval(&self, x: f64, a: usize) -> (usize, f64, bool) {
        let last = (self.shape[a] - 1) as f64;
        let s = (x - self.origin[a]) / self.step[a];
        let inside = s.clamp(0.0, last);
        // Conversion through i32 is the fastest; a shape has fewer nodes than that.
        let i = (inside as i32 as usize).min(self.shape[a].saturating_sub(2));
        (i, inside - i as f64, s == inside && last > 0.0)
    }

    /// The four edges along x of a cell, each by the numbers at its ends.
    #[inline]
    fn edges_of(&self, [i, j, k]: [usize; 3]) -> [[f64; 2]; 4] {
        let [nx, ny, nz] = self.shape;
        let edge = |dj: usize, dk: usize| {
            let (j, k) = ((j + dj).min(ny - 1), (k + dk).min(nz - 1));
            let row = &self.values[(k * ny + j) * nx..][..nx];
            [row[i], row[(i + 1).min(nx - 1)]]
        };
        [edge(0, 0), edge(1, 0), edge(0, 1), edge(1, 1)]
    }

    /// The four edges along x of the cell of a point, and the fractions of the cell at the point.
    #[inline]
    fn edges(&self, p: Vec3) -> ([[f64; 2]; 4], [(f64, bool); 3]) {
        let [(i, x, inx), (j, y, iny), (k, z, inz)] =
            [self.interval(p[0], 0), self.interval(p[1], 1), self.interval(p[2], 2)];
        (self.edges_of([i, j, k]), [(x, inx), (y, iny), (z, inz)])
    }

    /// The least and the greatest number in a box that at most one plane of nodes crosses along each axis; none of others. Trilinear numbers
    /// have their ends in the corners of the boxes that the planes cut it into.
    fn range_in(&self, b: &Aabb) -> Option<[f64; 2]> {
        let mut corners = [([(0, 0.0); 3], 0); 3];
        for (a, (at, count)) in corners.iter_mut().enumerate() {
            let ((i, x, _), (j, y, _)) = (self.interval(b.min[a], a), self.interval(b.max[a], a));
            (*at, *count) = match j - i {
                0 => ([(i, x), (j, y), (j, y)], 2),
                1 => ([(i, x), (j, 0.0), (j, y)], 3),
                _ => return None,
            };
        }
        let [xs, ys, zs] = corners.each_ref().map(|(at, count)| &at[..*count]);
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for (k, z) in zs {
            for (j, y) in ys {
                for (i, x) in xs {
                    let v = trilinear(self.edges_of([*i, *j, *k]), [*x, *y, *z]);
                    ends = [ends[0].min(v), ends[1].max(v)];
                }
            }
        }
        Some(ends)
    }

    /// The value at a point.
    #[inline]
    pub fn value_at(&self, p: Vec3) -> f64 {
        let (edges, [x, y, z]) = self.edges(p);
        trilinear(edges, [x.0, y.0, z.0])
    }

    /// Value and gradient (per mm) at a point.
    #[inline]
    pub fn at(&self, p: Vec3) -> (f64, Vec3) {
        let (edges, [(x, inx), (y, iny), (z, inz)]) = self.edges(p);
        let on = edges.map(|[a, b]| mix(a, b, x));
        let (front, back) = (mix(on[0], on[1], y), mix(on[2], on[3], y));
        let dx = edges.map(|[a, b]| b - a);
        let slope = [
            if inx { mix(mix(dx[0], dx[1], y), mix(dx[2], dx[3], y), z) / self.step[0] } else { 0.0 },
            if iny { mix(on[1] - on[0], on[3] - on[2], z) / self.step[1] } else { 0.0 },
            if inz { (back - front) / self.step[2] } else { 0.0 },
        ];
        (mix(front, back, z), slope)
    }

    /// Numbers given at points, put on grids over `bounds`, one for each of `N`: the mean of the nearest `neighbours`, weighted by one
    /// over the square of the distance (Shepard).
    ///
    /// # Errors
    /// No points; numbers or positions that are not finite.
    pub fn scattered<const N: usize>(
        points: &[Vec3],
        values: &[[f64; N]],
        neighbours: usize,
        bounds: &Aabb,
    ) -> Result<[Samples; N], Fault> {
        if points.is_empty() {
            return Err(Fault::new("path", "there are no points"));
        }
        let spread = points.iter().fold(*bounds, |b, p| b.with(*p)).size();
        let apart = (spread.iter().product::<f64>() / points.len() as f64).cbrt();
        let (step, shape) = grid(bounds, 0.5 * apart);
        let tree = NearestPoints::new(points);
        let wanted = neighbours.clamp(1, points.len());
        let at = |near: &mut Vec<(f64, u32)>, n: usize| {
            let index = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            tree.nearest(core::array::from_fn(|a| bounds.min[a] + step[a] * index[a] as f64), wanted, near);
            let least = 1e-24 * dot(spread, spread);
            let (mut sum, mut weights) = ([0.0; N], 0.0);
            for (d, n) in near.iter() {
                let w = 1.0 / d.max(least);
                sum.iter_mut().zip(&values[*n as usize]).for_each(|(s, v)| *s += w * v);
                weights += w;
            }
            sum.map(|s| s / weights)
        };
        use rayon::prelude::*;
        let all: Vec<[f64; N]> = (0..shape.iter().product()).into_par_iter().map_init(Vec::new, at).collect();
        let one = |c: usize| Samples::new(bounds.min, step, shape, all.iter().map(|v| v[c]).collect());
        let made = (0..N).map(one).collect::<Result<Vec<Samples>, Fault>>()?;
        made.try_into().map_err(|_| Fault::new("path", "there are no numbers"))
    }

    /// Numbers given at the points of a mesh of tetrahedra, put on a grid over `bounds`, linear in each tetrahedron: one
    /// grid for each of `values`, none if it has no node in the mesh. Beyond the mesh they are those of the nearest node in it.
    /// Also the fraction of the positions in `of` that lie beyond it by more than a step of the grid.
    ///
    /// # Errors
    /// No tetrahedra; numbers that are not finite.
    pub fn meshed(
        points: &[Vec3],
        tets: &[[u32; 4]],
        values: &[Vec<f64>],
        bounds: &Aabb,
        of: &[Vec3],
    ) -> Result<(Vec<Samples>, f64), Fault> {
        if tets.is_empty() {
            return Err(Fault::new("path", "the mesh has no cells of any volume"));
        }
        let corners = |t: &[u32; 4]| t.map(|i| points[i as usize]);
        // Two steps on an edge of a typical tetrahedron, a sixth of whose cube it is about.
        let volume = |p: &[Vec3; 4]| determinant(&[sub(p[1], p[0]), sub(p[2], p[0]), sub(p[3], p[0])]).abs() / 6.0;
        let mut sizes: Vec<f64> = tets.iter().map(|t| volume(&corners(t))).collect();
        sizes.sort_by(f64::total_cmp);
        let typical = (6.0 * sizes[sizes.len() / 2]).cbrt().max(1e-12);
        let longest = bounds.size().into_iter().fold(0.0, f64::max);
        let (step, shape) = grid(bounds, (0.5 * typical).min(longest / COARSEST));
        let count: usize = shape.iter().product();
        let mut out = vec![vec![f64::NAN; count]; values.len()];
        for t in tets {
            let p = corners(t);
            let six = determinant(&[sub(p[1], p[0]), sub(p[2], p[0]), sub(p[3], p[0])]);
            if six == 0.0 {
                continue;
            }
            let b = p.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
            let span = |a: usize| {
                let lo = ((b.min[a] - bounds.min[a]) / step[a] - 1e-9).ceil().max(0.0);
                let hi = ((b.max[a] - bounds.min[a]) / step[a] + 1e-9).floor().min((shape[a] - 1) as f64);
                (lo as usize, if hi < lo { 0 } else { hi as usize + 1 })
            };
            let [x, y, z] = [0, 1, 2].map(span);
            for k in z.0..z.1 {
                for j in y.0..y.1 {
                    for i in x.0..x.1 {
                        let q: Vec3 = core::array::from_fn(|a| bounds.min[a] + step[a] * [i, j, k][a] as f64);
                        let v = p.map(|p| sub(p, q));
                        let part = |a: usize, b: usize, c: usize| dot(v[a], cross(v[b], v[c]));
                        let w = [part(1, 2, 3), -part(0, 2, 3), part(0, 1, 3), -part(0, 1, 2)].map(|w| w / six);
                        if w.iter().all(|w| *w >= -1e-9) {
                            let n = (k * shape[1] + j) * shape[0] + i;
                            for (o, v) in out.iter_mut().zip(values) {
                                o[n] = (0..4).map(|c| w[c] * v[t[c] as usize]).sum();
                            }
                        }
                    }
                }
            }
        }
        let found: Vec<bool> = out[0].iter().map(|v| !v.is_nan()).collect();
        if !found.contains(&true) {
            return Ok((Vec::new(), 1.0));
        }
        // The lower corner of the grid's cell: on the upper faces of the bounds, of the last cells.
        let node = |p: &Vec3| -> [usize; 3] {
            let last = |a: usize| shape[a].saturating_sub(2) as f64;
            core::array::from_fn(|a| ((p[a] - bounds.min[a]) / step[a]).clamp(0.0, last(a)) as usize)
        };
        let missed = |p: &&Vec3| {
            let at = node(p);
            !(0..8).any(|d| {
                let [i, j, k] = core::array::from_fn(|a| (at[a] + (d >> a & 1)).min(shape[a] - 1));
                found[(k * shape[1] + j) * shape[0] + i]
            })
        };
        let share = of.iter().filter(missed).count() as f64 / of.len().max(1) as f64;
        spread(&mut out, &found, shape);
        let made = out.into_iter().map(|v| Samples::new(bounds.min, step, shape, v));
        Ok((made.collect::<Result<Vec<Samples>, Fault>>()?, share))
    }
}

#[inline]
fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

/// The number at fractions of a cell, by its edges along x.
#[inline]
fn trilinear(edges: [[f64; 2]; 4], [x, y, z]: [f64; 3]) -> f64 {
    let on = edges.map(|[a, b]| mix(a, b, x));
    mix(mix(on[0], on[1], y), mix(on[2], on[3], y), z)
}

impl Field for Samples {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.value_at(*p);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            (*v, *g) = self.at(*p);
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let mut range = [(0, 0); 3];
        for a in 0..3 {
            let at = |x: f64| self.interval(x, a).0 / BLOCK;
            // Infinite ends are clamped as all others.
            range[a] = (at(b.min[a]).min(self.blocks[a] - 1), at(b.max[a]).min(self.blocks[a] - 1));
        }
        let mut all = [f64::INFINITY, f64::NEG_INFINITY];
        for k in range[2].0..=range[2].1 {
            for j in range[1].0..=range[1].1 {
                for i in range[0].0..=range[0].1 {
                    let r = self.ranges[(k * self.blocks[1] + j) * self.blocks[0] + i];
                    all = [all[0].min(r[0]), all[1].max(r[1])];
                }
            }
        }
        // Rounded by the greatest number of the cells, however small those in the box are.
        let slack = 8.0 * f64::EPSILON * all[0].abs().max(all[1].abs());
        let [least, most] = self.range_in(b).unwrap_or(all);
        Interval::new(least - slack, most + slack)
    }
}

impl VaryingNumber for Samples {
    fn likely_extreme(&self, b: &Aabb) -> Vec3 {
        // The node next to the middle, if the box holds it.
        let middle = b.center();
        let node: Vec3 = core::array::from_fn(|a| {
            let last = (self.shape[a] - 1) as f64;
            let i = ((middle[a] - self.origin[a]) / self.step[a]).round().clamp(0.0, last);
            self.origin[a] + self.step[a] * i
        });
        if b.distance(node) == 0.0 { node } else { middle }
    }
}

/// Steps of about `h`, and nodes, over a box.
fn grid(bounds: &Aabb, h: f64) -> (Vec3, [usize; 3]) {
    let size = bounds.size();
    let least = (size.iter().product::<f64>() / NODES).cbrt();
    let h = h.max(least);
    let shape = size.map(|s| ((s / h).ceil() as usize).clamp(2, 4096) + 1);
    (core::array::from_fn(|a| size[a] / (shape[a] - 1) as f64), shape)
}

/// Gives nodes that have no value that of the nearest which has one, counted in steps.
fn spread(values: &mut [Vec<f64>], found: &[bool], shape: [usize; 3]) {
    let mut found = found.to_vec();
    let mut queue: VecDeque<usize> = (0..found.len()).filter(|&n| found[n]).collect();
    let strides = [1, shape[0], shape[0] * shape[1]];
    while let Some(n) = queue.pop_front() {
        let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
        for a in 0..3 {
            let below = (at[a] > 0).then(|| n - strides[a]);
            let above = (at[a] + 1 < shape[a]).then(|| n + strides[a]);
            for m in below.into_iter().chain(above) {
                if !core::mem::replace(&mut found[m], true) {
                    values.iter_mut().for_each(|v| v[m] = v[n]);
                    queue.push_back(m);
                }
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn positions(n: usize) -> impl Iterator<Item = Vec3> {
        (1..=n).map(|i| [0.8191725, 0.6710436, 0.5497005].map(|s| (s * i as f64).fract()))
    }

    fn linear([x, y, z]: Vec3) -> f64 {
        0.3 + 2.0 * x - y + 0.5 * z
    }

    const UNIT: Aabb = Aabb { min: [0.0; 3], max: [1.0; 3] };

    #[test]
    fn straight_fields_are_met_between_nodes_and_held_beyond() {
        let shape = [6, 9, 11];
        let step = [0.2, 0.125, 0.1];
        let values =
            (0..6 * 9 * 11).map(|n| linear([0.2 * (n % 6) as f64, 0.125 * (n / 6 % 9) as f64, 0.1 * (n / 54) as f64]));
        let s = Samples::new([0.0; 3], step, shape, values.collect()).unwrap();
        for p in positions(500) {
            let p = p.map(|v| 1.6 * v - 0.3);
            let held = p.map(|v| v.clamp(0.0, 1.0));
            let (v, g) = s.at(p);
            assert!((v - linear(held)).abs() < 1e-13);
            for a in 0..3 {
                let want = if held[a] == p[a] { [2.0, -1.0, 0.5][a] } else { 0.0 };
                assert!((g[a] - want).abs() < 1e-12);
            }
            let b = Aabb { min: p, max: p.map(|v| v + 0.17) };
            let bound = s.bound(&b);
            for q in positions(20) {
                let v = s.at(core::array::from_fn(|a| p[a] + 0.17 * q[a])).0;
                assert!(bound.lo <= v && v <= bound.hi);
            }
        }
        let all = s.bound(&Aabb::ALL);
        assert!((all.lo - (-0.7)).abs() < 1e-12 && (all.hi - 2.8).abs() < 1e-12);
        assert!(Samples::new([0.0; 3], step, [6, 9, 10], vec![0.0; 594]).is_err());
        let f = Samples::new([0.0; 3], step, [2, 2, 1], vec![0.0, 1.0, f64::NAN, 2.0]).err().unwrap();
        assert!(f.message.contains("(0, 1, 0)"), "{f}");
    }

    #[test]
    fn a_mesh_gives_its_field_and_the_share_it_misses() {
        // A box of hexahedra's tetrahedra on [0, 0.8] × [0, 1]².
        let n = 5usize;
        let node = |i: usize| [0.2 * (i % n) as f64, 0.25 * (i / n % n) as f64, 0.25 * (i / n / n) as f64];
        let points: Vec<Vec3> = (0..n * n * n).map(node).collect();
        let mut tets = Vec::new();
        for c in 0..64 {
            let base = c % 4 + c / 4 % 4 * n + c / 16 * n * n;
            let v = [0, 1, 1 + n, n, n * n, n * n + 1, n * n + n + 1, n * n + n].map(|d| (base + d) as u32);
            for t in [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]] {
                tets.push(t.map(|i: usize| v[i]));
            }
        }
        let values = vec![points.iter().map(|p| linear(*p)).collect::<Vec<f64>>()];
        let inside: Vec<Vec3> = positions(2000).collect();
        let (made, share) = Samples::meshed(&points, &tets, &values, &UNIT, &inside).unwrap();
        // A fifth less about a step.
        assert!((0.05..0.2).contains(&share), "{share}");
        for p in positions(500).filter(|p| p[0] < 0.7) {
            assert!((made[0].at(p).0 - linear(p)).abs() < 1e-12);
        }
        assert!((made[0].at([1.0, 0.5, 0.5]).0 - linear([0.8, 0.5, 0.5])).abs() < 0.4);
        let far = Aabb { min: [5.0; 3], max: [6.0; 3] };
        let (none, all) = Samples::meshed(&points, &tets, &values, &far, &inside).unwrap();
        assert!(none.is_empty() && all == 1.0);
    }

    #[test]
    fn scattered_points_are_met_and_nothing_overshoots() {
        let points: Vec<Vec3> = positions(300).collect();
        let values: Vec<[f64; 2]> = points.iter().map(|p| [linear(*p), -2.0 * linear(*p)]).collect();
        let [s, other] = Samples::scattered(&points, &values, 8, &UNIT).unwrap();
        let worst = positions(900).skip(300).fold(0.0f64, |m, p| m.max((s.at(p).0 - linear(p)).abs()));
        // A field of slope 2.3 over points 0.15 apart; corners have theirs on one side.
        assert!(worst < 0.45, "{worst}");
        let mean = positions(900).skip(300).map(|p| s.at(p).0 - linear(p)).sum::<f64>() / 600.0;
        assert!(mean.abs() < 0.02, "{mean}");
        let all = s.bound(&Aabb::ALL);
        let given = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), [v, _]| (a.min(*v), b.max(*v)));
        assert!(positions(99).all(|p| other.at(p).0 == -2.0 * s.at(p).0));
        assert!(all.lo >= given.0 - 1e-12 && all.hi <= given.1 + 1e-12);
        let [one] = Samples::scattered(&[[3.0, 0.0, 0.0]], &[[7.0]], 8, &UNIT).unwrap();
        assert_eq!(one.at([0.3; 3]).0, 7.0);
    }
}
