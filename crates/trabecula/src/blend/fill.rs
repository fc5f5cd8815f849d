//! A blend on the rows of a block.
//!
//! A block is cut into cubes of a few nodes. Where the bounds of the shares say that one lattice is alone, it alone is
//! evaluated; elsewhere shares are found node by node. A node's value depends on the node alone, whatever the block: a
//! lattice that is alone by its bounds is alone by its shares too.

use super::Blend;
use super::added::{At, Row};
use super::strand;
use crate::field::Block;
use crate::math::{Aabb, Interval, Vec3};

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
            (0..bound.len())
                .filter(|i| bound[*i].hi > 0.0)
                .fold(0, |m, i| m | 1u64 << i)
        };
        let shape = block.shape().map(|n| n.div_ceil(CUBE));
        let all = here(&block.bounds());
        if all.count_ones() == 1 {
            let here = vec![all; shape.iter().product()];
            return Cubes { shape, here };
        }
        let each = (0..shape.iter().product()).map(|n: usize| {
            let at = [
                n % shape[0],
                n / shape[0] % shape[1],
                n / shape[0] / shape[1],
            ];
            let nodes: [&[f64]; 3] = core::array::from_fn(|a| {
                let axis = block.axes[a];
                &axis[at[a] * CUBE..((at[a] + 1) * CUBE).min(axis.len())]
            });
            here(&Block { axes: nodes }.bounds())
        });
        Cubes {
            here: each.collect(),
            shape,
        }
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
        let mut rows: Vec<_> = self
            .strands
            .iter()
            .enumerate()
            .map(|(i, s)| (all >> i & 1 == 1).then(|| s.rows(block, wanted)))
            .collect();
        let mut cores = vec![vec![0f32; xs.len()]; self.strands.len()];
        let mut some = Nodes::default();
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
                // Runs of cubes: those with one and the same lattice, and those with several.
                let mut from = 0;
                for run in of_row.chunk_by(|a, b| a == b || (several(*a) && several(*b))) {
                    let to = from + run.len() * CUBE;
                    let line = Line {
                        rows: &rows,
                        cores: &cores,
                        at: [ys[j], zs[k]],
                        xs,
                    };
                    some.nodes.clear();
                    some.nodes.extend((from..to.min(xs.len())).filter(here));
                    if several(run[0]) {
                        self.fill_mixed(&mut some, &line, row);
                    } else {
                        self.fill_alone(run[0].trailing_zeros() as usize, &mut some, &line, row);
                    }
                    from = to;
                }
            }
        }
    }

    /// The nodes of a row where one lattice is alone.
    fn fill_alone(&self, s: usize, some: &mut Nodes, line: &Line, row: &mut [f32]) {
        let (Some(rows), strand) = (&line.rows[s], &self.strands[s]) else {
            return;
        };
        some.high.resize(some.nodes.len(), 0.0);
        match strand.uniform() {
            Some(high) => some.high.fill(high),
            None => {
                some.place(line);
                strand.highs(&some.points, &mut some.high);
            }
        }
        for (i, high) in some.nodes.iter().zip(&some.high) {
            let low = strand.low_alone(*high);
            row[*i] = self.value_of([rows.value(line.cores[s][*i]), low, *high]) as f32;
        }
    }

    /// The nodes of a row where several lattices may be.
    fn fill_mixed(&self, some: &mut Nodes, line: &Line, row: &mut [f32]) {
        let n = self.strands.len();
        some.place(line);
        let Nodes {
            nodes,
            points,
            w,
            high,
            highs,
            at,
            row: known,
        } = some;
        if let Some(levels) = &self.levels {
            known.enter(levels, line.at);
        }
        w.resize(n * points.len(), 0.0);
        self.weights.values(points, w);
        highs.resize(n * points.len(), 0.0);
        high.resize(points.len(), 0.0);
        for (s, strand) in self.strands.iter().enumerate() {
            match strand.uniform() {
                Some(v) => high.fill(v),
                None if (0..points.len()).any(|i| w[i * n + s] > 0.0) => strand.highs(points, high),
                None => {}
            }
            for (all, high) in highs.chunks_exact_mut(n).zip(&*high) {
                all[s] = *high;
            }
        }
        for ((node, p), (w, high)) in
            (nodes.iter().zip(&*points)).zip(w.chunks_exact(n).zip(highs.chunks_exact(n)))
        {
            let mut f = 0.0;
            for (s, w) in w.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                if let Some(rows) = &line.rows[s] {
                    f += w * rows.value(line.cores[s][*node]);
                }
            }
            let value = self.value_at(*p, f, (w, high), at, |levels, end, at| {
                levels.added_in_row(&self.strands, p[0], w, at, end, known)
            });
            row[*node] = value as f32;
        }
    }
}

/// Whether more than one bit is set.
fn several(lattices: u64) -> bool {
    lattices.count_ones() > 1
}

/// A row of nodes and what the lattices are there.
struct Line<'a> {
    rows: &'a [Option<strand::Rows<'a>>],
    cores: &'a [Vec<f32>],
    /// Its y and z.
    at: [f64; 2],
    xs: &'a [f64],
}

/// Some nodes of a row: buffers.
#[derive(Default)]
struct Nodes {
    nodes: Vec<usize>,
    points: Vec<Vec3>,
    /// Shares, those of a node side by side.
    w: Vec<f64>,
    /// Upper ends of one lattice, and of all, those of a node side by side.
    high: Vec<f64>,
    highs: Vec<f64>,
    at: At,
    row: Row,
}

impl Nodes {
    /// Finds where the nodes are.
    fn place(&mut self, line: &Line) {
        let [y, z] = line.at;
        self.points.clear();
        self.points
            .extend(self.nodes.iter().map(|i| [line.xs[*i], y, z]));
    }
}
