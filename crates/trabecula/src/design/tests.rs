//! Whole designs through the reader and back.

use super::*;

const GOOD: &str = r#"schema = 1
units = "mm"
[region.box]
size = [8, 8.5, 9]
[lattice.core]
cell = "gyroid"
part = "lower"
[lattice.core.map.affine]
wavelength = [4, 4, 5]
rotate = [0, 30, 0]
skew = { xz = 20 }
[lattice.core.level]
porosity = { linear = { along = [0, 0, 1], stops = [[0, 0.5], [9, 0.8]] } }
"#;

fn refused(text: &str) -> DesignError {
    match Design::from_toml(text) {
        Err(e) => e,
        Ok(_) => panic!("accepted:\n{text}"),
    }
}

/// The good design with one line changed.
fn with(line: &str, instead: &str) -> DesignError {
    assert!(GOOD.contains(line), "{line}");
    refused(&GOOD.replacen(line, instead, 1))
}

#[test]
fn a_design_survives_toml_and_json() {
    let d = Design::from_toml(GOOD).expect("good");
    let strip = |mut d: Design| {
        d.lines = LineNumbers::default();
        d
    };
    let toml = Design::from_toml(&d.to_toml().expect("writable")).expect("own TOML is readable");
    let json = Design::from_json(&d.to_json().to_string()).expect("own JSON is readable");
    assert_eq!(strip(toml), strip(d.clone()));
    assert_eq!(strip(json), strip(d));
}

#[test]
fn every_kind_of_region_and_grade_survives() {
    for region in [
        "box = { min = [0, 0, 0], max = [1, 2, 3] }",
        "cylinder = { base = [0, 0, 0], radius = 2, height = 3 }",
        "sphere = { radius = 2, center = [1, 0, 0] }",
        "mesh = { path = \"a.stl\", unit = \"inch\", scale = 2 }",
        "union = [{ sphere = { radius = 2 } }, { box = { size = [1, 1, 1] } }]",
        "difference = [{ sphere = { radius = 2 } }, { halfspace = { point = [0, 0, 0], normal = [0, 0, 1] } }]",
        "offset = { of = { intersection = [{ sphere = { radius = 2 } }] }, by = 0.5 }",
    ] {
        for level in [
            "iso = 0.2",
            "fraction = { depth = { stops = [[0, 0.2], [1, 0.3]] } }",
            "fraction = { formula = \"0.3 + 0.1*sin(x/5)\" }",
            "porosity = 0.7\nof = \"part\"",
            "porosity = 0.7\nfit = \"spartan\"",
            "thickness = 0.6\nmid = 0.2",
            "thickness = { linear = { along = [0, 0, 1], stops = [[0, 0.2], [1, 0.3]] } }",
            "iso = { radial = { stops = [[0, 0.2], [1, 0.3]] } }",
            "iso = { radial = { center = [1, 2, 3], axis = [0, 0, 1], stops = [[0, 0.2], [1, 0.3]] } }",
            "iso = { grid = { path = \"a.npy\", origin = [0, 0, 0], step = 0.5 } }",
            "iso = { points = { path = \"a.csv\", neighbours = 4, remap = [[0, 1], [2, 3]] } }",
            "iso = { field = { path = \"a.vtu\", array = \"S\", component = 2 } }",
        ] {
            let text = format!(
                "schema = 1\n[region]\n{region}\n[lattice.a]\npart = \"upper\"\n[[lattice.a.cell.series.terms]]\nhkl = \
                 [1, 0, -2]\nphase = -0.25\n[lattice.a.map.spartan]\nwavelength = 4\n[lattice.a.level]\n{level}\n"
            );
            let d = Design::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            let again = Design::from_toml(&d.to_toml().expect("writable")).expect("readable");
            assert_eq!(again.to_json(), d.to_json(), "{text}");
        }
    }
}

