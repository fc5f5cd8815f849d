//! Maps: tree to data.

use std::collections::BTreeMap;

use super::grade::control;
use super::{Read, grade, region, three};
use crate::design::data::*;
use crate::kind::{At, Fields, Kind};
use geometry::fault::counted;

/// Ways to say how cells are turned, of which one is given.
const TURNS: [&str; 7] = ["rotate", "rotate_x", "rotate_y", "rotate_z", "direction", "frame", "stress"];

pub(super) fn map(at: &At) -> Read<MapSpec> {
    let (kind, at) = at.kind("map", &["affine", "spartan", "phase", "cylinder", "sphere", "sweep", "tets"])?;
    if kind == "tets" {
        return Ok(MapSpec::Tets(tets(&at)?));
    }
    if kind == "phase" {
        return Ok(MapSpec::Phase(Box::new(phase(&at)?)));
    }
    if kind == "cylinder" {
        let f = at.fields("a map round an axis", &["wavelength", "around", "center", "axis"])?;
        let wavelength =
            f.need("wavelength", "the cell's edge in mm along the radius and the axis, one number or two")?;
        return Ok(MapSpec::Cylinder(CylinderMapSpec {
            wavelength: if wavelength.is_list() {
                OneOrTwo::Two(wavelength.numbers("one number or two, mm")?)
            } else {
                OneOrTwo::One(wavelength.number()?)
            },
            around: f.need("around", "the whole number of cells around")?.number()?,
            center: f.read("center", [0.0; 3], three)?,
            axis: f.read("axis", [0.0, 0.0, 1.0], three)?,
        }));
    }
    if kind == "sweep" {
        let keys = ["wavelength", "points", "path", "closed", "normal"];
        let f = at.fields("a map along a line", &keys)?;
        let wavelength =
            f.need("wavelength", "the cell's edge in mm, one number or three: two across the line and one along it")?;
        return Ok(MapSpec::Sweep(SweepSpec {
            wavelength: if wavelength.is_list() {
                OneOrThree::Three(wavelength.numbers("one number or three, mm")?)
            } else {
                OneOrThree::One(wavelength.number()?)
            },
            points: control(&f)?,
            closed: f.read("closed", false, At::truth)?,
            normal: f.read("normal", None, |at| three(at).map(Some))?,
        }));
    }
    if kind == "sphere" {
        let f = at.fields("a map about a centre", &["wavelength", "around", "center", "axis"])?;
        return Ok(MapSpec::Sphere(SphereMapSpec {
            wavelength: f.need("wavelength", "the cell's edge in mm along the radius")?.number()?,
            around: f.need("around", "the even number of cells round the equator")?.number()?,
            center: f.read("center", [0.0; 3], three)?,
            axis: f.read("axis", [0.0, 0.0, 1.0], three)?,
        }));
    }
    if kind == "spartan" {
        let f = at.fields("a spartan map", &["wavelength", "rotate", "offset"])?;
        let (wavelength, rotate, offset) = common(&f)?;
        return Ok(MapSpec::Spartan(SpartanSpec { wavelength, rotate, offset }));
    }
    let f = at.fields("an affine map", &["wavelength", "rotate", "offset", "skew"])?;
    let (wavelength, rotate, offset) = common(&f)?;
    Ok(MapSpec::Affine(AffineSpec { wavelength, rotate, offset, skew: f.read("skew", SkewSpec::default(), skew)? }))
}

/// What others call the meshers.
const MESHERS: [(&str, &str); 3] = [("wildmeshing", "ftetwild"), ("tetwild", "ftetwild"), ("stuffing", "background")];

pub(super) fn tets(at: &At) -> Read<TetsSpec> {
    let keys = ["size", "mesher", "limit", "zones", "path", "unit", "split", "overlap", "method"];
    let f = at.fields("a map over tetrahedra", &keys)?;
    let methods = [("explicit", Method::Explicit), ("implicit", Method::Implicit)];
    let joined = Joined {
        overlap: f.read("overlap", 0.0, At::number)?,
        method: f.read("method", Method::Explicit, |at| at.word("method", &methods))?,
    };
    let found = |keys: &[&str]| keys.iter().find_map(|k| f.get(k));
    let made = found(&["size", "mesher", "limit", "zones"]);
    if let (Some(_), Some(path)) = (made, f.get("path")) {
        return Err(path.error("a tetrahedral mesh is either made, with size, or read, from path; found both"));
    }
    if let Some(path) = f.get("path") {
        return Ok(TetsSpec::File(TetFileSpec {
            path: path.text("a path")?.to_string(),
            unit: f.read("unit", None, |at| Unit::read(at).map(Some))?,
            split: f.read("split", false, At::truth)?,
            joined,
        }));
    }
    if let Some(of_file) = found(&["unit", "split"]) {
        return Err(of_file.error("this belongs to a mesh from a file, and there is no path"));
    }
    let meaning = "the tetrahedra's edge in mm, a number or a grade (or give path, to a mesh of your own)";
    let size = grade(f.need("size", meaning)?)?;
    let meshers = [("background", MesherSpec::Background), ("ftetwild", MesherSpec::FTetWild)];
    Ok(TetsSpec::Made(MadeTetsSpec {
        size,
        mesher: f.read("mesher", MesherSpec::Background, |at| at.word_or("mesher", &meshers, &MESHERS))?,
        limit: f.read("limit", 600.0, At::number)?,
        zones: f.read("zones", BTreeMap::new(), zones)?,
        joined,
    }))
}

