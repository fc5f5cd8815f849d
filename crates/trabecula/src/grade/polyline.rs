//! Distance to a line of control points.

use super::control_points::ControlPoints;
use super::{BuildGrade, Grade, Quantity, VaryingNumber, directed};
use crate::environment::Environment;
use crate::field::Field;
use crate::kind::{DesignError, Key, Kind};
use geometry::bvh::{Bvh, Split, WideBvh};
use geometry::fault::{Fault, counted};
use geometry::math::{Aabb, Interval, Vec3, across, add, cross, dot, norm, scale, sub, unit};

/// Least sharpness of the smooth form: below it its weights make noticeably more than one.
pub const LEAST_SHARPNESS: f64 = 10.0;

/// Distance to a chain of straight segments through control points.
#[derive(Clone, Debug, PartialEq, Kind)]
#[kind(name = "Distance", noun = "a distance to a line", check = DistanceKind::directed)]
pub struct DistanceKind {
    /// The corners of the line, in order.
    #[kind(flatten)]
    points: ControlPoints,
    /// Whether the last is joined to the first.
    #[kind(default = false)]
    closed: bool,
    /// Direction of projection: the distance is that from a wall through the line along it. Inside a closed line it is negative.
    axis: Option<[f64; 3]>,
    /// The smooth form instead of the exact distance: off by at most 0.2785/sharpness of the longest segment, without a sign.
    #[kind(min = LEAST_SHARPNESS)]
    sharpness: Option<f64>,
}

impl DistanceKind {
    fn directed(&self, _: &Key) -> Result<(), Fault> {
        directed("axis", self.axis)
    }
}

impl DistanceKind {
    /// The line; `path` is that of the table with the key.
    pub(crate) fn line(&self, path: &str, environment: &Environment) -> Result<Polyline, DesignError> {
        let (points, _) = self.points.read(path, environment)?;
        let line = Polyline::new(points, self.closed, self.axis, self.sharpness);
        line.map_err(|f| self.points.fault(path, f))
    }
}

impl BuildGrade for DistanceKind {
    fn build(&self, of: &Quantity) -> Result<Grade, DesignError> {
        of.function(Ok(self.line(&of.path, of.environment)?))
    }
}

/// The distance (mm) to a chain of straight segments.
///
/// Exact, it is equations 21 to 24 of the hybrid paper: the distance to the nearest segment, or to its nearer end. With a
/// sharpness k it is equation 25, in which the three cases of a segment of length L are weighted by logistic functions of
/// k t: smooth where a segment's end takes over, and off by at most 0.2785 L/k (on the line near its ends; it is not zero
/// on the segment). Weights there make up to 1 + (1 + e^(k/2))⁻².
///
/// With an axis all is projected along it: distances are those from a wall through the line. A closed line with an axis has an
/// inside, where exact distances are negative.
pub struct Polyline {
    points: Vec<Vec3>,
    axis: Option<Vec3>,
    sharpness: Option<f64>,
    /// The line as a polygon, where it has an inside.
    polygon: Option<Polygon>,
    longest: f64,
    /// The segments, in the order `order` of their numbers.
    tree: WideBvh,
    order: Vec<u32>,
}

/// A closed line in the plane across an axis.
struct Polygon {
    /// Two directions in the plane.
    plane: [Vec3; 2],
    /// The ends of each edge.
    edges: Vec<[[f64; 2]; 2]>,
    tree: Bvh,
}

impl Polygon {
    fn new(points: &[Vec3], axis: Vec3) -> Polygon {
        let u = across(axis);
        let v = cross(axis, u);
        let edges: Vec<[[f64; 2]; 2]> =
            points.windows(2).map(|w| [w[0], w[1]].map(|q| [dot(q, u), dot(q, v)])).collect();
        let bounds = |[[ax, ay], [bx, by]]: &[[f64; 2]; 2]| Aabb::EMPTY.with([*ax, *ay, 0.0]).with([*bx, *by, 0.0]);
        let boxes: Vec<Aabb> = edges.iter().map(bounds).collect();
        let tree = Bvh::new(&boxes, (0..edges.len() as u32).collect(), Split::Median);
        Polygon { plane: [u, v], edges, tree }
    }

