//! Whether a small mesh is embedded. Planes that separate two triangles are looked for in plain f64 first, as nearly all pairs
//! have one; what rounding leaves open is decided exactly.

use super::exact::drop_axis;
use super::self_intersections::{bounds, meet};
use super::{Mesh, degenerate};
use crate::math::{Aabb, Vec3, cross, dot, sub};

/// Whether no two triangles of a small mesh meet elsewhere than in their common vertices or edge, and none is flat.
pub fn is_embedded(mesh: &Mesh) -> bool {
    let boxes = (0..mesh.triangles.len()).map(|i| bounds(mesh.corners(i)));
    let extent = boxes.fold(Aabb::EMPTY, Aabb::union).size().into_iter().fold(0.0, f64::max);
    let facets: Vec<Facet> = (0..mesh.triangles.len()).map(|i| Facet::new(mesh, i, extent)).collect();
    facets.iter().enumerate().all(|(i, a)| {
        let meets = |(j, b): (usize, &Facet)| {
            a.bounds.touches(&b.bounds) && !a.separates(b) && !b.separates(a) && meet(mesh, i, j)
        };
        (a.view.is_some() || !degenerate(mesh, i)) && !facets[..i].iter().enumerate().any(meets)
    })
}

/// A triangle, and what tells quickly on which side of it a point is.
struct Facet {
    names: [u32; 3],
    corners: [Vec3; 3],
    bounds: Aabb,
    normal: Vec3,
    /// The axis along which it looks largest, and whether it runs counter-clockwise seen along it; none if it may be flat.
    view: Option<(usize, bool)>,
    /// Bounds on the rounding errors of determinants of two and of three differences of coordinates.
    error: [f64; 2],
}

impl Facet {
    /// `extent` is the greatest difference of two coordinates in the mesh.
    fn new(mesh: &Mesh, i: usize, extent: f64) -> Facet {
        let corners = mesh.corners(i);
        let [a, b, c] = corners;
        let normal = cross(sub(b, a), sub(c, a));
        // Two products of two differences, then six of three: each factor and each operation adds half an epsilon at most.
        let error = [8.0 * f64::EPSILON * extent.powi(2), 32.0 * f64::EPSILON * extent.powi(3)];
        let axis = (1..3).fold(0, |m, k| if normal[k].abs() > normal[m].abs() { k } else { m });
        let view = (normal[axis].abs() > error[0]).then_some((axis, normal[axis] > 0.0));
        Facet { names: mesh.triangles[i], corners, bounds: bounds(corners), normal, view, error }
    }

    /// Whether the plane of the triangle, or one through a side of it along the axis of its view, certainly has the other
    /// triangle beyond it but for their common vertices.
    fn separates(&self, other: &Facet) -> bool {
        let Some((axis, left)) = self.view else {
            return false;
        };
        let common = self.names.map(|n| other.names.contains(&n));
        if common == [true; 3] {
            return false;
        }
        let free = || (0..3).filter(|k| !self.names.contains(&other.names[*k])).map(|k| other.corners[k]);
        let height = |p: Vec3| dot(self.normal, sub(p, self.corners[0]));
        if free().all(|p| height(p) > self.error[1]) || free().all(|p| height(p) < -self.error[1]) {
            return true;
        }
        // A common vertex opposite the side would be on the near side of it.
        (0..3).filter(|k| !common[(k + 2) % 3]).any(|k| {
            let [a, b] = [k, (k + 1) % 3].map(|k| drop_axis(self.corners[k], axis));
            free().all(|p| {
                let p = drop_axis(p, axis);
                let turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                (if left { -turn } else { turn }) > self.error[0]
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::samples::torus;
    use super::super::self_intersections;
    use super::*;

    #[test]
    fn the_quick_tests_agree_with_the_exact_ones() {
        let mut s = 11u64;
        let mut seen = [0; 2];
        for round in 0..4000 {
            // Corners on grids from coarse, where touching and coplanar pairs abound, to fine; a vertex or two in common.
            let steps = [2.0, 4.0, 1e3, 1e9][round % 4];
            let mut next = || (steps * crate::random::random(&mut s)).floor() / steps;
            let mut mesh = Mesh { vertices: (0..6).map(|_| [next(), next(), next()]).collect(), ..Mesh::default() };
            mesh.triangles.push([0, 1, 2]);
            mesh.triangles.push([[3, 4, 5], [0, 4, 5], [4, 2, 1]][round / 4 % 3]);
            let flat = (0..2).any(|i| degenerate(&mesh, i));
            let expected = !flat && self_intersections(&mesh, 1) == 0;
            assert_eq!(is_embedded(&mesh), expected, "{mesh:?}");
            seen[usize::from(expected)] += 1;
        }
        assert!(seen.iter().all(|n| *n > 400), "{seen:?}");
        assert!(is_embedded(&torus(24, 16)));
    }
}
