//! Fourier series on the torus: f(u) = Σ amplitude · cos 2π(h·u + phase).

use std::collections::HashMap;

use geometry::fault::Fault;
use geometry::math::{Complex, Mat3, Vec3, complex_product, dot, scale, sin_cos_turns};

mod kernel;

use kernel::{Wave, evaluate, fill};

/// One plane wave: amplitude · cos 2π(h·u + phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Integers (h, k, l).
    pub hkl: [i32; 3],
    /// Amplitude.
    pub amplitude: f64,
    /// Phase in turns.
    pub phase: f64,
}

/// A finite sum of plane waves, at most one for each ± wave vector.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    terms: Vec<Term>,
    /// The same, prepared for evaluation.
    waves: Vec<Wave>,
    /// The largest |h|, |k| or |l|.
    top: usize,
}

/// Largest |h|, |k| or |l|: beyond it a "cell" is no longer one and the tables of powers grow.
pub const MAX_INDEX: i32 = 64;

impl Series {
    /// A series from terms. Terms of equal or opposite wave vector are merged, vanishing ones dropped.
    ///
    /// # Errors
    /// Non-finite numbers, indices beyond ±64, or a sum that is constant (it has no surface).
    pub fn new(terms: Vec<Term>) -> Result<Series, Fault> {
        let mut sums: Vec<([i32; 3], f64, f64)> = Vec::new();
        let mut indices = HashMap::new();
        let mut largest: f64 = 0.0;
        for (i, t) in terms.iter().enumerate() {
            let at = |key: &str| format!("terms[{i}].{key}");
            if let Some(h) = t.hkl.iter().find(|h| h.unsigned_abs() > MAX_INDEX as u32) {
                return Err(Fault::new(
                    at("hkl"),
                    format!("{h} is out of range; indices run from -{MAX_INDEX} to {MAX_INDEX}"),
                ));
            }
            for (key, v) in [("amplitude", t.amplitude), ("phase", t.phase)] {
                if !v.is_finite() {
                    return Err(Fault::new(at(key), format!("{v} is not a number; give a finite one")));
                }
            }
            if t.amplitude.abs() > 1e100 {
                let message = format!("{:e} is out of range; an amplitude is at most 1e100 either way", t.amplitude);
                return Err(Fault::new(at("amplitude"), message));
            }
            largest = largest.max(t.amplitude.abs());
            // cos(−a) = cos(a): one wave vector of each pair represents both.
            let first = t.hkl.iter().find(|h| **h != 0).copied().unwrap_or(1);
            let s = first.signum();
            let hkl = t.hkl.map(|h| h * s);
            let (im, re) = sin_cos_turns(t.phase * f64::from(s));
            let (re, im) = (t.amplitude * re, t.amplitude * im);
            let index = *indices.entry(hkl).or_insert(sums.len());
            match sums.get_mut(index) {
                Some(e) => (e.1, e.2) = (e.1 + re, e.2 + im),
                None => sums.push((hkl, re, im)),
            }
        }
        let terms: Vec<Term> = sums
            .into_iter()
            .map(|(hkl, re, im)| Term { hkl, amplitude: re.hypot(im), phase: im.atan2(re) / core::f64::consts::TAU })
            .map(|t| {
                if t.hkl == [0; 3] {
                    Term { amplitude: t.amplitude * sin_cos_turns(t.phase).1, phase: 0.0, ..t }
                } else {
                    t
                }
            })
            .filter(|t| t.amplitude.abs() > 1e-14 * largest)
            .collect();
        if terms.iter().all(|t| t.hkl == [0; 3]) {
            return Err(Fault::new(
                "terms",
                "the sum is constant, so it has no surface; give at least one term with hkl other than [0, 0, 0]",
            ));
        }
        Ok(Series::of(terms))
    }

