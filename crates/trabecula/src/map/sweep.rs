//! A map that sweeps a lattice along a curve: cells across it and along it, in a rotation-minimizing frame.
//!
//! A cubic spline c goes through the control points. A position belongs to the nearest point of it, s is the arc length up to there (mm), and
//! its coordinates across are those in a frame N₁, N₂ that does not rotate about the line (double reflection: Wang, Jüttler,
//! Zheng, Liu, Computation of rotation minimizing frames, ACM Trans. Graph. 27, 2008). With the curvature vector κ and
//! d = x − c then ∇s = T/(1 − κ·d), ∇(d·N₁) = N₁. Cells fold where κ·d ≥ 1, at the centre of curvature, and tear where two points
//! of the line are nearest. A line that closes has a whole number of cells, and what its frame has turned by after one round is
//! spread over its length.

mod line;
mod room;
#[cfg(test)]
mod tests;

use super::Mapping;
use super::inverse::{listed, whole};
use crate::field::Field;
use geometry::fault::{Fault, number};
use geometry::math::{Aabb, Mat3, Vec3, add, cross, dot, norm, scale, sub, unit};
use line::{SamplePoint, Spans, carried, spline};

/// Sample points of the line for each span between control points.
const FINE: usize = 24;
/// Steps of Newton's method from the nearest sample point; convergence is quadratic.
const STEPS: usize = 6;
/// Nodes and weights of Gauss–Legendre quadrature on [−1, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// A line along which a lattice is swept, and the cells requested.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Control points, mm.
    pub points: Vec<Vec3>,
    /// Whether the last is followed by the first.
    pub closed: bool,
    /// Cell edges (mm): two across the line and one along it.
    pub wavelength: Vec3,
    /// Direction of the cell's first edge at the start, projected across the line; chosen if not given.
    pub normal: Option<Vec3>,
}

/// A lattice swept along a line. Phases are (a/λ₁, b/λ₂, s/λ₃).
#[derive(Clone, Debug)]
pub struct Sweep {
    /// For each span between control points, where it begins and its cubic.
    spans: Spans,
    /// Where the last span ends: they are as long as their chords.
    end: f64,
    sample_points: Vec<SamplePoint>,
    closed: bool,
    wavelength: Vec3,
    length: f64,
    /// Rotation of the frame about the line, radians per mm.
    twist: f64,
    /// The reach of the line (Federer), mm: within this distance the nearest point is unique.
    reach: f64,
    /// Least and greatest length of a cell along the line in the region, mm.
    along: [f64; 2],
    /// The Jacobians where cells are shortest and longest.
    extremes: [Mat3; 2],
}

/// Coordinates of a position relative to the line.
struct Local {
    s: f64,
    /// Coordinates along N₁ and N₂.
    across: [f64; 2],
    tangent: Vec3,
    normals: [Vec3; 2],
    /// 1 − κ·d.
    stretch: f64,
}

impl Sweep {
    /// Solves for the line; `samples` are positions in the region, at which the map must neither fold nor tear.
    ///
    /// # Errors
    /// Too few points, neighbours that coincide, lengths that are not positive, a normal along the line; a fold or a tear in
    /// the region, with the position.
    pub fn new(path: &Path, region: &dyn Field, samples: &[Vec3]) -> Result<Sweep, Fault> {
        let Path { points, closed, .. } = path;
        let least = if *closed { 3 } else { 2 };
        if points.len() < least || points.iter().flatten().any(|v| !v.is_finite()) {
            let message =
                format!("{} points; a line to sweep along needs at least {least}, of finite numbers", points.len());
            return Err(Fault::new("points", message));
        }
        if let Some(w) = path.wavelength.iter().find(|w| !(**w > 0.0 && w.is_finite())) {
            let message = format!("{} mm; a wavelength is a positive, finite length", number(*w));
            return Err(Fault::new("wavelength", message));
        }
        let (spans, end) = spline(points, *closed)?;
        let mut made = Sweep {
            spans,
            end,
            sample_points: Vec::new(),
            closed: *closed,
            wavelength: path.wavelength,
            length: 0.0,
            twist: 0.0,
            reach: f64::INFINITY,
            along: [path.wavelength[2]; 2],
            extremes: [[[0.0; 3]; 3]; 2],
        };
        made.walk(path.normal)?;
        let around = samples.iter().fold(Aabb::EMPTY, |b, p| b.with(*p));
        made.reach = made.found_reach(norm(around.size()));
        made.refuse_folds(region, samples)?;
        Ok(made)
    }

