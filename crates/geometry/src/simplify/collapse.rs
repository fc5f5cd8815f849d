//! The mesh while edges are taken from it: what a collapse would do, whether it may, and doing it.

use super::bucket_queue::{Candidate, Queue};
use super::deviation::{Displacements, Patch};
use super::error_quadric::Quadric;
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::half_edge_mesh::{HalfEdgeMesh, NONE, next, prev};
use crate::remesh::kept_edges;
use crate::remesh::refit_tree::{Bounds, Prism, Query, RefitTree};

/// Most triangles about a vertex.
const CROWD: usize = 48;
/// Least shape of a new triangle, 4√3 area / Σ side²: 1 where all sides are equal, 0.05 where one is about forty times
/// its height. Worse ones pass where there was a worse one before.
const SHAPE: f64 = 0.05;
/// Cosine of the most, 60 degrees, that new triangles turn about edges that are not sharp, unless it was more before.
const BEND: f64 = 0.5;
/// Kept edges are held by planes through them, normal to their triangles, of this times their length squared.
const HOLD: f64 = 10.0;
/// Among collapses that cost nothing, short edges come first.
const SHORT: f64 = 1e-8;

/// What a simplification starts from.
pub struct Start {
    /// Positions: single-precision numbers, so that the file holds what was tested.
    pub positions: Vec<Vec3>,
    /// Adjacency.
    pub half_edges: HalfEdgeMesh,
    /// For each half-edge, whether its edge is kept.
    pub kept: Vec<bool>,
    /// How far the surface has moved so far, by triangle.
    pub displacements: Vec<Displacements>,
    /// How far kept edges have moved so far, by vertex, mm.
    pub kept_moved: Vec<f32>,
    /// The vertices that may move; they have triangles all round them, which lie in `bounds`.
    pub free: Vec<bool>,
    /// Where they may move to: strictly within.
    pub bounds: Aabb,
}

/// A mesh in the course of being simplified.
pub struct Simplification {
    /// The mesh as it is now.
    pub mesh: Start,
    /// Triangles left.
    pub count: usize,
    tolerance: f64,
    kept_at: Vec<u8>,
    quadrics: Vec<Quadric>,
    versions: Vec<u32>,
    queue: Queue,
    tree: RefitTree,
    /// Triangles when the tree was built.
    indexed: usize,
    // Scratch of one candidate, kept to save allocations.
    mark: Vec<u32>,
    marked: u32,
    boundary: Vec<u32>,
    boundary_edges: Vec<u32>,
    patch: Patch,
    prisms: Vec<Prism>,
    normals: Vec<Vec3>,
    query: Query,
}

/// How an edge is to be collapsed.
struct Plan {
    /// The position, if it is not free.
    fixed: Option<Vec3>,
    cost: f64,
}

impl Simplification {
    /// A simplification that moves no point of the surface by more than `tolerance` (mm) in all.
    pub fn new(start: Start, tolerance: f64) -> Simplification {
        let n = start.positions.len();
        let count = start.half_edges.triangles.len();
        let kept_at = kept_edges::count(&start.half_edges, &start.kept, n);
        let mut work = Simplification {
            quadrics: quadrics(&start),
            mesh: start,
            count,
            tolerance,
            kept_at,
            versions: vec![0; n],
            queue: Queue::new(),
            tree: RefitTree::new(0, &[], |_| Bounds::of(&[])),
            indexed: 0,
            mark: vec![0; n.max(count)],
            marked: 0,
            boundary: Vec::new(),
            boundary_edges: Vec::new(),
            patch: Patch::default(),
            prisms: Vec::new(),
            normals: Vec::new(),
            query: Query::default(),
        };
        work.rebuild_tree();
        for h in 0..3 * count as u32 {
            if work.mesh.half_edges.from(h) < work.mesh.half_edges.to(h) {
                work.push(h);
            }
        }
        work
    }

