//! Conic arcs as rational quadratic Bézier curves, and the area between arc and chord.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::conic::Conic;
use super::hub_quadric::Quadric;

/// The curve ((1 − t)² p₀ + 2 w t (1 − t) p₁ + t² p₂)/((1 − t)² + 2 w t (1 − t) + t²): an arc of an ellipse for w < 1,
/// of a parabola for w = 1, of a hyperbola for w > 1; a straight segment if p₁ is the midpoint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bezier<const D: usize> {
    /// Control points p₀, p₁, p₂.
    pub points: [[f64; D]; 3],
    /// Weight w of p₁, positive.
    pub weight: f64,
}

impl<const D: usize> Bezier<D> {
    /// The point at t in [0, 1].
    pub fn at(&self, t: f64) -> [f64; D] {
        let (a, b, c) = ((1.0 - t) * (1.0 - t), 2.0 * self.weight * t * (1.0 - t), t * t);
        let [p, q, r] = &self.points;
        core::array::from_fn(|i| (a * p[i] + b * q[i] + c * r[i]) / (a + b + c))
    }

    /// Maximum distance from the chord's midpoint, w/(1 + w) |p₁ − (p₀ + p₂)/2|, at t = ½; in the unit of the points.
    pub fn sagitta(&self) -> f64 {
        let [p, q, r] = &self.points;
        let square: f64 = (0..D).map(|i| (q[i] - (p[i] + r[i]) / 2.0).powi(2)).sum();
        self.weight / (1.0 + self.weight) * square.sqrt()
    }

    /// Exact subdivision at t = ½.
    pub fn halves(&self) -> [Bezier<D>; 2] {
        let [p, q, r] = self.points;
        let w = self.weight;
        let middle = self.at(0.5);
        let beside = |p: [f64; D]| core::array::from_fn(|i| (p[i] + w * q[i]) / (1.0 + w));
        let weight = ((1.0 + w) / 2.0).sqrt();
        [Bezier { points: [p, beside(p), middle], weight }, Bezier { points: [middle, beside(r), r], weight }]
    }

    /// Appends points along the curve, without the first, such that chords are within `chord` of it.
    pub fn flatten(&self, chord: f64, out: &mut Vec<[f64; D]>) {
        let mut todo = vec![(*self, 24)];
        while let Some((b, depth)) = todo.pop() {
            if depth == 0 || b.sagitta() <= chord {
                out.push(b.points[2]);
            } else {
                let [first, second] = b.halves();
                todo.push((second, depth - 1));
                todo.push((first, depth - 1));
            }
        }
    }
}

impl Bezier<2> {
    /// Twice the signed area between curve and chord, positive for a left turn: the triangle of the control points
    /// times w (α − sin α cos α)/sin³ α with w = cos α; areas are affine, so it depends on nothing else. For w > 1
    /// (hyperbolas) the same with hyperbolic functions; near w = 1, where terms cancel, its series in 1 − w².
    pub fn segment_area_twice(&self) -> f64 {
        let [p, q, r] = self.points;
        let twice = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        twice * self.weight * fullness(self.weight)
    }

    /// Twice the signed area that the line from a point to the curve sweeps, positive counter-clockwise: summed over a loop, twice its
    /// area.
    pub fn swept_area_twice(&self, [x, y]: [f64; 2]) -> f64 {
        let [p, _, r] = self.points;
        (p[0] - x) * (r[1] - y) - (p[1] - y) * (r[0] - x) + self.segment_area_twice()
    }
}

/// (α − sin α cos α)/sin³ α with cos α = w: Σ (½)ₖ/k! yᵏ/(k + 3/2), y = 1 − w².
fn fullness(w: f64) -> f64 {
    let y = (1.0 - w) * (1.0 + w);
    if y.abs() < 0.1 {
        let (mut sum, mut term) = (0.0, 1.0);
        for k in 0..18 {
            let k = f64::from(k);
            sum += term / (k + 1.5);
            term *= y * (k + 0.5) / (k + 1.0);
        }
        return sum;
    }
    let s = y.abs().sqrt();
    if y > 0.0 { (w.acos() - w * s) / (s * y) } else { (w.acosh() - w * s) / (s * y) }
}