#[test]
fn every_kind_of_map_survives() {
    for map in [
        "phase = { wavelength = 4, rotate = [0, { formula = \"x\" }, 3] }",
        "phase = { wavelength = [4, { formula = \"5 + x/9\" }, 3], rotate_x = 2, rotate_z = { formula = \"x\" }, step = 0.5 }",
        "phase = { wavelength = 4, direction = [0, { formula = \"x\" }, 3], weight = { formula = \"x*x\" }, domain = \"box\", folds = true }",
        "phase = { wavelength = 4, frame = { x = [1, 0, 0], z = { field = { path = \"a.vtu\", array = \"v\" } } } }",
        "phase = { wavelength = 4, stress = { field = { path = \"a.vtu\", array = \"S\" }, order = \"voigt\" }, offset = [1, 2, 3] }",
        "phase = { wavelength = 4, stress = [1, 2, 3, 0, 0, 0] }",
        "cylinder = { wavelength = [3, 4], around = 12, center = [1, 2, 3] }",
        "sphere = { wavelength = 3, around = 12, axis = [0, 1, 0] }",
        "phase = { wavelength = 4, angle_weight = 10 }",
        "sweep = { wavelength = [2, 2, 3], points = [[0, 0, 0], [1, 2, 3]], normal = [1, 0, 0] }",
        "sweep = { wavelength = 2, path = \"line.csv\", closed = true }",
    ] {
        let text = format!(
            "schema = 1\n[region.box]\nsize = [8, 8, 8]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\nmap = {{ {map} }}\n\
             level = {{ iso = 0.2 }}\n"
        );
        let d = Design::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let again = Design::from_toml(&d.to_toml().expect("writable")).expect("readable");
        assert_eq!(again.to_json(), d.to_json(), "{text}");
    }
}

#[test]
fn skins_and_keep_zones_survive() {
    for more in [
        "[skin]\nthickness = 1\n",
        "[skin]\nthickness = { formula = \"1 + 0.01*x\" }\nopen = [\"-z\", \"+x\", { point = [0, 0, 1], normal = [0, 0, 1] }]\n",
        "[keep.boss.cylinder]\nbase = [0, 0, 0]\nradius = 2\nheight = 3\n[keep.ring]\nunion = [{ sphere = { radius = 2 } }]\n",
    ] {
        let text = format!("{GOOD}{more}");
        let d = Design::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        let again = Design::from_toml(&d.to_toml().expect("writable")).expect("readable");
        assert_eq!(again.to_json(), d.to_json(), "{text}");
        let again = Design::from_json(&d.to_json().to_string()).expect("readable");
        assert_eq!(again.to_json(), d.to_json(), "{text}");
    }
    assert_eq!(Design::from_toml(GOOD).expect("good").to_json().get("keep"), None);
    for (more, path, word) in [
        ("[skin]\nthicknes = 1\n", "skin.thicknes", "thickness"),
        ("[skin]\nthickness = 1\nopen = [\"botom\"]\n", "skin.open[0]", "-z"),
        ("[keep.boss.cylindre]\nradius = 2\n", "keep.boss.cylindre", "cylinder"),
        ("[keeps.boss.sphere]\nradius = 2\n", "keeps", "keep"),
    ] {
        let e = refused(&format!("{GOOD}{more}"));
        assert_eq!((e.path.as_str(), e.nearest.as_deref()), (path, Some(word)), "{e}");
        assert!(e.line > Some(13), "{e}");
    }
    for (more, path, part) in [
        ("[skin]\nopen = []\n", "skin", "\"thickness\" is missing"),
        ("[keep.sphere]\nradius = 2\n", "keep.sphere", "a name comes first"),
        ("[keep.boss]\n", "keep.boss", "a region is missing"),
        ("[skin]\nthickness = 1\nopen = \"-z\"\n", "skin.open", "a list, each one of -x"),
        ("[keep.a.sphere]\nradius = 2\n[keep.a.sphere]\nradius = 3\n", "", "not readable as TOML"),
    ] {
        let e = refused(&format!("{GOOD}{more}"));
        assert!(e.path == path && e.message.contains(part), "{e}");
    }
}

