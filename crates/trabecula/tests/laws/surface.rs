//! What an extracted surface guarantees, and the rates at which its errors fall.

use std::f64::consts::PI;
use std::sync::Arc;

use geometry::measure::size;
use geometry::mesh::Mesh;
use geometry::progress::{Silent, Stopped};
use geometry::repair::Repair;
use proptest::prelude::*;
use trabecula::cell::{Part, catalogue};
use trabecula::extract::{surface, voxels};
use trabecula::field::Field;
use trabecula::grade::{Grade, Linear};
use trabecula::lattice::Level;
use trabecula::region::{Cuboid, Cylinder, Difference, HalfSpace, Intersection, MeshRegion, Region, Sphere};
use trabecula::surface_maker::Islands;

use crate::common::{ball, cases, check, check_both, drawn, lattice_at, region, solid, stream};

fn cube(edge: f64) -> Region {
    Arc::new(Cuboid::new([0.0; 3], [edge; 3]).expect("box"))
}

#[test]
fn a_sheet_of_32_samples_a_cell_is_within_1e_4_of_its_volume() {
    // |G| ≤ 0.463951958 has the fraction 0.3 (exact table); eight whole cells.
    let field = lattice_at("gyroid", Part::Sheet, Level::Iso(Grade::Constant(0.463951958)), [1.0; 3], [0.0; 3]);
    let solid = solid(cube(2.0), Some(field));
    let errors = [32.0, 64.0].map(|n| {
        let s = surface(&solid, 1.0 / n, &Silent).expect("surface");
        (s.mesh.volume() / (0.3 * 8.0) - 1.0).abs()
    });
    println!("sheet volume errors at 32 and 64 samples a cell: {errors:?}");
    // 1e-4 is promised; what is left is of fourth order, so half the spacing has a sixteenth of it.
    assert!(errors[0] < 1e-4 && errors[1] < 1e-4 / 16.0, "{errors:?}");
}

#[test]
fn area_errors_fall_as_the_second_power_and_volume_errors_faster() {
    let exact = [4.0 * PI, 4.0 / 3.0 * PI];
    let errors = [8.0, 16.0, 32.0, 64.0, 128.0].map(|n| {
        let s = surface(&solid(ball([0.0; 3], 1.0), None), 1.0 / n, &Silent).expect("surface");
        assert!(s.cut.iter().all(|c| *c));
        [(s.mesh.area() / exact[0] - 1.0).abs(), (s.mesh.volume() / exact[1] - 1.0).abs()]
    });
    println!("ball area and volume errors at 8, 16 … 128 steps a radius: {errors:?}");
    for w in errors.windows(2) {
        // Order p means a ratio of 2^p: 4 for area.
        assert!((3.2..5.0).contains(&(w[0][0] / w[1][0])), "{errors:?}");
    }
    // The second order of volume is balanced away; what is left is of third order or higher, and depends on how the
    // ball lies in the grid: over four halvings at least a factor of 2^(4 · 2.8).
    assert!(errors[0][1] / errors[4][1] > 2f64.powf(11.2), "{errors:?}");
}