    /// Whether a ray from a point crosses the line an odd number of times.
    fn contains(&self, p: Vec3) -> bool {
        let [x, y] = self.plane.map(|d| dot(p, d));
        let ray = Aabb { min: [x, y, 0.0], max: [f64::INFINITY, y, 0.0] };
        let mut inside = false;
        self.tree.overlapping(&ray, |some| {
            for [[ax, ay], [bx, by]] in some.iter().map(|i| self.edges[*i as usize]) {
                inside ^= (ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax);
            }
        });
        inside
    }
}

impl Polyline {
    /// Through the points (mm) in order, and back to the first if `closed`.
    ///
    /// # Errors
    /// Fewer than two points (three if closed), two in a row that coincide after projection along the axis, a sharpness below 10.
    pub fn new(points: Vec<Vec3>, closed: bool, axis: Option<Vec3>, sharpness: Option<f64>) -> Result<Polyline, Fault> {
        let least = if closed { 3 } else { 2 };
        if points.len() < least {
            let message = format!("{}; a line needs at least {least}", counted(points.len(), "point"));
            return Err(Fault::new("points", message));
        }
        if let Some(k) = sharpness.filter(|k| !(*k >= LEAST_SHARPNESS && k.is_finite())) {
            let message = format!("sharpness is {k}; it must be a finite number, at least {LEAST_SHARPNESS}");
            return Err(Fault::new("sharpness", message));
        }
        let axis = axis.map(unit);
        let across = |p: Vec3| axis.map_or(p, |n| sub(p, scale(n, dot(n, p))));
        let mut points: Vec<Vec3> = points.into_iter().map(across).collect();
        if closed {
            points.push(points[0]);
        }
        let lengths: Vec<f64> = points.windows(2).map(|w| norm(sub(w[1], w[0]))).collect();
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        if let Some(i) = lengths.iter().position(|l| *l <= 1e-9 * longest) {
            let message = format!(
                "points {i} and {} coincide{}; leave one out",
                (i + 1) % (points.len() - usize::from(closed)),
                if axis.is_some() { " seen along the axis" } else { "" }
            );
            return Err(Fault::new("points", message));
        }
        let polygon = axis.filter(|_| closed && sharpness.is_none()).map(|n| Polygon::new(&points, n));
        let boxes: Vec<Aabb> = points.windows(2).map(|w| Aabb::EMPTY.with(w[0]).with(w[1])).collect();
        let tree = Bvh::new(&boxes, (0..boxes.len() as u32).collect(), Split::Median);
        let order = tree.order().to_vec();
        let boxes: Vec<Aabb> = order.iter().map(|i| boxes[*i as usize]).collect();
        let tree = WideBvh::new(&tree, &boxes);
        Ok(Polyline { points, axis, sharpness, polygon, longest, tree, order })
    }

    /// The most by which the smooth form is off, mm; 0 for the exact one.
    pub fn error(&self) -> f64 {
        self.sharpness.map_or(0.0, |k| 0.2785 * self.longest / k)
    }

    /// Two segments of a line with an inside that cross or touch, but for those that follow each other: their numbers, and where
    /// (mm, projected along the axis). A line without an inside may cross itself.
    pub fn crossing(&self) -> Option<([usize; 2], Vec3)> {
        self.polygon.as_ref()?;
        let segments: Vec<[Vec3; 2]> = self.points.windows(2).map(|w| [w[0], w[1]]).collect();
        let boxes: Vec<Aabb> = segments.iter().map(|[a, b]| Aabb::EMPTY.with(*a).with(*b)).collect();
        let last = segments.len() - 1;
        let closed = self.points[0] == self.points[last + 1];
        let near = 1e-9 * self.longest;
        for i in 0..=last {
            for j in i + 2..=last {
                let apart =
                    |a: usize| boxes[i].min[a] > boxes[j].max[a] + near || boxes[j].min[a] > boxes[i].max[a] + near;
                if (closed && i == 0 && j == last) || (0..3).any(apart) {
                    continue;
                }
                let (p, q) = nearest_points(segments[i], segments[j]);
                if norm(sub(p, q)) <= near {
                    return Some(([i, j], p));
                }
            }
        }
        None
    }

