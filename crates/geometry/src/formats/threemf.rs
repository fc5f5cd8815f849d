//! 3MF, core specification: objects in millimetres, with the design that they came from as metadata.
//!
//! Source: 3MF Consortium, 3D Manufacturing Format Core Specification 1.2; ECMA-376-2, Open Packaging Conventions.

use std::io::{self, Write};

use super::number::{push_f32, push_u32};
use super::xml::escaped;
use super::{ByteSpool, Indexed, Metadata, in_order, invalid};
use crate::math::Vec3;

mod beam_lattice;
mod beam_lattice_read;
mod deflate;
mod model;
mod package;
mod placed_beams;
mod read;

pub use beam_lattice::{BeamLattice, Cap, CompanionMeshes, Frustum, write_beam_lattice};
pub use package::DeflatedChunk;
use package::Entry;
pub use placed_beams::read_beam_lattice;
pub use read::{object_names, read, read_object};

const MODEL: &str = "3D/3dmodel.model";
const CORE: &str = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;
const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="rel0" Target="/3D/3dmodel.model" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

/// Writes 3MF. Coordinates are rounded to single precision, which is what readers of the format hold.
pub fn write(mesh: &dyn Indexed, meta: &Metadata, aside: &mut dyn ByteSpool, out: &mut dyn Write) -> io::Result<()> {
    write_objects(&[("", mesh)], meta, aside, out)
}

/// Writes several meshes as one 3MF: an object and an item of the build for each, with its name unless that is empty.
///
/// The model is deflated in pieces on all threads; the pieces join to one stream, since each ends at a byte. They are put aside,
/// as their size comes before them.
pub fn write_objects(
    objects: &[(&str, &dyn Indexed)],
    meta: &Metadata,
    aside: &mut dyn ByteSpool,
    out: &mut dyn Write,
) -> io::Result<()> {
    if objects.iter().any(|o| o.1.counts().iter().any(|n| *n >= i32::MAX as usize)) {
        return Err(invalid(format!("3MF counts to {}: the mesh has more vertices or triangles", i32::MAX)));
    }
    let mut model = ModelWriter::new(aside);
    let mut head = ModelWriter::head(" xmlns:trabecula=\"urn:trabecula:design\"");
    head.push_str(&meta.elements());
    head.push_str("<resources>\n");
    let mut tail = String::from("</resources>\n<build>\n");
    for (id, (name, mesh)) in (1..).zip(objects) {
        let name = if name.is_empty() { String::new() } else { format!(" name=\"{}\"", quoted(name)) };
        head.push_str(&format!("<object id=\"{id}\" type=\"model\"{name}>\n<mesh>\n<vertices>\n"));
        model.push(DeflatedChunk::of(head.as_bytes()))?;
        push_mesh(&mut model, *mesh)?;
        head = "</triangles>\n</mesh>\n</object>\n".into();
        tail.push_str(&format!("<item objectid=\"{id}\"/>\n"));
    }
    model.push(DeflatedChunk::of(format!("{head}{tail}</build>\n</model>\n").as_bytes()))?;
    model.finish(out)
}

/// The model of a package, made piece by piece.
pub struct ModelWriter<'a>(Entry<'a>);

impl<'a> ModelWriter<'a> {
    /// An empty model, whose pieces are put aside.
    pub fn new(aside: &'a mut dyn ByteSpool) -> ModelWriter<'a> {
        ModelWriter(Entry::new(MODEL, aside))
    }

    /// How its text begins, with more attributes of the model.
    pub fn head(attributes: &str) -> String {
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" xml:lang=\"en-US\" xmlns=\"{CORE}\"{attributes}>\n"
        )
    }

    /// Adds a piece of its text.
    pub fn push(&mut self, piece: DeflatedChunk) -> io::Result<()> {
        self.0.push(piece)
    }

    /// Writes the package.
    pub fn finish(mut self, out: &mut (impl Write + ?Sized)) -> io::Result<()> {
        let (mut first, mut second) = (Vec::new(), Vec::new());
        let mut types = Entry::new("[Content_Types].xml", &mut first);
        types.push(DeflatedChunk::of(TYPES.as_bytes()))?;
        let mut relations = Entry::new("_rels/.rels", &mut second);
        relations.push(DeflatedChunk::of(RELATIONS.as_bytes()))?;
        package::write(&mut [types, relations, self.0.lent()], package::LIMIT, &mut &mut *out)
    }
}

impl Metadata {
    /// The facts as elements of a model; empty ones are left out.
    fn elements(&self) -> String {
        let facts = [("Title", &self.title), ("Application", &self.application), ("trabecula:Design", &self.design)];
        let given = facts.iter().filter(|(_, text)| !text.is_empty());
        given.map(|(name, text)| format!("<metadata name=\"{name}\">{}</metadata>\n", escaped(text))).collect()
    }
}

/// Text as it may stand in an attribute.
fn quoted(text: &str) -> String {
    escaped(text).replace('"', "&quot;")
}

/// Adds rows of vertices.
fn push_vertices<'a>(
    model: &mut ModelWriter,
    count: usize,
    positions: impl Fn(std::ops::Range<usize>) -> io::Result<std::borrow::Cow<'a, [Vec3]>> + Sync,
) -> io::Result<()> {
    let rows = |r: std::ops::Range<usize>| {
        let mut text = Vec::with_capacity(r.len() * 48);
        for p in positions(r)?.iter() {
            let [x, y, z] = p.map(|v| v as f32);
            text.extend_from_slice(b"<vertex x=\"");
            push_f32(&mut text, x);
            text.extend_from_slice(b"\" y=\"");
            push_f32(&mut text, y);
            text.extend_from_slice(b"\" z=\"");
            push_f32(&mut text, z);
            text.extend_from_slice(b"\"/>\n");
        }
        Ok(DeflatedChunk::of(&text))
    };
    in_order(count, 1 << 14, rows, |piece| model.push(piece))
}

/// Adds the vertices and triangles of a mesh.
fn push_mesh(model: &mut ModelWriter, mesh: &dyn Indexed) -> io::Result<()> {
    let [vertices, triangles] = mesh.counts();
    push_vertices(model, vertices, |r| mesh.positions(r))?;
    let mut put = |piece| model.push(piece);
    put(DeflatedChunk::of(b"</vertices>\n<triangles>\n"))?;
    let faces = |r: std::ops::Range<usize>| {
        let mut text = Vec::with_capacity(r.len() * 56);
        for [a, b, c] in mesh.corners(r)?.iter() {
            text.extend_from_slice(b"<triangle v1=\"");
            push_u32(&mut text, *a);
            text.extend_from_slice(b"\" v2=\"");
            push_u32(&mut text, *b);
            text.extend_from_slice(b"\" v3=\"");
            push_u32(&mut text, *c);
            text.extend_from_slice(b"\"/>\n");
        }
        Ok(DeflatedChunk::of(&text))
    };
    in_order(triangles, 1 << 14, faces, &mut put)
}
