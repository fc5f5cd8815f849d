//! Tetrahedral meshes: the domain of a lattice that follows the part's own shape.

use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::union_find::{find, unite};

pub mod conformity;
pub mod surface_fit;
pub mod tet_locator;
pub mod tet_quality;

pub use conformity::Checked;
pub use tet_quality::{DihedralAngles, MinMeanMax, SLIVER, TetQuality};

/// A cube as six tetrahedra around a diagonal; bit a of a corner's number says on which side it is along axis a.
pub const CUBE: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// A tetrahedral mesh of a domain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Nodes (mm).
    pub nodes: Vec<Vec3>,
    /// The four nodes of each tetrahedron; (b − a) × (c − a) · (d − a) > 0 in a checked mesh.
    pub tets: Vec<[u32; 4]>,
    /// The zone of each tetrahedron, a number of the mesher's own; empty where there are none.
    pub zones: Vec<i64>,
}

/// The faces of a tetrahedron by corner indices, counter-clockwise seen from outside; face i lies opposite to node i.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The edges of a tetrahedron by corner indices; edge i lies opposite to edge 5 − i.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Volume of a tetrahedron (mm³): (b − a) × (c − a) · (d − a) / 6.
pub fn volume([a, b, c, d]: [Vec3; 4]) -> f64 {
    dot(cross(sub(b, a), sub(c, a)), sub(d, a)) / 6.0
}

/// The area (mm²) where the linear function with these values at the corners of a tetrahedron is zero; 0 where it has one sign.
pub fn cut_area(corners: [Vec3; 4], values: [f64; 4]) -> f64 {
    // Most are on one side.
    if values.iter().all(|v| *v > 0.0) || values.iter().all(|v| *v <= 0.0) {
        return 0.0;
    }
    let (above, below): (Vec<usize>, Vec<usize>) = (0..4).partition(|i| values[*i] > 0.0);
    let cut = |a: usize, b: usize| {
        let at = values[a] / (values[a] - values[b]);
        add(corners[a], scale(sub(corners[b], corners[a]), at))
    };
    let triangle = |a: Vec3, b: Vec3, c: Vec3| 0.5 * norm(cross(sub(b, a), sub(c, a)));
    match (&above[..], &below[..]) {
        ([a], [b, c, d]) | ([b, c, d], [a]) => triangle(cut(*a, *b), cut(*a, *c), cut(*a, *d)),
        ([a, b], [c, d]) => {
            let [p, q, r, s] = [cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)];
            triangle(p, q, r) + triangle(p, r, s)
        }
        _ => 0.0,
    }
}

impl TetMesh {
    /// The corners of tetrahedron `i`.
    #[inline]
    pub fn corners(&self, i: usize) -> [Vec3; 4] {
        self.tets[i].map(|n| self.nodes[n as usize])
    }

    /// Volume (mm³): the sum over the tetrahedra.
    pub fn volume(&self) -> f64 {
        (0..self.tets.len()).map(|i| volume(self.corners(i))).sum()
    }

