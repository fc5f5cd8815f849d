//! Transition tetrahedra between cells: their solid fraction, and the levels at which it meets the target.
//!
//! Where weights vary, what is solid follows from no cell's own table. It is summed over small tetrahedra on which f − t is
//! taken as linear, in two sizes of them, which together are of fourth order (Richardson).

use geometry::progress::checkpoint;
use rayon::prelude::*;

use super::{NodalLevel, Share, Tiling};
use crate::cell::Part;
use crate::cell::tet::{Subdivision, SubdivisionNodes, share_below};
use crate::map::CarrierMesh;

/// Steps along the edge of the tetrahedron, coarse and fine.
const STEPS: [usize; 2] = [16, 32];
/// A level has settled when the fraction about every node is within this of the target.
const NEAR: f64 = 1e-3;
/// The most times that levels are moved.
const ROUNDS: usize = 12;
/// How far apart the shares at the corners of a tetrahedron of one cell may be for the cell's own table to serve: f is not
/// independent of the position, so the table is off by some of the square of this.
const ALIKE: f64 = 0.05;
/// A small change of the level; values run over two.
const NUDGE: f64 = 0.01;

/// Cells on the small tetrahedra.
pub(super) struct Mixture {
    sizes: [Size; 2],
    part: Part,
}

/// Small tetrahedra of one size.
pub(super) struct Size {
    nodes: Vec<[f64; 4]>,
    pub tets: Vec<[u32; 4]>,
    /// For each cell, its values at the nodes, divided by its scale.
    pub cells: Vec<Vec<f64>>,
}

impl Size {
    pub fn new(cells: &[Share], n: usize) -> Size {
        let grid = Subdivision { n };
        let mut tets = Vec::with_capacity(n.pow(3));
        grid.each_tet(|at, _| tets.push(at.map(|[i, j, k]| Subdivision::index(i, j, k) as u32)));
        let values = |c: &Share| {
            let values = SubdivisionNodes::new(&c.cell, grid).values;
            values.into_iter().map(|v| v / c.scale).collect()
        };
        Size {
            nodes: grid.whole().into_iter().map(|k| grid.bary(k)).collect(),
            tets,
            cells: cells.iter().map(values).collect(),
        }
    }

    /// The share of each where f < `sign` · t.
    fn each_below(&self, weights: &[[f64; 4]], levels: [f64; 4], sign: f64) -> impl Iterator<Item = f64> {
        let linear = |v: &[f64; 4], l: &[f64; 4]| (0..4).map(|i| v[i] * l[i]).sum::<f64>();
        let value = |(i, l): (usize, &[f64; 4])| {
            let f = weights.iter().zip(&self.cells);
            let f: f64 = f.map(|(w, c)| linear(w, l) * c[i]).sum();
            f - sign * linear(&levels, l)
        };
        let values: Vec<f64> = self.nodes.iter().enumerate().map(value).collect();
        self.tets.iter().map(move |t| {
            let v = t.map(|n| values[n as usize]);
            // Most are on one side.
            match v.iter().filter(|v| **v < 0.0).count() {
                0 => 0.0,
                4 => 1.0,
                _ => share_below(v, 0.0),
            }
        })
    }

    /// The share where f < `sign` · t.
    fn below(&self, weights: &[[f64; 4]], levels: [f64; 4], sign: f64) -> f64 {
        self.each_below(weights, levels, sign).sum::<f64>() / self.tets.len() as f64
    }

    /// What is solid of something that small tetrahedra have each so much of.
    pub fn solid(&self, part: Part, weights: &[[f64; 4]], levels: [f64; 4], of: &[f32]) -> f64 {
        let below = |sign: f64| {
            let shares = self.each_below(weights, levels, sign).zip(of);
            shares.map(|(s, v)| s * f64::from(*v)).sum::<f64>()
        };
        match part {
            Part::Lower => below(1.0),
            Part::Upper => of.iter().map(|v| f64::from(*v)).sum::<f64>() - below(1.0),
            Part::Sheet => below(1.0) - below(-1.0),
        }
    }
}

impl Mixture {
    pub fn new(cells: &[Share], part: Part) -> Mixture {
        Mixture { sizes: STEPS.map(|n| Size::new(cells, n)), part }
    }

    /// The solid share of a tetrahedron, from the weights of the cells and the levels at its corners.
    pub fn share(&self, weights: &[[f64; 4]], levels: [f64; 4]) -> f64 {
        let below = |sign: f64| {
            let [coarse, fine] = [0, 1].map(|i| self.sizes[i].below(weights, levels, sign));
            fine + (fine - coarse) / 3.0
        };
        let share = match self.part {
            Part::Lower => below(1.0),
            Part::Upper => 1.0 - below(1.0),
            Part::Sheet => below(1.0) - below(-1.0),
        };
        share.clamp(0.0, 1.0)
    }
}

/// The weights of all cells at the corners of a tetrahedron.
pub(super) fn weights(map: &CarrierMesh, cells: &[Share], t: usize) -> Vec<[f64; 4]> {
    let at = |c: &Share| match &c.weights {
        Some(w) => map.tet(t).map(|n| w[n as usize]),
        None => [1.0; 4],
    };
    cells.iter().map(at).collect()
}

