//! Frames whose axes have neither signs nor order from one position to the next.

use std::f64::consts::SQRT_2;

use crate::common::points;
use geometry::math::{Aabb, Mat3, Vec3, cross, norm, product, rotation, scale, sub, transpose};
use geometry::random::random;
use trabecula::design::{Design, NoFiles};
use trabecula::grade::{Formula, Grade, Samples};
use trabecula::map::{Axis, Mapping, Orientation, Phase, PhaseRequest, SolverOptions, TwoAxes};

const BOX: Aabb = Aabb { min: [0.0; 3], max: [12.0, 9.0, 9.0] };
const STEP: f64 = 0.75;

/// A field that turns by up to 20 degrees about each axis.
fn frame(p: Vec3) -> Mat3 {
    rotation([2.0 * p[1], p[0], 15.0 + p[2]])
}

/// The frames at the positions of a grid as a result has them: of each the axes in one of all orders, with one of all signs.
fn result(seed: Option<u64>) -> TwoAxes {
    let shape = BOX.size().map(|s| (s / STEP).round() as usize + 1);
    let mut state = seed.unwrap_or(0);
    let mut columns = vec![Vec::new(); 21];
    for n in 0..shape.iter().product() {
        let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
        let axes = transpose(&frame(core::array::from_fn(|a| BOX.min[a] + STEP * at[a] as f64)));
        let mut pick = |of: usize| ((random(&mut state) + 1.0) / 2.0 * of as f64).min(of as f64 - 1.0) as usize;
        let ([first, third], signs) = match seed {
            Some(_) => {
                let first = pick(3);
                ([first, (first + 1 + pick(2)) % 3], [pick(2), pick(2)])
            }
            None => ([0, 2], [0, 0]),
        };
        let [x, z] = [(first, signs[0]), (third, signs[1])].map(|(a, s)| scale(axes[a], 1.0 - 2.0 * s as f64));
        let square = |[x, y, z]: Vec3| [x * x, y * y, z * z, y * z, x * z, x * y];
        let all = square(x)
            .into_iter()
            .chain(square(z))
            .chain(TwoAxes::coefficients(scale(x, 2.0), scale(z, 0.5)).expect("not parallel"));
        columns.iter_mut().zip(all).for_each(|(column, v)| column.push(v));
    }
    let made = |c: usize| Grade::from(Samples::new(BOX.min, [STEP; 3], shape, columns[c].clone()).expect("samples"));
    let lines = [0, 6].map(|from| Axis::Line(core::array::from_fn(|c| made(from + c))));
    let [x, z] = lines;
    TwoAxes::new(x, z).unordered(core::array::from_fn(|c| made(12 + c)))
}

fn solved(orientation: Orientation, smooth: Option<f64>) -> Phase {
    let wanted = PhaseRequest { smooth, ..PhaseRequest::new([0; 3].map(|_| Grade::Constant(3.0)), orientation) };
    Phase::solve(&BOX, &wanted, &SolverOptions::default()).expect("solved")
}

fn apart(a: &Phase, b: &Phase) -> f64 {
    let of = |p: Vec3| a.jacobian(p).iter().zip(b.jacobian(p)).map(|(a, b)| norm(sub(*a, b))).fold(0.0, f64::max);
    points(&BOX, 500).map(of).fold(0.0, f64::max)
}

/// Axes of a result in random orders with random signs give the map of the axes in one order. The third axis, which is made from the
/// other two, is the same but for rounding, and with it the map.
#[test]
fn orders_and_signs_of_a_result_do_not_count() {
    for smooth in [None, Some(2.0)] {
        let ordered = solved(Orientation::Frame(result(None)), smooth);
        for seed in [1, 2, 3] {
            let shuffled = solved(Orientation::Frame(result(Some(seed))), smooth);
            let off = apart(&ordered, &shuffled);
            // An averaged frame is found by steps from a neighbour's, of which there are sixty at most: which neighbour rounding decides.
            let within = if smooth.is_some() { 1e-4 } else { 1e-9 };
            assert!(off < within, "smooth {smooth:?}, seed {seed}: {off:e}");
        }
        let misfits = ordered.misfits(&points(&BOX, 500).collect::<Vec<_>>()).expect("misfits");
        let most = misfits.iter().flat_map(|m| m.angle).fold(0.0, f64::max);
        println!("smooth {smooth:?}: off by {most:.2} degrees at most");
        // No map follows a field that turns so; with the wrong axes it would be off by tens of degrees.
        assert!(most < 10.0, "{most}");
    }
}

/// A formula whose signs flip, in fewer than half of all places, gives the map of the one whose signs do not; of axes that agree already
/// nothing changes, bit for bit.
#[test]
fn signs_of_a_formula_do_not_count() {
    let vectors = |sign: &str| {
        let of = |parts: [&str; 3]| {
            Axis::Vector(parts.map(|t| Grade::from(Formula::parse(&format!("({sign})*({t})")).expect("formula"))))
        };
        TwoAxes::new(of(["cos(x/20)", "sin(x/20)", "0"]), of(["0", "0", "1"]))
    };
    let plain = solved(Orientation::Frame(vectors("1")), None);
    let flipped = solved(Orientation::Frame(vectors("sign(sin(5*x + 3*y*z) + 0.6)")), None);
    let third = |m: &Phase| m.jacobian([6.0, 4.0, 4.0])[2][2];
    assert!(third(&plain) > 0.0 && third(&flipped) > 0.0);
    assert!(apart(&plain, &flipped) < 1e-12);
}

/// Where the principal directions of a stress lie halfway between the coordinate axes, averages over a length keep them: torsion.
#[test]
fn pure_shear_is_kept_by_smoothing() {
    for (stress, axis) in [
        ([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], [1.0 / SQRT_2, 1.0 / SQRT_2, 0.0]),
        ([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 1.0 / SQRT_2, 1.0 / SQRT_2]),
        ([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [1.0 / 3f64.sqrt(); 3]),
    ] {
        let map = solved(Orientation::Stress(stress.map(Grade::Constant).into()), Some(3.0));
        for p in points(&BOX, 100) {
            let rows = map.jacobian(p).map(|r| scale(r, 3.0));
            let near = rows.iter().map(|r| norm(cross(*r, axis))).fold(f64::INFINITY, f64::min);
            assert!(near < 1e-9, "{stress:?} at {p:?}: {rows:?}");
            let unit = product(&rows, &transpose(&rows));
            assert!((0..3).all(|i| (unit[i][i] - 1.0).abs() < 1e-9));
        }
    }
}

/// A frame that comes back turned by a quarter round a line, by a formula whose axes jump where its angle does: cores cover the line, and
/// outside them nothing folds.
#[test]
fn a_core_covers_the_line_of_a_frame() {
    let angle = "atan2(y - 0.4, x + 0.3)/4";
    let text = format!(
        "schema = 1\n[region.box]\nmin = [-9, -8, 0]\nmax = [10, 9, 6]\n[lattice.a]\ncell = \"primitive\"\npart = \"upper\"\n\
         level.fraction = 0.4\n[lattice.a.map.phase]\nwavelength = 3\ncore = \"solid\"\n\
         frame = {{ x = [{{ formula = \"cos({angle})\" }}, {{ formula = \"sin({angle})\" }}, 0], z = [0, 0, 1] }}"
    );
    let made = Design::from_toml(&text).expect("text").build(&NoFiles).expect("built");
    let lines = made.report().lattices["a"].singular.clone().expect("solved");
    assert!(lines.len() == 1 && lines[0].turn == 90.0, "{lines:?}");
}
