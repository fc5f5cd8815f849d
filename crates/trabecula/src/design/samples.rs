//! Numbers in files: grids, points, results on meshes.

use std::sync::Arc;

use super::Loader;
use super::build::{Place, finite};
use super::data::*;
use super::error::DesignError;
use super::grade::Allowed;
use crate::cell::{Cell, Series};
use crate::fault::{Fault, counted, number};
use crate::field::Field;
use crate::grade::{Grade, Samples};
use crate::io::{self, Shape};
use crate::math::{Aabb, Vec3};
use crate::region::{MeshRegion, Repair, Shape as _};

/// The share of the region that a result's mesh may leave uncovered: curved faces are cut short by flat elements.
const UNCOVERED: f64 = 0.01;

pub(super) fn bytes(path: &str, at: &str, place: &Place) -> Result<Vec<u8>, DesignError> {
    place
        .loader
        .load(path)
        .map_err(|m| DesignError::new(at, m).found(path))
}

/// Nodes along an axis of the grid on which a mesh of one cell is looked at.
const CELL: usize = 64;

/// A cell from numbers or a mesh.
pub(super) fn cell(
    spec: &FileCellSpec,
    path: &str,
    loader: &dyn Loader,
) -> Result<Cell, DesignError> {
    let at = format!("{path}.path");
    let wrong =
        |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    if !(spec.terms >= 1.0 && spec.terms <= 2000.0 && spec.terms.fract() == 0.0) {
        let message = format!(
            "terms is {}; it must be a whole number from 1 to 2000",
            number(spec.terms)
        );
        return Err(DesignError::new(format!("{path}.terms"), message));
    }
    let file = loader
        .load(&spec.path)
        .map_err(|m| DesignError::new(&at, m).found(&spec.path))?;
    let kind = extension(&spec.path);
    let (shape, values) = if kind == "npy" {
        let (shape, values) = io::read_npy(&file).map_err(wrong)?;
        let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
            let message =
                format!("the array has shape {shape:?}; a cell has three dimensions [x, y, z]");
            wrong(Fault::new("", message))
        })?;
        (shape, values)
    } else if io::READABLE.contains(&kind.as_str()) {
        let mesh = io::read_mesh(&file, &kind).map_err(wrong)?.mesh;
        let solid = MeshRegion::new(mesh, Repair::Auto).map_err(wrong)?;
        let (b, size) = (solid.bounds(), solid.bounds().size());
        let points: Vec<Vec3> = (0..CELL.pow(3))
            .map(|n| [n % CELL, n / CELL % CELL, n / CELL / CELL])
            .map(|i| {
                core::array::from_fn(|a| b.min[a] + size[a] * (i[a] as f64 + 0.5) / CELL as f64)
            })
            .collect();
        let mut values = vec![0.0; points.len()];
        solid.values(&points, &mut values);
        let inside = |v: &f64| if *v < 0.0 { 1.0 } else { 0.0 };
        ([CELL; 3], values.iter().map(inside).collect())
    } else {
        let known = io::READABLE.join(", ");
        let message = format!("the name must end in npy, {known}; found \"{}\"", spec.path);
        return Err(DesignError::new(at, message).found(&spec.path));
    };
    let (series, share) = Series::sampled(&values, shape, spec.terms as usize).map_err(wrong)?;
    Ok(Cell::new(series).truncated(share))
}

fn extension(path: &str) -> String {
    path.rsplit_once('.').map_or("", |(_, e)| e).to_lowercase()
}

