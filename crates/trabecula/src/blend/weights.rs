//! The shares of the lattices of a blend: a partition of unity from grades.

use crate::grade::Grade;
use geometry::math::{Aabb, Interval, Vec3, add, scale, sub};

/// Shares up to this become 0 and the others are normalised again, so that a weight with a long tail
/// (a logistic) has an end, continuously.
const FAINT: f64 = 1e-6;

/// A partition of unity: a share of each lattice, wᵢ ≥ 0, Σ wᵢ = 1.
#[derive(Clone)]
pub struct Weights {
    of: Vec<Grade>,
    /// Whether there are two lattices and the one grade is the share of the second.
    between: bool,
}

impl Weights {
    /// Of two lattices: `weight` is the share of the second, cut off at 0 and 1.
    pub fn between(weight: Grade) -> Weights {
        Weights { of: vec![weight], between: true }
    }

    /// Whether they are the same everywhere.
    pub fn are_constant(&self) -> bool {
        self.of.iter().all(|grade| grade.constant().is_some())
    }

    /// One number for each lattice, cut off at 0 and divided by their sum. Where all are 0 the shares are equal; designs
    /// with such weights are refused.
    pub fn shares(of: Vec<Grade>) -> Weights {
        Weights { of, between: false }
    }

    /// Number of lattices.
    pub fn len(&self) -> usize {
        if self.between { 2 } else { self.of.len() }
    }

    /// Whether there is no lattice.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The grades as given.
    pub fn grades(&self) -> &[Grade] {
        &self.of
    }

    /// Fills the shares at points (mm), those of a point one after another.
    pub fn values(&self, points: &[Vec3], out: &mut [f64]) {
        let n = self.len();
        let mut raw = vec![0.0; points.len()];
        for (i, grade) in self.of.iter().enumerate() {
            grade.values(points, &mut raw);
            for (w, r) in out.chunks_exact_mut(n).zip(&raw) {
                if self.between {
                    let r = r.clamp(0.0, 1.0);
                    w.copy_from_slice(&[1.0 - r, r]);
                } else {
                    w[i] = r.max(0.0);
                }
            }
        }
        // The same function, compiled for two.
        match n {
            2 => out.as_chunks_mut::<2>().0.iter_mut().for_each(|w| normalise(w)),
            _ => out.chunks_exact_mut(n).for_each(normalise),
        }
    }

    /// Fills shares and their gradients (per mm).
    pub fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        let n = self.len();
        let (mut raw, mut slope) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        for (i, grade) in self.of.iter().enumerate() {
            grade.gradients(points, &mut raw, &mut slope);
            let both = values.chunks_exact_mut(n).zip(gradients.chunks_exact_mut(n));
            for ((w, g), (r, s)) in both.zip(raw.iter().zip(&slope)) {
                if self.between {
                    let s = if (0.0..=1.0).contains(r) { *s } else { [0.0; 3] };
                    let r = r.clamp(0.0, 1.0);
                    w.copy_from_slice(&[1.0 - r, r]);
                    g.copy_from_slice(&[scale(s, -1.0), s]);
                } else {
                    w[i] = r.max(0.0);
                    g[i] = if *r > 0.0 { *s } else { [0.0; 3] };
                }
            }
        }
        if n == 2 {
            let (values, gradients) = (values.as_chunks_mut::<2>().0, gradients.as_chunks_mut::<2>().0);
            let both = values.iter_mut().zip(gradients);
            return both.for_each(|(w, g)| normalise_gradients(w, g));
        }
        let both = values.chunks_exact_mut(n).zip(gradients.chunks_exact_mut(n));
        both.for_each(|(w, g)| normalise_gradients(w, g));
    }

    /// Fills an interval for each share that contains its values in the box. One whose upper end is 0 is absent.
    pub fn bound(&self, b: &Aabb, out: &mut [Interval]) {
        if self.between {
            let r = self.of[0].bound(b);
            let (lo, hi) = (r.lo.clamp(0.0, 1.0), r.hi.clamp(0.0, 1.0));
            out.copy_from_slice(&[Interval::new(1.0 - hi, 1.0 - lo), Interval::new(lo, hi)]);
        } else {
            for (o, g) in out.iter_mut().zip(&self.of) {
                let r = g.bound(b);
                *o = Interval::new(r.lo.max(0.0), r.hi.max(0.0));
            }
        }
        divide(out);
        for o in out.iter_mut() {
            // A share at the limit may be rounded: it becomes 0 only well below it.
            let faint = FAINT * (1.0 - 1e-9);
            *o = Interval::new((o.lo - FAINT).max(0.0), (o.hi - faint).max(0.0));
        }
        divide(out);
    }
}

/// Normalises numbers to shares.
#[inline(always)]
fn normalise(w: &mut [f64]) {
    let sum: f64 = w.iter().sum();
    if !(sum > 0.0 && sum.is_finite()) {
        return w.fill(1.0 / w.len() as f64);
    }
    w.iter_mut().for_each(|w| *w = (*w / sum - FAINT).max(0.0));
    let sum: f64 = w.iter().sum();
    w.iter_mut().for_each(|w| *w /= sum);
}

