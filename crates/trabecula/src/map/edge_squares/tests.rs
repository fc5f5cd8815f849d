use super::super::poisson::Poisson;
use super::*;
use geometry::math::Aabb;
use geometry::random::random;

fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut s = seed;
    move || random(&mut s)
}

fn grid(shape: [usize; 3], size: Vec3) -> PhaseGrid {
    let b = Aabb { min: [-1.0, 0.5, 2.0], max: core::array::from_fn(|a| [-1.0, 0.5, 2.0][a] + size[a]) };
    PhaseGrid::over(&b, shape)
}

/// The part of a square below a line, by counting.
#[test]
fn parts_of_a_square_below_a_line() {
    let mut next = noise(4);
    for case in 0..200 {
        let (p, q, t) = (next().abs(), if case % 5 == 0 { 0.0 } else { next().abs() }, 0.8 * next());
        const N: usize = 200;
        let at = |i: usize| (i as f64 + 0.5) / N as f64 - 0.5;
        let count = (0..N * N).filter(|n| p * at(n % N) + q * at(n / N) <= t).count() as f64 / (N * N) as f64;
        // A row of squares more or less.
        assert!((below(t, [p, q]) - count).abs() < 1.5 / N as f64, "{p} {q} {t}");
    }
}

/// With a weight, what is found is stationary: the weighted sum of squares does not fall in any direction, which a
/// direct evaluation of the sum shows; and where all edges weigh the same it is the direct solution.
#[test]
fn weighted_least_squares_are_least() {
    let g = grid([14, 12, 11], [2.0, 3.0, 1.4]);
    let mut random = noise(5);
    let k: Vec<Vec3> = (0..g.len()).map(|_| [random(), random(), random()]).collect();
    let s: Vec<f64> = (0..g.len()).map(|n| (-2.0 * (g.node(n)[0].abs() - 0.3).max(0.0)).exp().max(1e-3)).collect();
    let LeastSquaresSolution { values: f, steps, left } =
        EdgeSquares::new(g, &s, None).fit(&slopes(&g, &k), vec![0.0; g.len()], None);
    assert!(left < RESIDUAL && steps < 30, "{steps} steps, {left}");
    let strides = g.strides();
    let sum = |f: &[f64]| {
        let mut sum = 0.0;
        for n in 0..g.len() {
            let at = g.index(n);
            for a in 0..3 {
                if at[a] + 1 < g.shape[a] {
                    let m = n + strides[a];
                    let faces =
                        (0..3).filter(|&b| b != a && (at[b] == 0 || at[b] + 1 == g.shape[b])).fold(1.0, |w, _| 0.5 * w);
                    let miss = (f[m] - f[n]) / g.step[a] - (k[n][a] + k[m][a]) / 2.0;
                    sum += faces * s[n] * s[m] * miss * miss;
                }
            }
        }
        sum
    };
    let least = sum(&f);
    for _ in 0..20 {
        let d: Vec<f64> = (0..g.len()).map(|n| random() * s[n]).collect();
        let moved = |by: f64| {
            let f: Vec<f64> = f.iter().zip(&d).map(|(f, d)| f + by * d).collect();
            sum(&f)
        };
        let slope = (moved(1e-3) - moved(-1e-3)) / 2e-3;
        // The residual, times the length of the direction and the steepness of the sum.
        assert!(slope.abs() < 1e-4 * least, "{slope} of {least}");
    }
    let ones = vec![1.0; g.len()];
    let even = EdgeSquares::new(g, &ones, None).fit(&slopes(&g, &k), vec![0.0; g.len()], None).values;
    let exact = Poisson::new(g).integrate(&k);
    let t: Vec<f64> = (0..g.len()).map(|n| g.trapezoid(n)).collect();
    let off = (0..g.len()).map(|n| t[n] * (even[n] - exact[n])).sum::<f64>() / t.iter().sum::<f64>();
    // The residual, of values of size one.
    assert!((0..g.len()).all(|n| (even[n] - exact[n] - off).abs() < 1e-7));
}

