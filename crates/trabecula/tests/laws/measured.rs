//! Figures taken while a surface is made are those of the mesh, and the volume error reported beforehand bounds the realised one.

use geometry::measure::quality;
use geometry::progress::Silent;
use proptest::prelude::*;
use trabecula::design::{Design, NoFiles};
use trabecula::extract::GridSurface;
use trabecula::surface_maker::{Figures, Islands, SurfaceMaker, SurfaceOptions};

use crate::common::{Random, cases, drawn, meshed, region, solid};
use crate::islands::winding;

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(12) as u32, ..ProptestConfig::default() })]

    /// Random solids (many more in a campaign), of one tile and of several: sums agree to rounding, all else exactly; the
    /// percentile of angles to the thousandth of a degree by which they are counted. A void's point lies in the void.
    #[test]
    fn streamed_figures_are_those_of_the_mesh(
        lattice in drawn(),
        kind in 0..7usize,
        (r, s, t) in (0.7..1.4f64, -0.3..0.3f64, 0.2..0.9f64),
        edge in 0.02..0.15f64,
    ) {
        let solid = solid(region(kind, r, s, t), Some(lattice.lattice()));
        let options = SurfaceOptions { resolution: edge, islands: Islands::DropSmall };
        let Ok(made) = GridSurface(&solid).measure(&options, &Silent) else {
            prop_assert!(GridSurface(&solid).mesh(&options, &Silent).is_err());
            return Ok(());
        };
        let (mesh, components) = meshed(&GridSurface(&solid), edge, Islands::DropSmall).expect("surface");
        let (streamed, held) = (&made.figures, Figures::of(&mesh));
        prop_assert_eq!(&made.components, &components);
        let (a, b) = (&streamed.size, &held.size);
        // A million terms of the size of the sum, each rounded.
        let near = |a: f64, b: f64, of: f64| (a - b).abs() <= 1e-9 * of;
        prop_assert!(near(a.volume, b.volume, b.area * r) && near(a.area, b.area, b.area), "{a:?} {b:?}");
        prop_assert!(near(streamed.area_cut, held.area_cut, b.area));
        prop_assert_eq!((a.euler, a.pieces, a.cavities, a.closed), (b.euler, b.pieces, b.cavities, b.closed));
        prop_assert_eq!(&a.bounds, &b.bounds);
        let (a, b) = (made.quality.expect("triangles"), quality(&mesh.mesh).expect("triangles"));
        prop_assert_eq!((a.smallest_angle, a.largest_aspect), (b.smallest_angle, b.largest_aspect));
        prop_assert!((a.smallest_angle_p05 - b.smallest_angle_p05).abs() <= 1e-3, "{a:?} {b:?}");
        let all: Vec<usize> = (0..mesh.mesh.triangles.len()).collect();
        for (a, b) in streamed.voids.iter().zip(&held.voids) {
            prop_assert!(near(a.volume, b.volume, b.volume.max(edge.powi(3))) && a.bounds == b.bounds, "{a:?} {b:?}");
            // Voids wider than a step are met by a line of the grid. Of a wall that the grid does not resolve the mesh says where
            // the void is.
            let wide = (0..3).all(|k| a.bounds.max[k] - a.bounds.min[k] > 2.0 * edge);
            prop_assert!(!wide || winding(&mesh.mesh, &all, a.point).abs() < 0.5, "{a:?}");
        }
    }
}