    /// The ends of the segment at a position in the tree's order, and its number.
    fn segment(&self, at: usize) -> ([Vec3; 2], u32) {
        let i = self.order[at];
        ([self.points[i as usize], self.points[i as usize + 1]], i)
    }

    /// The unsigned distance to the nearest segment (mm), and the nearest point; of the first segment where several are as near.
    fn nearest(&self, p: Vec3) -> (f64, Vec3) {
        let mut best = (f64::INFINITY, u32::MAX, self.points[0]);
        self.tree.nearest(p, f64::INFINITY, |at| {
            let ([a, b], i) = self.segment(at);
            let d = sub(b, a);
            let t = (dot(sub(p, a), d) / dot(d, d)).clamp(0.0, 1.0);
            let foot = add(a, scale(d, t));
            let r = norm(sub(p, foot));
            if (r, i) < (best.0, best.1) {
                best = (r, i, foot);
            }
            best.0 * best.0
        });
        (best.0, best.2)
    }

    /// Equation 25 for the segment that it makes nearest.
    fn smooth(&self, p: Vec3, k: f64) -> f64 {
        let s = |x: f64| 1.0 / (1.0 + (-x).exp());
        let mut best = f64::INFINITY;
        self.tree.nearest(p, f64::INFINITY, |at| {
            let ([a, b], _) = self.segment(at);
            let d = sub(b, a);
            let t = dot(sub(p, a), d) / dot(d, d);
            let to = |q: Vec3| norm(sub(p, q));
            let weighted =
                to(a) * s(-k * t) + to(add(a, scale(d, t))) * s(k * t) * s(k * (1.0 - t)) + to(b) * s(k * (t - 1.0));
            best = best.min(weighted);
            (best + self.error()).powi(2)
        });
        best
    }

    /// Whether a point lies inside a closed line, projected along the axis.
    fn inside(&self, p: Vec3) -> bool {
        self.polygon.as_ref().is_some_and(|line| line.contains(p))
    }

    fn across(&self, p: Vec3) -> Vec3 {
        self.axis.map_or(p, |n| sub(p, scale(n, dot(n, p))))
    }

    fn at(&self, p: Vec3) -> f64 {
        let p = self.across(p);
        match self.sharpness {
            Some(k) => self.smooth(p, k),
            None if self.inside(p) => -self.nearest(p).0,
            None => self.nearest(p).0,
        }
    }
}

/// The points of two segments that are nearest to each other.
fn nearest_points([a, b]: [Vec3; 2], [c, d]: [Vec3; 2]) -> (Vec3, Vec3) {
    let (u, v, r) = (sub(b, a), sub(d, c), sub(a, c));
    let (uu, vv, uv) = (dot(u, u), dot(v, v), dot(u, v));
    let (ur, vr) = (dot(u, r), dot(v, r));
    let square = uu * vv - uv * uv;
    let s = if square > 1e-14 * uu * vv { ((uv * vr - ur * vv) / square).clamp(0.0, 1.0) } else { 0.0 };
    let t = (uv * s + vr) / vv;
    let (s, t) = match t {
        t if t < 0.0 => ((-ur / uu).clamp(0.0, 1.0), 0.0),
        t if t > 1.0 => (((uv - ur) / uu).clamp(0.0, 1.0), 1.0),
        t => (s, t),
    };
    (add(a, scale(u, s)), add(c, scale(v, t)))
}

