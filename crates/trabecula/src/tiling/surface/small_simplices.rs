//! The small simplices of a tetrahedron cut into n steps, listed once.

use crate::cell::tet::Subdivision;
use geometry::tetmesh::{EDGES, FACES};

/// A small tetrahedron: its nodes, its six edges (01, 02, 03, 12, 13, 23), and whether it is in positive order.
pub(super) struct Small {
    pub nodes: [u32; 4],
    pub edges: [u32; 6],
    pub even: bool,
}

/// A small triangle of a face, counter-clockwise seen from outside a positive tetrahedron: nodes, and the edges from each to
/// the next.
pub(super) struct Tile {
    pub nodes: [u32; 3],
    pub edges: [u32; 3],
}

/// All small simplices.
pub(super) struct Template {
    /// Coordinates that are zero at each node, a bit for each.
    pub zero: Vec<u8>,
    /// The edges by their nodes, the lower first, in ascending order: those of a face or an edge of the tetrahedron come in
    /// the same order in every tetrahedron that has it.
    pub edges: Vec<[u32; 2]>,
    pub tets: Vec<Small>,
    /// For each coordinate, the tiles of the face where it is zero.
    pub faces: [Vec<Tile>; 4],
}

/// The edge between two corners.
pub(super) fn pair(a: usize, b: usize) -> usize {
    match (a.min(b), a.max(b)) {
        (0, b) => b - 1,
        (1, b) => b + 1,
        _ => 5,
    }
}

impl Template {
    pub fn new(grid: Subdivision) -> Template {
        let zero: Vec<u8> = grid.whole().iter().map(|k| (0..4).fold(0, |m, i| m | u8::from(k[i] == 0) << i)).collect();
        let mut raw = Vec::new();
        grid.each_tet(|at, even| {
            raw.push((at.map(|[i, j, k]| Subdivision::index(i, j, k) as u32), even));
        });
        let mut edges: Vec<[u32; 2]> = raw.iter().flat_map(|(n, _)| EDGES.map(|[a, b]| [n[a], n[b]])).collect();
        edges.sort_unstable();
        edges.dedup();
        let edge = |a: u32, b: u32| edges.partition_point(|e| *e < [a.min(b), a.max(b)]) as u32;
        let mut faces: [Vec<Tile>; 4] = Default::default();
        let mut tets = Vec::with_capacity(raw.len());
        for (nodes, even) in raw {
            for f in FACES {
                let mut of = f.map(|i| nodes[i]);
                let on = of.iter().fold(15, |m, n| m & zero[*n as usize]);
                if on == 0 {
                    continue;
                }
                if !even {
                    of.swap(1, 2);
                }
                faces[on.trailing_zeros() as usize]
                    .push(Tile { nodes: of, edges: [0, 1, 2].map(|i| edge(of[i], of[(i + 1) % 3])) });
            }
            tets.push(Small { nodes, edges: EDGES.map(|[a, b]| edge(nodes[a], nodes[b])), even });
        }
        Template { zero, edges, tets, faces }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_simplices_make_up_the_tetrahedron() {
        for n in [1, 2, 5] {
            let t = Template::new(Subdivision { n });
            assert_eq!(t.tets.len(), n * n * n);
            assert!(t.faces.iter().all(|f| f.len() == n * n));
            // V − E + F − T = 1; 4 T = 2 F − (faces outside).
            let faces = (4 * t.tets.len() + 4 * n * n) / 2;
            let euler = t.zero.len() + faces - t.edges.len() - t.tets.len();
            assert_eq!(euler, 1);
        }
    }
}
