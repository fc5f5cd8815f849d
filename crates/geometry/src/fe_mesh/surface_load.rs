//! Forces at nodes that stand for a load on the faces of a set.

use super::{FeMesh, FeSet};
use crate::math::{Vec3, add, cross, norm, scale, sub};

/// Barycentric coordinates and weights on a triangle, exact to degree five: J. Radon, Monatshefte für Mathematik 52, 1948.
const POINTS: [(f64, f64, f64); 7] = {
    const NEAR: (f64, f64) = (0.470_142_064_105_115_1, 0.132_394_152_788_506_2);
    const FAR: (f64, f64) = (0.101_286_507_323_456_3, 0.125_939_180_544_827_15);
    const N: f64 = 1.0 - 2.0 * NEAR.0;
    const F: f64 = 1.0 - 2.0 * FAR.0;
    [
        (1.0 / 3.0, 1.0 / 3.0, 0.225),
        (NEAR.0, NEAR.0, NEAR.1),
        (N, NEAR.0, NEAR.1),
        (NEAR.0, N, NEAR.1),
        (FAR.0, FAR.0, FAR.1),
        (F, FAR.0, FAR.1),
        (FAR.0, F, FAR.1),
    ]
};

/// A load on the faces of a set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Load {
    /// A uniform traction with this resultant, N.
    Traction(Vec3),
    /// A pressure, MPa: it pushes against the faces, and pulls at them if it is negative.
    Pressure(f64),
}

/// What of a face is a node's, with its shape function N and the outer normal n; of an edge or an end likewise.
#[derive(Clone, Copy, Default)]
pub(super) struct NodeShare {
    pub node: u32,
    /// ∫ N dA.
    pub area: f64,
    /// ∫ N n dA; zero of what has no normal, edges and ends.
    pub normal: Vec3,
}

impl NodeShare {
    /// Of what has no normal.
    pub(super) fn bare((node, area): (u32, f64)) -> NodeShare {
        NodeShare { node, area, normal: [0.0; 3] }
    }
}

impl Load {
    /// The forces at nodes, ascending, by their shares of all faces.
    pub(super) fn at_nodes(self, mut shares: Vec<NodeShare>) -> Vec<(u32, Vec3)> {
        // Stable, so that sums have the same bits.
        shares.sort_by_key(|s| s.node);
        let whole: f64 = shares.iter().map(|s| s.area).sum();
        let at = |of: &[NodeShare]| {
            let force = match self {
                Load::Traction(force) => force.map(|f| f * of.iter().map(|s| s.area).sum::<f64>() / whole),
                Load::Pressure(p) => scale(of.iter().fold([0.0; 3], |sum, s| add(sum, s.normal)), -p),
            };
            (of[0].node, force)
        };
        shares.chunk_by(|a, b| a.node == b.node).map(at).collect()
    }
}

impl FeMesh {
    /// The work-equivalent forces at the nodes of a set's faces, ascending by node: force · ∫ Nᵢ dA / ∫ dA of a traction, −p ∫ Nᵢ n dA of a
    /// pressure, with the shape functions Nᵢ of the faces. Those of flat quadratic faces are at the middles of edges alone.
    pub fn nodal_forces(&self, set: &FeSet, load: Load) -> Vec<(u32, Vec3)> {
        let mut shares = Vec::with_capacity(6 * set.faces.len());
        for face in &set.faces {
            let [a, b, c] = self.face(*face);
            match self.face_middles(*face) {
                Some([d, e, f]) => shares.extend(self.quadratic_shares([a, b, c, d, e, f])),
                None => {
                    let [p, q, r] = [a, b, c].map(|n| self.nodes[n as usize]);
                    let normal = scale(cross(sub(q, p), sub(r, p)), 1.0 / 6.0);
                    shares.extend([a, b, c].map(|node| NodeShare { node, area: norm(normal), normal }));
                }
            }
        }
        load.at_nodes(shares)
    }