    /// Rebuilds the tree: its boxes have grown and hold collapsed triangles.
    fn rebuild_tree(&mut self) {
        let triangles = &self.mesh.half_edges.triangles;
        let live = (0..triangles.len() as u32).filter(|t| triangles[*t as usize][0] != NONE);
        let live: Vec<u32> = live.collect();
        let positions = &self.mesh.positions;
        self.tree =
            RefitTree::new(triangles.len(), &live, |t| Bounds::of(&triangles[t].map(|v| positions[v as usize])));
        self.indexed = live.len();
    }

    /// Takes the cheapest candidate and collapses its edge if every condition holds. `None` when no candidate is left.
    pub fn step(&mut self) -> Option<bool> {
        let c = self.queue.pop()?;
        let h = c.edge;
        if !self.mesh.half_edges.is_live(h) || self.stamp(h) != c.stamp {
            return Some(false);
        }
        let Some(plan) = self.plan(h) else {
            return Some(false);
        };
        Some(self.attempt(h, &plan))
    }

    fn position(&self, v: u32) -> Vec3 {
        self.mesh.positions[v as usize]
    }

    fn stamp(&self, h: u32) -> u32 {
        self.versions[self.mesh.half_edges.from(h) as usize]
            .wrapping_add(self.versions[self.mesh.half_edges.to(h) as usize])
    }

    fn push(&mut self, h: u32) {
        if let Some(plan) = self.plan(h) {
            let edge = sub(self.position(self.mesh.half_edges.to(h)), self.position(self.mesh.half_edges.from(h)));
            let long = dot(edge, edge);
            let stamp = self.stamp(h);
            let cost = plan.cost + SHORT * long * long;
            self.queue.push(cost, Candidate { edge: h, stamp });
        }
    }

    /// The positions that the kept edges at its ends allow the edge, and its cost by the quadrics; `None` where it must stay.
    fn plan(&self, h: u32) -> Option<Plan> {
        let (u, v) = (self.mesh.half_edges.from(h), self.mesh.half_edges.to(h));
        if [u, v].iter().any(|w| !self.mesh.free[*w as usize]) {
            return None;
        }
        let ends = [u, v].map(|w| self.kept_at[w as usize]);
        let along = self.mesh.kept[h as usize];
        let fixed = match ends {
            [0, 0] => None,
            [_, 0] => Some(self.position(u)),
            [0, _] => Some(self.position(v)),
            _ if !along => return None,
            // A vertex of the run itself: so the run stays on its curve, and faces adjacent to it stay flat.
            [2, 2] => Some(self.better_end(h)),
            [_, 2] => Some(self.position(u)),
            [2, _] => Some(self.position(v)),
            _ => return None,
        };
        let q = self.joint(h);
        let position = fixed.unwrap_or_else(|| q.least(self.middle(h)));
        let cost = q.at(position).max(0.0);
        // Its mean distance alone would exceed what is allowed.
        let hopeless = !along && cost > q.area * self.tolerance * self.tolerance;
        (!hopeless).then_some(Plan { fixed, cost })
    }

    fn joint(&self, h: u32) -> Quadric {
        self.quadrics[self.mesh.half_edges.from(h) as usize].plus(&self.quadrics[self.mesh.half_edges.to(h) as usize])
    }

    /// The end of the edge that costs less.
    fn better_end(&self, h: u32) -> Vec3 {
        let q = self.joint(h);
        let (p, r) = (self.position(self.mesh.half_edges.from(h)), self.position(self.mesh.half_edges.to(h)));
        if q.at(p) <= q.at(r) { p } else { r }
    }

    fn middle(&self, h: u32) -> Vec3 {
        let (p, q) = (self.position(self.mesh.half_edges.from(h)), self.position(self.mesh.half_edges.to(h)));
        scale(add(p, q), 0.5)
    }

    /// Collapses the edge if the result keeps every guarantee.
    fn attempt(&mut self, h: u32, plan: &Plan) -> bool {
        if !self.gather(h) {
            return false;
        }
        let first = plan.fixed.unwrap_or_else(|| self.balanced(h));
        self.patch.w = single(first);
        if !self.mesh.bounds.holds_inside(self.patch.w) {
            return false;
        }
        let Some(line) = self.kept_edge_moved(h) else {
            return false;
        };
        if !self.is_well_shaped() {
            return false;
        }
        if !self.patch.propagate(self.tolerance) {
            return false;
        }
        if !self.is_clear(h) {
            return false;
        }
        self.collapse(h, line);
        true
    }

