//! Signs of the surfaces at the nodes of a block, and the classification of its cells by them, 64 at a time.

use std::ops::Range;

use multiversion::multiversion;

use super::cube_table::CASES;
use super::sampling_grid::LocalSolid;
use crate::csg_tree::CsgTree;

/// The words of signs in a block. Rows of nodes and rows of cells have the same numbers: y + ny · z.
#[derive(Default)]
pub(super) struct Signs {
    pub shape: [usize; 3],
    /// For each live surface and each row of nodes: where it is negative.
    pub negative: Vec<Vec<u64>>,
    /// For each live surface and each row of cells: the cells that it alone crosses, in one plain patch.
    pub plain: Vec<Vec<u64>>,
    /// For each row of cells: the feature cells, where surfaces meet or one surface has more than a plain patch.
    pub featured: Vec<u64>,
}

/// The bits below `n`.
pub(super) fn below(n: usize) -> u64 {
    if n >= 64 { u64::MAX } else { (1u64 << n) - 1 }
}

impl Signs {
    /// The cells of row (j, k) on the solid side of a grid-aligned plane.
    pub fn adjacent(local: &LocalSolid, flat: usize, j: usize, k: usize) -> u64 {
        let f = &local.grid_planes[flat];
        let lower = match f.axis {
            0 => below(f.at),
            1 => [0, u64::MAX][usize::from(j < f.at)],
            _ => [0, u64::MAX][usize::from(k < f.at)],
        };
        if f.below { lower } else { !lower }
    }

    /// Cells of row (j, k) in which a surface is negative at some corner, and at all.
    #[inline(always)]
    fn some_and_all(&self, surface: usize, j: usize, k: usize) -> (u64, u64) {
        let n = &self.negative[surface];
        let row = k * self.shape[1] + j;
        let w = [row, row + 1, row + self.shape[1], row + self.shape[1] + 1].map(|r| n[r]);
        let (some, all) = (w[0] | w[1] | w[2] | w[3], w[0] & w[1] & w[2] & w[3]);
        (some | some >> 1, all & all >> 1)
    }

