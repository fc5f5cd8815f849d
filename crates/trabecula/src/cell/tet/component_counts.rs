//! Numbers of connected components of a tetrahedral cell and of its traces on the faces, as functions of the level.
//!
//! On a small simplex f is interpolated linearly and the solid is convex, hence connected. So components are those of a
//! graph of small tetrahedra, adjacent where they have solid on a common small triangle; a simplex enters the graph at
//! the minimum "depth" of f on it. All levels are swept at once by union-find, deepest first.

use super::subdivision::{Subdivision, SubdivisionNodes};
use super::{Count, Part, TetCell};
use geometry::union_find::unite;

/// Steps along the edge of the tetrahedron.
const STEPS: usize = 48;

/// Number of connected components as a function of the depth: lower f, upper −f, sheet |f|; solid is what lies below
/// it.
pub(super) struct ComponentCounts {
    upper: bool,
    /// Pairs of a depth and the number of components from there on, ascending.
    solid: Vec<(f64, usize)>,
    trace: Vec<(f64, usize)>,
    whole: Vec<[f64; 2]>,
}

/// The minimum depth on a simplex.
fn least_depth(part: Part, values: &[f64]) -> f64 {
    let (lo, hi) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    match part {
        Part::Lower => lo,
        Part::Upper => -hi,
        Part::Sheet => lo.max(-hi).max(0.0),
    }
}

/// A filtration of a graph: each node and each edge appears at a depth.
#[derive(Default)]
struct GraphFiltration {
    nodes: Vec<f64>,
    edges: Vec<(f64, u32, u32)>,
}

impl GraphFiltration {
    /// Pairs of a depth and the number of components from there on.
    fn counts(mut self, slack: f64) -> Vec<(f64, usize)> {
        let mut births = self.nodes.clone();
        births.sort_unstable_by(f64::total_cmp);
        self.edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut root: Vec<u32> = (0..self.nodes.len() as u32).collect();
        let mut out: Vec<(f64, usize)> = Vec::new();
        let (mut born, mut joined, mut edges) = (0, 0, self.edges.iter().peekable());
        loop {
            let next = births.get(born).copied().unwrap_or(f64::INFINITY);
            let next = edges.peek().map_or(next, |l| next.min(l.0));
            if next == f64::INFINITY {
                return out;
            }
            // Equal depths at equivalent positions differ by rounding.
            while births.get(born).is_some_and(|d| *d <= next + slack) {
                born += 1;
            }
            while let Some((_, a, b)) = edges.next_if(|l| l.0 <= next + slack) {
                joined += usize::from(unite(&mut root, *a, *b));
            }
            if out.last().is_none_or(|o| o.1 != born - joined) {
                out.push((next, born - joined));
            }
        }
    }
}

/// The number at a depth: solid is strictly below it.
fn at(counts: &[(f64, usize)], depth: f64) -> usize {
    let i = counts.partition_point(|c| c.0 < depth);
    if i == 0 { 0 } else { counts[i - 1].1 }
}

impl ComponentCounts {
    pub fn new(cell: &TetCell, part: Part) -> ComponentCounts {
        let nodes = SubdivisionNodes::new(cell, Subdivision { n: STEPS });
        let v = |i: usize| nodes.values[i];
        let mut solid = GraphFiltration::default();
        let mut open = std::collections::HashMap::new();
        nodes.grid.each_tet(|p, _| {
            let corners = p.map(|[i, j, k]| Subdivision::index(i, j, k));
            let tet = solid.nodes.len() as u32;
            solid.nodes.push(least_depth(part, &corners.map(v)));
            for without in 0..4 {
                let mut of = [0; 3];
                let others = (0..4).filter(|i| *i != without).map(|i| corners[i]);
                of.iter_mut().zip(others).for_each(|(o, c)| *o = c);
                of.sort_unstable();
                if let Some(other) = open.remove(&of) {
                    solid.edges.push((least_depth(part, &of.map(v)), other, tet));
                } else {
                    open.insert(of, tet);
                }
            }
        });
        // The face k = 0: nodes (a, b) are (a, b, 0).
        let mut trace = GraphFiltration::default();
        let mut open = std::collections::HashMap::new();
        nodes.grid.each_triangle(|p, _| {
            let corners = p.map(|[a, b]| Subdivision::index(a, b, 0));
            let triangle = trace.nodes.len() as u32;
            trace.nodes.push(least_depth(part, &corners.map(v)));
            for (a, b) in [(0, 1), (1, 2), (0, 2)] {
                let of = [corners[a], corners[b]];
                if let Some(other) = open.remove(&of) {
                    trace.edges.push((least_depth(part, &of.map(v)), other, triangle));
                } else {
                    open.insert(of, triangle);
                }
            }
        });
        let reach = trace.nodes.iter().copied().fold(f64::INFINITY, f64::min);
        let slack = 1e-10 * cell.series().amplitude();
        let (solid, trace) = (solid.counts(slack), trace.counts(slack));
        let most = nodes
            .values
            .iter()
            .map(|v| match part {
                Part::Lower => *v,
                Part::Upper => -v,
                Part::Sheet => v.abs(),
            })
            .fold(f64::NEG_INFINITY, f64::max);
        let upper = part == Part::Upper;
        let level = |d: f64| if upper { -d } else { d };
        let mut whole = Vec::new();
        for (i, (from, n)) in solid.iter().enumerate() {
            let to = solid.get(i + 1).map_or(most, |s| s.0);
            let from = from.max(reach);
            if *n == 1 && from < to {
                whole.push([level(from), level(to)]);
            }
        }
        ComponentCounts { upper, solid, trace, whole }
    }

    pub fn whole(&self) -> &[[f64; 2]] {
        &self.whole
    }

    pub fn count(&self, iso: f64) -> Count {
        let depth = if self.upper { -iso } else { iso };
        Count { components: at(&self.solid, depth), ports: at(&self.trace, depth) }
    }
}
