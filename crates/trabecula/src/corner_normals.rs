//! The normals of a surface at the corners of its triangles, as its field has them: what it is shaded by, so that facets do not show.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};
use geometry::surface_mesh::SurfaceMesh;
use rayon::prelude::*;

use crate::field::Field;

/// Points evaluated at once.
const BATCH: usize = 4096;
/// Cosine of the angle from a triangle up to which the gradient at a vertex is that of the triangle's side: 20°, more than triangles of a
/// default mesh turn from their surface.
const SAME_SIDE: f64 = 0.94;
/// Cosine of the angle beyond which the field says nothing about a triangle: 80°. Facets of a beam that is two grid steps thick turn by 60°.
/// 45° at the edge of a cut, where a coarse triangle of one side can lie within the other.
const UNLIKE: f64 = 0.17;
const UNLIKE_AT_CUTS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// How far to the middle of its triangle a corner on a crease is moved, off the crease.
const INWARDS: f64 = 0.25;

/// Unit normals at the corners of all triangles, three for each; zero where the gradient of the field does not fit the triangle.
///
/// On a crease, and where the lattice is cut, each side has its own: the gradient is that of a point of the triangle near the corner.
pub fn corner_normals(field: &dyn Field, surface: &SurfaceMesh) -> Vec<[f32; 3]> {
    let mesh = &surface.mesh;
    let at_vertices = directions(field, &mesh.vertices);
    let (mut cut, mut lattice) = (vec![false; mesh.vertices.len()], vec![false; mesh.vertices.len()]);
    for (t, is_cut) in mesh.triangles.iter().zip(&surface.cut) {
        let side = if *is_cut { &mut cut } else { &mut lattice };
        t.iter().for_each(|v| side[*v as usize] = true);
    }
    let flats: Vec<Vec3> = (0..mesh.triangles.len())
        .into_par_iter()
        .map(|i| {
            let [a, b, c] = mesh.corners(i);
            unit(cross(sub(b, a), sub(c, a)))
        })
        .collect();
    let corners = mesh.triangles.as_flattened();
    let alike = |i: usize, n: Vec3, least: f64| norm(n) > 0.0 && dot(n, flats[i / 3]) > least;
    let at_cut = |i: usize| cut[corners[i] as usize] && lattice[corners[i] as usize];
    let on_side = |i: usize| !at_cut(i) && alike(i, at_vertices[corners[i] as usize], SAME_SIDE);
    let apart: Vec<usize> = (0..corners.len()).into_par_iter().filter(|i| !on_side(*i)).collect();
    let moved = |i: &usize| {
        let [a, b, c] = mesh.corners(i / 3);
        let middle = scale(add(a, add(b, c)), 1.0 / 3.0);
        let p = mesh.vertices[corners[*i] as usize];
        add(p, scale(sub(middle, p), INWARDS))
    };
    let points: Vec<Vec3> = apart.par_iter().map(moved).collect();
    let mut normals: Vec<Vec3> = corners.par_iter().map(|v| at_vertices[*v as usize]).collect();
    for (i, n) in apart.into_iter().zip(directions(field, &points)) {
        normals[i] = n;
    }
    let known = |(i, n): (usize, &Vec3)| {
        let least = if at_cut(i) { UNLIKE_AT_CUTS } else { UNLIKE };
        if alike(i, *n, least) { n.map(|c| c as f32) } else { [0.0; 3] }
    };
    normals.par_iter().enumerate().map(known).collect()
}

/// The directions of the gradient.
fn directions(field: &dyn Field, points: &[Vec3]) -> Vec<Vec3> {
    let mut gradients = vec![[0.0; 3]; points.len()];
    gradients.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(out, points)| {
        field.gradients(points, &mut vec![0.0; points.len()], out);
        out.iter_mut().for_each(|g| *g = if g.iter().all(|c| c.is_finite()) { unit(*g) } else { [0.0; 3] });
    });
    gradients
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Aabb, Interval};
    use proptest::prelude::*;

    /// The part of a ball of radius 1 about the origin below a height; turned inside out by a sign of −1.
    struct Cap {
        height: f64,
        sign: f64,
    }

    impl Field for Cap {
        fn values(&self, points: &[Vec3], out: &mut [f64]) {
            self.gradients(points, out, &mut vec![[0.0; 3]; points.len()]);
        }

        fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
            for (i, p) in points.iter().enumerate() {
                let (ball, plane) = (norm(*p) - 1.0, p[2] - self.height);
                let n = if ball > plane { unit(*p) } else { [0.0, 0.0, 1.0] };
                (values[i], gradients[i]) = (self.sign * ball.max(plane), scale(n, self.sign));
            }
        }

        fn bound(&self, _: &Aabb) -> Interval {
            Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY }
        }
    }

    /// Its surface in rings of `n` corners, the lowest about the pole; the disc at the top is cut.
    fn surface(height: f64, n: usize) -> SurfaceMesh {
        let mut made = SurfaceMesh::default();
        let rings = n / 2;
        let top = height.acos();
        for ring in 0..=rings {
            let polar =
                std::f64::consts::PI - (std::f64::consts::PI - top) * (ring as f64 + 0.3) / (rings as f64 + 0.3);
            for k in 0..n {
                let (s, c) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                made.mesh.vertices.push([polar.sin() * c, polar.sin() * s, polar.cos()]);
            }
        }
        for (ring, k) in (0..rings).flat_map(|r| (0..n).map(move |k| (r, k))) {
            let at = |r: usize, k: usize| (r * n + k % n) as u32;
            let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
            made.mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        made.cut = vec![false; made.mesh.triangles.len()];
        made.mesh.vertices.push([0.0, 0.0, height]);
        let first = rings * n;
        for k in 0..n {
            made.mesh.triangles.push([first + k, first + (k + 1) % n, (rings + 1) * n].map(|v| v as u32));
            made.cut.push(true);
        }
        made
    }

    proptest! {
        /// Of a coarse cap the normals are radial, to rounding but at the edge, there up to what a corner is moved by; those of the disc are
        /// its own. A field that is not the surface's says nothing.
        #[test]
        fn normals_are_those_of_the_field_on_either_side_of_an_edge(height in -0.7..0.7f64, n in 32usize..64) {
            let (cap, surface) = (Cap { height, sign: 1.0 }, surface(height, n));
            let normals = corner_normals(&cap, &surface);
            let at_edge = |p: Vec3| (p[2] - height).abs() < 1e-9;
            // Sides of triangles are at most π / (n / 2) by 2 π / n long, and middles nearer than two thirds of their diagonals.
            let moved = INWARDS * 2.0 / 3.0 * std::f64::consts::TAU / n as f64 * std::f64::consts::SQRT_2;
            for (i, found) in normals.iter().enumerate() {
                let p = surface.mesh.vertices[surface.mesh.triangles[i / 3][i % 3] as usize];
                let found = found.map(f64::from);
                let (want, off) = match surface.cut[i / 3] {
                    true => ([0.0, 0.0, 1.0], 1e-6),
                    false if at_edge(p) => (p, moved),
                    false => (p, 1e-6),
                };
                prop_assert!(norm(sub(found, want)) <= off, "{found:?} {want:?} {off}");
            }
            let inside_out = corner_normals(&Cap { height, sign: -1.0 }, &surface);
            prop_assert!(inside_out.iter().all(|n| *n == [0.0; 3]));
        }
    }
}
