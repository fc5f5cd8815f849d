//! The mesh while edges are taken from it: what a collapse would do, whether it may, and doing it.

use super::bucket_queue::{Candidate, Queue};
use super::deviation::{CollapsePatch, Displacements};
use super::error_quadric::Quadric;
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::remesh::edited_mesh::{EdgeRing, EditedMesh, single};
use crate::remesh::half_edge_mesh::prev;

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

/// How far a mesh has moved, and where it may.
pub struct Motion {
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
    pub mesh: EditedMesh,
    /// How far it has moved.
    pub motion: Motion,
    tolerance: f64,
    quadrics: Vec<Quadric>,
    versions: Vec<u32>,
    queue: Queue,
    // Scratch of one candidate, kept to save allocations.
    ring: EdgeRing,
    patch: CollapsePatch,
    normals: Vec<Vec3>,
}

/// How an edge is to be collapsed.
struct Plan {
    /// The position, if it is not free.
    fixed: Option<Vec3>,
    cost: f64,
}

impl Simplification {
    /// A simplification that moves no point of the surface by more than `tolerance` (mm) in all.
    pub fn new(mesh: EditedMesh, motion: Motion, tolerance: f64) -> Simplification {
        let n = mesh.positions.len();
        let mut work = Simplification {
            quadrics: quadrics(&mesh),
            mesh,
            motion,
            tolerance,
            versions: vec![0; n],
            queue: Queue::new(),
            ring: EdgeRing::default(),
            patch: CollapsePatch::default(),
            normals: Vec::new(),
        };
        for h in 0..3 * work.mesh.count as u32 {
            if work.mesh.half_edges.from(h) < work.mesh.half_edges.to(h) {
                work.push(h);
            }
        }
        work
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
        self.mesh.at(v)
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
        if [u, v].iter().any(|w| !self.motion.free[*w as usize]) {
            return None;
        }
        let ends = [u, v].map(|w| self.mesh.kept_at[w as usize]);
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
        if !self.motion.bounds.holds_inside(self.patch.w) {
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

    /// Gathers the patch about the edge; false if the collapse would not leave a closed manifold, or two kept edges would become one.
    fn gather(&mut self, h: u32) -> bool {
        let (mesh, ring, patch) = (&self.mesh, &mut self.ring, &mut self.patch);
        if mesh.joins_kept(h) || !mesh.ring_of_edge(h, CROWD, ring) {
            return false;
        }
        let g = mesh.half_edges.twin(h);
        patch.turn = ring.turn;
        patch.boundary.clear();
        patch.boundary.extend(ring.ring.iter().map(|r| mesh.at(*r)));
        patch.old.clear();
        let triangles = ring.outer.iter().chain([&h, &g]).map(|e| (e / 3) as usize);
        patch.old.extend(triangles.map(|t| self.motion.displacements[t]));
        (patch.u, patch.v) = (mesh.at(mesh.half_edges.from(h)), mesh.at(mesh.half_edges.from(g)));
        true
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
            return Some(self.motion.kept_moved[u as usize].max(self.motion.kept_moved[v as usize]));
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
        let all = f64::from(self.motion.kept_moved[u as usize].max(self.motion.kept_moved[v as usize])) + most;
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
            let e = self.ring.outer[i];
            if !self.mesh.kept[e as usize] {
                let outer = unit(self.normal(self.mesh.half_edges.twin(e) / 3));
                bend = bend.min(dot(self.normals[i], outer));
            }
            if !self.mesh.is_kept_spoke(&self.ring, i) {
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

    /// The cosine of the sharpest turn about the edges of the patch that are not kept.
    fn bend_before(&self) -> f64 {
        let mut bend = 1.0f64;
        for e in &self.ring.outer {
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
        let (p, ring, mesh) = (&self.patch, &self.ring, &mut self.mesh);
        let (u, g) = (mesh.half_edges.from(h), mesh.half_edges.twin(h));
        let m = ring.ring.len();
        let fan = (0..m).map(|i| {
            let j = if i + 1 == m { 0 } else { i + 1 };
            ([u, ring.ring[i], ring.ring[j]], [p.w, p.boundary[i], p.boundary[j]])
        });
        mesh.is_clear(ring.outer.iter().chain([&h, &g]).map(|e| e / 3), fan, true)
    }

    /// Collapses the edge.
    fn collapse(&mut self, h: u32, line: f32) {
        let [u, v] = [self.mesh.half_edges.from(h), self.mesh.half_edges.to(h)].map(|w| w as usize);
        self.mesh.collapse(h, self.patch.w);
        self.motion.kept_moved[u] = line;
        self.quadrics[u] = self.quadrics[u].plus(&self.quadrics[v]);
        self.versions[u] = self.versions[u].max(self.versions[v]) + 1;
        for (e, new) in self.ring.outer.iter().zip(&self.patch.new) {
            self.motion.displacements[(e / 3) as usize] = *new;
        }
        self.mesh.refit(self.ring.outer.iter().map(|e| e / 3));
        for i in 0..self.ring.outer.len() {
            // The spoke before the boundary edge of triangle i.
            self.push(prev(self.ring.outer[i]));
        }
    }
}

/// The quadric of each vertex: the planes of its triangles, and those that hold its kept edges.
fn quadrics(mesh: &EditedMesh) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); mesh.positions.len()];
    for (t, names) in mesh.half_edges.triangles.iter().enumerate() {
        let p = names.map(|v| mesh.positions[v as usize]);
        let own = Quadric::triangle(p);
        let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
        for k in 0..3 {
            let v = names[k] as usize;
            quadrics[v] = quadrics[v].plus(&own);
            if mesh.kept[3 * t + k] {
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
