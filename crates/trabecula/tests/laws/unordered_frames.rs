//! Frames whose axes have neither signs nor order from one position to the next.

use std::f64::consts::SQRT_2;
use std::sync::Arc;

use crate::common::{off_axis, points, rows, within};
use geometry::math::{Aabb, Mat3, Vec3, cross, dot, norm, product, rotation, scale, sub, transpose, unit};
use geometry::random::random;
use trabecula::design::{Design, NoFiles};
use trabecula::grade::{Formula, Grade, Samples};
use trabecula::map::{Axis, Mapping, Orientation, Phase, PhaseRequest, SolverOptions, TwoAxes};
use trabecula::region::{Cylinder, Difference, HalfSpace, Intersection, Region};

const BOX: Aabb = Aabb { min: [0.0; 3], max: [12.0, 9.0, 9.0] };
/// Nodes of the phase grid, 0.75 mm apart, lie between these positions: what is found there is a mean of several frames.
const STEP: f64 = 1.0;

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
            println!("smooth {smooth:?}, seed {seed}: {off:e}");
            assert!(off < 1e-9, "smooth {smooth:?}, seed {seed}: {off:e}");
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

/// A sector of a tube under inner pressure, of radii 6 and 20 mm and 6 mm long, turned and moved: the radial and the hoop stress of Lamé and
/// a third along its axis, which differ everywhere.
struct Sector {
    frame: Mat3,
    at: Vec3,
    region: Region,
}

const RADII: [f64; 2] = [6.0, 20.0];

impl Sector {
    /// Of a quarter or a half.
    fn new(half: bool, frame: Mat3, at: Vec3) -> Sector {
        let [x, y, z] = transpose(&frame);
        let tube = |radius: f64, over: f64| {
            let base = sub(at, scale(z, over));
            Arc::new(Cylinder::new(base, z, radius, 6.0 + 2.0 * over).expect("cylinder")) as Region
        };
        let cut = |axis: Vec3| Arc::new(HalfSpace::new(at, scale(axis, -1.0)).expect("half-space")) as Region;
        let ring =
            Arc::new(Difference::new(vec![tube(RADII[1], 0.0), tube(RADII[0], 1.0)]).expect("difference")) as Region;
        let cuts = if half { vec![cut(y)] } else { vec![cut(y), cut(x)] };
        let parts = [ring].into_iter().chain(cuts).collect();
        Sector { frame, at, region: Arc::new(Intersection::new(parts).expect("intersection")) }
    }

    /// The coordinates along the own axes, as formulas.
    fn coordinates(&self) -> [String; 3] {
        transpose(&self.frame)
            .map(|[a, b, c]| format!("({a:.17}*x + {b:.17}*y + {c:.17}*z - {:.17})", dot([a, b, c], self.at)))
    }

    /// The stress; nearer to the axis than a radius that of the points at that radius, as a result is carried on beyond its data.
    fn stress(&self, least: f64) -> [Grade; 6] {
        let ([x, y, _], [a, b]) = (self.coordinates(), RADII.map(|r| r * r));
        let r = format!("max(sqrt({x}^2 + {y}^2), 1e-9)");
        // Both are their mean plus and minus this.
        let by = format!("{}/max({r}, {least})^2", a * b / (b - a));
        let mean = a / (b - a);
        let [c, s] = [format!("({x}^2 - {y}^2)/{r}^2"), format!("2*{x}*{y}/{r}^2")];
        let [e, f, g] = transpose(&self.frame);
        [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]].map(|[i, j]| {
            let even = mean * (e[i] * e[j] + f[i] * f[j]) + 0.1 * g[i] * g[j];
            let [cos, sin] = [f[i] * f[j] - e[i] * e[j], -e[i] * f[j] - f[i] * e[j]];
            let text = format!("{even:.17} + {by}*({cos:.17}*{c} + {sin:.17}*{s})");
            Grade::from(Formula::parse(&text).expect("formula"))
        })
    }

    /// The same directions, with their signs and their order.
    fn axes(&self) -> TwoAxes {
        let ([x, y, _], [e, f, g]) = (self.coordinates(), transpose(&self.frame));
        let radial =
            |i: usize| Formula::parse(&format!("{:.17}*{x} + {:.17}*{y} + 1e-9", e[i], f[i])).expect("formula");
        TwoAxes::new(Axis::Vector([0, 1, 2].map(|i| Grade::from(radial(i)))), Axis::Vector(g.map(Grade::Constant)))
    }

    fn solved(&self, orientation: Orientation, wavelength: f64, step: Option<f64>) -> Phase {
        let wanted = PhaseRequest::new([0; 3].map(|_| Grade::Constant(wavelength)), orientation);
        let settings = SolverOptions { step, region: Some(&*self.region), folds: false };
        Phase::solve(&self.region.bounds(), &wanted, &settings).expect("solved")
    }

    fn radial(&self, p: Vec3) -> Vec3 {
        let [_, _, z] = transpose(&self.frame);
        let off = sub(p, self.at);
        unit(sub(off, scale(z, dot(off, z))))
    }
}

