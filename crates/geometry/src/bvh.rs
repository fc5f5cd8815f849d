//! A bounding-volume hierarchy: a binary tree of axis-aligned boxes over anything that has a box.

use core::ops::Range;

use crate::math::{Aabb, add};

mod wide;
pub use wide::WideBvh;

/// How the items of a node are divided between its children.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// At the median of the box centres along the longest side: built fastest, for one pass of overlap queries.
    Median,
    /// By the surface-area heuristic over bins: dearer to build, for many nearest-item queries.
    ///
    /// Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies (2007).
    SurfaceArea,
}

impl Split {
    /// Items of a leaf, at most.
    fn leaf(self) -> usize {
        match self {
            Split::Median => 4,
            Split::SurfaceArea => 6,
        }
    }
}

/// Bins of the surface-area heuristic.
const BINS: usize = 16;
/// Deeper than this, items are halved by number, so that the depth stays below 64 + 32.
const DEEP: usize = 64;
/// Deeper than the tree can be.
const STACK: usize = 128;
/// Subtrees of more items are built in parallel.
const PARALLEL: usize = 4096;

/// A node of the tree. The first child of a branch is the next node.
#[derive(Clone, Copy, Debug)]
pub struct BvhNode {
    /// The box of its items.
    pub bounds: Aabb,
    /// First item of a leaf (a position in the tree's order); how many nodes on the second child of a branch stands.
    at: u32,
    /// Items of a leaf, zero for a branch.
    count: u32,
}

impl BvhNode {
    /// The positions of a leaf's items in the tree's order; `None` for a branch.
    #[inline]
    pub fn items(&self) -> Option<Range<usize>> {
        (self.count > 0).then(|| self.at as usize..(self.at + self.count) as usize)
    }

    /// The children of branch `i`.
    #[inline]
    pub fn children(&self, i: usize) -> [usize; 2] {
        [i + 1, i + self.at as usize]
    }
}

/// The tree: nodes, each before its children, and the items in the order of its leaves.
///
/// Any boxes are allowed. One that is empty or has a NaN touches nothing, so that no query asks for its item, which may be given with others
/// of its leaf; the others are found as if it were not there. Infinite boxes are found; they make neighbours dearer to find.
#[derive(Debug)]
pub struct Bvh {
    nodes: Vec<BvhNode>,
    order: Vec<u32>,
}

impl Bvh {
    /// The tree over `items`, which index `boxes`. The same for any number of threads.
    pub fn new(boxes: &[Aabb], mut items: Vec<u32>, split: Split) -> Bvh {
        let mut nodes = Vec::new();
        match split {
            _ if items.is_empty() => {}
            Split::Median => {
                nodes = vec![BvhNode { bounds: Aabb::EMPTY, at: 0, count: 0 }; nodes_of_halves(items.len())];
                build_halves(boxes, &mut items, 0, &mut nodes);
            }
            Split::SurfaceArea => build(boxes, &mut items, [0, 0], &mut nodes),
        }
        Bvh { nodes, order: items }
    }

    /// The nodes, each before its children; none without items.
    pub fn nodes(&self) -> &[BvhNode] {
        &self.nodes
    }

    /// The items in the order of the leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Calls `visit` with the items of every leaf whose box touches `b`.
    pub fn overlapping(&self, b: &Aabb, mut visit: impl FnMut(&[u32])) {
        self.overlapping_leaves(b, |leaf| visit(&self.order[leaf]));
    }

    /// Calls `visit` with the place in the order of every leaf whose box touches `b`.
    pub fn overlapping_leaves(&self, b: &Aabb, mut visit: impl FnMut(Range<usize>)) {
        let mut stack = [0usize; STACK];
        let mut top = usize::from(!self.nodes.is_empty());
        while top > 0 {
            top -= 1;
            let mut i = stack[top];
            while self.nodes[i].bounds.touches(b) {
                let node = &self.nodes[i];
                if let Some(items) = node.items() {
                    visit(items);
                    break;
                }
                let [first, second] = node.children(i);
                stack[top] = second;
                top += 1;
                i = first;
            }
        }
    }
}

fn half_area(b: &Aabb) -> f64 {
    let [x, y, z] = b.size();
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}

/// The longest side of a box; the first of equal ones.
fn longest(b: &Aabb) -> usize {
    let size = b.size();
    (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m })
}

/// Number of nodes of a tree of halves over `n` items: on each level there are parts of `size` and of one more.
fn nodes_of_halves(n: usize) -> usize {
    let leaf = Split::Median.leaf();
    let (mut size, mut parts, mut larger) = (n, 1, 0);
    let mut nodes = 1;
    while size > leaf || (size == leaf && larger > 0) {
        if size == leaf {
            return nodes + 2 * larger;
        }
        nodes += 2 * (parts + larger);
        (parts, larger) = if size % 2 == 0 { (2 * parts + larger, larger) } else { (parts, parts + 2 * larger) };
        size /= 2;
    }
    nodes
}

