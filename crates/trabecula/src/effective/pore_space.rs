//! The pore of a periodic cell on a cubic grid: nodes, the distances of walls along links, the area of the wall.

use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, apply, determinant, inverse, product, transpose};
use geometry::progress::{Progress, Stage, Stopped};
use geometry::roots::{Bracket, FalsePosition};
use geometry::tetmesh::cut_area;
use homogenise::{PoreGrid, VELOCITIES, WallLink, upper_edges};
use rayon::prelude::*;

use crate::csg_tree::CsgSolid;
use crate::field::Field;

/// Steps of a root search: it ends much sooner, when a wall is known to a billionth of a link.
const STEPS: usize = 40;
/// Steps from a wall within which there is no node of the pore.
const NEAR: f64 = 0.02;
/// Values of opposite corners that differ by no more, relative to the largest, are the same.
const SAME: f64 = 1e-7;

/// A cubic grid that repeats with a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicGrid {
    /// The edges of the cell in steps, as the columns (nx, 0, 0), (s, ny, 0), (t, u, nz).
    pub shape: [usize; 3],
    /// The numbers s, t, u.
    pub lean: [i64; 3],
    /// The step, mm.
    pub step: f64,
    /// The axes of the grid, as columns in the world's.
    pub axes: Mat3,
    /// How far the cell had to be strained to be whole numbers of steps.
    pub strain: f64,
}

impl CubicGrid {
    /// The grid for a cell with these edges (mm, columns) that has about `n` steps along the edge of a cube of its volume, and strains it least.
    pub fn near(edges: &Mat3, n: usize) -> CubicGrid {
        let (axes, upper) = upper_edges(edges);
        let mean = determinant(edges).abs().cbrt();
        if (0..9).all(|i| (upper[i / 3][i % 3] - if i / 3 == i % 3 { mean } else { 0.0 }).abs() <= 1e-9 * mean) {
            return CubicGrid { shape: [n; 3], lean: [0; 3], step: mean / n as f64, axes, strain: 0.0 };
        }
        let wanted = n as f64 * upper[0][0] / mean;
        let (low, high) = ((0.85 * wanted).floor().max(4.0) as usize, (1.15 * wanted).ceil().max(4.0) as usize);
        let best = (low..=high).map(|first| {
            let whole = upper.map(|row| row.map(|v| (v * first as f64 / upper[0][0]).round()));
            let shape = [0, 1, 2].map(|i| whole[i][i].max(4.0));
            let mut whole = whole;
            (0..3).for_each(|i| whole[i][i] = shape[i]);
            let step = mean / shape.iter().product::<f64>().cbrt();
            let change = product(&whole.map(|row| row.map(|v| v * step)), &inverse(&upper));
            let off = |i: usize| change[i / 3][i % 3] - if i / 3 == i % 3 { 1.0 } else { 0.0 };
            let strain = (0..9).map(off).map(f64::abs).fold(0.0, f64::max);
            // Grids of a half and a quarter of the steps should have the same proportions.
            let odd = if whole.iter().flatten().any(|v| v % 4.0 != 0.0) { 2e-3 } else { 0.0 };
            let far = 0.02 * (first as f64 / wanted - 1.0).abs();
            let grid = CubicGrid {
                shape: shape.map(|v| v as usize),
                lean: [whole[0][1] as i64, whole[0][2] as i64, whole[1][2] as i64],
                step,
                axes,
                strain: if strain < 1e-9 { 0.0 } else { strain },
            };
            (grid, strain + odd + far)
        });
        let best = best.min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or_else(
            || CubicGrid { shape: [n; 3], lean: [0; 3], step: mean / n as f64, axes, strain: 1.0 },
            |b| b.0,
        )
    }

    /// The grid of as many times fewer steps; `None` if these are no whole numbers.
    pub fn coarser(&self, by: usize) -> Option<CubicGrid> {
        let whole = self.shape.iter().all(|n| n % by == 0) && self.lean.iter().all(|n| n % by as i64 == 0);
        whole.then(|| CubicGrid {
            shape: self.shape.map(|n| n / by),
            lean: self.lean.map(|n| n / by as i64),
            step: self.step * by as f64,
            ..self.clone()
        })
    }

    /// The tensor in the world's axes, mm², of one in the grid's, steps squared.
    pub fn to_world(&self, k: &Mat3) -> Mat3 {
        let turned = product(&product(&self.axes, k), &transpose(&self.axes));
        turned.map(|row| row.map(|v| v * self.step * self.step))
    }

