//! The levels at which a blend holds the fraction asked for.
//!
//! The blend is solid where LO ≤ F ≤ HI with F = Σ wᵢ gᵢ. Let T(w, q) be the quantile function of F over a window: F < T(w, q) in a
//! fraction q of it. With the quantiles [aᵢ, bᵢ] of each lattice alone,
//!
//! > LO = T(w, Σ wᵢ aᵢ), HI = T(w, Σ wᵢ bᵢ),
//!
//! so that the fraction is Σ wᵢ (bᵢ − aᵢ), the mean of those asked for, whatever the cells. What is stored at the nodes of a grid
//! over w, for every window, is where no quantile varies the *offset* LO − Σ wᵢ loᵢ and HI − Σ wᵢ hiᵢ, and else T itself at
//! `SEGMENTS` + 1 fractions; between nodes and between windows both are linear. The offset is 0 where one lattice is alone:
//! sampled values at such nodes are subtracted, so the error of sampling is none there.

use std::sync::OnceLock;

use super::empirical::{Empirical, SEGMENTS, add_times, quantile};
use super::ends::{EndQuantiles, blended};
use super::node_table::NodeTable;
use super::share_grid::ShareGrid;
use super::summand::Summand;
use super::weights::Weights;
use super::windows::Windows;
use geometry::math::{Aabb, Interval, Vec3, add, scale};

/// The least interval that contains the numbers.
fn hull(of: impl Iterator<Item = f64>) -> Interval {
    of.fold(Interval::new(f64::INFINITY, f64::NEG_INFINITY), |r, v| Interval::new(r.lo.min(v), r.hi.max(v)))
}

/// Largest number of windows that are evaluated for the bound of a box.
const BOUND_WINDOWS: usize = 64;

/// What is tabulated of one window.
pub(super) struct WindowTables {
    /// The quantiles of each summand's ends, from its samples; zeros of lattices, whose quantiles are known.
    own: Vec<[f64; 2]>,
    /// At the nodes that the shares near the window need.
    near: NodeTable,
    /// At all nodes, once a point farther away needs another one.
    all: OnceLock<NodeTable>,
}

/// The levels of a blend by fraction.
pub(super) struct BlendLevels {
    pub windows: Windows,
    weights: Weights,
    pub grid: ShareGrid,
    /// The shares at each node.
    nodes: Vec<Vec<f64>>,
    /// Whether any summand is a sheet, so that there is a lower end.
    two_sided: bool,
    /// The quantiles of each summand, where none varies; `None` of fields that are no lattices. Tables then hold offsets, else
    /// quantile functions.
    uniform: Option<Vec<Option<[f64; 2]>>>,
    tables: Vec<OnceLock<WindowTables>>,
    /// The node at which each summand is alone.
    pub alone: Vec<usize>,
}

impl BlendLevels {
    pub fn new(summands: &[Summand], windows: Windows, weights: &Weights) -> BlendLevels {
        let n = summands.len();
        let grid = ShareGrid::new(n);
        let (mut alone, mut nodes) = (vec![0; n], vec![Vec::new(); grid.len()]);
        grid.each_node(|node, w| {
            nodes[node] = w.to_vec();
            if let Some(i) = w.iter().position(|w| *w == 1.0) {
                alone[i] = node;
            }
        });
        let quantiles = |s: &Summand| Some(s.quantiles(s.uniform_upper_end()?));
        BlendLevels {
            two_sided: summands.iter().any(Summand::is_sheet),
            uniform: summands.iter().map(quantiles).collect(),
            tables: (0..windows.len()).map(|_| OnceLock::new()).collect(),
            windows,
            weights: weights.clone(),
            grid,
            nodes,
            alone,
        }
    }

    /// Whether no quantile varies, so that tables hold offsets.
    pub fn is_uniform(&self) -> bool {
        self.uniform.is_some()
    }

    /// An empty table.
    pub fn empty_table(&self) -> NodeTable {
        let width = if self.is_uniform() { 2 } else { SEGMENTS + 1 };
        NodeTable::new(self.nodes.len(), width)
    }

    /// The nodes between which is interpolated where shares are within `w`: those with every y less than a step beyond its range.
    fn nodes_within(&self, w: &[Interval]) -> Vec<usize> {
        let step = (1.0 + 1e-9) / self.grid.steps() as f64;
        let mut within = vec![Interval::new(0.0, 0.0); w.len()];
        let mut sum = [-step, step];
        for (r, w) in within.iter_mut().zip(w).rev() {
            sum = [sum[0] + w.lo, sum[1] + w.hi];
            *r = Interval::new(sum[0], sum[1]);
        }
        let within_step = |node: &usize| {
            let mut y = 0.0;
            (1..w.len()).rev().all(|k| {
                y += self.nodes[*node][k];
                y > within[k].lo && y < within[k].hi
            })
        };
        (0..self.nodes.len()).filter(within_step).collect()
    }

