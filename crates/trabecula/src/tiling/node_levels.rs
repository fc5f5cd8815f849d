//! The level of a lattice over a tetrahedral mesh, from an iso, a fraction or a wall thickness: of this to first order.

use std::sync::Arc;

use rayon::prelude::*;

use super::NodalLevel;
use crate::cell::Part;
use crate::cell::tet::{Bary, Subdivision, SubdivisionNodes, TetCell};
use crate::map::CarrierMesh;
use geometry::math::{Vec3, add, cross, norm, scale};

/// Steps along the edge on which the mid-surface is sampled.
const STEPS: usize = 12;

/// How much of a cell is solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// The value of f; for a sheet the half-level.
    Iso,
    /// The solid share of the tetrahedron.
    Fraction,
    /// The mean thickness (mm) of a sheet's walls, weighted by the area of its mid-surface.
    Thickness,
}

/// A piece of the mid-surface f = 0, about a point.
pub(super) struct MidSurfacePiece {
    pub at: Bary,
    /// ∂f/∂λ there.
    pub slope: Bary,
    /// ∫ dA/|∂f/∂λ| over the piece. Volumes scale alike in all directions, so by the coarea formula the piece's area in a
    /// tetrahedron of volume V is in proportion to V |∇f| times this, whatever the tetrahedron's shape.
    pub weight: f64,
}

/// The mid-surface of a cell in small pieces. Their area falls short of the true one by the square of a step, which twice the steps
/// show: all weights make up for it.
pub(super) fn middle(cell: &TetCell) -> Vec<MidSurfacePiece> {
    let area = |pieces: &[MidSurfacePiece]| {
        pieces.iter().map(|p| p.weight * norm([p.slope[0], p.slope[1], p.slope[2]])).sum::<f64>()
    };
    let (mut pieces, fine) = (middle_in(cell, STEPS), area(&middle_in(cell, 2 * STEPS)));
    let coarse = area(&pieces);
    if coarse > 0.0 {
        let by = (fine + (fine - coarse) / 3.0) / coarse;
        pieces.iter_mut().for_each(|p| p.weight *= by);
    }
    pieces
}

fn middle_in(cell: &TetCell, n: usize) -> Vec<MidSurfacePiece> {
    let nodes = SubdivisionNodes::new(cell, Subdivision { n });
    let mut triangles: Vec<[Bary; 3]> = Vec::new();
    nodes.grid.each_tet(|at, _| {
        let i = at.map(|[i, j, k]| Subdivision::index(i, j, k));
        let (below, above): (Vec<usize>, Vec<usize>) = i.iter().partition(|i| nodes.values[**i] < 0.0);
        let root = |a: usize, b: usize| -> Bary {
            let (x, y) = (nodes.values[a], nodes.values[b]);
            let (p, q) = (nodes.grid.bary(nodes.whole[a]), nodes.grid.bary(nodes.whole[b]));
            let s = x / (x - y);
            core::array::from_fn(|i| p[i] + s * (q[i] - p[i]))
        };
        match (&below[..], &above[..]) {
            ([a], [b, c, d]) | ([b, c, d], [a]) => triangles.push([root(*a, *b), root(*a, *c), root(*a, *d)]),
            ([a, b], [c, d]) => {
                let [p, q, r, s] = [root(*a, *c), root(*a, *d), root(*b, *d), root(*b, *c)];
                triangles.extend([[p, q, r], [p, r, s]]);
            }
            _ => {}
        }
    });
    let centre = |t: &[Bary; 3]| -> Bary { core::array::from_fn(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0) };
    let at: Vec<Bary> = triangles.iter().map(centre).collect();
    let (mut v, mut g) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
    cell.gradients(&at, &mut v, &mut g);
    let piece = |((t, at), slope): ((&[Bary; 3], Bary), Bary)| {
        let side = |k: usize| -> Vec3 { core::array::from_fn(|i| t[k][i] - t[0][i]) };
        let area = 0.5 * norm(cross(side(1), side(2)));
        let steep = norm([slope[0], slope[1], slope[2]]);
        (area > 0.0 && steep > 0.0).then(|| MidSurfacePiece { at, slope, weight: area / steep })
    };
    triangles.iter().zip(at).zip(g).filter_map(piece).collect()
}

/// |∇f| (per mm) in a tetrahedron where ∂f/∂λ is `g`.
pub(super) fn steepness(map: &CarrierMesh, t: usize, g: &Bary) -> f64 {
    let m = map.slopes(t);
    let slope: Vec3 = (0..3).fold([0.0; 3], |s, i| add(s, scale(m[i], g[i])));
    norm(slope)
}

impl NodalLevel {
    /// The level that gives an amount: one number, or one for each node. A wall of half-level t is about 2t/|∇f| thick, f
    /// being steeper where tetrahedra are smaller: t follows the mean of |∇f| over the mid-surface in the tetrahedra about a
    /// node, and all are scaled so that the mean of that over the whole mid-surface is as asked.
    pub fn of(map: &CarrierMesh, cell: &TetCell, part: Part, amount: Amount, values: Vec<f64>) -> NodalLevel {
        let one = values.len() == 1;
        let level = |v: f64| match amount {
            Amount::Iso => v,
            Amount::Fraction => cell.iso(part, v),
            Amount::Thickness => 0.5 * v,
        };
        if one && amount != Amount::Thickness {
            return NodalLevel::Same(level(values[0]));
        }
        let mut values = if one { vec![values[0]; map.nodes().len()] } else { values };
        values.par_iter_mut().for_each(|v| *v = level(*v));
        if amount == Amount::Thickness {
            values = of_thickness(map, &middle(cell), &values);
        }
        NodalLevel::Nodes(Arc::new(values))
    }
}

/// The level at each node that gives half-walls of these thicknesses (mm).
fn of_thickness(map: &CarrierMesh, pieces: &[MidSurfacePiece], half: &[f64]) -> Vec<f64> {
    // The mean of |∇f| over a mid-surface weighs pieces by what makes 2t/|∇f|, weighted by area, its inverse.
    let weight: f64 = pieces.iter().map(|p| p.weight).sum();
    let area = |t: usize| {
        let sum: f64 = pieces.iter().map(|p| p.weight * steepness(map, t, &p.slope)).sum();
        map.volume(t) * sum
    };
    let areas: Vec<f64> = (0..map.len()).into_par_iter().map(area).collect();
    let mut about = vec![(0.0, 0.0); map.nodes().len()];
    for (t, area) in areas.iter().enumerate() {
        for n in map.tet(t) {
            let a = &mut about[n as usize];
            *a = (a.0 + area, a.1 + map.volume(t) * weight);
        }
    }
    let mut levels: Vec<f64> =
        half.iter().zip(about).map(|(h, (area, all))| if all > 0.0 { h * area / all } else { *h }).collect();
    // Half the walls asked for and found, integrated over the mid-surface; both are linear in what nodes have.
    let sums = |t: usize| {
        let at = |of: &[f64], l: &Bary| (0..4).map(|i| l[i] * of[map.tet(t)[i] as usize]).sum::<f64>();
        let one = |p: &MidSurfacePiece| {
            [at(half, &p.at) * p.weight * steepness(map, t, &p.slope), at(&levels, &p.at) * p.weight]
                .map(|v| map.volume(t) * v)
        };
        pieces.iter().map(one).fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d])
    };
    let sums: Vec<[f64; 2]> = (0..map.len()).into_par_iter().map(sums).collect();
    let [asked, found] = sums.iter().fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
    if found > 0.0 {
        levels.iter_mut().for_each(|v| *v *= asked / found);
    }
    levels
}
