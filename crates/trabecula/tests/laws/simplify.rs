//! Simplified meshes: what they guarantee, how light they get, how far they are from the first.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::Arc;

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use geometry::measure::size;
use geometry::mesh::Mesh;
use geometry::progress::{Progress, Silent, Stopped};
use geometry::simplify::{Goal, SimplifyReport, simplify};
use geometry::surface_mesh::SurfaceMesh;
use proptest::prelude::*;
use trabecula::cell::Part;
use trabecula::extract::surface;
use trabecula::grade::Grade;
use trabecula::lattice::Level;
use trabecula::region::{Cuboid, Cylinder, Region};

use crate::common::{ball, cases, check, drawn, lattice_at, region, solid};

fn cube(edge: f64) -> Region {
    Arc::new(Cuboid::new([0.0; 3], [edge; 3]).expect("box"))
}

/// The distance of a point from a triangle, by its own plane and sides: nothing of the code under test.
fn distance(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let n = cross(sub(b, a), sub(c, a));
    let corners = [a, b, c];
    let within = (0..3).all(|k| {
        let (s, t) = (corners[k], corners[(k + 1) % 3]);
        dot(cross(sub(t, s), sub(p, s)), n) >= 0.0
    });
    if within && norm(n) > 0.0 {
        return dot(sub(p, a), n).abs() / norm(n);
    }
    let sides = (0..3).map(|k| {
        let (s, t) = (corners[k], corners[(k + 1) % 3]);
        let (d, e) = (sub(t, s), sub(p, s));
        let along = (dot(d, e) / dot(d, d)).clamp(0.0, 1.0);
        norm(sub(e, scale(d, along)))
    });
    sides.fold(f64::INFINITY, f64::min)
}

/// The farthest that a point of `from` is from `to`, over some 36 points of each triangle; infinite beyond `reach`.
fn farthest(from: &Mesh, to: &Mesh, reach: f64) -> f64 {
    let step = (to.area() / to.triangles.len() as f64).sqrt() * 2.0 + reach;
    let cell = |p: Vec3| p.map(|x| (x / step).floor() as i32);
    let mut grid: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
    for t in 0..to.triangles.len() {
        let corners = to.corners(t);
        let (lo, hi) = corners.iter().fold((corners[0], corners[0]), |(lo, hi), p| {
            let each = |f: fn(f64, f64) -> f64, q: Vec3| [0, 1, 2].map(|k| f(q[k], p[k]));
            (each(f64::min, lo), each(f64::max, hi))
        });
        let (lo, hi) = (cell(lo.map(|x| x - reach)), cell(hi.map(|x| x + reach)));
        for x in lo[0]..=hi[0] {
            for y in lo[1]..=hi[1] {
                for z in lo[2]..=hi[2] {
                    grid.entry([x, y, z]).or_default().push(t);
                }
            }
        }
    }
    // Large triangles get more points.
    let longest = |c: [Vec3; 3]| (0..3).map(|k| norm(sub(c[k], c[(k + 1) % 3]))).fold(0.0, f64::max);
    let mut most = 0.0f64;
    for t in 0..from.triangles.len() {
        let c = from.corners(t);
        let n = ((longest(c) / (0.3 * step)).ceil() as u32).clamp(2, 12);
        for i in 0..=n {
            for j in 0..=n - i {
                let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let p = add(c[0], add(scale(sub(c[1], c[0]), s), scale(sub(c[2], c[0]), t)));
                let near = grid.get(&cell(p)).into_iter().flatten();
                let d = near.map(|t| distance(p, to.corners(*t))).fold(f64::INFINITY, f64::min);
                most = most.max(d);
            }
        }
    }
    most
}

