//! Surfaces that are meshes with feature edges, in groups of patches.

use std::ops::Range;
use std::sync::Arc;

use super::node_surfaces::{MOST, SurfaceSet, only};
use crate::field::Field;
use crate::implicit::Surface;
use geometry::math::{Aabb, Interval, Vec3, norm};
use geometry::surface_patches::{PatchGroup, patch_groups};

/// A surface that is a mesh with feature edges, and the groups of its patches, which are surfaces too.
pub(crate) struct Patched {
    /// The number of the mesh among the surfaces.
    pub mesh: usize,
    /// The number of the first group.
    first: usize,
    groups: Vec<Arc<PatchGroup>>,
}

impl Patched {
    /// The numbers of the groups.
    pub fn groups(&self) -> Range<usize> {
        self.first..self.first + self.groups.len()
    }

    /// A set with the mesh in place of its groups.
    pub fn folded(&self, set: SurfaceSet) -> SurfaceSet {
        let groups = self.groups().fold(0, |all, g| all | only(g));
        if set & groups == 0 { set } else { set & !groups | only(self.mesh) }
    }

    /// Whether a patch of the group with this number meets a tetrahedron.
    pub fn meets(&self, group: usize, corners: &[Vec3; 4]) -> bool {
        self.groups[group - self.first].meets(corners)
    }

    /// The width of the narrowest patches unless there are too many, as a fraction of the size of tetrahedra.
    pub const NARROW: f64 = 0.05;

    /// The meshes among surfaces, whose groups are added to these. `size` is that of tetrahedra (mm), and patches are at least as wide as
    /// the fraction `narrow` of it; wider where there are more groups than a node can know, and no groups where even one of all is more.
    pub fn of(surfaces: &mut Vec<Surface>, size: f64, narrow: f64) -> Vec<Patched> {
        let mut found = Vec::new();
        for mesh in 0..surfaces.len() {
            let Some(of) = surfaces[mesh].mesh.clone() else { continue };
            let first = surfaces.len();
            let widest = norm((*of).as_ref().bounds().size());
            let mut least = narrow * size;
            let mut groups = patch_groups((*of).as_ref(), size, least);
            while first + groups.len() > MOST && least < widest {
                least *= 2.0;
                groups = patch_groups((*of).as_ref(), size, least);
            }
            if first + groups.len() > MOST {
                groups.clear();
            }
            if groups.is_empty() {
                continue;
            }
            let groups: Vec<Arc<PatchGroup>> = groups.into_iter().map(Arc::new).collect();
            let surface = |g: &Arc<PatchGroup>| Surface {
                creases: g.creases.clone(),
                ..Surface::distance(Arc::new(GroupField(g.clone())))
            };
            surfaces.extend(groups.iter().map(surface));
            found.push(Patched { mesh, first, groups });
        }
        found
    }
}

/// A group of patches as a field.
struct GroupField(Arc<PatchGroup>);

impl Field for GroupField {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
    }

    fn bound(&self, _: &Aabb) -> Interval {
        Interval::new(f64::NEG_INFINITY, f64::INFINITY)
    }
}
