//! The solid inside a closed triangle mesh, as an exact signed distance.

use std::sync::Arc;

use super::{HalfSpace, Offset, Region, Shape, one_face};
use crate::face;
use crate::fault::Fault;
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::measure::self_intersections;
use crate::mesh::Mesh;

mod check;
mod open;
mod tree;

use tree::{Face, Feature, Hit, Tree};

/// The solid inside a clean, closed triangle mesh: one body, perhaps with cavities.
///
/// Distances are exact to rounding. Their sign comes from the angle-weighted normals of the nearest face, edge or
/// vertex: J. A. Bærentzen and H. Aanæs, Signed distance computation using the angle weighted pseudonormal, IEEE
/// Trans. Vis. Comput. Graph. 11 (2005) 243.
#[derive(Debug)]
pub struct MeshRegion {
    tree: Tree,
    /// Outward normals (any length) of each triangle's edges and corners, in the tree's order.
    edges: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
    bounds: Aabb,
    volume: f64,
    planes: [Vec<f64>; 3],
}

/// The unit normal of a triangle, exact along the axes.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let n = cross(sub(b, a), sub(c, a));
    if n.iter().filter(|x| **x != 0.0).count() == 1 {
        return n.map(|x| if x == 0.0 { 0.0 } else { x.signum() });
    }
    // The longest component first, so that small triangles do not underflow.
    let largest = n.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    unit(n.map(|x| x / largest))
}

impl MeshRegion {
    /// The solid inside `mesh` (mm). If edges are open, vertices that single precision cannot tell apart at the
    /// mesh's size are joined first: files often write one corner with two roundings.
    ///
    /// **Errors**: numbers that are not finite; open edges, edges with more than two triangles, neighbours that
    /// face opposite ways, duplicate or degenerate triangles (with their numbers); several bodies; a mesh that is
    /// inside out or flat. A body inside out within the other is a cavity and allowed.
    pub fn new(mut mesh: Mesh) -> Result<Self, Fault> {
        check::numbers(&mesh)?;
        if check::open(&mesh) {
            mesh = mesh.joined(mesh.single_rounding());
        }
        let pairs = check::check(&mesh)?;
        const MANY: usize = 1000;
        let crossing = self_intersections(&mesh, MANY);
        if crossing > 0 {
            let found = if crossing < MANY {
                crossing.to_string()
            } else {
                format!("{MANY} or more")
            };
            let message = format!(
                "the mesh of {} triangles crosses itself ({found} pairs of triangles), so what is inside is not plain; unite its bodies first",
                mesh.triangles.len()
            );
            return Err(Fault::new("", message));
        }
        let count = mesh.triangles.len();
        let faces: Vec<Face> = (0..count)
            .map(|i| {
                let corners = mesh.corners(i);
                Face {
                    corners,
                    normal: normal(corners),
                }
            })
            .collect();
        let mut edge_normals = vec![[[0.0; 3]; 3]; count];
        for [a, b] in pairs {
            let [a, b] = [a as usize, b as usize];
            let n = add(faces[a / 3].normal, faces[b / 3].normal);
            edge_normals[a / 3][a % 3] = n;
            edge_normals[b / 3][b % 3] = n;
        }
        let mut vertex_normals = vec![[0.0; 3]; mesh.vertices.len()];
        for (t, f) in mesh.triangles.iter().zip(&faces) {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| f.corners[(k + i) % 3]);
                let (u, v) = (sub(b, a), sub(c, a));
                let angle = norm(cross(u, v)).atan2(dot(u, v));
                let n = &mut vertex_normals[t[k] as usize];
                *n = add(*n, scale(f.normal, angle));
            }
        }
        let (tree, order) = Tree::new(&faces);
        Ok(MeshRegion {
            edges: order.iter().map(|i| edge_normals[*i as usize]).collect(),
            corners: order
                .iter()
                .map(|i| mesh.triangles[*i as usize].map(|v| vertex_normals[v as usize]))
                .collect(),
            bounds: mesh.bounds(),
            volume: mesh.volume(),
            planes: [0, 1, 2].map(|axis| planes(&faces, &mesh.bounds(), axis)),
            tree,
        })
    }

    /// Outward normal (any length) at the nearest point.
    fn outward(&self, hit: &Hit) -> Vec3 {
        let i = hit.triangle as usize;
        match hit.feature {
            Feature::Face => self.tree.faces()[i].normal,
            Feature::Edge(k) => self.edges[i][usize::from(k)],
            Feature::Corner(k) => self.corners[i][usize::from(k)],
        }
    }

    /// Signed distance; zero where rounding hides it, so that points of flat faces are exactly on them.
    fn signed(&self, hit: &Hit) -> f64 {
        let d = hit.square.sqrt();
        if d <= self.tree.rounding() {
            0.0
        } else if dot(hit.away, self.outward(hit)) < 0.0 {
            -d
        } else {
            d
        }
    }

    fn gradient(&self, hit: &Hit) -> Vec3 {
        let d = self.signed(hit);
        match hit.feature {
            Feature::Face => self.tree.faces()[hit.triangle as usize].normal,
            _ if d == 0.0 => unit(self.outward(hit)),
            _ => scale(hit.away, 1.0 / d),
        }
    }
}

