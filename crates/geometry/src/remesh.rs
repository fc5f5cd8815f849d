//! What changes of a triangle mesh edge by edge share: adjacency, the edges that stay, the triangles near a place.

use crate::math::Aabb;
use crate::mesh::Mesh;
use crate::surface_mesh::SurfaceMesh;

pub mod edited_mesh;
pub mod half_edge_mesh;
pub mod kept_edges;
pub mod refit_tree;

use edited_mesh::EditedMesh;
use half_edge_mesh::NONE;

/// Triangles of a mesh along a space-filling curve, so that what is near in space is near in memory.
pub fn curve_order(mesh: &Mesh, triangles: impl IntoIterator<Item = u32> + Clone) -> Vec<u32> {
    let corners = |t: u32| mesh.corners(t as usize);
    let b = triangles.clone().into_iter().flat_map(corners).fold(Aabb::EMPTY, Aabb::with);
    let longest = b.size().iter().fold(0.0f64, |m, s| m.max(*s));
    let scale = if longest > 0.0 { 2_097_151.0 / longest } else { 0.0 };
    let key = |t: u32| {
        let [p, q, r] = corners(t);
        let key = (0..3).fold(0, |key, k| {
            let middle = (p[k] + q[k] + r[k]) / 3.0 - b.min[k];
            key | spread((middle * scale) as u64) << k
        });
        (key, t)
    };
    let mut keys: Vec<(u64, u32)> = triangles.into_iter().map(key).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, t)| t).collect()
}

/// The same surface, its triangles along a space-filling curve and its vertices in the order of their first use.
pub fn in_order(surface: &SurfaceMesh) -> SurfaceMesh {
    let mesh = &surface.mesh;
    let mut names = vec![NONE; mesh.vertices.len()];
    let mut out = SurfaceMesh::default();
    for t in curve_order(mesh, 0..mesh.triangles.len() as u32) {
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
pub fn gathered(mesh: &EditedMesh, cut: &[bool]) -> SurfaceMesh {
    let mut names = vec![NONE; mesh.positions.len()];
    let mut out = SurfaceMesh::default();
    for (t, corners) in mesh.half_edges.triangles.iter().enumerate() {
        if corners[0] == NONE {
            continue;
        }
        let triangle = corners.map(|v| {
            let name = &mut names[v as usize];
            if *name == NONE {
                *name = out.mesh.vertices.len() as u32;
                out.mesh.vertices.push(mesh.at(v));
            }
            *name
        });
        out.mesh.triangles.push(triangle);
        out.cut.push(cut[t]);
    }
    out
}
