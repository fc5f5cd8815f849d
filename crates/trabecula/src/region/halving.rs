//! Values of a block of nodes, of which most are never evaluated.

use crate::field::Block;
use geometry::math::{Aabb, Interval, norm};

/// Fills `out` (x fastest) with values less `level` (mm) at a block's nodes, as
/// [`super::SignedDistance::fill_level`] says: the block is halved until a part lies on one side of the level by its bound,
/// or is eight nodes.
pub(super) fn fill(
    block: &Block,
    level: f64,
    out: &mut [f32],
    bound: impl Fn(&Aabb) -> Interval,
    mut value: impl FnMut([f64; 3]) -> f64,
) {
    if block.is_empty() {
        return;
    }
    let widest = |axis: &[f64]| axis.windows(2).fold(0.0f64, |m, w| m.max(w[1] - w[0]));
    let cell = norm(block.axes.map(widest));
    let [nx, ny, _] = block.shape();
    let mut parts = vec![[[0; 3], block.shape()]];
    while let Some([lo, hi]) = parts.pop() {
        let ends = [0, 1, 2].map(|a| [block.axes[a][lo[a]], block.axes[a][hi[a] - 1]]);
        let b = Aabb { min: ends.map(|e| e[0]), max: ends.map(|e| e[1]) };
        let r = bound(&b);
        let far = (r.lo - level > cell).then_some(r.lo - level);
        let far = far.or_else(|| (r.hi - level < -cell).then_some(r.hi - level));
        let size = b.size();
        let longest = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
        let few = (0..3).map(|a| hi[a] - lo[a]).product::<usize>() <= 8;
        if far.is_none() && !few && hi[longest] - lo[longest] > 1 {
            let middle = (lo[longest] + hi[longest]) / 2;
            let (mut end, mut begin) = (hi, lo);
            end[longest] = middle;
            begin[longest] = middle;
            // The first half is next: nodes in turn are near each other.
            parts.extend([[begin, hi], [lo, end]]);
            continue;
        }
        for k in lo[2]..hi[2] {
            for j in lo[1]..hi[1] {
                for i in lo[0]..hi[0] {
                    let p = [block.axes[0][i], block.axes[1][j], block.axes[2][k]];
                    out[(k * ny + j) * nx + i] = far.unwrap_or_else(|| value(p) - level) as f32;
                }
            }
        }
    }
}