    /// The shares in the box of the points that a window is interpolated to.
    fn shares_about(&self, i: usize) -> Vec<Interval> {
        let mut w = vec![Interval::new(0.0, 1.0); self.weights.len()];
        if self.windows.len() > 1 {
            self.weights.bound(&self.windows.support(i), &mut w);
        }
        w
    }

    /// The tables of a window, made when they are first needed.
    #[inline]
    fn tables(&self, window: usize, summands: &[Summand]) -> &WindowTables {
        self.tables[window].get_or_init(|| {
            let (positions, samples) = self.samples(window, summands);
            let of = |(s, of): (&Summand, &Vec<f32>)| match s.lattice() {
                Some(_) => [0.0; 2],
                None => s.empirical_quantiles(&positions, of),
            };
            let own: Vec<[f64; 2]> = summands.iter().zip(&samples).map(of).collect();
            WindowTables {
                near: self.tabulate(summands, &samples, &own, &self.nodes_within(&self.shares_about(window))),
                own,
                all: OnceLock::new(),
            }
        })
    }

    /// The sample positions of a window (mm), and each summand's values there.
    fn samples(&self, window: usize, summands: &[Summand]) -> (Vec<Vec3>, Vec<Vec<f32>>) {
        let positions = self.windows.samples(window);
        let samples = summands.iter().map(|s| s.single_values(&positions)).collect();
        (positions, samples)
    }

    /// What is tabulated at a node for a window: both offsets, or a quantile function.
    #[inline]
    pub fn node_values(&self, window: usize, summands: &[Summand], node: usize) -> &[f32] {
        let tables = self.tables(window, summands);
        tables.near.get(node).unwrap_or_else(|| self.other_node_values(window, summands, node))
    }

    /// The same of a node that the shares near the window do not need.
    #[cold]
    fn other_node_values(&self, window: usize, summands: &[Summand], node: usize) -> &[f32] {
        let tables = self.tables(window, summands);
        let all = tables.all.get_or_init(|| {
            let nodes: Vec<usize> = (0..self.nodes.len()).collect();
            self.tabulate(summands, &self.samples(window, summands).1, &tables.own, &nodes)
        });
        all.get(node).unwrap_or(&[0.0; SEGMENTS + 1])
    }

    /// The table of some nodes and of those where one summand is alone, from the values of all summands at the same positions.
    fn tabulate(&self, summands: &[Summand], samples: &[Vec<f32>], own: &[[f64; 2]], wanted: &[usize]) -> NodeTable {
        let mut table = self.empty_table();
        let exact: Option<Vec<[f64; 2]>> = self.uniform.as_ref().map(|uniform| {
            let each = uniform.iter().zip(own);
            each.map(|(q, own)| q.unwrap_or(*own)).collect()
        });
        let mut ends: Vec<(usize, [f64; 2])> = Vec::new();
        let mut sum = vec![0f32; samples[0].len()];
        let others = wanted.iter().filter(|n| !self.alone.contains(n));
        for &node in self.alone.iter().chain(others) {
            let w = &self.nodes[node];
            sum.fill(0.0);
            for (w, s) in w.iter().zip(samples).filter(|(w, _)| **w > 0.0) {
                add_times(&mut sum, *w as f32, s);
            }
            let distribution = Empirical::new(&sum);
            let Some(exact) = &exact else {
                distribution.tabulate(table.insert(node));
                continue;
            };
            let [a, b] = blended(w, exact.iter().copied());
            let low = match self.two_sided {
                true => distribution.quantile(a) + a.min(0.0) * distribution.range(),
                false => 0.0,
            };
            ends.push((node, [low, distribution.quantile(b)]));
        }
        // The ends of each summand alone are subtracted: sampled ones, but for the lower end of a network, which is no quantile.
        let base: Vec<[f64; 2]> = ends
            .iter()
            .zip(summands)
            .map(|((_, [low, high]), s)| {
                let low = if s.is_sheet() { *low } else { s.lower_end(0.0) };
                [low, *high]
            })
            .collect();
        for (node, ends) in ends {
            let offset = |e: usize| {
                let each = self.nodes[node].iter().zip(&base);
                ends[e] - each.map(|(w, base)| w * base[e]).sum::<f64>()
            };
            table.insert(node).copy_from_slice(&[offset(0) as f32, offset(1) as f32]);
        }
        table
    }

