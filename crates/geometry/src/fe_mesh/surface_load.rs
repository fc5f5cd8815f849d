//! Forces at nodes that stand for a uniform traction on the faces of a set.

use super::{FeMesh, FeSet};
use crate::math::{Vec3, cross, norm, sub};

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

/// A force shared among nodes, ascending by node, by the sum of each node's shares.
pub(super) fn shared(force: Vec3, mut shares: Vec<(u32, f64)>) -> Vec<(u32, Vec3)> {
    // Stable, so that sums have the same bits.
    shares.sort_by_key(|s| s.0);
    let whole: f64 = shares.iter().map(|s| s.1).sum();
    let at = |of: &[(u32, f64)]| (of[0].0, force.map(|f| f * of.iter().map(|s| s.1).sum::<f64>() / whole));
    shares.chunk_by(|a, b| a.0 == b.0).map(at).collect()
}

impl FeMesh {
    /// The work-equivalent forces at the nodes of a set's faces, ascending by node, of a uniform traction whose resultant is `force`:
    /// force · ∫ Nᵢ dA / ∫ dA with the shape functions Nᵢ of the faces. Those of flat quadratic faces are at the middles of edges alone.
    pub fn nodal_forces(&self, set: &FeSet, force: Vec3) -> Vec<(u32, Vec3)> {
        let mut shares: Vec<(u32, f64)> = Vec::with_capacity(6 * set.faces.len());
        for face in &set.faces {
            let [a, b, c] = self.face(*face);
            match self.face_middles(*face) {
                Some([d, e, f]) => shares.extend(self.quadratic_shares([a, b, c, d, e, f])),
                None => {
                    let [p, q, r] = [a, b, c].map(|n| self.nodes[n as usize]);
                    let third = norm(cross(sub(q, p), sub(r, p))) / 6.0;
                    shares.extend([a, b, c].map(|n| (n, third)));
                }
            }
        }
        shared(force, shares)
    }

    /// ∫ N dA of the nodes of a quadratic face: corners a b c, then the middles of ab, bc, ca.
    fn quadratic_shares(&self, nodes: [u32; 6]) -> [(u32, f64); 6] {
        let mut shares = nodes.map(|n| (n, 0.0));
        for (u, v, weight) in POINTS {
            let w = 1.0 - u - v;
            let shape =
                [w * (2.0 * w - 1.0), u * (2.0 * u - 1.0), v * (2.0 * v - 1.0), 4.0 * w * u, 4.0 * u * v, 4.0 * v * w];
            let along_u = [1.0 - 4.0 * w, 4.0 * u - 1.0, 0.0, 4.0 * (w - u), 4.0 * v, -4.0 * v];
            let along_v = [1.0 - 4.0 * w, 0.0, 4.0 * v - 1.0, -4.0 * u, 4.0 * u, 4.0 * (w - v)];
            let sum = |of: [f64; 6]| -> Vec3 {
                core::array::from_fn(|k| (0..6).map(|i| of[i] * self.nodes[nodes[i] as usize][k]).sum())
            };
            let element = 0.5 * weight * norm(cross(sum(along_u), sum(along_v)));
            shares.iter_mut().zip(shape).for_each(|(s, n)| s.1 += n * element);
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
        let linear = one(1, 0.0).nodal_forces(&one(1, 0.0).sets[0], force);
        assert!(linear.iter().all(|(_, f)| (f[1] + 2.0).abs() < 1e-14) && linear.len() == 3);
        for lift in [0.0, 0.3] {
            let mesh = one(2, lift);
            let quadratic = mesh.nodal_forces(&mesh.sets[0], force);
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
            let forces = mesh.nodal_forces(&mesh.sets[0], [1.0, 0.0, 0.0]);
            let centre: Vec3 =
                core::array::from_fn(|k| forces.iter().map(|(n, f)| f[0] * mesh.nodes[*n as usize][k]).sum());
            for (c, exact) in centre.iter().zip([2.0 / 3.0, 1.0, 0.0]) {
                assert!((c - exact).abs() < 1e-14);
            }
        }
    }
}