/// The grade of samples, checked against what is allowed in the region; `1 − value` if `complement`.
pub(super) fn grade(
    samples: Samples,
    remap: &[[f64; 2]],
    path: &str,
    place: &Place,
    allowed: Allowed,
    complement: bool,
) -> Result<Grade, DesignError> {
    let mut stops: Vec<[f64; 2]> = Vec::new();
    for (i, [v, w]) in remap.iter().enumerate() {
        let at = format!("{path}.remap[{i}]");
        finite(&at, *v)?;
        finite(&at, *w)?;
        if stops.last().is_some_and(|s| s[0] >= *v) {
            return Err(DesignError::new(
                at,
                format!("numbers must rise from stop to stop, found {}", number(*v)),
            ));
        }
        stops.push([*v, *w]);
    }
    if complement {
        if stops.is_empty() {
            let r = samples.bound(&Aabb::ALL);
            // One stop would do where all numbers are the same.
            stops = vec![[r.lo, r.lo], [r.hi.max(r.lo + 1.0), r.hi.max(r.lo + 1.0)]];
        }
        stops.iter_mut().for_each(|s| s[1] = 1.0 - s[1]);
    }
    let grade = Grade::Samples {
        of: Arc::new(samples),
        remap: stops,
    };
    super::level::check_varied(&grade, path, allowed, complement, place)?;
    Ok(grade)
}

pub(super) fn grid(spec: &GridSpec, path: &str, place: &Place) -> Result<Samples, DesignError> {
    let at = format!("{path}.path");
    let kind = extension(&spec.path);
    let pictures = ["png", "tif", "tiff"].contains(&kind.as_str());
    let file = if pictures {
        Vec::new()
    } else {
        bytes(&spec.path, &at, place)?
    };
    let wrong =
        |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let (origin, step, shape, values) = match extension(&spec.path).as_str() {
        "npy" => {
            let (shape, values) = io::read_npy(&file).map_err(wrong)?;
            let shape: [usize; 3] = shape.clone().try_into().map_err(|_| {
                wrong(Fault::new(
                    "",
                    format!("the array has shape {shape:?}; a grid has three dimensions [x, y, z]"),
                ))
            })?;
            let need = |key: &str, what: &str| {
                DesignError::new(
                    format!("{path}.{key}"),
                    format!("an NPY file does not say where it lies; give {key}, {what}"),
                )
            };
            let origin = spec
                .origin
                .ok_or_else(|| need("origin", "the place of the first number, [x, y, z] in mm"))?;
            let step = spec
                .step
                .ok_or_else(|| need("step", "the distance between numbers in mm, one or three"))?;
            (origin, step.three(), shape, values)
        }
        "vti" | "vtk" => {
            let data = io::read_vtk(&file).map_err(wrong)?;
            let Shape::Image {
                origin,
                step,
                nodes,
            } = data.shape
            else {
                return Err(wrong(Fault::new(
                    "",
                    "the file holds a mesh; use the grade field for it",
                )));
            };
            let array = pick(&data.arrays, spec.array.as_deref())
                .map_err(|m| DesignError::new(format!("{path}.array"), m))?;
            if array.components != 1 {
                let message = format!(
                    "the array \"{}\" has {} components; a number needs an array with one",
                    array.name, array.components
                );
                return Err(DesignError::new(format!("{path}.array"), message));
            }
            let (origin, shape) = if array.of_cells {
                let at = core::array::from_fn(|a| {
                    origin[a] + if nodes[a] > 1 { 0.5 * step[a] } else { 0.0 }
                });
                (at, nodes.map(|n| n.saturating_sub(1).max(1)))
            } else {
                (origin, nodes)
            };
            (
                spec.origin.unwrap_or(origin),
                spec.step.map_or(step, OneOrThree::three),
                shape,
                array.values.clone(),
            )
        }
        "png" | "tif" | "tiff" => {
            let need = |key: &str, what: &str| {
                DesignError::new(
                    format!("{path}.{key}"),
                    format!("pictures do not say where they lie; give {key}, {what}"),
                )
            };
            let origin = spec
                .origin
                .ok_or_else(|| need("origin", "the middle of the first pixel, [x, y, z] in mm"))?;
            let step = spec.step.ok_or_else(|| {
                need(
                    "step",
                    "the distance between pixels and pictures in mm, one or three",
                )
            })?;
            let (shape, values) = stack(spec, &at, place)?;
            (origin, step.three(), shape, values)
        }
        _ => {
            let message = format!(
                "the name must end in npy, vti or vtk, or in png or tif for pictures; found \"{}\"",
                spec.path
            );
            return Err(DesignError::new(at, message).found(&spec.path));
        }
    };
    let samples = Samples::new(origin, step, shape, values).map_err(|f| match f.at.as_str() {
        "path" => wrong(f),
        _ => DesignError::fault(path, f),
    })?;
    // A number stands for half a step about it as well.
    let reach = samples.step().into_iter().fold(0.0, f64::max) * 0.5 + 1e-9;
    let covered = samples.bounds().grown(reach);
    let missing = place
        .points
        .iter()
        .filter(|p| covered.distance(**p) > 0.0)
        .count();
    if missing > 0 {
        let (b, share) = (samples.bounds(), missing as f64 / place.points.len() as f64);
        let message = format!(
            "{}: the grid does not cover {} of the region; it reaches from {:?} to {:?} mm",
            spec.path,
            percent(share),
            b.min,
            b.max
        );
        return Err(DesignError::new(at, message).found(&spec.path));
    }
    Ok(samples)
}

