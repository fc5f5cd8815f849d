//! Where the periodic solid is one piece in R³.
//!
//! The function is sampled on a grid of the torus cut into tetrahedra along the diagonals (Freudenthal), on which
//! the linear interpolant's solid has the pieces and loops of the graph of its nodes. As solid grows node by node, a
//! forest keeps the pieces and, for each, the lattice translations that its closed paths realise: the solid is one
//! piece in R³ when there is one piece on the torus and its translations are all of Z³. Pieces appear and join at
//! critical values of the function, so each such event is moved to the critical point beside it, and the few events
//! that matter are played again at their exact levels.

use super::Part;
use crate::math::{Vec3, sub};

mod critical;
mod forest;
mod grid;
mod sublattice;

pub(super) use critical::{Function, critical, sample};
use forest::{Forest, Joined};
use grid::{DIRECTIONS, Grid};
use sublattice::{Int3, Sublattice};

/// How a part's connectivity changes with its level.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    /// Intervals of the level, as amounts of solid grow, in which the periodic solid is one piece in R³:
    /// [from, to] in iso (for `Upper` from ≥ to). The last one runs to the level at which all is solid.
    pub intervals: Vec<[f64; 2]>,
    /// Saddles by which pieces that were separate in R³ join, a piece and its own lattice translate included: (phase
    /// in turns, level of f). A line on which f is extreme (a strut that shrinks to a line) is given by points along
    /// it. Empty for sheets.
    pub necks: Vec<(Vec3, f64)>,
}

/// A piece as it appears.
struct Birth {
    node: u32,
    level: f64,
    /// Whether the level is that of a critical point, not of a sample.
    exact: bool,
    /// Loops that the piece had from the first.
    loops: Sublattice,
}

/// Two pieces that join, or one that meets its translate.
struct Event {
    pieces: [u32; 2],
    shift: Int3,
    level: f64,
    exact: bool,
}

/// Analyses the part of the cell function `f` (values and gradients per turn at phases).
///
/// Levels are exact (to about 1e-9) where the critical points are found by Newton's method, else good to the sampling.
pub fn connectivity(f: Function, part: Part) -> Connectivity {
    let grid = Grid::sample(f);
    let mut amounts: Vec<f64> = grid.values.iter().map(|v| amount(part, *v)).collect();
    if amounts.iter().any(|v| !v.is_finite()) {
        return Connectivity::default();
    }
    amounts.iter_mut().for_each(|v| *v += 0.0); // −0.0 and 0.0 are one level
    let mut order: Vec<u32> = (0..amounts.len() as u32).collect();
    order.sort_unstable_by(|a, b| {
        amounts[*a as usize]
            .total_cmp(&amounts[*b as usize])
            .then(a.cmp(b))
    });
    let sweep = Sweep {
        f,
        part,
        grid: &grid,
        amounts: &amounts,
        order: &order,
    };
    let (births, events) = sweep.events();
    let last = order.last().map_or(0, |i| *i);
    let full = sweep.refine(last, &[], 3).unwrap_or(amounts[last as usize]);
    let mut intervals = replay(births, events, full, grid.error, grid.range());
    if part == Part::Upper {
        intervals.iter_mut().flatten().for_each(|v| *v = -*v + 0.0);
    }
    let necks = if part == Part::Sheet {
        Vec::new()
    } else {
        sweep.necks()
    };
    Connectivity { intervals, necks }
}

/// How late a value becomes solid: the level at which it does (negated for the upper part).
fn amount(part: Part, v: f64) -> f64 {
    match part {
        Part::Sheet => v.abs(),
        Part::Lower => v,
        Part::Upper => -v,
    }
}

/// The nodes in the order in which they become solid.
struct Sweep<'a> {
    f: Function<'a>,
    part: Part,
    grid: &'a Grid,
    amounts: &'a [f64],
    order: &'a [u32],
}