    /// The series of the `count` largest waves of a function given at the nodes (i, j, k) / shape of the torus, x fastest:
    /// its discrete Fourier transform, truncated. Also the root mean square of what is left out, over that of the function
    /// less its mean. Waves up to a quarter of the nodes along each axis are kept at most.
    ///
    /// # Errors
    /// Fewer than four nodes along an axis, numbers that are not finite, a function that is constant.
    pub fn sampled(values: &[f64], shape: [usize; 3], count: usize) -> Result<(Series, f64), Fault> {
        use rustfft::{FftDirection, FftPlannerScalar, num_complex::Complex64};
        let all: usize = shape.iter().product();
        if shape.iter().any(|n| *n < 4) || values.len() != all {
            return Err(Fault::new("path", format!("a cell of {shape:?} numbers; give at least four along each axis")));
        }
        if let Some(n) = values.iter().position(|v| !v.is_finite()) {
            let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            return Err(Fault::new("path", format!("the number at {at:?} is {}; all must be finite", values[n])));
        }
        let mut f: Vec<Complex64> = values.iter().map(|v| Complex64::new(*v, 0.0)).collect();
        let mut planner = FftPlannerScalar::new();
        for axis in 0..3 {
            let (n, stride) = (shape[axis], shape[..axis].iter().product::<usize>());
            let plan = planner.plan_fft(n, FftDirection::Forward);
            let mut line = vec![Complex64::default(); n];
            for first in (0..all).filter(|i| i / stride % n == 0) {
                (0..n).for_each(|k| line[k] = f[first + k * stride]);
                plan.process(&mut line);
                (0..n).for_each(|k| f[first + k * stride] = line[k]);
            }
        }
        let wave = |n: usize| -> [i32; 3] {
            let at = [n % shape[0], n / shape[0] % shape[1], n / shape[0] / shape[1]];
            core::array::from_fn(|a| {
                let (i, n) = (at[a] as i32, shape[a] as i32);
                if 2 * i > n { i - n } else { i }
            })
        };
        // One of each pair of opposite waves represents both.
        let mut waves: Vec<(f64, [i32; 3], Complex64)> = (0..all)
            .map(|n| (wave(n), f[n] / all as f64))
            .filter(|(h, _)| h.iter().find(|v| **v != 0).is_none_or(|v| *v > 0))
            .map(|(h, c)| (c.norm(), h, c))
            .collect();
        let energy = f[1..].iter().map(|c| c.norm_sqr()).sum::<f64>() / (all as f64).powi(2);
        waves.retain(|(_, h, _)| {
            (0..3).all(|a| h[a].unsigned_abs() as usize <= (shape[a] / 4).clamp(1, MAX_INDEX as usize))
        });
        // Of equal ones the shorter, then by their indices, so that the choice is always the same.
        let length = |h: &[i32; 3]| h.iter().map(|v| v * v).sum::<i32>();
        let rounded = |v: f64| (v * 1e12).round();
        waves.sort_by(|a, b| {
            let by_size = rounded(b.0).total_cmp(&rounded(a.0));
            by_size.then(length(&a.1).cmp(&length(&b.1))).then(a.1.cmp(&b.1))
        });
        waves.truncate(count.max(1));
        let kept: f64 = waves.iter().filter(|w| w.1 != [0; 3]).map(|w| 2.0 * w.0 * w.0).sum();
        let terms = waves.iter().map(|(size, h, c)| Term {
            hkl: *h,
            amplitude: if *h == [0; 3] { c.re } else { 2.0 * size },
            phase: if *h == [0; 3] { 0.0 } else { c.im.atan2(c.re) / core::f64::consts::TAU },
        });
        let series = Series::new(terms.collect())
            .map_err(|_| Fault::new("path", "the numbers of the cell do not vary, so it has no surface"))?;
        Ok((series, ((energy - kept).max(0.0) / energy).sqrt()))
    }

    fn of(terms: Vec<Term>) -> Series {
        let waves = terms.iter().map(Wave::new).collect();
        let all = terms.iter().flat_map(|t| t.hkl);
        let top = all.map(i32::unsigned_abs).max().unwrap_or(0) as usize;
        Series { terms, waves, top }
    }

    /// The terms.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// A bound of |f|: the sum of the amplitudes.
    pub fn amplitude(&self) -> f64 {
        self.terms.iter().map(|t| t.amplitude.abs()).sum()
    }

    /// A bound of the largest second derivative of f in any direction of phase space: Σ |amplitude| |2πh|².
    pub fn curvature(&self) -> f64 {
        let squared = |h: [i32; 3]| h.iter().map(|&v| f64::from(v * v)).sum::<f64>();
        self.terms.iter().map(|t| t.amplitude.abs() * core::f64::consts::TAU.powi(2) * squared(t.hkl)).sum()
    }

