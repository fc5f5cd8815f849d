//! The nearest triangle: a flat tree of boxes over triangles copied into leaf order.

use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};

/// Most triangles a leaf holds, unless they cannot be told apart.
const LEAF: usize = 4;
/// Bins per axis when the surface area heuristic looks for a split.
const BINS: usize = 16;
/// Depth from which nodes are split at the median, so that no input makes the tree deeper than `STACK`.
const SAH_DEPTH: usize = 32;
/// Room for one waiting node per level: 32 levels by heuristic, 32 halvings of at most 2³² triangles.
const STACK: usize = 64;
/// Boxes are kept when farther than the best triangle by no more than rounding, so that the triangle
/// found does not depend on the order of the search.
const SLACK: f64 = 1.0 + 1e-14;

/// A box in single precision, rounded outwards, and what is in it: 32 bytes, two siblings per cache line.
#[derive(Clone, Copy, Debug)]
struct Node {
    min: [f32; 3],
    max: [f32; 3],
    /// First triangle of a leaf, or the first of two adjacent children.
    first: u32,
    /// Number of triangles of a leaf; zero for an inner node.
    count: u32,
}

impl Node {
    fn new(b: &Aabb) -> Self {
        Node {
            min: b.min.map(|v| (v as f32).next_down()),
            max: b.max.map(|v| (v as f32).next_up()),
            first: 0,
            count: 0,
        }
    }

    /// Squared distance from `p` to the box.
    #[inline(always)]
    fn distance2(&self, p: Vec3) -> f64 {
        let mut s = 0.0;
        for a in 0..3 {
            let d = (f64::from(self.min[a]) - p[a])
                .max(p[a] - f64::from(self.max[a]))
                .max(0.0);
            s += d * d;
        }
        s
    }
}

/// The part of a triangle on which a closest point lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    /// The inside of the triangle.
    Face,
    /// The edge from corner `k` to corner `k + 1`.
    Edge(usize),
    /// The corner `k`.
    Vertex(usize),
}

/// The closest point to `p` on a triangle, and the part it lies on.
///
/// Source: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
#[inline(always)]
pub(super) fn closest_on_triangle(p: Vec3, [a, b, c]: &[Vec3; 3]) -> (Vec3, Feature) {
    let (a, b, c) = (*a, *b, *c);
    let (ab, ac) = (sub(b, a), sub(c, a));
    let ap = sub(p, a);
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Vertex(0));
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Vertex(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (add(a, scale(ab, d1 / (d1 - d3))), Feature::Edge(0));
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Vertex(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (add(a, scale(ac, d2 / (d2 - d6))), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    let (e4, e5) = (d4 - d3, d5 - d6);
    if va <= 0.0 && e4 >= 0.0 && e5 >= 0.0 {
        return (add(b, scale(sub(c, b), e4 / (e4 + e5))), Feature::Edge(1));
    }
    let s = 1.0 / (va + vb + vc);
    (
        add(a, add(scale(ab, vb * s), scale(ac, vc * s))),
        Feature::Face,
    )
}

/// The nearest triangle so far.
struct Best {
    triangle: u32,
    distance2: f64,
    /// Boxes beyond this are not looked into.
    limit: f64,
}

impl Best {
    #[inline(always)]
    fn test(&mut self, p: Vec3, triangle: u32, corners: &[Vec3; 3]) {
        let (q, _) = closest_on_triangle(p, corners);
        let away = sub(p, q);
        let d = dot(away, away);
        if d < self.distance2 || (d == self.distance2 && triangle < self.triangle) {
            *self = Best {
                triangle,
                distance2: d,
                limit: d * SLACK,
            };
        }
    }
}

/// The tree. Triangles are named by their place in leaf order.
#[derive(Clone, Debug)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    /// Corners of the triangles, leaf by leaf.
    pub corners: Vec<[Vec3; 3]>,
}

impl Bvh {
    /// Builds the tree; the second part gives for each place in leaf order the triangle it was.
    pub fn new(corners: &[[Vec3; 3]]) -> (Self, Vec<u32>) {
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|t| t.iter().fold(Aabb::EMPTY, |b, &p| b.with(p)))
            .collect();
        let mut items: Vec<Item> = (0u32..)
            .zip(&boxes)
            .map(|(triangle, b)| Item {
                triangle,
                bounds: *b,
                center: b.center(),
            })
            .collect();
        let all = boxes.iter().fold(Aabb::EMPTY, |b, &o| b.union(o));
        let mut nodes = Vec::with_capacity(corners.len());
        nodes.push(Node::new(&all));
        // Padding, so that siblings share a cache line pair by pair.
        nodes.push(Node::new(&all));
        build(&mut nodes, 0, &mut items, 0, 0);
        let order: Vec<u32> = items.iter().map(|i| i.triangle).collect();
        let corners = order.iter().map(|&t| corners[t as usize]).collect();
        (Bvh { nodes, corners }, order)
    }

    /// The triangle nearest to `p`, the first in leaf order among equals; none when no distance is finite.
    ///
    /// `hint` is a triangle likely to be near: it bounds the search and never changes the answer.
    #[inline]
    pub fn nearest(&self, p: Vec3, hint: Option<u32>) -> Option<u32> {
        self.search(p, hint, -1.0).map(|(t, _)| t)
    }

    /// The nearest triangle and its squared distance, or the first that is found within `enough` (squared).
    pub fn search(&self, p: Vec3, hint: Option<u32>, enough: f64) -> Option<(u32, f64)> {
        let mut best = Best {
            triangle: u32::MAX,
            distance2: f64::INFINITY,
            limit: f64::INFINITY,
        };
        if let Some(t) = hint {
            best.test(p, t, &self.corners[t as usize]);
        }
        let mut stack = [(0u32, 0f64); STACK];
        let mut depth = 0;
        let mut at = 0;
        while best.distance2 > enough {
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                let leaf = node.first as usize..(node.first + node.count) as usize;
                for (t, corners) in (node.first..).zip(&self.corners[leaf]) {
                    best.test(p, t, corners);
                }
            } else {
                let i = node.first as usize;
                let near = self.nodes[i].distance2(p);
                let far = self.nodes[i + 1].distance2(p);
                let (near, far) = if far < near {
                    ((node.first + 1, far), (node.first, near))
                } else {
                    ((node.first, near), (node.first + 1, far))
                };
                if near.1 <= best.limit {
                    if far.1 <= best.limit {
                        stack[depth] = far;
                        depth += 1;
                    }
                    at = near.0;
                    continue;
                }
            }
            // The nearest that waits and is still worth a look.
            match (0..depth).rev().find(|&i| stack[i].1 <= best.limit) {
                Some(i) => (at, depth) = (stack[i].0, i),
                None => break,
            }
        }
        (best.triangle != u32::MAX).then_some((best.triangle, best.distance2))
    }

    /// Twice the area vector of a triangle: its normal, not of unit length.
    #[inline]
    pub fn normal(&self, t: u32) -> Vec3 {
        let [a, b, c] = &self.corners[t as usize];
        cross(sub(*b, *a), sub(*c, *a))
    }
}

