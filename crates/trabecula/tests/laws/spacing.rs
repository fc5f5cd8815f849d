//! The grid spacing that a design is meshed at unless another is asked for carries its walls.

use geometry::measure::size;
use trabecula::cell::catalogue;
use trabecula::design::{Built, Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::surface_maker::Islands;

use crate::common::meshed;

fn built(more: &str) -> Built {
    let text = format!("schema = 1\n[region.box]\nsize = [4, 4, 4]\n{more}");
    Design::from_toml(&text).expect("text").build(&NoFiles).expect("built")
}

/// One period of a sheet has the volume of its fraction within 1e-4, of every named cell. Two exceptions: walls thinner than a
/// 64th of the wavelength would cost more triangles than they are worth (lidinoid below 0.35), and Neovius's level at 0.3 to
/// 0.4 is near that of its saddles, where the error falls with a lower power of the spacing.
#[test]
fn sheets_have_their_volume() {
    for cell in catalogue() {
        for fraction in [0.2, 0.3, 0.5] {
            let design = format!(
                "[lattice.core]\ncell = \"{}\"\npart = \"sheet\"\nmap.affine.wavelength = 4\nlevel.fraction = {fraction}",
                cell.name
            );
            let built = built(&design);
            let spacing = built.report().spacing;
            let (made, _) = meshed(&GridSurface(&built.solid), spacing, Islands::Keep).expect("surface");
            let error = size(&made.mesh).volume / 64.0 / fraction - 1.0;
            let allowed = match cell.name {
                "lidinoid" if fraction < 0.35 => 1e-3,
                "neovius" => 5e-4,
                _ => 1e-4,
            };
            assert!(error.abs() < allowed, "{} {fraction}: {error:.1e} at {spacing:.4} mm", cell.name);
        }
    }
}

/// The spacing is half the thinnest wall, a 24th of the finest wave, a 32nd of the wavelength, whichever is least.
#[test]
fn the_finest_detail_decides() {
    let sheet = |cell: &str, level: &str| {
        let built = built(&format!(
            "[lattice.core]\ncell = \"{cell}\"\npart = \"sheet\"\nmap.affine.wavelength = 4\nlevel.{level}"
        ));
        built.report().spacing
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} for {b}");
    near(sheet("primitive", "thickness = 0.5"), 4.0 / 32.0);
    near(sheet("diamond", "thickness = 0.5"), 4.0 / (24.0 * 3f64.sqrt()));
    near(sheet("primitive", "thickness = 0.2"), 0.1);
    near(sheet("primitive", "thickness = 0.05"), 4.0 / 64.0);
    let beams = built("[beams.core]\ncell = \"bcc\"\nmap.affine.wavelength = 4\nradius = 0.3\n").report().spacing;
    near(beams, 0.1);
}
