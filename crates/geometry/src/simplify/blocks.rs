//! A mesh cut into blocks of space, cubes of one size, which can be worked on apart from each other.
//!
//! What is done in a block stays strictly inside it, so that no two blocks can get into each other's way. Each triangle has a
//! home, the block of its centroid; a block's members are all triangles that come near it.

use crate::math::{Aabb, Vec3, add, scale};
use crate::mesh::Mesh;

/// Triangles of a block: as many as keep its working memory in the tens of megabytes.
pub const BLOCK: usize = 1 << 18;
/// Triangles that are counted to choose the size of blocks.
const SAMPLE: usize = 1 << 18;
/// Most blocks along an axis.
const MOST: f64 = 400.0;
/// Blocks become smaller by this factor until none holds too many triangles.
const FINER: f64 = 1.25;
/// A share of the block's edge and of the largest coordinate within which a point counts to neither side of a face.
const CLOSE: f64 = 1e-9;

/// Blocks and the triangles that come near each.
pub struct Blocks {
    lower: Vec3,
    /// Edge of a block, mm; infinite where one block is everything.
    edge: f64,
    /// Width of what belongs to neither side of a face, mm.
    close: f64,
    counts: [usize; 3],
    start: Vec<usize>,
    members: Vec<u32>,
}

impl Blocks {
    /// One block that is everything.
    pub fn one(triangles: usize) -> Blocks {
        Blocks {
            lower: [0.0; 3],
            edge: f64::INFINITY,
            close: 0.0,
            counts: [1; 3],
            start: vec![0, triangles],
            members: (0..triangles as u32).collect(),
        }
    }

    /// Blocks of at most some [`BLOCK`] triangles, moved by `shift` of their edge; members come within `margin` (mm).
    pub fn new(mesh: &Mesh, shift: f64, margin: f64) -> Blocks {
        let all = mesh.triangles.len();
        if all <= BLOCK {
            return Blocks::one(all);
        }
        let bounds = mesh.bounds();
        let longest = bounds.size().iter().fold(0.0f64, |m, s| m.max(*s));
        let largest = bounds.min.iter().chain(&bounds.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let step = all.div_ceil(SAMPLE);
        let centers: Vec<Vec3> = (0..all).step_by(step).map(|t| center(mesh, t)).collect();
        let mut along = FINER;
        let mut blocks = loop {
            let edge = longest / along;
            let lower = bounds.min.map(|x| x - shift * edge);
            let counts = bounds.size().map(|s| ((s + shift * edge) / edge) as usize + 1);
            let blocks =
                Blocks { lower, edge, close: CLOSE * (edge + largest), counts, start: Vec::new(), members: Vec::new() };
            let mut held = vec![0usize; blocks.count()];
            centers.iter().for_each(|c| held[blocks.home(*c)] += step);
            if along > MOST || held.iter().all(|n| *n <= BLOCK) {
                break blocks;
            }
            along *= FINER;
        };
        blocks.collect(mesh, margin + blocks.close);
        blocks
    }

    /// Lists the members of each block: triangles whose boxes, grown by `margin`, touch it.
    fn collect(&mut self, mesh: &Mesh, margin: f64) {
        let near = |t: usize, found: &mut dyn FnMut(usize)| {
            let b = mesh.corners(t).iter().fold(Aabb::EMPTY, |b, p| b.with(*p)).grown(margin);
            let (first, last) = (self.cell(b.min), self.cell(b.max));
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        found(self.number([x, y, z]));
                    }
                }
            }
        };
        let mut start = vec![0usize; self.count() + 1];
        for t in 0..mesh.triangles.len() {
            near(t, &mut |b| start[b + 1] += 1);
        }
        for b in 0..self.count() {
            start[b + 1] += start[b];
        }
        let mut free = start.clone();
        let mut members = vec![0u32; start[self.count()]];
        for t in 0..mesh.triangles.len() {
            near(t, &mut |b| {
                members[free[b]] = t as u32;
                free[b] += 1;
            });
        }
        (self.start, self.members) = (start, members);
    }

    /// The number of blocks.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// The triangles that come near block `b`.
    pub fn members(&self, b: usize) -> &[u32] {
        &self.members[self.start[b]..self.start[b + 1]]
    }

    /// The block in which `p` lies.
    pub fn home(&self, p: Vec3) -> usize {
        self.number(self.cell(p))
    }

    /// What is block `b` alone, without what is too close to its faces.
    pub fn inside(&self, b: usize) -> Aabb {
        self.reach(b).grown(-self.close)
    }

    /// Block `b` with what is too close to its faces.
    pub fn around(&self, b: usize) -> Aabb {
        self.reach(b).grown(self.close)
    }

    fn reach(&self, b: usize) -> Aabb {
        if self.edge.is_infinite() {
            return Aabb::ALL;
        }
        let [nx, ny, _] = self.counts;
        let cell = [b % nx, b / nx % ny, b / nx / ny];
        let min = add(self.lower, cell.map(|i| i as f64 * self.edge));
        Aabb { min, max: min.map(|x| x + self.edge) }
    }

    fn cell(&self, p: Vec3) -> [usize; 3] {
        [0, 1, 2].map(|a| (((p[a] - self.lower[a]) / self.edge).max(0.0) as usize).min(self.counts[a] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.counts[1] + y) * self.counts[0] + x
    }
}

/// The centroid of triangle `t`.
fn center(mesh: &Mesh, t: usize) -> Vec3 {
    let [p, q, r] = mesh.corners(t);
    scale(add(p, add(q, r)), 1.0 / 3.0)
}
