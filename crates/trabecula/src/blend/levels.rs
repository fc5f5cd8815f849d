//! The levels of a blend at which it holds the fraction that was asked for.
//!
//! The blended function F = Σ wᵢ gᵢ is solid where LO ≤ F ≤ HI. Of its own distribution, where it stands, that is an
//! interval of quantiles; each lattice alone is one too, [aᵢ, bᵢ] of its own. The blend takes [Σ wᵢ aᵢ, Σ wᵢ bᵢ]: then its
//! fraction is Σ wᵢ (bᵢ − aᵢ), the mean of those asked for, whatever the cells. The distribution of F for shares w is that
//! of the sum over places where the gᵢ are known together (`joint`); it is tabulated over w.
//!
//! What is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ is nothing where one lattice is alone, however coarsely it was looked at.

use std::sync::OnceLock;

use super::joint::Joint;
use super::quantile::{Counted, Curve, add_times};
use super::simplex::{Grid, Place};
use super::strand::{BELOW, Strand};
use super::weights::Weights;
use crate::math::{Aabb, Interval, Vec3, add, scale, sub};

/// The quantiles of lattices at a point, [a, b] each, and those of a blend of them: the lower end Σ wᵢ aᵢ, and the upper so
/// far above it, or above none, as the fractions make.
fn blended(w: &[f64], each: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut a, mut p) = (0.0, 0.0);
    for (w, [lo, hi]) in w.iter().zip(each) {
        a += w * lo;
        p += w * (hi - lo.max(0.0));
    }
    [a, a.max(0.0) + p]
}

/// The least interval that contains numbers.
fn hull(of: impl Iterator<Item = f64>) -> Interval {
    of.fold(Interval::new(f64::INFINITY, f64::NEG_INFINITY), |r, v| {
        Interval::new(r.lo.min(v), r.hi.max(v))
    })
}

/// Most neighbourhoods that are asked for the bound of a box.
const MANY: usize = 64;

/// What is known of one neighbourhood.
struct Station {
    /// Quantiles [a, b] of what has no table of its own, found by looking.
    own: Vec<[f64; 2]>,
    /// At the nodes that shares about here need.
    near: Table,
    /// At all nodes, once a point beyond needs them.
    whole: OnceLock<Table>,
}

/// Nodes that were not looked at have no numbers.
enum Table {
    /// For each node what is added to the lower and the upper end.
    Ends(Vec<[f64; 2]>),
    /// For each node the quantile function.
    Curves(Vec<Curve>),
}

impl Table {
    fn has(&self, node: usize) -> bool {
        match self {
            Table::Ends(ends) => !ends[node][0].is_nan(),
            Table::Curves(curves) => curves[node].is_known(),
        }
    }
}

/// A lattice of the blend at a point.
#[derive(Clone, Copy, Default)]
pub(super) struct End {
    /// Quantiles of the lower and the upper end; `None` if found by looking.
    pub quantiles: Option<[(f64, f64); 2]>,
    /// Gradient of the upper end, on which the quantiles depend.
    pub slope: Vec3,
}

/// What is known of a row along x, so that its points need not ask all neighbourhoods anew.
#[derive(Default)]
pub(super) struct Row {
    place: Place,
    at: [f64; 2],
    /// For each neighbourhood along x, and each node that was asked for, what is added to the ends.
    tables: Vec<Vec<[f64; 2]>>,
}

/// The levels of a blend by fraction.
pub(super) struct Levels {
    pub joint: Joint,
    weights: Weights,
    grid: Grid,
    /// The shares at each node.
    nodes: Vec<Vec<f64>>,
    /// Whether there is a lower end anywhere.
    two_sided: bool,
    /// The quantiles, where none varies.
    uniform: Option<Vec<End>>,
    stations: Vec<OnceLock<Station>>,
    /// Numbers of the nodes at which one lattice is alone.
    alone: Vec<usize>,
}

