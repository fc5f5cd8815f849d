//! All feet of perpendiculars, on quadrics and on conic arcs, as roots of polynomials.
//!
//! Q(x(μ)) = 0 is a polynomial of degree six in μ. On an arc X = v + W/D, with W and D quadratic forms of sine and
//! cosine of the angle, the condition has degree four. All real roots are isolated by the roots of the derivative.

use geometry::math::{Vec3, add, apply, dot, norm, scale, sub, transpose};
use geometry::roots::{Bracket, Tolerance};

use super::super::conic::Conic;
use super::PrincipalAxes;

/// Number of azimuths tried where a whole circle is equally close.
const AZIMUTHS: usize = 32;

impl PrincipalAxes {
    /// The feet of p on the whole quadric; where p is about equally close to a circle or sphere of points, some of
    /// them.
    pub(in crate::quador) fn feet(&self, p: Vec3, out: &mut Vec<Vec3>) {
        let p = apply(&self.axes, p);
        let back = transpose(&self.axes);
        let mut put = |x: Vec3, mu: f64| {
            if let Some(x) = self.newton(p, x, mu) {
                out.push(apply(&back, x));
            }
        };
        for mu in roots(&self.polynomial(p)) {
            let x = [0, 1, 2].map(|i| (p[i] - mu * self.b[i]) / (1.0 + mu * self.m[i]));
            if x.iter().all(|v| v.is_finite()) {
                put(x, mu);
            }
        }
        // Where 1 + μm and p − μb both vanish along some axes, x is free along them except for Q = 0.
        let largest = self.m.iter().fold(0.0f64, |a, m| a.max(m.abs()));
        let size = norm(p) + self.c.abs().sqrt();
        for i in 0..3 {
            let same = |j: usize| (self.m[j] - self.m[i]).abs() <= 1e-9 * largest;
            if self.m[i].abs() < 1e-9 * largest || (0..i).any(same) {
                continue;
            }
            let mu = -1.0 / self.m[i];
            let free: Vec<usize> = (0..3).filter(|&j| same(j)).collect();
            if free.iter().any(|&j| (p[j] - mu * self.b[j]).abs() > 1e-5 * size) {
                continue;
            }
            let middle = [0, 1, 2].map(|j| {
                if free.contains(&j) {
                    -self.b[j] / self.m[j]
                } else {
                    (p[j] - mu * self.b[j]) / (1.0 + mu * self.m[j])
                }
            });
            let square = -self.value(middle) / self.m[i];
            if square.is_nan() || square < 0.0 {
                continue;
            }
            let r = square.sqrt();
            // A small remaining offset of p decides.
            let mut off = [0.0; 3];
            free.iter().for_each(|&j| off[j] = p[j] - mu * self.b[j]);
            if norm(off) > 0.0 {
                let off = scale(off, r / norm(off));
                put(add(middle, off), mu);
                put(sub(middle, off), mu);
            }
            let steps = if free.len() == 1 { 2 } else { AZIMUTHS };
            for k in 0..steps {
                let turn = (0.5 + k as f64) / steps as f64;
                let (sin, cos) = (turn * core::f64::consts::TAU).sin_cos();
                let mut x = middle;
                match free[..] {
                    [j] => x[j] += if k == 0 { r } else { -r },
                    [j, l] => {
                        x[j] += r * cos;
                        x[l] += r * sin;
                    }
                    _ => {
                        // A spiral from pole to pole.
                        let z = 2.0 * turn - 1.0;
                        let (sin, cos) = (k as f64 * 2.4).sin_cos();
                        let rho = r * (1.0 - z * z).sqrt();
                        x = add(x, [rho * cos, rho * sin, r * z]);
                    }
                }
                put(x, mu);
            }
        }
    }

    /// The coefficients of Q(x(μ)) Π (1 + μmᵢ)², constant term first.
    fn polynomial(&self, p: Vec3) -> [f64; 7] {
        let squares = [0, 1, 2].map(|i| {
            let m = self.m[i];
            [1.0, 2.0 * m, m * m]
        });
        let times = |a: &[f64], b: &[f64], out: &mut [f64; 7], s: f64| {
            for (i, a) in a.iter().enumerate() {
                for (j, b) in b.iter().enumerate() {
                    out[i + j] += s * a * b;
                }
            }
        };
        let mut all = [0.0; 7];
        for i in 0..3 {
            let (m, b, p) = (self.m[i], self.b[i], p[i]);
            // m (p − μb)² + 2b (p − μb)(1 + μm).
            let own = [p * (m * p + 2.0 * b), 2.0 * b * (p * m - b) - 2.0 * m * p * b, m * b * b - 2.0 * b * b * m];
            let mut rest = [0.0; 7];
            times(&squares[(i + 1) % 3], &squares[(i + 2) % 3], &mut rest, 1.0);
            times(&own, &rest[..5], &mut all, 1.0);
        }
        let mut rest = [0.0; 7];
        times(&squares[0], &squares[1], &mut rest, 1.0);
        times(&squares[2], &rest[..5], &mut all, self.c);
        all
    }
}

