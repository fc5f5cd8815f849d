//! A mesh in files: its vertices and its triangles are put aside while it is made, and read again when it is written with
//! numbered vertices, whose number comes before them. Components that are to be dropped are known in between.

use std::borrow::Cow;
use std::io::{self, SeekFrom, Write};
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use geometry::formats::{ByteSpool, Indexed, Metadata, write_indexed};
use geometry::math::Vec3;
use geometry::progress::{Progress, Stage, Stopped};

use super::{Resolved, Store, Summary, SurfaceMaker, SurfaceOptions, SurfaceSink, compact};

/// Bytes of a vertex and of a triangle.
const VERTEX: u64 = 24;
const TRIANGLE: u64 = 12;
/// Records that are read at once.
const CHUNK: u64 = 1 << 16;
/// The share of the work that is done once the mesh is made: formatting it.
const WRITING: f64 = 0.2;

/// Three empty files, of which nothing is left afterwards: for vertices, triangles and what a writer puts aside.
pub type ScratchStores<'a> = [&'a mut dyn Store; 3];

/// The surface, streamed in the format of `suffix`, one with numbered vertices, without holding the mesh: the same bytes as
/// `geometry::formats::write_mesh` gives for that of `SurfaceMaker::mesh`. In memory stay the tiles in flight and a bit for each
/// vertex, once components are dropped.
///
/// # Errors
/// As `SurfaceMaker::mesh` and `geometry::formats::write_indexed`; failures of the files.
pub fn stream_mesh(
    maker: &dyn SurfaceMaker,
    options: &SurfaceOptions,
    (suffix, meta): (&str, &Metadata),
    [vertices, triangles, aside]: ScratchStores,
    out: &mut dyn Write,
    progress: &dyn Progress,
) -> Result<Summary, Stopped> {
    let mut spool = Spool { vertices, triangles, counts: [0; 2] };
    let making = Stage { whole: progress, from: 0.0, to: 1.0 - WRITING };
    let found = maker.make(options, &mut spool, &making)?;
    let numbers = match found.components.unchanged() {
        true => None,
        false => Some(spool.drop_components(&found).map_err(Stopped::Io)?),
    };
    let total = spool.counts.iter().sum();
    let mesh = Spooled {
        counts: spool.counts.map(|n| n as usize),
        files: Mutex::new(spool),
        numbers,
        reported: Mutex::new((0, total)),
        progress: Stage { whole: progress, from: 1.0 - WRITING, to: 1.0 },
    };
    let written = write_indexed(&mesh, suffix, meta, &mut SpoolFile(aside), out).and_then(|()| out.flush());
    written.map_err(|e| if is_interrupt(&e) { Stopped::Interrupted } else { Stopped::Io(e) })?;
    Ok(found.summary())
}

/// What the mesh says when it is asked for more after an interrupt.
#[derive(Debug)]
struct Interrupt;

impl std::fmt::Display for Interrupt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("interrupted")
    }
}

impl std::error::Error for Interrupt {}

fn is_interrupt(e: &io::Error) -> bool {
    e.get_ref().is_some_and(|inner| inner.is::<Interrupt>())
}

/// The files while the mesh is made.
struct Spool<'a> {
    vertices: &'a mut dyn Store,
    triangles: &'a mut dyn Store,
    /// Vertices and triangles in them.
    counts: [u64; 2],
}

impl SurfaceSink for Spool<'_> {
    fn add(&mut self, vertices: &[Vec3], triangles: &[[u32; 3]], _: &[bool]) -> io::Result<()> {
        self.counts[0] += vertices.len() as u64;
        self.counts[1] += triangles.len() as u64;
        let positions: Vec<u8> = vertices.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.vertices.write_all(&positions)?;
        let corners: Vec<u8> = triangles.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.triangles.write_all(&corners)
    }
}

/// Records of `size` bytes.
fn records(file: &mut dyn Store, size: u64, range: Range<u64>) -> io::Result<Vec<u8>> {
    let mut bytes = vec![0; ((range.end - range.start) * size) as usize];
    file.seek(SeekFrom::Start(range.start * size))?;
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

fn corners(bytes: &[u8]) -> impl Iterator<Item = [u32; 3]> {
    let number = |b: &[u8]| b.try_into().map_or(0, u32::from_le_bytes);
    bytes.chunks_exact(12).map(move |t| [number(&t[..4]), number(&t[4..8]), number(&t[8..])])
}

impl Spool<'_> {
    /// Takes dropped components out of both files; gives the numbers of the vertices that are left.
    fn drop_components(&mut self, found: &Resolved) -> io::Result<VertexRanks> {
        let kept = compact::ranges(&found.parts);
        let mut used = vec![0u64; self.counts[0].div_ceil(64) as usize];
        for range in &kept {
            for start in range.clone().step_by(CHUNK as usize) {
                let bytes = records(self.triangles, TRIANGLE, start..range.end.min(start + CHUNK))?;
                for v in corners(&bytes).flatten() {
                    used[v as usize / 64] |= 1 << (v % 64);
                }
            }
        }
        compact::compact(self.triangles, 0, TRIANGLE, &kept, |_| true)?;
        let numbers = VertexRanks::new(used);
        compact::compact(self.vertices, 0, VERTEX, &numbers.ranges(), |_| true)?;
        self.counts = [numbers.count, kept.iter().map(|r| r.end - r.start).sum()];
        Ok(numbers)
    }
}

