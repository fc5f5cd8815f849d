//! A grid over the shares of n lattices, the simplex w ≥ 0, Σ wᵢ = 1, for piecewise linear interpolation.
//!
//! Coordinates are the partial sums y_k = m (w_k + … + wₙ), k = 2 … n, which descend: m ≥ y₂ ≥ … ≥ yₙ ≥ 0. Kuhn's (Freudenthal's)
//! triangulation of the unit cubes keeps that order, so every vertex of the simplex about a point is a node of the grid, and
//! interpolation by barycentric coordinates is continuous.

/// Steps along an edge of the grid for n lattices, so that it has a few hundred nodes.
fn steps(n: usize) -> usize {
    match n {
        0..=2 => 24,
        3 => 12,
        4 => 8,
        5 => 6,
        6 => 5,
        7 | 8 => 4,
        9 | 10 => 3,
        _ => 2,
    }
}

/// The grid.
pub(super) struct ShareGrid {
    n: usize,
    steps: usize,
    /// binomial[a][k] = C(a, k).
    binomial: Vec<Vec<usize>>,
}

/// The small simplex in which shares lie: its nodes, and the barycentric coordinates of the shares.
#[derive(Default)]
pub(super) struct ShareSimplex {
    pub nodes: Vec<usize>,
    pub coordinates: Vec<f64>,
    /// For each node but the first: index (from 0) of the y that rises by one from the node before it.
    pub axes: Vec<usize>,
    floor: Vec<usize>,
    order: Vec<(f64, usize)>,
}

impl ShareGrid {
    pub fn new(n: usize) -> ShareGrid {
        let steps = steps(n);
        let mut binomial = vec![vec![0usize; n + 1]; steps + n + 1];
        for a in 0..binomial.len() {
            binomial[a][0] = 1;
            for k in 1..=n.min(a) {
                binomial[a][k] = binomial[a - 1][k - 1] + if k < a { binomial[a - 1][k] } else { 0 };
            }
        }
        ShareGrid { n, steps, binomial }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        // C(m + n − 1, n − 1)
        self.binomial[self.steps + self.n - 1][self.n - 1]
    }

    /// The index of the node with these descending y: their rank in the combinatorial number system.
    fn index(&self, y: &[usize]) -> usize {
        let d = self.n - 1;
        (0..d).map(|k| self.binomial[y[k] + d - 1 - k][d - k]).sum()
    }

    /// Calls `each` with every node's index and shares.
    pub fn each_node(&self, mut each: impl FnMut(usize, &[f64])) {
        let (d, m) = (self.n - 1, self.steps);
        let mut y = vec![0usize; d];
        loop {
            let mut w = vec![0.0; self.n];
            for (i, w) in w.iter_mut().enumerate() {
                let above = if i == 0 { m } else { y[i - 1] };
                let below = if i == d { 0 } else { y[i] };
                *w = (above - below) as f64 / m as f64;
            }
            each(self.index(&y), &w);
            // The next descending sequence: the last that may rise does, those after it start from 0.
            let Some(i) = (0..d).rev().find(|&i| y[i] < if i == 0 { m } else { y[i - 1] }) else {
                return;
            };
            y[i] += 1;
            y[i + 1..].fill(0);
        }
    }

    /// Finds the simplex in which shares `w` lie.
    pub fn locate(&self, w: &[f64], at: &mut ShareSimplex) {
        let (d, m) = (self.n - 1, self.steps as f64);
        if d == 1 {
            // For two lattices node k is y = k.
            let y = (m * w[1]).clamp(0.0, m);
            let low = (y as usize).min(self.steps - 1);
            let share = y - low as f64;
            at.nodes.clear();
            at.nodes.extend([low, low + 1]);
            at.coordinates.clear();
            at.coordinates.extend([1.0 - share, share]);
            at.axes.clear();
            return at.axes.push(0);
        }
        at.floor.resize(d, 0);
        at.order.clear();
        let mut sum = 0.0;
        let mut node = 0;
        for k in (0..d).rev() {
            sum += w[k + 1];
            let y = (m * sum).clamp(0.0, m);
            let low = (y as usize).min(self.steps - 1);
            at.floor[k] = low;
            node += self.binomial[low + d - 1 - k][d - k];
            // The farthest first; of equal ones the first axis, so that the order of the y is kept.
            let share = y - low as f64;
            let before = at.order.iter().position(|o| o.0 <= share);
            at.order.insert(before.unwrap_or(at.order.len()), (share, k));
        }
        at.nodes.clear();
        at.coordinates.clear();
        at.axes.clear();
        let mut before = 1.0;
        at.nodes.push(node);
        for &(share, k) in &at.order {
            at.coordinates.push(before - share);
            before = share;
            // A y that rises by one: C(y + 1, d − k) = C(y, d − k) + C(y, d − k − 1).
            node += self.binomial[at.floor[k] + d - 1 - k][d - k - 1];
            at.nodes.push(node);
            at.axes.push(k);
        }
        at.coordinates.push(before);
    }

    /// Steps along an edge.
    pub fn steps(&self) -> usize {
        self.steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_numbered_once_and_linear_functions_are_exact() {
        for n in 2..=6 {
            let grid = ShareGrid::new(n);
            let slope: Vec<f64> = (0..n).map(|i| (i as f64 * 1.7).sin()).collect();
            let f = |w: &[f64]| w.iter().zip(&slope).map(|(w, s)| w * s).sum::<f64>();
            let mut table = vec![f64::NAN; grid.len()];
            grid.each_node(|i, w| {
                assert!(table[i].is_nan() && (w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                table[i] = f(w);
            });
            assert!(table.iter().all(|v| v.is_finite()));
            let mut at = ShareSimplex::default();
            for i in 0..2000 {
                let mut w: Vec<f64> = (0..n)
                    .map(|k| ((i * (k + 3)) as f64 * 0.7548776662466927).fract())
                    .map(|v| if v < 0.3 { 0.0 } else { v })
                    .collect();
                w[i % n] += 1e-3;
                let sum: f64 = w.iter().sum();
                w.iter_mut().for_each(|w| *w /= sum);
                grid.locate(&w, &mut at);
                let found: f64 = at.nodes.iter().zip(&at.coordinates).map(|(i, s)| table[*i] * s).sum();
                assert!(at.coordinates.iter().all(|s| *s >= -1e-12));
                assert!((found - f(&w)).abs() < 1e-12, "{n} {w:?}");
            }
        }
    }
}
