//! Faces of a mesh as finite volumes have them: between two cells or in one patch, ordered as OpenFOAM requires.
//!
//! Internal faces come first, ascending by owner and then neighbour (upper triangular order), owner < neighbour, normals from owner to
//! neighbour; then patches, normals outwards. Source: OpenFOAM User Guide, section Mesh description.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::FeMesh;
use crate::tetmesh::FACES;

/// The faces of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolyFaces {
    /// Nodes of each face, counter-clockwise seen from outside its owner.
    pub faces: Vec<[u32; 3]>,
    /// The tetrahedron that each face belongs to.
    pub owner: Vec<u32>,
    /// The tetrahedron on the other side of each internal face.
    pub neighbour: Vec<u32>,
    /// What boundary faces make up, in their order.
    pub patches: Vec<BoundaryPatch>,
}

/// A patch of boundary faces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BoundaryPatch {
    /// Its name: that of a set.
    pub name: String,
    /// The number of its first face.
    pub start: usize,
    /// The number of its faces.
    pub count: usize,
    /// The patch on the opposite side of a periodic cell, and the axis along which it lies; faces correspond one by one.
    pub cyclic: Option<(String, usize)>,
}

/// The name of the patch of faces that no set has.
const REST: &str = "REST";

impl FeMesh {
    /// The smallest set of each face that is in sets: an index of `sets`. Of equal ones the last.
    pub fn smallest_sets(&self) -> BTreeMap<(u32, u8), usize> {
        // Of equal ones that which is not the surface of a kind, such as CUT: what a face of the region is called says more.
        let kind = |s: &usize| ["CUT", "LATTICE", "SKIN"].contains(&&*self.sets[*s].name);
        let mut order: Vec<usize> = (0..self.sets.len()).collect();
        order.sort_by_key(|s| (std::cmp::Reverse(self.sets[*s].faces.len()), !kind(s)));
        let mut of = BTreeMap::new();
        for s in order {
            self.sets[s].faces.iter().for_each(|f| _ = of.insert(*f, s));
        }
        of
    }

    /// Its faces for finite volumes: each boundary face in the patch of its smallest set.
    pub fn poly_faces(&self) -> PolyFaces {
        let mut all: Vec<([u32; 3], u32)> = self
            .tets
            .par_iter()
            .enumerate()
            .flat_map_iter(|(t, nodes)| {
                FACES.iter().enumerate().map(move |(k, f)| {
                    let mut key = f.map(|c| nodes[c]);
                    key.sort_unstable();
                    (key, 4 * t as u32 + k as u32)
                })
            })
            .collect();
        all.par_sort_unstable();
        let (mut inner, mut outer) = (Vec::new(), Vec::new());
        for same in all.chunk_by(|a, b| a.0 == b.0) {
            match same {
                // The lesser one belongs to the tetrahedron that comes first.
                [(_, a), (_, b)] => inner.push((*a / 4, *b / 4, (*a % 4) as u8)),
                _ => outer.push((same[0].1 / 4, (same[0].1 % 4) as u8)),
            }
        }
        drop(all);
        inner.par_sort_unstable();
        let mut made = PolyFaces {
            faces: inner.iter().map(|(t, _, k)| self.face((*t, *k))).collect(),
            owner: inner.iter().map(|f| f.0).collect(),
            neighbour: inner.iter().map(|f| f.1).collect(),
            patches: Vec::new(),
        };
        outer.sort_unstable();
        let smallest = self.smallest_sets();
        let mut patches: BTreeMap<usize, Vec<(u32, u8)>> = BTreeMap::new();
        for f in outer {
            patches.entry(smallest.get(&f).copied().unwrap_or(self.sets.len())).or_default().push(f);
        }
        let images = self.images();
        for (s, of) in patches {
            let name = self.sets.get(s).map_or(REST, |s| &s.name).to_string();
            let cyclic = if self.pairs.is_empty() { None } else { opposite(&name) };
            let mut faces: Vec<([u32; 3], [u32; 3], u32)> = of
                .into_iter()
                .map(|f| {
                    let nodes = self.face(f);
                    match cyclic {
                        Some(_) => corresponding(nodes, &images, f.0),
                        None => ([0; 3], nodes, f.0),
                    }
                })
                .collect();
            // Stable: others stay in the order of tetrahedra.
            faces.sort_by_key(|f| f.0);
            made.patches.push(BoundaryPatch { name, start: made.faces.len(), count: faces.len(), cyclic });
            made.faces.extend(faces.iter().map(|f| f.1));
            made.owner.extend(faces.iter().map(|f| f.2));
        }
        made
    }

    /// The image of each node that has one in a periodic cell, itself otherwise.
    fn images(&self) -> Vec<u32> {
        let mut images: Vec<u32> = (0..self.nodes.len() as u32).collect();
        self.pairs.iter().for_each(|p| images[p.node as usize] = p.image);
        images
    }
}

/// A face of a cyclic patch by its nodes' images, ascending, and its nodes from that with the least image on.
fn corresponding(nodes: [u32; 3], images: &[u32], t: u32) -> ([u32; 3], [u32; 3], u32) {
    let of = nodes.map(|n| images[n as usize]);
    let first = (0..3).min_by_key(|k| of[*k]).unwrap_or(0);
    let mut key = of;
    key.sort_unstable();
    (key, [0, 1, 2].map(|k| nodes[(first + k) % 3]), t)
}

/// The bounding plane opposite to one, and its axis.
fn opposite(name: &str) -> Option<(String, usize)> {
    let axis = ["X", "Y", "Z"].iter().position(|a| name.rsplit('_').next().is_some_and(|n| n.starts_with(a)))?;
    let other = match name.chars().last()? {
        '0' => '1',
        '1' => '0',
        _ => return None,
    };
    let mut opposite = name.to_string();
    opposite.pop();
    opposite.push(other);
    Some((opposite, axis))
}

#[cfg(test)]
mod tests {
    use crate::fe_mesh::{FeMesh, FeSet};

    #[test]
    fn faces_stand_in_upper_triangular_order_and_patches_are_the_smallest_sets() {
        // Three tetrahedra in a row, 0–1–2.
        let set = |name: &str, faces: Vec<(u32, u8)>| FeSet { name: name.into(), faces, ..FeSet::default() };
        let mesh = FeMesh {
            nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3], [2.0, 1.0, 0.5]],
            tets: vec![[0, 1, 2, 3], [1, 4, 2, 3], [1, 5, 2, 4]],
            domain: vec![0; 3],
            domains: vec!["SOLID".into()],
            sets: vec![
                set("CUT", vec![(0, 1), (0, 2), (0, 3)]),
                set("X0", vec![(0, 1)]),
                set("Z1", vec![(2, 0)]),
                set("SKIN", vec![(2, 0)]),
            ],
            ..FeMesh::default()
        };
        let made = mesh.poly_faces();
        assert_eq!((made.neighbour.as_slice(), &made.owner[..2]), ([1, 2].as_slice(), [0, 1].as_slice()));
        assert_eq!(made.faces[0], [1, 2, 3]);
        let patches: Vec<(&str, usize, usize)> =
            made.patches.iter().map(|p| (p.name.as_str(), p.start, p.count)).collect();
        // Of Z1 and SKIN, which are the same face, the one that is named after its place.
        assert_eq!(patches, [("CUT", 2, 2), ("X0", 4, 1), ("Z1", 5, 1), ("REST", 6, 4)]);
        assert_eq!(made.faces.len(), made.owner.len());
    }
}
