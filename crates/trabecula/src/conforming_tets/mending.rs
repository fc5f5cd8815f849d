//! The worst tetrahedra, whose neighbourhoods become worse before they become better.
//!
//! Where no move, flip or collapse helps by itself, an edge is bisected, removed or collapsed whatever comes of it, and what that touched
//! is improved step by step. All is taken back unless everything touched is better than the tetrahedron was, so that the worst shapes never
//! get worse. Nodes are inserted in this way by B. M. Klingner and J. R. Shewchuk (Aggressive tetrahedral mesh improvement, 2007).

use super::boundary_node_hash::BoundaryNodeHash;
use super::node_surfaces::{HELD, SurfaceSet};
use super::shaping::{GONE, Shaping};
use super::tet_change::Change;
use super::tet_shape::shape;
use geometry::math::{Aabb, add, scale};
use geometry::progress::checkpoint;
use geometry::tetmesh::{EDGES, FACES};

/// Shapes worse than this are mended: dihedral angles below 15.1 or above 158.8 degrees.
const MENDED: f64 = 2.0;
/// So are shapes worse than this where they are few: dihedral angles below 21 or above 149.8 degrees,
const FAIR: f64 = 3.9;
/// at most this number.
const FEW: usize = 60;
/// Rounds over all of them.
const ROUNDS: usize = 3;
/// The least shape that the first change may leave: a tetrahedron with some volume.
const LEAST: f64 = 0.01;
/// The most steps after it.
const STEPS: usize = 40;
/// The least relative gain.
const GAIN: f64 = 1.05;

/// The first change of a neighbourhood.
#[derive(Clone, Copy)]
enum First {
    Bisect([u32; 2]),
    RemoveEdge([u32; 2]),
    RemoveFace([u32; 3]),
    Collapse([u32; 2]),
}

