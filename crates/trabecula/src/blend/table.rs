//! Numbers of some nodes of a grid of shares, equally many for each.

/// For each node that was evaluated: what is added to the lower and the upper end, or its quantile function.
#[derive(Default)]
pub(super) struct Table {
    /// Where a node's numbers begin, or `NONE`.
    first: Vec<u32>,
    width: usize,
    numbers: Vec<f32>,
}

const NONE: u32 = u32::MAX;

impl Table {
    /// A table of `nodes` nodes, with `width` numbers for each one that will be evaluated.
    pub fn new(nodes: usize, width: usize) -> Table {
        Table { first: vec![NONE; nodes], width, numbers: Vec::new() }
    }

    /// Forgets all numbers.
    pub fn clear(&mut self) {
        self.first.fill(NONE);
        self.numbers.clear();
    }

    /// The numbers of a node, if it was evaluated.
    #[inline]
    pub fn get(&self, node: usize) -> Option<&[f32]> {
        let first = self.first[node];
        (first != NONE).then(|| &self.numbers[first as usize..][..self.width])
    }

    /// The numbers of a node; `find` adds them to zeros if it was not evaluated.
    #[inline]
    pub fn get_or(&mut self, node: usize, find: impl FnOnce(&mut [f32])) -> &[f32] {
        if self.first[node] == NONE {
            find(self.add(node));
        }
        &self.numbers[self.first[node] as usize..][..self.width]
    }

    /// Gives a node that has none its numbers, zeros to begin with.
    pub fn add(&mut self, node: usize) -> &mut [f32] {
        let first = self.numbers.len();
        self.first[node] = first as u32;
        self.numbers.resize(first + self.width, 0.0);
        &mut self.numbers[first..]
    }
}
