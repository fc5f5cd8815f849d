//! Sweeps: what they are on lines that are known, and what is refused.

use super::*;
use crate::region::Sphere;

fn ring(n: usize, radius: f64) -> Vec<Vec3> {
    let turn = |i: usize| core::f64::consts::TAU * i as f64 / n as f64;
    (0..n).map(|i| [radius * turn(i).cos(), radius * turn(i).sin(), 0.0]).collect()
}

fn wave() -> Vec<Vec3> {
    (0..9).map(|i| f64::from(i) * 5.0).map(|x| [x, 4.0 * (x / 7.0).sin(), 3.0 * (x / 9.0).cos()]).collect()
}

fn phase(map: &Sweep, p: Vec3) -> Vec3 {
    let mut u = [[0.0; 3]];
    map.phases(&[p], &mut u);
    u[0]
}

fn path(points: Vec<Vec3>, closed: bool) -> Path {
    Path { points, closed, wavelength: [2.0, 2.5, 3.0], normal: None }
}

/// Positions about the line, none farther than `far`.
fn about(points: &[Vec3], far: f64) -> Vec<Vec3> {
    let each = (0..600).map(|i| {
        let s = [0.8191725, 0.6710436, 0.5497005, 0.3247].map(|s| (s * f64::from(i)).fract());
        let k = (s[3] * (points.len() - 1) as f64) as usize;
        let off = [0, 1, 2].map(|a| far / 3f64.sqrt() * (2.0 * s[a] - 1.0));
        add(points[k], off)
    });
    each.collect()
}

fn tube(line: Vec<Vec3>, closed: bool) -> (Sweep, Vec<Vec3>) {
    let samples = about(&line, 1.6);
    // All sampled positions, and no others.
    let region = Sphere::new([0.0; 3], 1e-3).expect("ball");
    (Sweep::new(&path(line, closed), &region, &samples).expect("map"), samples)
}

#[test]
fn a_straight_line_is_the_affine_map() {
    let line = vec![[1.0, 2.0, 3.0], [1.0, 2.0, 5.0], [1.0, 2.0, 11.0]];
    let mut target = path(line.clone(), false);
    target.normal = Some([1.0, 0.0, 0.5]);
    let ball = Sphere::new([1.0, 2.0, 5.0], 20.0).expect("ball");
    let samples = about(&line, 9.0);
    let map = Sweep::new(&target, &ball, &samples).expect("map");
    for p in samples {
        let want = [(p[0] - 1.0) / 2.0, (p[1] - 2.0) / 2.5, (p[2] - 3.0) / 3.0];
        assert!(norm(sub(phase(&map, p), want)) < 1e-12, "{p:?}");
    }
    assert_eq!(map.wavelengths(), [2.0, 3.0]);
}

/// The Jacobian is that of the phases, phases lead back, and none is steeper than its bound.
#[test]
fn slopes_places_and_bounds_agree() {
    for (line, closed) in [(wave(), false), (ring(10, 9.0), true)] {
        let (map, samples) = tube(line, closed);
        for p in &samples {
            let j = map.jacobian(*p);
            for a in 0..3 {
                let (mut lo, mut hi) = (*p, *p);
                lo[a] -= 1e-5;
                hi[a] += 1e-5;
                let mut d = sub(phase(&map, hi), phase(&map, lo));
                // Round a closed line phases begin anew.
                d[2] -= (d[2] / 1e-1).round() * 1e-1;
                for i in 0..3 {
                    // The error of frames between sample points is of fourth order in their distance.
                    assert!((d[i] / 2e-5 - j[i][a]).abs() < 2e-4, "{closed} {p:?} {i}{a}");
                }
            }
            let back = map.position(phase(&map, *p), *p).expect("position");
            assert!(norm(sub(back, *p)) < 1e-7, "{closed} {p:?} {back:?}");
            let b = Aabb { min: *p, max: p.map(|x| x + 0.2) };
            let steep = geometry::math::spectral_norm(&map.jacobian(p.map(|x| x + 0.13)));
            assert!(steep <= map.lipschitz(&b) * (1.0 + 1e-9), "{closed} {p:?}");
        }
    }
}

