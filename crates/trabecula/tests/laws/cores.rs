//! Cores cover singular lines: outside them cells are whole, without a fold and without a seam.

use crate::common::campaign;
use geometry::math::{Aabb, Vec3, add, determinant};
use geometry::measure::{self_intersections, size};
use geometry::progress::Silent;
use geometry::random::random;
use trabecula::design::{Built, Design, DesignError, NoFiles};
use trabecula::extract::surface;
use trabecula::field::{Block, Field};
use trabecula::report::SingularLineReport;

fn design(cell: &str, orientation: &str, keys: &str) -> String {
    format!(
        "schema = 1\n[region.box]\nmin = [-9, -8, 0]\nmax = [10, 9, 6]\n[lattice.a]\n{cell}\n\
         map.phase = {{ wavelength = 3, {orientation}{keys} }}\n"
    )
}

fn built(text: &str) -> Result<Built, DesignError> {
    Design::from_toml(text)?.build(&NoFiles)
}

/// A stress in the plane whose deviator has the direction of a product of z − p, each as it is or conjugate: each is a singular line, a
/// wedge or a trisector. Of one twice over axes go round in circles.
fn stress(of: &[([f64; 2], bool)]) -> String {
    let (mut re, mut im) = ("9".to_string(), "0".to_string());
    for ([a, b], conjugate) in of {
        let (x, y) = (format!("(x - ({a}))"), format!("({}(y - ({b})))", if *conjugate { "-1*" } else { "" }));
        let far = format!("(sqrt({x}^2 + {y}^2) + 0.2)");
        (re, im) = (format!("(({re})*{x} - ({im})*{y})/{far}"), format!("(({re})*{y} + ({im})*{x})/{far}"));
    }
    format!("stress = [{{ formula = \"{re}\" }}, {{ formula = \"-1*{re}\" }}, -20, 0, 0, {{ formula = \"{im}\" }}]")
}

const AT: [f64; 2] = [0.6, 1.3];
const WEDGE: &[([f64; 2], bool)] = &[(AT, false)];
const TRISECTOR: &[([f64; 2], bool)] = &[(AT, true)];
const CIRCLES: &[([f64; 2], bool)] = &[(AT, false), (AT, false)];
const WEDGES: &[([f64; 2], bool)] = &[([-3.7, 0.4], false), ([4.6, 1.1], false)];
const BOTH: &[([f64; 2], bool)] = &[([-3.7, 0.4], false), ([4.6, 1.1], true)];

/// Axes come back turned by a half round a ring of radius 5 in the plane z = 2.7.
const RING: &str = "stress = [{ formula = \"sqrt(x^2 + y^2) - 5\" }, { formula = \"5 - sqrt(x^2 + y^2)\" }, -20, 0, 0, \
                    { formula = \"z - 2.7\" }]";

const GYROID: &str = "cell = \"gyroid\"\npart = \"sheet\"\nlevel.fraction = 0.3";
const PRIMITIVE: &str = "cell = \"primitive\"\npart = \"upper\"\nlevel.fraction = 0.4";

fn lines(made: &Built) -> Vec<SingularLineReport> {
    made.report().lattices["a"].singular.clone().expect("solved")
}

fn from_lines(p: Vec3, of: &[([f64; 2], bool)]) -> f64 {
    of.iter().map(|(at, _)| (p[0] - at[0]).hypot(p[1] - at[1])).fold(f64::INFINITY, f64::min)
}

/// Points of the box.
fn points(count: usize) -> Vec<Vec3> {
    let mut seed = 11;
    let mut one = || [0; 3].map(|_| random(&mut seed));
    (0..count).map(|_| one()).map(|[a, b, c]| [0.5 + 9.5 * a, 0.5 + 8.5 * b, 3.0 + 3.0 * c]).collect()
}

/// The greatest change of the lattice along a circle from step to step of a ten-thousandth.
fn seam(made: &Built, center: [f64; 2], r: f64, z: f64) -> (f64, Vec3) {
    let n = (core::f64::consts::TAU * r / 1e-4) as usize;
    let at = |i: usize| {
        let (s, c) = (i as f64 / n as f64 * core::f64::consts::TAU).sin_cos();
        [center[0] + r * c, center[1] + r * s, z]
    };
    let points: Vec<Vec3> = (0..=n).map(at).collect();
    let mut values = vec![0.0; points.len()];
    made.lattices[0].1.values(&points, &mut values);
    let change = |i: usize| (values[i + 1] - values[i]).abs();
    (0..n).map(|i| (change(i), points[i])).fold((0.0, [0.0; 3]), |m, v| if v.0 > m.0 { v } else { m })
}

