//! Beams: data to a graph and its field, and what is to be said of it.

use std::sync::Arc;

use rayon::prelude::*;
use serde_json::{Value as Json, json};

use super::data::*;
use super::error::DesignError;
use super::grade::{Allowed, grade};
use super::level::check_varied;
use super::pattern;
use super::place::{LOOKS, Place};
use super::{Built, Warning};
use super::{map, sample, samples};
use crate::fault::{Fault, counted, number};
use crate::field::Field;
use crate::grade::Grade;
use crate::graph::{self, Cleaned, Graph, Nodes, Profile, Radii, Trim, Wire, sized};
use crate::math::{Aabb, Vec3, norm, sub};
use crate::pattern::Laid;
use crate::quador::pencil::Pencil;
use crate::quador::{Fillet, Quadors};
use crate::truss::{Beams, Truss};

/// Ends of beams within this share of the region's size of its surface lie on it.
const ON: f64 = 1e-9;
/// Nodes within this share of the mean length of struts are one.
const ONE: f64 = 1e-6;
/// An angle between beams (degrees) below which it is warned of.
const NARROW: f64 = 15.0;

/// The beams of a design, filling the region.
pub(super) fn beams(
    spec: &BeamsSpec,
    place: &Place,
    warnings: &mut Vec<Warning>,
) -> Result<Beams, DesignError> {
    if let Some(pattern) = &spec.pattern {
        return pattern::laid(spec, pattern, place, warnings).map(|p| Beams::Pattern(Arc::new(p)));
    }
    let fault = |f: Fault| DesignError::fault(&place.path, f);
    let radii = radii(spec, place)?;
    let Frame {
        mut wire,
        mut own,
        wavelength,
        reach,
    } = frame(spec, &radii, place, warnings)?;
    let mut cleaned = wire.clean(merging(spec, mean_length(&wire), place)?, &mut own);
    let source = if spec.cell.is_some() { "map" } else { "struts" };
    check_left(&wire, source, place)?;
    if spec.cell.is_none() {
        tell_cleaned(&cleaned, &place.path, warnings);
    }
    let trim = match spec.trim {
        TrimSpec::Cut => Trim::Cut,
        TrimSpec::Drop => Trim::Drop,
        TrimSpec::Snap => Trim::Snap,
    };
    let space: &dyn Field = &**place.region;
    let slack = ON * norm(place.region.bounds().size());
    let trimmed = trim.apply(&mut wire, space, reach, slack, &mut own);
    check_left(&wire, "trim", place)?;
    let held = |p: Vec3| space.value(p) >= -slack;
    if spec.dangling == DanglingSpec::Drop {
        cleaned.dangling = wire.drop_dangling(&held, &mut own);
        check_left(&wire, "dangling", place)?;
    }
    let graph = sized(&wire, &own, &radii).map_err(fault)?;
    check_beams(&graph, spec).map_err(fault)?;
    let quadors = Quadors::new(&graph, fillet(spec.fillet)).map_err(fault)?;
    let inside = |p: Vec3| space.value(p) <= slack;
    let fillets: Vec<(usize, f64)> = (0..quadors.len())
        .into_par_iter()
        .filter(|i| spec.fillet != FilletSpec::None && inside(quadors.center(*i)))
        .map(|i| (i, quadors.fillet_radius(i)))
        .filter(|f| f.1.is_finite())
        .collect();
    let narrow = fillets.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
    let wide = fillets.iter().map(|f| f.1).fold(0.0, f64::max);
    let mut collisions = quadors.collisions();
    collisions.retain(|c| inside(c.at));
    let truss = Truss {
        whole: whole(&quadors, space),
        collisions,
        facts: wire.facts(&inside),
        fillet: (!fillets.is_empty()).then_some([narrow, wide]),
        cell: spec.cell.as_deref().and_then(graph::named).map(|u| u.name),
        graph,
        quadors: Arc::new(quadors),
        wavelength,
        cleaned,
        trimmed,
        dangling: wire.dangling(&held),
    };
    check_open(&*truss.quadors, place)?;
    warn(&truss, &fillets, spec, place, warnings);
    Ok(Beams::Truss(Arc::new(truss)))
}

/// Whether all beams lie in a region.
fn whole(quadors: &Quadors, region: &dyn Field) -> bool {
    // A hub and its stubs lie within a box, and that within a ball.
    (0..quadors.len()).into_par_iter().all(|i| {
        let b = quadors.hold(i);
        region.bound(&b).hi <= 0.0 || region.value(b.center()) + 0.5 * norm(b.size()) <= 0.0
    })
}

