//! What a surface cuts out of the bounding planes of a periodic cell, while nodes are moved onto it.
//!
//! Of a triangle in a plane and its image both or neither must be faces of a domain. The sign at a corner that is not on the surface decides
//! it for both; where all corners are on the surface, or a node on it has one sign around it, there may be matter at one plane and none at
//! the other.

use super::node_surfaces::{SurfaceSet, members};
use super::partition::Partition;
use crate::implicit::AxisPlane;
use geometry::math::Vec3;
use geometry::tetmesh::FACES;
use rustc_hash::FxHashMap;

/// Triangles by their nodes, of all images the first.
type Stars = FxHashMap<u32, Vec<[u32; 3]>>;

/// The triangles in the bounding planes normal to each axis.
pub(super) struct PlaneSections {
    along: [Stars; 3],
}

impl PlaneSections {
    pub fn new(partition: &Partition) -> PlaneSections {
        let mut along: [Stars; 3] = Default::default();
        for (plane, own) in partition.faces_in_planes() {
            for n in own {
                let star = along[plane.axis].entry(n).or_default();
                if !star.contains(&own) {
                    star.push(own);
                }
            }
        }
        PlaneSections { along }
    }

    /// Whether the section stays a line through each node on the surface if a node, the first of its images, is moved onto it.
    pub fn stays_line(&self, n: u32, values: &[f64]) -> bool {
        let value = |m: u32| if m == n { 0.0 } else { values[m as usize] };
        let cut = |of: &mut dyn Iterator<Item = u32>| {
            let (mut below, mut above) = (false, false);
            of.for_each(|m| (below, above) = (below | (value(m) < 0.0), above | (value(m) > 0.0)));
            below && above
        };
        let stars: Vec<&Vec<[u32; 3]>> = self.along.iter().filter_map(|s| s.get(&n)).collect();
        let planar = self.along.iter().all(|stars| {
            let Some(star) = stars.get(&n) else { return true };
            if star.iter().any(|t| t.iter().all(|m| value(*m) == 0.0)) {
                return false;
            }
            let mut neighbours: Vec<u32> = star.iter().flatten().copied().filter(|m| value(*m) == 0.0).collect();
            neighbours.sort_unstable();
            neighbours.dedup();
            neighbours.into_iter().all(|m| {
                let around = stars.get(&m).into_iter().flatten();
                let at_edge = star.iter().filter(|t| m != n && t.contains(&m)).flatten().copied();
                let whole = star.iter().filter(|t| t.contains(&m)).count() < 2;
                cut(&mut around.flatten().copied()) && (m == n || whole || cut(&mut at_edge.into_iter()))
            })
        });
        // Along an edge of the cell.
        let edge = match stars[..] {
            [a, b] => {
                let both: Vec<u32> =
                    a.iter().flatten().copied().filter(|m| *m != n && b.iter().any(|t| t.contains(m))).collect();
                both.iter().all(|m| value(*m) != 0.0) && cut(&mut both.into_iter())
            }
            _ => true,
        };
        planar && edge
    }
}

impl Partition<'_> {
    /// The faces of tetrahedra in bounding planes, each with its plane, by their nodes, of all images the first, ascending.
    fn faces_in_planes(&self) -> impl Iterator<Item = (AxisPlane, [u32; 3])> {
        let tied = |n: &u32| self.next[*n as usize] != *n;
        let faces = self.tets.iter().flat_map(|t| FACES.map(|f| f.map(|c| t.nodes[c])));
        faces.filter(move |f| f.iter().all(tied)).filter_map(|f| {
            let common = f.iter().fold(SurfaceSet::MAX, |s, n| s & self.on[*n as usize]);
            let plane = members(common).find_map(|s| self.surfaces[s].bounding_plane())?;
            let mut own = f.map(|n| self.images(n).min().unwrap_or(n));
            own.sort_unstable();
            Some((plane, own))
        })
    }

    /// Whether each face in a bounding plane has its image, and each node of a tetrahedron has all of its own but for those that may
    /// lack one.
    pub fn is_periodic(&self, may_lack: &impl Fn(Vec3) -> bool) -> bool {
        let mut planes: FxHashMap<(usize, [u32; 3]), u8> = FxHashMap::default();
        for (plane, own) in self.faces_in_planes() {
            *planes.entry((plane.axis, own)).or_default() |= 1 << u8::from(plane.below);
        }
        let mut used = vec![false; self.nodes.len()];
        self.tets.iter().flat_map(|t| t.nodes).for_each(|n| used[n as usize] = true);
        let bounding = |s: usize| self.surfaces[s].bounding_plane().is_some();
        let alone = |n: u32| self.next[n as usize] == n && members(self.on[n as usize]).any(bounding);
        let whole = |n: u32| !alone(n) && self.images(n).all(|m| used[m as usize]) || may_lack(self.nodes[n as usize]);
        planes.values().all(|sides| *sides == 3) && (0..).zip(&used).filter(|(_, used)| **used).all(|(n, _)| whole(n))
    }
}
