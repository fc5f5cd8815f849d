//! Grades and orientations from files, through designs: what they give, and how they are refused.

use std::collections::HashMap;

use geometry::math::Vec3;
use trabecula::design::{Built, Design, DesignError, Loader};
use trabecula::field::Field;

struct Files(HashMap<String, Vec<u8>>);

impl Loader for Files {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        self.0.get(path).cloned().ok_or_else(|| format!("there is no file {path}"))
    }
}

fn npy(shape: [usize; 3], value: impl Fn([usize; 3]) -> f64) -> Vec<u8> {
    let [x, y, z] = shape;
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({x}, {y}, {z}), }}\n");
    out.extend((head.len() as u16).to_le_bytes());
    out.extend(head.as_bytes());
    for i in 0..x {
        for j in 0..y {
            out.extend((0..z).flat_map(|k| value([i, j, k]).to_le_bytes()));
        }
    }
    out
}

/// A box of hexahedra with arrays of points: `rho` a number, `S` a tensor, `v` a vector; and of cells: `c`.
fn vtu(size: Vec3, n: usize, rho: impl Fn(Vec3) -> f64, tensor: impl Fn(Vec3) -> [f64; 6]) -> Vec<u8> {
    let m = n + 1;
    let points: Vec<Vec3> = (0..m * m * m)
        .map(|i| [i % m, i / m % m, i / m / m])
        .map(|at| core::array::from_fn(|a| size[a] * at[a] as f64 / n as f64))
        .collect();
    let mut cells = String::new();
    for c in 0..n * n * n {
        let base = c % n + c / n % n * m + c / n / n * m * m;
        for d in [0, 1, 1 + m, m, m * m, m * m + 1, m * m + m + 1, m * m + m] {
            cells += &format!("{} ", base + d);
        }
    }
    let join = |v: Vec<f64>| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let count = n * n * n;
    format!(
        r#"<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="{}" NumberOfCells="{count}">
<PointData><DataArray type="Float64" Name="rho" format="ascii">{}</DataArray>
<DataArray type="Float64" Name="S" NumberOfComponents="6" format="ascii">{}</DataArray>
<DataArray type="Float64" Name="v" NumberOfComponents="3" format="ascii">{}</DataArray></PointData>
<CellData><DataArray type="Float64" Name="c" format="ascii">{}</DataArray></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{}</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">{cells}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{}</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{}</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>"#,
        points.len(),
        join(points.iter().map(|p| rho(*p)).collect()),
        join(points.iter().flat_map(|p| tensor(*p)).collect()),
        join(points.iter().flat_map(|_| [0.6, 0.0, 0.8]).collect()),
        join((0..count).map(|c| 0.2 + 0.001 * c as f64).collect()),
        join(points.iter().flatten().copied().collect()),
        join((1..=count).map(|c| 8.0 * c as f64).collect()),
        join(vec![12.0; count]),
    )
    .into_bytes()
}