/// An arc of a conic, or a straight segment where a plane cuts a quadric in a line.
#[derive(Clone, Copy, Debug)]
pub(super) enum Path {
    /// An arc, parametrised by the angle of lines through its start.
    Curved(Conic),
    /// A segment, with the quadric's derivative to its left: it vanishes where two lines cross.
    Straight {
        /// The start.
        from: Vec3,
        /// Unit direction.
        along: Vec3,
        /// Derivative of the quadric to the left at the start, and its change per mm.
        slope: [f64; 2],
        /// The length, mm.
        end: f64,
    },
}

impl Path {
    /// The section of a quadric by the plane normal to `normal`, from a common point along the tangent; `None` where
    /// the plane is tangent to the quadric.
    pub(super) fn new(q: &Quadric, normal: Vec3, from: Vec3, tangent: Vec3) -> Option<Path> {
        if let Some(conic) = Conic::new(q, normal, from, tangent) {
            return Some(Path::Curved(conic));
        }
        let left = cross(normal, tangent);
        let slope = [2.0 * dot(q.half_gradient(from), left), 2.0 * q.form(tangent, left)];
        (slope[0] != 0.0).then_some(Path::Straight { from, along: tangent, slope, end: f64::INFINITY })
    }

    /// The first parameter beyond the start at which an affine function with this value there and this gradient
    /// vanishes; with `zero` it vanishes at the start, which is excluded.
    pub(super) fn first_root(&self, value: f64, gradient: Vec3, zero: bool) -> Option<f64> {
        match self {
            Path::Curved(c) => c.roots([value, dot(gradient, c.e[0]), dot(gradient, c.e[1])], zero).next(),
            Path::Straight { along, .. } => {
                let t = -value / dot(gradient, *along);
                (!zero && t > 0.0 && t.is_finite()).then_some(t)
            }
        }
    }

    /// Ends the path at a parameter; `None` if it runs to infinity or through a crossing of lines before.
    pub(super) fn ended_at(mut self, at: Option<f64>) -> Option<Path> {
        match &mut self {
            Path::Curved(c) => {
                c.end = at.unwrap_or(c.end);
                if c.asymptote().is_some_and(|t| t <= c.end) {
                    return None;
                }
            }
            Path::Straight { end, slope, .. } => {
                *end = at?;
                let crossing = -slope[0] / slope[1];
                if crossing > 0.0 && crossing <= *end {
                    return None;
                }
            }
        }
        Some(self)
    }

    /// The point at a fraction of the parameter range.
    pub(super) fn at(&self, fraction: f64) -> Vec3 {
        match self {
            Path::Curved(c) => c.at(fraction * c.end),
            Path::Straight { from, along, end, .. } => add(*from, scale(*along, fraction * end)),
        }
    }

    /// The parameter of a point; `None` if it is not on the path's line beyond the start.
    pub(super) fn parameter(&self, x: Vec3) -> Option<f64> {
        match self {
            Path::Curved(c) => Some(c.angle_of(x)),
            Path::Straight { from, along, .. } => {
                let (t, off) = (dot(sub(x, *from), *along), norm(cross(sub(x, *from), *along)));
                (t > 0.0 && off < 1e-6 * t).then_some(t)
            }
        }
    }

    /// As Bézier curves, each less than a third of an ellipse.
    pub(super) fn curves(&self) -> Vec<Bezier<3>> {
        match self {
            Path::Curved(c) => curves(c, 0.0, c.end),
            Path::Straight { .. } => vec![Bezier { points: [self.at(0.0), self.at(0.5), self.at(1.0)], weight: 1.0 }],
        }
    }
}

