//! The line of a sweep: a cubic spline through control points, with arc lengths and rotation-minimizing frames tabulated.

use geometry::fault::Fault;
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub, unit};

/// Pieces of the table for each span between control points.
pub(super) const FINE: usize = 24;
/// Nodes and weights of Gauss–Legendre quadrature on [−1, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];
/// A step this small, as a share of the span, ends the search for a foot: its square is the error that is left.
const SETTLED: f64 = 1e-6;
/// Steps of Newton's method from an arc length near the one searched for; convergence is quadratic.
const STEPS: usize = 6;

/// What is tabulated: N₁, N₂, the arc length, and nothing, which fills the vector register.
type CurveTableRow = [f64; 8];

/// A point of the line: its span and the parameter in it.
pub(super) type CurveParameter = (usize, f64);

/// The part of the line between two control points: the cubic a + x (b + x (c + x d)), 0 ≤ x ≤ `long`. A line that does not
/// close has one more before its start and after its end, which go straight on for ever: c = d = 0, and `long` is zero.
#[derive(Clone, Debug)]
pub(super) struct Span {
    pub cubic: [Vec3; 4],
    pub long: f64,
    /// The parameters that belong to it.
    pub range: [f64; 2],
    /// Length of a piece, and its inverse; zero where there is one.
    pub piece: f64,
    per_piece: f64,
    /// First piece, and how many more there are.
    first: usize,
    more: usize,
    /// The coefficients of x to x⁵ in (c − a) · c′.
    pub square: [f64; 5],
    /// Longest and last step of a search for a foot.
    pub stride: f64,
    pub settled: f64,
    /// Bounds of its sample points.
    pub bounds: Aabb,
}

impl Span {
    fn new(cubic: [Vec3; 4], long: f64, first: usize) -> Span {
        let piece = long / FINE as f64;
        let [_, b, c, d] = cubic;
        let square = [dot(b, b), 3.0 * dot(b, c), 2.0 * dot(c, c) + 4.0 * dot(b, d), 5.0 * dot(c, d), 3.0 * dot(d, d)];
        Span {
            cubic,
            long,
            range: [0.0, long],
            piece,
            per_piece: 1.0 / piece,
            first,
            more: FINE - 1,
            square,
            stride: piece,
            settled: SETTLED * long,
            bounds: Aabb::EMPTY,
        }
    }

    /// Straight on from `start`, forwards or backwards.
    fn ray(start: Vec3, slope: Vec3, range: [f64; 2], first: usize) -> Span {
        let straight = Span::new([start, slope, [0.0; 3], [0.0; 3]], 0.0, first);
        let endless = f64::INFINITY;
        Span { range, per_piece: 0.0, more: 0, stride: endless, settled: 0.0, ..straight }
    }

    /// Position, first and second derivative.
    #[inline(always)]
    pub fn at(&self, x: f64) -> (Vec3, Vec3, Vec3) {
        let [a, b, c, d] = self.cubic;
        let position = add(a, scale(add(b, scale(add(c, scale(d, x)), x)), x));
        let first = add(b, scale(add(scale(c, 2.0), scale(d, 3.0 * x)), x));
        (position, first, add(scale(c, 2.0), scale(d, 6.0 * x)))
    }

    /// The length from x₀ to x, mm.
    fn length_between(&self, x0: f64, x: f64) -> f64 {
        let half = 0.5 * (x - x0);
        half * GAUSS.iter().map(|(g, w)| w * norm(self.at(x0 + half * (1.0 + g)).1)).sum::<f64>()
    }
}

/// A sample point of the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct SamplePoint {
    pub place: CurveParameter,
    pub position: Vec3,
    pub tangent: Vec3,
    /// The curvature vector, per mm.
    pub bend: Vec3,
    /// N₁, before the twist.
    pub normal: Vec3,
    /// Arc length up to here, mm.
    pub s: f64,
}

