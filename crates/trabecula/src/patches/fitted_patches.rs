//! Cubic curves and bicubic patches on implicit surfaces, by damped least squares (Levenberg 1944).
//!
//! At its ends a curve is tangent to the surface, so that all patches around a vertex have its normal there. Free are the lengths
//! of the end tangents and, off the planes of the box, their directions in the tangent planes; what is made small is the
//! distance to the surface. Of a patch the four inner control points are free; made small are the distances to the surface
//! inside and, along sides, the angles between its tangent planes and the surface's: two patches that have the surface's
//! tangent planes along their common side have each other's.

use geometry::dense::{factorise, substitute};
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};

use super::bezier::{BicubicPatch, Curve, basis, coons, on_side, slopes, sum};
use crate::field::Field;

/// Parameters at which curves are fitted.
const ON_CURVE: [f64; 5] = [0.14, 0.32, 0.5, 0.68, 0.86];
/// Parameters along a side at which normals are fitted.
pub const ON_SIDE: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Parameters within a patch at which distances are fitted, along both directions.
const IN_PATCH: [f64; 4] = [0.14, 0.38, 0.62, 0.86];
/// Length, in parts of a side, by which an angle counts as a distance.
const LEVER: f64 = 0.2;
/// Rounds of least squares.
const ROUNDS: usize = 4;
/// Share of the mean diagonal that damps a step.
const DAMPING: f64 = 1e-3;

/// A least-squares problem in N numbers, as its normal equations.
struct Normal<const N: usize> {
    matrix: [[f64; N]; N],
    right: [f64; N],
}

impl<const N: usize> Normal<N> {
    fn new() -> Self {
        Normal { matrix: [[0.0; N]; N], right: [0.0; N] }
    }

    /// Adds a residual with its derivatives.
    fn add(&mut self, residual: f64, slope: &[f64; N]) {
        for i in 0..N {
            self.right[i] -= slope[i] * residual;
            for j in 0..=i {
                self.matrix[i][j] += slope[i] * slope[j];
            }
        }
    }

    /// The step, damped.
    fn step(mut self) -> [f64; N] {
        let mean = (0..N).map(|i| self.matrix[i][i]).sum::<f64>() / N as f64;
        let damping = DAMPING * mean + f64::MIN_POSITIVE;
        for i in 0..N {
            self.matrix[i][i] += damping;
        }
        if factorise(&mut self.matrix, |_, rest| Some(rest.max(f64::MIN_POSITIVE).sqrt())).is_some() {
            substitute(&self.matrix, &mut self.right);
        }
        self.right
    }
}

/// Signed distances, to first order, and unit normals at points.
pub fn distances<const N: usize>(field: &dyn Field, points: &[Vec3; N]) -> ([f64; N], [Vec3; N]) {
    let (mut v, mut g) = ([0.0; N], [[0.0; 3]; N]);
    field.gradients(points, &mut v, &mut g);
    for (v, g) in v.iter_mut().zip(&mut g) {
        let length = norm(*g).max(f64::MIN_POSITIVE);
        (*v, *g) = (*v / length, scale(*g, 1.0 / length));
    }
    (v, g)
}

