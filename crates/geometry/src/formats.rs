//! File formats by extension. Formats are leaves: bytes in, mesh out; mesh in, `io::Write` out.
use std::io;
use std::ops::Range;

use rayon::prelude::*;

use crate::fault::Fault;
use crate::mesh::Mesh;

mod element_files;
mod elements;
mod frd;
mod graphs;
mod indexed;
mod join;
mod layer_files;
mod nastran_fields;
mod npy;
mod number;
mod obj;
mod off;
pub mod part21;
mod picture;
mod ply;
mod scalar;
pub mod stl;
mod text;
mod threemf;
mod vti;
mod vtk;
mod vtu;
mod xml;

pub use element_files::{
    BEAM_FORMATS, BeamFormat, FE_FORMATS, FeFormat, FeText, HEX_FORMATS, HexFormat, POLY_FILES, PolyFile,
    SHELL_FORMATS, ShellFormat,
};
pub use elements::Elements;
pub use graphs::{BeamGraph, GRAPH_FORMATS, GraphFormat, GraphLoss, read_graph, write_graph};
pub use indexed::{ByteSpool, Indexed};
pub use layer_files::{Encoded, LAYER_FORMATS, LayerFormat, LayerWriter, PixelGrid, Stack, Target};
pub use npy::{npy_head, read_npy, write_npy};
pub use picture::{Picture, read_pictures};
pub use stl::write_pieces as write_stl_pieces;
pub use text::{column, heading};
pub use threemf::{BeamLattice, Cap, CompanionMeshes, Frustum, object_names, read_object, write_beam_lattice};
pub use vti::{pvti, vti_frame, write_vti};
pub use vtk::{Data, DataArray, DataSet, read_vtk};
pub use vtu::write_vtu;

/// Formats of results on grids and meshes, by the ends of their files' names.
pub const RESULTS: [&str; 4] = ["vtu", "vtk", "vti", "frd"];

/// Reads a result of a kind of [`RESULTS`]. Of an FRD, which holds many steps, only the array of this name has its numbers.
///
/// **Errors**: what the format does not allow; truncated files; other kinds.
pub fn read_result(bytes: &[u8], kind: &str, array: &str) -> Result<Data, Fault> {
    match kind {
        "frd" => frd::read(bytes, array),
        _ => read_vtk(bytes),
    }
}

/// A format of mesh files. A new one is a file in this folder and a row in [`FORMATS`].
pub struct Format {
    /// End of the file's name, in small letters, without the dot.
    pub suffix: &'static str,
    /// Whether coordinates are in mm once read, because files name their unit.
    pub in_mm: bool,
    /// Whether each triangle of a file has corners of its own, in single precision: what belongs together has to be found.
    pub soup: bool,
    /// Reads a file.
    read: fn(&[u8]) -> Result<Mesh, Fault>,
    /// How files are written, if they are.
    pub writer: Option<Writer>,
}

/// How files of a format are written.
pub struct Writer {
    /// Whether numbers are bytes rather than text.
    pub binary: bool,
    /// Bytes of a file for each triangle and each vertex; those of text for parts of some hundred mm.
    pub bytes: [f64; 2],
    write: WriteMesh,
}

/// Writes a file.
enum WriteMesh {
    /// One in which each triangle has corners of its own.
    Soup(fn(&Mesh, &mut dyn io::Write) -> io::Result<()>),
    /// One with numbered vertices. What follows numbers that are not known yet is put aside.
    Indexed(fn(&dyn Indexed, &Metadata, &mut dyn ByteSpool, &mut dyn io::Write) -> io::Result<()>),
}

/// The mesh formats, in the order in which texts name them.
pub const FORMATS: &[Format] = &[
    Format {
        suffix: "stl",
        in_mm: false,
        soup: true,
        read: stl::read,
        writer: Some(Writer {
            binary: true,
            bytes: [50.0, 0.0],
            write: WriteMesh::Soup(|mesh, mut out| stl::write(mesh, &mut out)),
        }),
    },
    Format {
        suffix: "3mf",
        in_mm: true,
        soup: false,
        read: threemf::read,
        writer: Some(Writer { binary: false, bytes: [7.0, 9.0], write: WriteMesh::Indexed(threemf::write) }),
    },
    Format {
        suffix: "ply",
        in_mm: false,
        soup: false,
        read: |bytes| ply::read(without_mark(bytes)),
        writer: Some(Writer {
            binary: true,
            bytes: [13.0, 24.0],
            write: WriteMesh::Indexed(|mesh, _, _, out| ply::write(mesh, out)),
        }),
    },
    Format {
        suffix: "obj",
        in_mm: false,
        soup: false,
        read: |bytes| obj::read(without_mark(bytes)),
        writer: Some(Writer {
            binary: false,
            bytes: [27.0, 50.0],
            write: WriteMesh::Indexed(|mesh, meta, _, out| obj::write(mesh, meta, out)),
        }),
    },
    Format { suffix: "off", in_mm: false, soup: false, read: |bytes| off::read(without_mark(bytes)), writer: None },
];

