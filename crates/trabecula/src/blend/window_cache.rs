//! The windows about a point and what is tabulated at them, kept from point to point; trilinear interpolation between them.

use super::empirical::QuantileSegment;
use super::levels::BlendLevels;
use super::summand::Summand;
use geometry::math::Vec3;

/// Number of interpolation cells in the cache.
const SLOTS: usize = 32;
/// Key of an empty slot.
const EMPTY: usize = usize::MAX;

/// The C windows about a point: eight, or one that serves everywhere.
pub(super) struct WindowCache<'a, const C: usize> {
    levels: &'a BlendLevels,
    summands: &'a [Summand],
    /// Interpolation cells, each in the slot of its key modulo `SLOTS`; and the slot of the current point.
    slots: Vec<WindowCell<'a, C>>,
    current: usize,
    /// The cell's first window along each axis; NaN where the point lies beyond the outermost.
    first: Vec3,
    /// The point's position in the cell, 0 to 1 along each axis, and its slopes (per mm).
    position: Vec3,
    slope: Vec3,
}

/// An interpolation cell between windows.
struct WindowCell<'a, const C: usize> {
    key: usize,
    windows: [usize; C],
    /// For each node of the shares' grid, once needed: the offsets of both ends, or where levels vary the quantile functions.
    offsets: Vec<Option<[[f32; C]; 2]>>,
    quantiles: Vec<Option<[&'a [f32]; C]>>,
}

impl<'a, const C: usize> WindowCache<'a, C> {
    /// At no point yet.
    pub fn new(levels: &'a BlendLevels, summands: &'a [Summand]) -> WindowCache<'a, C> {
        let empty = || WindowCell { key: EMPTY, windows: [0; C], offsets: Vec::new(), quantiles: Vec::new() };
        WindowCache {
            levels,
            summands,
            slots: (0..SLOTS).map(|_| empty()).collect(),
            current: 0,
            first: [f64::NAN; 3],
            position: [0.0; 3],
            slope: [0.0; 3],
        }
    }

    /// Moves to a point (mm).
    pub fn move_to(&mut self, p: Vec3) {
        let windows = &self.levels.windows;
        if C == 1 && self.slots[self.current].key != EMPTY {
            return;
        }
        // Most points lie in the cell of the point before them.
        let position: Vec3 = core::array::from_fn(|a| windows.in_steps(a, p[a]) - self.first[a]);
        if position.iter().all(|s| (0.0..1.0).contains(s)) {
            self.position = position;
            return;
        }
        let (mut key, mut between) = (0, [[0; 2]; 3]);
        for a in 0..3 {
            let (i, position, slope) = windows.interval(a, p[a]);
            (self.position[a], self.slope[a]) = (position, slope);
            let next = (i + 1).min(windows.shape[a] - 1);
            // Beyond the outermost windows those next to them have no weight.
            let (which, ends) = match (slope == 0.0, position == 0.0) {
                (false, _) => (0, [i, next]),
                (true, true) => (1, [i, i]),
                (true, false) => (2, [next, next]),
            };
            self.first[a] = if slope == 0.0 { f64::NAN } else { i as f64 };
            between[a] = ends;
            key = (key * windows.shape[a] + i) * 3 + which;
        }
        self.current = key % SLOTS;
        let cell = &mut self.slots[self.current];
        if cell.key != key {
            let [nx, ny, _] = windows.shape;
            cell.key = key;
            cell.windows = core::array::from_fn(|c| {
                let [x, y, z] = [0, 1, 2].map(|a| between[a][c >> a & 1]);
                (z * ny + y) * nx + x
            });
            let nodes = self.levels.grid.len();
            cell.offsets.clear();
            cell.quantiles.clear();
            match self.levels.is_uniform() {
                true => cell.offsets.resize(nodes, None),
                false => cell.quantiles.resize(nodes, None),
            }
        }
    }

    /// The offset of an end at a node of the shares' grid, where no level varies.
    #[inline]
    pub fn offsets(&mut self, node: usize, end: usize) -> [f64; C] {
        let (levels, summands) = (self.levels, self.summands);
        let WindowCell { windows, offsets, .. } = &mut self.slots[self.current];
        let offsets = offsets[node].get_or_insert_with(|| {
            let of_windows = windows.map(|i| levels.node_values(i, summands, node));
            [0, 1].map(|e| of_windows.map(|of| of[e]))
        });
        offsets[end].map(f64::from)
    }

    /// The quantile functions of a node at a fraction, and their slopes, where levels vary.
    #[inline]
    pub fn quantiles(&mut self, node: usize, segment: QuantileSegment) -> ([f64; C], [f64; C]) {
        let (levels, summands) = (self.levels, self.summands);
        let WindowCell { windows, quantiles, .. } = &mut self.slots[self.current];
        let of = quantiles[node]
            .get_or_insert_with(|| windows.map(|i| levels.node_values(i, summands, node)))
            .map(|table| segment.value_and_slope(table));
        (of.map(|f| f.0), of.map(|f| f.1))
    }

    /// Trilinear interpolation of a number at each window to the point.
    #[inline]
    pub fn interpolate(&self, v: &[f64; C]) -> f64 {
        if C == 1 {
            return v[0];
        }
        let [x, y, z] = self.position;
        let along_x: [f64; 4] = core::array::from_fn(|i| v[2 * i] + x * (v[2 * i + 1] - v[2 * i]));
        let along_y = [0, 2].map(|i| along_x[i] + y * (along_x[i + 1] - along_x[i]));
        along_y[0] + z * (along_y[1] - along_y[0])
    }

    /// The same and its gradient (per mm).
    #[inline]
    pub fn interpolate_gradient(&self, v: &[f64; C]) -> (f64, Vec3) {
        if C == 1 {
            return (v[0], [0.0; 3]);
        }
        let [x, y, z] = self.position;
        let between = |a: f64, b: f64, t: f64| a + t * (b - a);
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
