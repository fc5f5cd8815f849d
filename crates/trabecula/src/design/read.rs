//! Tree to data: every key, kind and word is checked here; values are checked when the design is built.

use std::collections::BTreeMap;

use super::Design;
use super::data::*;
use crate::cell::tet::tet_catalogue;
use crate::cell::{catalogue, named};
use crate::kind::DesignError;
use crate::kind::{At, Kind, Node, Table};
use geometry::fault;
use geometry::symmetry::Group;

mod beams;
mod blend;
mod grade;
mod map;

use grade::grade;
use map::map;

type Read<T> = Result<T, DesignError>;

const THREE: &str = "three numbers [x, y, z]";
const AMOUNTS: &str = "exactly one of iso, fraction, porosity, thickness";

/// The design in a tree.
pub(super) fn design(node: &Node) -> Read<Design> {
    let f = At::root(node)
        .fields("a design", &["schema", "units", "region", "lattice", "beams", "blend", "skin", "keep"])?;
    let schema = f.need("schema", "write schema = 1 at the top")?;
    let number = schema.number()?;
    if number != 1.0 {
        return Err(schema.error(format!("this version reads schema 1, found {}", fault::number(number))));
    }
    if let Some(units) = f.get("units") {
        let word = units.text("\"mm\"")?;
        if word != "mm" {
            let message = format!("lengths in a design are mm, found \"{word}\"; a mesh file may have its own unit");
            return Err(units.error(message));
        }
    }
    let spec = region(f.need("region", "say where the part may be, such as [region.box] with size = [20, 20, 20]")?)?;
    let missing = "say what fills the region, such as [lattice.core] with cell = \"gyroid\", or [beams.core] with cell = \"octet\"";
    let beams = f.read("beams", BeamsSpecs::new(), beams::all)?;
    let lattice_at = match f.get("lattice") {
        None if !beams.is_empty() => None,
        _ => Some(f.need("lattice", missing)?),
    };
    let entries = lattice_at.map_or(Ok(Vec::new()), |at| at.entries("lattices by name, such as [lattice.core]"))?;
    if entries.is_empty() && beams.is_empty() {
        return Err(DesignError::new("lattice", missing));
    }
    let mut names: Vec<&str> = entries.iter().map(|e| e.0).collect();
    for name in beams.keys() {
        if names.contains(&name.as_str()) {
            let message = format!("\"{name}\" names a lattice already; give the beams another name");
            return Err(f.need("beams", "")?.error(message));
        }
        names.push(name);
    }
    if let ([a, b, ..], None) = (names.as_slice(), f.get("blend")) {
        let message = format!(
            "several lattices ({a}, {b}) need a blend to say where each is, such as [blend] with between = [\"{a}\", \"{b}\"] \
             and a weight"
        );
        let second = entries.get(1).map(|e| &e.1).or(f.get("beams"));
        return Err(second.unwrap_or(&f.at).error(message));
    }
    let blend = f.read("blend", None, |at| blend::blend(at, &names).map(Some))?;
    let mut lattices = Lattices::new();
    for (name, at) in &entries {
        lattices.insert(name.to_string(), lattice(at)?);
    }
    Ok(Design {
        schema: 1,
        units: super::Units::Mm,
        region: spec,
        lattice: lattices,
        beams,
        blend,
        skin: f.read("skin", None, |at| skin(at).map(Some))?,
        keep: f.read("keep", Keeps::new(), keeps)?,
        lines: node.lines(),
    })
}

/// The region in a design whose other keys are left alone.
pub(super) fn region_of(node: &Node) -> Read<RegionKind> {
    let missing = "say where the part may be, such as [region.box] with size = [20, 20, 20]";
    match entry(&At::root(node), "region")? {
        Some(at) => region(&at),
        None => Err(DesignError::new("region", format!("\"region\" is missing: {missing}"))),
    }
}

/// The region in a design, or in a tree that says nothing else.
pub(super) fn region_in(node: &Node) -> Read<RegionIn> {
    let at = At::root(node);
    if at.entries("a design or a region")?.iter().any(|(key, _)| ["lattice", "beams"].contains(key)) {
        return Ok(RegionIn::Design(Box::new(design(node)?)));
    }
    let f = at.fields("a region file", &["schema", "units", "region"])?;
    region(f.need("region", "say where the part may be, such as [region.box] with size = [20, 20, 20]")?)
        .map(RegionIn::Alone)
}

