//! Uniform-grid index of boxes, queried by points, boxes, planes and rays.

use geometry::math::{Aabb, Vec3};

/// Boxes listed by the grid cells that they touch.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxIndex {
    origin: Vec3,
    /// Cells per mm, along each axis.
    per: Vec3,
    cells: [usize; 3],
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl BoxIndex {
    /// Index of boxes, with about four cells for each.
    pub(super) fn new(boxes: impl Iterator<Item = Aabb> + Clone) -> BoxIndex {
        let (mut all, mut count) = (Aabb::EMPTY, 0usize);
        for b in boxes.clone() {
            all = all.union(b);
            count += 1;
        }
        if count == 0 {
            return BoxIndex::default();
        }
        let size = all.size().map(|s| s.max(1e-9));
        let edge = (size[0] * size[1] * size[2] / (4.0 * count as f64)).cbrt();
        let cells = size.map(|s| ((s / edge).ceil() as usize).clamp(1, 1024));
        let per = [0, 1, 2].map(|a| cells[a] as f64 / size[a]);
        let mut out = BoxIndex {
            origin: all.min,
            per,
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            items: Vec::new(),
        };
        for b in boxes.clone() {
            let (lo, hi) = out.range(&b);
            out.each_cell(lo, hi, &mut |c, starts: &mut Vec<u32>| starts[c + 1] += 1);
        }
        for i in 1..out.starts.len() {
            out.starts[i] += out.starts[i - 1];
        }
        let mut items = vec![0; out.starts[out.starts.len() - 1] as usize];
        let mut next = out.starts.clone();
        for (i, b) in boxes.enumerate() {
            let (lo, hi) = out.range(&b);
            for z in lo[2]..=hi[2] {
                for y in lo[1]..=hi[1] {
                    for x in lo[0]..=hi[0] {
                        let slot = &mut next[out.cell([x, y, z])];
                        items[*slot as usize] = i as u32;
                        *slot += 1;
                    }
                }
            }
        }
        out.items = items;
        out
    }

    fn each_cell(&mut self, lo: [usize; 3], hi: [usize; 3], f: &mut impl FnMut(usize, &mut Vec<u32>)) {
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let c = self.cell([x, y, z]);
                    f(c, &mut self.starts);
                }
            }
        }
    }

    #[inline]
    fn cell(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    #[inline]
    fn step(&self, a: usize, v: f64) -> usize {
        // The cast maps values below the grid, and NaN, to the first cell.
        (((v - self.origin[a]) * self.per[a]) as usize).min(self.cells[a] - 1)
    }

    fn range(&self, b: &Aabb) -> ([usize; 3], [usize; 3]) {
        ([0, 1, 2].map(|a| self.step(a, b.min[a])), [0, 1, 2].map(|a| self.step(a, b.max[a])))
    }

    /// The boxes listed in the cell of a point: all boxes that may contain it. Outside the grid no box contains a
    /// point.
    #[inline]
    pub(super) fn near(&self, p: Vec3) -> &[u32] {
        if self.items.is_empty() {
            return &[];
        }
        let c = self.cell([0, 1, 2].map(|a| self.step(a, p[a])));
        &self.items[self.starts[c] as usize..self.starts[c + 1] as usize]
    }

    /// The boxes that may touch a box, sorted, each once; `None` if there are more than `most` (or cells list many
    /// more).
    pub(super) fn touching(&self, b: &Aabb, most: usize) -> Option<Vec<u32>> {
        let mut out = Vec::new();
        if self.items.is_empty() {
            return Some(out);
        }
        let (lo, hi) = self.range(b);
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                let row = self.cell([lo[0], y, z]);
                let end = row + hi[0] - lo[0] + 1;
                out.extend_from_slice(&self.items[self.starts[row] as usize..self.starts[end] as usize]);
                if out.len() > 32 * most {
                    return None;
                }
            }
        }
        out.sort_unstable();
        out.dedup();
        (out.len() <= most).then_some(out)
    }

    /// Calls `f` with the boxes listed in the cells that a box touches, by rows of cells; a box may occur more than
    /// once.
    pub(super) fn about(&self, b: &Aabb, f: &mut impl FnMut(&[u32])) {
        if self.items.is_empty() {
            return;
        }
        let (lo, hi) = self.range(b);
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                let row = self.cell([lo[0], y, z]);
                let end = row + hi[0] - lo[0] + 1;
                f(&self.items[self.starts[row] as usize..self.starts[end] as usize]);
            }
        }
    }

    /// The boxes listed in the cells that the plane n·x = level crosses, sorted, each once.
    pub(super) fn across(&self, normal: Vec3, level: f64) -> Vec<u32> {
        let mut out = Vec::new();
        if self.items.is_empty() {
            return out;
        }
        // Columns along the axis closest to the normal, and the interval of the plane in each.
        let a = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs())).unwrap_or(2);
        let (b, c) = ((a + 1) % 3, (a + 2) % 3);
        let edge = |axis: usize| 1.0 / self.per[axis];
        let reach = 0.5 * (normal[b].abs() * edge(b) + normal[c].abs() * edge(c));
        for i in 0..self.cells[b] {
            for j in 0..self.cells[c] {
                let middle = |axis: usize, k: usize| self.origin[axis] + (k as f64 + 0.5) * edge(axis);
                let rest = level - normal[b] * middle(b, i) - normal[c] * middle(c, j);
                let (at, half) = (rest / normal[a], reach / normal[a].abs() + 1e-9 * edge(a));
                let end = self.origin[a] + self.cells[a] as f64 * edge(a);
                if at + half < self.origin[a] || at - half > end {
                    continue;
                }
                let mut cell = [0; 3];
                (cell[b], cell[c]) = (i, j);
                for k in self.step(a, at - half)..=self.step(a, at + half) {
                    cell[a] = k;
                    let at = self.cell(cell);
                    out.extend_from_slice(&self.items[self.starts[at] as usize..self.starts[at + 1] as usize]);
                }
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// Calls `f` with the boxes listed in each cell along a ray and the parameter at which the ray leaves the cell,
    /// until it returns false.
    pub(super) fn along(&self, origin: Vec3, direction: Vec3, f: &mut impl FnMut(&[u32], f64) -> bool) {
        if self.items.is_empty() || !direction.iter().chain(&origin).all(|v| v.is_finite()) {
            return;
        }
        let size = [0, 1, 2].map(|a| self.cells[a] as f64 / self.per[a]);
        let all = Aabb { min: self.origin, max: [0, 1, 2].map(|a| self.origin[a] + size[a]) };
        let Some((from, _)) = super::rays::clip_line(&all, origin, direction) else {
            return;
        };
        let start = [0, 1, 2].map(|a| origin[a] + direction[a] * from.max(0.0));
        let mut at = [0, 1, 2].map(|a| self.step(a, start[a]));
        loop {
            // The parameter at which the ray leaves the cell, by axis.
            let leave = [0, 1, 2].map(|a| {
                let wall = at[a] + usize::from(direction[a] > 0.0);
                if direction[a] == 0.0 {
                    f64::INFINITY
                } else {
                    (self.origin[a] + wall as f64 / self.per[a] - origin[a]) / direction[a]
                }
            });
            let a = (0..3).min_by(|&a, &b| leave[a].total_cmp(&leave[b])).unwrap_or(0);
            let c = self.cell(at);
            if !f(&self.items[self.starts[c] as usize..self.starts[c + 1] as usize], leave[a]) || leave[a].is_infinite()
            {
                return;
            }
            match direction[a] > 0.0 {
                true if at[a] + 1 < self.cells[a] => at[a] += 1,
                false if at[a] > 0 => at[a] -= 1,
                _ => return,
            }
        }
    }
}
