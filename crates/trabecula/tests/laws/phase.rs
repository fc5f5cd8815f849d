//! Lattices through solved maps: the laws that hold for affine maps hold here, and amounts stay true.

use std::sync::Arc;

use geometry::math::{Aabb, Vec3, determinant, norm, sub};
use geometry::measure::{self_intersections, size};
use geometry::progress::Silent;
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::surface;
use trabecula::field::{Block, Field};
use trabecula::grade::{Formula, Grade};
use trabecula::implicit::Implicit;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Map, Orientation, Phase, PhaseRequest, SolverOptions};
use trabecula::region::{Cuboid, Region};
use trabecula::solid::Solid;

fn formula(text: &str) -> Grade {
    Grade::from(Formula::parse(text).expect("formula"))
}

fn cell(name: &str) -> Arc<Cell> {
    Arc::new(Cell::new(Series::new(named(name).expect(name).terms()).expect(name)))
}

fn map(b: &Aabb, wavelength: [&str; 3], angles: [&str; 3]) -> Map {
    let wanted = PhaseRequest {
        offset: [0.1, 0.2, 0.3],
        ..PhaseRequest::new(wavelength.map(formula), Orientation::Angles(angles.map(formula)))
    };
    Arc::new(Phase::solve(b, &wanted, &SolverOptions::default()).expect("solved"))
}

fn numbers(n: usize) -> impl Iterator<Item = Vec3> {
    (1..=n).map(|i| [0.8191725, 0.6710436, 0.5497005].map(|s| (s * i as f64).fract()))
}

fn inside(b: &Aabb, share: Vec3) -> Vec3 {
    core::array::from_fn(|a| b.min[a] + share[a] * (b.max[a] - b.min[a]))
}

fn boxed(size: Vec3) -> Aabb {
    Aabb { min: [0.0; 3], max: size }
}

/// All that bends, at once: three wavelengths that vary, three angles that vary.
fn bent(b: &Aabb) -> Map {
    map(b, ["3 + 0.1*x", "3.5 + 0.3*sin(z/2)", "4 - 0.05*y"], ["3*z", "4*x", "5*y + 20"])
}

#[test]
fn blocks_equal_points_and_bounds_hold() {
    let b = boxed([12.0, 10.0, 9.0]);
    let map = bent(&b);
    let levels = [
        Level::Iso(Grade::Constant(0.2)),
        Level::Fraction(formula("0.2 + 0.02*x")),
        Level::Thickness(formula("0.3 + 0.02*y")),
    ];
    for level in levels {
        let parts: &[Part] = match level {
            Level::Thickness(_) => &[Part::Sheet],
            _ => &[Part::Sheet, Part::Lower, Part::Upper],
        };
        for &part in parts {
            let whole = Lattice::new(cell("gyroid"), map.clone(), part, level.clone());
            let mut fields: Vec<Arc<dyn Implicit>> = whole.parts();
            fields.push(Arc::new(whole));
            for l in fields {
                // Reaching out of the box on all sides.
                let axis: Vec<f64> = (0..23).map(|i| 0.61 * f64::from(i) - 1.3).collect();
                let block = Block { axes: [&axis, &axis, &axis] };
                let mut out = vec![0f32; block.len()];
                l.fill(&block, &mut out);
                for (i, v) in out.iter().enumerate() {
                    let p = [axis[i % 23], axis[i / 23 % 23], axis[i / 529]];
                    // Single precision of sums of size one.
                    assert!((f64::from(*v) - l.value(p)).abs() < 3e-6);
                }
                for (p, s) in numbers(60).zip(numbers(120).skip(60)) {
                    let p = inside(&b, p.map(|v| 1.2 * v - 0.1));
                    let half = if s[0] < 0.5 { 0.1 } else { 1.5 };
                    let around = Aabb { min: p, max: p }.grown(half * s[1]);
                    let bound = l.bound(&around);
                    for q in numbers(40) {
                        let v = l.value(inside(&around, q));
                        assert!(bound.lo <= v && v <= bound.hi, "{bound:?} {v}");
                    }
                }
            }
        }
    }
}

/// Small boxes get bounds small enough to skip them by.
#[test]
fn bounds_are_of_use() {
    let b = boxed([12.0, 10.0, 9.0]);
    for level in [Level::Fraction(Grade::Constant(0.2)), Level::Thickness(Grade::Constant(0.3))] {
        let l = Lattice::new(cell("gyroid"), bent(&b), Part::Sheet, level);
        let skipped =
            numbers(400).filter(|s| l.bound(&Aabb { min: inside(&b, *s), max: inside(&b, *s) }.grown(0.03)).lo > 0.0);
        let open = numbers(400).filter(|s| l.value(inside(&b, *s)) > 0.3);
        assert!(2 * skipped.count() > open.count());
    }
}

