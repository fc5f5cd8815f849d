//! The levels of a blend at which it holds the fraction that was asked for.
//!
//! The blended function F = Σ wᵢ gᵢ is solid where LO ≤ F ≤ HI. Of its own distribution, where it stands, that is an
//! interval of quantiles; each lattice alone is one too, [aᵢ, bᵢ] of its own. The blend takes [Σ wᵢ aᵢ, Σ wᵢ bᵢ]: then its
//! fraction is Σ wᵢ (bᵢ − aᵢ), the mean of those asked for, whatever the cells. The distribution of F for shares w is that
//! of the sum over places where the gᵢ are known together (`joint`); it is tabulated over w.
//!
//! What is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ is nothing where one lattice is alone, however coarsely it was sampled.

use std::sync::OnceLock;

use super::added::End;
use super::joint::Joint;
use super::quantile::{Counted, KNOTS, add_times, quantile};
use super::simplex::Grid;
use super::strand::Strand;
use super::table::Table;
use super::weights::Weights;
use geometry::math::{Aabb, Interval, Vec3, add, scale};

/// The quantiles of lattices at a point, [a, b] each, and those of a blend of them: the lower end Σ wᵢ aᵢ, and the upper so
/// far above it, or above none, as the fractions make.
pub(super) fn blended(w: &[f64], each: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut a, mut p) = (0.0, 0.0);
    for (w, [lo, hi]) in w.iter().zip(each) {
        a += w * lo;
        p += w * (hi - lo.max(0.0));
    }
    [a, a.max(0.0) + p]
}

/// The least interval that contains numbers.
fn hull(of: impl Iterator<Item = f64>) -> Interval {
    of.fold(Interval::new(f64::INFINITY, f64::NEG_INFINITY), |r, v| Interval::new(r.lo.min(v), r.hi.max(v)))
}

/// Most neighbourhoods that are asked for the bound of a box.
const MANY: usize = 64;

/// What is known of one neighbourhood.
pub(super) struct Station {
    /// The quantiles of each lattice, found by looking.
    own: Vec<[f64; 2]>,
    /// At the nodes that shares about here need.
    near: Table,
    /// At all nodes, once a point beyond needs them.
    whole: OnceLock<Table>,
}

/// The levels of a blend by fraction.
pub(super) struct Levels {
    pub joint: Joint,
    weights: Weights,
    pub grid: Grid,
    /// The shares at each node.
    nodes: Vec<Vec<f64>>,
    /// Whether there is a lower end anywhere.
    two_sided: bool,
    /// The quantiles of each lattice, where none varies; none of what is known by looking only. Then a table holds what is
    /// added to the ends, else quantile functions.
    uniform: Option<Vec<Option<[f64; 2]>>>,
    stations: Vec<OnceLock<Station>>,
    /// Numbers of the nodes at which one lattice is alone.
    pub alone: Vec<usize>,
}

impl Levels {
    pub fn new(strands: &[Strand], joint: Joint, weights: &Weights) -> Levels {
        let n = strands.len();
        let grid = Grid::new(n);
        let (mut alone, mut nodes) = (vec![0; n], vec![Vec::new(); grid.len()]);
        grid.each(|node, w| {
            nodes[node] = w.to_vec();
            if let Some(i) = w.iter().position(|w| *w == 1.0) {
                alone[i] = node;
            }
        });
        let quantiles = |s: &Strand| Some(s.quantiles(s.uniform()?));
        Levels {
            two_sided: strands.iter().any(Strand::is_sheet),
            uniform: strands.iter().map(quantiles).collect(),
            stations: (0..joint.len()).map(|_| OnceLock::new()).collect(),
            joint,
            weights: weights.clone(),
            grid,
            nodes,
            alone,
        }
    }

    /// Whether no quantile varies.
    pub fn is_uniform(&self) -> bool {
        self.uniform.is_some()
    }

    /// An empty table.
    pub fn table(&self) -> Table {
        let width = if self.is_uniform() { 2 } else { KNOTS + 1 };
        Table::new(self.nodes.len(), width)
    }

    /// The nodes whose tables are interpolated where shares are within `w`: those with no y a whole step beyond what there is.
    fn about(&self, w: &[Interval]) -> Vec<usize> {
        let step = (1.0 + 1e-9) / self.grid.steps() as f64;
        let mut within = vec![Interval::new(0.0, 0.0); w.len()];
        let mut sum = [-step, step];
        for (r, w) in within.iter_mut().zip(w).rev() {
            sum = [sum[0] + w.lo, sum[1] + w.hi];
            *r = Interval::new(sum[0], sum[1]);
        }
        let near = |node: &usize| {
            let mut y = 0.0;
            (1..w.len()).rev().all(|k| {
                y += self.nodes[*node][k];
                y > within[k].lo && y < within[k].hi
            })
        };
        (0..self.nodes.len()).filter(near).collect()
    }

    /// The shares in the box in which points ask a neighbourhood.
    fn shares(&self, i: usize) -> Vec<Interval> {
        let mut w = vec![Interval::new(0.0, 1.0); self.weights.len()];
        if self.joint.len() > 1 {
            self.weights.bound(&self.joint.support(i), &mut w);
        }
        w
    }

    #[inline]
    pub fn station(&self, i: usize, strands: &[Strand]) -> &Station {
        self.stations[i].get_or_init(|| {
            let (places, samples) = self.samples(i, strands);
            let of = |(s, of): (&Strand, &Vec<f32>)| s.quantiles_of(&places, of);
            let own: Vec<[f64; 2]> = strands.iter().zip(&samples).map(of).collect();
            Station {
                near: self.look(strands, &samples, &own, &self.about(&self.shares(i))),
                own,
                whole: OnceLock::new(),
            }
        })
    }