    /// For each row of nodes, those of cells that can contain solid according to the first `known` live surfaces.
    pub fn wanted(&self, local: &LocalSolid, known: usize) -> Vec<u64> {
        let [nx, ny, nz] = self.shape;
        let mut nodes = vec![0u64; ny * nz];
        let inner = below(nx - 1);
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                let sign = |f: usize| match f.checked_sub(local.live.len()) {
                    Some(flat) => (Signs::adjacent(local, flat, j, k), Signs::adjacent(local, flat, j, k)),
                    None if f < known => self.some_and_all(f, j, k),
                    None => (u64::MAX, 0),
                };
                let possible = |t: &CsgTree| t.possible(&|f| sign(f).0, &|f| sign(f).1);
                let solid = local.trees.iter().fold(0, |w, t| w | possible(t)) & inner;
                let both = solid | solid << 1;
                for row in [k * ny + j, k * ny + j + 1, (k + 1) * ny + j, (k + 1) * ny + j + 1] {
                    nodes[row] |= both;
                }
            }
        }
        nodes
    }

    /// Classifies the cells; returns whether any contains surface.
    pub fn sort(&mut self, local: &LocalSolid) -> bool {
        let [nx, ny, nz] = self.shape;
        let surfaces = self.negative.len();
        self.plain.resize_with(surfaces, Vec::new);
        for p in &mut self.plain {
            p.clear();
            p.resize(ny * nz, 0);
        }
        self.featured.clear();
        self.featured.resize(ny * nz, 0);
        let inner = below(nx - 1);
        let mut context = vec![(0u64, 0u64); surfaces];
        let mut decides = vec![0u64; surfaces];
        let mut found = false;
        for k in 0..nz - 1 {
            for j in 0..ny - 1 {
                let mut crossed = 0u64;
                for (f, s) in context.iter_mut().enumerate() {
                    *s = self.some_and_all(f, j, k);
                    crossed |= s.0 & !s.1;
                }
                if crossed & inner == 0 {
                    continue;
                }
                decides.fill(0);
                let adjacent = |f: usize| Signs::adjacent(local, f - surfaces, j, k);
                for tree in &local.trees {
                    tree.deciding(
                        crossed & inner,
                        &|f| if f < surfaces { context[f].0 } else { adjacent(f) },
                        &|f| if f < surfaces { context[f].1 } else { adjacent(f) },
                        &mut |f, positions| {
                            if f < surfaces {
                                decides[f] |= positions;
                            }
                        },
                    );
                }
                let (mut once, mut double_crossings) = (0u64, 0u64);
                for d in &decides {
                    double_crossings |= once & d;
                    once |= d;
                }
                if once == 0 {
                    continue;
                }
                found = true;
                let row = k * ny + j;
                let mut featured = double_crossings;
                for f in 0..surfaces {
                    let one = decides[f] & !double_crossings;
                    let odd = self.odd(f, j, k, one);
                    featured |= odd;
                    self.plain[f][row] = one & !odd;
                }
                self.featured[row] = featured;
            }
        }
        found
    }

    /// Those of the cells whose patch is not plain: several loops, or corners that touch across a face of the cell.
    #[inline(always)]
    fn odd(&self, surface: usize, j: usize, k: usize, cells: u64) -> u64 {
        let mut odd = 0;
        let mut bits = cells;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            odd |= u64::from(!CASES[self.corners(surface, i, j, k)].plain) << i;
        }
        odd
    }

    /// The pattern of a cell's corners at which a surface is negative; corner bits are x = 1, y = 2, z = 4.
    #[inline(always)]
    pub fn corners(&self, surface: usize, i: usize, j: usize, k: usize) -> usize {
        let n = &self.negative[surface];
        let row = k * self.shape[1] + j;
        let pair = |r: usize| (n[r] >> i & 3) as usize;
        pair(row) | pair(row + 1) << 2 | pair(row + self.shape[1]) << 4 | pair(row + self.shape[1] + 1) << 6
    }

    /// The signs at the corners of a cell.
    pub fn at_corners(&self, [i, j, k]: [usize; 3]) -> CornerSigns {
        let mut found = CornerSigns { patterns: [0; 64], negative: 0, mixed: 0 };
        for f in 0..self.negative.len() {
            let pattern = self.corners(f, i, j, k);
            found.patterns[f] = pattern as u8;
            found.negative |= u64::from(pattern == 255) << f;
            found.mixed |= u64::from(pattern != 255 && pattern != 0) << f;
        }
        found
    }

    /// The parts behind and ahead of the only surface in a cell.
    pub fn parts_beside(&self, local: &LocalSolid, surface: usize, [i, j, k]: [usize; 3]) -> [u8; 2] {
        let row = k * self.shape[1] + j;
        [u64::MAX, 0].map(|own| {
            local.part(&|f| match f.checked_sub(local.live.len()) {
                Some(flat) => Signs::adjacent(local, flat, j, k) >> i,
                None if f == surface => own,
                None => self.negative[f][row] >> i,
            })
        })
    }

    /// Whether a surface is negative at a node.
    #[inline]
    pub fn is_negative(&self, surface: usize, node: usize) -> bool {
        // A division of short numbers is the faster one.
        let (node, nx) = (node as u32, self.shape[0] as u32);
        let row = node / nx;
        self.negative[surface][row as usize] >> (node - row * nx) & 1 == 1
    }

    /// Whether a cell of the block is a feature cell.
    #[inline]
    pub fn is_feature(&self, cell: [usize; 3]) -> bool {
        self.featured[cell[2] * self.shape[1] + cell[1]] >> cell[0] & 1 == 1
    }

    /// Whether the block has a feature cell.
    pub fn has_features(&self) -> bool {
        self.featured.iter().any(|w| *w != 0)
    }

    /// The feature cells of the block.
    pub fn feature_cells(&self) -> impl Iterator<Item = [usize; 3]> {
        let ny = self.shape[1];
        self.featured.iter().enumerate().flat_map(move |(row, w)| bits(*w).map(move |i| [i, row % ny, row / ny]))
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

/// The signs of the surfaces at the corners of a cell.
pub(super) struct CornerSigns {
    /// For each surface, the corners at which it is negative.
    patterns: [u8; 64],
    /// The surfaces that are negative at all corners, and those that change sign.
    negative: u64,
    mixed: u64,
}

impl CornerSigns {
    /// The surfaces that are negative at all of some corners, and those that change sign between them.
    pub fn among(&self, corners: [usize; 4]) -> (u64, u64) {
        let (mut all, mut some) = (0, 0);
        for f in bits(self.mixed) {
            let pattern = self.pattern(f, corners);
            all |= u64::from(pattern == 15) << f;
            some |= u64::from(pattern != 0) << f;
        }
        (self.negative | all, some & !all)
    }

    /// Those of some corners at which a surface is negative, as bits.
    pub fn pattern(&self, surface: usize, corners: [usize; 4]) -> usize {
        let at = corners.map(|c| usize::from(self.patterns[surface]) >> c & 1);
        at[0] | at[1] << 1 | at[2] << 2 | at[3] << 3
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
