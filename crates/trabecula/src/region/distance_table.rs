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
    /// Number of the cell along x; not a number outside the region's bounds.
    number: f64,
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

    /// A coordinate in cells.
    #[inline]
    fn along(&self, axis: usize, x: f64) -> f64 {
        (x - self.bounds.min[axis]) / self.step
    }

    /// The cell of a point, if it is interpolated there.
    #[inline]
    fn cell(&self, p: Vec3) -> Option<InCell<'_>> {
        if self.range.hi <= 0.0 && (0..3).any(|a| p[a] < self.bounds.min[a] || p[a] > self.bounds.max[a]) {
            return Some(InCell { nodes: &OUTSIDE, first: 0, number: f64::NAN, at: [0.0; 3] });
        }
        let (mut brick, mut cell, mut at) = ([0; 3], [0; 3], [0.0; 3]);
        for a in 0..3 {
            let u = self.along(a, p[a]);
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
        let number = (brick[0] * CELLS + cell[0]) as f64;
        interpolated.then(|| InCell { nodes: &made.nodes, first: node(cell), number, at })
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
                let here = InCell { nodes: &nodes, first: node(cell), number: 0.0, at }.gradient(self.step).0;
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
        let mut line = CellLine::NONE;
        for (n, (p, o)) in points.iter().zip(out.iter_mut()).enumerate() {
            let x = self.along(0, p[0]) - line.cell;
            if p[1..] == line.yz && (0.0..1.0).contains(&x) && p[0] <= self.bounds.max[0] {
                *o = line.value(x);
                continue;
            }
            match self.cell(*p) {
                Some(cell) => {
                    line = CellLine { yz: [p[1], p[2]], cell: cell.number, ends: cell.line() };
                    *o = line.value(cell.at[0]);
                }
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

/// Numbers at a place between two whose numbers are these, at a share `t` of the way along an axis: Σ wᵢ (dᵢ + ½ ∇dᵢ · (x − xᵢ))
/// is linear interpolation of all numbers, and for the distance t (1 − t) times the difference of its slopes besides. Axis by
/// axis it is the sum over the corners of a cell.
#[inline(always)]
fn between(axis: usize, t: f64, a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    let mut sum = *a;
    for i in 0..4 {
        sum[i] += t * (b[i] - a[i]);
    }
    sum[0] += t * (1.0 - t) * (a[1 + axis] - b[1 + axis]);
    sum
}

/// How fast these numbers change with `t`.
#[inline(always)]
fn change(axis: usize, t: f64, a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    let mut slope = *b;
    for i in 0..4 {
        slope[i] -= a[i];
    }
    slope[0] += (1.0 - 2.0 * t) * (a[1 + axis] - b[1 + axis]);
    slope
}

impl InCell<'_> {
    #[inline(always)]
    fn node(&self, x: usize, y: usize, z: usize) -> &[f64; 4] {
        &self.nodes[self.first + node([x, y, z])]
    }

    /// The numbers at both ends of the line along x through the point.
    #[inline]
    fn line(&self) -> [[f64; 4]; 2] {
        let [_, y, z] = self.at;
        let mut ends = [[0.0; 4]; 2];
        for (x, end) in ends.iter_mut().enumerate() {
            let near = between(2, z, self.node(x, 0, 0), self.node(x, 0, 1));
            let far = between(2, z, self.node(x, 1, 0), self.node(x, 1, 1));
            *end = between(1, y, &near, &far);
        }
        ends
    }

    /// The value and its gradient, per mm.
    #[inline]
    fn gradient(&self, step: f64) -> (f64, Vec3) {
        let [x, y, z] = self.at;
        // At both ends of the line along x: the numbers, and how they change along y and z.
        let (mut ends, mut along_y, mut along_z) = ([[0.0; 4]; 2], [[0.0; 4]; 2], [[0.0; 4]; 2]);
        for i in 0..2 {
            let [a, b] = [self.node(i, 0, 0), self.node(i, 0, 1)];
            let [c, d] = [self.node(i, 1, 0), self.node(i, 1, 1)];
            let (near, far) = (between(2, z, a, b), between(2, z, c, d));
            ends[i] = between(1, y, &near, &far);
            along_y[i] = change(1, y, &near, &far);
            along_z[i] = between(1, y, &change(2, z, a, b), &change(2, z, c, d));
        }
        let [[a, b], [ay, by], [az, bz]] = [ends, along_y, along_z];
        let slope = [change(0, x, &a, &b)[0], between(0, x, &ay, &by)[0], between(0, x, &az, &bz)[0]];
        (between(0, x, &a, &b)[0], [slope[0] / step, slope[1] / step, slope[2] / step])
    }
}

/// A line along x through a cell: points that follow each other on it share all but the last step.
struct CellLine {
    yz: [f64; 2],
    /// Number of the cell along x; not a number for none.
    cell: f64,
    ends: [[f64; 4]; 2],
}

impl CellLine {
    const NONE: CellLine = CellLine { yz: [0.0; 2], cell: f64::NAN, ends: [[0.0; 4]; 2] };

    /// The value at a share of the cell.
    #[inline]
    fn value(&self, x: f64) -> f64 {
        between(0, x, &self.ends[0], &self.ends[1])[0]
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
