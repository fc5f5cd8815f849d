use super::*;
use crate::math::norm;
use crate::mesh::samples::{cube, icosphere, join, torus};
use crate::progress::Silent;

fn surface(mesh: Mesh) -> SurfaceMesh {
    SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh }
}

/// A ball of radius 5 mm some of whose vertices, no two of them adjacent, are moved most of the way to an adjacent one: needles.
fn with_needles() -> Mesh {
    let mut ball = icosphere(4, 5.0, 0.0);
    let mut near = vec![false; ball.vertices.len()];
    for t in 0..ball.triangles.len() {
        let [a, b, _] = ball.triangles[t];
        let around = || ball.triangles.iter().filter(|o| o.contains(&a)).flatten();
        if around().any(|v| near[*v as usize]) {
            continue;
        }
        around().for_each(|v| near[*v as usize] = true);
        let [p, q] = [a, b].map(|v| ball.vertices[v as usize]);
        let moved: Vec3 = core::array::from_fn(|k| 0.05 * p[k] + 0.95 * q[k]);
        let long = norm(moved);
        ball.vertices[a as usize] = moved.map(|x| 5.0 * x / long);
    }
    ball
}

fn smoothed(mesh: &SurfaceMesh) -> (SurfaceMesh, SmoothReport) {
    let Ok(made) = smooth(mesh, &Silent) else { panic!("not smoothed") };
    made
}

#[test]
fn slivers_of_a_ball_go_and_its_volume_stays() {
    let first = surface(with_needles());
    assert_eq!(measure::self_intersections(&first.mesh, 9), 0);
    let (made, report) = smoothed(&first);
    assert!(report.smallest_angle_p05_before < 5.0, "{report:?}");
    assert!(report.smallest_angle > 15.0 && report.smallest_angle_p05 > 25.0, "{report:?}");
    assert_eq!(measure::self_intersections(&made.mesh, 9), 0);
    let size = measure::size(&made.mesh);
    assert!(size.closed && size.euler == 2 && size.pieces == 1);
    // Rounding: 5 · 2⁻²⁴ a coordinate, of random sign.
    assert!((report.volume / report.volume_before - 1.0).abs() < 1e-6, "{report:?}");
    // A chord of two edges h, merged at worst, misses a circle of radius r by (2h)²/8r.
    let h = 5.0 * 1.1 / 16.0;
    for p in &made.mesh.vertices {
        assert!((norm(*p) - 5.0).abs() < h * h / 10.0, "{}", norm(*p));
    }
}

#[test]
fn good_triangles_are_left_as_they_are() {
    let first = surface(icosphere(3, 1.0, 0.0));
    let (made, report) = smoothed(&first);
    assert_eq!([report.flipped, report.merged, report.moved], [0; 3]);
    assert_eq!([report.triangles_before, report.triangles], [first.mesh.triangles.len(); 2]);
    assert!((made.mesh.volume() / first.mesh.volume() - 1.0).abs() < 1e-6);
}

#[test]
fn what_is_bounded_by_sharp_edges_alone_keeps_its_corners() {
    let first = surface(join(&[cube([0.0; 3], 2.0), cube([3.0, 0.1, 0.7], 1.0)]));
    let (made, _) = smoothed(&first);
    let sorted = |m: &Mesh| {
        let mut v: Vec<_> = m.vertices.iter().map(|p| p.map(|x| (x as f32).to_bits())).collect();
        v.sort_unstable();
        v
    };
    assert_eq!(sorted(&made.mesh), sorted(&first.mesh));
}

#[test]
fn smoothing_again_changes_little() {
    let (once, first) = smoothed(&surface(with_needles()));
    let (_, again) = smoothed(&once);
    let count = |r: &SmoothReport| r.flipped + r.merged + r.moved;
    assert!(20 * count(&again) < count(&first), "{first:?} {again:?}");
}

#[test]
fn stretched_rings_of_a_torus_improve() {
    // 16 quads around the tube and 240 along it: needles.
    let first = surface(torus(240, 16));
    let (made, report) = smoothed(&first);
    assert!(report.smallest_angle >= report.smallest_angle_before);
    assert_eq!(measure::size(&made.mesh).euler, 0);
    assert_eq!(measure::self_intersections(&made.mesh, 9), 0);
}

#[test]
fn open_and_empty_meshes_are_refused() {
    let mut open = cube([0.0; 3], 1.0);
    open.triangles.pop();
    for mesh in [open, Mesh::default()] {
        assert!(matches!(smooth(&surface(mesh), &Silent), Err(Stopped::Refused(_))));
    }
}