    /// The edges of the cell in steps, as columns.
    fn edges(&self) -> Mat3 {
        let ([nx, ny, nz], [s, t, u]) = (self.shape.map(|n| n as f64), self.lean.map(|n| n as f64));
        [[nx, s, t], [0.0, ny, u], [0.0, 0.0, nz]]
    }

    /// The place of a node, or of a point on a link from it, in coordinates of the cell, 0 to 1.
    fn place(&self, back: &Mat3, node: usize, velocity: usize, along: f64) -> Vec3 {
        let [nx, ny, _] = self.shape;
        let at = [node % nx, node / nx % ny, node / nx / ny];
        let at = [0, 1, 2].map(|a| at[a] as f64 + 0.5 + along * f64::from(VELOCITIES[velocity][a]));
        apply(back, at).map(|v| v - v.floor())
    }
}

/// The pore of a cell on a grid.
pub struct PoreSpace {
    /// Its nodes and walls.
    pub grid: PoreGrid,
    /// Area of the wall, mm².
    pub area: f64,
    /// Whether a cyclic change of the axes changes nothing.
    pub cyclic: bool,
}

impl PoreSpace {
    /// The nodes at which one of the solids is empty: each solid has a pore of its own, and pores of different ones do not connect.
    ///
    /// # Errors
    /// An interruption; a grid of which something does not fit together.
    pub fn new(solids: &[CsgSolid], grid: &CubicGrid, progress: &dyn Progress) -> Result<PoreSpace, Stopped> {
        let count: usize = grid.shape.iter().product();
        let (mut inside, mut walls) = (vec![false; count], Vec::new());
        let (mut area, mut cyclic) = (0.0, grid.lean == [0; 3] && grid.shape.iter().all(|n| *n == grid.shape[0]));
        for (n, solid) in solids.iter().enumerate() {
            let share = |at: f64| (n as f64 + at) / solids.len() as f64;
            let whole = |from, to| Stage { whole: progress, from: share(from), to: share(to) };
            let values = sampled(solid, grid, &whole(0.0, 0.3))?;
            let alone = open(grid, &values).map_err(Stopped::Refused)?;
            walls.extend(crossings(solid, grid, &alone, &values, &whole(0.3, 0.9))?);
            area += zero_area(grid, &alone, &values);
            cyclic = cyclic && is_cyclic(grid.shape[0], &values);
            inside.iter_mut().zip(&alone.pore).for_each(|(i, p)| *i |= p);
            if !whole(0.9, 1.0).step(1, 1) {
                return Err(Stopped::Interrupted);
            }
        }
        walls.sort_by_key(|w| (w.node, w.velocity));
        walls.dedup_by_key(|w| (w.node, w.velocity));
        let grid = PoreGrid::new(grid.shape, grid.lean, inside, walls).map_err(Stopped::Refused)?;
        Ok(PoreSpace { grid, area, cyclic })
    }
}

/// The pore of one solid, without its walls. A node nearer to a wall than a fiftieth of a step is left to the solid: where all its links are
/// cut at once flow becomes steady slowly.
fn open(grid: &CubicGrid, values: &[f64]) -> Result<PoreGrid, Fault> {
    let all = PoreGrid::new(grid.shape, grid.lean, vec![true; values.len()], Vec::new())?;
    let is_open = |node: usize| {
        let rise = |q: usize| (values[all.neighbour(node, q).0] - values[node]).abs();
        values[node] > 0.0 && (1..=6).map(rise).fold(0.0, f64::max) * NEAR < values[node]
    };
    let inside = (0..values.len()).into_par_iter().map(is_open).collect();
    PoreGrid::new(grid.shape, grid.lean, inside, Vec::new())
}

/// The area of the walls of some solids, mm².
///
/// # Errors
/// An interruption.
pub fn wall_area(solids: &[CsgSolid], grid: &CubicGrid, progress: &dyn Progress) -> Result<f64, Stopped> {
    let mut area = 0.0;
    for solid in solids {
        let values = sampled(solid, grid, progress)?;
        let alone = PoreGrid::new(grid.shape, grid.lean, vec![true; values.len()], Vec::new());
        area += zero_area(grid, &alone.map_err(Stopped::Refused)?, &values);
    }
    Ok(area)
}

