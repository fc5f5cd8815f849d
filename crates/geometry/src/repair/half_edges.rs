//! The edges of a mesh that may be broken, and its patches.

use rayon::prelude::*;

use crate::mesh::Mesh;

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

/// Sets that are joined pair by pair; the root of a set is its lowest member.
pub struct Sets(Vec<u32>);

impl Sets {
    /// So many sets of one.
    pub fn new(count: usize) -> Sets {
        Sets((0..count as u32).collect())
    }

    /// The root of the set of `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        let r = &mut self.0;
        while r[i as usize] != i {
            r[i as usize] = r[r[i as usize] as usize];
            i = r[i as usize];
        }
        i
    }

    /// Makes the sets of `a` and `b` one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// The number of each member's set, in the order of their lowest members, and how many sets there are.
    pub fn numbers(&mut self) -> (Vec<u32>, usize) {
        let mut number = vec![u32::MAX; self.0.len()];
        let mut count = 0;
        for i in 0..number.len() {
            let r = self.root(i as u32) as usize;
            if r == i {
                number[i] = count;
                count += 1;
            } else {
                number[i] = number[r];
            }
        }
        (number, count as usize)
    }
}

/// Components: for each triangle the number of the set that edges (of however many triangles) join, and how many
/// sets there are. Sets are numbered by their first triangles.
pub fn components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut sets = Sets::new(mesh.triangles.len());
    for pair in halves(mesh).windows(2).filter(|p| p[0].0 == p[1].0) {
        sets.join(pair[0].1 / 3, pair[1].1 / 3);
    }
    sets.numbers()
}