/// The beams that a design is made of, if of nothing else.
pub(super) fn alone(built: &Built) -> Result<Arc<Quadors>, Fault> {
    let refuse = |why: &str| {
        let message = format!(
            "a mesh to a chord error is made of the beams' own patches, and {why}; give the spacing of a grid (edge) instead"
        );
        Err(Fault::new("chord", message))
    };
    let [(_, beams)] = &built.beams[..] else {
        return refuse("this design is not one graph of beams");
    };
    if !built.lattices.is_empty() || !built.tilings.is_empty() {
        return refuse("this design has a lattice too");
    }
    if !built.solid.filled.is_empty() {
        return refuse("a skin or a kept zone of this design would cut them");
    }
    let (quadors, apart, whole) = match beams {
        Beams::Truss(t) => (t.quadors.clone(), t.collisions.is_empty(), t.whole),
        Beams::Pattern(laid) => {
            let written = laid.written()?;
            let whole = whole(&written, &*built.solid.region);
            let apart = written.collisions().is_empty();
            (Arc::new(written), apart, whole)
        }
    };
    if !apart {
        return refuse("some of these run into each other without a common node");
    }
    if !whole {
        return refuse(
            "the region cuts some (make it larger by a hub's radius, or take out what leaves it with trim = \"drop\")",
        );
    }
    Ok(quadors)
}

/// A frame before it is cleaned and trimmed.
struct Frame {
    wire: Wire,
    /// Radii that nodes have of their own, NaN where they have none; empty if none has.
    own: Vec<f64>,
    wavelength: f64,
    /// How far from the region a beam may lie and yet have a part in it, mm.
    reach: f64,
}

fn frame(
    spec: &BeamsSpec,
    radii: &Radii,
    place: &Place,
    warnings: &mut Vec<Warning>,
) -> Result<Frame, DesignError> {
    let below = |key: &str| format!("{}.{key}", place.path);
    let bounds = place.region.bounds();
    let thick = thickest(radii, &bounds, place);
    // Fillets end halfway along the beams: all those of a hub so near count for what is in the region.
    let reach = |longest: f64| match spec.fillet {
        FilletSpec::None => thick,
        _ => thick.max(0.5 * longest),
    };
    let (Some(name), Some(map)) = (&spec.cell, &spec.map) else {
        let (wire, own) = tables(spec, place)?;
        let longest = wire
            .struts
            .iter()
            .map(|s| wire.length(*s))
            .fold(0.0, f64::max);
        let largest = own
            .iter()
            .copied()
            .filter(|r| r.is_finite())
            .fold(0.0, f64::max);
        return Ok(Frame {
            wavelength: mean_length(&wire),
            reach: reach(longest).max(largest),
            wire,
            own,
        });
    };
    let unit = graph::named(name).ok_or_else(|| {
        let names: Vec<&str> = graph::catalogue().iter().map(|u| u.name).collect();
        DesignError::unknown(&below("cell"), "cell of beams", name, &names)
    })?;
    let net = unit.net().map_err(|f| DesignError::fault(&place.path, f))?;
    let at = Place {
        path: below("map"),
        ..*place
    };
    let made = map::map(map, &at)?;
    map::warn(&made, map, &place.path, warnings);
    for (key, grade) in [("radius", &radii.radius), ("hub", &radii.hub)] {
        let most = grade.as_ref().map_or(0.0, |g| greatest(g, place));
        if most > made.longest() {
            let message = format!(
                "{key} is {} mm; it must be greater than 0 and at most the wavelength, {} mm",
                number(most),
                number(made.longest())
            );
            return Err(DesignError::new(below(key), message).found(number(most)));
        }
    }
    let longest = net
        .lengths([made.longest(); 3])
        .into_iter()
        .fold(0.0, f64::max);
    let reach = reach(longest);
    let wire = graph::fill(&net, &made, &bounds, reach)
        .map_err(|f| DesignError::fault(&below("map"), f))?;
    Ok(Frame {
        wire,
        own: Vec::new(),
        wavelength: made.wavelength(),
        reach,
    })
}

pub(super) fn fillet(spec: FilletSpec) -> Fillet {
    match spec {
        FilletSpec::None => Fillet::None,
        FilletSpec::Auto => Fillet::Auto,
        FilletSpec::Radius(r) => Fillet::Radius(r),
        FilletSpec::Tau(t) => Fillet::Tau(t),
        FilletSpec::Alpha(a) => Fillet::Alpha(a),
        FilletSpec::Beta(b) => Fillet::Beta(b),
    }
}

