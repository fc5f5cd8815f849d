//! Nodes and edges on the creases of a surface, such as the edges of a mesh that is the region: cuts by one surface know none.
//!
//! Nodes near a crease move onto it, corners first; then boundary edges that cut across one are bisected there. Such nodes
//! stay where they are.

use rustc_hash::{FxHashMap, FxHashSet};

use super::chord_balance::{distances, interfaces};
use super::node_surfaces::{HELD, SurfaceSet, members, only};
use super::shaping::Shaping;
use super::tet_change::Change;
use super::tet_shape::shape;
use crate::implicit::Surface;
use geometry::feature_edges::Creases;
use geometry::math::{Vec3, add, dot, norm, scale, sub};

/// The least shape that a move or a bisection may leave: dihedral angles of 14 to 159.8 degrees.
const LEAST: f64 = 1.75;
/// Greatest move of a node, as a fraction of its shortest edge.
const REACH: f64 = 0.5;
/// Edges are bisected if their midpoint is farther from the surface than this fraction of their length.
const OFF: f64 = 0.03;

/// The creases of a surface, found by place.
struct Index<'a> {
    creases: &'a Creases,
    cell: f64,
    segments: FxHashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Index<'a> {
    /// Lookups reach `cell` (mm).
    fn new(creases: &'a Creases, cell: f64) -> Index<'a> {
        let mut index = Index { creases, cell, segments: FxHashMap::default() };
        for (i, s) in (0..).zip(&creases.segments) {
            let along = sub(s.ends[1], s.ends[0]);
            let steps = (2.0 * norm(along) / cell).ceil().max(1.0) as usize;
            for k in 0..=steps {
                let at = index.key(add(s.ends[0], scale(along, k as f64 / steps as f64)));
                let of = index.segments.entry(at).or_default();
                if of.last() != Some(&i) {
                    of.push(i);
                }
            }
        }
        index
    }

    fn key(&self, p: Vec3) -> [i64; 3] {
        p.map(|x| (x / self.cell).floor() as i64)
    }

    /// A position to a thousandth of a cell.
    fn place(&self, p: Vec3) -> [i64; 3] {
        p.map(|x| (1e3 * x / self.cell).round() as i64)
    }

    /// The nearest point of a crease within `reach` (mm, at most a cell), and the direction of the crease.
    fn nearest(&self, p: Vec3, reach: f64) -> Option<(Vec3, Vec3)> {
        let [x, y, z] = self.key(p);
        let mut best: Option<(f64, Vec3, Vec3)> = None;
        for dz in -1..=1 {
            for dy in -1..=1 {
                for dx in -1..=1 {
                    for i in self.segments.get(&[x + dx, y + dy, z + dz]).into_iter().flatten() {
                        let [a, b] = self.creases.segments[*i as usize].ends;
                        let d = sub(b, a);
                        let t = (dot(sub(p, a), d) / dot(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                        let q = add(a, scale(d, t));
                        let off = norm(sub(p, q));
                        if off <= reach && best.is_none_or(|(o, ..)| off < o) {
                            best = Some((off, q, scale(d, 1.0 / norm(d).max(f64::MIN_POSITIVE))));
                        }
                    }
                }
            }
        }
        best.map(|(_, q, d)| (q, d))
    }

    /// The point of a crease near `p` that lies on other surfaces as well (at most one): along its line by Newton's method.
    fn meeting(&self, p: Vec3, others: SurfaceSet, surfaces: &[Surface], reach: f64) -> Option<Vec3> {
        let (mut q, d) = self.nearest(p, reach)?;
        let Some(other) = members(others).next() else { return Some(q) };
        if members(others).count() > 1 {
            return None;
        }
        for _ in 0..8 {
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            surfaces[other].field.gradients(&[q], &mut v, &mut g);
            let slope = dot(g[0], d);
            if slope.abs() < 0.2 * norm(g[0]) {
                return None;
            }
            q = sub(q, scale(d, v[0] / slope));
            if norm(sub(p, q)) > reach {
                return None;
            }
        }
        // Off the end of the piece: not on the crease.
        let (back, _) = self.nearest(q, reach)?;
        (norm(sub(back, q)) < 1e-3 * reach).then_some(back)
    }
}

impl Shaping<'_> {
    /// Moves nodes onto creases and bisects edges that cut across them; whether there are creases. `step` is the edge of the
    /// background (mm).
    pub fn follow_creases(&mut self, step: f64) -> bool {
        let surfaces = self.surfaces;
        if surfaces.iter().all(|s| s.creases.segments.is_empty()) {
            return false;
        }
        // Sheets that nearly touch would meet in a place taken twice.
        let mut taken = FxHashSet::default();
        for (s, surface) in surfaces.iter().enumerate().filter(|(_, s)| !s.creases.segments.is_empty()) {
            let index = Index::new(&surface.creases, step);
            self.nodes_onto(s, &index, &mut taken);
            self.edges_onto(s, &index, &mut taken);
        }
        true
    }

    /// Moves nodes on a surface onto its creases: to corners first, then the nearest ones.
    fn nodes_onto(&mut self, s: usize, index: &Index, taken: &mut FxHashSet<[i64; 3]>) {
        let on = |n: usize| self.on[n] & only(s) != 0 && self.on[n] & HELD == 0 && self.next[n] as usize == n;
        let nodes: Vec<usize> = (0..self.nodes.len()).filter(|n| on(*n) && !self.around[*n].is_empty()).collect();
        let mut moves: Vec<(u8, f64, usize, Vec3)> = Vec::new();
        for n in nodes {
            let p = self.nodes[n];
            let others = self.around[n].iter().flat_map(|t| self.tets[*t as usize]).filter(|m| *m as usize != n);
            let shortest = others.map(|m| norm(sub(self.nodes[m as usize], p))).fold(f64::INFINITY, f64::min);
            let reach = REACH * shortest;
            if index.nearest(p, reach).is_none() {
                continue;
            }
            let corner = index.creases.corners.iter().map(|c| (norm(sub(c.0, p)), c.0));
            let corner = corner.filter(|c| c.0 < reach && self.on[n] == only(s)).min_by(|a, b| a.0.total_cmp(&b.0));
            let found = match corner {
                Some((off, at)) => Some((0, off, at)),
                None => {
                    let at = index.meeting(p, self.on[n] & !only(s), self.surfaces, reach);
                    at.map(|at| (1, norm(sub(at, p)), at))
                }
            };
            if let Some((rank, off, at)) = found
                && !self.crosses(&self.around[n], self.on[n], p, at)
            {
                moves.push((rank, off, n, at));
            }
        }
        moves.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        for (_, _, n, to) in moves {
            if taken.contains(&index.place(to)) {
                continue;
            }
            let old = core::mem::replace(&mut self.nodes[n], to);
            let worst = self.around[n].iter().map(|t| shape(self.corners(*t))).fold(f64::INFINITY, f64::min);
            let before = self.around[n].iter().map(|t| self.shapes[*t as usize]).fold(f64::INFINITY, f64::min);
            if worst < LEAST.min(before) {
                self.nodes[n] = old;
                continue;
            }
            self.on[n] |= HELD;
            taken.insert(index.place(to));
            for i in 0..self.around[n].len() {
                let t = self.around[n][i];
                self.shapes[t as usize] = shape(self.corners(t));
            }
        }
    }

    /// Whether a point moved from `p` to `to` would pass through another of the surfaces of nodes about some tetrahedra.
    fn crosses(&self, around: &[u32], own: SurfaceSet, p: Vec3, to: Vec3) -> bool {
        let nodes = around.iter().flat_map(|t| self.tets[*t as usize]);
        let near = nodes.fold(0, |set, n| set | self.on[n as usize]) & !own & !HELD;
        members(near).any(|s| {
            let field = &self.surfaces[s].field;
            (field.value(p) < 0.0) != (field.value(to) < 0.0)
        })
    }

    /// Bisects boundary edges on a surface that cut across a crease, the farthest from the surface first.
    fn edges_onto(&mut self, s: usize, index: &Index, taken: &mut FxHashSet<[i64; 3]>) {
        let faces = interfaces(&self.tets, &self.domain, &|n| self.on[n as usize] & only(s) != 0);
        let mut edges: Vec<[u32; 2]> =
            faces.iter().flat_map(|([a, b, c], ..)| [[*a, *b], [*a, *c], [*b, *c]]).collect();
        edges.sort_unstable();
        edges.dedup();
        let middle = |[a, b]: [u32; 2]| scale(add(self.nodes[a as usize], self.nodes[b as usize]), 0.5);
        let points: Vec<Vec3> = edges.iter().map(|e| middle(*e)).collect();
        let off = distances(&self.surfaces[s], &points);
        let mut crossed: Vec<(f64, [u32; 2], Vec3, SurfaceSet)> = Vec::new();
        for ((e, p), off) in edges.iter().zip(&points).zip(off) {
            let [a, b] = e.map(|n| self.nodes[n as usize]);
            let length = norm(sub(a, b));
            if off.abs() < OFF * length {
                continue;
            }
            let both = self.on[e[0] as usize] & self.on[e[1] as usize] & !HELD & !only(s);
            let own = both | only(s);
            if let Some(to) = index.meeting(*p, both, self.surfaces, 0.5 * length)
                && !self.crosses(&self.around[e[0] as usize], own, *p, to)
            {
                crossed.push((off.abs() / length, *e, to, both | only(s) | HELD));
            }
        }
        crossed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, [a, b], to, on) in crossed {
            let place = index.place(to);
            if !taken.contains(&place) && self.split_edge([a, b], to, on, LEAST) {
                taken.insert(place);
            }
        }
    }

    /// Bisects an edge by a node at a position if shapes are at least `least`; whether it was.
    pub(super) fn split_edge(&mut self, [a, b]: [u32; 2], at: Vec3, on: SurfaceSet, least: f64) -> bool {
        let gone = self.at_edge([a, b]);
        let new = self.nodes.len() as u32;
        let (mut made, mut domains) = (Vec::new(), Vec::new());
        for t in &gone {
            for end in [a, b] {
                let half = self.tets[*t as usize].map(|n| if n == end { new } else { n });
                let p = half.map(|n| if n == new { at } else { self.nodes[n as usize] });
                if shape(p) < least {
                    return false;
                }
                made.push(half);
                domains.push(self.domain[*t as usize]);
            }
        }
        self.nodes.push(at);
        self.on.push(on);
        self.next.push(new);
        self.around.push(Vec::new());
        if let Some(changes) = &mut self.changes {
            changes.push(Change::Added);
        }
        self.replace_each(&gone, &made, &domains);
        true
    }
}
