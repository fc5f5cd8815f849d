//! Coincident surfaces are merged or separated before extraction.
//!
//! Where two implicit surfaces coincide over an area, rounding decides their order there, and a mesh cut by both is not
//! sound. Two surfaces of one solid that are the same function are merged. Any other surface that coincides with an earlier
//! one is perturbed: offset by far less than a grid step and far more than single precision resolves, so that unions gain
//! solid and intersections lose it. Solids that touch along a face then overlap, and a cut that ends on a face passes
//! through it. In the same way a solid added to another grows slightly where the two share a surface.

use crate::csg_tree::{CsgSolid, Sign};
use crate::field::Field;
use crate::implicit::Surface;
use geometry::math::{Aabb, Vec3, add, dot, norm, scale};
use geometry::random::low_discrepancy;

/// Offset of a perturbed surface, as a share of the region's size.
const OFFSET: f64 = 1e-5;
/// Surfaces coincide where their distance is at most this share of the region's size.
const TOLERANCE: f64 = 1e-8;
/// Sample points per surface. Coincidence on less than a few thousandths of a surface may be missed.
const SAMPLES: usize = 1024;

/// Separates the surfaces of `solid` from each other, and offsets outwards those that coincide with one of `others`.
/// `bounds` are those of the region. `count` is the number of surfaces perturbed so far: no two are offset equally.
pub(crate) fn separate_from(solid: &mut CsgSolid, others: &[Surface], bounds: &Aabb, count: &mut usize) {
    separate(solid, bounds, count);
    let size = norm(bounds.size());
    for surface in &mut solid.surfaces {
        let samples = samples(&*surface.field, bounds);
        if others.iter().any(|o| coincides(&*o.field, &samples, size).is_some()) {
            *count += 1;
            *surface = surface.clone().offset(*count as f64 * OFFSET * size);
            surface.perturbed = true;
        }
    }
}

/// Merges or separates surfaces of `solid` that coincide with each other.
pub(crate) fn separate(solid: &mut CsgSolid, bounds: &Aabb, count: &mut usize) {
    let (given, size) = (solid.surfaces.clone(), norm(bounds.size()));
    if given.len() < 2 || !bounds.is_finite() {
        return;
    }
    let samples: Vec<_> = given.iter().map(|f| samples(&*f.field, bounds)).collect();
    // The surface that each one is merged into.
    let mut same: Vec<usize> = (0..given.len()).collect();
    let mut perturbed = vec![false; given.len()];
    for j in 1..given.len() {
        let mut others = (0..j).filter_map(|i| Some((i, coincidence(&given, &samples, [i, j], size)?)));
        let Some(first) = others.next() else { continue };
        let all: Vec<(usize, Coincidence)> = std::iter::once(first).chain(others).collect();
        let one = |a: &&(usize, Coincidence)| a.1 == Coincidence::Identical && !perturbed[a.0];
        if let (Some((i, _)), true) = (all.iter().find(one), all.iter().all(|a| a.1 != Coincidence::Opposed)) {
            same[j] = same[*i];
            continue;
        }
        // An opposed surface takes precedence: between the two lies a wall or a gap without thickness.
        let (i, _) = *all.iter().find(|a| a.1 == Coincidence::Opposed).unwrap_or(&all[0]);
        *count += 1;
        perturbed[j] = true;
        let sign = if solid.tree.intersects([i, j]) { -1.0 } else { 1.0 };
        solid.surfaces[j] = given[j].clone().offset(sign * *count as f64 * OFFSET * size);
        solid.surfaces[j].perturbed = true;
    }
    // Merged surfaces leave the list.
    let mut number = vec![0; given.len()];
    let mut kept = Vec::new();
    for (j, surface) in solid.surfaces.drain(..).enumerate() {
        number[j] = kept.len();
        if same[j] == j {
            kept.push(surface);
        } else {
            number[j] = number[same[j]];
        }
    }
    solid.surfaces = kept;
    solid.tree = solid.tree.simplified(&|f| Sign::Varies(number[f]));
}

