//! Cells of which an axis is along the normal of the surface.

use crate::common::{cuboid, mean, off_axis, within};
use std::sync::Arc;

use geometry::math::{Vec3, determinant, norm, unit};
use trabecula::grade::{Formula, Grade};
use trabecula::map::{Aligned, Axis, Mapping, Orientation, Phase, PhaseRequest, SolverOptions, TwoAxes};
use trabecula::region::{Cylinder, Difference, Intersection, Region};

fn wanted(wavelength: f64, orientation: Orientation, depth: Option<f64>) -> PhaseRequest {
    PhaseRequest {
        align: depth.map(|d| Aligned::new(d).expect("depth")),
        ..PhaseRequest::new([0; 3].map(|_| Grade::Constant(wavelength)), orientation)
    }
}

fn angles(of: Vec3) -> Orientation {
    Orientation::Angles(of.map(Grade::Constant))
}

fn solve(region: &Region, wanted: &PhaseRequest) -> Phase {
    let settings = SolverOptions { region: Some(&**region), ..SolverOptions::default() };
    Phase::solve(&region.bounds(), wanted, &settings).unwrap_or_else(|f| panic!("{f}"))
}

/// In a box all normals are axes of one frame, edges and corners included: the map is affine, to the end of the search for a frame.
#[test]
fn cells_in_a_box_are_along_its_edges() {
    let region = cuboid([-3.0, 2.0, 1.0], [11.0, 12.0, 9.0]);
    let map = solve(&region, &wanted(2.0, angles([0.0; 3]), Some(3.0)));
    for p in within(&region, 500, 3) {
        let j = map.jacobian(p);
        for a in 0..3 {
            let mut e = [0.0; 3];
            e[a] = 1.0;
            assert!(off_axis(&j, e) < 1e-6 && (2.0 * norm(j[a]) - 1.0).abs() < 1e-8, "{j:?}");
        }
    }
}

/// In a quarter of a tube, whose end faces are along radii, cells go round as well as those that are given the radius.
#[test]
fn cells_in_a_curved_panel_follow_it() {
    let cylinder = |r: f64, base: f64, height: f64| -> Region {
        Arc::new(Cylinder::new([0.0, 0.0, base], [0.0, 0.0, 1.0], r, height).expect("cylinder"))
    };
    let tube: Region =
        Arc::new(Difference::new(vec![cylinder(16.0, 0.0, 8.0), cylinder(10.0, -1.0, 10.0)]).expect("tube"));
    let quarter = cuboid([0.0, 0.0, -1.0], [17.0, 17.0, 9.0]);
    let region: Region = Arc::new(Intersection::new(vec![tube, quarter]).expect("panel"));
    let f = |text: &str| Grade::from(Formula::parse(text).expect("formula"));
    let zero = || Grade::Constant(0.0);
    let radius = Axis::Vector([f("x + 1e-9"), f("y"), zero()]);
    let up = Axis::Vector([zero(), zero(), Grade::Constant(1.0)]);
    let found = [
        solve(&region, &wanted(2.0, angles([0.0; 3]), Some(4.0))),
        solve(&region, &wanted(2.0, Orientation::Frame(TwoAxes::new(radius, up)), None)),
    ]
    .map(|map| {
        let points = within(&region, 5000, 3);
        assert!(points.iter().all(|p| determinant(&map.jacobian(*p)) > 0.0));
        mean(points.iter().map(|p| off_axis(&map.jacobian(*p), unit([p[0], p[1], 0.0]))))
    });
    println!("panel: {found:?}");
    // The mean of normals over a length ℓ is off by (ℓ/r)²/2 at most, ℓ being half the depth and r the least radius.
    assert!(found[0] < (0.5 * 0.2f64.powi(2)).to_degrees() + found[1], "{found:?}");
}

/// Cells that are turned by 30 degrees within come to lie along the surface on their way out. Each row of cells along an edge would have
/// to be as long as the edge and as its shadow on the turned rows, so they do as far as angles count more than spacings.
#[test]
fn cells_within_are_turned_as_asked() {
    let region = cuboid([0.0; 3], [20.0, 20.0, 6.0]);
    let points = within(&region, 20_000, 3);
    let normal = |p: &Vec3| match [0, 1].map(|a| p[a].min(20.0 - p[a]) < 0.4) {
        [true, false] => Some([1.0, 0.0, 0.0]),
        [false, true] => Some([0.0, 1.0, 0.0]),
        _ => None,
    };
    let (s, c) = 30f64.to_radians().sin_cos();
    let found = [1.0, 10.0, 100.0].map(|angle_weight| {
        let turned = PhaseRequest { angle_weight, ..wanted(1.0, angles([0.0, 0.0, 30.0]), Some(4.0)) };
        let map = solve(&region, &turned);
        let edges = points.iter().filter_map(|p| normal(p).map(|n| off_axis(&map.jacobian(*p), n)));
        let middle = points.iter().filter(|p| norm([p[0] - 10.0, p[1] - 10.0, 0.0]) < 3.0);
        [mean(edges), mean(middle.map(|p| off_axis(&map.jacobian(*p), [c, s, 0.0])))]
    });
    println!("plate: {found:?}");
    assert!(found.windows(2).all(|w| (0..2).all(|i| w[1][i] < w[0][i])), "{found:?}");
    assert!(found[0][0] < 30.0 && found[2][0] < 10.0 && found[2][1] < 3.0, "{found:?}");
}