/// The realised error of random sheets and networks (more in a campaign), stretched, turned, and cut anywhere, is at most three
/// times the one reported, at steps from coarse to fine. The reference is a mesh at two fifths of the step, whose own error is at most
/// 0.16 times as large as errors fall with the second power at least. Below 1e-5 the cut faces, of which a small box has many,
/// decide.
#[test]
fn the_volume_error_reported_bounds_the_realised_one() {
    let mut random = Random(11);
    let names: Vec<&str> = trabecula::cell::catalogue().iter().map(|c| c.name).collect();
    for _ in 0..cases(6) {
        let [a, b, c] = [0; 3].map(|_| random.between(0.8, 1.3));
        let [u, v, w] = [0; 3].map(|_| random.between(-180.0, 180.0));
        let [x, y, z] = [0; 3].map(|_| random.between(-1.0, 1.0));
        let (name, part) = (names[random.below(names.len())], ["sheet", "sheet", "lower", "upper"][random.below(4)]);
        let text = format!(
            "schema = 1\n[region.box]\nmin = [{x}, {y}, {z}]\nmax = [{}, {}, {}]\n[lattice.a]\ncell = \"{name}\"\npart = \
             \"{part}\"\nmap.affine = {{ wavelength = [{a}, {b}, {c}], rotate = [{u}, {v}, {w}] }}\nlevel.fraction = {}",
            x + random.between(1.5, 2.2),
            y + random.between(1.5, 2.2),
            z + random.between(1.5, 2.2),
            random.between(0.15, 0.6),
        );
        let built = Design::from_toml(&text).expect("text").build(&NoFiles).expect("built");
        let edge = a.min(b).min(c) / random.between(10.0, 36.0);
        let volume = |edge: f64| {
            let options = SurfaceOptions { resolution: edge, islands: Islands::Keep };
            GridSurface(&built.solid).measure(&options, &Silent).expect("surface").figures.size.volume
        };
        let realised = (volume(edge) / volume(0.4 * edge) - 1.0).abs();
        let reported = built.volume_error(edge).expect("a lattice");
        assert!(realised <= 3.0 * reported + 1e-5, "{realised:.1e}, reported {reported:.1e} at {edge:.4}:\n{text}");
    }
}

/// As above, of lattices that curved regions cut, with and without a skin: nor are the realised errors less than a tenth of those reported
/// over all cases; of single ones they may be nothing, where the errors of a lattice and of its cuts have opposite signs.
#[test]
fn the_volume_error_reported_bounds_that_of_lattices_in_curved_regions() {
    let mut random = Random(13);
    let mut sums = [0.0; 2];
    for case in 0..cases(8) {
        let [x, y, z] = [0; 3].map(|_| random.between(-1.0, 1.0));
        let [u, v, w] = [0; 3].map(|_| random.between(-180.0, 180.0));
        let radius = random.between(0.8, 1.3);
        let cylinder = |radius: f64| {
            format!("cylinder = {{ base = [{x}, {y}, {z}], axis = [{u}, {v}, {w}], height = 2, radius = {radius} }}")
        };
        let region = match case % 4 {
            0 => format!("sphere = {{ center = [{x}, {y}, {z}], radius = {radius} }}"),
            1 => cylinder(radius),
            2 => format!("capsule = {{ start = [{x}, {y}, {z}], end = [{}, 0, 0], radius = {radius} }}", x + 1.0),
            _ => format!("difference = [{{ {} }}, {{ {} }}]", cylinder(radius), cylinder(0.4 * radius)),
        };
        let skin = if random.below(3) == 0 { "skin = { thickness = 0.12 }\n" } else { "" };
        let (name, part) = (["gyroid", "diamond", "primitive"][random.below(3)], ["sheet", "lower"][random.below(2)]);
        let text = format!(
            "schema = 1\n{skin}[region]\n{region}\n[lattice.a]\ncell = \"{name}\"\npart = \"{part}\"\nmap.affine = {{ wavelength = 1, \
             rotate = [{u}, {v}, {w}] }}\nlevel.fraction = {}",
            random.between(0.2, 0.6),
        );
        let built = Design::from_toml(&text).expect("text").build(&NoFiles).expect("built");
        let edge = 1.0 / random.between(16.0, 36.0);
        let volume = |edge: f64| {
            let options = SurfaceOptions { resolution: edge, islands: Islands::Keep };
            GridSurface(&built.solid).measure(&options, &Silent).expect("surface").figures.size.volume
        };
        let realised = (volume(edge) / volume(0.4 * edge) - 1.0).abs();
        let reported = built.volume_error(edge).expect("a lattice");
        assert!(realised <= 3.0 * reported, "{realised:.1e}, reported {reported:.1e} at {edge:.4}:\n{text}");
        sums = [sums[0] + realised, sums[1] + reported];
    }
    assert!(sums[0] >= 0.1 * sums[1], "realised {:.1e}, reported {:.1e} in all", sums[0], sums[1]);
}

