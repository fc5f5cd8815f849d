//! The cells of a layer: those of the grid, and finer ones where the grid leaves the section undecided.
//!
//! A cell is refined where a surface passes two opposite corners, where three surfaces or more decide, and where a surface with
//! one sign at the corners may still reach in: second differences say how far it may bend. Adjacent cells of different size share
//! all nodes on their common side, because a cell with nodes on its sides is divided into triangles about its centre.

use geometry::progress::checkpoint;
use rustc_hash::{FxHashMap, FxHashSet};

use super::plane_grid::{FINE, LiveBlock, PlaneGrid, PlaneNode, lifted};
use crate::csg_tree::CsgTree;
use crate::implicit::Surface;
use geometry::math::Aabb;

/// Edge of the smallest cells, in units of the grid: an eighth of a cell, and a 32nd about creases of one surface, where gaps and
/// notches narrow.
const LEAST: u32 = 8;
const LEAST_CREASED: u32 = 2;
/// How far a function may go beyond its values at the corners of a cell, in sums of the second differences in either direction at
/// these: an eighth if it is smooth, half if it has a crease in the cell and is straight elsewhere.
const DIP: f64 = 0.5;
/// The same of a surface with creases, in second differences at the nodes around the cell, too, which have what bends away from
/// the crease: an arc rises by three eighths of its own second difference over the line through its last two nodes, and at a
/// block's end the crease shows at one node alone.
const CREASED_DIP: f64 = 1.0;

/// A corner of a polygon: its node and the signs of its block's live surfaces there.
pub(super) type SignedNode = (PlaneNode, u64);

/// A cell that is to be contoured.
#[derive(Clone, Copy)]
struct Leaf {
    block: u32,
    at: PlaneNode,
    size: u32,
}

/// All live blocks of a layer and their cells.
pub(super) struct LeafCells<'a> {
    grid: &'a PlaneGrid,
    surfaces: &'a [Surface],
    z: f64,
    pub blocks: Vec<LiveBlock>,
    /// For each block of the grid its number in `blocks`, or none.
    numbers: Vec<u32>,
    /// For each live block and live surface, how far it may go beyond its values at the corners of each cell of a row.
    dips: Vec<Vec<Vec<f32>>>,
    /// For each live block the values at nodes of refined cells.
    extra: Vec<FxHashMap<PlaneNode, Vec<f64>>>,
}

const NONE: u32 = u32::MAX;

/// What the grid says of the cells in a row of a block, a bit for each.
struct CellRow {
    /// The solid's boundary passes.
    crossed: u64,
    /// To be refined.
    undecided: u64,
}

