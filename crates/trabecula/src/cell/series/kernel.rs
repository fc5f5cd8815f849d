//! Sums of waves at many points: a few points to a vector, powers instead of trigonometry.

use multiversion::multiversion;

use super::Term;
use geometry::math::{Vec3, sin_cos_turns};

/// Points handled at once; the compiler turns each loop over them into vector instructions.
const LANES: usize = 8;

/// A term prepared for evaluation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wave {
    pub hkl: [i32; 3],
    pub re: f64,
    pub im: f64,
}

impl Wave {
    pub fn new(t: &Term) -> Wave {
        let (s, c) = sin_cos_turns(t.phase);
        Wave { hkl: t.hkl, re: t.amplitude * c, im: t.amplitude * s }
    }
}

type Lanes = [f64; LANES];

/// Powers e^{2πi n u} of one coordinate for n = 0 … top, over the lanes.
type Powers = Vec<(Lanes, Lanes)>;

#[inline(always)]
fn times(a: &mut (Lanes, Lanes), b: &(Lanes, Lanes), sign: f64) {
    for l in 0..LANES {
        let (re, im) = (a.0[l], a.1[l]);
        let bi = b.1[l] * sign;
        a.0[l] = re * b.0[l] - im * bi;
        a.1[l] = re * bi + im * b.0[l];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn evaluate(waves: &[Wave], top: usize, u: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
    let mut powers: [Powers; 3] = core::array::from_fn(|_| vec![([1.0; LANES], [0.0; LANES]); top + 1]);
    let blocks = u.chunks(LANES).zip(values.chunks_mut(LANES)).zip(gradients.chunks_mut(LANES));
    for ((u, values), gradients) in blocks {
        for a in 0..3 {
            let mut w = [0.0; LANES];
            for (l, p) in u.iter().enumerate() {
                w[l] = p[a];
            }
            let mut first = ([0.0; LANES], [0.0; LANES]);
            for l in 0..LANES {
                (first.1[l], first.0[l]) = sin_cos_turns(w[l]);
            }
            for n in 1..=top {
                let mut z = powers[a][n - 1];
                times(&mut z, &first, 1.0);
                powers[a][n] = z;
            }
        }
        let mut f = [0.0; LANES];
        let mut g = [[0.0; LANES]; 3];
        for w in waves {
            let mut z = ([w.re; LANES], [w.im; LANES]);
            for a in 0..3 {
                let n = w.hkl[a];
                if n != 0 {
                    times(&mut z, &powers[a][n.unsigned_abs() as usize], f64::from(n.signum()));
                }
            }
            for l in 0..LANES {
                f[l] += z.0[l];
            }
            for a in 0..3 {
                if w.hkl[a] != 0 {
                    let k = core::f64::consts::TAU * f64::from(w.hkl[a]);
                    for l in 0..LANES {
                        g[a][l] -= k * z.1[l];
                    }
                }
            }
        }
        for l in 0..u.len() {
            values[l] = f[l];
            gradients[l] = [g[0][l], g[1][l], g[2][l]];
        }
    }
}

/// Points handled at once in single precision.
const WIDE: usize = 16;
type Wide = [f32; WIDE];

/// (sin 2πu, cos 2πu) for |u| ≤ ½, in single precision.
#[inline(always)]
fn sin_cos_wide(u: &Wide) -> (Wide, Wide) {
    const ROUND: f32 = 12_582_912.0;
    let (mut s, mut c) = ([0.0; WIDE], [0.0; WIDE]);
    for l in 0..WIDE {
        let q = (u[l] * 4.0 + ROUND) - ROUND;
        let r = (u[l] * 4.0 - q) * core::f32::consts::FRAC_PI_2;
        let w = r * r;
        let sin = r * (1.0 + w * (-1.0 / 6.0 + w * (1.0 / 120.0 - w * (1.0 / 5040.0))));
        let cos = 1.0 + w * (-0.5 + w * (1.0 / 24.0 + w * (-1.0 / 720.0 + w * (1.0 / 40320.0))));
        // q is −2 … 2 quarters.
        let odd = q == 1.0 || q == -1.0;
        let half = q == 2.0 || q == -2.0;
        let (a, b) = if odd { (cos, sin) } else { (sin, cos) };
        s[l] = if half || q == -1.0 { -a } else { a };
        c[l] = if half || q == 1.0 { -b } else { b };
    }
    (s, c)
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn fill(waves: &[([i32; 3], f32, f32)], top: usize, u: &[Vec<f64>; 3], out: &mut [f32]) {
    const ROUND: f64 = 6755399441055744.0;
    let mut powers: [Vec<(Wide, Wide)>; 3] = core::array::from_fn(|_| vec![([1.0; WIDE], [0.0; WIDE]); top + 1]);
    for (block, out) in out.chunks_mut(WIDE).enumerate() {
        let from = block * WIDE;
        for a in 0..3 {
            let mut w = [0.0f32; WIDE];
            for (w, u) in w.iter_mut().zip(&u[a][from..from + out.len()]) {
                *w = (u - ((u + ROUND) - ROUND)) as f32;
            }
            let (s, c) = sin_cos_wide(&w);
            for n in 1..=top {
                let mut z = powers[a][n - 1];
                for l in 0..WIDE {
                    let (re, im) = (z.0[l], z.1[l]);
                    z.0[l] = re * c[l] - im * s[l];
                    z.1[l] = re * s[l] + im * c[l];
                }
                powers[a][n] = z;
            }
        }
        let mut f = [0.0f32; WIDE];
        for &(hkl, re, im) in waves {
            let mut z = ([re; WIDE], [im; WIDE]);
            for a in 0..3 {
                if hkl[a] != 0 {
                    let p = &powers[a][hkl[a].unsigned_abs() as usize];
                    let sign = hkl[a].signum() as f32;
                    for l in 0..WIDE {
                        let (re, im) = (z.0[l], z.1[l]);
                        let pi = p.1[l] * sign;
                        z.0[l] = re * p.0[l] - im * pi;
                        z.1[l] = re * pi + im * p.0[l];
                    }
                }
            }
            for l in 0..WIDE {
                f[l] += z.0[l];
            }
        }
        out.copy_from_slice(&f[..out.len()]);
    }
}
