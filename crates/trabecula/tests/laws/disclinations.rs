//! Lines round which directions wind are found where closed forms have them.

use crate::common::rows;
use trabecula::design::{Built, Design, DesignError, NoFiles};
use trabecula::report::SingularLineReport;

fn built(orientation: &str, folds: bool) -> Result<Built, DesignError> {
    let text = format!(
        "schema = 1\n[region.box]\nmin = [-9, -8, 0]\nmax = [10, 9, 6]\n[lattice.core]\ncell = \"primitive\"\npart = \"lower\"\n\
         map.phase = {{ wavelength = 3, folds = {folds}, {orientation} }}\nlevel.fraction = 0.5"
    );
    Design::from_toml(&text)?.build(&NoFiles)
}

fn lines(orientation: &str) -> Vec<SingularLineReport> {
    let report = built(orientation, true).expect("built").report();
    report.lattices["core"].singular.clone().expect("solved")
}

/// The stress x, −x, y of a half disclination, moved; a stress that goes round an axis; a direction that is half as fast as the angle.
#[test]
fn closed_forms_have_one_line_at_its_place() {
    let [x, y] = ["(x - 0.6)", "(y - 1.3)"];
    let r = format!("sqrt({x}^2 + {y}^2 + 1e-9)");
    let f = |text: String| format!("{{ formula = \"{text}\" }}");
    let plane = |xx: String, yy: String, xy: String| format!("stress = [{}, {}, -20, 0, 0, {}]", f(xx), f(yy), f(xy));
    let part = |of: &str, by: i32| f(format!("{of}(atan2({y}, {x})/{by})"));
    let frame = |by: i32| format!("frame = {{ x = [{}, {}, 0], z = [0, 0, 1] }}", part("cos", by), part("sin", by));
    let forms = [
        ("half", plane(x.into(), format!("-{x}"), y.into()), 180.0),
        ("hoop", plane(format!("{y}^2/{r}"), format!("{x}^2/{r}"), format!("-{x}*{y}/{r}")), 360.0),
        (
            "line",
            format!(
                "direction = [{}, {}, 0]",
                f(format!("sqrt(({r} + {x})/2)")),
                f(format!("{y}/sqrt(2*({r} + {x}))"))
            ),
            180.0,
        ),
        ("quarter of a frame", frame(4), 90.0),
        ("half of a frame", frame(2), 180.0),
        ("trisector", plane(x.into(), format!("-{x}"), format!("-{y}")), 180.0),
    ];
    for (what, orientation, turn) in rows(4, forms) {
        let found = lines(&orientation);
        println!("{what}: {found:?}");
        assert_eq!(found.len(), 1, "{what}: {found:?}");
        let line = &found[0];
        // Steps are at most 3/4 mm; from the first row of nodes to the last.
        for [x, y, _] in &line.points {
            assert!((x - 0.6).abs() < 0.75 && (y - 1.3).abs() < 0.75, "{what}: {line:?}");
        }
        let rises = line.points.windows(2).map(|p| p[1][2] - p[0][2]);
        assert!(rises.clone().all(|r| r >= 0.0) || rises.clone().all(|r| r <= 0.0), "{what}: {line:?}");
        assert!((line.length - 6.0).abs() < 0.01, "{what}: {line:?}");
        assert_eq!(line.turn, turn, "{what}");
    }
}