/// How two surfaces coincide.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Coincidence {
    /// They are the same function.
    Identical,
    /// Over some area, with the solid on the same side.
    Partial,
    /// Over some area, with the solid on opposite sides.
    Opposed,
}

fn coincidence(surfaces: &[Surface], samples: &[Vec<Sample>], [i, j]: [usize; 2], size: f64) -> Option<Coincidence> {
    let (f, g) = (&surfaces[i], &surfaces[j]);
    if let (Some(p), Some(q)) = (f.plane, g.plane) {
        let here = p.axis == q.axis && (p.at - q.at).abs() <= TOLERANCE * size;
        return here.then_some(match (p.below == q.below, p.at == q.at) {
            (true, true) => Coincidence::Identical,
            (true, false) => Coincidence::Partial,
            (false, _) => Coincidence::Opposed,
        });
    }
    // The samples of one may lie beyond the end of the other, such as that of a mesh: try both ways round.
    let same_side = coincides(&*f.field, &samples[j], size).or_else(|| coincides(&*g.field, &samples[i], size))?;
    if !same_side {
        return Some(Coincidence::Opposed);
    }
    let points: Vec<Vec3> = samples[i].iter().chain(&samples[j]).map(|p| p.0).collect();
    let (mut a, mut b) = (vec![0.0; points.len()], vec![0.0; points.len()]);
    let mut everywhere = true;
    // Compare values on both surfaces and at an offset from them.
    for by in [0.0, 0.01 * size] {
        let moved: Vec<Vec3> = points.iter().map(|p| add(*p, [by, -by, by])).collect();
        f.field.values(&moved, &mut a);
        g.field.values(&moved, &mut b);
        everywhere &= a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= TOLERANCE * size);
    }
    Some(if everywhere { Coincidence::Identical } else { Coincidence::Partial })
}

/// A point on a surface and the unit normal there.
type Sample = (Vec3, Vec3);

/// Sample points of a surface within the bounds.
fn samples(surface: &dyn Field, bounds: &Aabb) -> Vec<Sample> {
    let mut points: Vec<Vec3> = (0..SAMPLES).map(|i| bounds.at(low_discrepancy(i + 1))).collect();
    let (mut values, mut gradients) = (vec![0.0; SAMPLES], vec![[0.0; 3]; SAMPLES]);
    for _ in 0..4 {
        surface.gradients(&points, &mut values, &mut gradients);
        for i in 0..SAMPLES {
            let square = dot(gradients[i], gradients[i]);
            if square > 0.0 {
                points[i] = add(points[i], scale(gradients[i], -values[i] / square));
            }
        }
    }
    surface.gradients(&points, &mut values, &mut gradients);
    let tolerance = TOLERANCE * norm(bounds.size());
    (0..SAMPLES)
        .filter(|&i| values[i].abs() <= tolerance && bounds.distance(points[i]) <= tolerance)
        .map(|i| (points[i], geometry::math::unit(gradients[i])))
        .collect()
}

/// Whether another surface coincides with some of the samples, and if so whether the solid is on the same side at all of
/// them.
fn coincides(other: &dyn Field, samples: &[Sample], size: f64) -> Option<bool> {
    let points: Vec<Vec3> = samples.iter().map(|p| p.0).collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    other.gradients(&points, &mut values, &mut gradients);
    // Surfaces that merely cross share a curve, which a sample meets only by chance.
    let at = |i: usize| {
        let cosine = dot(geometry::math::unit(gradients[i]), samples[i].1);
        (values[i].abs() <= TOLERANCE * size && cosine.abs() > 1.0 - 1e-6).then_some(cosine > 0.0)
    };
    let found: Vec<bool> = (0..points.len()).filter_map(at).collect();
    (found.len() > 1).then(|| found.iter().all(|same| *same))
}
