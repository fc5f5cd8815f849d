//! Smooth patches of a mesh, bounded by its feature edges, and each as a function that is zero on it.
//!
//! A signed distance bends at the feature edges of a solid, and between two sheets of a thin wall. The function of one patch does not:
//! beyond its boundary it goes on as the tangent plane there, so that two of them meet in the feature edge and three in the corner.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::distance::triangle::{Feature, Triangle, normal};
use crate::distance::triangle_bvh::{Nearest, TriangleBvh};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;
use crate::repair::half_edges::{ends, halves};
use crate::tetmesh::FACES;
use crate::union_find;

/// The least turn of the normal across a feature edge, radians (40°): more than that between the sides of a coarsely approximated hole.
const TURN: f64 = 0.698;
/// A patch is at least as wide as this fraction of the size of elements; narrower ones are part of an adjacent one.
const NARROW: f64 = 0.05;
/// Patches of one group are at least as far apart as this multiple of the size.
const APART: f64 = 2.5;

/// Patches of a mesh that are far from each other, as one function.
#[derive(Debug)]
pub struct PatchGroup {
    tree: TriangleBvh,
    /// Outward normals of the edges and corners of each triangle, in the tree's order.
    normals: Vec<[Vec3; 6]>,
    /// Whether these are on the boundary of the patch, by bits.
    at_boundary: Vec<u8>,
}

/// The patches of a closed mesh that elements of a size (mm) resolve, in groups. The groups of a mesh without feature edges are none.
pub fn patch_groups(mesh: &Mesh, size: f64) -> Vec<PatchGroup> {
    let edges = feature_edges(mesh);
    let (patch, count) = patches(mesh, &edges, NARROW * size);
    if count < 2 {
        return Vec::new();
    }
    let group = groups(mesh, &patch, count, size);
    let groups = group.iter().max().map_or(0, |g| g + 1);
    let of = |g: usize| (0..patch.len()).filter(|t| group[patch[*t] as usize] == g).collect::<Vec<_>>();
    (0..groups).map(|g| PatchGroup::new(mesh, &of(g), &patch)).collect()
}

/// Two adjacent triangles, the length of their edge, and whether it is a feature edge.
struct Adjacent {
    triangles: [u32; 2],
    length: f64,
    feature: bool,
}

/// The edges of a mesh that two triangles share.
fn feature_edges(mesh: &Mesh) -> Vec<Adjacent> {
    let halves = halves(mesh);
    let pairs = halves.chunk_by(|a, b| a.0 == b.0).filter(|e| e.len() == 2);
    pairs
        .map(|e| {
            let triangles = [e[0].1 / 3, e[1].1 / 3];
            let [m, n] = triangles.map(|t| normal(mesh.corners(t as usize)));
            let [a, b] = ends(mesh, e[0].1).map(|v| mesh.vertices[v as usize]);
            let turn = norm(cross(m, n)).atan2(dot(m, n));
            Adjacent { triangles, length: norm(sub(a, b)), feature: turn > TURN }
        })
        .collect()
}

/// The patch of each triangle and how many there are: what smooth edges connect; patches narrower than `least` (mm) are joined to the
/// patch with which they share the longest boundary.
fn patches(mesh: &Mesh, edges: &[Adjacent], least: f64) -> (Vec<u32>, usize) {
    let mut root = union_find::singles(mesh.triangles.len());
    for e in edges.iter().filter(|e| !e.feature) {
        union_find::unite(&mut root, e.triangles[0], e.triangles[1]);
    }
    loop {
        let (label, count) = union_find::labels(&mut root);
        let mut area = vec![0.0; count];
        for (t, l) in label.iter().enumerate() {
            let [a, b, c] = mesh.corners(t);
            area[*l as usize] += 0.5 * norm(cross(sub(b, a), sub(c, a)));
        }
        let mut shared: FxHashMap<[u32; 2], (f64, [u32; 2])> = FxHashMap::default();
        let mut length = vec![0.0; count];
        for e in edges {
            let [a, b] = e.triangles.map(|t| label[t as usize]);
            if a != b {
                for (a, b) in [(a, b), (b, a)] {
                    length[a as usize] += e.length;
                    shared.entry([a, b]).or_insert((0.0, e.triangles)).0 += e.length;
                }
            }
        }
        let narrow = |p: usize| length[p] > 0.0 && 2.0 * area[p] < least * length[p];
        let least_area = (0..count).filter(|p| narrow(*p)).min_by(|a, b| area[*a].total_cmp(&area[*b]).then(a.cmp(b)));
        let Some(p) = least_area else { return (label, count) };
        let mut to: Vec<_> = shared.iter().filter(|(k, _)| k[0] as usize == p).collect();
        to.sort_unstable_by(|a, b| b.1.0.total_cmp(&a.1.0).then(a.0.cmp(b.0)));
        let [a, b] = to[0].1.1;
        union_find::unite(&mut root, a, b);
    }
}

