//! Boxes by their order.

use geometry::math::Aabb;

/// Boxes in a row, by a tree over their order: what is next in order is near in space.
pub(super) struct Row {
    count: usize,
    /// The root is 1, below n are 2n and 2n + 1, the boxes are the last.
    tree: Vec<Aabb>,
}

impl Row {
    pub fn of(boxes: Vec<Aabb>) -> Row {
        let leaves = boxes.len().next_power_of_two();
        let mut tree = vec![Aabb::EMPTY; 2 * leaves];
        tree[leaves..leaves + boxes.len()].copy_from_slice(&boxes);
        for n in (1..leaves).rev() {
            tree[n] = tree[2 * n].union(tree[2 * n + 1]);
        }
        Row { count: boxes.len(), tree }
    }

    pub fn all(&self) -> Aabb {
        self.tree[1]
    }

    /// Calls `found` with the number of each box that meets p, until it says that it has enough; whether it never did.
    pub fn near(&self, p: &Aabb, found: &mut impl FnMut(usize) -> bool) -> bool {
        let leaves = self.tree.len() / 2;
        let mut open = [0usize; 64];
        let mut count = 1;
        open[0] = 1;
        while count > 0 {
            count -= 1;
            let n = open[count];
            if p.intersection(self.tree[n]).is_empty() {
                continue;
            }
            if n < leaves {
                open[count] = 2 * n + 1;
                open[count + 1] = 2 * n;
                count += 2;
            } else if n - leaves < self.count && !found(n - leaves) {
                return false;
            }
        }
        true
    }
}
