//! File formats by extension. Formats are leaves: bytes in, mesh out; mesh in, `io::Write` out.
//!
//! Writers format chunks of fixed size in parallel and write them in order, so memory stays bounded and the
//! bytes are the same whatever the thread count. Readers never trust a count: memory follows the bytes present.

use std::io;
use std::ops::Range;

use rayon::prelude::*;

use crate::fault::Fault;
use crate::mesh::Mesh;

mod decimal;
mod join;
pub mod npy;
pub mod obj;
pub mod off;
pub mod ply;
pub mod stl;
mod text;
pub mod threemf;
pub mod vti;
mod xml;
mod zip;

/// What a mesh file held.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The mesh, vertices of equal position joined, in the file's own unit unless the format names one (3MF: mm).
    pub mesh: Mesh,
    /// Whether coordinates are already in mm because the file names its unit (3MF).
    pub in_mm: bool,
}

/// Reads a mesh from the bytes of a file whose name ends in `extension` (any letter case, no dot): stl, obj, ply, off, 3mf.
///
/// Polygons become fans of triangles. Vertices of bit-equal position (with −0 = 0) are joined, across bodies too;
/// triangles stay as they are, in the file's order, even those of no area. A file that cannot be read whole, or
/// that holds no triangle, is a fault that names the line or byte.
pub fn read_mesh(bytes: &[u8], extension: &str) -> Result<Loaded, Fault> {
    let extension = extension.to_ascii_lowercase();
    let mesh = match extension.as_str() {
        "stl" => stl::read(bytes)?,
        "obj" => obj::read(bytes)?,
        "ply" => ply::read(bytes)?,
        "off" => off::read(bytes)?,
        "3mf" => threemf::read(bytes)?,
        other => {
            let message = format!("cannot read mesh files named .{other}; use .stl, .obj, .ply, .off or .3mf");
            return Err(Fault::new("", message));
        }
    };
    Ok(Loaded { mesh, in_mm: extension == "3mf" })
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

/// Writes a mesh in the format of `extension` (any letter case): stl (binary), ply (binary), obj, 3mf.
///
/// STL and 3MF carry the f32 nearest to each coordinate, PLY and OBJ the f64 itself. An error of kind `InvalidInput`
/// says that the mesh does not fit the format: a coordinate that is not finite (in f32 where the format holds f32),
/// a vertex index out of range, too many triangles, or an unknown extension.
pub fn write_mesh<W: io::Write>(mesh: &Mesh, extension: &str, meta: &Metadata, out: &mut W) -> io::Result<()> {
    match extension.to_ascii_lowercase().as_str() {
        "stl" => stl::write(mesh, meta, out),
        "obj" => obj::write(mesh, meta, out),
        "ply" => ply::write(mesh, meta, out),
        "3mf" => threemf::write(mesh, meta, out),
        other => Err(refused(format!("cannot write meshes as .{other}; use .stl, .ply, .obj or .3mf"))),
    }
}

/// The error of a mesh that a format cannot hold.
fn refused(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}

/// Checks that coordinates are finite and at most `largest` in size, and that indices are in range.
fn check(mesh: &Mesh, largest: f64) -> io::Result<()> {
    let holds = |p: &[f64; 3]| p.iter().all(|x| x.abs() <= largest);
    if let Some(i) = mesh.vertices.par_iter().position_first(|p| !holds(p)) {
        let [x, y, z] = mesh.vertices[i];
        return Err(refused(format!("vertex {i} is at ({x:e}, {y:e}, {z:e}); coordinates must be finite and at most {largest:e}")));
    }
    let count = mesh.vertices.len();
    if let Some(i) = mesh.triangles.par_iter().position_first(|t| t.iter().any(|&v| v as usize >= count)) {
        return Err(refused(format!("triangle {i} names vertices {:?}; the mesh has {count}", mesh.triangles[i])));
    }
    Ok(())
}

/// Makes items `0..count` in parallel and hands them on in order, a bounded number at a time.
fn ordered<T: Send>(
    count: usize,
    make: impl Fn(usize) -> T + Sync,
    mut sink: impl FnMut(T) -> io::Result<()>,
) -> io::Result<()> {
    let batch = 4 * rayon::current_num_threads();
    for start in (0..count).step_by(batch) {
        let made: Vec<T> = (start..count.min(start + batch)).into_par_iter().map(&make).collect();
        made.into_iter().try_for_each(&mut sink)?;
    }
    Ok(())
}

/// Writes the records `0..count`, formatted in parallel by `format` in chunks of `CHUNK` records of about `size` bytes.
fn write_records<W: io::Write>(
    count: usize,
    size: usize,
    out: &mut W,
    format: impl Fn(Range<usize>, &mut Vec<u8>) + Sync,
) -> io::Result<()> {
    let make = |chunk: usize| {
        let range = chunk_range(chunk, count);
        let mut bytes = Vec::with_capacity(range.len() * size);
        format(range, &mut bytes);
        bytes
    };
    ordered(count.div_ceil(CHUNK), make, |bytes| out.write_all(&bytes))
}

/// Records formatted at a time: 1 to 2 MB of text.
const CHUNK: usize = 1 << 15;

/// The records of chunk `chunk` of `0..count`.
fn chunk_range(chunk: usize, count: usize) -> Range<usize> {
    chunk * CHUNK..count.min((chunk + 1) * CHUNK)
}

/// Text on one line: line breaks and other control characters become spaces.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
