//! Nets of rods on the surface of lattices over tetrahedra: as thick as what they tie, everywhere.

use crate::common::{Random, cases, check, stl, stream};
use geometry::progress::Silent;
use trabecula::design::{Built, Design, NoFiles};
use trabecula::extract::surface;
use trabecula::report::{DesignReport, NetReport, TilingReport, Varying};
use trabecula::surface_maker::Islands;

fn built(text: &str) -> Built {
    Design::from_toml(text).expect(text).build(&NoFiles).unwrap_or_else(|e| panic!("{text}\n{}: {}", e.path, e.message))
}

fn tets(report: &DesignReport) -> &TilingReport {
    report.lattices["a"].tets.as_ref().expect("tetrahedra")
}

fn net(report: &DesignReport) -> NetReport {
    tets(report).net.expect("a net")
}

/// A box or a ball whose tetrahedra are three times as large on one side as on the other.
fn graded(some: &mut Random, i: u64, keys: &str) -> (String, f64) {
    let r = some.between(8.0, 10.0);
    let fine = some.between(1.8, 2.2);
    let region = if i.is_multiple_of(2) {
        format!("box = {{ min = [{}, {}, {}], max = [{r}, {}, {}] }}", -r, -0.5 * r, -0.4 * r, 0.5 * r, 0.4 * r)
    } else {
        format!("sphere.radius = {r}")
    };
    let cell = ["diamond", "pn3m"][(i / 2 % 2) as usize];
    let text = format!(
        "schema = 1\nregion.{region}\n[lattice.a]\npart = \"lower\"\ncell.tet.name = \"{cell}\"\nlevel.fraction = 0.35\n\
         [lattice.a.map.tets]\nsize.linear = {{ along = [1, 0, 0], stops = [[{}, {fine}], [{r}, {}]] }}\nsurface = \"net\"\n{keys}",
        -r,
        3.0 * fine
    );
    (text, fine)
}

/// Rods follow the size of tetrahedra: the thinnest are as much thinner as tetrahedra are smaller there, no port is without one, and
/// what they leave open is open where tetrahedra are small, too. The default spacing has two steps across the thinnest and six
/// across the thickest, but for 64 in the smallest wavelength; the surface is that of a solid.
#[test]
fn a_net_follows_the_size_of_tetrahedra() {
    let mut some = Random(5);
    for i in 0..cases(2) {
        let (text, _) = graded(&mut some, i, "");
        let built = built(&text);
        let report = built.report();
        let Some(Varying::Range([least, most])) = tets(&report).end_radius else { panic!("{text}: one radius") };
        println!("{i}: {least} to {most}, {:?}, spacing {}", net(&report), report.spacing);
        assert!(most > 2.0 * least && most < 9.0 * least, "{text}: {least} to {most}");
        assert_eq!(net(&report).untied, 0, "{text}");
        let wavelength = built.solid.wavelength;
        assert!(
            report.spacing <= least.min(most / 3.0).max(wavelength / 64.0) * (1.0 + 1e-12),
            "{text}: {}",
            report.spacing
        );
        let made = surface(&built.solid, 0.35, &Silent).expect("surface");
        check(&text, &made);
    }
}

/// A radius that is given holds where tetrahedra have room for it, and nowhere more.
#[test]
fn a_given_radius_is_the_largest() {
    let mut some = Random(6);
    for i in 0..cases(2) {
        let (text, _) = graded(&mut some, i, "net.radius = 0.65\n");
        let report = built(&text).report();
        let Some(Varying::Range([least, most])) = tets(&report).end_radius else { panic!("{text}: one radius") };
        println!("{i}: {least} to {most}");
        assert!((most - 0.65).abs() < 1e-12 && least < 0.52 && least > 0.2, "{text}: {least} to {most}");
    }
}

/// Layers of prisms have tetrahedra that are flat: rods and rounded ends are no thicker than these are high.
#[test]
fn ends_in_layers_of_prisms_are_as_thin_as_these() {
    for surface in ["net", "rounded"] {
        let radii = |layers: &str| {
            let text = format!(
                "schema = 1\nregion.box = {{ min = [0, 0, 0], max = [20, 16, 10] }}\n[lattice.a]\npart = \"lower\"\n\
                 cell.tet.name = \"diamond\"\nlevel.fraction = 0.25\n[lattice.a.map.tets]\nsize = 5\nsurface = \"{surface}\"\n{layers}"
            );
            let report = built(&text).report();
            match tets(&report).end_radius.expect("a radius") {
                Varying::Range(both) => both,
                Varying::Number(one) => [one; 2],
            }
        };
        let plain = radii("");
        let thin = radii("layers = { count = 2, height = 0.5 }\n");
        println!("{surface}: {plain:?} plain, {thin:?} in layers");
        assert!(thin[1] < 0.7 * plain[1] && thin[1] < 0.5, "{surface}: {plain:?} {thin:?}");
    }
}

