//! The side of a clean surface from the normals of its nearest face, edge or vertex.
//!
//! J. A. Bærentzen and H. Aanæs, Signed distance computation using the angle weighted pseudonormal, IEEE Trans. Vis.
//! Comput. Graph. 11 (2005) 243.

use super::check::Pairs;
use super::tree::{Face, Feature, Hit, Tree};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;

/// Outward normals (any length) of each triangle's edges and corners, in the tree's order.
#[derive(Debug)]
pub struct Normals {
    edges: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
}

impl Normals {
    /// The normals of a closed mesh, whose half-edges `pairs` gives; `order` is that of the tree.
    pub fn new(mesh: &Mesh, faces: &[Face], pairs: &Pairs, order: &[u32]) -> Normals {
        let mut edges = vec![[[0.0; 3]; 3]; faces.len()];
        for [a, b] in pairs {
            let [a, b] = [*a as usize, *b as usize];
            let n = add(faces[a / 3].normal, faces[b / 3].normal);
            edges[a / 3][a % 3] = n;
            edges[b / 3][b % 3] = n;
        }
        let mut corners = vec![[0.0; 3]; mesh.vertices.len()];
        for (t, f) in mesh.triangles.iter().zip(faces) {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| f.corners[(k + i) % 3]);
                let (u, v) = (sub(b, a), sub(c, a));
                let angle = norm(cross(u, v)).atan2(dot(u, v));
                let n = &mut corners[t[k] as usize];
                *n = add(*n, scale(f.normal, angle));
            }
        }
        let of = |i: &u32| mesh.triangles[*i as usize].map(|v| corners[v as usize]);
        Normals {
            edges: order.iter().map(|i| edges[*i as usize]).collect(),
            corners: order.iter().map(of).collect(),
        }
    }

    /// Outward normal (any length) at the nearest point.
    pub fn outward(&self, tree: &Tree, hit: &Hit) -> Vec3 {
        let i = hit.triangle as usize;
        match hit.feature {
            Feature::Face => tree.faces()[i].normal,
            Feature::Edge(k) => self.edges[i][usize::from(k)],
            Feature::Corner(k) => self.corners[i][usize::from(k)],
        }
    }
}
