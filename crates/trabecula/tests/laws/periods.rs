//! Solved maps of parts with holes: phases grow round each by a whole number of cells.

use crate::common::{cases, within};
use std::sync::Arc;

use geometry::math::{Aabb, Vec3, add, apply, determinant, norm, sub, unit};
use geometry::measure::size;
use geometry::progress::Silent;
use geometry::random::random;
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::surface;
use trabecula::field::Block;
use trabecula::grade::{Formula, Grade};
use trabecula::implicit::Implicit;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Axis, Mapping, Orientation, Phase, PhaseRequest, Round, SolverOptions, TwoAxes};
use trabecula::region::{Cuboid, Cylinder, Difference, Region};
use trabecula::solid::Solid;

fn formula(text: &str) -> Grade {
    Grade::from(Formula::parse(text).expect("formula"))
}

fn wanted(wavelength: f64, orientation: Orientation) -> PhaseRequest {
    PhaseRequest::new([0; 3].map(|_| Grade::Constant(wavelength)), orientation)
}

fn tube(base: Vec3, axis: Vec3, radii: [f64; 2], height: f64) -> Region {
    let axis = unit(axis);
    let outer: Region = Arc::new(Cylinder::new(base, axis, radii[1], height).expect("outer"));
    let inner: Region = Arc::new(Cylinder::new(sub(base, axis), axis, radii[0], height + 2.0).expect("inner"));
    Arc::new(Difference::new(vec![outer, inner]).expect("tube"))
}

fn solve(region: &Region, wanted: &PhaseRequest, step: Option<f64>) -> Phase {
    let settings = SolverOptions { region: Some(&**region), step, ..SolverOptions::default() };
    Phase::solve(&region.bounds(), wanted, &settings).unwrap_or_else(|f| panic!("{f}"))
}

/// The directions out from a line and round it, as formulas.
fn around(at: Vec3, axis: Vec3) -> [[String; 3]; 2] {
    let axis = unit(axis);
    let [x, y, z] = core::array::from_fn(|a| format!("({} - ({:.17}))", ["x", "y", "z"][a], at[a]));
    let d = [&x, &y, &z];
    let along = format!("({x}*({:.17}) + {y}*({:.17}) + {z}*({:.17}))", axis[0], axis[1], axis[2]);
    let out = core::array::from_fn(|a| format!("{} - {along}*({:.17}) + 1e-9", d[a], axis[a]));
    let round = core::array::from_fn(|a| {
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        format!("({:.17})*{} - ({:.17})*{} + 1e-9", axis[b], d[c], axis[c], d[b])
    });
    [out, round]
}

