//! Warnings and figures of beams.

use crate::design::beams_in_region::share;
use crate::design::build_tets::rounded;
use crate::design::data::*;
use crate::design::{Built, Warning, build_pattern};
use crate::environment::Environment;
use crate::report::{BeamsReport, FilletShortfall, GraphReport};
use crate::truss::{Beams, Truss};
use ::beams::graph::Cleaned;
use ::beams::quador::{Fillet, Shortfall};
use geometry::fault::{counted, number, position};

/// An angle between beams (degrees) below which it is warned of.
const NARROW: f64 = 15.0;

pub(super) fn warn_cleaned(c: &Cleaned, path: &str, warnings: &mut Vec<Warning>) {
    let parts: Vec<String> = [
        (c.merged, "node", "merged into another at the same position"),
        (c.zero_length, "strut", "of no length left out"),
        (c.duplicates, "strut", "left out because another joins the same nodes"),
        (c.isolated, "node", "left out because no strut ends there"),
    ]
    .into_iter()
    .filter(|t| t.0 > 0)
    .map(|(n, what, done)| format!("{} {done}", counted(n, what)))
    .collect();
    if !parts.is_empty() {
        warnings.push(Warning { path: path.into(), message: parts.join(", ") });
    }
}

pub(super) fn warn(truss: &Truss, spec: &BeamsSpec, environment: &Environment, warnings: &mut Vec<Warning>) {
    let mut say = |message: String| {
        warnings.push(Warning { path: environment.path.clone(), message });
    };
    if truss.dangling > 0 && truss.cleaned.dangling == 0 {
        say(format!(
            "{} inside the region with a single beam; dangling = \"drop\" leaves such beams out",
            counted(truss.dangling, "node")
        ));
    }
    let inside = |hub: usize| environment.region.value(truss.quadors.center(hub)) <= 0.0;
    if let Some(tightest) = truss.shortfalls.first() {
        let target = match spec.fillet {
            FilletSpec::Radius(r) => format!("a fillet of {} mm", number(r)),
            _ => "the fillet asked for".into(),
        };
        say(format!(
            "{} cannot have {target}, only the largest that fits; the tightest has {} mm, at {}",
            counted(truss.shortfalls.len(), "hub"),
            rounded(tightest.fillets.radius[0], 3),
            position(truss.quadors.center(tightest.hub))
        ));
    }
    let over: Vec<_> = (truss.quadors.overlaps().iter()).filter(|o| inside(o.hub)).collect();
    if let (false, Some(o)) = (spec.fillet == FilletSpec::None, over.first()) {
        say(format!(
            "{} of beams still overlap halfway along, the first at {}: no fillet is made between them; make them thinner",
            counted(over.len(), "pair"),
            position(truss.quadors.center(o.hub))
        ));
    }
    if let Some(c) = truss.collisions.first() {
        say(format!(
            "{} of beams run into or touch each other without a common node, the first at {}: they are joined there, but not \
             filleted, and no exact figures of the whole are given; make them thinner, or put nodes there",
            counted(truss.collisions.len(), "pair"),
            position(c.at)
        ));
    }
    if let Some((n, p)) = truss.graph.contained_beams() {
        let lie = if n == 1 { "lies" } else { "lie" };
        say(format!(
            "{} {lie} within another one of the same hub, the first about {}",
            counted(n, "beam"),
            position(p)
        ));
    } else if let Some((angle, p)) = truss.report.min_angle.filter(|a| a.0 < NARROW) {
        say(format!(
            "the least angle between two beams is {angle:.1} degrees, at {}: below {NARROW} they run into one another",
            position(p)
        ));
    }
}

/// A hub that cannot have the fillets asked for.
fn fillet_shortfall(truss: &Truss, short: &Shortfall) -> FilletShortfall {
    let of = &short.fillets;
    let [asked_radius, asked_tau] = match truss.quadors.fillet() {
        Fillet::Radius(radius) => [Some(radius), None],
        other => [None, other.tau()],
    };
    FilletShortfall {
        hub: short.hub,
        position: truss.quadors.center(short.hub),
        asked_radius,
        asked_tau,
        radius: of.radius[0].is_finite().then_some(of.radius),
        tau: of.tau,
        crotches: of.crotches,
        short: of.short,
    }
}

/// The figures of beams; `sampled` is the solid share of the region, by sampling at points.
pub(in crate::design) fn report(
    beams: &Beams,
    built: &Built,
    sampled: &dyn core::ops::Deref<Target = f64>,
) -> BeamsReport {
    let truss = match beams {
        Beams::Truss(truss) => truss,
        Beams::Pattern(laid) => return build_pattern::report(laid, built, sampled),
    };
    let (frame, graph, quadors) = (&truss.report, &truss.graph, &truss.quadors);
    // Where there are fillets alone, those of all beams that have them.
    let only_fillets = frame.struts == 0;
    let present = || (0..graph.beams.len()).filter(|b| only_fillets || truss.within.struts[*b]);
    let radii = present().flat_map(|b| quadors.pencil(b).radii);
    let thin = present().map(|b| quadors.pencil(b).waist()).fold(f64::INFINITY, f64::min);
    // Of a part that the region cuts, or whose beams intersect, there is no closed form.
    let sum = truss.whole && truss.collisions.is_empty();
    let mass = sum.then(|| quadors.mass().ok()).flatten();
    let volume = mass.map(|m| m.volume);
    let (fraction, fraction_exact) = share(volume, truss.whole, built, sampled);
    let graph = GraphReport {
        hubs: frame.valence.values().sum(),
        beams: frame.struts,
        solved_radius: truss.solved_radius,
        length: frame.length,
        total_length: frame.total_length,
        area: mass.map(|m| m.area),
        centroid: mass.map(|m| m.centroid()),
        inertia: mass.map(|m| m.inertia()),
        valence: frame.valence.iter().map(|(v, n)| (v.to_string(), *n)).collect(),
        fillet_radius: truss.fillet,
        fillet_shortfalls: truss.shortfalls.iter().map(|s| fillet_shortfall(truss, s)).collect(),
        smallest_angle: frame.min_angle.map(|a| a.0),
        smallest_angle_at: frame.min_angle.map(|a| a.1),
        pieces: frame.components,
        dangling: truss.dangling,
        collisions: truss.collisions.len(),
        cleaned: truss.cleaned,
        trimmed: truss.trimmed,
    };
    BeamsReport {
        cell: truss.cell,
        wavelength: truss.wavelength,
        fraction,
        fraction_exact,
        porosity: 1.0 - fraction,
        thickness: 2.0 * thin,
        hub_radius: radii.fold([f64::INFINITY, 0.0], |[a, b], v| [a.min(v), b.max(v)]),
        volume,
        graph: Some(graph),
        pattern: None,
    }
}
