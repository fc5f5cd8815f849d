//! What the neighbourhoods about a point say together, and how that changes from place to place.

use super::levels::Levels;
use super::quantile::Spot;
use super::strand::Strand;
use geometry::math::Vec3;

/// Number of cubes of neighbourhoods in the cache.
const KEPT: usize = 32;
const NOBODY: usize = usize::MAX;

/// The neighbourhoods about points, and what they say at nodes of the table: C about each point, eight, or one that serves all.
pub(super) struct Near<'a, const C: usize> {
    levels: &'a Levels,
    strands: &'a [Strand],
    /// Cubes that were entered, each where its name says; and that of the point.
    kept: Vec<Cube<'a, C>>,
    at: usize,
    /// Its first neighbourhood along each axis; NaN where points beyond the outermost share it.
    first: Vec3,
    /// The shares of the upper ones along each axis, and their slopes (per mm).
    share: Vec3,
    slope: Vec3,
}

/// Neighbourhoods with points between them.
struct Cube<'a, const C: usize> {
    name: usize,
    corners: [usize; C],
    /// What they say at the nodes that were asked for: what is added to the ends, or quantile functions where levels vary.
    ends: Vec<Option<[[f32; C]; 2]>>,
    curves: Vec<Option<[&'a [f32]; C]>>,
}

impl<'a, const C: usize> Near<'a, C> {
    /// About no point yet.
    pub fn new(levels: &'a Levels, strands: &'a [Strand]) -> Near<'a, C> {
        let none = || Cube { name: NOBODY, corners: [0; C], ends: Vec::new(), curves: Vec::new() };
        Near {
            levels,
            strands,
            kept: (0..KEPT).map(|_| none()).collect(),
            at: 0,
            first: [f64::NAN; 3],
            share: [0.0; 3],
            slope: [0.0; 3],
        }
    }

    /// Goes to a point.
    pub fn enter(&mut self, p: Vec3) {
        let joint = &self.levels.joint;
        if C == 1 && self.kept[self.at].name != NOBODY {
            return;
        }
        // Most points lie where the one before them does.
        let past: Vec3 = core::array::from_fn(|a| joint.steps(a, p[a]) - self.first[a]);
        if past.iter().all(|s| (0.0..1.0).contains(s)) {
            self.share = past;
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
            self.first[a] = if slope == 0.0 { f64::NAN } else { i as f64 };
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
            let nodes = self.levels.grid.len();
            cube.ends.clear();
            cube.curves.clear();
            match self.levels.is_uniform() {
                true => cube.ends.resize(nodes, None),
                false => cube.curves.resize(nodes, None),
            }
        }
    }

    /// What is added to an end at a node of the table, where no level varies.
    #[inline]
    pub fn end(&mut self, node: usize, end: usize) -> [f64; C] {
        let (levels, strands) = (self.levels, self.strands);
        let Cube { corners, ends, .. } = &mut self.kept[self.at];
        let ends = ends[node].get_or_insert_with(|| {
            let numbers = corners.map(|i| levels.numbers(i, strands, node));
            [0, 1].map(|e| numbers.map(|of| of[e]))
        });
        ends[end].map(f64::from)
    }

    /// The quantile functions of a node of the table at a share, where levels vary; and their slopes.
    #[inline]
    pub fn curve(&mut self, node: usize, spot: Spot) -> ([f64; C], [f64; C]) {
        let (levels, strands) = (self.levels, self.strands);
        let Cube { corners, curves, .. } = &mut self.kept[self.at];
        let of = curves[node]
            .get_or_insert_with(|| corners.map(|i| levels.numbers(i, strands, node)))
            .map(|knots| spot.ask(knots));
        (of.map(|f| f.0), of.map(|f| f.1))
    }

    /// What a number at each of them makes at the point: linear between them along each axis.
    #[inline]
    pub fn value(&self, v: &[f64; C]) -> f64 {
        if C == 1 {
            return v[0];
        }
        let [x, y, z] = self.share;
        let along_x: [f64; 4] = core::array::from_fn(|i| v[2 * i] + x * (v[2 * i + 1] - v[2 * i]));
        let along_y = [0, 2].map(|i| along_x[i] + y * (along_x[i + 1] - along_x[i]));
        along_y[0] + z * (along_y[1] - along_y[0])
    }

    /// The same, and how it changes per mm.
    #[inline]
    pub fn gradient(&self, v: &[f64; C]) -> (f64, Vec3) {
        if C == 1 {
            return (v[0], [0.0; 3]);
        }
        let [x, y, z] = self.share;
        let between = |a: f64, b: f64, share: f64| a + share * (b - a);
        let rise_x = [0, 1, 2, 3].map(|i| v[2 * i + 1] - v[2 * i]);
        let along_x = [0, 1, 2, 3].map(|i| v[2 * i] + x * rise_x[i]);
        let rise_y = [0, 1].map(|i| along_x[2 * i + 1] - along_x[2 * i]);
        let along_y = [0, 1].map(|i| along_x[2 * i] + y * rise_y[i]);
        let dx = [0, 1].map(|i| between(rise_x[2 * i], rise_x[2 * i + 1], y));
        let dz = along_y[1] - along_y[0];
        let rise = [between(dx[0], dx[1], z), between(rise_y[0], rise_y[1], z), dz];
        let per_mm = [0, 1, 2].map(|a| rise[a] * self.slope[a]);
        (along_y[0] + z * dz, per_mm)
    }
}
