//! The little of ZIP that 3MF needs: one-pass writing in deflated chunks, and reading of stored and deflated entries.

use std::io;

use flate2::{Compress, Compression, Crc, Decompress, FlushCompress, FlushDecompress, Status};

use crate::fault::Fault;

/// No entry inflates to more than this: no mesh needs it, and a crafted file could ask for any amount.
const MOST_INFLATED: u64 = 2 << 30;

const LOCAL: u32 = 0x0403_4b50;
const DESCRIPTOR: u32 = 0x0807_4b50;
const CENTRAL: u32 = 0x0201_4b50;
const END: u32 = 0x0605_4b50;
const END64: u32 = 0x0606_4b50;
const LOCATOR64: u32 = 0x0706_4b50;
/// 1980-01-01 00:00, the first instant ZIP knows: the same file every time.
const DATE: u16 = 1 << 5 | 1;
/// Flags: sizes follow the data.
const FLAGS: u16 = 1 << 3;
const DEFLATED: u16 = 8;

/// A deflated piece of an entry.
pub(super) struct Chunk {
    bytes: Vec<u8>,
    crc: Crc,
}

impl Chunk {
    /// Deflates `plain` by itself. A chunk that is not `last` ends on a byte with the stream left open, so that
    /// chunks in a row are one deflate stream.
    pub(super) fn deflate(plain: &[u8], last: bool) -> Chunk {
        let mut crc = Crc::new();
        crc.update(plain);
        let mut deflate = Compress::new(Compression::fast(), false);
        let flush = if last { FlushCompress::Finish } else { FlushCompress::Sync };
        let mut bytes = Vec::with_capacity(plain.len() / 4 + 1024);
        loop {
            let from = deflate.total_in() as usize;
            let status = deflate.compress_vec(&plain[from..], &mut bytes, flush);
            // Room left over means that everything is out.
            if matches!(status, Ok(Status::StreamEnd)) || !last && bytes.len() < bytes.capacity() {
                break;
            }
            bytes.reserve(bytes.capacity());
        }
        Chunk { bytes, crc }
    }
}

/// An entry as the central directory lists it.
struct Listed {
    name: &'static str,
    crc: u32,
    packed: u64,
    plain: u64,
    offset: u64,
    large: bool,
}

/// Writes an archive front to back.
pub(super) struct Writer<'a, W> {
    out: &'a mut W,
    offset: u64,
    entries: Vec<Listed>,
    open: Option<(Listed, Crc)>,
}

fn le16(to: &mut Vec<u8>, values: &[u16]) {
    to.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

fn le32(to: &mut Vec<u8>, values: &[u32]) {
    to.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

fn le64(to: &mut Vec<u8>, values: &[u64]) {
    to.extend(values.iter().flat_map(|v| v.to_le_bytes()));
}

/// A size as the 32-bit field holds it: all ones point to the 64-bit field.
fn narrow(n: u64) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl<'a, W: io::Write> Writer<'a, W> {
    pub(super) fn new(out: &'a mut W) -> Self {
        Writer { out, offset: 0, entries: Vec::new(), open: None }
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.offset += bytes.len() as u64;
        self.out.write_all(bytes)
    }

    /// Writes a whole small entry.
    pub(super) fn small(&mut self, name: &'static str, plain: &[u8]) -> io::Result<()> {
        self.begin(name, false)?;
        self.chunk(&Chunk::deflate(plain, true))?;
        self.end()
    }

    /// Begins an entry; `large` if it may pass 4 GiB.
    pub(super) fn begin(&mut self, name: &'static str, large: bool) -> io::Result<()> {
        let listed = Listed { name, crc: 0, packed: 0, plain: 0, offset: self.offset, large };
        let mut head = Vec::new();
        le32(&mut head, &[LOCAL]);
        le16(&mut head, &[if large { 45 } else { 20 }, FLAGS, DEFLATED, 0, DATE]);
        let size = if large { u32::MAX } else { 0 };
        le32(&mut head, &[0, size, size]);
        le16(&mut head, &[name.len() as u16, if large { 20 } else { 0 }]);
        head.extend_from_slice(name.as_bytes());
        if large {
            le16(&mut head, &[1, 16]);
            le64(&mut head, &[0, 0]);
        }
        self.open = Some((listed, Crc::new()));
        self.put(&head)
    }

    /// Writes the next chunk of the entry begun.
    pub(super) fn chunk(&mut self, chunk: &Chunk) -> io::Result<()> {
        if let Some((listed, crc)) = &mut self.open {
            crc.combine(&chunk.crc);
            listed.packed += chunk.bytes.len() as u64;
            // `Crc` counts modulo 2^32; a chunk is far smaller.
            listed.plain += u64::from(chunk.crc.amount());
        }
        self.put(&chunk.bytes)
    }

    /// Ends the entry begun.
    pub(super) fn end(&mut self) -> io::Result<()> {
        let Some((mut listed, crc)) = self.open.take() else { return Ok(()) };
        listed.crc = crc.sum();
        let mut tail = Vec::new();
        le32(&mut tail, &[DESCRIPTOR, listed.crc]);
        if listed.large {
            le64(&mut tail, &[listed.packed, listed.plain]);
        } else {
            le32(&mut tail, &[narrow(listed.packed), narrow(listed.plain)]);
        }
        self.entries.push(listed);
        self.put(&tail)
    }

    /// Writes the central directory.
    pub(super) fn finish(mut self) -> io::Result<()> {
        let mut directory = Vec::new();
        for e in &self.entries {
            // The 64-bit field lists, in this order, what is all ones in the 32-bit fields.
            let far = e.offset >= u64::from(u32::MAX);
            let mut extra = Vec::new();
            if e.large {
                le64(&mut extra, &[e.plain, e.packed]);
            }
            if far {
                le64(&mut extra, &[e.offset]);
            }
            let version = if e.large || far { 45 } else { 20 };
            le32(&mut directory, &[CENTRAL]);
            le16(&mut directory, &[version, version, FLAGS, DEFLATED, 0, DATE]);
            let [packed, plain] = if e.large { [u32::MAX; 2] } else { [narrow(e.packed), narrow(e.plain)] };
            le32(&mut directory, &[e.crc, packed, plain]);
            let extra_len = if extra.is_empty() { 0 } else { extra.len() as u16 + 4 };
            le16(&mut directory, &[e.name.len() as u16, extra_len, 0, 0, 0]);
            le32(&mut directory, &[0, narrow(e.offset)]);
            directory.extend_from_slice(e.name.as_bytes());
            if !extra.is_empty() {
                le16(&mut directory, &[1, extra.len() as u16]);
                directory.extend_from_slice(&extra);
            }
        }
        let (count, size, start) = (self.entries.len() as u16, directory.len() as u64, self.offset);
        if start >= u64::from(u32::MAX) {
            let end = start + size;
            le32(&mut directory, &[END64]);
            le64(&mut directory, &[44]);
            le16(&mut directory, &[45, 45]);
            le32(&mut directory, &[0, 0]);
            le64(&mut directory, &[u64::from(count), u64::from(count), size, start]);
            le32(&mut directory, &[LOCATOR64, 0]);
            le64(&mut directory, &[end]);
            le32(&mut directory, &[1]);
        }
        le32(&mut directory, &[END]);
        le16(&mut directory, &[0, 0, count, count]);
        le32(&mut directory, &[narrow(size), narrow(start)]);
        le16(&mut directory, &[0]);
        self.put(&directory)
    }
}
