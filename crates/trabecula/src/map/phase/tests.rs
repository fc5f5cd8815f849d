use super::super::phase_grid::PhaseGrid;
use super::super::solution_quality::compared;
use super::*;
use crate::grade::Grade;
use crate::grade::{Formula, Linear};
use crate::map::Affine;
use crate::map::{Aligned, Orientation};
use geometry::math::dot;
use geometry::math::{cross, sub};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

fn formula(text: &str) -> Grade {
    Grade::from(Formula::parse(text).expect("formula"))
}

fn bounds(min: Vec3, max: Vec3) -> Aabb {
    Aabb { min, max }
}

fn about_z(angle: &str, wavelength: Grade) -> PhaseRequest {
    let zero = || Grade::Constant(0.0);
    PhaseRequest::new(
        [wavelength.clone(), wavelength.clone(), wavelength],
        Orientation::Angles([zero(), zero(), formula(angle)]),
    )
}

fn at(phase: &Phase, p: Vec3) -> Vec3 {
    let mut u = [[0.0; 3]];
    phase.phases(&[p], &mut u);
    u[0]
}

/// Conventions: a constant K gives exactly K·x, whatever the region's weights; so it is the affine map.
#[test]
fn what_does_not_vary_is_the_affine_map() {
    let b = bounds([-3.0, 2.0, 10.0], [9.0, 8.0, 14.0]);
    let angles = [20.0, 35.0, 50.0];
    let wavelength = [4.0, 5.0, 3.0];
    let offset = [0.3, -0.2, 5.0];
    let wanted = PhaseRequest {
        weight: Some(formula("1 + x*x")),
        offset,
        ..PhaseRequest::new(wavelength.map(Grade::Constant), Orientation::Angles(angles.map(Grade::Constant)))
    };
    let ball = crate::region::Sphere::new([3.0, 5.0, 12.0], 2.0).expect("ball");
    let affine = Affine::rigid(wavelength, angles, offset, &[]).expect("map");
    for region in [None, Some(&ball as &dyn Field)] {
        let settings = SolverOptions { region, ..SolverOptions::default() };
        let map = Phase::solve(&b, &wanted, &settings).expect("solved");
        for i in 0..200 {
            let s = [0.371, 0.713, 0.193].map(|s| (s * f64::from(i)).fract());
            let p = core::array::from_fn(|a| b.min[a] - 1.0 + s[a] * (b.size()[a] + 2.0));
            let (mut u, mut v) = ([[0.0; 3]], [[0.0; 3]]);
            map.phases(&[p], &mut u);
            affine.phases(&[p], &mut v);
            // A few roundings of phases of size ten.
            assert!(norm(sub(u[0], v[0])) < 1e-13, "{:?} {:?}", u[0], v[0]);
            let (j, k) = (map.jacobian(p), affine.jacobian(p));
            assert!((0..3).all(|a| norm(sub(j[a], k[a])) < 1e-13));
        }
    }
}

/// Closed form for a turn of γ per mm about z (in turns; K is that of the reference, 2π/λ, over 2π): with θ = θ₀ + γ x,
/// Φ₁ = (k/γ) sin θ + u, u harmonic with u_y = K_y on the sides and u_x = 0 on the ends.
fn ramp(x: f64, y: f64, l: f64) -> Vec3 {
    let (k, gamma) = (1.0, PI / 2.0 / l);
    let cosines = |f: &dyn Fn(f64) -> f64, n: usize| {
        // Simpson on a fine grid.
        let m = 4000;
        let sum: f64 = (0..=m)
            .map(|i| {
                let t = l * f64::from(i) / f64::from(m);
                let w = if i == 0 || i == m {
                    1.0
                } else if i % 2 == 1 {
                    4.0
                } else {
                    2.0
                };
                w * f(t) * (n as f64 * PI * t / l).cos()
            })
            .sum();
        sum / 3.0 / f64::from(m) * if n == 0 { 1.0 } else { 2.0 }
    };
    let series = |ky: &dyn Fn(f64) -> f64| {
        let mut u = cosines(ky, 0) * (y - l / 2.0);
        for n in 1..120 {
            let q = n as f64 * PI / l;
            // sinh(q (y − L/2)) / cosh(q L/2) without overflow.
            let (a, h) = (q * (y - l / 2.0), q * l / 2.0);
            let ratio = ((a - h).exp() - (-a - h).exp()) / (1.0 + (-2.0 * h).exp());
            u += cosines(ky, n) / q * (q * x).cos() * ratio;
        }
        u
    };
    let theta = gamma * x;
    [
        k / gamma * theta.sin() + series(&|t| k * (gamma * t).sin()),
        k / gamma * theta.cos() + series(&|t| k * (gamma * t).cos()),
        0.0,
    ]
}