impl Shaping<'_> {
    /// Mends the neighbourhoods of the worst tetrahedra, and of those that are a little worse than the best meshes have where they are
    /// few; whether any was.
    pub fn mend(&mut self) -> bool {
        let mut mended = false;
        let mut node_hash = None;
        for _ in 0..ROUNDS {
            let mut bad = self.bad();
            let below = |bad: &[u32], bar: f64| bad.partition_point(|t| self.shapes[*t as usize] < bar);
            let (worst, fair) = (below(&bad, MENDED), below(&bad, FAIR));
            let bar = if fair <= worst + FEW { FAIR } else { MENDED };
            bad.truncate(if bar == FAIR { fair } else { worst });
            if bad.is_empty() {
                break;
            }
            let node_hash = node_hash.get_or_insert_with(|| BoundaryNodeHash::new(self));
            let mut any = false;
            for t in bad {
                checkpoint();
                if self.tets[t as usize] != GONE && self.shapes[t as usize] < bar {
                    any |= self.mend_at(t, node_hash) || self.mend_free(t, node_hash);
                }
            }
            if !any {
                break;
            }
            mended = true;
        }
        mended
    }

    /// Mends the neighbourhood of a tetrahedron with its nodes on creases set free; whether it is better. If not, they stay.
    fn mend_free(&mut self, t: u32, node_hash: &BoundaryNodeHash) -> bool {
        let held = |on: SurfaceSet| on & HELD != 0 && on != HELD;
        let nodes = self.tets[t as usize];
        let freed: Vec<Change> = nodes.into_iter().map(|n| Change::Freed(n, self.on[n as usize])).collect();
        let any = nodes.into_iter().any(|n| held(self.on[n as usize]));
        for n in nodes.into_iter().map(|n| n as usize) {
            if held(self.on[n]) {
                self.on[n] &= !HELD;
            }
        }
        if any && self.mend_at(t, node_hash) {
            return true;
        }
        self.take_back(freed);
        false
    }

    /// Mends the neighbourhood of a tetrahedron; whether it is better.
    fn mend_at(&mut self, t: u32, node_hash: &BoundaryNodeHash) -> bool {
        let (nodes, before) = (self.tets[t as usize], self.shapes[t as usize]);
        let bar = (before * GAIN).max(LEAST);
        let edges = EDGES.map(|e| e.map(|k| nodes[k]));
        let bisections = edges.into_iter().map(First::Bisect);
        let edge_removals = edges.into_iter().map(First::RemoveEdge);
        let face_removals = FACES.into_iter().map(|f| First::RemoveFace(f.map(|k| nodes[k])));
        let collapses = edges.into_iter().flat_map(|[a, b]| [First::Collapse([a, b]), First::Collapse([b, a])]);
        let mut firsts = bisections.chain(edge_removals).chain(face_removals).chain(collapses);
        firsts.any(|first| self.mend_by(first, t, bar, node_hash))
    }

    /// Mends the neighbourhood of a tetrahedron by this first change; whether it is better. Where sheets of the boundary nearly touch,
    /// they could come to cross: if more of it crosses than before, it is taken back.
    fn mend_by(&mut self, first: First, t: u32, bar: f64, node_hash: &BoundaryNodeHash) -> bool {
        let Some(changes) = self.changed_by(first, t, bar) else { return false };
        let near = self.near(&changes, node_hash);
        let after = self.crossings(&near);
        if after == 0 {
            return true;
        }
        self.take_back(changes);
        if self.crossings(&near) < after {
            return false;
        }
        let Some(changes) = self.changed_by(first, t, bar) else { return false };
        let good = self.crossings(&near) <= after;
        if !good {
            self.take_back(changes);
        }
        good
    }

    /// The changes that begin with this one, if all that they touch is better than `bar`; if not, none is left.
    fn changed_by(&mut self, first: First, t: u32, bar: f64) -> Option<Vec<Change>> {
        self.changes = Some(Vec::new());
        let done = match first {
            First::Bisect(edge) => self.bisect(edge),
            First::RemoveEdge(edge) => self.remove_edge(edge, Some(LEAST)),
            First::RemoveFace(face) => self.remove_face(t, face, Some(LEAST)),
            First::Collapse(edge) => self.collapse(edge, Some(LEAST)),
        };
        let better = done && self.improved_beyond(bar);
        let changes = self.changes.take().unwrap_or_default();
        if better {
            return Some(changes);
        }
        self.take_back(changes);
        None
    }

    /// Nodes of the boundary near to where it was changed.
    fn near(&self, changes: &[Change], node_hash: &BoundaryNodeHash) -> Vec<u32> {
        let on = |n: &u32| self.on[*n as usize] != 0;
        let outer = |t: &[u32; 4]| t.iter().filter(|n| on(n)).count() > 2;
        let mut nodes: Vec<u32> = Vec::new();
        let mut within = Aabb::EMPTY;
        for change in changes {
            let tets: Vec<[u32; 4]> = match change {
                Change::Moved(n, old) if on(n) => {
                    within = within.with(*old);
                    self.around[*n as usize].iter().map(|t| self.tets[*t as usize]).collect()
                }
                Change::Replaced { gone, made, .. } => {
                    let made = made.iter().map(|t| self.tets[*t as usize]).filter(|t| *t != GONE);
                    made.chain(gone.iter().map(|g| g.1)).filter(outer).collect()
                }
                _ => Vec::new(),
            };
            nodes.extend(tets.iter().flatten().filter(|n| on(n)));
        }
        if nodes.is_empty() {
            return nodes;
        }
        nodes.iter().for_each(|n| within = within.with(self.nodes[*n as usize]));
        nodes.extend(node_hash.near(&within));
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Improves what was touched, the worst first, until all of it is better than `bar`; whether it is.
    fn improved_beyond(&mut self, bar: f64) -> bool {
        for _ in 0..STEPS {
            let Some(t) = self.worst_touched(bar) else { return true };
            let mut improved = false;
            for n in self.tets[t as usize] {
                if let Some(by) = self.better(n) {
                    self.displace(n, by);
                    improved = true;
                }
            }
            if !improved && !self.change_at(t) {
                return false;
            }
        }
        false
    }

    /// The worst of the tetrahedra that were touched, if it is not better than `bar`.
    fn worst_touched(&self, bar: f64) -> Option<u32> {
        let each = self.changes.iter().flatten().flat_map(|c| match c {
            Change::Moved(n, _) => &self.around[*n as usize][..],
            Change::Replaced { made, .. } => made,
            Change::Freed(..) | Change::Added => &[],
        });
        let worse = each.copied().filter(|t| self.shapes[*t as usize] <= bar);
        worse.min_by(|a, b| self.shapes[*a as usize].total_cmp(&self.shapes[*b as usize]).then(a.cmp(b)))
    }

    /// Bisects an edge within a domain; whether it was. Those of the boundary stay: where two sheets of it nearly touch, a new node could
    /// be on both.
    fn bisect(&mut self, [a, b]: [u32; 2]) -> bool {
        let middle = scale(add(self.nodes[a as usize], self.nodes[b as usize]), 0.5);
        !self.on_boundary([a, b]) && self.split_edge([a, b], middle, 0, LEAST)
    }

    /// What restores some tetrahedra.
    pub(super) fn state_of(&self, tets: &[u32]) -> Vec<(u32, [u32; 4], u8)> {
        tets.iter().map(|t| (*t, self.tets[*t as usize], self.domain[*t as usize])).collect()
    }

    /// Takes changes back.
    fn take_back(&mut self, changes: Vec<Change>) {
        for change in changes.into_iter().rev() {
            match change {
                Change::Moved(n, p) => {
                    self.nodes[n as usize] = p;
                    for i in 0..self.around[n as usize].len() {
                        let t = self.around[n as usize][i];
                        self.shapes[t as usize] = shape(self.corners(t));
                    }
                }
                Change::Freed(n, on) => self.on[n as usize] = on,
                Change::Added => {
                    self.nodes.pop();
                    self.on.pop();
                    self.next.pop();
                    self.around.pop();
                }
                Change::Replaced { gone, made, count } => {
                    made.into_iter().for_each(|t| self.detach(t));
                    self.tets.truncate(count);
                    self.domain.truncate(count);
                    self.shapes.truncate(count);
                    gone.into_iter().for_each(|(t, nodes, domain)| self.attach(t, nodes, domain));
                }
            }
        }
    }
}
