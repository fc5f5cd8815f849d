//! Grades: tree to data.

use super::{Read, region, three};
use crate::design::data::*;
use crate::kind::{At, Fields, GRADES};

pub(super) fn grade(at: &At) -> Read<GradeSpec> {
    if at.is_number() {
        return Ok(GradeSpec::Constant(at.number()?));
    }
    if at.is_list() || at.is_text() {
        return Err(at.expected("a number or a grade (a table with linear, depth, radial, formula, grid, points, field, sigmoid, region, distance or rbf)"));
    }
    let (kind, at) = at.kind("grade", &GRADES)?;
    Ok(GradeSpec::Kind(match kind {
        "formula" => GradeKind::Formula(at.text("a formula in x, y, z as text")?.to_string()),
        "depth" => {
            let f = at.fields("a grade by depth", &["stops"])?;
            GradeKind::Depth(DepthSpec { stops: stops(&f)? })
        }
        "radial" => {
            let f = at.fields("a radial grade", &["center", "axis", "stops"])?;
            GradeKind::Radial(RadialSpec {
                center: f.read("center", [0.0; 3], three)?,
                axis: f.read("axis", None, |at| three(at).map(Some))?,
                stops: stops(&f)?,
            })
        }
        "grid" => {
            let keys = ["path", "array", "origin", "step", "remap"];
            let f = at.fields("a grade on a grid", &keys)?;
            GradeKind::Grid(GridSpec {
                path: file(&f)?,
                array: f.read("array", None, |at| Ok(Some(at.text("a name")?.to_string())))?,
                origin: f.read("origin", None, |at| three(at).map(Some))?,
                step: f.read("step", None, |at| {
                    Ok(Some(if at.is_list() { OneOrThree::Three(three(at)?) } else { OneOrThree::One(at.number()?) }))
                })?,
                remap: remap(&f)?,
            })
        }
        "points" => {
            let f = at.fields("a grade at points", &["path", "neighbours", "remap"])?;
            GradeKind::Points(PointsSpec {
                path: file(&f)?,
                neighbours: f.read("neighbours", 8.0, At::number)?,
                remap: remap(&f)?,
            })
        }
        "field" => GradeKind::Field(field(&at)?),
        "sigmoid" => {
            let f = at.fields("a smooth step", &["of", "at", "width"])?;
            GradeKind::Sigmoid(SigmoidSpec {
                of: Box::new(grade(f.need("of", "the number that it is a step of")?)?),
                at: f.read("at", 0.0, At::number)?,
                width: f.need("width", "from where it is 0 to where it is 1")?.number()?,
            })
        }
        "region" => {
            let f = at.fields("a region as a number", &["of", "width"])?;
            GradeKind::Region(WithinSpec {
                of: Box::new(region(f.need("of", "a region, such as { sphere = { radius = 5 } }")?)?),
                width: f.need("width", "of the step at its surface, mm")?.number()?,
            })
        }
        "distance" => {
            let keys = ["points", "path", "closed", "axis", "sharpness"];
            let f = at.fields("a distance to a line", &keys)?;
            GradeKind::Distance(DistanceSpec {
                points: control(&f)?,
                closed: f.read("closed", false, At::truth)?,
                axis: f.read("axis", None, |at| three(at).map(Some))?,
                sharpness: f.read("sharpness", None, |at| at.number().map(Some))?,
            })
        }
        "rbf" => {
            let keys = ["points", "path", "values", "delta", "axis"];
            let f = at.fields("radial basis functions", &keys)?;
            GradeKind::Rbf(RbfSpec {
                points: control(&f)?,
                values: f.read("values", None, |at| {
                    let values = at.list("a list of numbers")?;
                    values.iter().map(At::number).collect::<Read<Vec<f64>>>().map(Some)
                })?,
                delta: f.read("delta", None, |at| at.number().map(Some))?,
                axis: f.read("axis", None, |at| three(at).map(Some))?,
            })
        }
        _ => {
            let f = at.fields("a linear grade", &["along", "stops"])?;
            let along = three(f.need("along", "the direction [x, y, z]")?)?;
            GradeKind::Linear(LinearSpec { along, stops: stops(&f)? })
        }
    }))
}

/// Control points: here, or in a file.
pub(super) fn control(f: &Fields) -> Read<ControlSpec> {
    match (f.get("points"), f.get("path")) {
        (Some(_), Some(path)) => Err(path.error("points and path at once; give the points here or in a file")),
        (Some(points), None) => {
            let points = points.list("a list of points [x, y, z]")?;
            Ok(ControlSpec::Points(points.iter().map(three).collect::<Read<_>>()?))
        }
        (None, Some(path)) => Ok(ControlSpec::Path(path.text("a path")?.to_string())),
        (None, None) => {
            Err(f.at.error("the points are missing; give points = [[x, y, z], ...] or path, a table (csv)"))
        }
    }
}

/// An array of a result.
pub(super) fn field(at: &At) -> Read<FieldSpec> {
    let keys = ["path", "array", "component", "remap"];
    let f = at.fields("a field of a result", &keys)?;
    let array = f.need("array", "the name of an array of points or cells in the file")?;
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
    stops.list("a list of [position, value]")?.iter().map(|s| s.numbers("[position, value]")).collect()
}
