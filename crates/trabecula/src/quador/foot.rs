//! Where the distance from a point to a quadric, or to an arc of a conic, is stationary.
//!
//! At a foot x of p on Q(x) = xᵀMx + 2 b·x + c = 0, p − x is along the slope: (1 + μM) x = p − μb. Along M's own axes that is
//! xᵢ = (pᵢ − μbᵢ)/(1 + μmᵢ), and Q(x(μ)) = 0 is a polynomial of degree six in μ. On an arc X = v + W/D with W and D quadratic
//! forms of the angle's sine and cosine, it is one of degree four. All real roots are found, between those of the derivative,
//! and each foot is then brought to the last digit by Newton's method.

use crate::math::{Mat3, Vec3, add, apply, dot, eigen, norm, root, scale, sub, transpose, unit};

use super::quadric::{Conic, Quadric};

/// A quadric along its own axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    /// The axes, rows.
    turn: Mat3,
    m: Vec3,
    b: Vec3,
    c: f64,
}

/// A foot along the axes of its quadric.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    p: Vec3,
    x: Vec3,
    mu: f64,
    /// How far it is from p.
    pub away: f64,
}

/// 1 + μm below which a foot is not told from a circle of them.
const DEGENERATE: f64 = 1e-5;
/// Azimuths that are tried where a whole circle is equally near.
const ROUND: usize = 32;

impl Axes {
    pub(super) fn new(q: &Quadric) -> Axes {
        let (m, turn) = eigen(&q.m);
        Axes {
            turn,
            m,
            b: apply(&turn, q.b),
            c: q.c,
        }
    }

    fn value(&self, x: Vec3) -> f64 {
        self.c
            + (0..3)
                .map(|i| x[i] * (self.m[i] * x[i] + 2.0 * self.b[i]))
                .sum::<f64>()
    }

    fn half_slope(&self, x: Vec3) -> Vec3 {
        [0, 1, 2].map(|i| self.m[i] * x[i] + self.b[i])
    }

    /// x(μ), Q there, its derivative, and the least 1 + μm.
    #[inline]
    fn along(&self, p: Vec3, mu: f64) -> (Vec3, [f64; 2], f64) {
        let (mut value, mut slope, mut near) = (self.c, 0.0, f64::INFINITY);
        let mut x = [0.0; 3];
        for i in 0..3 {
            let (m, b) = (self.m[i], self.b[i]);
            let w = 1.0 + mu * m;
            let over = 1.0 / w;
            x[i] = (p[i] - mu * b) * over;
            value += x[i] * (m * x[i] + 2.0 * b);
            let g = (m * p[i] + b) * over;
            slope -= 2.0 * g * g * over;
            near = near.min(w);
        }
        (x, [value, slope], near)
    }

