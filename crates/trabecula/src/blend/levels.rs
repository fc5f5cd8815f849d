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
use super::simplex::{Grid, Place};
use super::strand::{BELOW, Strand};
use crate::math::{Vec3, add, scale, sub};

/// Knots of a quantile function; they are closer at its ends.
const KNOTS: usize = 64;

/// A tabulated quantile function.
struct Curve([f32; KNOTS + 1]);

impl Curve {
    /// From values in rising order.
    fn new(sorted: &[f32]) -> Curve {
        let last = (sorted.len() - 1) as f64;
        Curve(core::array::from_fn(|k| {
            let (s, _) = (std::f64::consts::FRAC_PI_2 * k as f64 / KNOTS as f64).sin_cos();
            sorted[(s * s * last).round() as usize]
        }))
    }

    /// Value and slope at the share q. Below none it falls on as steeply as it rises in all.
    fn at(&self, q: f64) -> (f64, f64) {
        let whole = f64::from(self.0[KNOTS] - self.0[0]);
        if q < 0.0 {
            return (f64::from(self.0[0]) + q * whole, whole);
        }
        let knot = |k: usize| {
            (std::f64::consts::FRAC_PI_2 * k as f64 / KNOTS as f64)
                .sin()
                .powi(2)
        };
        let x = q.min(1.0).sqrt().asin() / std::f64::consts::FRAC_PI_2 * KNOTS as f64;
        let k = (x as usize).min(KNOTS - 1);
        let (q0, q1) = (knot(k), knot(k + 1));
        let (v0, v1) = (f64::from(self.0[k]), f64::from(self.0[k + 1]));
        let slope = (v1 - v0) / (q1 - q0);
        (v0 + slope * (q.min(1.0) - q0), slope)
    }
}

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

/// What is known of one neighbourhood.
struct Station {
    /// Quantiles [a, b] of what has no table of its own, found by looking.
    own: Vec<[f64; 2]>,
    table: Table,
}

enum Table {
    /// For each node what is added to the lower and the upper end.
    Ends(Vec<[f64; 2]>),
    /// For each node the quantile function.
    Curves(Vec<Curve>),
}

/// A lattice of the blend at a point.
#[derive(Clone, Copy, Default)]
pub(super) struct End {
    /// Quantiles of the lower and the upper end; `None` if found by looking.
    pub quantiles: Option<[(f64, f64); 2]>,
    /// Gradient of the upper end, on which the quantiles depend.
    pub slope: Vec3,
}

/// The levels of a blend by fraction.
pub(super) struct Levels {
    pub joint: Joint,
    grid: Grid,
    /// Whether there is a lower end anywhere.
    two_sided: bool,
    /// The quantiles, where none varies.
    uniform: Option<Vec<End>>,
    stations: Vec<OnceLock<Station>>,
    /// Numbers of the nodes at which one lattice is alone.
    alone: Vec<usize>,
}

impl Levels {
    pub fn new(strands: &[Strand], joint: Joint) -> Levels {
        let n = strands.len();
        let ends = |s: &Strand| {
            let quantiles = s.quantiles(s.uniform()?);
            Some(End {
                quantiles,
                slope: [0.0; 3],
            })
        };
        let grid = Grid::new(n);
        let mut alone = vec![0; n];
        grid.each(|node, w| {
            if let Some(i) = w.iter().position(|w| *w == 1.0) {
                alone[i] = node;
            }
        });
        Levels {
            two_sided: strands.iter().any(Strand::is_sheet),
            uniform: strands.iter().map(ends).collect(),
            stations: (0..joint.len()).map(|_| OnceLock::new()).collect(),
            joint,
            grid,
            alone,
        }
    }

    /// Whether no quantile varies.
    pub fn is_uniform(&self) -> bool {
        self.uniform.is_some()
    }

    fn station(&self, i: usize, strands: &[Strand]) -> &Station {
        self.stations[i].get_or_init(|| {
            let places = self.joint.places(i);
            let mut values = vec![0.0; places.len()];
            let samples: Vec<Vec<f32>> = strands
                .iter()
                .map(|s| {
                    s.values(&places, &mut values);
                    values.iter().map(|v| *v as f32).collect()
                })
                .collect();
            self.look(strands, &samples)
        })
    }

    /// The tables from the values of the lattices at the same places.
    fn look(&self, strands: &[Strand], samples: &[Vec<f32>]) -> Station {
        let count = samples[0].len();
        let own = samples.iter().map(|s| {
            let solid = s.iter().filter(|v| **v <= 0.0).count();
            [-BELOW, solid as f64 / count as f64]
        });
        let own: Vec<[f64; 2]> = own.collect();
        let mut curves: Vec<Option<Curve>> = (0..self.grid.len()).map(|_| None).collect();
        let mut ends = vec![[0.0; 2]; self.grid.len()];
        let mut sum = vec![0f32; count];
        let exact = self.uniform.as_deref().map(|u| {
            let q = u
                .iter()
                .zip(&own)
                .map(|(e, o)| e.quantiles.map_or(*o, |q| [q[0].0, q[1].0]));
            q.collect::<Vec<_>>()
        });
        // The value below which a share lies.
        let quantile = |values: &mut [f32], q: f64| {
            let at = q.clamp(0.0, 1.0) * (count - 1) as f64;
            f64::from(
                *values
                    .select_nth_unstable_by(at.round() as usize, f32::total_cmp)
                    .1,
            )
        };
        self.grid.each(|node, w| {
            sum.fill(0.0);
            for (w, s) in w.iter().zip(samples).filter(|(w, _)| **w > 0.0) {
                let w = *w as f32;
                sum.iter_mut().zip(s).for_each(|(o, v)| *o += w * v);
            }
            let Some(exact) = &exact else {
                sum.sort_unstable_by(f32::total_cmp);
                curves[node] = Some(Curve::new(&sum));
                return;
            };
            let [a, b] = blended(w, exact.iter().copied());
            ends[node] = [0.0, quantile(&mut sum, b)];
            if self.two_sided {
                let whole = if a < 0.0 {
                    let [lo, hi] = sum.iter().fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| {
                        [r[0].min(*v), r[1].max(*v)]
                    });
                    f64::from(hi - lo)
                } else {
                    0.0
                };
                ends[node][0] = quantile(&mut sum, a) + a.min(0.0) * whole;
            }
        });
        if exact.is_none() {
            let curves = curves.into_iter().flatten().collect();
            return Station {
                own,
                table: Table::Curves(curves),
            };
        }
        // Less what it is where each lattice is alone; less all that is added of a network's lower end, which no quantile is.
        let alone = |i: usize| match ends[self.alone[i]] {
            sheet if strands[i].is_sheet() => sheet,
            [_, hi] => [strands[i].low(0.0), hi],
        };
        let base: Vec<[f64; 2]> = (0..strands.len()).map(alone).collect();
        self.grid.each(|node, w| {
            for (i, w) in w.iter().enumerate() {
                (0..2).for_each(|e| ends[node][e] -= w * base[i][e]);
            }
        });
        Station {
            own,
            table: Table::Ends(ends),
        }
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
            let station = self.station(*i, strands);
            let v = match &station.table {
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
            let station = self.station(*i, strands);
            let (v, g) = match &station.table {
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
                    self.curved_gradients(strands, curves, &station.own, (w, dw), ends, at, &dy)
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
        curves: &[Curve],
        own: &[[f64; 2]],
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
