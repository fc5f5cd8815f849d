//! Rounded ends of lattices over tetrahedra: of walls and of struts, at plane faces and at curved ones, they bound a solid.

use crate::common::check;
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
        for edge in edges {
            let made = surface(&built.solid, edge, &Silent).expect(lattice);
            check(&format!("{region} {edge}\n{lattice}"), &made);
        }
    }
}