/// A tube with a frame, or stress, that goes round: the phases are those of `map.cylinder` with the number of cells that is nearest to
/// what the wavelength asks for, within 1 % of a cell, wherever the tube is and however it is turned. Four tubes; more in
/// `make campaign`.
#[test]
fn a_tube_along_its_hoops_is_wrapped_round_its_axis() {
    let mut seed = 11;
    let mut next = || random(&mut seed);
    for case in 0..cases(4) {
        let straight = case < 2;
        let (base, axis) = match straight {
            true => ([0.0; 3], [0.0, 0.0, 1.0]),
            false => ([next(), 5.0 * next(), next()], [next(), next(), 1.0 + next()]),
        };
        let axis = unit(axis);
        let (wave, inner) = (3.0, 5.0 + next());
        let radii = [inner, inner + 6.0 + next()];
        let height = 9.0;
        let region = tube(base, axis, radii, height);
        let [out, round] = around(base, axis);
        let orientation = if case % 2 == 0 {
            let z = Axis::Vector(axis.map(Grade::Constant));
            Orientation::Frame(TwoAxes::new(Axis::Vector(out.map(|t| formula(&t))), z))
        } else {
            // Hoops carry 2, the axis 1, the radius nothing.
            let square = |a: usize, b: usize| {
                let r2: Vec<String> = round.iter().map(|t| format!("({t})^2")).collect();
                let hoop = format!("2*({})*({})/({})", round[a], round[b], r2.join(" + "));
                formula(&format!("{hoop} + ({:.17})", axis[a] * axis[b]))
            };
            let of = [square(0, 0), square(1, 1), square(2, 2), square(1, 2), square(0, 2), square(0, 1)];
            Orientation::Stress(of.into())
        };
        let map = solve(&region, &wanted(wave, orientation), Some(wave / 8.0));
        // Least squares over the volume: Σ (1/λ − n/2πr)² r.
        let asked = std::f64::consts::TAU * (radii[1] - radii[0]) / wave / (radii[1] / radii[0]).ln();
        let [period] = map.periods() else { panic!("{:?}", map.periods()) };
        let hoop = (0..3).fold(0, |m, i| if period.asked[i].abs() > period.asked[m].abs() { i } else { m });
        println!("{case}: {period:?}, {asked:.3} by the closed form");
        assert!((period.asked[hoop].abs() - asked).abs() < 0.1, "{period:?} for {asked}");
        assert_eq!(period.cells[hoop].abs(), period.asked[hoop].abs().round() as i64);
        let exact = Round::cylinder(base, axis, [wave; 2], period.cells[hoop].abs() as f64, [radii[0], 8.0, radii[1]]);
        let exact = exact.expect("map");
        // Each phase is one of the other map's, in the same or the other sense, but for a constant: half of what it ranges over.
        let points = within(&region, 3000, 3);
        let (mut u, mut e) = (vec![[0.0; 3]; points.len()], vec![[0.0; 3]; points.len()]);
        assert!(points.iter().all(|p| determinant(&map.jacobian(*p)) > 0.0));
        map.phases(&points, &mut u);
        exact.phases(&points, &mut e);
        let range = |i: usize, of: usize, sign: f64| {
            let off = |n: usize| u[n][i] - sign * e[n][of];
            let wrapped = (0..points.len()).map(|n| off(n) - off(0) - (off(n) - off(0)).round());
            let (low, high) = wrapped.fold((0.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            (high - low) / 2.0
        };
        let worst = (0..3).map(|of| {
            let all = (0..3).flat_map(|i| [range(i, of, 1.0), range(i, of, -1.0)]);
            all.fold(f64::INFINITY, f64::min)
        });
        let worst = worst.fold(0.0, f64::max);
        println!("   phases within {worst:.4} of a cell");
        // Second order in the step: at eight nodes a cell below 0.008 in 12 cases, at four below 0.023.
        assert!(worst < 0.01, "{worst}");
    }
}

/// A plate with two holes.
fn plate() -> Region {
    let block: Region = Arc::new(Cuboid::new([-11.0, -7.0, 0.0], [11.0, 7.0, 2.0]).expect("block"));
    let drill =
        |x: f64| -> Region { Arc::new(Cylinder::new([x, 0.0, -1.0], [0.0, 0.0, 1.0], 2.5, 4.0).expect("drill")) };
    Arc::new(Difference::new(vec![block, drill(-5.0), drill(5.0)]).expect("plate"))
}

/// The target N ∇(θ₁ − θ₂), θ the angles about the holes of the plate, N = 8.3, and what is conjugate to it: rounding is the only misfit.
fn swirling() -> Phase {
    let out = |x: &str, c: &str| format!("({c})/(({x})^2 + y^2)");
    let v = [
        format!("-({} - {})", out("x+5", "y"), out("x-5", "y")),
        format!("{} - {}", out("x+5", "x+5"), out("x-5", "x-5")),
    ];
    let long = format!("sqrt(({})^2 + ({})^2)", v[0], v[1]);
    let edge = format!("min(6.283185307179586/(8.3*{long}), 6)");
    let still = || Grade::Constant(0.0);
    let x = Axis::Vector([formula(&v[0]), formula(&v[1]), still()]);
    let z = Axis::Vector([still(), still(), Grade::Constant(1.0)]);
    let wanted = PhaseRequest {
        wavelength: [formula(&edge), formula(&edge), Grade::Constant(2.0)],
        ..wanted(2.0, Orientation::Frame(TwoAxes::new(x, z)))
    };
    // Coarser than would be chosen for cells this small at the holes: the law holds on any grid.
    solve(&plate(), &wanted, Some(0.35))
}

/// Four points of Gauss and their weights on the unit interval.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
];

/// Round each hole, round both and round none, the Jacobian sums up to the whole numbers that are reported, and phases jump by whole
/// numbers alone.
#[test]
fn phases_of_a_plate_close_round_both_its_holes() {
    let map = swirling();
    let periods = map.periods().to_vec();
    println!("{periods:?}");
    assert!(within(&plate(), 3000, 8).iter().all(|p| determinant(&map.jacobian(*p)) > 0.0));
    assert_eq!(periods.len(), 2);
    for p in &periods {
        assert!(p.at[1].abs() < 1e-6 && (p.at[0].abs() - 5.0).abs() < 1e-6 && (p.along[2] - 1.0).abs() < 1e-9, "{p:?}");
        let sign = -p.at[0].signum();
        assert_eq!(p.cells, [8 * sign as i64, 0, 0], "{p:?}");
        // Where wavelengths are cut off the target is none of a phase.
        assert!((p.asked[0] - 8.3 * sign).abs() < 0.3 && p.asked[1].abs() < 0.3);
    }
    let mut seed = 4;
    for case in 0..24 {
        // Ellipses in the plate.
        let (center, radii) = match case % 4 {
            0 => ([-5.0, 0.0], [3.2 + 0.5 * random(&mut seed), 3.8 + random(&mut seed)]),
            1 => ([5.0, 0.0], [3.2 + 0.5 * random(&mut seed), 3.8 + random(&mut seed)]),
            2 => ([0.0, 0.0], [9.5 + random(&mut seed), 5.5 + random(&mut seed)]),
            _ => ([0.0, 4.5 + 0.5 * random(&mut seed)], [6.0, 1.2]),
        };
        let tilt = 0.9 * random(&mut seed);
        let at = |t: f64| {
            // From where no phase jumps.
            let (s, c) = (std::f64::consts::TAU * (t + 0.37)).sin_cos();
            [center[0] + radii[0] * c, center[1] + radii[1] * s, 1.0 + tilt * s]
        };
        let steps = 800;
        let (mut sum, mut jumps) = ([0.0; 3], [0.0; 3]);
        let mut last = [[0.0; 3]];
        map.phases(&[at(0.0)], &mut last);
        for i in 0..steps {
            let t = |s: f64| (f64::from(i) + s) / f64::from(steps);
            let mut grown = [0.0; 3];
            for (s, weight) in GAUSS {
                let (a, b) = (at(t(s) - 1e-6), at(t(s) + 1e-6));
                let slope = sub(b, a).map(|v| v / 2e-6);
                grown = add(grown, apply(&map.jacobian(at(t(s))), slope).map(|v| v * weight / f64::from(steps)));
            }
            let mut next = [[0.0; 3]];
            map.phases(&[at(t(1.0))], &mut next);
            let jump = sub(sub(next[0], last[0]), grown);
            // Splines of class C² in four points an interval, slopes by differences.
            assert!(jump.iter().all(|j| (j - j.round()).abs() < 1e-7), "{jump:?}");
            jumps = add(jumps, jump.map(f64::round));
            (sum, last) = (add(sum, grown), next);
        }
        let cells = |round: &dyn Fn(&Vec3) -> bool| {
            let each = periods.iter().filter(|p| round(&p.at)).map(|p| p.cells.map(|n| n as f64));
            each.fold([0.0; 3], add)
        };
        let expected = match case % 4 {
            0 => cells(&|at| at[0] < 0.0),
            1 => cells(&|at| at[0] > 0.0),
            2 => cells(&|_| true),
            _ => [0.0; 3],
        };
        assert!(norm(sub(sum, expected)) < 1e-6, "{case}: {sum:?} for {expected:?}");
        assert!(norm(add(jumps, expected)) < 1e-9, "{case}: {jumps:?} for {expected:?}");
    }
}

/// The same map for any number of threads.
#[test]
fn threads_leave_no_trace_in_closed_phases() {
    let solved = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| {
            let map = swirling();
            let points = within(&plate(), 500, 7);
            let mut u = vec![[0.0; 3]; points.len()];
            map.phases(&points, &mut u);
            (map.periods().to_vec(), u)
        })
    };
    assert_eq!(solved(1), solved(3));
}