    /// The series whose value at a point is the mean of this one over the cube of edge `h` (turns) about the point.
    pub fn averaged(&self, h: f64) -> Series {
        let sinc = |k: i32| {
            let x = core::f64::consts::PI * f64::from(k) * h;
            if x == 0.0 { 1.0 } else { x.sin() / x }
        };
        let mean = |t: &Term| Term { amplitude: t.amplitude * t.hkl.iter().map(|&k| sinc(k)).product::<f64>(), ..*t };
        Series::of(self.terms.iter().map(mean).collect())
    }

    /// The largest |h|, |k| or |l|.
    pub fn top(&self) -> usize {
        self.top
    }

    /// The frequency of the finest waves that matter (cycles a cell): the greatest |(h, k, l)| such that waves at and above
    /// it carry at least a twentieth of the variance.
    pub fn frequency(&self) -> f64 {
        let norm = |t: &Term| t.hkl.iter().map(|&k| f64::from(k * k)).sum::<f64>().sqrt();
        let mut waves: Vec<(f64, f64)> = self.terms.iter().map(|t| (norm(t), t.amplitude.powi(2))).collect();
        waves.retain(|w| w.0 > 0.0);
        waves.sort_by(|a, b| b.0.total_cmp(&a.0));
        let enough = waves.iter().map(|w| w.1).sum::<f64>() / 20.0;
        let mut carried = 0.0;
        let found = waves.iter().find(|(_, power)| {
            carried += power;
            carried >= enough
        });
        found.map_or(1.0, |w| w.0)
    }