impl Sweep<'_> {
    /// The amount at the critical point near a node at which at most `falling` directions lead to more solid;
    /// tried from the node and from the middles towards `others`.
    fn refine(&self, node: u32, others: &[u32], falling: usize) -> Option<f64> {
        self.refined(node, others, falling)
            .map(|(_, level, _)| level)
    }

    /// The same with the place and the number of flat directions.
    fn refined(&self, node: u32, others: &[u32], falling: usize) -> Option<(Vec3, f64, usize)> {
        let negative = match self.part {
            Part::Sheet => self.grid.values[node as usize] < 0.0,
            Part::Lower => false,
            Part::Upper => true,
        };
        let here = self.grid.position(node);
        let reach = 1.5 * 3f64.sqrt() / self.grid.n as f64;
        let middle = |o: &u32| {
            let d = sub(self.grid.position(*o), here).map(|v| v - v.round());
            [0, 1, 2].map(|a| here[a] + d[a] / 2.0)
        };
        core::iter::once(here)
            .chain(others.iter().map(middle))
            .find_map(|start| {
                let c = critical(self.f, start, reach)?;
                let rising = 3 - c.falling - c.flat;
                let down = if negative { rising } else { c.falling };
                let level = amount(self.part, c.level);
                let near = (level - self.amounts[node as usize]).abs() <= 3.0 * self.grid.error;
                (down <= falling && near).then_some((c.at, level, c.flat))
            })
    }

    /// Grows the solid and notes what happens to its pieces.
    fn events(&self) -> (Vec<Birth>, Vec<Event>) {
        let (n, sheet) = (self.amounts.len(), self.part == Part::Sheet);
        // Elements: nodes, then for a sheet the edges that the surface f = 0 crosses.
        let mut forest = Forest::new(if sheet { n * 8 } else { n });
        let mut births = Vec::new();
        let mut events = Vec::new();
        if sheet {
            self.surface(&mut forest, &mut births);
        }
        let mut nears = Vec::with_capacity(28);
        for &node in self.order {
            nears.clear();
            for (k, d) in DIRECTIONS.iter().enumerate() {
                let (ahead, wrap) = self.grid.step(node, *d);
                let (behind, back) = self.grid.step(node, d.map(|c| -c));
                nears.push((ahead, ahead, wrap));
                nears.push((behind, behind, back));
                if sheet {
                    // An edge stands in the period of its first node.
                    nears.push((self.grid.edge(node, k), ahead, [0; 3]));
                    nears.push((self.grid.edge(behind, k), behind, back));
                }
            }
            nears.retain(|(element, _, _)| forest.has(*element));
            forest.insert(node);
            if nears.is_empty() {
                let level = self.refine(node, &[], 0);
                births.push(Birth {
                    node,
                    level: level.unwrap_or(self.amounts[node as usize]),
                    exact: level.is_some(),
                    loops: Sublattice::default(),
                });
            }
            for &(element, towards, wrap) in &nears {
                let (pieces, shift) = match forest.join(node, element, wrap) {
                    Joined::Same => continue,
                    Joined::Merged {
                        pieces: [_, young], ..
                    } if young == node => continue,
                    Joined::Merged { pieces, shift } => (pieces, shift),
                    Joined::Loop { piece, shift } => ([piece; 2], shift),
                };
                let level = self.refine(node, &[towards], 1);
                let (level, exact) = (
                    level.unwrap_or(self.amounts[node as usize]),
                    level.is_some(),
                );
                events.push(Event {
                    pieces,
                    shift,
                    level,
                    exact,
                });
            }
        }
        (births, events)
    }

    /// Puts in the surface f = 0: crossed edges, joined through the triangles they share.
    fn surface(&self, forest: &mut Forest, births: &mut Vec<Birth>) {
        let n = self.amounts.len() as u32;
        let negative = |i: u32| self.grid.values[i as usize] < 0.0;
        let mut crossed = Vec::new();
        for node in 0..n {
            for (k, d) in DIRECTIONS.iter().enumerate() {
                if negative(node) != negative(self.grid.step(node, *d).0) {
                    forest.insert(self.grid.edge(node, k));
                    crossed.push(self.grid.edge(node, k));
                }
            }
        }
        for node in 0..n {
            // A triangle is node, node + d, node + d + e with d and e along different axes.
            for k in 0..7 {
                for l in (0..7).filter(|l| (k + 1) & (l + 1) == 0) {
                    let (mid, wrap) = self.grid.step(node, DIRECTIONS[k]);
                    let sides = [
                        (self.grid.edge(node, k), [0; 3]),
                        (self.grid.edge(mid, l), wrap),
                        (self.grid.edge(node, (k + 1 | (l + 1)) - 1), [0; 3]),
                    ];
                    let mut crossed = sides.iter().filter(|(e, _)| forest.has(*e));
                    if let (Some((a, wa)), Some((b, wb))) =
                        (crossed.next().copied(), crossed.next().copied())
                    {
                        forest.join(a, b, [0, 1, 2].map(|c| wb[c] - wa[c]));
                    }
                }
            }
        }
        for edge in crossed {
            if forest.leads(edge) {
                births.push(Birth {
                    node: edge,
                    level: 0.0,
                    exact: true,
                    loops: forest.loops(edge),
                });
            }
        }
    }

    /// The saddles that join what was separate in R³ just before, wherever the nodes that show them lie.
    fn necks(&self) -> Vec<(Vec3, f64)> {
        let mut rank = vec![0u32; self.order.len()];
        for (r, i) in self.order.iter().enumerate() {
            rank[*i as usize] = r as u32;
        }
        let range = self.grid.range();
        let back = 1.5 * self.grid.error + 1e-6 * range;
        let least = self
            .order
            .first()
            .map_or(0.0, |i| self.amounts[*i as usize]);
        let mut found: Vec<(Vec3, f64)> = Vec::new();
        let mut asked = Vec::new();
        for node in 0..self.order.len() as u32 {
            let below = self.lower_link(node, &rank);
            let level = self.amounts[node as usize];
            if below.len() >= 2 {
                let others: Vec<u32> = below.iter().map(|b| b.0).collect();
                let point = self.refined(node, &others, 1);
                let (at, level, _) = point.unwrap_or((self.grid.position(node), level, 0));
                let ends: Vec<_> = below
                    .iter()
                    .filter_map(|b| self.descend(*b, &rank, level - back))
                    .collect();
                if ends.len() >= 2 {
                    asked.push((level - back, at, level, ends));
                }
            }
            if level - least <= self.grid.error {
                // A strut that shrinks to a line of extreme f has its necks all along it.
                if let Some((at, level, 1..)) = self.refined(node, &[], 0) {
                    found.push((at, level));
                }
            }
        }
        asked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut forest = Forest::new(self.order.len());
        let mut grown = 0;
        for (limit, at, level, ends) in asked {
            while let Some(&node) = self
                .order
                .get(grown)
                .filter(|i| self.amounts[**i as usize] < limit)
            {
                grown += 1;
                forest.insert(node);
                for d in DIRECTIONS.iter().flat_map(|d| [*d, d.map(|c| -c)]) {
                    let (near, wrap) = self.grid.step(node, d);
                    if forest.has(near) {
                        forest.join(node, near, wrap);
                    }
                }
            }
            let (first, w) = ends[0];
            let apart = |(end, v): &(u32, Int3)| {
                !forest.together(first, *end, [0, 1, 2].map(|c| v[c] - w[c]))
            };
            if ends[1..].iter().any(apart) {
                found.push((at, level));
            }
        }
        let sign = if self.part == Part::Upper { -1.0 } else { 1.0 };
        distinct(found, 0.6 / self.grid.n as f64)
            .into_iter()
            .map(|(at, level)| (at, sign * level))
            .collect()
    }

    /// The pieces of a node's surroundings that are solid before it: the earliest node of each, with its period.
    fn lower_link(&self, node: u32, rank: &[u32]) -> Vec<(u32, Int3)> {
        let mut around = [(0u32, [0; 3], [0; 3]); 14];
        let mut n = 0;
        for d in DIRECTIONS.iter().flat_map(|d| [*d, d.map(|c| -c)]) {
            let (near, wrap) = self.grid.step(node, d);
            if rank[near as usize] < rank[node as usize] {
                around[n] = (near, wrap, d);
                n += 1;
            }
        }
        let around = &mut around[..n];
        around.sort_unstable_by_key(|a| rank[a.0 as usize]);
        let mut label = [usize::MAX; 14];
        let mut firsts = Vec::new();
        for i in 0..n {
            if label[i] != usize::MAX {
                continue;
            }
            firsts.push((around[i].0, around[i].1));
            let mut stack = vec![i];
            while let Some(a) = stack.pop() {
                label[a] = i;
                stack.extend((0..n).filter(|&b| {
                    label[b] == usize::MAX && grid::adjacent(around[a].2, around[b].2)
                }));
            }
        }
        firsts
    }

    /// Walks down from a node until the amount is below `limit`; `None` if it ends in a hollow above.
    fn descend(
        &self,
        (mut node, mut period): (u32, Int3),
        rank: &[u32],
        limit: f64,
    ) -> Option<(u32, Int3)> {
        while self.amounts[node as usize] >= limit {
            let (next, wrap) = DIRECTIONS
                .iter()
                .flat_map(|d| [*d, d.map(|c| -c)])
                .map(|d| self.grid.step(node, d))
                .min_by_key(|(near, _)| rank[*near as usize])?;
            if rank[next as usize] >= rank[node as usize] {
                return None;
            }
            node = next;
            period = [0, 1, 2].map(|c| period[c] + wrap[c]);
        }
        Some((node, period))
    }
}

