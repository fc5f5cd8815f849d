//! A blend on the nodes of a block.
//!
//! A block is divided into cubes of a few nodes. Where the bounds of the shares prove that one lattice is alone, it alone is
//! evaluated; elsewhere shares are evaluated node by node. A node's value depends on the node alone, not on the block: a
//! lattice that is alone by the bounds is alone by its shares too.

use super::grid_row::GridRow;
use super::mixed_rows::MixedRows;
use super::sum::{Blend, BlendBound};
use crate::field::Block;
use geometry::math::{Aabb, Interval, Vec3};

/// Nodes along an edge of a cube.
const CUBE: usize = 8;

/// For every cube of a block the summands that may have a weight in it, a bit for each.
struct CubeSummands {
    shape: [usize; 3],
    present: Vec<u64>,
}

impl CubeSummands {
    fn new(blend: &Blend, block: &Block) -> CubeSummands {
        let mut bound = vec![Interval::new(0.0, 0.0); blend.summands.len()];
        let mut present_in = |b: &Aabb| {
            blend.weights.bound(b, &mut bound);
            (0..bound.len()).filter(|i| bound[*i].hi > 0.0).fold(0, |m, i| m | 1u64 << i)
        };
        let shape = block.shape().map(|n| n.div_ceil(CUBE));
        let all = present_in(&block.bounds());
        if all.count_ones() == 1 {
            return CubeSummands { shape, present: vec![all; shape.iter().product()] };
        }
        let each = (0..shape.iter().product()).map(|n: usize| {
            let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            let nodes: [&[f64]; 3] = core::array::from_fn(|a| {
                let axis = block.axes[a];
                &axis[at[a] * CUBE..((at[a] + 1) * CUBE).min(axis.len())]
            });
            present_in(&Block { axes: nodes }.bounds())
        });
        CubeSummands { present: each.collect(), shape }
    }

    /// The cubes of a row of nodes.
    fn row(&self, j: usize, k: usize) -> &[u64] {
        let first = (k / CUBE * self.shape[1] + j / CUBE) * self.shape[0];
        &self.present[first..][..self.shape[0]]
    }
}

impl Blend {
    /// Fills the values on `sides` at the nodes of a block; where `wanted` is given at those with a bit alone.
    pub(super) fn fill_block<const S: usize>(
        &self,
        sides: [Option<BlendBound>; S],
        block: &Block,
        wanted: Option<&[u64]>,
        mut out: [&mut [f32]; S],
    ) {
        let cubes = CubeSummands::new(self, block);
        let all = cubes.present.iter().fold(0, |m, c| m | c);
        let [xs, ys, zs] = block.axes;
        let mut rows: Vec<_> =
            self.summands.iter().enumerate().map(|(i, s)| (all >> i & 1 == 1).then(|| s.rows(block, wanted))).collect();
        let mut cores = vec![vec![0f32; xs.len()]; self.summands.len()];
        let mut nodes = Vec::new();
        let mut single = SingleSummandRow::default();
        let mut mixed = several(all).then(|| MixedRows::new(self, xs));
        for k in 0..zs.len() {
            rows.iter_mut().flatten().for_each(|r| r.enter_layer(k));
            for j in 0..ys.len() {
                let word = wanted.map_or(u64::MAX, |w| w[k * ys.len() + j]);
                let mut on = out.each_mut().map(|out| &mut out[(k * ys.len() + j) * xs.len()..][..xs.len()]);
                if word == 0 {
                    on.iter_mut().for_each(|row| row.fill(1.0));
                    continue;
                }
                let here = |i: &usize| wanted.is_none() || word >> i & 1 == 1;
                let of_row = cubes.row(j, k);
                let needed = of_row.iter().fold(0, |m, c| m | c);
                for (i, rows) in rows.iter_mut().enumerate() {
                    if let Some(rows) = rows.as_mut().filter(|_| needed >> i & 1 == 1) {
                        rows.fill(j, k, word, &mut cores[i]);
                    }
                }
                let line = GridRow { rows: &rows, cores: &cores, index: [j, k], at: [ys[j], zs[k]], xs };
                // Runs of cubes with one and the same summand, and of cubes with several.
                let mut from = 0;
                for run in of_row.chunk_by(|a, b| a == b || (several(*a) && several(*b))) {
                    let to = from + run.len() * CUBE;
                    nodes.clear();
                    nodes.extend((from..to.min(xs.len())).filter(here));
                    match &mut mixed {
                        Some(mixed) if several(run[0]) => mixed.fill((self, sides), &nodes, &line, &mut on),
                        _ => single.fill((self, sides), run[0].trailing_zeros() as usize, &nodes, &line, &mut on),
                    }
                    from = to;
                }
            }
        }
    }
}

/// Whether more than one bit is set.
fn several(lattices: u64) -> bool {
    lattices.count_ones() > 1
}

/// Buffers for the nodes of a row where one summand is alone.
#[derive(Default)]
struct SingleSummandRow {
    points: Vec<Vec3>,
    high: Vec<f64>,
}

impl SingleSummandRow {
    fn fill<const S: usize>(
        &mut self,
        (blend, sides): (&Blend, [Option<BlendBound>; S]),
        s: usize,
        nodes: &[usize],
        line: &GridRow,
        on: &mut [&mut [f32]; S],
    ) {
        let summand = &blend.summands[s];
        self.high.resize(nodes.len(), 0.0);
        match summand.uniform_upper_end() {
            Some(high) => self.high.fill(high),
            None => {
                self.points.clear();
                self.points.extend(nodes.iter().map(|i| line.position(*i)));
                summand.upper_ends(&self.points, &mut self.high);
            }
        }
        for (i, high) in nodes.iter().zip(&self.high) {
            for (row, side) in on.iter_mut().zip(sides) {
                row[*i] = blend.alone(side, s, line.value(s, *i), *high) as f32;
            }
        }
    }
}
