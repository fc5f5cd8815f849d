//! Smoothed meshes: every guarantee, features, volume, and how good their triangles are.

use std::sync::Arc;

use geometry::math::Vec3;
use geometry::measure::{quality, size};
use geometry::progress::Silent;
use geometry::smooth::{SmoothReport, smooth};
use geometry::surface_mesh::SurfaceMesh;
use proptest::prelude::*;
use trabecula::cell::Part;
use trabecula::extract::surface;
use trabecula::field::Field;
use trabecula::region::{Cylinder, Region};
use trabecula::solid::Solid;

use crate::common::{cases, check, cuboid, drawn, lattice, region, rounded, rows, solid};

/// Smooths, and holds the result to every promise.
fn held(what: &str, s: &SurfaceMesh) -> (SurfaceMesh, SmoothReport) {
    let Ok((made, report)) = smooth(s, &Silent) else { panic!("{what}: refused") };
    check(what, &made);
    let (a, b) = (size(&rounded(&s.mesh)), size(&made.mesh));
    assert_eq!((a.euler, a.pieces, a.cavities), (b.euler, b.pieces, b.cavities), "{what}");
    assert_eq!([report.triangles_before, report.triangles], [s.mesh.triangles.len(), made.mesh.triangles.len()]);
    assert!((report.volume - b.volume).abs() <= 1e-9 * b.volume.abs(), "{what}");
    let found = quality(&made.mesh).expect("triangles");
    assert_eq!(
        [report.smallest_angle, report.smallest_angle_p05],
        [found.smallest_angle, found.smallest_angle_p05],
        "{what}"
    );
    (made, report)
}

fn of(solid: &Solid, edge: f64) -> SurfaceMesh {
    surface(solid, edge, &Silent).expect("surface")
}

#[test]
fn named_cells_in_a_box_have_good_triangles_and_their_fraction() {
    let whole: Region = cuboid([0.0; 3], [1.0; 3]);
    for name in trabecula::cell::catalogue().iter().map(|c| c.name) {
        let made = solid(whole.clone(), Some(lattice(name, Part::Sheet, 0.3, [1.0; 3], [0.0; 3])));
        let first = of(&made, 1.0 / 32.0);
        let (smoothed, report) = held(name, &first);
        println!(
            "{name}: 5th percentile {:.2}° to {:.2}°, least {:.3}° to {:.2}°, volume {:+.1e}, {} of {} triangles",
            report.smallest_angle_p05_before,
            report.smallest_angle_p05,
            report.smallest_angle_before,
            report.smallest_angle,
            report.volume / report.volume_before - 1.0,
            report.triangles,
            report.triangles_before,
        );
        assert!(report.smallest_angle_p05 > 15.0, "{name}: {report:?}");
        assert!((report.volume / report.volume_before - 1.0).abs() < 1e-4, "{name}: {report:?}");
        let (a, b) = (first.mesh.bounds(), smoothed.mesh.bounds());
        assert_eq!((a.min, a.max), (b.min, b.max), "{name}");
        // What is cut lies on the box, to the last bit.
        for (t, cut) in smoothed.mesh.triangles.iter().zip(&smoothed.cut) {
            let on = |k: usize, at: f64| t.iter().all(|v| smoothed.mesh.vertices[*v as usize][k] == at);
            assert!(!cut || (0..3).any(|k| on(k, 0.0) || on(k, 1.0)), "{name}");
        }
    }
}

/// The greatest distance of vertices that are on the lattice alone from its surface, to first order, mm.
fn off(solid: &Solid, s: &SurfaceMesh) -> f64 {
    let mut cut = vec![false; s.mesh.vertices.len()];
    for (t, c) in s.mesh.triangles.iter().zip(&s.cut) {
        t.iter().for_each(|v| cut[*v as usize] |= c);
    }
    let points: Vec<Vec3> = s.mesh.vertices.iter().zip(cut).filter(|(_, c)| !c).map(|(p, _)| *p).collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    solid.gradients(&points, &mut values, &mut gradients);
    let each = values.iter().zip(&gradients).map(|(v, g)| v.abs() / geometry::math::norm(*g));
    each.fold(0.0, f64::max)
}

