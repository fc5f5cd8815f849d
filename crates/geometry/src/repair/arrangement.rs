//! Triangles cut where others cross or cover them, and the pieces that bound the solid.
//!
//! The triangles are closed and oriented, so the winding number is an integer everywhere off them; the solid is where it
//! is one or more (or another number: that of the meshes, for what all of them hold). No piece of a triangle, cut along all
//! that meets it, has that boundary crossing it, so its centroid decides it: it is kept where the number is
//! below that one in front of it and not behind. This is the
//! idea of Q. Zhou, E. Grinspun, D. Zorin and A. Jacobson, Mesh arrangements for solid geometry, ACM Trans. Graph. 35
//! (2016) 39; the arithmetic differs. Whether triangles meet is decided exactly, positions are rounded. A piece that
//! rounding puts on the wrong side of a cut is as thin as the rounding, and no decision spreads from piece to piece,
//! so errors stay as small as they are made. For the same reason pieces need not match their neighbours: each triangle
//! is divided by the lines of its cuts (a binary space partition: H. Fuchs, Z. M. Kedem and B. F. Naylor, SIGGRAPH
//! 1980), which has no special cases.

use rayon::prelude::*;

use crate::distance::triangle::Triangle;
use crate::distance::triangle_bvh::TriangleBvh;
use crate::distance::winding::Winding;
use crate::math::{Vec3, add, cross, dot, norm, scale, sub};
use crate::mesh::edges::{Edges, rises};
use crate::mesh::exact::{drop_axis, orient2d, orient3d};
use crate::mesh::{Mesh, near_pairs};
use crate::progress::{Cancellation, checkpoint};
use crate::union_find::{find, singles, unite};

/// How two triangles meet.
enum TriangleIntersection {
    /// Along a segment.
    Across(u32, u32, [Vec3; 2]),
    /// They cover a common part, in one plane to within the tolerance.
    Flat(u32, u32),
}

/// Sets of triangles farther off than this many of their radii are taken as a whole: the nearest integer decides.
const REACH: f64 = 2.0;
/// A winding number this near an integer is certain.
const SURE: f64 = 0.05;
/// Points of a piece that are tried, at most, after its centroid.
const SAMPLES: usize = 6;

/// The result of cutting.
pub struct Cut {
    /// The boundary of the solid.
    pub mesh: Mesh,
    /// Pairs of triangles that crossed or covered each other.
    pub pairs: usize,
    /// Triangles that nothing cut and that do not bound the solid.
    pub inner: usize,
    /// Whether every triangle was kept whole.
    pub untouched: bool,
}

/// Two points closer than this are one, mm: above the rounding of all that is computed here.
pub fn tolerance(mesh: &Mesh) -> f64 {
    let b = mesh.bounds();
    let largest = b.min.iter().chain(&b.max).fold(0.0f64, |m, x| m.max(x.abs()));
    1e-11 * norm(b.size()) + 64.0 * f64::EPSILON * largest
}

