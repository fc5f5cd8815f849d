//! Interpolation without overshoot.
//!
//! Source: F. N. Fritsch, R. E. Carlson, Monotone piecewise cubic interpolation, SIAM Journal on Numerical Analysis 17, 1980; the slopes are
//! the weighted harmonic means of Fritsch and Butland, SIAM Journal on Scientific and Statistical Computing 5, 1984.

/// The value at `x` of the piecewise cubic through points (x, y) of ascending x, one at least, that has no extremum between them; beyond
/// the ends the value there.
pub fn monotone(points: &[[f64; 2]], x: f64) -> f64 {
    let n = points.len();
    if n < 2 {
        return points[0][1];
    }
    let secant = |i: usize| (points[i + 1][1] - points[i][1]) / (points[i + 1][0] - points[i][0]);
    let slope = |i: usize| {
        if i == 0 || i + 1 == n {
            return secant(if i == 0 { 0 } else { n - 2 });
        }
        let (a, b) = (secant(i - 1), secant(i));
        if a * b <= 0.0 {
            return 0.0;
        }
        let (h, g) = (points[i][0] - points[i - 1][0], points[i + 1][0] - points[i][0]);
        3.0 * (h + g) / ((h + 2.0 * g) / a + (2.0 * h + g) / b)
    };
    let i = points.partition_point(|p| p[0] <= x).clamp(1, n - 1) - 1;
    let ([x0, y0], [x1, y1]) = (points[i], points[i + 1]);
    let h = x1 - x0;
    let t = ((x - x0) / h).clamp(0.0, 1.0);
    let (s, u) = (t * t * (3.0 - 2.0 * t), t * (1.0 - t));
    y0 + (y1 - y0) * s + h * u * ((1.0 - t) * slope(i) - t * slope(i + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotone_cubic_meets_its_points_and_goes_no_further() {
        let points = [[0.0, 0.0], [1.0, 0.1], [2.0, 0.1], [4.0, 3.0], [5.0, 3.2]];
        for [x, y] in points {
            assert!((monotone(&points, x) - y).abs() < 1e-12);
        }
        let all: Vec<f64> = (0..=500).map(|i| monotone(&points, f64::from(i) / 100.0)).collect();
        assert!(all.windows(2).all(|w| w[0] <= w[1] + 1e-15));
        // A straight line is one.
        let line = [[0.0, 1.0], [1.0, 3.0], [3.0, 7.0]];
        assert!((monotone(&line, 2.2) - 5.4).abs() < 1e-12);
    }
}
