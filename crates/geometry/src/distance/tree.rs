//! A tree of boxes over triangles, and the nearest triangle to a point.

use crate::math::{Aabb, Vec3, add, cross, dot, scale, sub, unit};

/// The part of a triangle that is nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Its inside.
    Face,
    /// The edge from corner k to the next.
    Edge(u8),
    /// Corner k.
    Corner(u8),
}

/// The nearest point of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Squared distance, mm².
    pub square: f64,
    /// From the nearest point to the query.
    pub away: Vec3,
    /// Position of the triangle in the tree's order.
    pub triangle: u32,
    /// Where on the triangle.
    pub feature: Feature,
}

/// A triangle with its unit normal.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Corners, mm.
    pub corners: [Vec3; 3],
    /// Unit normal, outward; exact along the coordinate axes.
    pub normal: Vec3,
}

/// The unit normal of a triangle, exact along the axes.
pub fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let n = cross(sub(b, a), sub(c, a));
    if n.iter().filter(|x| **x != 0.0).count() == 1 {
        return n.map(|x| if x == 0.0 { 0.0 } else { x.signum() });
    }
    // The longest component first, so that small triangles do not underflow.
    let largest = n.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    unit(n.map(|x| x / largest))
}

impl Face {
    /// The triangle of these corners, which has area.
    pub fn new(corners: [Vec3; 3]) -> Face {
        Face { corners, normal: normal(corners) }
    }

    /// The nearest point of the triangle to `p`: squared distance, vector from it to `p`, feature.
    ///
    /// Over the inside the distance is that to the plane, which is exact for planes normal to an axis.
    /// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
    #[inline]
    pub fn nearest(&self, p: Vec3) -> (f64, Vec3, Feature) {
        let [a, b, c] = self.corners;
        let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
        let (d1, d2) = (dot(ab, ap), dot(ac, ap));
        let at = |away: Vec3, f: Feature| (dot(away, away), away, f);
        if d1 <= 0.0 && d2 <= 0.0 {
            return at(ap, Feature::Corner(0));
        }
        let bp = sub(p, b);
        let (d3, d4) = (dot(ab, bp), dot(ac, bp));
        if d3 >= 0.0 && d4 <= d3 {
            return at(bp, Feature::Corner(1));
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return at(sub(ap, scale(ab, d1 / (d1 - d3))), Feature::Edge(0));
        }
        let cp = sub(p, c);
        let (d5, d6) = (dot(ab, cp), dot(ac, cp));
        if d6 >= 0.0 && d5 <= d6 {
            return at(cp, Feature::Corner(2));
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return at(sub(ap, scale(ac, d2 / (d2 - d6))), Feature::Edge(2));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
            return at(sub(bp, scale(sub(c, b), t)), Feature::Edge(1));
        }
        let d = dot(ap, self.normal);
        (d * d, scale(self.normal, d), Feature::Face)
    }
}

/// Triangles of a leaf, at most.
const LEAF: usize = 6;
const BINS: usize = 16;
/// Deeper than this the triangles are halved by number, so that the depth stays below 64 + 32.
const DEEP: usize = 64;

/// A node of the tree.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// The box of its triangles.
    pub bounds: Aabb,
    /// First triangle of a leaf, or the second child (the first is the next node).
    pub at: u32,
    /// Triangles of a leaf, zero for a branch.
    pub count: u32,
}

/// The tree. Triangles are reordered so that a leaf's lie together.
#[derive(Debug)]
pub struct Tree {
    nodes: Vec<Node>,
    faces: Vec<Face>,
    /// Distances closer than this may be a tie: the rounding of coordinates.
    tie: f64,
}