    /// Gathers the patch about the edge; false if the collapse would not leave a closed manifold.
    fn gather(&mut self, h: u32) -> bool {
        let g = self.mesh.half_edges.twin(h);
        // Two kept edges do not become one.
        let kept = |e: u32| self.mesh.kept[e as usize];
        if [h, g].iter().any(|e| kept(next(*e)) && kept(prev(*e))) {
            return false;
        }
        self.marked += 1;
        let (boundary, edges, patch) = (&mut self.boundary, &mut self.boundary_edges, &mut self.patch);
        boundary.clear();
        edges.clear();
        patch.boundary.clear();
        patch.old.clear();
        for (start, end) in [(h, g), (g, h)] {
            // About the vertex that `start` leaves, from the corner left of it on.
            let mut e = self.mesh.half_edges.turned(start);
            let stop = next(end);
            while e != stop {
                let r = self.mesh.half_edges.to(e);
                if self.mark[r as usize] == self.marked || boundary.len() == CROWD {
                    return false;
                }
                self.mark[r as usize] = self.marked;
                boundary.push(r);
                edges.push(next(e));
                patch.boundary.push(self.mesh.positions[r as usize]);
                patch.old.push(self.mesh.displacements[(e / 3) as usize]);
                e = self.mesh.half_edges.turned(e);
            }
            if start == h {
                patch.turn = boundary.len();
            }
        }
        patch.old.push(self.mesh.displacements[(h / 3) as usize]);
        patch.old.push(self.mesh.displacements[(g / 3) as usize]);
        patch.u = self.mesh.positions[self.mesh.half_edges.from(h) as usize];
        patch.v = self.mesh.positions[self.mesh.half_edges.from(g) as usize];
        boundary.len() >= 3
    }

    /// The position of least cost among those that keep the volume.
    fn balanced(&self, h: u32) -> Vec3 {
        let p = &self.patch;
        let o = p.boundary[0];
        let m = p.boundary.len();
        let (u, v) = (sub(p.u, o), sub(p.v, o));
        let (mut g, mut six) = ([0.0; 3], 0.0);
        for i in 0..m {
            let c = cross(sub(p.boundary[i], o), sub(p.boundary[(i + 1) % m], o));
            g = add(g, c);
            six += dot(if i < p.turn { u } else { v }, c);
        }
        let y = sub(p.boundary[p.turn], o);
        // The triangle u v x has x in the origin; v u y remains.
        six += dot(y, cross(v, u));
        let q = self.joint(h);
        let middle = self.middle(h);
        let w = q.least_on(middle, g, six + dot(o, g));
        let (edge, off) = (sub(p.v, p.u), sub(w, middle));
        let mut w = if dot(off, off) <= dot(edge, edge) { w } else { middle };
        // A patch normal to an axis stays so to the last bit.
        for k in 0..3 {
            if p.u[k] == p.v[k] && p.boundary.iter().all(|r| r[k] == p.u[k]) {
                w[k] = p.u[k];
            }
        }
        w
    }

    /// How far the run of kept edges through u and v has then moved in all; `None` if too far.
    fn kept_edge_moved(&self, h: u32) -> Option<f32> {
        let (u, v) = (self.mesh.half_edges.from(h), self.mesh.half_edges.to(h));
        if !self.mesh.kept[h as usize] {
            return Some(self.mesh.kept_moved[u as usize].max(self.mesh.kept_moved[v as usize]));
        }
        let w = self.patch.w;
        let mut most = 0.0f64;
        for (a, b) in [(u, v), (v, u)] {
            let p = self.position(a);
            let beyond = |e: &u32| self.mesh.kept[*e as usize] && self.mesh.half_edges.to(*e) != b;
            let mut off = f64::INFINITY;
            for e in self.mesh.half_edges.leaving(a).filter(beyond) {
                off = off.min(from_segment(p, w, self.position(self.mesh.half_edges.to(e))));
            }
            most = most.max(if p == w { 0.0 } else { off });
        }
        most = most.max(from_segment(w, self.position(u), self.position(v)));
        let all = f64::from(self.mesh.kept_moved[u as usize].max(self.mesh.kept_moved[v as usize])) + most;
        (all <= self.tolerance).then_some(all as f32)
    }