/// A curve on a surface between two points with unit normals; in the plane normal to an axis if one is given.
pub fn curve(field: &dyn Field, ends: [Vec3; 2], normals: [Vec3; 2], plane: Option<usize>) -> Curve {
    let chord = sub(ends[1], ends[0]);
    let length = norm(chord);
    // For each end the directions in which its control point may move: along the curve, and across it.
    let along = normals.map(|n| {
        let t = match plane {
            Some(axis) => {
                let t = cross(core::array::from_fn(|a| if a == axis { 1.0 } else { 0.0 }), n);
                scale(t, dot(t, chord).signum())
            }
            None => sub(chord, scale(n, dot(chord, n))),
        };
        scale(t, 1.0 / norm(t).max(f64::MIN_POSITIVE))
    });
    let across: [Vec3; 2] =
        core::array::from_fn(|k| if plane.is_some() { [0.0; 3] } else { cross(normals[k], along[k]) });
    let mut c: Curve = [ends[0], [0.0; 3], [0.0; 3], ends[1]];
    let mut by = [length / 3.0, 0.0, length / 3.0, 0.0];
    let place = |by: &[f64; 4], c: &mut Curve| {
        c[1] = add(ends[0], add(scale(along[0], by[0]), scale(across[0], by[1])));
        c[2] = sub(ends[1], add(scale(along[1], by[2]), scale(across[1], by[3])));
    };
    place(&by, &mut c);
    for _ in 0..ROUNDS {
        let (off, normal) = distances(field, &ON_CURVE.map(|t| sum(&c, basis(t))));
        let mut equations = Normal::<4>::new();
        for ((t, off), n) in ON_CURVE.iter().zip(off).zip(normal) {
            let b = basis(*t);
            equations.add(
                off,
                &[
                    b[1] * dot(n, along[0]),
                    b[1] * dot(n, across[0]),
                    -b[2] * dot(n, along[1]),
                    -b[2] * dot(n, across[1]),
                ],
            );
        }
        let step = equations.step();
        by.iter_mut().zip(step).for_each(|(b, s)| *b += s.clamp(-0.1 * length, 0.1 * length));
        for k in [0, 2] {
            by[k] = by[k].clamp(0.15 * length, 0.7 * length);
            by[k + 1] = by[k + 1].clamp(-0.2 * length, 0.2 * length);
        }
        place(&by, &mut c);
    }
    c
}

/// The inner control points, and for each the number of its first unknown.
const INNER: [[usize; 2]; 4] = [[1, 1], [1, 2], [2, 1], [2, 2]];

/// A patch on a surface with these sides, in order. `normals` are the surface's along each side, at `ON_SIDE`; a side in a
/// plane of the box has none.
pub fn patch(field: &dyn Field, sides: &[Curve; 4], normals: &[Option<[Vec3; 4]>; 4]) -> BicubicPatch {
    let mut p = coons(sides);
    let size = sides.iter().map(|c| norm(sub(c[3], c[0]))).sum::<f64>() / 4.0;
    let inside: [[f64; 2]; 16] = core::array::from_fn(|k| [IN_PATCH[k % 4], IN_PATCH[k / 4]]);
    for _ in 0..ROUNDS {
        let mut equations = Normal::<12>::new();
        let at = inside.map(|[u, v]| sum(&p.map(|row| sum(&row, basis(v))), basis(u)));
        let (off, normal) = distances(field, &at);
        for ((uv, off), n) in inside.iter().zip(off).zip(normal) {
            let (bu, bv) = (basis(uv[0]), basis(uv[1]));
            let mut slope = [0.0; 12];
            for (k, [i, j]) in INNER.iter().enumerate() {
                (0..3).for_each(|a| slope[3 * k + a] = bu[*i] * bv[*j] * n[a]);
            }
            equations.add(off, &slope);
        }
        for (side, normals) in normals.iter().enumerate() {
            let Some(normals) = normals else { continue };
            for (t, n) in ON_SIDE.iter().zip(normals) {
                let [u, v] = on_side(side, *t);
                let across_v = side % 2 == 0;
                let weights = |i: usize, j: usize| match across_v {
                    true => basis(u)[i] * slopes(v)[j],
                    false => slopes(u)[i] * basis(v)[j],
                };
                let mut d = [0.0; 3];
                (0..16).for_each(|k| d = add(d, scale(p[k / 4][k % 4], weights(k / 4, k % 4))));
                let factor = LEVER * size / norm(d).max(f64::MIN_POSITIVE);
                let mut slope = [0.0; 12];
                for (k, [i, j]) in INNER.iter().enumerate() {
                    (0..3).for_each(|a| slope[3 * k + a] = factor * weights(*i, *j) * n[a]);
                }
                equations.add(factor * dot(d, *n), &slope);
            }
        }
        let step = equations.step();
        for (k, [i, j]) in INNER.iter().enumerate() {
            let mut by = [step[3 * k], step[3 * k + 1], step[3 * k + 2]];
            by = scale(by, (0.1 * size / norm(by).max(f64::MIN_POSITIVE)).min(1.0));
            p[*i][*j] = add(p[*i][*j], by);
        }
    }
    p
}
