use super::tree::normal;
use super::*;
use crate::region::tests::{check_shape, random};
use geometry::math::add;
use std::collections::HashMap;

/// An icosphere of 20·4ⁿ triangles, its radius waved by `wave`.
pub(super) fn ball(n: usize, radius: f64, wave: f64) -> Mesh {
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
pub(super) fn with(mut a: Mesh, b: Mesh, inside_out: bool) -> Mesh {
    let n = a.vertices.len() as u32;
    a.vertices.extend(b.vertices);
    a.triangles.extend(b.triangles.iter().map(|t| {
        let [x, y, z] = t.map(|v| v + n);
        if inside_out { [x, z, y] } else { [x, y, z] }
    }));
    a
}

#[test]
fn a_box_of_triangles_is_the_box() {
    let (lo, hi) = ([-1.0, -0.7, -1.1], [0.9, 1.2, 0.8]);
    let mesh = MeshRegion::new(Mesh::cuboid(lo, hi), Repair::Auto).unwrap();
    let exact = crate::region::Cuboid::new(lo, hi).unwrap();
    check_shape("box mesh", &mesh, 2.0, 1.0);
    let mut seed = 5;
    for _ in 0..5000 {
        let p = [0; 3].map(|_| random(&mut seed) * 2.5);
        assert!((mesh.value(p) - exact.value(p)).abs() < 1e-14, "{p:?}");
    }
    assert!((mesh.volume().unwrap() - exact.volume().unwrap()).abs() < 1e-14);
    for axis in 0..3 {
        let (mut got, mut want) = (Vec::new(), Vec::new());
        mesh.planes(axis, &mut got);
        exact.planes(axis, &mut want);
        assert_eq!(got, want);
    }
}

#[test]
fn flat_faces_are_exactly_zero() {
    let mut seed = 11;
    for _ in 0..200 {
        let lo = [0; 3].map(|_| random(&mut seed) * 100.0);
        let hi = lo.map(|v| v + 1.0 + random(&mut seed).abs() * 30.0);
        let mesh = MeshRegion::new(Mesh::cuboid(lo, hi), Repair::Auto).unwrap();
        for axis in 0..3 {
            for plane in [lo[axis], hi[axis]] {
                for _ in 0..50 {
                    let t = [0; 3].map(|_| (random(&mut seed) + 1.0) / 2.0);
                    let mut p = [0, 1, 2].map(|a| lo[a] + t[a] * (hi[a] - lo[a]));
                    // Some on the diagonal, where two triangles meet.
                    if t[0] > 0.5 {
                        p = [0, 1, 2].map(|a| lo[a] + t[1] * (hi[a] - lo[a]));
                    }
                    p[axis] = plane;
                    assert_eq!(mesh.value(p), 0.0);
                }
            }
        }
    }
}

#[test]
fn distances_and_signs_agree_with_a_plain_search() {
    let hollow = with(ball(3, 2.0, 0.2), ball(1, 0.8, 0.0), true);
    let volume = hollow.volume();
    let corners: Vec<[Vec3; 3]> = (0..hollow.triangles.len()).map(|i| hollow.corners(i)).collect();
    let region = MeshRegion::new(hollow, Repair::Auto).unwrap();
    assert_eq!(region.volume(), Some(volume));
    check_shape("hollow ball", &region, 2.5, 1.0);
    let mut seed = 77;
    for _ in 0..1500 {
        let p = [0; 3].map(|_| random(&mut seed) * 2.6);
        let (mut near, mut turns) = (f64::INFINITY, 0.0);
        for c in &corners {
            near = near.min(Face { corners: *c, normal: normal(*c) }.nearest(p).0.sqrt());
            let [a, b, c] = c.map(|q| sub(q, p));
            let (la, lb, lc) = (norm(a), norm(b), norm(c));
            let lower = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
            turns += 2.0 * dot(a, cross(b, c)).atan2(lower);
        }
        let inside = turns > 2.0 * core::f64::consts::PI;
        let d = region.value(p);
        assert_eq!(d.abs(), near, "{p:?}");
        assert_eq!(d < 0.0, inside, "{p:?}");
    }
}

#[test]
fn the_seed_never_matters() {
    let region = MeshRegion::new(ball(3, 1.0, 0.3), Repair::Auto).unwrap();
    let mut seed = 3;
    for _ in 0..500 {
        let p = [0; 3].map(|_| random(&mut seed) * 1.5);
        let any = ((random(&mut seed) + 1.0) * 640.0) as u32;
        let (a, b) = (region.tree.nearest(p, 0), region.tree.nearest(p, any));
        assert_eq!((a.square, a.triangle), (b.square, b.triangle));
    }
    // The centre of a regular body is equally far from every face.
    let cube = MeshRegion::new(Mesh::cuboid([-1.0; 3], [1.0; 3]), Repair::Auto).unwrap();
    for s in 0..12 {
        assert_eq!(cube.tree.nearest([0.0; 3], s).triangle, cube.tree.nearest([0.0; 3], 0).triangle);
    }
}

#[test]
fn nearest_points_of_a_triangle_by_sampling() {
    let mut seed = 21;
    for _ in 0..300 {
        let corners = [0; 3].map(|_| [0; 3].map(|_| random(&mut seed)));
        let face = Face { corners, normal: normal(corners) };
        let p = [0; 3].map(|_| 2.0 * random(&mut seed));
        let (square, away, _) = face.nearest(p);
        assert!((square - dot(away, away)).abs() < 1e-14);
        let n = 60;
        let mut least = f64::INFINITY;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let q = [0, 1, 2].map(|a| (1.0 - u - v) * corners[0][a] + u * corners[1][a] + v * corners[2][a]);
                least = least.min(norm(sub(p, q)));
            }
        }
        // The samples are never nearer, and one of them lies within a step of the nearest point.
        assert!(least >= square.sqrt() - 1e-12 && least <= square.sqrt() + 2.0 * 3f64.sqrt() * 2.0 / f64::from(n));
    }
}