fn files() -> Files {
    let mut all = HashMap::new();
    let mut put = |name: &str, bytes: Vec<u8>| all.insert(name.to_string(), bytes);
    put("good.npy", npy([9, 9, 9], |[i, j, k]| 0.2 + 0.03 * i as f64 + 0.01 * j as f64 - 0.005 * k as f64));
    put("nan.npy", npy([9, 9, 9], |at| if at == [3, 2, 1] { f64::NAN } else { 0.3 }));
    put("flat.npy", b"\x93NUMPY\x01\x00\x39\x00{'descr': '<f8', 'fortran_order': False, 'shape': (0,), }\n".to_vec());
    put("high.npy", npy([41; 3], |at| if at == [7, 31, 12] { 1.3 } else { 0.3 }));
    put("low.npy", npy([41; 3], |at| if at == [7, 31, 12] { -0.5 } else { 0.3 }));
    put("peak.npy", npy([41; 3], |at| if at == [7, 31, 12] { 0.8 } else { 0.3 }));
    // What lies beyond the region by more than a step does not count.
    put("beyond.npy", npy([51; 3], |at| if at[2] > 44 { 9.0 } else { 0.3 + 0.01 * at[0] as f64 }));
    put("good.csv", b"x,y,z,value\n0,0,0,0.2\n8,0,0,0.3\n0,8,0,0.4\n8,8,8,0.5\n".to_vec());
    put("metres.csv", b"x,y,z,value\n0,0,0,0.2\n0.008,0,0,0.3\n0,0.008,0,0.4\n0.008,0.008,0.008,0.5\n".to_vec());
    put("inches.csv", b"0,0,0,0.2\n0.3,0,0,0.3\n0,0.3,0,0.4\n0.3,0.3,0.3,0.5\n".to_vec());
    put("close.csv", b"3,3,3,0.2\n3.1,3,3,0.3\n3,3.1,3,0.4\n3.1,3.1,3.1,0.5\n".to_vec());
    put("bad.csv", b"0 0 0 0.2\n1 2 three 0.3\n".to_vec());
    let rho = |p: Vec3| 0.2 + 0.02 * p[0] + 0.01 * p[1];
    // Principal directions turn about z by 5 degrees for each mm along x; the greatest and the least stress change places.
    let tensor = |p: Vec3| {
        let (s, c) = (5.0 * p[0]).to_radians().sin_cos();
        let (a, b) = (10.0 - 2.6 * p[1], 1.0);
        [a * c * c + b * s * s, a * s * s + b * c * c, -6.0, (a - b) * s * c, 0.0, 0.0]
    };
    put("result.vtu", vtu([8.0; 3], 8, rho, tensor));
    put("short.vtu", vtu([6.0, 8.0, 8.0], 8, rho, tensor));
    put("nan.vtu", vtu([8.0; 3], 4, |_| f64::NAN, tensor));
    put("broken.vtu", b"<VTKFile type=\"PolyData\"></VTKFile>".to_vec());
    Files(all)
}

fn design(level: &str, map: &str) -> Result<Built, DesignError> {
    let text = format!(
        "schema = 1\n[region.box]\nmin = [0, 0, 0]\nmax = [8, 8, 8]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\n\
         map = {{ {map} }}\nlevel = {{ {level} }}\n"
    );
    Design::from_toml(&text)?.build(&files())
}

const PLAIN: &str = "affine = { wavelength = 4 }";

fn refused(level: &str, map: &str) -> DesignError {
    match design(level, map) {
        Err(e) => e,
        Ok(_) => panic!("{level} {map} was accepted"),
    }
}

fn places() -> impl Iterator<Item = Vec3> {
    (1..200).map(|i| [0.8191725, 0.6710436, 0.5497005].map(|s| 8.0 * (s * f64::from(i)).fract()))
}

/// The fraction at points, and what it should be.
fn agrees(level: &str, within: f64, want: impl Fn(Vec3) -> f64) {
    let built = design(level, PLAIN).unwrap_or_else(|e| panic!("{level}: {e}"));
    let points: Vec<Vec3> = places().collect();
    let mut found = vec![0.0; points.len()];
    built.lattices[0].1.fractions(&points, &mut found);
    for (p, v) in points.iter().zip(found) {
        assert!((v - want(*p)).abs() < within, "{level}: {v} for {} at {p:?}", want(*p));
    }
}