impl<'a> LeafCells<'a> {
    /// Samples a layer.
    pub fn new(grid: &'a PlaneGrid, surfaces: &'a [Surface], tree: &CsgTree, z: f64) -> LeafCells<'a> {
        let [nx, ny] = grid.blocks();
        let (mut blocks, mut numbers) = (Vec::new(), vec![NONE; nx * ny]);
        for (n, number) in numbers.iter_mut().enumerate() {
            if let Some(block) = LiveBlock::sample(grid, surfaces, tree, [n % nx, n / nx], z) {
                *number = blocks.len() as u32;
                blocks.push(block);
            }
        }
        let extra = blocks.iter().map(|_| FxHashMap::default()).collect();
        let dips = |of: &LiveBlock| {
            let of_one = |(f, values): (&usize, &Vec<f32>)| dips(values, of.shape[0], surfaces[*f].has_creases);
            of.live.iter().zip(&of.samples).map(of_one).collect()
        };
        let dips = blocks.iter().map(dips).collect();
        LeafCells { grid, surfaces, z, blocks, dips, numbers, extra }
    }

    /// Calls `found` for each polygon that the boundary may cross, with the number of its block: adjacent ones have whole sides
    /// in common.
    pub fn each_polygon(&mut self, found: &mut impl FnMut(&Self, u32, &[SignedNode])) {
        let (mut crossed, mut refined) = (Vec::new(), Vec::new());
        for b in 0..self.blocks.len() {
            checkpoint();
            self.classify(b as u32, &mut crossed, &mut refined);
        }
        let coarse: FxHashSet<PlaneNode> = refined.iter().map(|l: &Leaf| l.at).collect();
        let leaves = self.refine(refined);
        let hanging = hanging(&leaves);
        let around = self.around(&coarse);
        let near: FxHashSet<PlaneNode> = around.iter().map(|l| l.at).collect();
        for leaf in &crossed {
            if !near.contains(&leaf.at) {
                let corners = corners(leaf).map(|n| (n, self.signs(leaf.block, n)));
                found(self, leaf.block, &corners);
            }
        }
        let divided: Vec<(Leaf, Vec<PlaneNode>)> =
            leaves.iter().chain(&around).map(|leaf| (*leaf, boundary(leaf, &hanging))).collect();
        self.evaluate(divided.iter().flat_map(|(leaf, nodes)| {
            let centre = leaf.at.map(|x| x + leaf.size / 2);
            nodes.iter().copied().chain([centre]).map(|n| (leaf.block, n))
        }));
        for (leaf, nodes) in &divided {
            let of = |n: PlaneNode| (n, self.signs(leaf.block, n));
            let around: Vec<SignedNode> = nodes.iter().map(|n| of(*n)).collect();
            if around.iter().all(|c| c.1 == around[0].1) {
                continue;
            }
            if around.len() == 4 && !ambiguous(&around) {
                found(self, leaf.block, &around);
                continue;
            }
            let centre = of(leaf.at.map(|x| x + leaf.size / 2));
            for (i, corner) in around.iter().enumerate() {
                found(self, leaf.block, &[centre, *corner, around[(i + 1) % around.len()]]);
            }
        }
    }

    /// The value of a live surface of a block at a node, where it was sampled.
    pub fn value(&self, block: u32, node: PlaneNode, surface: usize) -> f64 {
        let of = &self.blocks[block as usize];
        match self.extra[block as usize].get(&node) {
            Some(values) => values[surface],
            None => f64::from(of.samples[surface][index(of, node)]),
        }
    }

    fn signs(&self, block: u32, node: PlaneNode) -> u64 {
        let of = &self.blocks[block as usize];
        match self.extra[block as usize].get(&node) {
            Some(values) => values.iter().enumerate().fold(0, |w, (f, v)| w | u64::from(*v <= 0.0) << f),
            None => {
                let [i, j] = place(of, node);
                of.signs(i, j)
            }
        }
    }

    /// Lists the cells of a block that are crossed or to be refined.
    fn classify(&self, block: u32, crossed: &mut Vec<Leaf>, refined: &mut Vec<Leaf>) {
        let of = &self.blocks[block as usize];
        for j in 0..of.shape[1] - 1 {
            let hides = |f: usize, i: usize| {
                let at = [of.first[0] + i, of.first[1] + j].map(|n| n as u32 * FINE);
                self.hides(&Leaf { block, at, size: FINE }, f)
            };
            let row = classify_row(of, &self.dips[block as usize], &hides, j);
            let mut left = row.crossed | row.undecided;
            while left != 0 {
                let i = left.trailing_zeros() as usize;
                left &= left - 1;
                let at = [of.first[0] + i, of.first[1] + j].map(|n| n as u32 * FINE);
                let list = if row.undecided >> i & 1 == 1 { &mut *refined } else { &mut *crossed };
                list.push(Leaf { block, at, size: FINE });
            }
        }
    }

    /// Divides cells by four until they are decided or smallest; gives what they end in.
    fn refine(&mut self, mut level: Vec<Leaf>) -> Vec<Leaf> {
        let mut leaves = Vec::new();
        while !level.is_empty() {
            let half = level[0].size / 2;
            let children = level.iter().flat_map(|l| {
                [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| Leaf {
                    at: [l.at[0] + x * half, l.at[1] + y * half],
                    size: half,
                    ..*l
                })
            });
            let children: Vec<Leaf> = children.collect();
            self.evaluate(children.iter().flat_map(|l| corners(l).map(|n| (l.block, n))));
            let (next, done): (Vec<Leaf>, Vec<Leaf>) =
                children.into_iter().partition(|l| l.size > LEAST_CREASED && self.undecided(l));
            leaves.extend(done);
            level = next;
        }
        leaves
    }

    /// Whether a part of a refined cell has to be refined further.
    fn undecided(&self, leaf: &Leaf) -> bool {
        let of = &self.blocks[leaf.block as usize];
        let signs = corners(leaf).map(|n| self.signs(leaf.block, n));
        let (some, all) = (signs.iter().fold(0, |a, b| a | b), signs.iter().fold(u64::MAX, |a, b| a & b));
        let dips = (0..of.live.len()).fold(0, |w, f| w | u64::from(self.hides(leaf, f)) << f);
        let (some, all) = (some | dips, all & !dips);
        let [a, b, c, d] = signs;
        let saddle = !(a ^ c) & !(b ^ d) & (a ^ b);
        let (mut count, mut found) = (0, false);
        of.tree.deciding(1, &|f| some >> f & 1, &|f| all >> f & 1, &mut |f, here| {
            count += here;
            let divisible = leaf.size > LEAST || self.surfaces[of.live[f]].has_creases;
            found |= here == 1 && (saddle | dips) >> f & 1 == 1 && divisible;
        });
        found || count >= 3 && leaf.size > LEAST
    }

    /// How far a surface may go beyond its values at the corners of a cell or a part of one: in proportion to the edge, if it has
    /// creases; else by second differences in what the part was divided from.
    fn dip(&self, leaf: &Leaf, surface: usize) -> f64 {
        let (of, s) = (&self.blocks[leaf.block as usize], leaf.size);
        if s == FINE || self.surfaces[of.live[surface]].has_creases {
            let [i, j] = place(of, leaf.at);
            let whole = self.dips[leaf.block as usize][surface][i + j * of.shape[0]];
            return f64::from(whole) * f64::from(s) / f64::from(FINE);
        }
        let first = leaf.at.map(|x| x / (2 * s) * (2 * s));
        let value = |i: u32, j: u32| self.value(leaf.block, [first[0] + i * s, first[1] + j * s], surface);
        let rows = (0..3).map(|k| (value(0, k) - 2.0 * value(1, k) + value(2, k)).abs()).fold(0.0, f64::max);
        let columns = (0..3).map(|k| (value(k, 0) - 2.0 * value(k, 1) + value(k, 2)).abs()).fold(0.0, f64::max);
        DIP * (rows + columns)
    }

    /// Whether a surface may change sign in a cell without a trace at the corners: inside, if it has one sign at all; where there are
    /// creases also on a side with one sign at its ends.
    fn hides(&self, leaf: &Leaf, f: usize) -> bool {
        let nodes = corners(leaf);
        let values = nodes.map(|n| self.value(leaf.block, n, f));
        let signs = values.map(|v| v <= 0.0);
        let surface = &self.surfaces[self.blocks[leaf.block as usize].live[f]];
        let uniform = signs == [signs[0]; 4];
        if !(uniform || surface.has_creases) {
            return false;
        }
        let dip = self.dip(leaf, f);
        // Bounds are dear to ask, and narrow enough to be asked, where there are creases.
        let varies = |a: PlaneNode, b: PlaneNode| {
            let [min, max] = [[0, 1].map(|k| a[k].min(b[k])), [0, 1].map(|k| a[k].max(b[k]))];
            let [min, max] = [min, max].map(|n| lifted(self.grid.position(n), self.z));
            let range = surface.field.bound(&Aabb { min, max });
            range.lo <= 0.0 && range.hi > 0.0
        };
        if uniform {
            let least = values.into_iter().map(f64::abs).fold(f64::MAX, f64::min);
            return least <= dip && (!surface.has_creases || varies(nodes[0], nodes[2]));
        }
        let side = |[i, j]: [usize; 2]| {
            signs[i] == signs[j] && values[i].abs().min(values[j].abs()) <= dip && varies(nodes[i], nodes[j])
        };
        [[0, 1], [1, 2], [2, 3], [3, 0]].into_iter().any(side)
    }

    /// Evaluates the live surfaces of blocks at nodes that are not nodes of the grid.
    fn evaluate(&mut self, wanted: impl Iterator<Item = (u32, PlaneNode)>) {
        let mut nodes: Vec<(u32, PlaneNode)> = wanted.filter(|(_, n)| n[0] % FINE != 0 || n[1] % FINE != 0).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.retain(|(b, n)| !self.extra[*b as usize].contains_key(n));
        for of in nodes.chunk_by(|a, b| a.0 == b.0) {
            let block = of[0].0 as usize;
            let points: Vec<_> = of.iter().map(|(_, n)| lifted(self.grid.position(*n), self.z)).collect();
            let live = &self.blocks[block].live;
            let mut values = vec![vec![0.0; points.len()]; live.len()];
            for (f, out) in live.iter().zip(&mut values) {
                self.surfaces[*f].field.values(&points, out);
            }
            for (i, (_, node)) in of.iter().enumerate() {
                self.extra[block].insert(*node, values.iter().map(|v| v[i]).collect());
            }
        }
    }

    /// The cells of the grid next to refined ones that are not refined themselves.
    fn around(&self, refined: &FxHashSet<PlaneNode>) -> Vec<Leaf> {
        let [nx, ny] = self.grid.cells.map(|n| n as u32);
        let blocks = self.grid.blocks()[0];
        let mut next = Vec::new();
        for [x, y] in refined {
            let (i, j) = (x / FINE, y / FINE);
            let sides = [(i.wrapping_sub(1), j), (i + 1, j), (i, j.wrapping_sub(1)), (i, j + 1)];
            next.extend(sides.into_iter().filter(|(i, j)| *i < nx && *j < ny).map(|(i, j)| [i * FINE, j * FINE]));
        }
        next.retain(|n| !refined.contains(n));
        next.sort_unstable();
        next.dedup();
        let leaf = |at: PlaneNode| {
            let [bx, by] = at.map(|x| (x / FINE) as usize / self.grid.block);
            let block = self.numbers[bx + by * blocks];
            (block != NONE).then_some(Leaf { block, at, size: FINE })
        };
        next.into_iter().filter_map(leaf).collect()
    }
}

