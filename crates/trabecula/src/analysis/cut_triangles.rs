//! Which triangles of a mesh lie on the surface of a region.

use rayon::prelude::*;

use crate::field::Field;
use geometry::math::{add, cross, dot, norm, scale, sub, unit};
use geometry::mesh::Mesh;

/// Points evaluated at once.
const BATCH: usize = 4096;
/// Corners on the surface stand off it by rounding and by what balances the volume of curved triangles: less than this
/// share of the mesh's mean edge.
const STAND_OFF: f64 = 0.05;
/// Over an arc of 45 degrees a chord stands off by this share of its length, and so do corners that balance it, as over the facets of
/// a mesh. A triangle that stands off farther runs from one face at an edge of the region to the other.
const CHORD: f64 = 0.1;
/// A triangle on the surface faces as it does, give or take 45 degrees; if it is no higher than its corners may stand
/// off, give or take 72.
const FACING: [f64; 2] = [0.7, 0.3];

/// For each triangle, whether it lies on the surface of `region` (a signed distance, mm) rather than inside it, judged
/// by its corners and its direction.
pub fn cut_triangles(mesh: &Mesh, region: &dyn Field) -> Vec<bool> {
    let mut off = vec![0.0; mesh.vertices.len()];
    let parts = off.par_chunks_mut(BATCH).zip(mesh.vertices.par_chunks(BATCH));
    parts.for_each(|(off, points)| region.values(points, off));
    let place = |v: u32| mesh.vertices[v as usize];
    let edges = mesh.triangles.iter().map(|t| norm(sub(place(t[1]), place(t[0]))));
    let near = STAND_OFF * edges.sum::<f64>() / mesh.triangles.len().max(1) as f64;
    let mut cut = vec![false; mesh.triangles.len()];
    let parts = cut.par_chunks_mut(BATCH).zip(mesh.triangles.par_chunks(BATCH));
    parts.for_each(|(cut, triangles)| {
        let middle = |t: &[u32; 3]| {
            let [a, b, c] = t.map(place);
            scale(add(a, add(b, c)), 1.0 / 3.0)
        };
        let middles: Vec<_> = triangles.iter().map(middle).collect();
        let (mut distance, mut gradient) = (vec![0.0; cut.len()], vec![[0.0; 3]; cut.len()]);
        region.gradients(&middles, &mut distance, &mut gradient);
        for (i, (cut, t)) in cut.iter_mut().zip(triangles).enumerate() {
            let [a, b, c] = t.map(place);
            let normal = cross(sub(b, a), sub(c, a));
            let longest = norm(sub(b, a)).max(norm(sub(c, a))).max(norm(sub(c, b)));
            let sliver = norm(normal) < near * longest;
            let reach = near.max(CHORD * longest);
            *cut = t.iter().all(|v| off[*v as usize].abs() <= reach)
                && distance[i].abs() <= reach
                && dot(unit(normal), unit(gradient[i])) >= FACING[usize::from(sliver)];
        }
    });
    cut
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::surface;
    use crate::region::{Cuboid, Sphere};
    use crate::solid::Solid;
    use geometry::progress::Silent;
    use std::sync::Arc;

    #[test]
    fn the_cut_of_a_ball_by_a_box_is_recognised() {
        let solid = |region: crate::region::Region| Solid::new(region, None, 1.0);
        let ball = Sphere::new([0.0; 3], 1.0).expect("ball");
        let mesh = surface(&solid(Arc::new(ball)), 0.07, &Silent).expect("surface").mesh;
        assert!(cut_triangles(&mesh, &ball).iter().all(|c| *c));
        let elsewhere = Cuboid::new([-2.0; 3], [2.0; 3]).expect("box");
        assert!(cut_triangles(&mesh, &elsewhere).iter().all(|c| !*c));
    }
}