    /// The spline at t: position, first and second derivative. Straight on beyond the ends of an open line.
    fn curve(&self, t: f64) -> (Vec3, Vec3, Vec3) {
        let end = self.end;
        let inside = if self.closed { t.rem_euclid(end) } else { t.clamp(0.0, end) };
        let i = self.spans.partition_point(|s| s.0 <= inside).max(1) - 1;
        let (from, [a, b, c, d]) = self.spans[i];
        let x = inside - from;
        let position = add(a, scale(add(b, scale(add(c, scale(d, x)), x)), x));
        let first = add(b, scale(add(scale(c, 2.0), scale(d, 3.0 * x)), x));
        if !self.closed && t != inside {
            return (add(position, scale(first, t - inside)), first, [0.0; 3]);
        }
        (position, first, add(scale(c, 2.0), scale(d, 6.0 * x)))
    }

    /// The length from t₀ to t, mm.
    fn length_between(&self, t0: f64, t: f64) -> f64 {
        let half = 0.5 * (t - t0);
        let at = |x: f64| norm(self.curve(t0 + half * (1.0 + x)).1);
        half * GAUSS.iter().map(|(x, w)| w * at(*x)).sum::<f64>()
    }

    /// Computes the sample points: arc lengths and frames.
    fn walk(&mut self, normal: Option<Vec3>) -> Result<(), Fault> {
        let end = self.end;
        let starts = self.spans.iter().map(|s| s.0);
        let bounds: Vec<f64> = starts.chain([end]).collect();
        let ts = bounds.windows(2).flat_map(|w| (0..FINE).map(move |i| w[0] + (w[1] - w[0]) * i as f64 / FINE as f64));
        let ts: Vec<f64> = ts.chain([end]).collect();
        let (start, slope, _) = self.curve(0.0);
        let tangent = unit(slope);
        let wanted = normal.unwrap_or_else(|| {
            let least = (0..3).fold(0, |m, a| if tangent[a].abs() < tangent[m].abs() { a } else { m });
            core::array::from_fn(|a| if a == least { 1.0 } else { 0.0 })
        });
        let flat = sub(wanted, scale(tangent, dot(wanted, tangent)));
        if !(norm(flat) > 1e-6 * norm(wanted) && norm(flat).is_finite()) {
            let message = format!("{wanted:?} lies along the line at its start; give a direction across it");
            return Err(Fault::new("normal", message));
        }
        let mut sample_points = vec![SamplePoint { t: 0.0, position: start, tangent, normal: unit(flat), s: 0.0 }];
        for t in ts.into_iter().skip(1) {
            let last = sample_points[sample_points.len() - 1];
            // The end of a closed line is evaluated at t = 0, so that it equals the start exactly.
            let (position, slope, _) = self.curve(if self.closed && t == end { 0.0 } else { t });
            let tangent = unit(slope);
            let s = last.s + self.length_between(last.t, t);
            let normal = carried(&last, position, tangent);
            sample_points.push(SamplePoint { t, position, tangent, normal, s });
        }
        let last = sample_points[sample_points.len() - 1];
        self.length = last.s;
        if self.closed {
            let (n, m) = (sample_points[0].normal, cross(sample_points[0].tangent, sample_points[0].normal));
            self.twist = -dot(last.normal, m).atan2(dot(last.normal, n)) / self.length;
            let count = (self.length / self.wavelength[2]).round().max(1.0);
            self.wavelength[2] = self.length / count;
            self.along = [self.wavelength[2]; 2];
        }
        self.sample_points = sample_points;
        Ok(())
    }

