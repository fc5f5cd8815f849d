//! Nodes, struts and radii: data to numbers that can be beams.

use rayon::prelude::*;

use crate::design::data::*;
use crate::design::grade::{Allowed, grade};
use crate::design::level::check_varied;
use crate::design::place::{Place, finite};
use crate::design::samples;
use crate::grade::Grade;
use crate::kind::DesignError;
use ::beams::graph::{self, Graph, Nodes, Profile, Radii, Wireframe};
use ::beams::quador::Pencil;
use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, norm, sub};

/// Nodes within this share of the mean length of struts are one.
const ONE: f64 = 1e-6;
/// Refuses beams that no quadric makes, with the place of the first and how many there are.
pub(super) fn check_beams(graph: &Graph, spec: &BeamsSpec) -> Result<(), Fault> {
    let wrong: Vec<(usize, Fault)> = (graph.beams.par_iter().enumerate())
        .filter_map(|(i, b)| {
            let [a, z] = b.ends.map(|n| graph.hubs[n as usize]);
            let length = norm(sub(z.center, a.center));
            let made = Pencil::new(length, [a.radius, z.radius], b.profile);
            made.err().map(|f| (i, f))
        })
        .collect();
    let Some((first, fault)) = wrong.first() else {
        return Ok(());
    };
    let [from, to] = graph.beams[*first].ends.map(|n| graph::position_text(graph.hubs[n as usize].center));
    let more = match wrong.len() {
        1 => String::new(),
        n => format!(" ({} in all)", counted(n, "such beam")),
    };
    // What stands in the design is the profile, or else the radii.
    let key = match (spec.profile, &spec.hub) {
        (Some(_), _) if fault.at == "profile" => "profile",
        (_, Some(_)) => "hub",
        _ if spec.radius.is_some() => "radius",
        _ => "nodes",
    };
    let message = format!("the beam from {from} to {to}: {}{more}", fault.message);
    Err(Fault::new(key, message))
}

pub(super) fn radii(spec: &BeamsSpec, place: &Place) -> Result<Radii<Grade>, DesignError> {
    let varied = |spec: &Option<GradeSpec>, key: &'static str| {
        let Some(spec) = spec else { return Ok(None) };
        let path = format!("{}.{key}", place.path);
        let allowed = Allowed::Positive(key);
        let made = grade(spec, &path, place, allowed, false)?;
        if let GradeSpec::Kind(GradeKind::Formula(_)) = spec {
            check_varied(&made, &format!("{path}.formula"), allowed, false, place)?;
        }
        Ok(Some(made))
    };
    let positive = |v: f64, kind: &str| {
        let path = format!("{}.profile.{kind}", place.path);
        Allowed::Positive(if kind == "waist" { "waist" } else { "lambda" }).check(&path, v, "")
    };
    let profile = match spec.profile {
        None => None,
        Some(ProfileSpec::Cone) => Some(Profile::Cone),
        Some(ProfileSpec::Cylinder) => Some(Profile::Cylinder),
        Some(ProfileSpec::Waist(v)) => Some(Profile::Waist(positive(v, "waist")?)),
        Some(ProfileSpec::Lambda(v)) => Some(Profile::Lambda(positive(v, "lambda")?)),
    };
    Ok(Radii { radius: varied(&spec.radius, "radius")?, hub: varied(&spec.hub, "hub")?, profile })
}

/// The greatest value at points in the region.
pub(super) fn greatest(grade: &Grade, place: &Place) -> f64 {
    let mut values = vec![0.0; place.points.len()];
    grade.values(place.points, &mut values);
    values.into_iter().fold(0.0, f64::max)
}

/// A bound of the radius of balls in the region.
pub(super) fn thickest(radii: &Radii<Grade>, bounds: &Aabb, place: &Place) -> f64 {
    let most = |g: &Grade| match g.bound(bounds).hi {
        v if v.is_finite() => v,
        _ => 2.0 * greatest(g, place),
    };
    let of = [&radii.radius, &radii.hub].into_iter().flatten();
    of.map(most).fold(0.0, f64::max).min(norm(bounds.size()))
}

pub(super) fn mean_length(wire: &Wireframe) -> f64 {
    let total: f64 = wire.struts.iter().map(|s| wire.length(*s)).sum();
    total / wire.struts.len().max(1) as f64
}

