//! Faces in exact rational form: biquadratic Bézier patches, trimmed by conics in space and in the parameter plane.
//!
//! A quadric is parametrised by projection from one of its own points ([`Stereographic`]). The inverse is a central
//! projection, which maps conics to conics: a rational quadratic curve in space stays one in (s, t). The pole lies off
//! the face. The annular faces of half-beams are cut in three or
//! more by meridian planes, in conics, and end at the end circle.

use core::f64::consts::TAU;

use geometry::math::{Vec3, add, apply, cross, dot, norm, scale, sub, unit};

use super::bezier::{Bezier, Path, curves, section_tangent};
use super::complex::{Complex, QuadricFace};
use super::hub::{HalfBeam, Hub};
use super::hub_quadric::Quadric;
use super::stereographic::{Stereographic, opposite_poles};

/// A trimming curve of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrimCurve {
    /// In space, relative to the hub's centre, mm.
    pub space: Bezier<3>,
    /// In (s, t): the same curve, with another parametrisation.
    pub flat: Bezier<2>,
    /// The arc of the hub that it is part of; `None` on end circles and meridian cuts.
    pub arc: Option<u32>,
}

/// A piece of a face in rational form.
#[derive(Clone, Debug, PartialEq)]
pub struct RationalPatch {
    /// Index of the face.
    pub face: u32,
    /// Its quadric, in the hub's frame.
    pub quadric: Quadric,
    /// The pole A.
    pub pole: Vec3,
    /// The point of the quadric with s = t = 0.
    pub origin: Vec3,
    /// Unit vectors along s and t, parallel to the tangent plane at the pole.
    pub axes: [Vec3; 2],
    /// Loops of trimming curves, the face on their left seen from outside.
    pub trims: Vec<Vec<TrimCurve>>,
}

/// A boundary curve in space, and its arc.
type BoundaryCurve = (Bezier<3>, Option<u32>);

impl RationalPatch {
    /// The parametrisation.
    fn chart(&self) -> Stereographic {
        Stereographic { quadric: self.quadric, pole: self.pole, origin: self.origin, axes: self.axes }
    }

    /// The point at (s, t).
    pub fn at(&self, at: [f64; 2]) -> Vec3 {
        self.chart().at(at)
    }

    /// (s, t) of a point of the quadric.
    pub fn parameters(&self, x: Vec3) -> [f64; 2] {
        self.chart().project(x).0
    }

    /// Ranges [min, max] of s and of t, over the control points of the trimming curves.
    pub fn range(&self) -> [[f64; 2]; 2] {
        let all = || self.trims.iter().flatten().flat_map(|t| t.flat.points);
        [0, 1].map(|a| {
            let least = all().map(|p| p[a]).fold(f64::INFINITY, f64::min);
            let most = all().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max);
            [least, most]
        })
    }

    /// Control points and weights of the biquadratic Bézier patch over its range, s first. Weights are those of the
    /// formula: at a corner of the range outside the face a weight may be negative.
    pub fn control_net(&self) -> ([[Vec3; 3]; 3], [[f64; 3]; 3]) {
        self.chart().net(self.range())
    }

    /// The patch with a given pole; `None` if a boundary curve meets the pole's tangent plane, where (s, t) are
    /// infinite.
    fn with_pole(
        face: u32,
        quadric: Quadric,
        pole: Vec3,
        origin: Vec3,
        boundary: &[Vec<BoundaryCurve>],
    ) -> Option<RationalPatch> {
        let chart = Stereographic::new(quadric, pole, origin);
        let mut patch = RationalPatch { face, quadric, pole, origin, axes: chart.axes, trims: Vec::new() };
        for boundary_loop in boundary {
            let mut loops = Vec::new();
            let mut todo: Vec<(BoundaryCurve, u32)> = boundary_loop.iter().rev().map(|s| (*s, 6)).collect();
            while let Some(((space, arc), depth)) = todo.pop() {
                let project = space.points.map(|p| chart.project(p));
                let [k, l, m] = [project[0].1, space.weight * project[1].1, project[2].1];
                if k.is_nan() || k < 1e-3 || m < 1e-3 {
                    return None;
                }
                let weight = l / (k * m).sqrt();
                if weight < 0.2 {
                    let [first, second] = space.halves();
                    todo.push(((second, arc), depth.checked_sub(1)?));
                    todo.push(((first, arc), depth.checked_sub(1)?));
                    continue;
                }
                let flat = Bezier { points: project.map(|s| s.0), weight };
                loops.push(TrimCurve { space, flat, arc });
            }
            patch.trims.push(loops);
        }
        Some(patch)
    }

    /// The patch of a simply connected piece of a face, with a pole across the hub or near there.
    fn with_opposite_pole(
        face: u32,
        quadric: Quadric,
        origin: Vec3,
        boundary: &[Vec<BoundaryCurve>],
    ) -> Option<RationalPatch> {
        opposite_poles(&quadric, origin)
            .find_map(|pole| RationalPatch::with_pole(face, quadric, pole, origin, boundary))
    }
}