/// A line with a frame at each point.
#[derive(Clone, Debug)]
pub(super) struct FramedCurve {
    pub closed: bool,
    pub spans: Vec<Span>,
    pub sample_points: Vec<SamplePoint>,
    /// Mm.
    pub length: f64,
    /// Rotation of the frame about the line, radians per mm.
    pub twist: f64,
    /// Polynomials of fifth degree that have values and two derivatives at the sample points, by powers.
    pieces: Vec<[CurveTableRow; 6]>,
}

impl FramedCurve {
    /// A line through points, its first normal nearest to `normal`.
    ///
    /// # Errors
    /// Neighbours that coincide, a normal along the line.
    pub fn new(points: &[Vec3], closed: bool, normal: Option<Vec3>) -> Result<FramedCurve, Fault> {
        let mut spans = spline(points, closed)?;
        if !closed {
            let end = &spans[spans.len() - 1];
            let (position, slope, _) = end.at(end.long);
            let count = spans.len() * FINE;
            let [start, first, ..] = spans[0].cubic;
            spans.insert(0, Span::ray(start, first, [f64::NEG_INFINITY, 0.0], 0));
            spans.iter_mut().skip(1).for_each(|s| s.first += 1);
            spans.push(Span::ray(position, slope, [0.0, f64::INFINITY], count + 1));
        }
        let (sample_points, pieces) = (Vec::new(), Vec::new());
        let mut line = FramedCurve { closed, spans, sample_points, length: 0.0, twist: 0.0, pieces };
        line.sample_points = line.walked(normal)?;
        let (first, last) = (line.sample_points[0], line.sample_points[line.sample_points.len() - 1]);
        line.length = last.s;
        if closed {
            let (n, m) = (first.normal, cross(first.tangent, first.normal));
            line.twist = -dot(last.normal, m).atan2(dot(last.normal, n)) / line.length;
        }
        line.pieces = line.tabulated();
        let starts = line.sample_points.chunks(FINE);
        for (span, samples) in line.spans[usize::from(!closed)..].iter_mut().zip(starts) {
            span.bounds = samples.iter().fold(Aabb::EMPTY, |b, k| b.with(k.position));
        }
        Ok(line)
    }

    /// How many spans go straight on before the first control point.
    pub fn before(&self) -> usize {
        usize::from(!self.closed)
    }

    /// The spans between control points.
    pub fn bent(&self) -> core::ops::Range<usize> {
        self.before()..self.spans.len() - self.before()
    }

    /// The sample points: positions, arc lengths and frames. The last has the place of the first on a line that closes.
    fn walked(&self, normal: Option<Vec3>) -> Result<Vec<SamplePoint>, Fault> {
        let sample = |(span, x): CurveParameter| {
            let (position, first, second) = self.spans[span].at(x);
            let tangent = unit(first);
            let bend = scale(sub(second, scale(tangent, dot(second, tangent))), 1.0 / dot(first, first));
            SamplePoint { place: (span, x), position, tangent, bend, normal: [0.0; 3], s: 0.0 }
        };
        let start = sample((self.before(), 0.0));
        let tangent = start.tangent;
        let wanted = normal.unwrap_or_else(|| {
            let least = (0..3).fold(0, |m, a| if tangent[a].abs() < tangent[m].abs() { a } else { m });
            core::array::from_fn(|a| if a == least { 1.0 } else { 0.0 })
        });
        let flat = sub(wanted, scale(tangent, dot(wanted, tangent)));
        if !(norm(flat) > 1e-6 * norm(wanted) && norm(flat).is_finite()) {
            let message = format!("{wanted:?} lies along the line at its start; give a direction across it");
            return Err(Fault::new("normal", message));
        }
        let mut all = vec![SamplePoint { normal: unit(flat), ..start }];
        for span in self.bent() {
            for i in 0..FINE {
                let last = all[all.len() - 1];
                let [from, to] = [i, i + 1].map(|i| self.spans[span].long * i as f64 / FINE as f64);
                let place = match i + 1 == FINE {
                    false => (span, to),
                    true if span + 1 < self.spans.len() => (span + 1, 0.0),
                    true => (0, 0.0),
                };
                let next = sample(place);
                let s = last.s + self.spans[span].length_between(from, to);
                all.push(SamplePoint { s, normal: carried(&last, next.position, next.tangent), ..next });
            }
        }
        Ok(all)
    }