/// A gyroid in the plate: values of blocks equal those of points, bounds hold, and its surface is closed and in one piece.
#[test]
fn a_lattice_goes_round_holes_without_a_seam() {
    let (map, region) = (Arc::new(swirling()), plate());
    let cell = Arc::new(Cell::new(Series::new(named("gyroid").expect("gyroid").terms()).expect("gyroid")));
    let l: Arc<dyn Implicit> = Arc::new(Lattice::new(cell, map, Part::Sheet, Level::Fraction(Grade::Constant(0.35))));
    let axis = |from: f64, n: usize| -> Vec<f64> { (0..n).map(|i| from + 0.37 * i as f64).collect() };
    let (x, y, z) = (axis(-11.3, 60), axis(-7.2, 40), axis(-0.2, 7));
    let block = Block { axes: [&x, &y, &z] };
    let mut out = vec![0f32; block.len()];
    l.fill(&block, &mut out);
    for (i, v) in out.iter().enumerate() {
        let p = [x[i % 60], y[i / 60 % 40], z[i / 2400]];
        // Single precision of sums of size one.
        assert!((f64::from(*v) - l.value(p)).abs() < 3e-6);
    }
    let mut seed = 6;
    for p in within(&region, 300, 9) {
        let around = Aabb { min: p, max: p }.grown(0.4 * (1.0 + random(&mut seed)));
        let bound = l.bound(&around);
        for _ in 0..30 {
            let q = [0, 1, 2].map(|a| around.center()[a] + 0.5 * around.size()[a] * random(&mut seed));
            let v = l.value(q);
            assert!(bound.lo <= v && v <= bound.hi, "{bound:?} {v}");
        }
    }
    let found = surface(&Solid::new(region, Some(l), 1.0), 0.2, &Silent).expect("surface");
    let m = size(&found.mesh);
    assert!(m.closed && m.pieces == 1, "{m:?}");
}

