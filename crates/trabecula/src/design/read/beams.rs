//! Beams: tree to data.

use super::{Read, grade, map, three};
use crate::design::data::*;
use crate::kind::At;
use beams::graph::catalogue;
use geometry::fault::{counted, number};

const KEYS: [&str; 12] =
    ["cell", "map", "nodes", "struts", "pattern", "radius", "hub", "profile", "fillet", "trim", "dangling", "merge"];

/// What others call the cells.
const CELLS: [(&str, &str); 16] = [
    ("simple_cubic", "sc"),
    ("cubic", "sc"),
    ("grid", "sc"),
    ("body_centred_cubic", "bcc"),
    ("body_centered_cubic", "bcc"),
    ("face_centred_cubic", "fcc"),
    ("face_centered_cubic", "fcc"),
    ("octet_truss", "octet"),
    ("octahedron", "octahedra"),
    ("cuboctahedron", "octahedra"),
    ("truncated_octahedron", "kelvin"),
    ("tetrakaidecahedron", "kelvin"),
    ("fluorite", "rhombic_dodecahedron"),
    ("dodecahedron", "rhombic_dodecahedron"),
    ("auxetic", "re_entrant"),
    ("honeycomb", "hexagonal_prism"),
];

pub(super) fn beams(at: &At) -> Read<BeamsSpec> {
    let f = at.fields("beams", &KEYS)?;
    let cell = f.get("cell").map(cell).transpose()?;
    let own = f.get("nodes").or(f.get("struts"));
    let pattern = f.get("pattern").map(pattern).transpose()?;
    if pattern.is_some() {
        for key in ["cell", "map", "nodes", "struts", "trim", "dangling", "merge"] {
            if let Some(other) = f.get(key) {
                let message =
                    format!("a pattern has its own nodes and struts, and is cut by the region; leave {key} out");
                return Err(other.error(message));
            }
        }
    }
    match (&cell, own) {
        (Some(_), Some(own)) => {
            return Err(own.error("beams are either a cell on a map, or nodes and struts; found both"));
        }
        (None, None) if pattern.is_some() => {}
        (None, None) => {
            let message = "no graph given; give cell (such as \"octet\") and map, nodes and struts, or a pattern";
            return Err(f.at.error(message));
        }
        (None, Some(_)) => {
            f.need("nodes", "a table (csv) of id, x, y, z, or rows of x, y, z in mm")?;
            f.need("struts", "a table (csv) of pairs of ids, or rows of two numbers of nodes")?;
            if let Some(map) = f.get("map") {
                let message = "nodes are given by their places in mm; a map belongs to a cell";
                return Err(map.error(message));
            }
        }
        (Some(_), None) => {
            f.need("map", "such as map.affine with wavelength = 5")?;
            if f.get("hub").is_none() {
                f.need("radius", "of a beam at mid length, mm")?;
            }
        }
    }
    let maybe = |key: &str| f.read(key, None, |at| grade(at).map(Some));
    let trims = [("cut", TrimSpec::Cut), ("drop", TrimSpec::Drop), ("snap", TrimSpec::Snap)];
    let loose = [("keep", DanglingSpec::Keep), ("drop", DanglingSpec::Drop)];
    Ok(BeamsSpec {
        cell,
        map: f.get("map").map(map).transpose()?,
        nodes: f.get("nodes").map(nodes).transpose()?,
        struts: f.get("struts").map(struts).transpose()?,
        pattern,
        radius: maybe("radius")?,
        hub: maybe("hub")?,
        profile: f.get("profile").map(profile).transpose()?,
        fillet: f.read("fillet", FilletSpec::None, fillet)?,
        trim: f.read("trim", TrimSpec::Cut, |at| at.word("trim", &trims))?,
        dangling: f.read("dangling", DanglingSpec::Keep, |at| at.word("word", &loose))?,
        merge: f.get("merge").map(At::number).transpose()?,
    })
}

fn cell(at: &At) -> Read<String> {
    let names: Vec<(&str, &str)> = catalogue().iter().map(|u| (u.name, u.name)).collect();
    if at.is_text() {
        let word = at.text("a name")?;
        if crate::cell::named(word).is_some() && beams::graph::named(word).is_none() {
            let message = format!("{word} is a surface, not a cell of beams; write it as a lattice");
            return Err(at.error(message));
        }
    }
    Ok(at.word_or("cell of beams", &names, &CELLS)?.to_string())
}

fn nodes(at: &At) -> Read<NodesSpec> {
    if at.is_text() {
        return Ok(NodesSpec::Path(at.text("a path")?.to_string()));
    }
    Ok(NodesSpec::Rows(places(at, "the path of a table, or rows of x, y, z in mm")?))
}

fn places(at: &At, what: &str) -> Read<Vec<RowSpec>> {
    let rows = at.list(what)?;
    let row = |at: &At| match at.list("x, y, z and perhaps a radius, mm")?.len() {
        4 => Ok(RowSpec::Ball(at.numbers("x, y, z, radius")?)),
        _ => Ok(RowSpec::Place(at.numbers("x, y, z and perhaps a radius, mm")?)),
    };
    let rows = rows.iter().map(row).collect::<Read<Vec<_>>>()?;
    if rows.is_empty() {
        return Err(at.error("no nodes given"));
    }
    Ok(rows)
}

