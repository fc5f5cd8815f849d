//! Local thickness of shapes where it is known in closed form, and the rate at which its error falls.

use std::sync::Arc;

use geometry::math::{Vec3, add, apply, rotation};
use geometry::measure::size;
use geometry::mesh::Mesh;
use geometry::mesh::samples::join;
use geometry::progress::{Progress, Silent, Stopped};
use geometry::surface_mesh::SurfaceMesh;
use trabecula::analysis::{ThicknessSpread, thickness, thickness_at_vertices, usual_step, voxels_for};
use trabecula::cell::{Cell, Part, Series, named};
use trabecula::extract::surface;
use trabecula::grade::Grade;
use trabecula::lattice::{Lattice, Level};
use trabecula::map::Affine;
use trabecula::region::{Cuboid, Cylinder, Difference, Region, Sphere, Union};
use trabecula::solid::Solid;

fn bare(mesh: Mesh) -> SurfaceMesh {
    SurfaceMesh { cut: vec![false; mesh.triangles.len()], mesh }
}

fn wall(mesh: Mesh, step: f64) -> ThicknessSpread {
    thickness(&bare(mesh), None, step, &Silent).expect("thickness").wall_thickness
}

fn block(min: Vec3, size: Vec3) -> Mesh {
    Mesh::cuboid(min, add(min, size))
}

fn turned(mut mesh: Mesh, degrees: Vec3) -> Mesh {
    let by = rotation(degrees);
    mesh.vertices.iter_mut().for_each(|v| *v = apply(&by, *v));
    mesh
}

fn full(region: Region, edge: f64) -> SurfaceMesh {
    let solid = Solid::new(region, None, 1.0);
    surface(&solid, edge, &Silent).expect("surface")
}

fn ball(center: Vec3, radius: f64) -> Sphere {
    Sphere::new(center, radius).expect("ball")
}

/// A cube of gyroid, cells of 4 mm.
fn gyroid(side: f64, part: Part, fraction: f64, edge: f64) -> (SurfaceMesh, Region) {
    let cell = Cell::new(Series::new(named("gyroid").expect("gyroid").terms()).expect("series"));
    let map = Affine::rigid([4.0; 3], [0.0; 3], [0.0; 3], &[]).expect("map");
    let level = Level::Fraction(Grade::Constant(fraction));
    let field = Arc::new(Lattice::new(Arc::new(cell), Arc::new(map), part, level));
    let region: Region = Arc::new(Cuboid::new([0.0; 3], [side; 3]).expect("box"));
    let solid = Solid::new(region.clone(), Some(field), 4.0);
    (surface(&solid, edge, &Silent).expect("surface"), region)
}

