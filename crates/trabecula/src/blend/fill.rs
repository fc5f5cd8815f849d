//! A blend on the rows of a block.
//!
//! A block is cut into cubes of a few nodes. Where the bounds of the shares say that one lattice is alone, it alone is
//! evaluated; elsewhere shares are found node by node. A node's value depends on the node alone, whatever the block: a
//! lattice that is alone by its bounds is alone by its shares too.

use super::Blend;
use super::levels::{End, Row};
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
        let n = self.strands.len();
        let cubes = Cubes::new(self, block);
        let all = cubes.here.iter().fold(0, |m, c| m | c);
        let [xs, ys, zs] = block.axes;
        let mut rows: Vec<_> = self
            .strands
            .iter()
            .enumerate()
            .map(|(i, s)| (all >> i & 1 == 1).then(|| s.rows(block, wanted)))
            .collect();
        let mut cores = vec![vec![0f32; xs.len()]; n];
        let mut mixed = Mixed::default();
        for k in 0..zs.len() {
            rows.iter_mut().flatten().for_each(|r| r.enter_layer(k));
            for j in 0..ys.len() {
                let word = wanted.map_or(u64::MAX, |w| w[k * ys.len() + j]);
                let row = &mut out[(k * ys.len() + j) * xs.len()..][..xs.len()];
                if word == 0 {
                    row.fill(1.0);
                    continue;
                }
                let here = |i: usize| wanted.is_none() || word >> i & 1 == 1;
                let of_row = cubes.row(j, k);
                let needed = of_row.iter().fold(0, |m, c| m | c);
                for (i, rows) in rows.iter_mut().enumerate() {
                    if let Some(rows) = rows.as_mut().filter(|_| needed >> i & 1 == 1) {
                        rows.fill(j, k, word, &mut cores[i]);
                    }
                }
                mixed.nodes.clear();
                for (c, cube) in of_row.iter().enumerate() {
                    let nodes = c * CUBE..((c + 1) * CUBE).min(xs.len());
                    if cube.count_ones() > 1 {
                        mixed.nodes.extend(nodes.filter(|i| here(*i)));
                        continue;
                    }
                    let s = cube.trailing_zeros() as usize;
                    let Some(rows) = &rows[s] else { continue };
                    match self.strands[s].uniform() {
                        Some(high) => {
                            let low = self.strands[s].low_alone(high);
                            for i in nodes {
                                row[i] = self.value_of([rows.value(cores[s][i]), low, high]) as f32;
                            }
                        }
                        None => {
                            let nodes: Vec<usize> = nodes.filter(|i| here(*i)).collect();
                            let points: Vec<Vec3> =
                                nodes.iter().map(|i| [xs[*i], ys[j], zs[k]]).collect();
                            let mut high = vec![0.0; points.len()];
                            self.strands[s].highs(&points, &mut high);
                            for (i, high) in nodes.into_iter().zip(high) {
                                let low = self.strands[s].low_alone(high);
                                row[i] = self.value_of([rows.value(cores[s][i]), low, high]) as f32;
                            }
                        }
                    }
                }
                if !mixed.nodes.is_empty() {
                    let value =
                        |s: usize, i: usize| rows[s].as_ref().map_or(0.0, |r| r.value(cores[s][i]));
                    self.fill_mixed(&mut mixed, |i| [xs[i], ys[j], zs[k]], value, row);
                }
            }
        }
    }

    /// The nodes of a row where several lattices may be.
    fn fill_mixed(
        &self,
        mixed: &mut Mixed,
        point: impl Fn(usize) -> Vec3,
        core: impl Fn(usize, usize) -> f64,
        row: &mut [f32],
    ) {
        let n = self.strands.len();
        let Mixed {
            nodes,
            points,
            w,
            high,
            ends,
            row: known,
        } = mixed;
        points.clear();
        points.extend(nodes.iter().map(|i| point(*i)));
        w.clear();
        w.resize(n * points.len(), 0.0);
        self.weights.values(points, w);
        high.clear();
        high.resize(n * points.len(), 0.0);
        for (s, strand) in self.strands.iter().enumerate() {
            let high = &mut high[s * points.len()..][..points.len()];
            match strand.uniform() {
                Some(v) => high.fill(v),
                None if (0..points.len()).any(|i| w[i * n + s] > 0.0) => strand.highs(points, high),
                None => {}
            }
        }
        let graded = self.levels.as_ref().is_some_and(|l| !l.is_uniform());
        ends.clear();
        ends.resize(n, End::default());
        for (p, node) in nodes.iter().enumerate() {
            let w = &w[p * n..][..n];
            let high = |s: usize| high[s * points.len() + p];
            let mut sum = [0.0; 3];
            if let Some(s) = w.iter().position(|w| *w == 1.0) {
                let high = high(s);
                sum = [core(s, *node), self.strands[s].low_alone(high), high];
            } else {
                for (s, strand) in self.strands.iter().enumerate().filter(|(s, _)| w[*s] > 0.0) {
                    let high = high(s);
                    sum[0] += w[s] * core(s, *node);
                    sum[1] += w[s] * strand.low(high);
                    sum[2] += w[s] * high;
                    if graded {
                        ends[s].quantiles = strand.quantiles(high);
                    }
                }
                if let Some(levels) = &self.levels {
                    let more = levels.added_in_row(&self.strands, points[p], w, ends, known);
                    sum = [sum[0], sum[1] + more[0], sum[2] + more[1]];
                }
            }
            row[*node] = self.value_of(sum) as f32;
        }
    }
}

/// Buffers for the nodes where several lattices may be.
#[derive(Default)]
struct Mixed {
    nodes: Vec<usize>,
    points: Vec<Vec3>,
    /// Shares, those of a node side by side.
    w: Vec<f64>,
    /// Upper ends, those of a lattice side by side.
    high: Vec<f64>,
    ends: Vec<End>,
    row: Row,
}
