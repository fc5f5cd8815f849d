//! Gaussian radial basis functions through control points.

use multiversion::multiversion;

use super::control_points::ControlPoints;
use super::{BuildGrade, Grade, Quantity, VaryingNumber, directed};
use crate::environment::Environment;
use crate::field::Field;
use crate::kind::{DesignError, Key, Kind};
use geometry::dense::{factorise, substitute};
use geometry::fault::{Fault, counted, number};
use geometry::math::{Aabb, Interval, Vec3, dot, exp, norm, scale, sub, unit};

/// Most control points: their equations are solved as they are.
pub const MOST: usize = 2000;
/// Condition number beyond which the weights of the functions have no correct digit to speak of.
const WORST: f64 = 1e12;
/// δ in mean distances between neighbours, unless given: the surface sags little between points, and the condition
/// number of points on a cubic grid stays near 10⁶.
const WIDTH: f64 = 1.5;

/// Gaussian radial basis functions through control points: the sum of β exp(−r²/δ²).
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Rbf", noun = "radial basis functions", check = RbfKind::complete)]
pub struct RbfKind {
    /// The control points.
    #[kind(flatten)]
    points: ControlPoints,
    /// The values taken at the points: 1 at all unless given here or as a fourth column of the file.
    values: Option<Vec<f64>>,
    /// δ; one and a half times the mean distance of a point from its nearest neighbour unless given.
    #[kind(unit = "mm", above = 0.0)]
    delta: Option<f64>,
    /// Direction of projection: each point becomes a line along it.
    axis: Option<[f64; 3]>,
}

impl RbfKind {
    fn complete(&self, _: &Key) -> Result<(), Fault> {
        if let (Some(values), ControlPoints::Points(points)) = (&self.values, &self.points)
            && values.len() != points.len()
        {
            let message =
                format!("{} for {}; give one for each", counted(values.len(), "value"), counted(points.len(), "point"));
            return Err(Fault::new("values", message));
        }
        directed("axis", self.axis)
    }
}

impl RbfKind {
    /// The functions.
    pub(crate) fn functions(&self, path: &str, environment: &Environment) -> Result<Rbf, DesignError> {
        let (points, column) = self.points.read(path, environment)?;
        let ones = || vec![1.0; points.len()];
        let values = self.values.clone().or(column).unwrap_or_else(ones);
        if values.len() != points.len() {
            let message =
                format!("{} for {}; give one for each", counted(values.len(), "value"), counted(points.len(), "point"));
            return Err(DesignError::new(format!("{path}.values"), message));
        }
        Rbf::new(points, &values, self.delta, self.axis).map_err(|f| self.points.fault(path, f))
    }
}

impl BuildGrade for RbfKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        of.function(Ok(self.functions(&of.path, of.environment)?))
    }
}

/// α(x) = Σ βᵢ exp(−|x − xᵢ|²/δ²) that takes given values at control points: equations 18 to 20 of the hybrid paper, with
/// the distance of vectors.
pub struct Rbf {
    points: Vec<Vec3>,
    beta: Vec<f64>,
    delta: f64,
    axis: Option<Vec3>,
    condition: f64,
}

impl Rbf {
    /// Through `values` at `points` (mm). With an axis all is projected along it. `delta` (mm) is one and a half times the mean
    /// distance of a point from its nearest neighbour unless given.
    ///
    /// # Errors
    /// No point or more than 2000, points that coincide, a δ that is not positive or so large that the equations are
    /// singular to working precision.
    pub fn new(points: Vec<Vec3>, values: &[f64], delta: Option<f64>, axis: Option<Vec3>) -> Result<Rbf, Fault> {
        let n = points.len();
        if n == 0 || n > MOST || values.len() != n {
            let message =
                format!("{n} points and {} values; give from 1 to {MOST} points with a value each", values.len());
            return Err(Fault::new("points", message));
        }
        let axis = axis.map(unit);
        let across = |p: Vec3| axis.map_or(p, |n| sub(p, scale(n, dot(n, p))));
        let points: Vec<Vec3> = points.into_iter().map(across).collect();
        let mut nearest = vec![(f64::INFINITY, 0); n];
        for i in 0..n {
            for j in 0..i {
                let d = norm(sub(points[i], points[j]));
                if d < nearest[i].0 {
                    nearest[i] = (d, j);
                }
                if d < nearest[j].0 {
                    nearest[j] = (d, i);
                }
            }
        }
        let size = (0..3).map(|a| {
            let x = points.iter().map(|p| p[a]);
            x.clone().fold(f64::NEG_INFINITY, f64::max) - x.fold(f64::INFINITY, f64::min)
        });
        let size = size.fold(0.0, f64::max);
        if let Some(i) = (0..n).find(|i| nearest[*i].0 <= 1e-9 * size) {
            let message = format!(
                "points {} and {} coincide{}: no function passes through both; leave one out",
                i.min(nearest[i].1),
                i.max(nearest[i].1),
                if axis.is_some() { " seen along the axis" } else { "" }
            );
            return Err(Fault::new("points", message));
        }
        let own = WIDTH * nearest.iter().map(|d| d.0).sum::<f64>() / n as f64;
        let delta = match delta {
            Some(d) if !(d > 0.0 && d.is_finite()) => {
                let message = format!("delta is {} mm; it must be a finite length greater than 0", number(d));
                return Err(Fault::new("delta", message));
            }
            Some(d) => d,
            None if n == 1 => {
                return Err(Fault::new("delta", "one point has no neighbour; give delta, mm"));
            }
            None => own,
        };
        let kernel = |a: Vec3, b: Vec3| exp(-dot(sub(a, b), sub(a, b)) / (delta * delta));
        let matrix: Vec<Vec<f64>> = points.iter().map(|a| points.iter().map(|b| kernel(*a, *b)).collect()).collect();
        let mut factor = matrix.clone();
        let root = |i: usize, rest: f64| (rest > f64::EPSILON * matrix[i][i]).then(|| rest.sqrt());
        let condition = factorise(&mut factor, root).map_or(f64::INFINITY, |()| condition(&matrix, &factor));
        if condition.is_nan() || condition >= WORST {
            let message = format!(
                "delta is {} mm: functions that wide are so alike at these points that their equations are singular to working \
                 precision (condition number above 1e12); {} mm would do",
                number(delta),
                number(own)
            );
            return Err(Fault::new("delta", message));
        }
        let mut beta = values.to_vec();
        substitute(&factor, &mut beta);
        Ok(Rbf { points, beta, delta, axis, condition })
    }