#[test]
fn slabs_have_their_thickness_however_they_lie() {
    for degrees in [[0.0; 3], [20.0, 33.0, 47.0], [0.0, 45.0, 0.0]] {
        for step in [0.4, 0.2, 0.1] {
            let s = wall(turned(block([0.1; 3], [20.0, 20.0, 1.03]), degrees), step);
            for found in [s.min, s.p05, s.max] {
                // Planes are exact but for the rounding of single precision; balls touch to a fiftieth of a step.
                assert!((found - 1.03).abs() < 0.02 * step, "{degrees:?} {step}: {s:?}");
            }
            // Less than the whole only by what no ball reaches at the rim.
            assert!(s.mean > 0.98 * 1.03 && s.mean <= s.max, "{s:?}");
            assert!((s.histogram.share.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}

/// Two plates with a gap of 1 mm between them and a boss on the upper one, whose face lies in a layer of voxels' centres: in it
/// nothing is pore. The same where coordinates are rounded to single precision.
#[test]
fn faces_of_the_region_in_a_layer_of_centres_are_no_pores() {
    let boxes =
        [([0.0; 3], [10.0, 10.0, 2.0]), ([0.0, 0.0, 3.0], [10.0, 10.0, 0.75]), ([4.0, 4.0, 3.2], [2.0, 2.0, 1.3])];
    let mut solid = join(&boxes.map(|(min, size)| block(min, size)));
    let cuboid = |max: Vec3, min: Vec3| Arc::new(Cuboid::new(min, max).expect("box")) as Region;
    let whole = vec![cuboid([10.0, 10.0, 3.75], [0.0; 3]), cuboid([6.0, 6.0, 4.5], [4.0, 4.0, 3.2])];
    let region: Region = Arc::new(Union::new(whole).expect("union"));
    for shift in [0.0, 5e-9] {
        solid.vertices.iter_mut().for_each(|v| *v = v.map(|x| x - shift));
        let pore =
            thickness(&bare(solid.clone()), Some(&region), 0.5, &Silent).expect("thickness").pore_size.expect("pore");
        for found in [pore.min, pore.p05, pore.mean, pore.max] {
            // Planes are exact but for the rounding of single precision; balls touch to a fiftieth of a step.
            assert!((found - 1.0).abs() < 0.02 * 0.5, "{shift}: {pore:?}");
        }
    }
}

#[test]
fn spheres_and_cylinders_have_their_diameter() {
    let sphere = full(Arc::new(ball([0.0; 3], 1.5)), 0.04).mesh;
    let rod = Cylinder::new([0.0; 3], [0.3, 0.2, 1.0], 0.7, 6.0).expect("cylinder");
    let rod = full(Arc::new(rod), 0.04).mesh;
    for step in [0.2, 0.1] {
        let s = wall(sphere.clone(), step);
        for found in [s.min, s.p05, s.mean, s.max] {
            assert!((found - 3.0).abs() < 0.05 * step, "{step}: {s:?}");
        }
        let s = wall(rod.clone(), step);
        for found in [s.min, s.max] {
            assert!((found - 1.4).abs() < 0.15 * step, "{step}: {s:?}");
        }
    }
}

#[test]
fn two_slabs_have_two_peaks() {
    let mut two = block([0.0; 3], [20.0, 20.0, 1.0]);
    let other = block([0.0, 0.0, 3.0], [20.0, 20.0, 2.0]);
    two.vertices.extend(other.vertices);
    two.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + 8)));
    let s = wall(two, 0.2);
    assert!((s.min - 1.0).abs() < 0.01 && (s.max - 2.0).abs() < 0.01, "{s:?}");
    let within = |low: f64, high: f64| {
        let bars = s.histogram.edges.windows(2).zip(&s.histogram.share);
        bars.filter(|(e, _)| e[0] >= low && e[1] <= high).map(|(_, share)| share).sum::<f64>()
    };
    // A third of the volume and two thirds, less what lies at the rims.
    assert!((within(0.9, 1.1) - 1.0 / 3.0).abs() < 0.03, "{s:?}");
    assert!((within(1.9, 2.1) - 2.0 / 3.0).abs() < 0.05, "{s:?}");
}

#[test]
fn a_shell_and_the_ball_in_it() {
    let region: Region = Arc::new(ball([0.0; 3], 3.0));
    let shell: Region = Arc::new(Difference::new(vec![region.clone(), Arc::new(ball([0.0; 3], 2.0))]).expect("shell"));
    let made = full(shell, 0.08);
    let t = thickness(&made, Some(&region), 0.15, &Silent).expect("thickness");
    let pore = t.pore_size.expect("pore");
    for found in [t.wall_thickness.min, t.wall_thickness.p05, t.wall_thickness.mean, t.wall_thickness.max] {
        assert!((found - 1.0).abs() < t.wall_thickness.accuracy, "{:?}", t.wall_thickness);
    }
    for found in [pore.min, pore.p05, pore.mean, pore.max] {
        assert!((found - 4.0).abs() < t.wall_thickness.accuracy, "{pore:?}");
    }
}

#[test]
fn turning_and_moving_change_nothing() {
    let (made, _) = gyroid(8.0, Part::Sheet, 0.3, 0.1);
    let still = wall(made.mesh.clone(), 0.08);
    let mut moved = turned(made.mesh, [15.0, 40.0, 65.0]);
    moved.vertices.iter_mut().flatten().for_each(|x| *x += 0.0317);
    let moved = wall(moved, 0.08);
    for (a, b) in [(still.mean, moved.mean), (still.sd, moved.sd), (still.max, moved.max)] {
        assert!((a - b).abs() < 0.15 * 0.08, "{still:?} {moved:?}");
    }
}

#[test]
fn errors_fall_with_the_step() {
    let (made, region) = gyroid(4.0, Part::Sheet, 0.3, 4.0 / 48.0);
    let mean = |step| {
        let t = thickness(&made, Some(&region), step, &Silent).expect("thickness");
        [t.wall_thickness.mean, t.pore_size.expect("pores").mean]
    };
    let [a, b, c] = [0.16, 0.08, 0.04].map(mean);
    for k in 0..2 {
        // Of an error C·h^p, differences fall by 2^p. Measured: 2.2 and more.
        let rate = (b[k] - a[k]).abs() / (c[k] - b[k]).abs();
        assert!(rate > 1.8, "{rate} {a:?} {b:?} {c:?}");
        assert!((b[k] - c[k]).abs() < 0.15 * 0.08, "{a:?} {b:?} {c:?}");
    }
}

#[test]
fn a_thin_sheet_is_as_thick_as_its_volume_over_half_its_area() {
    let (made, region) = gyroid(4.0, Part::Sheet, 0.1, 4.0 / 48.0);
    let t = thickness(&made, Some(&region), 0.04, &Silent).expect("thickness");
    let cut = made.cut.iter().enumerate().filter(|c| *c.1);
    let area = made.mesh.area() - cut.map(|(i, _)| triangle(&made.mesh, i)).sum::<f64>();
    let expected = size(&made.mesh).volume / (area / 2.0);
    assert!(
        (t.wall_thickness.mean - expected).abs() < t.wall_thickness.accuracy,
        "{} {expected}",
        t.wall_thickness.mean
    );
}

fn triangle(mesh: &Mesh, i: usize) -> f64 {
    let one = Mesh { vertices: mesh.corners(i).to_vec(), triangles: vec![[0, 1, 2]] };
    one.area()
}

#[test]
fn the_same_for_any_number_of_threads() {
    let (made, region) = gyroid(8.0, Part::Upper, 0.3, 0.2);
    let on = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("pool");
        pool.install(|| thickness(&made, Some(&region), 0.15, &Silent).expect("thickness"))
    };
    assert_eq!(on(1), on(3));
}