/// Grey pictures one above the other: the files that the path stands for in the order of their names, in which 10 comes after 9,
/// each with one picture or more.
fn stack(spec: &GridSpec, at: &str, place: &Place) -> Result<([usize; 3], Vec<f64>), DesignError> {
    let mut names = match spec.path.contains('*') {
        true => place
            .loader
            .list(&spec.path)
            .map_err(|m| DesignError::new(at, m).found(&spec.path))?,
        false => vec![spec.path.clone()],
    };
    names.sort_by_cached_key(|n| counted_name(n));
    let (mut size, mut values, mut count) = (None, Vec::new(), 0);
    for name in &names {
        let wrong =
            |message: String| DesignError::new(at, format!("{name}: {message}")).found(name);
        let file = bytes(name, at, place)?;
        for picture in io::read_pictures(&file).map_err(|f| wrong(f.message))? {
            let [w, h] = picture.size;
            let first = *size.get_or_insert(picture.size);
            if first != picture.size {
                let message = format!(
                    "a picture of {w} × {h} pixels among those of {} × {}",
                    first[0], first[1]
                );
                return Err(wrong(message));
            }
            values.extend(picture.values);
            count += 1;
        }
    }
    let [w, h] = size.ok_or_else(|| {
        DesignError::new(at, format!("{}: no pictures", spec.path)).found(&spec.path)
    })?;
    Ok(([w, h, count], values))
}

/// A name as its words and numbers, so that they sort as people count.
fn counted_name(name: &str) -> Vec<(String, u64)> {
    let mut parts: Vec<(String, u64)> = vec![(String::new(), 0)];
    let mut digits = false;
    for c in name.chars() {
        match (c.to_digit(10), parts.last_mut()) {
            (Some(d), Some(last)) => {
                last.1 = last.1.saturating_mul(10).saturating_add(u64::from(d));
                digits = true;
            }
            (None, Some(last)) if !digits => last.0.push(c),
            _ => {
                parts.push((c.to_string(), 0));
                digits = false;
            }
        }
    }
    parts
}

fn percent(share: f64) -> String {
    if share >= 0.01 {
        format!("{:.0} %", 100.0 * share)
    } else {
        format!("{:.2} %", 100.0 * share)
    }
}

pub(super) fn points(spec: &PointsSpec, path: &str, place: &Place) -> Result<Samples, DesignError> {
    let at = format!("{path}.path");
    let file = bytes(&spec.path, &at, place)?;
    let wrong =
        |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    let rows = table(&String::from_utf8_lossy(&file), &[4]).map_err(wrong)?;
    let (places, values): (Vec<Vec3>, Vec<f64>) =
        rows.iter().map(|r| ([r[0], r[1], r[2]], r[3])).unzip();
    if spec.neighbours < 1.0 || spec.neighbours.fract() != 0.0 || spec.neighbours > 64.0 {
        let message = format!(
            "neighbours is {}; it must be a whole number from 1 to 64",
            number(spec.neighbours)
        );
        return Err(DesignError::new(format!("{path}.neighbours"), message));
    }
    Samples::scattered(
        &places,
        &values,
        spec.neighbours as usize,
        &place.region.bounds(),
    )
    .map_err(wrong)
}

