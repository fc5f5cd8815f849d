//! Faces in exact rational form: biquadratic patches, trimmed by conics in space and in their own parameters.
//!
//! A quadric is seen from one of its own points, the pole A: the line from A through a point B of the plane across from it meets
//! the quadric once more, in X = Q(B, B) A − 2 Q(A, B) B with Q the quadric's bilinear form on homogeneous places. With B linear in
//! (s, t) that is of degree two, so a biquadratic Bézier patch holds it exactly; for a sphere it is stereographic projection.
//! The way back is a central projection, which takes a conic on the quadric to a conic: a rational quadratic curve in
//! space stays one in (s, t). The pole lies off the face. The faces of stubs, which go all round, are cut in three or more by
//! meridians, which are conics too, and end at the rim.

use core::f64::consts::TAU;

use geometry::math::{Vec3, add, apply, cross, dot, inverse, norm, scale, sub, unit};

use super::bezier::{Bezier, Path, curves, onward};
use super::complex::{Complex, Face};
use super::hub::{Hub, Stub};
use super::quadric::Quadric;

/// A side of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// In space, about the hub's centre.
    pub space: Bezier<3>,
    /// In (s, t): the same curve, though not at the same speed.
    pub flat: Bezier<2>,
    /// The arc of the hub that it is part of; none on a rim and where a stub's face is cut.
    pub arc: Option<u32>,
}

/// A piece of a face in rational form.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// The face.
    pub face: u32,
    /// Its quadric, about the hub's centre.
    pub quadric: Quadric,
    /// The pole.
    pub pole: Vec3,
    /// Where s = t = 0 is, on the quadric.
    pub origin: Vec3,
    /// s and t, of length one, parallel to the tangents at the pole.
    pub axes: [Vec3; 2],
    /// Loops of sides, the face to the left of each, seen from outside.
    pub trims: Vec<Vec<Trim>>,
}

/// A side before its patch has a pole.
type Side = (Bezier<3>, Option<u32>);

impl Patch {
    /// The place of (s, t).
    pub fn at(&self, [s, t]: [f64; 2]) -> Vec3 {
        let b = add(self.origin, add(scale(self.axes[0], s), scale(self.axes[1], t)));
        let (bb, ab) = (self.quadric.at(b), 2.0 * self.polar());
        scale(sub(scale(self.pole, bb), scale(b, ab)), 1.0 / (bb - ab))
    }

    /// Q(A, B), the same for all B of the plane.
    fn polar(&self) -> f64 {
        let (q, a) = (&self.quadric, self.pole);
        dot(self.origin, q.half_slope(a)) + dot(q.b, a) + q.c
    }

    /// (s, t) of a place, and the weight that the projection gives it.
    fn seen(&self, x: Vec3) -> ([f64; 2], f64) {
        let n = self.quadric.half_slope(self.pole);
        let (way, far) = (sub(x, self.pole), dot(sub(self.origin, self.pole), n));
        let weight = dot(way, n) / far;
        let b = sub(add(self.pole, scale(way, 1.0 / weight)), self.origin);
        ([dot(b, self.axes[0]), dot(b, self.axes[1])], weight)
    }

    /// (s, t) of a place of the quadric.
    pub fn parameters(&self, x: Vec3) -> [f64; 2] {
        self.seen(x).0
    }

