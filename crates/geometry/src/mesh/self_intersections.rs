//! Self-intersection of a mesh, decided exactly for its f64 coordinates.

use core::sync::atomic::{AtomicUsize, Ordering};
use std::collections::BTreeMap;

use rayon::prelude::*;

use super::exact::{drop_axis, orient2d, orient3d, plane_axis};
use crate::bvh::{Bvh, Split};
use crate::math::{Aabb, Vec3, cross, dot, norm, sub, unit};
use crate::mesh::{Mesh, degenerate};
use crate::progress::{Cancellation, checkpoint};

/// The number of triangles at a vertex above which those of it are compared by their directions from it: their boxes all touch there.
const FAN: usize = 64;
/// More than the rounding of unit vectors.
const ROUNDING: f64 = 1e-14;

/// The number of pairs of triangles that meet elsewhere than in their common vertices or edge, or `limit` if there
/// are at least this many.
///
/// Touching counts: a vertex of one on another, a crossing, an overlap in a plane, two neighbours folded onto each
/// other, a triangle given twice. Triangles without area are left out (`defects` counts them). Vertices are common
/// when they have the same index.
pub fn self_intersections(mesh: &Mesh, limit: usize) -> usize {
    let found = AtomicUsize::new(0);
    let near = Near::new(mesh, 0.0);
    near.pairs(
        |i, j| {
            if meet(mesh, i, j) {
                found.fetch_add(1, Ordering::Relaxed);
            }
            None::<()>
        },
        || found.load(Ordering::Relaxed) >= limit,
    );
    found.into_inner().min(limit)
}

/// What `f` makes of each pair of triangles whose boxes, grown by `margin` (mm), touch; the order of the pairs is the
/// same for any number of threads. Triangles without area are left out, and pairs of a vertex of many triangles that lie in directions from
/// it that are farther apart than the margin is anywhere on them.
pub fn near_pairs<T: Send>(mesh: &Mesh, margin: f64, f: impl Fn(usize, usize) -> Option<T> + Sync) -> Vec<T> {
    Near::new(mesh, margin).pairs(f, || false)
}

/// Boxes of triangles, and the vertices of many.
struct Near<'a> {
    mesh: &'a Mesh,
    margin: f64,
    boxes: Vec<Aabb>,
    /// Triangles with area.
    tree: Bvh,
    /// Vertices of many triangles, and these triangles; by vertex.
    fans: Vec<(u32, Vec<u32>)>,
    /// Whether a vertex is one of those.
    is_fan: Vec<bool>,
}

