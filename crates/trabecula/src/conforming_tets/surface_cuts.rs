//! Cutting tetrahedra along a surface: nodes near it are moved onto it, edges that still cross it are bisected there.
//!
//! Nodes move to the nearest crossing of one of their edges as in isosurface stuffing (Labelle & Shewchuk, ACM Transactions on Graphics
//! 26(3), 2007); those that lie on other surfaces move to where all meet. Tetrahedra are bisected edge by edge in one order for the
//! whole mesh, the longest first, so that both sides of a face are divided alike.

use super::node_surfaces::{SurfaceSet, only, onto};
use super::node_tets::NodeTets;
use super::partition::{Partition, Tet, images};
use super::plane_sections::PlaneSections;
use super::tet_shape::shape;
use crate::field::Field;
use geometry::math::{Vec3, add, norm, sub};
use geometry::progress::{Cancellation, checkpoint};
use geometry::roots::{Bracket, FalsePosition};
use geometry::tetmesh::{EDGES, volume};
use rayon::prelude::*;

/// Points evaluated at a time.
const BATCH: usize = 256;
/// A node moves to a crossing closer than this fraction of the edge; the first two for long and short edges of the uncut background,
/// for the angle bounds of the paper.
const LONG: f64 = 0.24999;
const SHORT: f64 = 0.41189;
const OTHER: f64 = 0.33;
/// The least shape (`tet_shape::shape`) that moving a node may leave.
const LEAST: f64 = 0.4;
/// Nodes closer to a surface than this fraction of the background's edges are on it.
const ROUNDING: f64 = 1e-7;
/// Greatest distance of a projected position from its crossing, as a fraction of the edge.
const REACH: f64 = 0.5;

/// An edge that crosses the surface.
struct CutEdge {
    /// Its nodes, the one of negative value first.
    ends: [u32; 2],
    /// Where it crosses, as a fraction from the first.
    at: f64,
}

/// An edge that is bisected.
struct Mark {
    /// Its nodes, ascending.
    ends: [u32; 2],
    /// Its place in the order of bisection.
    rank: u32,
    /// The new node.
    node: u32,
}