#[test]
fn numbers_from_files_are_where_they_belong() {
    let straight = |p: Vec3| 0.2 + 0.03 * p[0] + 0.01 * p[1] - 0.005 * p[2];
    let grid = "grid = { path = \"good.npy\", origin = [0, 0, 0], step = 1 }";
    agrees(&format!("fraction = {{ {grid} }}"), 1e-12, straight);
    agrees(&format!("porosity = {{ {grid} }}"), 1e-12, |p| 1.0 - straight(p));
    let remap =
        "fraction = { grid = { path = \"good.npy\", origin = [0, 0, 0], step = 1, remap = [[0, 0.1], [1, 0.6]] } }";
    agrees(remap, 1e-12, |p| 0.1 + 0.5 * straight(p));
    agrees("fraction = { radial = { center = [1, 2, 3], stops = [[0, 0.2], [20, 0.6]] } }", 1e-12, |[x, y, z]| {
        0.2 + 0.02 * ((x - 1.0).powi(2) + (y - 2.0).powi(2) + (z - 3.0).powi(2)).sqrt()
    });
    agrees("fraction = { radial = { axis = [0, 0, 2], stops = [[0, 0.2], [20, 0.6]] } }", 1e-12, |[x, y, _]| {
        0.2 + 0.02 * x.hypot(y)
    });
    agrees("fraction = { field = { path = \"result.vtu\", array = \"rho\" } }", 1e-9, |p| {
        0.2 + 0.02 * p[0] + 0.01 * p[1]
    });
    // Cells' values at their corners and between: half a step off at the faces.
    agrees(
        "fraction = { field = { path = \"result.vtu\", array = \"c\", remap = [[0.2, 0.3], [0.8, 0.6]] } }",
        0.08,
        |p| 0.3 + 0.5 * 0.001 * (p[0] - 0.5 + 8.0 * (p[1] - 0.5) + 64.0 * (p[2] - 0.5)),
    );
    let built = design("fraction = { points = { path = \"good.csv\" } }", PLAIN).expect("built");
    let mut v = [0.0; 2];
    built.lattices[0].1.fractions(&[[0.0; 3], [8.0; 3]], &mut v);
    assert!((v[0] - 0.2).abs() < 1e-9 && (v[1] - 0.5).abs() < 1e-9);
}

/// The lattice follows the principal directions of a stress whose axes turn, also where they change places.
#[test]
fn principal_directions_are_followed() {
    let map = "phase = { wavelength = 2, stress = { field = { path = \"result.vtu\", array = \"S\" } } }";
    let built = design("fraction = 0.3", map).unwrap_or_else(|e| panic!("{e}"));
    let report = serde_json::to_value(built.report()).expect("plain data");
    let d = &report["lattices"]["a"]["distortion"];
    assert!(d["turn"].as_f64().expect("turn") < 30.0 && d["outside"] == 0.0, "{d}");
    let turned = "phase = { wavelength = 2, rotate_z = { formula = \"5*x\" } }";
    let same = design("fraction = 0.3", turned).expect("built");
    // The same gratings up to names and signs, which leave |det J| alone.
    let (a, b) = (&built.lattices[0].1.map, &same.lattices[0].1.map);
    // Where the principal values cross there is no direction to follow, and beside it that of a tensor interpolated between
    // nodes is rough.
    for p in places().filter(|p| (p[1] - 9.0 / 2.6).abs() > 1.5) {
        let det = |m: &trabecula::map::Map| geometry::math::determinant(&m.jacobian(p));
        assert!((det(a) / det(b) - 1.0).abs() < 0.05, "{} {}", det(a), det(b));
    }
    let map = "phase = { wavelength = 2, direction = { field = { path = \"result.vtu\", array = \"v\" } } }";
    let built = design("fraction = 0.3", map).unwrap_or_else(|e| panic!("{e}"));
    let j = built.lattices[0].1.map.jacobian([4.0; 3]);
    assert!((j[2][0] - 0.3).abs() < 1e-9 && (j[2][2] - 0.4).abs() < 1e-9, "{j:?}");
    assert!(built.solid.value([4.0; 3]).is_finite());
}

/// The range of a fraction that is reported.
fn reported(level: &str) -> serde_json::Value {
    let built = design(level, PLAIN).unwrap_or_else(|e| panic!("{level}: {e}"));
    serde_json::to_value(built.report()).expect("plain data")["lattices"]["a"]["fraction"].clone()
}

/// One node of a fine grid, which no sample meets, counts in what is checked and in what is reported.
#[test]
fn single_nodes_of_a_grid_are_checked_and_reported() {
    let grid = |file: &str| format!("grid = {{ path = \"{file}\", origin = [0, 0, 0], step = 0.2 }}");
    for (file, value) in [("high.npy", "1.3"), ("low.npy", "-0.5")] {
        let e = refused(&format!("fraction = {{ {} }}", grid(file)), PLAIN);
        assert_eq!(e.path, "lattice.a.level.fraction.grid", "{e}");
        assert!(e.message.contains(value) && e.message.contains("(1.4, 6.2, 2.4)"), "{e}");
    }
    for (key, file, least, most) in
        [("fraction", "peak.npy", 0.3, 0.8), ("porosity", "peak.npy", 0.2, 0.7), ("fraction", "beyond.npy", 0.3, 0.7)]
    {
        let found = reported(&format!("{key} = {{ {} }}", grid(file)));
        let ends = [0, 1].map(|i| found[i].as_f64().expect("a number"));
        assert!((ends[0] - least).abs() < 1e-9 && (ends[1] - most).abs() < 1e-9, "{key} {file}: {found}");
    }
}

