//! 3MF: a ZIP package around one XML model, in a named unit. Written in mm with f32 coordinates; read with build
//! items, components, transforms and units.

use std::io;

use super::decimal::{push_f32, push_u64};
use super::zip::{self, Chunk};
use super::{CHUNK, Metadata, check, chunk_range, ordered};
use crate::fault::Fault;
use crate::mesh::Mesh;

const CONTENT_TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>
"#;
const RELATIONSHIPS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>
"#;
const MODEL: &str = "3D/3dmodel.model";
const TAIL: &str = "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"1\"/>\n</build>\n</model>\n";

/// Writes a 3MF package of one object in mm: coordinates as text that reads back the same f32, `meta.title` as Title,
/// `meta.application` as Application, `meta.design` as `design` in the namespace `urn:trabecula:design`.
pub fn write<W: io::Write>(mesh: &Mesh, meta: &Metadata, out: &mut W) -> io::Result<()> {
    check(mesh, f64::from(f32::MAX))?;
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    let (vertex_chunks, triangle_chunks) = (vertices.div_ceil(CHUNK), triangles.div_ceil(CHUNK));
    let head = head(meta);
    // 4 GiB cannot be passed when the longest lines would not: 76 and 59 bytes.
    let longest = head.len() as u64 + 76 * vertices as u64 + 59 * triangles as u64 + 1024;

    let mut archive = zip::Writer::new(out);
    archive.small("[Content_Types].xml", CONTENT_TYPES.as_bytes())?;
    archive.small("_rels/.rels", RELATIONSHIPS.as_bytes())?;
    archive.begin(MODEL, longest >= u64::from(u32::MAX))?;
    archive.chunk(&Chunk::deflate(head.as_bytes(), false))?;
    ordered(vertex_chunks, |i| Chunk::deflate(&vertex_lines(mesh, i), false), |chunk| archive.chunk(&chunk))?;
    archive.chunk(&Chunk::deflate(b"</vertices>\n<triangles>\n", false))?;
    ordered(triangle_chunks, |i| Chunk::deflate(&triangle_lines(mesh, i), false), |chunk| archive.chunk(&chunk))?;
    archive.chunk(&Chunk::deflate(TAIL.as_bytes(), true))?;
    archive.end()?;
    archive.finish()
}

/// The model up to its vertices.
fn head(meta: &Metadata) -> String {
    let mut text = String::from(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" \
         xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" xmlns:trabecula=\"urn:trabecula:design\">\n",
    );
    for (name, value) in
        [("Title", &meta.title), ("Application", &meta.application), ("trabecula:design", &meta.design)]
    {
        if !value.is_empty() {
            text += &format!("<metadata name=\"{name}\">{}</metadata>\n", escaped(value));
        }
    }
    text + "<resources>\n<object id=\"1\" type=\"model\">\n<mesh>\n<vertices>\n"
}

/// Text as XML content; characters that XML cannot hold become U+FFFD.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '\r' => out += "&#13;",
            '\n' | '\t' => out.push(c),
            '\0'..' ' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(c),
        }
    }
    out
}

fn vertex_lines(mesh: &Mesh, chunk: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(52 * CHUNK);
    for &[x, y, z] in &mesh.vertices[chunk_range(chunk, mesh.vertices.len())] {
        bytes.extend_from_slice(b"<vertex x=\"");
        push_f32(&mut bytes, x as f32);
        bytes.extend_from_slice(b"\" y=\"");
        push_f32(&mut bytes, y as f32);
        bytes.extend_from_slice(b"\" z=\"");
        push_f32(&mut bytes, z as f32);
        bytes.extend_from_slice(b"\"/>\n");
    }
    bytes
}

fn triangle_lines(mesh: &Mesh, chunk: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(52 * CHUNK);
    for &[a, b, c] in &mesh.triangles[chunk_range(chunk, mesh.triangles.len())] {
        bytes.extend_from_slice(b"<triangle v1=\"");
        push_u64(&mut bytes, a.into());
        bytes.extend_from_slice(b"\" v2=\"");
        push_u64(&mut bytes, b.into());
        bytes.extend_from_slice(b"\" v3=\"");
        push_u64(&mut bytes, c.into());
        bytes.extend_from_slice(b"\"/>\n");
    }
    bytes
}

/// Reads.
pub fn read(_bytes: &[u8]) -> Result<Mesh, Fault> {
    todo!()
}
