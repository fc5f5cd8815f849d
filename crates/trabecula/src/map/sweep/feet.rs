//! The foot of a position: the nearest point of a line.

use super::line::{CurveParameter, FINE, FramedCurve};
use geometry::math::{Aabb, Vec3, dot, norm, scale, sub};
use rayon::prelude::*;

/// Most steps of Newton's method, whose convergence is quadratic; each ends at the next span at the latest.
const STEPS: usize = 30;
/// Positions handled at once; the compiler turns each loop over them into vector instructions.
pub(super) const LANES: usize = 8;
/// Steps that they take together; few positions need more.
const TOGETHER: usize = 6;
/// Steps of the table of starts within the reach of the line.
const STARTS: f64 = 16.0;
/// Most entries of that table.
const MOST: f64 = 131_072.0;
/// Least 1 − κ·d at a start: where it is less, feet move fast.
const LEAST: f64 = 0.05;

impl FramedCurve {
    /// The foot, found from a place near it.
    ///
    /// With q = p − a, the parameter is a root of (c(x) − p) · c′(x), whose coefficients are those of (c − a) · c′ less
    /// those of q · c′.
    #[inline(always)]
    pub fn foot(&self, p: Vec3, (mut span, mut x): CurveParameter) -> CurveParameter {
        let mut count = 0;
        loop {
            let s = &self.spans[span];
            let [a, b, c, d] = s.cubic;
            let q = sub(p, a);
            let f = [-dot(q, b), s.square[0] - 2.0 * dot(q, c), s.square[1] - 3.0 * dot(q, d)];
            let [_, _, f3, f4, f5] = s.square;
            loop {
                let value = f[0] + x * (f[1] + x * (f[2] + x * (f3 + x * (f4 + x * f5))));
                let slope = f[1] + x * (2.0 * f[2] + x * (3.0 * f3 + x * (4.0 * f4 + x * 5.0 * f5)));
                count += 1;
                // Beyond the centre of curvature there is no least distance to go to.
                if slope <= 0.0 || count > STEPS {
                    return (span, x);
                }
                let step = (-value / slope).max(-s.stride).min(s.stride);
                x += step;
                if step.abs() <= s.settled {
                    return (span, x);
                }
                if x < s.range[0] || x > s.range[1] {
                    break;
                }
            }
            let (last, back) = (self.spans.len() - 1, x < s.range[0]);
            if !back {
                x -= s.long;
            }
            span = match (span, back) {
                (0, true) => last,
                (_, true) => span - 1,
                (i, false) if i == last => 0,
                (_, false) => span + 1,
            };
            if back {
                x += self.spans[span].long;
            }
        }
    }

    /// The feet of several positions: the same as one by one.
    #[inline(always)]
    pub fn feet(&self, p: &[Vec3; LANES], starts: &[CurveParameter; LANES]) -> [CurveParameter; LANES] {
        let mut feet = *starts;
        let span = starts[0].0;
        let mut found = [false; LANES];
        if starts.iter().all(|s| s.0 == span) {
            let x = self.feet_on(span, p, starts);
            for l in 0..LANES {
                found[l] = !x[l].is_nan();
                feet[l].1 = x[l];
            }
        }
        for l in 0..LANES {
            if !found[l] {
                feet[l] = self.foot(p[l], starts[l]);
            }
        }
        feet
    }

    /// Feet that are found on one span from starts on it, step by step as in `foot`; not a number for others.
    #[inline(always)]
    fn feet_on(&self, span: usize, p: &[Vec3; LANES], starts: &[CurveParameter; LANES]) -> [f64; LANES] {
        let s = &self.spans[span];
        let [a, b, c, d] = s.cubic;
        let [_, _, f3, f4, f5] = s.square;
        let (mut f, mut x) = ([[0.0; LANES]; 3], [0.0; LANES]);
        for l in 0..LANES {
            let q = sub(p[l], a);
            x[l] = starts[l].1;
            f[0][l] = -dot(q, b);
            f[1][l] = s.square[0] - 2.0 * dot(q, c);
            f[2][l] = s.square[1] - 3.0 * dot(q, d);
        }
        let (mut least, mut most, mut off) =
            ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES], [f64::INFINITY; LANES]);
        for _ in 0..TOGETHER {
            for l in 0..LANES {
                let value = f[0][l] + x[l] * (f[1][l] + x[l] * (f[2][l] + x[l] * (f3 + x[l] * (f4 + x[l] * f5))));
                let slope = f[1][l] + x[l] * (2.0 * f[2][l] + x[l] * (3.0 * f3 + x[l] * (4.0 * f4 + x[l] * 5.0 * f5)));
                let step = (-value / slope).max(-s.stride).min(s.stride);
                let to = if slope > 0.0 { x[l] + step } else { f64::NAN };
                let live = off[l] > s.settled;
                x[l] = if live { to } else { x[l] };
                off[l] = if live { step.abs() } else { off[l] };
                least[l] = if x[l] < least[l] { x[l] } else { least[l] };
                most[l] = if x[l] > most[l] { x[l] } else { most[l] };
            }
            if off.iter().all(|o| *o <= s.settled) {
                break;
            }
        }
        for l in 0..LANES {
            let alone = off[l] <= s.settled && least[l] >= s.range[0] && most[l] <= s.range[1];
            x[l] = if alone { x[l] } else { f64::NAN };
        }
        x
    }

    /// The sample point nearest to a position, or the foot on one of the rays that an open line goes on with.
    pub fn nearest(&self, p: Vec3) -> CurveParameter {
        let away: Vec<f64> = self.spans[self.bent()].iter().map(|s| s.bounds.distance(p).powi(2)).collect();
        let first = (0..away.len()).fold(0, |m, i| if away[i] < away[m] { i } else { m });
        let mut near = (f64::INFINITY, usize::MAX);
        // The bounds' distances are rounded.
        let within = |i: usize, r: f64| away[i] <= r * (1.0 + 1e-12);
        for i in core::iter::once(first).chain(0..away.len()) {
            if within(i, near.0) {
                for k in i * FINE..=(i + 1) * FINE {
                    let d = sub(p, self.sample_points[k].position);
                    let r = dot(d, d);
                    // The first of several, whatever the order in which they are found.
                    if r < near.0 || (r == near.0 && k < near.1) {
                        near = (r, k);
                    }
                }
            }
        }
        let last = self.sample_points.len() - 1;
        let beyond = [(0, -1.0), (last, 1.0)].into_iter().find_map(|(i, sign)| {
            let k = &self.sample_points[i];
            let d = sub(p, k.position);
            let along = dot(d, k.tangent);
            let ahead = !self.closed && sign * along > 0.0 && dot(d, d) - along * along < near.0;
            let ray = if i == 0 { 0 } else { self.spans.len() - 1 };
            ahead.then(|| (ray, along / norm(self.spans[ray].cubic[1])))
        });
        beyond.unwrap_or(self.sample_points[near.1].place)
    }
}

