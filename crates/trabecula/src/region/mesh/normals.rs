//! The side of a surface from the normals of its nearest face, edge or vertex.
//!
//! J. A. Bærentzen and H. Aanæs, Signed distance computation using the angle weighted pseudonormal, IEEE Trans. Vis.
//! Comput. Graph. 11 (2005) 243. The proof looks at nothing but the surface about the nearest point, so it holds at
//! every place where that is one clean sheet, however the surface is elsewhere.

use super::check::Pairs;
use super::edges::{halves, rises};
use super::tree::{Face, Feature, Hit, Tree};
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;

/// No normal: comparisons with it do not hold.
const NONE: Vec3 = [f64::NAN; 3];
/// A cut triangle lower than this share of its longest side has a normal that rounding may have turned.
const LOW: f64 = 1e-5;

/// Outward normals (any length) of each triangle's edges and corners, in the tree's order; not numbers where the
/// surface is not one sheet.
#[derive(Debug)]
pub struct Normals {
    /// Whether each triangle's own normal is to be trusted; empty for all.
    faces: Vec<bool>,
    edges: Vec<[Vec3; 3]>,
    corners: Vec<[Vec3; 3]>,
}

impl Normals {
    /// The normals of a closed mesh, whose half-edges `pairs` gives; `order` is that of the tree.
    pub fn new(mesh: &Mesh, faces: &[Face], pairs: &Pairs, order: &[u32]) -> Normals {
        let mut edges = vec![[NONE; 3]; faces.len()];
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
            faces: Vec::new(),
            edges: order.iter().map(|i| edges[*i as usize]).collect(),
            corners: order.iter().map(of).collect(),
        }
    }

    /// The normals of pieces, where they make one sheet of triangles that are not slivers.
    pub fn of_pieces(mesh: &Mesh, faces: &[Face], order: &[u32]) -> Normals {
        let sound: Vec<bool> = faces
            .iter()
            .map(|f| {
                let [a, b, c] = f.corners;
                let longest = [sub(b, a), sub(c, b), sub(a, c)].map(|e| dot(e, e));
                let longest = longest.into_iter().fold(0.0, f64::max);
                norm(cross(sub(b, a), sub(c, a))) > LOW * longest
            })
            .collect();
        let mut pairs = Pairs::new();
        for edge in halves(mesh).chunk_by(|a, b| a.0 == b.0) {
            if let [a, b] = edge
                && rises(mesh, a.1) != rises(mesh, b.1)
                && sound[a.1 as usize / 3]
                && sound[b.1 as usize / 3]
            {
                pairs.push([a.1, b.1]);
            }
        }
        let mut across = vec![u32::MAX; 3 * faces.len()];
        for [a, b] in &pairs {
            across[*a as usize] = *b;
            across[*b as usize] = *a;
        }
        let mut count = vec![0u32; mesh.vertices.len()];
        for v in mesh.triangles.iter().flatten() {
            count[*v as usize] += 1;
        }
        // A corner is clean if the walk about it comes back after all its triangles.
        let mut clean = vec![false; mesh.vertices.len()];
        let mut seen = vec![false; mesh.vertices.len()];
        for start in 0..across.len() {
            let v = mesh.triangles[start / 3][start % 3] as usize;
            if core::mem::replace(&mut seen[v], true) {
                continue;
            }
            let (mut h, mut steps) = (start, 0);
            while steps < count[v] {
                let next = across[h / 3 * 3 + (h + 2 - h / 3 * 3) % 3];
                if next == u32::MAX {
                    break;
                }
                h = next as usize;
                steps += 1;
                if h == start {
                    clean[v] = steps == count[v];
                    break;
                }
            }
        }
        let mut normals = Normals::new(mesh, faces, &pairs, order);
        for (at, i) in normals.corners.iter_mut().zip(order) {
            for (n, v) in at.iter_mut().zip(mesh.triangles[*i as usize]) {
                if !clean[v as usize] {
                    *n = NONE;
                }
            }
        }
        normals.faces = order.iter().map(|i| sound[*i as usize]).collect();
        normals
    }

    /// Outward normal (any length) at the nearest point; not numbers where there is none to trust.
    pub fn outward(&self, tree: &Tree, hit: &Hit) -> Vec3 {
        let i = hit.triangle as usize;
        match hit.feature {
            Feature::Face if self.faces.get(i) == Some(&false) => NONE,
            Feature::Face => tree.faces()[i].normal,
            Feature::Edge(k) => self.edges[i][usize::from(k)],
            Feature::Corner(k) => self.corners[i][usize::from(k)],
        }
    }
}
