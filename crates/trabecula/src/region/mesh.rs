//! The solid inside a closed triangle mesh, as an exact signed distance.

use std::sync::{Arc, OnceLock};

use super::{CadMesh, Offset, OpenSurface, Region, SignedDistance, one_surface};
use crate::csg_tree::CsgTree;
use crate::field::{Block, Field};
use crate::implicit::Surface;
use geometry::distance::triangle::Triangle;
use geometry::distance::triangle_bvh::{Candidates, Nearest};
use geometry::distance::{MeshDistance, UNKNOWN};
use geometry::fault::Fault;
use geometry::feature_edges::{Creases, creases};
use geometry::math::{Aabb, Interval, Vec3, cross, norm, sub};
use geometry::mesh::Mesh;
use geometry::repair::{Repair, Repaired};
use geometry::similarity::Similarity;

mod open;

/// The solid inside a triangle mesh, which is repaired if it is not clean.
///
/// Distances to the (repaired) boundary are exact to rounding: see [`MeshDistance`].
#[derive(Debug)]
pub struct MeshRegion {
    distance: MeshDistance,
    bounds: Aabb,
    volume: f64,
    planes: [Vec<f64>; 3],
    /// The file of a CAD system that it comes from.
    cad: Option<Arc<CadMesh>>,
    /// Computed at first use.
    creases: OnceLock<Arc<Creases>>,
}

impl MeshRegion {
    /// The solid inside `mesh` (mm), repaired if need be.
    ///
    /// **Errors**: those of [`MeshDistance::new`].
    pub fn new(mesh: Mesh, repair: Repair) -> Result<Self, Fault> {
        MeshDistance::new(mesh, repair).map(MeshRegion::of)
    }

    /// The intersection of the solids `of`, or their union if `any`, less the solids `less`. `None` if it is empty.
    pub(super) fn combined(of: &[&MeshRegion], any: bool, less: &[&MeshRegion]) -> Option<Self> {
        let [of, less] = [of, less].map(|all| all.iter().map(|r| &r.distance).collect::<Vec<_>>());
        MeshDistance::combined(&of, any, &less).map(MeshRegion::of)
    }

    fn of(distance: MeshDistance) -> Self {
        let bounds = distance.mesh().bounds();
        MeshRegion {
            bounds,
            volume: distance.mesh().volume(),
            planes: [0, 1, 2].map(|axis| planes(distance.triangles(), &bounds, axis)),
            distance,
            cad: None,
            creases: OnceLock::new(),
        }
    }

    /// The solid with the faces of the file that it comes from.
    pub(super) fn of_cad(self, cad: CadMesh) -> Self {
        MeshRegion { cad: Some(Arc::new(cad)), ..self }
    }

    /// The boundary that everything is taken from: the mesh given if it was clean, else the repaired one.
    pub fn mesh(&self) -> &Mesh {
        self.distance.mesh()
    }

    /// What was repaired.
    pub fn repaired(&self) -> &Repaired {
        self.distance.repaired()
    }
}