    /// The nearest of all feet of p; `None` where it is not told from others.
    ///
    /// Where 1 + μM is positive Q(x(μ)) falls, so it has one root at most, and the nearest foot is there (Moré 1993).
    pub(super) fn nearest(&self, p: Vec3) -> Option<Foot> {
        let p = apply(&self.turn, p);
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
            let (_, [value, slope], near) = self.along(p, mu);
            if near < DEGENERATE {
                return None;
            }
            if value > 0.0 {
                low = mu;
            } else {
                high = mu;
            }
            let step = -value / slope;
            let next = mu + step;
            // Newton's steps square: the next one is below the last digit.
            if step.abs() * size <= 1e-9 * near {
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

    /// The other feet of p within a distance from which the distance grows on all sides; `false` where they are not told apart.
    ///
    /// There 1 + μM is positive across g, so it has one negative eigenvalue at most, −t of the greatest or the least m, and
    /// gᵀ(1 + μM)⁻¹g ≤ 0, which is where Q(x(μ)) rises: with γ = Mp + b and w = 1 + μm, t³ Σ γᵢ²/wᵢ³ of the two others grows with
    /// t, so this is from t = 0 up to some t, and Q has one root there at most. As |x − p| ≥ |γ|(1 + t)/(|m| t) small t are too far.
    pub(super) fn others(&self, p: Vec3, within: f64, out: &mut Vec<Foot>) -> bool {
        let p = apply(&self.turn, p);
        let gamma = self.half_slope(p);
        let size = dot(p, p) + self.c.abs();
        for k in 0..3 {
            let m = self.m[k];
            let (far, own) = (within * m.abs(), gamma[k].abs());
            if far <= own {
                continue;
            }
            let ratio = [1, 2].map(|i| self.m[(k + i) % 3] / m);
            let end = (ratio.iter().filter(|r| **r > 0.0))
                .fold(f64::INFINITY, |e, r| e.min(1.0 / r - 1.0));
            let mut low = own / (far - own);
            if low < DEGENERATE && end > 0.0 {
                return false;
            }
            let mu = |t: f64| -(1.0 + t) / m;
            // Of Q's sign at t = 0 there is no root before where it changes, or where Q falls.
            let before = |t: f64| {
                let (_, [value, slope], _) = self.along(p, mu(t));
                (slope >= 0.0).then_some((value > 0.0) == (m > 0.0))
            };
            if low >= end || before(low) != Some(true) {
                continue;
            }
            let mut high = end;
            for _ in 0..60 {
                let t = if high.is_finite() {
                    0.5 * (low + high)
                } else {
                    2.0 * low + 1.0
                };
                match before(t) {
                    None => high = t,
                    Some(true) => low = t,
                    Some(false) => {
                        let ends = [mu(low).min(mu(t)), mu(low).max(mu(t))];
                        let near = [0.0, 4.0 * f64::EPSILON];
                        let at = root(ends, mu(t), true, near, |mu| self.along(p, mu).1);
                        out.push(self.foot(p, at));
                        break;
                    }
                }
                if high - low <= 1e-9 * high {
                    // Q may touch zero.
                    if self.along(p, mu(low)).1[0].abs() < 1e-6 * size {
                        return false;
                    }
                    break;
                }
            }
        }
        true
    }

    fn foot(&self, p: Vec3, mu: f64) -> Foot {
        let x = self.along(p, mu).0;
        let away = norm(sub(x, p));
        Foot { p, x, mu, away }
    }

    /// A foot brought to the last digit, where it lies in space.
    pub(super) fn place(&self, foot: &Foot) -> Option<Vec3> {
        let x = self.polished(foot.p, foot.x, foot.mu)?;
        Some(apply(&transpose(&self.turn), x))
    }

    /// The feet of p on the whole quadric; where p is about as near to all of a circle or sphere, some places of it.
    pub(super) fn feet(&self, p: Vec3, out: &mut Vec<Vec3>) {
        let p = apply(&self.turn, p);
        let back = transpose(&self.turn);
        let mut put = |x: Vec3, mu: f64| {
            if let Some(x) = self.polished(p, x, mu) {
                out.push(apply(&back, x));
            }
        };
        for mu in roots(&self.polynomial(p)) {
            let x = [0, 1, 2].map(|i| (p[i] - mu * self.b[i]) / (1.0 + mu * self.m[i]));
            if x.iter().all(|v| v.is_finite()) {
                put(x, mu);
            }
        }
        // Where 1 + μm vanishes along some axes and p − μb does too, x is free along them but for Q.
        let largest = self.m.iter().fold(0.0f64, |a, m| a.max(m.abs()));
        let size = norm(p) + self.c.abs().sqrt();
        for i in 0..3 {
            let same = |j: usize| (self.m[j] - self.m[i]).abs() <= 1e-9 * largest;
            if self.m[i].abs() < 1e-9 * largest || (0..i).any(same) {
                continue;
            }
            let mu = -1.0 / self.m[i];
            let free: Vec<usize> = (0..3).filter(|&j| same(j)).collect();
            if free
                .iter()
                .any(|&j| (p[j] - mu * self.b[j]).abs() > 1e-5 * size)
            {
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
            // What little p is off decides, if it is.
            let mut off = [0.0; 3];
            free.iter().for_each(|&j| off[j] = p[j] - mu * self.b[j]);
            if norm(off) > 0.0 {
                let off = scale(off, r / norm(off));
                put(add(middle, off), mu);
                put(sub(middle, off), mu);
            }
            let steps = if free.len() == 1 { 2 } else { ROUND };
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

    /// Q(x(μ)) Π (1 + μmᵢ)², from the constant on.
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
            let own = [
                p * (m * p + 2.0 * b),
                2.0 * b * (p * m - b) - 2.0 * m * p * b,
                m * b * b - 2.0 * b * b * m,
            ];
            let mut rest = [0.0; 7];
            times(&squares[(i + 1) % 3], &squares[(i + 2) % 3], &mut rest, 1.0);
            times(&own, &rest[..5], &mut all, 1.0);
        }
        let mut rest = [0.0; 7];
        times(&squares[0], &squares[1], &mut rest, 1.0);
        times(&squares[2], &rest[..5], &mut all, self.c);
        all
    }

    /// Newton's method on x − p + μ(Mx + b) = 0, Q(x) = 0; `None` if it does not lead there.
    fn polished(&self, p: Vec3, mut x: Vec3, mut mu: f64) -> Option<Vec3> {
        let size = norm(p) + norm(x);
        for round in 0..6 {
            let g = self.half_slope(x);
            let off = [0, 1, 2].map(|i| x[i] - p[i] + mu * g[i]);
            let q = self.value(x);
            let near = norm(off) <= 1e-13 * size && q.abs() <= 1e-13 * size * norm(g);
            if near || round == 5 {
                return (norm(off) <= 1e-8 * size && q.abs() <= 1e-10 * size * norm(g))
                    .then_some(x);
            }
            let mut rows = [[0.0; 5]; 4];
            for i in 0..3 {
                rows[i][i] = 1.0 + mu * self.m[i];
                rows[i][3] = g[i];
                rows[i][4] = -off[i];
                rows[3][i] = 2.0 * g[i];
            }
            rows[3][4] = -q;
            let Some(step) = solve(rows) else {
                // All of a circle is as near: this place of it is as good as any, once it is on the quadric.
                let along = scale(g, -q / (2.0 * dot(g, g)));
                x = add(x, along);
                continue;
            };
            x = add(x, [step[0], step[1], step[2]]);
            mu += step[3];
        }
        None
    }
}

/// The solution of four linear equations; `None` if they are dependent but for rounding.
fn solve(mut rows: [[f64; 5]; 4]) -> Option<[f64; 4]> {
    let largest = rows
        .iter()
        .flat_map(|r| &r[..4])
        .fold(0.0f64, |a, v| a.max(v.abs()));
    for c in 0..4 {
        let best = (c..4).max_by(|&i, &j| rows[i][c].abs().total_cmp(&rows[j][c].abs()))?;
        rows.swap(c, best);
        if rows[c][c].abs() <= 1e-12 * largest {
            return None;
        }
        for r in c + 1..4 {
            let f = rows[r][c] / rows[c][c];
            for k in c..5 {
                rows[r][k] -= f * rows[c][k];
            }
        }
    }
    let mut x = [0.0; 4];
    for r in (0..4).rev() {
        let sum: f64 = (r + 1..4).map(|k| rows[r][k] * x[k]).sum();
        x[r] = (rows[r][4] - sum) / rows[r][r];
    }
    Some(x)
}

/// The places of an arc from which its distance to p is stationary, and its ends.
pub(super) fn feet_on_arc(c: &Conic, p: Vec3, out: &mut Vec<Vec3>) {
    let a = sub(c.v, p);
    // With t = tan θ: D = d₀ + d₁t + d₂t², X − p = (a D − q (t e₁ + t² e₂))/D.
    let d = [c.m[0], 2.0 * c.m[1], c.m[2]];
    let w = [
        scale(a, d[0]),
        sub(scale(a, d[1]), scale(c.e[0], c.q)),
        sub(scale(a, d[2]), scale(c.e[1], c.q)),
    ];
    let n = [
        dot(w[0], w[0]),
        2.0 * dot(w[0], w[1]),
        dot(w[1], w[1]) + 2.0 * dot(w[0], w[2]),
        2.0 * dot(w[1], w[2]),
        dot(w[2], w[2]),
    ];
    // N'D − 2ND'; the fifth powers cancel.
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
        let theta = if theta < 0.0 {
            theta + core::f64::consts::PI
        } else {
            theta
        };
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

/// The real roots of c₀ + c₁x + …, ascending, and of its derivatives what is nearly a double root.
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
    let bound = (0..n - 1)
        .map(|k| 2.0 * (c[k] / lead).abs().powf(1.0 / (n - 1 - k) as f64))
        .fold(0.0, f64::max)
        * 1.01;
    let mut stops = vec![-bound];
    stops.extend(roots(&derived).into_iter().filter(|x| x.abs() < bound));
    stops.push(bound);
    let mut out = Vec::new();
    for (k, &x) in stops.iter().enumerate() {
        if k > 0 && k + 1 < stops.len() && value(x).abs() <= noise(x).max(1e-12 * largest) {
            out.push(x);
        }
        let Some(&y) = stops.get(k + 1) else { break };
        let rising = value(y) > 0.0;
        if rising == (value(x) > 0.0) {
            continue;
        }
        let near = [0.0, 4.0 * f64::EPSILON];
        out.push(root([x, y], (x + y) / 2.0, rising, near, |x| {
            [value(x), slope(x)]
        }));
    }
    out.sort_by(f64::total_cmp);
    out
}

/// A direction out of the solid at a foot on a crease: away from the point within.
pub(super) fn away(from: Vec3, to: Vec3) -> Vec3 {
    unit(sub(to, from))
}

#[cfg(test)]
mod tests {
    use super::super::tests::Random;
    use super::*;

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
                // Six roots within six units, no two nearer than 0.05: a root moves by 1e-16 · 4⁶/0.05⁵ at worst.
                assert!(got.iter().any(|g| (g - r).abs() < 1e-6), "{want:?} {got:?}");
            }
        }
    }