#[test]
fn cells_are_whole_outside_cores() {
    let of_all = [
        ("wedge", WEDGE, 1, 180.0),
        ("trisector", TRISECTOR, 1, 180.0),
        ("circles", CIRCLES, 1, 360.0),
        ("wedges", WEDGES, 2, 180.0),
        ("wedge and trisector", BOTH, 2, 180.0),
    ];
    for (i, (what, of, count, turn)) in of_all.into_iter().enumerate() {
        // One after the other, or in a campaign both.
        let cells = [GYROID, PRIMITIVE];
        for cell in if campaign() { &cells[..] } else { &cells[i % 2..=i % 2] } {
            let made = built(&design(cell, &stress(of), ", core = \"solid\"")).expect(what);
            let found = lines(&made);
            let d = made.report().lattices["a"].distortion.clone().expect("solved");
            println!("{what}: density {:?}, angle {:?}, turn {}, {:?}", d.density, d.angle[0], d.turn, made.warnings);
            assert_eq!(found.len(), count, "{what}: {found:?}");
            // In the branch of each place: axes that are turned about a line's are off by less than a quarter.
            assert!(d.angle.iter().all(|a| a.max < 90.0), "{what}: {:?}", d.angle);
            for line in &found {
                // To a step of the grid, an eighth of a wavelength.
                assert!(line.points.iter().all(|p| from_lines(*p, of) < 0.55), "{what}: {line:?}");
                assert!((line.turn - turn).abs() < 1.0 && (line.length - 6.0).abs() < 0.01, "{what}: {line:?}");
                assert_eq!((line.core, line.core_radius), (Some("solid"), Some(1.5)), "{what}");
            }
            let map = &made.lattices[0].1.map;
            let core = &made.solid.filled[0];
            let out = points(200_000).into_iter().filter(|p| core.value(*p) > 0.0);
            let (least, at) = out
                .map(|p| (determinant(&map.jacobian(p)), p))
                .fold((1.0, [0.0; 3]), |m, v| if v.0 < m.0 { v } else { m });
            println!("{what}: least det J {:.3} of the one asked for", least * 27.0);
            assert!(least > 0.0, "{what}: {least} at {at:?}");
            for (center, r, z) in of.iter().flat_map(|(at, _)| [(*at, 1.9, 1.0), (*at, 3.3, 4.9), (*at, 5.2, 2.2)]) {
                let (change, at) = seam(&made, center, r, z);
                if from_lines(at, of) > 1.6 {
                    assert!(change < 1e-4 * 8.0, "{what} at {at:?}: {change}");
                }
            }
        }
    }
}

/// A line that leaves the part through a cavity and comes in again is one: cells close round both pieces, and round the cavity.
#[test]
fn pieces_of_a_line_are_covered_as_one() {
    let text = design(GYROID, &stress(WEDGE), ", core = \"solid\"");
    let whole = "[region.box]\nmin = [-9, -8, 0]\nmax = [10, 9, 6]\n";
    let hollow = "[region]\ndifference = [{ box = { min = [-9, -8, 0], max = [10, 9, 6] } }, \
                  { box = { min = [-2, -1, 2], max = [3, 4, 4] } }]\n";
    assert!(text.contains(whole));
    let hollow = text.replace(whole, hollow);
    let wide = built(&hollow.replace("core = \"solid\"", "core = \"solid\", core_radius = 5")).expect("built");
    let made = built(&hollow).expect("built");
    for found in [lines(&wide), lines(&made)] {
        let whole = |l: &SingularLineReport| (l.length - 2.0).abs() < 0.3 && l.turn == 180.0;
        assert!(found.len() == 2 && found.iter().all(whole), "{found:?}");
    }
    let map = &made.lattices[0].1.map;
    let out = points(200_000).into_iter().filter(|p| from_lines(*p, WEDGE) > 1.6 && made.solid.region.value(*p) < 0.0);
    let least = out.map(|p| determinant(&map.jacobian(p))).fold(f64::INFINITY, f64::min);
    assert!(least > 0.0, "{least}");
    let mesh = surface(&made.solid, 0.2, &Silent).expect("meshed").mesh;
    assert!(size(&mesh).closed && self_intersections(&mesh, 1) == 0);
}

