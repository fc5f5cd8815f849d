//! A fraction and a thickness together give the wavelength.

use geometry::math::{IDENTITY, Vec3};
use proptest::prelude::*;
use trabecula::cell::{Cell, Distance, Part, Series, catalogue, named};
use trabecula::design::{Built, Design, DesignError, NoFiles};

use trabecula::field::Field;
use trabecula::report::Varying;

use crate::common::{Random, cases, rows};

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
    #![proptest_config(ProptestConfig { cases: cases(3) as u32, ..ProptestConfig::default() })]

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

/// Where the fraction or the length varies, cells are those of the wavelength that varies likewise: the length over the one that
/// the cell has per mm of its edge at the fraction there, for walls, necks and pores.
#[test]
fn graded_fractions_and_lengths_are_graded_wavelengths() {
    let linear = |stops: &[f64]| {
        let last = (stops.len() - 1) as f64;
        let at = |(i, v): (usize, &f64)| format!("[{}, {v}]", 9.0 * i as f64 / last - 4.5);
        let stops = stops.iter().enumerate().map(at).collect::<Vec<_>>().join(", ");
        format!("{{ linear = {{ along = [1, 0, 0], stops = [{stops}] }} }}")
    };
    let mut some = Random(5);
    let points: Vec<Vec3> = (0..500).map(|_| some.point(4.5)).collect();
    let kinds = [
        ("gyroid", Part::Sheet, "thickness"),
        ("primitive", Part::Upper, "pore"),
        ("diamond", Part::Lower, "thickness"),
    ];
    for (cell, part, key) in rows(2, kinds) {
        let series = Series::new(named(cell).expect("named").terms()).expect("series");
        let of = Cell::new(series.clone());
        let wall = Distance::new(&series, &IDENTITY);
        let per_mm = |fraction: f64| match (key, part) {
            ("pore", _) => of.pores(part, of.level(part, fraction), &IDENTITY)[0],
            (_, Part::Sheet) => 2.0 * wall.iso(part, fraction).0,
            _ => of.thickness(part, of.level(part, fraction), &IDENTITY).expect("a neck"),
        };
        let word = ["sheet", "lower", "upper"][part as usize];
        let compare = |fraction: &str, length: &str, wavelength: &[f64]| {
            let solved = built(cell, word, "map.phase = {}", &format!("fraction = {fraction}, {key} = {length}"));
            let map = format!("map.phase.wavelength = {}", linear(wavelength));
            let level =
                if part == Part::Sheet { format!("thickness = {length}") } else { format!("fraction = {fraction}") };
            let [solved, given] = [solved, built(cell, word, &map, &level)].map(|made| {
                let mut values = vec![0.0; points.len()];
                made.expect("built").lattices[0].1.values(&points, &mut values);
                values
            });
            let apart = solved.iter().zip(&given).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            // Rounding of the wavelengths, summed up along the part.
            assert!(apart < 1e-9, "{cell} {word}, {fraction}, {length}: {apart}");
        };
        // The wavelength is linear between 65 fractions.
        let fractions: Vec<f64> = (0..65).map(|i| 0.38 + 0.04 * f64::from(i) / 64.0).collect();
        let wavelengths: Vec<f64> = fractions.iter().map(|f| 0.5 / per_mm(*f)).collect();
        compare(&linear(&[0.38, 0.42]), "0.5", &wavelengths);
        compare("0.4", &linear(&[0.5, 0.55]), &[0.5, 0.55].map(|w| w / per_mm(0.4)));
    }
}

