//! What is added to the ends of a blend at a point: levels between neighbourhoods and between shares.
//!
//! Everything is linear between the tables (`levels`) of the neighbourhoods about a point, and between their nodes.

use super::levels::{Levels, blended};
use super::quantile::quantile;
use super::simplex::Place;
use super::strand::Strand;
use super::table::Table;
use crate::math::{Vec3, add, scale, sub};

/// The ends of what is solid: the lower, the upper.
pub(super) const LOW: usize = 0;
pub(super) const HIGH: usize = 1;

/// The quantiles of a lattice's ends at a point, and their gradients (per mm).
#[derive(Clone, Copy, Default)]
pub(super) struct End {
    pub quantiles: [f64; 2],
    pub slopes: [Vec3; 2],
}

/// What is asked of the numbers of a node.
#[derive(Clone, Copy)]
enum Ask {
    /// What is added to an end.
    End(usize),
    /// The value at a share.
    Quantile(f64),
}

impl Ask {
    /// The answer, and how it changes with the share.
    #[inline]
    fn of(self, numbers: &[f32]) -> (f64, f64) {
        match self {
            Ask::End(e) => (f64::from(numbers[e]), 0.0),
            Ask::Quantile(q) => quantile(numbers, q),
        }
    }
}

/// What is known of a row along x, so that its points need not ask all neighbourhoods anew.
#[derive(Default)]
pub(super) struct Row {
    /// For each neighbourhood along x the numbers there, between those along y and z, and for which y and z.
    columns: Vec<([f64; 2], Table)>,
}

impl Levels {
    /// What is added to Σ wᵢ loᵢ or Σ wᵢ hiᵢ at a point with shares `w`, which lie at `place`, and quantiles `q`.
    pub fn added(
        &self,
        strands: &[Strand],
        p: Vec3,
        (w, place): (&[f64], &Place),
        q: &[[f64; 2]],
        end: usize,
    ) -> f64 {
        let corners = self.joint.corners(p);
        self.level(strands, (w, place), q, end, |node, ask| {
            let near = corners.iter().filter(|c| c.1 > 0.0);
            near.map(|c| c.1 * ask.of(self.numbers(c.0, strands, node)).0)
                .sum()
        })
    }

    /// The same, its neighbours in a row having been asked before.
    pub fn added_in_row(
        &self,
        strands: &[Strand],
        p: Vec3,
        (w, place): (&[f64], &Place),
        q: &[[f64; 2]],
        end: usize,
        row: &mut Row,
    ) -> f64 {
        if row.columns.is_empty() {
            let column = |_| ([f64::NAN; 2], self.table());
            row.columns = (0..self.joint.shape[0]).map(column).collect();
        }
        let [x, y, z] = core::array::from_fn(|a| self.joint.along(a, p[a]));
        self.level(strands, (w, place), q, end, |node, ask| {
            let mut sum = 0.0;
            for (i, near) in [(x.0, 1.0 - x.1), (x.0 + 1, x.1)] {
                if near > 0.0 {
                    let (at, column) = &mut row.columns[i];
                    if *at != [p[1], p[2]] {
                        *at = [p[1], p[2]];
                        column.clear();
                    }
                    if column.get(node).is_none() {
                        let across = [(y.0, y.1), (z.0, z.1)];
                        self.between(strands, i, node, across, column.add(node));
                    }
                    sum += near * column.get(node).map_or(0.0, |v| ask.of(v).0);
                }
            }
            sum
        })
    }

    /// Adds a node's numbers at the i-th neighbourhood along x, between those along y and z.
    fn between(
        &self,
        strands: &[Strand],
        i: usize,
        node: usize,
        at: [(usize, f64); 2],
        out: &mut [f32],
    ) {
        let [nx, ny, _] = self.joint.shape;
        let [y, z] = at.map(|(n, t)| [(n, 1.0 - t), (n + 1, t)]);
        for (k, share_z) in z.into_iter().filter(|z| z.1 > 0.0) {
            for (j, share_y) in y.into_iter().filter(|y| y.1 > 0.0) {
                let numbers = self.numbers((k * ny + j) * nx + i, strands, node);
                let share = (share_y * share_z) as f32;
                out.iter_mut()
                    .zip(numbers)
                    .for_each(|(o, v)| *o += share * v);
            }
        }
    }

