//! Writing of ZIP archives whose content is deflated already, in pieces, on many threads; no crate takes such content.
//!
//! Source: PKWARE, APPNOTE.TXT 6.3; RFC 1951 (deflate).

use std::io::{self, Write};

use crc32fast::Hasher;

use super::ByteSpool;

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
pub struct DeflatedChunk {
    bytes: Vec<u8>,
    crc: Hasher,
    size: u64,
}

impl DeflatedChunk {
    /// Deflates text, best of rows of one pattern.
    pub fn of(text: &[u8]) -> DeflatedChunk {
        let mut crc = Hasher::new();
        crc.update(text);
        DeflatedChunk { bytes: super::deflate::rows(text), crc, size: text.len() as u64 }
    }

    /// Its bytes, and the CRC-32 and number of those of the text.
    pub fn into_parts(self) -> (Vec<u8>, [u64; 2]) {
        (self.bytes, [u64::from(self.crc.finalize()), self.size])
    }

    /// From what `into_parts` gave.
    pub fn of_parts(bytes: Vec<u8>, [crc, size]: [u64; 2]) -> DeflatedChunk {
        DeflatedChunk { bytes, crc: Hasher::new_with_initial_len(crc as u32, size), size }
    }
}

/// A file inside the archive.
pub struct Entry<'a> {
    name: &'static str,
    pieces: &'a mut dyn ByteSpool,
    crc: Hasher,
    size: u64,
    /// Bytes in the archive: the pieces and the two that end the stream.
    packed: u64,
}

impl<'a> Entry<'a> {
    /// An empty file, whose pieces are put aside in `pieces`.
    pub fn new(name: &'static str, pieces: &'a mut dyn ByteSpool) -> Self {
        Entry { name, pieces, crc: Hasher::new(), size: 0, packed: FINAL.len() as u64 }
    }

    /// The same file, for a shorter time: one that others with pieces elsewhere can stand in a row with.
    pub fn lent(&mut self) -> Entry<'_> {
        let crc = self.crc.clone();
        Entry { name: self.name, pieces: &mut *self.pieces, crc, size: self.size, packed: self.packed }
    }

    /// Adds a piece at the end.
    pub fn push(&mut self, piece: DeflatedChunk) -> io::Result<()> {
        self.crc.combine(&piece.crc);
        self.size += piece.size;
        self.packed += piece.bytes.len() as u64;
        self.pieces.put(piece.bytes)
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
pub fn write(entries: &mut [Entry], limit: u64, out: &mut dyn Write) -> io::Result<()> {
    let mut at = 0u64;
    let mut directory = Record::default();
    for e in entries.iter_mut() {
        let (packed, name) = (e.packed, e.name.as_bytes());
        let wide = e.size >= limit || packed >= limit || at >= limit;
        let version = if wide { 45 } else { 20 };
        let fields = |r: &mut Record| {
            r.two(version).two(0).two(8).two(0).two(DATE).raw(e.crc.clone().finalize());
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
        e.pieces.copy_to(out)?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Cursor, Read};

    #[test]
    fn pieces_join_with_narrow_and_wide_sizes() {
        let text: Vec<u8> = (0..200_000u32).flat_map(|i| format!("{} ", i % 9973 * (i % 977)).into_bytes()).collect();
        for limit in [LIMIT, 0, 1000] {
            let mut aside = [Vec::new(), Vec::new(), Vec::new()];
            let [a, b, c] = &mut aside;
            let mut long = Entry::new("a/long.txt", a);
            text.chunks(7001).for_each(|c| long.push(DeflatedChunk::of(c)).unwrap());
            let mut short = Entry::new("short", b);
            short.push(DeflatedChunk::of(b"x")).unwrap();
            let mut bytes = Vec::new();
            write(&mut [long, short, Entry::new("empty", c)], limit, &mut bytes).unwrap();
            let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
            for (name, want) in [("a/long.txt", &text[..]), ("short", b"x"), ("empty", b"")] {
                let mut got = Vec::new();
                archive.by_name(name).unwrap().read_to_end(&mut got).unwrap();
                assert!(got == want, "{name} {limit}");
            }
        }
    }
}
