//! Critical points of a function on the torus, from its gradients.

use geometry::math::{Mat3, Vec3, add, dot, eigen, norm, scale, sub};

/// Values and gradients per turn at phases.
pub(in crate::cell) type Function<'a> = &'a (dyn Fn(&[Vec3], &mut [f64], &mut [Vec3]) + Sync);

/// A critical point.
#[derive(Clone, Copy, Debug)]
pub(in crate::cell) struct Critical {
    /// Where, in turns (not reduced to one period).
    pub at: Vec3,
    /// The value there.
    pub level: f64,
    /// Eigenvalues of the Hessian below zero (beyond a thousandth of the largest).
    pub falling: usize,
    /// Eigenvalues about zero.
    pub flat: usize,
    /// Eigenvalues of the Hessian, ascending.
    pub values: Vec3,
    /// Their unit eigenvectors.
    pub axes: Mat3,
}

/// Value and gradient at one point.
pub(in crate::cell) fn sample(f: Function, u: Vec3) -> (f64, Vec3) {
    let (mut v, mut g) = ([0.0], [[0.0; 3]]);
    f(&[u], &mut v, &mut g);
    (v[0], g[0])
}

/// The critical point of f within `reach` (turns) of `start`, by Newton's method; along directions in which the
/// Hessian vanishes it stays where it is, so that lines of critical points are found as well.
pub(in crate::cell) fn critical(f: Function, start: Vec3, reach: f64) -> Option<Critical> {
    const STEP: f64 = 1e-4;
    let mut at = start;
    for _ in 0..48 {
        let mut points = [at; 7];
        for a in 0..3 {
            points[1 + 2 * a][a] += STEP;
            points[2 + 2 * a][a] -= STEP;
        }
        let (mut v, mut g) = ([0.0; 7], [[0.0; 3]; 7]);
        f(&points, &mut v, &mut g);
        let rows = [0, 1, 2].map(|a| scale(sub(g[1 + 2 * a], g[2 + 2 * a]), 0.5 / STEP));
        let hessian = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (rows[i][j] + rows[j][i]) / 2.0));
        let (values, vectors) = eigen(&hessian);
        let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut step = [0.0; 3];
        for (value, vector) in values.iter().zip(vectors) {
            if value.abs() > 1e-3 * largest {
                step = sub(step, scale(vector, dot(vector, g[0]) / value));
            }
        }
        let length = norm(step);
        if length < 1e-7 {
            // A flat direction may still climb: then this is no critical point.
            return (norm(g[0]) <= 1e-5 * largest).then(|| Critical {
                values,
                axes: vectors,
                // The next step would be its square.
                at: add(at, step),
                level: v[0],
                falling: values.iter().filter(|v| **v < -1e-3 * largest).count(),
                flat: values.iter().filter(|v| v.abs() <= 1e-3 * largest).count(),
            });
        }
        at = add(at, scale(step, (0.3 * reach / length).min(1.0)));
        if norm(sub(at, start)) > reach {
            return None;
        }
    }
    None
}
