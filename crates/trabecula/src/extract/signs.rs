//! What the signs of the faces at the nodes say of the cells of a block, 64 cells at a time.

use std::ops::Range;

use multiversion::multiversion;

use super::grid::Local;
use super::table::CASES;

/// The words of signs in a block. Rows of nodes and rows of cells have the same numbers: y + ny · z.
#[derive(Default)]
pub(super) struct Signs {
    pub shape: [usize; 3],
    /// For each live face and each row of nodes: where it is negative.
    pub negative: Vec<Vec<u64>>,
    /// For each live face and each row of cells: the cells that it alone crosses, in one plain patch.
    pub plain: Vec<Vec<u64>>,
    /// For each row of cells: those where faces meet, or one face makes more than a plain patch.
    pub knotted: Vec<u64>,
}

/// The bits below `n`.
pub(super) fn below(n: usize) -> u64 {
    if n >= 64 { u64::MAX } else { (1u64 << n) - 1 }
}

impl Signs {
    /// The cells of row (j, k) on the solid side of a laid face.
    pub fn beside(local: &Local, flat: usize, j: usize, k: usize) -> u64 {
        let f = &local.flat[flat];
        let lower = match f.axis {
            0 => below(f.at),
            1 => [0, u64::MAX][usize::from(j < f.at)],
            _ => [0, u64::MAX][usize::from(k < f.at)],
        };
        if f.below { lower } else { !lower }
    }

    /// Cells of row (j, k) in which a face is negative at some corner, and at all.
    #[inline(always)]
    fn some_and_all(&self, face: usize, j: usize, k: usize) -> (u64, u64) {
        let n = &self.negative[face];
        let row = k * self.shape[1] + j;
        let w = [row, row + 1, row + self.shape[1], row + self.shape[1] + 1].map(|r| n[r]);
        let (some, all) = (w[0] | w[1] | w[2] | w[3], w[0] & w[1] & w[2] & w[3]);
        (some | some >> 1, all & all >> 1)
    }