/// The group of each patch: those of one group are far from each other.
fn groups(mesh: &Mesh, patch: &[u32], count: usize, size: f64) -> Vec<usize> {
    let (spacing, cell) = (0.5 * size, (APART + 0.5) * size);
    let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    for (t, p) in patch.iter().enumerate() {
        let mut todo = vec![mesh.corners(t)];
        while let Some([a, b, c]) = todo.pop() {
            // Halved at its longest side.
            let sides = [[a, b, c], [b, c, a], [c, a, b]];
            let length = |s: &[Vec3; 3]| norm(sub(s[0], s[1]));
            let [u, v, w] = sides.into_iter().fold(sides[0], |m, s| if length(&s) > length(&m) { s } else { m });
            if length(&[u, v, w]) > spacing {
                let middle = scale(add(u, v), 0.5);
                todo.extend([[u, middle, w], [middle, v, w]]);
                continue;
            }
            for q in [a, b, c] {
                let of = cells.entry(q.map(|x| (x / cell).floor() as i64)).or_default();
                if !of.contains(p) {
                    of.push(*p);
                }
            }
        }
    }
    let mut near: Vec<Vec<u32>> = vec![Vec::new(); count];
    for ([x, y, z], of) in &cells {
        for i in 0..27 {
            let other = [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1];
            for q in cells.get(&other).into_iter().flatten() {
                of.iter().filter(|p| *p != q).for_each(|p| near[*p as usize].push(*q));
            }
        }
    }
    let mut group = vec![usize::MAX; count];
    for p in 0..count {
        near[p].sort_unstable();
        near[p].dedup();
        let taken: Vec<usize> = near[p].iter().map(|q| group[*q as usize]).collect();
        group[p] = (0..).find(|g| !taken.contains(g)).unwrap_or(0);
    }
    group
}

