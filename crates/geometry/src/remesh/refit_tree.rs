//! A bounding-volume tree of triangles that are edited: those near a position, and whether two intersect.
//!
//! The tree is made once, over the triangles in the order of a space-filling curve. Triangles that a collapse changes
//! keep their positions in it, and the boxes above them grow.

use super::half_edge_mesh::NONE;
use crate::math::{Vec3, cross, dot, sub};
use crate::mesh::{Mesh, is_embedded};

/// Triangles under a leaf.
const LEAF: usize = 4;
/// Signs of expressions larger than this share of their terms are certain, rounding errors being some 1e-15.
const CERTAIN: f64 = 1e-12;

/// A box in single precision: coordinates of the mesh are such numbers.
#[derive(Clone, Copy)]
pub struct Bounds {
    min: [f32; 3],
    max: [f32; 3],
}

impl Bounds {
    const EMPTY: Bounds = Bounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// The bounds of points.
    pub fn of(positions: &[Vec3]) -> Bounds {
        let mut b = Bounds::EMPTY;
        for p in positions {
            for k in 0..3 {
                b.min[k] = b.min[k].min(p[k] as f32);
                b.max[k] = b.max[k].max(p[k] as f32);
            }
        }
        b
    }

    /// Extends the box to hold `o`.
    #[inline]
    pub fn grow(&mut self, o: &Bounds) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(o.min[k]);
            self.max[k] = self.max[k].max(o.max[k]);
        }
    }

    /// Whether the boxes touch, faces included.
    #[inline]
    pub fn meets(&self, o: &Bounds) -> bool {
        (0..3).all(|k| self.min[k] <= o.max[k] && o.min[k] <= self.max[k])
    }

    #[inline]
    fn holds(&self, o: &Bounds) -> bool {
        (0..3).all(|k| self.min[k] <= o.min[k] && o.max[k] <= self.max[k])
    }
}

/// A complete binary tree of boxes; node i has the children 2i and 2i + 1, and the last level stands on the triangles.
pub struct RefitTree {
    boxes: Vec<Bounds>,
    leaves: usize,
    /// The triangles under the leaves, four to each, and the leaf of each triangle.
    order: Vec<u32>,
    leaf: Vec<u32>,
}

impl RefitTree {
    /// The tree of some of `n` triangles with the bounds `of(t)`.
    pub fn new(n: usize, some: &[u32], of: impl Fn(usize) -> Bounds) -> RefitTree {
        let leaves = some.len().div_ceil(LEAF).next_power_of_two();
        let mut boxes = vec![Bounds::EMPTY; 2 * leaves];
        let mut leaf = vec![0; n];
        for (i, &t) in some.iter().enumerate() {
            boxes[leaves + i / LEAF].grow(&of(t as usize));
            leaf[t as usize] = (leaves + i / LEAF) as u32;
        }
        for i in (1..leaves).rev() {
            let mut b = boxes[2 * i];
            b.grow(&boxes[2 * i + 1]);
            boxes[i] = b;
        }
        RefitTree { boxes, leaves, order: some.to_vec(), leaf }
    }

    /// Extends the boxes above triangle `t` to hold `b`.
    pub fn grow(&mut self, t: usize, b: &Bounds) {
        let mut i = self.leaf[t] as usize;
        while i > 0 && !self.boxes[i].holds(b) {
            self.boxes[i].grow(b);
            i /= 2;
        }
    }

    /// Whether one of the prisms, all of them within `all`, meets a triangle of the mesh (triangles and positions) that
    /// `stays`.
    pub fn meets(
        &self,
        prisms: &[Prism],
        all: &Bounds,
        (triangles, positions): (&[[u32; 3]], &[Vec3]),
        stays: impl Fn(u32) -> bool,
        query: &mut Query,
    ) -> bool {
        let Query { found, stack } = query;
        found.clear();
        self.visit(all, stack, |t| {
            if triangles[t as usize][0] != NONE && stays(t) {
                found.push(t);
            }
        });
        found.iter().any(|t| {
            let names = triangles[*t as usize];
            let positions = names.map(|v| positions[v as usize]);
            let bounds = Bounds::of(&positions);
            all.meets(&bounds) && prisms.iter().any(|p| p.meets(names, positions, &bounds))
        })
    }

    /// Calls `found` for the triangles under all leaves that touch `b`; `stack` is for its own use.
    fn visit(&self, b: &Bounds, stack: &mut Vec<usize>, mut found: impl FnMut(u32)) {
        stack.clear();
        stack.push(1);
        while let Some(i) = stack.pop() {
            if !self.boxes[i].meets(b) {
                continue;
            }
            if i >= self.leaves {
                let first = (i - self.leaves) * LEAF;
                let last = (first + LEAF).min(self.order.len());
                if let Some(under) = self.order.get(first..last) {
                    under.iter().for_each(|t| found(*t));
                }
            } else {
                stack.extend([2 * i, 2 * i + 1]);
            }
        }
    }
}

/// Working memory of [`RefitTree::meets`], kept to save allocations.
#[derive(Default)]
pub struct Query {
    found: Vec<u32>,
    stack: Vec<usize>,
}

/// A triangle with its plane and those through its edges normal to it.
pub struct Prism {
    names: [u32; 3],
    positions: [Vec3; 3],
    normal: Vec3,
    sides: [Vec3; 3],
    /// Its bounds.
    pub bounds: Bounds,
}

