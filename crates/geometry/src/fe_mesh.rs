//! Meshes for finite elements: linear or quadratic tetrahedra in domains, named sets, periodic pairs.

use rayon::prelude::*;

use crate::math::{Mat3, Vec3, add, determinant, scale, sub};
use crate::tetmesh::{EDGES, FACES, TetMesh, tet_quality::dihedral_cosines};

mod beam_mesh;
mod fraction_classes;
mod hex_mesh;
mod poly_faces;
mod shell_mesh;
mod surface_load;

pub use beam_mesh::{BeamMesh, BeamSection};
pub use fraction_classes::fraction_classes;
pub use hex_mesh::{HEX_FACES, HexMesh};
pub use poly_faces::{BoundaryPatch, PolyFaces};
pub use shell_mesh::ShellMesh;
pub use surface_load::Load;

/// A mesh for finite elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeMesh {
    /// Nodes (mm): corners first, then the nodes of edges.
    pub nodes: Vec<Vec3>,
    /// The corners of each tetrahedron, (b − a) × (c − a) · (d − a) > 0.
    pub tets: Vec<[u32; 4]>,
    /// The nodes on the edges of each tetrahedron, in the order of `EDGES`; empty for linear ones.
    pub middles: Vec<[u32; 6]>,
    /// The domain of each tetrahedron, ascending.
    pub domain: Vec<u8>,
    /// Names of the domains.
    pub domains: Vec<String>,
    /// The solid fraction of each tetrahedron where it is of a lattice; empty where tetrahedra are solid or pore.
    pub fraction: Vec<f64>,
    /// The axes of each tetrahedron's material, one row each, where it has some; empty where it has none.
    pub axes: Vec<Mat3>,
    /// Named sets.
    pub sets: Vec<FeSet>,
    /// Nodes on upper bounding planes of a periodic cell, each with its image on the lower ones.
    pub pairs: Vec<Pair>,
    /// Edges of a periodic cell (mm); zero if it is none.
    pub period: Vec3,
}

/// A named set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FeSet {
    /// Its name.
    pub name: String,
    /// Nodes, ascending.
    pub nodes: Vec<u32>,
    /// Tetrahedra, ascending.
    pub elements: Vec<u32>,
    /// Faces: tetrahedron, and the number of the corner opposite to it; ascending.
    pub faces: Vec<(u32, u8)>,
    /// Whether it is a part of the solid, such as a skin, with all its nodes and elements; else a surface, with those of its faces.
    pub bulk: bool,
}

/// Numbers at nodes or in elements.
#[derive(Clone, Debug, Default)]
pub struct FeField {
    /// Its name.
    pub name: String,
    /// Numbers for each node or element.
    pub components: usize,
    /// Whether it is at nodes.
    pub at_nodes: bool,
    /// The numbers, those of a node or element together.
    pub values: Vec<f64>,
}

/// A node of a periodic cell and its image on lower bounding planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The node.
    pub node: u32,
    /// Its image.
    pub image: u32,
    /// By which periods they differ.
    pub along: [bool; 3],
}

/// Dihedral angles, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Angles {
    /// The least of all.
    pub min: f64,
    /// The greatest of all.
    pub max: f64,
    /// 1 % of the tetrahedra have a smaller least angle.
    pub min_p01: f64,
    /// Half of them have.
    pub min_p50: f64,
    /// Half of the tetrahedra have a greater greatest angle.
    pub max_p50: f64,
    /// 1 % of them have.
    pub max_p99: f64,
    /// The middle of the tetrahedron with the angle nearest to 0 or 180 (mm).
    pub worst_at: Vec3,
}

/// The order of the edges' nodes in Abaqus, CalculiX, Nastran and VTK, by indices of `EDGES`.
pub const MIDDLES: [usize; 6] = [0, 3, 1, 2, 4, 5];

impl FeMesh {
    /// The straight tetrahedra between the corners.
    pub fn corners(&self) -> TetMesh {
        TetMesh { nodes: self.nodes.clone(), tets: self.tets.clone(), zones: Vec::new() }.compact()
    }

    /// Volume (mm³): ∫ det J over the elements, exact.
    pub fn volume(&self) -> f64 {
        (0..self.tets.len()).map(|i| self.element_volume(i)).sum()
    }

    /// Volume of an element (mm³): ∫ det J, exact.
    pub fn element_volume(&self, i: usize) -> f64 {
        if self.middles.is_empty() {
            return crate::tetmesh::volume(self.tets[i].map(|n| self.nodes[n as usize]));
        }
        // Degree three: Keast 1986, in barycentric coordinates.
        const INNER: f64 = 1.0 / 6.0;
        let at = |c: usize| core::array::from_fn(|k| if k == c { 0.5 } else { INNER });
        let four: f64 = (0..4).map(|c| self.jacobian(i, at(c))).sum();
        (-0.8 * self.jacobian(i, [0.25; 4]) + 0.45 * four) / 6.0
    }

