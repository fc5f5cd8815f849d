//! The sampling grid of a layer: blocks of square cells in a plane, those that bounds dismiss left out.
//!
//! Points of the grid and of its refinements have whole numbers for coordinates, in units of a 64th of a cell, so that
//! whatever cells share is found by number and never by comparing positions.

use std::sync::Arc;

use crate::csg_tree::{CsgTree, Sign};
use crate::field::Block;
use crate::implicit::{Surface, SurfacePair};
use geometry::fault::Fault;
use geometry::layer::Point;
use geometry::math::{Aabb, Vec3};
use rayon::prelude::*;

/// Cells along the edge of a block: the first size with which no block has more live surfaces than a word has bits.
const BLOCKS: [usize; 4] = [40, 20, 10, 5];
/// Most live surfaces of a block.
const MOST_LIVE: usize = 64;
/// Units along the edge of a cell.
pub(super) const FINE: u32 = 64;

/// A grid node or a node of a refined cell, in units of the grid.
pub(super) type PlaneNode = [u32; 2];

/// The grid, the same for all layers.
pub(super) struct PlaneGrid {
    /// The position of node (0, 0), mm.
    pub origin: Point,
    /// Edge of a cell, mm.
    pub step: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Cells along the edge of a block.
    pub block: usize,
}

impl PlaneGrid {
    /// A grid over the bounds of a region, with a margin of at least half a cell.
    ///
    /// # Errors
    /// More surfaces that meet in a few cells than are possible, at `step`.
    pub fn new(bounds: &Aabb, step: f64, surfaces: &[Surface]) -> Result<PlaneGrid, Fault> {
        let origin = [0, 1].map(|axis| {
            let planes = surfaces.iter().filter_map(|s| s.plane).filter(|p| p.axis == axis).map(|p| p.at);
            let planes: Vec<f64> = planes.chain([bounds.min[axis], bounds.max[axis]]).collect();
            // Faces normal to an axis are best placed off the grid lines.
            let clearance = |origin: f64| {
                let phase = planes.iter().map(|p| ((p - origin) / step).rem_euclid(1.0));
                phase.map(|t| t.min(1.0 - t)).fold(f64::INFINITY, f64::min)
            };
            let candidates = (0..32).map(|i| bounds.min[axis] - step * (0.51 + f64::from(i) / 32.0));
            candidates.fold((f64::NEG_INFINITY, bounds.min[axis] - step), |best, o| {
                let c = clearance(o);
                if c > best.0 { (c, o) } else { best }
            })
        });
        let origin = origin.map(|(_, o)| o);
        let cells = [0, 1].map(|a| ((bounds.max[a] - origin[a]) / step + 0.51).ceil() as usize);
        let grid = BLOCKS.map(|block| PlaneGrid { origin, step, cells, block });
        let mut most = 0;
        for of in grid {
            most = of.most_live(bounds, surfaces);
            if most <= MOST_LIVE {
                return Ok(of);
            }
        }
        let message = format!(
            "{most} smooth faces meet in a few cells of {step} mm, and {MOST_LIVE} are possible; use a smaller step, or a mesh for \
             the region"
        );
        Err(Fault::new("step", message))
    }

    /// The most surfaces that bounds leave in a block of any height, if there are many at all.
    fn most_live(&self, bounds: &Aabb, surfaces: &[Surface]) -> usize {
        if surfaces.len() <= MOST_LIVE {
            return surfaces.len();
        }
        let edge = self.step * self.block as f64;
        let [nx, ny] = self.blocks();
        let nz = (bounds.size()[2] / edge).ceil().max(1.0) as usize;
        let live = |n: usize| {
            let at = [n % nx, n / nx % ny, n / (nx * ny)];
            let origin = [self.origin[0], self.origin[1], bounds.min[2]];
            let min = [0, 1, 2].map(|a| origin[a] + edge * at[a] as f64);
            let b = Aabb { min, max: min.map(|x| x + edge) };
            let varies = |s: &&Surface| (s.field.bound(&b).lo <= 0.0) && (s.field.bound(&b).hi > 0.0);
            surfaces.iter().filter(varies).count()
        };
        (0..nx * ny * nz).into_par_iter().map(live).max().unwrap_or(0)
    }

    /// The position of a node, mm.
    #[inline]
    pub fn position(&self, node: PlaneNode) -> Point {
        let unit = self.step / f64::from(FINE);
        [0, 1].map(|a| self.origin[a] + f64::from(node[a]) * unit)
    }

