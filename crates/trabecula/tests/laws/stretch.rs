//! Bounds on how much cells are stretched hold wherever a map is accepted.

use crate::common::{campaign, points};
use geometry::math::{Aabb, Vec3, determinant};
use trabecula::design::{Built, Design, NoFiles};
use trabecula::field::Field;
use trabecula::grade::{Formula, Grade};
use trabecula::map::{Mapping, Orientation, Phase, PhaseRequest, SolverOptions, Stretch};
use trabecula::region::Cylinder;

fn wanted(rotate: [&str; 3], range: Option<[f64; 2]>) -> PhaseRequest {
    PhaseRequest {
        stretch: range.map(|r| Stretch::new(r).expect("range")),
        ..PhaseRequest::new(
            [0; 3].map(|_| Grade::Constant(3.0)),
            Orientation::Angles(rotate.map(|f| Grade::from(Formula::parse(f).expect("formula")))),
        )
    }
}

/// Those of the rod, which touches them.
const BOX: Aabb = Aabb { min: [1.0, 1.0, 0.0], max: [23.0, 23.0, 12.0] };

fn rod() -> Cylinder {
    Cylinder::new([12.0, 12.0, 0.0], [0.0, 0.0, 1.0], 11.0, 12.0).expect("rod")
}

/// The share of points in a region at which cells are stretched beyond a range.
fn beyond(map: &Phase, region: &dyn Field, range: [f64; 2]) -> f64 {
    let within: Vec<Vec3> = points(&BOX, 30_000).filter(|p| region.value(*p) < 0.0).collect();
    let found = map.misfits(&within).expect("misfits");
    let out = found.iter().filter(|m| m.density <= 0.0 || m.stretch[0] < range[0] || m.stretch[1] > range[1]);
    out.count() as f64 / within.len() as f64
}

/// Where least squares alone stretches cells too much, nearly all of them keep to the range: it is held in the middles of the grid's
/// cells, and off them to what the Jacobian changes by within one. What is lost is fidelity, and little of it. Two targets; three in
/// `make campaign`.
#[test]
fn cells_keep_to_the_range() {
    let rod = rod();
    let targets = [
        (["0", "0", "2.5*x"], [0.8, 1.25]),
        (["10*sin(x/3)", "20*sin(y/4)", "40*sin(x/3)*cos(y/4)"], [0.67, 1.5]),
        (["0", "0", "5*x"], [0.67, 1.5]),
    ];
    for (rotate, range) in targets.into_iter().take(if campaign() { 3 } else { 2 }) {
        let settings = SolverOptions { region: Some(&rod), ..SolverOptions::default() };
        let solve = |range| Phase::solve(&BOX, &wanted(rotate, range), &settings).expect("no fold");
        let [free, held] = [solve(None), solve(Some(range))];
        let [before, after] = [&free, &held].map(|m| beyond(m, &rod, range));
        let angle = |m: &Phase| m.distortion().angle.map(|a| a.mean).iter().sum::<f64>();
        println!("{rotate:?}: {before} {after}, {:?}, angles {} {}", held.overstretched(), angle(&free), angle(&held));
        assert!(before > 0.02 && after < 0.003, "{rotate:?}: {before} {after}");
        assert!(angle(&held) < 1.3 * angle(&free));
    }
}

/// A target that no map of least squares can follow without cells that are turned inside out has one whose cells are not.
#[test]
fn a_map_that_folds_is_unfolded() {
    let (rod, rotate) = (rod(), ["0", "0", "90*sin(x/2)"]);
    let settings = SolverOptions { region: Some(&rod), ..SolverOptions::default() };
    let refused = Phase::solve(&BOX, &wanted(rotate, None), &settings).err().expect("it folds");
    assert!(refused.message.contains("stretch"), "{}", refused.message);
    let map = Phase::solve(&BOX, &wanted(rotate, Some([0.67, 1.5])), &settings).expect("no fold");
    let mut within = points(&BOX, 200_000).filter(|p| rod.value(*p) < 0.0);
    assert!(within.all(|p| determinant(&map.jacobian(p)) > 0.0));
}

/// What keeps to the range as it is stays what it is, to the bit.
#[test]
fn a_map_within_the_range_is_that_of_least_squares() {
    for rotate in [["0", "0", "2*x"], ["3*sin(x/4)", "2*y", "20"]] {
        let solve = |range| Phase::solve(&BOX, &wanted(rotate, range), &SolverOptions::default()).expect("no fold");
        let [free, held] = [solve(None), solve(Some([0.5, 2.0]))];
        for p in points(&BOX, 500) {
            assert_eq!(free.jacobian(p), held.jacobian(p));
        }
    }
}

/// A range never makes of a map that does not fold one that does: round a singular line, where cells cannot be held in it, the map
/// without a range is taken, and a warning says where the range is left.
#[test]
fn a_range_that_folds_is_left_out() {
    let built = |more: &str| {
        let text = format!(
            "schema = 1\nregion.box = {{ min = [-4.3, -5.1, 0], max = [5.2, 4.4, 3] }}\n[lattice.a]\ncell = \"primitive\"\npart = \"upper\"\n\
             level.fraction = 0.4\n[lattice.a.map.phase]\nwavelength = 3\nstep = 1.4\nstress = [{{ formula = \"x\" }}, \
             {{ formula = \"-x\" }}, -20, 0, 0, {{ formula = \"y\" }}]\n{more}"
        );
        Design::from_toml(&text).expect("text").build(&NoFiles).expect("no fold")
    };
    let [free, held] = ["", "stretch = [0.67, 1.5]"].map(built);
    let reported = held.warnings.iter().find(|w| w.message.contains("stretch = [0.67, 1.5]")).expect("a warning");
    assert!(
        reported.message.contains("times as long as asked for at (") && reported.message.contains("folding"),
        "{reported:?}"
    );
    let density = |made: &Built| made.report().lattices["a"].distortion.as_ref().expect("solved").density;
    assert!(density(&free)[0] > 0.0 && density(&held)[0] > 0.0);
}