/// Simplifies, and holds the result to every promise. Gives the distance that was measured, too.
fn held(what: &str, s: &SurfaceMesh, goal: Goal) -> (SurfaceMesh, SimplifyReport, f64) {
    let (made, report) = simplify(s, &goal, &Silent).expect(what);
    check(what, &made);
    let (a, b) = (size(&s.mesh), size(&made.mesh));
    assert_eq!((a.euler, a.pieces, a.cavities), (b.euler, b.pieces, b.cavities), "{what}");
    assert_eq!([report.triangles_before, report.triangles], [s.mesh.triangles.len(), made.mesh.triangles.len()]);
    assert!((report.volume - b.volume).abs() <= 1e-9 * b.volume.abs(), "{what}");
    // Rounding of the measurement itself.
    let limit = report.deviation + 1e-9;
    let reach = if limit < 1.0 { limit } else { 1.0 };
    let found = farthest(&s.mesh, &made.mesh, reach).max(farthest(&made.mesh, &s.mesh, reach));
    assert!(found <= limit, "{what}: {found} mm away, {limit} promised");
    if let Some(t) = goal.tolerance {
        assert!(report.deviation <= t, "{what}: {} of {t}", report.deviation);
    }
    (made, report, found)
}

fn within(tolerance: f64) -> Goal {
    Goal { tolerance: Some(tolerance), ..Goal::default() }
}

fn down_to(triangles: usize) -> Goal {
    Goal { triangles: Some(triangles), ..Goal::default() }
}

fn of(region: Region, edge: f64) -> SurfaceMesh {
    surface(&solid(region, None), edge, &Silent).expect("surface")
}

#[test]
fn a_cube_comes_down_to_twelve_triangles() {
    for (min, edge) in [([0.0; 3], 0.05), ([-0.3, 0.1, 7.7], 0.13)] {
        let max = add(min, [1.0, 1.0, 1.0]);
        let fine = of(Arc::new(Cuboid::new(min, max).expect("box")), edge);
        let (made, report, _) = held("cube", &fine, within(0.01));
        assert_eq!((made.mesh.triangles.len(), made.mesh.vertices.len()), (12, 8));
        // Corners are moved to single precision, at most 7.7 · 2⁻²⁴ each way.
        assert!(report.deviation < 2e-6 && (made.mesh.volume() - 1.0).abs() < 1e-5);
        assert!(made.cut.iter().all(|c| *c));
    }
}

#[test]
fn a_ball_needs_triangles_in_inverse_proportion_to_the_tolerance() {
    let fine = of(ball([0.0; 3], 1.0), 0.02);
    let counts = [0.02, 0.01, 0.005].map(|t| {
        let (made, report, found) = held("ball", &fine, within(t));
        println!("ball {t}: {:?}, {:.5} promised, {found:.5} found", report.triangles, report.deviation);
        assert!(found > t / 10.0, "far too careful");
        // The volume is kept by every collapse, but for rounding.
        assert!((report.volume / report.volume_before - 1.0).abs() < 1e-6);
        made.mesh.triangles.len() as f64
    });
    for w in counts.windows(2) {
        assert!((1.6..2.4).contains(&(w[1] / w[0])), "{counts:?}");
    }
}

#[test]
fn a_cylinder_keeps_its_rims() {
    let (r, h) = (1.0, 0.6);
    let region = Arc::new(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], r, h).expect("cylinder"));
    let fine = of(region, 0.03);
    let (made, report, _) = held("cylinder", &fine, within(0.01));
    println!("cylinder: {:?}", report.triangles);
    assert!(report.triangles * 15 < report.triangles_before, "{report:?}");
    // Every vertex that stands at the height of a cap is on the cap's rim, and caps are flat.
    let caps = made.mesh.triangles.iter().filter(|t| {
        let z = t.map(|v| made.mesh.vertices[v as usize][2]);
        z[0] == z[1] && z[1] == z[2]
    });
    let area: f64 = caps
        .map(|t| {
            let [a, b, c] = t.map(|v| made.mesh.vertices[v as usize]);
            norm(cross(sub(b, a), sub(c, a))) / 2.0
        })
        .sum();
    assert!((area / (2.0 * PI * r * r) - 1.0).abs() < 0.02, "{area}");
    // The rims carry nearly all; a few vertices stay inside a cap, where triangles would be needles without them.
    let radii = made.mesh.vertices.iter().map(|v| v[0].hypot(v[1]));
    let inside = radii.clone().filter(|q| *q < r - 0.011).count();
    assert!(inside * 10 < made.mesh.vertices.len(), "{inside} of {}", made.mesh.vertices.len());
    assert!(radii.fold(0.0, f64::max) < r + 0.011);
}