    /// Whether the new triangles have a decent shape and do not fold.
    fn is_well_shaped(&mut self) -> bool {
        let p = &self.patch;
        let m = p.boundary.len();
        let after = |i: usize| if i + 1 == m { 0 } else { i + 1 };
        let shape = |[a, b, c]: [Vec3; 3]| {
            let (x, y, z) = (sub(b, a), sub(c, a), sub(c, b));
            let n = cross(x, y);
            let (sides, twice) = (dot(x, x) + dot(y, y) + dot(z, z), norm(n));
            (2.0 * 3f64.sqrt() * twice / sides, n, twice)
        };
        let old = |i: usize| [if i < p.turn { p.u } else { p.v }, p.boundary[i], p.boundary[after(i)]];
        self.normals.clear();
        let mut worst = f64::INFINITY;
        for i in 0..m {
            let (s, n, twice) = shape([p.w, p.boundary[i], p.boundary[after(i)]]);
            if s.is_nan() || twice <= 0.0 {
                return false;
            }
            worst = worst.min(s);
            self.normals.push(scale(n, 1.0 / twice));
        }
        if worst < SHAPE {
            let ends = [[p.u, p.v, p.boundary[0]], [p.v, p.u, p.boundary[p.turn]]];
            let all = (0..m).map(old).chain(ends);
            let before = all.fold(f64::INFINITY, |b, t| b.min(shape(t).0));
            if worst <= before {
                return false;
            }
        }
        let mut bend = f64::INFINITY;
        for i in 0..m {
            let e = self.boundary_edges[i];
            if !self.mesh.kept[e as usize] {
                let outer = unit(self.normal(self.mesh.half_edges.twin(e) / 3));
                bend = bend.min(dot(self.normals[i], outer));
            }
            if !self.is_kept_spoke(i) {
                let before = self.normals[if i == 0 { m - 1 } else { i - 1 }];
                bend = bend.min(dot(self.normals[i], before));
            }
        }
        bend >= BEND || bend > self.bend_before()
    }

    fn normal(&self, t: u32) -> Vec3 {
        let [a, b, c] = self.mesh.half_edges.triangles[t as usize].map(|v| self.mesh.positions[v as usize]);
        cross(sub(b, a), sub(c, a))
    }

    /// Whether the spoke to the boundary's vertex `i` would be kept.
    fn is_kept_spoke(&self, i: usize) -> bool {
        let spoke = prev(self.boundary_edges[i]);
        // At the two corners opposite the edge, two edges of the patch become one.
        let other = if i == 0 || i == self.patch.turn { prev(self.mesh.half_edges.twin(spoke)) } else { spoke };
        self.mesh.kept[spoke as usize] || self.mesh.kept[other as usize]
    }

    /// The cosine of the sharpest turn about the edges of the patch that are not kept.
    fn bend_before(&self) -> f64 {
        let mut bend = 1.0f64;
        for e in &self.boundary_edges {
            let t = e - e % 3;
            for g in [t, t + 1, t + 2] {
                if !self.mesh.kept[g as usize] {
                    let other = self.mesh.half_edges.twin(g) / 3;
                    bend = bend.min(dot(unit(self.normal(t / 3)), unit(self.normal(other))));
                }
            }
        }
        bend
    }

