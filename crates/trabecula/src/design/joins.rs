//! Connectivity of a lattice whose zones have different cells, predicted without making the surface.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{CellZone, Warning};
use crate::cell::Part;
use crate::cell::tet::{Bary, TetCell};
use crate::report::ZoneJoin;
use crate::tiling::{self, Connectivity, Tiling, ZonePair};

/// The cell of each zone.
pub(super) type Zoned = BTreeMap<i64, Arc<TetCell>>;

/// Steps along the edge of a face on which ports are sampled.
const STEPS: usize = 96;

/// Connectivity, and for every two zones with common faces the fraction of a face that is solid in both cells.
#[derive(Clone, Debug)]
pub struct Joins {
    connectivity: Connectivity,
    shares: Vec<f64>,
}

/// The connectivity of a lattice of zones whose cells have this solid fraction.
pub(super) fn joins(tiling: &Tiling, cells: &Zoned, fraction: f64) -> Option<Joins> {
    let connectivity = tiling::connectivity(tiling)?;
    let share = |zones: [i64; 2]| {
        let [a, b] = zones.map(|z| cells.get(&z));
        common(a?, b?, tiling.part, fraction)
    };
    let shares = connectivity.pairs.iter().map(|j| share(j.zones).unwrap_or(0.0));
    Some(Joins { shares: shares.collect(), connectivity })
}

/// The share of a face that is solid in both of two cells at the same fraction, by points evenly on it.
fn common(a: &TetCell, b: &TetCell, part: Part, fraction: f64) -> Option<f64> {
    let n = STEPS as f64;
    // The centroids of the small triangles of both orientations.
    let at = |i: usize, j: usize, third: f64| -> Bary {
        let [x, y] = [i, j].map(|v| (v as f64 + third) / n);
        [x, y, 1.0 - x - y, 0.0]
    };
    let mut points = Vec::with_capacity(STEPS * STEPS);
    for i in 0..STEPS {
        points.extend((0..STEPS - i).map(|j| at(i, j, 1.0 / 3.0)));
        points.extend((0..STEPS - i - 1).map(|j| at(i, j, 2.0 / 3.0)));
    }
    let solid = |s: &TetCell| -> Vec<bool> {
        let t = s.iso(part, fraction);
        let inside = |f: f64| match part {
            Part::Lower => f < t,
            Part::Upper => f > t,
            Part::Sheet => f.abs() < t,
        };
        s.values(&points).into_iter().map(inside).collect()
    };
    let both = solid(a).into_iter().zip(solid(b)).filter(|s| s.0 && s.1).count();
    Some(both as f64 / points.len() as f64)
}

impl Joins {
    /// Warns of zones that are not connected, or of a lattice that is disconnected although they are.
    pub(super) fn warn(&self, of: &[CellZone], path: &str, warnings: &mut Vec<Warning>) {
        let mut say = |message: String| {
            warnings.push(Warning { path: path.to_string(), message });
        };
        let name = |zone: i64| {
            let of = of.iter().find(|z| z.numbers.contains(&zone));
            of.map_or(zone.to_string(), |z| format!("{} ({})", z.name, z.cell))
        };
        let apart = self.connectivity.pairs.iter().zip(&self.shares).filter(|(j, _)| !j.joined);
        let mut any = false;
        for (join, share) in apart {
            any = true;
            let [a, b] = join.zones;
            say(format!(
                "zones {} and {} do not join: solid passes through {} of the {} faces between them, but the two stay \
                 apart, as their ports share {:.1} % of a face; take cells with ports in the same places, or a higher fraction",
                name(a),
                name(b),
                join.open,
                join.faces,
                100.0 * share
            ));
        }
        if !any && self.connectivity.components > 1 {
            say(format!("the lattice is in {} pieces, as its ports show", self.connectivity.components));
        }
    }

    /// Number of connected components of the lattice.
    pub(super) fn components(&self) -> usize {
        self.connectivity.components
    }

    /// The record for the report.
    pub(super) fn report(&self) -> Vec<ZoneJoin> {
        let one = |(j, ports): (&ZonePair, &f64)| ZoneJoin {
            zones: j.zones,
            faces: j.faces,
            open: j.open,
            ports: *ports,
            joined: j.joined,
        };
        self.connectivity.pairs.iter().zip(&self.shares).map(one).collect()
    }
}