    /// The least and greatest s, and t, of its sides' control points.
    pub fn range(&self) -> [[f64; 2]; 2] {
        let all = || self.trims.iter().flatten().flat_map(|t| t.flat.points);
        [0, 1].map(|a| {
            let least = all().map(|p| p[a]).fold(f64::INFINITY, f64::min);
            let most = all().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max);
            [least, most]
        })
    }

    /// The control points and weights of the biquadratic Bézier patch over its range, s first. Weights are those of the formula: a
    /// corner of the range that the face does not reach may have one below zero.
    pub fn net(&self) -> ([[Vec3; 3]; 3], [[f64; 3]; 3]) {
        let (q, [u, v]) = (&self.quadric, self.axes);
        let h = q.half_slope(self.origin);
        let ab = 2.0 * self.polar();
        let [s, t] = self.range();
        // Polar forms of 1, s, s² at the pairs of ends that the control points stand for.
        let blossom = |[a, b]: [f64; 2]| [[1.0, a, a * a], [1.0, (a + b) / 2.0, a * b], [1.0, b, b * b]];
        let (ss, tt) = (blossom(s), blossom(t));
        let mut net = ([[[0.0; 3]; 3]; 3], [[0.0; 3]; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let (s, t) = (ss[i], tt[j]);
                let bb = q.at(self.origin)
                    + 2.0 * (s[1] * dot(h, u) + t[1] * dot(h, v))
                    + s[2] * q.form(u, u)
                    + 2.0 * s[1] * t[1] * q.form(u, v)
                    + t[2] * q.form(v, v);
                let b = add(self.origin, add(scale(u, s[1]), scale(v, t[1])));
                net.1[i][j] = bb - ab;
                net.0[i][j] = scale(sub(scale(self.pole, bb), scale(b, ab)), 1.0 / (bb - ab));
            }
        }
        net
    }

    /// A patch seen from a pole; `None` if a side runs through the pole's tangent plane, where (s, t) are infinite.
    fn seen_from(face: u32, quadric: Quadric, pole: Vec3, origin: Vec3, sides: &[Vec<Side>]) -> Option<Patch> {
        let n = quadric.half_slope(pole);
        let u = unit(cross(n, if n[0].abs() < 0.6 * norm(n) { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
        let mut patch = Patch { face, quadric, pole, origin, axes: [u, cross(unit(n), u)], trims: Vec::new() };
        for walked in sides {
            let mut loops = Vec::new();
            let mut todo: Vec<(Side, u32)> = walked.iter().rev().map(|s| (*s, 6)).collect();
            while let Some(((space, arc), depth)) = todo.pop() {
                let seen = space.points.map(|p| patch.seen(p));
                let [k, l, m] = [seen[0].1, space.weight * seen[1].1, seen[2].1];
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
                let flat = Bezier { points: seen.map(|s| s.0), weight };
                loops.push(Trim { space, flat, arc });
            }
            patch.trims.push(loops);
        }
        Some(patch)
    }

    /// The patch of a simply connected piece of a face, seen from across the hub or, failing that, from somewhere near there.
    fn across(face: u32, quadric: Quadric, origin: Vec3, sides: &[Vec<Side>]) -> Option<Patch> {
        let normal = unit(quadric.half_slope(origin));
        let u = unit(cross(normal, if normal[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }));
        let v = cross(normal, u);
        // Through the quadric's own middle, the hub's, and along the normal.
        let middle = scale(apply(&inverse(&quadric.m), quadric.b), -1.0);
        let normal = scale(normal, -1.0);
        let inward = [sub(middle, origin), unit(scale(origin, -1.0)), normal];
        let tilts = (0..8).flat_map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / 8.0).sin_cos();
            [0.3, 0.8, 2.0].map(|by| add(normal, scale(add(scale(u, cos), scale(v, sin)), by)))
        });
        inward.into_iter().chain(tilts).find_map(|way| {
            // The origin is on the quadric: the other root.
            let t = -2.0 * dot(quadric.half_slope(origin), way) / quadric.form(way, way);
            let pole = add(origin, scale(way, t));
            let far = t.is_finite() && norm(pole) < 1e6 * norm(origin);
            far.then(|| Patch::seen_from(face, quadric, pole, origin, sides))?
        })
    }
}

impl Complex {
    /// The exact rational patches of a hub's faces; faces of which no pole sees the whole are left out, and counted.
    pub fn patches(&self, hub: &Hub) -> (Vec<Patch>, usize) {
        let (mut out, mut left) = (Vec::new(), 0);
        for (i, face) in self.faces.iter().enumerate() {
            match self.of_face(hub, i as u32, face) {
                Some(made) => out.extend(made),
                None => left += 1,
            }
        }
        (out, left)
    }