impl Tree {
    /// Builds the tree by the surface-area heuristic over bins; gives it and the old index of each triangle.
    ///
    /// Source: I. Wald, On fast construction of SAH-based bounding volume hierarchies (2007).
    pub fn new(faces: &[Face]) -> (Tree, Vec<u32>) {
        let boxes: Vec<Aabb> = faces.iter().map(|f| f.corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p))).collect();
        let mut order: Vec<u32> = (0..faces.len() as u32).collect();
        let mut nodes = Vec::with_capacity(faces.len());
        build(&boxes, &mut order, 0, 0, &mut nodes);
        let all = nodes[0].bounds;
        let largest = all.min.iter().chain(&all.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let faces = order.iter().map(|i| faces[*i as usize]).collect();
        (Tree { nodes, faces, tie: 16.0 * f64::EPSILON * largest }, order)
    }

    /// The rounding that a distance to the mesh carries, mm.
    pub fn rounding(&self) -> f64 {
        self.tie
    }

    /// The nodes, each before its children.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The triangles in the tree's order.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The nearest triangle; of several at the same computed distance the first. `seed` is a triangle that may be
    /// near: it makes the search shorter and never changes the answer.
    pub fn nearest(&self, p: Vec3, seed: u32) -> Hit {
        let (square, away, feature) = self.faces[seed as usize].nearest(p);
        let mut best = Hit { square, away, triangle: seed, feature };
        // Boxes are searched while they may hold a tie, so that rounding cannot make the seed matter.
        let reach = |square: f64| {
            let d = square.sqrt() * (1.0 + 1e-12) + self.tie + 1e-14 * p.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            d * d
        };
        let mut limit = reach(square);
        let mut stack = [(0u32, 0.0f64); 128];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (mut i, near) = stack[top];
            if near > limit {
                continue;
            }
            loop {
                let node = &self.nodes[i as usize];
                if node.count > 0 {
                    for k in node.at..node.at + node.count {
                        let (square, away, feature) = self.faces[k as usize].nearest(p);
                        if square < best.square || (square == best.square && k < best.triangle) {
                            if square < best.square {
                                limit = reach(square);
                            }
                            best = Hit { square, away, triangle: k, feature };
                        }
                    }
                    break;
                }
                let (first, second) = (i + 1, node.at);
                let mut near = (first, square_distance(&self.nodes[first as usize].bounds, p));
                let mut far = (second, square_distance(&self.nodes[second as usize].bounds, p));
                if far.1 < near.1 {
                    (near, far) = (far, near);
                }
                if far.1 <= limit && top < stack.len() {
                    stack[top] = far;
                    top += 1;
                }
                if near.1 > limit {
                    break;
                }
                i = near.0;
            }
        }
        best
    }
}

/// The larger of two numbers that are not NaN: one instruction, unlike `f64::max`.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn square_distance(b: &Aabb, p: Vec3) -> f64 {
    let mut square = 0.0;
    for a in 0..3 {
        let d = larger(larger(b.min[a] - p[a], p[a] - b.max[a]), 0.0);
        square += d * d;
    }
    square
}

fn half_area(b: &Aabb) -> f64 {
    let [x, y, z] = b.size();
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}

/// Appends the subtree of the triangles `order`, which stand from `first` on.
fn build(boxes: &[Aabb], order: &mut [u32], first: usize, depth: usize, nodes: &mut Vec<Node>) {
    let bounds = order.iter().fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize]));
    let here = nodes.len();
    nodes.push(Node { bounds, at: first as u32, count: order.len() as u32 });
    if order.len() <= LEAF {
        return;
    }
    let middle = if depth < DEEP { split(boxes, order) } else { None }.unwrap_or(order.len() / 2);
    let (left, right) = order.split_at_mut(middle);
    build(boxes, left, first, depth + 1, nodes);
    let second = nodes.len() as u32;
    build(boxes, right, first + middle, depth + 1, nodes);
    nodes[here].at = second;
    nodes[here].count = 0;
}

/// Orders the triangles so that the first so many go left; `None` where no plane parts them.
fn split(boxes: &[Aabb], order: &mut [u32]) -> Option<usize> {
    let middle = |i: u32| add(boxes[i as usize].min, boxes[i as usize].max);
    let spread = order.iter().fold(Aabb::EMPTY, |b, i| b.with(middle(*i)));
    let size = spread.size();
    let axis = (1..3).fold(0, |m, a| if size[a] > size[m] { a } else { m });
    let step = BINS as f64 / size[axis];
    if !step.is_finite() {
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
    order.sort_by_key(|i| bin(*i) >= cut);
    Some(order.partition_point(|i| bin(*i) < cut))
}
