//! Beams: data to a graph and its field.

mod beam_report;
mod graph_file;
mod radius_for_fraction;
mod wire;

use std::sync::Arc;

use rayon::prelude::*;

use super::beams_in_region::{check_open, whole};
use super::build_core;
use super::build_pattern;
use super::data::*;
use super::warn::solved_map;
use super::{Built, Warning};
use crate::environment::Environment;
use crate::field::Field;
use crate::grade::Grade;
use crate::kind::DesignError;
use crate::region::HalfSpace;
use crate::truss::{self, Beams, Truss, fill};
use ::beams::SlicePlane;
use ::beams::graph::{self, GivenRadii, Radii, Trim, Wireframe, with_radii};
use ::beams::quador::Quadors;
use geometry::fault::{Fault, number};
use geometry::math::{Vec3, norm};
use geometry::progress::checkpoint;

pub(super) use beam_report::report;
use beam_report::{warn, warn_cleaned};
use wire::{check_beams, check_left, greatest, mean_length, radii, tables, thickest};
pub(super) use wire::{given, key_of_fault};

/// Nodes within this share of the mean length of struts are one.
const ONE: f64 = 1e-6;
/// Ends of beams within this share of the region's size of its surface lie on it.
const ON: f64 = 1e-9;

/// The beams of a design, filling the region.
pub(super) fn beams(
    spec: &BeamsSpec,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<Beams, DesignError> {
    if let GraphSpec::Pattern(of) = &spec.graph {
        return build_pattern::laid(spec, &of.pattern, environment, warnings);
    }
    let fault = |f: Fault| DesignError::fault(&environment.path, f);
    let mut radii = radii(spec, environment)?;
    let Frame { mut wire, mut own, wavelength, reach } = frame(spec, &mut radii, environment, warnings)?;
    let trimming = spec.graph.trimming();
    let mut cleaned = wire.clean(trimming.merge.unwrap_or_else(|| ONE * mean_length(&wire)), &mut own);
    let cell = match &spec.graph {
        GraphSpec::Cell(of) => graph::named(&of.cell.0),
        _ => None,
    };
    let explicit = matches!(spec.graph, GraphSpec::Nodes(_) | GraphSpec::File(_));
    let source = match &spec.graph {
        GraphSpec::Cell(_) => "map",
        GraphSpec::File(_) => "path",
        _ => "struts",
    };
    check_left(&wire, source, environment)?;
    if cell.is_none() {
        warn_cleaned(&cleaned, &environment.path, warnings);
    }
    let trim = match trimming.trim {
        TrimSpec::Cut => Trim::Cut,
        TrimSpec::Drop => Trim::Drop,
        TrimSpec::Snap => Trim::Snap,
    };
    let region: &dyn Field = &**environment.region;
    let slack = ON * norm(environment.region.bounds().size());
    let trimmed = trim.apply(&mut wire, &|p, out| region.values(p, out), reach, slack, &mut own);
    check_left(&wire, "trim", environment)?;
    let held = |p: Vec3| region.value(p) >= -slack;
    if trimming.dangling == DanglingSpec::Drop {
        cleaned.dangling = wire.drop_dangling(&held, &mut own);
        check_left(&wire, "dangling", environment)?;
    }
    if let (Some(fraction), None) = (spec.fraction, &radii.radius) {
        radii.radius = Some(Grade::Constant(radius_for_fraction::of_frame(fraction, &wire, spec, environment)?));
    }
    checkpoint();
    let graph = with_radii(&wire, &own, &radii, Grade::values).map_err(fault)?;
    check_beams(&graph, spec).map_err(fault)?;
    let quadors = Quadors::new(&graph, spec.fillet.into()).map_err(fault)?;
    checkpoint();
    let inside = |p: Vec3| region.value(p) <= slack;
    let fillets: Vec<f64> = (0..quadors.len())
        .into_par_iter()
        .filter(|i| spec.fillet != FilletSpec::None && inside(quadors.center(*i)))
        .map(|i| quadors.fillet_radius(i))
        .filter(|radius| radius.is_finite())
        .collect();
    let narrow = fillets.iter().copied().fold(f64::INFINITY, f64::min);
    let wide = fillets.iter().copied().fold(0.0, f64::max);
    let mut shortfalls = quadors.shortfalls().to_vec();
    shortfalls.retain(|s| inside(quadors.center(s.hub)));
    shortfalls.sort_by(|a, b| a.fillets.radius[0].total_cmp(&b.fillets.radius[0]));
    checkpoint();
    let mut collisions = quadors.collisions();
    collisions.retain(|c| inside(c.at));
    let whole = whole(&quadors, region);
    let within = if whole { wire.whole() } else { truss::within(&quadors, region, &inside) };
    let truss = Truss {
        whole,
        report: wire.report(&within, collisions.iter().map(|c| c.beams)),
        collisions,
        within,
        fillet: (!fillets.is_empty()).then_some([narrow, wide]),
        shortfalls,
        cell: cell.map(|u| u.name),
        solved_radius: spec.fraction.and(radii.radius.as_ref()).and_then(Grade::constant),
        graph,
        quadors: Arc::new(quadors),
        wavelength,
        cleaned,
        trim,
        trimmed,
        repeats: !explicit,
        dangling: wire.dangling(&held),
    };
    check_open(&*truss.quadors, environment)?;
    warn(&truss, spec, environment, warnings);
    Ok(Beams::Truss(Arc::new(truss)))
}

/// The beams that a design is made of, if of nothing else, for a mesh to a chord error.
pub(super) fn alone(built: &Built) -> Result<Arc<Quadors>, Fault> {
    lone_beams(built, |why| {
        let message = format!(
            "a mesh to a chord error is made of the beams' own patches, and {why}; give the spacing of a grid (edge) instead"
        );
        Fault::new("chord", message)
    })
}

/// The beams that a design is made of, if of nothing else, for a STEP file; and the planes behind which they are kept.
pub(super) fn exact(built: &Built) -> Result<(Arc<Quadors>, Vec<SlicePlane>), Fault> {
    let fault = |why: &str| {
        let message =
            format!("write a mesh (3mf, stl) instead: a STEP file has the exact surface of beams alone, and {why}");
        Fault::new("", message)
    };
    let (quadors, whole) = apart(built, &fault)?;
    if whole {
        return Ok((quadors, Vec::new()));
    }
    let Some(sides) = built.solid.region.half_spaces() else {
        return Err(fault(
            "the region cuts some along other surfaces than those of a box, a tetrahedron, half-spaces or an intersection of \
             these; with trim = \"drop\" in a region that is smaller by the radius of the beams (region.offset) it cuts none",
        ));
    };
    let crossed = |side: &HalfSpace| (0..quadors.len()).any(|hub| side.bound(&quadors.hub_bounds(hub)).hi > 0.0);
    let planes = sides.iter().filter(|s| crossed(s)).map(|s| SlicePlane::new(s.point(), s.normal()));
    let planes = planes.collect::<Result<Vec<SlicePlane>, Fault>>()?;
    Ok((quadors, planes))
}

/// The only beams of a design that is made of nothing else, though its region may cut them; or why it is not.
pub(super) fn only(built: &Built) -> Result<&(String, Beams), &'static str> {
    let [beams] = &built.beams[..] else {
        return Err("this design is not one graph of beams");
    };
    if !built.lattices.is_empty() || !built.tilings.is_empty() {
        return Err("this design has a lattice too");
    }
    if !built.solid.filled.is_empty() {
        return Err("a skin or a kept zone of this design would cut them");
    }
    Ok(beams)
}