impl<'a> Near<'a> {
    fn new(mesh: &'a Mesh, margin: f64) -> Near<'a> {
        let all = (0..mesh.triangles.len()).into_par_iter();
        let boxes: Vec<Aabb> = all.clone().map(|i| bounds(mesh.corners(i)).grown(margin)).collect();
        let items: Vec<u32> = all.filter(|&i| !degenerate(mesh, i)).map(|i| i as u32).collect();
        let mut count = vec![0usize; mesh.vertices.len()];
        let at = |i: &u32| mesh.triangles[*i as usize];
        items.iter().flat_map(at).for_each(|v| count[v as usize] += 1);
        let is_fan: Vec<bool> = count.iter().map(|n| *n > FAN).collect();
        let mut fans: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for i in &items {
            at(i).into_iter().filter(|v| is_fan[*v as usize]).for_each(|v| fans.entry(v).or_default().push(*i));
        }
        let tree = Bvh::new(&boxes, items, Split::Median);
        Near { mesh, margin, boxes, tree, fans: fans.into_iter().collect(), is_fan }
    }

    /// What `f` makes of each pair, in an order that is the same for any number of threads, until there is `enough`.
    fn pairs<T: Send>(&self, f: impl Fn(usize, usize) -> Option<T> + Sync, enough: impl Fn() -> bool + Sync) -> Vec<T> {
        let of = |i: u32, j: u32| f(i as usize, j as usize);
        let apart = |i, j| if self.common_fan(i, j).is_none() { of(i, j) } else { None };
        let mut found = touching(&self.tree, &self.boxes, &enough, apart);
        // Triangles at a vertex meet elsewhere only if there is a direction from it that is in both, so that the arcs of their far edges
        // on the unit sphere meet.
        for (vertex, triangles) in &self.fans {
            let arcs: Vec<Aabb> = triangles.par_iter().map(|i| self.arc(*vertex, *i)).collect();
            let tree = Bvh::new(&arcs, (0..triangles.len() as u32).collect(), Split::Median);
            let here = |a: u32, b: u32| {
                let (i, j) = (triangles[a as usize], triangles[b as usize]);
                if self.common_fan(i, j) == Some(*vertex) { of(i, j) } else { None }
            };
            found.extend(touching(&tree, &arcs, &enough, here));
        }
        found
    }

    /// The first of the vertices of many triangles that two triangles share.
    fn common_fan(&self, i: u32, j: u32) -> Option<u32> {
        let (s, t) = (self.mesh.triangles[i as usize], self.mesh.triangles[j as usize]);
        s.into_iter().filter(|v| self.is_fan[*v as usize] && t.contains(v)).min()
    }

    /// The box of the directions from a vertex of a triangle into it: of an arc, which rises above its chord c by 1 − √(1 − c²/4) ≤ c²/4,
    /// grown by the angle at which the margin is seen from the vertex at the far edge.
    fn arc(&self, vertex: u32, triangle: u32) -> Aabb {
        let t = self.mesh.triangles[triangle as usize];
        let k = (0..3).find(|k| t[*k] == vertex).unwrap_or(0);
        let [o, a, b] = [0, 1, 2].map(|l| self.mesh.vertices[t[(k + l) % 3] as usize]);
        let (a, b) = (sub(a, o), sub(b, o));
        let far = norm(cross(a, b)) / norm(sub(b, a));
        let (a, b) = (unit(a), unit(b));
        let chord = sub(b, a);
        let grown = 0.25 * dot(chord, chord) + 2.0 * self.margin / far + ROUNDING;
        if grown.is_finite() {
            Aabb::EMPTY.with(a).with(b).grown(grown)
        } else {
            Aabb { min: [-2.0; 3], max: [2.0; 3] }
        }
    }
}

/// What `f` makes of each pair of items of a tree whose boxes touch, the lower number first, until there is `enough`.
fn touching<T: Send>(
    tree: &Bvh,
    boxes: &[Aabb],
    enough: &(impl Fn() -> bool + Sync),
    f: impl Fn(u32, u32) -> Option<T> + Sync,
) -> Vec<T> {
    let cancellation = Cancellation::current();
    let found = tree.order().par_chunks(256).map(|part| {
        let mut found = Vec::new();
        for &i in part {
            if enough() {
                break;
            }
            cancellation.enter(checkpoint);
            let b = &boxes[i as usize];
            tree.overlapping(b, |near| {
                let near = near.iter().filter(|j| **j > i && b.touches(&boxes[**j as usize]));
                found.extend(near.filter_map(|j| f(i, *j)));
            });
        }
        found
    });
    let found: Vec<Vec<T>> = found.collect();
    found.into_iter().flatten().collect()
}

pub(super) fn bounds(corners: [Vec3; 3]) -> Aabb {
    corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p))
}

/// Whether triangles `i` and `j` meet elsewhere than in their common vertices or edge. Both have area.
pub fn meet(mesh: &Mesh, i: usize, j: usize) -> bool {
    let (s, t) = (mesh.triangles[i], mesh.triangles[j]);
    let at = |v: u32| mesh.vertices[v as usize];
    let (p, q) = (s.map(at), t.map(at));
    let common = |k: &usize| t.contains(&s[*k]);
    let alone = |k: &usize| !s.contains(&t[*k]);
    match (0..3).filter(common).count() {
        0 if apart(p, q) => false,
        0 => (0..3).any(|k| crosses(p[k], p[(k + 1) % 3], q) || crosses(q[k], q[(k + 1) % 3], p)),
        1 => {
            // The common part is convex and holds the common vertex; if it is more, a ray from that vertex leaves one
            // of the triangles through the opposite side while still in the other.
            let k = (0..3).find(common).unwrap_or(0);
            let l = (0..3).find(|l| t[*l] == s[k]).unwrap_or(0);
            crosses(p[(k + 1) % 3], p[(k + 2) % 3], q) || crosses(q[(l + 1) % 3], q[(l + 2) % 3], p)
        }
        2 => {
            // Two planes through the common edge meet in its line alone, unless they are one plane.
            let (Some(k), Some(l)) = ((0..3).find(|k| !common(k)), (0..3).find(alone)) else {
                return true;
            };
            let (v, w) = (p[(k + 1) % 3], p[(k + 2) % 3]);
            if orient3d(v, w, p[k], q[l]) != 0 {
                return false;
            }
            plane_axis(v, w, p[k]).is_none_or(|axis| {
                let [v, w, a, b] = [v, w, p[k], q[l]].map(|c| drop_axis(c, axis));
                orient2d(v, w, a) == orient2d(v, w, b)
            })
        }
        _ => true,
    }
}