#[test]
fn vertices_stay_on_the_surface_to_second_order() {
    let whole: Region = cuboid([0.0; 3], [1.0; 3]);
    let made = solid(whole, Some(lattice("gyroid", Part::Lower, 0.5, [1.0; 3], [0.0; 3])));
    let found: Vec<[f64; 2]> = [16.0, 32.0, 64.0]
        .map(|n| {
            let first = of(&made, 1.0 / n);
            let (smoothed, _) = held("gyroid", &first);
            let found = [off(&made, &first), off(&made, &smoothed)];
            println!("1/{n}: {found:?} mm off");
            found
        })
        .to_vec();
    // The greatest curvature of this gyroid is about 2π/λ: a chord over two steps misses it by (2h)²κ/8.
    for (n, [_, after]) in [16.0, 32.0, 64.0f64].iter().zip(found) {
        assert!(after < 2.0 * std::f64::consts::PI / 2.0 / (n * n), "1/{n}: {after}");
    }
}

/// The greatest distance of cuts on the barrel of a cylinder about z from it, mm.
fn off_barrel(s: &SurfaceMesh, r: f64, caps: [f64; 2]) -> f64 {
    let mut most = 0.0f64;
    for (t, _) in s.mesh.triangles.iter().zip(&s.cut).filter(|(_, cut)| **cut) {
        let corners = t.map(|v| s.mesh.vertices[v as usize]);
        if !caps.iter().any(|z| corners.iter().all(|p| p[2] == *z)) {
            most = corners.iter().fold(most, |m, p| m.max((p[0].hypot(p[1]) - r).abs()));
        }
    }
    most
}

#[test]
fn a_cylinder_keeps_its_caps_and_its_radius() {
    let (r, h) = (1.0, 1.25);
    let region: Region = Arc::new(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], r, h).expect("cylinder"));
    let made = solid(region, Some(lattice("diamond", Part::Sheet, 0.3, [1.0; 3], [0.0; 3])));
    for n in rows(2, [16.0, 32.0, 64.0]) {
        let first = of(&made, 1.0 / n);
        let (smoothed, report) = held("cylinder", &first);
        assert!(report.smallest_angle_p05 > 15.0, "{report:?}");
        let bounds = smoothed.mesh.bounds();
        assert_eq!((bounds.min[2], bounds.max[2]), (0.0, h));
        let [before, after] = [&first, &smoothed].map(|s| off_barrel(s, r, [0.0, h]) * n * n);
        println!("cylinder at 1/{n}: {before:.3} and {after:.3} steps² off");
        // Chords over two steps, (2h)²/8r, on top of what the grid left.
        assert!(after < before + 0.5 / r, "1/{n}: {after}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(6) as u32))]

    /// Six designs in `make test`, as many as asked for in `make campaign`.
    #[test]
    fn random_designs_keep_every_guarantee(
        d in drawn(),
        kind in 0..7usize,
        (r, s, t) in (0.6..1.0f64, -0.3..0.3f64, 0.5..0.9f64),
        step in 0.02..0.09f64,
    ) {
        let made = solid(region(kind, r, s, t), Some(d.lattice()));
        let Ok(first) = surface(&made, step, &Silent) else { return Ok(()) };
        let what = format!("{d:?} in {kind} at {step}");
        let (smoothed, report) = held(&what, &first);
        prop_assert!(report.smallest_angle_p05 >= report.smallest_angle_p05_before, "{what}");
        // A vertex leaves no plane of the bounds; on round ones a chord is cut.
        let (a, b) = (first.mesh.bounds(), smoothed.mesh.bounds());
        for k in 0..3 {
            prop_assert!((a.min[k] - b.min[k]).abs() <= step && (a.max[k] - b.max[k]).abs() <= step, "{what}");
        }
    }
}