/// The boundary of where closed, oriented triangles wind at least `least` times. Pieces without area are left out.
pub fn boundary(mesh: &Mesh, least: usize) -> Cut {
    let eta = tolerance(mesh);
    let n = mesh.triangles.len();
    let faces: Vec<Triangle> = (0..n).map(|i| Triangle::new(mesh.corners(i))).collect();
    let intersections = near_pairs(mesh, eta, |i, j| intersection(mesh, &faces, eta, i, j));
    let mut segments: Vec<Vec<[Vec3; 2]>> = vec![Vec::new(); n];
    let mut covers: Vec<Vec<u32>> = vec![Vec::new(); n];
    let pairs = intersections.len();
    for m in intersections {
        match m {
            TriangleIntersection::Across(i, j, s) => {
                segments[i as usize].push(s);
                segments[j as usize].push(s);
            }
            TriangleIntersection::Flat(i, j) => {
                for (i, j) in [(i, j), (j, i)] {
                    covers[i as usize].push(j);
                    let c = faces[j as usize].corners;
                    segments[i as usize].extend([[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]]);
                }
            }
        }
    }
    let tree = TriangleBvh::new(&faces);
    let winding = Winding::new(&tree);
    let mut place = vec![0u32; n];
    for (k, i) in tree.order().iter().enumerate() {
        place[*i as usize] = k as u32;
    }
    let classifier =
        Classifier { faces: &faces, tree: &tree, winding: &winding, place: &place, level: least as f64 - 0.5 };
    let whole = |i: usize| segments[i].is_empty() && covers[i].is_empty();
    let kept_whole = classifier.patches(mesh, &whole);
    let request = Cancellation::current();
    let pieces: Vec<Vec<[Vec3; 3]>> = (0..n)
        .into_par_iter()
        .map(|i| {
            if whole(i) {
                return Vec::new();
            }
            request.enter(|| {
                checkpoint();
                classifier.pieces(i, &segments[i], &covers[i], eta)
            })
        })
        .collect();
    let mut out = Mesh { vertices: mesh.vertices.clone(), triangles: Vec::new() };
    let (mut inner, mut untouched) = (0, true);
    for i in 0..n {
        if whole(i) {
            if kept_whole[i] {
                out.triangles.push(mesh.triangles[i]);
            } else {
                inner += 1;
                untouched = false;
            }
            continue;
        }
        untouched = false;
        for piece in &pieces[i] {
            let t = piece.map(|p| {
                // Its own corners keep their index, so that whole neighbours stay joined.
                let own = (0..3).find(|k| faces[i].corners[*k] == p);
                own.map_or_else(
                    || {
                        out.vertices.push(p);
                        out.vertices.len() as u32 - 1
                    },
                    |k| mesh.triangles[i][k],
                )
            });
            out.triangles.push(t);
        }
    }
    Cut { mesh: out, pairs, inner, untouched }
}

/// The largest component of a normal.
fn steepest(n: Vec3) -> usize {
    (1..3).fold(0, |m, k| if n[k].abs() > n[m].abs() { k } else { m })
}

fn intersection(mesh: &Mesh, faces: &[Triangle], eta: f64, i: usize, j: usize) -> Option<TriangleIntersection> {
    let (s, t) = (&faces[i], &faces[j]);
    let (p, q) = (s.corners, t.corners);
    let off =
        |f: &Triangle, c: [Vec3; 3]| c.iter().fold(0.0f64, |m, v| m.max(dot(f.normal, sub(*v, f.corners[0])).abs()));
    let numbers = (i as u32, j as u32);
    if off(s, q) <= eta || off(t, p) <= eta {
        let axis = steepest(s.normal);
        let (p, q) = (p.map(|v| drop_axis(v, axis)), q.map(|v| drop_axis(v, axis)));
        let separate = apart(p, q, eta) || apart(q, p, eta);
        return (!separate).then_some(TriangleIntersection::Flat(numbers.0, numbers.1));
    }
    let common = mesh.triangles[i].iter().filter(|v| mesh.triangles[j].contains(v));
    if common.count() >= 2 {
        return None;
    }
    let of_q = q.map(|v| orient3d(p[0], p[1], p[2], v));
    let of_p = p.map(|v| orient3d(q[0], q[1], q[2], v));
    let one_side = |s: [i8; 3]| s.iter().all(|v| *v > 0) || s.iter().all(|v| *v < 0);
    if one_side(of_q) || one_side(of_p) {
        return None;
    }
    let a = on_plane(mesh.triangles[i], p, of_p, t)?;
    let b = on_plane(mesh.triangles[j], q, of_q, s)?;
    let along = cross(s.normal, t.normal);
    let sorted = |e: [Vec3; 2]| {
        let mut v = e.map(|x| (dot(along, sub(x, p[0])), x));
        if v[1].0 < v[0].0 {
            v.swap(0, 1);
        }
        v
    };
    let (a, b) = (sorted(a), sorted(b));
    let low = if a[0].0 > b[0].0 { a[0] } else { b[0] };
    let high = if a[1].0 < b[1].0 { a[1] } else { b[1] };
    (low.0 < high.0).then_some(TriangleIntersection::Across(numbers.0, numbers.1, [low.1, high.1]))
}

