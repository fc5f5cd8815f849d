//! Deflate for rows of one pattern, such as `<vertex x="1" y="2" z="3"/>`.
//!
//! A general compressor searches for matches; here each row repeats the one before but for its numbers, so the match
//! is known: the same attribute one row up. That makes the text of a mesh smaller than a fast general setting does,
//! and several times faster.
//!
//! Source: RFC 1951.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

const LITERALS: usize = 286;
const DISTANCES: usize = 30;
const END: usize = 256;
const LONGEST: usize = 258;
/// One block that ends at a byte and is not the last.
pub fn rows(text: &[u8]) -> Vec<u8> {
    let tokens = Tokens::of(text);
    let literals = codes(&lengths(&tokens.literals));
    let distances = codes(&lengths(&tokens.distances));
    let mut bits = Bits::new(text.len() / 4);
    // A dynamic block with all code lengths given plainly: four bits each for the numbers 0 to 15.
    bits.room(LITERALS);
    bits.put(0b100, 3);
    bits.put((LITERALS - 257) as u64, 5);
    bits.put((DISTANCES - 1) as u64, 5);
    bits.put(15, 4);
    (0..19).for_each(|i| bits.put(if i < 3 { 0 } else { 4 }, 3));
    for (_, length) in literals.iter().chain(&distances) {
        bits.put(reversed(*length, 4).into(), 4);
    }
    let lengths = std::array::from_fn::<_, { LONGEST + 1 }, _>(|l| {
        let (symbol, extra, n) = length_code(l.max(3) as u32);
        let (code, width) = literals[symbol];
        (u64::from(code | extra << width), width + n)
    });
    let mut rest = text;
    for run in &tokens.runs {
        let (plain, behind) = rest.split_at(run.plain as usize);
        rest = &behind[usize::from(run.length)..];
        // Codes have at most 15 bits.
        bits.room(2 * plain.len() + 8);
        for some in plain.chunks(3) {
            let (mut v, mut n) = (0, 0);
            for b in some {
                let (code, width) = literals[usize::from(*b)];
                v |= u64::from(code) << n;
                n += width;
            }
            bits.put(v, n);
        }
        if run.length > 0 {
            let (v, at) = lengths[usize::from(run.length)];
            let (symbol, extra, n) = distance_code(run.back.into());
            let (code, width) = distances[symbol];
            bits.put(v | u64::from(code | extra << width) << at, at + width + n);
        }
    }
    let (code, n) = literals[END];
    bits.room(16);
    bits.put(code.into(), n);
    // An empty stored block begins at a byte and ends at one.
    bits.put(0, 3);
    bits.finish(&[0, 0, 0xff, 0xff])
}

/// Some bytes as they are, then a match.
struct Run {
    plain: u32,
    /// Length of the match, or 0 where there is none.
    length: u16,
    /// Its distance less one.
    back: u16,
}

/// Runs in order, and how often each symbol occurs.
struct Tokens {
    runs: Vec<Run>,
    /// Bytes since the last match.
    plain: u32,
    literals: [u32; LITERALS],
    lengths: [u32; LONGEST + 1],
    distances: [u32; DISTANCES],
}

impl Tokens {
    /// The tokens of a text. `at` runs through it, `up` through the same places one row before.
    fn of(text: &[u8]) -> Tokens {
        let mut tokens = Tokens {
            runs: Vec::with_capacity(text.len() / 8),
            plain: 0,
            literals: [0; LITERALS],
            lengths: [0; LONGEST + 1],
            distances: [0; DISTANCES],
        };
        // Two symbols of each kind at least make a complete code.
        (tokens.literals[0], tokens.literals[END]) = (1, 1);
        (tokens.distances[0], tokens.distances[1]) = (1, 1);
        let mut at = text.iter().position(|b| *b == b'\n').map_or(text.len(), |n| n + 1);
        let mut up = 0;
        tokens.plain(&text[..at]);
        while at < text.len() {
            let n = common(text, up, at).min(LONGEST);
            if n >= 4 && at - up <= 32768 {
                tokens.matched(n as u32, (at - up) as u32);
            } else {
                tokens.plain(&text[at..at + n]);
            }
            (at, up) = (at + n, up + n);
            if n == LONGEST {
                continue;
            }
            // The rows part inside a number: the next quote is where they meet again.
            let quote = |b: &u8| *b == b'"';
            let n = text[at..].iter().position(quote).unwrap_or(text.len() - at);
            tokens.plain(&text[at..at + n]);
            at += n;
            while up + 1 < at && text[up] != b'"' {
                up += 1;
            }
            if at < text.len() && text[up] != text[at] {
                tokens.plain(&text[at..at + 1]);
                at += 1;
            }
        }
        tokens.end(0, 0);
        for length in 3..=LONGEST {
            tokens.literals[length_code(length as u32).0] += tokens.lengths[length];
        }
        tokens
    }