/// Stresses round which axes come back turned by a quarter, as averages over a length have them: a cell with axes of order four closes,
/// another is refused.
#[test]
fn quarter_turns_close_for_cells_with_such_axes() {
    let quarter = "smooth = 3, stress = [{ formula = \"1 + 0.9*cos(atan2(y, x)/2)\" }, { formula = \"1 - 0.9*cos(atan2(y, x)/2)\" }, \
                   0, 0, 0, { formula = \"0.9*sin(atan2(y, x)/2)\" }]";
    let made = built(&design(PRIMITIVE, quarter, ", core = \"solid\"")).expect("a quarter");
    let found = lines(&made);
    assert!(found.len() == 1 && (found[0].turn - 90.0).abs() < 1.0, "{found:?}");
    let map = &made.lattices[0].1.map;
    let out = points(200_000).into_iter().filter(|p| p[0].hypot(p[1]) > 1.6);
    let least = out.map(|p| determinant(&map.jacobian(p))).fold(f64::INFINITY, f64::min);
    println!("quarter: least det J {:.3} of the one asked for", least * 27.0);
    assert!(least > 0.0);
    for (r, z) in [(1.9, 1.0), (3.3, 4.9), (5.2, 2.2)] {
        let (change, at) = seam(&made, [0.0; 2], r, z);
        assert!(change < 1e-4 * 8.0, "{at:?}: {change}");
    }
    let why = built(&design(GYROID, quarter, ", core = \"solid\"")).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(why.contains("axes come back turned by 90 degrees"), "{why}");
}

/// Rows equal points, and bounds hold, across cuts and next to cores.
#[test]
fn blocks_equal_points_and_bounds_hold() {
    let made = built(&design(GYROID, &stress(WEDGES), ", core = \"void\"")).expect("built");
    let lattice = &made.lattices[0].1;
    let mut seed = 6;
    for _ in 0..400 {
        let c = [9.0 * random(&mut seed), 8.0 * random(&mut seed), 3.0 + 2.5 * random(&mut seed)];
        let h = 0.02 + 0.08 * (1.0 + random(&mut seed));
        let axes: [Vec<f64>; 3] = core::array::from_fn(|a| (0..9).map(|i| c[a] + h * f64::from(i)).collect());
        let block = Block { axes: [&axes[0], &axes[1], &axes[2]] };
        let mut out = vec![0f32; block.len()];
        lattice.fill(&block, &mut out);
        let bound = lattice.bound(&Aabb { min: c, max: add(c, [8.0 * h; 3]) });
        for (i, v) in out.iter().enumerate() {
            let p = [axes[0][i % 9], axes[1][i / 9 % 9], axes[2][i / 81]];
            let value = lattice.value(p);
            assert!((f64::from(*v) - value).abs() < 1e-5, "{p:?}: {v} for {value}");
            assert!(bound.lo <= value && value <= bound.hi, "{p:?}: {value} in {bound:?}");
        }
    }
}

/// A solid core is solid and a void one empty, in closed meshes of one piece, whose volumes are those of the field.
#[test]
fn cores_are_solid_or_void() {
    let all = points(400_000);
    for (fill, keys) in [("solid", ""), ("void", ""), ("solid", ", core_radius = 2.2"), ("void", ", core_radius = 2.2")]
    {
        let radius = if keys.is_empty() { 1.5 } else { 2.2 };
        let part = format!("{PRIMITIVE}\nlevel.of = \"part\"");
        let made = built(&design(&part, &stress(WEDGE), &format!(", core = \"{fill}\"{keys}"))).expect("built");
        let line = &lines(&made)[0];
        let center = line.points[line.points.len() / 2];
        let (mut solid, mut in_core) = (0, 0);
        for p in &all {
            let inside = made.solid.value(*p) <= 0.0;
            solid += usize::from(inside);
            let d = (p[0] - center[0]).hypot(p[1] - center[1]);
            if d < radius - 1e-6 {
                assert_eq!(inside, fill == "solid", "{fill} {p:?}");
                in_core += 1;
            }
        }
        let share = f64::from(in_core) / all.len() as f64;
        // Six standard deviations of a share of points.
        assert!(
            (share - core::f64::consts::PI * radius * radius / (19.0 * 17.0)).abs()
                < 6.0 * (share / all.len() as f64).sqrt()
        );
        let made_of = solid as f64 / all.len() as f64;
        let mesh = surface(&made.solid, 0.2, &Silent).expect("meshed").mesh;
        let found = size(&mesh);
        let whole = 19.0 * 17.0 * 6.0;
        println!("{fill} {radius}: {made_of} of points, {} of the mesh, {found:?}", found.volume / whole);
        assert!((made_of - 0.4).abs() < 6.0 * (0.24 / all.len() as f64).sqrt() + 3e-4, "{fill}: {made_of}");
        assert!((found.volume / whole - 0.4).abs() < 3e-3, "{fill}: {}", found.volume / whole);
        assert!(found.closed && found.pieces == 1, "{found:?}");
        assert_eq!(self_intersections(&mesh, 1), 0);
    }
}

