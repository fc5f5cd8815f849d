//! Nodes, struts and radii: data to numbers that can be beams.

use rayon::prelude::*;

use crate::design::data::*;
use crate::environment::Environment;
use crate::grade::Grade;
use crate::grade::{Quantity, key_of};
use crate::kind::DesignError;
use ::beams::graph::{self, GivenRadii, Graph, Nodes, Profile, Radii, Wireframe};
use ::beams::quador::Pencil;
use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Vec3, norm, sub};

/// Refuses beams that have no quadric, with the position of the first and their number.
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
    let key = key_of_fault(&fault.at, spec);
    let message = format!("the beam from {from} to {to}: {}{more}", fault.message);
    Err(Fault::new(key, message))
}

/// The key of a design that gives what is wrong with a beam: the profile, the radius at mid length, or else that of hubs.
pub(in crate::design) fn key_of_fault(at: &str, spec: &BeamsSpec) -> &'static str {
    match at {
        "profile" if spec.profile.is_some() => return "profile",
        "radius" if spec.radius.is_some() => return "radius",
        "radius" if spec.fraction.is_some() => return "fraction",
        "hub" if own_radii(spec) => return "pattern.nodes",
        _ => {}
    }
    match spec.graph {
        _ if spec.hub.is_some() => "hub",
        _ if spec.radius.is_some() => "radius",
        _ if spec.fraction.is_some() => "fraction",
        GraphSpec::File(_) => "path",
        GraphSpec::Pattern(_) => "pattern.nodes",
        _ => "nodes",
    }
}

/// Whether nodes of a pattern have radii of their own.
fn own_radii(spec: &BeamsSpec) -> bool {
    let GraphSpec::Pattern(of) = &spec.graph else { return false };
    of.pattern.nodes.0.iter().any(|row| matches!(row, RowSpec::Ball(_)))
}

pub(super) fn radii(spec: &BeamsSpec, environment: &Environment) -> Result<Radii<Grade>, DesignError> {
    let varied = |spec: &Option<GradeSpec>, key: &str| {
        let quantity = Quantity::new(format!("{}.{key}", environment.path), environment, key_of::<BeamsSpec>(key));
        spec.as_ref().map(|spec| spec.build(&quantity)).transpose()
    };
    let profile = spec.profile.map(profile);
    Ok(Radii { radius: varied(&spec.radius, "radius")?, hub: varied(&spec.hub, "hub")?, profile })
}

pub(super) fn profile(spec: ProfileSpec) -> Profile {
    match spec {
        ProfileSpec::Cone => Profile::Cone,
        ProfileSpec::Cylinder => Profile::Cylinder,
        ProfileSpec::Waist(v) => Profile::Waist(v),
        ProfileSpec::Lambda(v) => Profile::Lambda(v),
    }
}

/// The greatest value at points in the region.
pub(super) fn greatest(grade: &Grade, environment: &Environment) -> f64 {
    let mut values = vec![0.0; environment.points.len()];
    grade.values(environment.points, &mut values);
    values.into_iter().fold(0.0, f64::max)
}

/// A bound of the radius of balls in the region.
pub(super) fn thickest(radii: &Radii<Grade>, bounds: &Aabb, environment: &Environment) -> f64 {
    let most = |g: &Grade| match g.bound(bounds).hi {
        v if v.is_finite() => v,
        _ => 2.0 * greatest(g, environment),
    };
    let of = [&radii.radius, &radii.hub].into_iter().flatten();
    of.map(most).fold(0.0, f64::max).min(norm(bounds.size()))
}

pub(super) fn mean_length(wire: &Wireframe) -> f64 {
    let total: f64 = wire.struts.iter().map(|s| wire.length(*s)).sum();
    total / wire.struts.len().max(1) as f64
}