    /// δ, mm.
    pub fn delta(&self) -> f64 {
        self.delta
    }

    /// The condition number of the equations: the factor by which an error of the values can grow between the points.
    pub fn condition(&self) -> f64 {
        self.condition
    }

    /// Number of control points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no control point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    fn across(&self, p: Vec3) -> Vec3 {
        self.axis.map_or(p, |n| sub(p, scale(n, dot(n, p))))
    }
}

/// The ratio of the greatest and the least eigenvalue, by powers of the matrix and of its inverse.
fn condition(m: &[Vec<f64>], l: &[Vec<f64>]) -> f64 {
    let powers = |by: &dyn Fn(&[f64]) -> Vec<f64>| {
        // No eigenvector is likely to be at right angles to this.
        let mut x: Vec<f64> = (0..m.len()).map(|i| 1.0 + (i as f64 * 1.7).sin()).collect();
        let mut value = 0.0;
        for _ in 0..60 {
            let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
            x.iter_mut().for_each(|v| *v /= length);
            let y = by(&x);
            value = y.iter().zip(&x).map(|(a, b)| a * b).sum();
            x = y;
        }
        value
    };
    let times = |x: &[f64]| m.iter().map(|r| r.iter().zip(x).map(|(a, b)| a * b).sum()).collect();
    let back = |x: &[f64]| {
        let mut x = x.to_vec();
        substitute(l, &mut x);
        x
    };
    powers(&times) * powers(&back)
}

/// Points handled at once; the compiler turns each loop over them into vector instructions.
const LANES: usize = 8;

/// Adds β exp(−|x − q|²/δ²) of each function to values, and its derivatives to gradients, at points given by coordinates; `by` is 1/δ².
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn add_all(
    functions: (&[Vec3], &[f64]),
    by: f64,
    at: &[[f64; LANES]; 3],
    value: &mut [f64; LANES],
    gradient: &mut [[f64; LANES]; 3],
) {
    for ([x, y, z], beta) in functions.0.iter().zip(functions.1) {
        for l in 0..LANES {
            let d = [at[0][l] - x, at[1][l] - y, at[2][l] - z];
            let e = beta * exp(-(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) * by);
            value[l] += e;
            let slope = -2.0 * by * e;
            for k in 0..3 {
                gradient[k][l] += slope * d[k];
            }
        }
    }
}

impl Rbf {
    /// Values and gradients at no more than `LANES` points.
    fn sums(&self, points: &[Vec3]) -> ([f64; LANES], [[f64; LANES]; 3]) {
        let mut at = [[0.0; LANES]; 3];
        for (l, p) in points.iter().enumerate() {
            let p = self.across(*p);
            (at[0][l], at[1][l], at[2][l]) = (p[0], p[1], p[2]);
        }
        let (mut value, mut gradient) = ([0.0; LANES], [[0.0; LANES]; 3]);
        add_all((&self.points, &self.beta), 1.0 / (self.delta * self.delta), &at, &mut value, &mut gradient);
        (value, gradient)
    }
}