/// Coordinates at which flat faces normal to `axis` make up a hundredth of the bounds' largest side.
///
/// Distances there are zero by `signed`, whichever triangle, edge or corner is found nearest.
fn planes(faces: &[Triangle], bounds: &Aabb, axis: usize) -> Vec<f64> {
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

impl AsRef<Mesh> for MeshRegion {
    fn as_ref(&self) -> &Mesh {
        self.mesh()
    }
}

impl Field for MeshRegion {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.distance.values(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.distance.gradients(points, values, gradients);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        let d = self.value(b.center());
        let reach = norm(b.size()) / 2.0;
        let reach = reach * (1.0 + 1e-12) + 2.0 * self.distance.rounding() + 1e-14 * d.abs();
        Interval::new(d - reach, d + reach)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.fill_level(block, 0.0, out);
    }
}

impl SignedDistance for MeshRegion {
    fn bounds(&self) -> Aabb {
        self.bounds
    }

    fn level_planes(&self, axis: usize, level: f64, out: &mut Vec<f64>) {
        if level == 0.0 {
            out.extend(&self.planes[axis]);
        }
    }

    /// Halves the block until a part lies on one side of the level or is eight nodes: most nodes are never evaluated.
    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        if block.is_empty() {
            return;
        }
        let widest = |axis: &[f64]| axis.windows(2).fold(0.0f64, |m, w| m.max(w[1] - w[0]));
        let cell = norm(block.axes.map(widest));
        let shape = block.shape();
        let mut fill = Fill { region: self, block, level, cell, out, candidates: Candidates::default(), few: false };
        fill.part([0; 3], shape, 0, UNKNOWN);
    }

    fn surfaces(self: Arc<Self>, by: f64, out: &mut Vec<Surface>) -> CsgTree {
        match Offset::new(self.clone(), by) {
            Ok(moved) if by != 0.0 => one_surface(Arc::new(moved), out),
            _ => {
                let creases = self.creases.get_or_init(|| Arc::new(creases(self.distance.mesh())));
                out.push(Surface {
                    creases: creases.clone(),
                    mesh: Some(self.clone()),
                    ..Surface::distance(self.clone())
                });
                CsgTree::Leaf(out.len() - 1)
            }
        }
    }

    fn is_searched(&self) -> bool {
        true
    }

    fn moved(self: Arc<Self>, by: &Similarity) -> Result<Region, Fault> {
        let mut made = MeshRegion::of(self.distance.image(|p| by.point(p), by.mirrors()));
        made.cad = self.cad.as_ref().map(|cad| {
            let vertices = cad.mesh.vertices.iter().map(|p| by.point(*p)).collect();
            let mesh = cad.mesh.with_vertices(vertices, by.mirrors());
            let volume = cad.volume.map(|v| v * by.scale().powi(3));
            Arc::new(CadMesh { mesh, volume, chord: cad.chord * by.scale(), ..(**cad).clone() })
        });
        Ok(Arc::new(made))
    }

    fn as_mesh(&self) -> Option<&MeshRegion> {
        Some(self)
    }

    fn cad(&self, out: &mut Vec<Arc<CadMesh>>) {
        out.extend(self.cad.clone());
    }

    fn opened(self: Arc<Self>, cuts: &[OpenSurface], found: &mut [bool]) -> Option<Region> {
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
    /// The triangles of which one is nearest to any node of the part that is being filled, once they are few.
    candidates: Candidates,
    few: bool,
}

/// Candidates are looked for in parts of at most this many nodes, and used if they are no more than these: else each node is
/// searched for by itself.
const PART: usize = 64;
const MOST_CANDIDATES: usize = 32;

impl Fill<'_> {
    /// Fills the nodes from `lo` up to `hi`, `seed` being a triangle that may be near and `known` a distance.
    fn part(&mut self, lo: [usize; 3], hi: [usize; 3], seed: u32, known: (Vec3, f64)) {
        let ends = [0, 1, 2].map(|a| [self.block.axes[a][lo[a]], self.block.axes[a][hi[a] - 1]]);
        let center = ends.map(|[a, b]| a + (b - a) / 2.0);
        let size = ends.map(|[a, b]| b - a);
        let hit = self.nearest(center, seed);
        let known = (center, self.region.distance.signed(&hit, center, known));
        let d = known.1 - self.level;
        if d.abs() > (norm(size) / 2.0 + self.cell) * (1.0 + 1e-9) {
            self.each(lo, hi, |_, p| (d.abs() - norm(sub(p, center))).copysign(d));
            return;
        }
        let count = (0..3).map(|a| hi[a] - lo[a]).product::<usize>();
        let found = !self.few && count <= PART;
        if found {
            let radius = norm(size) / 2.0 * (1.0 + 1e-9);
            let Fill { region, candidates, .. } = self;
            self.few = region.distance.candidates(center, &hit, radius, MOST_CANDIDATES, candidates);
        }
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        if count <= 8 || hi[longest] - lo[longest] < 2 {
            let (mut seed, mut known) = (hit.triangle, known);
            self.each(lo, hi, |fill, p| {
                let hit = fill.nearest(p, seed);
                seed = hit.triangle;
                known = (p, fill.region.distance.signed(&hit, p, known));
                known.1 - fill.level
            });
        } else {
            let middle = (lo[longest] + hi[longest]) / 2;
            let (mut end, mut begin) = (hi, lo);
            end[longest] = middle;
            begin[longest] = middle;
            self.part(lo, end, hit.triangle, known);
            self.part(begin, hi, hit.triangle, known);
        }
        self.few &= !found;
    }

    fn nearest(&self, p: Vec3, seed: u32) -> Nearest {
        match self.few {
            true => self.region.distance.nearest_of(&self.candidates, p),
            false => self.region.distance.nearest(p, seed),
        }
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