/// What turns faster than cells can folds whatever goes round the hole, which the message names; what does not vary, or hardly, is as it
/// is without holes.
#[test]
fn what_cannot_close_is_refused_and_what_is_straight_stays() {
    let region = tube([0.0; 3], [0.0, 0.0, 1.0], [5.0, 9.0], 4.0);
    let settings = SolverOptions { region: Some(&*region), ..SolverOptions::default() };
    let still = || Grade::Constant(0.0);
    let twisted = formula("atan2(y, x)*57.29577951308232 + 360*tanh(z-2)");
    let twisted = wanted(3.0, Orientation::Angles([still(), still(), twisted]));
    let fault = Phase::solve(&region.bounds(), &twisted, &settings).err().expect("refused");
    assert!(fault.message.contains("folds") && fault.message.contains("whatever whole numbers"), "{fault}");
    let z = || Axis::Vector([0.0, 0.0, 1.0].map(Grade::Constant));
    for x in [["1", "0.5", "0"], ["1", "0.002*x", "0"]] {
        let x = Axis::Vector(x.map(formula));
        let map = solve(&region, &wanted(2.0, Orientation::Frame(TwoAxes::new(x, z()))), Some(0.5));
        assert!(map.periods().is_empty());
    }
}

/// A plate with a hole in tension (Kirsch, 1898): beyond a cell from the hole axes are within 3 degrees of the principal ones in the mean,
/// with no fold anywhere, and as many cells enter above the hole as leave below it: none goes round.
#[test]
fn kirsch_is_followed_past_the_hole() {
    let (a, wave) = (5.0, 3.0);
    let plate: Region = Arc::new(Cuboid::new([-25.0, -25.0, 0.0], [25.0, 25.0, 6.0]).expect("plate"));
    let hole: Region = Arc::new(Cylinder::new([0.0, 0.0, -1.0], [0.0, 0.0, 1.0], a, 8.0).expect("hole"));
    let region: Region = Arc::new(Difference::new(vec![plate, hole]).expect("part"));
    // Polar components for unit tension along x, turned to x and y.
    let r2 = "(x^2 + y^2 + 1e-9)";
    let [double, sine, q] = [format!("((x^2 - y^2)/{r2})"), format!("(2*x*y/{r2})"), format!("({}/{r2})", a * a)];
    let rr = format!("(0.5*(1 - {q}) + 0.5*(1 - 4*{q} + 3*{q}^2)*{double})");
    let tt = format!("(0.5*(1 + {q}) - 0.5*(1 + 3*{q}^2)*{double})");
    let rt = format!("(-0.5*(1 + 2*{q} - 3*{q}^2)*{sine})");
    let [cc, ss, cs] = [format!("(x^2/{r2})"), format!("(y^2/{r2})"), format!("(x*y/{r2})")];
    let xx = format!("{rr}*{cc} + {tt}*{ss} - 2*{rt}*{cs}");
    let yy = format!("{rr}*{ss} + {tt}*{cc} + 2*{rt}*{cs}");
    let xy = format!("({rr} - {tt})*{cs} + {rt}*({cc} - {ss})");
    let zero = || Grade::Constant(0.0);
    let stress = [formula(&xx), formula(&yy), zero(), zero(), zero(), formula(&xy)];
    let map = solve(&region, &wanted(wave, Orientation::Stress(stress.into())), None);
    assert!(map.periods().iter().all(|p| p.cells == [0; 3]), "{:?}", map.periods());
    let points = within(&region, 20_000, 9);
    assert!(points.iter().all(|p| determinant(&map.jacobian(*p)) > 0.0));
    let far: Vec<Vec3> = points.into_iter().filter(|p| p[0].hypot(p[1]) > a + wave).collect();
    let misfits = map.misfits(&far).expect("targets");
    for i in 0..3 {
        let mean = misfits.iter().map(|m| m.angle[i]).sum::<f64>() / far.len() as f64;
        println!("axis {i}: {mean:.2} degrees in the mean");
        assert!(mean < 3.0, "{i}: {mean}");
    }
}