/// Refuses beams that no quadric makes, with the place of the first and how many there are.
fn check_beams(graph: &Graph, spec: &BeamsSpec) -> Result<(), Fault> {
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
    let [from, to] = graph.beams[*first]
        .ends
        .map(|n| graph::place(graph.hubs[n as usize].center));
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

fn radii(spec: &BeamsSpec, place: &Place) -> Result<Radii, DesignError> {
    let varied = |spec: &Option<GradeSpec>, key: &'static str| {
        let Some(spec) = spec else { return Ok(None) };
        let path = format!("{}.{key}", place.path);
        let allowed = Allowed::Positive(key);
        let made = grade(spec, &path, place, allowed, false)?;
        if let Grade::Formula(_) = &made {
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
    Ok(Radii {
        radius: varied(&spec.radius, "radius")?,
        hub: varied(&spec.hub, "hub")?,
        profile,
    })
}

/// The greatest value at points in the region.
fn greatest(grade: &Grade, place: &Place) -> f64 {
    let mut values = vec![0.0; place.points.len()];
    grade.values(place.points, &mut values);
    values.into_iter().fold(0.0, f64::max)
}

/// A bound of the radius of balls in the region.
fn thickest(radii: &Radii, bounds: &Aabb, place: &Place) -> f64 {
    let most = |g: &Grade| match g.bound(bounds).hi {
        v if v.is_finite() => v,
        _ => 2.0 * greatest(g, place),
    };
    let of = [&radii.radius, &radii.hub].into_iter().flatten();
    of.map(most).fold(0.0, f64::max).min(norm(bounds.size()))
}

fn mean_length(wire: &Wire) -> f64 {
    let total: f64 = wire.struts.iter().map(|s| wire.length(*s)).sum();
    total / wire.struts.len().max(1) as f64
}

fn merging(spec: &BeamsSpec, mean: f64, place: &Place) -> Result<f64, DesignError> {
    match spec.merge {
        None => Ok(ONE * mean),
        Some(v) if v >= 0.0 && v.is_finite() => Ok(v),
        Some(v) => {
            let message = format!(
                "merge is {} mm; it must be a finite number, 0 or more",
                number(v)
            );
            Err(DesignError::new(format!("{}.merge", place.path), message).found(number(v)))
        }
    }
}

/// Refuses a frame of which nothing is left.
fn check_left(wire: &Wire, key: &str, place: &Place) -> Result<(), DesignError> {
    if !wire.struts.is_empty() {
        return Ok(());
    }
    let message = match key {
        "dangling" => "no beam is left once those with a free end are dropped: none of them lies on a closed way".into(),
        "struts" => "no beam has two different ends".to_string(),
        _ => {
            let b = place.region.bounds();
            let corner = |v: Vec3| v.map(number).join(", ");
            format!(
                "no beam lies in the region, which reaches from ({}) to ({}) mm",
                corner(b.min),
                corner(b.max)
            )
        }
    };
    Err(DesignError::new(format!("{}.{key}", place.path), message))
}

/// Nodes and struts of the user's own.
fn tables(spec: &BeamsSpec, place: &Place) -> Result<(Wire, Vec<f64>), DesignError> {
    let below = |key: &str| format!("{}.{key}", place.path);
    let read = |path: &str, key: &str| samples::bytes(path, &below(key), place);
    let wrong = |path: &str, key: &str, f: Fault| {
        DesignError::new(below(key), format!("{path}: {}", f.message)).found(path)
    };
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
            for (i, n) in rows
                .iter()
                .enumerate()
                .flat_map(|(i, r)| r.iter().map(move |n| (i, n)))
            {
                if *n as usize >= nodes.places.len() {
                    let message = format!(
                        "there is no node {n}; there are {}, counted from 0",
                        counted(nodes.places.len(), "node")
                    );
                    let at = format!("{}[{i}]", below("struts"));
                    return Err(DesignError::new(at, message).found(n.to_string()));
                }
            }
            Wire {
                nodes: nodes.places.clone(),
                struts: rows.clone(),
            }
        }
        None => Wire::default(),
    };
    if spec.radius.is_none() && spec.hub.is_none() && nodes.radii.is_empty() {
        let message = "\"radius\" is missing, and no node has a radius of its own: of a beam at mid length, mm";
        return Err(DesignError::new(&place.path, message));
    }
    Ok((wire, nodes.radii))
}

