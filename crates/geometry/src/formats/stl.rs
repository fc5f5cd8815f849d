//! STL, binary and ASCII.
//!
//! Source: 3D Systems, StereoLithography Interface Specification (1988).

use std::io::{self, Write};

use super::join::Joiner;
use super::text::{NumberedLines, at_line, position, shown, words};
use super::{in_order, invalid};
use crate::fault::Fault;
use crate::math::Vec3;
use crate::mesh::Mesh;

/// Bytes before the first record: eighty of text and the number of triangles.
pub const HEADER: usize = 84;
/// Bytes of a triangle: normal, three corners, attribute.
pub const RECORD: usize = 50;

/// Writes binary STL; normals are those of the rounded positions.
pub fn write<W: Write>(mesh: &Mesh, out: &mut W) -> io::Result<()> {
    let count = mesh.triangles.len();
    out.write_all(&header(counted(count)?))?;
    let make = |range: std::ops::Range<usize>| {
        let mut bytes = Vec::with_capacity(range.len() * RECORD);
        for t in &mesh.triangles[range] {
            push_record(&mut bytes, t.map(|v| mesh.vertices[v as usize].map(|x| x as f32)));
        }
        Ok(bytes)
    };
    in_order(count, 1 << 14, make, |bytes| out.write_all(&bytes))
}

/// Writes binary STL of `count` triangles that `pieces` are made of, a few at a time: `each` calls with those of a piece.
///
/// # Errors
/// What the writer gives, and more triangles than STL can count.
pub fn write_pieces<W: Write>(
    count: usize,
    pieces: usize,
    each: impl Fn(usize, &mut dyn FnMut([Vec3; 3])) + Sync,
    out: &mut W,
) -> io::Result<()> {
    out.write_all(&header(counted(count)?))?;
    let make = |range: std::ops::Range<usize>| {
        let mut bytes = Vec::new();
        for piece in range {
            each(piece, &mut |t| push_record(&mut bytes, t.map(|p| p.map(|x| x as f32))));
        }
        Ok(bytes)
    };
    let some = (pieces << 14).div_ceil(count.max(1)).max(1);
    in_order(pieces, some, make, |bytes| out.write_all(&bytes))
}

/// A number of triangles as STL writes it.
fn counted(count: usize) -> io::Result<u32> {
    u32::try_from(count).map_err(|_| invalid(format!("STL holds at most {} triangles, the mesh has {count}", u32::MAX)))
}

/// The header of a binary STL of `count` triangles. (It must not begin with "solid".)
pub fn header(count: u32) -> [u8; HEADER] {
    let mut header = [b' '; HEADER];
    let title = concat!("Binary STL, lengths in mm, by trabecula ", env!("CARGO_PKG_VERSION"));
    header[..title.len()].copy_from_slice(title.as_bytes());
    header[80..].copy_from_slice(&count.to_le_bytes());
    header
}

/// One triangle of a binary STL: normal, corners, no attributes.
#[inline]
pub fn push_record(out: &mut Vec<u8>, t: [[f32; 3]; 3]) {
    let [a, b, c] = t;
    let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let long = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    let s = if long > 0.0 { 1.0 / long } else { 0.0 };
    let floats = [n[0] * s, n[1] * s, n[2] * s, a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]];
    let mut record = [0u8; RECORD];
    for (slot, v) in record.chunks_exact_mut(4).zip(floats) {
        slot.copy_from_slice(&v.to_le_bytes());
    }
    out.extend_from_slice(&record);
}

/// Reads either kind. A file whose size fits the count it names is binary, whatever its first word.
pub fn read(bytes: &[u8]) -> Result<Mesh, Fault> {
    let named = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let expected = named.map(|n| HEADER as u64 + u64::from(n) * RECORD as u64);
    if expected == Some(bytes.len() as u64) {
        return binary(&bytes[HEADER..]);
    }
    let start = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(bytes.len());
    let solid = bytes[start..].get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    // A text file has no zero byte; a binary one has several in its header or count.
    if solid && !bytes[..bytes.len().min(1024)].contains(&0) {
        return ascii(bytes);
    }
    Err(Fault::new(
        "",
        match (named, expected) {
            (Some(n), Some(e)) => format!(
                "the header names {n} triangles, which take {e} bytes, but the file has {}: truncated or not STL",
                bytes.len()
            ),
            _ => format!("{} bytes: a binary STL has at least 84, and an ASCII one begins with \"solid\"", bytes.len()),
        },
    ))
}