/// Depth in boxes that touch falls to 0 at their joint, which is warned of; in those that overlap, and in one, it is not.
#[test]
fn depth_at_joints_of_boxes_is_warned_of() {
    let joint = |from: &str| {
        let text = format!(
            "schema = 1\n[region]\nunion = [{{ box = {{ min = [0, 0, 0], max = [10, 10, 10] }} }}, {{ box = {{ min = [{from}, 0, 0], max = \
             [20, 10, 10] }} }}]\n[lattice.a]\ncell = \"gyroid\"\npart = \"sheet\"\nmap = {{ affine = {{ wavelength = 4 }} }}\n\
             level = {{ fraction = {{ depth = {{ stops = [[0, 0.5], [2, 0.2]] }} }} }}\n"
        );
        let built = Design::from_toml(&text).and_then(|d| d.build(&files())).unwrap_or_else(|e| panic!("{e}"));
        built.warnings.into_iter().find(|w| w.path == "lattice.a.level.fraction.depth").map(|w| w.message)
    };
    let touching = joint("10").expect("a warning");
    assert!(touching.contains("(10, ") && touching.contains("overlap by 4 mm"), "{touching}");
    assert_eq!(joint("6"), None);
    assert_eq!(joint("0"), None);
}

/// Points in another unit lie close together in the region; the unit in which they would cover it is named.
#[test]
fn points_in_another_unit_are_doubted() {
    let warned = |file: &str| {
        let built = design(&format!("fraction = {{ points = {{ path = \"{file}\" }} }}"), PLAIN).expect("built");
        let of = built.warnings.into_iter().filter(|w| w.path == "lattice.a.level.fraction.points.path");
        of.map(|w| w.message).collect::<Vec<_>>()
    };
    assert!(warned("good.csv").is_empty());
    for (file, guess) in [("metres.csv", "in metres"), ("inches.csv", "in inches"), ("close.csv", "are they in mm?")] {
        let found = warned(file);
        assert!(found.len() == 1 && found[0].contains(guess), "{file}: {found:?}");
    }
}

