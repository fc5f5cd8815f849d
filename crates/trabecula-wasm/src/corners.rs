//! A mesh as the arrays that a graphics card draws: three corners for each triangle, one after another.

use geometry::math::{Vec3, cross, dot, norm, sub};
use geometry::surface_mesh::SurfaceMesh;

/// Triangles that meet at less than 35° share their light.
const CREASE: f64 = 0.819_152_044_288_992;
/// One, as a 16-bit number of a normal.
const ONE: f64 = 32767.0;

/// Of each corner its position (3 × f32, mm); then of each its normal and whether its triangle is cut (4 × i16, 32767 is one).
/// A normal is the mean of those of the triangles around the vertex that lie within 35° of the corner's own, by area.
pub fn corners(surface: &SurfaceMesh) -> Vec<u8> {
    let mesh = &surface.mesh;
    let normals: Vec<Vec3> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            cross(sub(b, a), sub(c, a))
        })
        .collect();
    let lengths: Vec<f64> = normals.iter().map(|n| norm(*n).max(1e-300)).collect();
    let around = Around::of(&mesh.triangles, mesh.vertices.len());
    let mut bytes = Vec::with_capacity(mesh.triangles.len() * 60);
    for v in mesh.triangles.as_flattened() {
        bytes.extend(mesh.vertices[*v as usize].iter().flat_map(|x| (*x as f32).to_le_bytes()));
    }
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let cut = if surface.cut[t] { ONE } else { 0.0 };
        for v in corners {
            let mut sum = [0.0; 3];
            for s in around.of_vertex(*v) {
                let s = *s as usize;
                if dot(normals[t], normals[s]) >= CREASE * lengths[t] * lengths[s] {
                    sum = [0, 1, 2].map(|i| sum[i] + normals[s][i]);
                }
            }
            let length = norm(sum).max(1e-300);
            let [x, y, z] = sum.map(|c| c / length * ONE);
            bytes.extend([x, y, z, cut].iter().flat_map(|c| (c.round() as i16).to_le_bytes()));
        }
    }
    bytes
}

/// The triangles around each vertex.
struct Around {
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl Around {
    fn of(triangles: &[[u32; 3]], vertices: usize) -> Around {
        let mut first = vec![0u32; vertices + 1];
        for v in triangles.as_flattened() {
            first[*v as usize + 1] += 1;
        }
        for v in 0..vertices {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut found = vec![0; 3 * triangles.len()];
        for (t, corners) in (0u32..).zip(triangles) {
            for v in corners {
                found[next[*v as usize] as usize] = t;
                next[*v as usize] += 1;
            }
        }
        Around { first, triangles: found }
    }

    fn of_vertex(&self, v: u32) -> &[u32] {
        &self.triangles[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}