/// Whether two triangles are surely apart: on different sides of a plane along a face, or along an edge of each, by more than rounding.
fn apart(p: [Vec3; 3], q: [Vec3; 3]) -> bool {
    let edges = |t: [Vec3; 3]| [sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])];
    let (e, g) = (edges(p), edges(q));
    let own = p.map(|v| sub(v, p[0]));
    let other = q.map(|v| sub(v, p[0]));
    let size = own.iter().chain(&other).flatten().fold(0.0f64, |m, c| m.max(c.abs()));
    // Any direction will do, so that only differences of positions and products with it are rounded: 7 roundings of at most three terms.
    let splits = |n: Vec3| {
        let slack = 16.0 * f64::EPSILON * size * (n[0].abs() + n[1].abs() + n[2].abs());
        let range = |t: &[Vec3; 3]| {
            t.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(dot(n, *v)), hi.max(dot(n, *v))])
        };
        let ([low, high], [from, to]) = (range(&own), range(&other));
        from > high + slack || low > to + slack
    };
    splits(cross(e[0], e[1])) || splits(cross(g[0], g[1])) || e.iter().any(|a| g.iter().any(|b| splits(cross(*a, *b))))
}

/// Whether the segment a b meets the triangle t (with area), ends and edges included.
fn crosses(a: Vec3, b: Vec3, t: [Vec3; 3]) -> bool {
    let (sa, sb) = (orient3d(t[0], t[1], t[2], a), orient3d(t[0], t[1], t[2], b));
    if sa * sb > 0 {
        return false;
    }
    if sa == 0 && sb == 0 {
        return plane_axis(t[0], t[1], t[2])
            .is_some_and(|axis| crosses_flat(drop_axis(a, axis), drop_axis(b, axis), t.map(|c| drop_axis(c, axis))));
    }
    // The line meets the plane in one point, within the triangle unless it passes edges on different sides.
    let sides = [0, 1, 2].map(|k| orient3d(a, b, t[k], t[(k + 1) % 3]));
    !(sides.contains(&1) && sides.contains(&-1))
}

/// The same in a plane.
fn crosses_flat(a: [f64; 2], b: [f64; 2], t: [[f64; 2]; 3]) -> bool {
    let inside = |p| {
        let turns = [0, 1, 2].map(|k| orient2d(t[k], t[(k + 1) % 3], p));
        !(turns.contains(&1) && turns.contains(&-1))
    };
    inside(a) || inside(b) || (0..3).any(|k| segments_meet(a, b, t[k], t[(k + 1) % 3]))
}

