//! Creases of meshes: how near the surface comes to them, and that every guarantee holds whatever the mesh.

use std::collections::HashSet;
use std::f64::consts::PI;
use std::sync::Arc;

use trabecula::extract::{Silent, Surface, surface};
use trabecula::field::Field;
use trabecula::math::{Vec3, add, apply, rotation, scale, sub};
use trabecula::measure::{non_manifold_vertices, self_intersections, size};
use trabecula::mesh::Mesh;
use trabecula::region::{MeshRegion, Repair};
use trabecula::solid::Solid;

/// Every guarantee, on the mesh as re-read from single precision.
fn check(what: &str, s: &Surface) {
    let mut m = s.mesh.clone();
    for x in m.vertices.iter_mut().flatten() {
        *x = f64::from(*x as f32) + 0.0;
    }
    let places: HashSet<[u64; 3]> = m.vertices.iter().map(|v| v.map(f64::to_bits)).collect();
    if places.len() != m.vertices.len() {
        let mut seen = std::collections::HashMap::new();
        for (i, v) in m.vertices.iter().enumerate() {
            if let Some(j) = seen.insert(v.map(f64::to_bits), i) {
                println!("{:?} {:?}", s.mesh.vertices[i], s.mesh.vertices[j]);
            }
        }
    }
    assert_eq!(places.len(), m.vertices.len(), "{what}: vertices fall together");
    assert!(size(&m).closed, "{what}: not closed");
    assert_eq!(non_manifold_vertices(&m), 0, "{what}: a vertex with two fans");
    assert_eq!(self_intersections(&m, 1), 0, "{what}: crosses itself");
}

fn region(mesh: Mesh) -> Arc<MeshRegion> {
    Arc::new(MeshRegion::new(mesh, Repair::Refuse).expect("clean"))
}

fn moved(mut mesh: Mesh, degrees: Vec3, by: Vec3) -> Mesh {
    let turn = rotation(degrees);
    for v in &mut mesh.vertices {
        *v = add(apply(&turn, *v), by);
    }
    mesh
}

/// A prism over a polygon, which `fan` divides into triangles.
fn prism(polygon: &[[f64; 2]], fan: &[[usize; 3]], height: f64) -> Mesh {
    let n = polygon.len() as u32;
    let at = |z: f64| polygon.iter().map(move |p| [p[0], p[1], z]);
    let mut mesh = Mesh {
        vertices: at(0.0).chain(at(height)).collect(),
        triangles: Vec::new(),
    };
    for t in fan {
        let [a, b, c] = t.map(|v| v as u32);
        mesh.triangles.extend([[a, c, b], [a + n, b + n, c + n]]);
    }
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    mesh
}

fn fan(n: usize) -> Vec<[usize; 3]> {
    (1..n - 1).map(|i| [0, i, i + 1]).collect()
}

fn block(x: f64, y: f64, z: f64) -> Mesh {
    prism(&[[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]], &fan(4), z)
}

/// An L; its inner edge is concave, and so is one of the three edges at that edge's ends.
fn angle() -> Mesh {
    let polygon = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.8], [0.7, 0.8], [0.7, 1.9], [0.0, 1.9]];
    prism(&polygon, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.9)
}

/// Two blocks, one turned on top of the other: corners where a convex, a concave and a convex edge meet.
fn step() -> Mesh {
    // A block with a notch in one of its corners.
    let (a, b) = (1.6, 0.7);
    let mut mesh = Mesh::default();
    let mut names = std::collections::HashMap::new();
    let at = [0.0, b, a];
    let full = |i: usize, j: usize, k: usize| i < 2 && j < 2 && k < 2 && (i, j, k) != (1, 1, 1);
    for i in 0..2usize {
        for j in 0..2usize {
            for k in 0..2usize {
                if !full(i, j, k) {
                    continue;
                }
                let c = [i, j, k];
                for axis in 0..3 {
                    for up in [false, true] {
                        let mut d = c;
                        d[axis] = d[axis].wrapping_add(if up { 1 } else { usize::MAX });
                        if full(d[0], d[1], d[2]) {
                            continue;
                        }
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let corner = |du: usize, dv: usize| {
                            let mut p = c;
                            p[axis] += usize::from(up);
                            p[u] += du;
                            p[v] += dv;
                            p
                        };
                        let mut quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        if !up {
                            quad.reverse();
                        }
                        let q = quad.map(|p| {
                            let next = names.len() as u32;
                            *names.entry(p).or_insert_with(|| {
                                mesh.vertices.push(p.map(|x| at[x]));
                                next
                            })
                        });
                        mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                    }
                }
            }
        }
    }
    mesh
}

/// Points on the edges of a mesh that turn by more than some angle.
fn creases(mesh: &Mesh, degrees: f64) -> Vec<Vec3> {
    let normal = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let l = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        n.map(|x| x / l)
    };
    let mut edges = std::collections::HashMap::new();
    let mut points = Vec::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if let Some(j) = edges.insert((a.min(b), a.max(b)), i) {
                let (n, m) = (normal(i), normal(j));
                if n.iter().zip(m).map(|(x, y)| x * y).sum::<f64>() < (degrees * PI / 180.0).cos() {
                    let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
                    points.extend((0..=20).map(|s| {
                        let t = f64::from(s) / 20.0;
                        add(scale(p, 1.0 - t), scale(q, t))
                    }));
                }
            }
        }
    }
    points
}

/// How far the creases of the region are from the mesh, and points of the mesh from the region.
fn apart(truth: &MeshRegion, mesh: &Mesh) -> [f64; 2] {
    let found = region(mesh.clone());
    let farthest = |r: &MeshRegion, points: &[Vec3]| points.iter().map(|p| r.value(*p).abs()).fold(0.0, f64::max);
    let middles: Vec<Vec3> = (0..mesh.triangles.len())
        .flat_map(|i| {
            let [a, b, c] = mesh.corners(i);
            [a, scale(add(a, b), 0.5), scale(add(b, c), 0.5), scale(add(c, a), 0.5)]
        })
        .collect();
    let mut bad: Vec<(f64, Vec3)> = middles.iter().map(|p| (truth.value(*p).abs(), *p)).collect();
    bad.sort_by(|a, b| b.0.total_cmp(&a.0));
    for b in bad.iter().take(6).filter(|b| b.0 > 1e-3) {
        println!("  {:.5} {:.4?}", b.0, sub(b.1, [0.11, -0.07, 0.05]));
    }
    [farthest(&found, &creases(truth.mesh(), 30.0)), farthest(truth, &middles)]
}

#[test]
fn polyhedra_are_met_exactly() {
    for (name, mesh) in [("block", block(1.0, 1.3, 0.8)), ("angle", angle()), ("step", step())] {
        for turn in [[0.0; 3], [17.0, 31.0, 47.0], [-70.0, 12.0, 5.0]] {
            for edge in [0.2, 0.09, 0.04] {
                let truth = region(moved(mesh.clone(), turn, [0.11, -0.07, 0.05]));
                let solid = Solid::new(truth.clone(), None, 1.0);
                let s = surface(&solid, edge, &Silent).expect("surface");
                check(name, &s);
                let off = apart(&truth, &s.mesh);
                println!("{name} {turn:?} {edge}: {:?} steps, volume {}", off.map(|x| x / edge), s.mesh.volume() / truth.mesh().volume() - 1.0);
            }
        }
    }
}
