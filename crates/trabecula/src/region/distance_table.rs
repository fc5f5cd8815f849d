//! A table of a region's signed distance: exact values and gradients at the nodes of a coarse grid, interpolated between them.
//!
//! For what depends on depth, not for surfaces. Each node carries the distance d and its gradient, and a point has
//! Σ wᵢ (dᵢ + ½ ∇dᵢ · (x − xᵢ)) with the trilinear weights wᵢ: continuous, and exact wherever the distance is quadratic. Every
//! cell is tested; where the interpolated distance is not within `TOLERANCE` of a cell (near medial surfaces), and outside
//! the grid, distances are the exact ones. A value depends on the point alone.
//!
//! A test is no proof, but something that it misses is small: the distance to any set is semiconcave, D²d ≤ 1/d, so that where
//! the least distance in a cell of edge h is d, what hides between its nodes is at most 3h²/8d.

use std::sync::OnceLock;

use super::Region;
use crate::field::Field;
use geometry::math::{Aabb, Interval, Vec3};

/// The greatest error at the tested points, as a share of a cell's edge.
const TOLERANCE: f64 = 1e-2;
/// Nodes of the grid: enough that interpolation holds in most cells, few enough for any memory.
const NODES: f64 = 5e5;
/// Most nodes along an axis.
const MOST: f64 = 2000.0;
/// Cells along the edge of a brick, which is made when first asked for.
const CELLS: usize = 4;
const PLANES: usize = CELLS + 1;
/// Where a cell is tested, as shares of its edges: off its centre, where odd terms cancel.
const TESTED: [Vec3; 2] = [[0.25; 3], [0.75; 3]];

/// The table.
pub struct DistanceTable {
    of: Region,
    /// Distances that matter: any other may stand for another one beyond the same end.
    range: Interval,
    /// Those of the region. The first node is their lower corner.
    bounds: Aabb,
    /// Edge of a cell, mm.
    step: f64,
    bricks: [usize; 3],
    made: Vec<OnceLock<Box<Brick>>>,
}

/// A part of the table.
struct Brick {
    /// Distance (mm) and half its gradient times a cell's edge at the nodes, x fastest; empty if no cell is interpolated.
    nodes: Vec<[f64; 4]>,
    /// Whether each cell is interpolated.
    interpolated: [bool; CELLS * CELLS * CELLS],
}

/// The nodes of a cell outside the region's bounds, where distances beyond the surface do not matter.
static OUTSIDE: [[f64; 4]; node([1; 3]) + 1] = [[0.0; 4]; node([1; 3]) + 1];

/// A point in its cell.
struct InCell<'a> {
    nodes: &'a [[f64; 4]],
    first: usize,
    /// Position in the cell as shares of its edges.
    at: Vec3,
}

impl DistanceTable {
    /// The table of a bounded region, of which distances in `range` (mm) matter.
    pub fn new(of: Region, range: Interval) -> DistanceTable {
        let bounds = of.bounds();
        let size = bounds.size();
        let longest = size.iter().fold(0.0f64, |m, s| m.max(*s));
        let step = (size.iter().product::<f64>() / NODES).cbrt().max(longest / MOST);
        let bricks = size.map(|s| (s / (step * CELLS as f64)).ceil().max(1.0) as usize);
        let made = (0..bricks.iter().product()).map(|_| OnceLock::new()).collect();
        DistanceTable { of, range, bounds, step, bricks, made }
    }

