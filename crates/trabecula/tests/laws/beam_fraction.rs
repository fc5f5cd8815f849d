//! The radius of beams from a fraction: whole cells in a box, frames that their region holds, and what cannot be.

use proptest::prelude::*;
use trabecula::design::{Design, DesignError, NoFiles};
use trabecula::report::BeamsReport;

use crate::common::cases;

fn beams(region: &str, core: &str) -> Result<BeamsReport, DesignError> {
    let text = format!("schema = 1\n[region.box]\n{region}\n[beams.core]\n{core}");
    let report = Design::from_toml(&text)?.build(&NoFiles)?.report();
    Ok(report.beams["core"].clone())
}

fn radius(of: &BeamsReport) -> f64 {
    of.graph.as_ref().and_then(|g| g.solved_radius).expect("a radius")
}

/// What a block of n³ whole cells gains by one more cell is the fraction of a cell: its volume is a polynomial of third degree in n,
/// with the fraction as its first coefficient. Returns the fraction of cells of the radius solved for, and how well it is known.
fn of_whole_cells(cell: &str, fraction: f64, [a, b, c]: [f64; 3], fillet: &str) -> Result<(f64, f64), DesignError> {
    let core =
        format!("cell = \"{cell}\"\nmap.affine.wavelength = [{a}, {b}, {c}]\nfillet = {fillet}\ntrim = \"drop\"");
    let block = |n: f64, amount: f64, key: &str| {
        // Hubs at the boundary of the block are thinner than one unit.
        let region = format!("min = [-1, -1, -1]\nmax = [{}, {}, {}]", n * a + 1.0, n * b + 1.0, n * c + 1.0);
        beams(&region, &format!("{core}\n{key} = {amount}"))
    };
    let r = radius(&block(1.0, fraction, "fraction")?);
    let volume = |n: f64| block(n, r, "radius").ok().and_then(|of| of.volume).expect("whole beams");
    let [v2, v3, v4, v5] = [2.0, 3.0, 4.0, 5.0].map(volume);
    // Volumes are known to 1e-10, and their third difference to eight times that of the largest.
    Ok(((v5 - 3.0 * v4 + 3.0 * v3 - v2) / 6.0 / (a * b * c), 8e-10 * v5 / (a * b * c)))
}

/// The largest fillets were found to 2⁻¹⁶, in steps as the radius grows: here the fraction lay between two of them, 1e-6 from either.
#[test]
fn the_largest_fillets_grow_with_the_radius_without_steps() {
    let wavelength = [5.005695559673972, 5.351537885191553, 4.808115889648781];
    let (realised, accuracy) = of_whole_cells("fcc", 0.04954219569345372, wavelength, "\"auto\"").expect("a radius");
    assert!((realised - 0.04954219569345372).abs() < accuracy, "{realised}");
}

proptest! {
    // 8 designs in `make test`, of four blocks each.
    #![proptest_config(ProptestConfig { cases: cases(8) as u32, ..ProptestConfig::default() })]

    #[test]
    fn whole_cells_have_the_fraction_asked_for(
        cell in proptest::sample::select(vec!["sc", "bcc", "fcc", "octet", "diamond", "kelvin", "octahedra", "re_entrant"]),
        fraction in 0.01..0.1f64,
        wavelength in proptest::array::uniform3(4.0..6.0f64),
        fillet in proptest::sample::select(vec!["\"none\"", "\"auto\"", "{ tau = 0.8 }", "{ radius = 0.1 }"]),
    ) {
        let (realised, accuracy) = of_whole_cells(cell, fraction, wavelength, fillet).map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!((realised - fraction).abs() < accuracy, "{realised} {fraction}");
    }

    /// A frame in a region that holds it has the fraction of the region, exactly; scaled, it has a scaled radius.
    #[test]
    fn frames_have_the_fraction_of_their_region(
        corner in proptest::array::uniform3(2.0..4.0f64),
        fraction in 0.001..0.004f64,
        fillet in proptest::sample::select(vec!["\"none\"", "\"auto\""]),
    ) {
        let frame = |size: f64| {
            let [x, y, z] = corner.map(|v| v * size);
            let nodes = format!("[[0, 0, 0], [{x}, 0, 0], [0, {y}, 0], [0, 0, {z}], [{}, {}, {}]]", -x, -y, -z);
            let region = format!("size = [{}, {}, {}]", 10.0 * size, 10.0 * size, 10.0 * size);
            let struts = "[[0, 1], [0, 2], [0, 3], [0, 4], [1, 2], [2, 3]]";
            beams(&region, &format!("nodes = {nodes}\nstruts = {struts}\nfillet = {fillet}\nfraction = {fraction}"))
        };
        let [one, two] = [1.0, 2.0].map(|size| frame(size).expect("a frame"));
        // Thicker beams overlap beyond the planes that split them: then shares are sampled.
        prop_assert!(one.fraction_exact);
        // The volume is known to 1e-10.
        prop_assert!((one.fraction / fraction - 1.0).abs() < 1e-9, "{}", one.fraction);
        prop_assert!((radius(&two) / radius(&one) - 2.0).abs() < 1e-9);
    }
}

/// The greatest fraction that a message allows is possible, and a little more is refused.
#[test]
fn the_limit_of_a_message_is_the_limit() {
    for cell in ["sc", "bcc", "octet", "kelvin"] {
        for fillet in ["none", "auto"] {
            let at = |fraction: f64| {
                let core = format!(
                    "cell = \"{cell}\"\nmap.affine.wavelength = 5\nfillet = \"{fillet}\"\nfraction = {fraction}"
                );
                beams("size = [7, 8, 9]", &core)
            };
            let message = at(0.99).expect_err("too much").to_string();
            let after = message.split("at most ").nth(1).expect("a limit");
            let most: f64 = after.split(':').next().and_then(|t| t.parse().ok()).expect("a number");
            assert!(most > 0.05, "{cell} {fillet}: {message}");
            assert!(radius(&at(most).expect("the limit")) > 0.0);
            at(most + 2e-4).expect_err("beyond the limit");
        }
    }
}
