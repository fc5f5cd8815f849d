//! Feet of perpendiculars from a point to a quadric: stationary points of the distance.
//!
//! At a foot x of p on Q(x) = xᵀMx + 2 b·x + c = 0, p − x is parallel to the gradient: (1 + μM) x = p − μb. In the
//! principal axes of M, xᵢ = (pᵢ − μbᵢ)/(1 + μmᵢ). Feet that can be closest are found by the sign of 1 + μM; `all_feet`
//! finds every one. Newton's method refines each to rounding.

use geometry::dense::solve;
use geometry::math::{Mat3, Vec3, add, apply, dot, eigen, norm, scale, sub, transpose, unit};
use geometry::roots::{Bracket, Tolerance};

use super::hub_quadric::Quadric;

mod all_feet;

pub(super) use all_feet::feet_on_conic;

/// A quadric in its principal axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PrincipalAxes {
    /// The axes, as rows.
    axes: Mat3,
    m: Vec3,
    b: Vec3,
    c: f64,
}

/// A foot in the principal axes of its quadric.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    p: Vec3,
    x: Vec3,
    mu: f64,
    /// Distance from p, mm.
    pub distance: f64,
}

/// Minimum of 1 + μm, below which a foot cannot be separated from a circle of feet.
const DEGENERATE: f64 = 1e-5;

impl PrincipalAxes {
    pub(super) fn new(q: &Quadric) -> PrincipalAxes {
        let (m, axes) = eigen(&q.m);
        PrincipalAxes { axes, m, b: apply(&axes, q.b), c: q.c }
    }

    fn value(&self, x: Vec3) -> f64 {
        self.c + (0..3).map(|i| x[i] * (self.m[i] * x[i] + 2.0 * self.b[i])).sum::<f64>()
    }

    fn half_gradient(&self, x: Vec3) -> Vec3 {
        [0, 1, 2].map(|i| self.m[i] * x[i] + self.b[i])
    }

    /// x(μ), [Q, dQ/dμ] there, and the minimum of 1 + μm.
    #[inline]
    fn on_curve(&self, p: Vec3, mu: f64) -> (Vec3, [f64; 2], f64) {
        let (mut value, mut slope, mut min_factor) = (self.c, 0.0, f64::INFINITY);
        let mut x = [0.0; 3];
        for i in 0..3 {
            let (m, b) = (self.m[i], self.b[i]);
            let w = 1.0 + mu * m;
            let over = 1.0 / w;
            x[i] = (p[i] - mu * b) * over;
            value += x[i] * (m * x[i] + 2.0 * b);
            let g = (m * p[i] + b) * over;
            slope -= 2.0 * g * g * over;
            min_factor = min_factor.min(w);
        }
        (x, [value, slope], min_factor)
    }