#[test]
fn bad_files_are_refused_with_what_is_wrong() {
    let says = |level: &str, map: &str, path: &str, words: &[&str]| {
        let e = refused(level, map);
        assert_eq!(e.path, format!("lattice.a.{path}"), "{e}");
        for w in words {
            assert!(e.message.contains(w), "{w}: {e}");
        }
    };
    let grid = |file: &str, rest: &str| format!("fraction = {{ grid = {{ path = \"{file}\"{rest} }} }}");
    let placed = ", origin = [0, 0, 0], step = 1";
    let at = "level.fraction.grid.path";
    says(&grid("nan.npy", placed), PLAIN, at, &["nan.npy", "1 of 729 numbers is not finite", "(3, 2, 1)"]);
    says(&grid("gone.npy", placed), PLAIN, at, &["there is no file"]);
    says(&grid("flat.npy", placed), PLAIN, at, &["shape [0]", "three dimensions"]);
    says(&grid("good.csv", placed), PLAIN, at, &["must end in npy"]);
    says(&grid("good.npy", ", origin = [0, 0, 0]"), PLAIN, "level.fraction.grid.step", &["step"]);
    says(&grid("good.npy", ", origin = [0, 0, 0], step = 0.8"), PLAIN, at, &["does not cover", "% of the region"]);
    says(
        &grid("good.npy", ", origin = [0, 0, 0], step = 1, remap = [[0, 0.1], [1, 7]]"),
        PLAIN,
        "level.fraction.grid",
        &["less than 1"],
    );
    says("fraction = { points = { path = \"bad.csv\" } }", PLAIN, "level.fraction.points.path", &["line 2", "three"]);
    let field =
        |file: &str, array: &str| format!("fraction = {{ field = {{ path = \"{file}\", array = \"{array}\" }} }}");
    says(
        &field("result.vtu", "mises"),
        PLAIN,
        "level.fraction.field.array",
        &["no array \"mises\"", "\"rho\" (1 number each, of points)", "\"S\" (6 numbers each", "\"c\""],
    );
    says(&field("result.vtu", "S"), PLAIN, "level.fraction.field.component", &["6 components"]);
    says(
        &field("short.vtu", "rho"),
        PLAIN,
        "level.fraction.field.path",
        &["does not cover", "% of the region", "[6.0, 8.0, 8.0]"],
    );
    says(
        &field("nan.vtu", "rho"),
        PLAIN,
        "level.fraction.field.array",
        &["125 of 125 numbers", "not finite", "fill them before use"],
    );
    says(&field("broken.vtu", "rho"), PLAIN, "level.fraction.field.path", &["PolyData"]);
    let stress = |array: &str| {
        format!("phase = {{ wavelength = 2, stress = {{ field = {{ path = \"result.vtu\", array = \"{array}\" }} }} }}")
    };
    says("fraction = 0.3", &stress("sigma"), "map.phase.stress.field.array", &["no array \"sigma\"", "\"S\""]);
    says("fraction = 0.3", &stress("v"), "map.phase.stress.field.array", &["3 components", "six or nine"]);
    says(
        "fraction = 0.3",
        "phase = { wavelength = 2, rotate_z = 3, direction = [0, 0, 1] }",
        "map.phase.rotate_z",
        &["found direction and rotate_z"],
    );
    says(
        "fraction = 0.3",
        "phase = { wavelength = 2, rotate = [1, 2] }",
        "map.phase.rotate",
        &["a list of three", "found 2 values"],
    );
    says(
        "fraction = 0.3",
        "phase = { wavelength = { formula = \"4 - x\" } }",
        "map.phase.wavelength.formula",
        &["(8,"],
    );
    says(
        "fraction = 0.3",
        "phase = { wavelength = { formula = \"open(x)\" } }",
        "map.phase.wavelength.formula",
        &["open"],
    );
    says(
        "fraction = 0.3",
        "phase = { wavelength = 2, rotate_z = { formula = \"170*tanh(x-4)\" } }",
        "map.phase",
        &["folds at"],
    );
    let warned =
        design("fraction = 0.3", "phase = { wavelength = 4, rotate_z = { formula = \"17*x\" } }").expect("built");
    assert!(warned.warnings.iter().any(|w| w.path == "lattice.a.map.phase" && w.message.contains("degrees a cell")));
}

/// A gyroid given as numbers is the gyroid; a rod given as a mesh fills as much of the cell as it did.
#[test]
fn cells_come_from_files() {
    use std::f64::consts::TAU;
    let gyroid = npy([16; 3], |at| {
        let [x, y, z] = at.map(|i| TAU * i as f64 / 16.0);
        x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()
    });
    let lattice = |cell: &str, level: &str| {
        let text = format!(
            "schema = 1\n[region.box]\nmin = [0, 0, 0]\nmax = [8, 8, 8]\n[lattice.a]\ncell = {cell}\npart = \"upper\"\n\
             map = {{ {PLAIN} }}\nlevel = {{ {level} }}\n"
        );
        let mut files = files();
        files.0.insert("gyroid.npy".into(), gyroid.clone());
        Design::from_toml(&text)?.build(&files)
    };
    let file = lattice("{ file = { path = \"gyroid.npy\" } }", "iso = 0.3").unwrap_or_else(|e| panic!("{e}"));
    let named = lattice("\"gyroid\"", "iso = 0.3").expect("named");
    for p in places() {
        assert!((file.lattices[0].1.value(p) - named.lattices[0].1.value(p)).abs() < 1e-9);
    }
    assert!(file.report().lattices["a"].truncation.expect("reported") < 1e-6);
    let e = lattice("{ file = { path = \"nan.npy\" } }", "iso = 0.3").err().expect("refused");
    assert!(e.path == "lattice.a.cell.file.path" && e.message.contains("[3, 2, 1]"), "{e}");
    let e = lattice("{ file = { path = \"gyroid.npy\", terms = 0 } }", "iso = 0.3").err().expect("refused");
    assert_eq!(e.path, "lattice.a.cell.file.terms");
}