/// As that of lattices in boxes, of random frames of beams (more in a campaign), turned, with and without fillets: nor is the realised error less than a tenth
/// of the one reported. Beams lose volume by chords; what a coarse grid does to the thinnest ones is in it too.
#[test]
fn the_volume_error_reported_of_beams_is_near_the_realised_one() {
    let mut random = Random(12);
    let fillets = ["\"none\"", "\"auto\"", "{ tau = 0.7 }", "{ radius = 0.05 }"];
    for _ in 0..cases(5) {
        let cell = ["sc", "bcc", "fcc", "octet", "diamond", "kelvin"][random.below(6)];
        let (radius, fillet) = (random.between(0.04, 0.07), fillets[random.below(4)]);
        let [u, v, w] = [0; 3].map(|_| random.between(-180.0, 180.0) * f64::from(random.below(2) as u8));
        let [x, y, z] = [0; 3].map(|_| random.between(-1.0, 1.0));
        let text = format!(
            "schema = 1\n[region.box]\nmin = [{x}, {y}, {z}]\nmax = [{}, {}, {}]\n[beams.a]\ncell = \"{cell}\"\nradius = {radius}\nfillet = \
             {fillet}\nmap.affine = {{ wavelength = 1, rotate = [{u}, {v}, {w}] }}",
            x + random.between(1.5, 2.2),
            y + random.between(1.5, 2.2),
            z + random.between(1.5, 2.2),
        );
        let (realised, reported) = beams_volume_error(&text, 2.0 * radius / random.between(1.4, 6.0));
        assert!(
            realised <= 3.0 * reported && realised >= 0.1 * reported,
            "{realised:.1e}, reported {reported:.1e}:\n{text}"
        );
    }
}

/// The volume error of beams at a grid spacing, realised and reported.
fn beams_volume_error(text: &str, edge: f64) -> (f64, f64) {
    let built = Design::from_toml(text).expect("text").build(&NoFiles).expect("built");
    let volume = |edge: f64| {
        let options = SurfaceOptions { resolution: edge, islands: Islands::Keep };
        GridSurface(&built.solid).measure(&options, &Silent).expect("surface").figures.size.volume
    };
    ((volume(edge) / volume(0.3 * edge) - 1.0).abs(), built.volume_error(edge).expect("beams"))
}

/// As that of beams anywhere, of frames of whole cells, whose outer beams are halved by the sides of the region: at most three times the
/// reported one, and a tenth of it in the mean.
#[test]
fn the_volume_error_reported_of_whole_cells_holds_for_beams_in_the_sides() {
    let mut random = Random(28);
    let mut sums = [0.0; 2];
    for n in 0..cases(5) {
        let cell = ["octet", "fcc", "sc", "bcc", "kelvin"][n as usize % 5];
        let radius = random.between(0.03, 0.07);
        let fillet = ["\"none\"", "\"auto\""][random.below(2)];
        let [a, b, c] = [0; 3].map(|_| 1 + random.below(3));
        let text = format!(
            "schema = 1\nregion.box.min = [0, 0, 0]\nregion.box.max = [{a}, {b}, {c}]\n[beams.a]\ncell = \"{cell}\"\nradius = {radius}\n\
             fillet = {fillet}\nmap.affine.wavelength = 1"
        );
        let (realised, reported) = beams_volume_error(&text, 2.0 * radius / random.between(2.0, 6.0));
        assert!(realised <= 3.0 * reported, "{realised:.1e}, reported {reported:.1e}:\n{text}");
        sums = [sums[0] + realised, sums[1] + reported];
    }
    assert!(sums[0] >= 0.1 * sums[1], "realised {:.1e}, reported {:.1e} in all", sums[0], sums[1]);
}