impl Complex {
    /// The exact rational patches of a hub's faces, and the number of faces for which no pole was found.
    pub fn patches(&self, hub: &Hub) -> (Vec<RationalPatch>, usize) {
        let (mut out, mut left) = (Vec::new(), 0);
        for (i, face) in self.faces.iter().enumerate() {
            match self.face_patches(hub, i as u32, face) {
                Some(made) => out.extend(made),
                None => left += 1,
            }
        }
        (out, left)
    }

    fn face_patches(&self, hub: &Hub, number: u32, face: &QuadricFace) -> Option<Vec<RationalPatch>> {
        let q = face.quadric;
        if let Some(half_beam) = face.end_circle {
            let half_beam = &hub.half_beams[half_beam as usize];
            // A seam that turns back at one azimuth may not at another.
            let attempts = [3, 4, 6].into_iter().flat_map(|n| (0..5).map(move |k| (n, k)));
            return attempts.map(|(n, k)| (n, 0.737 + TAU / n as f64 * 0.2 * f64::from(k))).find_map(|(n, first)| {
                sectors(self, face, half_beam, n, first)?
                    .into_iter()
                    .map(|(origin, boundary)| RationalPatch::with_opposite_pole(number, q, origin, &[boundary]))
                    .collect()
            });
        }
        let boundary: Vec<Vec<BoundaryCurve>> =
            face.loops.iter().map(|l| l.iter().flat_map(|w| self.boundary_curves(*w, None)).collect()).collect();
        if face.label == 0 {
            // The pole of the ball is on the axis of a half-beam; a hub without beams is cut in halves.
            let Some(s) = hub.half_beams.first() else {
                let r = hub.radius;
                let half = |z: f64| {
                    let (n, from) = ([0.0, 0.0, z], [r, 0.0, 0.0]);
                    let end_circle = Path::new(&q, n, from, section_tangent(&q, n, from))?.ended_at(None)?;
                    let boundary = end_circle.curves().into_iter().map(|c| (c, None)).collect();
                    RationalPatch::with_pole(number, q, [0.0, 0.0, -z * r], [0.0, 0.0, z * r], &[boundary])
                };
                return [1.0, -1.0].into_iter().map(half).collect();
            };
            let pole = scale(s.axis, hub.radius);
            let patch = RationalPatch::with_pole(number, q, pole, scale(pole, -1.0), &boundary)?;
            return Some(vec![patch]);
        }
        let middle = boundary.iter().flatten().fold([0.0; 3], |sum, (b, _)| {
            let [p, _, r] = b.points;
            add(sum, scale(unit(b.at(0.5)), norm(sub(p, r))))
        });
        let middle = unit(middle);
        let origin = scale(middle, q.ray_exit(middle));
        Some(vec![RationalPatch::with_opposite_pole(number, q, origin, &boundary)?])
    }

    /// An arc in its direction of traversal, or the part between two of its angles.
    fn boundary_curves(&self, (arc, forward): (u32, bool), part: Option<[f64; 2]>) -> Vec<BoundaryCurve> {
        let conic = &self.arcs[arc as usize].conic;
        let [from, to] = part.unwrap_or([0.0, conic.end]);
        let mut made = curves(conic, from, to);
        if !forward {
            made.reverse();
            made.iter_mut().for_each(|b| b.points.reverse());
        }
        made.into_iter().map(|b| (b, Some(arc))).collect()
    }
}