    /// The frame at t, carried from sample point i, the last before it.
    fn frame(&self, i: usize, t: f64, position: Vec3, tangent: Vec3, s: f64) -> [Vec3; 2] {
        let sample = &self.sample_points[i];
        let n = if t == sample.t { sample.normal } else { carried(sample, position, tangent) };
        let (sin, cos) = (self.twist * s).sin_cos();
        let m = cross(tangent, n);
        [add(scale(n, cos), scale(m, sin)), sub(scale(m, cos), scale(n, sin))]
    }

    fn local(&self, p: Vec3) -> Local {
        let mut near = (f64::INFINITY, 0);
        for (i, k) in self.sample_points.iter().enumerate() {
            let d = sub(p, k.position);
            let r = dot(d, d);
            if r < near.0 {
                near = (r, i);
            }
        }
        let last = self.sample_points.len() - 1;
        let end = self.end;
        // Straight on beyond the ends of an open line.
        let beyond = [(0, -1.0), (last, 1.0)].into_iter().find_map(|(i, sign)| {
            let k = &self.sample_points[i];
            let d = sub(p, k.position);
            let along = dot(d, k.tangent);
            let ahead = !self.closed && sign * along > 0.0 && dot(d, d) - along * along < near.0;
            ahead.then(|| self.sample_points[i].t + along / norm(self.curve(k.t).1))
        });
        let i = near.1;
        let step = |i: usize| self.sample_points[i + 1].t - self.sample_points[i].t;
        let lo = self.sample_points[i].t - step(if i == 0 { last - 1 } else { i - 1 });
        let hi = self.sample_points[i].t + step(if i == last { 0 } else { i });
        let mut t = beyond.unwrap_or(self.sample_points[i].t);
        for _ in 0..if beyond.is_some() { 0 } else { STEPS } {
            let (c, first, second) = self.curve(t);
            let d = sub(p, c);
            let slope = dot(first, first) - dot(d, second);
            if slope <= 0.0 {
                break;
            }
            t = (t + dot(d, first) / slope).clamp(lo, hi);
            if !self.closed {
                t = t.clamp(0.0, end);
            }
        }
        let (c, first, second) = self.curve(t);
        let (d, speed) = (sub(p, c), norm(first));
        let tangent = scale(first, 1.0 / speed);
        let bend = scale(sub(second, scale(tangent, dot(second, tangent))), 1.0 / (speed * speed));
        // On a closed line t is periodic.
        let round = if self.closed { t.rem_euclid(end) } else { t };
        let i = if round <= 0.0 { 0 } else { self.sample_points.partition_point(|k| k.t <= round).clamp(1, last) - 1 };
        let s = if !self.closed && round > end {
            self.length + (round - end) * speed
        } else if !self.closed && round < 0.0 {
            round * speed
        } else {
            self.sample_points[i].s + self.length_between(self.sample_points[i].t, round)
        };
        let normals = self.frame(i, round, c, tangent, s);
        Local { s, across: normals.map(|n| dot(d, n)), tangent, normals, stretch: 1.0 - dot(bend, d) }
    }

    /// The distance from the line, mm.
    fn away(&self, p: Vec3) -> f64 {
        let l = self.local(p);
        l.across[0].hypot(l.across[1])
    }

    /// Cell edges as they come out (mm): a line that closes has a whole number of cells.
    pub fn edges(&self) -> Vec3 {
        self.wavelength
    }

    /// The length of the line, mm.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The phase (turns) at a point (mm).
    fn phase(&self, p: Vec3) -> Vec3 {
        let l = self.local(p);
        let w = self.wavelength;
        [l.across[0] / w[0], l.across[1] / w[1], l.s / w[2]]
    }