/// A turn from 0 to 90 degrees over four cells: the reference's figures, and the order of the error.
#[test]
fn the_ramp_meets_its_closed_form_at_second_order() {
    let l = 4.0;
    let center = ramp(l / 2.0, l / 2.0, l);
    let exact = |x, y| sub(ramp(x, y, l), center);
    for ((x, y), want) in [((0.0, 0.0), -15.6615213), ((1.0, 2.0), -5.1907736), ((4.0, 4.0), 15.5318259)] {
        // Figures in radians with seven decimals; the series is cut at 120 terms.
        assert!((TAU * exact(x, y)[0] - want).abs() < 2e-4);
    }
    let b = bounds([0.0; 3], [l, l, l]);
    let wanted = about_z("22.5*x", Grade::Constant(1.0));
    let mut errors = Vec::new();
    for n in [16.0, 32.0, 64.0] {
        let settings = SolverOptions { step: Some(l / n), ..SolverOptions::default() };
        let phase = Phase::solve(&b, &wanted, &settings).expect("solved");
        let center = at(&phase, [l / 2.0; 3]);
        let mut worst = 0.0f64;
        for i in 0..25 {
            // On the nodes of the coarsest grid and off them.
            let (x, y) = (f64::from(i % 5) * l / 4.0 * 0.999, f64::from(i / 5) * l / 4.0 * 0.999);
            let d = sub(sub(at(&phase, [x, y, 1.3]), center), exact(x, y));
            worst = worst.max(d[0].abs()).max(d[1].abs());
        }
        errors.push(worst * TAU);
    }
    println!("ramp: {errors:?} rad");
    // The reference's figures at these grids: 1.8e-2, 4.6e-3, 1.2e-3.
    assert!(errors[0] < 2.5e-2);
    for pair in errors.windows(2) {
        assert!((3.4..4.6).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// K is a gradient: a ln r, a atan2(y, x). The map is conformal and its phases are known.
#[test]
fn a_conformal_map_is_found_at_second_order() {
    let b = bounds([1.0, 1.0, 0.0], [5.0, 4.0, 2.0]);
    // |K| = a / r, turned by the polar angle.
    let mut wanted = about_z("atan2(y, x) * 57.29577951308232", formula("sqrt(x^2 + y^2) / 2.5"));
    wanted.wavelength[2] = Grade::Constant(2.0);
    let exact = |p: Vec3| [2.5 * p[0].hypot(p[1]).ln(), 2.5 * p[1].atan2(p[0])];
    let mut errors = Vec::new();
    for step in [0.25, 0.125, 0.0625] {
        let settings = SolverOptions { step: Some(step), ..SolverOptions::default() };
        let phase = Phase::solve(&b, &wanted, &settings).expect("solved");
        let c = b.center();
        let mut worst = 0.0f64;
        for i in 0..100 {
            let s = [0.371, 0.713, 0.193].map(|s| (s * f64::from(i)).fract());
            let p = core::array::from_fn(|a| b.min[a] + s[a] * b.size()[a]);
            let (u, v) = (sub(at(&phase, p), at(&phase, c)), exact(p));
            worst = worst.max((u[0] - v[0] + exact(c)[0]).abs()).max((u[1] - v[1] + exact(c)[1]).abs());
        }
        errors.push(worst);
        let d = phase.distortion();
        // Second order again: the coarsest step is a sixth of the distance to the pole.
        let most = 1.0 + 0.01 * (step / 0.25_f64).powi(2);
        assert!(d.outside == 0.0 && d.spacing.iter().all(|s| s.max < most), "{d:?}");
    }
    println!("conformal: {errors:?} turns");
    for pair in errors.windows(2) {
        assert!((3.2..4.8).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// The phase of a wave (h, k, l), solved for by itself, is the sum of the three phases.
#[test]
fn a_grating_of_its_own_agrees_with_the_sum_of_three_phases() {
    let b = bounds([0.0; 3], [4.0, 5.0, 3.0]);
    let grid = PhaseGrid::over(&b, [17, 21, 13]);
    let nodes: Vec<Vec3> = (0..grid.len()).map(|n| grid.node(n)).collect();
    let angles = [formula("30*y"), formula("10*x*z"), formula("40*x")];
    let frames = Orientation::Angles(angles).frames(&grid, &nodes, None, None, None).expect("frames").at_nodes;
    let k: [Vec<Vec3>; 3] = core::array::from_fn(|i| frames.iter().map(|f| [f[0][i], f[1][i], f[2][i]]).collect());
    let depth: Vec<f64> = nodes.iter().map(|p| norm(sub(*p, b.center())) - 1.5).collect();
    for depth in [vec![-1.0; grid.len()], depth] {
        let exact = depth[0] == -1.0;
        let roots = || (!exact).then(|| depth.iter().map(|d| (-d.max(0.0) / 0.75).exp()).collect());
        let three = Problem::new(grid, &k, roots(), 1.0).solve().values;
        let hkl = [2.0, -1.0, 3.0];
        let sum: Vec<Vec3> =
            (0..grid.len()).map(|n| (0..3).fold([0.0; 3], |s, i| add(s, scale(k[i][n], hkl[i])))).collect();
        let own = Problem::new(grid, &[sum.clone(), sum.clone(), sum], roots(), 1.0).solve().values;
        for n in (0..grid.len()).filter(|&n| depth[n] < 0.0) {
            let joined: f64 = (0..3).map(|i| hkl[i] * three[i][n]).sum();
            // Direct: rounding. Conjugate gradients end at a residual of 1e-8.
            assert!((own[0][n] - joined).abs() < if exact { 1e-12 } else { 1e-5 });
        }
    }
}

/// Outside counts little: in a bent strip the map is nearer to the target than if the whole box counted.
#[test]
fn the_region_counts_and_its_surroundings_hardly() {
    use crate::region::{Cuboid, Cylinder, Difference, Intersection};
    let ring = Difference::new(vec![
        Arc::new(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 12.0, 4.0).expect("outer")) as crate::region::Region,
        Arc::new(Cylinder::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], 9.0, 6.0).expect("inner")),
    ]);
    let quarter = Intersection::new(vec![
        Arc::new(ring.expect("ring")) as crate::region::Region,
        Arc::new(Cuboid::new([0.0; 3], [12.0, 12.0, 4.0]).expect("box")),
    ])
    .expect("quarter");
    let b = bounds([0.0; 3], [12.0, 12.0, 4.0]);
    let wanted = about_z("atan2(y, x) * 57.29577951308232", Grade::Constant(2.0));
    let solve = |region| Phase::solve(&b, &wanted, &SolverOptions { region, folds: true, step: None }).expect("solved");
    let (near, all) = (solve(Some(&quarter)), solve(None));
    let judge = |phase: &Phase| {
        let mut sum = (0.0, 0);
        for i in 0..4000 {
            let s = [0.371, 0.713, 0.193].map(|s| (s * f64::from(i)).fract());
            let p: Vec3 = core::array::from_fn(|a| s[a] * b.max[a]);
            if quarter.value(p) < 0.0 {
                let t = p[1].atan2(p[0]);
                let want = [-0.5 * t.sin(), 0.5 * t.cos(), 0.0];
                sum = (sum.0 + norm(sub(phase.jacobian(p)[1], want)).powi(2), sum.1 + 1);
            }
        }
        (sum.0 / f64::from(sum.1)).sqrt() / 0.5
    };
    println!("misfit {:.4} with weights in {} steps, {:.4} without", judge(&near), near.effort().1, judge(&all));
    assert!(judge(&near) < 0.5 * judge(&all));
    assert!(near.effort().1 < 30);
}

#[test]
fn what_cannot_be_solved_is_refused_with_its_place() {
    let b = bounds([0.0; 3], [10.0, 10.0, 10.0]);
    let solve = |w: &PhaseRequest, step| Phase::solve(&b, w, &SolverOptions { step, ..SolverOptions::default() }).err();
    let refused = |w: &PhaseRequest, key: &str, words: &str| {
        let f = solve(w, None).expect("refused");
        assert!(f.at == key && f.message.contains(words), "{f}");
    };
    refused(&about_z("x", formula("5 - x")), "wavelength", "(5, 0, 0) mm");
    refused(&about_z("1/(x-5)", Grade::Constant(2.0)), "rotate", "(5, 0, 0) mm");
    let jump = Linear::new([1.0, 0.0, 0.0], vec![[5.0, 2.0], [5.001, 4.0]]).expect("grade");
    refused(&about_z("0*x", jump.into()), "wavelength", "faster than the grid");
    refused(&about_z("0*x", formula("4 + 3*sin(40*x*y*z)")), "wavelength", "faster than the grid");
    let step = crate::grade::Steps::new([1.0, 0.0, 0.0], vec![[0.0, 2.0], [5.1, 5.0]]).expect("grade");
    let leap = solve(&about_z("0*x", step.into()), None).expect("refused").message;
    assert!(leap.contains("jumps from 2 to 5 mm") && !leap.contains("smaller step"), "{leap}");
    let steep = solve(&about_z("0*x", formula("3 + 2*tanh(8*(x-5.1))")), Some(0.5)).expect("refused").message;
    assert!(steep.contains("smaller step"), "{steep}");
    let weighed = |w: f64| PhaseRequest { weight: Some(Grade::Constant(w)), ..about_z("x", Grade::Constant(2.0)) };
    refused(&weighed(-1.0), "weight", "-1; a weight is a finite number from 0 up");
    refused(&weighed(0.0), "weight", "0 everywhere");
    let fine = solve(&about_z("x", Grade::Constant(2.0)), Some(1e-4)).expect("refused");
    assert!(fine.at == "step" && fine.message.contains("use a step above"));
    // Half a turn within half a cell.
    refused(&about_z("360*tanh(x-5)", Grade::Constant(3.0)), "", "folds");
}

/// Where no map can follow, the weight says where the error goes: a map is the best by its own weight.
#[test]
fn errors_go_where_they_weigh_least() {
    let b = bounds([0.0; 3], [24.0, 24.0, 3.0]);
    let turned = about_z("40*sin(x/4)", Grade::Constant(3.0));
    let one = |_: Vec3| 1.0;
    let left = |p: Vec3| (-p[0] / 4.0).exp();
    let solve = |weight| {
        let wanted = PhaseRequest { weight, ..turned.clone() };
        Phase::solve(&b, &wanted, &SolverOptions::default()).expect("solved")
    };
    let miss = |map: &Phase, weight: &dyn Fn(Vec3) -> f64| -> f64 {
        let positions = (0..4000).map(|i| {
            let s = [0.8191725, 0.6710436, 0.5497005].map(|s| (s * f64::from(i)).fract());
            [0, 1, 2].map(|a| s[a] * b.max[a])
        });
        let each = positions.map(|p| {
            let angle = (40.0 * (p[0] / 4.0).sin()).to_radians();
            let (s, c) = angle.sin_cos();
            let j = map.jacobian(p);
            let off = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]].map(|k| scale(k, 1.0 / 3.0));
            let all = (0..3).map(|i| norm(sub(j[i], off[i])).powi(2));
            weight(p) * all.sum::<f64>()
        });
        each.sum()
    };
    let (even, heavy) = (solve(None), solve(Some(formula("exp(-x/4)"))));
    assert!(miss(&even, &one) < 0.97 * miss(&heavy, &one));
    assert!(miss(&heavy, &left) < 0.97 * miss(&even, &left));
    for bad in ["x - 1", "0*x"] {
        let wanted = PhaseRequest { weight: Some(formula(bad)), ..turned.clone() };
        let fault = Phase::solve(&b, &wanted, &SolverOptions::default()).err();
        assert_eq!(fault.expect("refused").at, "weight", "{bad}");
    }
}

/// What counts more is nearer to the target: the steeper an angle weighs the smaller its error and the greater that of
/// spacing, and the reverse. What does not vary is met exactly, whatever counts.
#[test]
fn angles_are_bought_with_spacings() {
    let b = bounds([0.0; 3], [16.0, 16.0, 4.0]);
    let ball = crate::region::Sphere::new([8.0, 8.0, 2.0], 7.0).expect("ball");
    for region in [None, Some(&ball as &dyn Field)] {
        let solve = |angle_weight, angle: &str| {
            let wanted = PhaseRequest { angle_weight, ..about_z(angle, Grade::Constant(2.0)) };
            let settings = SolverOptions { region, ..SolverOptions::default() };
            Phase::solve(&b, &wanted, &settings)
        };
        let off = |angle_weight| {
            let d = solve(angle_weight, "70*x/16").expect("solved").distortion().clone();
            let spacing = d.spacing.iter().take(2).map(|s| (s.max - 1.0).abs()).fold(0.0, f64::max);
            (d.angle[0].mean + d.angle[1].mean, spacing)
        };
        let [little, even, much] = [0.1, 1.0, 10.0].map(off);
        assert!(much.0 < 0.8 * even.0 && even.0 < 0.95 * little.0, "{little:?} {even:?} {much:?}");
        assert!(much.1 > even.1 && even.1 > little.1, "{little:?} {even:?} {much:?}");
        let still = solve(30.0, "25").expect("solved");
        let (p, q) = ([3.1, 9.2, 1.3], [11.0, 4.4, 2.0]);
        let (c, s) = (25f64.to_radians().cos(), 25f64.to_radians().sin());
        let wanted = ((q[0] - p[0]) * c + (q[1] - p[1]) * s) / 2.0;
        assert!((at(&still, q)[0] - at(&still, p)[0] - wanted).abs() < 1e-10);
        for bad in [0.0, -1.0, 1e9, f64::NAN] {
            let fault = solve(bad, "25").err().expect("refused");
            assert_eq!(fault.at, "angle_weight");
        }
    }
}

/// What the report says is what is found at the points where the solution was compared with the target, nodes and others;
/// stresses have the signs and axes of the nodes there too, also where two principal values agree and one axis alone is given.
#[test]
fn misfits_are_those_of_the_report() {
    let b = bounds([0.0; 3], [24.0, 24.0, 6.0]);
    // A tensor whose first direction is turned as the angles are: s cos 2a etc., with a third value apart.
    let stress = ["cos(0.1*x)", "-cos(0.1*x)", "3", "0", "0", "sin(0.1*x)"].map(formula);
    // Tension along a direction that turns, the same in all directions across it.
    let bar = ["cos(0.07*x)^2", "sin(0.07*x)^2", "0", "0", "0", "cos(0.07*x)*sin(0.07*x)"].map(formula);
    let turned = about_z("0.05*x*180/pi", Grade::Constant(3.0));
    let laid = |stress: [Grade; 6]| PhaseRequest { orientation: Orientation::Stress(stress.into()), ..turned.clone() };
    for wanted in [turned.clone(), laid(stress), laid(bar)] {
        let map = Phase::solve(&b, &wanted, &SolverOptions::default()).expect("solved");
        let grid = *map.solution.grid();
        let (nodes, between) = compared(&grid, &vec![f64::NEG_INFINITY; grid.len()], &vec![true; grid.len()], None);
        // Every node of a grid as small as this, and a point in every cell.
        assert_eq!(nodes.len(), grid.len());
        assert_eq!(between.len(), grid.shape.map(|n| n - 1).iter().product::<usize>());
        let points: Vec<Vec3> = nodes.iter().map(|n| grid.node(*n)).chain(between).collect();
        let found = map.misfits(&points).expect("misfits");
        let most = |f: &dyn Fn(&Misfit) -> f64| found.iter().map(f).fold(0.0, f64::max);
        let d = map.distortion();
        // Angles are good to √ε.
        let shear = most(&|m| m.shear);
        assert!((shear - d.shear.max).abs() < 1e-5, "{shear} {}", d.shear.max);
        for i in 0..3 {
            let angle = most(&|m| m.angle[i]);
            assert!((angle - d.angle[i].max).abs() < 1e-5, "{angle} {:?}", d.angle);
        }
        assert!((most(&|m| m.density) - d.density[1]).abs() < 1e-9);
    }
}

/// A target whose period is the step of the grid looks constant at the nodes: it is refused where the step is given, and else the
/// grid is made finer along that axis, which is reported, and the report is what is found at random points.
#[test]
fn what_hides_between_the_nodes_is_refused_or_resolved() {
    let b = bounds([0.0; 3], [40.0, 6.0, 6.0]);
    let swinging = about_z("30*sin(2*pi*x)", Grade::Constant(4.0));
    let pulsing = about_z("0*x", formula("4 + 0.7*sin(2*pi*x)"));
    for (wanted, key, words) in
        [(&swinging, "rotate", "turns by"), (&pulsing, "wavelength", "the wavelength goes from")]
    {
        let given = SolverOptions { step: Some(1.0), ..SolverOptions::default() };
        let fault = Phase::solve(&b, wanted, &given).err().expect("refused");
        assert_eq!(fault.at, key);
        assert!(
            [words, "within 0.5 mm", "1 mm apart", "step = 0."].iter().all(|w| fault.message.contains(w)),
            "{fault}"
        );

        let map = Phase::solve(&b, wanted, &SolverOptions::default()).expect("solved");
        assert!(map.undersampled().expect("reported").contains(words));
        // 60 degrees within half a period, an eighth of a cell.
        assert!(key != "rotate" || map.distortion().turn > 110.0, "{}", map.distortion().turn);
        let [nx, ny, nz] = map.effort().0;
        assert!(nx > 160 && ny < 13 && nz < 13, "{nx} {ny} {nz}");
        let (mut angle, mut spacing, mut ratio) = (0.0, 0.0f64, 0.0);
        const COUNT: usize = 20_000;
        for i in 0..COUNT {
            let s = [0.371_23, 0.713_71, 0.193_37].map(|s| (s * i as f64).fract());
            let p: Vec3 = [0, 1, 2].map(|a| s[a] * b.max[a]);
            let wave = (TAU * p[0]).sin();
            let (turn, length) = if key == "rotate" { (30.0 * wave, 4.0) } else { (0.0, 4.0 + 0.7 * wave) };
            let (sin, cos) = f64::to_radians(turn).sin_cos();
            let j = map.jacobian(p)[1];
            angle += (dot(j, [-sin, cos, 0.0]) / norm(j)).clamp(-1.0, 1.0).acos().to_degrees() / COUNT as f64;
            ratio += norm(j) * length / COUNT as f64;
            spacing = spacing.max((norm(j) * length).max(1.0 / norm(j) / length));
        }
        let d = map.distortion();
        // Means over some ten thousand points each, of figures whose spread is twice their mean; extremes are those of a smooth
        // function.
        assert!((d.angle[1].mean - angle).abs() < 0.05 * angle + 1e-3, "{angle} {:?}", d.angle[1]);
        assert!((d.spacing[1].mean - ratio).abs() < 0.01 * ratio, "{ratio} {:?}", d.spacing[1]);
        assert!((d.spacing[1].max - spacing).abs() < 0.05 * spacing, "{spacing} {:?}", d.spacing[1]);
    }
    // A period of several cells is carried by the usual grid.
    let slow = Phase::solve(&b, &about_z("30*sin(2*pi*x/12)", Grade::Constant(4.0)), &SolverOptions::default());
    let slow = slow.expect("solved");
    assert!(slow.undersampled().is_none() && slow.effort().0[0] < 50, "{:?}", slow.effort());
}

/// A ramp shorter than a cell is as steep as half a cell sees it; a long one is so on any length.
#[test]
fn a_short_ramp_turns_as_steeply_as_half_a_cell_sees() {
    let b = bounds([0.0; 3], [24.0, 6.0, 6.0]);
    let turn = |stops: Vec<[f64; 2]>| {
        let ramp = Grade::from(Linear::new([1.0, 0.0, 0.0], stops).expect("grade"));
        let mut wanted = about_z("0*x", Grade::Constant(4.0));
        wanted.orientation = Orientation::Angles([Grade::Constant(0.0), Grade::Constant(0.0), ramp]);
        Phase::solve(&b, &wanted, &SolverOptions::default()).expect("solved").distortion().turn
    };
    // 40 degrees within 2 mm of a 4 mm cell; the angle between frames is good to √ε.
    assert!((turn(vec![[11.0, 0.0], [13.0, 40.0]]) - 80.0).abs() < 1e-4);
    assert!((turn(vec![[0.0, 0.0], [24.0, 60.0]]) - 10.0).abs() < 1e-4);
}

/// A slab between two planes across a ball, of any thickness and slope: what is reported of the map is what it is at points of the slab,
/// also where no node of the grid is in it, which is said.
#[test]
fn a_region_thinner_than_the_grid_is_judged_inside_it() {
    use crate::region::{HalfSpace, Intersection, Region, Sphere};
    let mut state = 7;
    let mut random = || geometry::random::random(&mut state);
    for (i, thick) in [0.3 / 3f64.sqrt(), 0.02, 0.1, 3.0].into_iter().enumerate() {
        let normal = if i == 0 { [1.0; 3] } else { [random(), random(), 1.0 + random().abs()] };
        let unit = scale(normal, 1.0 / norm(normal));
        let parts: Vec<Region> = vec![
            Arc::new(HalfSpace::new([0.0; 3], scale(unit, -1.0)).expect("lower")),
            Arc::new(HalfSpace::new(scale(unit, thick), unit).expect("upper")),
            Arc::new(Sphere::new([0.0; 3], 10.0).expect("ball")),
        ];
        let slab = Intersection::new(parts).expect("slab");
        let b = bounds([-10.0; 3], [10.0; 3]);
        let settings = SolverOptions { region: Some(&slab), folds: true, step: None };
        let map = Phase::solve(&b, &about_z("12*x", Grade::Constant(3.0)), &settings).expect("solved");
        let across = cross(unit, [1.0, 0.0, 0.0]);
        let (e, f) = (scale(across, 1.0 / norm(across)), cross(unit, scale(across, 1.0 / norm(across))));
        let (mut spacing, mut density, mut count) = ([0.0; 3], [f64::INFINITY, 0.0f64], 0.0);
        for _ in 0..20_000 {
            let p = add(scale(e, 10.0 * random()), add(scale(f, 10.0 * random()), scale(unit, thick * random().abs())));
            if slab.value(p) <= 0.0 {
                let misfit = map.misfits(&[p]).expect("misfit")[0];
                spacing = add(spacing, misfit.spacing);
                density = [density[0].min(misfit.density), density[1].max(misfit.density)];
                count += 1.0;
            }
        }
        let d = map.distortion();
        for axis in 0..3 {
            // Of a hundred points at least, whose spread is below a tenth.
            assert!((d.spacing[axis].mean - spacing[axis] / count).abs() < 0.05, "{thick} {:?} {spacing:?}", d.spacing);
        }
        let close = |a: f64, b: f64| (a - b).abs() < 0.1 * b.abs().max(1.0);
        assert!(close(d.density[0], density[0]) && close(d.density[1], density[1]), "{:?} {density:?}", d.density);
        assert_eq!(
            map.undersampled().is_some_and(|w| w.contains("thicker than about")),
            thick < 0.5,
            "{:?}",
            map.undersampled()
        );
    }
}

/// However thin a plate along the axes is for the step, nodes of the grid lie through it, and its map is that of a thick one. A wall across
/// the long sides of its bounds is between nodes: that is said, with a step at which it is not.
#[test]
fn a_thin_plate_is_resolved_and_a_thin_wall_is_not() {
    use crate::region::{Cuboid, Region, Union};
    let block = |min: Vec3, max: Vec3| -> Region { Arc::new(Cuboid::new(min, max).expect("block")) };
    let solved = |region: &Region, step: f64| {
        let settings = SolverOptions { region: Some(&**region), folds: false, step: Some(step) };
        Phase::solve(&region.bounds(), &about_z("x", Grade::Constant(4.0)), &settings).expect("solved")
    };
    let [thin, thick] = [0.3, 6.0].map(|z| solved(&block([0.0; 3], [20.0, 20.0, z]), 2.0));
    let said = |map: &Phase| map.undersampled().filter(|w| w.contains("thicker than about")).map(str::to_string);
    assert_eq!(said(&thin), None);
    let mut state = 5;
    for _ in 0..500 {
        let [x, y, z] = [0; 3].map(|_| 0.5 + 0.5 * geometry::random::random(&mut state));
        let [a, b] = [(&thin, 0.3), (&thick, 6.0)].map(|(map, high)| map.jacobian([20.0 * x, 20.0 * y, high * z]));
        let off = (0..3).map(|i| norm(sub(a[i], b[i]))).fold(0.0, f64::max);
        assert!(off < 1e-9, "{off:e}");
    }
    let walls = vec![block([0.0; 3], [0.3, 20.0, 1.0]), block([19.7, 0.0, 0.0], [20.0, 20.0, 1.0])];
    let walls: Region = Arc::new(Union::new(walls).expect("walls"));
    let words = said(&solved(&walls, 2.0)).expect("a warning");
    let enough = words.split("step = ").nth(1).and_then(|t| t.split(',').next()).and_then(|t| t.parse::<f64>().ok());
    // Half the thickness, to two digits, which points in the walls find a little less.
    let enough = enough.expect("a step");
    assert!((0.12..=0.15).contains(&enough), "{words}");
    assert_eq!(said(&solved(&walls, enough)), None);
}

/// A range in which cells of the map for a narrower one lie is met.
#[test]
fn a_wider_range_is_met_where_a_narrower_one_gives_such_a_map() {
    let b = bounds([-8.0; 3], [8.0; 3]);
    let ball = crate::region::Sphere::new([0.0; 3], 8.0).expect("ball");
    let turned = [
        [
            "39.109*sin(0.104*x+0.303*y+0.328*z+5.144)",
            "28.094*sin(0.252*x+0.282*y+0.236*z+0.202)",
            "21.229*sin(0.334*x+0.304*y+0.101*z+4.378)",
        ],
        [
            "35.355*sin(0.337*x+0.178*y+0.206*z+1.978)",
            "48.514*sin(0.307*x+0.202*y+0.237*z+4.731)",
            "24.325*sin(0.107*x+0.288*y+0.235*z+1.819)",
        ],
    ];
    let mut met = 0;
    for angles in turned {
        let made = |range: [f64; 2]| {
            let wanted = PhaseRequest {
                stretch: Some(Stretch::new(range).expect("range")),
                ..PhaseRequest::new([3.0; 3].map(Grade::Constant), Orientation::Angles(angles.map(formula)))
            };
            let settings = SolverOptions { region: Some(&ball), folds: true, step: None };
            Phase::solve(&b, &wanted, &settings).expect("solved")
        };
        let wide = Stretch::new([0.67, 1.5]).expect("range");
        let narrow = made([0.8, 1.25]).distortion().clone();
        if narrow.density[0] > 0.0 && wide.excess(narrow.stretch) <= 1.0 {
            met += 1;
            let found = made([0.67, 1.5]);
            assert!(found.overstretched().is_none(), "{:?} {:?}", found.distortion().stretch, narrow.stretch);
        }
    }
    assert!(met > 0);
}

/// At faces of a box an axis of the cells that are asked for is along the normal, however far what is asked for within is turned from
/// it; and the report is that of the map against it.
#[test]
fn aligned_cells_are_asked_for_along_the_normal_at_the_surface() {
    let b = bounds([0.0; 3], [24.0; 3]);
    let cube = crate::region::Cuboid::new([0.0; 3], [24.0; 3]).expect("box");
    for angle in [5.0, 20.0, -30.0] {
        let wanted = PhaseRequest {
            align: Some(Aligned::new(6.0).expect("depth")),
            ..about_z(&format!("{angle}"), Grade::Constant(3.0))
        };
        let settings = SolverOptions { region: Some(&cube), folds: true, step: None };
        let map = Phase::solve(&b, &wanted, &settings).expect("solved");
        let asked = |x: f64| {
            let k = map.asked(&[[x, 12.0, 12.0]]).expect("asked")[0];
            (0..3).map(|i| (k[i][0].abs() / norm(k[i])).min(1.0).acos().to_degrees()).fold(90.0, f64::min)
        };
        // Half a step of the grid from the surface the normal's share is within 2 % of one.
        assert!(asked(0.0) < 1e-6 && asked(0.05) < 0.02 * f64::abs(angle), "{angle} {} {}", asked(0.0), asked(0.05));
        assert!((asked(12.0) - f64::abs(angle)).abs() < 2.0, "{angle} {}", asked(12.0));
    }
}

/// Hoop and radial directions of a tube under pressure: whole cells go round, as many as fit its mean radius, whatever the cells' size.
#[test]
fn whole_cells_go_round_a_tube_of_any_size() {
    use crate::region::{Cylinder, Difference, Region};
    let stress = [
        "((1-146.41/max(x^2+y^2,1))*x^2+(1+146.41/max(x^2+y^2,1))*y^2)/max(x^2+y^2,1)",
        "((1-146.41/max(x^2+y^2,1))*y^2+(1+146.41/max(x^2+y^2,1))*x^2)/max(x^2+y^2,1)",
        "0",
        "0",
        "0",
        "-292.82*x*y/max(x^2+y^2,1)^2",
    ];
    let tube = Difference::new(vec![
        Arc::new(Cylinder::new([0.0; 3], [0.0, 0.0, 1.0], 12.1, 6.5).expect("outer")) as Region,
        Arc::new(Cylinder::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], 8.6, 8.5).expect("inner")),
    ]);
    let tube = tube.expect("tube");
    let b = bounds([-12.1, -12.1, 0.0], [12.1, 12.1, 6.5]);
    for length in [2.6, 2.8, 3.0] {
        let wanted =
            PhaseRequest::new([length; 3].map(Grade::Constant), Orientation::Stress(stress.map(formula).into()));
        let map = Phase::solve(&b, &wanted, &SolverOptions { region: Some(&tube), ..SolverOptions::default() })
            .expect("solved");
        let [period] = map.periods() else { panic!("{length}: {:?}", map.distortion()) };
        let round = period.cells.iter().map(|n| n.abs()).max().expect("three");
        assert!((round as f64 - TAU * 10.35 / length).abs() < 1.0, "{length}: {period:?}");
        assert!(map.distortion().angle.iter().all(|a| a.mean < 1.0), "{length}: {:?}", map.distortion().angle);
    }
}
