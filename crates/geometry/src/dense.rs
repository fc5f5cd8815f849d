//! Small dense matrices: eigenvalues, linear equations, Cholesky's factors.
//!
//! A matrix is a slice of rows, each an array or a vector: `[[f64; 4]; 4]` as well as `Vec<Vec<f64>>`. Sums run in the order of the
//! entries, so that the bits are the same everywhere.

/// A row of a matrix.
pub trait MatrixRow: AsRef<[f64]> + AsMut<[f64]> {}
impl<T: AsRef<[f64]> + AsMut<[f64]>> MatrixRow for T {}

/// Most sweeps of Jacobi's method: convergence is quadratic, six are usual.
const SWEEPS: usize = 16;

/// Makes a symmetric matrix diagonal by Jacobi's rotations: its diagonal then has the eigenvalues, and if `vectors` was the identity its
/// rows are the orthonormal eigenvectors in the same order. `vectors` may be empty. Entries off the diagonal at most `near` times the
/// diagonal ones in their row and column count as zero.
#[inline]
pub fn diagonalise<R: MatrixRow>(a: &mut [R], vectors: &mut [R], near: f64) {
    let n = a.len();
    for _ in 0..SWEEPS {
        let mut is_diagonal = true;
        for p in 0..n {
            for q in p + 1..n {
                let [off, x, y] = [(p, q), (p, p), (q, q)].map(|(i, j)| a[i].as_ref()[j]);
                if off.abs() <= near * (x.abs() + y.abs()) {
                    continue;
                }
                is_diagonal = false;
                let theta = (y - x) / (2.0 * off);
                let t = (if theta < 0.0 { -1.0 } else { 1.0 }) / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                // a ← JᵀaJ, rows of `vectors` ← Jᵀ vectors.
                for row in &mut *a {
                    let row = row.as_mut();
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                for rows in [&mut *a, &mut *vectors] {
                    let Some((upper, [lower, ..])) = rows.split_at_mut_checked(q) else { continue };
                    for (x, y) in upper[p].as_mut().iter_mut().zip(lower.as_mut()) {
                        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                    }
                }
            }
        }
        if is_diagonal {
            break;
        }
    }
}

/// The share of the diagonal at which a matrix of any size is as good as diagonal.
const NEAR: f64 = 1e-16;

/// The eigenvalues of a symmetric matrix, in no order.
pub fn eigenvalues(mut a: Vec<Vec<f64>>) -> Vec<f64> {
    diagonalise(&mut a, &mut [], NEAR);
    (0..a.len()).map(|i| a[i][i]).collect()
}

/// The eigenvalues of a symmetric matrix, in no order, and row by row its orthonormal eigenvectors.
pub fn eigen(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = a.len();
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(unit).collect();
    diagonalise(&mut a, &mut vectors, NEAR);
    ((0..n).map(|i| a[i][i]).collect(), vectors)
}

/// Replaces the lower triangle of a symmetric matrix, the only part that is read, by Cholesky's factor L, A = LLᵀ; `None` if `pivot` is.
///
/// `pivot(i, rest)` is the entry on the diagonal of L for what is left of that of A: the root of `rest`, `None` if the matrix is not
/// positive enough. With an infinite pivot the unknown is zero and its equation is left out.
#[inline]
pub fn factorise<R: MatrixRow>(a: &mut [R], pivot: impl Fn(usize, f64) -> Option<f64>) -> Option<()> {
    for i in 0..a.len() {
        let (above, rest) = a.split_at_mut(i);
        let row = rest[0].as_mut();
        for j in 0..i {
            let other = above[j].as_ref();
            let s: f64 = row[..j].iter().zip(&other[..j]).map(|(a, b)| a * b).sum();
            row[j] = (row[j] - s) / other[j];
        }
        row[i] = pivot(i, row[i] - row[..i].iter().map(|v| v * v).sum::<f64>())?;
    }
    Some(())
}

/// Replaces b by the solution of LLᵀ x = b, for the lower triangle of L.
#[inline]
pub fn substitute<R: MatrixRow>(l: &[R], x: &mut [f64]) {
    for i in 0..x.len() {
        let row = l[i].as_ref();
        let s: f64 = row[..i].iter().zip(&*x).map(|(a, b)| a * b).sum();
        x[i] = (x[i] - s) / row[i];
    }
    for i in (0..x.len()).rev() {
        let row = l[i].as_ref();
        x[i] /= row[i];
        let v = x[i];
        x[..i].iter_mut().zip(row).for_each(|(x, l)| *x -= l * v);
    }
}

/// The inverse of a symmetric positive definite matrix; `None` if it is not positive definite, by 1e-14 of its largest entry.
pub fn inverse<const N: usize>(m: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let (mut l, largest) = (*m, (0..N).fold(0.0f64, |a, i| a.max(m[i][i])));
    factorise(&mut l, |_, rest| (rest > 1e-14 * largest).then(|| rest.sqrt()))?;
    let mut rows = [[0.0; N]; N];
    for (i, row) in rows.iter_mut().enumerate() {
        row[i] = 1.0;
        substitute(&l, row);
    }
    Some(rows)
}

/// Solves equations by Gauss' elimination with row pivots. A row is an equation: its coefficients, then its right-hand sides, which
/// are replaced by the solutions. `None` if the equations are dependent to `least` of the largest coefficient, or any is NaN.
#[inline]
pub fn solve<R: MatrixRow>(rows: &mut [R], least: f64) -> Option<()> {
    let n = rows.len();
    let at = |rows: &[R], i: usize, j: usize| rows[i].as_ref()[j];
    let largest = rows.iter().flat_map(|r| &r.as_ref()[..n]).fold(0.0f64, |a, v| a.max(v.abs()));
    for c in 0..n {
        let best = (c..n).max_by(|&i, &j| at(rows, i, c).abs().total_cmp(&at(rows, j, c).abs()))?;
        rows.swap(c, best);
        let (done, below) = rows.split_at_mut(c + 1);
        let pivot = done[c].as_ref();
        if pivot[c].is_nan() || pivot[c].abs() <= least * largest {
            return None;
        }
        for row in below.iter_mut().map(R::as_mut) {
            let f = row[c] / pivot[c];
            row[c..].iter_mut().zip(&pivot[c..]).for_each(|(v, p)| *v -= f * p);
        }
    }
    for r in (0..n).rev() {
        for k in n..rows[r].as_ref().len() {
            let sum: f64 = (r + 1..n).map(|i| at(rows, r, i) * at(rows, i, k)).sum();
            rows[r].as_mut()[k] = (at(rows, r, k) - sum) / at(rows, r, r);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        let mut found = eigenvalues(vec![vec![2.0, -1.0, 0.0], vec![-1.0, 2.0, -1.0], vec![0.0, -1.0, 2.0]]);
        found.sort_by(f64::total_cmp);
        let r = 2f64.sqrt();
        for (f, e) in found.iter().zip([2.0 - r, 2.0, 2.0 + r]) {
            assert!((f - e).abs() < 1e-14);
        }
    }

    /// Symmetric matrices of many sizes, A = B + Bᵀ of random B.
    fn random(n: usize, seed: &mut u64) -> Vec<Vec<f64>> {
        let b: Vec<Vec<f64>> = (0..n).map(|_| (0..n).map(|_| crate::random::random(seed)).collect()).collect();
        (0..n).map(|i| (0..n).map(|j| b[i][j] + b[j][i]).collect()).collect()
    }

    /// A = Σ λ v vᵀ, with orthonormal v.
    #[test]
    fn eigenvectors_make_their_matrix() {
        let mut seed = 7;
        for n in [1, 2, 3, 4, 6, 8, 24] {
            let a = random(n, &mut seed);
            let (values, vectors) = eigen(a.clone());
            for i in 0..n {
                for j in 0..n {
                    let made: f64 = (0..n).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                    let product: f64 = (0..n).map(|k| vectors[i][k] * vectors[j][k]).sum();
                    assert!((made - a[i][j]).abs() < 1e-13 && (product - f64::from(u8::from(i == j))).abs() < 1e-13);
                }
            }
            let mut alone = eigenvalues(a);
            alone.iter_mut().zip(values).for_each(|(a, v)| *a -= v);
            assert!(alone.iter().all(|off| *off == 0.0));
        }
    }

    /// A x = b, for x found by Cholesky's factors and by elimination, of a positive definite A.
    #[test]
    fn solutions_satisfy_their_equations() {
        let mut seed = 11;
        for n in [1, 2, 4, 6, 12] {
            let mut a = random(n, &mut seed);
            (0..n).for_each(|i| a[i][i] += 2.0 * n as f64);
            let b: Vec<f64> = (0..n).map(|i| 1.0 + i as f64).collect();
            let (mut l, mut x) = (a.clone(), b.clone());
            factorise(&mut l, |_, rest| (rest > 0.0).then(|| rest.sqrt())).expect("positive definite");
            substitute(&l, &mut x);
            let mut rows: Vec<Vec<f64>> = (0..n).map(|i| a[i].iter().copied().chain([b[i]]).collect()).collect();
            solve(&mut rows, 1e-12).expect("independent");
            for i in 0..n {
                let sum: f64 = (0..n).map(|k| a[i][k] * x[k]).sum();
                assert!((sum - b[i]).abs() < 1e-13 * n as f64 && (x[i] - rows[i][n]).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn dependent_equations_are_refused_and_left_out() {
        let dependent = [[1.0, 2.0, 1.0], [2.0, 4.0, 2.0]];
        assert_eq!(solve(&mut dependent.clone(), 1e-12), None);
        assert_eq!(solve(&mut [[f64::NAN, 2.0, 1.0], [2.0, 4.0, 2.0]], 1e-12), None);
        let mut a = [[1.0, 2.0], [2.0, 4.0]];
        assert_eq!(factorise(&mut a.clone(), |_, rest| (rest > 1e-12).then(|| rest.sqrt())), None);
        factorise(&mut a, |_, rest| Some(if rest > 1e-12 { rest.sqrt() } else { f64::INFINITY })).expect("pivots");
        let mut x = [1.0, 2.0];
        substitute(&a, &mut x);
        assert_eq!(x, [1.0, 0.0]);
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let mut m = [[0.1; 6]; 6];
        for (i, row) in m.iter_mut().enumerate() {
            row[i] = 1.0 + i as f64;
        }
        let inv = inverse(&m).expect("positive definite");
        for i in 0..6 {
            for j in 0..6 {
                let sum: f64 = (0..6).map(|k| m[i][k] * inv[k][j]).sum();
                assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        m[5][5] = -1.0;
        assert!(inverse(&m).is_none());
    }
}