#[test]
fn what_is_not_one_solid_is_refused_in_numbers() {
    let good = || Mesh::cuboid([0.0; 3], [1.0; 3]);
    let said = |mesh: Mesh| MeshRegion::new(mesh, Repair::Refuse).unwrap_err().message;
    let change = |f: &dyn Fn(&mut Mesh)| {
        let mut m = good();
        f(&mut m);
        said(m)
    };
    assert!(MeshRegion::new(good(), Repair::Auto).is_ok());
    assert!(change(&|m| m.triangles.truncate(11)).contains("3 open edges"));
    assert!(change(&|m| m.triangles[4].swap(0, 1)).contains("3 edges whose two triangles face opposite ways"));
    let double = change(&|m| m.triangles.push(m.triangles[2]));
    assert!(double.contains("3 edges with more than two") && double.contains("1 duplicate"), "{double}");
    assert!(change(&|m| m.vertices[7] = m.vertices[6]).contains("degenerate"));
    assert!(change(&|m| m.triangles.iter_mut().for_each(|t| t.swap(0, 1))).contains("inside out"));
    assert!(change(&|m| m.vertices[3][1] = f64::INFINITY).contains("vertex 3"));
    assert!(change(&|m| m.triangles[5][1] = 8).contains("triangle 5"));
    assert!(change(&|m| m.vertices.iter_mut().for_each(|v| v[2] *= 1e-14)).contains("flat"));
    assert!(said(Mesh::default()).contains("at least four"));
    let apart = || Mesh::cuboid([3.0; 3], [4.0; 3]);
    let two = MeshRegion::new(with(good(), apart(), false), Repair::Refuse).unwrap();
    assert_eq!(two.volume(), Some(2.0));
    assert!(said(with(good(), apart(), true)).contains("1 body that was inside out"));
    let inner = || Mesh::cuboid([0.25; 3], [0.75; 3]);
    assert!(said(with(good(), inner(), false)).contains("12 triangles inside the solid"));
    let hollow = MeshRegion::new(with(good(), inner(), true), Repair::Auto).unwrap();
    assert_eq!(hollow.volume(), Some(0.875));
    assert_eq!(hollow.value([0.5; 3]), 0.25);
}

