//! The grid spacing that a design is meshed at unless another is asked for carries its walls.

use geometry::measure::size;
use trabecula::cell::catalogue;
use trabecula::design::{Built, Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::surface_maker::{Islands, SurfaceMaker};

use crate::common::{campaign, meshed};

fn built(more: &str) -> Built {
    let text = format!("schema = 1\n[region.box]\nsize = [4, 4, 4]\n{more}");
    Design::from_toml(&text).expect("text").build(&NoFiles).expect("built")
}

/// One period of a sheet has the volume of its fraction within 1e-4, of every named cell. Two exceptions: walls thinner than a
/// 64th of the wavelength would cost more triangles than they are worth (lidinoid below 0.35), and Neovius's level at 0.3 to
/// 0.4 is near that of its saddles, where the error falls with a lower power of the spacing.
#[test]
fn sheets_have_their_volume() {
    let fractions = [0.2, 0.3, 0.5];
    for (i, cell) in catalogue().iter().enumerate() {
        // One of the three each; all of them in `make campaign`.
        let (first, all) = if campaign() { (0, 3) } else { (i % 3, 1) };
        for &fraction in &fractions[first..first + all] {
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

/// A mesh of more than 20 million triangles gets a spacing that is coarser by the root of the excess, since triangles fall with
/// the square of the spacing, as long as 12 steps are left on the wavelength and 1.5 across the thinnest wall.
#[test]
fn too_many_triangles_make_the_spacing_coarser() {
    let sheet = |size: f64, thickness: f64| {
        let text = format!(
            "schema = 1\n[region.box]\nsize = [{size}, {size}, {size}]\n[lattice.core]\ncell = \"gyroid\"\npart = \"sheet\"\n\
             map.affine.wavelength = 4\nlevel.thickness = {thickness}\n"
        );
        Design::from_toml(&text).expect("text").build(&NoFiles).expect("built")
    };
    assert_eq!(sheet(20.0, 0.4).coarser_spacing(), None);
    let some = sheet(50.0, 0.8);
    let coarser = some.coarser_spacing().expect("some 3.6e7 triangles");
    assert_eq!(coarser.wanted, some.report().spacing);
    assert!(coarser.triangles > 25e6 && coarser.spacing < 4.0 / 12.0, "{coarser:?}");
    // Scaled by the square from 16 steps on the wavelength, while cells along edges grow in number with the first power.
    let made = GridSurface(&some.solid).estimate(coarser.spacing).expect("estimate").triangles;
    assert!((made / 20e6 - 1.0).abs() < 0.2, "{made} at {coarser:?}");
    // Far too many: what the thinnest wall allows, then what the wavelength allows.
    let walls = sheet(200.0, 0.25).coarser_spacing().expect("coarser");
    let least = sheet(200.0, 0.25).report().lattices["core"].thickness.expect("known").least();
    assert!((walls.spacing * 1.5 / least - 1.0).abs() < 1e-2 && walls.spacing * 1.5 <= least, "{walls:?} for {least}");
    let waves = sheet(200.0, 0.8).coarser_spacing().expect("coarser");
    assert!((waves.spacing * 12.0 / 4.0 - 1.0).abs() < 1e-2 && waves.spacing <= 4.0 / 12.0, "{waves:?}");
}

/// Over tetrahedra, too: steps are then those along their edges, with the same 12 on the wavelength.
#[test]
fn large_tetrahedra_are_not_cut_finer_than_a_mesh_can_hold() {
    let text = "schema = 1\n[region.box]\nsize = [100, 100, 100]\n[lattice.core]\npart = \"sheet\"\ncell.tet.name = \"frd\"\nmap.tets.size = 9\nlevel.fraction = 0.3\n";
    let built = Design::from_toml(text).expect("text").build(&NoFiles).expect("built");
    let coarser = built.coarser_spacing().expect("coarser");
    let triangles = |edge| built.surface().estimate(edge).expect("estimate").triangles;
    assert!((triangles(coarser.wanted) / coarser.triangles - 1.0).abs() < 0.3, "{coarser:?}");
    assert!(coarser.spacing <= built.solid.wavelength / 12.0 && coarser.spacing > coarser.wanted);
    assert!(triangles(coarser.spacing) < 0.8 * coarser.triangles);
}