/// Of walls of given thickness in cells whose size varies the report has the range of the fraction and of the wavelength, and each
/// point its own fraction: near the one asked for, where that gave the wavelength.
#[test]
fn walls_in_cells_that_grow_have_the_fraction_of_each_place() {
    let graded = "{ linear = { along = [1, 0, 0], stops = [[-4.5, 0.35], [4.5, 0.45]] } }";
    let made = built("gyroid", "sheet", "map.phase = {}", &format!("fraction = {graded}, thickness = 0.3"));
    let made = made.expect("built");
    let core = &made.report().lattices["core"];
    let (Varying::Range([low, high]), Varying::Range([full, empty])) = (core.fraction, core.porosity) else {
        panic!("ranges, found {:?} and {:?}", core.fraction, core.porosity);
    };
    assert!(0.34 < low && low < 0.39 && 0.41 < high && high < 0.46, "{low} {high}");
    assert!((low + empty - 1.0).abs() < 1e-12 && (high + full - 1.0).abs() < 1e-12);
    let [short, long] = core.wavelengths.expect("a range");
    assert!((long / short - 0.45 / 0.35).abs() < 0.1, "{short} {long}");
    let mut found = [0.0; 2];
    made.lattices[0].1.fractions(&[[-4.0, 0.0, 0.0], [4.0, 0.0, 0.0]], &mut found);
    assert!(found[1] - found[0] > 0.02 && low <= found[0] && found[1] <= high, "{found:?}");

    let alike = built("gyroid", "sheet", "map.phase.wavelength = 3", "thickness = 0.3").expect("built").report();
    assert!(matches!(alike.lattices["core"].fraction, Varying::Number(_)));
    assert!(alike.lattices["core"].wavelengths.is_none());
}

#[test]
fn what_contradicts_is_refused() {
    let refused = |map: &str, level: &str| built("gyroid", "sheet", map, level).err().expect("refused").to_string();
    let both = "fraction = 0.3, thickness = 0.4";
    assert!(refused("map.affine.wavelength = 4", both).contains("give the wavelength; leave it out"));
    assert!(refused("map.affine = {}", "fraction = 0.3").contains("\"wavelength\" is missing"));
    assert!(refused("map.affine = {}", "iso = 0.3, thickness = 0.4").contains("give exactly one of"));
    assert!(
        refused("map.cylinder = { around = 20, wavelength = 4 }", both)
            .contains("give the wavelength of map.affine, map.spartan and map.phase")
    );
    assert!(refused("map.affine = {}", "fraction = \"x\", thickness = 0.4").contains("expected a number or a grade"));
    let graded = "fraction.linear = { along = [1, 0, 0], stops = [[0, 0.2], [9, 0.4]] }, thickness = 0.4";
    assert!(refused("map.affine = {}", graded).contains("use map.phase"));
    assert!(refused("map.phase.wavelength = 4", both).contains("leave it out"));
    assert!(refused("map.phase = {}", "fraction = 0.3").contains("\"wavelength\" is missing"));
}

/// A thickness that varies asks for cells that no map has everywhere; walls keep it, and the fraction that then deviates is warned of,
/// with the place. A gentle one is not.
#[test]
fn a_fraction_that_a_graded_thickness_does_not_keep_is_warned_of() {
    for (steep, warned) in [(0.1, false), (0.6, true)] {
        let stops = format!("[[-4.5, 0.3], [4.5, {}]]", 0.3 * (1.0 + steep));
        let level = format!("fraction = 0.3, thickness = {{ linear = {{ along = [1, 0, 0], stops = {stops} }} }}");
        let made = built("gyroid", "sheet", "map.phase = {}", &level).expect("built");
        let found = made.report().lattices["core"].fraction;
        let off = match found {
            Varying::Number(v) => (v / 0.3 - 1.0).abs(),
            Varying::Range([a, b]) => (a / 0.3 - 1.0).abs().max((b / 0.3 - 1.0).abs()),
        };
        assert_eq!(off > 0.05, warned, "{found:?}");
        let said: Vec<_> = made.warnings.iter().filter(|w| w.path == "lattice.core.level.fraction").collect();
        assert_eq!(said.len(), usize::from(warned), "{:?}", made.warnings);
        assert!(said.iter().all(|w| w.message.contains("mm, where 0.3000 is asked for")), "{said:?}");
    }
}