#[test]
fn vertices_come_to_the_surface_as_the_second_power() {
    let field =
        lattice_at("diamond", Part::Upper, Level::Fraction(Grade::Constant(0.3)), [1.0, 1.2, 0.9], [10.0, 20.0, 30.0]);
    let region = ball([0.0; 3], 1.0);
    let solid = solid(region.clone(), Some(field.clone()));
    let distances = |f: &dyn Field, points: &[[f64; 3]]| -> Vec<f64> {
        let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        f.gradients(points, &mut v, &mut g);
        v.iter().zip(&g).map(|(v, g)| v / g.iter().map(|x| x * x).sum::<f64>().sqrt()).collect()
    };
    // Away from the creases, and on them (within a step of both surfaces).
    let worst = [12.0, 24.0, 48.0].map(|n| {
        let s = surface(&solid, 1.0 / n, &Silent).expect("surface");
        let (a, b) = (distances(&*field, &s.mesh.vertices), distances(&*region, &s.mesh.vertices));
        let mut worst = [0.0f64; 2];
        for (a, b) in a.iter().zip(&b) {
            let crease = usize::from(a.abs().max(b.abs()) < 1.0 / n);
            worst[crease] = worst[crease].max(a.max(*b).abs());
        }
        worst
    });
    println!("farthest vertex, on faces and creases, at 12, 24, 48 steps a radius: {worst:?}");
    // On faces a factor of 16 over two halvings at second order; 4 at first. The maximum is not smooth in h. On
    // creases a vertex that the curve only brushes stands up to half a step off: first order.
    assert!(worst[2][0] < worst[0][0] / 10.0, "{worst:?}");
    assert!(worst[2][1] < 0.5 / 48.0, "{worst:?}");
}

/// The farthest of some points from a mesh.
fn farthest(points: &[[f64; 3]], mesh: Mesh) -> f64 {
    let mesh = MeshRegion::new(mesh, Repair::Refuse).expect("clean");
    points.iter().map(|p| mesh.value(*p).abs()).fold(0.0, f64::max)
}

