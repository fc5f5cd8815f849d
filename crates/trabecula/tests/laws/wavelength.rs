//! A fraction and a thickness together give the wavelength.

use proptest::prelude::*;
use trabecula::cell::{Cell, Part, Series, catalogue, named};
use trabecula::design::{Built, Design, DesignError, NoFiles};

use trabecula::report::Varying;

use crate::common::cases;

fn built(cell: &str, part: &str, map: &str, level: &str) -> Result<Built, DesignError> {
    let text = format!(
        "schema = 1\n[region.box]\nsize = [9, 9, 9]\n[lattice.core]\ncell = \"{cell}\"\npart = \"{part}\"\n{map}\nlevel = {{ {level} }}"
    );
    Design::from_toml(&text)?.build(&NoFiles)
}

fn number(v: Option<Varying>) -> f64 {
    match v {
        Some(Varying::Number(v)) => v,
        other => panic!("a number, found {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(5) as u32, ..ProptestConfig::default() })]

    /// The report of the design has the fraction and the thickness that were asked for, whatever cell, part and ratios; and a
    /// design that is given the wavelength found and one of the two has the other. Both figures are of the same tables, so
    /// only their interpolation (5e-4) and the search for the thinnest place part them: a wall's stops at steps of 1e-4, and the
    /// level of a neck's fraction is exact or from the table, 1e-5 of the range apart.
    #[test]
    fn both_are_met(
        cell in proptest::sample::select(catalogue().iter().map(|c| c.name).collect::<Vec<_>>()),
        part in proptest::sample::select(vec!["sheet", "lower", "upper"]),
        fraction in 0.25..0.45f64,
        thickness in 0.2..0.5f64,
        ratio in 0.8..1.25f64,
        turn in 0.0..90.0f64,
    ) {
        let map = format!("map.affine = {{ wavelength = [1, {ratio}, 1], rotate = [{turn}, 0, 0] }}");
        let made = match built(cell, part, &map, &format!("fraction = {fraction}, thickness = {thickness}")) {
            Ok(made) => made.report(),
            Err(e) => {
                prop_assert!(part != "sheet", "{e}");
                let of = Cell::new(Series::new(named(cell).expect("named").terms()).expect("series"));
                let part = if part == "lower" { Part::Lower } else { Part::Upper };
                let whole = of.connected_fraction(part);
                prop_assert!(!whole.iter().any(|[a, b]| (*a..=*b).contains(&fraction)), "{e}");
                return Ok(());
            }
        };
        let core = &made.lattices["core"];
        prop_assert!((number(Some(core.fraction)) - fraction).abs() < 5e-4, "{:?}", core.fraction);
        prop_assert!((number(core.thickness) / thickness - 1.0).abs() < 1e-4, "{:?}", core.thickness);

        // The same wavelengths, given.
        let (a, b) = if ratio < 1.0 { (core.wavelength / ratio, core.wavelength) } else { (core.wavelength, core.wavelength * ratio) };
        let map = format!("map.affine = {{ wavelength = [{a}, {b}, {a}], rotate = [{turn}, 0, 0] }}");
        let level = if part == "sheet" { format!("thickness = {thickness}") } else { format!("fraction = {fraction}") };
        let given = built(cell, part, &map, &level).expect("built").report();
        let given = &given.lattices["core"];
        prop_assert!((number(Some(given.fraction)) - fraction).abs() < 5e-4, "{:?}", given.fraction);
        prop_assert!((number(given.thickness) / thickness - 1.0).abs() < 1e-4, "{:?}", given.thickness);
    }
}

#[test]
fn what_contradicts_is_refused() {
    let refused = |map: &str, level: &str| built("gyroid", "sheet", map, level).err().expect("refused").to_string();
    let both = "fraction = 0.3, thickness = 0.4";
    assert!(refused("map.affine.wavelength = 4", both).contains("give the wavelength; leave it out"));
    assert!(refused("map.affine = {}", "fraction = 0.3").contains("\"wavelength\" is missing"));
    assert!(refused("map.affine = {}", "iso = 0.3, thickness = 0.4").contains("at once"));
    assert!(
        refused("map.cylinder = { around = 20, wavelength = 4 }", both)
            .contains("give the wavelength of map.affine and map.spartan")
    );
    assert!(refused("map.affine = {}", "fraction = \"x\", thickness = 0.4").contains("expected a number or a grade"));
}
