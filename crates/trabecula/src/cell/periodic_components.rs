//! Connected components of a periodic solid: the levels at which it is connected in R³.
//!
//! The function is sampled on a grid of the torus R³/Z³, divided into tetrahedra along the diagonals (Freudenthal). The solid of its
//! linear interpolant is homotopy equivalent to the subcomplex of its solid nodes, so its components and cycles are those of a
//! *periodic graph* (a quotient graph on the torus whose edges are labelled with the lattice translations that they cross).
//! Nodes are added in the order of their levels, and a *union-find with offsets* (`offset_forest`) keeps the components on the
//! torus. Each has the *sublattice of translations* of Z³ that its closed paths generate (`sublattice`): a component on the torus
//! lifts to as many components in R³ as that sublattice has cosets. So the solid is connected in R³ if it has one component on
//! the torus whose sublattice is all of Z³ (rank 3, index 1).
//!
//! Components appear at minima and merge, or gain a translation, at saddles. Each such event is moved to the adjacent critical
//! point of the function (`critical`), and the events are replayed at these levels.

use super::Part;
use rayon::prelude::*;

use geometry::math::{Vec3, add, scale, sub, unit};
use geometry::progress::checkpoint;

mod critical;
mod offset_forest;
mod sublattice;
mod torus_grid;

pub(super) use critical::{Critical, Function, critical, sample};
pub(super) use offset_forest::{Forest, UnionOutcome};
pub(super) use sublattice::Int3;
use sublattice::Sublattice;
pub(super) use torus_grid::AROUND;
use torus_grid::{DIRECTIONS, TorusGrid, groups};

/// The steps along the axes.
const STEPS: [Int3; 3] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/// A component as it appears.
struct Birth {
    node: u32,
    level: f64,
    /// Whether the level is that of a critical point, not of a sample.
    exact: bool,
    /// Translations of its closed paths when it appears.
    translations: Sublattice,
}

/// Two components that merge, or one whose sublattice of translations grows.
struct Event {
    components: [u32; 2],
    shift: Int3,
    level: f64,
    place: Vec3,
    exact: bool,
}

/// The intervals of the level, as amounts of solid grow, in which the periodic solid of this part of the cell function
/// `f` (values and gradients per turn at phases) is connected in R³: [from, to] in iso (for `Upper` from ≥ to). The last
/// one runs to the level at which all is solid.
///
/// Levels are exact (to about 1e-9) where the critical points are found by Newton's method, else good to the sampling.
pub fn connected(f: Function, part: Part) -> Vec<[f64; 2]> {
    let found = NodeFiltration::prepared(f, part, |sweep| {
        let (births, events) = sweep.events();
        let last = sweep.order.last().map_or(0, |i| *i);
        let full = sweep.refine(last, &[], 3).map_or(sweep.amounts[last as usize], |c| c.0);
        replay(births, events, full, sweep.grid.error, sweep.grid.range())
    });
    let mut intervals = found.unwrap_or_default();
    if part == Part::Upper {
        intervals.iter_mut().flatten().for_each(|v| *v = -*v + 0.0);
    }
    intervals
}

/// A level and a phase for one, two and three independent directions.
pub(super) type Openings = [Option<(f64, Vec3)>; 3];

/// For one, two and three independent directions: the level from which on a component of the part (`Lower` or `Upper`) is
/// connected with its translates in that number, as amounts of solid grow, and the phase of the saddle that does it. Levels are
/// those of f; as exact as those of [`connected`].
pub(super) fn openings(f: Function, part: Part) -> Openings {
    let found = NodeFiltration::prepared(f, part, |sweep| {
        let (births, mut events) = sweep.events();
        events.sort_by(|a, b| a.level.total_cmp(&b.level));
        let mut forest = Forest::new(sweep.amounts.len());
        births.iter().for_each(|b| forest.insert(b.node));
        let mut found = Openings::default();
        for e in &events {
            forest.join(e.components[0], e.components[1], e.shift);
            let rank = forest.translations(e.components[0]).rank();
            found[..rank].iter_mut().for_each(|open| *open = open.or(Some((e.level, e.place))));
        }
        found
    });
    let sign = if part == Part::Upper { -1.0 } else { 1.0 };
    found.unwrap_or_default().map(|open| open.map(|(level, at)| (sign * level, at)))
}

