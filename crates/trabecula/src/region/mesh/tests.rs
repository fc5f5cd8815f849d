use super::*;
use crate::region::tests::{check_shape, random};
use geometry::distance::REACH;
use geometry::distance::tree::{Tree, normal};
use geometry::distance::winding::Winding;
use geometry::math::{add, dot};
use geometry::mesh::samples::{icosphere, with};

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
    let hollow = with(icosphere(3, 2.0, 0.2), icosphere(1, 0.8, 0.0), true);
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
        let (tree, _) = Tree::new(region.distance.faces());
        let winding = Winding::new(&tree);
        let made = t.elapsed();
        let t = Instant::now();
        let inside = points.iter().filter(|p| winding.at(&tree, **p, REACH, |_| false) > 0.5).count();
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
