//! The solid inside a closed triangle mesh, as an exact signed distance.

use std::sync::{Arc, OnceLock};

use super::{HalfSpace, Offset, Region, Shape, one_surface};
use crate::field::{Block, Field};
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, cross, dot, norm, scale, sub, unit};
use geometry::mesh::Mesh;

mod cap;
mod check;
mod clean;
mod crease;
mod cut;
mod edges;
mod fair;
mod normals;
mod open;
mod orient;
mod repair;
mod tree;
mod winding;

use normals::Normals;
use repair::Boundary;
pub use repair::{CAPPED, Repair, Repaired};
use tree::{Face, Feature, Hit, Tree};
use winding::Winding;

/// A place and its signed distance, where none is known: no comparison with it holds.
const NOTHING: (Vec3, f64) = ([0.0; 3], f64::NAN);
/// Sets of triangles farther off than so many radii are taken as a whole where inside is told from outside: the winding
/// number of a closed surface is then within a few hundredths of zero or one.
const REACH: f64 = 1.4;

/// The solid inside a triangle mesh, which is repaired if it is not clean: bodies, perhaps with cavities.
///
/// Distances to the (repaired) boundary are exact to rounding. Their sign comes from the normals of the nearest face,
/// edge or vertex where the boundary is one clean surface, else from that of the face or the winding number.
#[derive(Debug)]
pub struct MeshRegion {
    tree: Tree,
    normals: Normals,
    /// Asked where the boundary is not one clean sheet; none where it is everywhere.
    winding: Option<Winding>,
    bounds: Aabb,
    volume: f64,
    planes: [Vec<f64>; 3],
    mesh: Mesh,
    repaired: Repaired,
    /// Found when they are first asked for.
    creases: OnceLock<Arc<crate::implicit::Creases>>,
}

impl MeshRegion {
    /// The solid inside `mesh` (mm), repaired if need be.
    ///
    /// A clean mesh is taken as it is, but for this: if edges are open, vertices that single precision cannot tell
    /// apart at the mesh's size are joined first, as files often write one corner with two roundings.
    ///
    /// **Errors**: numbers that are not finite; no volume; holes whose caps would be a tenth of the surface or more
    /// ([`CAPPED`]); with [`Repair::Refuse`] all that [`Repaired`] counts, in numbers.
    pub fn new(mesh: Mesh, repair: Repair) -> Result<Self, Fault> {
        repair::boundary(mesh, repair).map(MeshRegion::within)
    }

    /// What is in all of some regions, or in any; less what is in the others.
    ///
    /// None where that holds nothing.
    pub(super) fn combined(of: &[&MeshRegion], any: bool, less: &[&MeshRegion]) -> Option<Self> {
        let least = if any { 1 } else { of.len() };
        let [of, less] = [of, less].map(|all| all.iter().map(|r| &r.mesh).collect::<Vec<_>>());
        repair::combined(&of, &less, least).map(MeshRegion::within)
    }

    fn within(Boundary { mesh, pairs, done }: Boundary) -> Self {
        let faces: Vec<Face> = (0..mesh.triangles.len()).map(|i| Face::new(mesh.corners(i))).collect();
        let (tree, order) = Tree::new(&faces);
        let (normals, winding) = match pairs {
            Some(pairs) => (Normals::new(&mesh, &faces, &pairs, &order), None),
            None => (Normals::of_pieces(&faces, &order), Some(Winding::new(&tree))),
        };
        MeshRegion {
            normals,
            winding,
            bounds: mesh.bounds(),
            volume: mesh.volume(),
            planes: [0, 1, 2].map(|axis| planes(&faces, &mesh.bounds(), axis)),
            tree,
            mesh,
            repaired: done,
            creases: OnceLock::new(),
        }
    }

    /// The boundary that everything is taken from: the mesh given if it was clean, else the repaired one.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// What was repaired.
    pub fn repaired(&self) -> &Repaired {
        &self.repaired
    }