/// The saddles at which components that are separate in R³ join, a component and its own lattice translate included: (phase
/// in turns, level of f). A line on which f is extreme (a strut that shrinks to a line) is given by points along it.
/// Empty for sheets.
pub fn necks(f: Function, part: Part) -> Vec<(Vec3, f64)> {
    if part == Part::Sheet {
        return Vec::new();
    }
    NodeFiltration::prepared(f, part, |sweep| sweep.necks()).unwrap_or_default()
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
struct NodeFiltration<'a> {
    f: Function<'a>,
    part: Part,
    grid: &'a TorusGrid,
    amounts: &'a [f64],
    order: &'a [u32],
}

impl NodeFiltration<'_> {
    /// What `make` finds of a function's samples; `None` where one of them is no number.
    fn prepared<T>(f: Function, part: Part, make: impl Fn(&NodeFiltration) -> T) -> Option<T> {
        let grid = TorusGrid::sample(f);
        let mut amounts: Vec<f64> = grid.values.iter().map(|v| amount(part, *v)).collect();
        if amounts.iter().any(|v| !v.is_finite()) {
            return None;
        }
        amounts.iter_mut().for_each(|v| *v += 0.0); // −0.0 and 0.0 are one level
        let mut order: Vec<u32> = (0..amounts.len() as u32).collect();
        order.sort_unstable_by(|a, b| amounts[*a as usize].total_cmp(&amounts[*b as usize]).then(a.cmp(b)));
        Some(make(&NodeFiltration { f, part, grid: &grid, amounts: &amounts, order: &order }))
    }

    /// The amount at, and the phase of, the critical point near a node from which at most `falling` directions lead to more solid;
    /// sought from the node and from the middles towards `others`.
    fn refine(&self, node: u32, others: &[u32], falling: usize) -> Option<(f64, Vec3)> {
        let here = self.grid.position(node);
        let middle = |o: &u32| {
            let d = sub(self.grid.position(*o), here).map(|v| v - v.round());
            [0, 1, 2].map(|a| here[a] + d[a] / 2.0)
        };
        core::iter::once(here).chain(others.iter().map(middle)).find_map(|start| {
            let c = self.critical(node, start)?;
            let level = amount(self.part, c.level);
            let near = (level - self.amounts[node as usize]).abs() <= 3.0 * self.grid.error;
            (c.falling <= falling && near).then_some((level, c.at))
        })
    }

    /// The amount at a node, and its phase.
    fn sampled(&self, node: u32) -> (f64, Vec3) {
        (self.amounts[node as usize], self.grid.position(node))
    }

    /// The critical point near `start`, with the sign of the amount about `node`.
    fn critical(&self, node: u32, start: Vec3) -> Option<Critical> {
        let c = critical(self.f, start, 1.5 * 3f64.sqrt() / self.grid.n as f64)?;
        let negative = match self.part {
            Part::Sheet => self.grid.values[node as usize] < 0.0,
            Part::Lower => false,
            Part::Upper => true,
        };
        if !negative {
            return Some(c);
        }
        let [a, b, d] = c.axes;
        Some(Critical {
            falling: 3 - c.falling - c.flat,
            values: [-c.values[2], -c.values[1], -c.values[0]],
            axes: [d, b, a],
            ..c
        })
    }

    /// Adds the nodes in order and lists the events of the components.
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
            checkpoint();
            nears.clear();
            let near = AROUND.map(self.grid.steps(node));
            if sheet {
                // An edge belongs to the period of its first node.
                for (k, (behind, wrap)) in near[7..].iter().copied().enumerate() {
                    nears.push((self.grid.edge(node, k), near[k].0, [0; 3]));
                    nears.push((self.grid.edge(behind, k), behind, wrap));
                }
                nears.retain(|(element, _, _)| forest.has(*element));
            }
            nears.extend(present(&forest, &near).map(|(i, wrap)| (i, i, wrap)));
            forest.insert(node);
            if nears.is_empty() {
                let found = self.refine(node, &[], 0);
                let (level, _) = found.unwrap_or_else(|| self.sampled(node));
                births.push(Birth { node, level, exact: found.is_some(), translations: Sublattice::default() });
            }
            for &(element, towards, wrap) in &nears {
                let (components, shift) = match forest.join(node, element, wrap) {
                    UnionOutcome::Same => continue,
                    UnionOutcome::Merged { components: [_, young], .. } if young == node => continue,
                    UnionOutcome::Merged { components, shift } => (components, shift),
                    UnionOutcome::Loop { component, shift } => ([component; 2], shift),
                };
                let found = self.refine(node, &[towards], 1);
                let (level, place) = found.unwrap_or_else(|| self.sampled(node));
                events.push(Event { components, shift, level, place, exact: found.is_some() });
            }
        }
        (births, events)
    }

    /// Adds the surface f = 0: the grid edges that it crosses, joined through the triangles they share.
    fn surface(&self, forest: &mut Forest, births: &mut Vec<Birth>) {
        let n = self.amounts.len() as u32;
        let negative = |i: u32| self.grid.values[i as usize] < 0.0;
        let mut crossed = Vec::new();
        for node in 0..n {
            let step = self.grid.steps(node);
            for (k, d) in DIRECTIONS.iter().enumerate() {
                if negative(node) != negative(step(*d).0) {
                    forest.insert(self.grid.edge(node, k));
                    crossed.push(self.grid.edge(node, k));
                }
            }
        }
        for node in 0..n {
            // A triangle is node, node + d, node + d + e with d and e along different axes.
            let step = self.grid.steps(node);
            for k in 0..7 {
                for l in (0..7).filter(|l| (k + 1) & (l + 1) == 0) {
                    let (mid, wrap) = step(DIRECTIONS[k]);
                    let sides = [
                        (self.grid.edge(node, k), [0; 3]),
                        (self.grid.edge(mid, l), wrap),
                        (self.grid.edge(node, ((k + 1) | (l + 1)) - 1), [0; 3]),
                    ];
                    let mut crossed = sides.iter().filter(|(e, _)| forest.has(*e));
                    if let (Some((a, wa)), Some((b, wb))) = (crossed.next().copied(), crossed.next().copied()) {
                        forest.join(a, b, [0, 1, 2].map(|c| wb[c] - wa[c]));
                    }
                }
            }
        }
        for edge in crossed {
            if forest.is_eldest(edge) {
                births.push(Birth { node: edge, level: 0.0, exact: true, translations: forest.translations(edge) });
            }
        }
    }

    /// The saddles that join what was separate in R³ just before, and points of the lines that are extreme.
    fn necks(&self) -> Vec<(Vec3, f64)> {
        let back = 1.5 * self.grid.error + 1e-6 * self.grid.range();
        let n = self.order.len() as u32;
        // The node nearest to a critical point is at most h√3/2 away, which bounds its slope; and slopes fall towards it.
        let steepest = 0.866 * self.grid.bend / self.grid.n as f64;
        let still = |i: &u32| {
            let here = self.grid.slopes[*i as usize];
            let step = self.grid.steps(*i);
            let near = |d: Int3| self.grid.slopes[step(d).0 as usize];
            here <= steepest && STEPS.iter().all(|d| here <= near(*d) && here <= near(d.map(|c| -c)))
        };
        let points: Vec<Critical> = (0..n)
            .into_par_iter()
            .filter(still)
            .filter_map(|i| self.critical(i, self.grid.position(i)))
            .filter(|c| (c.falling == 1 && c.flat == 0) || (c.falling == 0 && c.flat > 0))
            .collect();
        let (saddles, lines): (Vec<_>, Vec<_>) = points.into_iter().partition(|c| c.flat == 0);
        let least = self.order.first().map_or(0.0, |i| self.amounts[*i as usize]);
        let extreme = |c: &Critical| amount(self.part, c.level) - least <= self.grid.error;
        let h = 1.0 / self.grid.n as f64;
        let mut found = distinct(lines.into_iter().filter(extreme).collect(), 1.8 * h);
        let mut queries: Vec<_> = distinct(saddles, 0.2 * h)
            .into_iter()
            .filter_map(|c| {
                let level = amount(self.part, c.level);
                let ends = [1.0, -1.0].map(|side| self.descend(&c, side * h, level - back));
                // A descent may end in a minimum less deep than that.
                let hollow = ends.iter().fold(level - back, |m, (node, _)| m.max(self.amounts[*node as usize]));
                let limit = hollow + 1e-9 * back;
                (limit < level).then_some((limit, ends, c))
            })
            .collect();
        queries.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut forest = Forest::new(self.order.len());
        let mut grown = 0;
        for (limit, [(a, v), (b, w)], saddle) in queries {
            while let Some(&node) = self.order.get(grown).filter(|i| self.amounts[**i as usize] < limit) {
                grown += 1;
                forest.insert(node);
                let near = AROUND.map(self.grid.steps(node));
                for (near, wrap) in present(&forest, &near) {
                    forest.join(node, near, wrap);
                }
            }
            if !forest.together(a, b, [0, 1, 2].map(|c| w[c] - v[c])) {
                found.push(saddle);
            }
        }
        found.into_iter().map(|c| (c.at.map(|v| v - v.floor()), c.level)).collect()
    }

    /// Walks from a saddle, `first` turns along its falling direction and then straight down, to a node near the first
    /// point solid at `limit`, or near the bottom of a hollow above it.
    fn descend(&self, saddle: &Critical, first: f64, limit: f64) -> (u32, Int3) {
        let sign = if self.part == Part::Upper { -1.0 } else { 1.0 };
        let mut at = add(saddle.at, scale(saddle.axes[0], first));
        let (mut v, mut g) = sample(self.f, at);
        let mut step = 0.4 * first.abs();
        loop {
            let corners = self.grid.corners(at).map(|c| (self.amounts[c.0 as usize], c));
            let lowest = corners.into_iter().fold(corners[0], |a, b| if b.0 < a.0 { b } else { a });
            if (sign * v < limit && lowest.0 < limit) || step < 0.01 * first.abs() {
                return lowest.1;
            }
            let next = add(at, scale(unit(g), -sign * step));
            let (w, k) = sample(self.f, next);
            if sign * w < sign * v {
                (at, v, g) = (next, w, k);
            } else {
                step *= 0.5;
            }
        }
    }
}

