//! Grid edges that a surface crosses twice.

use super::{EdgeStore, SurfaceContext};
use geometry::math::Vec3;
use geometry::roots::Bracket;

/// Two crossings nearer to each other than this many times the least distance of points from nodes are left out. Beyond the
/// feature edge a face is then cut off straight, by more than what is left out.
const CLOSE: f64 = 2.0;
/// Most intervals that are searched for a point on the other side of the surface.
const ROUNDS: usize = 40;

impl EdgeStore {
    /// Finds the double crossings on grid edges of these cells, given by their lowest nodes.
    pub(super) fn find_double_crossings<P: Fn(usize, usize) -> Option<Vec3>>(
        &mut self,
        context: &SurfaceContext<P>,
        cells: Vec<usize>,
    ) {
        let stride = context.nodes.stride;
        let mut edges: Vec<(usize, usize)> = Vec::with_capacity(12 * cells.len());
        for cell in cells {
            for axis in 0..3 {
                let [u, v] = [stride[(axis + 1) % 3], stride[(axis + 2) % 3]];
                edges.extend([0, u, v, u + v].map(|by| (cell + by, axis)));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        for (node, axis) in edges {
            if let Some(points) = context.double_crossings(self, node, axis) {
                self.double_crossings.insert((context.surface, node, axis), points);
            }
        }
        for ((surface, node, axis), points) in &self.double_crossings {
            for (i, p) in points.iter().enumerate() {
                self.points.insert(super::VertexId::crossing(*node, *axis, *surface, i), *p);
            }
        }
    }
}

impl<P: Fn(usize, usize) -> Option<Vec3>> SurfaceContext<'_, P> {
    /// Both points where the surface crosses a grid edge whose ends are on the same side of it.
    fn double_crossings(&self, edges: &EdgeStore, node: usize, axis: usize) -> Option<[Vec3; 2]> {
        let (nodes, at) = (self.nodes, self.nodes.at(node));
        let around = (0..3).filter(|a| *a != axis);
        if at[axis] + 2 > nodes.shape[axis] || around.clone().any(|a| at[a] == 0 || at[a] + 2 > nodes.shape[a]) {
            return None;
        }
        let [a, b] = self.open(node, axis)?;
        let on_plane = around.clone().any(|a| self.grid.is_grid_plane(a, nodes.axes[a][at[a]]));
        let mut adjacent = around;
        let (u, v) = (adjacent.next()?, adjacent.next()?);
        let all_join = || {
            [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().all(|(x, y)| {
                let mut cell = at;
                cell[u] -= x;
                cell[v] -= y;
                edges.takes_extra_points(self, cell)
            })
        };
        if on_plane || !all_join() {
            return None;
        }
        let height = |t: f64| self.height(node, axis, t);
        let margin = self.grid.margin;
        let (t, low) = deepest(&height, (a, 1.0 - b), CLOSE * margin)?;
        let root = |end: [f64; 2]| Bracket::new([t, low], end).map(|b| b.false_position(1e-12, 1e-12, height));
        let p = root([0.0, a.max(1e-12)])?.max(margin);
        let q = root([1.0, b.max(1e-12)])?.min(1.0 - margin);
        (q - p >= CLOSE * margin).then(|| [p, q].map(|t| self.along(node, axis, t)))
    }

    /// Whether the surface crosses none of the grid edges of a cell.
    pub(super) fn untouched(&self, cell: [usize; 3]) -> bool {
        let [i, j, k] = cell;
        let low = self.nodes.index(cell);
        let edge = |axis: usize, by: usize| {
            let Some([a, b]) = self.open(low + by, axis) else {
                return true;
            };
            let height = |t| self.height(low + by, axis, t);
            deepest(&height, (a, 1.0 - b), CLOSE * self.grid.margin).is_none()
        };
        matches!(self.signs.corners(self.surface, i, j, k), 0 | 0xff)
            && (0..3).all(|axis| {
                let [u, v] = [1, 2].map(|n| self.nodes.stride[(axis + n) % 3]);
                [0, u, v, u + v].into_iter().all(|by| edge(axis, by))
            })
    }

    /// The distances from the ends of a grid edge, as shares of its length, within which a distance function cannot vanish by
    /// its Lipschitz bound; none if that covers the whole edge.
    fn open(&self, node: usize, axis: usize) -> Option<[f64; 2]> {
        let ends = [node, node + self.nodes.stride[axis]];
        let [p, q] = ends.map(|n| self.signs.is_negative(self.surface, n));
        let [a, b] = ends.map(|n| f64::from(self.samples[n].abs()) / self.length(node, axis));
        (p == q && a + b < 1.0 - CLOSE * self.grid.margin).then_some([a, b])
    }

    pub(super) fn length(&self, node: usize, axis: usize) -> f64 {
        let (axis, at) = (self.nodes.axes[axis], self.nodes.at(node)[axis]);
        axis[at + 1] - axis[at]
    }

    /// A point of a grid edge.
    fn along(&self, node: usize, axis: usize, t: f64) -> Vec3 {
        let mut p = self.nodes.position(node);
        p[axis] += t * self.length(node, axis);
        p
    }

    /// Distance of a point of a grid edge from the surface, as a share of the edge's length; positive on the side of its lower
    /// end.
    fn height(&self, node: usize, axis: usize, t: f64) -> f64 {
        let d = self.field.value(self.along(node, axis, t)) / self.length(node, axis);
        if self.signs.is_negative(self.surface, node) { -d } else { d }
    }
}

/// A point of an interval where a function with Lipschitz bound 1 is not positive; none if there is none but in intervals
/// shorter than `close`.
fn deepest(height: &impl Fn(f64) -> f64, range: (f64, f64), close: f64) -> Option<(f64, f64)> {
    let mut open = vec![range];
    for _ in 0..ROUNDS {
        // The widest remaining interval first.
        let i = (0..open.len()).max_by(|a, b| {
            let width = |i: &usize| open[*i].1 - open[*i].0;
            width(a).total_cmp(&width(b))
        })?;
        let (a, b) = open.swap_remove(i);
        if b - a < close {
            return None;
        }
        let t = (a + b) / 2.0;
        let h = height(t);
        if h <= 0.0 {
            return Some((t, h));
        }
        open.extend([(a, t - h), (t + h, b)].into_iter().filter(|w| w.0 < w.1));
    }
    None
}