/// Whether an edge of triangle `a` separates `b` from it, to within `eta`.
fn apart(a: [[f64; 2]; 3], b: [[f64; 2]; 3], eta: f64) -> bool {
    let sign = f64::from(orient2d(a[0], a[1], a[2]));
    (0..3).any(|k| {
        let line = Line::through(a[k], a[(k + 1) % 3]);
        b.iter().all(|p| sign * line.side(*p) <= eta)
    })
}

/// The segment in which a triangle (corners `p`, vertices `v`, on the sides `signs`) meets the plane of `face`; the same
/// bits from every triangle with that edge.
fn on_plane(v: [u32; 3], p: [Vec3; 3], signs: [i8; 3], face: &Triangle) -> Option<[Vec3; 2]> {
    let mut found: [Option<Vec3>; 2] = [None, None];
    let mut put = |x: Vec3| {
        let free = usize::from(found[0].is_some());
        found[free] = Some(x);
    };
    for k in 0..3 {
        let l = (k + 1) % 3;
        if signs[k] == 0 {
            put(p[k]);
        } else if signs[k] * signs[l] < 0 {
            let (a, b) = if v[k] < v[l] { (p[k], p[l]) } else { (p[l], p[k]) };
            let height = |x: Vec3| dot(face.normal, sub(x, face.corners[0]));
            let (ha, hb) = (height(a), height(b));
            let share = ha / (ha - hb);
            let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 };
            let mut x = add(a, scale(sub(b, a), share));
            // Flat faces stay flat to the last bit.
            let c = face.corners;
            for axis in 0..3 {
                if c[0][axis] == c[1][axis] && c[0][axis] == c[2][axis] {
                    x[axis] = c[0][axis];
                }
            }
            put(x);
        }
    }
    match found {
        [Some(a), Some(b)] => Some([a, b]),
        _ => None,
    }
}

/// A directed line in a plane.
#[derive(Clone, Copy)]
struct Line {
    at: [f64; 2],
    /// Unit vector across, to the left.
    left: [f64; 2],
}

impl Line {
    fn through(a: [f64; 2], b: [f64; 2]) -> Line {
        let d = [b[0] - a[0], b[1] - a[1]];
        let length = d[0].hypot(d[1]);
        Line { at: a, left: [-d[1] / length, d[0] / length] }
    }

    /// Distance of a point, positive on the left.
    fn side(&self, p: [f64; 2]) -> f64 {
        self.left[0] * (p[0] - self.at[0]) + self.left[1] * (p[1] - self.at[1])
    }
}

/// A part of a triangle: a convex polygon, or two parts and the line between them.
enum BspNode {
    Leaf(Vec<Vec3>),
    Divided(Line, u32, u32),
}

/// A triangle divided by lines (a binary space partition).
struct Partition {
    nodes: Vec<BspNode>,
    /// The triangle.
    outline: [[f64; 2]; 3],
    /// The coordinate left out.
    axis: usize,
    eta: f64,
}

impl Partition {
    fn flat(&self, p: Vec3) -> [f64; 2] {
        drop_axis(p, self.axis)
    }

    /// Divides every polygon that the segment crosses by the segment's line.
    fn add(&mut self, segment: [Vec3; 2]) {
        let ends = segment.map(|p| self.flat(p));
        let Some([a, b]) = self.clip(ends) else {
            return;
        };
        let line = Line::through(ends[0], ends[1]);
        let mut work = vec![(0u32, a, b)];
        while let Some((i, a, b)) = work.pop() {
            if (b[0] - a[0]).hypot(b[1] - a[1]) <= self.eta {
                continue;
            }
            match &self.nodes[i as usize] {
                BspNode::Divided(by, left, right) => {
                    let (left, right) = (*left, *right);
                    let (sa, sb) = (by.side(a), by.side(b));
                    if sa.abs() <= self.eta && sb.abs() <= self.eta {
                        continue; // already a line of the partition
                    }
                    if sa >= -self.eta && sb >= -self.eta {
                        work.push((left, a, b));
                    } else if sa <= self.eta && sb <= self.eta {
                        work.push((right, a, b));
                    } else {
                        let t = sa / (sa - sb);
                        let m = [0, 1].map(|k| a[k] + (b[k] - a[k]) * t);
                        let (at_a, at_b) = if sa > 0.0 { (left, right) } else { (right, left) };
                        work.push((at_a, a, m));
                        work.push((at_b, m, b));
                    }
                }
                BspNode::Leaf(polygon) => {
                    if let Some((left, right)) = self.split(polygon, &line, segment) {
                        let first = self.nodes.len() as u32;
                        self.nodes.extend([BspNode::Leaf(left), BspNode::Leaf(right)]);
                        self.nodes[i as usize] = BspNode::Divided(line, first, first + 1);
                    }
                }
            }
        }
    }