/// What a file that is read for its region holds.
pub(super) enum RegionIn {
    Design(Box<Design>),
    Alone(RegionKind),
}

/// The entry of a table with other keys, which are left alone.
fn entry<'a>(at: &At<'a>, key: &str) -> Read<Option<At<'a>>> {
    let entries = at.entries(&format!("a table with {key}"))?;
    Ok(entries.into_iter().find(|(k, _)| *k == key).map(|e| e.1))
}

/// The tetrahedral mesh in a design, whose other keys are left alone, and the path of its table; the name of its lattice if
/// it is to be that of one.
pub(super) fn tets_in(node: &Node, lattice: Option<&str>) -> Read<(String, TetsSpec)> {
    let at = At::root(node);
    let lattices = match entry(&at, "lattice")? {
        Some(of) => of.entries("lattices by name, such as [lattice.core]")?,
        None => Vec::new(),
    };
    for (name, at) in lattices {
        if lattice.is_some_and(|wanted| wanted != name) {
            continue;
        }
        if let Some(map) = entry(&at, "map")?
            && let Some(tets) = entry(&map, "tets")?
        {
            return Ok((tets.path.clone(), map::tets(&tets)?));
        }
    }
    let message =
        "no lattice of the design has a tetrahedral mesh; give one, such as [lattice.core.map.tets] with size = 5";
    Err(DesignError::new("lattice", message))
}

fn three(at: &At) -> Read<[f64; 3]> {
    at.numbers(THREE)
}

fn region(at: &At) -> Read<RegionKind> {
    RegionKind::read(at)
}

/// What others call the sides.
const SIDES: [(&str, &str); 14] = [
    ("bottom", "-z"),
    ("top", "+z"),
    ("down", "-z"),
    ("up", "+z"),
    ("left", "-x"),
    ("right", "+x"),
    ("front", "-y"),
    ("back", "+y"),
    ("xmin", "-x"),
    ("xmax", "+x"),
    ("ymin", "-y"),
    ("ymax", "+y"),
    ("zmin", "-z"),
    ("zmax", "+z"),
];

fn skin(at: &At) -> Read<SkinSpec> {
    let f = at.fields("a skin", &["thickness", "open"])?;
    let thickness = f.need("thickness", "how far below the surface it reaches, mm")?;
    Ok(SkinSpec {
        thickness: grade(thickness)?,
        open: f.read("open", Vec::new(), |at| {
            let sides = at.list("a list of sides such as [\"-z\"], or of half-spaces")?;
            sides.iter().map(opening).collect()
        })?,
    })
}

fn opening(at: &At) -> Read<OpenSpec> {
    if at.is_text() {
        return Ok(OpenSpec::Side(at.word_or("side", &SideSpec::ALL, &SIDES)?));
    }
    Ok(OpenSpec::Plane(HalfSpaceKind::read(at)?))
}

fn keeps(at: &At) -> Read<Keeps> {
    let mut keeps = Keeps::new();
    for (name, at) in at.entries("regions by name, such as [keep.boss.cylinder]")? {
        // A kind where a name should be.
        if RegionKind::keys().iter().any(|k| k.name == name) && region(&at).is_err() {
            let message = format!("a name comes first, such as [keep.boss.{name}]: {name} is a kind of region");
            return Err(at.error(message));
        }
        keeps.insert(name.to_string(), region(&at)?);
    }
    Ok(keeps)
}

/// What others call the parts.
const PARTS: [(&str, &str); 14] = [
    ("wall", "sheet"),
    ("shell", "sheet"),
    ("surface", "sheet"),
    ("double", "sheet"),
    ("network", "lower"),
    ("skeletal", "lower"),
    ("skeleton", "lower"),
    ("strut", "lower"),
    ("solid", "lower"),
    ("below", "lower"),
    ("negative", "lower"),
    ("above", "upper"),
    ("positive", "upper"),
    ("over", "upper"),
];