impl Format {
    /// The format with a suffix, in any letter case.
    pub fn of(suffix: &str) -> Option<&'static Format> {
        FORMATS.iter().find(|f| f.suffix.eq_ignore_ascii_case(suffix))
    }

    /// The suffixes of all formats, for messages: "stl, 3mf, …".
    pub fn listed() -> String {
        suffixes(FORMATS.iter())
    }
}

fn suffixes(of: impl Iterator<Item = &'static Format>) -> String {
    of.map(|f| f.suffix).collect::<Vec<_>>().join(", ")
}

/// Text without the byte order mark that some editors put before it.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// What a mesh file held.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh, vertices of equal position joined, in the file's own unit unless the format names one (3MF: mm).
    pub mesh: Mesh,
    /// Whether coordinates are already in mm because the file names its unit (3MF).
    pub in_mm: bool,
}

fn unknown(suffix: &str, known: &str) -> String {
    let found = if suffix.is_empty() { "no extension".to_string() } else { format!("extension \"{suffix}\"") };
    format!("{found}: known mesh formats are {known}")
}

/// Reads a mesh from the bytes of a file whose name ends in `suffix` (any letter case, no dot): one of [`FORMATS`].
///
/// Polygons become fans of triangles; vertices that no face uses are dropped.
///
/// **Errors**: an unknown suffix; an empty, truncated or malformed file (with line or byte); coordinates that
/// are not finite; indices out of range; a file without faces.
pub fn read_mesh(bytes: &[u8], suffix: &str) -> Result<Loaded, Fault> {
    let format = Format::of(suffix).ok_or_else(|| Fault::new("", unknown(suffix, &Format::listed())))?;
    if bytes.is_empty() {
        return Err(Fault::new("", "the file is empty (0 bytes)"));
    }
    let mesh = (format.read)(bytes);
    let wide = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
    let mesh = mesh.map_err(|f| match wide {
        true => Fault::new("", "the file is text in UTF-16; save it as UTF-8"),
        false => f,
    })?;
    if mesh.triangles.is_empty() {
        return Err(Fault::new("", "the file holds no triangle"));
    }
    Ok(Loaded { mesh, in_mm: format.in_mm })
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

/// Writes a mesh in the format of `suffix` (any letter case, no dot): one of [`FORMATS`] that has a writer.
///
/// The bytes do not depend on the number of threads.
///
/// **Errors**: whatever `out` reports, unchanged; `InvalidInput` for an unknown suffix, an index out of range, a
/// coordinate that is not finite in single precision, or more triangles or vertices than the format can count.
pub fn write_mesh<W: io::Write>(mesh: &Mesh, suffix: &str, meta: &Metadata, out: &mut W) -> io::Result<()> {
    let write = writer(suffix)?;
    check_mesh(mesh)?;
    match write {
        WriteMesh::Soup(write) => write(mesh, out),
        WriteMesh::Indexed(write) => write(mesh, meta, &mut Vec::new(), out),
    }
}

/// Writes a mesh that need not be in memory in a format with numbered vertices: the same bytes as [`write_mesh`]. `aside` holds
/// bytes in between.
///
/// **Errors**: as [`write_mesh`], but for coordinates and indices, which are not checked; `InvalidInput` for a format whose
/// triangles have corners of their own; whatever the mesh and `aside` report.
pub fn write_indexed(
    mesh: &dyn Indexed,
    suffix: &str,
    meta: &Metadata,
    aside: &mut dyn ByteSpool,
    out: &mut dyn io::Write,
) -> io::Result<()> {
    match writer(suffix)? {
        WriteMesh::Indexed(write) => write(mesh, meta, aside, out),
        WriteMesh::Soup(_) => Err(invalid(format!("{suffix} has no numbered vertices"))),
    }
}

/// How files with this suffix are written.
fn writer(suffix: &str) -> io::Result<&'static WriteMesh> {
    let found = Format::of(suffix).and_then(|f| f.writer.as_ref());
    let written = || FORMATS.iter().filter(|f| f.writer.is_some());
    found.map(|w| &w.write).ok_or_else(|| invalid(unknown(suffix, &suffixes(written()))))
}

/// Writes several meshes into one 3MF, each an object of its own with its name, all to be built where they are.
///
/// **Errors**: as [`write_mesh`].
pub fn write_objects<W: io::Write>(objects: &[(&str, &Mesh)], meta: &Metadata, out: &mut W) -> io::Result<()> {
    objects.iter().try_for_each(|o| check_mesh(o.1))?;
    let objects: Vec<(&str, &dyn Indexed)> =
        objects.iter().map(|(name, mesh)| (*name, *mesh as &dyn Indexed)).collect();
    threemf::write_objects(&objects, meta, &mut Vec::new(), out)
}

