//! A blend on the rows of a block.
//!
//! A block is cut into cubes of a few nodes. Where the bounds of the shares say that one lattice is alone, it alone is
//! evaluated; elsewhere shares are found node by node. A node's value depends on the node alone, whatever the block: a
//! lattice that is alone by its bounds is alone by its shares too.

use super::Blend;
use super::mixed::Mixed;
use super::strand;
use crate::field::Block;
use geometry::math::{Aabb, Interval, Vec3};

/// Nodes along an edge of a cube.
const CUBE: usize = 8;
/// Most lattices: one bit of a word for each.
pub(super) const MOST: usize = 64;

/// The lattices that may be there, a bit for each, in every cube of a block.
struct Cubes {
    shape: [usize; 3],
    here: Vec<u64>,
}

impl Cubes {
    fn new(blend: &Blend, block: &Block) -> Cubes {
        let mut bound = vec![Interval::new(0.0, 0.0); blend.strands.len()];
        let mut here = |b: &Aabb| {
            blend.weights.bound(b, &mut bound);
            (0..bound.len()).filter(|i| bound[*i].hi > 0.0).fold(0, |m, i| m | 1u64 << i)
        };
        let shape = block.shape().map(|n| n.div_ceil(CUBE));
        let all = here(&block.bounds());
        if all.count_ones() == 1 {
            let here = vec![all; shape.iter().product()];
            return Cubes { shape, here };
        }
        let each = (0..shape.iter().product()).map(|n: usize| {
            let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            let nodes: [&[f64]; 3] = core::array::from_fn(|a| {
                let axis = block.axes[a];
                &axis[at[a] * CUBE..((at[a] + 1) * CUBE).min(axis.len())]
            });
            here(&Block { axes: nodes }.bounds())
        });
        Cubes { here: each.collect(), shape }
    }

    /// The cubes of a row of nodes.
    fn row(&self, j: usize, k: usize) -> &[u64] {
        let first = (k / CUBE * self.shape[1] + j / CUBE) * self.shape[0];
        &self.here[first..][..self.shape[0]]
    }
}

impl Blend {
    pub(super) fn fill_rows(&self, block: &Block, wanted: Option<&[u64]>, out: &mut [f32]) {
        let cubes = Cubes::new(self, block);
        let all = cubes.here.iter().fold(0, |m, c| m | c);
        let [xs, ys, zs] = block.axes;
        let mut rows: Vec<_> =
            self.strands.iter().enumerate().map(|(i, s)| (all >> i & 1 == 1).then(|| s.rows(block, wanted))).collect();
        let mut cores = vec![vec![0f32; xs.len()]; self.strands.len()];
        let mut nodes = Vec::new();
        let mut alone = Alone::default();
        let mut mixed = several(all).then(|| Mixed::new(self, xs));
        for k in 0..zs.len() {
            rows.iter_mut().flatten().for_each(|r| r.enter_layer(k));
            for j in 0..ys.len() {
                let word = wanted.map_or(u64::MAX, |w| w[k * ys.len() + j]);
                let row = &mut out[(k * ys.len() + j) * xs.len()..][..xs.len()];
                if word == 0 {
                    row.fill(1.0);
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
                let line = Line { rows: &rows, cores: &cores, number: [j, k], at: [ys[j], zs[k]], xs };
                // Runs of cubes: those with one and the same lattice, and those with several.
                let mut from = 0;
                for run in of_row.chunk_by(|a, b| a == b || (several(*a) && several(*b))) {
                    let to = from + run.len() * CUBE;
                    nodes.clear();
                    nodes.extend((from..to.min(xs.len())).filter(here));
                    match &mut mixed {
                        Some(mixed) if several(run[0]) => mixed.fill(self, &nodes, &line, row),
                        _ => alone.fill(self, run[0].trailing_zeros() as usize, &nodes, &line, row),
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

/// A row of nodes and what the lattices are there.
pub(super) struct Line<'a> {
    pub rows: &'a [Option<strand::Rows<'a>>],
    pub cores: &'a [Vec<f32>],
    /// Its number along y and z.
    pub number: [usize; 2],
    /// Its y and z.
    pub at: [f64; 2],
    pub xs: &'a [f64],
}

impl Line<'_> {
    /// A node.
    pub fn place(&self, i: usize) -> Vec3 {
        [self.xs[i], self.at[0], self.at[1]]
    }

    /// The core of a lattice at a node.
    #[inline]
    pub fn core(&self, s: usize, i: usize) -> f64 {
        let rows = self.rows[s].as_ref();
        rows.map_or(0.0, |rows| rows.value(self.cores[s][i]))
    }
}

/// The nodes of a row where one lattice is alone: buffers.
#[derive(Default)]
struct Alone {
    points: Vec<Vec3>,
    high: Vec<f64>,
}

impl Alone {
    fn fill(&mut self, blend: &Blend, s: usize, nodes: &[usize], line: &Line, row: &mut [f32]) {
        let strand = &blend.strands[s];
        self.high.resize(nodes.len(), 0.0);
        match strand.uniform() {
            Some(high) => self.high.fill(high),
            None => {
                self.points.clear();
                self.points.extend(nodes.iter().map(|i| line.place(*i)));
                strand.highs(&self.points, &mut self.high);
            }
        }
        for (i, high) in nodes.iter().zip(&self.high) {
            row[*i] = blend.alone(s, line.core(s, *i), *high) as f32;
        }
    }
}

impl Blend {
    /// The value where a lattice is alone, its core is `g` and its upper end `high`.
    #[inline]
    pub(super) fn alone(&self, s: usize, g: f64, high: f64) -> f64 {
        self.value_of([g, self.strands[s].low_alone(high), high])
    }
}
