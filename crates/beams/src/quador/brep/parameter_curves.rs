//! Curves of edges in the parameter planes of surfaces, with the same parameter as in space.
//!
//! On rational patches and planes they are rational quadratic and exact, and on meridians they are segments. Other curves on cylinders,
//! cones, spheres and surfaces of revolution are not rational: polynomials interpolate them at Chebyshev points, nearly
//! to rounding.

use core::f64::consts::{PI, TAU};
use std::collections::HashMap;
use std::sync::OnceLock;

use geometry::dense::solve;
use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};

use super::super::bezier::Bezier;
use super::{Brep, BrepFace, Surface};

/// A Bézier curve in a parameter plane, over [0, 1]. Rational patches have parameters in [0, 1].
#[derive(Clone, Debug)]
pub(crate) struct ParameterCurve {
    /// Control points.
    pub points: Vec<[f64; 2]>,
    /// Their weights, if it is rational.
    pub weights: Option<Vec<f64>>,
}

/// Degrees that are tried, in order.
const DEGREES: [usize; 6] = [3, 6, 9, 12, 16, 20];
/// Deviation from the edge at which no higher degree is tried, in distances from the hub's centre.
const DEVIATION: f64 = 1e-11;
/// Deviation that is accepted: far below the accuracy of 1e-7 mm that files declare.
const MAX_DEVIATION: f64 = 3e-10;
/// How often an edge is halved to reach it.
const HALVINGS: u32 = 3;
/// Number of points at which the deviation is measured.
const SAMPLES: usize = 24;

/// What a curve in a parameter plane depends on.
pub(crate) type CurveKey = [u64; 27];

impl Brep<'_> {
    /// What the curve of an edge in the parameter plane of a face depends on: equal hubs have the same to the last bit.
    pub(crate) fn curve_key(&self, face: &BrepFace, edge: u32) -> CurveKey {
        let Bezier { points, weight } = self.curve((edge, true), &face.frame);
        let mut key = [0.0; 27];
        let mut put = key.iter_mut();
        let mut add = |numbers: &[f64]| put.by_ref().zip(numbers).for_each(|(to, v)| *to = *v);
        points.iter().for_each(|p| add(p));
        add(&[weight]);
        match face.surface {
            Surface::Cylinder { axis, side, radius } => [&axis[..], &side, &[1.0, radius]].into_iter().for_each(add),
            Surface::Cone { axis, side, radius, half_angle } => {
                [&axis[..], &side, &[2.0, radius, half_angle]].into_iter().for_each(add);
            }
            Surface::Sphere { axis, side, radius } => [&axis[..], &side, &[3.0, radius]].into_iter().for_each(add),
            Surface::Revolution { axis, meridian: Bezier { points: [p, q, r], weight }, .. } => {
                [&axis[..], &p, &q, &r, &[4.0, weight]].into_iter().for_each(add);
            }
            Surface::Rational { chart, range: [s, t] } => {
                [&chart.pole[..], &chart.origin, &chart.axes[0], &chart.axes[1], &s, &t, &[5.0]]
                    .into_iter()
                    .for_each(add);
            }
            Surface::Plane { origin, axes: [u, v] } => [&origin[..], &u, &v, &[6.0]].into_iter().for_each(add),
        }
        key.map(f64::to_bits)
    }

    /// The curve of an edge in the parameter plane of a face.
    pub(crate) fn parameter_curve(&self, face: &BrepFace, edge: u32) -> ParameterCurve {
        self.fitted(face, edge).0
    }

    /// The same, and its deviation from the edge relative to the distance from the hub's centre.
    fn fitted(&self, face: &BrepFace, edge: u32) -> (ParameterCurve, f64) {
        let curve = self.curve((edge, true), &face.frame);
        if let Surface::Rational { chart, range } = face.surface {
            let projected = curve.points.map(|p| chart.project(p));
            let scaled = |p: [f64; 2]| [0, 1].map(|a| (p[a] - range[a][0]) / (range[a][1] - range[a][0]));
            let [k, l, m] = projected.map(|p| p.1);
            let points = projected.iter().map(|p| scaled(p.0)).collect();
            return (ParameterCurve { points, weights: Some(vec![k, curve.weight * l, m]) }, 0.0);
        }
        if let Surface::Plane { .. } = face.surface {
            let Bezier { points, weight } = face.surface.flattened(&curve);
            return (ParameterCurve { points: points.to_vec(), weights: Some(vec![1.0, weight, 1.0]) }, 0.0);
        }
        let off = |made: &ParameterCurve| {
            let deviation = (0..SAMPLES).map(|k| {
                let t = (k as f64 + 0.5) / SAMPLES as f64;
                let x = curve.at(t);
                norm(sub(face.surface.at(made.at(t)), x)) / norm(x)
            });
            deviation.fold(0.0, f64::max)
        };
        let mut made = along_meridian(&face.surface, &curve);
        let mut deviation = off(&made);
        for degree in DEGREES {
            if deviation < DEVIATION {
                break;
            }
            made = ParameterCurve { points: interpolated(&face.surface, &curve, degree), weights: None };
            deviation = off(&made);
        }
        (made, deviation)
    }

    /// Halves edges whose curve in a parameter plane is no polynomial of limited degree.
    pub(super) fn divide_edges(&mut self) {
        let mut known: HashMap<CurveKey, bool> = HashMap::new();
        for _ in 0..HALVINGS {
            let mut long: Vec<u32> = Vec::new();
            for face in self.faces.iter().filter(|f| !matches!(f.surface, Surface::Rational { .. })) {
                for (edge, _) in self.loops(face).into_iter().flatten() {
                    let key = self.curve_key(face, edge);
                    if *known.entry(key).or_insert_with(|| self.fitted(face, edge).1 > MAX_DEVIATION) {
                        long.push(edge);
                    }
                }
            }
            long.sort_unstable();
            long.dedup();
            long.iter().for_each(|edge| self.divide(*edge, 0.5));
            if long.is_empty() {
                return;
            }
        }
    }
}