/// The face of a half-beam cut by meridian planes: a point in the middle of each sector, and its boundary. `None` if
/// the seam crosses a meridian plane backwards.
fn sectors(
    complex: &Complex,
    face: &QuadricFace,
    half_beam: &HalfBeam,
    count: usize,
    first: f64,
) -> Option<Vec<(Vec3, Vec<BoundaryCurve>)>> {
    let (q, axis) = (&face.quadric, half_beam.axis);
    let pole = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let side = unit(cross(axis, pole));
    let other = cross(axis, side);
    let azimuth = |k: usize| first + TAU * k as f64 / count as f64;
    let along = |a: f64| add(scale(side, a.cos()), scale(other, a.sin()));
    let perpendicular = |a: f64| cross(axis, along(a));
    // The pieces of the seam between cuts, each with the cut at its start.
    let mut pieces: Vec<(Option<usize>, Vec<BoundaryCurve>)> = Vec::new();
    for &(arc, forward) in face.loops.iter().flatten() {
        let conic = &complex.arcs[arc as usize].conic;
        let mut stops: Vec<(f64, usize)> = Vec::new();
        for k in 0..count {
            let m = perpendicular(azimuth(k));
            for t in conic.roots([dot(m, conic.v), dot(m, conic.e[0]), dot(m, conic.e[1])], false) {
                if t < conic.end && dot(conic.at(t), along(azimuth(k))) > 0.0 {
                    stops.push((t, k));
                }
            }
        }
        stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut ends: Vec<(f64, Option<usize>)> = vec![(0.0, None)];
        ends.extend(stops.into_iter().map(|(t, k)| (t, Some(k))));
        ends.push((conic.end, None));
        let mut parts: Vec<_> = ends
            .windows(2)
            .map(|w| {
                let start = if forward { w[0].1 } else { w[1].1 };
                let part = Some([w[0].0, w[1].0]);
                (start, complex.boundary_curves((arc, forward), part))
            })
            .collect();
        if !forward {
            parts.reverse();
        }
        pieces.extend(parts);
    }
    let first = pieces.iter().position(|p| p.0 == Some(0))?;
    pieces.rotate_left(first);
    let mut out: Vec<(Vec3, Vec<BoundaryCurve>)> = Vec::new();
    for (start, boundary) in pieces {
        if let Some(k) = start {
            // Seen from outside with the half-beam on its left, the seam has increasing azimuth.
            if k != out.len() {
                return None;
            }
            out.push(([0.0; 3], Vec::new()));
        }
        out.last_mut()?.1.extend(boundary);
    }
    if out.len() != count {
        return None;
    }
    let corners: Vec<Vec3> = out.iter().map(|o| o.1[0].0.points[0]).collect();
    let meridian = |k: usize| {
        let (from, m) = (corners[k % count], perpendicular(azimuth(k)));
        let direction = section_tangent(q, m, from);
        let up = if dot(direction, axis) > 0.0 { direction } else { scale(direction, -1.0) };
        let path = Path::new(q, m, from, up)?;
        let end = path.first_root(dot(axis, from) - half_beam.split, axis, false)?;
        path.ended_at(Some(end))
    };
    for k in 0..count {
        let (up, down) = (meridian(k + 1)?, meridian(k)?);
        let (from, n) = (up.at(1.0), scale(axis, -1.0));
        let back = Path::new(q, n, from, section_tangent(q, n, from))?;
        let m = perpendicular(azimuth(k));
        let end = back.first_root(dot(m, from), m, false)?;
        let end_circle = back.ended_at(Some(end))?;
        let mut down = down.curves();
        down.reverse();
        down.iter_mut().for_each(|b| b.points.reverse());
        let cuts = up.curves().into_iter().chain(end_circle.curves()).chain(down);
        out[k].1.extend(cuts.map(|c| (c, None)));
        let direction = along((azimuth(k) + azimuth(k + 1)) / 2.0);
        let height = (dot(corners[k], axis) + dot(corners[(k + 1) % count], axis)) / 4.0 + half_beam.split / 2.0;
        let rho = half_beam.radius_squared(height).max(0.0).sqrt();
        out[k].0 = add(scale(axis, height), scale(direction, rho));
    }
    Some(out)
}

