//! What changes of a triangle mesh edge by edge share: adjacency, the edges that stay, the triangles near a place.

use crate::math::Vec3;
use crate::surface_mesh::SurfaceMesh;

pub mod half_edge_mesh;
pub mod kept_edges;
pub mod refit_tree;

use half_edge_mesh::{HalfEdgeMesh, NONE};

/// The same surface, its triangles along a space-filling curve and its vertices in the order of their first use, so that
/// what is near in space is near in memory.
pub fn in_order(surface: &SurfaceMesh) -> SurfaceMesh {
    let mesh = &surface.mesh;
    let b = mesh.bounds();
    let longest = b.size().iter().fold(0.0f64, |m, s| m.max(*s));
    let scale = if longest > 0.0 { 2_097_151.0 / longest } else { 0.0 };
    let mut keys: Vec<(u64, u32)> = (0..mesh.triangles.len())
        .map(|t| {
            let [p, q, r] = mesh.corners(t);
            let key = (0..3).fold(0, |key, k| {
                let middle = (p[k] + q[k] + r[k]) / 3.0 - b.min[k];
                key | spread((middle * scale) as u64) << k
            });
            (key, t as u32)
        })
        .collect();
    keys.sort_unstable();
    let mut names = vec![NONE; mesh.vertices.len()];
    let mut out = SurfaceMesh::default();
    for (_, t) in keys {
        let triangle = mesh.triangles[t as usize].map(|v| {
            let name = &mut names[v as usize];
            if *name == NONE {
                *name = out.mesh.vertices.len() as u32;
                out.mesh.vertices.push(mesh.vertices[v as usize]);
            }
            *name
        });
        out.mesh.triangles.push(triangle);
        out.cut.push(surface.cut[t as usize]);
    }
    out
}

/// The lowest 21 bits of a number, three apart.
fn spread(x: u64) -> u64 {
    let mut x = x & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// The triangles that are left.
pub fn gathered(half_edges: &HalfEdgeMesh, positions: &[Vec3], cut: &[bool]) -> SurfaceMesh {
    let mut names = vec![NONE; positions.len()];
    let mut out = SurfaceMesh::default();
    for (t, corners) in half_edges.triangles.iter().enumerate() {
        if corners[0] == NONE {
            continue;
        }
        let triangle = corners.map(|v| {
            let name = &mut names[v as usize];
            if *name == NONE {
                *name = out.mesh.vertices.len() as u32;
                out.mesh.vertices.push(positions[v as usize]);
            }
            *name
        });
        out.mesh.triangles.push(triangle);
        out.cut.push(cut[t]);
    }
    out
}