/// Where a skin is solid it ties the ports: there is a net where it is open, and none is refused to be asked for in vain.
#[test]
fn a_net_is_where_a_skin_is_open() {
    let text = |skin: &str| {
        format!(
            "schema = 1\nregion.box = {{ min = [0, 0, 0], max = [20, 16, 10] }}\n{skin}\n[lattice.a]\npart = \"lower\"\n\
             cell.tet.name = \"diamond\"\nlevel.fraction = 0.3\nmap.tets = {{ size = 5, surface = \"net\" }}\n"
        )
    };
    let count = |skin: &str| net(&built(&text(skin)).report()).ports;
    let (all, top) = (count(""), count("skin = { thickness = 0.8, open = [\"+z\"] }"));
    // One port on each triangle: those of the upper face, and of no other.
    println!("{all} {top}");
    assert!(top > 0 && 6 * top < 2 * all, "{top} of {all}");
    let refused = Design::from_toml(&text("skin.thickness = 0.8")).expect("design").build(&NoFiles).map(|_| ());
    let why = refused.expect_err("a net under a skin");
    assert_eq!(why.path, "lattice.a.map.tets.surface");
    assert!(why.message.contains("ties the ports without it"), "{}", why.message);
}

/// The openings of a net along all edges, as pn3m has, are the circles within the triangles, less the rods: on a box they are known to a step of the
/// points at which they are looked for.
#[test]
fn openings_are_those_of_the_triangles() {
    let text = |keys: &str| {
        format!(
            "schema = 1\nregion.box = {{ min = [0, 0, 0], max = [20, 16, 10] }}\n[lattice.a]\npart = \"lower\"\n\
             cell.tet.name = \"pn3m\"\nlevel.fraction = 0.35\n[lattice.a.map.tets]\nsize = 5\nsurface = \"net\"\n\
             net = {{ radius = 0.2{keys} }}\n"
        )
    };
    let made = built(&text(""));
    let report = made.report();
    let found = net(&report);
    let map = &made.tilings[0].tiling.map;
    let faces = map.boundary();
    let inner = |i: usize| {
        let [a, b, c] = faces.corners(i);
        let side = |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
        let (x, y, z) = (side(b, c), side(c, a), side(a, b));
        let s = 0.5 * (x + y + z);
        (((s - x) * (s - y) * (s - z) / s).sqrt(), x.max(y).max(z))
    };
    let widest =
        (0..faces.triangles.len()).map(inner).fold((0.0, 0.0), |a: (f64, f64), b| (a.0.max(b.0), a.1.max(b.1)));
    let known = 2.0 * (widest.0 - 0.2);
    println!("{} of {known}", found.opening);
    // Of points a twelfth of an edge apart one is within 1/√3 of that of the middle.
    let step = widest.1 / 12.0 / 3f64.sqrt();
    assert!(found.opening <= known + 2.0 * 0.1 && found.opening >= known - 2.0 * step, "{} {known}", found.opening);
    let said = |keys: &str| built(&text(keys)).warnings.iter().any(|w| w.message.contains("has openings of up to"));
    assert!(
        said(&format!(", opening = {}", 0.9 * found.opening)) && !said(&format!(", opening = {}", 1.1 * found.opening))
    );
}

/// Where a lattice meets its net at the border of two tiles, both have the same vertices, in a cell that is cut again, too: a file that
/// is written tile by tile is the mesh. Found among random designs.
#[test]
fn tiles_agree_where_a_lattice_meets_its_net() {
    let found = [
        (
            "difference = [{ box.size = [18, 14, 12] }, { cylinder = { base = [1, 0.7, -9], radius = 3.1, height = 18 } }]",
            [3.742896433454007, 0.27199651777744294, 0.1923953879031345],
        ),
        (
            "intersection = [{ sphere.radius = 9 }, { halfspace = { point = [0,0,2], normal = [0.3,0.2,1] } }]",
            [3.712084347847849, 0.3749476133100689, 0.24423181280977344],
        ),
    ];
    for (region, [size, fraction, edge]) in found {
        let text = format!(
            "schema = 1\nregion.{region}\n[lattice.a]\npart = \"lower\"\ncell.tet.name = \"diamond\"\n\
             level.fraction = {fraction}\nmap.tets = {{ size = {size}, surface = \"net\", method = \"implicit\" }}\n"
        );
        let built = built(&text);
        let (bytes, _) = stream(&built.solid, edge, Islands::Keep).expect("stream");
        assert!(bytes == stl(&surface(&built.solid, edge, &Silent).expect("surface")), "{text}");
    }
}
