//! Tracing feature edges through the grid: which edges are kept, and which cells and faces they pass.

use rustc_hash::FxHashMap;

use crate::extract::block_nodes::{BlockNodes, PaddedNodes};
use geometry::feature_edges::Creases;
use geometry::math::{Vec3, add, scale, sub};

/// The feature edges of a block's live surfaces, cell by cell.
#[derive(Default)]
pub(in crate::extract) struct TracedEdges {
    /// Points where feature edges pierce cell faces: surface, face, position.
    pub(super) pierced: Vec<(usize, (usize, usize), Vec3)>,
    /// Segments of feature edges in cells, by the surface and the lowest node of the cell.
    pub(super) segments: FxHashMap<(usize, usize), Vec<[Vec3; 2]>>,
    /// For each row of nodes: those within two cells of a feature edge.
    near: Vec<u64>,
}

impl TracedEdges {
    /// Forgets all edges, for a block of this shape.
    pub(super) fn clear(&mut self, shape: [usize; 3]) {
        self.pierced.clear();
        self.segments.clear();
        self.near.clear();
        self.near.resize(shape[1] * shape[2], 0);
    }

    /// Traces the feature edges of a live surface through the cells of the block.
    pub fn trace(&mut self, nodes: &BlockNodes, padded: &PaddedNodes, of: &Creases, surface: usize, segments: &[u32]) {
        for &i in segments {
            self.walk(nodes, padded, surface, of.segments[i as usize].ends);
        }
    }

    /// Traces one segment through the cells of the block and those around it.
    fn walk(&mut self, nodes: &BlockNodes, padded: &PaddedNodes, surface: usize, [p, q]: [Vec3; 2]) {
        let along = sub(q, p);
        let mut stops = vec![0.0, 1.0];
        for a in 0..3 {
            let axis = padded.axes[a];
            let [from, to] = [p, q].map(|x| axis.partition_point(|n| *n < x[a]));
            for n in from.min(to)..from.max(to) {
                let t = (axis[n] - p[a]) / along[a];
                stops.push(t);
                let mut at = add(p, scale(along, t));
                at[a] = axis[n];
                if let Some(cell) = cell_of(nodes.axes, at) {
                    self.pierced.push((surface, (nodes.index(cell), a), at));
                }
            }
        }
        stops.sort_by(f64::total_cmp);
        for w in stops.windows(2).filter(|w| w[0] < w[1]) {
            let ends = [w[0], w[1]].map(|t| add(p, scale(along, t)));
            let middle = scale(add(ends[0], ends[1]), 0.5);
            if let Some(cell) = cell_of(nodes.axes, middle) {
                let here = (surface, nodes.index(cell));
                self.segments.entry(here).or_default().push(ends);
            }
            if let Some(cell) = cell_of(padded.axes, middle) {
                self.mark(nodes, [0, 1, 2].map(|a| cell[a] as isize - padded.before[a]));
            }
        }
    }

    /// Marks the nodes within two cells of one that a feature edge passes.
    fn mark(&mut self, nodes: &BlockNodes, cell: [isize; 3]) {
        let reach = [0, 1, 2].map(|a| {
            let last = nodes.shape[a] as isize - 1;
            ((cell[a] - 1).max(0) as usize)..=((cell[a] + 2).min(last) as usize)
        });
        let [x, y, z] = reach;
        let mask = x.fold(0, |m, i| m | 1u64 << i);
        for k in z {
            for j in y.clone() {
                self.near[k * nodes.shape[1] + j] |= mask;
            }
        }
    }

    /// Whether a feature edge lies within two cells of a node. Contours that end on grid edges farther away are known to every
    /// tile that has these edges.
    pub fn are_near(&self, nodes: &BlockNodes, [i, j, k]: [usize; 3]) -> bool {
        self.near[k * nodes.shape[1] + j] >> i & 1 == 1
    }

    /// Adds the nodes around feature edges to those where the other surfaces are sampled.
    pub fn wanted(&self, nodes: &BlockNodes, wanted: &mut [u64]) {
        for &(_, node) in self.segments.keys() {
            let [i, j, k] = nodes.at(node);
            let around = |x: usize, a: usize| x.saturating_sub(1)..(x + 3).min(nodes.shape[a]);
            let row = around(i, 0).fold(0, |w, i| w | 1u64 << i);
            for k in around(k, 2) {
                for j in around(j, 1) {
                    wanted[k * nodes.shape[1] + j] |= row;
                }
            }
        }
    }
}

/// The cell between nodes that contains a position.
pub(super) fn cell_of(axes: [&[f64]; 3], p: Vec3) -> Option<[usize; 3]> {
    let mut cell = [0; 3];
    for a in 0..3 {
        let above = axes[a].partition_point(|n| *n <= p[a]);
        if above == 0 || above == axes[a].len() {
            return None;
        }
        cell[a] = above - 1;
    }
    Some(cell)
}
