//! What is added to the ends of a blend at a point: levels between neighbourhoods and between shares.
//!
//! Everything is linear between the tables (`levels`) of the neighbourhoods about a point, and between their nodes.

use super::levels::{Levels, blended};
use super::near::Near;
use super::quantile::{Spot, add_times, quantile};
use super::simplex::Place;
use super::strand::Strand;
use super::table::Table;
use geometry::math::{Vec3, add, scale, sub};

/// The ends of what is solid: the lower, the upper.
pub(super) const LOW: usize = 0;
pub(super) const HIGH: usize = 1;

/// The quantiles of a lattice's ends at a point, and their gradients (per mm).
#[derive(Clone, Copy, Default)]
pub(super) struct End {
    pub quantiles: [f64; 2],
    pub slopes: [Vec3; 2],
}

/// What is found at a point on the way to its value.
#[derive(Default)]
pub(super) struct At {
    /// Where the shares lie.
    pub place: Place,
    /// The quantiles of the lattices, where they vary.
    pub q: Vec<[f64; 2]>,
    terms: Vec<Term>,
}

/// A node's part in what is added: how often its number counts and, of a quantile function, at which share. (No enum: read
/// ahead of its tag, a small whole number would be taken for a subnormal one, and those are slow.)
#[derive(Clone, Copy)]
struct Term {
    node: usize,
    times: f64,
    q: f64,
}

/// What is known of a row along x, so that its points need not ask all neighbourhoods anew.
pub(super) struct Row {
    /// For each node along x: between which neighbourhoods it lies, counted from the first, and the share of the second.
    along: Vec<([usize; 2], f64)>,
    beside: Beside,
    /// For each neighbourhood along x what is added to the ends at each node of the table, NaN where nobody has asked; or,
    /// where levels vary, quantile functions.
    ends: Vec<[f32; 2]>,
    curves: Vec<Table>,
}

/// The neighbourhoods adjacent to a row.
struct Beside {
    /// The first along x.
    first: usize,
    /// Between which along y and z the row lies; none before the first row.
    across: Option<[(usize, f64); 2]>,
    /// What those of one number along y say at the row's z, for each along x; and that number. Even ones and odd ones, as rows
    /// lie between one of each.
    sides: [(Option<usize>, Vec<Table>); 2],
}

impl Row {
    /// Rows with nodes at these x.
    pub fn new(levels: &Levels, xs: &[f64]) -> Row {
        let last = levels.joint.shape[0] - 1;
        let along = |x: &f64| {
            let (n, share, _) = levels.joint.along(0, *x);
            ([n, (n + 1).min(last)], share)
        };
        let mut along: Vec<_> = xs.iter().map(along).collect();
        let first = along.first().map_or(0, |a| a.0[0]);
        let columns = along.last().map_or(0, |a| a.0[1] + 1 - first);
        along.iter_mut().for_each(|a| a.0 = a.0.map(|n| n - first));
        let (ends, curves) = match levels.is_uniform() {
            true => (columns * levels.grid.len(), 0),
            false => (0, columns),
        };
        let tables = |n: usize| (0..n).map(|_| levels.table()).collect::<Vec<_>>();
        Row {
            along,
            beside: Beside { first, across: None, sides: [0, 1].map(|_| (None, tables(columns))) },
            ends: vec![[f32::NAN; 2]; ends],
            curves: tables(curves),
        }
    }

    /// Begins the row at this y and z.
    pub fn enter(&mut self, levels: &Levels, at: [f64; 2]) {
        let across = [0, 1].map(|a| {
            let (n, share, _) = levels.joint.along(a + 1, at[a]);
            (n, share)
        });
        let beside = &mut self.beside;
        // Of one neighbourhood that serves all, everything is known already.
        if beside.across == Some(across) {
            return;
        }
        if beside.across.is_none_or(|a| a[1] != across[1]) {
            beside.sides.iter_mut().for_each(|side| side.0 = None);
        }
        beside.across = Some(across);
        self.ends.fill([f32::NAN; 2]);
        self.curves.iter_mut().for_each(Table::clear);
    }
}