fn zones(at: &At) -> Read<BTreeMap<String, RegionKind>> {
    let of = at.entries("regions by the zone's number, such as { 1 = { sphere = { radius = 5 } } }")?;
    of.into_iter()
        .map(|(zone, at)| match zone.parse::<u32>() {
            Ok(n) if n.to_string() == zone => Ok((zone.to_string(), region(&at)?)),
            _ => Err(at.error(format!("a zone is a whole number from 0; found \"{zone}\""))),
        })
        .collect()
}

fn common(f: &Fields) -> Read<(OneOrThree, [f64; 3], [f64; 3])> {
    let wavelength = f.need("wavelength", "the cell's edge in mm, one number or three")?;
    let wavelength = if wavelength.is_list() {
        OneOrThree::Three(wavelength.numbers("one number or three, mm")?)
    } else {
        OneOrThree::One(wavelength.number()?)
    };
    Ok((wavelength, f.read("rotate", [0.0; 3], three)?, f.read("offset", [0.0; 3], three)?))
}

fn skew(at: &At) -> Read<SkewSpec> {
    let f = at.fields("shears in degrees", &["xy", "xz", "yx", "yz", "zx", "zy"])?;
    let angle = |key| f.read(key, 0.0, At::number);
    Ok(SkewSpec {
        xy: angle("xy")?,
        xz: angle("xz")?,
        yx: angle("yx")?,
        yz: angle("yz")?,
        zx: angle("zx")?,
        zy: angle("zy")?,
    })
}

fn phase(at: &At) -> Read<PhaseSpec> {
    let mut keys = vec!["wavelength"];
    keys.extend(TURNS);
    keys.extend(["weight", "angle_weight", "offset", "step", "domain", "folds"]);
    let f = at.fields("a phase map", &keys)?;
    let given: Vec<&str> = TURNS.into_iter().filter(|k| f.get(k).is_some()).collect();
    if let [first, rest @ ..] = given.as_slice() {
        let single = |k: &str| k.starts_with("rotate_");
        if let Some(other) = rest.iter().find(|k| !(single(first) && single(k))) {
            let message = format!(
                "{first} and {other} at once; cells are turned by exactly one of rotate (or rotate_x, rotate_y, rotate_z), direction, frame, stress"
            );
            return Err(f.need(other, "")?.error(message));
        }
    }
    let maybe = |key: &str| f.read(key, None, |at| grade(at).map(Some));
    let wavelength = f.need("wavelength", "the cell's edge in mm, one number or three; each may vary")?;
    let domains = [("region", Domain::Region), ("box", Domain::Box)];
    Ok(PhaseSpec {
        wavelength: if wavelength.is_list() {
            GradeOrThree::Three(Box::new(grades(wavelength, "one number or three, mm")?))
        } else {
            GradeOrThree::One(grade(wavelength)?)
        },
        rotate: f.read("rotate", None, |at| grades(at, "three angles [x, y, z] in degrees").map(Some))?,
        rotate_x: maybe("rotate_x")?,
        rotate_y: maybe("rotate_y")?,
        rotate_z: maybe("rotate_z")?,
        direction: f.read("direction", None, |at| vector(at).map(Some))?,
        frame: f.read("frame", None, |at| {
            let f = at.fields("a frame", &["x", "z"])?;
            Ok(Some(FrameSpec {
                x: vector(f.need("x", "the direction of the cell's x axis")?)?,
                z: vector(f.need("z", "the direction of the cell's z axis")?)?,
            }))
        })?,
        stress: f.read("stress", None, |at| tensor(at).map(Some))?,
        weight: maybe("weight")?,
        angle_weight: f.read("angle_weight", 1.0, At::number)?,
        offset: f.read("offset", [0.0; 3], three)?,
        step: f.read("step", None, |at| at.number().map(Some))?,
        domain: f.read("domain", Domain::Region, |at| at.word("domain", &domains))?,
        folds: f.read("folds", false, At::truth)?,
    })
}

fn vector(at: &At) -> Read<VectorSpec> {
    if !at.is_list() {
        let f = at.fields("a vector", &["field"])?;
        let field = f.need("field", "an array of three numbers of a result")?;
        return Ok(VectorSpec::Field(VectorField { field: super::grade::field(field)? }));
    }
    grades(at, "three numbers [x, y, z], each of which may vary").map(|g| VectorSpec::Components(Box::new(g)))
}

fn tensor(at: &At) -> Read<TensorSpec> {
    if !at.is_list() {
        let f = at.fields("a tensor", &["field", "order"])?;
        let field = f.need("field", "an array of six or nine numbers of a result")?;
        let orders = [("vtk", TensorOrder::Vtk), ("voigt", TensorOrder::Voigt)];
        return Ok(TensorSpec::Field(TensorField {
            field: super::grade::field(field)?,
            order: f.read("order", TensorOrder::Vtk, |at| at.word("order", &orders))?,
        }));
    }
    grades(at, "six numbers [11, 22, 33, 23, 13, 12], each of which may vary")
        .map(|g| TensorSpec::Components(Box::new(g)))
}

/// A list of numbers, each of which may vary.
fn grades<const N: usize>(at: &At, what: &str) -> Read<[GradeSpec; N]> {
    let items = at.list(what)?;
    let found = items.len();
    let read = items.iter().map(grade).collect::<Read<Vec<GradeSpec>>>()?;
    read.try_into().map_err(|_| at.error(format!("expected {what}, found {}", counted(found, "value"))))
}