/// The beams that a design is made of, if of nothing else and if none run into each other; and whether the region cuts none.
fn apart(built: &Built, fault: &impl Fn(&str) -> Fault) -> Result<(Arc<Quadors>, bool), Fault> {
    let (_, beams) = only(built).map_err(fault)?;
    let (quadors, apart, whole) = match beams {
        Beams::Truss(t) => (t.quadors.clone(), t.collisions.is_empty(), t.whole),
        Beams::Pattern(laid) => {
            let written = laid.expand()?;
            let whole = whole(&written, &*built.solid.region);
            let apart = written.collisions().is_empty();
            (written, apart, whole)
        }
    };
    if !apart {
        return Err(fault("some of these run into each other without a common node"));
    }
    Ok((quadors, whole))
}

fn lone_beams(built: &Built, fault: impl Fn(&str) -> Fault) -> Result<Arc<Quadors>, Fault> {
    let (quadors, whole) = apart(built, &fault)?;
    if whole {
        return Ok(quadors);
    }
    Err(fault(match only(built) {
        Ok((_, Beams::Truss(t))) if t.trim != Trim::Drop => {
            "the region cuts some (make it larger by a hub's radius, or take out what leaves it with trim = \"drop\")"
        }
        _ => "the region cuts some (make it larger by a hub's radius)",
    }))
}

