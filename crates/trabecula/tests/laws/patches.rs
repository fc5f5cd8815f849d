//! Laws of patches for CAD systems: lattices in boxes as closed solids of bicubic patches.

use std::collections::HashMap;

use geometry::formats::part21::Title;
use geometry::math::{Vec3, add, norm, scale};
use geometry::measure::size;
use geometry::progress::{Silent, Stopped};
use trabecula::cell::{Part, catalogue};
use trabecula::patches::Patches;
use trabecula::report::StepReport;
use trabecula::solid::Solid;
use trabecula::surface_maker::Islands;

use crate::common::{Random, ball, cases, cuboid, lattice, meshed, solid};

fn made(solid: &Solid, tolerance: f64) -> (StepReport, String) {
    let patches = Patches::new(solid, tolerance, &Silent).expect("patches");
    let mut out = Vec::new();
    patches.write_step(Title::default(), &mut out, &Silent).expect("written to memory");
    (patches.summary(), String::from_utf8(out).expect("ASCII"))
}

/// The entities of a file by number.
fn entities(text: &str) -> HashMap<&str, &str> {
    text.lines().filter_map(|l| l.strip_suffix(';')?.split_once('=')).filter(|e| e.0.starts_with('#')).collect()
}

/// How many entities have this name.
fn count(of: &HashMap<&str, &str>, name: &str) -> i64 {
    of.values().filter(|e| e.split('(').next() == Some(name)).count() as i64
}

/// Places inside the patches of a file, from their control points there.
fn places(of: &HashMap<&str, &str>) -> Vec<Vec3> {
    let point = |id: &str| {
        let inner = of[id].split("('',(").nth(1).expect("coordinates").trim_end_matches(')');
        let v: Vec<f64> = inner.split(',').map(|x| x.parse().expect("a number")).collect();
        [v[0], v[1], v[2]]
    };
    let bernstein = |t: f64| [(1.0 - t).powi(3), 3.0 * t * (1.0 - t).powi(2), 3.0 * t * t * (1.0 - t), t.powi(3)];
    let mut found = Vec::new();
    for surface in of.values().filter(|e| e.starts_with("B_SPLINE_SURFACE_WITH_KNOTS('',3,3,")) {
        let net = surface.split("),.UNSPECIFIED").next().expect("a net");
        let ids: Vec<&str> = net.split(['(', ',', ')']).filter(|w| w.starts_with('#')).collect();
        assert_eq!(ids.len(), 16);
        for (u, v) in [(0.37, 0.61), (0.08, 0.93)] {
            let (bu, bv) = (bernstein(u), bernstein(v));
            let term = |k: usize| scale(point(ids[k]), bu[k / 4] * bv[k % 4]);
            found.push((0..16).map(term).fold([0.0; 3], add));
        }
    }
    found
}

#[test]
fn patches_close_keep_the_topology_and_lie_on_the_surface() {
    let mut random = Random(11);
    let names: Vec<&str> = catalogue().iter().map(|c| c.name).collect();
    for case in 0..cases(6) as usize {
        let name = names[case % names.len()];
        let part = [Part::Sheet, Part::Lower, Part::Upper][random.below(3)];
        let (fraction, low, extent) = (random.between(0.25, 0.6), random.point(0.5), random.between(0.7, 1.2));
        let turned = [0.0, 20.0 * random.share(), 0.0];
        let field = lattice(name, part, fraction, [1.0; 3], turned);
        let within = solid(cuboid(low, low.map(|x| x + extent)), Some(field.clone()));
        let what = format!("{name} {part:?} {fraction} {low:?} {extent} {turned:?}");
        const TOLERANCE: f64 = 2e-3;
        // A surface that all but touches a face of the box may have no patches; it is then refused.
        let patches = match Patches::new(&within, TOLERANCE, &Silent) {
            Ok(patches) => patches,
            Err(Stopped::Refused(fault)) => {
                println!("{what}: {}", fault.message);
                continue;
            }
            Err(other) => panic!("{what}: {other:?}"),
        };
        let mut out = Vec::new();
        patches.write_step(Title::default(), &mut out, &Silent).expect("written to memory");
        let (summary, text) = (patches.summary(), String::from_utf8(out).expect("ASCII"));
        let found = entities(&text);
        let mut uses: HashMap<&str, [u32; 2]> = HashMap::new();
        for oriented in found.values().filter(|e| e.starts_with("ORIENTED_EDGE(")) {
            let words: Vec<&str> = oriented.trim_end_matches(')').split(',').collect();
            uses.entry(words[3]).or_default()[usize::from(words[4] == ".T.")] += 1;
        }
        assert_eq!(uses.len(), summary.edges, "{what}");
        assert!(uses.values().all(|u| *u == [1, 1]), "{what}: an edge is not used once in each direction");
        let [(coarse, _), (mesh, _)] = [24.0, 64.0]
            .map(|n| meshed(&trabecula::extract::GridSurface(&within), 1.0 / n, Islands::Keep).expect("mesh"));
        let of_mesh = size(&mesh.mesh);
        // A face with holes is a disc less one for each of them.
        let [v, e, f, holes] = ["VERTEX_POINT", "EDGE_CURVE", "ADVANCED_FACE", "FACE_BOUND"].map(|n| count(&found, n));
        // The topology is that of a grid of 32 cells a wavelength: what a coarser one does not see may be missing.
        if size(&coarse.mesh).euler == of_mesh.euler {
            assert_eq!(v - e + f - holes, of_mesh.euler, "{what}");
        }
        assert!((summary.volume - of_mesh.volume).abs() < TOLERANCE * mesh.mesh.area(), "{what}: {summary:?}");
        assert!(summary.deviation <= TOLERANCE && summary.angle.is_some_and(|a| a <= 1.0), "{what}: {summary:?}");
        let places = places(&found);
        let (mut values, mut slopes) = (vec![0.0; places.len()], vec![[0.0; 3]; places.len()]);
        field.gradients(&places, &mut values, &mut slopes);
        for (value, slope) in values.iter().zip(&slopes) {
            // Between the points at which the deviation is taken it may be a little more.
            assert!(value.abs() / norm(*slope) <= 1.1 * TOLERANCE, "{what}: {value}");
        }
    }
}

