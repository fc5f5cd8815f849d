//! Sums over fields, plane by plane: the same bits for any number of threads.

use rayon::prelude::*;

use crate::lanes::{LANES, Real};

/// Numbers summed by one thread at a time.
const PIECE: usize = 1 << 14;

/// Σ a b in f64.
pub fn dot<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let each: Vec<f64> = a.par_chunks(PIECE).zip(b.par_chunks(PIECE)).map(|(a, b)| piece(a, b)).collect();
    each.into_iter().sum()
}

fn piece<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.chunks(LANES).zip(b.chunks(LANES)) {
        for (s, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *s += a.wide() * b.wide();
        }
    }
    sums.into_iter().sum()
}

/// `y` += s `x`.
pub fn add<T: Real>(y: &mut [T], s: T, x: &[T]) {
    y.par_chunks_mut(PIECE).zip(x.par_chunks(PIECE)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            *y += s * *x;
        }
    });
}

/// `y` = f(`y`, `x`), number by number.
pub fn combine<A: Real, B: Real>(y: &mut [A], x: &[B], f: impl Fn(A, B) -> A + Sync) {
    y.par_chunks_mut(PIECE).zip(x.par_chunks(PIECE)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            *y = f(*y, *x);
        }
    });
}
