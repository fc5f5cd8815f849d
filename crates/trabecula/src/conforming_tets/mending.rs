//! The worst tetrahedra, whose neighbourhoods become worse before they become better.
//!
//! Where no move, flip or collapse helps by itself, an edge is bisected, removed or collapsed whatever comes of it, and what that touched
//! is improved step by step. All is taken back unless everything touched is better than the tetrahedron was, so that the worst shapes never
//! get worse. Nodes are inserted in this way by B. M. Klingner and J. R. Shewchuk (Aggressive tetrahedral mesh improvement, 2007).

use super::interfaces;
use super::node_surfaces::{HELD, SurfaceSet};
use super::shaping::{GONE, Shaping};
use super::tet_shape::shape;
use geometry::math::{Vec3, add, scale};
use geometry::measure::self_intersections;
use geometry::mesh::Mesh;
use geometry::progress::checkpoint;
use geometry::tetmesh::{EDGES, FACES};

/// Shapes worse than this are mended: dihedral angles below 15.1 or above 158.8 degrees.
const MENDED: f64 = 2.0;
/// Rounds over all of them.
const ROUNDS: usize = 3;
/// The least shape that the first change may leave: a tetrahedron with some volume.
const LEAST: f64 = 0.01;
/// The most steps after it.
const STEPS: usize = 40;
/// The most pairs of triangles that cross that are counted.
const COUNTED: usize = 1000;
/// The least relative gain.
const GAIN: f64 = 1.05;

/// A change that can be taken back.
pub(super) enum Change {
    /// A node that was elsewhere.
    Moved(u32, Vec3),
    /// A node that was on more surfaces.
    Freed(u32, SurfaceSet),
    /// A new node.
    Added,
    /// Tetrahedra, with their nodes and domains, in place of which there are others; how many numbers there were.
    Replaced { gone: Vec<(u32, [u32; 4], u8)>, made: Vec<u32>, count: usize },
}

/// The first change of a neighbourhood.
#[derive(Clone, Copy)]
enum First {
    Bisect([u32; 2]),
    RemoveEdge([u32; 2]),
    RemoveFace([u32; 3]),
    Collapse([u32; 2]),
}

impl Shaping<'_> {
    /// Mends the neighbourhoods of the worst tetrahedra; whether any was. Where sheets of the boundary nearly touch, they could come to cross:
    /// if more of it crosses than before, all is taken back.
    pub fn mend(&mut self) -> bool {
        if self.bad().is_empty() {
            return false;
        }
        let before = self.crossings();
        let made = self.mend_all();
        if self.crossings() > before {
            self.take_back(made);
            return false;
        }
        !made.is_empty()
    }

    /// The pairs of triangles of the boundary that cross, up to `COUNTED`.
    fn crossings(&self) -> usize {
        let faces = interfaces(&self.tets, &self.domain, &|n| self.on[n as usize] != 0);
        let triangles = faces.into_iter().map(|(face, _, _)| face).collect();
        self_intersections(&Mesh { vertices: self.nodes.clone(), triangles }, COUNTED)
    }

    /// Mends what it can; the changes.
    fn mend_all(&mut self) -> Vec<Change> {
        let mut made = Vec::new();
        for _ in 0..ROUNDS {
            let before = made.len();
            for t in self.bad() {
                checkpoint();
                if self.tets[t as usize] != GONE && self.shapes[t as usize] < MENDED {
                    let _ = self.mend_at(t, &mut made) || self.mend_free(t, &mut made);
                }
            }
            if made.len() == before {
                break;
            }
        }
        made
    }

    /// Mends the neighbourhood of a tetrahedron with its nodes on creases set free; whether it is better. If not, they stay.
    fn mend_free(&mut self, t: u32, made: &mut Vec<Change>) -> bool {
        let held = |on: SurfaceSet| on & HELD != 0 && on != HELD;
        let nodes = self.tets[t as usize];
        let freed: Vec<Change> = nodes.into_iter().map(|n| Change::Freed(n, self.on[n as usize])).collect();
        for n in nodes.into_iter().map(|n| n as usize) {
            if held(self.on[n]) {
                self.on[n] &= !HELD;
            }
        }
        let any = freed.iter().any(|f| matches!(f, Change::Freed(n, on) if self.on[*n as usize] != *on));
        let from = made.len();
        made.extend(freed);
        if any && self.mend_at(t, made) {
            return true;
        }
        let freed = made.split_off(from);
        self.take_back(freed);
        false
    }

    /// Mends the neighbourhood of a tetrahedron; whether it is better.
    fn mend_at(&mut self, t: u32, made: &mut Vec<Change>) -> bool {
        let (nodes, before) = (self.tets[t as usize], self.shapes[t as usize]);
        let bar = (before * GAIN).max(LEAST);
        let edges = EDGES.map(|e| e.map(|k| nodes[k]));
        let bisections = edges.into_iter().map(First::Bisect);
        let edge_removals = edges.into_iter().map(First::RemoveEdge);
        let face_removals = FACES.into_iter().map(|f| First::RemoveFace(f.map(|k| nodes[k])));
        let collapses = edges.into_iter().flat_map(|[a, b]| [First::Collapse([a, b]), First::Collapse([b, a])]);
        for change in bisections.chain(edge_removals).chain(face_removals).chain(collapses) {
            self.changes = Some(Vec::new());
            let done = match change {
                First::Bisect(edge) => self.bisect(edge),
                First::RemoveEdge(edge) => self.remove_edge(edge, Some(LEAST)),
                First::RemoveFace(face) => self.remove_face(t, face, Some(LEAST)),
                First::Collapse(edge) => self.collapse(edge, Some(LEAST)),
            };
            let better = done && self.improved_beyond(bar);
            let changes = self.changes.take().unwrap_or_default();
            if better {
                made.extend(changes);
                return true;
            }
            self.take_back(changes);
        }
        false
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