impl Beside {
    /// Adds a node's numbers at a neighbourhood along x, between those along y and z.
    fn between(&mut self, levels: &Levels, strands: &[Strand], (column, node): (usize, usize), out: &mut [f32]) {
        let [nx, ny, _] = levels.joint.shape;
        let Some(across) = self.across else { return };
        let [y, z] = across.map(|(n, t)| [(n, 1.0 - t), (n + 1, t)]);
        for (j, share) in y.into_iter().filter(|y| y.1 > 0.0) {
            let (number, tables) = &mut self.sides[j % 2];
            if *number != Some(j) {
                *number = Some(j);
                tables.iter_mut().for_each(Table::clear);
            }
            let of_side = tables[column].get_or(node, |out| {
                for (k, share) in z.into_iter().filter(|z| z.1 > 0.0) {
                    let i = (k * ny + j) * nx + self.first + column;
                    add_times(out, share as f32, levels.numbers(i, strands, node));
                }
            });
            add_times(out, share as f32, of_side);
        }
    }
}

impl Levels {
    /// What is added to Σ wᵢ loᵢ or Σ wᵢ hiᵢ at a point with shares `w`, which lie at a place and have quantiles.
    pub fn added(&self, strands: &[Strand], p: Vec3, w: &[f64], at: &mut At, end: usize) -> f64 {
        let mut sum = self.terms(strands, w, at, end);
        for (i, near, _) in self.joint.corners(p).iter().filter(|c| c.1 > 0.0) {
            for t in &at.terms {
                let numbers = self.numbers(*i, strands, t.node);
                sum += near * t.times * self.ask(numbers, end, t.q).0;
            }
        }
        sum
    }

    /// The same at the i-th node of a row that has been entered: of shares that lie at `nodes`, with these multiplicities; where no
    /// level varies.
    #[inline(always)]
    pub fn added_in_row(
        &self,
        strands: &[Strand],
        i: usize,
        (nodes, times): (&[f64], &[f64]),
        row: &mut Row,
        end: usize,
    ) -> f64 {
        let (columns, share) = row.along[i];
        let size = self.grid.len();
        let [first, second] = columns.map(|c| &row.ends[c * size..][..size]);
        let each = nodes.iter().zip(times).map(|(node, times)| {
            let node = node.to_bits() as usize;
            let [a, b] = [first, second].map(|of| f64::from(of[node][end]));
            times * ((1.0 - share) * a + share * b)
        });
        let sum: f64 = each.sum();
        match sum.is_nan() {
            true => self.found_in_row(strands, i, (nodes, times), row, end),
            false => sum,
        }
    }

    /// The same where some of it has to be found first.
    #[cold]
    fn found_in_row(
        &self,
        strands: &[Strand],
        i: usize,
        (nodes, times): (&[f64], &[f64]),
        row: &mut Row,
        end: usize,
    ) -> f64 {
        let (columns, share) = row.along[i];
        let near = [1.0 - share, share];
        // What counts nothing need not be known; else the same sum to the last bit.
        let each = nodes.iter().zip(times).filter(|n| *n.1 != 0.0).map(|(node, times)| {
            let node = node.to_bits() as usize;
            let [a, b] = [0, 1].map(|c| {
                let known = &mut row.ends[columns[c] * self.grid.len() + node];
                if near[c] > 0.0 && known[end].is_nan() {
                    *known = [0.0; 2];
                    row.beside.between(self, strands, (columns[c], node), known);
                }
                if near[c] > 0.0 { f64::from(known[end]) } else { 0.0 }
            });
            times * (near[0] * a + near[1] * b)
        });
        each.sum()
    }

    /// The same where levels vary; `w` are the shares and `q` the lattices' quantiles.
    #[inline(always)]
    pub fn added_by_curves(
        &self,
        strands: &[Strand],
        i: usize,
        (w, nodes, times, q): (&[f64], &[f64], &[f64], impl Fn(usize) -> [f64; 2]),
        row: &mut Row,
        end: usize,
    ) -> f64 {
        let (columns, share) = row.along[i];
        let columns = || (columns.into_iter().zip([1.0 - share, share])).filter(|c| c.1 > 0.0);
        let Row { beside, curves, .. } = row;
        // A quantile function's value at a spot, between the two neighbourhoods.
        let mut ask = |node: usize, spot: Spot| -> f64 {
            let each = columns().map(|(column, near)| {
                let curve = curves[column].get_or(node, |out| {
                    beside.between(self, strands, (column, node), out);
                });
                near * spot.ask(curve).0
            });
            each.sum()
        };
        let mut sum = 0.0;
        let own = Spot::of(blended(w, (0..w.len()).map(&q))[end]);
        for (node, times) in nodes.iter().zip(times).filter(|n| *n.1 != 0.0) {
            sum += times * ask(node.to_bits() as usize, own);
        }
        for (s, strand) in strands.iter().enumerate().filter(|(s, _)| w[*s] > 0.0) {
            let base = match end == HIGH || strand.is_sheet() {
                true => ask(self.alone[s], Spot::of(q(s)[end])),
                false => strand.low(0.0),
            };
            sum -= w[s] * base;
        }
        sum
    }