/// Coordinates at which flat faces normal to `axis` make up a hundredth of the bounds' largest side.
///
/// Distances there are zero by `signed`, whichever triangle, edge or corner is found nearest.
fn planes(faces: &[Face], bounds: &Aabb, axis: usize) -> Vec<f64> {
    let flat = faces
        .iter()
        .filter(|f| f.corners.iter().all(|p| p[axis] == f.corners[0][axis]));
    let mut areas: Vec<(f64, f64)> = flat
        .map(|f| {
            let [a, b, c] = f.corners;
            (a[axis], norm(cross(sub(b, a), sub(c, a))) / 2.0)
        })
        .collect();
    areas.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [x, y, z] = bounds.size();
    let least = 0.01 * (x * y).max(y * z).max(z * x);
    let together = areas.chunk_by(|a, b| a.0 == b.0);
    together
        .filter(|g| g.iter().map(|f| f.1).sum::<f64>() >= least)
        .map(|g| g[0].0)
        .collect()
}

impl Field for MeshRegion {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut seed = 0;
        for (o, p) in out.iter_mut().zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            *o = self.signed(&hit);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut seed = 0;
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            (*v, *g) = (self.signed(&hit), self.gradient(&hit));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let d = self.value(b.center());
        let reach = norm(b.size()) / 2.0;
        let reach = reach * (1.0 + 1e-12) + 2.0 * self.tree.rounding() + 1e-14 * d.abs();
        Interval::new(d - reach, d + reach)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl Shape for MeshRegion {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        if level == 0.0 {
            out.extend(&self.planes[axis]);
        }
    }

    /// Halves the block until a part lies on one side of the level or is eight nodes: most nodes are never asked.
    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        if block.is_empty() {
            return;
        }
        let widest = |axis: &[f64]| axis.windows(2).fold(0.0f64, |m, w| m.max(w[1] - w[0]));
        let cell = norm(block.axes.map(widest));
        let shape = block.shape();
        let mut fill = Fill {
            region: self,
            block,
            level,
            cell,
            out,
        };
        fill.part([0; 3], shape, 0);
    }

    fn faces(self: Arc<Self>, by: f64, out: &mut Vec<face::Face>) -> face::Tree {
        match Offset::new(self.clone(), by) {
            Ok(moved) if by != 0.0 => one_face(Arc::new(moved), out),
            _ => one_face(self, out),
        }
    }

    fn opened(self: Arc<Self>, cuts: &[HalfSpace], found: &mut [bool]) -> Option<Region> {
        open::opened(self, cuts, found)
    }

    fn volume(&self) -> Option<f64> {
        Some(self.volume)
    }
}

struct Fill<'a> {
    region: &'a MeshRegion,
    block: &'a Block<'a>,
    level: f64,
    /// Diagonal of the largest grid cell.
    cell: f64,
    out: &'a mut [f32],
}

impl Fill<'_> {
    /// Fills the nodes from `lo` up to `hi`, `seed` being a triangle that may be near.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], seed: u32) {
        let ends = [0, 1, 2].map(|a| [self.block.axes[a][lo[a]], self.block.axes[a][hi[a] - 1]]);
        let center = ends.map(|[a, b]| a + (b - a) / 2.0);
        let size = ends.map(|[a, b]| b - a);
        let hit = self.region.tree.nearest(center, seed);
        let d = self.region.signed(&hit) - self.level;
        if d.abs() > (norm(size) / 2.0 + self.cell) * (1.0 + 1e-9) {
            self.each(lo, hi, |_, p| (d.abs() - norm(sub(p, center))).copysign(d));
            return;
        }
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        if (0..3).map(|a| hi[a] - lo[a]).product::<usize>() <= 8 || hi[longest] - lo[longest] < 2 {
            let mut seed = hit.triangle;
            self.each(lo, hi, |fill, p| {
                let hit = fill.region.tree.nearest(p, seed);
                seed = hit.triangle;
                fill.region.signed(&hit) - fill.level
            });
            return;
        }
        let middle = (lo[longest] + hi[longest]) / 2;
        let (mut end, mut begin) = (hi, lo);
        end[longest] = middle;
        begin[longest] = middle;
        self.part(lo, end, hit.triangle);
        self.part(begin, hi, hit.triangle);
    }

    fn each(&mut self, lo: [usize; 3], hi: [usize; 3], mut value: impl FnMut(&Self, Vec3) -> f64) {
        let [nx, ny, _] = self.block.shape();
        let [xs, ys, zs] = self.block.axes;
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    self.out[(k * ny + j) * nx + i] = value(self, [xs[i], ys[j], zs[k]]) as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