pub(super) fn merging(spec: &BeamsSpec, mean: f64, place: &Place) -> Result<f64, DesignError> {
    match spec.merge {
        None => Ok(ONE * mean),
        Some(v) if v >= 0.0 && v.is_finite() => Ok(v),
        Some(v) => {
            let message = format!("merge is {} mm; it must be a finite number, 0 or more", number(v));
            Err(DesignError::new(format!("{}.merge", place.path), message).found(number(v)))
        }
    }
}

/// Refuses a frame of which nothing is left.
pub(super) fn check_left(wire: &Wireframe, key: &str, place: &Place) -> Result<(), DesignError> {
    if !wire.struts.is_empty() {
        return Ok(());
    }
    let message = match key {
        "dangling" => {
            "no beam is left once those with a free end are dropped: none of them lies on a closed way".into()
        }
        "struts" => "no beam has two different ends".to_string(),
        _ => {
            let b = place.region.bounds();
            let corner = |v: Vec3| v.map(number).join(", ");
            format!("no beam lies in the region, which reaches from ({}) to ({}) mm", corner(b.min), corner(b.max))
        }
    };
    Err(DesignError::new(format!("{}.{key}", place.path), message))
}

/// Nodes and struts of the user's own.
pub(super) fn tables(spec: &BeamsSpec, place: &Place) -> Result<(Wireframe, Vec<f64>), DesignError> {
    let below = |key: &str| format!("{}.{key}", place.path);
    let read = |path: &str, key: &str| samples::bytes(path, &below(key), place);
    let wrong =
        |path: &str, key: &str, f: Fault| DesignError::new(below(key), format!("{path}: {}", f.message)).found(path);
    let nodes = match &spec.nodes {
        Some(NodesSpec::Path(path)) => {
            let text = read(path, "nodes")?;
            graph::nodes(&String::from_utf8_lossy(&text)).map_err(|f| wrong(path, "nodes", f))?
        }
        Some(NodesSpec::Rows(rows)) => given(rows, &below("nodes"))?,
        None => Nodes::default(),
    };
    let wire = match &spec.struts {
        Some(StrutsSpec::Path(path)) => {
            let text = read(path, "struts")?;
            let text = String::from_utf8_lossy(&text);
            graph::struts(&text, &nodes).map_err(|f| wrong(path, "struts", f))?
        }
        Some(StrutsSpec::Rows(rows)) => {
            for (i, n) in rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |n| (i, n))) {
                if *n as usize >= nodes.positions.len() {
                    let message = format!(
                        "there is no node {n}; there are {}, counted from 0",
                        counted(nodes.positions.len(), "node")
                    );
                    let at = format!("{}[{i}]", below("struts"));
                    return Err(DesignError::new(at, message).found(n.to_string()));
                }
            }
            Wireframe { nodes: nodes.positions.clone(), struts: rows.clone() }
        }
        None => Wireframe::default(),
    };
    if spec.radius.is_none() && spec.hub.is_none() && nodes.radii.is_empty() {
        let message = "\"radius\" is missing, and no node has a radius of its own: of a beam at mid length, mm";
        return Err(DesignError::new(&place.path, message));
    }
    Ok((wire, nodes.radii))
}

/// Nodes that stand in the design.
pub(in crate::design) fn given(rows: &[RowSpec], path: &str) -> Result<Nodes, DesignError> {
    let mut nodes = Nodes::default();
    for (i, row) in rows.iter().enumerate() {
        let (at, radius) = match *row {
            RowSpec::Place(p) => (p, None),
            RowSpec::Ball([x, y, z, r]) => ([x, y, z], Some(r)),
        };
        let path = format!("{path}[{i}]");
        for v in at {
            finite(&path, v)?;
        }
        if let Some(r) = radius {
            Allowed::Positive("radius").check(&path, r, "")?;
        }
        nodes.positions.push(at);
        nodes.radii.push(radius.unwrap_or(f64::NAN));
        nodes.names.insert(i.to_string(), i as u32);
    }
    if nodes.radii.iter().all(|r| r.is_nan()) {
        nodes.radii.clear();
    }
    Ok(nodes)
}