/// Keys that stand one level deeper, where beginners look for them: the key and its table.
const DEEPER: [(&str, &str); 8] = [
    ("iso", "level"),
    ("fraction", "level"),
    ("porosity", "level"),
    ("thickness", "level"),
    ("mid", "level"),
    ("wavelength", "map.affine"),
    ("rotate", "map.affine"),
    ("offset", "map.affine"),
];

fn lattice(at: &At) -> Read<LatticeSpec> {
    for (key, entry) in at.entries("a lattice")? {
        if let Some((_, table)) = DEEPER.iter().find(|d| d.0 == key) {
            return Err(entry.error(format!("{key} goes under [{}.{table}]", at.path)));
        }
    }
    let f = at.fields("a lattice", &["cell", "part", "map", "level"])?;
    let parts = [("sheet", PartSpec::Sheet), ("lower", PartSpec::Lower), ("upper", PartSpec::Upper)];
    Ok(LatticeSpec {
        cell: cell(f.need("cell", "such as cell = \"gyroid\"")?)?,
        part: f.need("part", "sheet (|f| ≤ t), lower (f ≤ t) or upper (f ≥ t)")?.word_or("part", &parts, &PARTS)?,
        map: map(f.need("map", "such as map.affine with wavelength = 4")?)?,
        level: level(f.need("level", AMOUNTS)?)?,
    })
}

/// The cell in a tree of its own.
pub(super) fn cell_in(node: &Node) -> Read<CellSpec> {
    let mut at = At::root(node);
    at.path = "cell".into();
    cell(&at)
}

fn cell(at: &At) -> Read<CellSpec> {
    if at.is_text() {
        let names: Vec<(&str, &str)> = catalogue().iter().map(|n| (n.name, n.name)).collect();
        let word = at.text("a name")?;
        if ::beams::graph::named(word).is_some() && crate::cell::named(word).is_none() {
            let message =
                format!("{word} is a cell of beams, not a surface; write [beams.NAME] with cell = \"{word}\"");
            return Err(at.error(message));
        }
        return Ok(CellSpec::Name(at.word("cell", &names)?.to_string()));
    }
    let (kind, at) = at.kind("cell", &["series", "file", "tet"])?;
    if kind == "file" {
        let f = at.fields("a cell from a file", &["path", "terms"])?;
        let path = f.need("path", "numbers (npy) or a mesh of one cell")?;
        return Ok(CellSpec::Kind(CellKind::File(FileCellSpec {
            path: path.text("a path")?.to_string(),
            terms: f.read("terms", 200.0, At::number)?,
        })));
    }
    if kind == "tet" {
        return Ok(CellSpec::Kind(CellKind::Tet(tet(&at)?)));
    }
    let f = at.fields("a series", &["terms", "group"])?;
    let terms = f.need("terms", "a list of { hkl = [h, k, l], amplitude = 1, phase = 0 }")?;
    let terms = terms.list("a list of terms")?.iter().map(term).collect::<Read<Vec<_>>>()?;
    let group = f.get("group").map(group).transpose()?;
    Ok(CellSpec::Kind(CellKind::Series(SeriesSpec { group, terms })))
}

/// The name of a ready tetrahedral cell. Of a periodic cell that can be none it says why.
fn tet_name(at: &At) -> Read<&'static str> {
    let names: Vec<(&str, &'static str)> = tet_catalogue().iter().map(|n| (n.name, n.name)).collect();
    at.word("tetrahedral cell", &names).map_err(|e| {
        let periodic = at.text("").ok().and_then(named);
        let group = periodic.and_then(|n| Group::named(n.number()).ok());
        match group.map(|g| g.tetrahedral_sites()) {
            Some(Err(why)) => DesignError { message: format!("{}. {}", why.message, e.message), ..e },
            _ => e,
        }
    })
}

