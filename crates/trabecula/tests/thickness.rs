//! Local thickness of shapes where it is known in closed form, and the rate at which its error falls.

use std::sync::Arc;

use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::{Progress, Silent, Stopped, Surface, surface};
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::{Affine, Map};
use trabecula::math::{Vec3, apply, rotation};
use trabecula::measure::{Spread, size, thickness, usual_step, voxels_for};
use trabecula::mesh::Mesh;
use trabecula::region::{Cuboid, Cylinder, Difference, Region, Sphere};
use trabecula::solid::Solid;

fn bare(mesh: Mesh) -> Surface {
    Surface {
        cut: vec![false; mesh.triangles.len()],
        mesh,
    }
}

fn wall(mesh: Mesh, step: f64) -> Spread {
    thickness(&bare(mesh), None, step, &Silent).expect("thickness").wall
}

/// A box as twelve triangles.
fn block(min: Vec3, size: Vec3) -> Mesh {
    let corner = |i: usize| core::array::from_fn(|a| min[a] + size[a] * (i >> a & 1) as f64);
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect(),
    }
}

fn turned(mut mesh: Mesh, degrees: Vec3) -> Mesh {
    let by = rotation(degrees);
    mesh.vertices.iter_mut().for_each(|v| *v = apply(&by, *v));
    mesh
}

fn full(region: Region, edge: f64) -> Surface {
    let solid = Solid {
        region,
        field: None,
        wavelength: 1.0,
    };
    surface(&solid, edge, &Silent).expect("surface")
}

fn ball(center: Vec3, radius: f64) -> Sphere {
    Sphere::new(center, radius).expect("ball")
}

/// A cube of gyroid, cells of 4 mm.
fn gyroid(part: Part, fraction: f64, edge: f64) -> (Surface, Region) {
    let cell = Cell::new(Series::new(named("gyroid").expect("gyroid").terms()).expect("series"));
    let map = Affine::rigid([4.0; 3], [0.0; 3], [0.0; 3], &[]).expect("map");
    let level = Level::Fraction(Grade::Constant(fraction));
    let field = Arc::new(Lattice::new(Arc::new(cell), Map::Affine(map), part, level));
    let region: Region = Arc::new(Cuboid::new([0.0; 3], [8.0; 3]).expect("box"));
    let solid = Solid {
        region: region.clone(),
        field: Some(field),
        wavelength: 4.0,
    };
    (surface(&solid, edge, &Silent).expect("surface"), region)
}

fn line(s: &Spread) -> String {
    format!("min {:.4} p05 {:.4} mean {:.4} sd {:.4} max {:.4}", s.min, s.p05, s.mean, s.sd, s.max)
}

#[test]
#[ignore]
fn look() {
    for step in [0.4, 0.2, 0.1, 0.05] {
        for (name, mesh) in [
            ("slab", block([0.0; 3], [10.0, 10.0, 1.03])),
            ("slab turned", turned(block([0.0; 3], [10.0, 10.0, 1.03]), [20.0, 33.0, 47.0])),
            ("ball", full(Arc::new(ball([0.0; 3], 1.5)), 0.04).mesh),
            ("cylinder", full(Arc::new(Cylinder::new([0.0; 3], [0.3, 0.2, 1.0], 0.7, 6.0).expect("c")), 0.04).mesh),
            ("cube", block([0.0; 3], [3.01; 3])),
            ("cube turned", turned(block([0.0; 3], [3.01; 3]), [20.0, 33.0, 47.0])),
        ] {
            let start = std::time::Instant::now();
            let s = wall(mesh, step);
            println!("{step} {name}: {} {:?}", line(&s), start.elapsed());
        }
    }
    for (part, f) in [(Part::Sheet, 0.1), (Part::Sheet, 0.3), (Part::Upper, 0.3)] {
        let (made, region) = gyroid(part, f, 4.0 / 48.0);
        for step in [0.16, 0.08, 0.04, 0.032] {
            let start = std::time::Instant::now();
            let t = thickness(&made, Some(&region), step, &Silent).expect("thickness");
            println!("{part:?} {f} {step}: {} | {} {:?}", line(&t.wall), line(&t.pore.expect("pores")), start.elapsed());
        }
    }
}