    /// The quantiles of summand `i` about a point (mm) and their gradients, from its samples.
    pub fn measured_quantiles(&self, summands: &[Summand], p: Vec3, i: usize) -> EndQuantiles {
        let near = self.windows.adjacent(p);
        let near = near.iter().filter(|c| c.1 > 0.0 || c.2 != [0.0; 3]);
        near.fold(EndQuantiles::default(), |mut end, (n, share, slope)| {
            let own = self.tables(*n, summands).own[i];
            for (e, own) in own.into_iter().enumerate() {
                end.quantiles[e] += share * own;
                end.slopes[e] = add(end.slopes[e], scale(*slope, own));
            }
            end
        })
    }

    /// Intervals that contain the offsets of both ends in a box, where shares are within `w` and upper ends within `highs`.
    /// Interpolated values lie between those at the windows and nodes about.
    pub fn bound(&self, summands: &[Summand], b: &Aabb, w: &[Interval], highs: &[Interval]) -> [Interval; 2] {
        let all = [Interval::new(f64::NEG_INFINITY, f64::INFINITY); 2];
        // Nothing is gained from a box of several cells.
        if self.windows.count_in(b).is_none_or(|c| c > BOUND_WINDOWS) {
            return all;
        }
        let (mut near, mut out) = (Vec::new(), None);
        self.windows.each_in(b, |i| {
            if self.shares_about(i).iter().any(|w| w.lo == 1.0) {
                // Where one summand is alone the offset is 0.
                out = Some([Interval::new(0.0, 0.0); 2]);
            } else {
                near.push(self.tables(i, summands));
            }
        });
        let nodes = self.nodes_within(w);
        let q: Vec<[Interval; 2]> = (0..w.len())
            .map(|i| match [highs[i].lo, highs[i].hi].map(|h| summands[i].quantiles(h)) {
                [Some(lo), Some(hi)] => [0, 1].map(|e| hull([lo[e], hi[e]].into_iter())),
                _ => [0, 1].map(|e| hull(near.iter().map(|s| s.own[i][e]))),
            })
            .collect();
        for tables in near {
            let known: Vec<&[f32]> = nodes.iter().filter_map(|n| tables.near.get(*n)).collect();
            if known.is_empty() {
                continue;
            }
            let here = if self.is_uniform() {
                [0, 1].map(|e| hull(known.iter().map(|v| f64::from(v[e]))))
            } else {
                self.bound_by_quantiles(summands, &tables.near, &known, w, &q)
            };
            out = Some(out.map_or(here, |o: [Interval; 2]| [o[0].union(here[0]), o[1].union(here[1])]));
        }
        out.unwrap_or(all)
    }

    /// The same of one window where tables hold quantile functions; those of the nodes about are `known`.
    fn bound_by_quantiles(
        &self,
        summands: &[Summand],
        table: &NodeTable,
        known: &[&[f32]],
        w: &[Interval],
        q: &[[Interval; 2]],
    ) -> [Interval; 2] {
        let (mut a, mut p) = (Interval::new(0.0, 0.0), Interval::new(0.0, 0.0));
        for (w, [lo, hi]) in w.iter().zip(q) {
            let from = lo.max(Interval::new(0.0, 0.0));
            let share = Interval::new((hi.lo - from.hi).max(0.0), hi.hi - from.lo);
            (a, p) = (a + w.times(*lo), p + w.times(share));
        }
        let top = a.max(Interval::new(0.0, 0.0)) + p;
        let mut found = [a, top].map(|q| {
            let [lo, hi] = [q.lo, q.hi].map(|q| hull(known.iter().map(|v| quantile(v, q))));
            Interval::new(lo.lo, hi.hi)
        });
        for (i, s) in summands.iter().enumerate().filter(|(i, _)| w[*i].hi > 0.0) {
            for e in 0..2 {
                let base = match table.get(self.alone[i]) {
                    Some(v) if e == 1 || s.is_sheet() => {
                        Interval::new(quantile(v, q[i][e].lo), quantile(v, q[i][e].hi))
                    }
                    _ => Interval::new(s.lower_end(0.0), s.lower_end(0.0)),
                };
                found[e] = found[e] - w[i].times(base);
            }
        }
        found
    }
}