    /// For each row of nodes, those at cells that can hold solid as far as the first `known` live faces tell.
    pub fn wanted(&self, local: &Local, known: usize) -> Vec<u64> {
        let [nx, ny, nz] = self.shape;
        let mut nodes = vec![0u64; ny * nz];
        let inner = below(nx - 1);
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                let solid = local.tree.solid(&|f| match f.checked_sub(local.live.len()) {
                    Some(flat) => Signs::beside(local, flat, j, k),
                    None if f < known => self.some_and_all(f, j, k).0,
                    None => u64::MAX,
                }) & inner;
                let both = solid | solid << 1;
                for row in [k * ny + j, k * ny + j + 1, (k + 1) * ny + j, (k + 1) * ny + j + 1] {
                    nodes[row] |= both;
                }
            }
        }
        nodes
    }

    /// Sorts the cells; whether any holds surface.
    pub fn sort(&mut self, local: &Local) -> bool {
        let [nx, ny, nz] = self.shape;
        let faces = self.negative.len();
        self.plain.resize_with(faces, Vec::new);
        for p in &mut self.plain {
            p.clear();
            p.resize(ny * nz, 0);
        }
        self.knotted.clear();
        self.knotted.resize(ny * nz, 0);
        let inner = below(nx - 1);
        let mut seen = vec![(0u64, 0u64); faces];
        let mut decides = vec![0u64; faces];
        let mut found = false;
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                let mut crossed = 0u64;
                for (f, s) in seen.iter_mut().enumerate() {
                    *s = self.some_and_all(f, j, k);
                    crossed |= s.0 & !s.1;
                }
                if crossed & inner == 0 {
                    continue;
                }
                decides.fill(0);
                let beside = |f: usize| Signs::beside(local, f - faces, j, k);
                local.tree.deciding(
                    crossed & inner,
                    &|f| if f < faces { seen[f].0 } else { beside(f) },
                    &|f| if f < faces { seen[f].1 } else { beside(f) },
                    &mut |f, places| {
                        if f < faces {
                            decides[f] |= places;
                        }
                    },
                );
                let (mut once, mut twice) = (0u64, 0u64);
                for d in &decides {
                    twice |= once & d;
                    once |= d;
                }
                if once == 0 {
                    continue;
                }
                found = true;
                let row = k * ny + j;
                let mut knotted = twice;
                for f in 0..faces {
                    let one = decides[f] & !twice;
                    let odd = self.odd(f, j, k, one);
                    knotted |= odd;
                    self.plain[f][row] = one & !odd;
                }
                self.knotted[row] = knotted;
            }
        }
        found
    }

    /// Those of the cells whose patch is not plain: several loops, or corners that touch across a face.
    #[inline(always)]
    fn odd(&self, face: usize, j: usize, k: usize, cells: u64) -> u64 {
        let mut odd = 0;
        let mut bits = cells;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            odd |= u64::from(!CASES[self.corners(face, i, j, k)].plain) << i;
        }
        odd
    }

    /// The pattern of a cell's corners at which a face is negative; corner bits are x = 1, y = 2, z = 4.
    #[inline(always)]
    pub fn corners(&self, face: usize, i: usize, j: usize, k: usize) -> usize {
        let n = &self.negative[face];
        let row = k * self.shape[1] + j;
        let pair = |r: usize| (n[r] >> i & 3) as usize;
        pair(row) | pair(row + 1) << 2 | pair(row + self.shape[1]) << 4 | pair(row + self.shape[1] + 1) << 6
    }

    /// Whether a face is negative at a node.
    #[inline]
    pub fn is_negative(&self, face: usize, node: usize) -> bool {
        let nx = self.shape[0];
        self.negative[face][node / nx] >> (node % nx) & 1 == 1
    }

    /// Whether a cell of the block is knotted.
    #[inline]
    pub fn is_knotted(&self, cell: [usize; 3]) -> bool {
        self.knotted[cell[2] * self.shape[1] + cell[1]] >> cell[0] & 1 == 1
    }

    /// Whether any cell of the block is knotted.
    pub fn is_any_knotted(&self) -> bool {
        self.knotted.iter().any(|w| *w != 0)
    }

    /// The knotted cells of the block.
    pub fn knotted_cells(&self) -> impl Iterator<Item = [usize; 3]> {
        let ny = self.shape[1];
        self.knotted.iter().enumerate().flat_map(move |(row, w)| bits(*w).map(move |i| [i, row % ny, row / ny]))
    }

    /// For a word of cells in each row: the grid edges along `axis` that belong to any of them, for row (j, k).
    #[inline(always)]
    pub fn edges_of(&self, cells: &[u64], axis: usize, j: usize, k: usize) -> u64 {
        let ny = self.shape[1];
        let at = |dj: usize, dk: usize| {
            if j < dj || k < dk { 0 } else { cells[(k - dk) * ny + j - dj] }
        };
        match axis {
            0 => at(0, 0) | at(1, 0) | at(0, 1) | at(1, 1),
            1 => {
                let w = at(0, 0) | at(0, 1);
                w | w << 1
            }
            _ => {
                let w = at(0, 0) | at(1, 0);
                w | w << 1
            }
        }
    }
}

/// The numbers of the bits that are set.
pub(super) fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (word != 0).then(|| {
            let i = word.trailing_zeros() as usize;
            word &= word - 1;
            i
        })
    })
}

/// The word of signs of each row of samples: the bits whose value is negative, or zero too if `zero_counts`.
///
/// Zero counts for the region, so that bodies that touch are joined. For the lattice it does not: where a surface runs
/// through the very corner of a region, the corner would become a speck of solid.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn negative(words: &mut Vec<u64>, samples: &[f32], nx: usize, zero_counts: bool) {
    // The negative number nearest to zero.
    let most = if zero_counts { 0.0 } else { -f32::from_bits(1) };
    words.clear();
    for row in samples.chunks_exact(nx) {
        let mut signs = 0u64;
        let (whole, rest) = row.as_chunks::<32>();
        for (k, values) in whole.iter().enumerate() {
            // Thirty-two values, so that a lane of the vector is as wide as a value.
            let lanes: [u32; 32] = core::array::from_fn(|i| u32::from(values[i] <= most) << i);
            signs |= u64::from(lanes.iter().fold(0, |w, b| w | b)) << (32 * k);
        }
        for (i, v) in rest.iter().enumerate() {
            signs |= u64::from(*v <= most) << (32 * whole.len() + i);
        }
        words.push(signs);
    }
}

/// The cells of a word within a range.
pub(super) fn within(range: &Range<usize>) -> u64 {
    below(range.end) & !below(range.start)
}
