//! A background of tetrahedra that is cut along the surfaces of a solid, one after another.

use super::node_surfaces::{SurfaceSet, members, only};
use super::patched_surface::Patched;
use crate::csg_tree::CsgTree;
use crate::implicit::Surface;
use geometry::math::{Vec3, sub};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Greatest distance of the midpoint of a boundary edge from its surface, as a fraction of the edge's length.
pub(super) const SAGITTA: f64 = 0.08;

/// A tetrahedron, positively oriented, and the surfaces of which it is known on which side it lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tet {
    pub nodes: [u32; 4],
    /// Surfaces whose function is negative in it.
    pub negative: SurfaceSet,
    /// Surfaces whose function is positive in it.
    pub positive: SurfaceSet,
}

/// Tetrahedra that are cut along surfaces until each lies in one domain or in none.
pub(crate) struct Partition<'a> {
    pub surfaces: &'a [Surface],
    /// Those of them that are meshes with feature edges, and are cut patch by patch.
    pub patched: &'a [Patched],
    /// The domains; no two overlap.
    pub trees: &'a [CsgTree],
    pub nodes: Vec<Vec3>,
    /// The surfaces on which each node lies.
    pub on: Vec<SurfaceSet>,
    /// The next periodic image of each node, in a cycle; itself without images.
    pub next: Vec<u32>,
    pub tets: Vec<Tet>,
}

impl Tet {
    /// What is known of the side of a surface, as words of one position: may be negative, is negative.
    fn sides(&self, surface: usize) -> (u64, u64) {
        let bit = 1 << surface;
        (u64::from(self.positive & bit == 0), u64::from(self.negative & bit != 0))
    }

    /// Whether it may lie in a domain.
    pub fn may_be_in(&self, tree: &CsgTree) -> bool {
        tree.possible(&|s| self.sides(s).0, &|s| self.sides(s).1) & 1 == 1
    }

    /// Whether the side of a surface that is not known yet can decide whether it lies in a domain.
    pub fn depends_on(&self, surface: usize, trees: &[CsgTree]) -> bool {
        if (self.negative | self.positive) >> surface & 1 == 1 {
            return false;
        }
        let mut found = false;
        for tree in trees {
            let mut note = |s: usize, w: u64| found |= s == surface && w & 1 == 1;
            tree.deciding(1, &|s| self.sides(s).0, &|s| self.sides(s).1, &mut note);
        }
        found
    }
}

/// What follows from the sides of each tetrahedron alone: it is found once for those that are alike.
fn by_sides<T: Copy + Send>(tets: &[Tet], of: impl Fn(&Tet) -> T + Sync) -> Vec<T> {
    const BATCH: usize = 4096;
    let found = tets.par_chunks(BATCH).flat_map_iter(|tets| {
        let (of, mut known) = (&of, FxHashMap::default());
        tets.iter().map(move |t| *known.entry((t.negative, t.positive)).or_insert_with(|| of(t)))
    });
    found.collect()
}

impl Partition<'_> {
    /// Which tetrahedra depend on the side of a surface.
    pub fn dependent(&self, surface: usize) -> Vec<bool> {
        by_sides(&self.tets, |t| t.depends_on(surface, self.trees))
    }

    /// Removes tetrahedra that lie in no domain.
    pub fn drop_outside(&mut self) {
        let tets = core::mem::take(&mut self.tets);
        let kept = by_sides(&tets, |t| self.trees.iter().any(|tree| t.may_be_in(tree)));
        self.tets = tets.into_par_iter().zip(kept).filter_map(|(t, kept)| kept.then_some(t)).collect();
    }

    /// The domain of each tetrahedron, when all surfaces are known that decide it.
    pub fn domains(&self) -> Vec<u8> {
        let of = |t: &Tet| self.trees.iter().position(|tree| t.may_be_in(tree)).unwrap_or(0) as u8;
        by_sides(&self.tets, of)
    }

    /// Puts nodes on the first of surfaces that are the same plane, as of boxes that touch or overlap: on two, they would count as nodes on
    /// an edge and stay where they are.
    pub fn join_planes(&mut self) {
        let plane = |i: usize| self.surfaces[i].plane.map(|p| (p.axis, p.at));
        let first = |i: usize| (0..i).find(|j| plane(*j).is_some() && plane(*j) == plane(i)).unwrap_or(i);
        let firsts: Vec<usize> = (0..self.surfaces.len()).map(first).collect();
        let joined = |set: SurfaceSet| members(set).fold(0, |all, i| all | only(firsts[i]));
        self.on.iter_mut().for_each(|set| *set = joined(*set));
    }

    /// The corners of a tetrahedron.
    pub fn corners(&self, t: &Tet) -> [Vec3; 4] {
        t.nodes.map(|n| self.nodes[n as usize])
    }

    /// The node and its periodic images.
    pub fn images(&self, n: u32) -> impl Iterator<Item = u32> {
        images(&self.next, n)
    }

    /// The periodic images of an edge other than itself: those with the same translation of both ends.
    pub fn edge_images(&self, [a, b]: [u32; 2]) -> Vec<[u32; 2]> {
        edge_images(&self.nodes, &self.next, [a, b])
    }

    /// The surfaces on which the midpoint of an edge whose ends lie on them is, by their values at it.
    pub fn shared(&self, [a, b]: [u32; 2]) -> SurfaceSet {
        let both = self.on[a as usize] & self.on[b as usize];
        let (p, q) = (self.nodes[a as usize], self.nodes[b as usize]);
        let middle: Vec3 = core::array::from_fn(|k| 0.5 * (p[k] + q[k]));
        let length = geometry::math::norm(sub(p, q));
        members(both)
            .filter(|i| {
                if self.surfaces[*i].plane.is_some() {
                    return true;
                }
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                self.surfaces[*i].field.gradients(&[middle], &mut v, &mut g);
                v[0].abs() <= SAGITTA * length * geometry::math::norm(g[0])
            })
            .fold(0, |set, i| set | 1 << i)
    }
}

/// A node and its periodic images, along their cycle.
pub(crate) fn images(next: &[u32], n: u32) -> impl Iterator<Item = u32> {
    let mut at = Some(n);
    core::iter::from_fn(move || {
        let here = at?;
        let after = next[here as usize];
        at = (after != n).then_some(after);
        Some(here)
    })
}

/// The periodic images of an edge other than itself.
pub(crate) fn edge_images(nodes: &[Vec3], next: &[u32], [a, b]: [u32; 2]) -> Vec<[u32; 2]> {
    let mut out = Vec::new();
    if next[a as usize] == a || next[b as usize] == b {
        return out;
    }
    let along = sub(nodes[b as usize], nodes[a as usize]);
    for c in images(next, a) {
        for d in images(next, b) {
            let other = sub(nodes[d as usize], nodes[c as usize]);
            let same = (0..3).all(|k| (along[k] - other[k]).abs() <= 1e-9 * (along[k].abs() + other[k].abs() + 1e-3));
            if c != a && same {
                out.push([c, d]);
            }
        }
    }
    out
}