    /// A Lipschitz bound (turns per mm) where 1 − κ·d is at least `stretch` and the distance from the line at most `away`.
    fn lipschitz_within(&self, stretch: f64, away: f64) -> f64 {
        let [a, b, c] = self.wavelength;
        // The rows are orthogonal but for the twist, whose norm is added.
        (1.0 / a.min(b)).max(1.0 / (stretch * c)) + self.twist.abs() * away / (stretch * a.min(b))
    }

    /// How many cells a line that closes has along it.
    pub fn around(&self) -> Option<i32> {
        self.closed.then(|| (self.length / self.wavelength[2]).round() as i32)
    }
}

impl Mapping for Sweep {
    fn wavelengths(&self) -> [f64; 2] {
        let [a, b, _] = self.wavelength;
        [a.min(b).min(self.along[0]), a.max(b).max(self.along[1])]
    }

    fn phases(&self, points: &[Vec3], out: &mut [Vec3]) {
        for (o, &p) in out.iter_mut().zip(points) {
            *o = self.phase(p);
        }
    }

    fn jacobian(&self, p: Vec3) -> Mat3 {
        let l = self.local(p);
        let along = scale(l.tangent, 1.0 / l.stretch.max(1e-6));
        let [a, b] = l.across;
        let w = self.wavelength;
        [
            scale(add(l.normals[0], scale(along, self.twist * b)), 1.0 / w[0]),
            scale(sub(l.normals[1], scale(along, self.twist * a)), 1.0 / w[1]),
            scale(along, 1.0 / w[2]),
        ]
    }

    fn typical(&self) -> Mat3 {
        core::array::from_fn(|i| core::array::from_fn(|j| if i == j { 1.0 / self.wavelength[i] } else { 0.0 }))
    }

    fn extremes(&self) -> Vec<Mat3> {
        self.extremes.to_vec()
    }

    /// Infinite where a position may have more than one nearest point of the line.
    fn lipschitz(&self, b: &Aabb) -> f64 {
        let reach = norm(b.size()) / 2.0;
        let away = self.away(b.center()) + reach;
        if away >= self.reach {
            return f64::INFINITY;
        }
        self.lipschitz_within(1.0 - away / self.reach, away)
    }

    fn max_lipschitz(&self) -> f64 {
        let stretch = self.along[0] / self.wavelength[2];
        self.lipschitz_within(stretch.max(1e-3), self.reach)
    }

    fn position(&self, u: Vec3, _: Vec3) -> Option<Vec3> {
        let w = self.wavelength;
        let mut s = u[2] * w[2];
        if self.closed {
            s = s.rem_euclid(self.length);
        }
        let last = self.sample_points.len() - 1;
        let i = self.sample_points.partition_point(|k| k.s <= s).clamp(1, last) - 1;
        // s rises with t at the speed of the spline, which is near one.
        let mut t = self.sample_points[i].t;
        for _ in 0..STEPS {
            let have = if t > self.end && !self.closed {
                self.length + (t - self.end) * norm(self.curve(t).1)
            } else {
                self.sample_points[i].s + self.length_between(self.sample_points[i].t, t)
            };
            t += (s - have) / norm(self.curve(t).1);
        }
        let (c, first, _) = self.curve(t);
        let n = self.frame(i, t, c, unit(first), s);
        Some(add(c, add(scale(n[0], u[0] * w[0]), scale(n[1], u[1] * w[1]))))
    }

    fn cells(&self, b: &Aabb) -> Vec<([i32; 3], Vec3)> {
        let away = self.away(b.center()) + norm(b.size());
        let w = self.wavelength;
        let across = |a: usize| [whole(-away / w[a]) - 1, whole(away / w[a]) + 1];
        let along = match self.around() {
            Some(n) => [0, n - 1],
            None => [whole(-away / w[2]) - 1, whole((self.length + away) / w[2]) + 1],
        };
        listed(self, [across(0), across(1), along], b, None)
    }

    fn canonical(&self, cell: [i32; 3]) -> [i32; 3] {
        match self.around() {
            Some(n) => [cell[0], cell[1], cell[2].rem_euclid(n)],
            None => cell,
        }
    }
}