#[test]
fn edges_are_met_to_second_order_and_flat_ones_exactly() {
    // Two vectors that make a frame with the third.
    let n = [0.36, 0.48, 0.8];
    let (u, v) = ([0.8, -0.6, 0.0], [0.48, 0.64, -0.6]);
    let along = |a: f64, b: f64, c: f64| [0, 1, 2].map(|k| a * u[k] + b * v[k] + c * n[k]);
    let turns = |i: usize| (2.0 * PI * (i as f64 + 0.3) / 500.0).sin_cos();
    let half = |n: [f64; 3], d: f64| -> Region { Arc::new(HalfSpace::new(n.map(|x| d * x), n).expect("half-space")) };

    // A cap of a ball: its rim is a circle.
    let cap: Region = Arc::new(Intersection::new(vec![ball([0.0; 3], 1.0), half(n, 0.28)]).expect("cap"));
    let rim: Vec<[f64; 3]> = (0..500).map(turns).map(|(s, c)| along(0.96 * c, 0.96 * s, 0.28)).collect();
    // A tilted cylinder: two rims.
    let barrel: Region = Arc::new(Cylinder::new([0.1, 0.2, 0.3], n, 0.7, 1.1).expect("cylinder"));
    let rims: Vec<[f64; 3]> = (0..1000)
        .map(|i| {
            let (s, c) = turns(i / 2);
            let p = along(0.7 * c, 0.7 * s, 1.1 * f64::from(i as u32 % 2));
            [p[0] + 0.1, p[1] + 0.2, p[2] + 0.3]
        })
        .collect();
    // A ball from a block: the edge is concave.
    let bite: Region = Arc::new(Difference::new(vec![half(n, 0.28), ball([0.0; 3], 1.0)]).expect("bite"));
    let bite: Region =
        Arc::new(Intersection::new(vec![bite, Arc::new(Sphere::new([0.0; 3], 1.6).expect("ball"))]).expect("bounded"));
    // A lattice in a ball: points of both surfaces, by Newton's method from all over.
    let field =
        lattice_at("gyroid", Part::Lower, Level::Iso(Grade::Constant(0.1)), [1.1, 1.3, 0.9], [10.0, 20.0, 30.0]);
    let mut creases = Vec::new();
    for i in 0..900 {
        let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / 900.0;
        let (s, c) = (f64::from(i) * 2.399963229728653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let mut p = [r * c, r * s, z];
        for _ in 0..20 {
            let (mut f, mut g) = ([0.0], [[0.0; 3]]);
            field.gradients(&[p], &mut f, &mut g);
            // The steepest way along the sphere.
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let d = [0, 1, 2].map(|k| g[0][k] - dot(g[0], p) * p[k]);
            let step = f[0] / dot(d, d).max(1.0);
            let q = [0, 1, 2].map(|k| p[k] - step * d[k]);
            p = q.map(|x| x / dot(q, q).sqrt());
        }
        // Where the two surfaces nearly touch there is no edge.
        let (mut f, mut g) = ([0.0], [[0.0; 3]]);
        field.gradients(&[p], &mut f, &mut g);
        let (steep, radial) =
            (g[0].iter().map(|x| x * x).sum::<f64>().sqrt(), (0..3).map(|k| g[0][k] * p[k]).sum::<f64>());
        if f[0].abs() < 1e-9 && (radial / steep).abs() < 0.8 {
            creases.push(p);
        }
    }
    assert!(creases.len() > 300);

    for (name, solid, points) in [
        ("rim of a cap", solid(cap, None), &rim),
        ("rims of a cylinder", solid(barrel, None), &rims),
        ("rim of a bite", solid(bite, None), &rim),
        ("lattice in a ball", solid(ball([0.0; 3], 1.0), Some(field)), &creases),
    ] {
        let errors = [10.0, 20.0, 40.0].map(|n| {
            let s = surface(&solid, 1.0 / n, &Silent).expect("surface");
            check(name, &s);
            // How far the mesh strays from the solid, by the middles of its edges; the region alone is a distance.
            let middles = s.mesh.triangles.iter().flat_map(|t| {
                let [a, b, c] = t.map(|v| s.mesh.vertices[v as usize]);
                [(a, b), (b, c), (c, a)].map(|(a, b)| [0, 1, 2].map(|k| 0.5 * (a[k] + b[k])))
            });
            let stray = middles.map(|p| solid.value(p).abs()).fold(0.0, f64::max);
            let stray = if solid.field.is_none() { stray } else { 0.0 };
            farthest(points, s.mesh).max(stray)
        });
        println!("{name}: farthest of edge and mesh from each other at 10, 20, 40 steps: {errors:?}");
        // Second order over two halvings is a factor of 16; a chamfer has 4. The maximum is not smooth in the step.
        assert!(errors[2] < errors[0] / 9.0, "{name}: {errors:?}");
    }

    // Flat faces that meet in edges and corners: nothing to approximate, whatever the step.
    let frame = [u, v, n];
    let sides = frame.iter().flat_map(|d| [half(*d, 0.6), half(d.map(|x| -x), 0.5)]);
    let block: Region = Arc::new(Intersection::new(sides.collect()).expect("block"));
    let block: Region = Arc::new(Intersection::new(vec![block, cube_about(2.0)]).expect("bounded"));
    let s = surface(&solid(block, None), 0.13, &Silent).expect("surface");
    check("turned block", &s);
    let ends = [-0.5, 0.6];
    let corners: Vec<[f64; 3]> = (0..8).map(|i| along(ends[i & 1], ends[i >> 1 & 1], ends[i >> 2])).collect();
    // Faces keep 1/4096 of a step away from nodes; a corner sees three of them.
    assert!(farthest(&corners, s.mesh.clone()) < 0.13 * 3.0 / 4096.0);
    assert!((s.mesh.volume() / 1.1f64.powi(3) - 1.0).abs() < 1e-4);
}

/// A cube about the origin.
fn cube_about(half: f64) -> Region {
    Arc::new(Cuboid::new([-half; 3], [half; 3]).expect("box"))
}

#[test]
fn boxes_and_caps_are_exact() {
    let s =
        surface(&solid(Arc::new(Cuboid::new([-1.0, 0.3, 2.0], [0.7, 1.1, 2.9]).expect("box")), None), 0.13, &Silent)
            .expect("surface");
    check("box", &s);
    let want: f64 = 1.7 * 0.8 * 0.9;
    let area = 2.0 * (1.7 * 0.8 + 0.8 * 0.9 + 0.9 * 1.7);
    // Rounding of some thousand terms.
    let errors = [s.mesh.volume() / want - 1.0, s.mesh.area() / area - 1.0];
    assert!(errors.iter().all(|e| e.abs() < 1e-12), "{errors:?}");
    assert_eq!(size(&s.mesh).euler, 2);
    let disc = Arc::new(Cylinder::new([0.1, 0.2, 0.3], [0.0, 0.0, 1.0], 1.0, 0.5).expect("cylinder"));
    let s = surface(&solid(disc, None), 0.05, &Silent).expect("surface");
    check("disc", &s);
    assert!((s.mesh.bounds().min[2] - 0.3).abs() < 1e-15 && (s.mesh.bounds().max[2] - 0.8).abs() < 1e-15);
    // The rim is a polygon on the circle: area and volume too small by the order of (h/r)²/6 at most.
    assert!((s.mesh.volume() / (0.5 * PI) - 1.0).abs() < 0.05f64.powi(2) / 6.0);
}

#[test]
fn topology_of_the_unit_cells_is_that_of_the_literature() {
    // Euler characteristic of the surface f = 0 in one cubic cell. The mesh of the f ≤ 0 solid in n³ cells of a box is
    // closed by caps, so compare through the periodic interior: χ grows by χ_cell · n³ to leading order.
    for (name, chi) in [("primitive", -4), ("gyroid", -8), ("diamond", -16), ("iwp", -12)] {
        let euler = |n: f64| {
            let field = lattice_at(name, Part::Lower, Level::Iso(Grade::Constant(0.0)), [1.0; 3], [0.0; 3]);
            // Off the symmetry planes, so that no critical point lies on a face of the box.
            let region = Arc::new(Cuboid::new([0.13, 0.17, 0.21], [n + 0.13, n + 0.17, n + 0.21]).expect("box"));
            let s = surface(&solid(region, Some(field)), 1.0 / 20.0, &Silent).expect("surface");
            size(&s.mesh).euler
        };
        // Third differences of a cubic in n leave 6 times its leading coefficient.
        let e = [1.0, 2.0, 3.0, 4.0].map(euler);
        assert_eq!(e[3] - 3 * e[2] + 3 * e[1] - e[0], 6 * chi, "{name}: {e:?}");
    }
}

#[test]
fn same_bytes_for_any_number_of_threads_and_both_roads_agree() {
    let field =
        lattice_at("gyroid", Part::Sheet, Level::Fraction(Grade::Constant(0.25)), [1.0, 1.1, 0.9], [5.0, 15.0, 25.0]);
    let solid = solid(ball([0.0; 3], 1.7), Some(field));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
        pool.install(|| {
            let (stl, summary) = stream(&solid, 0.025, Islands::Keep).expect("stl");
            (surface(&solid, 0.025, &Silent).expect("surface"), stl, summary)
        })
    };
    let (one, stl, summary) = run(1);
    let (three, again, _) = run(3);
    assert!(one == three && stl == again);
    // 136 steps along each axis: more tiles than two, so stitching is at work.
    check("ball over tiles", &one);
    assert_eq!(summary.triangles as usize, one.mesh.triangles.len());
    // The sums differ in order only.
    assert!((summary.volume / one.mesh.volume() - 1.0).abs() < 1e-10);
    assert!(((summary.area_lattice + summary.area_cut) / one.mesh.area() - 1.0).abs() < 1e-10);
    for (i, t) in one.mesh.triangles.iter().enumerate() {
        for (k, v) in t.iter().enumerate() {
            for a in 0..3 {
                let at = 84 + 50 * i + 12 * (k + 1) + 4 * a;
                let read = f32::from_le_bytes([stl[at], stl[at + 1], stl[at + 2], stl[at + 3]]);
                assert_eq!(read, one.mesh.vertices[*v as usize][a] as f32);
            }
        }
    }
}