    #[inline]
    fn plain(&mut self, text: &[u8]) {
        for b in text {
            self.literals[usize::from(*b)] += 1;
        }
        self.plain += text.len() as u32;
    }

    #[inline]
    fn matched(&mut self, length: u32, distance: u32) {
        self.lengths[length as usize] += 1;
        self.distances[distance_code(distance - 1).0] += 1;
        self.end(length as u16, (distance - 1) as u16);
    }

    #[inline]
    fn end(&mut self, length: u16, back: u16) {
        let plain = std::mem::take(&mut self.plain);
        self.runs.push(Run { plain, length, back });
    }
}

/// Number of equal bytes from `a` and from `b` > `a` on; counting ends soon after `LONGEST`.
#[inline]
fn common(text: &[u8], a: usize, b: usize) -> usize {
    let word = |i: usize| text.get(i..i + 8).and_then(|w| w.try_into().ok()).map(u64::from_le_bytes);
    let mut n = 0;
    while n < LONGEST
        && let (Some(x), Some(y)) = (word(a + n), word(b + n))
    {
        if x != y {
            return n + (x ^ y).trailing_zeros() as usize / 8;
        }
        n += 8;
    }
    while n < LONGEST && b + n < text.len() && text[a + n] == text[b + n] {
        n += 1;
    }
    n
}

/// Symbol, extra bits and their number for a match length of 3 to 258.
#[inline]
fn length_code(length: u32) -> (usize, u32, u32) {
    let l = length - 3;
    if l < 8 {
        return (257 + l as usize, 0, 0);
    }
    if l == 255 {
        return (285, 0, 0);
    }
    let log = l.ilog2();
    let n = log - 2;
    (257 + 4 * (log as usize - 1) + (l >> n & 3) as usize, l & ((1 << n) - 1), n)
}

/// Symbol, extra bits and their number for a distance less one.
#[inline]
fn distance_code(d: u32) -> (usize, u32, u32) {
    if d < 4 {
        return (d as usize, 0, 0);
    }
    let log = d.ilog2();
    let n = log - 1;
    (2 * log as usize + (d >> n & 1) as usize, d & ((1 << n) - 1), n)
}

/// Huffman code lengths of at most 15 bits; zero for what never occurs.
fn lengths(counts: &[u32]) -> Vec<u32> {
    let mut weights: Vec<u64> = counts.iter().map(|c| u64::from(*c)).collect();
    loop {
        let mut heap: BinaryHeap<Reverse<(u64, usize)>> =
            weights.iter().enumerate().filter(|(_, w)| **w > 0).map(|(i, w)| Reverse((*w, i))).collect();
        let mut parent = vec![usize::MAX; weights.len()];
        while let (Some(Reverse((a, i))), Some(Reverse((b, j)))) = (heap.pop(), heap.pop()) {
            (parent[i], parent[j]) = (parent.len(), parent.len());
            heap.push(Reverse((a + b, parent.len())));
            parent.push(usize::MAX);
        }
        // Parents stand behind their children, so depths are known from the back.
        let mut depth = vec![0u32; parent.len()];
        for i in (0..parent.len()).rev() {
            if parent[i] != usize::MAX {
                depth[i] = depth[parent[i]] + 1;
            }
        }
        depth.truncate(weights.len());
        if depth.iter().all(|d| *d <= 15) {
            return depth;
        }
        // Flatter weights make a flatter tree.
        weights.iter_mut().filter(|w| **w > 0).for_each(|w| *w = *w / 2 + 1);
    }
}

/// The low `n` bits in reverse order: codes go out from their highest bit.
fn reversed(v: u32, n: u32) -> u32 {
    if n == 0 { 0 } else { v.reverse_bits() >> (32 - n) }
}

/// Canonical codes, as they go out, with their lengths.
fn codes(lengths: &[u32]) -> Vec<(u32, u32)> {
    let mut next = [0u32; 17];
    for n in 1..16 {
        let used = lengths.iter().filter(|l| **l == n).count() as u32;
        next[n as usize + 1] = (next[n as usize] + used) << 1;
    }
    let code = |&n: &u32| {
        let v = next[n as usize];
        next[n as usize] += u32::from(n > 0);
        (reversed(v, n), n)
    };
    lengths.iter().map(code).collect()
}