    fn of_face(&self, hub: &Hub, number: u32, face: &Face) -> Option<Vec<Patch>> {
        let q = face.quadric;
        if let Some(stub) = face.rim {
            let stub = &hub.stubs[stub as usize];
            // Where a seam turns back at one azimuth it does not at another.
            let ways = [3, 4, 6].into_iter().flat_map(|n| (0..5).map(move |k| (n, k)));
            return ways.map(|(n, k)| (n, 0.737 + TAU / n as f64 * 0.2 * f64::from(k))).find_map(|(n, first)| {
                sectors(self, face, stub, n, first)?
                    .into_iter()
                    .map(|(origin, sides)| Patch::across(number, q, origin, &[sides]))
                    .collect()
            });
        }
        let sides: Vec<Vec<Side>> =
            face.loops.iter().map(|l| l.iter().flat_map(|w| self.sides(*w, None)).collect()).collect();
        if face.label == 0 {
            // A ball is seen from the middle of a stub; a lone one by halves.
            let Some(s) = hub.stubs.first() else {
                let r = hub.radius;
                let half = |z: f64| {
                    let (n, from) = ([0.0, 0.0, z], [r, 0.0, 0.0]);
                    let rim = Path::new(&q, n, from, onward(&q, n, from))?.until(None)?;
                    let sides = rim.curves().into_iter().map(|c| (c, None)).collect();
                    Patch::seen_from(number, q, [0.0, 0.0, -z * r], [0.0, 0.0, z * r], &[sides])
                };
                return [1.0, -1.0].into_iter().map(half).collect();
            };
            let pole = scale(s.axis, hub.radius);
            let patch = Patch::seen_from(number, q, pole, scale(pole, -1.0), &sides)?;
            return Some(vec![patch]);
        }
        let middle = sides.iter().flatten().fold([0.0; 3], |sum, (b, _)| {
            let [p, _, r] = b.points;
            add(sum, scale(unit(b.at(0.5)), norm(sub(p, r))))
        });
        let middle = unit(middle);
        let origin = scale(middle, q.exit(middle));
        Some(vec![Patch::across(number, q, origin, &sides)?])
    }

