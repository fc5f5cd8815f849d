//! Grades: tree to data.

use super::{Read, three};
use crate::design::data::*;
use crate::design::node::{At, Fields, GRADES, Later};

const LATER: [Later; 4] = [
    (
        "radial",
        "use a formula, such as \"0.3 + 0.01*sqrt(x^2 + y^2)\"",
    ),
    ("grid", "use linear, depth or formula"),
    ("points", "use linear, depth or formula"),
    ("field", "use linear, depth or formula"),
];

pub(super) fn grade(at: &At) -> Read<GradeSpec> {
    if at.is_number() {
        return Ok(GradeSpec::Constant(at.number()?));
    }
    if at.is_list() || at.is_text() {
        return Err(at.expected("a number or a grade (a table with linear, depth or formula)"));
    }
    let (kind, at) = at.kind("grade", &GRADES, &LATER)?;
    Ok(GradeSpec::Kind(match kind {
        "formula" => GradeKind::Formula(at.text("a formula in x, y, z as text")?.to_string()),
        "depth" => {
            let f = at.fields("a grade by depth", &["stops"], &[])?;
            GradeKind::Depth(DepthSpec { stops: stops(&f)? })
        }
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

fn stops(f: &Fields) -> Read<Vec<[f64; 2]>> {
    let stops = f.need("stops", "a list of [position, value]")?;
    stops
        .list("a list of [position, value]")?
        .iter()
        .map(|s| s.numbers("[position, value]"))
        .collect()
}