/// A triangle while the tree is built.
#[derive(Clone, Copy)]
struct Item {
    bounds: Aabb,
    center: Vec3,
    triangle: u32,
}

/// Splits `items`, the triangles of node `at` from place `first` on, until the leaves are small.
fn build(nodes: &mut Vec<Node>, at: usize, items: &mut [Item], first: usize, depth: usize) {
    if items.len() <= LEAF {
        nodes[at].first = first as u32;
        nodes[at].count = items.len() as u32;
        return;
    }
    let middle = if depth < SAH_DEPTH {
        heuristic_split(items)
    } else {
        None
    };
    let middle = middle.unwrap_or_else(|| median_split(items));
    let children = nodes.len();
    nodes[at].first = children as u32;
    let (left, right) = items.split_at_mut(middle);
    for part in [&*left, &*right] {
        let b = part.iter().fold(Aabb::EMPTY, |b, i| b.union(i.bounds));
        nodes.push(Node::new(&b));
    }
    build(nodes, children, left, first, depth + 1);
    build(nodes, children + 1, right, first + middle, depth + 1);
}

/// Half the area of a box.
fn half_area(b: &Aabb) -> f64 {
    let [x, y, z] = b.size();
    x * y + y * z + z * x
}

/// Parts the items where the binned surface area heuristic costs least; none when their centres coincide.
fn heuristic_split(items: &mut [Item]) -> Option<usize> {
    let centers = items.iter().fold(Aabb::EMPTY, |b, i| b.with(i.center));
    let size = centers.size();
    let mut best: Option<(f64, usize, usize)> = None;
    let bin_of = |i: &Item, a: usize| {
        let s = (i.center[a] - centers.min[a]) * (BINS as f64 / size[a]);
        (s as usize).min(BINS - 1)
    };
    for a in 0..3 {
        if size[a] <= 0.0 {
            continue;
        }
        let mut bins = [(Aabb::EMPTY, 0usize); BINS];
        for i in items.iter() {
            let bin = &mut bins[bin_of(i, a)];
            bin.0 = bin.0.union(i.bounds);
            bin.1 += 1;
        }
        // Cost of everything from bin k on, then of everything before it.
        let mut right = [0.0; BINS];
        let (mut b, mut n) = (Aabb::EMPTY, 0);
        for k in (1..BINS).rev() {
            b = b.union(bins[k].0);
            n += bins[k].1;
            right[k] = if n > 0 {
                half_area(&b) * n as f64
            } else {
                f64::INFINITY
            };
        }
        let (mut b, mut n) = (Aabb::EMPTY, 0);
        for k in 1..BINS {
            b = b.union(bins[k - 1].0);
            n += bins[k - 1].1;
            if n > 0 {
                let cost = half_area(&b) * n as f64 + right[k];
                if cost.is_finite() && best.is_none_or(|(c, ..)| cost < c) {
                    best = Some((cost, a, k));
                }
            }
        }
    }
    let (_, a, k) = best?;
    // A two-ended partition: fixed by the order of the items alone.
    let (mut i, mut j) = (0, items.len());
    while i < j {
        if bin_of(&items[i], a) < k {
            i += 1;
        } else {
            j -= 1;
            items.swap(i, j);
        }
    }
    (0 < i && i < items.len()).then_some(i)
}

/// Parts the items in two halves along the longest axis of their centres.
fn median_split(items: &mut [Item]) -> usize {
    let size = items
        .iter()
        .fold(Aabb::EMPTY, |b, i| b.with(i.center))
        .size();
    let a = (0..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
    let middle = items.len() / 2;
    let by = |i: &Item, j: &Item| {
        i.center[a]
            .total_cmp(&j.center[a])
            .then(i.triangle.cmp(&j.triangle))
    };
    items.select_nth_unstable_by(middle, by);
    middle
}

/// The angle at `o` between the directions to `p` and `q`, radians.
pub(super) fn angle(o: Vec3, p: Vec3, q: Vec3) -> f64 {
    let (u, v) = (sub(p, o), sub(q, o));
    norm(cross(u, v)).atan2(dot(u, v))
}