/// The arc of a conic between two angles as Bézier curves, each less than a third of an ellipse. Numerator and
/// denominator of X(θ) are quadratic forms of (cos θ, sin θ); their polar forms at both ends are the control points and
/// weights.
pub(super) fn curves(c: &Conic, from: f64, to: f64) -> Vec<Bezier<3>> {
    let mut out = Vec::new();
    let mut todo = vec![(from, to, 12)];
    while let Some((a, b, depth)) = todo.pop() {
        let ((s, t), (u, v)) = (a.sin_cos(), b.sin_cos());
        let form = |(s, t): (f64, f64), (u, v): (f64, f64)| c.m[0] * t * v + c.m[1] * (s * v + t * u) + c.m[2] * s * u;
        let (aa, ab, bb) = (form((s, t), (s, t)), form((s, t), (u, v)), form((u, v), (u, v)));
        let weight = ab / (aa * bb).sqrt() * aa.signum();
        if depth > 0 && (weight.is_nan() || weight < 0.5) {
            let m = (a + b) / 2.0;
            todo.push((m, b, depth - 1));
            todo.push((a, m, depth - 1));
            continue;
        }
        let point = |along: f64, left: f64, d: f64| {
            add(c.v, add(scale(c.e[0], -c.q * along / d), scale(c.e[1], -c.q * left / d)))
        };
        out.push(Bezier {
            points: [point(s * t, s * s, aa), point((s * v + t * u) / 2.0, s * u, ab), point(u * v, u * u, bb)],
            weight,
        });
    }
    out
}

/// The tangent direction in a plane with the inside of the quadric on the left.
pub(super) fn section_tangent(q: &Quadric, normal: Vec3, at: Vec3) -> Vec3 {
    unit(cross(normal, q.half_gradient(at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_3, PI};

    /// Twice the area between curve and chord by many chords, with one Richardson step.
    fn sampled(b: &Bezier<2>) -> f64 {
        let chords = |n: i32| {
            let p = b.points[0];
            let mut sum = 0.0;
            for k in 0..n {
                let [x, y] = [k, k + 1].map(|k| b.at(f64::from(k) / f64::from(n)));
                sum += (x[0] - p[0]) * (y[1] - p[1]) - (x[1] - p[1]) * (y[0] - p[0]);
            }
            sum
        };
        let (one, two) = (chords(4000), chords(8000));
        two + (two - one) / 3.0
    }

    #[test]
    fn the_area_beside_an_arc_is_its_closed_form() {
        for w in [0.01, 0.3, 0.5, 0.9, 0.947, 0.95, 0.999_999, 1.0, 1.000_001, 1.04, 1.06, 2.0, 30.0] {
            let b = Bezier { points: [[0.0, 0.0], [1.7, -0.8], [2.0, 0.5]], weight: w };
            let (got, want) = (b.segment_area_twice(), sampled(&b));
            assert!((got - want).abs() < 1e-10 * want.abs(), "{w}: {got} {want}");
        }
        // A sector of a circle.
        let alpha = FRAC_PI_3;
        let b = Bezier {
            points: [[alpha.cos(), -alpha.sin()], [1.0 / alpha.cos(), 0.0], [alpha.cos(), alpha.sin()]],
            weight: alpha.cos(),
        };
        let want = 2.0 * alpha - (2.0 * alpha).sin();
        assert!((b.segment_area_twice() - want).abs() < 1e-15);
    }

    #[test]
    fn halves_are_the_same_curve() {
        let b = Bezier { points: [[0.0, 0.0], [1.7, -0.8], [2.0, 0.5]], weight: 1.7 };
        let [p, q] = b.halves();
        let both = p.segment_area_twice() + q.segment_area_twice();
        let m = b.at(0.5);
        let chords = m[0] * b.points[2][1] - m[1] * b.points[2][0];
        assert!((both + chords - b.segment_area_twice()).abs() < 1e-14);
        let mut tessellation = vec![b.points[0]];
        b.flatten(1e-3, &mut tessellation);
        assert!(tessellation.len() > 8 && tessellation.last() == Some(&b.points[2]));
    }

    #[test]
    fn a_circle_is_four_curves_and_its_area() {
        let q = Quadric { m: geometry::math::IDENTITY, b: [0.0; 3], c: -4.0 };
        let (n, from) = ([0.0, 0.0, 1.0], [2.0, 0.0, 0.0]);
        let path =
            Path::new(&q, n, from, section_tangent(&q, n, from)).and_then(|p| p.ended_at(None)).expect("a circle");
        let curves = path.curves();
        assert_eq!(curves.len(), 4);
        let mut twice = 0.0;
        for c in curves {
            let b = Bezier::<2> { points: c.points.map(|p| [p[0], p[1]]), weight: c.weight };
            let [p, _, r] = b.points;
            twice += p[0] * r[1] - p[1] * r[0] + b.segment_area_twice();
        }
        assert!((twice - 8.0 * PI).abs() < 1e-13, "{twice}");
    }
}
