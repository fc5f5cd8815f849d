//! Orientation of triangles: alike across edges, components outwards, cavities kept.

use crate::distance::triangle::Triangle;
use crate::distance::triangle_bvh::TriangleBvh;
use crate::distance::winding::{Winding, turn};
use crate::math::{Aabb, Vec3, cross, dot, norm, scale, sub};
use crate::mesh::Mesh;
use crate::mesh::edges::{Edges, components, rises};

/// Triangles of a component at whose centroids it is tested whether another one contains it.
const SAMPLES: usize = 32;
/// Components of more triangles are tested through a tree.
const MANY: usize = 256;

/// Makes the triangles of each patch (joined by edges of two triangles) face alike, as most of its area did; gives
/// the number of triangles reversed. Where a patch is not orientable (a Möbius band) some edge stays as it was.
pub fn face_alike(mesh: &mut Mesh) -> usize {
    let n = mesh.triangles.len();
    // Per edge of a triangle its neighbour, and whether the two face opposite ways.
    let mut across = vec![(u32::MAX, false); 3 * n];
    for edge in Edges::of(&mesh.triangles).each() {
        if let [a, b] = *edge {
            let against = rises(&mesh.triangles, a) == rises(&mesh.triangles, b);
            across[a as usize] = (b / 3, against);
            across[b as usize] = (a / 3, against);
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

/// A connected component of a mesh.
struct Component {
    triangles: Vec<u32>,
    bounds: Aabb,
    volume: f64,
    /// Built at the first query, for components of many triangles.
    tree: Option<(TriangleBvh, Winding)>,
}

impl Component {
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

/// Turns components (sets joined by edges) that are inside out. A component within others keeps its sense against them, so
/// that cavities stay, unless it would bound no solid and no cavity. Gives the number of components turned.
pub fn face_out(mesh: &mut Mesh) -> usize {
    let (number, count) = components(mesh);
    let mut components: Vec<Component> =
        (0..count).map(|_| Component { triangles: Vec::new(), bounds: Aabb::EMPTY, volume: 0.0, tree: None }).collect();
    for (i, b) in (0..).zip(&number) {
        let component = &mut components[*b as usize];
        component.triangles.push(i);
        component.bounds = mesh.corners(i as usize).iter().fold(component.bounds, |b, p| b.with(*p));
    }
    for component in &mut components {
        let o = component.bounds.center();
        let six = |i: &u32| {
            let [a, b, c] = mesh.corners(*i as usize).map(|p| sub(p, o));
            dot(a, cross(b, c))
        };
        component.volume = component.triangles.iter().map(six).sum::<f64>() / 6.0;
    }
    // From the largest box down, a component comes after all that hold it.
    let extent = |b: &Component| dot(b.bounds.size(), b.bounds.size());
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| extent(&components[*b]).total_cmp(&extent(&components[*a])).then(a.cmp(b)));
    let any_out = components.iter().any(|b| b.volume < 0.0);
    let mut flip = vec![false; count];
    for (rank, &i) in order.iter().enumerate() {
        // Where none is inside out there is nothing to test.
        let mut holders: Vec<usize> = Vec::new();
        if any_out {
            let inside = |outer: &Aabb, inner: &Aabb| {
                (0..3).all(|k| outer.min[k] <= inner.min[k] && inner.max[k] <= outer.max[k])
            };
            let step = components[i].triangles.len().div_ceil(SAMPLES).max(1);
            let samples: Vec<Vec3> = components[i]
                .triangles
                .iter()
                .step_by(step)
                .map(|t| {
                    let [a, b, c] = mesh.corners(*t as usize);
                    scale([0, 1, 2].map(|k| a[k] + b[k] + c[k]), 1.0 / 3.0)
                })
                .collect();
            for &j in &order[..rank] {
                let within = inside(&components[j].bounds, &components[i].bounds);
                if within && samples.iter().all(|p| components[j].holds(mesh, *p)) {
                    holders.push(j);
                }
            }
        }
        let sense = |j: usize, flip: &[bool]| (components[j].volume > 0.0) != flip[j];
        let about = holders.iter().map(|&j| if sense(j, &flip) { 1 } else { -1 });
        let about: i32 = about.sum();
        // The nearest holder is the last: boxes shrink along the order.
        flip[i] = holders.last().is_some_and(|&j| flip[j]);
        if components[i].volume != 0.0 && !sense(i, &flip) && about <= 0 {
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
