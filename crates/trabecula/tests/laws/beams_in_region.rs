//! Which beams are in a region: those of which something is, in files as in the report, whatever fillets need besides.

use beams::{Fillet, Quadors};
use proptest::prelude::*;
use trabecula::design::{Built, Design, NoFiles};
use trabecula::report::{BeamsFileReport, GraphReport};
use trabecula::truss::{Beams, Truss};

use crate::common::{cases, within};

fn built(region: &str, core: &str) -> Built {
    let text = format!("schema = 1\n[region]\n{region}\n[beams.core]\n{core}");
    Design::from_toml(&text).expect("text").build(&NoFiles).expect("built")
}

fn truss(built: &Built) -> &Truss {
    match &built.beams[0].1 {
        Beams::Truss(truss) => truss,
        Beams::Pattern(_) => panic!("a pattern"),
    }
}

fn counts(built: &Built) -> GraphReport {
    built.report().beams["core"].graph.clone().expect("a graph")
}

fn file(built: &Built) -> (BeamsFileReport, String) {
    let mut out = Vec::new();
    let made = built.write_graph("obj", &mut out).expect("written");
    (made, String::from_utf8(out).expect("text"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(12) as u32, ..ProptestConfig::default() })]

    /// With and without fillets the same beams, and no fewer than fill the region as all do: none that is left out has a point in it.
    #[test]
    fn files_and_reports_have_the_beams_in_the_region_alone(
        cell in prop::sample::select(vec!["sc", "bcc", "fcc", "octet", "diamond", "kelvin"]),
        radius in 0.2..0.6f64,
        size in 1.0..9.0f64,
        at in prop::array::uniform3(-9.0..9.0f64),
        kind in 0..3usize,
    ) {
        let [x, y, z] = at;
        let region = match kind {
            0 => format!("box = {{ center = [{x}, {y}, {z}], size = [{size}, {}, {}] }}", size + 1.0, size + 2.0),
            1 => format!("sphere = {{ center = [{x}, {y}, {z}], radius = {size} }}"),
            _ => format!("cylinder = {{ base = [{x}, {y}, {z}], axis = [1, 2, 3], radius = {}, height = 8 }}", 0.5 * size),
        };
        let core = |fillet: &str| format!("cell = \"{cell}\"\nradius = {radius}\nmap.affine.wavelength = 9\nfillet = \"{fillet}\"");
        let text = format!("schema = 1\n[region]\n{region}\n[beams.core]\n{}", core("none"));
        // Where there is nothing, nothing is to be written.
        let Ok(bare) = Design::from_toml(&text).expect("text").build(&NoFiles) else { return Ok(()) };
        let filleted = built(&region, &core("auto"));
        // A beam that grazes the region by less than a step along its axis shows may count or not.
        let nearest = |[from, to]: [[f64; 3]; 2]| {
            let at = |t: f64| bare.solid.region.value([0, 1, 2].map(|k| (1.0 - t) * from[k] + t * to[k]));
            (0..=2000).map(|i| at(f64::from(i) / 2000.0)).fold(f64::INFINITY, f64::min)
        };
        let all = truss(&filleted);
        let ends = |q: &Quadors, b: usize| q.ends(b).map(|h| q.center(h as usize));
        prop_assume!((0..all.quadors.beams()).all(|b| (nearest(ends(&all.quadors, b)) - radius).abs() > 1e-3));
        let (a, b) = (counts(&bare), counts(&filleted));
        prop_assert_eq!((a.beams, a.hubs, a.pieces, a.dangling), (b.beams, b.hubs, b.pieces, b.dangling));
        prop_assert!((a.total_length - b.total_length).abs() < 1e-9 * a.total_length);
        prop_assert_eq!(&a.valence, &b.valence);
        if a.beams == 0 {
            return Ok(());
        }
        let (of_bare, of_filleted) = (file(&bare).0, file(&filleted).0);
        prop_assert_eq!((of_bare.nodes, of_bare.beams), (of_filleted.nodes, of_filleted.beams));
        prop_assert_eq!(of_bare.beams, a.beams);
        let part = Quadors::new(&all.graph.part(&all.within.struts), Fillet::None).expect("beams");
        let whole = Quadors::new(&all.graph, Fillet::None).expect("beams");
        for p in within(&bare.solid.region, 5000, 7) {
            prop_assert_eq!(part.contains(p), whole.contains(p), "{:?}", p);
        }
        // Of each that is written there is a point.
        for b in 0..part.beams() {
            prop_assert!(nearest(ends(&part, b)) < radius, "{b}");
        }
    }
}

/// Beams that cross a region with both hubs outside were not counted, and lengths had no least one.
#[test]
fn beams_that_cross_the_region_are_counted_though_no_hub_is_inside() {
    let one = built(
        "box = { min = [1, -2, -2], max = [9, 2, 2] }",
        "nodes = [[0, 0, 0], [10, 0, 0]]\nstruts = [[0, 1]]\nradius = 0.7",
    );
    let found = counts(&one);
    assert_eq!((found.hubs, found.beams, found.pieces, found.dangling), (0, 1, 1, 0));
    assert_eq!((found.length, found.total_length), (Some([10.0, 10.0]), 10.0));
    assert_eq!(file(&one).0.beams, 1);
    // Two that meet outside are two pieces inside, and one where their common ball reaches in.
    let bent = "nodes = [[0, 0, 0], [10, 1, 0], [0, 2, 0]]\nstruts = [[0, 1], [1, 2]]\nradius = 0.2";
    let pieces = |x: f64| counts(&built(&format!("box = {{ min = [1, -2, -2], max = [{x}, 4, 2] }}"), bent)).pieces;
    assert_eq!([pieces(5.0), pieces(9.7), pieces(9.9), pieces(11.0)], [2, 2, 1, 1]);
}

/// Files of a pattern that reaches out of the region had all of it.
#[test]
fn files_of_a_pattern_have_the_repeats_in_the_region_alone() {
    let pattern = "radius = 0.2\n[beams.core.pattern]\nnodes = [[0, 0, 0]]\nstruts = [[0, 0, 1, 0, 0]]\nrepeat = [{ count = 10, by = [1, 0, 0] }]";
    let (made, text) = file(&built("box = { min = [2.5, -1, -1], max = [5.5, 1, 1] }", pattern));
    assert_eq!((made.nodes, made.beams), (5, 4), "{text}");
}
