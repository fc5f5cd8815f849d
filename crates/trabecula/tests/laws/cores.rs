//! Cores cover singular lines: outside them cells are whole, without a fold and without a seam.

use geometry::math::{Vec3, determinant, norm, sub};
use geometry::progress::Silent;
use geometry::random::random;
use trabecula::design::{Built, Design, DesignError, NoFiles};
use trabecula::extract::surface;
use trabecula::field::Field;
use trabecula::report::SingularLineReport;

/// The centre of the singular line.
const AT: [f64; 2] = [0.6, 1.3];

fn design(cell: &str, orientation: &str, keys: &str) -> String {
    format!(
        "schema = 1\n[region.box]\nmin = [-9, -8, 0]\nmax = [10, 9, 6]\n[lattice.a]\n{cell}\n\
         map.phase = {{ wavelength = 3, {orientation}{keys} }}\n"
    )
}

fn built(text: &str) -> Result<Built, DesignError> {
    Design::from_toml(text)?.build(&NoFiles)
}

/// A stress in the plane whose axes wind round the line: a wedge, a trisector, hoops.
fn stress(what: &str) -> String {
    let [x, y] = [format!("(x - {})", AT[0]), format!("(y - {})", AT[1])];
    let r = format!("sqrt({x}^2 + {y}^2 + 1e-9)");
    let [xx, yy, xy] = match what {
        "wedge" => [x.clone(), format!("-{x}"), y],
        "trisector" => [x.clone(), format!("-{x}"), format!("-{y}")],
        _ => [format!("{y}^2/{r}"), format!("{x}^2/{r}"), format!("-{x}*{y}/{r}")],
    };
    let f = |text: &str| format!("{{ formula = \"{text}\" }}");
    format!("stress = [{}, {}, -20, 0, 0, {}]", f(&xx), f(&yy), f(&xy))
}

fn from_line(p: Vec3) -> f64 {
    (p[0] - AT[0]).hypot(p[1] - AT[1])
}

/// Points of the box outside a radius of the line.
fn outside(count: usize, radius: f64) -> Vec<Vec3> {
    let mut seed = 11;
    let mut one = move || {
        let [a, b, c] = [0; 3].map(|_| random(&mut seed));
        [0.5 + 9.5 * a, 0.5 + 8.5 * b, 3.0 + 3.0 * c]
    };
    core::iter::from_fn(move || Some(one())).filter(|p| from_line(*p) > radius).take(count).collect()
}

const GYROID: &str = "cell = \"gyroid\"\npart = \"sheet\"\nlevel.fraction = 0.3";
const PRIMITIVE: &str = "cell = \"primitive\"\npart = \"upper\"\nlevel.fraction = 0.4";

#[test]
fn cells_are_whole_outside_the_core() {
    for what in ["wedge", "trisector", "hoop"] {
        let start = std::time::Instant::now();
        let made = built(&design(GYROID, &stress(what), ", core = \"solid\"")).expect("built");
        println!("{what}: {:?} {:?}", start.elapsed(), made.warnings);
        let map = &made.lattices[0].1.map;
        let report = made.report().lattices["a"].clone();
        println!("{:?}", report.distortion);
        let lines: Vec<SingularLineReport> = report.singular.expect("solved");
        println!("{lines:?}");
        assert_eq!(lines.len(), 1, "{what}");
        let radius = lines[0].core_radius.expect("covered");
        let least = outside(200_000, radius).into_iter().map(|p| determinant(&map.jacobian(p))).fold(f64::INFINITY, f64::min);
        println!("{what}: least det J {least}, over the one asked for {}", least * 27.0);
        assert!(least > 0.0, "{what}: {least}");
        // Without a seam: once round the line in steps of a ten-thousandth, values change as little.
        let lattice = &made.lattices[0].1;
        for (r, z) in [(radius + 0.4, 1.0), (radius + 1.7, 3.3), (5.1, 2.2), (6.3, 4.9)] {
            let n = (core::f64::consts::TAU * r / 1e-4) as usize;
            let at = |i: usize| {
                let (s, c) = (i as f64 / n as f64 * core::f64::consts::TAU).sin_cos();
                [AT[0] + r * c, AT[1] + r * s, z]
            };
            let points: Vec<Vec3> = (0..=n).map(at).collect();
            let mut values = vec![0.0; points.len()];
            lattice.values(&points, &mut values);
            let (change, i) = (0..n).map(|i| ((values[i + 1] - values[i]).abs(), i)).fold((0.0, 0), |m, v| if v.0 > m.0 { v } else { m });
            println!("{what} r {r}: {change} at {:?}", points[i]);
            assert!(change < 1e-4 * 12.0, "{what} at {:?}: {change}", points[i]);
        }
    }
}
