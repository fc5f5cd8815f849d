//! The part of ZIP that 3MF needs: deflated or stored entries, with 64-bit sizes where they are needed.
//!
//! Source: PKWARE, APPNOTE.TXT 6.3; RFC 1951 (deflate).

use std::cell::Cell;
use std::io::{self, Write};

use flate2::{Compress, Compression, Crc, Decompress, FlushCompress, FlushDecompress, Status};

use crate::fault::Fault;

/// Sizes from here on are written in 64 bits.
pub const LIMIT: u64 = u32::MAX as u64;

const LOCAL: u32 = 0x0403_4b50;
const CENTRAL: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
const END64: u32 = 0x0606_4b50;
const LOCATOR64: u32 = 0x0706_4b50;
/// 1980-01-01, the first day that ZIP knows: the bytes depend on the content alone.
const DATE: u16 = 0x21;

/// A piece of an entry, deflated so that pieces can be put one after the other.
pub struct Piece {
    bytes: Vec<u8>,
    crc: Crc,
    size: u64,
}

/// Deflates rows of one pattern.
pub fn deflate_rows(text: &[u8]) -> Piece {
    let mut crc = Crc::new();
    crc.update(text);
    Piece { bytes: super::deflate::rows(text), crc, size: text.len() as u64 }
}

/// Deflates text on its own, up to a byte boundary.
pub fn deflate(text: &[u8]) -> Piece {
    let mut crc = Crc::new();
    crc.update(text);
    let mut bytes = Vec::with_capacity(text.len() / 3 + 64);
    let mut state = Compress::new(Compression::fast(), false);
    loop {
        let from = state.total_in() as usize;
        // Compressing memory to memory cannot fail; were it to, the checksum would tell the reader.
        let status = state.compress_vec(&text[from..], &mut bytes, FlushCompress::Sync);
        let done = state.total_in() as usize == text.len() && bytes.len() < bytes.capacity();
        if done || status.is_err() {
            return Piece { bytes, crc, size: text.len() as u64 };
        }
        bytes.reserve(bytes.capacity().max(1024));
    }
}

/// A file inside the archive.
pub struct Entry {
    name: &'static str,
    pieces: Vec<Vec<u8>>,
    crc: Crc,
    size: u64,
}

impl Entry {
    /// An empty file.
    pub fn new(name: &'static str) -> Self {
        Entry { name, pieces: Vec::new(), crc: Crc::new(), size: 0 }
    }

    /// Adds a piece at the end.
    pub fn push(&mut self, piece: Piece) {
        self.crc.combine(&piece.crc);
        self.size += piece.size;
        self.pieces.push(piece.bytes);
    }

    /// Bytes in the archive: the pieces and the two that end the stream.
    fn packed(&self) -> u64 {
        self.pieces.iter().map(|p| p.len() as u64).sum::<u64>() + FINAL.len() as u64
    }
}

/// An empty last block with fixed codes.
const FINAL: [u8; 2] = [3, 0];

#[derive(Default)]
struct Record(Vec<u8>);

impl Record {
    fn two(&mut self, v: impl TryInto<u16>) -> &mut Self {
        self.0.extend(v.try_into().unwrap_or(u16::MAX).to_le_bytes());
        self
    }
    /// A number of four bytes, all ones where it does not fit.
    fn four(&mut self, v: u64, limit: u64) -> &mut Self {
        self.0.extend((if v >= limit { u32::MAX } else { v as u32 }).to_le_bytes());
        self
    }
    fn eight(&mut self, v: u64) -> &mut Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn raw(&mut self, v: u32) -> &mut Self {
        self.four(u64::from(v), u64::MAX)
    }
}

/// Writes the archive. Numbers of `limit` and above take 64-bit fields (`LIMIT`, less in tests).
pub fn write<W: Write>(entries: &[Entry], limit: u64, out: &mut W) -> io::Result<()> {
    let mut at = 0u64;
    let mut directory = Record::default();
    for e in entries {
        let (packed, name) = (e.packed(), e.name.as_bytes());
        let wide = e.size >= limit || packed >= limit || at >= limit;
        let version = if wide { 45 } else { 20 };
        let fields = |r: &mut Record| {
            r.two(version).two(0).two(8).two(0).two(DATE).raw(e.crc.sum());
            let cap = if wide { 0 } else { u64::MAX };
            r.four(packed, cap).four(e.size, cap).two(name.len());
        };
        let mut local = Record::default();
        local.raw(LOCAL);
        fields(&mut local);
        local.two(if wide { 20 } else { 0 });
        local.0.extend(name);
        if wide {
            local.two(1).two(16).eight(e.size).eight(packed);
        }
        directory.raw(CENTRAL).two(version);
        fields(&mut directory);
        directory.two(if wide { 28 } else { 0 }).two(0).two(0).two(0).raw(0);
        directory.four(at, if wide { 0 } else { u64::MAX });
        directory.0.extend(name);
        if wide {
            directory.two(1).two(24).eight(e.size).eight(packed).eight(at);
        }
        out.write_all(&local.0)?;
        e.pieces.iter().try_for_each(|p| out.write_all(p))?;
        out.write_all(&FINAL)?;
        at += local.0.len() as u64 + packed;
    }
    let (count, size) = (entries.len(), directory.0.len() as u64);
    if at >= limit {
        directory.raw(END64).eight(44).two(45).two(45).raw(0).raw(0);
        directory.eight(count as u64).eight(count as u64).eight(size).eight(at);
        directory.raw(LOCATOR64).raw(0).eight(at + size).raw(1);
    }
    directory.raw(END).two(0).two(0).two(count).two(count).four(size, limit).four(at, limit).two(0);
    out.write_all(&directory.0)
}