/// Bits, lowest first.
struct Bits {
    /// Whole bytes up to `at`; room behind them.
    out: Vec<u8>,
    at: usize,
    held: u64,
    /// Fewer than eight.
    count: u32,
}

impl Bits {
    fn new(room: usize) -> Bits {
        Bits { out: vec![0; room], at: 0, held: 0, count: 0 }
    }

    /// Makes room for `bytes` more.
    #[inline]
    fn room(&mut self, bytes: usize) {
        let need = self.at + bytes + 8;
        if need > self.out.len() {
            self.out.resize(need + need / 2, 0);
        }
    }

    /// Adds the low `n` ≤ 56 bits of `v`, whose higher bits are zero, where there is room.
    #[inline]
    fn put(&mut self, v: u64, n: u32) {
        self.held |= v << self.count;
        self.count += n;
        // All that is held goes out at each turn, without asking whether it fills bytes; what does not is written over.
        self.out[self.at..self.at + 8].copy_from_slice(&self.held.to_le_bytes());
        self.at += (self.count >> 3) as usize;
        self.held >>= self.count & !7;
        self.count &= 7;
    }

    /// Fills the last byte with zeros and adds `bytes`.
    fn finish(mut self, bytes: &[u8]) -> Vec<u8> {
        self.out.truncate(self.at + usize::from(self.count > 0));
        self.out.extend_from_slice(bytes);
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Decompress, FlushDecompress};

    fn check(text: &[u8]) -> usize {
        let packed = rows(text);
        let mut out = Vec::with_capacity(text.len() + 1);
        let mut state = Decompress::new(false);
        let whole = [&packed[..], &[3, 0]].concat();
        state.decompress_vec(&whole, &mut out, FlushDecompress::Finish).unwrap();
        assert!(out == text, "{:?}", String::from_utf8_lossy(&text[..text.len().min(200)]));
        packed.len()
    }

    #[test]
    fn rows_come_back_and_shrink() {
        let mut text = String::new();
        let mut seed = 1u64;
        for i in 0..5000u64 {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            text += &format!("<triangle v1=\"{}\" v2=\"{}\" v3=\"{}\"/>\n", i / 2, i / 2 + (seed >> 61), seed >> 50);
        }
        let packed = check(text.as_bytes());
        assert!(packed < text.len() / 5, "{packed} of {}", text.len());
    }

    #[test]
    fn any_text_comes_back() {
        check(b"");
        check(b"\n");
        check(b"no line end");
        check(b"\"\"\n\"\"\"\n\n\"a\"b\"\n");
        check(&vec![b'a'; 5000]);
        check(&[b"\n".repeat(700), b"x".repeat(70_000), b"\"\n".repeat(9)].concat());
        let mut seed = 5u64;
        for n in 0..300 {
            let text: Vec<u8> = (0..n * 7)
                .map(|_| {
                    seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    b"\"\n01<\xff"[(seed >> 40) as usize % 6]
                })
                .collect();
            check(&text);
        }
    }

    #[test]
    fn codes_are_complete_and_at_most_fifteen_bits() {
        // Fibonacci counts make the deepest tree.
        let mut counts = vec![1u32, 1];
        while counts.len() < 40 {
            counts.push(counts[counts.len() - 1] + counts[counts.len() - 2]);
        }
        let lengths = lengths(&counts);
        assert!(lengths.iter().all(|l| (1..=15).contains(l)));
        assert_eq!(lengths.iter().map(|l| 1u32 << (15 - l)).sum::<u32>(), 1 << 15);
    }

    #[test]
    fn lengths_and_distances_are_coded_as_the_standard_tells() {
        let cases =
            [(3, 257, 0, 0), (10, 264, 0, 0), (11, 265, 0, 1), (22, 269, 3, 2), (257, 284, 30, 5), (258, 285, 0, 0)];
        for (length, symbol, extra, n) in cases {
            assert_eq!(length_code(length), (symbol, extra, n));
        }
        for (distance, symbol, extra, n) in [(1, 0, 0, 0), (5, 4, 0, 1), (48, 10, 15, 4), (32768, 29, 8191, 13)] {
            assert_eq!(distance_code(distance - 1), (symbol, extra, n));
        }
    }
}