#[test]
fn gradients_agree_with_differences() {
    let b = boxed([12.0, 10.0, 9.0]);
    for level in [Level::Fraction(formula("0.2 + 0.02*x")), Level::Thickness(formula("0.3 + 0.02*y"))] {
        let l = Lattice::new(cell("diamond"), bent(&b), Part::Sheet, level);
        for l in l.parts() {
            for s in numbers(200) {
                let p = inside(&b, s);
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                l.gradients(&[p], &mut v, &mut g);
                assert!((v[0] - l.value(p)).abs() < 1e-12);
                for a in 0..3 {
                    let mut q = [p, p];
                    q[0][a] -= 1e-5;
                    q[1][a] += 1e-5;
                    let d = (l.value(q[1]) - l.value(q[0])) / 2e-5;
                    assert!((d - g[0][a]).abs() < 1e-4, "{d} {}", g[0][a]);
                }
            }
        }
    }
}

/// A gyroid wrapped round a tube is closed across the seam, in one piece, and of the fraction asked for.
#[test]
fn a_tube_closes_over_its_seam() {
    use trabecula::map::Round;
    use trabecula::region::{Cylinder, Difference};
    let tube = |r: f64, z: f64, h: f64| -> Region {
        Arc::new(Cylinder::new([0.0, 0.0, z], [0.0, 0.0, 1.0], r, h).expect("cylinder"))
    };
    let region: Region = Arc::new(Difference::new(vec![tube(8.0, 0.0, 8.0), tube(5.0, -1.0, 10.0)]).expect("tube"));
    // Three cells across the wall and four along the axis, all of them whole.
    let map = Round::cylinder([0.0; 3], [0.0, 0.0, 1.0], [1.0, 2.0], 20.0, [5.0, 6.5, 8.0]).expect("map");
    for level in [Level::Fraction(Grade::Constant(0.35)), Level::Thickness(Grade::Constant(0.25))] {
        let exact = matches!(level, Level::Fraction(_));
        let l: Arc<dyn Implicit> = Arc::new(Lattice::new(cell("gyroid"), Arc::new(map), Part::Sheet, level));
        let solid = Solid::new(region.clone(), Some(l), 1.0);
        let m = size(&surface(&solid, 0.12, &Silent).expect("surface").mesh);
        let share = m.volume / (std::f64::consts::PI * 39.0 * 8.0);
        assert!(m.closed && m.pieces == 1, "{m:?}");
        // Within a cell the volume grows with the radius, by a fifth, where the solid share of the layers swings by some
        // tenths: their product, averaged over the cell.
        assert!(!exact || (share - 0.35).abs() < 0.01, "{share}");
    }
}

/// The solid share of windows two cells wide, smooth at their edges, against the fraction asked for averaged over the same
/// window. Phases are equidistributed on the torus in any window that is large against a cell and small against the
/// change of the Jacobian, so the cell's own table holds under a map that bends.
#[test]
fn graded_fractions_are_met_through_the_map() {
    let b = boxed([32.0, 24.0, 16.0]);
    let asked = formula("0.2 + 0.006*x + 0.1*sin(y/8)");
    let map = map(&b, ["2.0 + 0.02*x", "2.0 + 0.02*x", "2.0 + 0.02*x"], ["0*x", "1*y", "2.2*x"]);
    let mut worst = (0.0f64, 0.0f64);
    for name in ["primitive", "gyroid", "iwp"] {
        for part in [Part::Lower, Part::Sheet] {
            let l = Lattice::new(cell(name), map.clone(), part, Level::Fraction(asked.clone()));
            for at in [[7.0, 6.0, 8.0], [16.0, 12.0, 8.0], [26.0, 17.0, 7.0]] {
                // cos² windows: their transform is flat zero where the waves of the lattice are.
                let (n, half) = (64usize, 4.0 * 1.25);
                let axis: [Vec<f64>; 3] = core::array::from_fn(|a| {
                    (0..n).map(|i| at[a] + half * ((i as f64 + 0.5) / n as f64 * 2.0 - 1.0)).collect()
                });
                let weight: Vec<f64> =
                    (0..n).map(|i| ((i as f64 + 0.5) / n as f64 * std::f64::consts::PI).sin().powi(4)).collect();
                let block = Block { axes: [&axis[0], &axis[1], &axis[2]] };
                let mut out = vec![0f32; block.len()];
                l.fill(&block, &mut out);
                let points: Vec<Vec3> =
                    (0..n * n * n).map(|i| [axis[0][i % n], axis[1][i / n % n], axis[2][i / n / n]]).collect();
                let mut want = vec![0.0; points.len()];
                asked.values(&points, &mut want);
                let (mut sum, mut solid, mut mean) = (0.0, 0.0, 0.0);
                for i in 0..n * n * n {
                    let w = weight[i % n] * weight[i / n % n] * weight[i / n / n];
                    sum += w;
                    mean += w * want[i];
                    // The share of a voxel that is solid, from its value and a typical slope, takes the noise of counting away.
                    solid += w * f64::from(u8::from(out[i] <= 0.0));
                }
                let miss = (solid - mean).abs() / sum;
                worst = if part == Part::Sheet { (worst.0, worst.1.max(miss)) } else { (worst.0.max(miss), worst.1) };
                assert!(miss < 0.005, "{name} {part:?} at {at:?}: {} for {}", solid / sum, mean / sum);
            }
        }
    }
    println!("fraction missed by at most {:.4} (networks), {:.4} (sheets)", worst.0, worst.1);
}