/// Builds a tree of halves in place: `nodes` are as many as it has. `first` is the position of the first item.
fn build_halves(boxes: &[Aabb], order: &mut [u32], first: usize, nodes: &mut [BvhNode]) {
    let bounds = order.iter().fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize]));
    let n = order.len();
    let Some((node, rest)) = nodes.split_first_mut() else { return };
    if n <= Split::Median.leaf() {
        *node = BvhNode { bounds, at: first as u32, count: n as u32 };
        return;
    }
    let middle = halve(boxes, order, longest(&bounds));
    let of_left = nodes_of_halves(middle);
    *node = BvhNode { bounds, at: 1 + of_left as u32, count: 0 };
    let (left, right) = order.split_at_mut(middle);
    let (left_nodes, right_nodes) = rest.split_at_mut(of_left);
    let mut make_left = || build_halves(boxes, left, first, left_nodes);
    let mut make_right = || build_halves(boxes, right, first + middle, right_nodes);
    if n > PARALLEL {
        rayon::join(make_left, make_right);
    } else {
        make_left();
        make_right();
    }
}

/// Builds a tree by the surface-area heuristic: appends its nodes. `first` is the position of the first item.
fn build(boxes: &[Aabb], order: &mut [u32], [first, depth]: [usize; 2], nodes: &mut Vec<BvhNode>) {
    let bounds = order.iter().fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize]));
    let here = nodes.len();
    nodes.push(BvhNode { bounds, at: first as u32, count: order.len() as u32 });
    if order.len() <= Split::SurfaceArea.leaf() {
        return;
    }
    let divided = if depth < DEEP { divide(boxes, order) } else { None };
    let middle = divided.unwrap_or(order.len() / 2);
    let parallel = order.len() > PARALLEL;
    let (left, right) = order.split_at_mut(middle);
    let [of_left, of_right] = [[first, depth + 1], [first + middle, depth + 1]];
    if parallel {
        let mut rest = Vec::new();
        let make_left = || build(boxes, left, of_left, nodes);
        rayon::join(make_left, || build(boxes, right, of_right, &mut rest));
        nodes[here].at = (nodes.len() - here) as u32;
        nodes.append(&mut rest);
    } else {
        build(boxes, left, of_left, nodes);
        nodes[here].at = (nodes.len() - here) as u32;
        build(boxes, right, of_right, nodes);
    }
    nodes[here].count = 0;
}

/// Orders the items so that the half with the lower box centres along an axis comes first; gives its number.
fn halve(boxes: &[Aabb], order: &mut [u32], axis: usize) -> usize {
    let key = |i: &u32| boxes[*i as usize].min[axis] + boxes[*i as usize].max[axis];
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    half
}

