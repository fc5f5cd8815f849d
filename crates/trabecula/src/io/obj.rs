//! Wavefront OBJ: vertices and polygons as text, f64.

use std::io;

use super::decimal::{push_f64, push_u64};
use super::join::Joiner;
use super::text::{number, show, words};
use super::{Metadata, check, one_line, write_records};
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Writes an OBJ: comments with the program and title, then vertices (shortest text that reads back the same f64)
/// and triangles.
pub fn write<W: io::Write>(mesh: &Mesh, meta: &Metadata, out: &mut W) -> io::Result<()> {
    check(mesh, f64::MAX)?;
    writeln!(out, "# mm {}", one_line(&meta.application))?;
    writeln!(out, "# {}", one_line(&meta.title))?;
    write_records(mesh.vertices.len(), 60, out, |range, bytes| {
        for p in &mesh.vertices[range] {
            bytes.push(b'v');
            for &x in p {
                bytes.push(b' ');
                push_f64(bytes, x);
            }
            bytes.push(b'\n');
        }
    })?;
    write_records(mesh.triangles.len(), 30, out, |range, bytes| {
        for t in &mesh.triangles[range] {
            bytes.push(b'f');
            for &v in t {
                bytes.push(b' ');
                push_u64(bytes, u64::from(v) + 1);
            }
            bytes.push(b'\n');
        }
    })
}

/// Reads.
pub fn read(_bytes: &[u8]) -> Result<Mesh, Fault> {
    todo!()
}
