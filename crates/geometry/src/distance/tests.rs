//! Laws of the signed distance, and its rates.

use super::*;
use crate::math::{add, cross};
use crate::mesh::samples::{icosphere, with};
use crate::random::random;
use triangle::normal;

#[test]
fn flat_faces_are_exactly_zero() {
    let mut seed = 11;
    for _ in 0..200 {
        let lo = [0; 3].map(|_| random(&mut seed) * 100.0);
        let hi = lo.map(|v| v + 1.0 + random(&mut seed).abs() * 30.0);
        let mesh = MeshDistance::new(Mesh::cuboid(lo, hi), Repair::Auto).unwrap();
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
    let hollow = with(icosphere(3, 2.0, 0.2), icosphere(1, 0.8, 0.0), true);
    let volume = hollow.volume();
    let corners: Vec<[Vec3; 3]> = (0..hollow.triangles.len()).map(|i| hollow.corners(i)).collect();
    let region = MeshDistance::new(hollow, Repair::Auto).unwrap();
    assert_eq!(region.mesh().volume(), volume);
    let mut seed = 77;
    for _ in 0..1500 {
        let p = [0; 3].map(|_| random(&mut seed) * 2.6);
        let (mut near, mut turns) = (f64::INFINITY, 0.0);
        for c in &corners {
            near = near.min(Triangle { corners: *c, normal: normal(*c) }.nearest(p).0.sqrt());
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
fn what_is_not_one_solid_is_refused_in_numbers() {
    let good = || Mesh::cuboid([0.0; 3], [1.0; 3]);
    let said = |mesh: Mesh| MeshDistance::new(mesh, Repair::Refuse).unwrap_err().message;
    let change = |f: &dyn Fn(&mut Mesh)| {
        let mut m = good();
        f(&mut m);
        said(m)
    };
    assert!(MeshDistance::new(good(), Repair::Auto).is_ok());
    assert!(change(&|m| m.triangles.truncate(11)).contains("3 open edges"));
    assert!(change(&|m| m.triangles[4].swap(0, 1)).contains("3 edges whose two triangles face opposite ways"));
    let double = change(&|m| m.triangles.push(m.triangles[2]));
    assert!(double.contains("3 edges with more than two") && double.contains("1 duplicate"), "{double}");
    assert!(change(&|m| m.vertices[7] = m.vertices[6]).contains("degenerate"));
    assert!(change(&|m| m.triangles.iter_mut().for_each(|t| t.swap(0, 1))).contains("inside out"));
    assert!(change(&|m| m.vertices[3][1] = f64::INFINITY).contains("vertex 3"));
    assert!(change(&|m| m.triangles[5][1] = 8).contains("triangle 5"));
    assert!(change(&|m| m.vertices.iter_mut().for_each(|v| v[2] *= 1e-14)).contains("flat"));
    assert!(said(Mesh::default()).contains("at least 4"));
    let apart = || Mesh::cuboid([3.0; 3], [4.0; 3]);
    let two = MeshDistance::new(with(good(), apart(), false), Repair::Refuse).unwrap();
    assert_eq!(two.mesh().volume(), 2.0);
    assert!(said(with(good(), apart(), true)).contains("1 component that was inside out"));
    let inner = || Mesh::cuboid([0.25; 3], [0.75; 3]);
    assert!(said(with(good(), inner(), false)).contains("12 triangles inside the solid"));
    let hollow = MeshDistance::new(with(good(), inner(), true), Repair::Auto).unwrap();
    assert_eq!(hollow.mesh().volume(), 0.875);
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
    let region = MeshDistance::new(mesh.clone(), Repair::Auto).unwrap();
    assert!((region.mesh().volume() - 1.0).abs() < 1e-5);
    mesh.vertices[0][0] += 1e-3;
    assert!(MeshDistance::new(mesh, Repair::Refuse).unwrap_err().message.contains("open edges"));
}

#[test]
fn the_seed_never_matters() {
    let region = MeshDistance::new(icosphere(3, 1.0, 0.3), Repair::Auto).unwrap();
    let mut seed = 3;
    for _ in 0..500 {
        let p = [0; 3].map(|_| random(&mut seed) * 1.5);
        let any = ((random(&mut seed) + 1.0) * 640.0) as u32;
        let (a, b) = (region.nearest(p, 0), region.nearest(p, any));
        assert_eq!((a.square, a.triangle), (b.square, b.triangle));
    }
    // The centre of a regular body is equally far from every face.
    let cube = MeshDistance::new(Mesh::cuboid([-1.0; 3], [1.0; 3]), Repair::Auto).unwrap();
    for s in 0..12 {
        assert_eq!(cube.nearest([0.0; 3], s).triangle, cube.nearest([0.0; 3], 0).triangle);
    }
}

#[test]
fn nearest_points_of_a_triangle_by_sampling() {
    let mut seed = 21;
    for _ in 0..300 {
        let corners = [0; 3].map(|_| [0; 3].map(|_| random(&mut seed)));
        let face = Triangle { corners, normal: normal(corners) };
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
fn winding_numbers_are_whole_and_the_tree_is_near_them() {
    let mesh = with(icosphere(3, 2.0, 0.2), icosphere(2, 0.8, 0.0), true);
    let faces: Vec<Triangle> = (0..mesh.triangles.len()).map(|i| Triangle::new(mesh.corners(i))).collect();
    let tree = TriangleBvh::new(&faces);
    let winding = Winding::new(&tree);
    let mut seed = 6;
    let mut worst = [0.0f64; 3];
    for _ in 0..2000 {
        let p = [0; 3].map(|_| random(&mut seed) * 2.6);
        let plain: f64 = faces.iter().map(|f| winding::turn(f.corners, p)).sum();
        assert!((plain - plain.round()).abs() < 1e-11, "{plain}");
        for (w, reach) in worst.iter_mut().zip([2.0, 4.0, 8.0]) {
            *w = w.max((winding.at(&tree, p, reach, |_| false) - plain).abs());
        }
    }
    // Moments up to the second leave an error of the third: an eighth at twice the reach, at least.
    assert!(worst[0] < 0.02 && worst[1] < worst[0] / 8.0 && worst[2] < worst[1] / 8.0, "{worst:?}");
    // An open surface: the number is that of the plain sum there too.
    let open: Vec<Triangle> = faces[..500].to_vec();
    let tree = TriangleBvh::new(&open);
    let winding = Winding::new(&tree);
    for _ in 0..500 {
        let p = [0; 3].map(|_| random(&mut seed) * 2.6);
        let plain: f64 = open.iter().map(|f| winding::turn(f.corners, p)).sum();
        assert!((winding.at(&tree, p, 2.0, |_| false) - plain).abs() < 0.02);
    }
}

/// Not a test of right or wrong: prints the rates that the documentation cites, of a clean mesh and of two that cross.
#[test]
#[ignore = "a measurement: run by name in release"]
fn rates() {
    use std::time::Instant;
    let clean = icosphere(6, 100.0, 0.1);
    let mut other = icosphere(6, 70.0, 0.1);
    for v in &mut other.vertices {
        *v = add(*v, [60.0, 10.0, 5.0]);
    }
    let mut open = clean.clone();
    open.triangles.retain(|t| t.iter().any(|v| clean.vertices[*v as usize][0] < 98.0));
    for (name, mesh) in
        [("clean", clean.clone()), ("with a hole", open), ("two that cross", with(clean.clone(), other, false))]
    {
        let t = Instant::now();
        let region = MeshDistance::new(mesh.clone(), Repair::Auto).unwrap();
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
        let tree = TriangleBvh::new(region.triangles());
        let winding = Winding::new(&tree);
        let made = t.elapsed();
        let t = Instant::now();
        let inside = points.iter().filter(|p| winding.at(&tree, **p, REACH, |_| false) > 0.5).count();
        println!(
            "  moments in {made:?}, {:.0} ns per winding number, {inside} inside",
            t.elapsed().as_nanos() as f64 / points.len() as f64
        );
    }
}
