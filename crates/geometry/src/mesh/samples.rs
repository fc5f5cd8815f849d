//! Small meshes of known volume and topology, for tests and examples.

use super::Mesh;
use std::collections::HashMap;

use crate::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

/// The tetrahedron of the origin and the three unit points.
pub fn tetrahedron() -> Mesh {
    Mesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    }
}

/// An axis-aligned cube by its least corner and its edge.
pub fn cube(min: Vec3, edge: f64) -> Mesh {
    Mesh::cuboid(min, add(min, [edge; 3]))
}

/// A torus of radii 2 and 1 about z, of n × m quadrilaterals, each cut in two.
pub fn torus(n: u32, m: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let [u, v] = [f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)].map(|t| t * core::f64::consts::TAU);
            let r = 2.0 + v.cos();
            mesh.vertices.push([r * u.cos(), r * u.sin(), v.sin()]);
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// One mesh of several.
pub fn join(parts: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for p in parts {
        let shift = all.vertices.len() as u32;
        all.vertices.extend(&p.vertices);
        all.triangles.extend(p.triangles.iter().map(|t| t.map(|v| v + shift)));
    }
    all
}

/// The same mesh facing the other way.
pub fn flipped(mut mesh: Mesh) -> Mesh {
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh
}

/// An icosphere of 20·4ⁿ triangles about the origin, its radius varied by the share `wave`.
pub fn icosphere(n: usize, radius: f64, wave: f64) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        vertices.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    let near = |i: usize, j: usize, v: &[Vec3]| (norm(sub(v[i], v[j])) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j, &vertices) && near(j, k, &vertices) && near(i, k, &vertices) {
                    let [a, b, c] = [i, j, k].map(|v| vertices[v]);
                    let out = dot(a, cross(b, c)) > 0.0;
                    let t = if out { [i, j, k] } else { [i, k, j] };
                    triangles.push(t.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..n {
        let mut halves = HashMap::new();
        let mut next = Vec::new();
        for t in &triangles {
            let m = [0, 1, 2].map(|k| {
                let (a, b): (u32, u32) = (t[k], t[(k + 1) % 3]);
                *halves.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push(scale(add(vertices[a as usize], vertices[b as usize]), 0.5));
                    vertices.len() as u32 - 1
                })
            });
            next.extend([[t[0], m[0], m[2]], [m[0], t[1], m[1]], [m[2], m[1], t[2]], m]);
        }
        triangles = next;
    }
    for v in &mut vertices {
        let u = unit(*v);
        let r = radius * (1.0 + wave * (7.0 * u[0]).sin() * (6.0 * u[1]).sin() * (5.0 * u[2]).cos());
        *v = scale(u, r);
    }
    Mesh { vertices, triangles }
}

/// Both meshes as one, the second turned inside out if asked.
pub fn with(mut a: Mesh, b: Mesh, inside_out: bool) -> Mesh {
    let n = a.vertices.len() as u32;
    a.vertices.extend(b.vertices);
    a.triangles.extend(b.triangles.iter().map(|t| {
        let [x, y, z] = t.map(|v| v + n);
        if inside_out { [x, z, y] } else { [x, y, z] }
    }));
    a
}
