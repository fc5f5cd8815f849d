//! Meshes for the tests.

use core::f64::consts::TAU;
use std::collections::HashMap;

use crate::math::{Vec3, add, scale, unit};
use crate::mesh::Mesh;

/// The box between two corners.
pub(super) fn cuboid(min: Vec3, max: Vec3) -> Mesh {
    let vertices = (0..8)
        .map(|i| std::array::from_fn(|a| if i >> a & 1 == 1 { max[a] } else { min[a] }))
        .collect();
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let triangles = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    Mesh {
        vertices,
        triangles,
    }
}

/// A unit icosahedron, each triangle divided in four `n` times, its vertices on the unit sphere.
pub(super) fn icosphere(n: usize) -> Mesh {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices: Vec<Vec3> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(unit)
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..n {
        let mut middles = HashMap::new();
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for t in &triangles {
            let m: [u32; 3] = std::array::from_fn(|k| {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push(unit(add(vertices[a as usize], vertices[b as usize])));
                    vertices.len() as u32 - 1
                })
            });
            finer.extend([
                [t[0], m[0], m[2]],
                [t[1], m[1], m[0]],
                [t[2], m[2], m[1]],
                m,
            ]);
        }
        triangles = finer;
    }
    Mesh {
        vertices,
        triangles,
    }
}

/// A torus about z of radii `r` and `s`, `n` by `m` quads.
pub(super) fn torus(r: f64, s: f64, n: u32, m: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (
                TAU * f64::from(i) / f64::from(n),
                TAU * f64::from(j) / f64::from(m),
            );
            let d = r + s * v.cos();
            mesh.vertices.push([d * u.cos(), d * u.sin(), s * v.sin()]);
            let at = |i: u32, j: u32| (i % n) * m + j % m;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A sphere of mean radius `r` with waves on it.
pub(super) fn wavy(n: usize, r: f64) -> Mesh {
    let mut mesh = icosphere(n);
    for p in &mut mesh.vertices {
        let wave = (7.0 * p[0]).sin() * (6.0 * p[1]).sin() * (5.0 * p[2]).cos();
        *p = scale(*p, r * (1.0 + 0.1 * wave));
    }
    mesh
}

/// The mesh scaled and moved.
pub(super) fn moved(mut mesh: Mesh, s: f64, by: Vec3) -> Mesh {
    for p in &mut mesh.vertices {
        *p = add(scale(*p, s), by);
    }
    mesh
}

/// The mesh turned inside out.
pub(super) fn flipped(mut mesh: Mesh) -> Mesh {
    for t in &mut mesh.triangles {
        t.swap(1, 2);
    }
    mesh
}

/// Both meshes in one.
pub(super) fn joined(mut a: Mesh, b: Mesh) -> Mesh {
    let n = a.vertices.len() as u32;
    a.vertices.extend(b.vertices);
    a.triangles
        .extend(b.triangles.iter().map(|t| t.map(|v| v + n)));
    a
}

/// Numbers in [-1, 1), the same on every run.
pub(super) struct Random(pub u64);

impl Random {
    pub fn number(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn point(&mut self, s: f64) -> Vec3 {
        std::array::from_fn(|_| s * self.number())
    }
}