/// Stresses whose deviator is a product of (w − c) or its conjugate over points c of the plane, w = x + iy: round each the axes turn by a half,
/// forth or back. Points that are apart are two lines or more, though axes are not clear next to them and the faces there are pierced by
/// quarters forth and back; two within a step are one line by a whole turn if both go forth, and none if one undoes the other.
#[test]
fn a_turn_is_that_once_round_all_that_is_near() {
    let plane = |points: &[([f64; 2], bool)], scale: f64, out: f64| {
        let first = ("1".to_string(), "0".to_string());
        let (re, im) = points.iter().fold(first, |(re, im), ([a, b], back)| {
            let (x, y) = (format!("(x - ({a}))"), format!("({}*(y - ({b})))", if *back { -1 } else { 1 }));
            (format!("(({re})*{x} - ({im})*{y})"), format!("(({re})*{y} + ({im})*{x})"))
        });
        let f = |sign: f64, of: &str| format!("{{ formula = \"{}*{of}\" }}", sign * scale);
        format!("stress = [{}, {}, {out}, 0, 0, {}]", f(1.0, &re), f(-1.0, &re), f(1.0, &im))
    };
    let four = [[-6.0, -3.0], [5.0, 4.0], [0.0, 6.0], [3.0, -5.0]].map(|p| (p, false));
    let pair = |by: f64, back: bool| [([0.6 - by, 0.3], false), ([0.6 + by, 0.3], back)];
    let [forth, undone] = [false, true].map(|back| pair(0.3, back));
    let middle = vec![([0.6, 0.3], false)];
    // The points at which lines are, and the turn.
    let forms = [
        ("unclear", plane(&four, 0.0016, -60.0), four.to_vec(), 180.0),
        ("one after the other", plane(&forth, 1.0, -20.0), middle, 360.0),
        ("undone", plane(&undone, 1.0, -20.0), Vec::new(), 0.0),
        ("apart", plane(&pair(4.0, true), 1.0, -20.0), pair(4.0, true).to_vec(), 180.0),
        ("apart, both forth", plane(&pair(4.0, false), 1.0, -20.0), pair(4.0, false).to_vec(), 180.0),
    ];
    for (what, stress, at, turn) in rows(4, forms) {
        let found = lines(&stress);
        println!("{what}: {:?}", found.iter().map(|l| (l.points[0], l.length, l.turn)).collect::<Vec<_>>());
        assert_eq!(found.len(), at.len(), "{what}: {found:?}");
        for line in &found {
            assert_eq!(line.turn, turn, "{what}: {line:?}");
            // Two steps: lines so near to each other are one at their mean.
            let near = |[x, y, _]: &[f64; 3]| at.iter().any(|([a, b], _)| (x - a).hypot(y - b) < 1.5);
            assert!(line.points.iter().all(near), "{what}: {line:?}");
        }
    }
}

/// Axes that come back reversed round a hole meet along a seam: such a map is refused, or warned of where it only nearly folds.
#[test]
fn a_seam_is_never_silent() {
    let half = "[{ formula = \"cos(atan2(y, x)/2)\" }, { formula = \"sin(atan2(y, x)/2)\" }, 0]";
    for orientation in [format!("frame = {{ x = {half}, z = [0, 0, 1] }}"), format!("direction = {half}")] {
        let text = format!(
            "schema = 1\n[[region.difference]]\ncylinder = {{ base = [0, 0, 0], axis = [0, 0, 1], radius = 14, height = 9 }}\n\
             [[region.difference]]\ncylinder = {{ base = [0, 0, -1], axis = [0, 0, 1], radius = 6, height = 11 }}\n\
             [lattice.core]\ncell = \"primitive\"\npart = \"lower\"\nmap.phase = {{ wavelength = 3, {orientation} }}\nlevel.fraction = 0.5"
        );
        match Design::from_toml(&text).expect("text").build(&NoFiles) {
            Err(why) => assert!(why.to_string().contains("folds") && why.to_string().contains("hole"), "{why}"),
            Ok(made) => {
                let reported = made.warnings.iter().any(|w| w.message.contains("nearly folds"));
                assert!(reported, "{orientation}: {:?}", made.warnings);
            }
        }
    }
}

/// A map that folds for that reason names the line.
#[test]
fn what_folds_names_its_line() {
    let message = built("stress = [{ formula = \"x\" }, { formula = \"-x\" }, -20, 0, 0, { formula = \"y\" }]", false);
    let message = message.err().expect("it folds").to_string();
    assert!(message.contains("axes do not come back to themselves round a line from"), "{message}");
    // What covers it comes first; a range of stretches helps where nothing winds.
    assert!(message.contains(". Cover the line with core = \"solid\" or \"void\", smooth"), "{message}");
    assert!(!message.contains("stretch"), "{message}");
    let line =
        built("direction = [{ formula = \"cos(atan2(y, x)/2)\" }, { formula = \"sin(atan2(y, x)/2)\" }, 0]", false);
    if let Err(why) = line {
        assert!(!why.to_string().contains("core ="), "no core serves a direction: {why}");
    }
}