/// An archive in memory.
pub struct Archive<'a> {
    bytes: &'a [u8],
    entries: Vec<Found>,
    /// Bytes that may yet be inflated.
    left: Cell<u64>,
}

/// What all files of an archive may inflate to: so many times the archive, and some bytes. Meshes come to ten times.
const MOST: (u64, u64) = (100, 1 << 24);

struct Found {
    name: String,
    method: u64,
    crc: u64,
    packed: u64,
    size: u64,
    at: u64,
}

fn fault(message: impl Into<String>) -> Fault {
    Fault::new("", message)
}

/// The little-endian number of `n` bytes at `at`.
fn number(bytes: &[u8], at: u64, n: u64) -> Result<u64, Fault> {
    let end = at.checked_add(n).filter(|e| *e <= bytes.len() as u64);
    let end = end.ok_or_else(|| fault(format!("the ZIP directory points to byte {at} of {}", bytes.len())))?;
    Ok(bytes[at as usize..end as usize].iter().rev().fold(0, |v, b| v << 8 | u64::from(*b)))
}

impl<'a> Archive<'a> {
    /// Reads the directory.
    pub fn new(bytes: &'a [u8]) -> Result<Self, Fault> {
        let tail = bytes.len().saturating_sub(22 + 65535);
        let end = bytes[tail..].windows(22).rposition(|w| w.starts_with(&END.to_le_bytes()));
        let end = (end
            .ok_or_else(|| fault(format!("no ZIP directory in {} bytes: truncated or not 3MF", bytes.len())))?
            + tail) as u64;
        let (mut count, mut at) = (number(bytes, end + 10, 2)?, number(bytes, end + 16, 4)?);
        if end >= 20 && number(bytes, end - 20, 4)? == u64::from(LOCATOR64) {
            let wide = number(bytes, end - 12, 8)?;
            (count, at) = (number(bytes, wide.saturating_add(32), 8)?, number(bytes, wide.saturating_add(48), 8)?);
        }
        let mut entries = Vec::new();
        for i in 0..count {
            if number(bytes, at, 4)? != u64::from(CENTRAL) {
                return Err(fault(format!("entry {i} of {count} of the ZIP directory (byte {at}) is damaged")));
            }
            let get = |offset, n| number(bytes, at + offset, n);
            let (name, extra, comment) = (get(28, 2)?, get(30, 2)?, get(32, 2)?);
            number(bytes, at + 46 + name + extra + comment, 0)?;
            let slice = |from: u64, n: u64| &bytes[from as usize..(from + n) as usize];
            let mut e = Found {
                name: String::from_utf8_lossy(slice(at + 46, name)).into_owned(),
                method: get(10, 2)?,
                crc: get(16, 4)?,
                packed: get(20, 4)?,
                size: get(24, 4)?,
                at: get(42, 4)?,
            };
            if get(8, 2)? & 1 == 1 {
                return Err(fault(format!("\"{}\" is encrypted: save the file without a password", e.name)));
            }
            widen(slice(at + 46 + name, extra), &mut e)?;
            entries.push(e);
            at += 46 + name + extra + comment;
        }
        let left = Cell::new(MOST.0 * bytes.len() as u64 + MOST.1);
        Ok(Archive { bytes, entries, left })
    }

