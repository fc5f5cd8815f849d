//! STL: bare triangles in f32. Written binary; read binary and ASCII.

use std::io;

use super::join::Joiner;
use super::text::{Words, show};
use super::{Metadata, check, refused, write_records};
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Bytes before the first record of a binary file: 80 of text and the count.
const HEADER: usize = 84;
/// Bytes of one triangle: normal, three corners, two unused bytes.
const RECORD: usize = 50;

/// The first 84 bytes of a binary STL of `count` triangles; the text never begins with "solid".
pub fn header(application: &str, count: u32) -> [u8; HEADER] {
    let mut bytes = [b' '; HEADER];
    let text = format!("binary STL, mm, {application}");
    for (to, c) in bytes[..80].iter_mut().zip(text.chars()) {
        *to = if c.is_ascii_graphic() { c as u8 } else { b' ' };
    }
    bytes[80..].copy_from_slice(&count.to_le_bytes());
    bytes
}

/// Appends one 50-byte record: the unit normal (b − a) × (c − a) / |…| in f32 (zero where it cannot be formed),
/// the corners, and two zero bytes.
#[inline]
pub fn push_record(out: &mut Vec<u8>, corners: [[f32; 3]; 3]) {
    let [a, b, c] = corners;
    let u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let v = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let squared = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    let over = if squared > 0.0 && squared.is_finite() { 1.0 / squared.sqrt() } else { 0.0 };
    let normal = if over > 0.0 { n.map(|x| x * over) } else { [0.0; 3] };
    let mut record = [0; RECORD];
    for (row, p) in [normal, a, b, c].iter().enumerate() {
        for (col, x) in p.iter().enumerate() {
            let at = 12 * row + 4 * col;
            record[at..at + 4].copy_from_slice(&x.to_le_bytes());
        }
    }
    out.extend_from_slice(&record);
}

/// Writes a binary STL; `meta.application` is named in its header.
pub fn write<W: io::Write>(mesh: &Mesh, meta: &Metadata, out: &mut W) -> io::Result<()> {
    check(mesh, f64::from(f32::MAX))?;
    let count = u32::try_from(mesh.triangles.len())
        .map_err(|_| refused(format!("{} triangles are more than STL can count", mesh.triangles.len())))?;
    out.write_all(&header(&meta.application, count))?;
    write_records(mesh.triangles.len(), RECORD, out, |range, bytes| {
        for i in range {
            push_record(bytes, mesh.corners(i).map(|p| p.map(|x| x as f32)));
        }
    })
}

/// Reads.
pub fn read(_bytes: &[u8]) -> Result<Mesh, Fault> {
    todo!()
}