    /// Number of blocks along x and y.
    pub fn blocks(&self) -> [usize; 2] {
        self.cells.map(|n| n.div_ceil(self.block))
    }
}

/// A block of cells in which the solid's boundary may lie.
pub(super) struct LiveBlock {
    /// Its first cell.
    pub first: [usize; 2],
    /// Number of nodes along x and y.
    pub shape: [usize; 2],
    /// The surfaces that may change sign in it.
    pub live: Vec<usize>,
    /// The solid, by the indices in `live`.
    pub tree: CsgTree,
    /// For each live surface, the values at the nodes, x fastest.
    pub samples: Vec<Vec<f32>>,
    /// For each live surface and row of nodes, where it is not positive.
    pub negative: Vec<Vec<u64>>,
}

impl LiveBlock {
    /// Samples a block at a height; `None` if bounds tell that no boundary lies in it.
    pub fn sample(
        grid: &PlaneGrid,
        surfaces: &[Surface],
        tree: &CsgTree,
        block: [usize; 2],
        z: f64,
    ) -> Option<LiveBlock> {
        let first = block.map(|b| b * grid.block);
        let shape = [0, 1].map(|a| (grid.cells[a] - first[a]).min(grid.block) + 1);
        let axes = [0, 1].map(|a| {
            let nodes = (first[a]..first[a] + shape[a]).map(|i| i as u32 * FINE);
            nodes.map(|n| grid.position([n, n])[a]).collect::<Vec<f64>>()
        });
        let zs = [z];
        let nodes = Block { axes: [&axes[0], &axes[1], &zs] };
        let bounds = nodes.bounds();
        let sign = |f: usize| {
            let r = surfaces[f].field.bound(&bounds);
            if r.hi <= 0.0 {
                Sign::Negative
            } else if r.lo > 0.0 {
                Sign::Positive
            } else {
                Sign::Varies(f)
            }
        };
        let signs: Vec<Sign> = (0..surfaces.len()).map(sign).collect();
        let local = tree.simplified(&|f| signs[f]);
        if matches!(&local, CsgTree::Intersection(of) | CsgTree::Union(of) if of.is_empty()) {
            return None;
        }
        let mut live = Vec::new();
        local.for_each(&mut |f| live.push(f));
        live.sort_unstable();
        live.dedup();
        let index = |f: usize| live.binary_search(&f).map_or(Sign::Positive, Sign::Varies);
        let tree = local.simplified(&index);
        let samples = sample(surfaces, &live, &nodes);
        let negative = samples.iter().map(|s| s.chunks(shape[0]).map(row_signs).collect()).collect();
        Some(LiveBlock { first, shape, live, tree, samples, negative })
    }

    /// The signs of the live surfaces at a node of the grid: a bit is set where one is not positive.
    #[inline]
    pub fn signs(&self, i: usize, j: usize) -> u64 {
        let of = self.negative.iter().enumerate();
        of.fold(0, |w, (f, rows)| w | (rows[j] >> i & 1) << f)
    }

    /// Whether the solid is where the live surfaces have these signs.
    #[inline]
    pub fn solid(&self, signs: u64) -> bool {
        self.tree.solid(&|f| signs >> f & 1) & 1 == 1
    }
}

fn row_signs(row: &[f32]) -> u64 {
    row.iter().enumerate().fold(0, |w, (i, v)| w | u64::from(*v <= 0.0) << i)
}

/// The values of some surfaces at the nodes of a block.
fn sample(surfaces: &[Surface], live: &[usize], nodes: &Block) -> Vec<Vec<f32>> {
    let wanted = vec![u64::MAX; nodes.shape()[1]];
    let mut samples = vec![vec![0f32; nodes.len()]; live.len()];
    let mut at = 0;
    while at < live.len() {
        let surface = &surfaces[live[at]];
        let twin = |p: &&Arc<dyn SurfacePair>| {
            let next = live.get(at + 1).and_then(|f| surfaces[*f].pair.as_ref());
            next.is_some_and(|n| Arc::ptr_eq(p, n))
        };
        match (surface.pair.as_ref().filter(twin), &mut samples[at..]) {
            (Some(pair), [a, b, ..]) => {
                pair.fill_both(nodes, &wanted, [a, b]);
                at += 2;
            }
            (_, [a, ..]) => {
                surface.field.fill(nodes, a);
                at += 1;
            }
            _ => break,
        }
    }
    samples
}

/// A point of a layer in space.
#[inline]
pub(super) fn lifted([x, y]: Point, z: f64) -> Vec3 {
    [x, y, z]
}