impl ParameterCurve {
    /// The point of the parameter plane at t.
    pub(super) fn at(&self, t: f64) -> [f64; 2] {
        let (mut sum, mut weight) = ([0.0; 2], 0.0);
        for (k, (b, p)) in bernstein(self.points.len() - 1, t).zip(&self.points).enumerate() {
            let w = b * self.weights.as_ref().map_or(1.0, |w| w[k]);
            sum = [sum[0] + w * p[0], sum[1] + w * p[1]];
            weight += w;
        }
        sum.map(|v| v / weight)
    }
}

/// The segment between the parameters of a curve's ends, with its middle at that of the curve. Two rational parametrisations
/// of a conic arc differ by such a function: it is exact on meridians.
fn along_meridian(surface: &Surface, curve: &Bezier<3>) -> ParameterCurve {
    let [p, q, r] = [0.0, 0.5, 1.0].map(|t| surface.parameters(curve.at(t)));
    let ratio = (q[1] - p[1]) / (r[1] - q[1]);
    let weights = (ratio > 0.0 && ratio != 1.0 && ratio.is_finite()).then(|| vec![1.0, ratio]);
    ParameterCurve { points: vec![p, r], weights }
}

impl Surface {
    /// A curve in a plane, in its parameters.
    pub(super) fn flattened(&self, curve: &Bezier<3>) -> Bezier<2> {
        Bezier { points: curve.points.map(|p| self.parameters(p)), weight: curve.weight }
    }

    /// The point at (u, v).
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> Vec3 {
        let around = |axis: Vec3, side: Vec3, rho: f64, z: f64| {
            let (sin, cos) = u.sin_cos();
            let radial = add(scale(side, cos), scale(cross(axis, side), sin));
            add(scale(axis, z), scale(radial, rho))
        };
        match *self {
            Surface::Cylinder { axis, side, radius } => around(axis, side, radius, v),
            Surface::Cone { axis, side, radius, half_angle } => around(axis, side, radius + v * half_angle.tan(), v),
            Surface::Sphere { axis, side, radius } => around(axis, side, radius * v.cos(), radius * v.sin()),
            Surface::Revolution { axis, side, meridian } => {
                let x = meridian.at(v);
                around(axis, side, dot(x, side), dot(x, axis))
            }
            Surface::Rational { chart, .. } => chart.at([u, v]),
            Surface::Plane { origin, axes } => add(origin, add(scale(axes[0], u), scale(axes[1], v))),
        }
    }

