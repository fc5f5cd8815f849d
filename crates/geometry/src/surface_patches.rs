//! Smooth patches of a mesh, bounded by its feature edges, and each as a function that is zero on it.
//!
//! A signed distance bends at the feature edges of a solid, and between two sheets of a thin wall. The function of one patch does not:
//! beyond its boundary it goes on as the tangent plane there, so that two of them meet in the feature edge and three in the corner.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::distance::normals::PseudoNormals;
use crate::distance::triangle::{Feature, Triangle, normal};
use crate::distance::triangle_bvh::{Nearest, TriangleBvh};
use crate::feature_edges::{Creases, creases};
use crate::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, ends};
use crate::progress::checkpoint;
use crate::tetmesh::FACES;
use crate::union_find;

/// The least turn of the normal across a feature edge, radians (40°): more than that between the sides of a coarsely approximated hole.
const TURN: f64 = 0.698;
/// Patches of one group are at least as far apart as this multiple of the size.
const APART: f64 = 2.5;

/// Patches of a mesh that are far from each other, as one function.
#[derive(Debug)]
pub struct PatchGroup {
    tree: TriangleBvh,
    normals: PseudoNormals,
    /// Which corners of each triangle are on the boundary of its patch, in the tree's order.
    at_boundary: Vec<[bool; 3]>,
    /// The creases within its patches: shallow ones, and those that end in a patch.
    pub creases: Arc<Creases>,
}

/// The patches of a closed mesh for elements of a size (mm), in groups; patches narrower than `narrow` (mm) are part of an adjacent one.
/// The groups of a mesh without feature edges are none.
pub fn patch_groups(mesh: &Mesh, size: f64, narrow: f64) -> Vec<PatchGroup> {
    let edges = feature_edges(mesh);
    let (patch, count) = patches(mesh, &edges, narrow);
    if count < 2 {
        return Vec::new();
    }
    let group = groups(mesh, &patch, count, size);
    let groups = group.iter().max().map_or(0, |g| g + 1);
    let of = |g: usize| (0..patch.len()).filter(|t| group[patch[*t] as usize] == g).collect::<Vec<_>>();
    (0..groups).map(|g| PatchGroup::new(&part(mesh, &of(g)))).collect()
}

/// Two adjacent triangles, the length of their edge, and whether it is a feature edge.
struct Adjacent {
    triangles: [u32; 2],
    length: f64,
    feature: bool,
}