    /// The part of a segment within the triangle; `None` where it runs along an edge.
    fn clip(&self, [a, b]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
        let corners = self.outline;
        let sign = f64::from(orient2d(corners[0], corners[1], corners[2]));
        let (mut from, mut to) = (0.0f64, 1.0f64);
        for k in 0..3 {
            let line = Line::through(corners[k], corners[(k + 1) % 3]);
            let (sa, sb) = (sign * line.side(a), sign * line.side(b));
            if sa <= self.eta && sb <= self.eta {
                return None; // outside, or along the edge
            }
            if sa < 0.0 {
                from = from.max(sa / (sa - sb));
            }
            if sb < 0.0 {
                to = to.min(sa / (sa - sb));
            }
        }
        let at = |t: f64| [0, 1].map(|k| a[k] + (b[k] - a[k]) * t);
        (from < to).then(|| [if from == 0.0 { a } else { at(from) }, if to == 1.0 { b } else { at(to) }])
    }

    fn split(&self, polygon: &[Vec3], line: &Line, ends: [Vec3; 2]) -> Option<(Vec<Vec3>, Vec<Vec3>)> {
        let side = |p: Vec3| line.side(self.flat(p));
        let sides: Vec<f64> = polygon.iter().map(|p| side(*p)).collect();
        if !(sides.iter().any(|s| *s > self.eta) && sides.iter().any(|s| *s < -self.eta)) {
            return None;
        }
        let (mut left, mut right) = (Vec::new(), Vec::new());
        for k in 0..polygon.len() {
            let l = (k + 1) % polygon.len();
            let (p, q, s, t) = (polygon[k], polygon[l], sides[k], sides[l]);
            if s >= -self.eta {
                left.push(p);
            }
            if s <= self.eta {
                right.push(p);
            }
            if (s > self.eta && t < -self.eta) || (s < -self.eta && t > self.eta) {
                // From the lower end, so that both sides of an edge get the same bits.
                let forward = p < q;
                let (a, b, sa, sb) = if forward { (p, q, s, t) } else { (q, p, t, s) };
                let x = add(a, scale(sub(b, a), sa / (sa - sb)));
                let near = ends.into_iter().find(|e| norm(sub(*e, x)) <= 4.0 * self.eta);
                let x = near.unwrap_or(x);
                left.push(x);
                right.push(x);
            }
        }
        Some((left, right))
    }
}

/// Decides which pieces of triangles bound the solid, by winding numbers on both sides of points on them.
struct Classifier<'a> {
    faces: &'a [Triangle],
    tree: &'a TriangleBvh,
    winding: &'a Winding,
    /// The position of each triangle in the order of the tree.
    place: &'a [u32],
    /// Half below the least winding number of the solid.
    level: f64,
}

