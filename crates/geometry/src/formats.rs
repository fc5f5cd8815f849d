//! File formats by extension. Formats are leaves: bytes in, mesh out; mesh in, `io::Write` out.
use std::io;
use std::ops::Range;

use rayon::prelude::*;

use crate::fault::Fault;
use crate::mesh::Mesh;

mod elements;
mod join;
mod npy;
mod number;
mod obj;
mod off;
mod picture;
mod ply;
pub mod stl;
mod text;
mod threemf;
mod vti;
mod vtk;
mod vtu;
mod xml;

pub use elements::Elements;
pub use npy::{read_npy, write_npy};
pub use picture::{Picture, read_pictures};
pub use stl::write_pieces as write_stl_pieces;
pub use vti::write_vti;
pub use vtk::{Array, Data, Shape, read_vtk};
pub use vtu::write_vtu;

/// Extensions of the mesh formats that can be read.
pub const READABLE: [&str; 5] = ["stl", "obj", "ply", "off", "3mf"];
/// Extensions of the mesh formats that can be written.
pub const WRITABLE: [&str; 4] = ["stl", "ply", "obj", "3mf"];

/// What a mesh file held.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The mesh, vertices of equal position joined, in the file's own unit unless the format names one (3MF: mm).
    pub mesh: Mesh,
    /// Whether coordinates are already in mm because the file names its unit (3MF).
    pub in_mm: bool,
}

fn unknown(extension: &str, known: &[&str]) -> String {
    let found = if extension.is_empty() { "no extension".to_string() } else { format!("extension \"{extension}\"") };
    format!("{found}: known mesh formats are {}", known.join(", "))
}

/// Reads a mesh from the bytes of a file whose name ends in `extension` (any letter case, no dot): stl, obj, ply,
/// off, 3mf.
///
/// Polygons become fans of triangles; vertices that no face uses are dropped.
///
/// **Errors**: an unknown extension; an empty, truncated or malformed file (with line or byte); coordinates that
/// are not finite; indices out of range; a file without faces.
pub fn read_mesh(bytes: &[u8], extension: &str) -> Result<Loaded, Fault> {
    let kind = extension.to_ascii_lowercase();
    if !READABLE.contains(&kind.as_str()) {
        return Err(Fault::new("", unknown(extension, &READABLE)));
    }
    if bytes.is_empty() {
        return Err(Fault::new("", "the file is empty (0 bytes)"));
    }
    // Some editors put a byte order mark before text.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mesh = match kind.as_str() {
        "stl" => stl::read(bytes),
        "obj" => obj::read(text),
        "ply" => ply::read(text),
        "off" => off::read(text),
        _ => threemf::read(bytes),
    };
    let wide = bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff");
    let mesh = mesh.map_err(|f| match wide {
        true => Fault::new("", "the file is text in UTF-16; save it as UTF-8"),
        false => f,
    })?;
    if mesh.triangles.is_empty() {
        return Err(Fault::new("", "the file holds no triangle"));
    }
    Ok(Loaded { mesh, in_mm: kind == "3mf" })
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

/// Writes a mesh in the format of `extension` (any letter case, no dot): stl (binary), ply (binary), obj, 3mf.
///
/// The bytes do not depend on the number of threads.
///
/// **Errors**: whatever `out` reports, unchanged; `InvalidInput` for an unknown extension, an index out of range, a
/// coordinate that is not finite in single precision, or more triangles or vertices than the format can count.
pub fn write_mesh<W: io::Write>(mesh: &Mesh, extension: &str, meta: &Metadata, out: &mut W) -> io::Result<()> {
    let kind = extension.to_ascii_lowercase();
    if !WRITABLE.contains(&kind.as_str()) {
        return Err(invalid(unknown(extension, &WRITABLE)));
    }
    let count = mesh.vertices.len();
    if let Some(i) = mesh.triangles.par_iter().position_first(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(invalid(format!("triangle {i} is {:?}, but there are {count} vertices", mesh.triangles[i])));
    }
    let outside = |p: &[f64; 3]| p.iter().any(|x| !(*x as f32).is_finite());
    if let Some(i) = mesh.vertices.par_iter().position_first(outside) {
        return Err(invalid(format!("vertex {i} at {:?} is not finite in single precision", mesh.vertices[i])));
    }
    match kind.as_str() {
        "stl" => stl::write(mesh, out),
        "ply" => ply::write(mesh, out),
        "obj" => obj::write(mesh, meta, out),
        _ => threemf::write(mesh, meta, out),
    }
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

/// Makes pieces of `count` items, `chunk` at a time, on all threads, and takes them in order. A few pieces per
/// thread are held at once; their limits depend on `chunk` alone.
fn in_order<T: Send>(
    count: usize,
    chunk: usize,
    make: impl Fn(Range<usize>) -> T + Sync,
    mut take: impl FnMut(T) -> io::Result<()>,
) -> io::Result<()> {
    let chunks = count.div_ceil(chunk);
    let batch = 4 * rayon::current_num_threads();
    for first in (0..chunks).step_by(batch) {
        let piece = |i: usize| make(i * chunk..count.min((i + 1) * chunk));
        let made: Vec<T> = (first..chunks.min(first + batch)).into_par_iter().map(piece).collect();
        made.into_iter().try_for_each(&mut take)?;
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
        for kind in WRITABLE {
            let mut bytes = Vec::new();
            let upper = kind.to_uppercase();
            write_mesh(&mesh, &upper, &Metadata::default(), &mut bytes).unwrap();
            let back = read_mesh(&bytes, &upper).unwrap();
            assert_eq!(back.mesh.volume(), mesh.volume(), "{kind}");
            assert_eq!(back.in_mm, kind == "3mf");
        }
        let fault = read_mesh(b"x", "step").unwrap_err();
        assert_eq!(fault.message, "extension \"step\": known mesh formats are stl, obj, ply, off, 3mf");
        assert!(write_mesh(&mesh, "", &Metadata::default(), &mut Vec::new()).is_err());
        for kind in READABLE {
            assert_eq!(read_mesh(b"", kind).unwrap_err().message, "the file is empty (0 bytes)");
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