/// A phase depends on the position alone, not on those it is evaluated with; its foot is the nearest point of the line.
#[test]
fn batches_are_single_points_and_feet_are_nearest() {
    for (line, closed) in [(wave(), false), (ring(10, 9.0), true)] {
        let (map, samples) = tube(line, closed);
        let mut u = vec![[0.0; 3]; samples.len()];
        // Along rows most feet of a batch are on one span.
        let row: Vec<Vec3> = (0..samples.len()).map(|i| [0.07 * i as f64 - 5.0, 0.3, -0.2]).collect();
        for points in [&samples, &row] {
            map.phases(points, &mut u);
            for (p, u) in points.iter().zip(&u) {
                assert_eq!(*u, phase(&map, *p));
            }
        }
        for p in &samples {
            let away = map.away(*p);
            let nearest =
                map.line.sample_points.iter().map(|k| norm(sub(*p, k.position))).fold(f64::INFINITY, f64::min);
            assert!(away <= nearest + 1e-12, "{closed} {p:?} {away} {nearest}");
        }
    }
}

/// Round a ring the frame comes back, whole cells fit, and phases are those of the cylinder map.
#[test]
fn a_ring_closes_with_whole_cells() {
    let (map, samples) = tube(ring(24, 9.0), true);
    // A spline through 24 points is the circle to about (2π/24)⁴/384.
    assert!((map.length() / (18.0 * core::f64::consts::PI) - 1.0).abs() < 1e-4);
    let count = map.around().expect("closed");
    assert_eq!(count, 19);
    assert!((map.length() / map.edges()[2] - f64::from(count)).abs() < 1e-12);
    for p in samples {
        let u = phase(&map, p);
        let turned = p[1].atan2(p[0]) / core::f64::consts::TAU * f64::from(count);
        let off = u[2] - turned;
        assert!((off - (off / f64::from(count)).round() * f64::from(count)).abs() < 5e-3);
        let (r, z) = (p[0].hypot(p[1]) - 9.0, p[2]);
        let across = (u[0] * 2.0).hypot(u[1] * 2.5);
        assert!((across - r.hypot(z)).abs() < 2e-3);
    }
}

#[test]
fn folds_tears_and_slips_are_refused() {
    let fault = |line: Vec<Vec3>, closed: bool, radius: f64, center: Vec3| {
        let ball = Sphere::new(center, radius).expect("ball");
        let samples = about(&[center], 3f64.sqrt() * radius);
        let samples: Vec<Vec3> = samples.into_iter().filter(|p| ball.value(*p) <= 0.0).collect();
        Sweep::new(&path(line, closed), &ball, &samples).err().map(|f| (f.at, f.message))
    };
    // The centre of a ring.
    let (at, words) = fault(ring(12, 6.0), true, 8.0, [0.0; 3]).expect("refused");
    assert!(at == "points" && (words.contains("folds") || words.contains("tears")), "{words}");
    // In the middle between two legs.
    let legs = vec![[0.0, 0.0, 0.0], [0.0, 0.0, 20.0], [6.0, 0.0, 26.0], [12.0, 0.0, 20.0], [12.0, 0.0, 0.0]];
    let (_, words) = fault(legs.clone(), false, 5.0, [6.0, 0.0, 2.0]).expect("refused");
    assert!(words.contains("tears"), "{words}");
    assert!(fault(legs, false, 3.0, [0.0, 0.0, 4.0]).is_none());
    for (line, closed) in [
        (vec![[0.0; 3]], false),
        (vec![[0.0; 3], [1.0, 0.0, 0.0]], true),
        (vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], false),
        (vec![[0.0; 3], [f64::NAN, 0.0, 0.0]], false),
    ] {
        assert_eq!(fault(line, closed, 1.0, [0.0; 3]).expect("refused").0, "points");
    }
    let ball = Sphere::new([0.0; 3], 1.0).expect("ball");
    let mut along = path(wave(), false);
    let first = sub(along.points[1], along.points[0]);
    along.wavelength[1] = 0.0;
    assert_eq!(Sweep::new(&along, &ball, &[]).expect_err("refused").at, "wavelength");
    let straight = Path { normal: Some(first), ..path(vec![[0.0; 3], first], false) };
    assert_eq!(Sweep::new(&straight, &ball, &[]).expect_err("refused").at, "normal");
}
