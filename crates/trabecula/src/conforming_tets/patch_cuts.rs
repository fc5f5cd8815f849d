//! Cuts along the patches of a mesh, group by group, so that its feature edges and corners are edges and nodes of tetrahedra.

use super::node_surfaces::{members, only};
use super::partition::{Partition, Tet};
use super::patched_surface::Patched;
use super::surface_cuts::evaluated;
use geometry::math::{Vec3, norm, sub};
use rayon::prelude::*;

/// The most rounds of cuts of tetrahedra that nodes draw to a group by moving onto it.
const DRAWN: usize = 4;

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
