//! Voxels as finite elements: hexahedra, each with the share of it that is solid, in one piece.

use super::FeSet;
use super::surface_load::{Load, NodeShare};
use crate::math::{Aabb, Vec3};
use crate::union_find::{find, singles, unite};

/// Hexahedra of a regular grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HexMesh {
    /// Nodes (mm), x fastest.
    pub nodes: Vec<Vec3>,
    /// Nodes of each hexahedron, in the order of VTK, Abaqus and Gmsh: round the lower face, then round the upper one.
    pub hexes: Vec<[u32; 8]>,
    /// The share of each hexahedron that is solid.
    pub fraction: Vec<f64>,
    /// Edges of a hexahedron (mm).
    pub step: Vec3,
    /// Named sets; a face is a hexahedron and a number of `HEX_FACES`.
    pub sets: Vec<FeSet>,
    /// Solid volume that was left out (mm³): voxels with less than the least share, and other pieces.
    pub dropped: f64,
}

/// The faces of a hexahedron, counter-clockwise seen from outside: S1 to S6 of Abaqus.
pub const HEX_FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// Axis and side of each face.
const FACING: [(usize, bool); 6] = [(2, false), (2, true), (1, false), (0, true), (1, true), (0, false)];
/// The corners of a hexahedron.
const CORNERS: [[usize; 3]; 8] =
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];

impl HexMesh {
    /// The voxels of a grid over `bounds`, x fastest, of which a share of at least `least` is solid, where they belong to the piece, by
    /// common faces, with the greatest solid volume. The sets are the faces on each side of the grid, and the rest of the boundary.
    pub fn of(bounds: &Aabb, shape: [usize; 3], fractions: &[f64], least: f64) -> HexMesh {
        let [nx, ny, nz] = shape;
        let step: Vec3 = core::array::from_fn(|a| bounds.size()[a] / shape[a] as f64);
        let cell = step[0] * step[1] * step[2];
        let solid: f64 = fractions.iter().sum();
        let chosen = largest(shape, fractions, least);
        let at = |i: usize| [i % nx, i / nx % ny, i / nx / ny];
        let corner = |[x, y, z]: [usize; 3]| x + (nx + 1) * (y + (ny + 1) * z);
        let mut number = vec![u32::MAX; (nx + 1) * (ny + 1) * (nz + 1)];
        let of: Vec<usize> = (0..fractions.len()).filter(|i| chosen[*i]).collect();
        for i in &of {
            CORNERS.iter().for_each(|c| number[corner(core::array::from_fn(|a| at(*i)[a] + c[a]))] = 0);
        }
        let mut nodes = Vec::new();
        for (i, n) in number.iter_mut().enumerate().filter(|(_, n)| **n == 0) {
            *n = nodes.len() as u32;
            let place = [i % (nx + 1), i / (nx + 1) % (ny + 1), i / (nx + 1) / (ny + 1)];
            // The last plane is exactly that of the bounds.
            let along = |a: usize| match place[a] {
                p if p == shape[a] => bounds.max[a],
                p => bounds.min[a] + step[a] * p as f64,
            };
            nodes.push([along(0), along(1), along(2)]);
        }
        let nodes_of = |i: usize| CORNERS.map(|c| number[corner(core::array::from_fn(|a| at(i)[a] + c[a]))]);
        let mut mesh = HexMesh {
            nodes,
            hexes: of.iter().map(|i| nodes_of(*i)).collect(),
            fraction: of.iter().map(|i| fractions[*i]).collect(),
            step,
            ..HexMesh::default()
        };
        mesh.dropped = cell * (solid - mesh.fraction.iter().sum::<f64>());
        let mut sides = vec![Vec::new(); 7];
        for (h, i) in of.iter().enumerate() {
            for (k, (axis, upper)) in FACING.into_iter().enumerate() {
                let place = at(*i)[axis];
                let stride = [1, nx, nx * ny][axis];
                if place == if upper { shape[axis] - 1 } else { 0 } {
                    sides[2 * axis + usize::from(upper)].push((h as u32, k as u8));
                } else if !chosen[if upper { i + stride } else { i - stride }] {
                    sides[6].push((h as u32, k as u8));
                }
            }
        }
        for (name, faces) in ["X0", "X1", "Y0", "Y1", "Z0", "Z1", "SURFACE"].into_iter().zip(sides) {
            mesh.add_set(name.into(), faces);
        }
        mesh
    }

