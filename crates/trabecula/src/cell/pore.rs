//! The largest ball that passes through a periodic void: its bottleneck.
//!
//! A ball of radius r can be where the distance d to the solid is at least r, so the largest one that travels through the void
//! is the largest r at which {d ≥ r} is connected with translates of itself in as many independent directions as the void is
//! (a widest path, or maximin path). Nodes of a grid on the torus are added to a union-find with offsets in the order of falling
//! d; the one at which the sublattice of a component reaches that rank marks the bottleneck, and the saddle of d there gives it.
//!
//! At the nodes d is measured exactly, but it has creases: a node's own d may be a grid step less than on the ridge next to it. So
//! each node stands for the largest ball about a point within half a step of it, which the feet of its neighbours give. That
//! makes d at most too great, by the second order in the step.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::Part;
use super::foot_point::LevelSurface;
use super::nearest::NearestSearch;
use super::periodic_components::{AROUND, Forest, Int3, critical, present};
use super::series::Series;
use super::thickness::distance;
use super::throat::throat;
use geometry::math::{Mat3, Vec3, add, dot, inverse, norm, scale, sub, transpose, unit};

/// Fewest and most nodes along an axis, and nodes on the finest wave along it.
const NODES: [f64; 2] = [24.0, 64.0];
const WAVE: f64 = 12.0;
/// Most nodes times terms of the series.
const EFFORT: f64 = 4e6;
/// Share of a grid step by which values at the nodes may be too great, and by which they are uneven.
const EXCESS: f64 = 0.25;
const NOISE: f64 = 0.015;
/// How far from the node of a pass a saddle of f is sought, turns.
const ABOUT: f64 = 0.1;
/// Share of a neck's radius within which two saddles are one.
const SAME: f64 = 1e-3;
/// Ratio of the nodes along each axis of the second grid, where the saddle is not found on the first.
const FINER: f64 = 1.7;

/// Whether no wave is finer than the finest grid is for.
pub(super) fn resolves(series: &Series) -> bool {
    let indices = series.terms().iter().flat_map(|t| t.hkl);
    indices.map(i32::unsigned_abs).max().is_none_or(|top| WAVE * f64::from(top) <= NODES[1])
}

/// A void to pass through: f ≥ level (`Upper`) or f ≤ level (`Lower`), in space.
pub(super) struct Void<'a> {
    pub(super) series: &'a Series,
    pub(super) side: Part,
    pub(super) level: f64,
    pub(super) to_phase: &'a Mat3,
    /// In how many independent directions it is connected with its translates, and the phase of the saddle at which it
    /// becomes so.
    pub(super) rank: usize,
    pub(super) saddle: Vec3,
    /// The phases of the saddles of f at which parts of the void join that are open at the level.
    pub(super) necks: Vec<Vec3>,
}

/// A pass between two chambers of the void, or between a chamber and a translate of its own.
struct Pass {
    /// The nodes at which the chambers are widest.
    chambers: [u32; 2],
    /// The period of the second relative to the first.
    shift: Int3,
    /// The node at its narrowest place, and the radius (mm) of the largest ball there.
    node: u32,
    radius: f64,
    /// Whether its saddle has been sought, and found.
    sought: bool,
    found: bool,
}

/// The nodes of a grid on the torus, and what of the void each stands for.
struct VoidNodes<'a> {
    void: &'a Void<'a>,
    /// f less the void's level.
    series: &'a Series,
    search: &'a NearestSearch<'a>,
    surface: LevelSurface<'a>,
    feet: Vec<Vec3>,
    /// Radius (mm) of the largest ball near a node; zero in the solid.
    radii: Vec<f64>,
    step: f64,
    /// The node nearest to each neck of the void, and the vector (mm) from it to the neck.
    necks: Vec<(u32, Vec3)>,
}

