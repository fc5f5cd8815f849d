//! The radius of beams at which their solid fraction is what is asked for.
//!
//! In a periodic cell the fraction is the volume of the beams in the cell on the torus, by exact integrals, over that of the cell. Where
//! a map deforms cells differently, it is the mean over the region of those of cells with the map's local edges. Of nodes and
//! struts it is the share of the region: exact where the region holds all beams, else by sampling.

use rayon::prelude::*;

use super::wire::profile;
use crate::design::beams_in_region::whole;
use crate::design::data::*;
use crate::design::sample;
use crate::environment::Environment;
use crate::kind::DesignError;
use crate::map::Map;
use ::beams::graph::{GivenRadii, Graph, PeriodicGraph, Radii, Wireframe, with_radii};
use ::beams::quador::{Fillet, PeriodicCell, Quadors};
use geometry::fault::{Fault, number};
use geometry::math::{Mat3, inverse, transpose};
use geometry::roots::{Bracket, FalsePosition, try_bisect};

/// Greatest number of positions at which the cells of a map are taken.
const CELLS: usize = 32;
/// Number of points by which the share of a region that cuts beams is found.
const POINTS: usize = 50_000;
/// Greatest number of radii that are tried.
const TRIALS: usize = 100;
/// Relative width of an interval in which a radius is known: the volume is known to 1e-10.
const WIDTH: f64 = 1e-12;

/// The largest radius that is possible, and the fraction there.
#[derive(Clone, Copy, Debug)]
struct RadiusLimit {
    radius: f64,
    fraction: f64,
}

/// The radius at which an increasing function is `asked`; it is `None` or fails where beams are too thick. `start` is a guess. If it is
/// nowhere so large, the error is the largest radius that was possible, and its value.
fn solve(
    asked: f64,
    start: f64,
    near: f64,
    value: impl Fn(f64) -> Result<Option<f64>, Fault>,
) -> Result<Result<f64, RadiusLimit>, Fault> {
    let (mut low, mut high, mut limit) = ([0.0, -asked], None, f64::INFINITY);
    let (mut x, mut last) = (start, None);
    for _ in 0..TRIALS {
        match value(x) {
            Ok(Some(v)) if v < asked => {
                low = [x, v - asked];
                x = if limit < f64::INFINITY { 0.5 * (x + limit) } else { 1.3 * x };
            }
            Ok(Some(v)) => {
                high = Some([x, v - asked]);
                break;
            }
            failed => {
                last = failed.err().or(last);
                limit = x;
                x = 0.5 * (low[0] + x);
            }
        }
        if limit < f64::INFINITY && limit - low[0] <= 1e-9 * limit {
            break;
        }
    }
    let Some(high) = high else {
        return match (low[0] > 0.0, last) {
            (false, Some(fault)) => Err(fault),
            _ => Ok(Err(RadiusLimit { radius: low[0], fraction: low[1] + asked })),
        };
    };
    let mut search = FalsePosition::new(Bracket { below: low, above: high });
    for _ in 0..TRIALS {
        let (x, bracket) = (search.guess(), *search.bracket());
        if bracket.width() <= WIDTH * bracket.above[0] || !bracket.holds(x) {
            break;
        }
        let [radius, off] = bracket.below;
        let Some(v) = value(x)? else { return Ok(Err(RadiusLimit { radius, fraction: off + asked })) };
        if (v - asked).abs() <= near {
            return Ok(Ok(x));
        }
        search.narrow(x, v - asked);
    }
    let Bracket { below, above } = search.bracket();
    Ok(Ok(if below[1].abs() < above[1].abs() { below[0] } else { above[0] }))
}

/// Refuses a fraction that no radius gives.
fn impossible(asked: f64, most: f64, why: &str, environment: &Environment) -> DesignError {
    // Rounded down, so that the number that is given is allowed.
    let most = (1e4 * most).floor() / 1e4;
    let message =
        format!("fraction is {}; it must be greater than 0 and at most {}: {why}", number(asked), number(most));
    DesignError::new(format!("{}.fraction", environment.path), message).found(number(asked))
}

const OVERLAP: &str = "thicker beams overlap at mid length, and their volume has no closed form; give a radius instead";
const COLLIDE: &str = "thicker beams run into each other without a common node; give a radius instead";

/// The edges of a map's cells in the region, each once: all equal for an affine map.
fn cells(map: &Map, environment: &Environment) -> Vec<Mat3> {
    let every = environment.points.len().div_ceil(CELLS).max(1);
    let count = if map.affine().is_some() { 1 } else { CELLS };
    let points = environment.points.iter().step_by(every).take(count);
    points.map(|p| transpose(&inverse(&map.jacobian(*p)))).collect()
}

