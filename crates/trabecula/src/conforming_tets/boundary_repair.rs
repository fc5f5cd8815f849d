//! Repair of a non-manifold boundary: tetrahedra are removed where the boundary meets itself in a node or an edge.

use std::collections::HashSet;

use super::node_tets::NodeTets;
use geometry::progress::checkpoint;
use geometry::tetmesh::{FACES, TetMesh, volume};

/// A connected component is a fragment if its volume is less than this fraction of the largest one's,
const FRAGMENT_FRACTION: f64 = 0.01;
/// and it has at most this number of tetrahedra: too few to be a body of its own.
const FRAGMENT_TETS: usize = 100;

/// Removes tetrahedra until no two boundary sheets share a node, and fragments that this or thin walls leave; returns
/// the removed volume (mm³).
pub(crate) fn repair(mesh: &mut TetMesh) -> f64 {
    let mut lost = 0.0;
    loop {
        checkpoint();
        let mut removed = non_manifold(mesh);
        if removed.is_empty() {
            removed = fragments(mesh);
        }
        if removed.is_empty() {
            return lost;
        }
        let mut kept = Vec::with_capacity(mesh.tets.len());
        for (i, t) in (0..).zip(&mesh.tets) {
            if removed.contains(&i) {
                lost += volume(t.map(|n| mesh.nodes[n as usize]));
            } else {
                kept.push(*t);
            }
        }
        mesh.tets = kept;
    }
}

/// The tetrahedra of fragments.
fn fragments(mesh: &TetMesh) -> HashSet<u32> {
    let (count, component) = mesh.pieces();
    let (mut size, mut tets) = (vec![0.0; count], vec![0; count]);
    for (i, p) in component.iter().enumerate() {
        size[*p as usize] += volume(mesh.corners(i));
        tets[*p as usize] += 1;
    }
    let most = size.iter().copied().fold(0.0, f64::max);
    let fragment = |p: u32| size[p as usize] < FRAGMENT_FRACTION * most && tets[p as usize] <= FRAGMENT_TETS;
    let of = component.iter().enumerate().filter(|(_, p)| fragment(**p));
    of.map(|(i, _)| i as u32).collect()
}

/// The tetrahedra to be removed at nodes with more than one boundary sheet.
fn non_manifold(mesh: &TetMesh) -> HashSet<u32> {
    let node_tets = NodeTets::new(mesh.tets.iter().copied(), &vec![true; mesh.nodes.len()]);
    let mut sheets: Vec<Vec<[u32; 2]>> = vec![Vec::new(); mesh.nodes.len()];
    for [a, b, c] in mesh.boundary_faces() {
        for (n, edge) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            sheets[n as usize].push(edge);
        }
    }
    let mut removed = HashSet::new();
    for (n, link) in sheets.iter().enumerate() {
        if link.is_empty() || cycles(link) == 1 {
            continue;
        }
        let groups = groups(mesh, n as u32, node_tets.of(n as u32));
        let size = |of: &Vec<u32>| of.iter().map(|i| volume(mesh.corners(*i as usize))).sum::<f64>();
        if let [_] = groups.as_slice() {
            // The tetrahedra at the node enclose a hole: only removing all of them is certain to repair it.
            removed.extend(groups.iter().flatten());
            continue;
        }
        let most = (0..groups.len()).fold(0, |m, i| if size(&groups[i]) > size(&groups[m]) { i } else { m });
        let rest = groups.iter().enumerate().filter(|(i, _)| *i != most);
        removed.extend(rest.flat_map(|(_, of)| of));
    }
    removed
}

/// Number of cycles of the edges opposite to a node in its boundary faces; more than one if a node occurs twice.
fn cycles(link: &[[u32; 2]]) -> usize {
    let mut left = link.to_vec();
    let mut count = 0;
    while let Some([first, mut end]) = left.pop() {
        count += 1;
        while end != first {
            match left.iter().position(|e| e[0] == end) {
                Some(i) => end = left.swap_remove(i)[1],
                None => return usize::MAX,
            }
        }
    }
    let mut starts: Vec<u32> = link.iter().map(|e| e[0]).collect();
    starts.sort_unstable();
    if starts.windows(2).any(|w| w[0] == w[1]) { usize::MAX } else { count }
}

/// The tetrahedra at a node in groups connected by faces at the node.
fn groups(mesh: &TetMesh, n: u32, tets: &[u32]) -> Vec<Vec<u32>> {
    let faces: Vec<Vec<[u32; 3]>> = tets
        .iter()
        .map(|i| {
            let t = mesh.tets[*i as usize];
            let keys = FACES.iter().map(|f| {
                let mut key = f.map(|c| t[c]);
                key.sort_unstable();
                key
            });
            keys.filter(|k| k.contains(&n)).collect()
        })
        .collect();
    let mut left: Vec<usize> = (0..tets.len()).collect();
    let mut groups = Vec::new();
    while let Some(first) = left.pop() {
        let mut group = vec![first];
        let mut i = 0;
        while i < group.len() {
            let here = &faces[group[i]];
            let (near, far): (Vec<usize>, Vec<usize>) =
                left.iter().partition(|j| faces[**j].iter().any(|f| here.contains(f)));
            group.extend(near);
            left = far;
            i += 1;
        }
        groups.push(group.into_iter().map(|i| tets[i]).collect());
    }
    groups
}