impl Classifier<'_> {
    /// Whether a piece of triangle `i` bounds the solid. Where another triangle touches the point that is tried,
    /// as an edge may that only rests on this one, the number is no integer there and another point is tried.
    fn piece_bounds(&self, i: usize, polygon: &[Vec3], covers: &[u32]) -> bool {
        let sum = polygon.iter().fold([0.0; 3], |s, p| add(s, *p));
        let middle = scale(sum, 1.0 / polygon.len() as f64);
        let (mut best, mut doubt) = self.bounds(i, middle, covers);
        for (k, p) in polygon.iter().enumerate().take(SAMPLES) {
            if doubt < SURE {
                break;
            }
            // Odd shares, so that no lattice of corners has its points there.
            let share = 0.294_117 + 0.173_205 * k as f64 / SAMPLES as f64;
            let sample = add(middle, scale(sub(*p, middle), share));
            let (bounds, off) = self.bounds(i, sample, covers);
            if off < doubt {
                (best, doubt) = (bounds, off);
            }
        }
        best
    }

    /// Whether triangle `i` bounds the solid about `p`, a point on it, and how far the winding numbers there are from integers;
    /// of several triangles that cover it there the one with the lowest number that faces out does.
    fn bounds(&self, i: usize, p: Vec3, covers: &[u32]) -> (bool, f64) {
        let normal = self.faces[i].normal;
        let mut net = 1.0;
        let mut first = true;
        let mut here: Vec<u32> = vec![self.place[i]];
        for &j in covers {
            let f = &self.faces[j as usize];
            let axis = steepest(f.normal);
            let c = f.corners.map(|v| drop_axis(v, axis));
            let q = drop_axis(p, axis);
            let turns = [0, 1, 2].map(|k| orient2d(c[k], c[(k + 1) % 3], q));
            if turns.contains(&1) && turns.contains(&-1) {
                continue;
            }
            here.push(self.place[j as usize]);
            if dot(f.normal, normal) > 0.0 {
                net += 1.0;
                first &= (j as usize) > i;
            } else {
                net -= 1.0;
            }
        }
        let others = self.winding.at(self.tree, p, REACH, |k| here.contains(&k));
        let (front, back) = (others - net / 2.0, others + net / 2.0);
        let kept = first && front < self.level && back > self.level;
        (kept, (front - front.round()).abs())
    }

    /// Which of the triangles that nothing cuts bound the solid: those of a patch do alike.
    fn patches(&self, mesh: &Mesh, whole: &impl Fn(usize) -> bool) -> Vec<bool> {
        let n = mesh.triangles.len();
        let mut root = singles(n);
        for edge in Edges::of(&mesh.triangles).each() {
            if let [a, b] = edge
                && rises(&mesh.triangles, *a) != rises(&mesh.triangles, *b)
            {
                let (a, b) = (a / 3, b / 3);
                if whole(a as usize) && whole(b as usize) {
                    unite(&mut root, a, b);
                }
            }
        }
        let area = |i: usize| {
            let [a, b, c] = self.faces[i].corners;
            norm(cross(sub(b, a), sub(c, a)))
        };
        // The largest triangle of a patch speaks for it.
        let mut largest: Vec<(u32, f64)> = vec![(u32::MAX, -1.0); n];
        for i in (0..n).filter(|i| whole(*i)) {
            let r = find(&mut root, i as u32) as usize;
            if area(i) > largest[r].1 {
                largest[r] = (i as u32, area(i));
            }
        }
        let decided: Vec<bool> = largest
            .par_iter()
            .map(|(i, _)| *i != u32::MAX && { self.piece_bounds(*i as usize, &self.faces[*i as usize].corners, &[]) })
            .collect();
        (0..n).map(|i| decided[find(&mut root, i as u32) as usize]).collect()
    }

    /// The pieces of triangle `i` that bound the solid.
    fn pieces(&self, i: usize, segments: &[[Vec3; 2]], covers: &[u32], eta: f64) -> Vec<[Vec3; 3]> {
        let face = &self.faces[i];
        let axis = steepest(face.normal);
        let mut partition = Partition {
            nodes: vec![BspNode::Leaf(face.corners.to_vec())],
            outline: face.corners.map(|p| drop_axis(p, axis)),
            axis,
            eta,
        };
        // In a scattered order, so that the partition does not grow deep along a curve.
        let mut order: Vec<usize> = (0..segments.len()).collect();
        order.sort_by_key(|k| (*k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        for k in order {
            partition.add(segments[k]);
        }
        let mut out = Vec::new();
        for node in &partition.nodes {
            let BspNode::Leaf(polygon) = node else { continue };
            if !self.piece_bounds(i, polygon, covers) {
                continue;
            }
            for k in 1..polygon.len().saturating_sub(1) {
                let t = [polygon[0], polygon[k], polygon[k + 1]];
                if !super::stitch::flat(t) {
                    out.push(t);
                }
            }
        }
        out
    }
}
