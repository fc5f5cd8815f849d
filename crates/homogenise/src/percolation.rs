//! In how many directions the solid of a periodic cell goes on without end.

use crate::cell::VoxelCell;

/// A connected component of a periodic structure.
pub struct Component {
    /// Its members, in ascending order.
    pub members: Vec<usize>,
    /// Independent translations, in edges of the cell, by which it is connected with itself.
    pub windings: Vec<[i32; 3]>,
}

/// The connected components of those of `count` members that are `inside`; `near` lists the neighbours of one and the cells they are in.
pub fn components(
    count: usize,
    inside: impl Fn(usize) -> bool,
    near: impl Fn(usize, &mut Vec<(usize, [i32; 3])>),
) -> Vec<Component> {
    let mut offset: Vec<Option<[i32; 3]>> = vec![None; count];
    let (mut all, mut stack, mut around) = (Vec::new(), Vec::new(), Vec::new());
    for start in 0..count {
        if offset[start].is_some() || !inside(start) {
            continue;
        }
        offset[start] = Some([0; 3]);
        stack.push(start);
        let (mut members, mut windings) = (Vec::new(), Vec::new());
        while let Some(at) = stack.pop() {
            members.push(at);
            let here = offset[at].unwrap_or_default();
            around.clear();
            near(at, &mut around);
            for (to, step) in around.iter().filter(|(to, _)| inside(*to)) {
                let cell = [0, 1, 2].map(|a| here[a] + step[a]);
                match offset[*to] {
                    None => {
                        offset[*to] = Some(cell);
                        stack.push(*to);
                    }
                    Some(known) if known != cell => windings.push([0, 1, 2].map(|a| cell[a] - known[a])),
                    Some(_) => {}
                }
            }
            if windings.len() > 64 {
                windings = independent(&windings);
            }
        }
        members.sort_unstable();
        all.push(Component { members, windings: independent(&windings) });
    }
    all
}

impl VoxelCell {
    /// The number of independent directions, 0 to 3, in which some connected component of the voxels (by faces) with a fraction above
    /// `least` is connected with its own translates.
    pub fn endless_directions(&self, least: f64) -> usize {
        let [nx, ny, _] = self.shape;
        let near = |at: usize, out: &mut Vec<(usize, [i32; 3])>| {
            let place = [at % nx, at / nx % ny, at / nx / ny];
            for (axis, up) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
                let (mut next, mut cell, n) = (place, [0; 3], self.shape[axis]);
                next[axis] = if up { (place[axis] + 1) % n } else { (place[axis] + n - 1) % n };
                cell[axis] = i32::from(up && place[axis] + 1 == n) - i32::from(!up && place[axis] == 0);
                out.push(((next[2] * ny + next[1]) * nx + next[0], cell));
            }
        };
        let all = components(self.fractions.len(), |i| self.fractions[i] > least, near);
        all.iter().map(|c| c.windings.len()).max().unwrap_or(0)
    }
}

/// Of a list of vectors, those that are independent of the ones before.
fn independent(of: &[[i32; 3]]) -> Vec<[i32; 3]> {
    let mut kept: Vec<[i32; 3]> = Vec::new();
    for v in of {
        let cross = |a: &[i32; 3], b: &[i32; 3]| {
            [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
        };
        let new = match &kept[..] {
            [] => *v != [0; 3],
            [a] => cross(a, v) != [0; 3],
            [a, b] => (0..3).map(|i| cross(a, b)[i] * v[i]).sum::<i32>() != 0,
            _ => false,
        };
        if new {
            kept.push(*v);
        }
    }
    kept
}
