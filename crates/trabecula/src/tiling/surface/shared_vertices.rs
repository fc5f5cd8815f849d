//! Vertices that tetrahedra share, by the simplices of the mesh in which they lie.

use std::collections::HashMap;

use super::tet_surface::TetSurface;
use crate::map::tet_map::NONE;
use crate::surface_maker::next_vertex;
use geometry::math::Vec3;
use geometry::progress::Stopped;

/// The number of the first shared vertex on each simplex of the tetrahedral mesh. Vertices on a simplex have the same order in
/// every tetrahedron.
#[derive(Default)]
pub(super) struct SharedVertices {
    faces: HashMap<[u32; 3], u32>,
    /// Corners on edges, and nodes of caps, which only tetrahedra with a boundary face have.
    edges: [HashMap<[u32; 2], u32>; 2],
    nodes: HashMap<u32, u32>,
}

impl SharedVertices {
    /// The number of each vertex of a surface; new vertices are added to `new`, which begins at number `base`.
    pub fn numbers(
        &mut self,
        ids: [u32; 4],
        surface: &TetSurface,
        places: &[Vec3],
        base: usize,
        vertices: &mut Vec<Vec3>,
    ) -> Result<Vec<u32>, Stopped> {
        next_vertex(base + vertices.len() + places.len())?;
        let mut counts = [[0u32; 16]; 2];
        for (v, zero) in surface.zero.iter().enumerate() {
            counts[usize::from(v >= surface.crossings)][usize::from(*zero)] += 1;
        }
        // For every simplex, where its vertices begin and whether they are new.
        let mut next = [[(0, false); 16]; 2];
        for (node, (counts, next)) in counts.iter().zip(&mut next).enumerate() {
            for zero in (0..16).filter(|z| counts[*z] > 0) {
                let new = (base + vertices.len()) as u32;
                let mut on = (0..4).filter(|i| zero >> i & 1 == 0).map(|i| ids[i]);
                let mut corner = || on.next().unwrap_or(NONE);
                let first = match (zero as u32).count_ones() {
                    3 => *self.nodes.entry(corner()).or_insert(new),
                    2 => *self.edges[node].entry([corner(), corner()]).or_insert(new),
                    // A node of a cap inside a face is nobody else's; a face is looked up once more at most.
                    1 if node == 0 => {
                        let face = [corner(), corner(), corner()];
                        let known = self.faces.remove(&face);
                        known.unwrap_or_else(|| *self.faces.entry(face).or_insert(new))
                    }
                    _ => new,
                };
                if first == new {
                    vertices.resize(vertices.len() + counts[zero] as usize, [0.0; 3]);
                }
                next[zero] = (first, first == new);
            }
        }
        let name = |(v, (position, zero)): (usize, (&Vec3, &u8))| {
            let next = &mut next[usize::from(v >= surface.crossings)][usize::from(*zero)];
            let name = next.0;
            if next.1 {
                vertices[name as usize - base] = *position;
            }
            next.0 += 1;
            name
        };
        let all = places.iter().zip(&surface.zero).enumerate();
        Ok(all.map(name).collect())
    }
}