/// Nodes that stand in the design.
pub(super) fn given(rows: &[RowSpec], path: &str) -> Result<Nodes, DesignError> {
    let mut nodes = Nodes::default();
    for (i, row) in rows.iter().enumerate() {
        let (at, radius) = match *row {
            RowSpec::Place(p) => (p, None),
            RowSpec::Ball([x, y, z, r]) => ([x, y, z], Some(r)),
        };
        let path = format!("{path}[{i}]");
        for v in at {
            super::place::finite(&path, v)?;
        }
        if let Some(r) = radius {
            Allowed::Positive("radius").check(&path, r, "")?;
        }
        nodes.places.push(at);
        nodes.radii.push(radius.unwrap_or(f64::NAN));
        nodes.names.insert(i.to_string(), i as u32);
    }
    if nodes.radii.iter().all(|r| r.is_nan()) {
        nodes.radii.clear();
    }
    Ok(nodes)
}

/// Refuses beams that leave the region empty or fill it.
pub(super) fn check_open(field: &dyn Field, place: &Place) -> Result<(), DesignError> {
    let share = |points: &[Vec3]| {
        let mut values = vec![0.0; points.len()];
        field.values(points, &mut values);
        values.iter().filter(|v| **v <= 0.0).count() as f64 / points.len().max(1) as f64
    };
    let mixed = |v: f64| v > 0.0 && v < 1.0;
    if mixed(share(place.points)) {
        return Ok(());
    }
    match share(&sample::inside(place.region, 10 * LOOKS).0) {
        v if v >= 1.0 => Err(DesignError::new(
            format!("{}.radius", place.path),
            "the beams are so thick that the region is solid everywhere: nothing is open",
        )),
        // A few thin beams may be missed by every look.
        _ => Ok(()),
    }
}

fn tell_cleaned(c: &Cleaned, path: &str, warnings: &mut Vec<Warning>) {
    let told: Vec<String> = [
        (c.merged, "node", "merged into another at the same place"),
        (c.short, "strut", "of no length left out"),
        (
            c.duplicates,
            "strut",
            "left out because another joins the same nodes",
        ),
        (c.isolated, "node", "left out because no strut ends there"),
    ]
    .into_iter()
    .filter(|t| t.0 > 0)
    .map(|(n, what, done)| format!("{} {done}", counted(n, what)))
    .collect();
    if !told.is_empty() {
        warnings.push(Warning {
            path: path.into(),
            message: told.join(", "),
        });
    }
}

fn warn(
    truss: &Truss,
    fillets: &[(usize, f64)],
    spec: &BeamsSpec,
    place: &Place,
    warnings: &mut Vec<Warning>,
) {
    let mut say = |message: String| {
        warnings.push(Warning {
            path: place.path.clone(),
            message,
        });
    };
    let at = |p: Vec3| format!("({:.3}, {:.3}, {:.3}) mm", p[0], p[1], p[2]);
    if truss.dangling > 0 && truss.cleaned.dangling == 0 {
        say(format!(
            "{} inside the region with a single beam; dangling = \"drop\" leaves such beams out",
            counted(truss.dangling, "node")
        ));
    }
    let inside = |hub: usize| place.region.value(truss.quadors.center(hub)) <= 0.0;
    let short: Vec<(usize, f64)> = match spec.fillet {
        FilletSpec::Radius(r) => {
            let less = |f: &&(usize, f64)| f.1 < r * (1.0 - 1e-9);
            fillets.iter().filter(less).copied().collect()
        }
        _ => (truss.quadors.shortfalls().iter())
            .filter(|s| inside(s.hub))
            .map(|s| (s.hub, s.radius))
            .collect(),
    };
    if let Some((hub, radius)) = short.iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
        let asked = match spec.fillet {
            FilletSpec::Radius(r) => format!("a fillet of {} mm", number(r)),
            _ => "the fillet asked for".into(),
        };
        say(format!(
            "{} cannot have {asked}, only the largest that fits; the tightest has {radius:.3} mm, at {}",
            counted(short.len(), "hub"),
            at(truss.quadors.center(*hub))
        ));
    }
    let over: Vec<_> = (truss.quadors.overlaps().iter())
        .filter(|o| inside(o.hub))
        .collect();
    if let (false, Some(o)) = (spec.fillet == FilletSpec::None, over.first()) {
        say(format!(
            "{} of beams still overlap halfway along, the first at {}: no fillet is made between them; make them thinner",
            counted(over.len(), "pair"),
            at(truss.quadors.center(o.hub))
        ));
    }
    if let Some(c) = truss.collisions.first() {
        say(format!(
            "{} of beams run into each other without a common node, the first at {}: they are joined there, but not filleted, and \
             exact figures of the whole are not told; make them thinner, or put nodes there",
            counted(truss.collisions.len(), "pair"),
            at(c.at)
        ));
    }
    if let Some((n, p)) = truss.graph.swallowed() {
        say(format!(
            "{} lie within another one of the same hub, the first about {}",
            counted(n, "beam"),
            at(p)
        ));
    } else if let Some((angle, p)) = truss.facts.angle.filter(|a| a.0 < NARROW) {
        say(format!(
            "the least angle between two beams is {angle:.1} degrees, at {}: below {NARROW} they run into one another",
            at(p)
        ));
    }
}

