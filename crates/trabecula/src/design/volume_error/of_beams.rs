//! The volume error to expect of beams: a few hubs with their beams, whose volume is known exactly, are meshed by themselves.

use std::sync::Arc;

use geometry::progress::Silent;
use rayon::prelude::*;

use crate::design::Built;
use crate::extract;
use crate::region::Cuboid;
use crate::solid::Solid;
use crate::truss::Beams;
use beams::{Beam, Graph, HubBall, Profile, Quadors};

/// Hubs that are meshed.
const HUBS: usize = 4;

/// The share of the errors of beams and of their joints that is left at least where they cancel.
const LEFT: f64 = 0.25;

/// Most steps' squares on the surface of what is meshed at once; at finer spacings the error is taken to fall with the second power.
const SQUARES: f64 = 3e4;

/// The relative error of the volume of beams at grid spacing `edge` (mm); `None` where that of no hub has a closed form.
pub(super) fn of_beams(beams: &Beams, built: &Built, edge: f64) -> Option<f64> {
    let (quadors, hubs) = match beams {
        Beams::Truss(truss) => (&*truss.quadors, spread(truss.within.nodes.as_slice(), &truss.quadors)),
        Beams::Pattern(laid) => {
            let (quadors, mut kinds) = laid.representatives();
            // Those of most of the volume; of equals the first.
            kinds.sort_by(|a, b| b.1.total_cmp(&a.1));
            kinds.truncate(HUBS);
            (quadors, kinds)
        }
    };
    let low = built.solid.region.bounds().min;
    let each = hubs.par_iter().filter_map(|(hub, weight)| {
        let [exact, off] = of_hub(quadors, *hub, low, edge)?;
        Some([weight * exact, weight * off])
    });
    // Summed in order: the same for any number of threads.
    let [exact, off] = each.collect::<Vec<_>>().into_iter().reduce(|a, b| [a[0] + b[0], a[1] + b[1]])?;
    Some(off / exact)
}

/// Some of the hubs that are in the region, or of all where none is, each counted once.
fn spread(inside: &[bool], quadors: &Quadors) -> Vec<(usize, f64)> {
    let some = inside.contains(&true);
    let hubs: Vec<usize> =
        (0..quadors.len()).filter(|i| (!some || inside[*i]) && !quadors.hub(*i).half_beams.is_empty()).collect();
    // In the middle of equal shares of their list.
    let count = hubs.len().min(HUBS);
    (0..count).map(|k| (hubs[(2 * k + 1) * hubs.len() / (2 * count)], 1.0)).collect()
}

/// The exact volume of a hub with the halves of its beams, and how far that of its mesh is off, mm³: of the hub with whole beams less half
/// of each beam alone. Chords cost beams volume, while hubs without fillets gain some; what cancels in one grid does not in another.
fn of_hub(quadors: &Quadors, hub: usize, low: [f64; 3], edge: f64) -> Option<[f64; 2]> {
    let incident: Vec<usize> = quadors.hub(hub).half_beams.iter().map(|half| half.beam as usize).collect();
    let whole = star(quadors, hub, &incident)?;
    let step = edge.max((whole.mass().ok()?.area / SQUARES).sqrt());
    let [volume, off] = meshed(whole, low, step)?;
    let mut halves = [0.0; 2];
    for beam in incident {
        let alone = meshed(star(quadors, hub, &[beam])?, low, step)?;
        halves = [0, 1].map(|i| halves[i] + alone[i] / 2.0);
    }
    let joint = off - 2.0 * halves[1];
    let least = LEFT * (joint.abs() + halves[1].abs());
    Some([volume - halves[0], (off - halves[1]).abs().max(least) * (edge / step).powi(2)])
}

/// The exact volume of beams and how much more their mesh has, mm³.
fn meshed(beams: Quadors, low: [f64; 3], step: f64) -> Option<[f64; 2]> {
    let exact = beams.mass().ok()?.volume;
    let bounds = beams.bounds().grown(2.0 * step);
    // In the places that the grid of the part has.
    let min = [0, 1, 2].map(|a| low[a] + ((bounds.min[a] - low[a]) / step).floor() * step);
    let solid = Solid::new(Arc::new(Cuboid::new(min, bounds.max).ok()?), Some(Arc::new(beams)), step);
    let made = extract::surface(&solid, step, &Silent).map_or(0.0, |made| made.mesh.volume());
    Some([exact, made - exact])
}

/// A hub with some of its beams, whose other hubs have no more.
fn star(quadors: &Quadors, hub: usize, incident: &[usize]) -> Option<Quadors> {
    let ball = |i: usize| HubBall { center: quadors.center(i), radius: quadors.hub(i).radius };
    let mut graph = Graph { hubs: vec![ball(hub)], beams: Vec::new() };
    for &beam in incident {
        let next = graph.hubs.len() as u32;
        let ends = quadors.ends(beam);
        let other = ends.into_iter().find(|e| *e as usize != hub)?;
        graph.hubs.push(ball(other as usize));
        let profile = Profile::Lambda(quadors.pencil(beam).lambda);
        graph.beams.push(Beam { ends: ends.map(|e| if e == other { next } else { 0 }), profile });
    }
    Quadors::new(&graph, quadors.fillet()).ok()
}