/// Control points, and the values beside them if there are four columns.
pub(super) fn control(
    file: &str,
    at: &str,
    place: &Place,
) -> Result<(Vec<Vec3>, Option<Vec<f64>>), DesignError> {
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
        let words: Vec<&str> = line
            .split([',', ';', '\t', ' '])
            .filter(|w| !w.is_empty())
            .collect();
        let row: Vec<Option<f64>> = words
            .iter()
            .map(|w| w.trim_matches('"').parse().ok())
            .collect();
        if rows.is_empty() && row.iter().all(Option::is_none) {
            continue;
        }
        let wide = rows.first().map_or(row.len(), Vec::len);
        let numbers: Option<Vec<f64>> = row.into_iter().collect();
        let Some(row) = numbers.filter(|r| r.len() == wide && widths.contains(&wide)) else {
            return Err(fault(n, format!("expected {what}, found \"{line}\"")));
        };
        if row.iter().any(|v| !v.is_finite()) {
            return Err(fault(
                n,
                format!("numbers must be finite, found \"{line}\""),
            ));
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(Fault::new("", format!("the file has no rows of {what}")));
    }
    Ok(rows)
}

pub(super) fn field(spec: &FieldSpec, path: &str, place: &Place) -> Result<Samples, DesignError> {
    let at = format!("{path}.component");
    let made = components(spec, path, place, |array| {
        match (spec.component, array.components) {
            (None, 1) => Ok(vec![0]),
            (None, n) => Err(DesignError::new(
                &at,
                format!(
                    "the array \"{}\" has {n} components; give component, from 0 to {}",
                    array.name,
                    n - 1
                ),
            )),
            (Some(c), n) if c >= 0.0 && c < n as f64 && c.fract() == 0.0 => Ok(vec![c as usize]),
            (Some(c), n) => Err(DesignError::new(
                &at,
                format!(
                    "component is {}; the array \"{}\" has components 0 to {}",
                    number(c),
                    array.name,
                    n - 1
                ),
            )),
        }
    })?;
    let one = made.into_iter().next();
    one.ok_or_else(|| DesignError::new(path, "the array has no numbers"))
}

/// The components of a vector (three) or a symmetric tensor (six, in the order 11, 22, 33, 23, 13, 12).
pub(super) fn several<const N: usize>(
    spec: &FieldSpec,
    path: &str,
    place: &Place,
    order: impl Fn(usize) -> Option<[usize; N]>,
) -> Result<[Grade; N], DesignError> {
    let made = components(spec, path, place, |array| {
        order(array.components).map(|o| o.to_vec()).ok_or_else(|| {
            let needed = if N == 3 {
                "a vector has three"
            } else {
                "a tensor has six or nine"
            };
            DesignError::new(
                format!("{path}.array"),
                format!(
                    "the array \"{}\" has {} components; {needed}",
                    array.name, array.components
                ),
            )
        })
    })?;
    let mut made = made.into_iter().map(|s| Grade::Samples {
        of: Arc::new(s),
        remap: Vec::new(),
    });
    Ok(core::array::from_fn(|_| {
        made.next().unwrap_or(Grade::Constant(0.0))
    }))
}

/// The array of this name, or the only one.
fn pick<'a>(arrays: &'a [io::Array], name: Option<&str>) -> Result<&'a io::Array, String> {
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
        if names.is_empty() {
            "it has none".to_string()
        } else {
            format!("it has {}", names.join(", "))
        }
    };
    match name {
        Some(name) => arrays
            .iter()
            .find(|a| a.name == name)
            .ok_or_else(|| format!("the file has no array \"{name}\"; {}", listed())),
        None => match arrays {
            [one] => Ok(one),
            _ => Err(format!(
                "the file does not have exactly one array, so name one; {}",
                listed()
            )),
        },
    }
}

