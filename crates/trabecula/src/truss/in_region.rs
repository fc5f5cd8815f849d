//! Which beams are in a region: a graph has others too, whose fillets shape those that are.

use rayon::prelude::*;

use crate::field::Field;
use beams::Quadors;
use beams::graph::Within;
use geometry::math::{Vec3, add, norm, scale, sub};

/// Minimum number of steps along an axis: narrower parts of the region are missed.
const MIN_STEPS: f64 = 256.0;
/// Share of a radius by which a beam that touches the region from outside may seem to reach into it.
const TOUCH: f64 = 1e-9;

/// Whether something of each beam is in a region (signed distance): whether its axis is somewhere nearer to it than the beam's radius
/// there. The radius at a hub is the ball's.
pub fn beams_in(quadors: &Quadors, region: &dyn Field) -> Vec<bool> {
    (0..quadors.beams()).into_par_iter().map(|b| is_in(quadors, b, region)).collect()
}

/// What of a graph is in a region: its beams, the hubs for whose centre `inside` holds, and as joints those whose balls reach into it.
pub fn within(quadors: &Quadors, region: &dyn Field, inside: &(impl Fn(Vec3) -> bool + Sync)) -> Within {
    let hubs = || (0..quadors.len()).into_par_iter();
    Within {
        struts: beams_in(quadors, region),
        nodes: hubs().map(|i| inside(quadors.center(i))).collect(),
        joints: hubs().map(|i| region.value(quadors.center(i)) < (1.0 - TOUCH) * quadors.hub(i).radius).collect(),
    }
}

fn is_in(quadors: &Quadors, beam: usize, region: &dyn Field) -> bool {
    let pencil = quadors.pencil(beam);
    let [from, to] = quadors.ends(beam).map(|h| quadors.center(h as usize));
    let (length, [r1, r2]) = (pencil.length, pencil.radii);
    let axis = scale(sub(to, from), 1.0 / norm(sub(to, from)));
    // Within a hub the beam goes on as it touches the ball.
    let [low, high] = [pencil.contact(0), length - pencil.contact(1)];
    let section = |z: f64| pencil.radius_squared(z.max(low).min(high)).max(0.0);
    let radius = |z: f64| section(z).max(r1 * r1 - z * z).max(r2 * r2 - (length - z).powi(2)).sqrt();
    let [a, b, _] = pencil.meridian(0);
    let widest = if a < 0.0 { section(-0.5 * b / a) } else { 0.0 };
    let most = r1.max(r2).max(widest.max(section(low)).max(section(high)).sqrt());
    let reaches = |z: f64, v: f64| v < (1.0 - TOUCH) * radius(z);
    let mut z = 0.0;
    while z < length {
        let v = region.value(add(from, scale(axis, z)));
        if reaches(z, v) {
            return true;
        }
        // A distance changes by no more than the step.
        z += (v - most).max(length / MIN_STEPS);
    }
    reaches(length, region.value(to))
}