    fn tabulated(&self) -> Vec<[CurveTableRow; 6]> {
        let mut pieces: Vec<[CurveTableRow; 6]> = Vec::new();
        let straight = |sample: &SamplePoint, span: usize| {
            let [value, first, _] = self.frame(sample, span, 0.0);
            [value, first, [0.0; 8], [0.0; 8], [0.0; 8], [0.0; 8]]
        };
        for (i, ends) in self.sample_points.windows(2).enumerate() {
            let span = self.before() + i / FINE;
            let h = self.spans[span].piece;
            let [from, to] = [i % FINE, i % FINE + 1].map(|k| k as f64 * h);
            pieces.push(quintic(h, self.frame(&ends[0], span, from), self.frame(&ends[1], span, to)));
        }
        if !self.closed {
            let last = self.spans.len() - 1;
            pieces.insert(0, straight(&self.sample_points[0], 0));
            pieces.push(straight(&self.sample_points[self.sample_points.len() - 1], last));
        }
        pieces
    }

    /// N₁, N₂ and the arc length at a sample point that is at x in a span, with first and second derivatives by x.
    ///
    /// With v = |c′| a frame that does not rotate about the line has N′ = −(N·T′) T; with a twist N₁′ is v · twist · N₂ more,
    /// and N₂′ as much N₁ less.
    fn frame(&self, sample: &SamplePoint, span: usize, x: f64) -> [CurveTableRow; 3] {
        let (_, slope, second) = self.spans[span].at(x);
        let third = scale(self.spans[span].cubic[3], 6.0);
        let (v, t) = (norm(slope), unit(slope));
        let dv = dot(t, second);
        let dt = scale(sub(second, scale(t, dv)), 1.0 / v);
        let (sin, cos) = (self.twist * sample.s).sin_cos();
        let n = sample.normal;
        let m = cross(t, n);
        let normals = [add(scale(n, cos), scale(m, sin)), sub(scale(m, cos), scale(n, sin))];
        let across = |a: Vec3, b: Vec3, twist: f64| add(scale(t, -dot(a, dt)), scale(b, twist * v));
        let firsts = [across(normals[0], normals[1], self.twist), across(normals[1], normals[0], -self.twist)];
        let seconds = [(0, 1, self.twist), (1, 0, -self.twist)].map(|(i, j, twist)| {
            // N·T″, with T″ = (c‴ − 2 v′ T′ − v″ T) / v.
            let bent = (dot(normals[i], third) - 2.0 * dv * dot(normals[i], dt)) / v;
            let along = scale(t, -dot(firsts[i], dt) - bent);
            let turned = add(scale(normals[j], dv), scale(firsts[j], v));
            add(sub(along, scale(dt, dot(normals[i], dt))), scale(turned, twist))
        });
        let row = |[a, b]: [Vec3; 2], s: f64| [a[0], a[1], a[2], b[0], b[1], b[2], s, 0.0];
        [row(normals, sample.s), row(firsts, v), row(seconds, dv)]
    }

    /// N₁, N₂ and the arc length.
    #[inline(always)]
    pub fn row(&self, (span, x): CurveParameter) -> CurveTableRow {
        let span = &self.spans[span];
        let k = ((x * span.per_piece) as usize).min(span.more);
        let y = x - k as f64 * span.piece;
        let piece = &self.pieces[span.first + k];
        let mut row = piece[5];
        for power in piece[..5].iter().rev() {
            for (r, p) in row.iter_mut().zip(power) {
                *r = *r * y + p;
            }
        }
        row
    }

    /// Where the arc length is s.
    pub fn at_length(&self, s: f64) -> CurveParameter {
        let last = self.sample_points.len() - 1;
        let (span, mut x) = match self.closed {
            false if s < 0.0 => (0, 0.0),
            false if s > self.length => (self.spans.len() - 1, 0.0),
            _ => self.sample_points[self.sample_points.partition_point(|k| k.s <= s).clamp(1, last) - 1].place,
        };
        for _ in 0..STEPS {
            x += (s - self.row((span, x))[6]) / norm(self.spans[span].at(x).1);
        }
        (span, x)
    }
}

