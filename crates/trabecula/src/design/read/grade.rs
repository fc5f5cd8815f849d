//! Grades: tree to data.

use super::{Read, three};
use crate::design::data::*;
use crate::design::node::{At, Fields, GRADES};

pub(super) fn grade(at: &At) -> Read<GradeSpec> {
    if at.is_number() {
        return Ok(GradeSpec::Constant(at.number()?));
    }
    if at.is_list() || at.is_text() {
        return Err(at.expected("a number or a grade (a table with linear, depth, radial, formula, grid, points or field)"));
    }
    let (kind, at) = at.kind("grade", &GRADES, &[])?;
    Ok(GradeSpec::Kind(match kind {
        "formula" => GradeKind::Formula(at.text("a formula in x, y, z as text")?.to_string()),
        "depth" => {
            let f = at.fields("a grade by depth", &["stops"], &[])?;
            GradeKind::Depth(DepthSpec { stops: stops(&f)? })
        }
        "radial" => {
            let f = at.fields("a radial grade", &["center", "axis", "stops"], &[])?;
            GradeKind::Radial(RadialSpec {
                center: f.read("center", [0.0; 3], three)?,
                axis: f.read("axis", None, |at| three(at).map(Some))?,
                stops: stops(&f)?,
            })
        }
        "grid" => {
            let keys = ["path", "array", "origin", "step", "remap"];
            let f = at.fields("a grade on a grid", &keys, &[])?;
            GradeKind::Grid(GridSpec {
                path: file(&f)?,
                array: f.read("array", None, |at| Ok(Some(at.text("a name")?.to_string())))?,
                origin: f.read("origin", None, |at| three(at).map(Some))?,
                step: f.read("step", None, |at| {
                    Ok(Some(if at.is_list() {
                        OneOrThree::Three(three(at)?)
                    } else {
                        OneOrThree::One(at.number()?)
                    }))
                })?,
                remap: remap(&f)?,
            })
        }
        "points" => {
            let f = at.fields("a grade at points", &["path", "neighbours", "remap"], &[])?;
            GradeKind::Points(PointsSpec {
                path: file(&f)?,
                neighbours: f.read("neighbours", 8.0, At::number)?,
                remap: remap(&f)?,
            })
        }
        "field" => GradeKind::Field(field(&at)?),
        _ => {
            let f = at.fields("a linear grade", &["along", "stops"], &[])?;
            let along = three(f.need("along", "the direction [x, y, z]")?)?;
            GradeKind::Linear(LinearSpec {
                along,
                stops: stops(&f)?,
            })
        }
    }))
}

/// An array of a result.
pub(super) fn field(at: &At) -> Read<FieldSpec> {
    let keys = ["path", "array", "component", "remap"];
    let f = at.fields("a field of a result", &keys, &[])?;
    let array = f.need(
        "array",
        "the name of an array of points or cells in the file",
    )?;
    Ok(FieldSpec {
        path: file(&f)?,
        array: array.text("a name")?.to_string(),
        component: f.read("component", None, |at| at.number().map(Some))?,
        remap: remap(&f)?,
    })
}

fn file(f: &Fields) -> Read<String> {
    let path = f.need("path", "the file, relative to the design file")?;
    Ok(path.text("a path")?.to_string())
}

fn remap(f: &Fields) -> Read<Vec<[f64; 2]>> {
    f.read("remap", Vec::new(), |at| {
        let stops = at.list("a list of [number, value]")?;
        stops.iter().map(|s| s.numbers("[number, value]")).collect()
    })
}

fn stops(f: &Fields) -> Read<Vec<[f64; 2]>> {
    let stops = f.need("stops", "a list of [position, value]")?;
    stops
        .list("a list of [position, value]")?
        .iter()
        .map(|s| s.numbers("[position, value]"))
        .collect()
}