impl Partition<'_> {
    /// Cuts the tetrahedra that depend on a surface along it. `step` are the edges of the background's cubes (mm).
    pub fn cut(&mut self, surface: usize, step: f64) {
        match self.patched.iter().find(|p| p.mesh == surface) {
            Some(patched) => self.cut_by_patches(patched, step),
            None => self.cut_where(surface, &self.dependent(surface), step),
        }
        self.drop_outside();
    }

    /// Cuts some tetrahedra along a surface.
    pub fn cut_where(&mut self, surface: usize, dependent: &[bool], step: f64) {
        let mut values = self.values(surface, dependent, step);
        let crossings = self.crossings(surface, dependent, &values);
        checkpoint();
        if !crossings.is_empty() {
            self.snap(surface, &crossings, &mut values, step);
        }
        checkpoint();
        let marks = self.mark(surface, &crossings, &mut values);
        let straight = self.project(surface, &marks);
        checkpoint();
        self.bisect(surface, dependent, &marks, &values);
        self.straighten(&straight);
    }

    /// Values of the surface's function at the nodes of some tetrahedra, zero at nodes on it, NaN elsewhere; the same at periodic
    /// images.
    pub fn values(&mut self, surface: usize, of: &[bool], step: f64) -> Vec<f64> {
        let bit = only(surface);
        let mut values = vec![f64::NAN; self.nodes.len()];
        let mut needed = vec![false; self.nodes.len()];
        for (t, _) in self.tets.iter().zip(of).filter(|(_, of)| **of) {
            t.nodes.iter().for_each(|n| needed[*n as usize] = true);
        }
        let next = &self.next;
        let first = |n: usize| images(next, n as u32).min().unwrap_or(n as u32) as usize;
        for n in 0..needed.len() {
            if needed[n] && self.next[n] as usize != n {
                needed[first(n)] = true;
            }
        }
        let ask: Vec<usize> = (0..needed.len()).filter(|n| needed[*n] && self.on[*n] & bit == 0).collect();
        let points: Vec<Vec3> = ask.iter().map(|n| self.nodes[*n]).collect();
        let found = evaluated(&*self.surfaces[surface].field, &points);
        for (n, v) in ask.iter().zip(found) {
            values[*n] = v;
        }
        // Corners of a mesh in which more than three patches meet.
        let rounding = if self.patched.iter().any(|p| p.groups().contains(&surface)) { ROUNDING * step } else { 0.0 };
        for n in 0..needed.len() {
            if needed[n] && next[n] as usize != n {
                values[n] = values[first(n)];
            }
            if needed[n] && (values[n].abs() <= rounding || self.on[n] & bit != 0) {
                values[n] = 0.0;
                self.on[n] |= bit;
            }
        }
        values
    }

    /// The edges of some tetrahedra that cross the surface, ascending, and where.
    fn crossings(&self, surface: usize, of: &[bool], values: &[f64]) -> Vec<CutEdge> {
        let each = self.tets.par_iter().zip(of).filter(|(_, of)| **of);
        let mut ends: Vec<[u32; 2]> = each
            .flat_map_iter(|(t, _)| {
                EDGES.into_iter().filter_map(|[a, b]| {
                    let (a, b) = (t.nodes[a], t.nodes[b]);
                    let (v, w) = (values[a as usize], values[b as usize]);
                    if v < 0.0 && w > 0.0 {
                        Some([a, b])
                    } else if v > 0.0 && w < 0.0 {
                        Some([b, a])
                    } else {
                        None
                    }
                })
            })
            .collect();
        ends.par_sort_unstable();
        ends.dedup();
        // Images cross where the first of them does.
        let first = |e: &[u32; 2]| self.edge_images(*e).into_iter().fold(*e, |m, o| m.min(o));
        let asked: Vec<[u32; 2]> = ends.par_iter().map(first).collect();
        let at = roots(&*self.surfaces[surface].field, &self.nodes, values, &asked);
        ends.into_iter().zip(at).map(|(ends, at)| CutEdge { ends, at }).collect()
    }

    /// Where an edge crosses.
    fn place(&self, c: &CutEdge) -> Vec3 {
        let [p, q] = c.ends.map(|n| self.nodes[n as usize]);
        core::array::from_fn(|k| p[k] + c.at * (q[k] - p[k]))
    }

    /// Moves nodes that are close to crossings of their edges onto the surface.
    fn snap(&mut self, surface: usize, crossings: &[CutEdge], values: &mut [f64], step: f64) {
        let this = &*self;
        // (first image, distance, crossing, its end)
        let mut near: Vec<(u32, f64, u32, u8)> = crossings
            .par_iter()
            .enumerate()
            .flat_map_iter(|(i, c)| {
                let [p, q] = c.ends.map(|n| this.nodes[n as usize]);
                let length = norm(sub(p, q));
                let free = c.ends.iter().all(|n| this.on[*n as usize] == 0);
                let share = match free {
                    true if length > 0.93 * step => LONG,
                    true => SHORT,
                    false => OTHER,
                };
                let ends = [(c.at, 0u8), (1.0 - c.at, 1u8)].into_iter().filter(move |(at, _)| *at < share);
                ends.map(move |(at, end)| {
                    let n = c.ends[end as usize];
                    (this.images(n).min().unwrap_or(n), at * length, i as u32, end)
                })
            })
            .collect();
        near.par_sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)).then(a.3.cmp(&b.3))
        });
        near.dedup_by_key(|c| c.0);
        let bit = only(surface);
        let mut moves: Vec<(f64, u32, Vec3)> = near
            .par_iter()
            .filter_map(|(_, distance, i, end)| {
                let c = &crossings[*i as usize];
                let n = c.ends[*end as usize] as usize;
                let at = self.place(c);
                let [p, q] = c.ends.map(|n| self.nodes[n as usize]);
                let reach = REACH * norm(sub(p, q));
                let to = match self.on[n] {
                    // A node on the surface up to rounding stays: at a corner of the region three other surfaces fix it.
                    _ if *distance <= ROUNDING * step => self.nodes[n],
                    0 => at,
                    on => onto(self.surfaces, on | bit, at, reach)?,
                };
                Some((*distance, n as u32, sub(to, self.nodes[n])))
            })
            .collect();
        moves.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let node_tets = self.node_tets(moves.iter().flat_map(|m| self.images(m.1)));
        let sections = PlaneSections::new(self);
        for (distance, n, by) in moves {
            checkpoint();
            let images: Vec<u32> = images(&self.next, n).collect();
            let first = images.iter().min().copied().unwrap_or(n);
            // Nodes on the surface up to rounding are on it whatever follows: edges would be cut there without length.
            if distance > ROUNDING * step && images.len() > 1 && !sections.stays_line(first, values) {
                continue;
            }
            let old: Vec<Vec3> = images.iter().map(|n| self.nodes[*n as usize]).collect();
            let of = |n: &u32| node_tets.of(*n).iter();
            let worst = |p: &Self| {
                let shapes = images.iter().flat_map(of).map(|t| shape(p.corners(&p.tets[*t as usize])));
                shapes.fold(f64::INFINITY, f64::min)
            };
            let before = worst(self);
            images.iter().for_each(|n| self.nodes[*n as usize] = add(self.nodes[*n as usize], by));
            if worst(self) >= LEAST.min(0.9 * before) {
                for n in images {
                    (self.on[n as usize], values[n as usize]) = (self.on[n as usize] | bit, 0.0);
                }
            } else {
                images.iter().zip(old).for_each(|(n, p)| self.nodes[*n as usize] = p);
            }
        }
    }

    /// The tetrahedra at some nodes.
    fn node_tets(&self, nodes: impl Iterator<Item = u32>) -> NodeTets {
        let mut wanted = vec![false; self.nodes.len()];
        nodes.for_each(|n| wanted[n as usize] = true);
        NodeTets::new(self.tets.iter().map(|t| t.nodes), &wanted)
    }

    /// Makes the nodes in which edges that still cross are bisected; in the order of their ends.
    fn mark(&mut self, surface: usize, crossings: &[CutEdge], values: &mut Vec<f64>) -> Vec<Mark> {
        let open = |c: &&CutEdge| c.ends.iter().all(|n| values[*n as usize] != 0.0);
        let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        // (length², first image, ends, where)
        let mut edges: Vec<(f64, [u32; 2], [u32; 2], Vec3)> = crossings
            .par_iter()
            .filter(open)
            .map(|c| {
                let [p, q] = c.ends.map(|n| self.nodes[n as usize]);
                let d = sub(p, q);
                let first = self.edge_images(c.ends).into_iter().map(sorted).fold(sorted(c.ends), |m, e| m.min(e));
                (geometry::math::dot(d, d), first, sorted(c.ends), self.place(c))
            })
            .collect();
        edges.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let bit = only(surface);
        let shared: Vec<SurfaceSet> = edges.par_iter().map(|e| self.shared(e.2)).collect();
        let mut marks: Vec<Mark> = Vec::with_capacity(edges.len());
        for (rank, (e, shared)) in (0..).zip(edges.iter().zip(shared)) {
            checkpoint();
            let node = self.nodes.len() as u32;
            // Images follow each other.
            let before = marks.last().filter(|_| rank > 0 && edges[rank as usize - 1].1 == e.1).map(|m| m.node);
            self.nodes.push(e.3);
            self.on.push(shared | bit);
            self.next.push(node);
            values.push(0.0);
            if let Some(before) = before {
                self.next.swap(before as usize, node as usize);
            }
            marks.push(Mark { ends: e.2, rank, node });
        }
        marks.sort_unstable_by_key(|m| m.ends);
        marks
    }

    /// Moves new nodes onto the other surfaces on which their edges lie; gives what their straight positions were.
    fn project(&mut self, surface: usize, marks: &[Mark]) -> Vec<(u32, Vec3)> {
        let bit = only(surface);
        let curved = |n: u32| {
            let mut others = super::node_surfaces::members(self.on[n as usize] & !bit);
            others.any(|s| self.surfaces[s].plane.is_none())
        };
        let moved: Vec<(u32, Vec3)> = marks
            .par_iter()
            .filter(|m| curved(m.node))
            .filter_map(|m| {
                let p = self.nodes[m.node as usize];
                let [a, b] = m.ends.map(|n| self.nodes[n as usize]);
                let first = self.images(m.node).min() == Some(m.node);
                let to =
                    if first { onto(self.surfaces, self.on[m.node as usize], p, REACH * norm(sub(a, b)))? } else { p };
                Some((m.node, sub(to, p)))
            })
            .collect();
        let mut straight = Vec::new();
        for (n, by) in moved {
            for n in images(&self.next, n) {
                if by != [0.0; 3] {
                    straight.push((n, self.nodes[n as usize]));
                    self.nodes[n as usize] = add(self.nodes[n as usize], by);
                }
            }
        }
        straight
    }

    /// Divides tetrahedra at their marked edges and notes on which side those that depend on the surface lie.
    fn bisect(&mut self, surface: usize, dependent: &[bool], marks: &[Mark], values: &[f64]) {
        let mut start = vec![0u32; self.nodes.len() + 1];
        marks.iter().for_each(|m| start[m.ends[0] as usize + 1] += 1);
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mark = |a: u32, b: u32| {
            let (a, b) = (a.min(b) as usize, a.max(b));
            marks[start[a] as usize..start[a + 1] as usize].iter().find(|m| m.ends[1] == b)
        };
        let bit = only(surface);
        let old = core::mem::take(&mut self.tets);
        let mut tets: Vec<Tet> = old
            .par_iter()
            .zip(dependent)
            .flat_map_iter(|(t, dependent)| {
                let mut found: Vec<&Mark> =
                    EDGES.into_iter().filter_map(|[a, b]| mark(t.nodes[a], t.nodes[b])).collect();
                found.sort_unstable_by_key(|m| m.rank);
                let mut out = Vec::with_capacity(if found.is_empty() { 1 } else { 6 });
                divided(*t, &found, &mut out);
                if *dependent {
                    for t in &mut out {
                        let side = t.nodes.iter().map(|n| values[*n as usize]).find(|v| *v != 0.0);
                        match side {
                            Some(v) if v < 0.0 => t.negative |= bit,
                            Some(_) => t.positive |= bit,
                            None => {}
                        }
                    }
                }
                out
            })
            .collect();
        // All nodes on the surface: the side of the middle.
        let field = &*self.surfaces[surface].field;
        let (nodes, trees) = (&self.nodes, self.trees);
        tets.par_iter_mut().for_each(|t| {
            let flat = t.nodes.iter().all(|n| values[*n as usize] == 0.0) && (t.negative | t.positive) & bit == 0;
            if flat && !trees.is_empty() {
                let p = t.nodes.map(|n| nodes[n as usize]);
                let middle = core::array::from_fn(|k| (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4.0);
                if field.value(middle) < 0.0 { t.negative |= bit } else { t.positive |= bit }
            }
        });
        self.tets = tets;
    }

    /// Moves nodes back whose projection inverted a tetrahedron.
    fn straighten(&mut self, straight: &[(u32, Vec3)]) {
        if straight.is_empty() {
            return;
        }
        let back: rustc_hash::FxHashMap<u32, Vec3> = straight.iter().copied().collect();
        for _ in 0..3 {
            let inverted = self.tets.par_iter().filter(|t| volume(self.corners(t)) <= 0.0);
            let mut bad: Vec<u32> = inverted.flat_map_iter(|t| t.nodes).filter(|n| back.contains_key(n)).collect();
            if bad.is_empty() {
                return;
            }
            bad = bad.into_iter().flat_map(|n| images(&self.next, n).collect::<Vec<_>>()).collect();
            bad.into_iter().for_each(|n| self.nodes[n as usize] = back[&n]);
        }
    }
}

