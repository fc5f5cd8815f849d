//! A mesh as the arrays that a graphics card draws.

use geometry::math::{Vec3, cross, dot, norm, sub};
use geometry::surface_mesh::SurfaceMesh;

/// Triangles that meet at less than 35° share their light.
const CREASE: f64 = 0.819_152_044_288_992;
/// One, as a 16-bit number of a normal.
const ONE: f64 = 32767.0;

/// Arrays for drawing.
pub struct Arrays {
    /// Of each vertex that of the mesh.
    pub vertices: Vec<u32>,
    /// Of each vertex its position (3 × f32, mm); then of each its normal and whether its triangles are cut (4 × i16, 32767 is one);
    /// then of each triangle its vertices (3 × u32).
    pub bytes: Vec<u8>,
}

/// The arrays of a surface. A vertex occurs once for each of its normals. A normal is the mean of those of the triangles around the
/// vertex that lie within 35° of the corner's own, by area.
pub fn arrays(surface: &SurfaceMesh) -> Arrays {
    let mesh = &surface.mesh;
    let normals: Vec<Vec3> = (0..mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            cross(sub(b, a), sub(c, a))
        })
        .collect();
    let lengths: Vec<f64> = normals.iter().map(|n| norm(*n).max(1e-300)).collect();
    let adjacent = VertexTriangles::of(&mesh.triangles, mesh.vertices.len());
    let mut drawn = CornerVertices::new(mesh.vertices.len());
    let mut index = Vec::with_capacity(12 * mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let cut = if surface.cut[t] { ONE } else { 0.0 };
        for v in corners {
            let mut sum = [0.0; 3];
            for s in adjacent.of_vertex(*v) {
                let s = *s as usize;
                if dot(normals[t], normals[s]) >= CREASE * lengths[t] * lengths[s] {
                    sum = [0, 1, 2].map(|i| sum[i] + normals[s][i]);
                }
            }
            let length = norm(sum).max(1e-300);
            let [x, y, z] = sum.map(|c| c / length * ONE);
            index.extend(drawn.number(*v, [x, y, z, cut].map(|c| c.round() as i16)).to_le_bytes());
        }
    }
    let positions = drawn.vertices.iter().flat_map(|v| mesh.vertices[*v as usize]);
    let mut bytes: Vec<u8> = positions.flat_map(|x| (x as f32).to_le_bytes()).collect();
    bytes.extend(drawn.normals.as_flattened().iter().flat_map(|c| c.to_le_bytes()));
    bytes.extend(index);
    Arrays { vertices: drawn.vertices, bytes }
}

/// No vertex.
const NONE: u32 = u32::MAX;

/// Vertices with one normal each: those of a vertex of the mesh are a chain.
struct CornerVertices {
    first: Vec<u32>,
    next: Vec<u32>,
    vertices: Vec<u32>,
    normals: Vec<[i16; 4]>,
}

impl CornerVertices {
    fn new(vertices: usize) -> CornerVertices {
        CornerVertices { first: vec![NONE; vertices], next: Vec::new(), vertices: Vec::new(), normals: Vec::new() }
    }

    /// The number of a vertex of the mesh with this normal.
    fn number(&mut self, v: u32, normal: [i16; 4]) -> u32 {
        let mut at = self.first[v as usize];
        while at != NONE && self.normals[at as usize] != normal {
            at = self.next[at as usize];
        }
        if at == NONE {
            at = self.vertices.len() as u32;
            self.next.push(self.first[v as usize]);
            self.first[v as usize] = at;
            self.vertices.push(v);
            self.normals.push(normal);
        }
        at
    }
}

/// The triangles around each vertex.
struct VertexTriangles {
    first: Vec<u32>,
    triangles: Vec<u32>,
}

impl VertexTriangles {
    fn of(triangles: &[[u32; 3]], vertices: usize) -> VertexTriangles {
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
        VertexTriangles { first, triangles: found }
    }

    fn of_vertex(&self, v: u32) -> &[u32] {
        &self.triangles[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}