/// The chosen components of an array, on grids over the region.
fn components(
    spec: &FieldSpec,
    path: &str,
    place: &Place,
    choose: impl Fn(&io::Array) -> Result<Vec<usize>, DesignError>,
) -> Result<Vec<Samples>, DesignError> {
    let at = format!("{path}.path");
    let file = bytes(&spec.path, &at, place)?;
    let wrong =
        |f: Fault| DesignError::new(&at, format!("{}: {}", spec.path, f.message)).found(&spec.path);
    if !["vtu", "vtk", "vti"].contains(&extension(&spec.path).as_str()) {
        let message = format!(
            "the name must end in vtu, vtk or vti; found \"{}\"",
            spec.path
        );
        return Err(DesignError::new(at, message).found(&spec.path));
    }
    let data = io::read_vtk(&file).map_err(wrong)?;
    let array = pick(&data.arrays, Some(&spec.array))
        .map_err(|m| DesignError::new(format!("{path}.array"), m).found(&spec.array))?;
    if let Some(n) = array.values.iter().position(|v| !v.is_finite()) {
        let bad = array.values.iter().filter(|v| !v.is_finite()).count();
        let what = if array.of_cells { "cell" } else { "point" };
        let message = format!(
            "{}: {bad} of {} of the array \"{}\" are not finite, the first at {what} {}",
            spec.path,
            counted(array.values.len(), "number"),
            array.name,
            n / array.components
        );
        return Err(DesignError::new(format!("{path}.array"), message));
    }
    let chosen = choose(array)?;
    let column = |c: usize| {
        array
            .values
            .chunks_exact(array.components)
            .map(move |t| t[c])
    };
    let (points, tets, of) = match data.shape {
        Shape::Mesh(elements) => {
            let (tets, of) = elements.tets();
            (elements.points, tets, of)
        }
        Shape::Image {
            origin,
            step,
            nodes,
        } => {
            let (origin, shape) = if array.of_cells {
                (
                    core::array::from_fn(|a| origin[a] + 0.5 * step[a]),
                    nodes.map(|n| n.saturating_sub(1).max(1)),
                )
            } else {
                (origin, nodes)
            };
            let made = chosen
                .iter()
                .map(|&c| Samples::new(origin, step, shape, column(c).collect()));
            return made.collect::<Result<Vec<Samples>, Fault>>().map_err(wrong);
        }
    };
    // What cells have goes to their corners, by volume.
    let values: Vec<Vec<f64>> = chosen
        .iter()
        .map(|&c| {
            let own: Vec<f64> = column(c).collect();
            if !array.of_cells {
                return own;
            }
            let (mut sum, mut weight) = (vec![0.0; points.len()], vec![0.0; points.len()]);
            for (t, cell) in tets.iter().zip(&of) {
                let p = t.map(|i| points[i as usize]);
                let edges = [1, 2, 3].map(|i| crate::math::sub(p[i], p[0]));
                let volume = crate::math::determinant(&edges).abs();
                for i in t.map(|i| i as usize) {
                    sum[i] += volume * own[*cell as usize];
                    weight[i] += volume;
                }
            }
            sum.iter()
                .zip(&weight)
                .map(|(s, w)| if *w > 0.0 { s / w } else { 0.0 })
                .collect()
        })
        .collect();
    let (made, share) = Samples::meshed(
        &points,
        &tets,
        &values,
        &place.region.bounds(),
        place.points,
    )
    .map_err(wrong)?;
    if share > UNCOVERED {
        let b = points.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let message = format!(
            "{}: the mesh does not cover {} of the region; it reaches from {:?} to {:?} mm",
            spec.path,
            percent(share),
            b.min,
            b.max
        );
        return Err(DesignError::new(at, message).found(&spec.path));
    }
    Ok(made)
}
