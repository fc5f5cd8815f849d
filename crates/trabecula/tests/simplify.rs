//! Simplified meshes: what they guarantee, how light they get, how far they are from the first.

use std::sync::Arc;
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::{Silent, Surface, surface};
use trabecula::field::Field;
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Affine, Map};
use trabecula::region::{Cuboid, Cylinder, Region, Sphere};
use trabecula::simplify::{Goal, simplify};
use trabecula::solid::Solid;

fn solid(region: Region, field: Option<Arc<dyn Field>>) -> Solid {
    Solid {
        region,
        field,
        wavelength: 1.0,
    }
}

#[test]
#[ignore]
fn try_it() {
    let cell = Cell::new(Series::new(named("gyroid").unwrap().terms()).unwrap());
    let map = Affine::rigid([5.0; 3], [0.0; 3], [0.0; 3], &[]).expect("map");
    let lattice: Arc<dyn Field> = Arc::new(Lattice::new(
        Arc::new(cell),
        Map::Affine(map),
        Part::Sheet,
        Level::Fraction(Grade::Constant(0.3)),
    ));
    let cases: Vec<(&str, Surface)> = vec![
        (
            "cube",
            surface(
                &solid(Arc::new(Cuboid::new([0.0; 3], [10.0; 3]).unwrap()), None),
                0.25,
                &Silent,
            )
            .unwrap(),
        ),
        (
            "ball",
            surface(
                &solid(Arc::new(Sphere::new([0.0; 3], 10.0).unwrap()), None),
                0.2,
                &Silent,
            )
            .unwrap(),
        ),
        (
            "cylinder",
            surface(
                &solid(
                    Arc::new(Cylinder::new([0.1, 0.2, 0.3], [0.0, 0.0, 1.0], 10.0, 5.0).unwrap()),
                    None,
                ),
                0.2,
                &Silent,
            )
            .unwrap(),
        ),
        (
            "gyroid",
            surface(
                &solid(
                    Arc::new(Cuboid::new([0.0; 3], [10.0; 3]).unwrap()),
                    Some(lattice),
                ),
                0.25,
                &Silent,
            )
            .unwrap(),
        ),
    ];
    for (name, s) in &cases {
        for tolerance in [0.05, 0.02] {
            let start = std::time::Instant::now();
            let (_, r) = simplify(
                s,
                &Goal {
                    tolerance: Some(tolerance),
                    triangles: None,
                },
                &Silent,
            )
            .unwrap();
            eprintln!(
                "{name} {tolerance}: {:?} dev {:.4} vol {:.2e} area {:.2e} {:.0}k/s",
                r.triangles,
                r.deviation,
                r.volume[1] / r.volume[0] - 1.0,
                r.area[1] / r.area[0] - 1.0,
                r.triangles[0] as f64 / start.elapsed().as_secs_f64() / 1e3
            );
        }
    }
}