impl Field for Rbf {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (out, points) in out.chunks_mut(LANES).zip(points.chunks(LANES)) {
            out.copy_from_slice(&self.sums(points).0[..points.len()]);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let out = values.chunks_mut(LANES).zip(gradients.chunks_mut(LANES));
        for ((values, gradients), points) in out.zip(points.chunks(LANES)) {
            let (value, gradient) = self.sums(points);
            values.copy_from_slice(&value[..points.len()]);
            gradients.iter_mut().enumerate().for_each(|(l, g)| *g = gradient.map(|of| of[l]));
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            let ends = self.beta.iter().fold([0.0; 2], |s, v| [s[0] + v.min(0.0), s[1] + v.max(0.0)]);
            return Interval::new(ends[0], ends[1]);
        }
        let by = 1.0 / (self.delta * self.delta);
        let middle = self.across(b.center());
        let reach = norm(b.size()) / 2.0 * (1.0 + 1e-12) + 1e-12 * (1.0 + norm(middle));
        // Each function by how near and far its point is, and all by how steep they can be.
        let (mut lo, mut hi, mut value, mut slope, mut size) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (q, beta) in self.points.iter().zip(&self.beta) {
            let d = norm(sub(middle, *q));
            let (near, far) = ((d - reach).max(0.0), d + reach);
            let (most, least) = (exp(-near * near * by), exp(-far * far * by));
            let ends = [beta * least, beta * most];
            lo += ends[0].min(ends[1]);
            hi += ends[0].max(ends[1]);
            value += beta * exp(-d * d * by);
            // 2r/δ² e^(−r²/δ²) rises to r = δ/√2 and falls after it.
            let top = self.delta / std::f64::consts::SQRT_2;
            let r = top.clamp(near, far);
            slope += beta.abs() * 2.0 * r * by * exp(-r * r * by);
            size += beta.abs() * most;
        }
        let slack = 1e-13 * size;
        Interval::new(lo.max(value - slope * reach) - slack, hi.min(value + slope * reach) + slack)
    }
}

impl VaryingNumber for Rbf {}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use geometry::math::add;

    fn ring(n: usize) -> Vec<Vec3> {
        let turn = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        (0..n).map(|i| [turn(i).cos(), turn(i).sin(), 0.0]).collect()
    }

    #[test]
    fn it_passes_through_its_points() {
        let points = ring(16);
        let values: Vec<f64> = (0..16).map(|i| f64::from(i % 5)).collect();
        let rbf = Rbf::new(points.clone(), &values, None, None).unwrap();
        let mut out = vec![0.0; 16];
        rbf.values(&points, &mut out);
        for (a, b) in out.iter().zip(&values) {
            assert!((a - b).abs() < 1e-12 * rbf.condition());
        }
    }

    /// Known of a ring of radius one: α in its middle for δ of 0.3, 0.6, 1.0.
    #[test]
    fn the_middle_of_a_ring_is_as_known() {
        for (n, delta, middle) in [(16, 0.3, 0.0002), (16, 0.6, 0.358), (16, 1.0, 1.192)] {
            let rbf = Rbf::new(ring(n), &vec![1.0; n], Some(delta), None).unwrap();
            assert!((rbf.value([0.0; 3]) - middle).abs() < 2e-3, "{delta}: {}", rbf.value([0.0; 3]));
        }
        // Projected along an axis, a point's height does not matter.
        let rbf = Rbf::new(ring(16), &[1.0; 16], Some(0.6), Some([0.0, 0.0, 3.0])).unwrap();
        assert!((rbf.value([0.0, 0.0, 7.0]) - 0.358).abs() < 2e-3);
    }

    #[test]
    fn gradients_and_bounds_hold() {
        let rbf = Rbf::new(ring(12), &[1.0; 12], None, None).unwrap();
        for i in 0..3000 {
            let p = [0.754877666, 0.569840291, 0.819172513].map(|a| (i as f64 * a).fract() * 4.0 - 2.0);
            let size = 0.001 * f64::from(i % 700);
            let b = rbf.bound(&Aabb { min: p, max: p.map(|x| x + size) });
            let q = add(p, [0.2 * size, 0.9 * size, 0.5 * size]);
            assert!(b.lo <= rbf.value(q) && rbf.value(q) <= b.hi);
            let (mut v, mut g) = ([0.0], [[0.0; 3]]);
            rbf.gradients(&[p], &mut v, &mut g);
            for a in 0..3 {
                let (mut lo, mut hi) = (p, p);
                lo[a] -= 1e-5;
                hi[a] += 1e-5;
                assert!((g[0][a] - (rbf.value(hi) - rbf.value(lo)) / 2e-5).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn points_and_widths_that_cannot_be_are_refused() {
        let at = |points: Vec<Vec3>, delta| {
            let values = vec![1.0; points.len()];
            Rbf::new(points, &values, delta, None).err().map(|f| f.at)
        };
        let mut twice = ring(8);
        twice.push(twice[3]);
        assert_eq!(at(twice, None).as_deref(), Some("points"));
        assert_eq!(at(Vec::new(), None).as_deref(), Some("points"));
        assert_eq!(at(ring(32), Some(1.0)).as_deref(), Some("delta"));
        assert_eq!(at(ring(8), Some(-1.0)).as_deref(), Some("delta"));
        assert_eq!(at(ring(8), None), None);
    }
}