#[test]
fn slips_are_reported_with_path_line_and_nearest_word() {
    for (line, instead, path, number, nearest) in [
        ("[region.box]", "[region.bxo]", "region.bxo", 3, "box"),
        ("size =", "siez =", "region.box.siez", 4, "size"),
        ("cell =", "cel =", "lattice.core.cel", 6, "cell"),
        ("\"gyroid\"", "\"gyriod\"", "lattice.core.cell", 6, "gyroid"),
        ("\"lower\"", "\"lowr\"", "lattice.core.part", 7, "lower"),
        ("wavelength =", "wavelenght =", "lattice.core.map.affine.wavelenght", 9, "wavelength"),
        ("map.affine", "map.afine", "lattice.core.map.afine", 8, "affine"),
        ("porosity =", "porosty =", "lattice.core.level.porosty", 13, "porosity"),
        ("linear =", "liner =", "lattice.core.level.porosity.liner", 13, "linear"),
        ("stops =", "stop =", "lattice.core.level.porosity.linear.stop", 13, "stops"),
        ("xz = 20", "xzz = 20", "lattice.core.map.affine.skew.xzz", 11, "xz"),
    ] {
        let e = with(line, instead);
        assert_eq!((e.path.as_str(), e.line, e.nearest.as_deref()), (path, Some(number), Some(nearest)), "{e}");
    }
}

#[test]
fn several_lattices_need_a_blend() {
    let two = GOOD.to_string()
        + "[lattice.shell]\ncell = \"gyroid\"\npart = \"sheet\"\nmap.affine.wavelength = 4\nlevel.iso = 0.3\n";
    let e = refused(&two);
    assert!(e.path == "lattice.shell" && e.message.contains("need a blend") && e.line == Some(14), "{e}");
}

#[test]
fn exactly_one_amount() {
    let e = refused(&(GOOD.to_string() + "fraction = 0.3\n"));
    assert!(e.message.contains("found fraction and porosity"), "{e}");
    assert_eq!((e.path.as_str(), e.line), ("lattice.core.level.porosity", Some(13)));
    let e = refused(GOOD.split("porosity").next().unwrap_or_default());
    assert_eq!(e.message, "give exactly one of thickness, pore, fraction, porosity, iso, stiffness, permeability");
    assert_eq!((e.path.as_str(), e.line), ("lattice.core.level", Some(12)));
}

#[test]
fn values_of_the_wrong_type_say_what_was_found() {
    for (line, instead, found) in [
        ("schema = 1", "schema = 2", "schema 1, found 2"),
        ("[8, 8.5, 9]", "8", "found 8"),
        ("[8, 8.5, 9]", "[8, 9]", "found 2 values"),
        ("[4, 4, 5]", "\"four\"", "found \"four\""),
        ("[4, 4, 5]", "{ linear = { along = [1,0,0], stops = [] } }", "use map.phase for a wavelength"),
        ("[0, 30, 0]", "[0, true, 0]", "found true"),
        ("units = \"mm\"", "units = \"inch\"", "lengths in a design are mm"),
        ("[[0, 0.5], [9, 0.8]]", "[[0, 0.5, 1]]", "found 3 values"),
    ] {
        let e = with(line, instead);
        assert!(e.message.contains(found), "{e}");
        assert!(e.line.is_some() && !e.path.is_empty(), "{e}");
    }
    let e = refused("schema = 1\nregion = = 2\n");
    assert_eq!(e.line, Some(2));
    assert!(refused("").message.contains("\"schema\" is missing"));
}

#[test]
fn broken_text_never_panics() {
    for cut in 0..GOOD.len() {
        let _ = Design::from_toml(&GOOD[..cut]);
        let _ = Design::from_json(&GOOD[..cut]);
    }
}

