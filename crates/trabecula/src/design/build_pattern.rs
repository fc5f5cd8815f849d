//! Patterns of beams: data to a program of repeats.

use std::sync::Arc;

use super::beams_in_region::{check_open, inside, share};
use super::build_beams::{given, key_of_fault};
use super::data::*;
use super::{Built, Warning};
use crate::environment::Environment;
use crate::kind::DesignError;
use crate::report::{BeamsReport, PatternReport};
use crate::truss::Beams;
use ::beams::graph::{HubBall, Profile};
use ::beams::pattern::{Pattern, PatternField, Strut};
use geometry::fault::{counted, number};
use geometry::math::rotation;
use geometry::similarity::Similarity;

/// The pattern of a design, filling the region.
pub(super) fn laid(
    spec: &BeamsSpec,
    of: &PatternSpec,
    environment: &Environment,
    warnings: &mut Vec<Warning>,
) -> Result<Beams, DesignError> {
    let below = |key: &str| format!("{}.{key}", environment.path);
    let single = |given: &Option<GradeSpec>| match given {
        Some(GradeSpec::Constant(v)) => Some(*v),
        _ => None,
    };
    let (radius, hub) = (single(&spec.radius), single(&spec.hub));
    let at = below("pattern");
    let nodes = given(&of.nodes);
    let mut hubs = Vec::new();
    for (i, center) in nodes.positions.iter().enumerate() {
        let own = nodes.radii.get(i).copied().filter(|r| !r.is_nan());
        let Some(radius) = own.or(hub).or(radius) else {
            let message = "it has no radius of its own, and no radius of beams is given; give one";
            return Err(DesignError::new(format!("{at}.nodes[{i}]"), message));
        };
        hubs.push(HubBall { center: *center, radius });
    }
    let profile = match (spec.profile, radius) {
        (Some(ProfileSpec::Cylinder), _) => Profile::Cylinder,
        (Some(ProfileSpec::Waist(v)), _) => Profile::Waist(v),
        (Some(ProfileSpec::Lambda(v)), _) => Profile::Lambda(v),
        (None, Some(r)) => Profile::Mid(r),
        (Some(ProfileSpec::Cone), _) | (None, None) => Profile::Cone,
    };
    let strut = |PatternStrut(s): &PatternStrut| Strut {
        ends: [s[0] as u32, s[1] as u32],
        offset: [s[2], s[3], s[4]],
        profile,
    };
    let mut steps = [(Similarity::IDENTITY, 1); 3];
    for (i, (step, repeat)) in steps.iter_mut().zip(&of.repeat).enumerate() {
        let at = |key: &str| format!("{at}.repeat[{i}].{key}");
        let all = repeat.scale.powf(f64::from(repeat.count) - 1.0);
        if !(1e-6..=1e6).contains(&all) {
            let message = format!(
                "the last repeat is {} times as large as the first; it must be from 1e-6 to 1e6 times",
                number(all)
            );
            return Err(DesignError::new(at("scale"), message).found(number(repeat.scale)));
        }
        *step = (Similarity::new(repeat.scale, rotation(repeat.rotate), repeat.about, repeat.by), repeat.count);
    }
    let pattern = Pattern { nodes: hubs, struts: of.struts.iter().map(strut).collect(), steps };
    pattern.check().map_err(|f| DesignError::fault(&at, f))?;
    let laid = PatternField::new(pattern, spec.fillet.into()).map_err(|f| {
        // The number of a beam about one hub of each kind is none of the design.
        match f.at.strip_prefix("beams[").and_then(|rest| rest.split_once("].")) {
            Some((_, of)) => DesignError { path: below(key_of_fault(of, spec)), ..DesignError::fault(&at, f.clone()) },
            None => DesignError::fault(&at, f),
        }
    })?;
    let region = environment.region.bounds();
    if laid.bounds().intersection(region).is_empty() {
        let (b, r) = (laid.bounds(), region);
        let corner = |v: [f64; 3]| v.map(number).join(", ");
        let message = format!(
            "no beam lies in the region: the pattern reaches from ({}) to ({}) mm, the region from ({}) to ({}) mm",
            corner(b.min),
            corner(b.max),
            corner(r.min),
            corner(r.max)
        );
        return Err(DesignError::new(at, message));
    }
    let found = laid.collisions().map_err(|f| DesignError::fault(&at, f))?;
    if let Some(c) = found
        && let Some(p) = c.at
    {
        let message = format!(
            "{} of beams run into each other without a common node, as many about one hub of each kind, the first at {}: they are \
             joined there, but not filleted, and no exact volume is given; make them thinner, or put nodes there",
            counted(c.count, "pair"),
            beams::graph::position_text(p)
        );
        warnings.push(Warning { path: at, message });
    }
    let beams = Beams::Pattern(Arc::new(laid));
    check_open(&*beams.field(), environment)?;
    Ok(beams)
}

/// The figures of a pattern.
pub(super) fn report(laid: &PatternField, built: &Built, sampled: &dyn core::ops::Deref<Target = f64>) -> BeamsReport {
    let pattern = laid.pattern();
    let (hubs, beams) = pattern.counts();
    let radii = pattern.nodes.iter().map(|h| h.radius);
    let range = radii.fold([f64::INFINITY, 0.0], |[a, b]: [f64; 2], v| [a.min(v), b.max(v)]);
    let scales = laid.scales();
    let found = laid.collisions().ok().flatten();
    let clear = found.is_none_or(|c| c.count == 0);
    let volume = clear.then(|| laid.volume().ok()).flatten();
    // Intersections are known only if they were searched for.
    let whole = found.is_some() && inside(laid, built);
    let (fraction, fraction_exact) = share(volume, whole, built, sampled);
    BeamsReport {
        cell: None,
        wavelength: laid.wavelength(),
        fraction,
        fraction_exact,
        porosity: 1.0 - fraction,
        thickness: 2.0 * laid.min_radius(),
        hub_radius: [range[0] * scales[0], range[1] * scales[1]],
        volume,
        graph: None,
        pattern: Some(PatternReport {
            hubs,
            beams,
            repeats: pattern.steps.map(|s| s.1),
            kinds: laid.representatives().1.len(),
            collisions: found.map(|c| c.count),
        }),
    }
}