impl Levels {
    pub fn new(strands: &[Strand], joint: Joint, weights: &Weights) -> Levels {
        let n = strands.len();
        let ends = |s: &Strand| {
            let quantiles = s.quantiles(s.uniform()?);
            Some(End {
                quantiles,
                slope: [0.0; 3],
            })
        };
        let grid = Grid::new(n);
        let (mut alone, mut nodes) = (vec![0; n], vec![Vec::new(); grid.len()]);
        grid.each(|node, w| {
            nodes[node] = w.to_vec();
            if let Some(i) = w.iter().position(|w| *w == 1.0) {
                alone[i] = node;
            }
        });
        Levels {
            two_sided: strands.iter().any(Strand::is_sheet),
            uniform: strands.iter().map(ends).collect(),
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

    /// The nodes whose tables are interpolated where shares are within `w`: those with no y a whole step beyond what there is.
    fn about(&self, w: &[Interval]) -> Vec<bool> {
        let step = (1.0 + 1e-9) / self.grid.steps() as f64;
        let near = |node: &Vec<f64>| {
            (1..w.len()).all(|k| {
                let y: f64 = node[k..].iter().sum();
                let [lo, hi] = w[k..]
                    .iter()
                    .fold([0.0; 2], |s, w| [s[0] + w.lo, s[1] + w.hi]);
                y > lo - step && y < hi + step
            })
        };
        self.nodes.iter().map(near).collect()
    }

    /// The shares in the box in which points ask a neighbourhood.
    fn shares(&self, i: usize) -> Vec<Interval> {
        let mut w = vec![Interval::new(0.0, 1.0); self.weights.len()];
        if self.joint.len() > 1 {
            self.weights.bound(&self.joint.support(i), &mut w);
        }
        w
    }

    fn station(&self, i: usize, strands: &[Strand]) -> &Station {
        self.stations[i].get_or_init(|| {
            let samples = self.samples(i, strands);
            let own = samples.iter().map(|s| {
                let solid = s.iter().filter(|v| **v <= 0.0).count();
                [-BELOW, solid as f64 / s.len() as f64]
            });
            let own: Vec<[f64; 2]> = own.collect();
            Station {
                near: self.look(strands, &samples, &own, &self.about(&self.shares(i))),
                own,
                whole: OnceLock::new(),
            }
        })
    }

    fn samples(&self, i: usize, strands: &[Strand]) -> Vec<Vec<f32>> {
        let places = self.joint.places(i);
        strands.iter().map(|s| s.samples(&places)).collect()
    }

    /// A neighbourhood, and its table with numbers at these nodes.
    fn table(&self, i: usize, strands: &[Strand], nodes: &[usize]) -> (&Station, &Table) {
        let station = self.station(i, strands);
        if nodes.iter().all(|n| station.near.has(*n)) {
            return (station, &station.near);
        }
        let whole = station.whole.get_or_init(|| {
            let all = vec![true; self.nodes.len()];
            self.look(strands, &self.samples(i, strands), &station.own, &all)
        });
        (station, whole)
    }

    /// The table, at some nodes and where each lattice is alone, from the values of the lattices at the same places.
    fn look(
        &self,
        strands: &[Strand],
        samples: &[Vec<f32>],
        own: &[[f64; 2]],
        wanted: &[bool],
    ) -> Table {
        let mut sum = vec![0f32; samples[0].len()];
        let counted = self.nodes.iter().enumerate().map(|(node, w)| {
            (wanted[node] || self.alone.contains(&node)).then(|| {
                sum.fill(0.0);
                for (w, s) in w.iter().zip(samples).filter(|(w, _)| **w > 0.0) {
                    add_times(&mut sum, *w as f32, s);
                }
                Counted::of(&sum)
            })
        });
        let Some(uniform) = &self.uniform else {
            let curve = |c: Option<Counted>| c.map_or(Curve::UNKNOWN, |c| Curve::new(&c));
            return Table::Curves(counted.map(curve).collect());
        };
        let exact = uniform.iter().zip(own);
        let exact = exact.map(|(e, o)| e.quantiles.map_or(*o, |q| [q[0].0, q[1].0]));
        let exact: Vec<[f64; 2]> = exact.collect();
        let ends = counted.zip(&self.nodes).map(|(counted, w)| {
            let Some(counted) = counted else {
                return [f64::NAN; 2];
            };
            let [a, b] = blended(w, exact.iter().copied());
            let low = match self.two_sided {
                true => counted.quantile(a) + a.min(0.0) * counted.whole(),
                false => 0.0,
            };
            [low, counted.quantile(b)]
        });
        let mut ends: Vec<[f64; 2]> = ends.collect();
        // Less what it is where each lattice is alone; less all that is added of a network's lower end, which no quantile is.
        let alone = |i: usize| match ends[self.alone[i]] {
            sheet if strands[i].is_sheet() => sheet,
            [_, hi] => [strands[i].low(0.0), hi],
        };
        let base: Vec<[f64; 2]> = (0..strands.len()).map(alone).collect();
        for (ends, w) in ends.iter_mut().zip(&self.nodes) {
            for (w, base) in w.iter().zip(&base) {
                (0..2).for_each(|e| ends[e] -= w * base[e]);
            }
        }
        Table::Ends(ends)
    }

    /// The share of a field that is solid about a point, found by looking.
    pub fn share_found(&self, strands: &[Strand], p: Vec3, i: usize) -> f64 {
        let near = self.joint.corners(p);
        near.iter()
            .filter(|c| c.1 > 0.0)
            .map(|c| c.1 * self.station(c.0, strands).own[i][1])
            .sum()
    }

    /// What is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ at a point with shares `w`, its neighbours in a row having been asked before.
    pub fn added_in_row(
        &self,
        strands: &[Strand],
        p: Vec3,
        w: &[f64],
        ends: &[End],
        row: &mut Row,
    ) -> [f64; 2] {
        if self.uniform.is_none() {
            return self.added(strands, p, w, ends, &mut row.place);
        }
        if row.at != [p[1], p[2]] || row.tables.is_empty() {
            row.at = [p[1], p[2]];
            row.tables.resize(self.joint.shape[0], Vec::new());
            row.tables.iter_mut().for_each(Vec::clear);
        }
        self.grid.place(w, &mut row.place);
        let [x, y, z] = core::array::from_fn(|a| self.joint.along(a, p[a]));
        let mut out = [0.0; 2];
        for (i, near) in [(x.0, 1.0 - x.1), (x.0 + 1, x.1)] {
            if near <= 0.0 {
                continue;
            }
            let table = &mut row.tables[i];
            if table.is_empty() {
                table.resize(self.grid.len(), [f64::NAN; 2]);
            }
            for (n, share) in row.place.nodes.iter().zip(&row.place.shares) {
                let v = &mut table[*n];
                if v[0].is_nan() {
                    *v = self.across(strands, i, *n, [(y.0, y.1), (z.0, z.1)]);
                }
                (0..2).for_each(|e| out[e] += near * share * v[e]);
            }
        }
        out
    }

    /// A node's ends at the i-th neighbourhood along x, between those along y and z.
    fn across(&self, strands: &[Strand], i: usize, node: usize, at: [(usize, f64); 2]) -> [f64; 2] {
        let [nx, ny, _] = self.joint.shape;
        let mut out = [0.0; 2];
        let [y, z] = at.map(|(n, t)| [(n, 1.0 - t), (n + 1, t)]);
        for (k, share_z) in z.into_iter().filter(|z| z.1 > 0.0) {
            for (j, share_y) in y.into_iter().filter(|y| y.1 > 0.0) {
                let (_, table) = self.table((k * ny + j) * nx + i, strands, &[node]);
                if let Table::Ends(ends) = table {
                    (0..2).for_each(|e| out[e] += share_y * share_z * ends[node][e]);
                }
            }
        }
        out
    }

    /// What is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ at a point with shares `w`.
    pub fn added(
        &self,
        strands: &[Strand],
        p: Vec3,
        w: &[f64],
        ends: &[End],
        at: &mut Place,
    ) -> [f64; 2] {
        self.grid.place(w, at);
        let mut out = [0.0; 2];
        for (i, share, _) in self.joint.corners(p).iter().filter(|c| c.1 > 0.0) {
            let (station, table) = self.table(*i, strands, &at.nodes);
            let v = match table {
                Table::Ends(ends) => at.nodes.iter().zip(&at.shares).fold([0.0; 2], |v, (n, s)| {
                    [v[0] + s * ends[*n][0], v[1] + s * ends[*n][1]]
                }),
                Table::Curves(curves) => self.curved(strands, curves, &station.own, w, ends, at),
            };
            out = [out[0] + share * v[0], out[1] + share * v[1]];
        }
        out
    }

    /// Where each lattice is alone: the value at its end's quantile, and how it changes with that.
    fn base(&self, strands: &[Strand], curves: &[Curve], i: usize, q: [f64; 2]) -> [(f64, f64); 2] {
        let curve = &curves[self.alone[i]];
        let low = match strands[i].is_sheet() {
            true => curve.at(q[0]),
            false => (strands[i].low(0.0), 0.0),
        };
        [low, curve.at(q[1])]
    }

    /// Intervals that contain what is added to Σ wᵢ loᵢ and Σ wᵢ hiᵢ in a box, where shares are within `w` and upper ends
    /// within `highs`: everything is between what its tables have at the neighbourhoods and nodes about.
    pub fn bound(
        &self,
        strands: &[Strand],
        b: &Aabb,
        w: &[Interval],
        highs: &[Interval],
    ) -> [Interval; 2] {
        let n = w.len();
        let all = [Interval::new(f64::NEG_INFINITY, f64::INFINITY); 2];
        // A box of several cells has everything in it.
        if self.joint.count_in(b).is_none_or(|c| c > MANY) {
            return all;
        }
        let about = self.about(w);
        let nodes: Vec<usize> = (0..about.len()).filter(|i| about[*i]).collect();
        if nodes.is_empty() {
            return all;
        }
        let mut out: Option<[Interval; 2]> = None;
        self.joint.each_in(b, |i| {
            if self.shares(i).iter().any(|w| w.lo == 1.0) {
                // Nobody asks where one lattice is alone: nothing is added.
                let none = Interval::new(0.0, 0.0);
                out = Some(out.map_or([none; 2], |o| o.map(|o| o.union(none))));
                return;
            }
            let station = self.station(i, strands);
            let here = match &station.near {
                Table::Ends(ends) => [0, 1].map(|e| hull(nodes.iter().map(|n| ends[*n][e]))),
                Table::Curves(curves) => {
                    let q = |i: usize| -> [Interval; 2] {
                        let ends = [highs[i].lo, highs[i].hi].map(|h| {
                            strands[i]
                                .quantiles(h)
                                .map_or(station.own[i], |q| [q[0].0, q[1].0])
                        });
                        [0, 1].map(|e| hull(ends.iter().map(|q| q[e])))
                    };
                    let of: Vec<[Interval; 2]> = (0..n).map(q).collect();
                    let (mut a, mut p) = (Interval::new(0.0, 0.0), Interval::new(0.0, 0.0));
                    for (w, [lo, hi]) in w.iter().zip(&of) {
                        let from = lo.max(Interval::new(0.0, 0.0));
                        let share = Interval::new((hi.lo - from.hi).max(0.0), hi.hi - from.lo);
                        (a, p) = (a + w.times(*lo), p + w.times(share));
                    }
                    let top = a.max(Interval::new(0.0, 0.0)) + p;
                    let mut found = [a, top].map(|q| {
                        let lo = nodes.iter().map(|n| curves[*n].at(q.lo).0);
                        Interval::new(
                            lo.fold(f64::INFINITY, f64::min),
                            hull(nodes.iter().map(|n| curves[*n].at(q.hi).0)).hi,
                        )
                    });
                    for i in (0..n).filter(|i| w[*i].hi > 0.0) {
                        let [lo, hi] = [of[i].map(|q| q.lo), of[i].map(|q| q.hi)]
                            .map(|q| self.base(strands, curves, i, q));
                        for e in 0..2 {
                            found[e] = found[e] - w[i].times(Interval::new(lo[e].0, hi[e].0));
                        }
                    }
                    found
                }
            };
            out = Some(out.map_or(here, |o| [o[0].union(here[0]), o[1].union(here[1])]));
        });
        out.unwrap_or(all)
    }

    fn curved(
        &self,
        strands: &[Strand],
        curves: &[Curve],
        own: &[[f64; 2]],
        w: &[f64],
        ends: &[End],
        at: &Place,
    ) -> [f64; 2] {
        let q = |i: usize| ends[i].quantiles.map_or(own[i], |q| [q[0].0, q[1].0]);
        let [a, b] = blended(w, (0..w.len()).map(q));
        let sum = |q: f64| {
            let each = at.nodes.iter().zip(&at.shares);
            each.map(|(n, s)| s * curves[*n].at(q).0).sum::<f64>()
        };
        let mut v = [sum(a), sum(b)];
        for (i, w) in w.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            let base = self.base(strands, curves, i, q(i));
            (0..2).for_each(|e| v[e] -= w * base[e].0);
        }
        v
    }

    /// The same with gradients (per mm); `dw` are those of the shares.
    pub fn added_gradients(
        &self,
        strands: &[Strand],
        p: Vec3,
        (w, dw): (&[f64], &[Vec3]),
        ends: &[End],
        at: &mut Place,
    ) -> ([f64; 2], [Vec3; 2]) {
        self.grid.place(w, at);
        let (mut out, mut slope) = ([0.0; 2], [[0.0; 3]; 2]);
        // ∇y of each axis: m Σ ∇w from it on.
        let mut dy = vec![[0.0; 3]; w.len() - 1];
        let mut sum = [0.0; 3];
        for k in (0..dy.len()).rev() {
            sum = add(sum, dw[k + 1]);
            dy[k] = scale(sum, self.grid.steps() as f64);
        }
        for (i, share, dshare) in self
            .joint
            .corners(p)
            .iter()
            .filter(|c| c.1 > 0.0 || c.2 != [0.0; 3])
        {
            let (station, table) = self.table(*i, strands, &at.nodes);
            let (v, g) = match table {
                Table::Ends(of) => {
                    let side = |e: usize| {
                        let node = |l: usize| of[at.nodes[l]][e];
                        let v = at
                            .shares
                            .iter()
                            .enumerate()
                            .map(|(l, s)| s * node(l))
                            .sum::<f64>();
                        let g = at.axes.iter().enumerate().fold([0.0; 3], |g, (l, k)| {
                            add(g, scale(dy[*k], node(l + 1) - node(l)))
                        });
                        (v, g)
                    };
                    let (lo, hi) = (side(0), side(1));
                    ([lo.0, hi.0], [lo.1, hi.1])
                }
                Table::Curves(curves) => {
                    self.curved_gradients(strands, (curves, &station.own), (w, dw), ends, at, &dy)
                }
            };
            for e in 0..2 {
                out[e] += share * v[e];
                slope[e] = add(slope[e], add(scale(g[e], *share), scale(*dshare, v[e])));
            }
        }
        (out, slope)
    }

    fn curved_gradients(
        &self,
        strands: &[Strand],
        (curves, own): (&[Curve], &[[f64; 2]]),
        (w, dw): (&[f64], &[Vec3]),
        ends: &[End],
        at: &Place,
        dy: &[Vec3],
    ) -> ([f64; 2], [Vec3; 2]) {
        let q = |i: usize| ends[i].quantiles.map_or(own[i], |q| [q[0].0, q[1].0]);
        let dq = |i: usize| {
            let by = |e: usize| ends[i].quantiles.map_or(0.0, |q| q[e].1);
            [scale(ends[i].slope, by(0)), scale(ends[i].slope, by(1))]
        };
        let [a, b] = blended(w, (0..w.len()).map(q));
        let (mut da, mut dp) = ([0.0; 3], [0.0; 3]);
        for i in 0..w.len() {
            let ([lo, hi], [dlo, dhi]) = (q(i), dq(i));
            let (from, dfrom) = if lo > 0.0 { (lo, dlo) } else { (0.0, [0.0; 3]) };
            da = add(da, add(scale(dw[i], lo), scale(dlo, w[i])));
            dp = add(
                dp,
                add(scale(dw[i], hi - from), scale(sub(dhi, dfrom), w[i])),
            );
        }
        let db = if a > 0.0 { add(da, dp) } else { dp };
        let side = |q: f64, dq: Vec3| {
            let each: Vec<(f64, f64)> = at.nodes.iter().map(|n| curves[*n].at(q)).collect();
            let v = each
                .iter()
                .zip(&at.shares)
                .map(|(c, s)| s * c.0)
                .sum::<f64>();
            let steep = each
                .iter()
                .zip(&at.shares)
                .map(|(c, s)| s * c.1)
                .sum::<f64>();
            let g = at
                .axes
                .iter()
                .enumerate()
                .fold(scale(dq, steep), |g, (l, k)| {
                    add(g, scale(dy[*k], each[l + 1].0 - each[l].0))
                });
            (v, g)
        };
        let (lo, hi) = (side(a, da), side(b, db));
        let (mut v, mut g) = ([lo.0, hi.0], [lo.1, hi.1]);
        for i in 0..w.len() {
            let base = self.base(strands, curves, i, q(i));
            for e in 0..2 {
                let (c, steep) = base[e];
                v[e] -= w[i] * c;
                g[e] = sub(g[e], add(scale(dw[i], c), scale(dq(i)[e], w[i] * steep)));
            }
        }
        (v, g)
    }
}
