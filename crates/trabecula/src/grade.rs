//! A number that may vary in space.

use std::sync::Arc;

use crate::field::Field;
use geometry::fault::Fault;
use geometry::math::{Aabb, Interval, Vec3, dot, norm, scale, sub, unit};

mod formula;
mod polyline;
mod rbf;
mod samples;
mod sigmoid;
pub use formula::Formula;
pub use polyline::Polyline;
pub use rbf::Rbf;
pub use samples::Samples;
pub use sigmoid::Sigmoid;

/// A number that may vary in space. Its unit is that of the key it stands under.
#[derive(Clone)]
pub enum Grade {
    /// The same everywhere.
    Constant(f64),
    /// Piecewise linear in s = along · x (mm), constant beyond the first and last stop.
    Linear {
        /// Direction; s is measured in multiples of its length.
        along: Vec3,
        /// (s, value), s ascending.
        stops: Vec<[f64; 2]>,
    },
    /// Piecewise linear in the depth (mm) below the surface of a region, constant beyond the stops.
    Depth {
        /// Signed distance of the region, negative inside.
        region: Arc<dyn Field>,
        /// (depth, value), depth ascending.
        stops: Vec<[f64; 2]>,
    },
    /// A formula in x, y, z (mm).
    Formula(Formula),
    /// Piecewise linear in the distance (mm) from a point, or from a line through it, constant beyond the stops.
    Radial {
        /// The point.
        center: Vec3,
        /// Direction of the line, a unit vector; none for the distance from the point.
        axis: Option<Vec3>,
        /// (distance, value), distance ascending.
        stops: Vec<[f64; 2]>,
    },
    /// Numbers on a grid.
    Samples {
        /// The numbers.
        of: Arc<Samples>,
        /// What they stand for: (number, value), number ascending; empty if for themselves.
        remap: Vec<[f64; 2]>,
    },
    /// Any other function of position: a distance to a line, radial basis functions, a smooth step.
    Function(Arc<dyn Field>),
}

impl Grade {
    /// Piecewise linear in s = along · x (mm).
    ///
    /// **Errors** where `along` is zero or not finite, or the stops are none, not finite or not ascending in s.
    pub fn linear(along: Vec3, stops: Vec<[f64; 2]>) -> Result<Grade, Fault> {
        if along.iter().any(|v| !v.is_finite()) || along == [0.0; 3] {
            return Err(Fault::new("along", format!("found {along:?}; give three finite numbers, not all zero")));
        }
        check_stops(&stops, "s")?;
        Ok(Grade::Linear { along, stops })
    }

    /// Piecewise linear in the depth (mm) below the surface of `region` (its signed distance, negative inside).
    ///
    /// **Errors** where the stops are none, not finite or not ascending in depth.
    pub fn depth(region: Arc<dyn Field>, stops: Vec<[f64; 2]>) -> Result<Grade, Fault> {
        check_stops(&stops, "depth")?;
        Ok(Grade::Depth { region, stops })
    }

    /// The value everywhere, if it does not vary.
    pub fn constant(&self) -> Option<f64> {
        match self {
            Grade::Constant(v) => Some(*v),
            _ => None,
        }
    }

    /// Along which axes it may change; no, where moving along one leaves every bit as it is.
    pub fn varies(&self) -> [bool; 3] {
        match self {
            Grade::Constant(_) => [false; 3],
            Grade::Linear { along, .. } => along.map(|c| c != 0.0),
            Grade::Formula(f) => f.varies(),
            _ => [true; 3],
        }
    }

