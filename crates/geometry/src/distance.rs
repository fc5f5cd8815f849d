//! The exact signed distance of the solid inside a closed triangle mesh.
//!
//! The nearest triangle is found in a tree of boxes. The sign comes from the normals of the nearest face, edge or vertex
//! where the boundary is one clean surface (Bærentzen and Aanæs, IEEE Transactions on Visualization and Computer Graphics
//! 11(3), 2005), else from those of the face or from the winding number (Barill et al., ACM Transactions on Graphics 37(4), 2018).

use crate::fault::Fault;
use crate::math::{Vec3, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;
use crate::repair::{self, Boundary, Repair, Repaired};

mod disc;
pub(crate) mod normals;
pub mod periodic;
pub mod triangle;
pub mod triangle_bvh;
pub mod winding;

use normals::PseudoNormals;
use triangle::{Feature, Triangle};
use triangle_bvh::{Candidates, Nearest, TriangleBvh};
use winding::Winding;

/// A position and its signed distance, where none is known: no comparison with it holds.
pub const UNKNOWN: (Vec3, f64) = ([0.0; 3], f64::NAN);
/// Sets of triangles farther off than this many of their radii are taken as a whole where the winding number decides the
/// sign: for a closed surface it is then within a few hundredths of zero or one.
pub const REACH: f64 = 1.4;

/// The solid inside a triangle mesh, repaired if it was not clean: connected components, perhaps with cavities.
///
/// Distances to the (repaired) boundary are exact to rounding, negative inside.
#[derive(Debug)]
pub struct MeshDistance {
    tree: TriangleBvh,
    normals: PseudoNormals,
    /// Decides the sign where the boundary is not one clean surface; none where it is everywhere.
    winding: Option<Winding>,
    mesh: Mesh,
    repaired: Repaired,
}

impl MeshDistance {
    /// The solid inside `mesh` (mm), repaired if need be.
    ///
    /// A clean mesh is taken as it is, but for this: if edges are open, vertices that single precision cannot tell
    /// apart at the mesh's size are joined first, as files often write one corner with two roundings.
    ///
    /// **Errors**: numbers that are not finite; no volume; holes whose caps would be a tenth of the surface or more
    /// ([`repair::CAPPED`]); with [`Repair::Refuse`] all that [`Repaired`] counts, in numbers.
    pub fn new(mesh: Mesh, repair: Repair) -> Result<Self, Fault> {
        repair::boundary(mesh, repair).map(MeshDistance::within)
    }

    /// The intersection of the solids `of`, or their union if `any`, less the solids `less`. `None` if it is empty.
    pub fn combined(of: &[&MeshDistance], any: bool, less: &[&MeshDistance]) -> Option<Self> {
        let least = if any { 1 } else { of.len() };
        let [of, less] = [of, less].map(|all| all.iter().map(|r| &r.mesh).collect::<Vec<_>>());
        repair::combined(&of, &less, least).map(MeshDistance::within)
    }

    /// The same boundary with its vertices at other positions, by a similarity transform; triangles are turned over if it `mirrors`.
    pub fn image(&self, to: impl Fn(Vec3) -> Vec3, mirrors: bool) -> Self {
        let mesh = self.mesh.with_vertices(self.mesh.vertices.iter().map(|p| to(*p)).collect(), mirrors);
        // Rounding may let thin parts touch.
        let pairs = if self.signed_by_normals() { repair::pairs(&mesh) } else { None };
        MeshDistance::within(Boundary { mesh, pairs, done: self.repaired.clone() })
    }

    fn within(Boundary { mesh, pairs, done }: Boundary) -> Self {
        let faces: Vec<Triangle> = (0..mesh.triangles.len()).map(|i| Triangle::new(mesh.corners(i))).collect();
        let tree = TriangleBvh::new(&faces);
        let (normals, winding) = match pairs {
            Some(pairs) => (PseudoNormals::new(&mesh, &faces, &pairs, tree.order()), None),
            None => (PseudoNormals::of_pieces(&faces, tree.order()), Some(Winding::new(&tree))),
        };
        MeshDistance { normals, winding, tree, mesh, repaired: done }
    }

    /// The boundary: the mesh given if it was clean, else the repaired one.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Counts of the repairs.
    pub fn repaired(&self) -> &Repaired {
        &self.repaired
    }

    /// Whether the boundary is one clean surface, so that normals alone decide the sign.
    pub fn signed_by_normals(&self) -> bool {
        self.winding.is_none()
    }

    /// The triangles, in the order of the tree.
    pub fn triangles(&self) -> &[Triangle] {
        self.tree.triangles()
    }

    /// Distances up to this (mm) are hidden by rounding.
    pub fn rounding(&self) -> f64 {
        self.tree.rounding()
    }

    /// The nearest triangle; `seed` is one that may be near.
    pub fn nearest(&self, p: Vec3, seed: u32) -> Nearest {
        self.tree.nearest(p, seed)
    }

    /// Finds the triangles of which one is nearest to any point of the ball about `center`, whose nearest triangle is `hit`;
    /// false if there are more than `most`.
    pub fn candidates(&self, center: Vec3, hit: &Nearest, radius: f64, most: usize, found: &mut Candidates) -> bool {
        self.tree.candidates(center, hit, radius, most, found)
    }

    /// The nearest triangle to a point of the candidates' ball.
    pub fn nearest_of(&self, candidates: &Candidates, p: Vec3) -> Nearest {
        self.tree.nearest_of(candidates, p)
    }

    /// Signed distance (mm) of `p`, whose nearest triangle is `hit`; zero where rounding hides it, so that points of flat
    /// faces are exactly on them.
    ///
    /// `known` is a position and its signed distance: where the two balls that hold no surface overlap, the sign is the
    /// same, and winding numbers need not be computed.
    pub fn signed(&self, hit: &Nearest, p: Vec3, known: (Vec3, f64)) -> f64 {
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

    /// Gradient of the signed distance at a position whose nearest triangle is `hit` and whose signed distance is `d` (mm).
    fn gradient(&self, hit: &Nearest, d: f64) -> Vec3 {
        let outward = self.normals.outward(&self.tree, hit);
        match hit.feature {
            Feature::Face if !outward[0].is_nan() => outward,
            _ if d == 0.0 && outward[0].is_nan() => self.tree.triangles()[hit.triangle as usize].normal,
            _ if d == 0.0 => unit(outward),
            _ => scale(hit.away, 1.0 / d),
        }
    }

    /// Signed distance (mm) of a point.
    pub fn value(&self, p: Vec3) -> f64 {
        self.signed(&self.tree.nearest(p, 0), p, UNKNOWN)
    }

    /// Fills signed distances (mm) of points; fastest for points that follow each other closely.
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let (mut recent, mut known) = (Recent::default(), UNKNOWN);
        for (o, p) in out.iter_mut().zip(points) {
            let hit = recent.nearest(&self.tree, *p);
            *o = self.signed(&hit, *p, known);
            known = (*p, *o);
        }
    }

    /// Fills signed distances (mm) and their gradients; on the surface the outward normal.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let (mut recent, mut known) = (Recent::default(), UNKNOWN);
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let hit = recent.nearest(&self.tree, *p);
            *v = self.signed(&hit, *p, known);
            *g = self.gradient(&hit, *v);
            known = (*p, *v);
        }
    }
}

/// The triangles that were found last, the latest first: where rows of points run through a part, from one side of it to the
/// other, the next point is mostly near one of them.
#[derive(Default)]
struct Recent([u32; 4]);

impl Recent {
    fn nearest(&mut self, tree: &TriangleBvh, p: Vec3) -> Nearest {
        let hit = tree.nearest(p, tree.seed(p, self.0));
        if !self.0.contains(&hit.triangle) {
            self.0.rotate_right(1);
            self.0[0] = hit.triangle;
        }
        hit
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
