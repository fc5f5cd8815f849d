//! Conjugate gradients with a preconditioner, to the same bits for any number of threads.

use rayon::prelude::*;

use geometry::progress::checkpoint;

/// Numbers that are summed in one go, so that sums do not depend on the number of threads.
const CHUNK: usize = 4096;

/// What was found: the solution, the number of steps taken, and the error left.
pub(super) struct Solved {
    pub x: Vec<f64>,
    pub steps: usize,
    /// The root of the energy of the error, relative to the first.
    pub left: f64,
}

/// The solution of a symmetric positive semi-definite system from `start` on: until the error left is `residual`, or after `most` steps.
/// `operator` and `precondition` fill their second argument with what they make of the first.
pub(super) fn solve(
    right: Vec<f64>,
    start: Vec<f64>,
    operator: impl Fn(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&[f64], &mut [f64]),
    (residual, most): (f64, usize),
) -> Solved {
    let dot = |a: &[f64], b: &[f64]| sums(a.len(), |n| a[n] * b[n]);
    let mut q = vec![0.0; start.len()];
    let (mut x, mut r) = (start, right);
    let scale = dot(&r, &r).sqrt();
    operator(&x, &mut q);
    r.par_iter_mut().zip(&q).for_each(|(r, q)| *r -= q);
    // What rounding leaves of a system that needs no solving.
    if dot(&r, &r).sqrt() <= 1e-12 * scale {
        return Solved { x, steps: 0, left: 0.0 };
    }
    let mut z = vec![0.0; x.len()];
    precondition(&r, &mut z);
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let (first, mut steps, mut left) = (rz, 0, 1.0);
    while steps < most && left > residual {
        checkpoint();
        operator(&p, &mut q);
        let alpha = rz / dot(&p, &q);
        if !alpha.is_finite() {
            break;
        }
        let both = (x.par_iter_mut(), r.par_iter_mut(), p.par_iter(), q.par_iter()).into_par_iter();
        both.for_each(|(x, r, p, q)| (*x, *r) = (*x + alpha * p, *r - alpha * q));
        precondition(&r, &mut z);
        let next = dot(&r, &z);
        p.par_iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / rz * *p);
        rz = next;
        steps += 1;
        left = (rz.max(0.0) / first).sqrt();
    }
    Solved { x, steps, left }
}

/// The sum of numbers, in chunks of one length.
pub(super) fn sums(n: usize, of: impl Fn(usize) -> f64 + Sync) -> f64 {
    let chunk = |c: usize| (c * CHUNK..((c + 1) * CHUNK).min(n)).map(&of).sum::<f64>();
    (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).collect::<Vec<f64>>().iter().sum()
}
