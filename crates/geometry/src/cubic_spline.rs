//! Uniform cubic B-splines: their basis, and the coefficients of a tricubic spline through values at the nodes of a grid.

/// The condition at both ends of each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndCondition {
    /// The first node follows the last: as many coefficients as nodes.
    Periodic,
    /// Not-a-knot: the third derivative does not jump at the second and the last but one node, so that a cubic is met exactly.
    /// Two coefficients more than nodes, of which there are four or more; entry m belongs to node m − 1.
    NotAKnot,
}

/// The weights of four coefficients in the value at the share t of an interval.
#[inline(always)]
pub fn weights(t: f64) -> [f64; 4] {
    const BY_POWER: [[f64; 4]; 4] = [
        [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0],
        [-0.5, 0.0, 0.5, 0.0],
        [0.5, -1.0, 0.5, 0.0],
        [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
    ];
    polynomials(t, BY_POWER)
}

/// The derivatives of [`weights`].
#[inline(always)]
pub fn slopes(t: f64) -> [f64; 4] {
    polynomials(t, [[-0.5, 0.0, 0.5, 0.0], [1.0, -2.0, 1.0, 0.0], [-0.5, 1.5, -1.5, 0.5]])
}

/// The second derivatives of [`weights`].
#[inline(always)]
pub fn bends(t: f64) -> [f64; 4] {
    polynomials(t, [[1.0, -2.0, 1.0, 0.0], [-1.0, 3.0, -3.0, 1.0]])
}

/// Four polynomials by their coefficients, those of a power side by side: a vector has all four.
#[inline(always)]
fn polynomials<const N: usize>(t: f64, by_power: [[f64; 4]; N]) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for of in by_power.iter().rev() {
        for i in 0..4 {
            sum[i] = sum[i] * t + of[i];
        }
    }
    sum
}

/// The coefficients of the spline through `values` (x fastest), axis by axis.
pub fn coefficients(mut values: Vec<f64>, mut shape: [usize; 3], boundary: EndCondition) -> Vec<f64> {
    for axis in 0..3 {
        let inner: usize = shape[..axis].iter().product();
        let n = shape[axis];
        match boundary {
            EndCondition::Periodic => {
                let mut line = vec![0.0; n];
                for lines in values.chunks_mut(inner * n) {
                    for x in 0..inner {
                        line.iter_mut().zip(lines[x..].iter().step_by(inner)).for_each(|(l, v)| *l = *v);
                        periodic(&mut line);
                        lines[x..].iter_mut().step_by(inner).zip(&line).for_each(|(v, l)| *v = *l);
                    }
                }
            }
            EndCondition::NotAKnot => {
                let mut to = vec![0.0; values.len() / n * (n + 2)];
                for (from, to) in values.chunks(inner * n).zip(to.chunks_mut(inner * (n + 2))) {
                    not_a_knot(from, to, n, inner);
                }
                values = to;
                shape[axis] += 2;
            }
        }
    }
    values
}

/// Replaces values on a circle by coefficients, (c₋ + 4 c + c₊) / 6 = v: a recursive filter (Unser, Aldroubi and Eden, B-spline
/// signal processing, IEEE Trans. Signal Process. 41, 1993).
fn periodic(line: &mut [f64]) {
    let n = line.len();
    let pole = 3f64.sqrt() - 2.0;
    // The sums over the whole circle; 0.268⁴⁸ is below rounding.
    let far = 48;
    let start =
        |line: &[f64], at: &dyn Fn(usize) -> usize| (0..far).rev().fold(0.0, |sum, m| sum * pole + line[at(m) % n]);
    line[0] = start(line, &|m| n * far - m);
    for k in 1..n {
        line[k] += pole * line[k - 1];
    }
    line[n - 1] = -pole * start(line, &|m| n - 1 + m);
    for k in (0..n - 1).rev() {
        line[k] = pole * (line[k + 1] - line[k]);
    }
    line.iter_mut().for_each(|v| *v *= 6.0);
}

/// Finds n + 2 coefficients along an axis, for `inner` lines side by side: (c₋ + 4c + c₊)/6 is the value, and the third
/// derivative does not jump at the nodes next to the ends.
fn not_a_knot(from: &[f64], to: &mut [f64], n: usize, inner: usize) {
    let f = |i: usize, x: usize| from[i * inner + x];
    // Coefficient i stands at entry i + 1.
    let at = |i: usize| (i + 1) * inner;
    for x in 0..inner {
        // The condition gives these outright.
        to[at(1) + x] = (8.0 * f(1, x) - f(0, x) - f(2, x)) / 6.0;
        let m = n - 2;
        to[at(m) + x] = (8.0 * f(m, x) - f(m - 1, x) - f(m + 1, x)) / 6.0;
    }
    // Between them, elimination and back substitution.
    let mut factor = vec![0.0; n];
    for i in 2..n - 2 {
        factor[i] = 1.0 / (4.0 - factor[i - 1]);
        for x in 0..inner {
            to[at(i) + x] = (6.0 * f(i, x) - to[at(i - 1) + x]) * factor[i];
        }
    }
    for i in (2..n - 2).rev() {
        for x in 0..inner {
            to[at(i) + x] -= factor[i] * to[at(i + 1) + x];
        }
    }
    for x in 0..inner {
        let c = |to: &[f64], i: usize| to[at(i) + x];
        to[at(0) + x] = 6.0 * f(1, x) - 4.0 * c(to, 1) - c(to, 2);
        to[x] = 6.0 * f(0, x) - 4.0 * c(to, 0) - c(to, 1);
        let l = n - 1;
        to[at(l) + x] = 6.0 * f(l - 1, x) - 4.0 * c(to, l - 1) - c(to, l - 2);
        to[at(n) + x] = 6.0 * f(l, x) - 4.0 * c(to, l) - c(to, l - 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::random;

    /// The spline of these coefficients at node (i, j, k).
    fn at_node(c: &[f64], shape: [usize; 3], node: [usize; 3], first: impl Fn(usize, usize) -> usize) -> f64 {
        let w = weights(0.0);
        let mut sum = 0.0;
        for i in 0..64 {
            let d = [i % 4, i / 4 % 4, i / 16];
            let [x, y, z] = [0, 1, 2].map(|a| first(node[a] + d[a], shape[a]));
            sum += w[d[0]] * w[d[1]] * w[d[2]] * c.get((z * shape[1] + y) * shape[0] + x).unwrap_or(&0.0);
        }
        sum
    }

    #[test]
    fn splines_pass_through_their_values() {
        let nodes = [7, 6, 9];
        let mut seed = 3;
        let values: Vec<f64> = (0..7 * 6 * 9).map(|_| random(&mut seed)).collect();
        let around = coefficients(values.clone(), nodes, EndCondition::Periodic);
        let open = coefficients(values.clone(), nodes, EndCondition::NotAKnot);
        assert_eq!((around.len(), open.len()), (7 * 6 * 9, 9 * 8 * 11));
        for (i, v) in values.iter().enumerate() {
            let node = [i % 7, i / 7 % 6, i / 42];
            let periodic = at_node(&around, nodes, node, |m, n| (m + n - 1) % n);
            // Entries past the last have no weight at a node.
            let not_a_knot = at_node(&open, nodes.map(|n| n + 2), node, |m, n| m.min(n - 1));
            assert!((periodic - v).abs() < 1e-13 && (not_a_knot - v).abs() < 1e-12, "{i}: {periodic} {not_a_knot} {v}");
        }
    }
}