impl Field for Polyline {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(points) {
            *o = self.at(*p);
        }
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            *v = self.at(*p);
            if self.sharpness.is_none() {
                let p = self.across(*p);
                let foot = self.nearest(p).1;
                *g = scale(unit(sub(p, foot)), if *v < 0.0 { -1.0 } else { 1.0 });
                continue;
            }
            let step = 1e-6 * self.longest;
            *g = core::array::from_fn(|a| {
                let (mut lo, mut hi) = (*p, *p);
                lo[a] -= step;
                hi[a] += step;
                (self.at(hi) - self.at(lo)) / (2.0 * step)
            });
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        if !b.is_finite() {
            return Interval::new(f64::NEG_INFINITY, f64::INFINITY);
        }
        // Distances, signed or not, are 1-Lipschitz.
        let middle = self.across(b.center());
        let d = self.nearest(middle).0 * if self.inside(middle) { -1.0 } else { 1.0 };
        let reach = norm(b.size()) / 2.0 * (1.0 + 1e-12) + 1e-12 * (1.0 + norm(middle));
        let r = Interval::new(d - reach, d + reach);
        match self.sharpness {
            None if self.polygon.is_some() => r,
            None => Interval::new(r.lo.max(0.0), r.hi),
            // More than one in all, and between segments whichever seems nearer.
            Some(_) => Interval::new((r.lo.max(0.0) - self.error()).max(0.0), r.hi * (1.0 + 1e-4) + self.error()),
        }
    }
}

