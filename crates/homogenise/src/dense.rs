//! Small dense symmetric matrices.

/// The eigenvalues of a symmetric matrix, by Jacobi's rotations.
pub fn eigenvalues(a: Vec<Vec<f64>>) -> Vec<f64> {
    eigen(a).0
}

/// The eigenvalues of a symmetric matrix and, row by row, its orthonormal eigenvectors, by Jacobi's rotations.
pub fn eigen(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let n = a.len();
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let mut vectors: Vec<Vec<f64>> = (0..n).map(unit).collect();
    for _ in 0..60 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j] * a[i][j]).sum();
        let all: f64 = a.iter().flatten().map(|v| v * v).sum();
        if off <= 1e-30 * all {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if let Some(turn) = rotation(&a, p, q) {
                    a.iter_mut().for_each(|row| (row[p], row[q]) = turned(turn, row[p], row[q]));
                    turn_rows(&mut a, turn, p, q);
                    turn_rows(&mut vectors, turn, p, q);
                }
            }
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), vectors)
}

/// Cosine and sine of the rotation that makes the entry (p, q) zero; `None` if it is.
fn rotation(a: &[Vec<f64>], p: usize, q: usize) -> Option<(f64, f64)> {
    if a[p][q] == 0.0 {
        return None;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let t = if theta == 0.0 { 1.0 } else { t };
    let c = 1.0 / (t * t + 1.0).sqrt();
    Some((c, t * c))
}

fn turned((c, s): (f64, f64), x: f64, y: f64) -> (f64, f64) {
    (c * x - s * y, s * x + c * y)
}

fn turn_rows(a: &mut [Vec<f64>], turn: (f64, f64), p: usize, q: usize) {
    let (upper, lower) = a.split_at_mut(q);
    for (x, y) in upper[p].iter_mut().zip(&mut lower[0]) {
        (*x, *y) = turned(turn, *x, *y);
    }
}

/// The inverse of a symmetric positive definite 6 × 6 matrix, by Cholesky's factors; `None` if it is not positive definite.
pub fn inverse6(m: &[[f64; 6]; 6]) -> Option<[[f64; 6]; 6]> {
    let mut l = [[0.0; 6]; 6];
    let largest = (0..6).fold(0.0f64, |a, i| a.max(m[i][i]));
    for i in 0..6 {
        for j in 0..=i {
            let sum = m[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = match i == j {
                true if sum > 1e-14 * largest => sum.sqrt(),
                true => return None,
                false => sum / l[j][j],
            };
        }
    }
    let mut out = [[0.0; 6]; 6];
    for column in 0..6 {
        let mut x = [0.0; 6];
        for i in 0..6 {
            let one = if i == column { 1.0 } else { 0.0 };
            x[i] = (one - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
        }
        for i in (0..6).rev() {
            x[i] = (x[i] - (i + 1..6).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
        }
        for i in 0..6 {
            out[i][column] = x[i];
        }
    }
    Some(out)
}

/// The solution of A x = b for a symmetric positive definite A, by Cholesky's factors; `None` if it is not positive definite.
pub fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| a[i][k] * a[j][k]).sum::<f64>();
            a[i][j] = match i == j {
                true if sum > 0.0 => sum.sqrt(),
                true => return None,
                false => sum / a[j][j],
            };
        }
        b[i] = (b[i] - (0..i).map(|k| a[i][k] * b[k]).sum::<f64>()) / a[i][i];
    }
    for i in (0..n).rev() {
        b[i] = (b[i] - (i + 1..n).map(|k| a[k][i] * b[k]).sum::<f64>()) / a[i][i];
    }
    Some(b)
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

    /// A = Σ λ v vᵀ, with orthonormal v.
    #[test]
    fn eigenvectors_make_their_matrix() {
        let a = vec![
            vec![4.0, 1.0, -2.0, 0.5],
            vec![1.0, 3.0, 0.0, 1.0],
            vec![-2.0, 0.0, 5.0, 0.2],
            vec![0.5, 1.0, 0.2, 3.0],
        ];
        let (values, vectors) = eigen(a.clone());
        for i in 0..4 {
            for j in 0..4 {
                let made: f64 = (0..4).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                let product: f64 = (0..4).map(|k| vectors[i][k] * vectors[j][k]).sum();
                assert!((made - a[i][j]).abs() < 1e-13 && (product - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let mut m = [[0.1; 6]; 6];
        for (i, row) in m.iter_mut().enumerate() {
            row[i] = 1.0 + i as f64;
        }
        let inv = inverse6(&m).expect("positive definite");
        for i in 0..6 {
            for j in 0..6 {
                let sum: f64 = (0..6).map(|k| m[i][k] * inv[k][j]).sum();
                assert!((sum - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
        m[5][5] = -1.0;
        assert!(inverse6(&m).is_none());
    }
}
