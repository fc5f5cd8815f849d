//! Regions moved, turned, mirrored, scaled and repeated: distances, volumes, and every guarantee of their meshes.

use std::f64::consts::PI;
use std::sync::Arc;

use geometry::math::{Vec3, norm, product, rotation, sub};
use geometry::progress::Silent;
use geometry::repair::Repair;
use geometry::similarity::Similarity;
use trabecula::cell::Part;
use trabecula::design::{self, NoFiles, Node};
use trabecula::extract::surface;
use trabecula::grade::Grade;
use trabecula::region::{MeshRegion, Region};
use trabecula::skin::skin;
use trabecula::solid::Solid;

use super::common::{Random, cases, check_both, lattice, points, region};
use super::crease::{block, cylinder};

/// A region of a text without units, such as `sphere = { radius = 1 }`.
fn read(text: &str) -> Region {
    let node = Node::from_toml(&format!("[region]\n{text}\n")).expect("text");
    design::region(&node, &NoFiles).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn random(some: &mut Random) -> Similarity {
    // A third of them only turn onto other axes.
    let turn = match some.below(3) {
        0 => rotation([0; 3].map(|_| 90.0 * some.below(4) as f64)),
        _ => rotation(some.point(180.0)),
    };
    let mut mirror = rotation([0.0; 3]);
    mirror[0][0] = if some.share() < 0.5 { -1.0 } else { 1.0 };
    Similarity::new(some.between(0.5, 2.0), product(&turn, &mirror), some.point(1.0), some.point(3.0))
}

/// The value at the image of a point is the factor times that at the point, and the solid has the factor's cube of the volume. Flat
/// faces keep 1/4096 of a step away from nodes; a chord of a step is h²/8r at most from a surface of radius r, and the rim of a
/// cylinder is a polygon of such chords.
#[test]
fn images_of_regions_are_meshed_as_well() {
    for case in 0..cases(8) {
        let some = &mut Random(77 * case + 1);
        let (kind, r) = (case as usize % 8, some.between(0.8, 1.3));
        let of = match kind {
            7 => Arc::new(MeshRegion::new(cylinder(5, 0.8, 1.1), Repair::Refuse).expect("clean")) as Region,
            _ => region(kind, r, some.between(-0.2, 0.2), some.between(0.3, 0.8)),
        };
        let by = random(some);
        let image = of.clone().moved(&by).expect("moved");
        for p in points(&of.bounds().grown(0.5), 300) {
            let off = image.value(by.point(p)) - by.scale() * of.value(p);
            assert!(off.abs() < 1e-12, "case {case}: {off:e}");
        }
        let edge = by.scale() * some.between(0.04, 0.08);
        let [own, moved] = [(of, edge / by.scale()), (image, edge)].map(|(region, edge)| {
            let solid = Solid::new(region, None, 1.0);
            let s = surface(&solid, edge, &Silent).expect("surface");
            check_both(&format!("case {case}, kind {kind}"), &solid, edge, &s);
            (s.mesh.volume(), s.mesh.area(), solid.region.volume())
        });
        let slack = moved.1 * (1e-3 * edge + edge * edge / (4.0 * 0.5 * by.scale()));
        let want = own.2.unwrap_or(own.0) * by.scale().powi(3);
        assert!((moved.0 - want).abs() < slack, "case {case}, kind {kind}: {} for {want} within {slack}", moved.0);
    }
}

/// A repeated region is the union of its moved copies, value by value.
#[test]
fn a_repeated_region_is_the_union_of_moved_ones() {
    for of in [
        "box = { size = [1, 0.4, 0.7], center = [2, 0.1, 0] }",
        "cylinder = { base = [2, 0, 0], radius = 0.4, height = 1 }",
    ] {
        let of = format!("{{ {of} }}");
        for count in [3, 12] {
            let turned = |k: i32| format!("moved = {{ of = {of}, rotate = [0, 0, {}], about = [0.5, 0, 0] }}", 30 * k);
            let shifted =
                |k: i32| format!("moved = {{ of = {of}, by = [{}, {}, 0] }}", 0.75 * f64::from(k), 0.5 * f64::from(k));
            let united = |copy: &dyn Fn(i32) -> String| {
                let all: Vec<String> = (0..count).map(|k| format!("{{ {} }}", copy(k))).collect();
                read(&format!("union = [{}]", all.join(", ")))
            };
            let ring = format!("around = {{ count = {count}, angle = 30, about = [0.5, 0, 0] }}");
            let row = format!("along = [{{ by = [0.75, 0.5, 0], count = {count} }}]");
            for (rule, by_hand) in [(ring, united(&turned)), (row, united(&shifted))] {
                let made = read(&format!("repeated = {{ of = {of}, {rule} }}"));
                assert_eq!(made.bounds(), by_hand.bounds());
                for p in points(&made.bounds().grown(1.0), 500) {
                    assert_eq!(made.value(p), by_hand.value(p), "{rule}");
                }
            }
        }
    }
}

/// A disc with holes or slots round its middle, lying in any direction: closed, not crossing itself, of the right volume, however many
/// they are; with a skin and a lattice in it too. Rims of holes are polygons of chords of a step.
#[test]
fn drilled_discs_have_the_volume_that_is_left() {
    for case in 0..cases(6) {
        let some = &mut Random(91 * case + 3);
        let count = [5, 12, 31, 60][case as usize % 4];
        let far = some.between(6.0, 9.0);
        // Apart from each other and within the disc.
        let wide = (PI * far / f64::from(count) * some.between(0.4, 0.75)).min(1.2);
        let slots = case % 2 == 1;
        let (hole, cut) = match slots {
            true => {
                let size = [1.5, 1.2 * wide, 4.0];
                (format!("box = {{ size = {size:?}, center = [{far}, 0, 0] }}"), size[0] * size[1] * 2.0)
            }
            false => (
                format!("cylinder = {{ base = [{far}, 0, -1.5], radius = {wide}, height = 3 }}"),
                PI * wide * wide * 2.0,
            ),
        };
        let turn = some.point(180.0);
        let text = format!(
            "moved.rotate = {turn:?}\nmoved.by = {:?}\nmoved.of.difference = [{{ cylinder = {{ base = [0, 0, -1], radius = 11, \
             height = 2 }} }}, {{ repeated = {{ of = {{ {hole} }}, around = {{ count = {count} }} }} }}]",
            some.point(2.0)
        );
        let region = read(&text);
        let want = PI * 121.0 * 2.0 - f64::from(count) * cut;
        let edge = (wide / 3.0).min(0.3);
        let solid = Solid::new(region.clone(), None, 1.0);
        let s = surface(&solid, edge, &Silent).expect("surface");
        check_both(&format!("case {case}"), &solid, edge, &s);
        // Edges keep a chamfer within a step, chords their sagitta.
        let around = f64::from(count) * if slots { 0.0 } else { 2.0 * PI * wide * 2.0 * edge * edge / (8.0 * wide) };
        let slack = s.mesh.area() * (1e-3 * edge + edge * edge / (8.0 * 11.0)) + around;
        assert!((s.mesh.volume() - want).abs() < slack, "case {case}: {} for {want} within {slack}", s.mesh.volume());
        assert_eq!(geometry::measure::size(&s.mesh).euler, 2 - 2 * i64::from(count), "case {case}: as many holes");
        if count <= 12 {
            let gyroid = lattice("gyroid", Part::Sheet, 0.4, [3.0; 3], turn);
            let walls = skin(&region, &Grade::Constant(0.4), &[]).expect("skin");
            let solid = Solid::new(region, Some(gyroid), 3.0).with(walls);
            let s = surface(&solid, edge, &Silent).expect("surface");
            check_both(&format!("case {case}, filled"), &solid, edge, &s);
        }
    }
}

/// Meshes that are moved, mirrored and repeated are meshes: combined they are one, oriented outwards.
#[test]
fn moved_meshes_are_combined_as_meshes_are() {
    for case in 0..cases(6) {
        let some = &mut Random(13 * case + 7);
        let cube = Arc::new(MeshRegion::new(block(0.5, 0.4, 0.3), Repair::Refuse).expect("clean")) as Region;
        let (a, b) = (random(some), random(some));
        let image = cube.clone().moved(&a).expect("moved");
        let twice = image.clone().moved(&b).expect("moved");
        let [one, two] = [&image, &twice].map(|r| r.as_mesh().expect("a mesh").mesh());
        let all = cube.volume().expect("volume");
        for (mesh, s) in [(one, a.scale()), (two, a.scale() * b.scale())] {
            assert!((mesh.volume() / (all * s.powi(3)) - 1.0).abs() < 1e-12, "case {case}: inside out?");
        }
        // Two halves of a block, one the mirror image of the other: the block, wherever it lies.
        let half = Arc::new(MeshRegion::new(block(0.5, 0.4, 0.3), Repair::Refuse).expect("clean")) as Region;
        let mut flip = rotation([0.0; 3]);
        flip[0][0] = -1.0;
        let low = half.bounds().min[0];
        let other = half.clone().moved(&Similarity::new(1.0, flip, [low, 0.0, 0.0], [0.0; 3])).expect("mirrored");
        let whole = trabecula::region::Union::new(vec![half.clone(), other]).expect("union");
        let whole = (Arc::new(whole) as Region).moved(&a).expect("moved");
        let found = whole.as_mesh().expect("one mesh").mesh().volume();
        assert!((found / (2.0 * all * a.scale().powi(3)) - 1.0).abs() < 1e-12, "case {case}: {found}");
        let middle: Vec3 = a.point([low, half.bounds().center()[1], half.bounds().center()[2]]);
        let deep = 0.5 * half.bounds().size()[2] * a.scale();
        assert!((whole.value(middle) + deep).abs() < 1e-12, "case {case}: a wall where the halves meet");
        assert!(norm(sub(whole.bounds().center(), middle)) < 1e-9 * norm(whole.bounds().size()));
    }
}