/// Points of one period, those nearer than `apart` given once, in order of their level.
fn distinct(mut points: Vec<(Vec3, f64)>, apart: f64) -> Vec<(Vec3, f64)> {
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut kept: Vec<(Vec3, f64)> = Vec::new();
    for (at, level) in points {
        let same = |k: &(Vec3, f64)| {
            (0..3).all(|a| (at[a] - k.0[a] - (at[a] - k.0[a]).round()).abs() < apart)
        };
        if !kept.iter().any(same) {
            kept.push((at.map(|v| v - v.floor()), level));
        }
    }
    kept
}

/// Plays the events at their refined levels; the intervals in which one piece winds round the torus every way.
///
/// Pieces that join others again within the error of sampling, or exactly where they appear, are noise.
fn replay(
    births: Vec<Birth>,
    mut events: Vec<Event>,
    full: f64,
    error: f64,
    range: f64,
) -> Vec<[f64; 2]> {
    let index = |node: u32| births.iter().position(|b| b.node == node);
    let mut order: Vec<usize> = (0..births.len()).collect();
    order.sort_by(|a, b| births[*a].level.total_cmp(&births[*b].level));
    let mut forest = Forest::new(births.len());
    for &i in &order {
        forest.insert(i as u32);
        forest.wind(i as u32, &births[i].loops);
    }
    let Some(&eldest) = order.first() else {
        return Vec::new();
    };
    events.sort_by(|a, b| a.level.total_cmp(&b.level));
    // Spans in which a second piece lives.
    let mut spans = Vec::new();
    let mut whole = forest
        .loops(eldest as u32)
        .is_full()
        .then_some(births[eldest].level);
    for e in &events {
        let (Some(a), Some(b)) = (index(e.pieces[0]), index(e.pieces[1])) else {
            continue;
        };
        if let Joined::Merged {
            pieces: [_, young], ..
        } = forest.join(a as u32, b as u32, e.shift)
        {
            let born = &births[young as usize];
            let noise = if born.exact && e.exact {
                1e-6 * range
            } else {
                error
            };
            if e.level - born.level > noise {
                spans.push([born.level, e.level]);
            }
        }
        if whole.is_none() && forest.loops(eldest as u32).is_full() {
            whole = Some(e.level);
        }
    }
    let Some(mut from) = whole else {
        return Vec::new();
    };
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut intervals = Vec::new();
    for [birth, death] in spans {
        if birth - from > 1e-6 * range {
            intervals.push([from, birth]);
        }
        from = from.max(death);
    }
    if full - from > 1e-6 * range {
        intervals.push([from, full]);
    }
    intervals
}

#[cfg(test)]
mod tests;
