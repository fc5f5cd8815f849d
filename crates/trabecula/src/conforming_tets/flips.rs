//! Changes of topology that improve shapes: edges are removed by triangulating the ring about them anew, faces are replaced by
//! edges, edges are collapsed.
//!
//! The triangulation of the ring is optimal by dynamic programming (Klincsek 1980; Freitag, Ollivier-Gooch 1997).

use super::node_surfaces::{HELD, SurfaceSet, members};
use super::partition::SAGITTA;
use super::shaping::{GONE, Shaping};
use super::tet_change::Change;
use super::tet_shape::shape;
use geometry::math::{norm, sub};
use geometry::progress::checkpoint;
use geometry::tetmesh::{EDGES, FACES};

/// The greatest number of nodes of a ring.
const RING: usize = 8;
/// The least relative gain.
const GAIN: f64 = 1.02;

impl Shaping<'_> {
    /// Tries all changes at badly shaped tetrahedra; whether any was made.
    pub fn change_topology(&mut self) -> bool {
        let mut changed = false;
        for t in self.bad() {
            checkpoint();
            let old = self.tets[t as usize];
            if old == GONE {
                continue;
            }
            changed |= self.change_at(t);
        }
        changed
    }

    /// Tries all changes at a tetrahedron until it is gone; whether any was made.
    pub(super) fn change_at(&mut self, t: u32) -> bool {
        let old = self.tets[t as usize];
        let there = |s: &Self| s.tets[t as usize] == old;
        let mut changed = false;
        for [a, b] in EDGES {
            if there(self) {
                changed |= self.remove_edge([old[a], old[b]], None);
            }
        }
        for f in FACES {
            if there(self) {
                changed |= self.remove_face(t, f.map(|k| old[k]), None);
            }
        }
        for [a, b] in EDGES {
            for [n, m] in [[a, b], [b, a]] {
                if there(self) {
                    changed |= self.collapse([old[n], old[m]], None);
                }
            }
        }
        changed
    }

    /// The tetrahedra at an edge.
    pub fn at_edge(&self, [a, b]: [u32; 2]) -> Vec<u32> {
        let has = |t: &&u32| self.tets[**t as usize].contains(&b);
        self.around[a as usize].iter().filter(has).copied().collect()
    }

    /// The nodes about an edge in order (those of tetrahedra a, b, r₀, r₁ positive), and whether they close; `None` if there is
    /// more than one chain.
    fn ring(&self, [a, b]: [u32; 2], at: &[u32]) -> Option<(Vec<u32>, bool)> {
        let mut links: Vec<[u32; 2]> = Vec::with_capacity(at.len());
        for t in at {
            let t = self.tets[*t as usize];
            let [i, j] = [a, b].map(|n| t.iter().position(|m| *m == n));
            let (i, j) = (i?, j?);
            let k = (0..4).find(|k| *k != i && *k != j)?;
            let l = 6 - i - j - k;
            let even = permutation_even([i, j, k, l]);
            links.push(if even { [t[k], t[l]] } else { [t[l], t[k]] });
        }
        let start = links.iter().find(|l| links.iter().all(|m| m[1] != l[0])).or(links.first())?[0];
        let mut ring = vec![start];
        let mut left = links;
        while let Some(i) = left.iter().position(|l| l[0] == ring[ring.len() - 1]) {
            ring.push(left.swap_remove(i)[1]);
        }
        let closed = ring.len() > 1 && ring[0] == ring[ring.len() - 1];
        if closed {
            ring.pop();
        }
        left.is_empty().then_some((ring, closed))
    }

    /// Removes an edge by an optimal triangulation of the ring about it, if shapes are better than `bar`; without one, than the worst was.
    pub(super) fn remove_edge(&mut self, [a, b]: [u32; 2], bar: Option<f64>) -> bool {
        let at = self.at_edge([a, b]);
        if at.is_empty()
            || at.len() >= RING
            || at.iter().any(|t| self.domain[*t as usize] != self.domain[at[0] as usize])
        {
            return false;
        }
        let Some((ring, closed)) = self.ring([a, b], &at) else { return false };
        if ring.len() < 3 || ring.len() > RING {
            return false;
        }
        if !closed && !self.may_flip([a, b], [ring[0], ring[ring.len() - 1]]) {
            return false;
        }
        let before = at.iter().map(|t| self.shapes[*t as usize]).fold(f64::INFINITY, f64::min);
        let Some(made) = self.triangulated([a, b], &ring, bar.unwrap_or(before * GAIN)) else { return false };
        self.replace(&at, &made);
        true
    }

    /// Whether a boundary edge may be replaced by that between the other corners of its two faces: all lie on one surface alone,
    /// and it follows that surface as well.
    fn may_flip(&self, [a, b]: [u32; 2], [c, d]: [u32; 2]) -> bool {
        let periodic = |n: u32| self.next[n as usize] != n;
        let planar = [a, b].into_iter().any(|n| self.in_plane([n, c, d]));
        if planar || [a, b, c, d].into_iter().all(periodic) || !self.at_edge([c, d]).is_empty() {
            return false;
        }
        let set = [a, b, c, d].into_iter().fold(SurfaceSet::MAX, |s, n| s & self.on[n as usize]);
        if set.count_ones() != 1 || set == HELD || (self.on[a as usize] & self.on[b as usize]).count_ones() != 1 {
            return false;
        }
        let surface = &self.surfaces[set.trailing_zeros() as usize];
        if surface.plane.is_some() {
            return true;
        }
        let [p, q] = [c, d].map(|n| self.nodes[n as usize]);
        let middle = core::array::from_fn(|k| 0.5 * (p[k] + q[k]));
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        surface.field.gradients(&[middle], &mut v, &mut g);
        v[0].abs() <= SAGITTA * norm(g[0]) * norm(sub(p, q))
    }

    /// Whether a triangle lies in a bounding plane of a periodic cell: there it must have an image.
    fn in_plane(&self, of: [u32; 3]) -> bool {
        let common = of.iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]);
        of.iter().all(|n| self.next[*n as usize] != *n)
            && members(common).any(|s| self.surfaces[s].bounding_plane().is_some())
    }

    /// The tetrahedra over and under the triangulation of a ring whose worst shape is best, if that is better than `bar`.
    fn triangulated(&self, [a, b]: [u32; 2], ring: &[u32], bar: f64) -> Option<Vec<[u32; 4]>> {
        let n = ring.len();
        let p = |i: usize| self.nodes[ring[i] as usize];
        let (low, high) = (self.nodes[a as usize], self.nodes[b as usize]);
        let mut best = [[(f64::INFINITY, 0usize); RING]; RING];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                best[i][j] = (f64::NEG_INFINITY, 0);
                for k in i + 1..j {
                    let sides = best[i][k].0.min(best[k][j].0);
                    if sides <= bar {
                        continue;
                    }
                    let here = shape([p(i), p(k), p(j), high]).min(shape([p(i), p(j), p(k), low]));
                    let worst = here.min(sides);
                    if worst > best[i][j].0 {
                        best[i][j] = (worst, k);
                    }
                }
            }
        }
        if best[0][n - 1].0 <= bar {
            return None;
        }
        let mut made = Vec::with_capacity(2 * (n - 2));
        let mut todo = vec![(0, n - 1)];
        while let Some((i, j)) = todo.pop() {
            if j - i < 2 {
                continue;
            }
            let k = best[i][j].1;
            made.push([ring[i], ring[k], ring[j], b]);
            made.push([ring[i], ring[j], ring[k], a]);
            todo.extend([(i, k), (k, j)]);
        }
        Some(made)
    }

    /// Replaces the face of a tetrahedron by an edge between the nodes opposite to it, if shapes are better than `bar`; without one, than
    /// the worst was.
    pub(super) fn remove_face(&mut self, t: u32, [a, b, c]: [u32; 3], bar: Option<f64>) -> bool {
        let has = |o: &&u32| **o != t && [b, c].iter().all(|n| self.tets[**o as usize].contains(n));
        let Some(other) = self.around[a as usize].iter().find(has).copied() else { return false };
        if self.domain[t as usize] != self.domain[other as usize] {
            return false;
        }
        let apex = |t: u32| self.tets[t as usize].into_iter().find(|n| ![a, b, c].contains(n));
        let (Some(d), Some(e)) = (apex(t), apex(other)) else { return false };
        if !self.at_edge([d, e]).is_empty() {
            return false;
        }
        // The face is counter-clockwise seen from outside of t: from e.
        let made = [[d, e, a, b], [d, e, b, c], [d, e, c, a]].map(|[d, e, x, y]| [d, e, y, x]);
        let before = self.shapes[t as usize].min(self.shapes[other as usize]);
        let worst =
            |of: &[[u32; 4]]| of.iter().map(|t| shape(t.map(|n| self.nodes[n as usize]))).fold(f64::INFINITY, f64::min);
        let turned = made.map(|[d, e, x, y]| [d, e, y, x]);
        for made in [made, turned] {
            if worst(&made) > bar.unwrap_or(before * GAIN) {
                self.replace(&[t, other], &made);
                return true;
            }
        }
        false
    }

    /// Collapses the edge from `n` to `m`, onto `m`, if shapes at `n` are better than `bar`; without one, than the worst was.
    pub(super) fn collapse(&mut self, [n, m]: [u32; 2], bar: Option<f64>) -> bool {
        let [on_n, on_m] = [n, m].map(|n| self.on[n as usize]);
        if on_n & (!on_m | HELD) != 0 || self.next[n as usize] != n {
            return false;
        }
        let at = self.at_edge([n, m]);
        let Some((ring, closed)) = self.ring([n, m], &at) else { return false };
        // A node on surfaces moves along faces of them alone, along an edge of the boundary; between domains the ring is closed.
        let several = at.iter().any(|t| self.domain[*t as usize] != self.domain[at[0] as usize]);
        if on_n != 0 && closed && !several || on_n.count_ones() > 1 && (on_n & on_m).count_ones() < 2 {
            return false;
        }
        if !self.linked([n, m], &ring) {
            return false;
        }
        let of = &self.around[n as usize];
        let before = of.iter().map(|t| self.shapes[*t as usize]).fold(f64::INFINITY, f64::min);
        let bar = bar.unwrap_or(before * GAIN);
        let mut made = Vec::with_capacity(of.len());
        for t in of {
            let t = self.tets[*t as usize];
            if t.contains(&m) {
                continue;
            }
            let new = t.map(|k| if k == n { m } else { k });
            if FACES.iter().any(|f| f.iter().any(|k| new[*k] == m) && self.in_plane(f.map(|k| new[k]))) {
                return false;
            }
            if shape(new.map(|n| self.nodes[n as usize])) <= bar {
                return false;
            }
            made.push(new);
        }
        let gone = of.clone();
        let domains: Vec<u8> =
            gone.iter().filter(|t| !self.tets[**t as usize].contains(&m)).map(|t| self.domain[*t as usize]).collect();
        self.replace_each(&gone, &made, &domains);
        true
    }

    /// The link condition of a collapse: what is adjacent to both ends is adjacent to the edge; on the boundary too.
    fn linked(&self, [n, m]: [u32; 2], ring: &[u32]) -> bool {
        let neighbours = |n: u32| {
            let mut all: Vec<u32> = self.around[n as usize].iter().flat_map(|t| self.tets[*t as usize]).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let (of_n, of_m) = (neighbours(n), neighbours(m));
        let both = of_n.iter().filter(|k| **k != n && **k != m && of_m.binary_search(k).is_ok());
        let mut ring = ring.to_vec();
        ring.sort_unstable();
        if !both.copied().eq(ring.iter().copied()) {
            return false;
        }
        // No edge of the link of both but those of the ring's tetrahedra.
        let opposite = |n: u32, m: u32| {
            let of = self.around[n as usize].iter().map(|t| self.tets[*t as usize]).filter(move |t| !t.contains(&m));
            let pairs = of.flat_map(|t| EDGES.map(|[i, j]| [t[i].min(t[j]), t[i].max(t[j])]));
            let mut all: Vec<[u32; 2]> =
                pairs.filter(|e| !e.contains(&n) && e.iter().all(|k| ring.binary_search(k).is_ok())).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let of_m = opposite(m, n);
        let common = opposite(n, m).into_iter().filter(|e| of_m.binary_search(e).is_ok());
        let mut of_edge = self.at_edge([n, m]).into_iter().map(|t| self.tets[t as usize]);
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for t in &mut of_edge {
            let rest: Vec<u32> = t.into_iter().filter(|k| *k != n && *k != m).collect();
            edges.push([rest[0].min(rest[1]), rest[0].max(rest[1])]);
        }
        for e in common {
            if !edges.contains(&e) {
                return false;
            }
        }
        // Two edges of the boundary that become one are those of a face that goes.
        let on = |n: &u32| self.on[*n as usize] != 0;
        let pinches = on(&m)
            && on(&n)
            && ring.iter().filter(|k| on(k)).any(|k| {
                let mut at = self.around[*k as usize]
                    .iter()
                    .filter(|t| [n, m].iter().all(|n| self.tets[**t as usize].contains(n)));
                let (first, second) = (at.next(), at.next());
                let domain = |t: Option<&u32>| t.map(|t| self.domain[*t as usize]);
                domain(first) == domain(second) && self.on_boundary([n, *k]) && self.on_boundary([m, *k])
            });
        !pinches
    }

    /// Whether an edge is one of the boundary or between domains.
    pub fn on_boundary(&self, edge: [u32; 2]) -> bool {
        let at = self.at_edge(edge);
        at.iter().any(|t| self.domain[*t as usize] != self.domain[at[0] as usize])
            || self.ring(edge, &at).is_none_or(|(_, closed)| !closed)
    }

    /// Replaces tetrahedra of one domain.
    fn replace(&mut self, gone: &[u32], made: &[[u32; 4]]) {
        let domain = self.domain[gone[0] as usize];
        self.replace_each(gone, made, &vec![domain; made.len()]);
    }

    /// Replaces tetrahedra by others, of these domains; the numbers of those that are gone are used again.
    pub fn replace_each(&mut self, gone: &[u32], made: &[[u32; 4]], domains: &[u8]) {
        let before = self.changes.is_some().then(|| self.state_of(gone));
        gone.iter().for_each(|t| self.detach(*t));
        let (mut free, count) = (gone.iter().copied(), self.tets.len());
        let mut new = Vec::with_capacity(made.len());
        for (t, domain) in made.iter().zip(domains) {
            let i = free.next().unwrap_or_else(|| {
                self.tets.push(GONE);
                self.domain.push(0);
                self.shapes.push(0.0);
                self.tets.len() as u32 - 1
            });
            self.attach(i, *t, *domain);
            new.push(i);
        }
        if let (Some(changes), Some(gone)) = (&mut self.changes, before) {
            changes.push(Change::Replaced { gone, made: new, count });
        }
    }

    /// Takes a tetrahedron from its nodes.
    pub(super) fn detach(&mut self, t: u32) {
        for n in core::mem::replace(&mut self.tets[t as usize], GONE) {
            self.around[n as usize].retain(|o| *o != t);
        }
        self.shapes[t as usize] = f64::INFINITY;
    }

    /// Makes a tetrahedron with a number that is free.
    pub(super) fn attach(&mut self, t: u32, nodes: [u32; 4], domain: u8) {
        (self.tets[t as usize], self.domain[t as usize]) = (nodes, domain);
        self.shapes[t as usize] = shape(self.corners(t));
        nodes.iter().for_each(|n| self.around[*n as usize].push(t));
    }
}

/// Whether a permutation of 0..4 is even.
fn permutation_even(p: [usize; 4]) -> bool {
    let inversions = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j))).filter(|(i, j)| p[*i] > p[*j]).count();
    inversions % 2 == 0
}