fn binary(records: &[u8]) -> Result<Mesh, Fault> {
    let mut joiner = Joiner::default();
    for (i, r) in records.chunks_exact(RECORD).enumerate() {
        let at = |k: usize| f32::from_le_bytes([r[k], r[k + 1], r[k + 2], r[k + 3]]);
        let corners = [12, 24, 36].map(|k| [at(k), at(k + 4), at(k + 8)].map(f64::from));
        if let Some(v) = corners.iter().flatten().find(|v| !v.is_finite()) {
            let byte = HEADER + i * RECORD;
            return Err(Fault::new("", format!("triangle {i} (byte {byte}) has the coordinate {v}: not finite")));
        }
        joiner.triangle(corners)?;
    }
    Ok(joiner.finish())
}

fn ascii(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut joiner = Joiner::default();
    let mut open: Option<usize> = None; // line of the solid that has not ended
    let mut corners = Vec::new();
    let mut facet = false;
    let mut last = 0;
    for (line, text) in NumberedLines::new(bytes) {
        last = line;
        let mut rest = words(text).peekable();
        while let Some(word) = rest.next() {
            let lower = word.to_ascii_lowercase();
            match (lower.as_slice(), open.is_some()) {
                // Names run to the end of the line and may hold any word.
                (b"solid", false) => {
                    open = Some(line);
                    break;
                }
                (b"endsolid", true) if !facet => {
                    open = None;
                    break;
                }
                (b"facet", true) if !facet => {
                    facet = true;
                    corners.clear();
                    // The normal is not read: the corners' order is what counts.
                    while rest.peek().is_some_and(|w| !w.eq_ignore_ascii_case(b"outer")) {
                        rest.next();
                    }
                }
                (b"outer" | b"loop" | b"endloop", true) if facet => {}
                (b"vertex", true) if facet => corners.push(position(line, &mut rest)?),
                (b"endfacet", true) if facet => {
                    let Ok(triangle) = <[_; 3]>::try_from(corners.as_slice()) else {
                        let n = corners.len();
                        return Err(at_line(line, format!("a facet of {n} vertices: STL has three")));
                    };
                    joiner.triangle(triangle)?;
                    facet = false;
                }
                _ => {
                    return Err(at_line(line, format!("{} is not expected here", shown(word))));
                }
            }
        }
    }
    match open {
        Some(line) => Err(Fault::new("", format!("the solid of line {line} has no endsolid: cut off at line {last}"))),
        None => Ok(joiner.finish()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::tests::{refuses_damage, tetrahedron};

    const TEXT: &str = "SOLID a vertex in name\n Facet normal 0 0 nan\n OUTER loop\n vertex 0 0 0\n VERTEX 1 0 0\n \
                        vertex 0 1e0 0\n endloop\n endFacet\nendsolid a\nsolid\nfacet normal 0 0 1 outer loop vertex 0 0 0 \
                        vertex 1 0 0 vertex 0 0 1 endloop endfacet\nEndSolid b";

    #[test]
    fn binary_comes_back_as_written() {
        let mesh = tetrahedron();
        let mut bytes = Vec::new();
        write(&mesh, &mut bytes).unwrap();
        assert_eq!(bytes.len(), HEADER + 4 * RECORD);
        let back = read(&bytes).unwrap();
        assert_eq!(back.volume(), mesh.volume());
        assert_eq!((back.vertices.len(), back.triangles.len()), (4, 4));
        // The first triangle is (0, 2, 1) of the corner at the origin: it looks down.
        assert_eq!(bytes[HEADER..HEADER + 12], [0.0f32, 0.0, -1.0].map(f32::to_le_bytes).concat());
        refuses_damage("stl", &bytes, bytes.len());
        // Binary even where the header says otherwise.
        bytes[..5].copy_from_slice(b"solid");
        assert_eq!(read(&bytes).unwrap(), back);
    }

    #[test]
    fn ascii_in_any_case_and_of_several_solids() {
        let mesh = read(TEXT.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
        let one = &TEXT[..TEXT.find("solid\nfacet").unwrap_or(0)];
        refuses_damage("stl", one.as_bytes(), one.len() - " a\n".len());
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused() {
        let mut bytes = Vec::new();
        write(&tetrahedron(), &mut bytes).unwrap();
        bytes[HEADER + 62..HEADER + 66].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(read(&bytes).unwrap_err().message.contains("triangle 1 (byte 134)"));
    }
}