#[test]
fn what_is_simplified_in_blocks_keeps_every_guarantee() {
    // More triangles than a block has: faces, edges and a lattice that blocks cut across.
    let field = lattice_at("gyroid", Part::Sheet, Level::Fraction(Grade::Constant(0.4)), [1.0; 3], [0.0; 3]);
    let fine = surface(&solid(cube(2.0), Some(field)), 1.0 / 60.0, &Silent).expect("surface");
    assert!(fine.mesh.triangles.len() > 300_000);
    let (made, report, _) = held("gyroid", &fine, within(0.004));
    println!("gyroid in blocks: {:?}", report.triangles);
    assert!(report.triangles * 3 < report.triangles_before, "{report:?}");
    for (i, cut) in made.cut.iter().enumerate() {
        let corners = made.mesh.corners(i);
        let flat = (0..3).any(|k| [0.0, 2.0].iter().any(|x| corners.iter().all(|p| p[k] == *x)));
        assert_eq!(flat, *cut, "{corners:?}");
    }
    // The faces of blocks leave no trace: a cube's come down to its own twelve triangles.
    let fine = of(cube(1.0), 1.0 / 170.0);
    assert!(fine.mesh.triangles.len() > 300_000);
    let (made, _) = simplify(&fine, &within(0.01), &Silent).expect("cube");
    check("cube", &made);
    assert_eq!(made.mesh.triangles.len(), 12);
}

#[test]
fn a_number_of_triangles_is_met() {
    let field = lattice_at("gyroid", Part::Sheet, Level::Fraction(Grade::Constant(0.3)), [1.0; 3], [0.0; 3]);
    let fine = surface(&solid(cube(1.0), Some(field)), 1.0 / 24.0, &Silent).expect("surface");
    let n = fine.mesh.triangles.len();
    let mut last = 0.0;
    for target in [n * 3 / 4, n / 2, n / 4] {
        let (made, report, _) = held("gyroid", &fine, down_to(target));
        let left = made.mesh.triangles.len();
        assert!(left <= target && left + 2 > target, "{left} for {target}");
        assert!(report.deviation > last);
        last = report.deviation;
    }
    // Enough already: as it is.
    let (same, report) = simplify(&fine, &down_to(n), &Silent).expect("as it is");
    assert!(same == fine && report.deviation == 0.0 && [report.triangles_before, report.triangles] == [n, n]);
    // Both: the first that is reached.
    let both = Goal { tolerance: Some(1e-3), triangles: Some(4) };
    assert_eq!(
        simplify(&fine, &both, &Silent).expect("both").0,
        simplify(&fine, &within(1e-3), &Silent).expect("one").0
    );
}

#[test]
fn cuts_stay_what_they_are() {
    let field = lattice_at("gyroid", Part::Sheet, Level::Fraction(Grade::Constant(0.35)), [1.0; 3], [0.0; 3]);
    let fine = surface(&solid(cube(1.5), Some(field)), 1.0 / 32.0, &Silent).expect("surface");
    let (made, report, _) = held("gyroid", &fine, within(0.005));
    println!("gyroid: {:?}", report.triangles);
    let area = |s: &SurfaceMesh, cut: bool| -> f64 {
        let own = (0..s.cut.len()).filter(|i| s.cut[*i] == cut);
        own.map(|i| {
            let [a, b, c] = s.mesh.corners(i);
            norm(cross(sub(b, a), sub(c, a))) / 2.0
        })
        .sum()
    };
    for cut in [true, false] {
        let ratio = area(&made, cut) / area(&fine, cut);
        assert!((ratio - 1.0).abs() < 0.01, "{cut}: {ratio}");
    }
    // The faces of the box are flat and stay exactly where they are.
    for (i, cut) in made.cut.iter().enumerate() {
        let corners = made.mesh.corners(i);
        let flat = (0..3).any(|k| [0.0, 1.5].iter().any(|x| corners.iter().all(|p| p[k] == *x)));
        assert_eq!(flat, *cut, "{corners:?}");
    }
}