    /// The cell of a point, if it is interpolated there.
    #[inline]
    fn cell(&self, p: Vec3) -> Option<InCell<'_>> {
        if self.range.hi <= 0.0 && (0..3).any(|a| p[a] < self.bounds.min[a] || p[a] > self.bounds.max[a]) {
            return Some(InCell { nodes: &OUTSIDE, first: 0, at: [0.0; 3] });
        }
        let (mut brick, mut cell, mut at) = ([0; 3], [0; 3], [0.0; 3]);
        for a in 0..3 {
            let u = (p[a] - self.bounds.min[a]) / self.step;
            // Neither is NaN.
            if !(u >= 0.0 && u < (self.bricks[a] * CELLS) as f64) {
                return None;
            }
            let whole = u as usize;
            (brick[a], cell[a], at[a]) = (whole / CELLS, whole % CELLS, u - whole as f64);
        }
        let index = brick[0] + self.bricks[0] * (brick[1] + self.bricks[1] * brick[2]);
        let made = self.made[index].get_or_init(|| Box::new(self.brick(brick)));
        let interpolated = made.interpolated[cell[0] + CELLS * (cell[1] + CELLS * cell[2])];
        interpolated.then(|| InCell { nodes: &made.nodes, first: node(cell), at })
    }

    fn brick(&self, brick: [usize; 3]) -> Brick {
        let coordinate = |a: usize, u: f64| self.bounds.min[a] + (brick[a] as f64 * CELLS as f64 + u) * self.step;
        let position = |u: Vec3| [0, 1, 2].map(|a| coordinate(a, u[a]));
        let mut interpolated = [false; CELLS * CELLS * CELLS];
        let bounds = Aabb { min: position([0.0; 3]), max: position([CELLS as f64; 3]) };
        let all = self.of.bound(&bounds);
        if all.lo >= self.range.hi || all.hi <= self.range.lo {
            let nodes = vec![[all.lo.max(self.range.lo), 0.0, 0.0, 0.0]; PLANES * PLANES * PLANES];
            return Brick { nodes, interpolated: [true; CELLS * CELLS * CELLS] };
        }
        let points: Vec<Vec3> = each(PLANES).map(|n| position(n.map(|i| i as f64))).collect();
        let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        self.of.gradients(&points, &mut values, &mut gradients);
        let half = 0.5 * self.step;
        let nodes: Vec<[f64; 4]> =
            values.iter().zip(&gradients).map(|(d, g)| [*d, half * g[0], half * g[1], half * g[2]]).collect();
        let tested: Vec<Vec3> =
            each(CELLS).flat_map(|c| TESTED.map(|t| position([0, 1, 2].map(|a| c[a] as f64 + t[a])))).collect();
        let mut exact = vec![0.0; tested.len()];
        self.of.values(&tested, &mut exact);
        for ((good, cell), exact) in interpolated.iter_mut().zip(each(CELLS)).zip(exact.chunks_exact(TESTED.len())) {
            let near = |(at, exact): (Vec3, &f64)| {
                let here = InCell { nodes: &nodes, first: node(cell), at }.value();
                (self.clamped(here) - self.clamped(*exact)).abs() <= TOLERANCE * self.step
            };
            *good = TESTED.into_iter().zip(exact).all(near);
        }
        Brick { nodes, interpolated }
    }

    fn clamped(&self, d: f64) -> f64 {
        d.clamp(self.range.lo, self.range.hi)
    }
}

/// Signed distances, mm.
impl Field for DistanceTable {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut rest, mut at) = (Vec::new(), Vec::new());
        for (n, (p, o)) in points.iter().zip(out.iter_mut()).enumerate() {
            match self.cell(*p) {
                Some(cell) => *o = cell.value(),
                None => {
                    rest.push(*p);
                    at.push(n);
                }
            }
        }
        let mut exact = vec![0.0; rest.len()];
        self.of.values(&rest, &mut exact);
        for (n, d) in at.into_iter().zip(exact) {
            out[n] = d;
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut rest, mut at) = (Vec::new(), Vec::new());
        for (n, p) in points.iter().enumerate() {
            match self.cell(*p) {
                Some(cell) => (values[n], gradients[n]) = cell.gradient(self.step),
                None => {
                    rest.push(*p);
                    at.push(n);
                }
            }
        }
        let (mut exact, mut slopes) = (vec![0.0; rest.len()], vec![[0.0; 3]; rest.len()]);
        self.of.gradients(&rest, &mut exact, &mut slopes);
        for (n, exact) in at.into_iter().zip(exact.into_iter().zip(slopes)) {
            (values[n], gradients[n]) = exact;
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        // An interpolated distance and the exact one change by at most |x − xᵢ| from a node xᵢ on, the former by half of that again.
        let error = 1.5 * 0.75f64.sqrt() * self.step;
        self.of.bound(b) + Interval::new(-error, error)
    }
}

/// The positions of a cube of `n`³, x fastest.
fn each(n: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..n * n * n).map(move |i| [i % n, i / n % n, i / (n * n)])
}