/// The only cell of a tetrahedron, if there is but one.
pub(super) fn only(weights: &[[f64; 4]]) -> Option<usize> {
    weights.iter().position(|w| *w == [1.0; 4])
}

impl NodalLevel {
    /// The levels at which several cells have the target fractions at the nodes, one or one for each. A node of one
    /// cell has that cell's level. Where cells meet, levels of nodes are moved until the tetrahedra about each, taken
    /// together, meet the target: the mean of the cells' levels alone would lose some of it, since a sum of two
    /// functions has other values than either.
    pub fn mixed(map: &CarrierMesh, cells: &[Share], part: Part, target: &[f64]) -> NodalLevel {
        let target = |n: u32| target[(n as usize).min(target.len() - 1)];
        let weight = |c: &Share, n: u32| c.weights.as_ref().map_or(1.0, |w| w[n as usize]);
        let start = |n: u32| {
            let of = |c: &Share| match weight(c, n) {
                0.0 => 0.0,
                w => w * c.cell.iso(part, target(n)) / c.scale,
            };
            cells.iter().map(of).sum::<f64>()
        };
        let count = map.nodes().len() as u32;
        let mut levels: Vec<f64> = (0..count).into_par_iter().map(start).collect();
        let meet = |n: u32| cells.iter().filter(|c| weight(c, n) > 0.0).count() > 1;
        let free: Vec<bool> = (0..count).map(meet).collect();
        let moves = |t: &usize| map.tet(*t).iter().any(|n| free[*n as usize]);
        let tets: Vec<usize> = (0..map.len()).filter(moves).collect();
        let mixture = Mixture::new(cells, part);
        for _ in 0..ROUNDS {
            checkpoint();
            // For each tetrahedron its deficit, how much a common move of its free nodes adds, and its volume, mm³; each of
            // these nodes has an equal part, so that nothing lacks in all when none does.
            let deficit = |t: &usize| {
                let ids = map.tet(*t);
                let weights = weights(map, cells, *t);
                let at = ids.map(|n| levels[n as usize]);
                let moved = core::array::from_fn(|i| at[i] + if free[ids[i] as usize] { NUDGE } else { 0.0 });
                let [now, then] = [at, moved].map(|l| mixture.share(&weights, l));
                let wanted = ids.iter().map(|n| target(*n)).sum::<f64>() / 4.0;
                let count = ids.iter().filter(|n| free[**n as usize]).count();
                let v = map.volume(*t) / count as f64;
                [v * (wanted - now), v * (then - now) / NUDGE, v]
            };
            let found: Vec<[f64; 3]> = tets.par_iter().map(deficit).collect();
            let mut about = vec![[0.0; 3]; levels.len()];
            for (t, f) in tets.iter().zip(&found) {
                for n in map.tet(*t) {
                    let a = &mut about[n as usize];
                    *a = core::array::from_fn(|i| a[i] + f[i]);
                }
            }
            let mut most = 0.0f64;
            for (n, [lacks, gains, volume]) in about.into_iter().enumerate() {
                if !free[n] || gains.abs() < 1e-3 * volume {
                    continue;
                }
                most = most.max((lacks / volume).abs());
                let to = levels[n] + (lacks / gains).clamp(-0.2, 0.2);
                // The half-level of a sheet stays one.
                levels[n] = if part == Part::Sheet { to.max(0.2 * levels[n]) } else { to };
            }
            if most < NEAR {
                break;
            }
        }
        NodalLevel::Nodes(levels.into())
    }
}

impl Tiling {
    /// The solid share of each tetrahedron: exact where there is one cell at one level, and from the cell's table where levels
    /// are alike; else by small tetrahedra. Where tetrahedra overlap, those of the blended function in the whole mesh.
    pub fn shares(&self) -> Vec<f64> {
        if let (NodalLevel::Same(t), [_]) = (&self.level, &self.cells[..]) {
            return vec![self.fraction(*t); self.map.len()];
        }
        if self.map.overlap() > 0.0 {
            return self.sampled_shares();
        }
        let mixture = Mixture::new(&self.cells, self.part);
        let share = |t: usize| {
            let weights = weights(&self.map, &self.cells, t);
            let corner = |i: usize| core::array::from_fn(|k| f64::from(u8::from(k == i)));
            let levels = core::array::from_fn(|i| self.level_at(t, corner(i)));
            let alike = only(&weights).and_then(|one| {
                let c = &self.cells[one];
                let fraction = |t: f64| c.cell.fraction(self.part, t * c.scale);
                let ends: [f64; 4] = levels.map(fraction);
                let (lo, hi) = ends.iter().fold((1.0f64, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
                // Corners and the middle: exact for what is quadratic in the level.
                let middle = fraction(levels.iter().sum::<f64>() / 4.0);
                let mean = (ends.iter().sum::<f64>() + 16.0 * middle) / 20.0;
                (hi - lo < ALIKE).then_some(mean)
            });
            alike.unwrap_or_else(|| mixture.share(&weights, levels))
        };
        (0..self.map.len()).into_par_iter().map(share).collect()
    }
}
