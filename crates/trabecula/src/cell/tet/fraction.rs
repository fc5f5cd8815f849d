//! Solid fraction of a tetrahedral cell and its inverse.

use super::subdivision::{Subdivision, SubdivisionNodes};
use super::{Part, TetCell};
use geometry::math::Interval;
use geometry::roots::bisect;

/// Steps along the edge of the tetrahedron, coarse and fine: their two fractions give one of fourth order (Richardson).
const STEPS: [usize; 2] = [40, 80];
/// Levels in the table.
const LEVELS: usize = 1024;
/// Steps along the edge of a face.
const FACE: [usize; 2] = [160, 320];

/// Share of the tetrahedron where f < t, at equally spaced levels.
pub(crate) struct FractionTable {
    range: Interval,
    below: Vec<f64>,
}

/// Share of a tetrahedron with ascending corner values where the linear function is below t.
fn below_in_tet([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    if t <= a {
        0.0
    } else if t >= d {
        1.0
    } else if t < b {
        (t - a).powi(3) / ((b - a) * (c - a) * (d - a))
    } else if t < c {
        // The corner cut off at a less the one cut off at b, without the poles at b = a and c = d.
        let (ca, da, cb, db) = (c - a, d - a, c - b, d - b);
        let s = t - b;
        let cubic = if cb > 0.0 { (ca + db) / (cb * db) * s.powi(3) } else { 0.0 };
        ((b - a).powi(2) + 3.0 * (b - a) * s + 3.0 * s * s - cubic) / (ca * da)
    } else {
        1.0 - (d - t).powi(3) / ((d - a) * (d - b) * (d - c))
    }
}

/// The same for a triangle.
fn below_in_triangle([a, b, c]: [f64; 3], t: f64) -> f64 {
    if t <= a {
        0.0
    } else if t >= c {
        1.0
    } else if t < b {
        (t - a).powi(2) / ((b - a) * (c - a))
    } else {
        1.0 - (c - t).powi(2) / ((c - a) * (c - b))
    }
}

/// Share of a tetrahedron with these values at its corners where the linear function is below t.
pub(crate) fn share_below(v: [f64; 4], t: f64) -> f64 {
    below_in_tet(ascending(v), t)
}

fn ascending<const N: usize>(mut v: [f64; N]) -> [f64; N] {
    v.sort_unstable_by(f64::total_cmp);
    v
}

/// The share below each level of `range`, by linear functions on the small tetrahedra.
fn shares(nodes: &SubdivisionNodes, range: Interval) -> Vec<f64> {
    let step = (range.hi - range.lo) / LEVELS as f64;
    // What a small tetrahedron adds between its least and its greatest value, and that it is full beyond.
    let (mut part, mut full) = (vec![0.0; LEVELS + 1], vec![0u32; LEVELS + 2]);
    nodes.grid.each_tet(|at, _| {
        let v = ascending(at.map(|[i, j, k]| nodes.values[Subdivision::index(i, j, k)]));
        let steps = |t: f64| ((t - range.lo) / step).clamp(0.0, LEVELS as f64);
        let (first, last) = (steps(v[0]).floor() as usize, steps(v[3]).ceil() as usize);
        for (l, p) in part.iter_mut().enumerate().take(last).skip(first) {
            *p += below_in_tet(v, range.lo + l as f64 * step);
        }
        full[last] += 1;
    });
    let all = nodes.grid.n.pow(3) as f64;
    let mut sum = 0;
    let done = part.iter().zip(full).map(|(p, f)| {
        sum += f;
        (p + f64::from(sum)) / all
    });
    done.collect()
}

impl FractionTable {
    pub fn new(cell: &TetCell) -> FractionTable {
        let nodes = STEPS.map(|n| SubdivisionNodes::new(cell, Subdivision { n }));
        let fine = &nodes[1].values;
        let (lo, hi) = fine.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(*v), r.1.max(*v)));
        let range = Interval::new(lo, hi);
        let [coarse, fine] = [0, 1].map(|i| shares(&nodes[i], range));
        let mut most = 0.0f64;
        let mut below: Vec<f64> = coarse
            .iter()
            .zip(&fine)
            .map(|(c, f)| {
                // A share never falls with the level; Richardson's could, by its error.
                most = most.max((f + (f - c) / 3.0).clamp(0.0, 1.0));
                most
            })
            .collect();
        below[LEVELS] = 1.0;
        FractionTable { range, below }
    }

    /// The table of a sample of values, each with its weight.
    pub fn sampled(sample: &[(f64, Vec<f64>)]) -> FractionTable {
        let values = sample.iter().flat_map(|s| &s.1);
        let (lo, hi) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |r, v| (r.0.min(*v), r.1.max(*v)));
        let mut below = vec![0.0; LEVELS + 1];
        for (weight, values) in sample {
            for v in values {
                // Counted from the next level on.
                let at = (v - lo) / (hi - lo) * LEVELS as f64;
                below[(at as usize + 1).min(LEVELS)] += weight;
            }
        }
        let mut sum = 0.0;
        for b in &mut below {
            sum += *b;
            *b = sum;
        }
        below.iter_mut().for_each(|b| *b /= sum);
        FractionTable { range: Interval::new(lo, hi), below }
    }

    pub fn range(&self) -> Interval {
        self.range
    }

    /// The share where f < t.
    fn below(&self, t: f64) -> f64 {
        let at = (t - self.range.lo) / (self.range.hi - self.range.lo) * LEVELS as f64;
        if at.is_nan() || at <= 0.0 {
            return 0.0;
        }
        if at >= LEVELS as f64 {
            return 1.0;
        }
        let i = at as usize;
        self.below[i] + (at - i as f64) * (self.below[i + 1] - self.below[i])
    }

    pub fn fraction(&self, part: Part, t: f64) -> f64 {
        match part {
            Part::Lower => self.below(t),
            Part::Upper => 1.0 - self.below(t),
            Part::Sheet if t <= 0.0 => 0.0,
            Part::Sheet => self.below(t) - self.below(-t),
        }
    }

    pub fn iso(&self, part: Part, fraction: f64) -> f64 {
        let Interval { lo, hi } = match part {
            Part::Sheet => Interval::new(0.0, self.range.lo.abs().max(self.range.hi.abs())),
            _ => self.range,
        };
        let falls = part == Part::Upper;
        // The table is monotone; 60 halvings leave nothing.
        let [lo, hi] = bisect([lo, hi], 60, |t| (self.fraction(part, t) < fraction) != falls);
        0.5 * (lo + hi)
    }
}

/// The solid share of a face.
pub(super) fn of_face(cell: &TetCell, part: Part, iso: f64) -> f64 {
    let below = |t: f64| {
        let [coarse, fine] = FACE.map(|n| {
            let bary = |a: usize, b: usize| {
                let k = [n - a, a - b, b].map(|v| v as f64 / n as f64);
                [k[0], k[1], k[2], 0.0]
            };
            let at: Vec<_> = (0..=n).flat_map(|a| (0..=a).map(move |b| bary(a, b))).collect();
            let v = cell.values(&at);
            let mut sum = 0.0;
            Subdivision { n }.each_triangle(|t3, _| {
                let of = t3.map(|[a, b]| v[a * (a + 1) / 2 + b]);
                sum += below_in_triangle(ascending(of), t);
            });
            sum / (n * n) as f64
        });
        (fine + (fine - coarse) / 3.0).clamp(0.0, 1.0)
    };
    match part {
        Part::Lower => below(iso),
        Part::Upper => 1.0 - below(iso),
        Part::Sheet if iso <= 0.0 => 0.0,
        Part::Sheet => below(iso) - below(-iso),
    }
}