/// Where a node of the grid is in its block.
fn place(block: &LiveBlock, node: PlaneNode) -> [usize; 2] {
    [0, 1].map(|a| (node[a] / FINE) as usize - block.first[a])
}

fn index(block: &LiveBlock, node: PlaneNode) -> usize {
    let [i, j] = place(block, node);
    i + j * block.shape[0]
}

/// The corners of a cell, counter-clockwise.
fn corners(leaf: &Leaf) -> [PlaneNode; 4] {
    let ([x, y], s) = (leaf.at, leaf.size);
    [[x, y], [x + s, y], [x + s, y + s], [x, y + s]]
}

/// Whether a surface has one sign at two opposite corners and the other at the others.
fn ambiguous(of: &[SignedNode]) -> bool {
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| of[i].1);
    !(a ^ c) & !(b ^ d) & (a ^ b) != 0
}

/// The corners of refined cells.
fn hanging(leaves: &[Leaf]) -> FxHashSet<PlaneNode> {
    leaves.iter().flat_map(corners).collect()
}

/// The nodes on the boundary of a cell, counter-clockwise.
fn boundary(leaf: &Leaf, hanging: &FxHashSet<PlaneNode>) -> Vec<PlaneNode> {
    fn side(a: PlaneNode, b: PlaneNode, hanging: &FxHashSet<PlaneNode>, out: &mut Vec<PlaneNode>) {
        let middle = [0, 1].map(|i| (a[i] + b[i]) / 2);
        if middle != a && middle != b && hanging.contains(&middle) {
            side(a, middle, hanging, out);
            out.push(middle);
            side(middle, b, hanging, out);
        }
    }
    let of = corners(leaf);
    let mut out = Vec::with_capacity(8);
    for i in 0..4 {
        out.push(of[i]);
        side(of[i], of[(i + 1) % 4], hanging, &mut out);
    }
    out
}

