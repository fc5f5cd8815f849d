//! Compaction: removing ranges of records from a file in place. Records that stay keep their order.

use std::io::{self, Read, Seek, SeekFrom, Write};

/// A file-like output that can be read back and truncated. Streaming begins at its start.
pub trait Store: Read + Write + Seek + Send {
    /// Truncates it to `length` bytes.
    ///
    /// # Errors
    /// Failures of the underlying file.
    fn truncate_to(&mut self, length: u64) -> io::Result<()>;
}

impl Store for std::fs::File {
    fn truncate_to(&mut self, length: u64) -> io::Result<()> {
        self.set_len(length)
    }
}

impl Store for io::Cursor<Vec<u8>> {
    fn truncate_to(&mut self, length: u64) -> io::Result<()> {
        self.get_mut().truncate(usize::try_from(length).unwrap_or(usize::MAX));
        Ok(())
    }
}

/// The ranges of items that stay, given the length of each part in order and whether it stays.
pub(super) fn ranges(parts: &[(u64, bool)]) -> Vec<std::ops::Range<u64>> {
    let mut ranges: Vec<std::ops::Range<u64>> = Vec::new();
    let mut at = 0;
    for &(count, stays) in parts {
        let end = at + count;
        if stays {
            match ranges.last_mut().filter(|r| r.end == at) {
                Some(run) => run.end = end,
                None => ranges.push(at..end),
            }
        }
        at = end;
    }
    ranges
}

/// Bytes moved at once.
const CHUNK: u64 = 1 << 20;

/// Keeps the first `head` bytes and, of the records of `size` bytes that follow, those in `ranges`. `go_on`
/// receives the number of records done and returns whether to continue.
pub(super) fn compact(
    out: &mut dyn Store,
    head: u64,
    size: u64,
    ranges: &[std::ops::Range<u64>],
    mut go_on: impl FnMut(u64) -> bool,
) -> io::Result<bool> {
    let mut to = head;
    let mut chunk = Vec::new();
    for run in ranges {
        let (mut from, end) = (head + run.start * size, head + run.end * size);
        if from == to {
            to = end;
            continue;
        }
        while from < end {
            if !go_on((from - head) / size) {
                return Ok(false);
            }
            chunk.resize((end - from).min(CHUNK) as usize, 0);
            out.seek(SeekFrom::Start(from))?;
            out.read_exact(&mut chunk)?;
            out.seek(SeekFrom::Start(to))?;
            out.write_all(&chunk)?;
            from += chunk.len() as u64;
            to += chunk.len() as u64;
        }
    }
    out.truncate_to(to)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_moves_up() {
        let parts = [(2, true), (1, true), (3, false), (0, true), (2, true), (1, false), (1, true)];
        assert_eq!(ranges(&parts), [0..3, 6..8, 9..10]);
        assert_eq!(ranges(&[(3, false)]), []);
        let bytes: Vec<u8> = (0..4 + 3 * 10).collect();
        let mut out = io::Cursor::new(bytes.clone());
        let done = compact(&mut out, 4, 3, &ranges(&parts), |_| true).expect("memory");
        let want = [&bytes[..13], &bytes[22..28], &bytes[31..34]].concat();
        assert!(done && out.into_inner() == want);
        let mut out = io::Cursor::new(bytes);
        assert!(!compact(&mut out, 4, 3, &ranges(&parts), |_| false).expect("memory"));
    }

    #[test]
    fn long_runs_move_in_chunks() {
        let n = 3 * CHUNK / 2;
        let bytes: Vec<u8> = (0..2 * n).map(|i| (i % 251) as u8).collect();
        let mut out = io::Cursor::new(bytes.clone());
        // Less than a chunk further up, so that bytes are read before they are overwritten.
        let parts = [(7, false), (2 * n - 7, true)];
        compact(&mut out, 0, 1, &ranges(&parts), |_| true).expect("memory");
        assert!(out.into_inner() == bytes[7..]);
    }
}
