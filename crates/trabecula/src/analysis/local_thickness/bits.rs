//! A set of voxels, one bit each, in whole words for each row along x.

use core::ops::Range;

/// Bits of a word.
const WIDE: usize = 64;

/// A set of voxels.
#[derive(Clone)]
pub(super) struct Bits {
    pub words: Vec<u64>,
    /// Words of a row.
    pub stride: usize,
}

impl Bits {
    pub(super) fn new([nx, ny, nz]: [usize; 3]) -> Bits {
        let stride = nx.div_ceil(WIDE);
        Bits { words: vec![0; stride * ny * nz], stride }
    }

    /// Whether voxel `x` of row `row` is in the set.
    pub(super) fn has(&self, row: usize, x: usize) -> bool {
        self.words[row * self.stride + x / WIDE] >> (x % WIDE) & 1 == 1
    }

    pub(super) fn count(&self) -> usize {
        self.words.iter().map(|w| w.count_ones() as usize).sum()
    }
}

/// The words of a row that a span of voxels touches, each with the bits of the span.
pub(super) fn masks(span: Range<usize>) -> impl Iterator<Item = (usize, u64)> {
    let words = if span.is_empty() { 0..0 } else { span.start / WIDE..span.end.div_ceil(WIDE) };
    words.map(move |w| {
        let low = span.start.saturating_sub(w * WIDE);
        let high = (span.end - w * WIDE).min(WIDE);
        (w, u64::MAX << low & u64::MAX >> (WIDE - high))
    })
}

/// The places of the bits that are set.
pub(super) fn ones(mut word: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        if word == 0 {
            return None;
        }
        let at = word.trailing_zeros() as usize;
        word &= word - 1;
        Some(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_as_words() {
        for (a, b) in [(0, 0), (0, 1), (3, 64), (3, 65), (63, 64), (64, 130), (10, 200)] {
            let found: Vec<usize> = masks(a..b).flat_map(|(w, m)| ones(m).map(move |i| w * 64 + i)).collect();
            assert_eq!(found, (a..b).collect::<Vec<_>>());
        }
    }
}
