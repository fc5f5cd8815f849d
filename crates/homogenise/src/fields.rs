//! Sums over fields, plane by plane: the same bits for any number of threads.

use multiversion::multiversion;
use rayon::prelude::*;

use crate::lanes::{LANES, Real};

/// Numbers summed by one thread at a time.
pub const PIECE: usize = 1 << 14;
/// Numbers in a field that one thread is done with before a second one is awake.
pub const SMALL: usize = 1 << 14;

/// Σ a b in f64.
pub fn dot<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let each: Vec<f64> = a.par_chunks(PIECE).zip(b.par_chunks(PIECE)).map(|(a, b)| piece(a, b)).collect();
    each.into_iter().sum()
}

/// Σ a b of each b, in f64.
pub fn dots<A: Real, B: Real>(a: &[A], b: [&[B]; 2]) -> [f64; 2] {
    let pieces = a.par_chunks(PIECE).zip(b[0].par_chunks(PIECE)).zip(b[1].par_chunks(PIECE));
    let each: Vec<[f64; 2]> = pieces.map(|((a, b), c)| [piece(a, b), piece(a, c)]).collect();
    each.into_iter().fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]])
}

/// Σ a b in f64, by one thread.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub fn piece<A: Real, B: Real>(a: &[A], b: &[B]) -> f64 {
    let mut sums = [0.0; LANES];
    let (whole, rest) = a.as_chunks::<LANES>();
    let (whole_b, rest_b) = b.as_chunks::<LANES>();
    for (a, b) in whole.iter().zip(whole_b) {
        for i in 0..LANES {
            sums[i] += a[i].wide() * b[i].wide();
        }
    }
    for (s, (a, b)) in sums.iter_mut().zip(rest.iter().zip(rest_b)) {
        *s += a.wide() * b.wide();
    }
    sums.into_iter().sum()
}

/// Calls `f` with pieces of fields, those written and those read.
pub fn in_pieces<const M: usize, const N: usize>(
    to: [&mut [f32]; M],
    from: [&[f32]; N],
    f: impl Fn([&mut [f32]; M], [&[f32]; N]) + Sync,
) {
    let count = from[0].len();
    if count <= SMALL {
        return f(to, from);
    }
    let mut to = to.map(|t| t.chunks_mut(PIECE));
    let pieces: Vec<_> = (0..count.div_ceil(PIECE))
        .map(|i| {
            let range = i * PIECE..count.min((i + 1) * PIECE);
            (to.each_mut().map(|t| t.next().unwrap_or_default()), from.map(|f| &f[range.clone()]))
        })
        .collect();
    pieces.into_par_iter().for_each(|(to, from)| f(to, from));
}

/// `y` = f(`y`, `x`), number by number.
pub fn combine<A: Real, B: Real>(y: &mut [A], x: &[B], f: impl Fn(A, B) -> A + Sync) {
    if y.len() <= SMALL {
        return y.iter_mut().zip(x).for_each(|(y, x)| *y = f(*y, *x));
    }
    y.par_chunks_mut(PIECE).zip(x.par_chunks(PIECE)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            *y = f(*y, *x);
        }
    });
}