/// How far a function may go beyond its values at the corners of cells: for each node, of the cell that begins there.
fn dips(values: &[f32], nx: usize, creased: bool) -> Vec<f32> {
    let bends = second_differences(values, nx);
    let ny = values.len() / nx;
    let (around, share) = if creased { (1, CREASED_DIP) } else { (0, DIP) };
    let reach = |i: usize, count: usize| i.saturating_sub(around)..(i + 2 + around).min(count);
    let along: Vec<f32> =
        (0..values.len()).map(|n| reach(n % nx, nx).map(|i| bends[n - n % nx + i]).fold(0.0, f32::max)).collect();
    let of = |n: usize| reach(n / nx, ny).map(|j| along[n % nx + j * nx]).fold(0.0, f32::max);
    (0..values.len()).map(|n| share as f32 * of(n)).collect()
}

/// The sum of the second differences along x and y, at each node; at the ends of rows those of the next node.
fn second_differences(values: &[f32], nx: usize) -> Vec<f32> {
    let ny = values.len() / nx;
    let along = |n: usize, stride: usize, at: usize, count: usize| {
        if count < 3 {
            return 0.0;
        }
        let n = n + stride * usize::from(at == 0) - stride * usize::from(at + 1 == count);
        (values[n - stride] - 2.0 * values[n] + values[n + stride]).abs()
    };
    let of = |n: usize| along(n, 1, n % nx, nx) + along(n, nx, n / nx, ny);
    (0..values.len()).map(of).collect()
}