/// Whether a design is one graph of beams and nothing else.
pub(super) fn lone(built: &Built) -> bool {
    built.beams.len() == 1
        && built.lattices.is_empty()
        && built.tilings.is_empty()
        && built.solid.filled.is_empty()
}

/// Most beams of a pattern that are looked at one by one.
const FEW: f64 = 2e4;

/// Whether all beams lie in the region: of a large pattern, by the box that holds it.
pub(super) fn held(beams: &Beams, built: &Built) -> bool {
    match beams {
        Beams::Truss(truss) => truss.whole,
        Beams::Pattern(laid) => inside(laid, built),
    }
}

/// The same of a pattern.
pub(super) fn inside(laid: &Laid, built: &Built) -> bool {
    let region = &*built.solid.region;
    let each = || laid.written().is_ok_and(|written| whole(&written, region));
    region.bound(&laid.bounds()).hi <= 0.0 || laid.pattern().counts().1 <= FEW && each()
}

/// The solid share of the region, and whether it is exact: where beams of that volume are all there is, and the region's volume is known.
pub(super) fn share(
    volume: Option<f64>,
    whole: bool,
    built: &Built,
    sampled: &dyn core::ops::Deref<Target = f64>,
) -> (f64, bool) {
    match (volume, built.solid.region.volume()) {
        (Some(solid), Some(region)) if whole && lone(built) => (solid / region, true),
        _ => (**sampled, false),
    }
}

/// The figures of beams; `sampled` is the solid share of the region, by looks at points.
pub(super) fn report(
    beams: &Beams,
    built: &Built,
    sampled: &dyn core::ops::Deref<Target = f64>,
) -> Json {
    let truss = match beams {
        Beams::Truss(truss) => truss,
        Beams::Pattern(laid) => return pattern::report(laid, built, sampled),
    };
    let (facts, graph, quadors) = (&truss.facts, &truss.graph, &truss.quadors);
    let [least, most] = (graph.hubs.iter().map(|h| h.radius))
        .fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], v| {
            [a.min(v), b.max(v)]
        });
    let valence: serde_json::Map<String, Json> = (facts.valence.iter())
        .map(|(v, n)| (v.to_string(), json!(n)))
        .collect();
    let thin = (0..graph.beams.len())
        .map(|b| quadors.pencil(b).waist())
        .fold(f64::INFINITY, f64::min);
    // Of a part that the region cuts, or whose beams run into each other, there is no closed form.
    let sum = truss.whole && truss.collisions.is_empty();
    let mass = sum.then(|| quadors.mass().ok()).flatten();
    let (fraction, exact) = share(mass.map(|m| m.volume), truss.whole, built, sampled);
    json!({
        "cell": truss.cell,
        "wavelength": truss.wavelength,
        "hubs": facts.valence.values().sum::<usize>(),
        "beams": facts.struts,
        "fraction": fraction,
        "fraction_exact": exact,
        "porosity": 1.0 - fraction,
        "thickness": 2.0 * thin,
        "hub_radius": [least, most],
        "length": facts.length,
        "total_length": facts.total,
        "volume": mass.map(|m| m.volume),
        "area": mass.map(|m| m.area),
        "centroid": mass.map(|m| m.centroid()),
        "inertia": mass.map(|m| m.inertia()),
        "valence": valence,
        "fillet_radius": truss.fillet,
        "smallest_angle": facts.angle.map(|a| a.0),
        "smallest_angle_at": facts.angle.map(|a| a.1),
        "pieces": facts.pieces,
        "dangling": truss.dangling,
        "collisions": truss.collisions.len(),
        "cleaned": {
            "merged": truss.cleaned.merged,
            "zero_length": truss.cleaned.short,
            "duplicates": truss.cleaned.duplicates,
            "isolated": truss.cleaned.isolated,
            "dangling": truss.cleaned.dangling,
        },
        "trimmed": {
            "outside": truss.trimmed.outside,
            "dropped": truss.trimmed.dropped,
            "snapped": truss.trimmed.snapped,
        },
    })
}
