//! Faces kept apart from those that they would coincide with.
//!
//! Where two faces are one surface over some area, their order there is a matter of rounding, and no mesh that is cut by
//! both is sound. Within a body, faces that are one function are made one face. Any other face that runs along an earlier
//! one is moved by far less than any grid step and far more than single precision can tell: so that there is more solid
//! where either may be solid, and less where both must. What meets face to face then overlaps, what is taken away flush
//! with a face goes through it. In the same way a body that is added to a solid reaches a little farther where it is flush
//! with what is there already.

use std::sync::Arc;

use crate::face::{Body, Face, Sign};
use crate::field::{Block, Field};
use geometry::math::{Aabb, Interval, Vec3, add, dot, norm, scale};

/// How far a face that is flush is moved, as a share of the region's size.
const APART: f64 = 1e-5;
/// Faces are flush where they are this close, as a share of the size.
const FLUSH: f64 = 1e-8;
/// Places on each face at which it is looked at: what coincides on less than some thousandths of a face is not seen.
const LOOKS: usize = 1024;

/// The body with its faces that are flush with one of `others` moved outwards, and those that are flush with each other
/// kept apart. `bounds` are those of the region. `moved` counts: no two faces move by the same.
pub(crate) fn apart(body: &mut Body, others: &[Face], bounds: &Aabb, moved: &mut usize) {
    parted(body, bounds, moved);
    let size = norm(bounds.size());
    for face in &mut body.faces {
        let places = places(&*face.field, bounds);
        if others.iter().any(|o| flush(&*o.field, &places, size).is_some()) {
            *moved += 1;
            *face = outwards(face.clone(), *moved as f64 * APART * size);
            face.flush = true;
        }
    }
}

/// The body with its faces kept apart from each other.
pub(crate) fn parted(body: &mut Body, bounds: &Aabb, moved: &mut usize) {
    let (given, size) = (body.faces.clone(), norm(bounds.size()));
    if given.len() < 2 || !bounds.is_finite() {
        return;
    }
    let places: Vec<_> = given.iter().map(|f| places(&*f.field, bounds)).collect();
    // A face that is now another one.
    let mut same: Vec<usize> = (0..given.len()).collect();
    let mut is_moved = vec![false; given.len()];
    for j in 1..given.len() {
        let mut along = (0..j).filter_map(|i| Some((i, meets(&given, &places, [i, j], size)?)));
        let Some(first) = along.next() else { continue };
        let all: Vec<(usize, Along)> = std::iter::once(first).chain(along).collect();
        let one = |a: &&(usize, Along)| a.1 == Along::One && !is_moved[a.0];
        if let (Some((i, _)), true) = (all.iter().find(one), all.iter().all(|a| a.1 != Along::Against)) {
            same[j] = same[*i];
            continue;
        }
        // What faces it decides, for there is a wall or a gap without thickness.
        let (i, _) = *all.iter().find(|a| a.1 == Along::Against).unwrap_or(&all[0]);
        *moved += 1;
        is_moved[j] = true;
        let way = if body.tree.both_must([i, j]) { -1.0 } else { 1.0 };
        body.faces[j] = outwards(given[j].clone(), way * *moved as f64 * APART * size);
        body.faces[j].flush = true;
    }
    // Faces that are others leave the list.
    let mut number = vec![0; given.len()];
    let mut kept = Vec::new();
    for (j, face) in body.faces.drain(..).enumerate() {
        number[j] = kept.len();
        if same[j] == j {
            kept.push(face);
        } else {
            number[j] = number[same[j]];
        }
    }
    body.faces = kept;
    body.tree = body.tree.given(&|f| Sign::Varies(number[f]));
}

/// How two faces run along each other.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Along {
    /// They are one function.
    One,
    /// On a part of them, with the solid on the same side.
    Partly,
    /// With the solid on opposite sides.
    Against,
}

fn meets(faces: &[Face], places: &[Vec<(Vec3, Vec3)>], [i, j]: [usize; 2], size: f64) -> Option<Along> {
    let (f, g) = (&faces[i], &faces[j]);
    if let (Some(p), Some(q)) = (f.plane, g.plane) {
        let here = p.axis == q.axis && (p.at - q.at).abs() <= FLUSH * size;
        return here.then_some(match (p.below == q.below, p.at == q.at) {
            (true, true) => Along::One,
            (true, false) => Along::Partly,
            (false, _) => Along::Against,
        });
    }
    // Of a face that ends, such as that of a mesh, the other one's places may lie beyond.
    let alike = flush(&*f.field, &places[j], size).or_else(|| flush(&*g.field, &places[i], size))?;
    if !alike {
        return Some(Along::Against);
    }
    let points: Vec<Vec3> = places[i].iter().chain(&places[j]).map(|p| p.0).collect();
    let (mut a, mut b) = (vec![0.0; points.len()], vec![0.0; points.len()]);
    let mut everywhere = true;
    // On both of them, and off them.
    for by in [0.0, 0.01 * size] {
        let moved: Vec<Vec3> = points.iter().map(|p| add(*p, [by, -by, by])).collect();
        f.field.values(&moved, &mut a);
        g.field.values(&moved, &mut b);
        everywhere &= a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= FLUSH * size);
    }
    Some(if everywhere { Along::One } else { Along::Partly })
}

/// The same face with the solid reaching farther by `by` (mm).
pub(crate) fn outwards(face: Face, by: f64) -> Face {
    Face {
        field: Arc::new(Moved(face.field, by)),
        plane: face.plane.map(|p| crate::face::Plane { at: p.at + if p.below { by } else { -by }, ..p }),
        ..face
    }
}

/// Places on a face within the bounds, and its unit normals there.
fn places(face: &dyn Field, bounds: &Aabb) -> Vec<(Vec3, Vec3)> {
    // The fractional parts of multiples of these fill a cube evenly: powers of the root of x⁴ = x + 1.
    const STEPS: Vec3 = [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_97];
    let size = bounds.size();
    let place = |i: usize| core::array::from_fn(|a| bounds.min[a] + size[a] * (STEPS[a] * (i + 1) as f64).fract());
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
        .map(|i| (points[i], geometry::math::unit(gradients[i])))
        .collect()
}

/// Whether another face runs along some of the places, and there with the solid on the same side.
fn flush(other: &dyn Field, places: &[(Vec3, Vec3)], size: f64) -> Option<bool> {
    let points: Vec<Vec3> = places.iter().map(|p| p.0).collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    other.gradients(&points, &mut values, &mut gradients);
    // Faces that cross have a curve in common: no place lies on it but by chance.
    let along = |i: usize| {
        let way = dot(geometry::math::unit(gradients[i]), places[i].1);
        (values[i].abs() <= FLUSH * size && way.abs() > 1.0 - 1e-6).then_some(way > 0.0)
    };
    let found: Vec<bool> = (0..points.len()).filter_map(along).collect();
    (found.len() > 1).then(|| found.iter().all(|alike| *alike))
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
