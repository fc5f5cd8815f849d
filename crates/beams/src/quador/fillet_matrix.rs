//! The matrix R of the fillets of a hub: 1 on its diagonal, τ off it.

use super::affine_function::AffineFunction;

/// Number of half-beams of a hub for which no memory is allocated.
pub(super) const MANY: usize = 16;

/// Calls `f` with room for `n` numbers.
#[inline]
pub(super) fn with_room<const ROOM: usize, T>(n: usize, f: impl FnOnce(&mut [f64]) -> T) -> T {
    if n <= ROOM { f(&mut [0.0; ROOM][..n]) } else { f(&mut vec![0.0; n]) }
}

/// Row k of Cholesky's factor L of a matrix, from the rows before it, each of `stride` numbers; whether the matrix is positive
/// definite so far.
#[inline]
pub(super) fn append(
    before: &[f64],
    row: &mut [f64],
    stride: usize,
    k: usize,
    entry: impl Fn(usize) -> f64,
    diagonal: f64,
) -> bool {
    let mut square = diagonal;
    for c in 0..k {
        let with = &before[c * stride..];
        let sum: f64 = (0..c).map(|q| row[q] * with[q]).sum();
        row[c] = (entry(c) - sum) / with[c];
        square -= row[c] * row[c];
    }
    row[k] = square.sqrt();
    square > 0.0
}

/// Solves R y = g for several g, in place, with 1 on the diagonal of R and `tau` off it; `l` is for use as memory.
#[inline]
pub(super) fn solve(n: usize, tau: impl Fn(usize, usize) -> f64, y: &mut [[f64; 2]], l: &mut Vec<f64>) {
    if n < 2 {
        return;
    }
    let less = |a: [f64; 2], s: f64, b: [f64; 2]| [a[0] - s * b[0], a[1] - s * b[1]];
    l.resize(n * n, 0.0);
    for k in 0..n {
        let (before, row) = l.split_at_mut(k * n);
        append(before, row, n, k, |c| tau(k, c), 1.0);
        let rest = (0..k).fold(y[k], |rest, c| less(rest, row[c], y[c]));
        y[k] = rest.map(|v| v / row[k]);
    }
    for k in (0..n).rev() {
        let rest = (k + 1..n).fold(y[k], |rest, c| less(rest, l[c * n + k], y[c]));
        y[k] = rest.map(|v| v / l[k * n + k]);
    }
}

/// Whether a symmetric matrix, given row by row, is positive definite with `diagonal` on its diagonal: by elimination, whole rows
/// at once.
pub(super) fn is_positive_definite(n: usize, matrix: &[f64], diagonal: f64) -> bool {
    with_room::<{ MANY * MANY }, bool>(n * n, |left| {
        left.copy_from_slice(matrix);
        (0..n).for_each(|k| left[k * n + k] = diagonal);
        (0..n).all(|k| {
            let (done, below) = left.split_at_mut((k + 1) * n);
            let row = &done[k * n..];
            let inverse = 1.0 / row[k];
            for (i, other) in below.chunks_exact_mut(n).enumerate() {
                let part = row[k + 1 + i] * inverse;
                for (o, r) in other[k + 1 + i..].iter_mut().zip(&row[k + 1 + i..]) {
                    *o -= part * r;
                }
            }
            row[k] > 0.0
        })
    })
}

/// The inverse of a symmetric, positive definite matrix, given row by row, with `diagonal` on its diagonal, row by row.
pub(super) fn inverse(n: usize, matrix: &[f64], diagonal: f64) -> Vec<f64> {
    let mut l = vec![0.0; n * n];
    for k in 0..n {
        let (before, row) = l.split_at_mut(k * n);
        append(before, row, n, k, |c| matrix[k * n + c], diagonal);
    }
    let mut inverse = vec![0.0; n * n];
    for k in 0..n {
        // Column k of L⁻¹, then of L⁻ᵀL⁻¹.
        let mut column = vec![0.0; n];
        for i in k..n {
            let sum: f64 = (k..i).map(|c| l[i * n + c] * column[c]).sum();
            column[i] = (f64::from(u8::from(i == k)) - sum) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|c| l[c * n + i] * column[c]).sum();
            column[i] = (column[i] - sum) / l[i * n + i];
        }
        for i in 0..n {
            inverse[i * n + k] = column[i];
        }
    }
    inverse
}

/// R of a set of half-beams as L Lᵀ.
pub(super) struct Factor<'a> {
    of: &'a [usize],
    l: Vec<f64>,
}

impl Factor<'_> {
    /// Of half-beams with fillets.
    pub(super) fn new(of: &[usize], tau: impl Fn(usize, usize) -> f64) -> Factor<'_> {
        let n = of.len();
        let mut l = vec![0.0; n * n];
        for k in 0..n {
            let (before, row) = l.split_at_mut(k * n);
            append(before, row, n, k, |c| tau(of[k], of[c]), 1.0);
        }
        Factor { of, l }
    }

    fn l(&self, i: usize, j: usize) -> f64 {
        self.l[i * self.of.len() + j]
    }

    /// h = L⁻¹g, for given g: the functions whose squares add up to gᵀR⁻¹g.
    pub(super) fn squares(&self, g: &dyn Fn(usize) -> AffineFunction) -> Vec<AffineFunction> {
        let mut h: Vec<AffineFunction> = Vec::with_capacity(self.of.len());
        for (k, &i) in self.of.iter().enumerate() {
            let rest = (0..k).fold(g(i), |sum, c| sum.plus(-self.l(k, c), &h[c]));
            h.push(AffineFunction::default().plus(1.0 / self.l(k, k), &rest));
        }
        h
    }

    /// y = R⁻¹g = L⁻ᵀh.
    pub(super) fn solved(&self, mut h: Vec<AffineFunction>) -> Vec<AffineFunction> {
        for k in (0..h.len()).rev() {
            let rest = (k + 1..h.len()).fold(h[k], |sum, c| sum.plus(-self.l(c, k), &h[c]));
            h[k] = AffineFunction::default().plus(1.0 / self.l(k, k), &rest);
        }
        h
    }

    /// The kth number on the diagonal of R⁻¹.
    pub(super) fn inverse_diagonal(&self, k: usize) -> f64 {
        let n = self.of.len();
        if k + 1 == n {
            return 1.0 / (self.l(k, k) * self.l(k, k));
        }
        let mut column = vec![0.0; n];
        for i in k..n {
            let sum: f64 = (k..i).map(|c| self.l(i, c) * column[c]).sum();
            column[i] = (f64::from(u8::from(i == k)) - sum) / self.l(i, i);
        }
        column.iter().map(|v| v * v).sum()
    }
}