#[test]
fn every_named_cell_and_part_has_its_fraction() {
    // Whole cells of every kind: mesh volume over box is the fraction asked for.
    for n in catalogue() {
        for (part, fraction) in [(Part::Sheet, 0.35), (Part::Lower, 0.5), (Part::Upper, 0.6)] {
            let field = lattice_at(n.name, part, Level::Fraction(Grade::Constant(fraction)), [1.0; 3], [0.0; 3]);
            let s = surface(&solid(cube(1.0), Some(field)), 1.0 / 48.0, &Silent).expect("surface");
            let error = (s.mesh.volume() - fraction).abs();
            // Balanced volume: fourth order in 2π·top/48 with waves up to index 4 in these cells.
            assert!(error < 2e-3, "{} {part:?}: {error:.1e}", n.name);
        }
    }
}

#[test]
fn a_graded_fraction_is_met() {
    let stops = vec![[0.0, 0.15], [8.0, 0.6]];
    let grade = Grade::from(Linear::new([0.0, 0.0, 1.0], stops).expect("grade"));
    for (name, part) in [("gyroid", Part::Sheet), ("diamond", Part::Lower), ("primitive", Part::Sheet)] {
        let field = lattice_at(name, part, Level::Fraction(grade.clone()), [1.0; 3], [0.0; 3]);
        let region = Arc::new(Cuboid::new([0.0; 3], [1.0, 1.0, 8.0]).expect("box"));
        let v = voxels(&solid(region, Some(field)), 1.0 / 64.0, &Silent).expect("voxels");
        let layer = v.shape[0] * v.shape[1];
        let mean: Vec<f64> =
            v.solid.chunks(layer).map(|l| l.iter().map(|&b| f64::from(b)).sum::<f64>() / layer as f64).collect();
        // A smooth window two cells wide: 1 + cos over 2 × 64 layers.
        for centre in (64..8 * 64 - 64).step_by(16) {
            let weights: Vec<f64> = (0..128).map(|i| 1.0 - (2.0 * PI * (f64::from(i) + 0.5) / 128.0).cos()).collect();
            let got: f64 =
                (0..128).map(|i| weights[i] * mean[centre - 64 + i]).sum::<f64>() / weights.iter().sum::<f64>();
            let want = 0.15 + 0.45 * (centre as f64 / 64.0) / 8.0;
            assert!((got - want).abs() < 0.005, "{name} at {centre}: {got} for {want}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(16) as u32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any cell, part, fraction, orientation and region, however coarse the grid. 2000 cases in `make campaign`.
    #[test]
    fn random_solids_keep_every_guarantee(
        kind in 0..7usize,
        shape in (0.5..1.5f64, -0.4..0.4f64, 0.2..1.0f64),
        drawn in drawn(),
        edge in 0.04..0.3f64,
    ) {
        let region = region(kind, shape.0, shape.1, shape.2);
        let text = format!("region {kind} {shape:?}");
        let field = drawn.lattice();
        let design = solid(region.clone(), Some(field));
        let s = match surface(&design, edge, &Silent) {
            // So little may be there that no node of the grid meets it.
            Err(Stopped::Refused(f)) if f.message.starts_with("no surface") => {
                let solid = voxels(&design, edge, &Silent).expect("voxels").solid;
                prop_assert!(solid.iter().map(|v| u32::from(*v)).sum::<u32>() < 8, "{f}");
                return Ok(());
            }
            made => made.expect("surface"),
        };
        check_both(&format!("{drawn:?} {text} edge {edge}"), &design, edge, &s);
        let design = solid(region, None);
        let full = surface(&design, edge, &Silent).expect("surface");
        check_both(&format!("full {text} edge {edge}"), &design, edge, &full);
        prop_assert!(s.mesh.volume() <= full.mesh.volume() * (1.0 + 0.5 * edge) + 1e-9);
    }
}