    /// Names of the files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|e| e.name.as_str())
    }

    /// The content of the file of this name (any letter case, with or without a leading slash).
    pub fn file(&self, name: &str) -> Result<Vec<u8>, Fault> {
        let plain = |s: &str| s.trim_start_matches('/').to_ascii_lowercase();
        let e = self.entries.iter().find(|e| plain(&e.name) == plain(name));
        let e = e.ok_or_else(|| fault(format!("the archive holds no \"{name}\": not 3MF")))?;
        let skip = number(self.bytes, e.at.saturating_add(26), 2)? + number(self.bytes, e.at.saturating_add(28), 2)?;
        if number(self.bytes, e.at, 4)? != u64::from(LOCAL) {
            return Err(fault(format!("\"{name}\" does not begin at byte {}: damaged", e.at)));
        }
        let from = e.at + 30 + skip;
        let end = from.saturating_add(e.packed);
        let Some(data) = self.bytes.get(from as usize..end as usize) else {
            return Err(fault(format!("\"{name}\" ends at byte {end}, the file at {}: truncated", self.bytes.len())));
        };
        // Deflate gives at most 1032 bytes for one.
        if e.size > e.packed.saturating_mul(1032).saturating_add(1032) {
            return Err(fault(format!("\"{name}\" claims {} bytes from {}: damaged", e.size, e.packed)));
        }
        let Some(left) = self.left.get().checked_sub(e.size) else {
            return Err(fault(format!(
                "\"{name}\" inflates to {} bytes, from an archive of {}: more than {} times as much is no mesh",
                e.size,
                self.bytes.len(),
                MOST.0
            )));
        };
        self.left.set(left);
        let content = match e.method {
            0 => data.to_vec(),
            8 => inflate(data, e.size as usize)
                .ok_or_else(|| fault(format!("\"{name}\" is not {} deflated bytes: damaged", e.size)))?,
            m => {
                return Err(fault(format!("\"{name}\" is packed by method {m}: only 0 and 8 (deflate) are read")));
            }
        };
        let mut crc = Crc::new();
        crc.update(&content);
        if content.len() as u64 != e.size || u64::from(crc.sum()) != e.crc {
            let (want, got) = (e.crc, crc.sum());
            return Err(fault(format!("\"{name}\" has the checksum {got:08x}, not {want:08x}: damaged")));
        }
        Ok(content)
    }
}

/// Takes 64-bit sizes from the extra fields, in the order in which the 32-bit ones are all ones.
fn widen(extra: &[u8], e: &mut Found) -> Result<(), Fault> {
    let mut at = 0;
    while at + 4 <= extra.len() as u64 {
        let (id, n) = (number(extra, at, 2)?, number(extra, at + 2, 2)?);
        at += 4;
        if id == 1 {
            let mut from = at;
            for v in [&mut e.size, &mut e.packed, &mut e.at] {
                if *v == u64::from(u32::MAX) {
                    *v = number(extra, from, 8)?;
                    from += 8;
                }
            }
        }
        at += n;
    }
    Ok(())
}

/// Exactly `size` bytes, or none.
fn inflate(data: &[u8], size: usize) -> Option<Vec<u8>> {
    let mut state = Decompress::new(false);
    let mut out = Vec::with_capacity(size + 1);
    loop {
        let from = state.total_in() as usize;
        let before = out.len();
        match state.decompress_vec(&data[from..], &mut out, FlushDecompress::Finish).ok()? {
            Status::StreamEnd => return (out.len() == size).then_some(out),
            _ if out.len() > size || (out.len() == before && state.total_in() as usize == from) => {
                return None;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_join_with_narrow_and_wide_sizes() {
        let text: Vec<u8> = (0..200_000u32).flat_map(|i| format!("{} ", i % 9973 * (i % 977)).into_bytes()).collect();
        for limit in [LIMIT, 0, 1000] {
            let mut long = Entry::new("a/long.txt");
            text.chunks(7001).for_each(|c| long.push(deflate(c)));
            let mut short = Entry::new("short");
            short.push(deflate(b"x"));
            let mut bytes = Vec::new();
            write(&[long, short, Entry::new("empty")], limit, &mut bytes).unwrap();
            let archive = Archive::new(&bytes).unwrap();
            assert_eq!(archive.names().collect::<Vec<_>>(), ["a/long.txt", "short", "empty"]);
            assert_eq!(archive.file("/A/long.txt").unwrap(), text);
            assert_eq!(archive.file("short").unwrap(), b"x");
            assert_eq!(archive.file("empty").unwrap(), b"");
            assert!(archive.file("none").is_err());
        }
    }

    #[test]
    fn blanks_without_end_are_refused_before_they_are_made() {
        let mut long = Entry::new("blanks");
        let piece = || {
            let text = vec![b' '; 1 << 20];
            let (mut crc, mut bytes) = (Crc::new(), Vec::with_capacity(1 << 16));
            crc.update(&text);
            let mut state = Compress::new(Compression::best(), false);
            state.compress_vec(&text, &mut bytes, FlushCompress::Sync).unwrap();
            Piece { bytes, crc, size: 1 << 20 }
        };
        (0..300).for_each(|_| long.push(piece()));
        let mut short = Entry::new("some");
        (0..9).for_each(|_| short.push(piece()));
        let mut bytes = Vec::new();
        write(&[long, short], LIMIT, &mut bytes).unwrap();
        let archive = Archive::new(&bytes).unwrap();
        let message = archive.file("blanks").map(|c| c.len()).unwrap_err().message;
        assert!(message.contains("314572800") && message.contains("100 times"));
        // What is inflated twice counts twice.
        assert!((0..99).any(|_| archive.file("some").is_err()));
    }

    #[test]
    fn noise_deflates_too() {
        let mut seed = 9u64;
        let noise: Vec<u8> = std::iter::repeat_with(|| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
            (seed >> 56) as u8
        })
        .take(100_000)
        .collect();
        let piece = deflate(&noise);
        assert_eq!(inflate(&[&piece.bytes[..], &FINAL].concat(), noise.len()), Some(noise));
    }
}