fn pattern(at: &At) -> Read<PatternSpec> {
    let f = at.fields("a pattern", &["nodes", "struts", "repeat"])?;
    let nodes = places(
        f.need("nodes", "rows of x, y, z and perhaps a radius, mm")?,
        "rows of x, y, z and perhaps a radius, mm",
    )?;
    let struts = f.need("struts", "rows of two ids and the repeats between them, such as [0, 0, 1, 0, 0]")?;
    let row = |at: &At| {
        let what = "two ids and up to three repeats, such as [0, 0, 1, 0, 0]";
        let items = at.list(what)?;
        if !(2..=5).contains(&items.len()) {
            return Err(at.error(format!("expected {what}, found {}", counted(items.len(), "value"))));
        }
        let mut row = [0; 5];
        for (i, (r, item)) in row.iter_mut().zip(&items).enumerate() {
            let v = item.number()?;
            if v.fract() != 0.0 || v.abs() > 1e6 || (i < 2 && v < 0.0) {
                return Err(item.error(format!("expected a whole number, found {}", number(v))));
            }
            *r = v as i32;
        }
        Ok(row)
    };
    let rows = struts.list("rows of two ids and the repeats between them")?;
    let made = rows.iter().map(row).collect::<Read<Vec<_>>>()?;
    if made.is_empty() {
        return Err(struts.error("no struts given"));
    }
    let steps = f.need("repeat", "one to three steps, such as { count = 12, rotate = [0, 0, 30] }")?;
    let items = steps.list("one to three steps, such as [{ count = 12, rotate = [0, 0, 30] }]")?;
    if !(1..=3).contains(&items.len()) {
        return Err(steps.error(format!("expected one to three steps, found {}", items.len())));
    }
    Ok(PatternSpec { nodes, struts: made, repeat: items.iter().map(repeat).collect::<Read<Vec<_>>>()? })
}

fn repeat(at: &At) -> Read<RepeatSpec> {
    let f = at.fields("a step", &["count", "by", "rotate", "scale", "about"])?;
    Ok(RepeatSpec {
        count: f.need("count", "how often, the original counted")?.number()?,
        by: f.read("by", [0.0; 3], three)?,
        rotate: f.read("rotate", [0.0; 3], three)?,
        scale: f.read("scale", 1.0, At::number)?,
        about: f.read("about", [0.0; 3], three)?,
    })
}

fn struts(at: &At) -> Read<StrutsSpec> {
    if at.is_text() {
        return Ok(StrutsSpec::Path(at.text("a path")?.to_string()));
    }
    let rows = at.list("the path of a table, or pairs of numbers of nodes")?;
    let row = |at: &At| {
        let pair: [f64; 2] = at.numbers("two numbers of nodes")?;
        match pair.iter().find(|v| !(v.fract() == 0.0 && **v >= 0.0 && **v < f64::from(u32::MAX))) {
            Some(v) => Err(at.error(format!("nodes are counted by whole numbers from 0, found {}", number(*v)))),
            None => Ok(pair.map(|v| v as u32)),
        }
    };
    let rows = rows.iter().map(row).collect::<Read<Vec<_>>>()?;
    if rows.is_empty() {
        return Err(at.error("no struts given"));
    }
    Ok(StrutsSpec::Rows(rows))
}

fn profile(at: &At) -> Read<ProfileSpec> {
    if at.is_text() {
        let words = [("cone", ProfileSpec::Cone), ("cylinder", ProfileSpec::Cylinder)];
        return at.word("profile", &words);
    }
    let (kind, at) = at.kind("profile", &["waist", "lambda"])?;
    let v = at.number()?;
    Ok(if kind == "waist" { ProfileSpec::Waist(v) } else { ProfileSpec::Lambda(v) })
}

fn fillet(at: &At) -> Read<FilletSpec> {
    if at.is_text() {
        let words = [("none", FilletSpec::None), ("auto", FilletSpec::Auto)];
        return at.word("fillet", &words);
    }
    if at.is_number() {
        return Err(at.error("a bare number says not what it is; for a radius in mm write fillet = { radius = 0.5 }"));
    }
    let (kind, at) = at.kind("fillet", &["radius", "tau", "alpha", "beta"])?;
    let v = at.number()?;
    Ok(match kind {
        "radius" => FilletSpec::Radius(v),
        "tau" => FilletSpec::Tau(v),
        "alpha" => FilletSpec::Alpha(v),
        _ => FilletSpec::Beta(v),
    })
}

/// All graphs of beams by name.
pub(super) fn all(at: &At) -> Read<BeamsSpecs> {
    let entries = at.entries("beams by name, such as [beams.core]")?;
    if let Some((key, at)) = entries.iter().find(|(key, _)| KEYS.contains(key)) {
        let message = format!("a name comes first, such as [beams.core] with {key}");
        return Err(at.error(message));
    }
    let mut found = BeamsSpecs::new();
    for (name, at) in &entries {
        found.insert(name.to_string(), beams(at)?);
    }
    Ok(found)
}