impl Prism {
    /// The triangle with these corners.
    pub fn new(names: [u32; 3], positions: [Vec3; 3]) -> Prism {
        let side = |k: usize| sub(positions[(k + 1) % 3], positions[k]);
        let normal = cross(side(0), side(1));
        Prism {
            names,
            positions,
            normal,
            sides: [0, 1, 2].map(|k| cross(side(k), normal)),
            bounds: Bounds::of(&positions),
        }
    }

    /// Whether another triangle meets this one elsewhere than in common corners or a common edge. Exact: where no
    /// plane separates them beyond rounding, exact predicates decide.
    pub fn meets(&self, names: [u32; 3], positions: [Vec3; 3], bounds: &Bounds) -> bool {
        if !self.bounds.meets(bounds) {
            return false;
        }
        let shared = names.map(|n| self.names.iter().position(|m| *m == n));
        !self.is_apart(shared, positions) && self.crosses(names, positions)
    }

    /// Whether one of the planes has this triangle on one side and what the other does not share strictly on the other.
    ///
    /// A common corner lies on the plane and is its base, so that the two triangles are two cones with their tips
    /// there, and an angle between them that is larger than rounding can make.
    fn is_apart(&self, shared: [Option<usize>; 3], positions: [Vec3; 3]) -> bool {
        let base = shared.iter().flatten().next().map_or(0, |k| *k);
        let o = self.positions[base];
        let reach = if shared == [None; 3] {
            let [a, b] = [1, 2].map(|k| sub(self.positions[k], o));
            dot(a, a).max(dot(b, b)).sqrt()
        } else {
            0.0
        };
        let beyond = |o: Vec3, plane: Vec3, sign: f64| {
            let long = CERTAIN * dot(plane, plane).sqrt();
            (0..3).filter(|k| shared[*k].is_none()).all(|k| {
                let d = sub(positions[k], o);
                sign * dot(plane, d) > long * (dot(d, d).sqrt() + reach)
            })
        };
        if shared.iter().all(Option::is_some) {
            return false;
        }
        if beyond(o, self.normal, 1.0) || beyond(o, self.normal, -1.0) {
            return true;
        }
        (0..3).any(|k| {
            let on = |s: &Option<usize>| s.is_none_or(|c| c == k || c == (k + 1) % 3);
            let start = if base == (k + 1) % 3 { base } else { k };
            shared.iter().all(on) && beyond(self.positions[start], self.sides[k], 1.0)
        })
    }

    #[cold]
    fn crosses(&self, names: [u32; 3], positions: [Vec3; 3]) -> bool {
        let mut pair = Mesh { vertices: self.positions.to_vec(), triangles: vec![[0, 1, 2]] };
        let other = core::array::from_fn(|k| match self.names.iter().position(|n| *n == names[k]) {
            Some(c) => c as u32,
            None => {
                pair.vertices.push(positions[k]);
                pair.vertices.len() as u32 - 1
            }
        });
        pair.triangles.push(other);
        !is_embedded(&pair)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_answers_agree_with_the_exact_ones() {
        let mut s = 11u64;
        let mut next = |n: u64| ((crate::random::random(&mut s) + 1.0) / 2.0 * n as f64) as u64;
        let (mut met, mut apart) = (0, 0);
        for _ in 0..40_000 {
            // Corners on a small grid, some of them common by name.
            let pool: Vec<Vec3> = (0..6).map(|_| [0; 3].map(|_| next(5) as f64)).collect();
            let a = [0u32, 1, 2];
            let common = next(3) as u32;
            let mut b = [3u32, 4, 5];
            for k in 0..common {
                b[k as usize] = (k + next(2) as u32) % 3;
            }
            if b[0] == b[1] {
                continue;
            }
            let at = |t: [u32; 3]| t.map(|v| pool[v as usize]);
            let flat = |t: [Vec3; 3]| cross(sub(t[1], t[0]), sub(t[2], t[0])) == [0.0; 3];
            if flat(at(a)) || flat(at(b)) {
                continue;
            }
            let prism = Prism::new(a, at(a));
            let want = prism.crosses(b, at(b));
            assert_eq!(prism.meets(b, at(b), &Bounds::of(&at(b))), want, "{pool:?} {b:?}");
            met += usize::from(want);
            apart += usize::from(!want);
        }
        assert!(met > 5000 && apart > 5000);
    }

    #[test]
    fn the_tree_finds_what_touches() {
        let place = |t: usize| {
            let x = (t * 7919 % 1000) as f64;
            [[x, 0.0, 0.0], [x + 1.0, 1.0, 0.0]]
        };
        let all: Vec<u32> = (0..999).collect();
        let mut tree = RefitTree::new(999, &all, |t| Bounds::of(&place(t)));
        tree.grow(5, &Bounds::of(&[[-50.0; 3]]));
        let mut found = Vec::new();
        let b = Bounds::of(&[[100.0, 0.0, 0.0], [103.0, 0.5, 0.0]]);
        tree.visit(&b, &mut Vec::new(), |t| found.push(t));
        for t in 0..999 {
            if Bounds::of(&place(t)).meets(&b) {
                assert!(found.contains(&(t as u32)));
            }
        }
        found.clear();
        tree.visit(&Bounds::of(&[[-50.0; 3]]), &mut Vec::new(), |t| found.push(t));
        assert!(found.contains(&5));
    }
}