/// Axes agree all over a part that lies about no line round which they do not come back to themselves, though there is one in a hole that
/// the stress is surer in: the map is that of directions which have signs and order, and they turn in it as fast as these.
#[test]
fn what_is_asked_for_in_a_hole_does_not_order_axes_in_the_part() {
    let mut seed = 23;
    let cases = [
        (3.0, None, 5.5, false),
        (4.0, None, 5.5, true),
        (3.0, Some(0.8), 0.5, false),
        (6.0, None, 5.9, false),
        (3.0, Some(1.0), 3.0, true),
        (3.0, Some(0.7), 1.0, false),
        (2.0, None, 4.5, true),
        (3.0, Some(0.5), 5.5, true),
    ];
    for (i, (wavelength, step, least, half)) in rows(4, cases).enumerate() {
        for turned in [false, true] {
            let angles = [0; 3].map(|_| if turned { 180.0 * random(&mut seed) } else { 0.0 });
            let at = [0; 3].map(|_| if turned { 10.0 * random(&mut seed) } else { 0.0 });
            let part = Sector::new(half, rotation(angles), at);
            let map = part.solved(Orientation::Stress(part.stress(least).into()), wavelength, step);
            let ordered = part.solved(Orientation::Frame(part.axes()), wavelength, step);
            // Nodes as far apart as a cell, and as much more as half a step.
            let size = part.region.bounds().size();
            let h = (0..3).map(|a| size[a] / (map.effort().0[a] - 1) as f64).fold(0.0, f64::max);
            let far = wavelength + 0.5 * h;
            let most = 2.0 * (0.5 * far / RADII[0]).asin().to_degrees() * wavelength / far;
            let off = |m: &Phase, p: &Vec3| off_axis(&m.jacobian(*p), part.radial(*p));
            let all = within(&part.region, 2000, i as u64);
            let worse = all.iter().map(|p| off(&map, p) - off(&ordered, p)).fold(0.0, f64::max);
            let misfits = map.misfits(&all).expect("misfits");
            let [angle, least_angle] = [&misfits, &ordered.misfits(&all).expect("misfits")]
                .map(|m| m.iter().flat_map(|m| m.angle).fold(0.0, f64::max));
            let turn = map.distortion().turn;
            println!(
                "{wavelength} mm, step {step:?}, from {least} mm, half {half}, {turned}: turn {turn:.2} of {most:.2}, angle {angle:.3} of \
                 {least_angle:.3}, radial off by {worse:.2e} more"
            );
            assert!(map.distortion().singular.is_empty());
            assert!(turn < most + 1e-6);
            // On the axis, 6 mm from the part, nothing is radial: nodes there may be off by half a turn, and count by their distance alone.
            let limit = 180.0 * (-2.0 / 3.0 * RADII[0] / h).exp();
            assert!(angle < least_angle + limit && worse < limit);
        }
    }
}
