//! Meshes that tests are about.

use super::Mesh;
use crate::math::{Vec3, add};

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