/// Where there is no line a core changes no bit.
#[test]
fn without_a_line_a_core_changes_nothing() {
    let turned = "stress = [{ formula = \"1 + x/20\" }, 0.2, -1, 0, 0, { formula = \"y/30\" }]";
    let [with, without] = [", core = \"solid\"", ""].map(|keys| built(&design(GYROID, turned, keys)).expect("built"));
    assert!(lines(&with).is_empty() && with.solid.filled.is_empty());
    for p in points(2000) {
        assert_eq!(with.solid.value(p).to_bits(), without.solid.value(p).to_bits(), "{p:?}");
    }
}

/// What a core does not go with is one error that says so.
#[test]
fn what_is_not_possible_is_said() {
    let half = "[{ formula = \"cos(atan2(y, x)/2)\" }, { formula = \"sin(atan2(y, x)/2)\" }, 0]";
    let odd = "cell.series.terms = [{ hkl = [1, 0, 0], amplitude = 1 }, { hkl = [0, 1, 1], amplitude = 1, phase = 0.1 }, \
               { hkl = [1, 1, 0], amplitude = 1, phase = 0.3 }, { hkl = [0, 0, 1], amplitude = 0.5, phase = 0.07 }, { hkl = [1, 0, 1], amplitude = 1, phase = 0.2 }]\n\
               part = \"upper\"\nlevel.fraction = 0.4";
    let wedge = stress(WEDGE);
    for (cell, orientation, keys, words) in [
        (
            GYROID,
            wedge.as_str(),
            ", core_radius = 2",
            "lattice.a.map.phase.core_radius: core_radius is how far core reaches",
        ),
        (GYROID, &wedge, ", core = \"beams\"", "solid"),
        (GYROID, &wedge, ", core = \"solid\", core_radius = 0", "core_radius"),
        (
            GYROID,
            &wedge,
            ", core = \"solid\", core_radius = 0.003",
            "lattice.a.map.phase.core_radius: 0.003 mm; the grid needs 4 steps",
        ),
        (
            GYROID,
            &wedge,
            ", core = \"solid\", core_radius = 100",
            "lattice.a.map.phase.core_radius: 100 mm; cores of this radius cover the whole part",
        ),
        (
            GYROID,
            &wedge,
            ", core = \"solid\", stretch = [0.67, 1.5]",
            "lattice.a.map.phase.stretch: core covers singular lines here",
        ),
        (GYROID, &wedge, ", core = \"solid\", offset = [1, 0, 0]", "lattice.a.map.phase.offset: core covers"),
        (GYROID, &wedge, ", core = \"solid\", angle_weight = 2", "lattice.a.map.phase.angle_weight: core covers"),
        (
            GYROID,
            &format!("direction = {half}"),
            ", core = \"solid\"",
            "lattice.a.map.phase.core: a direction alone comes back reversed",
        ),
        (odd, &wedge, ", core = \"void\"", "lattice.a.cell: axes come back turned by 180 degrees"),
        (GYROID, RING, ", core = \"solid\"", "lattice.a.map.phase.core: a singular line is closed, a ring through"),
        (
            GYROID,
            RING,
            ", core = \"solid\"",
            "smooth directions over more than a wavelength (smooth, in mm), or leave core out",
        ),
        (GYROID, "align = \"surface\"", ", smooth = 3", "give a larger align_depth, and leave smooth out"),
        (GYROID, "rotate_z = 3", ", smooth = 3, align = \"surface\"", "angles are followed as they are given"),
    ] {
        let why = built(&design(cell, orientation, keys)).err().map(|e| e.to_string()).unwrap_or_default();
        println!("{why}");
        assert!(why.contains(words), "{keys}: {why}");
    }
}