/// The index of a node in its brick.
#[inline]
const fn node([i, j, k]: [usize; 3]) -> usize {
    i + PLANES * (j + PLANES * k)
}

impl InCell<'_> {
    /// Corner i (bit a: whether it is at the far end of axis a): its numbers, and the way from it to the point.
    #[inline(always)]
    fn corner(&self, i: usize) -> ([f64; 4], Vec3) {
        let far = [0, 1, 2].map(|a| i >> a & 1);
        (self.nodes[self.first + node(far)], [0, 1, 2].map(|a| self.at[a] - far[a] as f64))
    }

    #[inline]
    fn value(&self) -> f64 {
        let mut sum = 0.0;
        for i in 0..8 {
            let ([d, gx, gy, gz], [x, y, z]) = self.corner(i);
            let weight = (1.0 - x.abs()) * (1.0 - y.abs()) * (1.0 - z.abs());
            sum += weight * (d + gx * x + gy * y + gz * z);
        }
        sum
    }

    /// The value and its gradient, per mm.
    #[inline]
    fn gradient(&self, step: f64) -> (f64, Vec3) {
        let (mut sum, mut slope) = (0.0, [0.0; 3]);
        for i in 0..8 {
            let ([d, gx, gy, gz], r) = self.corner(i);
            let value = d + gx * r[0] + gy * r[1] + gz * r[2];
            let [x, y, z] = r.map(|r| 1.0 - r.abs());
            // The weight of a far corner grows along its axis, that of a near one falls.
            let up = [0, 1, 2].map(|a| if i >> a & 1 == 1 { value } else { -value });
            sum += x * y * z * value;
            slope[0] += y * z * (up[0] + x * gx);
            slope[1] += z * x * (up[1] + y * gy);
            slope[2] += x * y * (up[2] + z * gz);
        }
        (sum, slope.map(|s| s / step))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::region::{Cuboid, Sphere};
    use geometry::math::{add, scale, sub};
    use geometry::random::random;

    fn points(b: &Aabb, n: usize) -> Vec<Vec3> {
        let mut seed = 7;
        let half = scale(b.size(), 0.5);
        (0..n).map(|_| add(b.center(), half.map(|h| h * random(&mut seed)))).collect()
    }

    #[test]
    fn distances_agree_with_the_exact_ones() {
        let regions: [Region; 2] = [
            Arc::new(Sphere::new([1.0, 2.0, 3.0], 6.0).expect("valid")),
            Arc::new(Cuboid::new([0.0; 3], [12.0, 9.0, 7.0]).expect("valid")),
        ];
        for region in regions {
            let table = DistanceTable::new(region.clone(), Interval::new(-3.0, 0.0));
            let points = points(&region.bounds(), 4000);
            let (mut values, mut found) = (vec![0.0; 4000], vec![0.0; 4000]);
            let mut gradients = vec![[0.0; 3]; 4000];
            table.values(&points, &mut values);
            table.gradients(&points, &mut found, &mut gradients);
            let mut interpolated = 0;
            for (n, p) in points.iter().enumerate() {
                let exact = region.value(*p);
                // The distance to a corner that is not tested is at most seven times that to the tested ones.
                let error = (table.clamped(values[n]) - table.clamped(exact)).abs();
                assert!(error <= 8.0 * TOLERANCE * table.step, "{error} at {p:?}");
                assert!((values[n] - found[n]).abs() < 1e-12);
                let inside = table.cell(*p).is_some() && exact > -2.9;
                interpolated += usize::from(inside);
                let h = 1e-6 * table.step;
                let mut ends = [add(*p, [h, 0.0, 0.0]), sub(*p, [h, 0.0, 0.0])];
                ends.sort_by(|a, b| b[0].total_cmp(&a[0]));
                let same = ends
                    .iter()
                    .all(|e| table.cell(*e).is_some_and(|c| c.first == table.cell(*p).map_or(0, |c| c.first)));
                if inside && same {
                    let mut v = [0.0; 2];
                    table.values(&ends, &mut v);
                    assert!(((v[0] - v[1]) / (2.0 * h) - gradients[n][0]).abs() < 1e-6, "{:?}", gradients[n]);
                }
            }
            assert!(interpolated > 1000, "{interpolated}");
        }
    }
}
