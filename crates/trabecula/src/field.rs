//! Scalar fields: value, gradient and proven bounds. Negative is solid.

use geometry::math::{Aabb, Interval, Vec3};

/// The nodes of a structured block: every combination of the three coordinate lists (mm), x running fastest.
#[derive(Clone, Copy, Debug)]
pub struct Block<'a> {
    /// Coordinates of the node planes along each axis, ascending.
    pub axes: [&'a [f64]; 3],
}

impl Block<'_> {
    /// Number of nodes along each axis.
    pub fn shape(&self) -> [usize; 3] {
        self.axes.map(<[f64]>::len)
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.shape().iter().product()
    }

    /// Whether the block has no node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The box spanned by the nodes.
    pub fn bounds(&self) -> Aabb {
        let end = |a: &[f64]| a[a.len() - 1];
        Aabb { min: self.axes.map(|a| a[0]), max: self.axes.map(end) }
    }
}

/// A function of space. Evaluating cannot fail: whatever can be wrong is found when the field is built.
pub trait Field: Send + Sync {
    /// Fills `out[i]` with the value at `points[i]` (mm). The slices have equal length.
    fn values(&self, points: &[Vec3], out: &mut [f64]);

    /// Fills values and gradients (per mm). Where the function has a crease, one of the one-sided gradients.
    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]);

    /// An interval that contains every value in the box. Proven, so a block may be skipped by it.
    fn bound(&self, b: &Aabb) -> Interval;

    /// Fills `out` (x fastest) with the values at the block's nodes, rounded to f32.
    ///
    /// The default goes through points; structured fields override it, and there most of the speed is won.
    fn fill(&self, block: &Block, out: &mut [f32]) {
        fill_points(self, block, 0.0, None, out);
    }

    /// As `fill`, for a block at most 64 nodes wide, where only nodes whose bit is set in `wanted` (one word for each
    /// row along x) need a value. Fields that are dear to evaluate override it.
    fn fill_where(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        let _ = wanted;
        self.fill(block, out);
    }

    /// As `fill_where`, where a node may have any value of its sign, at least a grid cell's diagonal in magnitude, if all nodes
    /// of the cells around it have that sign: what a surface needs. Fields with bounds that are cheap override it.
    fn fill_near(&self, block: &Block, wanted: &[u64], out: &mut [f32]) {
        self.fill_where(block, wanted, out);
    }

    /// Whether values at scattered points wait for memory: many points are then better given in an order in which neighbours
    /// follow each other.
    fn is_large(&self) -> bool {
        false
    }

    /// The value at one point (mm).
    fn value(&self, p: Vec3) -> f64 {
        let mut v = [0.0];
        self.values(&[p], &mut v);
        v[0]
    }
}

/// Fills `out` (x fastest) with the values less `level` at a block's nodes, or at those whose bit is set in `wanted`, by way of points.
pub(crate) fn fill_points(
    of: &(impl Field + ?Sized),
    block: &Block,
    level: f64,
    wanted: Option<&[u64]>,
    out: &mut [f32],
) {
    let [xs, ys, zs] = block.axes;
    let (mut points, mut values) = (Vec::with_capacity(xs.len()), vec![0.0; xs.len()]);
    for (row, out) in out.chunks_exact_mut(xs.len().max(1)).enumerate() {
        let (y, z) = (ys[row % ys.len()], zs[row / ys.len()]);
        let here = |i: &usize| wanted.is_none_or(|wanted| wanted[row] >> i & 1 == 1);
        points.clear();
        points.extend((0..xs.len()).filter(here).map(|i| [xs[i], y, z]));
        let values = &mut values[..points.len()];
        of.values(&points, values);
        // What is not wanted is void, whatever was there before.
        out.fill(1.0);
        for (i, v) in (0..xs.len()).filter(here).zip(values) {
            out[i] = (*v - level) as f32;
        }
    }
}