/// Every object of the schema has exactly the keys that the reader accepts: an unknown key's message lists them.
#[test]
fn the_schema_and_the_reader_agree() {
    let schema: serde_json::Value = serde_json::from_str(&schema()).expect("JSON");
    let defs = schema["$defs"].as_object().expect("definitions");
    let keys = |name: &str| -> Vec<String> {
        let properties = defs[name]["properties"].as_object();
        let mut keys: Vec<String> = properties.into_iter().flatten().map(|(k, _)| k.clone()).collect();
        keys.sort();
        keys
    };
    let listed = |e: DesignError| -> Vec<String> {
        let list = e.message.split("Allowed: ").nth(1).unwrap_or_else(|| panic!("{e}")).to_string();
        let mut words: Vec<String> = list.split(", ").map(str::to_string).collect();
        words.sort();
        words
    };
    let region = |kind: &str| refused(&format!("schema = 1\n[region.{kind}]\nzzzzzzzz = 1\n"));
    for (kind, name) in [
        ("cylinder", "Cylinder"),
        ("sphere", "Sphere"),
        ("halfspace", "HalfSpace"),
        ("tetrahedron", "Tetrahedron"),
        ("mesh", "Mesh"),
        ("offset", "Offset"),
    ] {
        assert_eq!(listed(region(kind)), keys(name), "{kind}");
    }
    assert_eq!(listed(region("box")), keys("Box"));
    assert_eq!(listed(refused("schema = 1\n[region]\nzzzzzzzz = 1\n")), keys("Region"));
    assert_eq!(listed(with("cell =", "zzzzzzzz =")), keys("Lattice"));
    assert_eq!(listed(with("units = \"mm\"", "skin = { zzzzzzzz = 1 }")), keys("Skin"));
    assert_eq!(listed(with("wavelength =", "zzzzzzzz =")), keys("Affine"));
    assert_eq!(listed(with("xz =", "zzzzzzzz =")), keys("Skew"));
    assert_eq!(listed(with("porosity =", "zzzzzzzz =")), keys("Level"));
    assert_eq!(listed(with("map.affine", "map.zzzzzzzz")), keys("Map"));
    assert_eq!(listed(with("linear =", "zzzzzzzz =")), keys("Grade"));
    for (kind, name) in [("phase", "Phase"), ("cylinder", "CylinderMap"), ("sphere", "SphereMap")] {
        // The first key that an affine map alone has is unknown.
        let words = listed(with("map.affine", &format!("map.{kind}")));
        assert_eq!(words, keys(name), "{kind}");
    }
    assert_eq!(listed(with("along =", "zzzzzzzz =")), keys("Linear"));
}

/// The committed schema is the generated one. To renew it: `TRABECULA_RENEW=1 cargo test -p trabecula schema`.
#[test]
fn the_committed_schema_is_current() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../schema/design.json");
    let text = schema();
    if std::env::var_os("TRABECULA_RENEW").is_some() {
        std::fs::write(path, &text).expect("schema/ exists");
    }
    let old = std::fs::read_to_string(path).unwrap_or_default();
    assert!(old == text, "schema/design.json is stale; renew it with TRABECULA_RENEW=1 cargo test -p trabecula schema");
}

/// Primitive cells, upper part, and a second lattice that takes over along x.
fn blended(second: &str, weight: &str, by: &str) -> Built {
    let text = format!(
        r#"schema = 1
[region.box]
size = [24, 8, 8]
[lattice.a]
cell = "primitive"
part = "upper"
level.fraction = 0.3
map.affine.wavelength = 4
[lattice.b]
{second}
[blend]
between = ["a", "b"]
weight = {weight}
by = "{by}"
"#
    );
    let design = Design::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    design.build(&NoFiles).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn said<'a>(built: &'a Built, what: &str) -> Vec<&'a str> {
    built.warnings.iter().map(|w| w.message.as_str()).filter(|m| m.contains(what)).collect()
}

const RAMP: &str = "{ linear = { along = [1, 0, 0], stops = [[-8, 0], [8, 1]] } }";

