//! From the cut background to a mesh whose shapes can be improved.

use super::boundary_repair::repair;
use super::chord_balance::interfaces;
use super::node_surfaces::{HELD, SurfaceSet, only};
use super::partition::Partition;
use super::shaping::Shaping;
use geometry::tetmesh::TetMesh;
use geometry::union_find::unite;
use rayon::prelude::*;

/// The cut mesh, ready to be improved: manifold, without fragments, nodes held by the surfaces of their boundary faces alone; and
/// the volume that was left out.
///
/// `one` says that it is one domain whose components do not hold together by images: fragments are left out then.
pub(crate) fn prepared<'a>(partition: Partition<'a>, one: bool) -> (Shaping<'a>, f64) {
    let mut domain = partition.domains();
    let mut tets: Vec<[u32; 4]> = partition.tets.iter().map(|t| t.nodes).collect();
    let mut dropped = 0.0;
    let mut faces = interfaces(&tets, &domain, &|n| partition.on[n as usize] != 0);
    if one && (components(&tets, partition.nodes.len()) > 1 || pinched(&faces)) {
        let mut mesh = TetMesh { nodes: partition.nodes.clone(), tets, zones: Vec::new() };
        dropped = repair(&mut mesh);
        tets = mesh.tets;
        domain = vec![0; tets.len()];
        faces = interfaces(&tets, &domain, &|_| true);
    }
    let mut on = vec![0; partition.on.len()];
    for (f, ..) in faces {
        let set = f.iter().fold(SurfaceSet::MAX, |s, n| s & partition.on[*n as usize]);
        f.iter().for_each(|n| on[*n as usize] |= if set == 0 { HELD } else { set });
    }
    tie(&partition, &mut on);
    let nodes = (partition.nodes, on, partition.next);
    (Shaping::new(partition.surfaces, nodes, (tets, domain)), dropped)
}

/// Makes images lie on the same surfaces but for the bounding planes, and stay on these.
fn tie(partition: &Partition, on: &mut [SurfaceSet]) {
    let bounding = |s: &usize| partition.surfaces[*s].bounding_plane().is_some();
    let planes = (0..partition.surfaces.len()).filter(bounding).fold(0, |set, s| set | only(s));
    let first = |n: &u32| partition.next[*n as usize] != *n && partition.images(*n).min() == Some(*n);
    for n in (0..on.len() as u32).filter(first) {
        let all = partition.images(n).fold(0, |set, m| set | on[m as usize]) & !planes;
        for m in partition.images(n) {
            on[m as usize] = all | partition.on[m as usize] & planes;
        }
    }
}

/// The number of components that are connected by nodes.
pub(crate) fn components(tets: &[[u32; 4]], nodes: usize) -> usize {
    let mut root: Vec<u32> = (0..nodes as u32).collect();
    let mut used = vec![false; nodes];
    for t in tets {
        t.iter().for_each(|n| used[*n as usize] = true);
        for n in &t[1..] {
            unite(&mut root, t[0], *n);
        }
    }
    (0..nodes as u32).filter(|n| used[*n as usize] && root[*n as usize] == *n).count()
}

/// Whether the boundary touches itself: by Euler's formula for the faces around each node, which are one fan unless a node has more
/// edges than faces, or an edge more than two faces.
fn pinched(faces: &[([u32; 3], u32, bool)]) -> bool {
    // (node, opposite edge) of each face.
    let mut links: Vec<(u32, [u32; 2])> =
        faces.par_iter().flat_map_iter(|([a, b, c], ..)| [(*a, [*b, *c]), (*b, [*a, *c]), (*c, [*a, *b])]).collect();
    links.par_sort_unstable();
    let by_node: Vec<&[(u32, [u32; 2])]> = links.chunk_by(|a, b| a.0 == b.0).collect();
    by_node.par_iter().any(|link| {
        // One closed cycle through the neighbours?
        let mut at = link[0].1[1];
        let mut before = 0;
        for count in 1..=link.len() {
            let next = (0..link.len()).find(|i| *i != before && link[*i].1.contains(&at));
            if at == link[0].1[0] {
                return count != link.len();
            }
            let Some(i) = next else { return true };
            let [p, q] = link[i].1;
            (at, before) = (if p == at { q } else { p }, i);
        }
        true
    })
}
