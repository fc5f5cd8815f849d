//! File formats by extension. Formats are leaves: bytes in, mesh out; mesh in, `io::Write` out.
use std::io;

use crate::fault::Fault;
use crate::mesh::Mesh;

/// What a mesh file held.
pub struct Loaded {
    /// The mesh, vertices of equal position joined, in the file's own unit unless the format names one (3MF: mm).
    pub mesh: Mesh,
    /// Whether coordinates are already in mm because the file names its unit (3MF).
    pub in_mm: bool,
}

/// Reads a mesh from the bytes of a file whose name ends in `extension` (any letter case, no dot): stl, obj, ply, off, 3mf.
pub fn read_mesh(bytes: &[u8], extension: &str) -> Result<Loaded, Fault> {
    let _ = (bytes, extension);
    todo!()
}

/// Facts written into formats that carry metadata.
#[derive(Clone, Debug, Default)]
pub struct Metadata {
    /// Title, e.g. the design's file name.
    pub title: String,
    /// The design as text (TOML or JSON), empty if none.
    pub design: String,
    /// Program and version.
    pub application: String,
}

/// Writes a mesh in the format of `extension`: stl (binary), ply (binary), obj, 3mf.
pub fn write_mesh<W: io::Write>(mesh: &Mesh, extension: &str, meta: &Metadata, out: &mut W) -> io::Result<()> {
    let _ = (mesh, extension, meta, out);
    todo!()
}
