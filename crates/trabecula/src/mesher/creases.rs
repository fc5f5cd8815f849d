//! Feature edges of the region that edges of the boundary cut across: a node is placed on them.

use rayon::prelude::*;

use super::features::{meeting, touching};
use super::isosurface_stuffing::values;
use super::smooth::improve;
use super::tet_shape::shape;
use super::work::Work;
use crate::field::Field;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Boundary edges are examined if their midpoint is farther from the surface than this fraction of their length.
const OFF: f64 = 0.02;
/// An edge that crosses no feature edge is bisected if its midpoint is farther off than this fraction of its length;
/// for an arc whose radius is the length it would be 0.13.
const SHORT: f64 = 0.1;
/// Number of passes over the surrounding nodes to improve their tetrahedra.
const PASSES: usize = 3;
/// Positions along an edge (as fractions) at which tangent planes of the region are sampled; also near its ends, since a feature edge
/// may pass close to one.
const SAMPLES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Moves an end of, or bisects, boundary edges that cut across a feature edge or corner of the region, so that a node
/// lies on it; and bisects those that cut a curve short. No tetrahedron gets worse than `least` or than the worst at
/// its nodes was; with `relax`, after surrounding nodes were moved.
pub(super) fn creases(work: &mut Work, least: f64, relax: bool) {
    let mut moved = vec![false; work.mesh.nodes.len()];
    for found in crossed(work) {
        let edge = found.edge;
        if edge.iter().any(|n| moved[*n as usize]) {
            continue;
        }
        if work.given(&found, least, relax) {
            edge.iter().for_each(|n| moved[*n as usize] = true);
            moved.resize(work.mesh.nodes.len(), true);
        }
    }
}

impl Work<'_> {
    /// Gives an edge a node at the position of `found`: an end that is moved, or a new one, whichever leaves the better shapes.
    /// Returns whether it did.
    fn given(&mut self, found: &Crossed, least: f64, relax: bool) -> bool {
        let Crossed { edge, position, rank, .. } = *found;
        let ends = edge.map(|n| self.mesh.nodes[n as usize]);
        let near = 0.5 * norm(sub(ends[0], ends[1]));
        let free = |i: &usize| rank > 1 && self.held[edge[*i] as usize] < rank && norm(sub(position, ends[*i])) < near;
        let end = |i: usize| {
            let at = self.around.of(edge[i] as usize);
            (self.left(at, &edge[i..=i], position, least), Some(edge[i]))
        };
        let mut candidates: Vec<(f64, Option<u32>)> = (0..2).filter(free).map(end).collect();
        let at = self.around.edge(&self.mesh, edge);
        candidates.push((self.left(&at, &edge, position, least), None));
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        // For a curve no surrounding nodes are moved.
        candidates.retain(|c| relax && rank > 1 || c.0 >= 0.0);
        candidates.into_iter().any(|(left, end)| match end {
            Some(n) => self.moves(n as usize, found, left >= 0.0, least),
            None => self.halves(&at, found, left >= 0.0, least),
        })
    }

    /// The worst shape of some tetrahedra, less the allowed one, when each of `nodes` in turn is moved to `position`.
    fn left(&self, of: &[u32], nodes: &[u32], position: Vec3, least: f64) -> f64 {
        let (mut before, mut after) = (f64::INFINITY, f64::INFINITY);
        for t in of {
            let (t, p) = (self.mesh.tets[*t as usize], self.mesh.corners(*t as usize));
            before = before.min(shape(p));
            for n in nodes {
                let moved = core::array::from_fn(|i| if t[i] == *n { position } else { p[i] });
                after = after.min(shape(moved));
            }
        }
        after - least.min(before)
    }

    /// Moves a node to the position of `to`; returns whether it stays there.
    fn moves(&mut self, n: usize, to: &Crossed, good: bool, least: f64) -> bool {
        let ring = self.ring(self.around.of(n));
        let bar = self.bar(&ring, least);
        let old = core::mem::replace(&mut self.mesh.nodes[n], to.position);
        let held = core::mem::replace(&mut self.held[n], to.rank);
        let done = good || self.relax(&ring, bar);
        if !done {
            self.mesh.nodes[n] = old;
            self.held[n] = held;
        }
        done
    }

    /// Bisects an edge, whose tetrahedra are `at`; returns whether the new node stays.
    fn halves(&mut self, at: &[u32], to: &Crossed, good: bool, least: f64) -> bool {
        let mut ring = self.ring(at);
        let bar = self.bar(&ring, least);
        let count = self.mesh.tets.len();
        ring.push(self.mesh.nodes.len());
        self.split(to.edge, to.position, if to.rank > 1 { to.rank } else { 0 });
        let done = good || self.relax(&ring, bar);
        if !done {
            self.unsplit(to.edge, count);
        }
        done
    }

    /// The nodes of some tetrahedra, ascending.
    fn ring(&self, of: &[u32]) -> Vec<usize> {
        let nodes = of.iter().flat_map(|t| self.mesh.tets[*t as usize]);
        let mut ring: Vec<usize> = nodes.map(|n| n as usize).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// The worst shape about some nodes, or `least` if that is worse.
    fn bar(&self, ring: &[usize], least: f64) -> f64 {
        ring.iter().fold(least, |m, n| m.min(self.worst(*n).0))
    }

    /// Moves nodes of a ring until none of their tetrahedra is worse than `bar`, and returns whether that was reached; if not
    /// they are moved back.
    fn relax(&mut self, ring: &[usize], bar: f64) -> bool {
        let old: Vec<Vec3> = ring.iter().map(|n| self.mesh.nodes[*n]).collect();
        for _ in 0..PASSES {
            for n in ring {
                if self.held[*n] == 0 {
                    improve(self, *n);
                }
            }
            if ring.iter().all(|n| self.worst(*n).0 >= bar) {
                return true;
            }
        }
        for (n, p) in ring.iter().zip(old) {
            self.mesh.nodes[*n] = p;
        }
        false
    }
}