    /// An arc as it is walked, or the part of it between two of its angles.
    fn sides(&self, (arc, forward): (u32, bool), part: Option<[f64; 2]>) -> Vec<Side> {
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

/// A stub's face, cut by half-planes about its axis: a place in the middle of each sector, and its sides. `None` if the seam
/// turns back across one of them.
fn sectors(complex: &Complex, face: &Face, stub: &Stub, count: usize, first: f64) -> Option<Vec<(Vec3, Vec<Side>)>> {
    let (q, axis) = (&face.quadric, stub.axis);
    let pole = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let side = unit(cross(axis, pole));
    let other = cross(axis, side);
    let azimuth = |k: usize| first + TAU * k as f64 / count as f64;
    let along = |a: f64| add(scale(side, a.cos()), scale(other, a.sin()));
    let across = |a: f64| cross(axis, along(a));
    // The seam in pieces between the cuts, and the cut that each begins at.
    let mut pieces: Vec<(Option<usize>, Vec<Side>)> = Vec::new();
    for &(arc, forward) in face.loops.iter().flatten() {
        let conic = &complex.arcs[arc as usize].conic;
        let mut stops: Vec<(f64, usize)> = Vec::new();
        for k in 0..count {
            let m = across(azimuth(k));
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
                (start, complex.sides((arc, forward), part))
            })
            .collect();
        if !forward {
            parts.reverse();
        }
        pieces.extend(parts);
    }
    let first = pieces.iter().position(|p| p.0 == Some(0))?;
    pieces.rotate_left(first);
    let mut out: Vec<(Vec3, Vec<Side>)> = Vec::new();
    for (start, sides) in pieces {
        if let Some(k) = start {
            // Seen from outside, with the stub to its left, the seam goes round with growing azimuth.
            if k != out.len() {
                return None;
            }
            out.push(([0.0; 3], Vec::new()));
        }
        out.last_mut()?.1.extend(sides);
    }
    if out.len() != count {
        return None;
    }
    let corners: Vec<Vec3> = out.iter().map(|o| o.1[0].0.points[0]).collect();
    let meridian = |k: usize| {
        let (from, m) = (corners[k % count], across(azimuth(k)));
        let way = onward(q, m, from);
        let up = if dot(way, axis) > 0.0 { way } else { scale(way, -1.0) };
        let path = Path::new(q, m, from, up)?;
        let end = path.first(dot(axis, from) - stub.split, axis, false)?;
        path.until(Some(end))
    };
    for k in 0..count {
        let (up, down) = (meridian(k + 1)?, meridian(k)?);
        let (from, n) = (up.at(1.0), scale(axis, -1.0));
        let back = Path::new(q, n, from, onward(q, n, from))?;
        let m = across(azimuth(k));
        let end = back.first(dot(m, from), m, false)?;
        let rim = back.until(Some(end))?;
        let mut down = down.curves();
        down.reverse();
        down.iter_mut().for_each(|b| b.points.reverse());
        let cuts = up.curves().into_iter().chain(rim.curves()).chain(down);
        out[k].1.extend(cuts.map(|c| (c, None)));
        let way = along((azimuth(k) + azimuth(k + 1)) / 2.0);
        let height = (dot(corners[k], axis) + dot(corners[(k + 1) % count], axis)) / 4.0 + stub.split / 2.0;
        let rho = stub.squared(height).max(0.0).sqrt();
        out[k].0 = add(scale(axis, height), scale(way, rho));
    }
    Some(out)
}

/// The symmetric 4 × 4 matrix of a quadric about another origin: xᵀMx for homogeneous x.
pub fn matrix(q: &Quadric, center: Vec3) -> [[f64; 4]; 4] {
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

    /// What must hold of every patch of a hub; how many were left out.
    fn check(hub: &Hub, complex: &Complex) -> (usize, usize) {
        let (patches, left) = complex.patches(hub);
        let mut walked = vec![0; complex.arcs.len()];
        for p in &patches {
            let face = &complex.faces[p.face as usize];
            let (net, weights) = p.net();
            let range = p.range();
            for walked_loop in &p.trims {
                for (k, t) in walked_loop.iter().enumerate() {
                    let next = &walked_loop[(k + 1) % walked_loop.len()];
                    let size = hub.radius + norm(t.space.points[0]);
                    assert!(norm(sub(t.space.points[2], next.space.points[0])) < 1e-8 * size);
                    for share in [0.0, 0.21, 0.5, 0.84, 1.0] {
                        // The side lies on the face, in space and by its parameters.
                        let x = t.space.at(share);
                        assert!(p.quadric.at(x).abs() < 1e-9 * size * size, "{}", p.quadric.at(x));
                        let y = p.at(t.flat.at(share));
                        assert!(p.quadric.at(y).abs() < 1e-9 * size * size);
                        assert!(hub.value(y).abs() < 1e-8 * size * size, "{}", hub.value(y));
                        let there = p.parameters(x);
                        assert!(norm(sub(p.at(there), x)) < 1e-8 * size, "{x:?} {:?}", p.at(there));
                        // The net gives the same place.
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
                        walked[a as usize] += 1;
                    }
                }
            }
            // Inside the sides of a face the label is its own.
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
            assert!(walked.iter().all(|w| *w >= 2), "each arc is walked from both sides: {walked:?}");
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
        // Six stubs in thirds, twelve fillets, eight corners.
        assert_eq!(check(&q.hub(0), &complex), (38, 0));
        assert!(made > 1000 && left == 0, "{made} patches, {left} faces left out");
    }

    #[test]
    fn the_matrix_is_the_quadric_elsewhere() {
        let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.1, -0.2, 0.3], c: -1.0 };
        q.square(-0.7, &super::super::hub::Affine { a: [1.0, 2.0, -0.5], b: 0.3 });
        let (center, x) = ([3.0, -1.0, 2.0], [0.3, 0.8, -0.4]);
        let m = matrix(&q, center);
        let y = add(center, x);
        let h = [y[0], y[1], y[2], 1.0];
        let value: f64 = (0..4).map(|i| (0..4).map(|j| h[i] * m[i][j] * h[j]).sum::<f64>()).sum();
        assert!((value - q.at(x)).abs() < 1e-12);
    }
}
