//! Rounded ends of lattices over tetrahedra: of walls and of struts, at plane faces and at curved ones, they bound a solid.

use crate::common::{check, rows};
use geometry::progress::Silent;
use trabecula::design::{Design, NoFiles};
use trabecula::extract::surface;

/// Both sides of a wall are rounded, and their ends must not be tangent to each other or to the region's face: vertices there would
/// fall together in the single precision of files.
#[test]
fn rounded_ends_are_manifold_as_files_hold_them() {
    let walls = "part = \"sheet\"\ncell.tet.name = \"diamond_sheet\"\nlevel.thickness = 0.5";
    let sheet = "part = \"sheet\"\ncell.tet.name = \"primitive_sheet\"\nlevel.fraction = 0.25";
    let struts = "part = \"lower\"\ncell.tet.name = \"diamond\"\nlevel.fraction = 0.3";
    let block = "box = { min = [0, 0, 0], max = [20, 20, 12] }";
    let ball = "sphere.radius = 5";
    let can = "cylinder = { base = [0, 0, 0], radius = 5, height = 8 }";
    for (region, lattice, edges) in [
        (block, walls, [0.25, 0.31]),
        (block, struts, [0.25, 0.4]),
        (ball, walls, [0.21, 0.3]),
        (ball, struts, [0.2, 0.33]),
        (can, sheet, [0.22, 0.3]),
        (can, struts, [0.2, 0.3]),
    ] {
        let text = format!(
            "schema = 1\nregion.{region}\n[lattice.a]\n{lattice}\nmap.tets = {{ size = 5, surface = \"rounded\" }}\n"
        );
        let built = Design::from_toml(&text).expect(lattice).build(&NoFiles).expect(lattice);
        for edge in rows(1, edges) {
            let made = surface(&built.solid, edge, &Silent).expect(lattice);
            check(&format!("{region} {edge}\n{lattice}"), &made);
        }
    }
}

/// The figures of zones are those of the finished part where that is another than the lattice in flat tetrahedra: with a net, which
/// is solid in all of them, and where tetrahedra are bent. Their mean is the part's fraction, by 80 000 points, which know it within
/// 0.005, three standard errors; zones of a bent part have a little more of it than their flat tetrahedra say, or less.
#[test]
fn zones_are_reported_as_they_are_in_the_finished_part() {
    for (region, surface, near) in
        [("box = { min = [-10, -10, -6], max = [10, 10, 6] }", "net", 0.005), ("sphere.radius = 8", "capped", 0.01)]
    {
        let text = format!(
            "schema = 1\nregion.{region}\n[lattice.a]\ncell.tet.zones = {{ 0 = \"p43m\", 1 = \"f43m\" }}\npart = \"lower\"\n\
             level.fraction = 0.3\n[lattice.a.map.tets]\nsize = 4\nsurface = \"{surface}\"\n\
             zones.1.halfspace = {{ point = [0, 0, 0], normal = [1, 0, 0] }}\n"
        );
        let built = Design::from_toml(&text).expect(surface).build(&NoFiles).expect(surface);
        let report = built.report();
        let tets = report.lattices["a"].tets.as_ref().expect("tetrahedra");
        let finished = tets.finished_fraction.expect("of the finished part");
        let zones = tets.zones.as_ref().expect("zones");
        let mut sums = [0.0; 3];
        for zone in zones.values() {
            let own = zone.finished_fraction.expect("of the finished zone");
            println!("{surface} {}: {own:.4} finished, {:.4} flat", zone.cell, zone.solid_fraction);
            sums[0] += zone.volume;
            sums[1] += zone.volume * own;
            sums[2] += zone.volume * zone.solid_fraction;
            assert!((own - 0.3).abs() < 0.03, "{surface} {}: {own}", zone.cell);
        }
        assert!((finished - 0.3).abs() < 1e-3, "{surface}: {finished}");
        assert!((sums[1] / sums[0] - finished).abs() < near, "{surface}: {} of {finished}", sums[1] / sums[0]);
        assert!((sums[2] / sums[0] - tets.solid_fraction).abs() < 1e-9, "{surface}");
        assert!(surface != "net" || tets.solid_fraction < 0.9 * finished, "{surface}: {}", tets.solid_fraction);
    }
}