/// Where to start from: at the nodes of a grid a foot and how it moves with the position.
#[derive(Clone, Debug, Default)]
pub(super) struct Starts {
    min: Vec3,
    per_step: f64,
    step: f64,
    shape: [usize; 3],
    starts: Vec<Start>,
}

/// The span and parameter of a foot, and the gradient of the parameter; no span where feet about the node do not agree.
#[derive(Clone, Copy, Debug)]
struct Start {
    span: u32,
    x: f32,
    slope: [f32; 3],
}

impl Starts {
    /// The starts in a box.
    pub fn new(line: &FramedCurve, reach: f64, b: &Aabb) -> Starts {
        let volume: f64 = b.size().iter().product();
        let step = (reach / STARTS).min(norm(b.size())).max((volume / MOST).cbrt());
        let shape = b.size().map(|s| (s / step) as usize + 2);
        let node = |i: usize| {
            let at = [i % shape[0], i / shape[0] % shape[1], i / shape[0] / shape[1]];
            let p: Vec3 = core::array::from_fn(|a| b.min[a] + at[a] as f64 * step);
            (at, p)
        };
        /// A foot, the parameter from the beginning of the line, its gradient, and whether it is a least distance.
        struct Node {
            place: CurveParameter,
            t: f64,
            slope: Vec3,
        }
        let begins: Vec<f64> = line.spans.iter().scan(0.0, |t, s| Some(core::mem::replace(t, *t + s.long))).collect();
        let end = line.spans.iter().map(|s| s.long).sum::<f64>();
        let count = shape.iter().product::<usize>();
        let nodes: Vec<Option<Node>> = (0..count)
            .into_par_iter()
            .map(|i| {
                let p = node(i).1;
                let place = line.foot(p, line.nearest(p));
                let (c, first, second) = line.spans[place.0].at(place.1);
                let (speed, rest) = (dot(first, first), dot(first, first) - dot(sub(p, c), second));
                let slope = scale(first, 1.0 / rest);
                (rest > LEAST * speed).then(|| Node { place, t: begins[place.0] + place.1, slope })
            })
            .collect();
        // Feet about a node agree if those of the nodes next to it are where its gradient has them, to four times what is
        // good enough: errors are of second order, and those nodes are at twice the distance of the positions that start from it.
        let agrees = |i: usize, n: &Node| {
            let (at, p) = node(i);
            let piece = line.spans[n.place.0].long.max(line.spans[line.before()].long) / FINE as f64;
            (0..27).all(|k| {
                let to = [k % 3, k / 3 % 3, k / 9];
                if (0..3).any(|a| at[a] + to[a] == 0 || at[a] + to[a] > shape[a]) {
                    return true;
                }
                let to: [usize; 3] = core::array::from_fn(|a| at[a] + to[a] - 1);
                let other = to[0] + shape[0] * (to[1] + shape[1] * to[2]);
                nodes[other].as_ref().is_some_and(|o| {
                    let mut off = o.t - n.t - dot(n.slope, sub(node(other).1, p));
                    if line.closed {
                        off -= (off / end).round() * end;
                    }
                    off.abs() <= 4.0 * piece
                })
            })
        };
        let start = |i: usize| match &nodes[i] {
            Some(n) if agrees(i, n) => {
                Start { span: n.place.0 as u32, x: n.place.1 as f32, slope: n.slope.map(|v| v as f32) }
            }
            _ => Start { span: u32::MAX, x: 0.0, slope: [0.0; 3] },
        };
        let starts = (0..count).into_par_iter().map(start).collect();
        Starts { min: b.min, per_step: 1.0 / step, step, shape, starts }
    }

    /// A place near the foot.
    #[inline(always)]
    pub fn at(&self, line: &FramedCurve, p: Vec3) -> CurveParameter {
        let s: Vec3 = core::array::from_fn(|a| (p[a] - self.min[a]) * self.per_step + 0.5);
        // Negative and NaN, as integers, are zero.
        let i = s.map(|s| s as usize);
        if (0..3).all(|a| s[a] >= 0.0 && i[a] < self.shape[a]) {
            let start = &self.starts[i[0] + self.shape[0] * (i[1] + self.shape[1] * i[2])];
            if start.span != u32::MAX {
                let off: Vec3 = core::array::from_fn(|a| p[a] - self.min[a] - i[a] as f64 * self.step);
                return (start.span as usize, f64::from(start.x) + dot(start.slope.map(f64::from), off));
            }
        }
        line.nearest(p)
    }
}