/// The values of a solid at the nodes.
fn sampled(solid: &CsgSolid, grid: &CubicGrid, progress: &dyn Progress) -> Result<Vec<f64>, Stopped> {
    let [nx, ny, nz] = grid.shape;
    let back = inverse(&grid.edges());
    let mut values = vec![0.0; nx * ny * nz];
    values.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let points: Vec<Vec3> = (0..nx).map(|x| grid.place(&back, row * nx + x, 0, 0.0)).collect();
        solid.values(&points, out);
    });
    if progress.step(1, 1) { Ok(values) } else { Err(Stopped::Interrupted) }
}

/// Where the solid begins on each link that leaves its pore: by the method of false position.
fn crossings(
    solid: &CsgSolid,
    grid: &CubicGrid,
    alone: &PoreGrid,
    values: &[f64],
    progress: &dyn Progress,
) -> Result<Vec<WallLink>, Stopped> {
    let [nx, ny, nz] = grid.shape;
    let back = inverse(&grid.edges());
    let each: Vec<Vec<WallLink>> = (0..nz)
        .into_par_iter()
        .map(|z| {
            let mut links: Vec<(usize, usize, FalsePosition)> = Vec::new();
            for node in (z * nx * ny..(z + 1) * nx * ny).filter(|i| alone.pore[*i]) {
                for velocity in 1..VELOCITIES.len() {
                    let (to, _) = alone.neighbour(node, velocity);
                    if !alone.pore[to] {
                        let bracket = Bracket { below: [1.0, values[to].min(0.0)], above: [0.0, values[node]] };
                        links.push((node, velocity, FalsePosition::new(bracket)));
                    }
                }
            }
            let mut found = vec![0.0; links.len()];
            for _ in 0..STEPS {
                let points: Vec<Vec3> = links.iter().map(|(n, q, l)| grid.place(&back, *n, *q, l.guess())).collect();
                solid.values(&points, &mut found);
                let mut open = false;
                for ((_, _, link), value) in links.iter_mut().zip(&found) {
                    link.narrow(link.guess(), *value);
                    open |= link.bracket().width() > 1e-9 && *value != 0.0;
                }
                if !open {
                    break;
                }
            }
            let wall = |(node, velocity, link): (usize, usize, FalsePosition)| {
                let bracket = link.bracket();
                let at = if bracket.below[1] == 0.0 { bracket.below[0] } else { bracket.middle() };
                WallLink { node, velocity, distance: at.clamp(1e-9, 1.0) }
            };
            links.into_iter().map(wall).collect()
        })
        .collect();
    if !progress.step(1, 1) {
        return Err(Stopped::Interrupted);
    }
    Ok(each.into_iter().flatten().collect())
}

/// Whether values are the same after a cyclic change of the axes.
fn is_cyclic(n: usize, values: &[f64]) -> bool {
    let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let at = |x: usize, y: usize, z: usize| values[(z * n + y) * n + x];
    (0..n).all(|z| (0..n).all(|y| (0..n).all(|x| (at(x, y, z) - at(y, z, x)).abs() <= SAME * largest)))
}

/// The area of the zero set, mm²: the planes of the values at the corners of six tetrahedra in each cube of nodes.
fn zero_area(grid: &CubicGrid, alone: &PoreGrid, values: &[f64]) -> f64 {
    // The paths from one corner of a cube to the opposite one along its edges; each is a tetrahedron.
    const PATHS: [[usize; 3]; 6] = [[1, 2, 4], [1, 4, 2], [2, 1, 4], [2, 4, 1], [4, 1, 2], [4, 2, 1]];
    let corner = |i: usize| [0, 1, 2].map(|a| (i >> a & 1) as f64);
    let step = |bits: usize| match bits {
        1 => 1,
        2 => 3,
        _ => 5,
    };
    let [nx, ny, nz] = grid.shape;
    let each: Vec<f64> = (0..nz)
        .into_par_iter()
        .map(|z| {
            let mut sum = 0.0;
            for node in z * nx * ny..(z + 1) * nx * ny {
                let mut at = [0.0; 8];
                for (i, v) in at.iter_mut().enumerate() {
                    let mut to = node;
                    for bit in [1, 2, 4].into_iter().filter(|b| i & b != 0) {
                        to = alone.neighbour(to, step(bit)).0;
                    }
                    *v = values[to];
                }
                if at.iter().all(|v| *v > 0.0) || at.iter().all(|v| *v <= 0.0) {
                    continue;
                }
                for path in PATHS {
                    let names = [0, path[0], path[0] | path[1], 7];
                    sum += cut_area(names.map(corner), names.map(|i| at[i]));
                }
            }
            sum
        })
        .collect();
    each.into_iter().sum::<f64>() * grid.step * grid.step
}