/// Whether the segment from a point to a point of the surface lies on one side of it: else another wall, or a gap, lies
/// between them.
fn within(region: &dyn Field, p: Vec3, position: Vec3) -> bool {
    let points = [0.0, 0.3, 0.6, 0.9].map(|s| add(p, scale(sub(position, p), s)));
    let mut v = [0.0; 4];
    region.values(&points, &mut v);
    v.iter().all(|v| *v < 0.0) || v.iter().all(|v| *v > 0.0)
}

/// An edge of the boundary whose midpoint is off the surface.
struct Crossed {
    edge: [u32; 2],
    /// Distance of its midpoint from the surface (mm).
    off: f64,
    /// The target position of the node, and the number of directions in which the region holds it there: 1 on a smooth face,
    /// 2 on an edge, 3 in a corner.
    position: Vec3,
    rank: usize,
}

/// The boundary's edges that cut across edges or corners of the region, or cut a curve short; corners first, then those that
/// are farthest off.
fn crossed(work: &Work) -> Vec<Crossed> {
    let (region, mesh) = (work.region, &work.mesh);
    let faces = mesh.boundary_faces();
    let mut edges: Vec<[u32; 2]> =
        faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|[a, b]| a < b).collect();
    edges.par_sort_unstable();
    let ends = |e: &[u32; 2]| e.map(|n| mesh.nodes[n as usize]);
    let middle = |e: &[u32; 2]| {
        let [p, q] = ends(e);
        scale(add(p, q), 0.5)
    };
    let middles: Vec<Vec3> = edges.iter().map(middle).collect();
    let off = values(region, &middles);
    let crossing = |((e, m), off): ((&[u32; 2], &Vec3), &f64)| {
        let [p, q] = ends(e);
        let along = sub(q, p);
        let length = norm(along);
        if off.abs() < OFF * length {
            return None;
        }
        let points = SAMPLES.map(|s| add(p, scale(along, s)));
        let planes = touching(region, &points);
        let found = meeting(region, *m, &planes).filter(|(_, rank)| *rank > 1);
        let short = || (off.abs() > SHORT * length).then_some((planes[2].0, 1));
        let (position, rank) = found.or_else(short)?;
        let near = norm(sub(position, *m)) < length
            && region.value(position).abs() < OFF * length
            && within(region, *m, position)
            && !work.bars(position);
        near.then_some(Crossed { edge: *e, off: off.abs(), position, rank })
    };
    let all = edges.par_iter().zip(&middles).zip(&off);
    let mut found: Vec<Crossed> = all.filter_map(crossing).collect();
    let order = |a: &Crossed, b: &Crossed| {
        let rank = b.rank.cmp(&a.rank);
        rank.then(b.off.total_cmp(&a.off)).then(a.edge.cmp(&b.edge))
    };
    found.sort_by(order);
    found
}