    /// Fills `out[i]` with the value at `points[i]` (mm).
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        match self {
            Grade::Constant(v) => out.fill(*v),
            Grade::Linear { along, stops } => {
                for (o, p) in out.iter_mut().zip(points) {
                    *o = interpolate(stops, dot(*along, *p)).0;
                }
            }
            Grade::Depth { region, stops } => {
                region.values(points, out);
                for o in out.iter_mut() {
                    *o = interpolate(stops, -*o).0;
                }
            }
            Grade::Formula(f) => f.values(points, out),
            Grade::Function(f) => f.values(points, out),
            Grade::Radial { center, axis, stops } => {
                for (o, p) in out.iter_mut().zip(points) {
                    *o = interpolate(stops, norm(off(*p, *center, *axis))).0;
                }
            }
            Grade::Samples { of, remap } => {
                for (o, p) in out.iter_mut().zip(points) {
                    *o = remapped(remap, of.at(*p).0).0;
                }
            }
        }
    }

    /// Fills values and gradients (per mm). At a stop, the gradient of the piece that begins there.
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match self {
            Grade::Constant(v) => {
                values.fill(*v);
                gradients.fill([0.0; 3]);
            }
            Grade::Linear { along, stops } => {
                for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
                    let (value, slope) = interpolate(stops, dot(*along, *p));
                    *v = value;
                    *g = scale(*along, slope);
                }
            }
            Grade::Depth { region, stops } => {
                region.gradients(points, values, gradients);
                for (v, g) in values.iter_mut().zip(gradients) {
                    let (value, slope) = interpolate(stops, -*v);
                    *v = value;
                    *g = scale(*g, -slope);
                }
            }
            Grade::Formula(f) => f.gradients(points, values, gradients),
            Grade::Function(f) => f.gradients(points, values, gradients),
            Grade::Radial { center, axis, stops } => {
                for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
                    let off = off(*p, *center, *axis);
                    let (value, slope) = interpolate(stops, norm(off));
                    *v = value;
                    *g = scale(unit(off), slope);
                }
            }
            Grade::Samples { of, remap } => {
                for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
                    let (number, slope) = of.at(*p);
                    let (value, by) = remapped(remap, number);
                    *v = value;
                    *g = scale(slope, by);
                }
            }
        }
    }

    /// An interval that contains every value in the box (may be loose, never too small).
    pub fn bound(&self, b: &Aabb) -> Interval {
        match self {
            Grade::Constant(v) => Interval::new(*v, *v),
            Grade::Linear { along, stops } => {
                // Rounded sums and products are monotone, so these ends hold for every rounded s as well.
                let end = |low: bool| {
                    let term = |a: usize| match along[a] {
                        0.0 => 0.0,
                        c if (c > 0.0) == low => c * b.min[a],
                        c => c * b.max[a],
                    };
                    term(0) + term(1) + term(2)
                };
                range(stops, Interval::new(end(true), end(false)))
            }
            Grade::Depth { region, stops } => range(stops, -region.bound(b)),
            Grade::Formula(f) => f.bound(b),
            Grade::Function(f) => f.bound(b),
            Grade::Radial { center, axis, stops } => {
                if !b.is_finite() {
                    return range(stops, Interval::new(0.0, f64::INFINITY));
                }
                // Distances from points and lines change by no more than the way between two places.
                let r = norm(off(b.center(), *center, *axis));
                let reach = norm(b.size()) / 2.0 * (1.0 + 1e-12) + 1e-12 * r;
                range(stops, Interval::new((r - reach).max(0.0), r + reach))
            }
            Grade::Samples { of, remap } => {
                let r = of.bound(b);
                if remap.is_empty() { r } else { range(remap, r) }
            }
        }
    }
}

/// From the point, or from the nearest place on the line, to `p`.
fn off(p: Vec3, center: Vec3, axis: Option<Vec3>) -> Vec3 {
    let d = sub(p, center);
    match axis {
        None => d,
        Some(n) => sub(d, scale(n, dot(d, n))),
    }
}

/// What a number stands for, and the slope.
fn remapped(remap: &[[f64; 2]], v: f64) -> (f64, f64) {
    if remap.is_empty() { (v, 1.0) } else { interpolate(remap, v) }
}

/// Refuses stops that are no function of their first number.
fn check_stops(stops: &[[f64; 2]], name: &str) -> Result<(), Fault> {
    if stops.is_empty() {
        return Err(Fault::new("stops", format!("found none; give at least one [{name}, value]")));
    }
    for (i, [s, v]) in stops.iter().enumerate() {
        if !s.is_finite() || !v.is_finite() {
            return Err(Fault::new(format!("stops[{i}]"), format!("found [{s}, {v}]; both numbers must be finite")));
        }
        if i > 0 && *s <= stops[i - 1][0] {
            let before = stops[i - 1][0];
            return Err(Fault::new(
                format!("stops[{i}]"),
                format!("{name} = {s} follows {name} = {before}; {name} must grow from stop to stop"),
            ));
        }
    }
    Ok(())
}