    /// The shares of the nodes of a quadratic face: corners a b c, then the middles of ab, bc, ca.
    fn quadratic_shares(&self, nodes: [u32; 6]) -> [NodeShare; 6] {
        let mut shares = nodes.map(|node| NodeShare { node, ..NodeShare::default() });
        for (u, v, weight) in POINTS {
            let w = 1.0 - u - v;
            let shape =
                [w * (2.0 * w - 1.0), u * (2.0 * u - 1.0), v * (2.0 * v - 1.0), 4.0 * w * u, 4.0 * u * v, 4.0 * v * w];
            let along_u = [1.0 - 4.0 * w, 4.0 * u - 1.0, 0.0, 4.0 * (w - u), 4.0 * v, -4.0 * v];
            let along_v = [1.0 - 4.0 * w, 0.0, 4.0 * v - 1.0, -4.0 * u, 4.0 * u, 4.0 * (w - v)];
            let sum = |of: [f64; 6]| -> Vec3 {
                core::array::from_fn(|k| (0..6).map(|i| of[i] * self.nodes[nodes[i] as usize][k]).sum())
            };
            let element = scale(cross(sum(along_u), sum(along_v)), 0.5 * weight);
            for (s, n) in shares.iter_mut().zip(shape) {
                s.area += n * norm(element);
                s.normal = add(s.normal, scale(element, n));
            }
        }
        shares
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::tetmesh::EDGES;

    /// A tetrahedron whose face z = 0 is loaded; the middle of its edge along x is `lift` lower.
    fn one(order: u8, lift: f64) -> FeMesh {
        let mut nodes = vec![[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
        let mut middles = Vec::new();
        if order == 2 {
            for [a, b] in EDGES {
                nodes.push(core::array::from_fn(|k| 0.5 * (nodes[a][k] + nodes[b][k])));
            }
            nodes[4][2] -= lift;
            middles.push([4, 5, 6, 7, 8, 9]);
        }
        let set = FeSet { name: "S".into(), faces: vec![(0, 3)], ..FeSet::default() };
        FeMesh { nodes, tets: vec![[0, 1, 2, 3]], middles, domain: vec![0], sets: vec![set], ..FeMesh::default() }
    }

    #[test]
    fn flat_faces_have_thirds_and_all_have_the_resultant() {
        let force = [0.0, -6.0, 3.0];
        let linear = one(1, 0.0).nodal_forces(&one(1, 0.0).sets[0], Load::Traction(force));
        assert!(linear.iter().all(|(_, f)| (f[1] + 2.0).abs() < 1e-14) && linear.len() == 3);
        for lift in [0.0, 0.3] {
            let mesh = one(2, lift);
            let quadratic = mesh.nodal_forces(&mesh.sets[0], Load::Traction(force));
            let total: f64 = quadratic.iter().map(|(_, f)| f[1]).sum();
            assert!((total + 6.0).abs() < 1e-13 && quadratic.len() == 6);
            let corner = quadratic.iter().find(|(n, _)| *n == 0).unwrap().1[1];
            // A curved face is no longer in thirds.
            assert_eq!(corner.abs() < 1e-14, lift == 0.0, "{corner}");
        }
    }

    #[test]
    fn the_centre_of_pressure_of_a_flat_face_is_its_centroid() {
        for order in [1, 2] {
            let mesh = one(order, 0.0);
            let forces = mesh.nodal_forces(&mesh.sets[0], Load::Traction([1.0, 0.0, 0.0]));
            let centre: Vec3 =
                core::array::from_fn(|k| forces.iter().map(|(n, f)| f[0] * mesh.nodes[*n as usize][k]).sum());
            for (c, exact) in centre.iter().zip([2.0 / 3.0, 1.0, 0.0]) {
                assert!((c - exact).abs() < 1e-14);
            }
        }
    }

    /// On all faces of a body, whatever their shape, it has no resultant; on a flat one pressure times area, inwards.
    #[test]
    fn pressure_pushes_against_faces_and_balances_about_a_body() {
        for (order, lift) in [(1, 0.0), (2, 0.0), (2, 0.3)] {
            let mut mesh = one(order, lift);
            let resultant = |mesh: &FeMesh| {
                let forces = mesh.nodal_forces(&mesh.sets[0], Load::Pressure(2.0));
                forces.iter().fold([0.0; 3], |sum, (_, f)| add(sum, *f))
            };
            // The face z = 0 has 3 mm²; its projection has whatever its edges do in their plane.
            assert!((resultant(&mesh)[2] - 6.0).abs() < 1e-13);
            mesh.sets[0].faces = (0..4).map(|k| (0, k)).collect();
            assert!(norm(resultant(&mesh)) < 1e-13);
        }
    }
}