/// The neighbours that are in the forest, one of each group that is connected already.
pub(super) fn present(forest: &Forest, near: &[(u32, Int3); 14]) -> impl Iterator<Item = (u32, Int3)> + use<> {
    let bits = (0..14).fold(0, |bits, k| bits | u16::from(forest.has(near[k].0)) << k);
    let near = *near;
    groups(bits).map(move |k| near[k])
}

/// Points of one period, those nearer than `apart` along every axis given once.
fn distinct(points: Vec<Critical>, apart: f64) -> Vec<Critical> {
    let mut kept: Vec<Critical> = Vec::new();
    for p in points {
        let same = |k: &Critical| sub(p.at, k.at).iter().all(|d| (d - d.round()).abs() < apart);
        if !kept.iter().any(same) {
            kept.push(p);
        }
    }
    kept
}

/// Plays the events at their refined levels; the intervals in which there is one component, with all translations of Z³.
///
/// Components that merge with others within the error of sampling after they appear, or at the same level, are noise.
fn replay(births: Vec<Birth>, mut events: Vec<Event>, full: f64, error: f64, range: f64) -> Vec<[f64; 2]> {
    let index = |node: u32| births.iter().position(|b| b.node == node);
    let mut order: Vec<usize> = (0..births.len()).collect();
    order.sort_by(|a, b| births[*a].level.total_cmp(&births[*b].level));
    let mut forest = Forest::new(births.len());
    for &i in &order {
        forest.insert(i as u32);
        forest.add_translations(i as u32, &births[i].translations);
    }
    let Some(&eldest) = order.first() else {
        return Vec::new();
    };
    for e in events.iter_mut().filter(|e| !e.exact) {
        // On a line of extreme values a component merges with its neighbours at the level where it appears.
        let born = e.components.map(|p| index(p).map_or(f64::INFINITY, |i| births[i].level));
        let born = born[0].max(born[1]);
        if e.level - born <= error {
            (e.level, e.exact) = (born, true);
        }
    }
    events.sort_by(|a, b| a.level.total_cmp(&b.level));
    // Intervals of the level in which there is a second component.
    let mut spans = Vec::new();
    let mut whole = forest.translations(eldest as u32).is_full().then_some(births[eldest].level);
    for e in &events {
        let (Some(a), Some(b)) = (index(e.components[0]), index(e.components[1])) else {
            continue;
        };
        if let UnionOutcome::Merged { components: [_, young], .. } = forest.join(a as u32, b as u32, e.shift) {
            let born = &births[young as usize];
            let noise = if born.exact && e.exact { 1e-6 * range } else { error };
            if e.level - born.level > noise {
                spans.push([born.level, e.level]);
            }
        }
        if whole.is_none() && forest.translations(eldest as u32).is_full() {
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
