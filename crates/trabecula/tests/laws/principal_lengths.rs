//! Wavelengths by the order of the principal stresses lie along their directions, whatever axes of the cell do.

use geometry::math::{Aabb, Mat3, Vec3, apply, norm, product, rotation, transpose};
use geometry::random::random;
use trabecula::grade::{Formula, Grade};
use trabecula::map::{Mapping, Orientation, Phase, PhaseRequest, SolverOptions};

const BOX: Aabb = Aabb { min: [0.0; 3], max: [24.0, 12.0, 12.0] };
const LENGTHS: Vec3 = [3.0, 4.0, 5.0];

fn solved(stress: [Grade; 6], smooth: Option<f64>) -> Phase {
    let wanted = PhaseRequest {
        by_principal: true,
        smooth,
        ..PhaseRequest::new(LENGTHS.map(Grade::Constant), Orientation::Stress(stress.into()))
    };
    Phase::solve(&BOX, &wanted, &SolverOptions::default()).unwrap_or_else(|f| panic!("{f}"))
}

/// The tensor of a frame (columns) and principal values.
fn tensor(frame: &Mat3, values: Vec3) -> [f64; 6] {
    let scaled: Mat3 = core::array::from_fn(|i| core::array::from_fn(|j| frame[i][j] * values[j]));
    let t = product(&scaled, &transpose(frame));
    [t[0][0], t[1][1], t[2][2], t[1][2], t[0][2], t[0][1]]
}

/// Any constant stress, its values in any order along any directions: the map is affine, and the steps of its phases along each
/// direction are those of the length for the value's rank.
#[test]
fn each_direction_has_the_length_of_its_rank() {
    let mut seed = 5;
    for _ in 0..24 {
        let frame = rotation([0; 3].map(|_| 180.0 * random(&mut seed)));
        // Apart by more than the tenth within which values count as equal.
        let mut values = [8.0, 1.0, -5.0].map(|v| v + random(&mut seed));
        values.rotate_left((3.0 * random(&mut seed).abs()) as usize);
        let map = solved(tensor(&frame, values).map(Grade::Constant), None);
        for (k, v) in values.iter().enumerate() {
            let rank = values.iter().filter(|w| *w > v).count();
            let along = [frame[0][k], frame[1][k], frame[2][k]];
            let step = norm(apply(&map.jacobian([7.0, 5.0, 4.0]), along));
            // Rounding of an eigenvector, its logarithm and exponential.
            assert!((step * LENGTHS[rank] - 1.0).abs() < 1e-12, "{values:?} {k}: {step}");
        }
    }
}

/// Where two values change places the lengths along their directions do, over the distance within which they count as equal; there it is
/// the geometric mean along both. The axes of the cell stay what they are.
#[test]
fn lengths_change_places_where_values_do() {
    let f = |text: &str| Grade::from(Formula::parse(text).expect("formula"));
    let zero = || Grade::Constant(0.0);
    for smooth in [None, Some(1.0)] {
        let map =
            solved([f("10 + (x - 12)"), f("10 - (x - 12)"), Grade::Constant(-30.0), zero(), zero(), zero()], smooth);
        // |K| = |∇Φ| / spacing.
        let wanted = |x: f64| {
            let p = [x, 6.0, 6.0];
            let (j, m) = (map.jacobian(p), map.misfits(&[p]).expect("misfit")[0]);
            core::array::from_fn::<f64, 3, _>(|i| m.spacing[i] / norm(j[i]))
        };
        // A smoothing length of 1 mm leaves e⁻⁷ of what is 7 mm away.
        let close = |found: Vec3, want: Vec3, within: f64| (0..3).all(|i| (found[i] / want[i] - 1.0).abs() < within);
        let within = if smooth.is_some() { 2e-3 } else { 1e-12 };
        assert!(close(wanted(2.0), [4.0, 3.0, 5.0], within), "{:?}", wanted(2.0));
        assert!(close(wanted(22.0), [3.0, 4.0, 5.0], within), "{:?}", wanted(22.0));
        let mean = 12f64.sqrt();
        assert!(close(wanted(12.0), [mean, mean, 5.0], 1e-9), "{:?}", wanted(12.0));
    }
}