    /// Signed distance; zero where rounding hides it, so that points of flat faces are exactly on them.
    ///
    /// `known` is a place and its signed distance: where the two balls that hold no surface overlap, the sign is the
    /// same, and winding numbers need not be asked for.
    fn signed(&self, hit: &Hit, p: Vec3, known: (Vec3, f64)) -> f64 {
        let d = hit.square.sqrt();
        let rounding = self.tree.rounding();
        if d <= rounding {
            return 0.0;
        }
        let height = dot(hit.away, self.normals.outward(&self.tree, hit));
        let inside = match &self.winding {
            Some(winding) if height.is_nan() => {
                if (d + known.1.abs()) * (1.0 - 1e-9) > norm(sub(p, known.0)) + rounding {
                    known.1 < 0.0
                } else {
                    winding.at(&self.tree, p, REACH, |_| false) > 0.5
                }
            }
            _ => height < 0.0,
        };
        if inside { -d } else { d }
    }

    fn gradient(&self, hit: &Hit, d: f64) -> Vec3 {
        let outward = self.normals.outward(&self.tree, hit);
        match hit.feature {
            Feature::Face if !outward[0].is_nan() => outward,
            _ if d == 0.0 && outward[0].is_nan() => self.tree.faces()[hit.triangle as usize].normal,
            _ if d == 0.0 => unit(outward),
            _ => scale(hit.away, 1.0 / d),
        }
    }
}

/// Coordinates at which flat faces normal to `axis` make up a hundredth of the bounds' largest side.
///
/// Distances there are zero by `signed`, whichever triangle, edge or corner is found nearest.
fn planes(faces: &[Face], bounds: &Aabb, axis: usize) -> Vec<f64> {
    let flat = faces.iter().filter(|f| f.corners.iter().all(|p| p[axis] == f.corners[0][axis]));
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
    together.filter(|g| g.iter().map(|f| f.1).sum::<f64>() >= least).map(|g| g[0].0).collect()
}

impl Field for MeshRegion {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut seed, mut known) = (0, NOTHING);
        for (o, p) in out.iter_mut().zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            *o = self.signed(&hit, *p, known);
            known = (*p, *o);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut seed, mut known) = (0, NOTHING);
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            *v = self.signed(&hit, *p, known);
            *g = self.gradient(&hit, *v);
            known = (*p, *v);
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
        let mut fill = Fill { region: self, block, level, cell, out };
        fill.part([0; 3], shape, 0, NOTHING);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<crate::implicit::Surface>) -> crate::csg_tree::CsgTree {
        match Offset::new(self.clone(), by) {
            Ok(moved) if by != 0.0 => one_surface(Arc::new(moved), out),
            _ => {
                let creases = self.creases.get_or_init(|| Arc::new(crease::creases(&self.mesh)));
                out.push(crate::implicit::Surface {
                    creases: creases.clone(),
                    ..crate::implicit::Surface::distance(self.clone())
                });
                crate::csg_tree::CsgTree::Leaf(out.len() - 1)
            }
        }
    }

    fn as_mesh(&self) -> Option<&MeshRegion> {
        Some(self)
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
    /// Fills the nodes from `lo` up to `hi`, `seed` being a triangle that may be near and `known` a distance.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], seed: u32, known: (Vec3, f64)) {
        let ends = [0, 1, 2].map(|a| [self.block.axes[a][lo[a]], self.block.axes[a][hi[a] - 1]]);
        let center = ends.map(|[a, b]| a + (b - a) / 2.0);
        let size = ends.map(|[a, b]| b - a);
        let hit = self.region.tree.nearest(center, seed);
        let known = (center, self.region.signed(&hit, center, known));
        let d = known.1 - self.level;
        if d.abs() > (norm(size) / 2.0 + self.cell) * (1.0 + 1e-9) {
            self.each(lo, hi, |_, p| (d.abs() - norm(sub(p, center))).copysign(d));
            return;
        }
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        if (0..3).map(|a| hi[a] - lo[a]).product::<usize>() <= 8 || hi[longest] - lo[longest] < 2 {
            let (mut seed, mut known) = (hit.triangle, known);
            self.each(lo, hi, |fill, p| {
                let hit = fill.region.tree.nearest(p, seed);
                seed = hit.triangle;
                known = (p, fill.region.signed(&hit, p, known));
                known.1 - fill.level
            });
            return;
        }
        let middle = (lo[longest] + hi[longest]) / 2;
        let (mut end, mut begin) = (hi, lo);
        end[longest] = middle;
        begin[longest] = middle;
        self.part(lo, end, hit.triangle, known);
        self.part(begin, hi, hit.triangle, known);
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
mod laws;
#[cfg(test)]
mod tests;