/// The polynomial of fifth degree with these values and first and second derivatives at 0 and h, by powers.
fn quintic(h: f64, [f, df, ddf]: [CurveTableRow; 3], [g, dg, ddg]: [CurveTableRow; 3]) -> [CurveTableRow; 6] {
    let mut powers = [f, df, ddf.map(|v| 0.5 * v), [0.0; 8], [0.0; 8], [0.0; 8]];
    for i in 0..8 {
        // What is missing at h.
        let value = g[i] - (f[i] + h * (df[i] + h * 0.5 * ddf[i]));
        let first = (dg[i] - (df[i] + h * ddf[i])) * h;
        let second = (ddg[i] - ddf[i]) * h * h;
        powers[3][i] = (10.0 * value - 4.0 * first + 0.5 * second) / h.powi(3);
        powers[4][i] = (-15.0 * value + 7.0 * first - second) / h.powi(4);
        powers[5][i] = (6.0 * value - 3.0 * first + 0.5 * second) / h.powi(5);
    }
    powers
}

/// The normal of a sample point carried to the next one by two reflections.
fn carried(sample: &SamplePoint, position: Vec3, tangent: Vec3) -> Vec3 {
    let mirrored = |v: Vec3, n: Vec3| {
        let long = dot(n, n);
        if long > 0.0 { sub(v, scale(n, 2.0 * dot(n, v) / long)) } else { v }
    };
    let step = sub(position, sample.position);
    let (normal, along) = (mirrored(sample.normal, step), mirrored(sample.tangent, step));
    let n = mirrored(normal, sub(tangent, along));
    unit(sub(n, scale(tangent, dot(n, tangent))))
}

/// The cubic spline through points at the lengths of their chords, natural at the ends or closed.
fn spline(points: &[Vec3], closed: bool) -> Result<Vec<Span>, Fault> {
    let n = points.len();
    let count = if closed { n } else { n - 1 };
    let at = |i: usize| points[i % n];
    let chord: Vec<f64> = (0..count).map(|i| norm(sub(at(i + 1), at(i)))).collect();
    let longest = chord.iter().copied().fold(0.0, f64::max);
    if let Some(i) = chord.iter().position(|l| *l <= 1e-9 * longest) {
        let message = format!("points {i} and {} coincide; leave one out", (i + 1) % n);
        return Err(Fault::new("points", message));
    }
    // Second derivatives at the points: a few sweeps over equations whose diagonal is twice the rest.
    let mut bend = vec![[0.0; 3]; count + 1];
    let slope = |i: usize| scale(sub(at(i + 1), at(i)), 1.0 / chord[i]);
    for _ in 0..200 {
        for i in 0..=count {
            let (before, after) = match (i, closed) {
                (0, false) => continue,
                (i, false) if i == count => continue,
                (0, true) => (count - 1, 0),
                (i, _) => (i - 1, i % count),
            };
            let right = scale(sub(slope(after), slope(before)), 6.0);
            let (hb, ha) = (chord[before], chord[after]);
            let near =
                add(scale(bend[before], hb), scale(bend[if closed { (after + 1) % count } else { after + 1 }], ha));
            bend[i] = scale(sub(right, near), 1.0 / (2.0 * (hb + ha)));
            if closed && i == 0 {
                bend[count] = bend[0];
            }
        }
    }
    let span = |i: usize| {
        let h = chord[i];
        let (m0, m1) = (bend[i], bend[if closed { (i + 1) % count } else { i + 1 }]);
        let b = sub(slope(i), scale(add(scale(m0, 2.0), m1), h / 6.0));
        Span::new([at(i), b, scale(m0, 0.5), scale(sub(m1, m0), 1.0 / (6.0 * h))], h, i * FINE)
    };
    Ok((0..count).map(span).collect())
}