    /// (u, v) of a point; angles u about an axis are in [0, 2π).
    pub(super) fn parameters(&self, x: Vec3) -> [f64; 2] {
        let (axis, side) = match *self {
            Surface::Cylinder { axis, side, .. }
            | Surface::Cone { axis, side, .. }
            | Surface::Sphere { axis, side, .. }
            | Surface::Revolution { axis, side, .. } => (axis, side),
            Surface::Rational { chart, .. } => return chart.project(x).0,
            Surface::Plane { origin, axes } => return axes.map(|a| dot(sub(x, origin), a)),
        };
        let z = dot(x, axis);
        let [a, b] = [dot(x, side), dot(x, cross(axis, side))];
        let u = b.atan2(a);
        let v = match *self {
            Surface::Sphere { .. } => z.atan2(a.hypot(b)),
            Surface::Revolution { meridian, .. } => {
                // z (t) = z with t = y/(1 + y).
                let [p, q, r] = meridian.points.map(|p| dot(p, axis) - z);
                let q = meridian.weight * q;
                let s = -(q + (q * q - p * r).max(0.0).sqrt().copysign(q));
                // z increases: p ≤ 0 ≤ r, so that one root is in [0, 1].
                if q > 0.0 { p / (p + s) } else { s / (s + r) }
            }
            _ => z,
        };
        [if u < 0.0 { u + TAU } else { u }, v]
    }
}

/// Control points of the polynomial curve of a degree through the parameters of a curve at Chebyshev points.
fn interpolated(surface: &Surface, curve: &Bezier<3>, degree: usize) -> Vec<[f64; 2]> {
    let values: Vec<[f64; 2]> = nodes(degree).map(|t| surface.parameters(curve.at(t))).collect();
    let row = |row: &[f64]| [0, 1].map(|a| row.iter().zip(&values).map(|(m, v)| m * v[a]).sum());
    let mut points: Vec<[f64; 2]> = from_values(degree).chunks(degree + 1).map(row).collect();
    // The ends to the last bit.
    (points[0], points[degree]) = (values[0], values[degree]);
    points
}

/// The extreme points of a Chebyshev polynomial on [0, 1].
fn nodes(degree: usize) -> impl Iterator<Item = f64> {
    (0..=degree).map(move |k| (PI * k as f64 / (2.0 * degree as f64)).sin().powi(2))
}

/// The Bernstein polynomials of a degree at t.
fn bernstein(degree: usize, t: f64) -> impl Iterator<Item = f64> {
    let mut binomial = 1.0;
    (0..=degree).map(move |k| {
        let value = binomial * t.powi(k as i32) * (1.0 - t).powi((degree - k) as i32);
        binomial *= (degree - k) as f64 / (k + 1) as f64;
        value
    })
}

/// The matrix from values at the nodes to control points, row by row: the inverse of the Bernstein polynomials there.
fn from_values(degree: usize) -> &'static [f64] {
    static KNOWN: [OnceLock<Vec<f64>>; DEGREES.len()] = [const { OnceLock::new() }; DEGREES.len()];
    let index = DEGREES.iter().position(|d| *d == degree).unwrap_or(0);
    KNOWN[index].get_or_init(|| {
        let n = degree + 1;
        let unit = |row: usize| (0..n).map(move |k| if k == row { 1.0 } else { 0.0 });
        let mut rows: Vec<Vec<f64>> =
            nodes(degree).enumerate().map(|(k, t)| bernstein(degree, t).chain(unit(k)).collect()).collect();
        // The polynomials are independent.
        _ = solve(&mut rows, 0.0);
        rows.into_iter().flat_map(|row| row.into_iter().skip(n)).collect()
    })
}