#[test]
fn corners_written_with_two_roundings_are_one() {
    let mut mesh = Mesh::cuboid([10.0; 3], [11.0; 3]);
    // Every triangle its own corners, off by less than single precision tells at 11 mm.
    let mut seed = 4;
    let corners: Vec<Vec3> = (0..12).flat_map(|i| mesh.corners(i)).collect();
    mesh.vertices = corners.iter().map(|p| p.map(|x| x + 2e-7 * random(&mut seed))).collect();
    mesh.triangles = (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let region = MeshRegion::new(mesh.clone(), Repair::Auto).unwrap();
    assert!((region.volume().unwrap() - 1.0).abs() < 1e-5);
    mesh.vertices[0][0] += 1e-3;
    assert!(MeshRegion::new(mesh, Repair::Refuse).unwrap_err().message.contains("open edges"));
}

/// Not a test of right or wrong: prints the rates that the documentation cites, of a clean mesh and of two that cross.
#[test]
#[ignore = "a measurement: run by name in release"]
fn rates() {
    use rayon::prelude::*;
    use std::time::Instant;
    let clean = ball(6, 100.0, 0.1);
    let mut other = ball(6, 70.0, 0.1);
    for v in &mut other.vertices {
        *v = add(*v, [60.0, 10.0, 5.0]);
    }
    let mut open = clean.clone();
    open.triangles.retain(|t| t.iter().any(|v| clean.vertices[*v as usize][0] < 98.0));
    for (name, mesh) in
        [("clean", clean.clone()), ("with a hole", open), ("two that cross", with(clean.clone(), other, false))]
    {
        let t = Instant::now();
        let region = MeshRegion::new(mesh.clone(), Repair::Auto).unwrap();
        println!(
            "{name}: {} triangles: built in {:?}; {:?}",
            mesh.triangles.len(),
            t.elapsed(),
            region.repaired().sentence()
        );
        let mut seed = 1;
        let points: Vec<Vec3> = (0..200_000)
            .map(|_| {
                let i = ((random(&mut seed) + 1.0) / 2.0 * mesh.vertices.len() as f64) as usize;
                add(mesh.vertices[i], [0; 3].map(|_| random(&mut seed)))
            })
            .collect();
        let mut out = vec![0.0; points.len()];
        let t = Instant::now();
        region.values(&points, &mut out);
        println!("  {:.0} ns per random query near the surface", t.elapsed().as_nanos() as f64 / points.len() as f64);
        let t = Instant::now();
        let winding = Winding::new(&region.tree);
        let made = t.elapsed();
        let t = Instant::now();
        let inside = points.iter().filter(|p| winding.at(&region.tree, **p, REACH, |_| false) > 0.5).count();
        println!(
            "  moments in {made:?}, {:.0} ns per winding number, {inside} inside",
            t.elapsed().as_nanos() as f64 / points.len() as f64
        );
        let n = 256;
        let axis: Vec<f64> = (0..n).map(|i| -115.0 + 260.0 * i as f64 / (n - 1) as f64).collect();
        let t = Instant::now();
        let tiles: Vec<(usize, usize, usize)> = (0..512).map(|i| (i % 8 * 32, i / 8 % 8 * 32, i / 64 * 32)).collect();
        let inside: usize = tiles
            .par_iter()
            .map(|&(x, y, z)| {
                let block = Block { axes: [&axis[x..x + 32], &axis[y..y + 32], &axis[z..z + 32]] };
                let mut out = vec![0f32; block.len()];
                region.fill(&block, &mut out);
                out.iter().filter(|v| **v < 0.0).count()
            })
            .sum();
        println!("  {n}³ filled in {:?}, {inside} inside", t.elapsed());
    }
}