#[test]
fn refused_with_reasons() {
    let refused = |mesh: Mesh, step: f64| match thickness(&bare(mesh), None, step, &Silent) {
        Err(Stopped::Refused(fault)) => fault.to_string(),
        other => panic!("{other:?}"),
    };
    let good = block([0.0; 3], [1.0; 3]);
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(refused(good.clone(), step).contains("greater than 0"));
    }
    assert!(refused(good.clone(), 1e-5).contains("use a step above"));
    let thin = block([0.2; 3], [10.0, 10.0, 0.01]);
    assert!(voxels_for(&bare(thin), None, 0.5).is_ok());
    let mut open = good.clone();
    open.triangles.pop();
    assert!(refused(open, 0.1).contains("not closed"));
    let mut inverted = good.clone();
    inverted.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(refused(inverted, 0.1).contains("inside out"));
    assert!(refused(Mesh::default(), 0.1).contains("empty"));
    let step = usual_step(&bare(good), None);
    assert!(step > 0.0 && step < 0.1);
}

#[test]
fn it_can_be_stopped() {
    struct Stop;
    impl Progress for Stop {
        fn step(&self, done: u64, total: u64) -> bool {
            assert!(done <= total);
            done < 5
        }
    }
    let made = bare(block([0.0; 3], [1.0; 3]));
    assert!(matches!(thickness(&made, None, 0.05, &Stop), Err(Stopped::Interrupted)));
}

#[test]
fn vertices_have_the_thickness_of_the_solid_at_them() {
    // A slab away from its edges; a ball everywhere: its local thickness is its diameter at all points.
    let step = 0.1;
    let slab = full(Arc::new(Cuboid::new([0.0; 3], [6.0, 6.0, 1.0]).expect("box")), 0.25);
    let found = thickness_at_vertices(&slab, step, &Silent).expect("thickness");
    let inner = |p: &Vec3| (0..2).all(|a| (1.2..4.8).contains(&p[a]));
    let within: Vec<f64> = slab.mesh.vertices.iter().zip(&found).filter(|(p, _)| inner(p)).map(|(_, t)| *t).collect();
    assert!(within.len() > 100 && within.iter().all(|t| (t - 1.0).abs() < 0.01));
    let sphere = full(Arc::new(ball([0.3, 0.2, 0.1], 1.0)), 0.1);
    let found = thickness_at_vertices(&sphere, step, &Silent).expect("thickness");
    let low = found.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(low > 2.0 - 0.2 * step && found.iter().all(|t| *t < 2.0 + 0.2 * step), "{low}");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("pool");
    assert_eq!(found, pool.install(|| thickness_at_vertices(&sphere, step, &Silent).expect("thickness")));
}
