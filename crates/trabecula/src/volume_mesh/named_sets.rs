//! Named sets of a volume mesh: bounding planes, what the region cuts, lattice, skin, keep zones.

use super::cyclic_nodes::PLANES;
use super::domains::Domains;
use super::node_surfaces::{HELD, SurfaceSet, only};
use crate::field::Field;
use geometry::fe_mesh::{FeMesh, FeSet};
use geometry::math::{Vec3, add, scale};
use rayon::prelude::*;

/// Adds the sets that are not empty. `faces` are those on surfaces: tetrahedron and corner, their surfaces, whether only one tetrahedron
/// has them; `planes` the surfaces of the bounding planes; `bodies` the names of what is solid whatever the lattice says.
pub(super) fn add_sets(
    mesh: &mut FeMesh,
    domains: &Domains,
    faces: &[((u32, u8), SurfaceSet, bool)],
    planes: &[[Option<usize>; 2]; 3],
    bodies: &[String],
) {
    let below = |n: usize| -> SurfaceSet { (1 << n) - 1 };
    let region = below(domains.region);
    let lattice = !below(domains.lattice) & !HELD;
    let several = domains.names.len() > 1;
    for (axis, sides) in planes.iter().enumerate() {
        for (side, s) in sides.iter().enumerate() {
            let Some(s) = s else { continue };
            let name = PLANES[axis][side];
            let of: Vec<(u32, u8)> =
                faces.iter().filter(|(_, set, outer)| *outer && set & only(*s) != 0).map(|f| f.0).collect();
            if several {
                for (d, domain) in domains.names.iter().enumerate() {
                    let of = of.iter().copied().filter(|f| mesh.domain[f.0 as usize] as usize == d).collect();
                    push(mesh, format!("{domain}_{name}"), of);
                }
            }
            push(mesh, name.into(), of);
        }
    }
    let cut = faces.iter().filter(|(_, set, outer)| *outer && set & region != 0).map(|f| f.0).collect();
    push(mesh, "CUT".into(), cut);
    let own = faces.iter().filter(|(_, set, _)| set & region == 0 && set & lattice != 0).map(|f| f.0).collect();
    push(mesh, "LATTICE".into(), own);
    let middle = |t: &[u32; 4]| scale(t.iter().fold([0.0; 3], |s, n| add(s, mesh.nodes[*n as usize])), 0.25);
    let middles: Vec<Vec3> = mesh.tets.par_iter().map(middle).collect();
    for (body, name) in domains.filled.iter().zip(bodies) {
        let mut values = vec![0.0; middles.len()];
        values.par_chunks_mut(1024).zip(middles.par_chunks(1024)).for_each(|(v, p)| body.values(p, v));
        let within = |t: u32| values[t as usize] < 0.0 && mesh.domain[t as usize] == 0;
        let of: Vec<(u32, u8)> = faces.iter().filter(|(f, _, outer)| *outer && within(f.0)).map(|f| f.0).collect();
        let elements: Vec<u32> = (0..mesh.tets.len() as u32).filter(|t| within(*t)).collect();
        if !elements.is_empty() {
            let nodes = nodes_of(elements.iter().flat_map(|t| {
                let middles = mesh.middles.get(*t as usize).copied();
                mesh.tets[*t as usize].into_iter().chain(middles.into_iter().flatten())
            }));
            mesh.sets.push(FeSet { name: name.clone(), nodes, elements, faces: of });
        }
    }
}

/// Adds a set of faces with their nodes and tetrahedra, unless it is empty.
fn push(mesh: &mut FeMesh, name: String, mut faces: Vec<(u32, u8)>) {
    if faces.is_empty() {
        return;
    }
    faces.sort_unstable();
    let mut elements: Vec<u32> = faces.iter().map(|f| f.0).collect();
    elements.dedup();
    let nodes = nodes_of(
        faces.iter().flat_map(|f| mesh.face(*f).into_iter().chain(mesh.face_middles(*f).into_iter().flatten())),
    );
    mesh.sets.push(FeSet { name, nodes, elements, faces });
}

fn nodes_of(nodes: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut nodes: Vec<u32> = nodes.collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
