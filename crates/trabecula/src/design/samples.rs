//! Numbers in files: cells, points, and what is common to all; grids and results on meshes have files of their own.

mod field;
mod grid;

use super::Loader;
use super::data::*;
use super::place::Place;
use crate::cell::{Cell, Series};
use crate::field::Field;
use crate::grade::Samples;
use crate::kind::DesignError;
use crate::region::{MeshRegion, Shape as _};
pub(super) use field::{field, several};
use geometry::fault::{Fault, counted};
use geometry::formats;
use geometry::math::Vec3;
use geometry::repair::Repair;
pub(super) use grid::grid;

pub(super) fn bytes(path: &str, at: &str, place: &Place) -> Result<Vec<u8>, DesignError> {
    place.loader.load(path).map_err(|m| DesignError::new(at, m).found(path))
}

/// Nodes along an axis of the grid on which a mesh of one cell is sampled.
const CELL: usize = 64;

/// A cell from numbers or a mesh.
pub(super) fn cell(spec: &FileCellSpec, path: &str, loader: &dyn Loader) -> Result<Cell, DesignError> {
    let at = format!("{path}.path");
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let file = loader.load(&spec.path).map_err(|m| DesignError::new(&at, m).found(&spec.path))?;
    let kind = extension(&spec.path);
    let (shape, values) = if kind == "npy" {
        let (shape, values) = formats::read_npy(&file).map_err(wrong)?;
        let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
            let message = format!("the array has shape {shape:?}; a cell has three dimensions [x, y, z]");
            wrong(Fault::new("", message))
        })?;
        (shape, values)
    } else if formats::Format::of(&kind).is_some() {
        let mesh = formats::read_mesh(&file, &kind).map_err(wrong)?.mesh;
        let solid = MeshRegion::new(mesh, Repair::Auto).map_err(wrong)?;
        let (b, size) = (solid.bounds(), solid.bounds().size());
        let points: Vec<Vec3> = (0..CELL.pow(3))
            .map(|n| [n % CELL, n / CELL % CELL, n / CELL / CELL])
            .map(|i| core::array::from_fn(|a| b.min[a] + size[a] * (i[a] as f64 + 0.5) / CELL as f64))
            .collect();
        let mut values = vec![0.0; points.len()];
        solid.values(&points, &mut values);
        let inside = |v: &f64| if *v < 0.0 { 1.0 } else { 0.0 };
        ([CELL; 3], values.iter().map(inside).collect())
    } else {
        let known = formats::Format::listed();
        let message = format!("the name must end in npy, {known}; found \"{}\"", spec.path);
        return Err(DesignError::new(at, message).found(&spec.path));
    };
    let (series, share) = Series::sampled(&values, shape, spec.terms as usize).map_err(wrong)?;
    Ok(Cell::new(series).truncated(share))
}

fn extension(path: &str) -> String {
    path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase()
}

/// The array of this name, or the only one.
fn pick<'a>(arrays: &'a [formats::Array], name: Option<&str>) -> Result<&'a formats::Array, String> {
    let listed = || {
        let names: Vec<String> = arrays
            .iter()
            .map(|a| {
                format!(
                    "\"{}\" ({} each, of {})",
                    a.name,
                    counted(a.components, "number"),
                    if a.of_cells { "cells" } else { "points" }
                )
            })
            .collect();
        if names.is_empty() { "it has none".to_string() } else { format!("it has {}", names.join(", ")) }
    };
    match name {
        Some(name) => arrays
            .iter()
            .find(|a| a.name == name)
            .ok_or_else(|| format!("the file has no array \"{name}\"; {}", listed())),
        None => match arrays {
            [one] => Ok(one),
            _ => Err(format!("the file does not have exactly one array, so name one; {}", listed())),
        },
    }
}

fn percent(share: f64) -> String {
    if share >= 0.01 { format!("{:.0} %", 100.0 * share) } else { format!("{:.2} %", 100.0 * share) }
}

pub(super) fn points(spec: &PointsSpec, path: &str, place: &Place) -> Result<Samples, DesignError> {
    let at = format!("{path}.path");
    let file = bytes(&spec.path, &at, place)?;
    let wrong = |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let rows = table(&String::from_utf8_lossy(&file), &[4]).map_err(wrong)?;
    let (places, values): (Vec<Vec3>, Vec<f64>) = rows.iter().map(|r| ([r[0], r[1], r[2]], r[3])).unzip();
    Samples::scattered(&places, &values, spec.neighbours as usize, &place.region.bounds()).map_err(wrong)
}

/// Control points, and their values if there are four columns.
pub(super) fn control(file: &str, at: &str, place: &Place) -> Result<(Vec<Vec3>, Option<Vec<f64>>), DesignError> {
    let text = bytes(file, at, place)?;
    let rows = table(&String::from_utf8_lossy(&text), &[3, 4])
        .map_err(|f| DesignError::new(at, format!("{file}: {}", f.message)).found(file))?;
    let places = rows.iter().map(|r| [r[0], r[1], r[2]]).collect();
    Ok((places, rows.iter().map(|r| r.get(3).copied()).collect()))
}

/// Rows of numbers, apart by commas, semicolons or spaces, x, y, z and a value if `widths` says so, all of one width; one
/// line of words before them is passed over.
fn table(text: &str, widths: &[usize]) -> Result<Vec<Vec<f64>>, Fault> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let what = match widths {
        [4] => "four numbers x, y, z, value",
        _ => "x, y, z, or x, y, z, value in all rows",
    };
    let fault = |n: usize, message: String| Fault::new("", format!("line {}: {message}", n + 1));
    for (n, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words: Vec<&str> = line.split([',', ';', '\t', ' ']).filter(|w| !w.is_empty()).collect();
        let row: Vec<Option<f64>> = words.iter().map(|w| w.trim_matches('"').parse().ok()).collect();
        if rows.is_empty() && row.iter().all(Option::is_none) {
            continue;
        }
        let wide = rows.first().map_or(row.len(), Vec::len);
        let numbers: Option<Vec<f64>> = row.into_iter().collect();
        let Some(row) = numbers.filter(|r| r.len() == wide && widths.contains(&wide)) else {
            return Err(fault(n, format!("expected {what}, found \"{line}\"")));
        };
        if row.iter().any(|v| !v.is_finite()) {
            return Err(fault(n, format!("numbers must be finite, found \"{line}\"")));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Fault::new("", format!("the file has no rows of {what}")));
    }
    Ok(rows)
}
