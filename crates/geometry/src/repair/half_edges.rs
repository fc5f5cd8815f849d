//! The edges of a mesh that may be broken, and its patches.

use rayon::prelude::*;

use crate::mesh::Mesh;
use crate::union_find;

/// Half-edges (the edge's vertices, 3 · triangle + corner where it begins) in the order of their edges.
pub fn halves(mesh: &Mesh) -> Vec<(u64, u32)> {
    let mut halves: Vec<(u64, u32)> = mesh
        .triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(i, t)| {
            let edge = |k: usize| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                let key = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                (key, (3 * i + k) as u32)
            };
            [edge(0), edge(1), edge(2)]
        })
        .collect();
    halves.par_sort_unstable();
    halves
}

/// Whether half-edge `h` runs from its lower to its higher vertex.
pub fn rises(mesh: &Mesh, h: u32) -> bool {
    let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
    t[k] < t[(k + 1) % 3]
}

/// The ends of half-edge `h`.
pub fn ends(mesh: &Mesh, h: u32) -> [u32; 2] {
    let (t, k) = (mesh.triangles[h as usize / 3], h as usize % 3);
    [t[k], t[(k + 1) % 3]]
}

/// Half-edges whose edge has one triangle.
pub fn open(mesh: &Mesh) -> Vec<u32> {
    let halves = halves(mesh);
    let edges = halves.chunk_by(|a, b| a.0 == b.0);
    let mut open: Vec<u32> = edges.filter(|e| e.len() == 1).map(|e| e[0].1).collect();
    open.sort_unstable();
    open
}

/// Components: for each triangle the number of the set that edges (of however many triangles) join, and how many
/// sets there are. Sets are numbered by their first triangles.
pub fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut root = union_find::singles(mesh.triangles.len());
    for pair in halves(mesh).windows(2).filter(|p| p[0].0 == p[1].0) {
        union_find::unite(&mut root, pair[0].1 / 3, pair[1].1 / 3);
    }
    union_find::labels(&mut root)
}