    /// Whether the fan meets no triangle outside the patch. Its own triangles are disjoint, being a graph.
    fn is_clear(&mut self, h: u32) -> bool {
        let p = &self.patch;
        let m = p.boundary.len();
        let u = self.mesh.half_edges.from(h);
        self.prisms.clear();
        for i in 0..m {
            let j = if i + 1 == m { 0 } else { i + 1 };
            self.prisms.push(Prism::new([u, self.boundary[i], self.boundary[j]], [p.w, p.boundary[i], p.boundary[j]]));
        }
        let mut all = Bounds::of(&p.boundary);
        all.grow(&Bounds::of(&[p.w]));
        self.marked += 1;
        for e in self.boundary_edges.iter().chain(&[h, self.mesh.half_edges.twin(h)]) {
            self.mark[(e / 3) as usize] = self.marked;
        }
        let stays = |t: u32| self.mark[t as usize] != self.marked;
        let mesh = (&self.mesh.half_edges.triangles[..], &self.mesh.positions[..]);
        !self.tree.meets(&self.prisms, &all, mesh, stays, &mut self.query)
    }

    /// Collapses the edge.
    fn collapse(&mut self, h: u32, line: f32) {
        let g = self.mesh.half_edges.twin(h);
        let (u, v) = (self.mesh.half_edges.from(h), self.mesh.half_edges.from(g));
        let wings = [self.mesh.half_edges.from(prev(h)), self.mesh.half_edges.from(prev(g))];
        // Of each of the two collapsed triangles two edges become one, which is kept if one of them was.
        for e in [h, g] {
            let (a, b) = (self.mesh.half_edges.twin(next(e)), self.mesh.half_edges.twin(prev(e)));
            let kept = self.mesh.kept[a as usize] || self.mesh.kept[b as usize];
            self.mesh.kept[a as usize] = kept;
            self.mesh.kept[b as usize] = kept;
        }
        self.mesh.half_edges.collapse(h);
        self.count -= 2;

        self.mesh.positions[u as usize] = self.patch.w;
        self.mesh.kept_moved[u as usize] = line;
        self.quadrics[u as usize] = self.quadrics[u as usize].plus(&self.quadrics[v as usize]);
        let version = self.versions[u as usize].max(self.versions[v as usize]);
        self.versions[u as usize] = version + 1;
        for w in [u, wings[0], wings[1]] {
            let kept = self.mesh.half_edges.leaving(w).filter(|e| self.mesh.kept[*e as usize]);
            self.kept_at[w as usize] = kept.count().min(255) as u8;
        }
        for i in 0..self.boundary.len() {
            let t = (self.boundary_edges[i] / 3) as usize;
            self.mesh.displacements[t] = self.patch.new[i];
            self.tree.grow(t, &self.prisms[i].bounds);
        }
        if 4 * self.count < 3 * self.indexed {
            self.rebuild_tree();
        }
        for i in 0..self.boundary_edges.len() {
            // The spoke before the boundary edge of triangle i.
            self.push(prev(self.boundary_edges[i]));
        }
    }
}

/// A position in single precision.
pub fn single(p: Vec3) -> Vec3 {
    // Plus zero: −0 is 0.
    p.map(|x| f64::from(x as f32) + 0.0)
}

/// The quadric of each vertex: the planes of its triangles, and those that hold its kept edges.
fn quadrics(start: &Start) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); start.positions.len()];
    for (t, names) in start.half_edges.triangles.iter().enumerate() {
        let p = names.map(|v| start.positions[v as usize]);
        let own = Quadric::triangle(p);
        let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
        for k in 0..3 {
            let v = names[k] as usize;
            quadrics[v] = quadrics[v].plus(&own);
            if start.kept[3 * t + k] {
                let side = sub(p[(k + 1) % 3], p[k]);
                let wall = Quadric::plane(unit(cross(side, normal)), p[k], HOLD * dot(side, side));
                for w in [v, names[(k + 1) % 3] as usize] {
                    quadrics[w] = quadrics[w].plus(&wall);
                }
            }
        }
    }
    quadrics
}

/// The distance of `p` from the segment a b.
fn from_segment(p: Vec3, a: Vec3, b: Vec3) -> f64 {
    let (d, e) = (sub(b, a), sub(p, a));
    let long = dot(d, d);
    let t = if long > 0.0 { (dot(d, e) / long).clamp(0.0, 1.0) } else { 0.0 };
    norm(sub(e, scale(d, t)))
}