/// Normalises numbers and their gradients to shares.
#[inline(always)]
fn normalise_gradients(w: &mut [f64], g: &mut [Vec3]) {
    // The gradient of r / Σr, twice: before and after faint shares are set to 0.
    let divide = |w: &mut [f64], g: &mut [Vec3], sum: f64| {
        let whole = g.iter().fold([0.0; 3], |a, b| add(a, *b));
        if sum == 1.0 && whole == [0.0; 3] {
            return;
        }
        let per = 1.0 / sum;
        for (w, g) in w.iter_mut().zip(g) {
            *w /= sum;
            *g = scale(sub(*g, scale(whole, *w)), per);
        }
    };
    let sum: f64 = w.iter().sum();
    if sum > 0.0 && sum.is_finite() {
        divide(w, g, sum);
        for (w, g) in w.iter_mut().zip(g.iter_mut()) {
            *w = (*w - FAINT).max(0.0);
            if *w == 0.0 {
                *g = [0.0; 3];
            }
        }
        let sum = w.iter().sum();
        divide(w, g, sum);
    } else {
        normalise(w);
        g.fill([0.0; 3]);
    }
}

/// Intervals of numbers to intervals of shares: each with the least and the greatest sum of the others.
fn divide(r: &mut [Interval]) {
    const SLACK: f64 = 1e-12;
    let sums = r.iter().fold([0.0; 2], |s, r| [s[0] + r.lo, s[1] + r.hi]);
    for r in r.iter_mut() {
        let others = [(sums[0] - r.lo).max(0.0), (sums[1] - r.hi).max(0.0)];
        // Sums less a term have a rounding error of the sums.
        let alone = others[1] <= 1e-15 * sums[1];
        let share = |v: f64, others: f64| if v > 0.0 { v / (v + others) } else { 0.0 };
        let lo = if alone && r.lo > 0.0 { 1.0 } else { share(r.lo, others[1]) - SLACK };
        let hi = if r.hi > 0.0 { share(r.hi, others[0]) + SLACK } else { 0.0 };
        *r = Interval::new(lo.max(0.0), hi.min(1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grade::Formula;

    fn grade(text: &str) -> Grade {
        Grade::from(Formula::parse(text).unwrap_or_else(|f| panic!("{f}")))
    }

    fn all() -> Vec<Weights> {
        vec![
            Weights::between(grade("x/3 + 0.2*sin(y)")),
            Weights::between(grade("1/(1 + exp(-4*x))")),
            Weights::shares(vec![
                grade("exp(-x^2 - y^2)"),
                grade("exp(-(x - 2)^2)"),
                grade("exp(-(y - 2)^2 - (z + 1)^2)"),
            ]),
            Weights::shares(vec![grade("x"), grade("1 - x"), grade("abs(y)"), grade("0")]),
        ]
    }

    fn points() -> impl Iterator<Item = Vec3> {
        (0..400).map(|i| [0.754877666, 0.569840291, 0.819172513].map(|a| (i as f64 * a).fract() * 8.0 - 4.0))
    }

    #[test]
    fn shares_make_one_and_their_gradients_nothing() {
        for weights in all() {
            let n = weights.len();
            for p in points() {
                let (mut w, mut g) = (vec![0.0; n], vec![[0.0; 3]; n]);
                weights.gradients(&[p], &mut w, &mut g);
                let mut plain = vec![0.0; n];
                weights.values(&[p], &mut plain);
                assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-14 && w.iter().all(|w| *w >= 0.0));
                for (a, b) in w.iter().zip(&plain) {
                    assert!((a - b).abs() < 1e-14);
                }
                for a in 0..3 {
                    assert!(g.iter().map(|g| g[a]).sum::<f64>().abs() < 1e-12);
                    let step = 1e-6;
                    let mut near = [p, p];
                    near[0][a] -= step;
                    near[1][a] += step;
                    let (mut v, mut s) = (vec![0.0; 2 * n], vec![[0.0; 3]; 2 * n]);
                    weights.gradients(&near, &mut v, &mut s);
                    for i in 0..n {
                        // Where a share is cut off the one-sided slopes differ.
                        if (s[i][a] - s[n + i][a]).abs() < 1e-3 {
                            assert!((g[i][a] - (v[n + i] - v[i]) / (2.0 * step)).abs() < 1e-3);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn bounds_hold_and_find_absent_lattices() {
        let mut absent = 0;
        for weights in all() {
            let n = weights.len();
            for (i, p) in points().enumerate() {
                let size = 0.01 + 0.02 * (i % 40) as f64;
                let b = Aabb { min: p, max: p.map(|x| x + size) };
                let mut bound = vec![Interval::new(0.0, 0.0); n];
                weights.bound(&b, &mut bound);
                let mut w = vec![0.0; n];
                for t in [[0.0; 3], [1.0; 3], [0.3, 0.6, 0.9], [0.8, 0.1, 0.4]] {
                    let q = core::array::from_fn(|a| p[a] + size * t[a]);
                    weights.values(&[q], &mut w);
                    for (w, b) in w.iter().zip(&bound) {
                        assert!(b.lo <= *w && *w <= b.hi, "{w} {b:?}");
                        absent += usize::from(b.hi == 0.0);
                    }
                }
                assert!(bound.iter().filter(|b| b.lo == 1.0).count() <= 1);
            }
        }
        // The tail of the logistic alone is a fifth of its points.
        assert!(absent > 1000, "{absent}");
    }

    #[test]
    fn a_share_that_is_nothing_everywhere_counts_for_nothing() {
        let weights = Weights::shares(vec![grade("2"), grade("0"), grade("-1")]);
        let mut w = [9.0; 3];
        weights.values(&[[1.0, 2.0, 3.0]], &mut w);
        assert_eq!(w, [1.0, 0.0, 0.0]);
        let none = Weights::shares(vec![grade("0"), grade("x - x")]);
        let mut w = [9.0; 2];
        none.values(&[[1.0, 2.0, 3.0]], &mut w);
        assert_eq!(w, [0.5, 0.5]);
    }
}
