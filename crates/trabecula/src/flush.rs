//! Bodies kept apart from faces that they are flush with.
//!
//! Where two faces are one surface over some area, their order there is a matter of rounding, and no mesh that is cut by
//! both is sound. So a body that is added to a solid reaches a little farther where it is flush with what is there
//! already: what it meets face to face it then overlaps, and what it ends level with it stands out from, by far less
//! than any grid step and far more than single precision can tell.

use std::sync::Arc;

use crate::face::{Body, Face};
use crate::field::{Block, Field};
use crate::math::{Aabb, Interval, Vec3, add, dot, norm, scale};

/// How far a face that is flush is moved, as a share of the region's size.
const APART: f64 = 1e-5;
/// Faces are flush where they are this close, as a share of the size.
const FLUSH: f64 = 1e-8;
/// Places on each face at which it is looked at.
const LOOKS: usize = 96;

/// The body with its faces that are flush with one of `others`, or with each other, moved outwards. `bounds` are those
/// of the region.
pub(crate) fn apart(body: &mut Body, others: &[Face], bounds: &Aabb) {
    let size = norm(bounds.size());
    let mut placed: Vec<Face> = others.to_vec();
    let mut moved = 0.0;
    for face in &mut body.faces {
        let places = places(&*face.field, bounds);
        if placed.iter().any(|o| flush(&*o.field, &places, size)) {
            moved += 1.0;
            *face = outwards(face.clone(), moved * APART * size);
        }
        placed.push(face.clone());
    }
}

/// The same face with the solid reaching farther by `by` (mm).
pub(crate) fn outwards(face: Face, by: f64) -> Face {
    Face {
        field: Arc::new(Moved(face.field, by)),
        plane: face.plane.map(|p| crate::face::Plane {
            at: p.at + if p.below { by } else { -by },
            ..p
        }),
        ..face
    }
}

/// Places on a face within the bounds, and its unit normals there.
fn places(face: &dyn Field, bounds: &Aabb) -> Vec<(Vec3, Vec3)> {
    // The fractional parts of multiples of these fill a cube evenly: powers of the root of x⁴ = x + 1.
    const STEPS: Vec3 = [
        0.819_172_513_396_164,
        0.671_043_606_703_789,
        0.549_700_477_901_97,
    ];
    let size = bounds.size();
    let place = |i: usize| {
        core::array::from_fn(|a| bounds.min[a] + size[a] * (STEPS[a] * (i + 1) as f64).fract())
    };
    let mut points: Vec<Vec3> = (0..LOOKS).map(place).collect();
    let (mut values, mut gradients) = (vec![0.0; LOOKS], vec![[0.0; 3]; LOOKS]);
    for _ in 0..4 {
        face.gradients(&points, &mut values, &mut gradients);
        for i in 0..LOOKS {
            let square = dot(gradients[i], gradients[i]);
            if square > 0.0 {
                points[i] = add(points[i], scale(gradients[i], -values[i] / square));
            }
        }
    }
    face.gradients(&points, &mut values, &mut gradients);
    let tolerance = FLUSH * norm(size);
    (0..LOOKS)
        .filter(|&i| values[i].abs() <= tolerance && bounds.distance(points[i]) <= tolerance)
        .map(|i| (points[i], crate::math::unit(gradients[i])))
        .collect()
}

/// Whether another face runs along some of the places, on whichever side its solid is.
fn flush(other: &dyn Field, places: &[(Vec3, Vec3)], size: f64) -> bool {
    let points: Vec<Vec3> = places.iter().map(|p| p.0).collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    other.gradients(&points, &mut values, &mut gradients);
    // Faces that cross have a curve in common: no place lies on it but by chance.
    let along = |i: &usize| {
        let n = crate::math::unit(gradients[*i]);
        values[*i].abs() <= FLUSH * size && dot(n, places[*i].1).abs() > 1.0 - 1e-6
    };
    (0..points.len()).filter(along).count() > 1
}

/// A field less a number.
struct Moved(Arc<dyn Field>, f64);

impl Field for Moved {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        self.0.values(points, out);
        out.iter_mut().for_each(|v| *v -= self.1);
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        self.0.gradients(points, values, gradients);
        values.iter_mut().for_each(|v| *v -= self.1);
    }

    fn bound(&self, b: &Aabb) -> Interval {
        self.0.bound(b) - Interval::new(self.1, self.1)
    }

    fn fill(&self, block: &Block, out: &mut [f32]) {
        self.0.fill(block, out);
        out.iter_mut().for_each(|v| *v -= self.1 as f32);
    }
}