#[test]
fn faces_grow_as_the_square_root_of_the_accuracy() {
    let within = solid(cuboid([0.0; 3], [1.0; 3]), Some(lattice("gyroid", Part::Lower, 0.4, [1.0; 3], [0.0; 3])));
    let counts = [1e-4, 1e-6].map(|t| made(&within, t).0.faces as f64);
    println!("faces within 1e-4 and 1e-6 of the cell: {counts:?}");
    // Of fourth order the spacing falls as the fourth root, and faces grow as its square: by 10 for a hundredth. Grids come in
    // steps of up to 1.7, and divided faces in addition.
    assert!(counts[1] / counts[0] < 25.0, "{counts:?}");
}

#[test]
fn the_volume_of_whole_cells_is_exact_to_the_tolerance() {
    for (part, fraction) in [(Part::Sheet, 0.3), (Part::Lower, 0.3), (Part::Upper, 0.5)] {
        let field = lattice("primitive", part, fraction, [1.0; 3], [0.0; 3]);
        let (summary, _) = made(&solid(cuboid([0.0; 3], [1.0; 3]), Some(field)), 1e-3);
        // Both signs of the deviation occur: far less than the area, about 5, times it.
        assert!((summary.volume - fraction).abs() < 2e-4, "{summary:?}");
    }
}

#[test]
fn a_closed_void_belongs_to_the_solid_around_it() {
    // Where cos x + cos y + cos z is greatest, in the middle of the box, nothing is solid.
    let field = lattice("primitive", Part::Lower, 0.97, [1.0; 3], [0.0; 3]);
    let (summary, text) = made(&solid(cuboid([-0.5; 3], [0.5; 3]), Some(field)), 1e-3);
    let found = entities(&text);
    assert_eq!(summary.solids, 1);
    assert_eq!(["CLOSED_SHELL", "BREP_WITH_VOIDS", "MANIFOLD_SOLID_BREP"].map(|n| count(&found, n)), [2, 1, 0]);
    assert!((summary.volume - 0.97).abs() < 2e-4, "{summary:?}");
}

#[test]
fn what_has_no_patches_is_refused() {
    let field = lattice("gyroid", Part::Sheet, 0.3, [1.0; 3], [0.0; 3]);
    let round = solid(ball([0.0; 3], 1.0), Some(field.clone()));
    match Patches::new(&round, 1e-3, &Silent) {
        Err(Stopped::Refused(fault)) => assert!(fault.message.contains("this region is no box"), "{fault:?}"),
        _ => panic!("a ball has no patches"),
    }
    let large = solid(cuboid([0.0; 3], [60.0; 3]), Some(field));
    match Patches::new(&large, 1e-3, &Silent) {
        Err(Stopped::Refused(fault)) => assert!(fault.message.contains("faces"), "{fault:?}"),
        _ => panic!("too many faces"),
    }
}