/// The symmetric 4 × 4 matrix of a quadric about another origin, for homogeneous coordinates.
pub fn homogeneous_matrix(q: &Quadric, center: Vec3) -> [[f64; 4]; 4] {
    let mut out = [[0.0; 4]; 4];
    let mc = apply(&q.m, center);
    for i in 0..3 {
        out[i][..3].copy_from_slice(&q.m[i]);
        out[i][3] = q.b[i] - mc[i];
        out[3][i] = out[i][3];
    }
    out[3][3] = q.at(scale(center, -1.0));
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, random_star, six, star};
    use super::super::{Fillet, Quadors};
    use super::*;
    use crate::graph::Profile;

    /// Checks every patch of a hub; returns the numbers of patches and of faces left out.
    fn check(hub: &Hub, complex: &Complex) -> (usize, usize) {
        let (patches, left) = complex.patches(hub);
        let mut boundary_loop = vec![0; complex.arcs.len()];
        for p in &patches {
            let face = &complex.faces[p.face as usize];
            let (net, weights) = p.control_net();
            let range = p.range();
            for walked_loop in &p.trims {
                for (k, t) in walked_loop.iter().enumerate() {
                    let next = &walked_loop[(k + 1) % walked_loop.len()];
                    let size = hub.radius + norm(t.space.points[0]);
                    assert!(norm(sub(t.space.points[2], next.space.points[0])) < 1e-8 * size);
                    for fraction in [0.0, 0.21, 0.5, 0.84, 1.0] {
                        // The trimming curve lies on the face, in space and by its parameters.
                        let x = t.space.at(fraction);
                        assert!(p.quadric.at(x).abs() < 1e-9 * size * size, "{}", p.quadric.at(x));
                        let y = p.at(t.flat.at(fraction));
                        assert!(p.quadric.at(y).abs() < 1e-9 * size * size);
                        assert!(hub.value(y).abs() < 1e-8 * size * size, "{}", hub.value(y));
                        let there = p.parameters(x);
                        assert!(norm(sub(p.at(there), x)) < 1e-8 * size, "{x:?} {:?}", p.at(there));
                        // The control net gives the same point.
                        let at = p.parameters(y);
                        let bernstein = |a: usize| {
                            let [lo, hi] = range[a];
                            let t = (at[a] - lo) / (hi - lo);
                            [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t]
                        };
                        let (bs, bt) = (bernstein(0), bernstein(1));
                        let (mut sum, mut weight) = ([0.0; 3], 0.0);
                        for i in 0..3 {
                            for j in 0..3 {
                                let w = bs[i] * bt[j] * weights[i][j];
                                sum = add(sum, scale(net[i][j], w));
                                weight += w;
                            }
                        }
                        let z = scale(sum, 1.0 / weight);
                        assert!(norm(sub(z, y)) < 1e-7 * size, "{z:?} {y:?}");
                    }
                    if let Some(a) = t.arc {
                        boundary_loop[a as usize] += 1;
                    }
                }
            }
            // Inside the boundary the point is on the quadric.
            let inner = p
                .trims
                .iter()
                .flatten()
                .fold([0.0; 2], |m, t| [m[0] + t.flat.points[0][0], m[1] + t.flat.points[0][1]]);
            let n = p.trims.iter().flatten().count() as f64;
            if face.label.count_ones() == 2 && p.trims[0].len() == 4 {
                let x = p.at(inner.map(|v| v / n));
                assert!(p.quadric.at(x).abs() < 1e-9 * (1.0 + dot(x, x)));
            }
        }
        if left == 0 {
            assert!(boundary_loop.iter().all(|w| *w >= 2), "each arc is traversed from both sides: {boundary_loop:?}");
        }
        (patches.len(), left)
    }

    #[test]
    fn patches_are_the_faces_and_their_sides_the_arcs() {
        let mut random = Random(71);
        let (mut made, mut left) = (0, 0);
        for n in 0..=12 {
            for fillet in [Fillet::Auto, Fillet::Tau(0.7), Fillet::None] {
                let graph = if n == 0 { star(1.0, &[], |_| Profile::Cone) } else { random_star(&mut random, n) };
                let q = Quadors::new(&graph, fillet).expect("a star");
                for i in 0..q.len() {
                    if q.overlaps().iter().any(|o| o.hub == i) {
                        continue;
                    }
                    let Ok(complex) = q.complex(i) else { continue };
                    let (m, l) = check(&q.hub(i), &complex);
                    made += m;
                    left += l;
                }
            }
        }
        let ends: Vec<_> = six().into_iter().map(|u| (u, 10.0, 1.0)).collect();
        let q = Quadors::new(&star(1.0, &ends, |_| Profile::Cylinder), Fillet::Tau(0.7)).expect("a star");
        let complex = q.complex(0).expect("a hub");
        // Six half-beam faces in thirds, twelve fillets, eight corners.
        assert_eq!(check(&q.hub(0), &complex), (38, 0));
        assert!(made > 1000 && left == 0, "{made} patches, {left} faces left out");
    }

    #[test]
    fn the_matrix_is_the_quadric_elsewhere() {
        let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.1, -0.2, 0.3], c: -1.0 };
        q.add_square(-0.7, &super::super::affine_function::AffineFunction { a: [1.0, 2.0, -0.5], b: 0.3 });
        let (center, x) = ([3.0, -1.0, 2.0], [0.3, 0.8, -0.4]);
        let m = homogeneous_matrix(&q, center);
        let y = add(center, x);
        let h = [y[0], y[1], y[2], 1.0];
        let value: f64 = (0..4).map(|i| (0..4).map(|j| h[i] * m[i][j] * h[j]).sum::<f64>()).sum();
        assert!((value - q.at(x)).abs() < 1e-12);
    }
}