    /// What is added to an end by the numbers of a node (at the share q), and how it changes with that.
    #[inline(always)]
    fn ask(&self, numbers: &[f32], end: usize, q: f64) -> (f64, f64) {
        match self.is_uniform() {
            true => (f64::from(numbers[end]), 0.0),
            false => quantile(numbers, q),
        }
    }

    /// Finds which nodes have a part in what is added to an end; what is added besides.
    fn terms(&self, strands: &[Strand], w: &[f64], at: &mut At, end: usize) -> f64 {
        let At { place, q, terms } = at;
        let own = match self.is_uniform() {
            true => 0.0,
            false => blended(w, q.iter().copied())[end],
        };
        terms.clear();
        let nodes = place.nodes.iter().zip(&place.shares);
        terms.extend(nodes.map(|(node, times)| Term { node: *node, times: *times, q: own }));
        let mut more = 0.0;
        if !self.is_uniform() {
            for (i, s) in strands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                if end == HIGH || s.is_sheet() {
                    terms.push(Term { node: self.alone[i], times: -w[i], q: q[i][end] });
                } else {
                    more -= w[i] * s.low(0.0);
                }
            }
        }
        more
    }

    /// The same with its gradient (per mm); `near` is what is known about the point, `dw` are the gradients of the shares.
    /// Tables are added up at each neighbourhood first, each as often as it counts there; between the neighbourhoods
    /// everything is linear.
    #[inline(always)]
    pub fn added_gradients<const C: usize>(
        &self,
        strands: &[Strand],
        near: &mut Near<C>,
        (w, dw, place): (&[f64], &[Vec3], &Place),
        ends: &[End],
        end: usize,
    ) -> (f64, Vec3) {
        let uniform = self.is_uniform();
        let (own, dq) = match uniform {
            true => (Spot::of(0.0), [0.0; 3]),
            false => {
                let (q, dq) = blended_gradient(w, dw, ends, end);
                (Spot::of(q), dq)
            }
        };
        let (mut sum, mut steep) = ([0.0; C], [0.0; C]);
        let (mut low, mut gradient, mut before) = (0.0, [0.0; 3], [0.0; C]);
        for (l, (node, share)) in place.nodes.iter().zip(&place.shares).enumerate() {
            let v = match uniform {
                true => near.end(*node, end),
                false => {
                    let (v, slope) = near.curve(*node, own);
                    add_to(&mut steep, *share, &slope);
                    v
                }
            };
            add_to(&mut sum, *share, &v);
            if l > 0 {
                // ∇y of the axis on which this node follows the last: m Σ ∇w from it on.
                let from = place.axes[l - 1] + 1;
                let dy = dw[from..].iter().fold([0.0; 3], |a, b| add(a, *b));
                let rise = core::array::from_fn(|c| v[c] - before[c]);
                let rise = self.grid.steps() as f64 * near.value(&rise);
                gradient = add(gradient, scale(dy, rise));
            }
            before = v;
        }
        if !uniform {
            gradient = add(gradient, scale(dq, near.value(&steep)));
            for (i, s) in strands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                if end == HIGH || s.is_sheet() {
                    let spot = Spot::of(ends[i].quantiles[end]);
                    let (v, slope) = near.curve(self.alone[i], spot);
                    add_to(&mut sum, -w[i], &v);
                    let own = scale(ends[i].slopes[end], w[i] * near.value(&slope));
                    gradient = sub(gradient, add(scale(dw[i], near.value(&v)), own));
                } else {
                    low -= w[i] * s.low(0.0);
                    gradient = sub(gradient, scale(dw[i], s.low(0.0)));
                }
            }
        }
        let (v, d) = near.gradient(&sum);
        (low + v, add(gradient, d))
    }
}

/// Adds a multiple of each number.
#[inline(always)]
fn add_to<const C: usize>(sum: &mut [f64; C], times: f64, v: &[f64; C]) {
    sum.iter_mut().zip(v).for_each(|(s, v)| *s += times * v);
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