#[test]
fn same_bytes_for_any_number_of_threads() {
    let field = lattice_at("diamond", Part::Sheet, Level::Fraction(Grade::Constant(0.3)), [1.0; 3], [5.0, 15.0, 25.0]);
    let fine = surface(&solid(ball([0.0; 3], 1.0), Some(field)), 0.05, &Silent).expect("surface");
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| simplify(&fine, &within(0.01), &Silent).expect("simplified"))
    };
    assert!(run(1) == run(3));
}

#[test]
fn what_cannot_be_done_is_refused_with_numbers() {
    let fine = of(cube(1.0), 0.1);
    let refused = |s: &SurfaceMesh, goal: Goal| match simplify(s, &goal, &Silent) {
        Err(Stopped::Refused(f)) => f.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(refused(&fine, Goal::default()).contains("give a tolerance"));
    for t in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(&fine, within(t)).starts_with("tolerance: is "));
    }
    assert!(refused(&fine, within(1e-9)).contains("single precision"));
    assert_eq!(refused(&fine, down_to(3)), "triangles: is 3; a closed mesh has at least 4");
    let mut open = fine.clone();
    open.mesh.triangles.pop();
    open.cut.pop();
    assert!(refused(&open, within(0.1)).contains("3 edges with one triangle"));
    let mut crossed = fine.clone();
    let n = crossed.mesh.vertices.len() as u32;
    let shifted = fine.mesh.vertices.iter().map(|p| add(*p, [0.53, 0.51, 0.57]));
    crossed.mesh.vertices.extend(shifted);
    crossed.mesh.triangles.extend(fine.mesh.triangles.iter().map(|t| t.map(|v| v + n)));
    crossed.cut.extend(fine.cut.iter());
    assert!(refused(&crossed, within(0.1)).contains("intersecting pairs of triangles"));

    struct Never;
    impl Progress for Never {
        fn step(&self, _: u64, _: u64) -> bool {
            false
        }
    }
    let many = of(ball([0.0; 3], 1.0), 0.05);
    assert!(matches!(simplify(&many, &within(0.05), &Never), Err(Stopped::Interrupted)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(6) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any cell, part, fraction, orientation and region, however coarse the grid and however large the tolerance.
    /// 40 cases in `make campaign`.
    #[test]
    fn random_solids_keep_every_guarantee(
        kind in 0..7usize,
        shape in (0.5..1.5f64, -0.4..0.4f64, 0.2..1.0f64),
        drawn in drawn(),
        edge in 0.05..0.3f64,
        tolerance in 0.002..0.3f64,
        share in 0.05..0.9f64,
    ) {
        let region = region(kind, shape.0, shape.1, shape.2);
        let field = drawn.lattice();
        let s = match surface(&solid(region, Some(field)), edge, &Silent) {
            // So little may be there that no node of the grid meets it, as the law of random surfaces shows.
            Err(Stopped::Refused(f)) if f.message.starts_with("no surface") => return Ok(()),
            made => made.expect("surface"),
        };
        let text = format!("{drawn:?} region {kind} {shape:?} edge {edge}");
        held(&format!("{text} tolerance {tolerance}"), &s, within(tolerance));
        let target = ((s.mesh.triangles.len() as f64 * share) as usize).max(4);
        held(&format!("{text} down to {target}"), &s, down_to(target));
    }
}