/// Walls of a given thickness stay that thick where the map stretches cells: a point of the wall's face is followed along
/// the normal of the mid-surface to the mid-surface.
#[test]
fn thickness_is_true_through_the_jacobian() {
    let b = boxed([16.0, 12.0, 10.0]);
    let map = map(&b, ["4 + 0.1*x", "4 + 0.1*x", "4 + 0.1*x"], ["0*x", "0*y", "3*x"]);
    let (mut errors, mut plain) = (Vec::new(), Vec::new());
    let w = 0.4;
    let l = Lattice::new(cell("gyroid"), map.clone(), Part::Sheet, Level::Thickness(Grade::Constant(w)));
    let mid = Lattice::new(cell("gyroid"), map.clone(), Part::Lower, Level::Iso(Grade::Constant(0.0)));
    let gradient = |l: &Lattice, p: Vec3| {
        let (mut v, mut g) = ([0.0], [[0.0; 3]]);
        l.core_gradients(&[p], &mut v, &mut g);
        (v[0], g[0])
    };
    for s in numbers(1500) {
        let mut p = inside(&b, s.map(|v| 0.1 + 0.8 * v));
        // To the mid-surface, then half a thickness along its normal.
        for _ in 0..12 {
            let (v, g) = gradient(&mid, p);
            p = sub(p, g.map(|c| c * v / norm(g).powi(2)));
        }
        let (v, g) = gradient(&mid, p);
        if v.abs() > 1e-9 || b.distance(p) > 0.0 {
            continue;
        }
        let n = g.map(|c| c / norm(g));
        let q: Vec3 = core::array::from_fn(|a| p[a] + w / 2.0 * n[a]);
        let core = gradient(&l, q).0.abs();
        errors.push((core / (w / 2.0) - 1.0).abs());
        let scale = (determinant(&map.jacobian(q)) / determinant(&map.typical())).cbrt();
        plain.push((core * scale / (w / 2.0) - 1.0).abs());
    }
    errors.sort_by(f64::total_cmp);
    let p95 = errors[errors.len() * 95 / 100];
    let worst = errors[errors.len() - 1];
    println!(
        "thickness: {} walls, 95 % within {p95:.4}, worst {worst:.4}; blind to the Jacobian {:.4}",
        errors.len(),
        plain.iter().sum::<f64>() / plain.len() as f64
    );
    assert!(errors.len() > 500 && worst < 0.05, "{worst}");
}

/// The surface of an oriented, graded sheet is closed and holds what the field holds.
#[test]
fn surfaces_are_closed_and_hold_the_solid() {
    let edges = [10.0, 8.0, 6.0];
    let b = boxed(edges);
    for (part, level) in [
        (Part::Sheet, Level::Fraction(formula("0.2 + 0.02*x"))),
        (Part::Upper, Level::Fraction(formula("0.3 + 0.02*y"))),
        (Part::Sheet, Level::Thickness(Grade::Constant(0.35))),
    ] {
        let l: Arc<dyn Implicit> = Arc::new(Lattice::new(cell("gyroid"), bent(&b), part, level));
        let region: Region = Arc::new(Cuboid::new([0.0; 3], edges).expect("box"));
        let solid = Solid::new(region, Some(l.clone()), 3.0);
        let found = surface(&solid, 0.15, &Silent).expect("surface");
        let m = size(&found.mesh);
        assert!(m.closed && self_intersections(&found.mesh, 1) == 0);
        let n = 120_000;
        let hits = numbers(n).filter(|s| l.value(inside(&b, *s)) <= 0.0).count();
        let sampled = hits as f64 / n as f64 * 480.0;
        // Quasi-random points: about n^(-2/3) of the box.
        assert!((m.volume - sampled).abs() < 0.001 * 480.0, "{} {sampled}", m.volume);
    }
}