impl Void<'_> {
    /// Diameter (mm) of the largest ball that passes through; infinite where nothing is solid, zero where nothing is open.
    pub(super) fn pore(&self) -> f64 {
        if self.rank == 0 {
            return 0.0;
        }
        let Ok(series) = self.series.about(self.level) else {
            return 0.0;
        };
        match self.measured(&series, 1.0) {
            (_, false) => self.measured(&series, FINER),
            sure => sure,
        }
        .0
    }

    /// The same on a grid with `finer` times the nodes along each axis, and whether the saddle was found.
    fn measured(&self, series: &Series, finer: f64) -> (f64, bool) {
        let search = NearestSearch::new(series, self.to_phase, self.shape(finer));
        let (f, feet) = search.feet();
        if !feet.iter().any(|p| p[0].is_finite()) {
            return (f64::INFINITY, true);
        }
        let open = |f: f64| if self.side == Part::Lower { f < 0.0 } else { f > 0.0 };
        let step = search.diagonal();
        let radii = (0..f.len()).into_par_iter();
        let radii =
            radii.map(|i| if open(f[i]) { largest_near(&search, &feet, i, 0.5 * step).1 } else { 0.0 }).collect();
        let surface = LevelSurface::new(series, 0.0, self.to_phase, 3.0 * step);
        let necks = self.necks.iter().map(|u| search.nearest_node(*u)).collect();
        let nodes = VoidNodes { void: self, series, search: &search, surface, feet, radii, step, necks };
        let (radius, sure) = nodes.bottleneck(self.rank).unwrap_or_else(|| (nodes.at(self.saddle), true));
        (2.0 * radius, sure)
    }

    /// Nodes along the axes, about equally far apart in space.
    fn shape(&self, finer: f64) -> [usize; 3] {
        let edges = transpose(&inverse(self.to_phase)).map(norm);
        let least = edges.iter().fold(f64::INFINITY, |m, e| m.min(*e));
        let most = (EFFORT / self.series.terms().len() as f64).cbrt().clamp(NODES[0], NODES[1]);
        core::array::from_fn(|a| {
            let top = self.series.terms().iter().map(|t| t.hkl[a].unsigned_abs()).max().unwrap_or(1);
            let waves = (WAVE * f64::from(top)).max(NODES[0]);
            (finer * waves * edges[a] / least).clamp(NODES[0], most).ceil() as usize
        })
    }
}

/// The centre (mm from a node) and radius of the largest empty ball about a point at most `reach` from the node, among the feet
/// of the node and its neighbours: away from the nearest foot, then from the nearest two, then from the nearest three.
fn largest_near(search: &NearestSearch, feet: &[Vec3], node: usize, reach: f64) -> (Vec3, f64) {
    let mut near = [feet[node]; 27];
    let at = search.index(node);
    for (k, (d, step)) in search.around().iter().enumerate() {
        near[k] = add(feet[search.neighbour(at, *d)], *step);
    }
    near.sort_unstable_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)));
    let (mut x, first) = ([0.0; 3], near[0]);
    let mut spanned: Vec<Vec3> = Vec::with_capacity(2);
    loop {
        let from = sub(x, first);
        let radius = norm(from);
        let along = spanned.iter().fold(from, |v, s| sub(v, scale(*s, dot(v, *s))));
        if spanned.len() == 3 || norm(along) < 1e-9 * radius {
            return (x, radius);
        }
        let along = unit(along);
        // To where the next foot is as near, or the reach ends.
        let ahead = dot(x, along);
        let mut go = (ahead * ahead + reach * reach - dot(x, x)).max(0.0).sqrt() - ahead;
        let mut next = None;
        for p in &near[1..] {
            let faster = dot(along, sub(*p, first));
            let to = sub(x, *p);
            let s = (dot(to, to) - radius * radius) / (2.0 * faster);
            if faster > 1e-9 * radius && s < go {
                (go, next) = (s.max(0.0), Some(*p));
            }
        }
        x = add(x, scale(along, go));
        let Some(p) = next else {
            return (x, norm(sub(x, first)));
        };
        let across = sub(p, first);
        let across = spanned.iter().fold(across, |v, s| sub(v, scale(*s, dot(v, *s))));
        if norm(across) < 1e-9 * radius {
            return (x, norm(sub(x, first)));
        }
        spanned.push(unit(across));
    }
}

