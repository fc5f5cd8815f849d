//! The rows of `corpus/`: every design built, meshed and measured, and every named cell against its numbers.

mod kinds;

use std::path::{Path, PathBuf};

use geometry::math::{cross, norm, sub};
use geometry::measure::size;
use geometry::mesh::Mesh;
use geometry::progress::Silent;
use rayon::prelude::*;
use toml::{Table, Value};
use trabecula::cell::{Cell, Part, Series, catalogue};
use trabecula::design::{CadMesh, Design, FaceLabel, Loader, Tessellation};
use trabecula::surface_maker::{Islands, SurfaceOptions};

/// Samples per smallest wavelength, where a row does not name another number.
const PER_CELL: f64 = 32.0;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../corpus")
}

fn table(name: &str) -> Table {
    let text = std::fs::read_to_string(corpus().join(name)).expect("a file of the corpus");
    text.parse().expect("TOML")
}

/// Files relative to a folder.
struct Folder(PathBuf);

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.0.join(path)).map_err(|e| format!("{path}: {e}"))
    }

    /// The triangles that scripts/step_parts.py has put next to the file.
    fn cad(&self, path: &str, how: &Tessellation) -> Result<CadMesh, String> {
        let text = self.load(&path.replace(".step", ".json"))?;
        let Triangles { points, triangles, faces, labels, volume } =
            serde_json::from_slice(&text).map_err(|e| e.to_string())?;
        Ok(CadMesh {
            file: path.into(),
            mesh: Mesh { vertices: points, triangles },
            face: faces,
            labels: labels.into_iter().map(|[name, color]| FaceLabel { name, color }).collect(),
            chord: how.chord.ok_or("no chord error")?,
            angle: how.angle.ok_or("no angle")?,
            volume: Some(volume),
        })
    }
}

#[derive(serde::Deserialize)]
struct Triangles {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    faces: Vec<u32>,
    labels: Vec<[String; 2]>,
    volume: f64,
}

fn number(value: &Value) -> f64 {
    value.as_float().or_else(|| value.as_integer().map(|i| i as f64)).expect("a number")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(number).collect()
}

/// Pairs of numbers, or none where the row has no such key.
fn pairs(row: &Table, key: &str) -> Vec<[f64; 2]> {
    let rows = row.get(key).and_then(Value::as_array).cloned().unwrap_or_default();
    rows.iter().map(|r| numbers(r).try_into().expect("a pair")).collect()
}

/// What differs from a row of `solids.toml`, in words.
fn differences(name: &str, row: &Table) -> Result<Vec<String>, String> {
    let text = std::fs::read_to_string(corpus().join(format!("designs/{name}.toml"))).map_err(|e| e.to_string())?;
    let design = Design::from_toml(&text).map_err(|e| e.to_string())?;
    let built = design.build(&Folder(corpus().join("designs"))).map_err(|e| e.to_string())?;
    let edge = built.solid.wavelength / row.get("per_cell").map_or(PER_CELL, number);
    let made = built
        .surface()
        .mesh(&SurfaceOptions { islands: Islands::Keep, ..SurfaceOptions::new(edge) }, &Silent)
        .map_err(|e| format!("{e:?}"))?;
    let found = made.surface;
    let all = size(&found.mesh);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| found.mesh.vertices[v as usize]);
        norm(cross(sub(b, a), sub(c, a))) / 2.0
    };
    let cut: f64 = found.mesh.triangles.iter().zip(&found.cut).filter(|(_, cut)| **cut).map(|(t, _)| area(t)).sum();
    let mut out = Vec::new();
    if !all.closed {
        out.push("not closed".to_string());
    }
    for (key, expected) in row.iter().filter(|(key, _)| !["why", "per_cell"].contains(&key.as_str())) {
        let value = match key.as_str() {
            "volume" => all.volume,
            "area" => all.area,
            "area_lattice" => all.area - cut,
            "area_cut" => cut,
            "euler" => all.euler as f64,
            "pieces" => all.pieces as f64,
            "cavities" => all.cavities as f64,
            _ => return Err(format!("unknown key {key}")),
        };
        let (want, tolerance) = match expected {
            Value::Array(_) => {
                let [want, tolerance] = numbers(expected)[..] else { return Err(format!("{key} is no pair")) };
                (want, tolerance * want.abs().max(1.0))
            }
            whole => (number(whole), 0.0),
        };
        if (value - want).abs() > tolerance {
            out.push(format!("{key} is {value}, expected {want} within {tolerance:.2e}"));
        }
    }
    Ok(out)
}

#[test]
fn solids() {
    let rows: Vec<(String, Value)> = table("solids.toml").into_iter().collect();
    let wrong: Vec<String> = rows
        .par_iter()
        .flat_map_iter(|(name, row)| {
            let found = differences(name, row.as_table().expect("a row")).unwrap_or_else(|e| vec![e]);
            found.into_iter().map(move |what| format!("{name}: {what}"))
        })
        .collect();
    assert!(rows.len() > 50 && wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The largest |fraction at our level − fraction asked for|, by the distribution itself.
fn misses(cell: &Cell, part: Part, rows: &[[f64; 2]]) -> f64 {
    // Between the reference's level and ours lies the error of the fraction there.
    let shares = rows.iter().flat_map(|[asked, t]| {
        let share = |t: f64| cell.fraction(part, t);
        [share(*t) - asked, share(cell.iso(part, *asked).0) - asked]
    });
    shares.map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn cells() {
    let all = table("cells.toml");
    let tolerance = |key: &str| number(&all["tolerance"][key]);
    let rows = all["cells"].as_table().expect("a table");
    assert_eq!(rows.len(), catalogue().len());
    catalogue().par_iter().for_each(|known| {
        let cell = Cell::new(Series::new(known.terms()).expect(known.name));
        let row = rows[known.name].as_table().expect("a row");
        let range = numbers(&row["range"]);
        let ends = [cell.range().lo - range[0], cell.range().hi - range[1]];
        assert!(ends.iter().all(|e| e.abs() < tolerance("range")), "{} {ends:?}", known.name);
        let lower: Vec<[f64; 2]> = pairs(row, "lower_at").iter().map(|[t, v]| [*v, *t]).collect();
        let upper: Vec<[f64; 2]> = lower.iter().map(|[v, t]| [1.0 - v, *t]).collect();
        for (part, rows) in [
            (Part::Lower, lower),
            (Part::Upper, upper),
            (Part::Lower, pairs(row, "iso_lower")),
            (Part::Upper, pairs(row, "iso_upper")),
            (Part::Sheet, pairs(row, "iso_sheet")),
        ] {
            let worst = misses(&cell, part, &rows);
            assert!(worst < tolerance("fraction"), "{} {part:?} {worst:.2e}", known.name);
        }
    });
}