/// With a tilt the sum of the edges' squares and of those of the cells' middles, across K or along it, is least.
#[test]
fn tilted_least_squares_are_least() {
    let g = grid([11, 9, 8], [2.0, 3.0, 1.4]);
    let mut random = noise(9);
    let k: Vec<Vec3> = (0..g.len()).map(|_| [2.0 + random(), random(), random()]).collect();
    let even = vec![1.0; g.len()];
    for ratio in [0.1, 10.0] {
        let tilt = AngleWeight::new(g, &k, ratio, &even).expect("tilted");
        let squares = EdgeSquares::new(g, &even, None);
        let LeastSquaresSolution { values: f, left, .. } =
            squares.fit(&slopes(&g, &k), vec![0.0; g.len()], Some(&tilt));
        assert!(left < RESIDUAL);
        let strides = g.strides();
        let sum = |f: &[f64]| {
            let mut sum = 0.0;
            for n in 0..g.len() {
                let at = g.index(n);
                for a in (0..3).filter(|&a| at[a] + 1 < g.shape[a]) {
                    let m = n + strides[a];
                    let faces =
                        (0..3).filter(|&b| b != a && (at[b] == 0 || at[b] + 1 == g.shape[b])).fold(1.0, |w, _| 0.5 * w);
                    let miss = (f[m] - f[n]) / g.step[a] - (k[n][a] + k[m][a]) / 2.0;
                    sum += faces * miss * miss;
                }
                if (0..3).any(|a| at[a] + 1 == g.shape[a]) {
                    continue;
                }
                let corner = |i: usize| n + (0..3).map(|a| (i >> a & 1) * strides[a]).sum::<usize>();
                let mean = |a: usize| (0..8).map(|i| k[corner(i)][a]).sum::<f64>() / 8.0;
                let slope = |a: usize| {
                    let ends = (0..8).map(|i| f[corner(i)] * if i >> a & 1 == 1 { 0.25 } else { -0.25 });
                    ends.sum::<f64>() / g.step[a]
                };
                let want = [0, 1, 2].map(mean);
                let miss = [0, 1, 2].map(|a| slope(a) - want[a]);
                let long = want.iter().map(|v| v * v).sum::<f64>();
                let along = (0..3).map(|a| want[a] * miss[a]).sum::<f64>().powi(2) / long;
                let all: f64 = miss.iter().map(|m| m * m).sum();
                sum += if ratio > 1.0 { (ratio - 1.0) * (all - along) } else { (1.0 / ratio - 1.0) * along };
            }
            sum
        };
        let least = sum(&f);
        for _ in 0..10 {
            let d: Vec<f64> = (0..g.len()).map(|_| random()).collect();
            let moved = |by: f64| {
                let f: Vec<f64> = f.iter().zip(&d).map(|(f, d)| f + by * d).collect();
                sum(&f)
            };
            let slope = (moved(1e-3) - moved(-1e-3)) / 2e-3;
            assert!(slope.abs() < 1e-4 * least, "{ratio}: {slope} of {least}");
        }
    }
}

/// A field without sources that is along the boundary of a region has the constant as the function nearest to it, and with cut faces
/// that is found at second order, wherever the boundary crosses the grid.
#[test]
fn cut_faces_are_of_second_order() {
    let errors = [17, 33, 65].map(|n| {
        let g = PhaseGrid::over(&Aabb { min: [-1.0, -1.0, 0.0], max: [1.0, 1.0, 0.5] }, [n, n, n / 4 + 2]);
        let depth: Vec<f64> = (0..g.len())
            .map(|n| {
                let [x, y, _] = g.node(n);
                (x.hypot(y) - 0.93).max(0.37 - x.hypot(y))
            })
            .collect();
        let round = |[x, y, _]: Vec3| {
            let r = x.hypot(y).max(0.1);
            [-y / (r * r) * (1.0 - r), x / (r * r) * (1.0 - r), 0.0]
        };
        let k: Vec<Vec3> = (0..g.len()).map(|n| round(g.node(n))).collect();
        let squares = EdgeSquares::new(g, &vec![1.0; g.len()], Some(&depth));
        let f = squares.fit(&slopes(&g, &k), vec![0.0; g.len()], None).values;
        let inside = || (0..g.len()).filter(|n| depth[*n] <= 0.0).map(|n| f[n]);
        let (low, high) = inside().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        high - low
    });
    println!("{errors:?}");
    assert!(errors[0] < 0.02 && errors[0] / errors[2] > 8.0, "{errors:?}");
}
