//! Bounding-box tree over boxes in sequence.

use geometry::math::Aabb;

/// Boxes in sequence, with a binary tree of their unions: consecutive boxes are near in space.
pub(super) struct BoxTree {
    count: usize,
    /// The root is 1, the children of n are 2n and 2n + 1, the leaves come last.
    tree: Vec<Aabb>,
}

impl BoxTree {
    pub(super) fn of(boxes: Vec<Aabb>) -> BoxTree {
        let leaves = boxes.len().next_power_of_two();
        let mut tree = vec![Aabb::EMPTY; 2 * leaves];
        tree[leaves..leaves + boxes.len()].copy_from_slice(&boxes);
        for n in (1..leaves).rev() {
            tree[n] = tree[2 * n].union(tree[2 * n + 1]);
        }
        BoxTree { count: boxes.len(), tree }
    }

    pub(super) fn all(&self) -> Aabb {
        self.tree[1]
    }

    /// Calls `found` with the index of each box that meets p until it returns false; returns whether it never did.
    pub(super) fn find_meeting(&self, p: &Aabb, found: &mut impl FnMut(usize) -> bool) -> bool {
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