/// Refuses what no format can hold.
fn check_mesh(mesh: &Mesh) -> io::Result<()> {
    let count = mesh.vertices.len();
    if let Some(i) = mesh.triangles.par_iter().position_first(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(invalid(format!("triangle {i} is {:?}, but there are {count} vertices", mesh.triangles[i])));
    }
    let outside = |p: &[f64; 3]| p.iter().any(|x| !(*x as f32).is_finite());
    if let Some(i) = mesh.vertices.par_iter().position_first(outside) {
        return Err(invalid(format!("vertex {i} at {:?} is not finite in single precision", mesh.vertices[i])));
    }
    Ok(())
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

/// Makes pieces of `count` items, `chunk` at a time, on all threads, and takes them in order until one fails. A few pieces per
/// thread are held at once; their limits depend on `chunk` alone.
fn in_order<T: Send>(
    count: usize,
    chunk: usize,
    make: impl Fn(Range<usize>) -> io::Result<T> + Sync,
    mut take: impl FnMut(T) -> io::Result<()>,
) -> io::Result<()> {
    let chunks = count.div_ceil(chunk);
    let batch = 4 * rayon::current_num_threads();
    for first in (0..chunks).step_by(batch) {
        let piece = |i: usize| make(i * chunk..count.min((i + 1) * chunk));
        let made: Vec<io::Result<T>> = (first..chunks.min(first + batch)).into_par_iter().map(piece).collect();
        made.into_iter().try_for_each(|made| take(made?))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner of a cube, outward.
    pub fn tetrahedron() -> Mesh {
        Mesh {
            vertices: vec![[0.0; 3], [1.5, 0.0, 0.0], [0.0, 2.25, 0.0], [0.0, 0.0, 3.125]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        }
    }

    /// Every truncation below `whole` bytes is refused, and no garbled byte brings the reader down.
    pub fn refuses_damage(extension: &str, bytes: &[u8], whole: usize) {
        for n in 0..whole {
            let r = read_mesh(&bytes[..n], extension);
            assert!(r.is_err(), "{extension} cut at {n} of {} was taken", bytes.len());
        }
        let mut seed = 3u64;
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize
        };
        for _ in 0..3000 {
            let mut bad = bytes.to_vec();
            for _ in 0..1 + next() % 4 {
                let i = next() % bad.len();
                bad[i] = next() as u8;
            }
            if let Ok(loaded) = read_mesh(&bad, extension) {
                assert!(loaded.mesh.vertices.iter().flatten().all(|v| v.is_finite()));
                let n = loaded.mesh.vertices.len() as u32;
                assert!(loaded.mesh.triangles.iter().flatten().all(|v| *v < n));
            }
            let noise: Vec<u8> = (0..next() % 400).map(|_| next() as u8).collect();
            assert!(read_mesh(&noise, extension).is_err());
        }
    }

    #[test]
    fn extensions_in_any_case_and_unknown_ones_named() {
        let mesh = tetrahedron();
        for format in FORMATS {
            let mut bytes = Vec::new();
            let upper = format.suffix.to_uppercase();
            let written = write_mesh(&mesh, &upper, &Metadata::default(), &mut bytes);
            assert_eq!(written.is_ok(), format.writer.is_some());
            if let Err(e) = written {
                assert_eq!(e.to_string(), "extension \"OFF\": known mesh formats are stl, 3mf, ply, obj");
                continue;
            }
            let back = read_mesh(&bytes, &upper).unwrap();
            assert_eq!(back.mesh.volume(), mesh.volume(), "{upper}");
            assert_eq!(back.in_mm, upper == "3MF");
        }
        let fault = read_mesh(b"x", "step").unwrap_err();
        assert_eq!(fault.message, "extension \"step\": known mesh formats are stl, 3mf, ply, obj, off");
        assert!(write_mesh(&mesh, "", &Metadata::default(), &mut Vec::new()).is_err());
        for format in FORMATS {
            assert_eq!(read_mesh(b"", format.suffix).unwrap_err().message, "the file is empty (0 bytes)");
        }
    }

    #[test]
    fn a_byte_order_mark_is_passed_over() {
        let text = b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(read_mesh(text, "obj").unwrap().mesh.area(), 0.5);
        let wide: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for kind in ["obj", "ply", "off", "stl"] {
            let message = read_mesh(&wide, kind).unwrap_err().message;
            assert!(message.contains("UTF-16"), "{message}");
        }
    }

    #[test]
    fn meshes_that_no_file_can_hold_are_refused() {
        for (v, t) in [([0.0, 0.0, 1e40], [0, 1, 2]), ([0.0, f64::NAN, 0.0], [0, 1, 2]), ([0.0; 3], [0, 1, 7])] {
            let mut mesh = tetrahedron();
            mesh.vertices[1] = v;
            mesh.triangles[2] = t;
            let e = write_mesh(&mesh, "stl", &Metadata::default(), &mut Vec::new()).unwrap_err();
            assert_eq!(e.kind(), io::ErrorKind::InvalidInput);
        }
    }
}