    /// The nearest foot of p; `None` where it cannot be separated from others.
    ///
    /// Where 1 + μM is positive definite, Q(x(μ)) decreases, so it has at most one root, and this is the nearest foot
    /// (Moré 1993).
    pub(super) fn nearest(&self, p: Vec3) -> Option<Foot> {
        let p = apply(&self.axes, p);
        let size = self.m.iter().fold(0.0f64, |a, m| a.max(m.abs()));
        let [mut low, mut high] = [f64::NEG_INFINITY, f64::INFINITY];
        for m in self.m {
            if m > 0.0 {
                low = low.max(-1.0 / m);
            } else if m < 0.0 {
                high = high.min(-1.0 / m);
            }
        }
        let mut mu = 0.0;
        for _ in 0..40 {
            let (_, [value, slope], min_factor) = self.on_curve(p, mu);
            if min_factor < DEGENERATE {
                return None;
            }
            if value > 0.0 {
                low = mu;
            } else {
                high = mu;
            }
            let step = -value / slope;
            let next = mu + step;
            // Newton's method converges quadratically: the next step is below rounding.
            if step.abs() * size <= 1e-9 * min_factor {
                return Some(self.foot(p, next));
            }
            mu = if next > low && next < high {
                next
            } else if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * mu + step.signum() / size
            };
        }
        None
    }

    /// Appends the other local minima of the distance from p, closer than `within` (mm); `false` where they cannot be
    /// separated.
    ///
    /// At such a foot 1 + μM is positive on the tangent plane, so it has at most one negative eigenvalue, −t of the
    /// largest or the smallest m, and gᵀ(1 + μM)⁻¹g ≤ 0, where Q(x(μ)) increases: with γ = Mp + b and w = 1 + μm, t³ Σ
    /// γᵢ²/wᵢ³ over the two others increases with t, so this is an interval from t = 0, with at most one root of Q. As
    /// |x − p| ≥ |γ|(1 + t)/(|m| t), small t are too far.
    pub(super) fn others(&self, p: Vec3, within: f64, out: &mut Vec<Foot>) -> bool {
        let p = apply(&self.axes, p);
        let gamma = self.half_gradient(p);
        let size = dot(p, p) + self.c.abs();
        for k in 0..3 {
            let m = self.m[k];
            let (far, own) = (within * m.abs(), gamma[k].abs());
            if far <= own {
                continue;
            }
            let ratio = [1, 2].map(|i| self.m[(k + i) % 3] / m);
            let end = (ratio.iter().filter(|r| **r > 0.0)).fold(f64::INFINITY, |e, r| e.min(1.0 / r - 1.0));
            let mut low = own / (far - own);
            if low < DEGENERATE && end > 0.0 {
                return false;
            }
            let mu = |t: f64| -(1.0 + t) / m;
            // While Q has the sign it has at t = 0 and does not decrease, the root lies ahead.
            let before = |t: f64| {
                let (_, [value, slope], _) = self.on_curve(p, mu(t));
                (slope >= 0.0).then_some((value > 0.0) == (m > 0.0))
            };
            if low >= end || before(low) != Some(true) {
                continue;
            }
            let mut high = end;
            for _ in 0..60 {
                let t = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * low + 1.0 };
                match before(t) {
                    None => high = t,
                    Some(true) => low = t,
                    Some(false) => {
                        let bracket = Bracket::of_signs(mu(low).min(mu(t)), mu(low).max(mu(t)));
                        let at = bracket.newton(mu(t), Tolerance::ROUNDING, |mu| self.on_curve(p, mu).1);
                        out.push(self.foot(p, at));
                        break;
                    }
                }
                if high - low <= 1e-9 * high {
                    // A double root is possible.
                    if self.on_curve(p, mu(low)).1[0].abs() < 1e-6 * size {
                        return false;
                    }
                    break;
                }
            }
        }
        true
    }

    fn foot(&self, p: Vec3, mu: f64) -> Foot {
        let x = self.on_curve(p, mu).0;
        let distance = norm(sub(x, p));
        Foot { p, x, mu, distance }
    }

    /// A foot refined to rounding, in space; `None` if the refinement fails.
    pub(super) fn refined(&self, foot: &Foot) -> Option<Vec3> {
        let x = self.newton(foot.p, foot.x, foot.mu)?;
        Some(apply(&transpose(&self.axes), x))
    }

    /// Newton's method on x − p + μ(Mx + b) = 0, Q(x) = 0; `None` if it does not converge.
    fn newton(&self, p: Vec3, mut x: Vec3, mut mu: f64) -> Option<Vec3> {
        let size = norm(p) + norm(x);
        for round in 0..6 {
            let g = self.half_gradient(x);
            let off = [0, 1, 2].map(|i| x[i] - p[i] + mu * g[i]);
            let q = self.value(x);
            let min_factor = norm(off) <= 1e-13 * size && q.abs() <= 1e-13 * size * norm(g);
            if min_factor || round == 5 {
                return (norm(off) <= 1e-8 * size && q.abs() <= 1e-10 * size * norm(g)).then_some(x);
            }
            let mut rows = [[0.0; 5]; 4];
            for i in 0..3 {
                rows[i][i] = 1.0 + mu * self.m[i];
                rows[i][3] = g[i];
                rows[i][4] = -off[i];
                rows[3][i] = 2.0 * g[i];
            }
            rows[3][4] = -q;
            if solve(&mut rows, 1e-12).is_none() {
                // A whole circle is equally close: any of its points serves, once it is on the quadric.
                let along = scale(g, -q / (2.0 * dot(g, g)));
                x = add(x, along);
                continue;
            }
            x = add(x, [0, 1, 2].map(|i| rows[i][4]));
            mu += rows[3][4];
        }
        None
    }
}

/// The direction from a point in the solid to its foot on a crease.
pub(super) fn outward(from: Vec3, to: Vec3) -> Vec3 {
    unit(sub(to, from))
}