    /// The faces that only one tetrahedron has, by nodes, counter-clockwise seen from outside; in the order of the
    /// tetrahedra.
    pub fn boundary_faces(&self) -> Vec<[u32; 3]> {
        let mut faces = self.faces();
        faces.sort_unstable();
        let mut single: Vec<u32> =
            faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0].1).collect();
        single.sort_unstable();
        single.into_iter().map(|f| self.face(f)).collect()
    }

    /// The boundary as a closed mesh, vertices in the order of the nodes.
    pub fn boundary(&self) -> Mesh {
        let mut triangles = self.boundary_faces();
        let mut to = vec![u32::MAX; self.nodes.len()];
        triangles.iter().flatten().for_each(|n| to[*n as usize] = 0);
        let mut vertices = Vec::new();
        for (p, to) in self.nodes.iter().zip(&mut to) {
            if *to == 0 {
                *to = vertices.len() as u32;
                vertices.push(*p);
            }
        }
        triangles.iter_mut().flatten().for_each(|n| *n = to[*n as usize]);
        Mesh { vertices, triangles }
    }

    /// Every face of every tetrahedron: its nodes in ascending order, and four times the tetrahedron plus its place.
    fn faces(&self) -> Vec<([u32; 3], u32)> {
        let each = self.tets.iter().enumerate().flat_map(|(i, t)| {
            FACES.iter().enumerate().map(move |(k, f)| {
                let mut key = f.map(|c| t[c]);
                key.sort_unstable();
                (key, (4 * i + k) as u32)
            })
        });
        each.collect()
    }

    /// The nodes of a face that `faces` gave.
    fn face(&self, f: u32) -> [u32; 3] {
        FACES[f as usize % 4].map(|c| self.tets[f as usize / 4][c])
    }

    /// The number of pieces that hold together by faces, and the piece of each tetrahedron, numbered as they come.
    pub fn pieces(&self) -> (usize, Vec<u32>) {
        let mut faces = self.faces();
        faces.sort_unstable();
        let mut root: Vec<u32> = (0..self.tets.len() as u32).collect();
        for same in faces.chunk_by(|a, b| a.0 == b.0) {
            for (_, f) in &same[1..] {
                unite(&mut root, same[0].1 / 4, f / 4);
            }
        }
        let mut number = vec![u32::MAX; self.tets.len()];
        let mut count = 0;
        let piece = (0..self.tets.len() as u32)
            .map(|i| {
                let r = find(&mut root, i) as usize;
                if number[r] == u32::MAX {
                    number[r] = count;
                    count += 1;
                }
                number[r]
            })
            .collect();
        (count as usize, piece)
    }

    /// The mesh without nodes that no tetrahedron uses, the others in their order.
    pub fn compact(mut self) -> TetMesh {
        let mut to = vec![u32::MAX; self.nodes.len()];
        self.tets.iter().flatten().for_each(|n| to[*n as usize] = 0);
        let mut kept = Vec::new();
        for (p, to) in self.nodes.iter().zip(&mut to) {
            if *to == 0 {
                *to = kept.len() as u32;
                kept.push(*p);
            }
        }
        self.nodes = kept;
        self.tets.iter_mut().flatten().for_each(|n| *n = to[*n as usize]);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::size;

    /// Planes that cut one corner and two corners off a tetrahedron: a right triangle and a rectangle.
    #[test]
    fn areas_of_cuts_are_those_of_plane_sections() {
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let of = |f: fn(Vec3) -> f64| cut_area(corners, corners.map(f));
        assert!((of(|p| p[0] - 0.5) - 0.125).abs() < 1e-15);
        assert!((of(|p| p[0] + p[1] - 0.5) - 0.125f64.sqrt()).abs() < 1e-15);
        assert_eq!((of(|_| 1.0), of(|p| -p[0])), (0.0, 0.0));
    }

    /// The unit cube as six tetrahedra around a diagonal.
    pub fn cube() -> TetMesh {
        let corner = |i: usize| core::array::from_fn(|a| (i >> a & 1) as f64);
        TetMesh {
            nodes: (0..8).map(corner).collect(),
            tets: CUBE.map(|t| t.map(|i| i as u32)).to_vec(),
            zones: Vec::new(),
        }
    }

    #[test]
    fn the_boundary_of_a_cube_is_a_cube() {
        let cube = cube();
        assert!((0..6).all(|i| (volume(cube.corners(i)) - 1.0 / 6.0).abs() < 1e-15));
        let boundary = cube.boundary();
        assert_eq!((boundary.vertices.len(), boundary.triangles.len()), (8, 12));
        assert!((boundary.volume() - 1.0).abs() < 1e-15 && (boundary.area() - 6.0).abs() < 1e-15);
        assert_eq!((size(&boundary).closed, size(&boundary).euler), (true, 2));
        assert_eq!(cube.pieces().0, 1);
    }

    #[test]
    fn pieces_hold_together_by_faces() {
        let mut two = cube();
        // Less its third and its last tetrahedron the cube is two pieces that share the diagonal.
        two.tets.remove(5);
        two.tets.remove(2);
        assert_eq!(two.pieces(), (2, vec![0, 0, 1, 1]));
        two.tets.truncate(2);
        let compact = two.compact();
        assert_eq!(compact.nodes.len(), 5);
        assert!((compact.volume() - 1.0 / 3.0).abs() < 1e-15);
    }
}