/// The primitive function changes its sign half a diagonal away, and its two parts are each other's images: half-way between
/// them nothing is left, and no solid leads across. So it is between both parts of one cell.
#[test]
fn lattices_that_cancel_are_warned_of_with_the_place() {
    let opposite = "cell = \"primitive\"\npart = \"upper\"\nlevel.fraction = 0.3\nmap.affine = { wavelength = 4, offset = [2, 2, 2] }";
    let lower = "cell = \"primitive\"\npart = \"lower\"\nlevel.fraction = 0.3\nmap.affine.wavelength = 4";
    for (second, by) in [(opposite, "fraction"), (lower, "fraction"), (opposite, "value")] {
        let built = blended(second, RAMP, by);
        let warned = said(&built, "cancel");
        assert!(warned.len() == 1 && warned[0].contains("shares are 0.50 and 0.50"), "{by}: {warned:?}");
        assert!(warned[0].contains(" at (0, "), "{}", warned[0]);
        let [one] = &built.transitions()[..] else { panic!("one transition") };
        assert!(one.neck.is_none() && one.gap.is_some_and(|p| p[0].abs() < 4.0), "{by}: {:?}", one.gap);
        // The offset that the warning names is the cure.
        let start = warned[0].find("`offset = ").expect("an offset") + 1;
        let offset = warned[0][start..].split('`').next().expect("an end");
        let lattice = second.split("\nmap").next().expect("a lattice");
        let mended = blended(&format!("{lattice}\nmap.affine = {{ wavelength = 4, {offset} }}"), RAMP, by);
        assert!(said(&mended, "cancel").is_empty(), "{offset}: {:?}", mended.warnings);
        let [one] = &mended.transitions()[..] else { panic!("one transition") };
        assert!(one.neck.is_some() && one.gap.is_none(), "{offset}");
    }
}

#[test]
fn lattices_that_grow_into_each_other_are_not_told() {
    let same = "cell = \"primitive\"\npart = \"upper\"\nlevel.fraction = 0.3\nmap.affine.wavelength = 4";
    let gyroid = "cell = \"gyroid\"\npart = \"upper\"\nlevel.fraction = 0.3\nmap.affine.wavelength = 4";
    let sheet = "cell = \"gyroid\"\npart = \"sheet\"\nlevel.fraction = 0.3\nmap.affine.wavelength = 5";
    for second in [same, gyroid, sheet] {
        let built = blended(second, RAMP, "fraction");
        assert!(said(&built, "cancel").is_empty(), "{:?}", built.warnings);
        let [one] = &built.transitions()[..] else { panic!("one transition") };
        assert!(one.neck.is_some() && one.gap.is_none());
    }
    // Where neither is alone and the shares are the same everywhere there is nothing to cross.
    let [one] = &blended(gyroid, "0.5", "fraction").transitions()[..] else { panic!("one transition") };
    assert!(one.gap.is_none());
}

/// A rod in short pieces has the spacing of a rod: the pieces are no cells.
#[test]
fn struts_in_short_pieces_are_resolved_by_their_thickness() {
    let spacing = |pieces: u32| {
        let nodes: Vec<String> =
            (0..=pieces).map(|i| format!("[{}, 0, 0]", 10.0 * f64::from(i) / f64::from(pieces) - 5.0)).collect();
        let struts: Vec<String> = (0..pieces).map(|i| format!("[{i}, {}]", i + 1)).collect();
        let text = format!(
            "schema = 1\nregion.box.size = [14, 8, 8]\n[beams.rod]\nnodes = [{}]\nstruts = [{}]\nradius = 0.6\n",
            nodes.join(", "),
            struts.join(", ")
        );
        let design = Design::from_toml(&text).unwrap_or_else(|e| panic!("{e}\n{text}"));
        design.build(&NoFiles).unwrap_or_else(|e| panic!("{e}\n{text}")).report().spacing
    };
    for (pieces, wanted) in [(2, 0.2), (5, 0.2), (20, 0.2), (40, 0.125)] {
        assert!((spacing(pieces) - wanted).abs() < 1e-9, "{pieces}: {}", spacing(pieces));
    }
}
