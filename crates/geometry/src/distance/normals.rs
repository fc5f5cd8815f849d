//! The side of a surface from the normals of its nearest face, edge or vertex.
//!
//! J. A. Bærentzen and H. Aanæs, Signed distance computation using the angle weighted pseudonormal, IEEE Trans. Vis.
//! Comput. Graph. 11 (2005) 243. The proof looks at nothing but the surface about the nearest point, so within a
//! triangle it holds however the surface is elsewhere.

use super::triangle::{Feature, Triangle};
use super::triangle_bvh::{Nearest, TriangleBvh};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::repair::validity::Pairs;

/// No normal: comparisons with it do not hold.
const NONE: Vec3 = [f64::NAN; 3];
/// A cut triangle lower than this share of its longest side has a normal that rounding may have turned.
const LOW: f64 = 1e-5;

/// Outward normals (any length) of each triangle's edges and corners, in the tree's order.
#[derive(Debug)]
pub struct PseudoNormals {
    /// Whether each triangle's own normal is to be trusted; empty for all.
    faces: Vec<bool>,
    /// Empty where there are none to trust, and so are the corners.
    edges: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
}

impl PseudoNormals {
    /// The normals of a closed mesh, whose half-edges `pairs` gives; `order` is that of the tree.
    pub fn new(mesh: &Mesh, faces: &[Triangle], pairs: &Pairs, order: &[u32]) -> PseudoNormals {
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
        PseudoNormals {
            faces: Vec::new(),
            edges: order.iter().map(|i| edges[*i as usize]).collect(),
            corners: order.iter().map(of).collect(),
        }
    }

    /// The normals of pieces that need not match: those of triangles that are not slivers, and none of edges and
    /// corners. Another piece may rest on those from the other side, so that the nearest point is on both; within a
    /// triangle only a line of places has such a point nearest.
    pub fn of_pieces(faces: &[Triangle], order: &[u32]) -> PseudoNormals {
        let sound = |i: &u32| {
            let [a, b, c] = faces[*i as usize].corners;
            let longest = [sub(b, a), sub(c, b), sub(a, c)].map(|e| dot(e, e));
            let longest = longest.into_iter().fold(0.0, f64::max);
            norm(cross(sub(b, a), sub(c, a))) > LOW * longest
        };
        PseudoNormals { faces: order.iter().map(sound).collect(), edges: Vec::new(), corners: Vec::new() }
    }

    /// Outward normal (any length) at the nearest point; not numbers where there is none to trust.
    pub fn outward(&self, tree: &TriangleBvh, hit: &Nearest) -> Vec3 {
        let i = hit.triangle as usize;
        match hit.feature {
            Feature::Face if self.faces.get(i) == Some(&false) => NONE,
            Feature::Face => tree.triangles()[i].normal,
            Feature::Edge(k) => self.edges.get(i).map_or(NONE, |e| e[usize::from(k)]),
            Feature::Corner(k) => self.corners.get(i).map_or(NONE, |c| c[usize::from(k)]),
        }
    }
}
