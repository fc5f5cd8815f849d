//! Stresses of several load cases and of tables, through designs.

use geometry::math::{Mat3, Vec3};
use trabecula::design::{Built, Design, DesignError, Loader};

/// One file, whatever its name.
struct One(String);

impl Loader for One {
    fn load(&self, _: &str) -> Result<Vec<u8>, String> {
        Ok(self.0.clone().into_bytes())
    }
}

/// Tension along a direction that turns about z by 4 degrees a millimetre, compression across it, and nothing along z.
const TURNS: [&str; 6] = ["cos(0.14*x)", "-cos(0.14*x)", "0", "0", "0", "sin(0.14*x)"];

fn tensor(factor: f64, of: [&str; 6]) -> String {
    format!("[{}]", of.map(|f| format!("{{ formula = \"{factor}*({f})\" }}")).join(", "))
}

fn built(stress: &str, file: &str) -> Result<Built, DesignError> {
    let text = format!(
        "schema = 1\n[region.box]\nmin = [0, 0, 0]\nmax = [10, 6, 6]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\n\
         map.phase = {{ wavelength = 3, step = 1, stress = {stress} }}\nlevel.fraction = 0.3\n"
    );
    Design::from_toml(&text)?.build(&One(file.into()))
}

fn phases(stress: &str, file: &str) -> Vec<Vec3> {
    let built = built(stress, file).unwrap_or_else(|e| panic!("{stress}: {e}"));
    let mut out = vec![[0.0; 3]; 200];
    built.lattices[0].1.map.phases(&points(), &mut out);
    out
}

fn points() -> Vec<Vec3> {
    let at =
        |i: u32| [(0.8191725, 10.0), (0.6710436, 6.0), (0.5497005, 6.0)].map(|(s, l)| l * (s * f64::from(i)).fract());
    (1..=200).map(at).collect()
}

#[test]
fn one_case_is_plain_stress_to_the_last_bit() {
    let (plain, other) = (phases(&tensor(1.0, TURNS), ""), tensor(3.0, ["x", "1", "y", "0", "z", "0"]));
    for by in ["mean", "worst"] {
        for cases in [format!("[{}]", tensor(1.0, TURNS)), format!("[{other}, {}]", tensor(1.0, TURNS))] {
            let weights = if cases.contains(&other) { "[0, 0.3]" } else { "[7]" };
            assert_eq!(phases(&format!("{{ cases = {cases}, by = \"{by}\", weights = {weights} }}"), ""), plain);
        }
    }
}

/// The same load forth and back, one of them larger, and a load that only presses from all sides, which has no directions: the phases are
/// those of the load alone. Frames agree to the root of the rounding of a sum of squares, 1e-8, over some three cells.
#[test]
fn opposite_loads_have_the_directions_of_one() {
    let plain = phases(&tensor(1.0, TURNS), "");
    let [forth, back, press] =
        [tensor(1.0, TURNS), tensor(-2.0, TURNS), tensor(1.0, ["-1", "-1", "-1", "0", "0", "0"])];
    for stress in [
        format!("{{ cases = [{forth}, {back}, {press}] }}"),
        format!("{{ cases = [{press}, {forth}, {back}], weights = [2, 0.5, 0.1] }}"),
        format!("{{ cases = [{forth}, {back}], by = \"worst\" }}"),
    ] {
        let off = phases(&stress, "")
            .iter()
            .flatten()
            .zip(plain.iter().flatten())
            .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(off < 1e-7, "{stress}: {off}");
    }
}

/// Before the middle the first case is worst, behind it the second, at right angles to the first but for 20 degrees: cells turn there.
#[test]
fn the_worst_case_changes_where_another_dominates() {
    let turn = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        [c * c - s * s, s * s - c * c, 0.0, 0.0, 0.0, 2.0 * s * c].map(|v| format!("{v}"))
    };
    let case = |of: [String; 6], size: &str| {
        tensor(1.0, of.each_ref().map(String::as_str)).replace("1*(", &format!("({size})*("))
    };
    let stress = format!("{{ cases = [{}, {}], by = \"worst\" }}", case(turn(0.0), "10-x"), case(turn(20.0), "x"));
    let angle = |j: Mat3| j[0][1].atan2(j[0][0]).to_degrees().rem_euclid(90.0);
    for more in ["", ", smooth = 1"] {
        let built = built(&format!("{stress}{more}"), "").unwrap_or_else(|e| panic!("{e}"));
        // The jump is spread over a wavelength or so by the least squares of the phase.
        for (at, want) in [(1.0, 0.0f64), (9.0, 20.0)] {
            let off = (angle(built.lattices[0].1.map.jacobian([at, 3.0, 3.0])) - want + 45.0).rem_euclid(90.0) - 45.0;
            assert!(off.abs() < 4.0, "{off} at {at}{more}");
        }
    }
}

/// A table of a tensor that is the same everywhere: the weights of the nearest points do not matter.
#[test]
fn a_table_is_the_tensor_that_it_holds() {
    let same = [2.0, 1.0, -0.5, 0.4, 0.3, -0.7];
    let plain = phases(&format!("{same:?}"), "");
    let (mut nine, mut many) =
        (String::new(), "Node;S.S12;X (m);Y (m);Z (m);S.S11;S.S22;S.S33;S.S13;S.S23\n".to_string());
    for (i, [x, y, z]) in points().iter().enumerate() {
        let [a, b, c, d, e, f] = same;
        nine += &format!("{x} {y} {z} {a} {b} {c} {d} {e} {f}\n");
        let [x, y, z] = [x, y, z].map(|v| v / 1000.0);
        many += &format!("PART-1.{i};{f};{x};{y};{z};{a};{b};{c};{e};{d}\n");
    }
    let columns = "[\"X (m)\", \"Y (m)\", \"Z (m)\", \"S.S11\", \"S.S22\", \"S.S33\", \"S.S23\", \"S.S13\", \"S.S12\"]";
    let named = format!("{{ table = {{ path = \"t.csv\", unit = \"m\", columns = {columns} }} }}");
    for (stress, file) in [("{ table = { path = \"t.csv\" } }", &nine), (&named, &many)] {
        let off = phases(stress, file)
            .iter()
            .flatten()
            .zip(plain.iter().flatten())
            .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        // Rounding of the mean of eight, over gaps of a tenth, over some three cells.
        assert!(off < 1e-12, "{off}");
    }
    let says = |stress: &str, file: &str, words: &[&str]| {
        let e = built(stress, file).err().expect("refused");
        assert_eq!(e.path, "lattice.a.map.phase.stress.table.path", "{e}");
        words.iter().for_each(|w| assert!(e.message.contains(w), "{w}: {e}"));
    };
    says(&named.replace("S.S23", "S23"), &many, &["no column is named \"S23\"", "\"S.S13\", \"S.S23\""]);
    says(&named, &many.replace("PART-1.7;-0.7", "PART-1.7;-"), &["line 9", "as S.S12, found \"-\""]);
    let bare = named.replace("unit = \"m\", ", "");
    says(&bare, &many, &["the heading \"X (m)\" has another unit than mm", "give unit = \"m\""]);
    says(&bare.replace(" (m)", ""), &many.replace(" (m)", ""), &["the points reach from", "unit = \"m\""]);
    says("{ table = { path = \"t.csv\" } }", &many, &["the heading \"X (m)\""]);
    says(
        "{ table = { path = \"t.csv\" } }",
        &many.replace(" (m)", ""),
        &["line 2", "nine numbers x, y, z, 11, 22, 33, 23, 13, 12"],
    );
}