    #[test]
    fn feet_are_stationary_and_the_nearest_is_among_them() {
        let mut random = Random(7);
        for _ in 0..300 {
            let mut q = Quadric {
                m: crate::math::IDENTITY,
                b: [0.0; 3],
                c: -1.0,
            };
            for _ in 0..2 {
                let g = super::super::hub::Affine {
                    a: scale(random.direction(), 1.2 * random.next()),
                    b: random.next() - 0.7,
                };
                q.square(-random.next(), &g);
            }
            let p = scale(random.direction(), 3.0 * random.next());
            let mut feet = Vec::new();
            Axes::new(&q).feet(p, &mut feet);
            let mut least = f64::INFINITY;
            for x in &feet {
                assert!(q.at(*x).abs() < 1e-9 * (1.0 + dot(*x, *x)));
                let g = unit(q.half_slope(*x));
                let across = sub(sub(p, *x), scale(g, dot(sub(p, *x), g)));
                assert!(norm(across) < 1e-6 * (1.0 + norm(*x)), "{across:?}");
                least = least.min(norm(sub(p, *x)));
            }
            for _ in 0..2000 {
                let x = scale(random.direction(), 1.0);
                let t = q.exit(x);
                if t > 0.0 && t < 1e3 {
                    assert!(norm(sub(scale(x, t), p)) > least - 1e-9, "{q:?} {p:?}");
                }
            }
        }
    }
}