impl PatchGroup {
    /// The function of some triangles of a mesh, whose patches are given.
    fn new(mesh: &Mesh, of: &[usize], patch: &[u32]) -> PatchGroup {
        let triangles: Vec<Triangle> = of.iter().map(|t| Triangle::new(mesh.corners(*t))).collect();
        let tree = TriangleBvh::new(&triangles);
        // By edge: the sum of normals, and how many triangles of the group have it.
        let mut edges: FxHashMap<[u32; 2], (Vec3, u8)> = FxHashMap::default();
        let mut corners: FxHashMap<(u32, u32), Vec3> = FxHashMap::default();
        let edge = |t: usize, k: usize| {
            let [a, b] = [mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]];
            [a.min(b), a.max(b)]
        };
        for (t, f) in of.iter().zip(&triangles) {
            for k in 0..3 {
                let e = edges.entry(edge(*t, k)).or_default();
                *e = (add(e.0, f.normal), e.1 + 1);
                let [a, b, c] = [0, 1, 2].map(|i| f.corners[(k + i) % 3]);
                let (u, v) = (sub(b, a), sub(c, a));
                let angle = norm(cross(u, v)).atan2(dot(u, v));
                let n = corners.entry((mesh.triangles[*t][k], patch[*t])).or_default();
                *n = add(*n, scale(f.normal, angle));
            }
        }
        let mut boundary_vertices: Vec<u32> = edges.iter().filter(|e| e.1.1 == 1).flat_map(|e| *e.0).collect();
        boundary_vertices.sort_unstable();
        let about = |i: &u32| {
            let t = of[*i as usize];
            let of_edges = [0, 1, 2].map(|k| edges[&edge(t, k)]);
            let at = mesh.triangles[t];
            let of_corners = at.map(|v| unit(corners[&(v, patch[t])]));
            let mut bits = 0;
            for k in 0..3 {
                bits |= u8::from(of_edges[k].1 == 1) << k;
                bits |= u8::from(boundary_vertices.binary_search(&at[k]).is_ok()) << (3 + k);
            }
            let [a, b, c] = of_edges.map(|e| unit(e.0));
            let [d, e, f] = of_corners;
            ([a, b, c, d, e, f], bits)
        };
        let (normals, at_boundary) = tree.order().par_iter().map(about).unzip();
        PatchGroup { tree, normals, at_boundary }
    }

    /// The value (mm), positive outside, and its gradient, of a point whose nearest triangle is `hit`.
    fn at(&self, hit: &Nearest) -> (f64, Vec3) {
        let i = hit.triangle as usize;
        let (n, bit) = match hit.feature {
            Feature::Face => (self.tree.triangles()[i].normal, 0),
            Feature::Edge(k) => (self.normals[i][usize::from(k)], 1 << k),
            Feature::Corner(k) => (self.normals[i][3 + usize::from(k)], 8 << k),
        };
        let height = dot(hit.away, n);
        let d = hit.square.sqrt();
        if hit.feature == Feature::Face || self.at_boundary[i] & bit != 0 || d <= self.tree.rounding() {
            return (if d <= self.tree.rounding() { 0.0 } else { height }, n);
        }
        let signed = if height < 0.0 { -d } else { d };
        (signed, scale(hit.away, 1.0 / signed))
    }

    /// Fills values (mm) at points.
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let mut seed = 0;
        for (o, p) in out.iter_mut().zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            *o = self.at(&hit).0;
        }
    }

    /// Fills values (mm) and gradients at points.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let mut seed = 0;
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let hit = self.tree.nearest(*p, seed);
            seed = hit.triangle;
            (*v, *g) = self.at(&hit);
        }
    }

    /// Whether the patches reach into a tetrahedron, positively oriented, or cover much of one of its faces.
    pub fn meets(&self, corners: &[Vec3; 4]) -> bool {
        let b = corners.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        let within = planes(corners, INWARD);
        if self.tree.any_touching(&b, |t| !clipped(t.corners, &within).is_empty()) {
            return true;
        }
        let face = |f: [usize; 3]| area(&f.map(|k| corners[k]));
        let least = COVERED * FACES.map(face).into_iter().fold(f64::INFINITY, f64::min);
        let about = planes(corners, -INWARD);
        self.tree.any_touching(&b, |t| area(&clipped(t.corners, &about)) > least)
    }
}

/// A patch reaches into a tetrahedron if it is deeper in it than this fraction of its heights.
const INWARD: f64 = 0.02;
/// It covers much of a face if one of its triangles covers this fraction of the smallest one.
const COVERED: f64 = 0.2;

/// The planes of the faces of a tetrahedron, moved inwards by a fraction of its heights: inward normals and offsets.
fn planes(p: &[Vec3; 4], inward: f64) -> [(Vec3, f64); 4] {
    FACES.map(|f| f.map(|k| p[k])).map(|[a, b, c]| {
        let n = unit(cross(sub(b, a), sub(c, a)));
        let heights = p.map(|q| dot(n, sub(q, a)));
        let far = heights.into_iter().fold(0.0, |m: f64, h| if h.abs() > m.abs() { h } else { m });
        let n = if far < 0.0 { scale(n, -1.0) } else { n };
        (n, dot(n, a) + inward * far.abs())
    })
}

/// The part of a triangle on the inner side of all planes.
fn clipped(corners: [Vec3; 3], planes: &[(Vec3, f64); 4]) -> Vec<Vec3> {
    let mut polygon = corners.to_vec();
    for (n, offset) in planes {
        let height = |p: Vec3| dot(*n, p) - offset;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (h, k) = (height(*p), height(q));
            if h >= 0.0 {
                kept.push(*p);
            }
            if (h >= 0.0) != (k >= 0.0) {
                kept.push(add(*p, scale(sub(q, *p), h / (h - k))));
            }
        }
        polygon = kept;
    }
    polygon
}

/// The area of a convex polygon.
fn area(polygon: &[Vec3]) -> f64 {
    let fan = polygon.windows(2).skip(1).map(|w| cross(sub(w[0], polygon[0]), sub(w[1], polygon[0])));
    0.5 * norm(fan.fold([0.0; 3], add))
}
