//! Which triangles of a mesh lie on the surface of a region.

use rayon::prelude::*;

use crate::field::Field;
use crate::math::{add, cross, dot, norm, scale, sub, unit};
use crate::mesh::Mesh;

/// Triangles told apart at once.
const BATCH: usize = 4096;
/// This close to the surface, as a share of the mesh's mean edge, a triangle is on it whichever way it faces: slivers
/// have no direction to speak of.
const TOUCHING: f64 = 0.05;
/// A triangle on a curved surface stands off it by its chord height; this share of its longest edge allows for arcs
/// of 45 degrees, if it faces as the surface does, to 18 degrees.
const STAND_OFF: f64 = 0.1;
const FACING: f64 = 0.95;

/// For each triangle, whether it lies on the surface of `region` (a signed distance, mm) rather than inside it,
/// judged at its middle. Triangles of the lattice within a twentieth of an edge of the surface count as cut.
pub fn cut_triangles(mesh: &Mesh, region: &dyn Field) -> Vec<bool> {
    let mut cut = vec![false; mesh.triangles.len()];
    let first_edges = mesh.triangles.iter().map(|t| {
        norm(sub(
            mesh.vertices[t[1] as usize],
            mesh.vertices[t[0] as usize],
        ))
    });
    let touching = TOUCHING * first_edges.sum::<f64>() / mesh.triangles.len().max(1) as f64;
    cut.par_chunks_mut(BATCH).enumerate().for_each(|(n, cut)| {
        let corners = |i: usize| mesh.corners(n * BATCH + i);
        let middles: Vec<_> = (0..cut.len())
            .map(|i| {
                let [a, b, c] = corners(i);
                scale(add(a, add(b, c)), 1.0 / 3.0)
            })
            .collect();
        let (mut distance, mut gradient) = (vec![0.0; cut.len()], vec![[0.0; 3]; cut.len()]);
        region.gradients(&middles, &mut distance, &mut gradient);
        for (i, cut) in cut.iter_mut().enumerate() {
            let [a, b, c] = corners(i);
            let (ab, ac) = (sub(b, a), sub(c, a));
            let longest = norm(ab).max(norm(ac)).max(norm(sub(c, b)));
            let facing = dot(unit(cross(ab, ac)), unit(gradient[i]));
            let off = distance[i].abs();
            *cut = off <= touching || (off <= STAND_OFF * longest && facing >= FACING);
        }
    });
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::{Silent, surface};
    use crate::region::{Cuboid, Sphere};
    use crate::solid::Solid;
    use std::sync::Arc;

    #[test]
    fn a_ball_cut_by_a_box_is_told_apart() {
        let solid = |region: crate::region::Region| Solid::new(region, None, 1.0);
        let ball = Sphere::new([0.0; 3], 1.0).expect("ball");
        let mesh = surface(&solid(Arc::new(ball)), 0.07, &Silent)
            .expect("surface")
            .mesh;
        assert!(cut_triangles(&mesh, &ball).iter().all(|c| *c));
        let elsewhere = Cuboid::new([-2.0; 3], [2.0; 3]).expect("box");
        assert!(cut_triangles(&mesh, &elsewhere).iter().all(|c| !*c));
    }
}