/// Errors in the radius of the thinnest beam, unless another resolution is asked for: a circle has eighteen edges.
const PER_RADIUS: f64 = 50.0;

/// The error (mm) of chords and of radii at which beams are made unless another is asked for; infinite where there is no beam.
pub(super) fn fine_error(quadors: &Quadors) -> f64 {
    let waists = (0..quadors.beams()).map(|b| quadors.pencil(b).waist());
    waists.fold(f64::INFINITY, f64::min) / PER_RADIUS
}

/// The chord error (mm) at which the surface of beams is made unless another resolution is asked for; `None` for what is
/// made on a grid: other solids, beams that the region cuts or that overlap, patterns of many beams.
pub(super) fn default_chord(built: &Built) -> Option<f64> {
    if let [(_, Beams::Pattern(laid))] = &built.beams[..]
        && laid.expanded_if_small().is_none()
    {
        return None;
    }
    let quadors = alone(built).ok().filter(|q| q.overlaps().is_empty())?;
    Some(fine_error(&quadors)).filter(|error| *error < f64::INFINITY)
}

/// A frame before it is cleaned and trimmed.
struct Frame {
    wire: Wireframe,
    /// Radii given at nodes and for struts, mm.
    own: GivenRadii,
    wavelength: f64,
    /// Greatest distance from the region, mm, of a beam's axis of which a part of the beam may be in the region.
    reach: f64,
}

fn frame(
    spec: &BeamsSpec,
    radii: &mut Radii<Grade>,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<Frame, DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let bounds = environment.region.bounds();
    // Fillets end halfway along the beams: all those of a hub so near count for what is in the region.
    let reach = |radii: &Radii<Grade>, longest: f64| match (spec.fillet, &radii.radius) {
        (FilletSpec::None, Some(_)) => thickest(radii, &bounds, environment),
        _ => thickest(radii, &bounds, environment).max(0.5 * longest),
    };
    let explicit = |(wire, own): (Wireframe, GivenRadii), radii: &Radii<Grade>| {
        let longest = wire.struts.iter().map(|s| wire.length(*s)).fold(0.0, f64::max);
        let all = own.nodes.iter().chain(own.struts.iter().flatten());
        let largest = all.copied().filter(|r| r.is_finite()).fold(0.0, f64::max);
        Frame { wavelength: mean_length(&wire), reach: reach(radii, longest).max(largest), wire, own }
    };
    let (cell, map) = match &spec.graph {
        GraphSpec::Cell(of) => (&of.cell.0, &of.map),
        GraphSpec::Nodes(of) => return Ok(explicit(tables(of, spec, environment)?, radii)),
        GraphSpec::File(of) => return Ok(explicit(graph_file::read(of, spec, environment, warnings)?, radii)),
        GraphSpec::Pattern(_) => return Err(DesignError::new(&environment.path, "a pattern is no frame")),
    };
    let unit = graph::named(cell).ok_or_else(|| DesignError::new(below("cell"), "no such cell"))?;
    let net = unit.graph().map_err(|f| DesignError::fault(&environment.path, f))?;
    let at = Environment { path: below("map"), ..*environment };
    let made = map.build(&at)?;
    build_core::not_of_beams(&made, map, &at.path)?;
    solved_map(&made, map, &environment.path, warnings);
    if let Some(fraction) = spec.fraction {
        let radius = radius_for_fraction::of_cell(fraction, &net, &made, spec, environment)?;
        radii.radius = Some(Grade::Constant(radius));
    }
    for (key, grade) in [("radius", &radii.radius), ("hub", &radii.hub)] {
        let most = grade.as_ref().map_or(0.0, |g| greatest(g, environment));
        if most > made.longest() {
            let message = format!(
                "{key} is {} mm; it must be greater than 0 and at most the wavelength, {} mm",
                number(most),
                number(made.longest())
            );
            return Err(DesignError::new(below(key), message).found(number(most)));
        }
    }
    let longest = net.lengths([made.longest(); 3]).into_iter().fold(0.0, f64::max);
    let reach = reach(radii, longest);
    let wire = fill(&net, &made, &bounds, reach).map_err(|f| DesignError::fault(&below("map"), f))?;
    Ok(Frame { wire, own: GivenRadii::default(), wavelength: made.wavelength(), reach })
}