impl VaryingNumber for Polyline {}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn positions() -> impl Iterator<Item = Vec3> {
        (0..3000).map(|i| [0.754877666, 0.569840291, 0.819172513].map(|a| (i as f64 * a).fract() * 10.0 - 5.0))
    }

    fn chain() -> Vec<Vec3> {
        vec![[-2.0, -1.0, 0.0], [1.0, -1.5, 0.3], [2.0, 1.0, 0.0], [-1.0, 2.0, -0.5]]
    }

    #[test]
    fn the_smooth_form_is_as_near_as_it_says() {
        // One segment of length one: the greatest error is 0.0280, 0.0139, 0.0028 for k of 10, 20, 100.
        for (k, most) in [(10.0, 0.0280), (20.0, 0.0140), (100.0, 0.0028)] {
            let ends = vec![[0.0; 3], [1.0, 0.0, 0.0]];
            let exact = Polyline::new(ends.clone(), false, None, None).unwrap();
            let smooth = Polyline::new(ends, false, None, Some(k)).unwrap();
            let mut worst = 0.0f64;
            for i in 0..=4000 {
                let p = [f64::from(i) / 1000.0 - 1.5, 0.0, 0.0];
                worst = worst.max((exact.at(p) - smooth.at(p)).abs());
            }
            assert!(worst <= smooth.error() * 1.006 && worst > 0.9 * most && worst <= most * 1.01, "{k} {worst}");
        }
    }

    /// A line through many points, closed about an axis or not: all distances are the least over its segments, one by one, and
    /// the inside is where the line winds round an odd number of times.
    #[test]
    fn of_many_segments_the_nearest_is_found() {
        let turn = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
        let star = |i: u32| {
            let r = 3.0 + (7.0 * turn(i, 300)).sin() + 0.3 * f64::from(i * 37 % 11) / 11.0;
            [r * turn(i, 300).cos(), r * turn(i, 300).sin(), 0.01 * f64::from(i % 5)]
        };
        let points: Vec<Vec3> = (0..300).map(star).collect();
        let line = Polyline::new(points.clone(), true, Some([0.0, 0.0, 1.0]), None).unwrap();
        let smooth = Polyline::new(points.clone(), false, None, Some(20.0)).unwrap();
        for p in positions() {
            let each = |of: &Polyline| {
                let parts = of.points.windows(2).map(|w| w.to_vec());
                let one = |part| Polyline::new(part, false, None, of.sharpness).unwrap().at(of.across(p));
                parts.map(one).fold(f64::INFINITY, f64::min)
            };
            assert_eq!(line.at(p).abs(), each(&line), "{p:?}");
            assert_eq!(smooth.at(p), each(&smooth), "{p:?}");
            let angle = |a: Vec3, b: Vec3| cross(a, b)[2].atan2(a[0] * b[0] + a[1] * b[1]);
            let around = (0..300).map(|i| angle(sub(points[i], p), sub(points[(i + 1) % 300], p)));
            let winding = around.sum::<f64>() / std::f64::consts::TAU;
            assert_eq!(line.at(p) < 0.0, winding.round() as i64 % 2 != 0, "{p:?} {winding}");
        }
    }

    #[test]
    fn gradients_and_bounds_hold() {
        let made = [
            Polyline::new(chain(), false, None, None).unwrap(),
            Polyline::new(chain(), true, Some([0.1, 0.2, 1.0]), None).unwrap(),
            Polyline::new(chain(), true, None, Some(25.0)).unwrap(),
        ];
        for line in &made {
            for (i, p) in positions().enumerate() {
                let size = 0.002 * (i % 500) as f64;
                let b = line.bound(&Aabb { min: p, max: p.map(|x| x + size) });
                let q = [0.3, 0.9, 0.6].map(|t| t * size);
                let v = line.at(add(p, q));
                assert!(b.lo <= v && v <= b.hi, "{v} {b:?}");
                let (mut v, mut g) = ([0.0], [[0.0; 3]]);
                line.gradients(&[p], &mut v, &mut g);
                let h = 1e-5;
                for a in 0..3 {
                    let (mut lo, mut hi) = (p, p);
                    lo[a] -= h;
                    hi[a] += h;
                    let (l, m, r) = (line.at(lo), v[0], line.at(hi));
                    // Not across a crease, where slopes of the two sides differ.
                    if ((r - m) - (m - l)).abs() < 1e-8 {
                        assert!((g[0][a] - (r - l) / (2.0 * h)).abs() < 1e-3, "{p:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_closed_line_has_an_inside() {
        let square = vec![[-1.0, -1.0, 5.0], [1.0, -1.0, -3.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 2.0]];
        let line = Polyline::new(square, true, Some([0.0, 0.0, 2.0]), None).unwrap();
        for (p, d) in [([0.0, 0.0, 9.0], -1.0), ([0.5, 0.0, 0.0], -0.5), ([3.0, 0.0, 1.0], 2.0)] {
            assert!((line.at(p) - d).abs() < 1e-12);
        }
    }

    #[test]
    fn lines_that_cross_themselves_are_found() {
        let z = Some([0.0, 0.0, 1.0]);
        let bow = vec![[0.0, 0.0, 1.0], [2.0, 2.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 3.0]];
        let crossing = |of: &[Vec3], closed, axis| Polyline::new(of.to_vec(), closed, axis, None).unwrap().crossing();
        let (segments, p) = crossing(&bow, true, z).unwrap();
        assert!(segments == [0, 2] && norm(sub(p, [1.0, 1.0, 0.0])) < 1e-12, "{segments:?} {p:?}");
        // Not seen along an axis they pass each other; an open line has no inside.
        assert_eq!(crossing(&bow, true, None), None);
        assert_eq!(crossing(&bow, false, z), None);
        assert_eq!(crossing(&chain(), true, z), None);
        // Back over an earlier segment.
        let back = [[0.0; 3], [4.0, 0.0, 0.0], [4.0, 1.0, 0.0], [5.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(crossing(&back, true, z).map(|c| c.0), Some([0, 3]));
    }

    #[test]
    fn lines_that_are_none_are_refused() {
        let at = |points: Vec<Vec3>, axis, k| Polyline::new(points, false, axis, k).err().map(|f| f.at);
        assert_eq!(at(vec![[0.0; 3]], None, None).as_deref(), Some("points"));
        assert_eq!(at(vec![[0.0; 3], [0.0, 0.0, 1.0]], Some([0.0, 0.0, 1.0]), None).as_deref(), Some("points"));
        assert_eq!(at(chain(), None, Some(2.0)).as_deref(), Some("sharpness"));
    }
}