fn tet(at: &At) -> Read<TetCellSpec> {
    let own = ["group", "terms", "site", "dual", "edge"];
    let mut keys = vec!["name", "zones"];
    keys.extend(own);
    let f = at.fields("a tetrahedral cell", &keys)?;
    if let Some(zones) = f.get("zones") {
        if let Some(other) = ["name"].iter().chain(&own).find_map(|k| f.get(k)) {
            return Err(other.error("with zones every cell is a ready one, by its name; leave this out"));
        }
        let mut of = BTreeMap::new();
        for (zone, at) in zones.entries("a ready cell for each zone, such as { 1 = \"diamond\" }")? {
            of.insert(zone.to_string(), tet_name(&at)?.to_string());
        }
        return Ok(TetCellSpec { zones: of, ..TetCellSpec::default() });
    }
    if let Some(name) = f.get("name") {
        if let Some(other) = own.iter().find_map(|k| f.get(k)) {
            let message = "a ready cell has its own group, terms, site and edge; give a name or these";
            return Err(other.error(message));
        }
        return Ok(TetCellSpec { name: Some(tet_name(name)?.to_string()), ..TetCellSpec::default() });
    }
    let terms = f.need("terms", "a list of { hkl = [h, k, l] }, or a ready cell's name")?;
    let terms = terms.list("a list of terms")?;
    Ok(TetCellSpec {
        name: None,
        group: Some(group(f.need("group", "a space group such as 221 or \"227:2\"")?)?),
        terms: terms.iter().map(term).collect::<Read<Vec<_>>>()?,
        site: f.read("site", None, |at| three(at).map(Some))?,
        dual: f.read("dual", false, At::truth)?,
        edge: Some(f.need("edge", "the tetrahedron's edge in edges of the cubic cell")?.number()?),
        zones: BTreeMap::new(),
    })
}

/// A space group's symbol, which may be its number.
fn group(at: &At) -> Read<String> {
    if !at.is_number() {
        return Ok(at.text("a space group such as 227, \"227:2\" or \"Fd-3m\"")?.to_string());
    }
    match at.number()? {
        n if n.fract() == 0.0 && n.abs() < 1e6 => Ok(format!("{n}")),
        n => Err(at.error(format!("expected a space group, found {n}; they are numbered from 1 to 230"))),
    }
}

fn term(at: &At) -> Read<TermSpec> {
    let f = at.fields("a term", &["hkl", "amplitude", "phase", "component"])?;
    let components = [("re", Component::Re), ("im", Component::Im)];
    let hkl = f.need("hkl", "three whole numbers")?;
    let numbers: [f64; 3] = hkl.numbers("three whole numbers [h, k, l]")?;
    if numbers.iter().any(|v| v.fract() != 0.0 || v.abs() > 1e6) {
        return Err(hkl.error(format!("expected three whole numbers, found {numbers:?}")));
    }
    Ok(TermSpec {
        hkl: numbers.map(|v| v as i32),
        amplitude: f.read("amplitude", 1.0, At::number)?,
        phase: f.read("phase", 0.0, At::number)?,
        component: f.read("component", Component::Re, |at| at.word("component", &components))?,
    })
}

fn level(at: &At) -> Read<LevelSpec> {
    let f = at.fields("a level", &["iso", "fraction", "porosity", "thickness", "of", "fit", "mid"])?;
    let given: Vec<_> =
        ["iso", "fraction", "porosity", "thickness"].into_iter().filter_map(|k| Some((k, f.get(k)?))).collect();
    let amount = match given.as_slice() {
        [] => {
            return Err(f.at.error(format!("no amount given; give {AMOUNTS}")));
        }
        [(key, value)] => {
            let value = grade(value)?;
            match *key {
                "iso" => AmountSpec::Iso(value),
                "fraction" => AmountSpec::Fraction(value),
                "porosity" => AmountSpec::Porosity(value),
                _ => AmountSpec::Thickness(value),
            }
        }
        several => {
            let names: Vec<&str> = several.iter().map(|g| g.0).collect();
            let message = format!("{} at once; give {AMOUNTS}", names.join(" and "));
            return Err(several[1].1.error(message));
        }
    };
    let of = f.read("of", Of::Cell, |at| at.word("word", &[("cell", Of::Cell), ("part", Of::Part)]))?;
    let fit = f.read("fit", Fit::Table, |at| at.word("fit", &[("table", Fit::Table), ("spartan", Fit::Spartan)]))?;
    let mid = f.read("mid", 0.0, At::number)?;
    Ok(LevelSpec { amount, of, fit, mid })
}
