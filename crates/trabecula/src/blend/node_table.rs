//! A table of equally many numbers for each of some nodes of a grid.

/// For each tabulated node its numbers: the level offsets of both ends, or a quantile function.
#[derive(Default)]
pub(super) struct NodeTable {
    /// Index of a node's first number, or `NONE`.
    first: Vec<u32>,
    width: usize,
    numbers: Vec<f32>,
}

const NONE: u32 = u32::MAX;

impl NodeTable {
    /// An empty table for `nodes` nodes, with `width` numbers each.
    pub fn new(nodes: usize, width: usize) -> NodeTable {
        NodeTable { first: vec![NONE; nodes], width, numbers: Vec::new() }
    }

    /// Removes all numbers.
    pub fn clear(&mut self) {
        self.first.fill(NONE);
        self.numbers.clear();
    }

    /// The numbers of a node, if it is tabulated.
    #[inline]
    pub fn get(&self, node: usize) -> Option<&[f32]> {
        let first = self.first[node];
        (first != NONE).then(|| &self.numbers[first as usize..][..self.width])
    }

    /// The numbers of a node; where it is not tabulated `find` adds them to zeros first.
    #[inline]
    pub fn get_or_insert(&mut self, node: usize, find: impl FnOnce(&mut [f32])) -> &[f32] {
        if self.first[node] == NONE {
            find(self.insert(node));
        }
        &self.numbers[self.first[node] as usize..][..self.width]
    }

    /// Adds a node that is not tabulated yet, with zeros.
    pub fn insert(&mut self, node: usize) -> &mut [f32] {
        let first = self.numbers.len();
        self.first[node] = first as u32;
        self.numbers.resize(first + self.width, 0.0);
        &mut self.numbers[first..]
    }
}
