//! The offset of a blend's ends from Σ wᵢ loᵢ and Σ wᵢ hiᵢ at a point, with its gradient: interpolated between windows and between
//! the nodes of the shares' grid (`levels`).
//!
//! Where no level varies tables hold the offsets. Else they hold quantile functions T of every node, and the offset is
//! Σ λₗ Tₗ(Q) − Σ wᵢ Tᵢ(qᵢ), with λ the barycentric coordinates of the shares, Q the blended quantile (`ends::blended`), Tᵢ the function
//! of the node where lattice i is alone and qᵢ its own quantile.

use super::empirical::{QuantileSegment, quantile};
use super::ends::{EndQuantiles, HIGH, blended, blended_gradient};
use super::levels::BlendLevels;
use super::share_grid::ShareSimplex;
use super::summand::Summand;
use super::window_cache::WindowCache;
use geometry::math::{Vec3, add, scale, sub};

/// Where a point lies in the tables, and buffers.
#[derive(Default)]
pub(super) struct Position {
    /// The simplex of its shares.
    pub simplex: ShareSimplex,
    /// The quantiles of the lattices, where levels vary.
    pub quantiles: Vec<[f64; 2]>,
    terms: Vec<OffsetTerm>,
}

/// A node's term in an offset: the factor of its number and, of a quantile function, the fraction at which it is evaluated. (Not an
/// enum: read before its tag, a small integer would be taken for a subnormal float, and those are slow.)
#[derive(Clone, Copy)]
struct OffsetTerm {
    node: usize,
    factor: f64,
    q: f64,
}

impl BlendLevels {
    /// The offset of an end at a point (mm) with shares `w`, whose position in the tables is `at`.
    pub fn offset(&self, summands: &[Summand], p: Vec3, w: &[f64], at: &mut Position, end: usize) -> f64 {
        let mut sum = self.terms(summands, w, at, end);
        for (i, weight, _) in self.windows.adjacent(p).iter().filter(|c| c.1 > 0.0) {
            for t in &at.terms {
                let numbers = self.node_values(*i, summands, t.node);
                sum += weight * t.factor * self.number(numbers, end, t.q);
            }
        }
        sum
    }

    /// A node's number for an end: its offset, or its quantile function at q.
    #[inline(always)]
    fn number(&self, numbers: &[f32], end: usize, q: f64) -> f64 {
        match self.is_uniform() {
            true => f64::from(numbers[end]),
            false => quantile(numbers, q),
        }
    }

    /// Lists the terms of an offset; returns the constant in addition to them.
    fn terms(&self, summands: &[Summand], w: &[f64], at: &mut Position, end: usize) -> f64 {
        let Position { simplex, quantiles, terms } = at;
        let own = match self.is_uniform() {
            true => 0.0,
            false => blended(w, quantiles.iter().copied())[end],
        };
        terms.clear();
        let nodes = simplex.nodes.iter().zip(&simplex.coordinates);
        terms.extend(nodes.map(|(node, factor)| OffsetTerm { node: *node, factor: *factor, q: own }));
        let mut constant = 0.0;
        if !self.is_uniform() {
            for (i, s) in summands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                if end == HIGH || s.is_sheet() {
                    terms.push(OffsetTerm { node: self.alone[i], factor: -w[i], q: quantiles[i][end] });
                } else {
                    constant -= w[i] * s.lower_end(0.0);
                }
            }
        }
        constant
    }

    /// The offset of an end and its gradient (per mm) at the point of `windows`; `dw` are the gradients of the shares. Terms are
    /// summed for each window first, and interpolated between windows once.
    #[inline(always)]
    pub fn offset_gradients<const C: usize>(
        &self,
        summands: &[Summand],
        windows: &mut WindowCache<C>,
        (w, dw, simplex): (&[f64], &[Vec3], &ShareSimplex),
        ends: &[EndQuantiles],
        end: usize,
    ) -> (f64, Vec3) {
        let uniform = self.is_uniform();
        let (own, dq) = match uniform {
            true => (QuantileSegment::at(0.0), [0.0; 3]),
            false => {
                let (q, dq) = blended_gradient(w, dw, ends, end);
                (QuantileSegment::at(q), dq)
            }
        };
        let (mut sum, mut steep) = ([0.0; C], [0.0; C]);
        let (mut low, mut gradient, mut before) = (0.0, [0.0; 3], [0.0; C]);
        for (l, (node, coordinate)) in simplex.nodes.iter().zip(&simplex.coordinates).enumerate() {
            let v = match uniform {
                true => windows.offsets(*node, end),
                false => {
                    let (v, slope) = windows.quantiles(*node, own);
                    add_to(&mut steep, *coordinate, &slope);
                    v
                }
            };
            add_to(&mut sum, *coordinate, &v);
            if l > 0 {
                // m ∇(Σ w from k on) for the y_k that rises to this node from the last.
                let from = simplex.axes[l - 1] + 1;
                let dy = dw[from..].iter().fold([0.0; 3], |a, b| add(a, *b));
                let rise = core::array::from_fn(|c| v[c] - before[c]);
                let rise = self.grid.steps() as f64 * windows.interpolate(&rise);
                gradient = add(gradient, scale(dy, rise));
            }
            before = v;
        }
        if !uniform {
            gradient = add(gradient, scale(dq, windows.interpolate(&steep)));
            for (i, s) in summands.iter().enumerate().filter(|(i, _)| w[*i] > 0.0) {
                if end == HIGH || s.is_sheet() {
                    let segment = QuantileSegment::at(ends[i].quantiles[end]);
                    let (v, slope) = windows.quantiles(self.alone[i], segment);
                    add_to(&mut sum, -w[i], &v);
                    let own = scale(ends[i].slopes[end], w[i] * windows.interpolate(&slope));
                    gradient = sub(gradient, add(scale(dw[i], windows.interpolate(&v)), own));
                } else {
                    low -= w[i] * s.lower_end(0.0);
                    gradient = sub(gradient, scale(dw[i], s.lower_end(0.0)));
                }
            }
        }
        let (v, d) = windows.interpolate_gradient(&sum);
        (low + v, add(gradient, d))
    }
}

/// Adds `factor` times each number.
#[inline(always)]
fn add_to<const C: usize>(sum: &mut [f64; C], factor: f64, v: &[f64; C]) {
    sum.iter_mut().zip(v).for_each(|(s, v)| *s += factor * v);
}