    /// What is added to an end, where `sum` puts together what the neighbourhoods answer for a node.
    fn level(
        &self,
        strands: &[Strand],
        (w, place): (&[f64], &Place),
        q: &[[f64; 2]],
        end: usize,
        mut sum: impl FnMut(usize, Ask) -> f64,
    ) -> f64 {
        let nodes = place.nodes.iter().zip(&place.shares);
        if self.is_uniform() {
            return nodes.map(|(n, s)| s * sum(*n, Ask::End(end))).sum();
        }
        let ask = Ask::Quantile(blended(w, q.iter().copied())[end]);
        let mut out: f64 = nodes.map(|(n, s)| s * sum(*n, ask)).sum();
        for (i, s) in strands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
            out -= w[i]
                * match end == HIGH || s.is_sheet() {
                    true => sum(self.alone[i], Ask::Quantile(q[i][end])),
                    false => s.low(0.0),
                };
        }
        out
    }

    /// The same with its gradient (per mm); `dw` are those of the shares.
    pub fn added_gradients(
        &self,
        strands: &[Strand],
        p: Vec3,
        (w, dw, place): (&[f64], &[Vec3], &Place),
        ends: &[End],
        end: usize,
    ) -> (f64, Vec3) {
        let corners = self.joint.corners(p);
        // What the neighbourhoods answer together, how that changes from place to place, and with the share.
        let sum = |node: usize, ask: Ask| {
            let (mut v, mut d, mut steep) = (0.0, [0.0; 3], 0.0);
            for (i, share, slope) in &corners {
                if *share > 0.0 || *slope != [0.0; 3] {
                    let of = ask.of(self.numbers(*i, strands, node));
                    v += share * of.0;
                    d = add(d, scale(*slope, of.0));
                    steep += share * of.1;
                }
            }
            (v, d, steep)
        };
        let (ask, dq) = if self.is_uniform() {
            (Ask::End(end), [0.0; 3])
        } else {
            let (q, dq) = blended_gradient(w, dw, ends, end);
            (Ask::Quantile(q), dq)
        };
        let (mut out, mut gradient, mut before) = (0.0, [0.0; 3], 0.0);
        for (l, (node, share)) in place.nodes.iter().zip(&place.shares).enumerate() {
            let (v, d, steep) = sum(*node, ask);
            out += share * v;
            gradient = add(gradient, scale(add(d, scale(dq, steep)), *share));
            if l > 0 {
                // ∇y of the axis on which this node follows the last: m Σ ∇w from it on.
                let from = place.axes[l - 1] + 1;
                let dy = dw[from..].iter().fold([0.0; 3], |a, b| add(a, *b));
                let rise = self.grid.steps() as f64 * (v - before);
                gradient = add(gradient, scale(dy, rise));
            }
            before = v;
        }
        if self.is_uniform() {
            return (out, gradient);
        }
        for (i, s) in strands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
            let (v, d) = if end == HIGH || s.is_sheet() {
                let (v, d, steep) = sum(self.alone[i], Ask::Quantile(ends[i].quantiles[end]));
                (v, add(d, scale(ends[i].slopes[end], steep)))
            } else {
                (s.low(0.0), [0.0; 3])
            };
            out -= w[i] * v;
            gradient = sub(gradient, add(scale(dw[i], v), scale(d, w[i])));
        }
        (out, gradient)
    }
}

/// One end of `blended` and its gradient (per mm).
fn blended_gradient(w: &[f64], dw: &[Vec3], ends: &[End], end: usize) -> (f64, Vec3) {
    let q = blended(w, ends.iter().map(|e| e.quantiles));
    let (mut da, mut dp) = ([0.0; 3], [0.0; 3]);
    for ((w, dw), e) in w.iter().zip(dw).zip(ends) {
        let ([lo, hi], [dlo, dhi]) = (e.quantiles, e.slopes);
        let (from, dfrom) = if lo > 0.0 { (lo, dlo) } else { (0.0, [0.0; 3]) };
        da = add(da, add(scale(*dw, lo), scale(dlo, *w)));
        dp = add(dp, add(scale(*dw, hi - from), scale(sub(dhi, dfrom), *w)));
    }
    match end {
        LOW => (q[LOW], da),
        _ if q[LOW] > 0.0 => (q[HIGH], add(da, dp)),
        _ => (q[HIGH], dp),
    }
}
