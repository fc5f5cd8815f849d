//! What the neighbourhoods about a point say together, and how that changes from place to place.

use super::levels::{Levels, Station};
use super::quantile::Spot;
use super::strand::Strand;
use crate::math::Vec3;

/// The neighbourhoods about points that follow each other: they are found again only where others begin.
pub(super) struct Near<'a> {
    levels: &'a Levels,
    strands: &'a [Strand],
    /// The lower and the upper ones along each axis.
    between: Option<[[usize; 2]; 3]>,
    /// One that serves all, or the eight corners: the number of each, and what is known of it.
    corners: Vec<(usize, &'a Station)>,
    /// The shares of the upper ones, and their slopes (per mm).
    share: Vec3,
    slope: Vec3,
}

impl<'a> Near<'a> {
    /// About no point yet.
    pub fn new(levels: &'a Levels, strands: &'a [Strand]) -> Near<'a> {
        Near {
            levels,
            strands,
            between: None,
            corners: Vec::with_capacity(8),
            share: [0.0; 3],
            slope: [0.0; 3],
        }
    }

    /// Goes to a point.
    pub fn enter(&mut self, p: Vec3) {
        let joint = &self.levels.joint;
        let along: [(usize, f64, f64); 3] = core::array::from_fn(|a| joint.along(a, p[a]));
        (self.share, self.slope) = (along.map(|a| a.1), along.map(|a| a.2));
        let between = core::array::from_fn(|a| {
            let (i, share, slope) = along[a];
            let next = (i + 1).min(joint.shape[a] - 1);
            // Beyond the outermost ones those before them do not count.
            match (share, slope) {
                (0.0, 0.0) => [i, i],
                (1.0, 0.0) => [next, next],
                _ => [i, next],
            }
        });
        if self.between == Some(between) {
            return;
        }
        self.between = Some(between);
        self.corners.clear();
        let [nx, ny, _] = joint.shape;
        let count = if joint.len() == 1 { 1 } else { 8 };
        for c in 0..count {
            let [x, y, z] = [0, 1, 2].map(|a| between[a][c >> a & 1]);
            let i = (z * ny + y) * nx + x;
            self.corners.push((i, self.levels.station(i, self.strands)));
        }
    }

    /// What is said at a node of the table (of an end, or at the share q), how that changes per mm, and with q.
    pub fn ask(&self, node: usize, end: usize, q: f64) -> (f64, Vec3, f64) {
        let spot = Spot::of(q);
        let uniform = self.levels.is_uniform();
        let of = |&(i, station): &(usize, &Station)| {
            let numbers = match station.known(node) {
                Some(numbers) => numbers,
                None => self.levels.numbers(i, self.strands, node),
            };
            match uniform {
                true => (f64::from(numbers[end]), 0.0),
                false => spot.ask(numbers),
            }
        };
        let Some(corners) = self.corners.as_chunks::<8>().0.first() else {
            let (v, steep) = self.corners.first().map_or((0.0, 0.0), of);
            return (v, [0.0; 3], steep);
        };
        let found = corners.each_ref().map(of);
        let (v, rise) = self.linear(found.map(|f| f.0));
        let steep = match uniform {
            true => 0.0,
            false => self.linear(found.map(|f| f.1)).0,
        };
        (v, [0, 1, 2].map(|a| rise[a] * self.slope[a]), steep)
    }

    /// Linear between the corners along each axis: the value, and how it rises from the lower to the upper ones.
    fn linear(&self, v: [f64; 8]) -> (f64, Vec3) {
        let [x, y, z] = self.share;
        let between = |a: f64, b: f64, share: f64| a + share * (b - a);
        let rise_x = [0, 1, 2, 3].map(|i| v[2 * i + 1] - v[2 * i]);
        let along_x = [0, 1, 2, 3].map(|i| v[2 * i] + x * rise_x[i]);
        let rise_y = [0, 1].map(|i| along_x[2 * i + 1] - along_x[2 * i]);
        let along_y = [0, 1].map(|i| along_x[2 * i] + y * rise_y[i]);
        let dx = [0, 1].map(|i| between(rise_x[2 * i], rise_x[2 * i + 1], y));
        let dz = along_y[1] - along_y[0];
        let rise = [
            between(dx[0], dx[1], z),
            between(rise_y[0], rise_y[1], z),
            dz,
        ];
        (along_y[0] + z * dz, rise)
    }
}
