//! A grid of nodes over a box, ends included.

use geometry::math::{Aabb, Vec3};

/// Nodes origin + step · (i, j, k), 0 ≤ i < shape, x running fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PhaseGrid {
    pub origin: Vec3,
    pub step: Vec3,
    pub shape: [usize; 3],
}

impl PhaseGrid {
    /// A grid over the box with `nodes` nodes along each axis (at least two).
    pub fn over(b: &Aabb, shape: [usize; 3]) -> PhaseGrid {
        let size = b.size();
        PhaseGrid { origin: b.min, step: core::array::from_fn(|a| size[a] / (shape[a] - 1) as f64), shape }
    }

    /// The same with more nodes on each side.
    pub fn padded(&self, by: usize) -> PhaseGrid {
        let origin = core::array::from_fn(|a| self.origin[a] - by as f64 * self.step[a]);
        PhaseGrid { origin, step: self.step, shape: self.shape.map(|n| n + 2 * by) }
    }

    /// The grid of every other node, from the first one on, and the numbers of its nodes in this one.
    pub fn halved(&self) -> (PhaseGrid, Vec<usize>) {
        let half = PhaseGrid { step: self.step.map(|s| 2.0 * s), shape: self.shape.map(|n| n.div_ceil(2)), ..*self };
        let strides = self.strides();
        let here = |n: usize| half.index(n).into_iter().zip(strides).map(|(i, s)| 2 * i * s).sum();
        (half, (0..half.len()).map(here).collect())
    }

    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// The index along each axis of node `n`.
    pub fn index(&self, n: usize) -> [usize; 3] {
        let [nx, ny, _] = self.shape;
        [n % nx, n / nx % ny, n / nx / ny]
    }

    pub fn node(&self, n: usize) -> Vec3 {
        let at = self.index(n);
        core::array::from_fn(|a| self.origin[a] + self.step[a] * at[a] as f64)
    }

    /// How far apart neighbours along each axis are stored.
    pub fn strides(&self) -> [usize; 3] {
        [1, self.shape[0], self.shape[0] * self.shape[1]]
    }

    /// The adjacent nodes along the axes.
    pub fn neighbours(&self, n: usize) -> impl Iterator<Item = usize> + use<> {
        let (at, strides, shape) = (self.index(n), self.strides(), self.shape);
        (0..3).flat_map(move |a| {
            let below = (at[a] > 0).then(|| n - strides[a]);
            let above = (at[a] + 1 < shape[a]).then(|| n + strides[a]);
            below.into_iter().chain(above)
        })
    }

    /// The nodes about a point, or about the nearest point of the grid's box, and their shares in a value there, linear between them.
    pub fn around(&self, p: Vec3) -> [(usize, f64); 8] {
        let along = |a: usize| ((p[a] - self.origin[a]) / self.step[a]).clamp(0.0, (self.shape[a] - 1) as f64);
        let first: [usize; 3] = core::array::from_fn(|a| (along(a) as usize).min(self.shape[a] - 2));
        let strides = self.strides();
        core::array::from_fn(|corner| {
            (0..3).fold((0, 1.0), |(n, share), a| {
                let (t, up) = (along(a) - first[a] as f64, corner >> a & 1);
                (n + (first[a] + up) * strides[a], share * if up == 1 { t } else { 1.0 - t })
            })
        })
    }

    /// The middle of the face at right angles to an axis above node `n`.
    pub fn face_middle(&self, n: usize, axis: usize) -> Vec3 {
        let mut p = self.node(n);
        for a in (0..3).filter(|a| *a != axis) {
            p[a] += 0.5 * self.step[a];
        }
        p
    }

    /// The cells below and above that face, by their first nodes; `None` beyond the grid.
    pub fn cells_of_face(&self, n: usize, axis: usize) -> [Option<usize>; 2] {
        let at = self.index(n)[axis];
        [(at > 0).then(|| n - self.strides()[axis]), (at + 1 < self.shape[axis]).then_some(n)]
    }

    /// The weight of the trapezoid rule at node `n`: halved for each face of the box that it lies in.
    pub fn trapezoid(&self, n: usize) -> f64 {
        let at = self.index(n);
        (0..3).filter(|&a| at[a] == 0 || at[a] + 1 == self.shape[a]).fold(1.0, |w, _| 0.5 * w)
    }

    /// The number (from 2·3·5-smooth lengths plus one, so that transforms are fast) at or above `n`.
    pub fn fft_friendly(n: usize) -> usize {
        let smooth = |mut m: usize| {
            for p in [2, 3, 5] {
                while m.is_multiple_of(p) {
                    m /= p;
                }
            }
            m == 1
        };
        (n.max(2)..).find(|m| smooth(m - 1)).unwrap_or(n)
    }
}