/// Orders the items so that those of the first child come first, and gives their number; `None` where no plane parts them.
fn divide(boxes: &[Aabb], order: &mut [u32]) -> Option<usize> {
    let middle = |i: u32| add(boxes[i as usize].min, boxes[i as usize].max);
    let spread = order.iter().fold(Aabb::EMPTY, |b, i| b.with(middle(*i)));
    let axis = longest(&spread);
    let step = BINS as f64 / spread.size()[axis];
    // One place, none, or so far apart that all would fall into one bin.
    if !(step.is_finite() && step > 0.0) {
        return None;
    }
    let bin = |i: u32| (((middle(i)[axis] - spread.min[axis]) * step) as usize).min(BINS - 1);
    let mut bins = [(Aabb::EMPTY, 0usize); BINS];
    for i in order.iter() {
        let b = &mut bins[bin(*i)];
        *b = (b.0.union(boxes[*i as usize]), b.1 + 1);
    }
    let sweep = |from: &mut dyn Iterator<Item = usize>| {
        let (mut b, mut n) = (Aabb::EMPTY, 0);
        let mut cost = [0.0; BINS];
        for i in from {
            b = b.union(bins[i].0);
            n += bins[i].1;
            cost[i] = half_area(&b) * n as f64;
        }
        cost
    };
    let (left, right) = (sweep(&mut (0..BINS)), sweep(&mut (0..BINS).rev()));
    // The first and last bins hold the extremes, so neither side is empty.
    let cost = |cut: usize| left[cut - 1] + right[cut];
    let cut = (2..BINS).fold(1, |best, i| if cost(i) < cost(best) { i } else { best });
    let (mut first, mut second) = (0, Vec::with_capacity(order.len()));
    for n in 0..order.len() {
        let item = order[n];
        if bin(item) < cut {
            order[first] = item;
            first += 1;
        } else {
            second.push(item);
        }
    }
    order[first..].copy_from_slice(&second);
    Some(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    #[test]
    fn the_nodes_of_halves_are_counted() {
        fn counted(n: usize) -> usize {
            if n <= Split::Median.leaf() { 1 } else { 1 + counted(n / 2) + counted(n - n / 2) }
        }
        for n in 1..3000 {
            assert_eq!(nodes_of_halves(n), counted(n), "{n}");
        }
    }

    fn boxes(n: usize) -> Vec<Aabb> {
        let mut seed = 5;
        let mut point = |reach: f64| [0; 3].map(|_| reach * random(&mut seed));
        let mut one = || {
            let p = point(1.0);
            Aabb::EMPTY.with(p).with(add(p, point(0.05)))
        };
        (0..n).map(|_| one()).collect()
    }

    #[test]
    fn queries_agree_with_all_boxes() {
        for (n, split) in
            [(0, Split::Median), (1, Split::SurfaceArea), (9000, Split::Median), (9000, Split::SurfaceArea)]
        {
            let boxes = boxes(n);
            // Every third item is left out.
            let items: Vec<u32> = (0..n as u32).filter(|i| i % 3 != 1).collect();
            let tree = Bvh::new(&boxes, items.clone(), split);
            let mut sorted = tree.order().to_vec();
            sorted.sort_unstable();
            assert_eq!(sorted, items);
            let in_order: Vec<Aabb> = tree.order().iter().map(|i| boxes[*i as usize]).collect();
            let wide = WideBvh::new(&tree, &in_order);
            let mut seed = 8;
            for _ in 0..200 {
                let p = [0; 3].map(|_| random(&mut seed));
                let query = Aabb::EMPTY.with(p).grown(0.1);
                let mut found: Vec<u32> = Vec::new();
                let touches = |i: &&u32| boxes[**i as usize].touches(&query);
                tree.overlapping(&query, |items| found.extend(items.iter().filter(touches)));
                found.sort_unstable();
                assert!(found.iter().eq(items.iter().filter(touches)));
                let mut best = f64::INFINITY;
                wide.nearest(p, best, |i| {
                    best = best.min(in_order[i].distance(p).powi(2));
                    best
                });
                let want = items.iter().map(|i| boxes[*i as usize].distance(p)).fold(f64::INFINITY, f64::min);
                assert!((best.sqrt() - want).abs() < 1e-15 || best == want);
            }
        }
    }

    /// Boxes that are empty, infinite or have NaN at some or all ends are found if they touch, and hide no others.
    #[test]
    fn boxes_of_any_numbers_hide_no_others() {
        let special = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300];
        for (share, n) in [(7, 3000), (2, 3000), (1, 600)] {
            let mut boxes = boxes(n);
            for (k, b) in boxes.iter_mut().step_by(share).enumerate() {
                let value = special[k % 4];
                match k % 5 {
                    0 => (b.min[k % 3], b.max[k % 3]) = (value, value),
                    1 => (b.min, b.max) = ([value; 3], [value; 3]),
                    2 => b.max[k % 3] = value,
                    3 => *b = Aabb::EMPTY,
                    _ => *b = Aabb::ALL,
                }
            }
            for split in [Split::Median, Split::SurfaceArea] {
                let tree = Bvh::new(&boxes, (0..n as u32).collect(), split);
                let mut sorted = tree.order().to_vec();
                sorted.sort_unstable();
                assert!(sorted.into_iter().eq(0..n as u32));
                let in_order: Vec<Aabb> = tree.order().iter().map(|i| boxes[*i as usize]).collect();
                let wide = WideBvh::new(&tree, &in_order);
                let mut seed = 8;
                for _ in 0..50 {
                    let p = [0; 3].map(|_| random(&mut seed));
                    let query = Aabb::EMPTY.with(p).grown(0.1);
                    let touches = |i: &u32| boxes[*i as usize].touches(&query);
                    let mut found: Vec<u32> = Vec::new();
                    tree.overlapping(&query, |items| found.extend(items.iter().copied().filter(touches)));
                    found.sort_unstable();
                    assert!(found.into_iter().eq((0..n as u32).filter(touches)), "{split:?}");
                    let square = |b: &Aabb| {
                        let known = !b.is_empty() && b.min.iter().chain(&b.max).all(|v| !v.is_nan());
                        if known { b.distance(p).powi(2) } else { f64::INFINITY }
                    };
                    let mut best = f64::INFINITY;
                    wide.nearest(p, best, |i| {
                        best = best.min(square(&in_order[i]));
                        best
                    });
                    let want = boxes.iter().map(square).fold(f64::INFINITY, f64::min);
                    assert!((best.sqrt() - want.sqrt()).abs() < 1e-15 || best == want, "{split:?} {best} {want}");
                }
            }
        }
    }

    #[test]
    fn equal_boxes_are_halved() {
        let boxes = vec![Aabb { min: [0.0; 3], max: [1.0; 3] }; 5000];
        for split in [Split::Median, Split::SurfaceArea] {
            let tree = Bvh::new(&boxes, (0..5000).collect(), split);
            let mut count = 0;
            tree.overlapping(&boxes[0], |items| count += items.len());
            assert_eq!(count, 5000);
        }
    }
}