/// The radius of the beams of a periodic cell.
pub(super) fn of_cell(
    asked: f64,
    net: &PeriodicGraph,
    map: &Map,
    spec: &BeamsSpec,
    environment: &Environment,
) -> Result<f64, DesignError> {
    let (profile, fillet) = (spec.profile.map(profile), Fillet::from(spec.fillet));
    let cells = cells(map, environment).into_iter().map(|edges| PeriodicCell { graph: net, edges, profile, fillet });
    let cells: Vec<PeriodicCell> = cells.collect();
    let value = |radius: f64| -> Result<Option<f64>, Fault> {
        let mut sum = 0.0;
        for cell in &cells {
            let Some(volume) = cell.volume(radius)? else { return Ok(None) };
            sum += volume / cell.size() / cells.len() as f64;
        }
        Ok(Some(sum))
    };
    let fault = |f: Fault| DesignError::fault(&environment.path, f);
    // As if beams were cylinders that do not meet.
    let slender: f64 = cells.iter().map(|c| core::f64::consts::PI * c.lengths().sum::<f64>() / c.size()).sum();
    let start = (asked * cells.len() as f64 / slender).sqrt();
    let radius = match solve(asked, start, 1e-12, value).map_err(fault)? {
        Ok(radius) => radius,
        Err(most) => {
            let free = clear_of_others(&cells, most.radius).map_err(fault)?;
            let (most, why) = match free {
                Some(radius) => (value(radius).map_err(fault)?.unwrap_or(0.0), COLLIDE),
                None => (most.fraction, OVERLAP),
            };
            return Err(impossible(asked, most, why, environment));
        }
    };
    match clear_of_others(&cells, radius).map_err(fault)? {
        None => Ok(radius),
        Some(most) => {
            let most = value(most).map_err(fault)?.unwrap_or(0.0);
            Err(impossible(asked, most, COLLIDE, environment))
        }
    }
}

/// The largest radius, up to one at which beams run into each other without a common node, at which none do; `None` if they do not there.
fn clear_of_others(cells: &[PeriodicCell], radius: f64) -> Result<Option<f64>, Fault> {
    let collide = |radius: f64| -> Result<bool, Fault> {
        let each: Vec<bool> = cells.par_iter().map(|c| c.collides(radius)).collect::<Result<_, _>>()?;
        Ok(each.contains(&true))
    };
    if !collide(radius)? {
        return Ok(None);
    }
    // To a millionth.
    Ok(Some(try_bisect([0.0, radius], 20, |radius| collide(radius).map(|c| !c))?[0]))
}

/// The radius of the beams of a frame.
pub(super) fn of_frame(
    asked: f64,
    wire: &Wireframe,
    spec: &BeamsSpec,
    environment: &Environment,
) -> Result<f64, DesignError> {
    let fault = |f: Fault| DesignError::fault(&environment.path, f);
    let region = environment.region;
    let graph = |radius: f64| -> Result<Graph, Fault> {
        let radii = Radii { radius: Some(radius), hub: None, profile: spec.profile.map(profile) };
        with_radii(wire, &GivenRadii::default(), &radii, |radius, _, out| out.fill(*radius))
    };
    let quadors = |radius: f64| Quadors::new(&graph(radius)?, spec.fillet.into());
    let share = || sample::inside(region, 10 * sample::COUNT).1 * region.bounds().size().iter().product::<f64>();
    let size = region.volume().unwrap_or_else(share);
    let exact = |radius: f64| -> Result<Option<f64>, Fault> {
        let made = quadors(radius)?;
        if !made.overlaps().is_empty() || !made.collisions().is_empty() {
            return Ok(None);
        }
        Ok(Some(made.volume()? / size))
    };
    let length: f64 = wire.struts.iter().map(|s| wire.length(*s)).sum();
    let start = (asked * size / (core::f64::consts::PI * length)).sqrt();
    let uncut = solve(asked, start, 1e-12, exact);
    if let Ok(Ok(radius)) = uncut
        && whole(&quadors(radius).map_err(fault)?, &**region)
    {
        return Ok(radius);
    }
    let points = sample::inside(region, POINTS).0;
    let sampled = |radius: f64| -> Result<Option<f64>, Fault> {
        let made = quadors(radius)?;
        let solid: usize = points.par_iter().with_min_len(256).map(|p| usize::from(made.contains(*p))).sum();
        Ok(Some(solid as f64 / points.len().max(1) as f64))
    };
    let near = 1.0 / points.len().max(1) as f64;
    match solve(asked, start, near, sampled).map_err(fault)? {
        Ok(radius) => Ok(radius),
        Err(most) => {
            let why = "thicker beams are no longer than their hubs are wide; give a radius instead";
            Err(impossible(asked, most.fraction, why, environment))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_radius_is_found_from_any_start_and_a_limit_is_told() {
        let cubic = |limit: f64| {
            move |r: f64| -> Result<Option<f64>, Fault> { Ok((r <= limit).then_some(9.0 * r * r - 8.0 * r.powi(3))) }
        };
        for start in [1e-4, 0.1, 0.3, 5.0] {
            let r = solve(0.3, start, 1e-12, cubic(0.5)).expect("no fault").expect("a radius");
            assert!((9.0 * r * r - 8.0 * r.powi(3) - 0.3).abs() < 1e-11, "{start}: {r}");
            let most = solve(0.3, start, 1e-12, cubic(0.1)).expect("no fault").expect_err("none");
            assert!((most.radius - 0.1).abs() < 1e-9 && (most.fraction - 0.082).abs() < 1e-8);
        }
    }
}
