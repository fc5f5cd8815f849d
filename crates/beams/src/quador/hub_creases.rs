//! The creases in which beams without fillets meet, as straight pieces.

use std::f64::consts::PI;

use super::Quadors;
use super::complex::Complex;
use super::hub::Hub;
use geometry::feature_edges::{Creases, Segment, TURN};
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use rayon::prelude::*;

impl Quadors {
    /// The creases of all hubs, in pieces about as long as `step` (mm) with their ends on the surface; none with fillets. Those of a hub
    /// whose beams lie inside each other are left out.
    pub fn creases(&self, step: f64) -> Creases {
        let mut all = Creases::default();
        if !self.has_creases() {
            return all;
        }
        let of = |i: usize| self.complex(i).ok().map(|c| pieces(&self.hub(i), &c, self.center(i), step));
        let each: Vec<Option<Creases>> = (0..self.len()).into_par_iter().map(of).collect();
        for of in each.into_iter().flatten() {
            all.segments.extend(of.segments);
            all.corners.extend(of.corners);
        }
        all
    }
}

/// The creases of a hub with its centre at a position.
fn pieces(hub: &Hub, complex: &Complex, center: Vec3, step: f64) -> Creases {
    let mut found = Creases::default();
    let mut ends = vec![0; complex.vertices.len()];
    for arc in &complex.arcs {
        let conic = &arc.conic;
        let [m, n] = arc.labels.map(|label| normal(hub, label, conic.at(0.5 * conic.end)));
        let turn = norm(cross(m, n)).atan2(dot(m, n));
        if turn < TURN {
            continue;
        }
        let rough = |k: usize| conic.at(conic.end * k as f64 / 8.0);
        let length: f64 = (0..8).map(|k| norm(sub(rough(k + 1), rough(k)))).sum();
        // At least eight on a closed one.
        let least = if conic.end == PI { 8.0 } else { 1.0 };
        let count = (length / step).ceil().max(least) as usize;
        let at = |k: usize| add(center, conic.at(conic.end * k as f64 / count as f64));
        found.segments.extend((0..count).map(|k| {
            let ends = [at(k), at(k + 1)];
            Segment { ends, turn, run: norm(sub(ends[0], ends[1])) }
        }));
        arc.ends.iter().for_each(|v| ends[*v as usize] += 1);
    }
    // In a vertex of two arcs, that of a closed one too, the crease goes on.
    let corners = complex.vertices.iter().zip(ends).filter(|(_, count)| *count > 2);
    found.corners = corners.map(|(v, count)| (add(center, v.at), count)).collect();
    found
}

/// The outward direction of a sharp hub's surface where the half-beams of a label are active: at most one.
fn normal(hub: &Hub, label: u64, x: Vec3) -> Vec3 {
    match hub.half_beams.get(label.trailing_zeros() as usize) {
        Some(beam) => sub(x, scale(beam.g.a, beam.g.at(x))),
        None => x,
    }
}