/// The parts of a tetrahedron that is bisected at marked edges in their order.
fn divided(t: Tet, marks: &[&Mark], out: &mut Vec<Tet>) {
    let found = marks.iter().position(|m| m.ends.iter().all(|n| t.nodes.contains(n)));
    let Some(i) = found else { return out.push(t) };
    let [a, b] = marks[i].ends;
    let with = |end: u32| Tet { nodes: t.nodes.map(|n| if n == end { marks[i].node } else { n }), ..t };
    divided(with(b), &marks[i + 1..], out);
    divided(with(a), &marks[i + 1..], out);
}

/// Values of a field at points, on all threads.
pub(crate) fn evaluated(field: &dyn Field, points: &[Vec3]) -> Vec<f64> {
    let (mut out, request) = (vec![0.0; points.len()], Cancellation::current());
    out.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(o, p)| {
        request.enter(checkpoint);
        field.values(p, o);
    });
    out
}

/// The fraction of each edge, from its node of negative value, at which a field is zero.
fn roots(field: &dyn Field, nodes: &[Vec3], values: &[f64], edges: &[[u32; 2]]) -> Vec<f64> {
    const ROUNDS: usize = 40;
    let (mut found, request) = (vec![0.0; edges.len()], Cancellation::current());
    found.par_chunks_mut(BATCH).zip(edges.par_chunks(BATCH)).for_each(|(found, edges)| {
        request.enter(checkpoint);
        let ends = |[a, b]: &[u32; 2]| [values[*a as usize], values[*b as usize]];
        let start = |e: &[u32; 2]| Bracket { below: [0.0, ends(e)[0]], above: [1.0, ends(e)[1]] };
        let mut state: Vec<FalsePosition> = edges.iter().map(|e| FalsePosition::new(start(e))).collect();
        let mut open: Vec<usize> = (0..edges.len()).collect();
        let (mut points, mut new) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            points.clear();
            for i in &open {
                found[*i] = state[*i].guess();
                let [p, q] = edges[*i].map(|n| nodes[n as usize]);
                points.push(core::array::from_fn::<f64, 3, _>(|k| p[k] + found[*i] * (q[k] - p[k])));
            }
            new.resize(points.len(), 0.0);
            field.values(&points, &mut new);
            let mut v = new.iter();
            open.retain(|i| {
                let v = v.next().copied().unwrap_or_default();
                state[*i].narrow(found[*i], v);
                let [a, b] = ends(&edges[*i]);
                v.abs() > 1e-12 * (a.abs() + b.abs()) && state[*i].bracket().width() > 1e-14
            });
            if open.is_empty() {
                break;
            }
        }
    });
    found
}
