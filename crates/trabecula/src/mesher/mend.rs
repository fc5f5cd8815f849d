//! Where the boundary meets itself in a node or an edge: taken away, as a surface is wanted that is one sheet everywhere.

use std::collections::HashSet;

use super::work::Around;
use geometry::tetmesh::{FACES, TetMesh, volume};

/// A piece is a crumb if it has less than this share of the largest one's volume,
const CRUMB: f64 = 0.01;
/// and at most so many tetrahedra: too few to show a body of its own.
const FEW: usize = 100;

/// Takes tetrahedra away until no two sheets of the boundary share a node, and crumbs that this or thin places leave; gives
/// their volume (mm³).
pub(super) fn mend(mesh: &mut TetMesh) -> f64 {
    let mut lost = 0.0;
    loop {
        let mut away = pinches(mesh);
        if away.is_empty() {
            away = crumbs(mesh);
        }
        if away.is_empty() {
            return lost;
        }
        let mut kept = Vec::with_capacity(mesh.tets.len());
        for (i, t) in (0..).zip(&mesh.tets) {
            if away.contains(&i) {
                lost += volume(t.map(|n| mesh.nodes[n as usize]));
            } else {
                kept.push(*t);
            }
        }
        mesh.tets = kept;
    }
}

/// The tetrahedra of pieces that are crumbs.
fn crumbs(mesh: &TetMesh) -> HashSet<u32> {
    let (count, piece) = mesh.pieces();
    let (mut size, mut tets) = (vec![0.0; count], vec![0; count]);
    for (i, p) in piece.iter().enumerate() {
        size[*p as usize] += volume(mesh.corners(i));
        tets[*p as usize] += 1;
    }
    let most = size.iter().copied().fold(0.0, f64::max);
    let crumb = |p: u32| size[p as usize] < CRUMB * most && tets[p as usize] <= FEW;
    let of = piece.iter().enumerate().filter(|(_, p)| crumb(**p));
    of.map(|(i, _)| i as u32).collect()
}

/// The tetrahedra to be taken away at nodes with more than one sheet.
fn pinches(mesh: &TetMesh) -> HashSet<u32> {
    let around = Around::new(mesh);
    let mut sheets: Vec<Vec<[u32; 2]>> = vec![Vec::new(); mesh.nodes.len()];
    for [a, b, c] in mesh.boundary_faces() {
        for (n, edge) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            sheets[n as usize].push(edge);
        }
    }
    let mut away = HashSet::new();
    for (n, link) in sheets.iter().enumerate() {
        if link.is_empty() || cycles(link) == 1 {
            continue;
        }
        let groups = groups(mesh, n as u32, around.of(n));
        let size = |of: &Vec<u32>| of.iter().map(|i| volume(mesh.corners(*i as usize))).sum::<f64>();
        if let [_] = groups.as_slice() {
            // A hole through the tetrahedra at the node: nothing short of all of them mends it for sure.
            away.extend(groups.iter().flatten());
            continue;
        }
        let most = (0..groups.len()).fold(0, |m, i| if size(&groups[i]) > size(&groups[m]) { i } else { m });
        let rest = groups.iter().enumerate().filter(|(i, _)| *i != most);
        away.extend(rest.flat_map(|(_, of)| of));
    }
    away
}

/// Cycles of the edges opposite to a node in its boundary faces; more than one if a node of them is met twice.
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

/// The tetrahedra at a node in groups that hang together by faces at the node.
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
