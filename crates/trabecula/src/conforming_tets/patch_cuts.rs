//! Cuts along the patches of a mesh, group by group, so that its feature edges and corners are edges and nodes of tetrahedra.

use std::ops::Range;
use std::sync::Arc;

use super::node_surfaces::{MOST, SurfaceSet, members, only};
use super::partition::{Partition, Tet};
use super::surface_cuts::evaluated;
use crate::field::Field;
use crate::implicit::Surface;
use geometry::math::{Aabb, Interval, Vec3, norm, sub};
use geometry::surface_patches::{PatchGroup, patch_groups};
use rayon::prelude::*;

/// The most rounds of cuts of tetrahedra that nodes draw to a group by moving onto it.
const DRAWN: usize = 4;

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

impl Partition<'_> {
    /// Cuts tetrahedra along the patches of a mesh that meet them, and notes on which side of it all lie.
    pub fn cut_by_patches(&mut self, patched: &Patched, step: f64) {
        self.settle_far(patched.mesh);
        for g in patched.groups() {
            let dependent = self.met(patched, g);
            self.cut_where(g, &dependent, step);
            self.cut_drawn(patched, g, step);
        }
        // Cuts along other groups have moved nodes along this one.
        for g in patched.groups() {
            self.cut_drawn(patched, g, step);
        }
        self.settle(patched, step);
    }

    /// Cuts tetrahedra along a group of patches to which nodes that moved have drawn them.
    fn cut_drawn(&mut self, patched: &Patched, group: usize, step: f64) {
        for _ in 0..DRAWN {
            let drawn = self.drawn_to(patched, group);
            if !drawn.contains(&true) {
                return;
            }
            self.cut_where(group, &drawn, step);
        }
    }

    /// Notes on which side of a mesh those lie that it cannot reach.
    fn settle_far(&mut self, mesh: usize) {
        let field = &*self.surfaces[mesh].field;
        let (nodes, trees) = (&self.nodes, self.trees);
        self.tets.par_iter_mut().filter(|t| t.depends_on(mesh, trees)).for_each(|t| {
            let p = t.nodes.map(|n| nodes[n as usize]);
            let middle = mean(&p);
            let reach = p.iter().map(|p| norm(sub(*p, middle))).fold(0.0, f64::max);
            let v = field.value(middle);
            if v < -reach {
                t.negative |= only(mesh);
            } else if v > reach {
                t.positive |= only(mesh);
            }
        });
    }

    /// Which tetrahedra depend on a mesh and meet a group of its patches.
    fn met(&self, patched: &Patched, group: usize) -> Vec<bool> {
        let of = |t: &Tet| t.depends_on(patched.mesh, self.trees) && patched.meets(group, &self.corners(t));
        self.tets.par_iter().map(of).collect()
    }

    /// Which tetrahedra that depend on a mesh and have a node on a group of its patches meet that, and have not been cut along it.
    fn drawn_to(&self, patched: &Patched, group: usize) -> Vec<bool> {
        let bit = only(group);
        let of = |t: &Tet| {
            (t.negative | t.positive) & bit == 0
                && t.nodes.iter().any(|n| self.on[*n as usize] & bit != 0)
                && t.depends_on(patched.mesh, self.trees)
                && patched.meets(group, &self.corners(t))
        };
        self.tets.par_iter().map(of).collect()
    }

    /// Holds nodes of the background on the planes, and on the patches of meshes, on which they lie already, so that cuts along other
    /// surfaces do not move them away.
    pub fn hold_nodes(&mut self, own: usize, step: f64) {
        let all = vec![true; self.tets.len()];
        for s in 0..own {
            match self.patched.iter().find(|p| p.mesh == s) {
                Some(patched) => patched.groups().for_each(|g| {
                    let dependent = self.met(patched, g);
                    self.values(g, &dependent, step);
                }),
                None if self.surfaces[s].plane.is_some() => drop(self.values(s, &all, step)),
                None => {}
            }
        }
    }

    /// Notes on which side of a mesh tetrahedra lie that have been cut along it.
    ///
    /// The node farthest from the surface decides. Where all nodes are on it, the middle does; chords may have put that on the wrong
    /// side of a curved patch, and so the side that the cut along the patch has found counts if it is the nearest one.
    fn settle(&mut self, patched: &Patched, step: f64) {
        /// Nodes are off the surface if they are farther away than this fraction of the background's edges.
        const OFF: f64 = 1e-4;
        /// Distances that differ by less than this fraction of those edges are those of one place.
        const ROUNDING: f64 = 1e-9;
        let field = &*self.surfaces[patched.mesh].field;
        let mut used = vec![false; self.nodes.len()];
        self.tets.iter().flat_map(|t| t.nodes).for_each(|n| used[n as usize] = true);
        let asked: Vec<usize> = (0..used.len()).filter(|n| used[*n]).collect();
        let points: Vec<Vec3> = asked.iter().map(|n| self.nodes[*n]).collect();
        let mut values = vec![0.0; self.nodes.len()];
        asked.iter().zip(evaluated(field, &points)).for_each(|(n, v)| values[*n] = v);
        let groups = patched.groups().fold(0, |set, g| set | only(g));
        let (nodes, surfaces) = (&self.nodes, self.surfaces);
        self.tets.par_iter_mut().filter(|t| (t.negative | t.positive) & only(patched.mesh) == 0).for_each(|t| {
            let farthest = t
                .nodes
                .map(|n| values[n as usize])
                .into_iter()
                .fold(0.0, |m: f64, v| if v.abs() > m.abs() { v } else { m });
            let inside = if farthest.abs() > OFF * step {
                farthest < 0.0
            } else {
                let p = t.nodes.map(|n| nodes[n as usize]);
                let middle = mean(&p);
                let v = field.value(middle);
                let nearest = |g: &usize| (surfaces[*g].field.value(middle).abs() - v.abs()).abs() <= ROUNDING * step;
                match members((t.negative | t.positive) & groups).find(nearest) {
                    Some(g) => t.negative & only(g) != 0,
                    None => v < 0.0,
                }
            };
            if inside { t.negative |= only(patched.mesh) } else { t.positive |= only(patched.mesh) }
        });
    }
}

/// The mean of the corners of a tetrahedron.
fn mean(p: &[Vec3; 4]) -> Vec3 {
    core::array::from_fn(|k| (p[0][k] + p[1][k] + p[2][k] + p[3][k]) / 4.0)
}