    fn samples(&self, i: usize, strands: &[Strand]) -> (Vec<Vec3>, Vec<Vec<f32>>) {
        let places = self.joint.places(i);
        let samples = strands.iter().map(|s| s.samples(&places)).collect();
        (places, samples)
    }

    /// The numbers of a node in a neighbourhood.
    #[inline]
    pub fn numbers(&self, i: usize, strands: &[Strand], node: usize) -> &[f32] {
        let station = self.station(i, strands);
        station.near.get(node).unwrap_or_else(|| self.far(i, strands, node))
    }

    /// The same of a node that shares nearby do not need.
    #[cold]
    fn far(&self, i: usize, strands: &[Strand], node: usize) -> &[f32] {
        let station = self.station(i, strands);
        let whole = station.whole.get_or_init(|| {
            let all: Vec<usize> = (0..self.nodes.len()).collect();
            self.look(strands, &self.samples(i, strands).1, &station.own, &all)
        });
        whole.get(node).unwrap_or(&[0.0; KNOTS + 1])
    }

    /// The table, at some nodes and where each lattice is alone, from the values of the lattices at the same places.
    fn look(&self, strands: &[Strand], samples: &[Vec<f32>], own: &[[f64; 2]], wanted: &[usize]) -> Table {
        let mut table = self.table();
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
            let counted = Counted::of(&sum);
            let Some(exact) = &exact else {
                counted.knots(table.add(node));
                continue;
            };
            let [a, b] = blended(w, exact.iter().copied());
            let low = match self.two_sided {
                true => counted.quantile(a) + a.min(0.0) * counted.whole(),
                false => 0.0,
            };
            ends.push((node, [low, counted.quantile(b)]));
        }
        // Less what it is where each lattice is alone; less all that is added of a network's lower end, which no quantile is.
        let base: Vec<[f64; 2]> = ends
            .iter()
            .zip(strands)
            .map(|((_, [low, high]), s)| {
                let low = if s.is_sheet() { *low } else { s.low(0.0) };
                [low, *high]
            })
            .collect();
        for (node, ends) in ends {
            let more = |e: usize| {
                let each = self.nodes[node].iter().zip(&base);
                ends[e] - each.map(|(w, base)| w * base[e]).sum::<f64>()
            };
            table.add(node).copy_from_slice(&[more(0) as f32, more(1) as f32]);
        }
        table
    }

    /// The quantiles of a field about a point, found by looking, and their gradients (per mm).
    pub fn found(&self, strands: &[Strand], p: Vec3, i: usize) -> End {
        let near = self.joint.corners(p);
        let near = near.iter().filter(|c| c.1 > 0.0 || c.2 != [0.0; 3]);
        near.fold(End::default(), |mut end, (n, share, slope)| {
            let own = self.station(*n, strands).own[i];
            for (e, own) in own.into_iter().enumerate() {
                end.quantiles[e] += share * own;
                end.slopes[e] = add(end.slopes[e], scale(*slope, own));
            }
            end
        })
    }

    /// Intervals that contain what is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ in a box, where shares are within `w` and upper ends
    /// within `highs`: everything is between what its tables have at the neighbourhoods and nodes about.
    pub fn bound(&self, strands: &[Strand], b: &Aabb, w: &[Interval], highs: &[Interval]) -> [Interval; 2] {
        let all = [Interval::new(f64::NEG_INFINITY, f64::INFINITY); 2];
        // A box of several cells has everything in it.
        if self.joint.count_in(b).is_none_or(|c| c > MANY) {
            return all;
        }
        let (mut near, mut out) = (Vec::new(), None);
        self.joint.each_in(b, |i| {
            if self.shares(i).iter().any(|w| w.lo == 1.0) {
                // Nobody asks where one lattice is alone: nothing is added.
                out = Some([Interval::new(0.0, 0.0); 2]);
            } else {
                near.push(self.station(i, strands));
            }
        });
        let nodes = self.about(w);
        let q: Vec<[Interval; 2]> = (0..w.len())
            .map(|i| match [highs[i].lo, highs[i].hi].map(|h| strands[i].quantiles(h)) {
                [Some(lo), Some(hi)] => [0, 1].map(|e| hull([lo[e], hi[e]].into_iter())),
                _ => [0, 1].map(|e| hull(near.iter().map(|s| s.own[i][e]))),
            })
            .collect();
        for station in near {
            let known: Vec<&[f32]> = nodes.iter().filter_map(|n| station.near.get(*n)).collect();
            if known.is_empty() {
                continue;
            }
            let here = if self.is_uniform() {
                [0, 1].map(|e| hull(known.iter().map(|v| f64::from(v[e]))))
            } else {
                self.curved_bound(strands, &station.near, &known, w, &q)
            };
            out = Some(out.map_or(here, |o: [Interval; 2]| [o[0].union(here[0]), o[1].union(here[1])]));
        }
        out.unwrap_or(all)
    }

    /// The same of one neighbourhood with quantile functions, those of the nodes about being `known`.
    fn curved_bound(
        &self,
        strands: &[Strand],
        table: &Table,
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
            let [lo, hi] = [q.lo, q.hi].map(|q| hull(known.iter().map(|v| quantile(v, q).0)));
            Interval::new(lo.lo, hi.hi)
        });
        for (i, s) in strands.iter().enumerate().filter(|(i, _)| w[*i].hi > 0.0) {
            for e in 0..2 {
                let base = match table.get(self.alone[i]) {
                    Some(v) if e == 1 || s.is_sheet() => {
                        Interval::new(quantile(v, q[i][e].lo).0, quantile(v, q[i][e].hi).0)
                    }
                    _ => Interval::new(s.low(0.0), s.low(0.0)),
                };
                found[e] = found[e] - w[i].times(base);
            }
        }
        found
    }
}
