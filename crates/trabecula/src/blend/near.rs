//! What the neighbourhoods about a point say together, and how that changes from place to place.

use super::levels::Levels;
use super::quantile::Spot;
use super::strand::Strand;
use crate::math::Vec3;

/// So many cubes of neighbourhoods are remembered.
const KEPT: usize = 32;
const NOBODY: usize = usize::MAX;

/// The neighbourhoods about points, and what they say at nodes of the table.
pub(super) struct Near<'a> {
    levels: &'a Levels,
    strands: &'a [Strand],
    /// Cubes that were entered, each where its name says; and that of the point.
    kept: Vec<Cube<'a>>,
    at: usize,
    /// The shares of the upper ones along each axis, and their slopes (per mm).
    share: Vec3,
    slope: Vec3,
}

/// Eight neighbourhoods with points between them; one and the same where one serves all.
struct Cube<'a> {
    name: usize,
    corners: [usize; 8],
    /// Their numbers at the nodes that were asked for.
    numbers: Vec<Option<[&'a [f32]; 8]>>,
}

impl<'a> Near<'a> {
    /// About no point yet.
    pub fn new(levels: &'a Levels, strands: &'a [Strand]) -> Near<'a> {
        let none = || Cube {
            name: NOBODY,
            corners: [0; 8],
            numbers: Vec::new(),
        };
        Near {
            levels,
            strands,
            kept: (0..KEPT).map(|_| none()).collect(),
            at: 0,
            share: [0.0; 3],
            slope: [0.0; 3],
        }
    }

    /// Goes to a point.
    pub fn enter(&mut self, p: Vec3) {
        let joint = &self.levels.joint;
        if joint.len() == 1 && self.kept[self.at].name != NOBODY {
            return;
        }
        let (mut name, mut between) = (0, [[0; 2]; 3]);
        for a in 0..3 {
            let (i, share, slope) = joint.along(a, p[a]);
            (self.share[a], self.slope[a]) = (share, slope);
            let next = (i + 1).min(joint.shape[a] - 1);
            // Beyond the outermost ones those before them do not count.
            let (which, ends) = match (slope == 0.0, share == 0.0) {
                (false, _) => (0, [i, next]),
                (true, true) => (1, [i, i]),
                (true, false) => (2, [next, next]),
            };
            between[a] = ends;
            name = (name * joint.shape[a] + i) * 3 + which;
        }
        self.at = name % KEPT;
        let cube = &mut self.kept[self.at];
        if cube.name != name {
            let [nx, ny, _] = joint.shape;
            cube.name = name;
            cube.corners = core::array::from_fn(|c| {
                let [x, y, z] = [0, 1, 2].map(|a| between[a][c >> a & 1]);
                (z * ny + y) * nx + x
            });
            cube.numbers.clear();
            cube.numbers.resize(self.levels.grid.len(), None);
        }
    }

    /// What the neighbourhoods about the point have at a node of the table.
    #[inline]
    fn numbers(&mut self, node: usize) -> [&'a [f32]; 8] {
        let (levels, strands) = (self.levels, self.strands);
        let Cube {
            corners, numbers, ..
        } = &mut self.kept[self.at];
        *numbers[node].get_or_insert_with(|| corners.map(|i| levels.numbers(i, strands, node)))
    }

    /// What is said at a node of the table (of an end, or at the share q), how that changes per mm, and with q.
    #[inline(always)]
    pub fn ask(&mut self, node: usize, end: usize, q: f64) -> (f64, Vec3, f64) {
        let numbers = self.numbers(node);
        let one = self.levels.joint.len() == 1;
        let per_mm = |rise: Vec3, slope: Vec3| [0, 1, 2].map(|a| rise[a] * slope[a]);
        if self.levels.is_uniform() {
            if one {
                return (f64::from(numbers[0][end]), [0.0; 3], 0.0);
            }
            let (v, rise) = self.linear(numbers.map(|n| f64::from(n[end])));
            return (v, per_mm(rise, self.slope), 0.0);
        }
        let spot = Spot::of(q);
        if one {
            let (v, steep) = spot.ask(numbers[0]);
            return (v, [0.0; 3], steep);
        }
        let found = numbers.map(|n| spot.ask(n));
        let (v, rise) = self.linear(found.map(|f| f.0));
        let (steep, _) = self.linear(found.map(|f| f.1));
        (v, per_mm(rise, self.slope), steep)
    }

    /// Linear between the corners along each axis: the value, and how it rises from the lower to the upper ones.
    #[inline]
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