/// Classifies the cells of a row, 64 at a time.
fn classify_row(of: &LiveBlock, dip: &[Vec<f32>], hides: &impl Fn(usize, usize) -> bool, j: usize) -> CellRow {
    let nx = of.shape[0];
    let mask = (1u64 << (nx - 1)) - 1;
    let rows = |f: usize| (of.negative[f][j], of.negative[f][j + 1]);
    let count = of.live.len();
    let (mut some, mut all, mut saddle, mut dips) = (vec![0; count], vec![0; count], vec![0; count], vec![0; count]);
    for f in 0..count {
        let (a, b) = rows(f);
        some[f] = a | a >> 1 | b | b >> 1;
        all[f] = a & (a >> 1) & b & (b >> 1);
        saddle[f] = (a ^ (a >> 1)) & (b ^ (b >> 1)) & (a ^ b);
        let values = &of.samples[f];
        for i in 0..nx - 1 {
            let n = i + j * nx;
            let least =
                values[n].abs().min(values[n + 1].abs()).min(values[n + nx].abs()).min(values[n + nx + 1].abs());
            if least <= dip[f][n] {
                dips[f] |= u64::from(hides(f, i)) << i;
            }
        }
    }
    let crossed = of.tree.possible(&|f| some[f], &|f| all[f]) & !of.tree.certain(&|f| some[f], &|f| all[f]) & mask;
    let (mut one, mut two, mut undecided) = (0u64, 0u64, 0u64);
    let (may, must) = (|f: usize| some[f] | dips[f], |f: usize| all[f] & !dips[f]);
    of.tree.deciding(mask, &may, &must, &mut |f, here| {
        let three = two & here;
        two |= one & here;
        one |= here;
        undecided |= three | here & (saddle[f] | dips[f]);
    });
    CellRow { crossed, undecided }
}