/// Whether two segments in a plane meet, ends included.
fn segments_meet(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> bool {
    let (sc, sd) = (orient2d(a, b, c), orient2d(a, b, d));
    let (sa, sb) = (orient2d(c, d, a), orient2d(c, d, b));
    if [sa, sb, sc, sd] == [0; 4] {
        // On one line: they meet where their extents do on both axes.
        return (0..2).all(|k| a[k].min(b[k]) <= c[k].max(d[k]) && c[k].min(d[k]) <= a[k].max(b[k]));
    }
    sa * sb <= 0 && sc * sd <= 0
}

#[cfg(test)]
mod tests {
    use super::super::samples::{cube, flipped, join, tetrahedron, torus};
    use super::*;

    /// The count for two triangles given by corners; equal corners are one vertex.
    fn pair(s: [Vec3; 3], t: [Vec3; 3]) -> usize {
        let mut mesh = Mesh::default();
        for tri in [s, t] {
            let ids = tri.map(|p| {
                let found = mesh.vertices.iter().position(|v| *v == p);
                found.unwrap_or_else(|| {
                    mesh.vertices.push(p);
                    mesh.vertices.len() - 1
                }) as u32
            });
            mesh.triangles.push(ids);
        }
        // Whatever the order of triangles and corners, and in mirrored axes.
        let n = self_intersections(&mesh, 10);
        for turn in 0..3 {
            for axis in 0..3 {
                let mut m = mesh.clone();
                m.triangles[0].rotate_left(turn);
                m.triangles[1].swap(turn, (turn + 1) % 3);
                m.triangles.swap(0, 1);
                m.vertices.iter_mut().for_each(|v| v.rotate_left(axis));
                assert_eq!(self_intersections(&m, 10), n);
            }
        }
        n
    }

    const T: [Vec3; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn pairs_without_common_vertices() {
        for (t, want, what) in [
            ([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [5.0, 5.0, 0.5]], 1, "an edge pierces"),
            ([[1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [2.0, 1.0, 1.0]], 0, "above, parallel"),
            ([[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [5.0, 5.0, 0.5]], 0, "outside, in the plane's neighbourhood"),
            ([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], 1, "a corner on the inside"),
            ([[2.0, 0.0, 0.0], [2.0, -1.0, 1.0], [2.0, -1.0, -1.0]], 1, "a corner on a side"),
            ([[2.0, 0.0, -1.0], [2.0, 0.0, 1.0], [2.0, -1.0, 0.0]], 1, "a side across a side"),
            ([[1.0, 0.5, 0.0], [2.0, 0.5, 0.0], [1.0, 1.5, 0.0]], 1, "in the plane, within"),
            ([[-1.0, -1.0, 0.0], [9.0, -1.0, 0.0], [-1.0, 9.0, 0.0]], 1, "in the plane, around"),
            ([[1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [2.0, 1.0, 0.0]], 1, "in the plane, across"),
            ([[5.0, 5.0, 0.0], [6.0, 5.0, 0.0], [5.0, 6.0, 0.0]], 0, "in the plane, apart"),
            ([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, -1.0, 0.0]], 1, "in the plane, along a side"),
            ([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [2.0, -1.0, 1.0]], 1, "hinged along a part of a side"),
            ([[2.0, 2.0, 0.0], [3.0, 3.0, 0.0], [3.0, 3.0, 1.0]], 1, "a corner on the long side"),
            ([[2.0, 2.0, 1e-300], [3.0, 3.0, 1.0], [3.0, 2.0, 1.0]], 0, "a hair above the long side"),
            ([[0.0, 0.0, 1e-17], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], 0, "a hair above a corner"),
        ] {
            assert_eq!(pair(T, t), want, "{what}");
        }
    }

    #[test]
    fn pairs_with_a_common_vertex() {
        let o = [0.0; 3];
        for (t, want, what) in [
            ([o, [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]], 0, "in the plane, opposite"),
            ([o, [1.0, 2.0, 0.0], [2.0, 1.0, 0.0]], 1, "in the plane, within"),
            ([o, [8.0, 1.0, 0.0], [8.0, 2.0, 0.0]], 1, "in the plane, through the far side"),
            ([o, [8.0, 0.0, 0.0], [8.0, -2.0, 0.0]], 1, "in the plane, along a side"),
            ([o, [0.0, -1.0, 1.0], [0.0, -1.0, -1.0]], 0, "upright, outside"),
            ([o, [1.0, 1.0, 1.0], [1.0, 1.0, -1.0]], 1, "upright, through the inside"),
            ([o, [9.0, 9.0, 1.0], [9.0, 9.0, -1.0]], 1, "upright, through the whole"),
            ([o, [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]], 1, "a side lies in it"),
            ([o, [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]], 1, "a side lies on its side"),
            ([o, [1.0, 1.0, 1.0], [1.0, 2.0, 1.0]], 0, "rising"),
        ] {
            assert_eq!(pair(T, t), want, "{what}");
        }
    }

    #[test]
    fn pairs_with_a_common_edge() {
        let [a, b, _] = T;
        for (c, want, what) in [
            ([1.0, -1.0, 0.0], 0, "flat neighbours"),
            ([1.0, 1.0, 0.0], 1, "folded flat, within"),
            ([9.0, 9.0, 0.0], 1, "folded flat, beyond"),
            ([1.0, 1.0, 1e-300], 0, "folded to a hair"),
            ([1.0, 1.0, 1.0], 0, "a roof"),
        ] {
            assert_eq!(pair(T, [b, a, c]), want, "{what}");
        }
        assert_eq!(pair(T, [T[1], T[0], T[2]]), 1, "the same triangle again");
    }

    #[test]
    fn solids() {
        assert_eq!(self_intersections(&Mesh::default(), 9), 0);
        assert_eq!(self_intersections(&tetrahedron(), 9), 0);
        assert_eq!(self_intersections(&torus(64, 48), 9), 0);
        let nested = join(&[cube([0.0; 3], 4.0), flipped(cube([1.0; 3], 2.0))]);
        assert_eq!(self_intersections(&nested, 9), 0);
        let crossing = join(&[cube([0.0; 3], 2.0), cube([1.0; 3], 2.0)]);
        assert!(self_intersections(&crossing, 1000) > 6);
        assert_eq!(self_intersections(&crossing, 3), 3);
        let touching = join(&[cube([0.0; 3], 1.0), cube([1.0, 0.0, 0.0], 1.0)]);
        assert!(self_intersections(&touching, 1000) > 0);
    }

    /// A cone over a polygon of many sides, in a random place; a fold or a fin at its apex or its base is found as for few sides.
    #[test]
    fn fans_are_judged_as_other_triangles() {
        let n = 4 * FAN as u32;
        let mut state = 3u64;
        let mut next = || crate::random::random(&mut state);
        let (apex, base) = ([next(), next(), 3.0 + next()], [next(), next(), next()]);
        let mut cone = Mesh { vertices: vec![apex, base], triangles: Vec::new() };
        for k in 0..n {
            let (sine, cosine) = (f64::from(k) / f64::from(n) * core::f64::consts::TAU).sin_cos();
            cone.vertices.push([base[0] + 2.0 * cosine, base[1] + 2.0 * sine, base[2]]);
            let (a, b) = (2 + k, 2 + (k + 1) % n);
            cone.triangles.extend([[0, a, b], [1, b, a]]);
        }
        let all_pairs = |mesh: &Mesh| {
            let all = 0..mesh.triangles.len();
            all.clone()
                .flat_map(|i| all.clone().map(move |j| (i, j)))
                .filter(|(i, j)| i < j && meet(mesh, *i, *j))
                .count()
        };
        assert_eq!(self_intersections(&cone, usize::MAX), 0);
        assert_eq!(all_pairs(&cone), 0);
        for (move_vertex, by) in [(2, [0.0, 0.3, 0.0]), (40, [-0.2, 0.1, 0.4]), (1, [0.0, 0.0, 4.0])] {
            let mut bent = cone.clone();
            let v = &mut bent.vertices[move_vertex];
            *v = crate::math::add(*v, by);
            let found = self_intersections(&bent, usize::MAX);
            assert_eq!(found, all_pairs(&bent), "{move_vertex}");
            assert_eq!(near_pairs(&bent, 0.0, |i, j| meet(&bent, i, j).then_some(())).len(), found);
            assert!(found > 0, "{move_vertex}");
        }
    }

    #[test]
    fn random_triangles_agree_with_all_pairs() {
        let mut s = 5u64;
        let mut next = || (4.0 * (crate::random::random(&mut s) + 1.0)).floor();
        // Corners on a grid of 8³: touching, coplanar and repeated cases abound.
        let mut mesh = Mesh::default();
        for v in 0..300u32 {
            mesh.vertices.push([next(), next(), next()]);
            if v % 3 == 2 {
                mesh.triangles.push([v - 2, v - 1, v]);
            }
        }
        let mut all = 0;
        for i in 0..100 {
            for j in i + 1..100 {
                all += usize::from(!degenerate(&mesh, i) && !degenerate(&mesh, j) && meet(&mesh, i, j));
            }
        }
        assert!(all > 50);
        assert_eq!(self_intersections(&mesh, usize::MAX), all);
    }
}
