//! Phases that are whole numbers on faces of the part.

use crate::common::cuboid;
use std::sync::Arc;

use geometry::math::{Vec3, determinant, norm};
use trabecula::grade::Grade;
use trabecula::map::{Aligned, Mapping, Orientation, Phase, PhaseRequest, SolverOptions};
use trabecula::region::{Cylinder, Difference, Intersection, Region};

fn wanted(wavelength: f64, rotate: Vec3, fix: Vec<Region>) -> PhaseRequest {
    PhaseRequest {
        fix,
        offset: [0.3, 0.2, -0.1],
        ..PhaseRequest::new(
            [0; 3].map(|_| Grade::Constant(wavelength)),
            Orientation::Angles(rotate.map(Grade::Constant)),
        )
    }
}

fn solve(region: &Region, wanted: &PhaseRequest) -> Result<Phase, String> {
    let settings = SolverOptions { region: Some(&**region), ..SolverOptions::default() };
    Phase::solve(&region.bounds(), wanted, &settings).map_err(|f| f.to_string())
}

fn phases(map: &Phase, p: Vec3) -> Vec3 {
    let mut u = [[0.0; 3]];
    map.phases(&[p], &mut u);
    u[0]
}

/// A slab 10 mm thick with cells of 3 mm has three whole ones through it; the other two phases are what they were, to
/// rounding.
#[test]
fn a_slab_has_whole_cells_through_it() {
    let slab = cuboid([-5.0, 0.0, 0.0], [5.0, 14.0, 12.0]);
    let ends = [-5.0, 5.0].map(|x| cuboid([x - 0.1, -1.0, -1.0], [x + 0.1, 15.0, 13.0]));
    let [free, fixed] = [vec![], ends.to_vec()].map(|fix| solve(&slab, &wanted(3.0, [0.0; 3], fix)).expect("solved"));
    for i in 0..400 {
        let s = [0.371, 0.713, 0.193].map(|s| (s * f64::from(i)).fract());
        let p = [-5.0 + 10.0 * s[0], 14.0 * s[1], 12.0 * s[2]];
        let [low, high, within] = [[-5.0, p[1], p[2]], [5.0, p[1], p[2]], p].map(|p| phases(&fixed, p));
        // A weight of a thousand on the faces, and there is no other error.
        assert!((low[0] - low[0].round()).abs() < 2e-3 && (high[0] - high[0].round()).abs() < 2e-3, "{low:?} {high:?}");
        assert_eq!((high[0] - low[0]).round(), 3.0);
        let still = phases(&free, p);
        assert!((1..3).all(|i| (within[i] - still[i]).abs() < 1e-12), "{within:?} {still:?}");
        // Nine tenths of a cell each, evenly.
        assert!((fixed.jacobian(p)[0][0] - 0.3).abs() < 2e-3, "{:?}", fixed.jacobian(p));
    }
}

/// Cells along the surface of a curved panel: both of its cylindrical faces are whole, to the second order of the grid's step.
#[test]
fn a_curved_wall_has_whole_cells_through_it() {
    let cylinder = |r: f64, base: f64, height: f64| -> Region {
        Arc::new(Cylinder::new([0.0, 0.0, base], [0.0, 0.0, 1.0], r, height).expect("cylinder"))
    };
    let tube: Region =
        Arc::new(Difference::new(vec![cylinder(15.0, 0.0, 6.0), cylinder(10.0, -1.0, 8.0)]).expect("tube"));
    let panel: Region =
        Arc::new(Intersection::new(vec![tube, cuboid([0.0, 0.0, -1.0], [17.0, 17.0, 7.0])]).expect("panel"));
    let faces = [10.0, 15.0].map(|r| -> Region {
        Arc::new(Difference::new(vec![cylinder(r + 0.2, -1.0, 8.0), cylinder(r - 0.2, -2.0, 10.0)]).expect("shell"))
    });
    let errors = [0.5, 0.25].map(|step| {
        let align = Some(Aligned::new(4.0).expect("depth"));
        let wanted = PhaseRequest { align, ..wanted(2.0, [0.0; 3], faces.to_vec()) };
        let settings = SolverOptions { region: Some(&*panel), step: Some(step), ..SolverOptions::default() };
        let map = Phase::solve(&panel.bounds(), &wanted, &settings).expect("solved");
        let mut worst = 0.0f64;
        for i in 0..200 {
            let (t, z) = (0.1 + 1.37 * (0.371 * f64::from(i)).fract(), 6.0 * (0.713 * f64::from(i)).fract());
            let on = [10.0, 15.0].map(|r| phases(&map, [r * t.cos(), r * t.sin(), z]));
            let radial = (0..3).max_by(|a, b| (on[1][*a] - on[0][*a]).abs().total_cmp(&(on[1][*b] - on[0][*b]).abs()));
            for u in on {
                let u = u[radial.expect("axis")];
                worst = worst.max((u - u.round()).abs());
            }
            assert!(determinant(&map.jacobian([12.0 * t.cos(), 12.0 * t.sin(), z])) > 0.0);
        }
        worst
    });
    println!("panel: {errors:?}");
    assert!(errors[1] < 0.01 && errors[0] < 0.04, "{errors:?}");
}

/// Two parts that meet at a fixed face have the same phase on it, whatever is beyond.
#[test]
fn parts_that_meet_fit() {
    let face = cuboid([-0.1, -1.0, -1.0], [0.1, 20.0, 20.0]);
    let parts = [cuboid([-7.0, 0.0, 0.0], [0.0, 9.0, 9.0]), cuboid([0.0, 0.0, 0.0], [11.0, 9.0, 9.0])];
    let at = parts.map(|part| {
        phases(&solve(&part, &wanted(2.7, [0.0; 3], vec![face.clone()])).expect("solved"), [0.0, 4.0, 5.0])
    });
    let apart = norm([0, 1, 2].map(|i| (at[0][i] - at[1][i]) - (at[0][i] - at[1][i]).round()));
    assert!(apart < 2e-3, "{at:?}");
}

/// Cells that are not along the normal, a region without a face, and faces of a wall thinner than half a cell are refused with their
/// place.
#[test]
fn what_cannot_be_fixed_is_refused() {
    let slab = cuboid([0.0; 3], [12.0, 12.0, 6.0]);
    let face = || cuboid([-0.1, -1.0, -1.0], [0.1, 13.0, 7.0]);
    let turned = solve(&slab, &wanted(2.0, [0.0, 0.0, 40.0], vec![face()])).err().expect("turned");
    assert!(turned.starts_with("fix[0]") && turned.contains("40 degrees"), "{turned}");
    let inside = cuboid([4.0; 3], [5.0; 3]);
    let none = solve(&slab, &wanted(2.0, [0.0; 3], vec![face(), inside])).err().expect("none");
    assert!(none.starts_with("fix[1]") && none.contains("no part of the surface"), "{none}");
    let opposite = cuboid([11.9, -1.0, -1.0], [12.1, 13.0, 7.0]);
    let thin = solve(&slab, &wanted(30.0, [0.0; 3], vec![face(), opposite])).err().expect("thin");
    assert!(thin.starts_with("fix[1]") && thin.contains("0.40 cells") && thin.contains("fix[0]"), "{thin}");
}
