//! PLY: a self-describing list of elements. Written binary little-endian with f64 vertices; read in all three encodings.

use std::io;

use super::join::Joiner;
use super::text::{Words, number, show};
use super::{Metadata, check, one_line, write_records};
use crate::fault::Fault;
use crate::mesh::Mesh;

/// Writes a binary little-endian PLY: double x, y, z and lists of int indices.
pub fn write<W: io::Write>(mesh: &Mesh, meta: &Metadata, out: &mut W) -> io::Result<()> {
    check(mesh, f64::MAX)?;
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment mm {}\ncomment {}\nelement vertex {}\n\
         property double x\nproperty double y\nproperty double z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        one_line(&meta.application),
        one_line(&meta.title),
        mesh.vertices.len(),
        mesh.triangles.len(),
    )?;
    write_records(mesh.vertices.len(), 24, out, |range, bytes| {
        for x in mesh.vertices[range].iter().flatten() {
            bytes.extend_from_slice(&x.to_le_bytes());
        }
    })?;
    write_records(mesh.triangles.len(), 13, out, |range, bytes| {
        for t in &mesh.triangles[range] {
            bytes.push(3);
            for v in t {
                bytes.extend_from_slice(&v.to_le_bytes());
            }
        }
    })
}

/// Reads.
pub fn read(_bytes: &[u8]) -> Result<Mesh, Fault> {
    todo!()
}