    /// The dihedral angles between the planes of corners; `None` without tetrahedra.
    pub fn angles(&self) -> Option<Angles> {
        let degrees = |c: f64| c.clamp(-1.0, 1.0).acos().to_degrees();
        let both = |t: &[u32; 4]| {
            let all = dihedral_cosines(t.map(|n| self.nodes[n as usize]));
            let (lo, hi) = all.iter().fold((1.0f64, -1.0f64), |(lo, hi), c| (lo.min(*c), hi.max(*c)));
            (degrees(hi), degrees(lo))
        };
        let (mut least, mut most): (Vec<f64>, Vec<f64>) = self.tets.par_iter().map(both).unzip();
        let off = |i: &usize| least[*i].min(180.0 - most[*i]);
        let worst = (0..least.len()).min_by(|i, j| off(i).total_cmp(&off(j)))?;
        least.par_sort_unstable_by(f64::total_cmp);
        most.par_sort_unstable_by(f64::total_cmp);
        let at = |of: &[f64], share: f64| of[((of.len() - 1) as f64 * share).round() as usize];
        let corners = self.tets[worst].map(|n| self.nodes[n as usize]);
        Some(Angles {
            min: least[0],
            max: most[most.len() - 1],
            min_p01: at(&least, 0.01),
            min_p50: at(&least, 0.5),
            max_p50: at(&most, 0.5),
            max_p99: at(&most, 0.99),
            worst_at: scale(corners.into_iter().fold([0.0; 3], add), 0.25),
        })
    }

    /// The ten nodes of a quadratic tetrahedron: corners, edges in the order of `EDGES`.
    pub fn quadratic(&self, i: usize) -> [Vec3; 10] {
        core::array::from_fn(|k| self.nodes[if k < 4 { self.tets[i][k] } else { self.middles[i][k - 4] } as usize])
    }

    /// det J of a quadratic tetrahedron (six times its volume if it is straight) at barycentric coordinates.
    pub fn jacobian(&self, i: usize, at: [f64; 4]) -> f64 {
        jacobian(&self.quadratic(i), at)
    }

    /// A set by its name.
    pub fn set(&self, name: &str) -> Option<&FeSet> {
        self.sets.iter().find(|s| s.name == name)
    }

    /// The corners of a face, counter-clockwise seen from outside.
    pub fn face(&self, (t, k): (u32, u8)) -> [u32; 3] {
        FACES[k as usize].map(|c| self.tets[t as usize][c])
    }

    /// The nodes on the edges of a face, each after its corner; none in linear meshes.
    pub fn face_middles(&self, (t, k): (u32, u8)) -> Option<[u32; 3]> {
        let middles = self.middles.get(t as usize)?;
        let [a, b, c] = FACES[k as usize];
        let of = |a: usize, b: usize| EDGES.iter().position(|e| *e == [a.min(b), a.max(b)]).unwrap_or(0);
        Some([of(a, b), of(b, c), of(c, a)].map(|e| middles[e]))
    }
}

/// det J of a quadratic tetrahedron at barycentric coordinates.
pub fn jacobian(p: &[Vec3; 10], at: [f64; 4]) -> f64 {
    // ∂N/∂L of each corner function: 4 L − 1; of each edge function: 4 L of the other end.
    let slope = |corner: usize| -> Vec3 {
        let mut d: Vec3 = core::array::from_fn(|k| (4.0 * at[corner] - 1.0) * p[corner][k]);
        for (e, [a, b]) in EDGES.iter().enumerate() {
            if let Some(other) = [(a, b), (b, a)].iter().find(|(x, _)| **x == corner).map(|(_, y)| **y) {
                (0..3).for_each(|k| d[k] += 4.0 * at[other] * p[4 + e][k]);
            }
        }
        d
    };
    let first = slope(0);
    let m: Mat3 = [1, 2, 3].map(|c| sub(slope(c), first));
    determinant(&m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_jacobian_of_a_straight_tetrahedron_is_constant() {
        let corners = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.5, 0.0, 1.0]];
        let middle = |[a, b]: [usize; 2]| core::array::from_fn(|k| 0.5 * (corners[a][k] + corners[b][k]));
        let nodes: Vec<Vec3> = corners.into_iter().chain(EDGES.map(middle)).collect();
        let mesh = FeMesh {
            nodes,
            tets: vec![[0, 1, 2, 3]],
            middles: vec![[4, 5, 6, 7, 8, 9]],
            domain: vec![0],
            ..FeMesh::default()
        };
        for at in [[0.25; 4], [1.0, 0.0, 0.0, 0.0], [0.1, 0.2, 0.3, 0.4]] {
            assert!((mesh.jacobian(0, at) - 6.0).abs() < 1e-14);
        }
        assert!((mesh.volume() - 1.0).abs() < 1e-15);
        let mut curved = mesh.clone();
        // Moving the node of an edge changes the volume as a linear function: ∫ of its basis function, −1/20 + 4/20 … on each face.
        curved.nodes[7][2] -= 0.1;
        let more = curved.volume() - 1.0;
        curved.nodes[7][2] -= 0.1;
        assert!((curved.volume() - 1.0 - 2.0 * more).abs() < 1e-14 && more != 0.0 || more.abs() < 1e-15);
        assert_eq!(mesh.face_middles((0, 3)), Some([5, 7, 4]));
    }
}