/// The edges of a mesh that two triangles share.
fn feature_edges(mesh: &Mesh) -> Vec<Adjacent> {
    let edges = Edges::of(&mesh.triangles);
    let pairs = edges.each().filter(|e| e.len() == 2);
    pairs
        .map(|e| {
            let triangles = [e[0] / 3, e[1] / 3];
            let [m, n] = triangles.map(|t| normal(mesh.corners(t as usize)));
            let [a, b] = ends(&mesh.triangles, e[0]).map(|v| mesh.vertices[v as usize]);
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
        // All narrow ones at a time, each to its widest neighbour: the number of patches halves, or more, in a pass.
        let mut to: Vec<Option<(f64, u32, [u32; 2])>> = vec![None; count];
        for ([a, b], (length, triangles)) in shared {
            let best = &mut to[a as usize];
            if best.is_none_or(|(l, c, _)| length > l || length == l && b < c) {
                *best = Some((length, b, triangles));
            }
        }
        let narrow = |p: &usize| length[*p] > 0.0 && 2.0 * area[*p] < least * length[*p];
        let joined: Vec<[u32; 2]> = (0..count).filter(narrow).filter_map(|p| to[p].map(|t| t.2)).collect();
        if joined.is_empty() {
            return (label, count);
        }
        for [a, b] in joined {
            union_find::unite(&mut root, a, b);
        }
        checkpoint();
    }
}

/// The group of each patch: those of one group are far from each other.
fn groups(mesh: &Mesh, patch: &[u32], count: usize, size: f64) -> Vec<usize> {
    let (spacing, cell) = (0.5 * size, (APART + 0.5) * size);
    let mut cells: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    for (t, p) in patch.iter().enumerate() {
        checkpoint();
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

/// Some triangles of a mesh as one of their own.
fn part(mesh: &Mesh, of: &[usize]) -> Mesh {
    let mut number: FxHashMap<u32, u32> = FxHashMap::default();
    let mut vertices = Vec::new();
    let mut renamed = |v: u32| {
        *number.entry(v).or_insert_with(|| {
            vertices.push(mesh.vertices[v as usize]);
            vertices.len() as u32 - 1
        })
    };
    let triangles = of.iter().map(|t| mesh.triangles[*t].map(&mut renamed)).collect();
    Mesh { vertices, triangles }
}

impl PatchGroup {
    /// The function of a mesh that is open where its patches end.
    fn new(mesh: &Mesh) -> PatchGroup {
        let faces: Vec<Triangle> = (0..mesh.triangles.len()).map(|i| Triangle::new(mesh.corners(i))).collect();
        let tree = TriangleBvh::new(&faces);
        let edges = Edges::of(&mesh.triangles);
        let pairs: Vec<[u32; 2]> = edges.each().filter(|e| e.len() == 2).map(|e| [e[0], e[1]]).collect();
        let normals = PseudoNormals::new(mesh, &faces, &pairs, tree.order());
        let mut at_boundary = vec![false; mesh.vertices.len()];
        for e in edges.each().filter(|e| e.len() == 1) {
            ends(&mesh.triangles, e[0]).into_iter().for_each(|v| at_boundary[v as usize] = true);
        }
        let of = |i: &u32| mesh.triangles[*i as usize].map(|v| at_boundary[v as usize]);
        let at_boundary = tree.order().iter().map(of).collect();
        PatchGroup { normals, at_boundary, tree, creases: Arc::new(creases(mesh)) }
    }

    /// The value (mm), positive outside, and its gradient, of a point whose nearest triangle is `hit`.
    fn at(&self, hit: &Nearest) -> (f64, Vec3) {
        let i = hit.triangle as usize;
        let outward = unit(self.normals.outward(&self.tree, hit));
        // An edge of one triangle has no normal of two.
        let (n, flat) = match hit.feature {
            Feature::Face => (outward, true),
            Feature::Edge(_) if outward == [0.0; 3] => (self.tree.triangles()[i].normal, true),
            Feature::Edge(_) => (outward, false),
            Feature::Corner(k) => (outward, self.at_boundary[i][usize::from(k)]),
        };
        let (height, d) = (dot(hit.away, n), hit.square.sqrt());
        if d <= self.tree.rounding() {
            return (0.0, n);
        }
        if flat {
            return (height, n);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A box between the origin and `size`.
    fn cuboid(size: Vec3) -> Mesh {
        let corner = |i: usize| -> Vec3 { core::array::from_fn(|k| if i >> k & 1 == 1 { size[k] } else { 0.0 }) };
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Mesh { vertices: (0..8).map(corner).collect(), triangles }
    }

    #[test]
    fn each_side_of_a_box_goes_on_as_its_plane() {
        let groups = patch_groups(&cuboid([1.0, 2.0, 3.0]), 1.0, 0.05);
        assert_eq!(groups.len(), 6, "sides closer than two and a half sizes are in groups of their own");
        for p in [[0.3, 0.4, 0.5], [1.5, -0.4, 0.2], [-2.0, 3.0, 4.5], [1.0, 2.0, 3.0]] {
            let mut found: Vec<f64> = groups
                .iter()
                .map(|g| {
                    let (mut v, mut n) = ([0.0], [[0.0; 3]]);
                    g.gradients(&[p], &mut v, &mut n);
                    assert!((norm(n[0]) - 1.0).abs() < 1e-12);
                    v[0]
                })
                .collect();
            let [x, y, z] = p;
            let mut planes = [-x, x - 1.0, -y, y - 2.0, -z, z - 3.0];
            found.sort_by(f64::total_cmp);
            planes.sort_by(f64::total_cmp);
            assert!(found.iter().zip(planes).all(|(a, b)| (a - b).abs() < 1e-12), "{p:?}: {found:?}, not {planes:?}");
        }
    }

    #[test]
    fn far_sides_share_a_group_and_narrow_ones_are_joined() {
        // Ten times as long as apart: both ends are of one group.
        assert_eq!(patch_groups(&cuboid([10.0, 1.0, 1.0]), 1.0, 0.05).len(), 5);
        // Sides a hundredth of a size wide are no patches of their own.
        let (patch, count) = {
            let mesh = cuboid([1.0, 1.0, 0.01]);
            patches(&mesh, &feature_edges(&mesh), 0.05)
        };
        assert_eq!(count, 2, "{patch:?}");
    }

    #[test]
    fn a_patch_meets_what_it_enters_or_covers_and_nothing_that_it_touches() {
        let groups = patch_groups(&cuboid([4.0, 4.0, 4.0]), 1.0, 0.05);
        let met = |at: Vec3| {
            let tet = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|p| add(p, at));
            groups.iter().filter(|g| g.meets(&tet)).count()
        };
        // Across one plane, with a face on one, across an edge, and with nothing but an edge of its own on one.
        assert_eq!(met([1.0, 1.0, -0.5]), 1);
        assert_eq!(met([1.0, 1.0, 4.0]), 1);
        assert_eq!(met([1.0, -0.3, -0.3]), 2);
        assert_eq!(met([4.0, 1.0, 1.0]), 1);
        assert_eq!(met([1.5, 1.5, 1.5]), 0);
        assert_eq!(met([1.0, 4.0, -1.0]), 0);
    }
}
