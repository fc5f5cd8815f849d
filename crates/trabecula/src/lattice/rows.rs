//! The core of a lattice on the rows of a block.

use multiversion::multiversion;

use super::Lattice;
use crate::cell::{Distance, Series, Term};
use crate::field::Block;
use crate::map::{self, Affine};
use geometry::math::{Complex, Vec3, add, apply, complex_product, dot, sin_cos_turns, transpose};

/// The core on the rows of a block.
///
/// Under an affine map every wave is a product of three one-dimensional ones, so a row of nodes costs two
/// multiplications per distinct wave number along x and no trigonometry; a distance is looked up in its table.
/// Under any other map phases come row by row, and waves are summed at each node.
pub(crate) enum LatticeRows<'a> {
    Waves(RowWaves),
    Distance(&'a Distance, &'a Affine, Block<'a>),
    Phases(&'a Series, Box<dyn map::PhaseRows + 'a>, [Vec<f64>; 3]),
    Points(&'a Lattice, Block<'a>),
}

impl<'a> LatticeRows<'a> {
    pub(crate) fn new(lattice: &'a Lattice, block: &Block<'a>) -> LatticeRows<'a> {
        let series = lattice.cell.series();
        match (&lattice.distance, lattice.map.affine()) {
            (Some(d), Some(map)) => LatticeRows::Distance(d, map, *block),
            (None, Some(map)) => LatticeRows::Waves(RowWaves::new(series.terms(), map, block)),
            (Some(_), None) => LatticeRows::Points(lattice, *block),
            (None, None) => {
                let row = || vec![0.0; block.axes[0].len()];
                LatticeRows::Phases(series, lattice.map.rows(block), [row(), row(), row()])
            }
        }
    }

    /// Makes ready for the rows of layer k.
    pub(crate) fn enter_layer(&mut self, k: usize) {
        match self {
            LatticeRows::Waves(waves) => waves.enter_layer(k),
            LatticeRows::Phases(_, map, _) => map.enter_layer(k),
            LatticeRows::Distance(..) | LatticeRows::Points(..) => {}
        }
    }

    /// Fills the row (j, k) of the layer entered last; nodes whose bit in `wanted` is not set may be left out.
    pub(crate) fn fill(&mut self, j: usize, k: usize, wanted: u64, row: &mut [f32]) {
        match self {
            LatticeRows::Phases(series, map, u) => {
                map.fill(j, u);
                series.fill(u, row);
            }
            LatticeRows::Points(lattice, block) => {
                let [xs, ys, zs] = block.axes;
                // Blocks wider than a word are wanted whole.
                let here = |i: &usize| wanted == u64::MAX || wanted >> i & 1 == 1;
                let points: Vec<Vec3> = (0..xs.len()).filter(here).map(|i| [xs[i], ys[j], zs[k]]).collect();
                let mut values = vec![0.0; points.len()];
                lattice.cores(&points, &mut values);
                for (i, v) in (0..xs.len()).filter(here).zip(values) {
                    row[i] = v as f32;
                }
            }
            LatticeRows::Waves(waves) => sum_waves(waves, j, row),
            LatticeRows::Distance(d, map, block) => {
                let [xs, ys, zs] = block.axes;
                let base = add(apply(&map.matrix, [0.0, ys[j], zs[k]]), map.shift);
                d.fill_row(base, map.matrix.map(|r| r[0]), xs, row);
            }
        }
    }
}

/// The waves of a series on the nodes of a block, as tables along the axes.
pub(crate) struct RowWaves {
    /// For each distinct wave number along x: cosines and sines at the nodes.
    along_x: Vec<(Vec<f32>, Vec<f32>)>,
    /// For each distinct wave number along x: the terms that have it, and whether conjugated.
    groups: Vec<Vec<(usize, bool)>>,
    /// For each term: amplitude · e^{2πi(ky y + phase)} at the nodes along y.
    along_y: Vec<Vec<Complex>>,
    /// For each term: e^{2πi kz z} at the nodes along z.
    along_z: Vec<Vec<Complex>>,
    /// For each distinct wave number along x: the complex amplitude in the rows of the present layer.
    rows: Vec<Vec<Complex>>,
}

impl RowWaves {
    fn new(terms: &[Term], map: &Affine, block: &Block) -> RowWaves {
        let back = transpose(&map.matrix);
        let wave = |t: &Term| {
            let h = t.hkl.map(f64::from);
            (apply(&back, h), dot(h, map.shift) + t.phase)
        };
        let turn = |a: f64| {
            let (s, c) = sin_cos_turns(a);
            (c, s)
        };
        let mut numbers: Vec<f64> = Vec::new();
        let mut groups: Vec<Vec<(usize, bool)>> = Vec::new();
        let (mut along_y, mut along_z) = (Vec::new(), Vec::new());
        for (i, t) in terms.iter().enumerate() {
            let (k, phase) = wave(t);
            let (kx, flip) = (k[0].abs(), k[0] < 0.0);
            match numbers.iter().position(|&n| n == kx) {
                Some(g) => groups[g].push((i, flip)),
                None => {
                    numbers.push(kx);
                    groups.push(vec![(i, flip)]);
                }
            }
            let scaled = |a: f64| (t.amplitude * turn(a).0, t.amplitude * turn(a).1);
            along_y.push(block.axes[1].iter().map(|y| scaled(k[1] * y + phase)).collect());
            along_z.push(block.axes[2].iter().map(|z| turn(k[2] * z)).collect());
        }
        let along_x = numbers
            .iter()
            .map(|n| block.axes[0].iter().map(|x| turn(n * x)).map(|(c, s)| (c as f32, s as f32)).unzip())
            .collect();
        let rows = vec![vec![(0.0, 0.0); block.axes[1].len()]; groups.len()];
        RowWaves { along_x, groups, along_y, along_z, rows }
    }

    /// Finds the complex amplitudes of the rows in layer k.
    fn enter_layer(&mut self, k: usize) {
        for (group, rows) in self.groups.iter().zip(&mut self.rows) {
            rows.fill((0.0, 0.0));
            for &(i, flip) in group {
                let z = self.along_z[i][k];
                // Re(c e^{−ia}) = Re(conj(c) e^{ia}).
                let sign = if flip { -1.0 } else { 1.0 };
                for (sum, &y) in rows.iter_mut().zip(&self.along_y[i]) {
                    let c = complex_product(y, z);
                    *sum = (sum.0 + c.0, sum.1 + sign * c.1);
                }
            }
        }
    }
}

/// Sums the waves along row j of the present layer.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn sum_waves(waves: &RowWaves, j: usize, row: &mut [f32]) {
    for (n, ((cos, sin), amplitudes)) in waves.along_x.iter().zip(&waves.rows).enumerate() {
        let (re, im) = (amplitudes[j].0 as f32, amplitudes[j].1 as f32);
        let terms = row.iter_mut().zip(cos).zip(sin);
        if n == 0 {
            terms.for_each(|((o, c), s)| *o = re * c - im * s);
        } else {
            terms.for_each(|((o, c), s)| *o += re * c - im * s);
        }
    }
}