/// The points of an arc at which the distance to p is stationary, and its ends.
pub(in crate::quador) fn feet_on_conic(c: &Conic, p: Vec3, out: &mut Vec<Vec3>) {
    let a = sub(c.v, p);
    // With t = tan θ: D = d₀ + d₁t + d₂t², X − p = (a D − q (t e₁ + t² e₂))/D.
    let d = [c.m[0], 2.0 * c.m[1], c.m[2]];
    let w = [scale(a, d[0]), sub(scale(a, d[1]), scale(c.e[0], c.q)), sub(scale(a, d[2]), scale(c.e[1], c.q))];
    let n = [
        dot(w[0], w[0]),
        2.0 * dot(w[0], w[1]),
        dot(w[1], w[1]) + 2.0 * dot(w[0], w[2]),
        2.0 * dot(w[1], w[2]),
        dot(w[2], w[2]),
    ];
    // N'D − 2ND'; the terms of degree five cancel.
    let mut f = [0.0; 6];
    for i in 0..5 {
        for j in 0..3 {
            if i + j > 0 {
                f[i + j - 1] += (i as f64 - 2.0 * j as f64) * n[i] * d[j];
            }
        }
    }
    for t in roots(&f[..5]) {
        let theta = t.atan();
        let theta = if theta < 0.0 { theta + core::f64::consts::PI } else { theta };
        if theta < c.end {
            out.push(c.at(theta));
        }
    }
    for theta in [0.0, core::f64::consts::FRAC_PI_2, c.end] {
        if theta <= c.end {
            out.push(c.at(theta));
        }
    }
}

/// The real roots of c₀ + c₁x + …, ascending; and those of its derivative that are nearly double roots.
fn roots(c: &[f64]) -> Vec<f64> {
    let largest = c.iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let mut n = c.len();
    while n > 1 && c[n - 1].abs() <= 1e-15 * largest {
        n -= 1;
    }
    let c = &c[..n];
    if n < 2 {
        return Vec::new();
    }
    if n == 2 {
        return vec![-c[0] / c[1]];
    }
    let value = |x: f64| c.iter().rev().fold(0.0, |v, a| v * x + a);
    let slope = |x: f64| (1..n).rev().fold(0.0, |v, k| v * x + k as f64 * c[k]);
    let noise = |x: f64| c.iter().rev().fold(0.0, |v: f64, a| v * x.abs() + a.abs()) * 1e-14;
    let derived: Vec<f64> = (1..n).map(|k| k as f64 * c[k]).collect();
    // Fujiwara's bound of all roots.
    let lead = c[n - 1];
    let bound = (0..n - 1).map(|k| 2.0 * (c[k] / lead).abs().powf(1.0 / (n - 1 - k) as f64)).fold(0.0, f64::max) * 1.01;
    let mut stops = vec![-bound];
    stops.extend(roots(&derived).into_iter().filter(|x| x.abs() < bound));
    stops.push(bound);
    let mut out = Vec::new();
    for (k, &x) in stops.iter().enumerate() {
        if k > 0 && k + 1 < stops.len() && value(x).abs() <= noise(x).max(1e-12 * largest) {
            out.push(x);
        }
        let Some(&y) = stops.get(k + 1) else { break };
        if (value(y) > 0.0) == (value(x) > 0.0) {
            continue;
        }
        let bracket = Bracket::new([x, value(x)], [y, value(y)]);
        let root = |b: Bracket| b.newton((x + y) / 2.0, Tolerance::ROUNDING, |x| [value(x), slope(x)]);
        out.extend(bracket.map(root));
    }
    out.sort_by(f64::total_cmp);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quador::hub_quadric::Quadric;
    use crate::quador::tests::Random;
    use geometry::math::unit;

    #[test]
    fn all_real_roots_are_found() {
        let mut random = Random(5);
        for _ in 0..2000 {
            let n = 1 + (6.0 * random.next()) as usize;
            let mut want: Vec<f64> = (0..n).map(|_| 6.0 * random.next() - 3.0).collect();
            want.sort_by(f64::total_cmp);
            if want.windows(2).any(|w| w[1] - w[0] < 0.05) {
                continue;
            }
            let mut c = vec![1.0];
            for r in &want {
                let mut next = vec![0.0; c.len() + 1];
                for (k, a) in c.iter().enumerate() {
                    next[k + 1] += a;
                    next[k] -= a * r;
                }
                c = next;
            }
            let got = roots(&c);
            for r in &want {
                // Six roots within six units, pairwise 0.05 apart: a root moves by at most 1e-16 · 4⁶/0.05⁵.
                assert!(got.iter().any(|g| (g - r).abs() < 1e-6), "{want:?} {got:?}");
            }
        }
    }

    #[test]
    fn feet_are_stationary_and_the_nearest_is_among_them() {
        let mut random = Random(7);
        for _ in 0..300 {
            let mut q = Quadric { m: geometry::math::IDENTITY, b: [0.0; 3], c: -1.0 };
            for _ in 0..2 {
                let g = crate::quador::affine_function::AffineFunction {
                    a: scale(random.direction(), 1.2 * random.next()),
                    b: random.next() - 0.7,
                };
                q.add_square(-random.next(), &g);
            }
            let p = scale(random.direction(), 3.0 * random.next());
            let mut feet = Vec::new();
            PrincipalAxes::new(&q).feet(p, &mut feet);
            let mut least = f64::INFINITY;
            for x in &feet {
                assert!(q.at(*x).abs() < 1e-9 * (1.0 + dot(*x, *x)));
                let g = unit(q.half_gradient(*x));
                let across = sub(sub(p, *x), scale(g, dot(sub(p, *x), g)));
                assert!(norm(across) < 1e-6 * (1.0 + norm(*x)), "{across:?}");
                least = least.min(norm(sub(p, *x)));
            }
            for _ in 0..2000 {
                let x = scale(random.direction(), 1.0);
                let t = q.ray_exit(x);
                if t > 0.0 && t < 1e3 {
                    assert!(norm(sub(scale(x, t), p)) > least - 1e-9, "{q:?} {p:?}");
                }
            }
        }
    }
}
