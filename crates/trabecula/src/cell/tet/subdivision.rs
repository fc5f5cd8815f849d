//! Freudenthal's subdivision of the tetrahedron, and a tetrahedral cell sampled on it.
//!
//! Nodes are (k_0, k_1, k_2, k_3)/n. The small tetrahedra are those of cubes cut along their diagonals; on each of the four
//! faces they leave the plain triangular grid, whatever the order of the corners. So two tetrahedra of a mesh that number
//! their corners by the mesh's nodes have the same small triangles on a common face.

use super::{Bary, TetCell};

/// Names of nodes and edges of a subdivision into n steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subdivision {
    /// Steps along an edge.
    pub n: usize,
}

/// Whole barycentric coordinates; their sum is n.
pub type Whole = [u16; 4];

impl Subdivision {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        (self.n + 1) * (self.n + 2) * (self.n + 3) / 6
    }

    /// The number of the node (i, j, k), n ≥ i ≥ j ≥ k ≥ 0, whose coordinates are (n − i, i − j, j − k, k). Numbers
    /// ascend as coordinates descend, the first first: nodes of a face or an edge come in the same order in every
    /// tetrahedron that has it.
    #[inline]
    pub fn index(i: usize, j: usize, k: usize) -> usize {
        i * (i + 1) * (i + 2) / 6 + j * (j + 1) / 2 + k
    }

    /// The coordinates of all nodes, in order.
    pub fn whole(&self) -> Vec<Whole> {
        let mut out = Vec::with_capacity(self.nodes());
        for i in 0..=self.n {
            for j in 0..=i {
                for k in 0..=j {
                    out.push([self.n - i, i - j, j - k, k].map(|v| v as u16));
                }
            }
        }
        out
    }

    /// Coordinates that sum to one.
    #[inline]
    pub fn bary(&self, k: Whole) -> Bary {
        k.map(|v| f64::from(v) / self.n as f64)
    }

    /// Calls `f` with the four nodes of each small tetrahedron, and whether they are in positive order. From each to any
    /// later of the four the step in (i, j, k) is of zeros and ones.
    pub fn each_tet(&self, mut f: impl FnMut([[usize; 3]; 4], bool)) {
        // The paths from a cube's corner to the opposite one, axis after axis.
        const PATHS: [([usize; 3], bool); 6] = [
            ([0, 1, 2], true),
            ([1, 2, 0], true),
            ([2, 0, 1], true),
            ([1, 0, 2], false),
            ([0, 2, 1], false),
            ([2, 1, 0], false),
        ];
        for i in 0..self.n {
            for j in 0..=i {
                for k in 0..=j {
                    for (path, even) in PATHS {
                        let mut at = [[i, j, k]; 4];
                        for s in 0..3 {
                            at[s + 1] = at[s];
                            at[s + 1][path[s]] += 1;
                        }
                        if at.iter().all(|[i, j, k]| i >= j && j >= k) {
                            f(at, even);
                        }
                    }
                }
            }
        }
    }

    /// Calls `f` with the three nodes (a, b) of each small triangle of a face, n ≥ a ≥ b ≥ 0, positively ordered or not.
    pub fn each_triangle(&self, mut f: impl FnMut([[usize; 2]; 3], bool)) {
        for a in 0..self.n {
            for b in 0..=a {
                f([[a, b], [a + 1, b], [a + 1, b + 1]], true);
                if b < a {
                    f([[a, b], [a, b + 1], [a + 1, b + 1]], false);
                }
            }
        }
    }
}

/// A cell on a subdivision: values at the nodes, and slopes along the edges at both their ends. The same in all bits at
/// points that differ in the order of their coordinates.
pub struct SubdivisionNodes {
    /// The subdivision.
    pub grid: Subdivision,
    /// Coordinates of the nodes.
    pub whole: Vec<Whole>,
    /// f at the nodes.
    pub values: Vec<f64>,
    /// ∂f/∂λ at the nodes.
    gradients: Vec<Bary>,
    /// The node whose coordinates are the same in descending order.
    sorted: Vec<u32>,
}

impl SubdivisionNodes {
    /// Evaluates f where coordinates descend, and copies it to the rest.
    pub fn new(cell: &TetCell, grid: Subdivision) -> SubdivisionNodes {
        let whole = grid.whole();
        let descends = |k: &Whole| k.windows(2).all(|p| p[0] >= p[1]);
        let main: Vec<usize> = (0..whole.len()).filter(|i| descends(&whole[*i])).collect();
        let at: Vec<Bary> = main.iter().map(|i| grid.bary(whole[*i])).collect();
        let (mut v, mut g) = (vec![0.0; at.len()], vec![[0.0; 4]; at.len()]);
        cell.gradients(&at, &mut v, &mut g);
        let sorted: Vec<u32> = whole
            .iter()
            .map(|k| {
                let mut k = *k;
                k.sort_unstable_by(|a, b| b.cmp(a));
                Subdivision::index(grid.n - usize::from(k[0]), usize::from(k[2] + k[3]), usize::from(k[3])) as u32
            })
            .collect();
        let (mut values, mut gradients) = (vec![0.0; whole.len()], vec![[0.0; 4]; whole.len()]);
        for ((i, v), g) in main.iter().zip(v).zip(g) {
            (values[*i], gradients[*i]) = (v, g);
        }
        for i in 0..whole.len() {
            values[i] = values[sorted[i] as usize];
        }
        SubdivisionNodes { grid, whole, values, gradients, sorted }
    }

    /// The change of f over the small edge from node a to node b by its slope at a: ∂f/∂λ · (λ_b − λ_a).
    pub fn slope(&self, a: usize, b: usize) -> f64 {
        // The four pairs of coordinates in an order that does not depend on that of the corners.
        let (ka, kb) = (&self.whole[a], &self.whole[b]);
        let mut pairs: [(u16, u16); 4] = core::array::from_fn(|i| (ka[i], kb[i]));
        pairs.sort_unstable_by(|x, y| y.cmp(x));
        let g = &self.gradients[self.sorted[a] as usize];
        let step = |i: usize| f64::from(pairs[i].1) - f64::from(pairs[i].0);
        let sum = g[0] * step(0) + g[1] * step(1) + g[2] * step(2) + g[3] * step(3);
        sum / self.grid.n as f64
    }
}