/// The numbers of the vertices of a set among themselves: a bit for each vertex, and how many are before each word.
struct VertexRanks {
    used: Vec<u64>,
    before: Vec<u32>,
    count: u64,
}

impl VertexRanks {
    fn new(used: Vec<u64>) -> VertexRanks {
        let mut count = 0u64;
        let before = used.iter().map(|word| {
            count += u64::from(word.count_ones());
            (count - u64::from(word.count_ones())) as u32
        });
        let before = before.collect();
        VertexRanks { used, before, count }
    }

    /// The set as ranges.
    fn ranges(&self) -> Vec<Range<u64>> {
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for (n, word) in self.used.iter().enumerate() {
            let (mut rest, mut at) = (*word, 64 * n as u64);
            while rest != 0 {
                let skip = u64::from(rest.trailing_zeros());
                let length = u64::from((rest >> skip).trailing_ones());
                let start = at + skip;
                match ranges.last_mut() {
                    Some(last) if last.end == start => last.end += length,
                    _ => ranges.push(start..start + length),
                }
                at = start + length;
                rest = if skip + length == 64 { 0 } else { rest >> (skip + length) };
            }
        }
        ranges
    }

    fn of(&self, v: u32) -> u32 {
        let (word, bit) = (v as usize / 64, v % 64);
        self.before[word] + (self.used[word] & ((1 << bit) - 1)).count_ones()
    }
}

/// The files while the mesh is written.
struct Spooled<'a> {
    counts: [usize; 2],
    files: Mutex<Spool<'a>>,
    numbers: Option<VertexRanks>,
    /// Records that were read, of how many.
    reported: Mutex<(u64, u64)>,
    progress: Stage<'a>,
}

impl Spooled<'_> {
    fn read(&self, of: impl FnOnce(&mut Spool) -> io::Result<Vec<u8>>, count: usize) -> io::Result<Vec<u8>> {
        {
            // Under the lock, so that progress rises.
            let mut reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
            reported.0 += count as u64;
            if !self.progress.step(reported.0, reported.1) {
                return Err(io::Error::other(Interrupt));
            }
        }
        of(&mut self.files.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn wide(range: &Range<usize>) -> Range<u64> {
    range.start as u64..range.end as u64
}

impl Indexed for Spooled<'_> {
    fn counts(&self) -> [usize; 2] {
        self.counts
    }

    fn positions(&self, range: Range<usize>) -> io::Result<Cow<'_, [Vec3]>> {
        let bytes = self.read(|files| records(files.vertices, VERTEX, wide(&range)), range.len())?;
        let number = |b: &[u8]| b.try_into().map_or(0.0, f64::from_le_bytes);
        let positions = bytes.chunks_exact(24).map(|p| [number(&p[..8]), number(&p[8..16]), number(&p[16..])]);
        Ok(Cow::Owned(positions.collect()))
    }

    fn corners(&self, range: Range<usize>) -> io::Result<Cow<'_, [[u32; 3]]>> {
        let bytes = self.read(|files| records(files.triangles, TRIANGLE, wide(&range)), range.len())?;
        let number = |v| self.numbers.as_ref().map_or(v, |n| n.of(v));
        Ok(Cow::Owned(corners(&bytes).map(|t| t.map(number)).collect()))
    }
}

/// A file for what a writer puts aside.
struct SpoolFile<'a>(&'a mut dyn Store);

impl ByteSpool for SpoolFile<'_> {
    fn put(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.0.write_all(&bytes)
    }

    fn copy_to(&mut self, out: &mut dyn Write) -> io::Result<()> {
        self.0.seek(SeekFrom::Start(0))?;
        io::copy(&mut self.0, out)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_a_set_are_numbered_in_their_order() {
        let of = |v: u32| v.is_multiple_of(3) || (60..70).contains(&v);
        let mut used = vec![0u64; 4];
        (0..256).filter(|v| of(*v)).for_each(|v| used[v as usize / 64] |= 1 << (v % 64));
        let numbers = VertexRanks::new(used);
        let kept: Vec<u32> = (0..256).filter(|v| of(*v)).collect();
        assert_eq!(numbers.count, kept.len() as u64);
        assert!((0..).zip(kept).all(|(n, v)| numbers.of(v) == n));
    }
}
