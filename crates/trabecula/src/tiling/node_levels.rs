//! The level of a lattice over a tetrahedral mesh, from an iso, a fraction or a wall thickness.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Level, Tiling};
use crate::cell::Part;
use crate::cell::tet::{Bary, Nodes, Subdivision, TetCell};
use crate::map::Tets;
use geometry::math::{Vec3, add, norm, scale};

/// Steps along the edge on which the mid-surface is sampled.
const STEPS: usize = 6;

/// How much of a cell is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// The value of f; for a sheet the half-level.
    Iso,
    /// The solid share of the tetrahedron.
    Fraction,
    /// The mean thickness (mm) of a sheet's walls in the tetrahedra about a node.
    Thickness,
}

/// How a thickness (mm) spreads over the walls of all tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// The least.
    pub min: f64,
    /// A twentieth is below it.
    pub low: f64,
    /// The mean.
    pub mean: f64,
    /// A twentieth is above it.
    pub high: f64,
    /// The greatest.
    pub max: f64,
}

/// Points of the mid-surface f = 0 and ∂f/∂λ there.
fn middle(cell: &TetCell) -> Vec<(Bary, Bary)> {
    let nodes = Nodes::new(cell, Subdivision { n: STEPS });
    let mut edges = Vec::new();
    nodes.grid.each_tet(|at, _| {
        let i = at.map(|[i, j, k]| Subdivision::index(i, j, k));
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            edges.push([i[a], i[b]]);
        }
    });
    edges.sort_unstable();
    edges.dedup();
    let cross = |[a, b]: &[usize; 2]| {
        let (x, y) = (nodes.values[*a], nodes.values[*b]);
        ((x < 0.0) != (y < 0.0)).then(|| {
            let (p, q) = (nodes.grid.bary(nodes.whole[*a]), nodes.grid.bary(nodes.whole[*b]));
            let s = x / (x - y);
            core::array::from_fn(|i| p[i] + s * (q[i] - p[i]))
        })
    };
    let at: Vec<Bary> = edges.iter().filter_map(cross).collect();
    let (mut v, mut g) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
    cell.gradients(&at, &mut v, &mut g);
    at.into_iter().zip(g).collect()
}

/// |∇f| (per mm) in a tetrahedron where ∂f/∂λ is `g`.
fn steepness(map: &Tets, t: usize, g: &Bary) -> f64 {
    let m = map.slopes(t);
    let slope: Vec3 = (0..3).fold([0.0; 3], |s, i| add(s, scale(m[i], g[i])));
    norm(slope)
}

impl Level {
    /// The level that gives an amount: one number, or one for each node. A wall of half-level t is about 2t/|∇f| thick, f
    /// being steeper where tetrahedra are smaller: t follows the mean of |∇f| over the mid-surface in each tetrahedron, and
    /// a node has the mean of the tetrahedra about it.
    pub fn of(map: &Tets, cell: &TetCell, part: Part, amount: Amount, values: Vec<f64>) -> Level {
        let one = values.len() == 1;
        let level = |v: f64| match amount {
            Amount::Iso => v,
            Amount::Fraction => cell.iso(part, v),
            Amount::Thickness => 0.5 * v,
        };
        if one && amount != Amount::Thickness {
            return Level::Same(level(values[0]));
        }
        let mut values = if one { vec![values[0]; map.nodes().len()] } else { values };
        values.par_iter_mut().for_each(|v| *v = level(*v));
        if amount == Amount::Thickness {
            let at = middle(cell);
            let mean = |t: usize| {
                let sum: f64 = at.iter().map(|(_, g)| steepness(map, t, g)).sum();
                sum / at.len() as f64
            };
            let means: Vec<f64> = (0..map.len()).into_par_iter().map(mean).collect();
            let mut about = vec![(0.0, 0u32); map.nodes().len()];
            for (t, mean) in means.iter().enumerate() {
                for n in map.tet(t) {
                    let a = &mut about[n as usize];
                    *a = (a.0 + mean, a.1 + 1);
                }
            }
            for (v, (sum, count)) in values.iter_mut().zip(about) {
                *v *= if count > 0 { sum / f64::from(count) } else { 1.0 };
            }
        }
        Level::Nodes(Arc::new(values))
    }
}

impl Tiling {
    /// How thick the walls of a sheet are over all tetrahedra, to first order: 2t/|∇f| on the mid-surface. `None` for other
    /// parts, for transitions, and where there is no mid-surface.
    pub fn thickness(&self) -> Option<Spread> {
        let [cell] = &self.cells[..] else { return None };
        let at = middle(&cell.cell);
        if self.part != Part::Sheet || at.is_empty() {
            return None;
        }
        // Some hundred thousand samples are enough for a spread.
        let step = (self.map.len() * at.len()).div_ceil(2_000_000);
        let tets = (0..self.map.len()).into_par_iter().step_by(step);
        let mut all: Vec<f64> = tets
            .flat_map_iter(|t| {
                let one =
                    move |(l, g): &(Bary, Bary)| 2.0 * self.level_at(t, *l) / (steepness(&self.map, t, g) / cell.scale);
                at.iter().map(one).collect::<Vec<f64>>()
            })
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        let share = |s: f64| all[((all.len() - 1) as f64 * s) as usize];
        Some(Spread {
            min: share(0.0),
            low: share(0.05),
            mean: all.iter().sum::<f64>() / all.len() as f64,
            high: share(0.95),
            max: share(1.0),
        })
    }
}
