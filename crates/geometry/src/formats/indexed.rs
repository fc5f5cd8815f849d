//! What a writer of indexed formats asks for, so that no mesh need be in memory: ranges of it, and a place for bytes whose
//! number has to be known before they are written.

use std::borrow::Cow;
use std::io::{self, Seek, Write};
use std::ops::Range;

use crate::math::Vec3;
use crate::mesh::Mesh;

/// An indexed mesh, in memory or in files, from which ranges are taken in order.
pub trait Indexed: Sync {
    /// The numbers of vertices and triangles.
    fn counts(&self) -> [usize; 2];

    /// The positions of a range of vertices, mm.
    ///
    /// # Errors
    /// Failures of the files that hold the mesh.
    fn positions(&self, range: Range<usize>) -> io::Result<Cow<'_, [Vec3]>>;

    /// The corners of a range of triangles.
    ///
    /// # Errors
    /// Failures of the files that hold the mesh.
    fn corners(&self, range: Range<usize>) -> io::Result<Cow<'_, [[u32; 3]]>>;
}

impl Indexed for Mesh {
    fn counts(&self) -> [usize; 2] {
        [self.vertices.len(), self.triangles.len()]
    }

    fn positions(&self, range: Range<usize>) -> io::Result<Cow<'_, [Vec3]>> {
        Ok(Cow::Borrowed(&self.vertices[range]))
    }

    fn corners(&self, range: Range<usize>) -> io::Result<Cow<'_, [[u32; 3]]>> {
        Ok(Cow::Borrowed(&self.triangles[range]))
    }
}

/// Bytes put aside until what precedes them is known.
pub trait ByteSpool {
    /// Adds bytes at the end.
    ///
    /// # Errors
    /// Failures of the file that holds them.
    fn put(&mut self, bytes: Vec<u8>) -> io::Result<()>;

    /// Writes all of them.
    ///
    /// # Errors
    /// Failures of either file.
    fn copy_to(&mut self, out: &mut dyn io::Write) -> io::Result<()>;
}

impl ByteSpool for Vec<Vec<u8>> {
    fn put(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.push(bytes);
        Ok(())
    }

    fn copy_to(&mut self, out: &mut dyn io::Write) -> io::Result<()> {
        self.iter().try_for_each(|bytes| out.write_all(bytes))
    }
}

/// A file that is written and then read back from its beginning.
impl ByteSpool for std::fs::File {
    fn put(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.write_all(&bytes)
    }

    fn copy_to(&mut self, out: &mut dyn io::Write) -> io::Result<()> {
        self.seek(io::SeekFrom::Start(0))?;
        io::copy(self, out).map(|_| ())
    }
}
