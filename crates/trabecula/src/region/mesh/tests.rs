use super::*;
use crate::region::tests::check_shape;
use geometry::math::add;
use geometry::mesh::samples::{icosphere, with};
use geometry::random::random;

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
fn a_hollow_ball_obeys_the_laws_of_shapes() {
    let hollow = with(icosphere(3, 2.0, 0.2), icosphere(1, 0.8, 0.0), true);
    let volume = hollow.volume();
    let region = MeshRegion::new(hollow, Repair::Auto).unwrap();
    assert_eq!(region.volume(), Some(volume));
    check_shape("hollow ball", &region, 2.5, 1.0);
}

/// Not a test of right or wrong: prints the times that the documentation cites of filling a grid, a clean mesh and of two that cross.
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
        let region = MeshRegion::new(mesh, Repair::Auto).unwrap();
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
        println!("{name}: {n}³ filled in {:?}, {inside} inside", t.elapsed());
    }
}