/// Refuses an empty frame.
pub(super) fn check_left(wire: &Wireframe, key: &str, environment: &Environment) -> Result<(), DesignError> {
    if !wire.struts.is_empty() {
        return Ok(());
    }
    let message = match key {
        "dangling" => {
            "no beam is left once those with a free end are dropped: none of them lies on a closed way".into()
        }
        "struts" | "path" => "no beam has two different ends".to_string(),
        _ => {
            let b = environment.region.bounds();
            let corner = |v: Vec3| v.map(number).join(", ");
            format!("no beam lies in the region, which reaches from ({}) to ({}) mm", corner(b.min), corner(b.max))
        }
    };
    Err(DesignError::new(format!("{}.{key}", environment.path), message))
}

/// Explicit nodes and struts.
pub(super) fn tables(
    graph: &NodeGraph,
    spec: &BeamsSpec,
    environment: &Environment,
) -> Result<(Wireframe, GivenRadii), DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let read = |path: &str, key: &str| environment.load(path, &below(key));
    let wrong =
        |path: &str, key: &str, f: Fault| DesignError::new(below(key), format!("{path}: {}", f.message)).found(path);
    let nodes = match &graph.nodes {
        NodesSpec::Path(path) => {
            let text = read(path, "nodes")?;
            graph::nodes(&String::from_utf8_lossy(&text)).map_err(|f| wrong(path, "nodes", f))?
        }
        NodesSpec::Rows(rows) => given(rows),
    };
    let wire = match &graph.struts {
        StrutsSpec::Path(path) => {
            let text = read(path, "struts")?;
            let text = String::from_utf8_lossy(&text);
            graph::struts(&text, &nodes).map_err(|f| wrong(path, "struts", f))?
        }
        StrutsSpec::Rows(pairs) => {
            let struts = numbered(pairs, nodes.positions.len(), &below("struts"))?;
            Wireframe { nodes: nodes.positions.clone(), struts }
        }
    };
    if spec.fraction.is_some() && !nodes.radii.is_empty() {
        let message =
            "with fraction the radius of all beams is solved for; leave out the radii of nodes, or give radius";
        return Err(DesignError::new(below("nodes"), message));
    }
    if spec.radius.is_none() && spec.fraction.is_none() && spec.hub.is_none() && nodes.radii.is_empty() {
        let message = "\"radius\" is missing (mm, of beams at mid length), and no node has one";
        return Err(DesignError::new(&environment.path, message));
    }
    Ok((wire, GivenRadii { nodes: nodes.radii, struts: Vec::new() }))
}

/// Struts listed in the design, between some of `count` nodes.
fn numbered(pairs: &Pairs, count: usize, path: &str) -> Result<Vec<[u32; 2]>, DesignError> {
    let mut struts = Vec::with_capacity(pairs.0.len());
    for (i, ids) in pairs.0.iter().enumerate() {
        if let Some(NodeId(n)) = ids.iter().find(|id| id.0 < 0 || id.0 as usize >= count) {
            let all =
                if count == 1 { "its number is 0".into() } else { format!("their numbers are 0 to {}", count - 1) };
            let are = if count == 1 { "is" } else { "are" };
            let message = format!("there is no node {n}; there {are} {}, {all}", counted(count, "node"));
            return Err(DesignError::new(format!("{path}[{i}]"), message).found(n.to_string()));
        }
        struts.push(ids.map(|id| id.0 as u32));
    }
    Ok(struts)
}

/// Nodes listed in the design.
pub(in crate::design) fn given(rows: &NodeRows) -> Nodes {
    let mut nodes = Nodes::default();
    for (i, row) in rows.0.iter().enumerate() {
        let (at, radius) = match *row {
            RowSpec::Place(p) => (p, f64::NAN),
            RowSpec::Ball([x, y, z, r]) => ([x, y, z], r),
        };
        nodes.positions.push(at);
        nodes.radii.push(radius);
        nodes.names.insert(i.to_string(), i as u32);
    }
    if nodes.radii.iter().all(|r| r.is_nan()) {
        nodes.radii.clear();
    }
    nodes
}