    /// The series with the greatest common factor of its indices taken out along each axis, and the factors. The
    /// function repeats that often within the cell, so what does not depend on lengths is the same for both.
    pub fn reduced(&self) -> (Series, [i32; 3]) {
        let gcd = |mut a: i32, mut b: i32| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a.abs()
        };
        let factor = |a: usize| self.terms.iter().fold(0, |g, t| gcd(g, t.hkl[a])).max(1);
        let factors = [0, 1, 2].map(factor);
        let divided = |t: &Term| Term { hkl: [0, 1, 2].map(|a| t.hkl[a] / factors[a]), ..*t };
        (Series::of(self.terms.iter().map(divided).collect()), factors)
    }

    /// The same series less a constant: its surface f = 0 is this one's f = `level`.
    ///
    /// # Errors
    /// A level that is not finite.
    pub fn about(&self, level: f64) -> Result<Series, Fault> {
        let constant = Term { hkl: [0; 3], amplitude: -level, phase: 0.0 };
        Series::new(self.terms.iter().copied().chain([constant]).collect())
    }

    /// The series times a factor.
    pub fn scaled(&self, by: f64) -> Series {
        let times = |t: &Term| Term { amplitude: t.amplitude * by, ..*t };
        Series::of(self.terms.iter().map(times).collect())
    }

    /// Value, gradient (per turn) and second derivatives at one phase.
    pub fn second(&self, u: Vec3) -> (f64, Vec3, Mat3) {
        let (mut f, mut g, mut h) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        for t in &self.terms {
            let k = t.hkl.map(f64::from);
            let (s, c) = sin_cos_turns(dot(k, u) + t.phase);
            let (s, c) = (t.amplitude * s, t.amplitude * c);
            f += c;
            let k = scale(k, core::f64::consts::TAU);
            for i in 0..3 {
                g[i] -= s * k[i];
                for j in 0..3 {
                    h[i][j] -= c * k[i] * k[j];
                }
            }
        }
        (f, g, h)
    }

    /// Values and gradients (per turn) at phases `u` (turns). The three slices have equal length.
    ///
    /// The arithmetic of a point does not depend on its index in the batch, so equal points give equal bits.
    pub fn gradients(&self, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        evaluate(&self.waves, self.top, u, values, gradients);
    }

    /// Values at phases given coordinate by coordinate, in single precision: phases are reduced in double precision, and
    /// what rounding then leaves is about 1e-6 of the sum of the amplitudes.
    pub fn fill(&self, u: &[Vec<f64>; 3], out: &mut [f32]) {
        let waves: Vec<([i32; 3], f32, f32)> = self.waves.iter().map(|w| (w.hkl, w.re as f32, w.im as f32)).collect();
        fill(&waves, self.top, u, out);
    }

    /// Values and gradients (per turn) on a row: x (turns) varies, y and z are the same. Waves of equal |h| are added
    /// up first, so that a node costs as much as there are different |h|, however many terms.
    pub fn row(&self, x: &[f64], [y, z]: [f64; 2], values: &mut [f64], gradients: &mut [Vec3]) {
        let powers = |v: f64| -> Vec<Complex> {
            let top = self.top as i32;
            (-top..=top).map(|n| sin_cos_turns(f64::from(n) * v)).map(|(s, c)| (c, s)).collect()
        };
        let (along_y, along_z) = (powers(y), powers(z));
        let at = |table: &[Complex], n: i32| table[(n + self.top as i32) as usize];
        // For each |h|: Σ c, Σ k c, Σ l c with c = amplitude · e^{2πi(k y + l z + phase)}, h made positive.
        let mut sums = vec![[(0.0, 0.0); 3]; self.top + 1];
        for w in &self.waves {
            let s = if w.hkl[0] < 0 { -1 } else { 1 };
            let [h, k, l] = w.hkl.map(|n| n * s);
            let phase = (w.re, w.im * f64::from(s));
            let c = complex_product(complex_product(phase, at(&along_y, k)), at(&along_z, l));
            for (sum, factor) in sums[h as usize].iter_mut().zip([1, k, l]) {
                let factor = f64::from(factor);
                *sum = (sum.0 + factor * c.0, sum.1 + factor * c.1);
            }
        }
        values.fill(0.0);
        gradients.fill([0.0; 3]);
        for (h, sum) in sums.iter().enumerate() {
            if sum.iter().all(|c| *c == (0.0, 0.0)) {
                continue;
            }
            let h = h as f64;
            for ((x, v), g) in x.iter().zip(&mut *values).zip(&mut *gradients) {
                let (s, c) = sin_cos_turns(h * x);
                let z = sum.map(|a| complex_product(a, (c, s)));
                *v += z[0].0;
                let slopes = [h * z[0].1, z[1].1, z[2].1];
                for (g, slope) in g.iter_mut().zip(slopes) {
                    *g -= core::f64::consts::TAU * slope;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn term(hkl: [i32; 3], amplitude: f64, phase: f64) -> Term {
        Term { hkl, amplitude, phase }
    }

    #[test]
    fn opposite_waves_merge_and_constants_are_refused() {
        let s = Series::new(vec![term([1, 0, 0], 1.0, 0.1), term([-1, 0, 0], 1.0, -0.1)]).expect("valid");
        assert_eq!(s.terms().len(), 1);
        assert!((s.terms()[0].amplitude - 2.0).abs() < 1e-15);
        assert!(Series::new(vec![term([0, 0, 0], 1.0, 0.0)]).is_err());
        assert!(Series::new(vec![term([1, 0, 0], 1.0, 0.0), term([1, 0, 0], 1.0, 0.5)]).is_err());
        assert!(Series::new(vec![term([65, 0, 0], 1.0, 0.0)]).is_err());
        assert!(Series::new(vec![term([1, 0, 0], f64::NAN, 0.0)]).is_err());
    }

    #[test]
    fn a_series_comes_back_from_its_samples_and_truncation_is_told() {
        let s = Series::new(vec![
            term([1, -2, 0], 0.7, 0.13),
            term([0, 3, 1], -0.4, 0.0),
            term([2, 2, -2], 0.2, 0.25),
            term([0, 0, 0], 0.5, 0.0),
        ])
        .expect("valid");
        let shape = [12usize, 16, 10];
        let u: Vec<Vec3> = (0..12 * 16 * 10)
            .map(|n| [n % 12, n / 12 % 16, n / 192])
            .map(|i| core::array::from_fn(|a| i[a] as f64 / shape[a] as f64))
            .collect();
        let (mut v, mut g) = (vec![0.0; u.len()], vec![[0.0; 3]; u.len()]);
        s.gradients(&u, &mut v, &mut g);
        let (all, error) = Series::sampled(&v, shape, 50).expect("sampled");
        assert!(error < 1e-7 && all.terms().len() == 4, "{error} {:?}", all.terms());
        let p = [[0.123, 0.456, 0.789]];
        let (mut a, mut b, mut h) = ([0.0], [0.0], [[0.0; 3]]);
        s.gradients(&p, &mut a, &mut h);
        all.gradients(&p, &mut b, &mut h);
        assert!((a[0] - b[0]).abs() < 1e-12);
        // Without the least: 0.2 of root 0.7² + 0.4² + 0.2².
        let (_, error) = Series::sampled(&v, shape, 3).expect("sampled");
        assert!((error - 0.2 / 0.69f64.sqrt()).abs() < 1e-9);
        assert!(Series::sampled(&vec![1.0; 1920], shape, 9).is_err());
        assert!(Series::sampled(&v, [12, 16, 11], 9).is_err());
    }

    #[test]
    fn rows_are_points_and_common_factors_only_repeat() {
        let s = Series::new(vec![
            term([2, -6, 0], 0.7, 0.13),
            term([-2, 3, 64], -0.4, 0.0),
            term([0, 0, 8], 0.5, 0.0),
            term([0, 0, 0], 0.5, 0.0),
        ])
        .expect("valid");
        let x: Vec<f64> = (0..37).map(|i| 0.037 * f64::from(i) - 0.2).collect();
        let (mut v, mut g) = (vec![0.0; 37], vec![[0.0; 3]; 37]);
        let (mut w, mut h) = (v.clone(), g.clone());
        let (small, factors) = s.reduced();
        assert_eq!(factors, [2, 3, 8]);
        s.row(&x, [0.31, -0.77], &mut v, &mut g);
        let u: Vec<Vec3> = x.iter().map(|x| [*x, 0.31, -0.77]).collect();
        s.gradients(&u, &mut w, &mut h);
        for i in 0..37 {
            assert!((v[i] - w[i]).abs() < 1e-13);
            // Slopes reach 2π · 64; products of 64 powers each lose a bit.
            assert!((0..3).all(|a| (g[i][a] - h[i][a]).abs() < 1e-11));
        }
        let folded: Vec<Vec3> = u.iter().map(|u| [0, 1, 2].map(|a| u[a] * f64::from(factors[a]))).collect();
        small.gradients(&folded, &mut v, &mut g);
        assert!((0..37).all(|i| (v[i] - w[i]).abs() < 1e-12));
    }

    #[test]
    fn gradient_agrees_with_differences_and_batches_with_single_points() {
        let s = Series::new(vec![
            term([1, -2, 0], 0.7, 0.13),
            term([0, 3, 1], -0.4, 0.0),
            term([2, 2, -2], 0.2, 0.25),
            term([0, 0, 0], 0.5, 0.0),
        ])
        .expect("valid");
        let u: Vec<Vec3> = (0..37).map(|i| [0.37 * f64::from(i), 0.11 * f64::from(i) - 2.0, 1.7]).collect();
        let (mut v, mut g) = (vec![0.0; 37], vec![[0.0; 3]; 37]);
        s.gradients(&u, &mut v, &mut g);
        let mut single = vec![0f32; 37];
        s.fill(&[0, 1, 2].map(|a| u.iter().map(|u| u[a]).collect()), &mut single);
        for i in 0..37 {
            // 2π times the rounding of a phase times an index of three, and that of the sums.
            assert!((f64::from(single[i]) - v[i]).abs() < 3e-6);
            let (mut w, mut h) = ([0.0], [[0.0; 3]]);
            s.gradients(&u[i..=i], &mut w, &mut h);
            assert_eq!((v[i], g[i]), (w[0], h[0]));
            for a in 0..3 {
                let e = 1e-5;
                let (mut lo, mut hi) = (u[i], u[i]);
                lo[a] -= e;
                hi[a] += e;
                let (mut w, mut h) = ([0.0; 2], [[0.0; 3]; 2]);
                s.gradients(&[lo, hi], &mut w, &mut h);
                // Central difference: error e² f'''/6 with |f'''| < 0.7·(2π·2)³ + … < 5e3, so below 1e-7.
                assert!(((w[1] - w[0]) / (2.0 * e) - g[i][a]).abs() < 3e-7);
            }
        }
    }
}
