//! Which way triangles face: neighbours alike, bodies outwards, cavities kept.

use super::half_edges::{components, halves, rises};
use crate::distance::triangle::Triangle;
use crate::distance::triangle_bvh::TriangleBvh;
use crate::distance::winding::{Winding, turn};
use crate::math::{Aabb, Vec3, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;

/// Corners of a body at which it is asked whether another one holds it.
const LOOKS: usize = 32;
/// Bodies of more triangles are asked through a tree.
const MANY: usize = 256;

/// Makes the triangles of each patch (joined by edges of two triangles) face alike, as most of its area did; gives
/// the number of triangles turned. Where a patch has one side only (a Möbius band) some edge stays as it was.
pub fn face_alike(mesh: &mut Mesh) -> usize {
    let halves = halves(mesh);
    let n = mesh.triangles.len();
    // Per side of a triangle its neighbour, and whether the two face opposite ways.
    let mut across = vec![(u32::MAX, false); 3 * n];
    for edge in halves.chunk_by(|a, b| a.0 == b.0) {
        if let [a, b] = edge {
            let against = rises(mesh, a.1) == rises(mesh, b.1);
            across[a.1 as usize] = (b.1 / 3, against);
            across[b.1 as usize] = (a.1 / 3, against);
        }
    }
    let area = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        norm(cross(sub(b, a), sub(c, a)))
    };
    let mut turned: Vec<Option<bool>> = vec![None; n];
    let mut flips = vec![false; n];
    let mut patch = Vec::new();
    for first in 0..n {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        patch.clear();
        patch.push(first);
        let mut next = 0;
        let mut balance = 0.0;
        while let Some(&i) = patch.get(next) {
            next += 1;
            let this = turned[i] == Some(true);
            balance += if this { -area(i) } else { area(i) };
            for (j, against) in &across[3 * i..3 * i + 3] {
                if let Some(t @ None) = turned.get_mut(*j as usize) {
                    *t = Some(this != *against);
                    patch.push(*j as usize);
                }
            }
        }
        for &i in &patch {
            flips[i] = (turned[i] == Some(true)) != (balance < 0.0);
        }
    }
    for (t, _) in mesh.triangles.iter_mut().zip(&flips).filter(|f| *f.1) {
        t.swap(1, 2);
    }
    flips.iter().filter(|f| **f).count()
}

/// One closed body of a mesh.
struct Body {
    triangles: Vec<u32>,
    bounds: Aabb,
    volume: f64,
    /// Made at the first question, for bodies of many triangles.
    tree: Option<(TriangleBvh, Winding)>,
}

impl Body {
    fn holds(&mut self, mesh: &Mesh, p: Vec3) -> bool {
        if self.bounds.distance(p) > 0.0 {
            return false;
        }
        let corners = |i: &u32| mesh.corners(*i as usize);
        if self.triangles.len() <= MANY {
            return self.triangles.iter().map(|i| turn(corners(i), p)).sum::<f64>().abs() > 0.5;
        }
        let (tree, winding) = self.tree.get_or_insert_with(|| {
            let faces: Vec<Triangle> = self.triangles.iter().map(|i| Triangle::new(corners(i))).collect();
            let tree = TriangleBvh::new(&faces);
            let winding = Winding::new(&tree);
            (tree, winding)
        });
        winding.at(tree, p, 2.0, |_| false).abs() > 0.5
    }
}

/// Turns bodies (sets joined by edges) that are inside out. A body within others keeps its sense against them, so
/// that cavities stay, unless it would bound no solid and no cavity. Gives the number of bodies turned.
pub fn face_out(mesh: &mut Mesh) -> usize {
    let (number, count) = components(mesh);
    let mut bodies: Vec<Body> =
        (0..count).map(|_| Body { triangles: Vec::new(), bounds: Aabb::EMPTY, volume: 0.0, tree: None }).collect();
    for (i, b) in (0..).zip(&number) {
        let body = &mut bodies[*b as usize];
        body.triangles.push(i);
        body.bounds = mesh.corners(i as usize).iter().fold(body.bounds, |b, p| b.with(*p));
    }
    for body in &mut bodies {
        let o = body.bounds.center();
        let six = |i: &u32| {
            let [a, b, c] = mesh.corners(*i as usize).map(|p| sub(p, o));
            dot(a, cross(b, c))
        };
        body.volume = body.triangles.iter().map(six).sum::<f64>() / 6.0;
    }
    // From the largest box down, a body comes after all that hold it.
    let extent = |b: &Body| dot(b.bounds.size(), b.bounds.size());
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| extent(&bodies[*b]).total_cmp(&extent(&bodies[*a])).then(a.cmp(b)));
    let any_out = bodies.iter().any(|b| b.volume < 0.0);
    let mut flip = vec![false; count];
    for (rank, &i) in order.iter().enumerate() {
        // Nothing stands inside out: nothing to ask.
        let mut holders: Vec<usize> = Vec::new();
        if any_out {
            let inside = |outer: &Aabb, inner: &Aabb| {
                (0..3).all(|k| outer.min[k] <= inner.min[k] && inner.max[k] <= outer.max[k])
            };
            let step = bodies[i].triangles.len().div_ceil(LOOKS).max(1);
            let looks: Vec<Vec3> = bodies[i]
                .triangles
                .iter()
                .step_by(step)
                .map(|t| {
                    let [a, b, c] = mesh.corners(*t as usize);
                    scale([0, 1, 2].map(|k| a[k] + b[k] + c[k]), 1.0 / 3.0)
                })
                .collect();
            for &j in &order[..rank] {
                let within = inside(&bodies[j].bounds, &bodies[i].bounds);
                if within && looks.iter().all(|p| bodies[j].holds(mesh, *p)) {
                    holders.push(j);
                }
            }
        }
        let sense = |j: usize, flip: &[bool]| (bodies[j].volume > 0.0) != flip[j];
        let about = holders.iter().map(|&j| if sense(j, &flip) { 1 } else { -1 });
        let about: i32 = about.sum();
        // The nearest holder is the last: boxes shrink along the order.
        flip[i] = holders.last().is_some_and(|&j| flip[j]);
        if bodies[i].volume != 0.0 && !sense(i, &flip) && about <= 0 {
            flip[i] = !flip[i];
        }
    }
    for (t, b) in mesh.triangles.iter_mut().zip(&number) {
        if flip[*b as usize] {
            t.swap(1, 2);
        }
    }
    flip.iter().filter(|f| **f).count()
}