/// Value and slope of the piecewise linear function at `s`; constant beyond its ends, NaN without stops.
fn interpolate(stops: &[[f64; 2]], s: f64) -> (f64, f64) {
    let i = stops.partition_point(|p| p[0] <= s);
    match (i.checked_sub(1).and_then(|j| stops.get(j)), stops.get(i)) {
        (Some([s0, v0]), Some([s1, v1])) => {
            let slope = (v1 - v0) / (s1 - s0);
            ((v0 + slope * (s - s0)).clamp(v0.min(*v1), v0.max(*v1)), slope)
        }
        (Some([_, v]), None) | (None, Some([_, v])) => (*v, 0.0),
        (None, None) => (f64::NAN, 0.0),
    }
}

/// The values that the piecewise linear function takes on an interval, widened by the rounding of `interpolate`.
fn range(stops: &[[f64; 2]], s: Interval) -> Interval {
    if stops.is_empty() || s.lo.is_nan() || s.hi.is_nan() {
        return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
    }
    let mut largest = 0.0f64;
    let (a, b) = (interpolate(stops, s.lo).0, interpolate(stops, s.hi).0);
    let mut r = Interval::new(a.min(b), a.max(b));
    for [at, v] in stops {
        largest = largest.max(v.abs());
        if (s.lo..=s.hi).contains(at) {
            r = r.union(Interval::new(*v, *v));
        }
    }
    let slack = largest * 4.0 * f64::EPSILON;
    Interval::new(r.lo - slack, r.hi + slack)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Distance to the unit sphere.
    struct Ball;
    impl Field for Ball {
        fn values(&self, points: &[Vec3], out: &mut [f64]) {
            for (o, p) in out.iter_mut().zip(points) {
                *o = norm(*p) - 1.0;
            }
        }
        fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
            self.values(points, values);
            for (g, p) in gradients.iter_mut().zip(points) {
                *g = scale(*p, 1.0 / norm(*p));
            }
        }
        fn bound(&self, b: &Aabb) -> Interval {
            let far = (0..3).map(|a| b.min[a].abs().max(b.max[a].abs()).powi(2)).sum::<f64>().sqrt();
            Interval::new(b.distance([0.0; 3]) - 1.0 - 1e-12, far - 1.0 + 1e-12)
        }
    }

    fn all() -> Vec<Grade> {
        vec![
            Grade::Constant(0.3),
            Grade::linear([0.5, -1.0, 2.0], vec![[-1.0, 0.2], [0.5, 0.9], [2.0, -0.4]]).unwrap(),
            Grade::depth(Arc::new(Ball), vec![[0.0, 0.6], [0.4, 0.2], [0.8, 0.3]]).unwrap(),
            Grade::Formula(Formula::parse("0.3 + 0.1*sin(x/0.3) * y^2 - max(z, x)").unwrap()),
            Grade::Radial { center: [0.2, 0.1, 0.0], axis: None, stops: vec![[0.3, 0.1], [1.0, 0.6], [1.4, 0.2]] },
            Grade::Radial {
                center: [0.2, 0.1, 0.0],
                axis: Some([0.6, 0.0, 0.8]),
                stops: vec![[0.3, 0.1], [1.0, 0.6], [1.4, 0.2]],
            },
            Grade::Samples {
                of: Arc::new(
                    Samples::new(
                        [-1.0; 3],
                        [0.7, 0.5, 1.0],
                        [4, 4, 3],
                        (0..48).map(|i| f64::from(i * 7 % 13)).collect(),
                    )
                    .unwrap(),
                ),
                remap: vec![[2.0, 0.1], [7.0, 0.9], [10.0, 0.4]],
            },
            Grade::Function(Arc::new(Sigmoid::new(Grade::Formula(Formula::parse("x + y*z").unwrap()), 0.2, 1.5))),
        ]
    }

    fn samples(n: usize) -> impl Iterator<Item = f64> {
        let mut s = 12345u64;
        (0..n).map(move |_| (geometry::random::random(&mut s) + 1.0) / 2.0)
    }

    #[test]
    fn linear_is_exact_at_stops_between_and_beyond() {
        let g = Grade::linear([0.0, 0.0, 2.0], vec![[0.0, 1.0], [4.0, 3.0]]).unwrap();
        let mut v = [0.0; 5];
        g.values(&[[9.0, 9.0, -1.0], [0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 7.0]], &mut v);
        assert_eq!(v, [1.0, 1.0, 2.0, 3.0, 3.0]);
    }

    #[test]
    fn depth_counts_from_the_surface_inwards() {
        let g = Grade::depth(Arc::new(Ball), vec![[0.0, 0.6], [0.5, 0.2]]).unwrap();
        let mut v = [0.0; 4];
        g.values(&[[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.75, 0.0], [0.0, 0.0, 0.1]], &mut v);
        for (v, want) in v.iter().zip([0.6, 0.6, 0.4, 0.2]) {
            assert!((v - want).abs() < 1e-15);
        }
    }

    #[test]
    fn gradients_agree_with_differences_and_bounds_hold() {
        let mut r = samples(20_000);
        let mut next = || r.next().unwrap_or(0.5);
        for (k, g) in all().iter().enumerate() {
            for _ in 0..200 {
                let p = [next() * 3.0 - 1.5, next() * 3.0 - 1.5, next() * 3.0 - 1.5];
                let (mut v, mut d) = ([0.0], [[0.0; 3]]);
                g.gradients(&[p], &mut v, &mut d);
                let mut plain = [0.0];
                g.values(&[p], &mut plain);
                assert_eq!(plain, v);
                let size = next() * 0.5;
                let b = Aabb { min: p, max: p.map(|c| c + size) };
                let bound = g.bound(&b);
                for _ in 0..5 {
                    let q = [p[0] + size * next(), p[1] + size * next(), p[2] + size * next()];
                    g.values(&[q], &mut plain);
                    assert!(
                        bound.lo <= plain[0] && plain[0] <= bound.hi,
                        "grade {k} at {q:?}: {plain:?} not in {bound:?}"
                    );
                }
                for a in 0..3 {
                    let h = 1e-6;
                    let (mut lo, mut hi) = (p, p);
                    lo[a] -= h;
                    hi[a] += h;
                    let (mut w, mut e) = ([0.0; 2], [[0.0; 3]; 2]);
                    g.gradients(&[lo, hi], &mut w, &mut e);
                    // Across a crease the one-sided slopes differ: skip it.
                    if (e[0][a] - e[1][a]).abs() < 1e-2 {
                        assert!((d[0][a] - (w[1] - w[0]) / (2.0 * h)).abs() < 1e-4, "grade {k} at {p:?}, axis {a}");
                    }
                }
            }
        }
    }

    #[test]
    fn an_unbounded_box_gives_the_whole_range() {
        let g = Grade::linear([0.0, 0.0, 1.0], vec![[0.0, 0.2], [1.0, 0.7], [2.0, 0.1]]).unwrap();
        let b = g.bound(&Aabb::ALL);
        assert!((b.lo - 0.1).abs() < 1e-14 && (b.hi - 0.7).abs() < 1e-14, "{b:?}");
    }

    #[test]
    fn bad_stops_are_refused_where_they_stand() {
        let at = |r: Result<Grade, Fault>| r.err().map(|f| f.at);
        assert_eq!(at(Grade::linear([0.0; 3], vec![[0.0, 1.0]])).as_deref(), Some("along"));
        assert_eq!(at(Grade::linear([f64::NAN, 0.0, 1.0], vec![[0.0, 1.0]])).as_deref(), Some("along"));
        let z = [0.0, 0.0, 1.0];
        assert_eq!(at(Grade::linear(z, vec![])).as_deref(), Some("stops"));
        assert_eq!(at(Grade::linear(z, vec![[0.0, 1.0], [0.0, 2.0]])).as_deref(), Some("stops[1]"));
        assert_eq!(at(Grade::linear(z, vec![[0.0, f64::NAN]])).as_deref(), Some("stops[0]"));
        assert_eq!(
            at(Grade::depth(Arc::new(Ball), vec![[0.0, 1.0], [f64::INFINITY, 2.0]])).as_deref(),
            Some("stops[1]")
        );
    }
}
