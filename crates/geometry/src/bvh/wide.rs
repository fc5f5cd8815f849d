//! The same tree for nearest-item queries: four children to a node, down to single items, their boxes side by side in single
//! precision so that one node is one step of vector arithmetic.

use super::Bvh;
use crate::math::{Aabb, Vec3};

/// Children of a node.
const WIDTH: usize = 4;
/// The number of no child.
const NONE: u32 = u32::MAX;
/// Set in the number of a child that is an item.
const ITEM: u32 = 1 << 31;
/// Boxes are this much larger than their items, as a share of the tree's size: more than single precision rounds a query that is
/// within eight sizes of the tree. Of one farther off the rounding is within `SLACK` of the distance.
const GROWN: f64 = 1.0 / (1 << 20) as f64;
/// Relative error of squared distances to boxes, with room to spare.
const SLACK: f64 = 1e-5;

/// A node: the boxes of its children, less the tree's origin, and their numbers.
#[derive(Clone, Copy, Debug)]
struct WideNode {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    child: [u32; WIDTH],
}

const EMPTY: WideNode =
    WideNode { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3], child: [NONE; WIDTH] };

/// A tree for nearest-item queries.
#[derive(Debug)]
pub struct WideBvh {
    origin: Vec3,
    /// By how much boxes are larger, mm.
    grown: f64,
    nodes: Vec<WideNode>,
}

impl WideBvh {
    /// The tree of `of`, whose items have these `boxes`, in its order.
    pub fn new(of: &Bvh, boxes: &[Aabb]) -> WideBvh {
        let all = of.nodes().first().map_or(Aabb { min: [0.0; 3], max: [0.0; 3] }, |n| n.bounds);
        let largest = all.size().iter().fold(0.0f64, |m, x| m.max(*x));
        let mut tree = WideBvh { origin: all.center(), grown: GROWN * largest, nodes: Vec::new() };
        if !of.nodes().is_empty() {
            tree.branch(of, boxes, 0);
        }
        tree
    }

    /// Adds the node of branch or leaf `i` with all below it; gives its number.
    fn branch(&mut self, of: &Bvh, boxes: &[Aabb], i: usize) -> u32 {
        let here = self.nodes.len();
        self.nodes.push(EMPTY);
        let mut open = vec![i];
        while open.len() < WIDTH {
            let area = |i: usize| super::half_area(&of.nodes()[i].bounds);
            let branches = (0..open.len()).filter(|n| of.nodes()[open[*n]].items().is_none());
            let Some(n) = branches.reduce(|a, b| if area(open[b]) > area(open[a]) { b } else { a }) else { break };
            let [first, second] = of.nodes()[open[n]].children(open[n]);
            open[n] = first;
            open.push(second);
        }
        for (slot, n) in open.iter().enumerate() {
            let node = &of.nodes()[*n];
            let child = match node.items() {
                // A leaf on its own is this node's items; one of several is a node.
                Some(items) if open.len() == 1 => return self.leaf(here, boxes, items),
                Some(items) if items.len() == 1 => ITEM | items.start as u32,
                Some(items) => {
                    let leaf = self.nodes.len();
                    self.nodes.push(EMPTY);
                    self.leaf(leaf, boxes, items)
                }
                None => self.branch(of, boxes, *n),
            };
            self.put(here, slot, &node.bounds, child);
        }
        here as u32
    }

    /// Makes node `here` that of items; gives its number.
    fn leaf(&mut self, here: usize, boxes: &[Aabb], items: core::ops::Range<usize>) -> u32 {
        let own = if items.len() > WIDTH { items.start..items.start + WIDTH - 1 } else { items.clone() };
        for (slot, k) in own.clone().enumerate() {
            self.put(here, slot, &boxes[k], ITEM | k as u32);
        }
        if own.end < items.end {
            let rest = own.end..items.end;
            let bounds = boxes[rest.clone()].iter().fold(Aabb::EMPTY, |b, x| b.union(*x));
            let next = self.nodes.len();
            self.nodes.push(EMPTY);
            let child = self.leaf(next, boxes, rest);
            self.put(here, WIDTH - 1, &bounds, child);
        }
        here as u32
    }

    fn put(&mut self, here: usize, slot: usize, bounds: &Aabb, child: u32) {
        let node = &mut self.nodes[here];
        for a in 0..3 {
            node.min[a][slot] = (bounds.min[a] - self.origin[a] - self.grown) as f32;
            node.max[a][slot] = (bounds.max[a] - self.origin[a] + self.grown) as f32;
        }
        node.child[slot] = child;
    }

    /// Calls `visit` with the positions (in the tree's order) of items whose box may be within a squared distance of `p` (mm²),
    /// all that are among them, nearer boxes first. `limit` is that distance at first; `visit` gives what it is from then on.
    #[inline]
    pub fn nearest(&self, p: Vec3, limit: f64, mut visit: impl FnMut(usize) -> f64) {
        let at: [f32; 3] = [0, 1, 2].map(|a| (p[a] - self.origin[a]) as f32);
        let mut limit = rounded(limit);
        if let Some(root) = self.nodes.first() {
            self.below(root, at, &mut limit, &mut visit);
        }
    }

    /// The same below a node. Recursion is no deeper than the tree, which has fewer than a hundred levels.
    fn below(&self, node: &WideNode, at: [f32; 3], limit: &mut f32, visit: &mut impl FnMut(usize) -> f64) {
        let squares = square_distances(node, at);
        // Numbers that are not negative are ordered as their bits are.
        let of = |i: usize| u64::from(squares[i].to_bits()) << 32 | u64::from(node.child[i]);
        for (square, child) in sorted([0, 1, 2, 3].map(of)).map(|key| (f32::from_bits((key >> 32) as u32), key as u32))
        {
            if square > *limit || child == NONE {
                return;
            }
            if child & ITEM != 0 {
                *limit = rounded(visit((child & !ITEM) as usize));
            } else {
                self.below(&self.nodes[child as usize], at, limit, visit);
            }
        }
    }
}

/// A squared distance with room for the error of those to boxes.
fn rounded(limit: f64) -> f32 {
    (limit * (1.0 + SLACK)) as f32
}

/// Four numbers in order, without branches.
#[inline(always)]
fn sorted([a, b, c, d]: [u64; WIDTH]) -> [u64; WIDTH] {
    let (a, b, c, d) = (a.min(b), a.max(b), c.min(d), c.max(d));
    let (least, b, c, most) = (a.min(c), b.min(d), a.max(c), b.max(d));
    [least, b.min(c), b.max(c), most]
}

/// Squared distances of a point from the boxes of a node. A function of its own, so that it becomes vector arithmetic.
#[inline(never)]
fn square_distances(node: &WideNode, p: [f32; 3]) -> [f32; WIDTH] {
    // One instruction, unlike `f32::max`.
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    let along = |a: usize| -> [f32; WIDTH] {
        let (min, max) = (&node.min[a], &node.max[a]);
        core::array::from_fn(|i| {
            let d = larger(larger(min[i] - p[a], p[a] - max[i]), 0.0);
            d * d
        })
    };
    let [x, y, z] = [along(0), along(1), along(2)];
    core::array::from_fn(|i| x[i] + y[i] + z[i])
}
