//! Distances of the nodes of a grid from some of them.

use super::phase_grid::Grid;

/// The distance (mm) of each node from the nearest of those that are `from`: squares along one axis after the other, each the lower
/// envelope of parabolas (Felzenszwalb and Huttenlocher, Distance transforms of sampled functions, Theory of Computing 8, 2012).
pub(super) fn distances(grid: &Grid, from: &[bool]) -> Vec<f64> {
    let far = 1e12 * grid.step.into_iter().fold(0.0, f64::max).powi(2);
    let mut squares: Vec<f64> = from.iter().map(|f| if *f { 0.0 } else { far }).collect();
    for a in 0..3 {
        let (length, stride, h) = (grid.shape[a], grid.strides()[a], grid.step[a]);
        let mut line = vec![0.0; length];
        let mut envelope: Vec<(usize, f64)> = Vec::new();
        for first in (0..grid.len()).filter(|n| grid.index(*n)[a] == 0) {
            (0..length).for_each(|i| line[i] = squares[first + i * stride]);
            lower(&line, h, &mut envelope);
            let mut k = 0;
            for i in 0..length {
                let x = i as f64 * h;
                while k + 1 < envelope.len() && envelope[k + 1].1 <= x {
                    k += 1;
                }
                let p = envelope[k].0;
                squares[first + i * stride] = line[p] + ((i as f64 - p as f64) * h).powi(2);
            }
        }
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// The parabolas f(p) + (x − p h)² that are the lowest somewhere, and from where on.
fn lower(f: &[f64], h: f64, envelope: &mut Vec<(usize, f64)>) {
    envelope.clear();
    for q in 0..f.len() {
        let b = q as f64 * h;
        let mut start = f64::NEG_INFINITY;
        while let Some(&(p, from)) = envelope.last() {
            let a = p as f64 * h;
            start = (f[q] + b * b - f[p] - a * a) / (2.0 * (b - a));
            if start > from {
                break;
            }
            envelope.pop();
            start = f64::NEG_INFINITY;
        }
        envelope.push((q, start));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::math::{Aabb, norm, sub};
    use geometry::random::random;

    #[test]
    fn distances_are_those_of_the_nearest_node() {
        let g = Grid::over(&Aabb { min: [0.0; 3], max: [3.0, 2.0, 5.0] }, [11, 13, 9]);
        let mut seed = 2;
        for share in [0.9, 0.99, 1.0] {
            let mut from: Vec<bool> = (0..g.len()).map(|_| random(&mut seed) > share).collect();
            from[77] = true;
            let all: Vec<usize> = (0..g.len()).filter(|n| from[*n]).collect();
            for (n, d) in distances(&g, &from).into_iter().enumerate() {
                let best = all.iter().map(|m| norm(sub(g.node(n), g.node(*m)))).fold(f64::INFINITY, f64::min);
                assert!((d - best).abs() < 1e-12, "{d} {best}");
            }
        }
    }
}