/// The same key for a pass and its reverse.
fn ordered(a: u32, b: u32, shift: Int3) -> (u32, u32, Int3) {
    let back = shift.map(|c| -c);
    if (a, shift) <= (b, back) { (a, b, shift) } else { (b, a, back) }
}

impl VoidNodes<'_> {
    /// The passes between chambers, as the ball shrinks, down to a little below the radius at which a component has the rank;
    /// `None` if none has it. A chamber hardly wider than its widest pass is one with what is beyond it.
    fn passes(&self, rank: usize) -> Option<Vec<Pass>> {
        let mut order: Vec<u32> = (0..self.radii.len() as u32).filter(|i| self.radii[*i as usize] > 0.0).collect();
        let radius = |i: u32| self.radii[i as usize];
        order.sort_unstable_by(|a, b| radius(*b).total_cmp(&radius(*a)).then(a.cmp(b)));
        let [mut chambers, mut components] = [(); 2].map(|()| Forest::new(self.radii.len()));
        let (mut passes, mut known) = (Vec::new(), FxHashSet::default());
        let mut found = 0.0;
        for node in order {
            if radius(node) < found {
                break;
            }
            chambers.insert(node);
            components.insert(node);
            for (k, (towards, wrap)) in present(&chambers, &AROUND.map(|d| self.search.stepped(node, d))).enumerate() {
                components.join(node, towards, wrap);
                let [(here, own), (there, other)] = [node, towards].map(|i| chambers.eldest(i));
                let shift = [0, 1, 2].map(|a| own[a] + wrap[a] - other[a]);
                let narrow = radius(here).min(radius(there)) - radius(node) < 2.0 * NOISE * self.step;
                if here != there && (k == 0 || narrow) {
                    chambers.join(node, towards, wrap);
                } else if (here != there || shift != [0; 3]) && known.insert(ordered(here, there, shift)) {
                    let chambers = [here, there];
                    passes.push(Pass { chambers, shift, node, radius: radius(node), sought: false, found: false });
                }
            }
            if found == 0.0 && components.translations(node).rank() >= rank {
                found = radius(node) - EXCESS * self.step;
            }
        }
        (found != 0.0).then_some(passes)
    }

    /// Radius of the largest ball that passes in `rank` directions, and whether its saddle was found. Saddles are sought of the
    /// pass that is the bottleneck, then of those that may be as narrow or as wide.
    fn bottleneck(&self, rank: usize) -> Option<(f64, bool)> {
        let mut passes = self.passes(rank)?;
        let mut excess = 0.0f64;
        loop {
            passes.sort_by(|a, b| b.radius.total_cmp(&a.radius));
            let last = self.widest(&passes, rank);
            let radius = passes[last].radius;
            let near = (radius - NOISE * self.step)..=(radius + 2.0 * excess + NOISE * self.step);
            let mut open: Vec<&mut Pass> = match passes[last].sought {
                false => vec![&mut passes[last]],
                true => passes.iter_mut().filter(|p| !p.sought && near.contains(&p.radius)).collect(),
            };
            if open.is_empty() {
                return Some((radius, passes[last].found));
            }
            let found: Vec<Option<f64>> = open.par_iter().map(|p| self.found(p)).collect();
            for (pass, found) in open.iter_mut().zip(found) {
                pass.found = found.is_some();
                let radius = found.unwrap_or(pass.radius);
                excess = excess.max(pass.radius - radius);
                (pass.radius, pass.sought) = (radius, true);
            }
        }
    }

    /// The last of the passes, widest first, that has to be open for a component to have the rank.
    fn widest(&self, passes: &[Pass], rank: usize) -> usize {
        let mut forest = Forest::new(self.radii.len());
        for (i, pass) in passes.iter().enumerate() {
            let [a, b] = pass.chambers;
            for c in [a, b] {
                if !forest.has(c) {
                    forest.insert(c);
                }
            }
            forest.join(a, b, pass.shift);
            if forest.translations(a).rank() >= rank {
                return i;
            }
        }
        passes.len() - 1
    }

    /// Radius of a pass, where its saddle is found.
    fn found(&self, pass: &Pass) -> Option<f64> {
        self.narrow(pass).or_else(|| self.sharp(pass)).or_else(|| self.symmetric(pass))
    }

    /// Radius at the saddle of the distance that is one of f too, as in the middle of symmetric necks.
    fn symmetric(&self, pass: &Pass) -> Option<f64> {
        let start = self.search.phase(pass.node as usize);
        let at = critical(&|u, v, g| self.series.gradients(u, v, g), start, ABOUT)?.at;
        let (node, from) = self.search.nearest_node(at);
        self.saddle(node, from).filter(|r| (r - pass.radius).abs() < EXCESS * self.step)
    }

    /// Radius at the saddle of the distance near the node of a pass: from the largest ball near it, or from the node itself.
    fn sharp(&self, pass: &Pass) -> Option<f64> {
        let ball = largest_near(self.search, &self.feet, pass.node as usize, 0.5 * self.step).0;
        let found = [ball, [0.0; 3]].into_iter().find_map(|from| self.saddle(pass.node, from));
        found.filter(|r| (r - pass.radius).abs() < EXCESS * self.step)
    }

    /// Radius of a pass that is narrower than the grid's step, at the neck of the void near it: the ball of a node may then lie
    /// in the chamber next to it.
    fn narrow(&self, pass: &Pass) -> Option<f64> {
        if pass.radius > self.step {
            return None;
        }
        let here = self.search.index(pass.node as usize);
        let off = |(node, from): &(u32, Vec3)| {
            let there = self.search.index(*node as usize);
            let apart = [0, 1, 2].map(|a| self.search.between(a, here[a], there[a]));
            (0..3).fold(*from, |s, a| add(s, scale(self.search.spacing()[a], f64::from(apart[a]))))
        };
        let near = self.necks.iter().map(|n| (norm(off(n)), n)).filter(|(d, _)| *d < 1.5 * self.step);
        let (_, (node, from)) = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let radius = self.neck(*node, *from);
        (radius < pass.radius + NOISE * self.step).then_some(radius)
    }

    /// Radius at the saddle of the distance near a point `from` (mm) a node.
    fn saddle(&self, node: u32, from: Vec3) -> Option<f64> {
        let mut cloud: Vec<Vec3> = Vec::with_capacity(125);
        let at = self.search.index(node as usize);
        let spacing = self.search.spacing();
        for k in 0..125 {
            let d = [k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2];
            let step = (0..3).fold([0.0; 3], |s, a| add(s, scale(spacing[a], f64::from(d[a]))));
            let foot = add(self.feet[self.search.moved(at, d)], step);
            if foot[0].is_finite() {
                cloud.push(foot);
            }
        }
        throat(&self.surface, self.search.phase(node as usize), from, &cloud, 0.5 * self.step)
    }

    /// Radius at the saddle of the distance near a phase; the distance itself where there is none.
    fn at(&self, u: Vec3) -> f64 {
        let (node, from) = self.search.nearest_node(u);
        self.neck(node, from)
    }

    /// Radius of a neck whose saddle of f lies `from` (mm) a node. As it closes, that saddle is the distance's too, the surface is
    /// nearly a circle, and patches of it decide little: where they agree the distance at that saddle, or else the narrower.
    fn neck(&self, node: u32, from: Vec3) -> f64 {
        let u = self.surface.moved(self.search.phase(node as usize), from);
        let sign = if self.void.side == Part::Lower { 1.0 } else { -1.0 };
        let measured = distance(self.series, u, 0.0, sign, self.void.to_phase).unwrap_or(f64::INFINITY);
        let other = self.saddle(node, from).filter(|r| (r / measured - 1.0).abs() > SAME);
        other.map_or(measured, |r| r.min(measured))
    }
}