    /// Adds a set of faces with their nodes and hexahedra, unless it is empty.
    pub fn add_set(&mut self, name: String, faces: Vec<(u32, u8)>) {
        if faces.is_empty() {
            return;
        }
        let mut elements: Vec<u32> = faces.iter().map(|f| f.0).collect();
        elements.dedup();
        let mut nodes: Vec<u32> = faces.iter().flat_map(|f| self.face(*f)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        self.sets.push(FeSet { name, nodes, elements, faces, bulk: false });
    }

    /// The nodes of a face, counter-clockwise seen from outside.
    pub fn face(&self, (h, k): (u32, u8)) -> [u32; 4] {
        HEX_FACES[k as usize].map(|c| self.hexes[h as usize][c])
    }

    /// All faces at the boundary, ascending.
    pub fn boundary(&self) -> Vec<(u32, u8)> {
        let planes = ["X0", "X1", "Y0", "Y1", "Z0", "Z1", "SURFACE"];
        let own = self.sets.iter().filter(|s| planes.contains(&s.name.as_str()));
        let mut faces: Vec<(u32, u8)> = own.flat_map(|s| s.faces.iter().copied()).collect();
        faces.sort_unstable();
        faces
    }

    /// The centre of a face (mm).
    pub fn middle(&self, face: (u32, u8)) -> Vec3 {
        let p = self.face(face).map(|n| self.nodes[n as usize]);
        core::array::from_fn(|a| 0.25 * p.iter().map(|p| p[a]).sum::<f64>())
    }

    /// Solid volume (mm³): of each hexahedron its solid share.
    pub fn volume(&self) -> f64 {
        self.step[0] * self.step[1] * self.step[2] * self.fraction.iter().sum::<f64>()
    }

    /// A set by its name.
    pub fn set(&self, name: &str) -> Option<&FeSet> {
        self.sets.iter().find(|s| s.name == name)
    }

    /// The work-equivalent forces at the nodes of a set's faces, ascending by node.
    pub fn nodal_forces(&self, set: &FeSet, load: Load) -> Vec<(u32, Vec3)> {
        let shares = |f: &(u32, u8)| {
            let (axis, upper) = FACING[f.1 as usize];
            let area = self.step[(axis + 1) % 3] * self.step[(axis + 2) % 3] / 4.0;
            let mut normal = [0.0; 3];
            normal[axis] = if upper { area } else { -area };
            self.face(*f).map(|node| NodeShare { node, area, normal })
        };
        load.at_nodes(set.faces.iter().flat_map(shares).collect())
    }
}

/// Which voxels have at least a share and belong to the piece of the greatest solid volume.
fn largest(shape: [usize; 3], fractions: &[f64], least: f64) -> Vec<bool> {
    let [nx, ny, _] = shape;
    let has = |i: usize| fractions[i] >= least && fractions[i] > 0.0;
    let mut root = singles(fractions.len());
    for i in (0..fractions.len()).filter(|i| has(*i)) {
        let place = [i % nx, i / nx % ny, i / nx / ny];
        for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
            if place[axis] > 0 && has(i - stride) {
                unite(&mut root, i as u32, (i - stride) as u32);
            }
        }
    }
    let mut volume = vec![0.0; fractions.len()];
    let of: Vec<u32> = (0..fractions.len()).map(|i| find(&mut root, i as u32)).collect();
    (0..fractions.len()).filter(|i| has(*i)).for_each(|i| volume[of[i] as usize] += fractions[i]);
    // Of equal ones the first.
    let best = (0..volume.len()).fold(0, |b, i| if volume[i] > volume[b] { i } else { b });
    (0..fractions.len()).map(|i| has(i) && of[i] as usize == best).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_piece_is_kept_with_its_faces_in_sets() {
        // An L of three voxels, a diagonal neighbour, and one below the least share.
        let mut fractions = [0.0; 12];
        (fractions[0], fractions[1], fractions[3], fractions[8], fractions[2]) = (1.0, 0.5, 0.25, 1.0, 0.01);
        let bounds = Aabb { min: [0.0; 3], max: [3.0, 4.0, 1.0] };
        let mesh = HexMesh::of(&bounds, [3, 2, 2], &fractions, 0.1);
        assert_eq!((mesh.hexes.len(), mesh.nodes.len()), (3, 16));
        // Voxels are 1 × 2 × 0.5 mm.
        assert!((mesh.volume() - 1.75).abs() < 1e-15 && (mesh.dropped - 1.01).abs() < 1e-15);
        let count = |name: &str| mesh.set(name).map_or(0, |s| s.faces.len());
        assert_eq!(["X0", "X1", "Y0", "Y1", "Z0", "Z1", "SURFACE"].map(count), [2, 0, 2, 1, 3, 0, 6]);
        for f in mesh.boundary() {
            let p = mesh.face(f).map(|n| mesh.nodes[n as usize]);
            let normal = crate::math::cross(crate::math::sub(p[1], p[0]), crate::math::sub(p[2], p[1]));
            let h = mesh.hexes[f.0 as usize].map(|n| mesh.nodes[n as usize]);
            let centre: Vec3 = core::array::from_fn(|a| 0.5 * (h[0][a] + h[6][a]));
            let out = crate::math::sub(mesh.middle(f), centre);
            assert!(crate::math::dot(normal, out) > 0.0);
        }
    }

    #[test]
    fn forces_have_the_resultant() {
        let mesh = HexMesh::of(&Aabb { min: [0.0; 3], max: [2.0, 2.0, 1.0] }, [2, 2, 1], &[1.0; 4], 0.5);
        let forces = mesh.set("X1").map(|s| mesh.nodal_forces(s, Load::Traction([8.0, 0.0, -8.0]))).unwrap_or_default();
        // Two faces in a column: their common nodes carry twice the others' share.
        let mut along: Vec<f64> = forces.iter().map(|f| f.1[0]).collect();
        along.sort_by(f64::total_cmp);
        assert_eq!(along, [1.0, 1.0, 1.0, 1.0, 2.0, 2.0]);
        // A pressure of 3 MPa on 2 × 1 mm, inwards.
        let forces = mesh.set("X1").map(|s| mesh.nodal_forces(s, Load::Pressure(3.0))).unwrap_or_default();
        assert!((forces.iter().map(|f| f.1[0]).sum::<f64>() + 6.0).abs() < 1e-14);
    }
}
