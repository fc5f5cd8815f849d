//! Numbers of the vertices on the grid edges of a block.

use super::block_nodes::BlockNodes;
use super::vertex_id::VertexId;

/// Numbers of the vertices of one surface: those on x-edges, then y, then z, each in node order.
#[derive(Default)]
pub(super) struct VertexNumbers {
    pub crossed: [Vec<u64>; 3],
    pub offset: [Vec<u32>; 3],
}

impl VertexNumbers {
    /// The number of the vertex on the edge along `axis` from node i of a row, if it has one.
    #[inline]
    pub fn get(&self, axis: usize, row: usize, i: usize) -> Option<u32> {
        (self.crossed[axis][row] >> i & 1 == 1).then(|| self.of(axis, row, i))
    }

    /// The edges along `axis` of a row that have a vertex, and the number of the first one's.
    pub fn row(&self, axis: usize, row: usize) -> (u64, u32) {
        (self.crossed[axis][row], self.offset[axis][row])
    }

    #[inline(always)]
    fn of(&self, axis: usize, row: usize, i: usize) -> u32 {
        self.offset[axis][row] + (self.crossed[axis][row] & ((1u64 << i) - 1)).count_ones()
    }
}

/// The number of a vertex of a plain cell by its id.
pub(super) fn numbered(numbers: &[VertexNumbers], nodes: &BlockNodes, key: VertexId) -> Option<u32> {
    let steps = key.steps();
    if !(steps.is_power_of_two() && steps < 8) {
        return None;
    }
    let [i, j, k] = nodes.at(key.node());
    let row = k * nodes.shape[1] + j;
    numbers[key.surfaces().next()?].get(steps.trailing_zeros() as usize, row, i)
}
