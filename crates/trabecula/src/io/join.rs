//! Meshes built from what files hold: equal positions joined, polygons cut into fans, indices checked at the end.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::fault::Fault;
use crate::math::Vec3;
use crate::mesh::Mesh;

/// A mesh under construction.
#[derive(Default)]
pub(super) struct Joiner {
    mesh: Mesh,
    known: HashMap<[u64; 3], u32, BuildHasherDefault<Mix>>,
}

impl Joiner {
    /// The index of the vertex at `p`, new or known; `place` says where the file gives it.
    pub(super) fn vertex(&mut self, p: Vec3, place: impl Fn() -> String) -> Result<u32, Fault> {
        if !p.iter().all(|x| x.is_finite()) {
            let [x, y, z] = p;
            let message = format!("{}: vertex at ({x}, {y}, {z}); coordinates must be finite numbers", place());
            return Err(Fault::new("", message));
        }
        // Adding zero turns −0 into 0.
        let p = p.map(|x| x + 0.0);
        let next = self.mesh.vertices.len();
        if next == u32::MAX as usize {
            return Err(Fault::new("", format!("{}: more than {next} vertices; a mesh holds no more", place())));
        }
        let index = *self.known.entry(p.map(f64::to_bits)).or_insert(next as u32);
        if index as usize == next {
            self.mesh.vertices.push(p);
        }
        Ok(index)
    }

    /// Adds a triangle of indices that `vertex` gave.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) {
        self.mesh.triangles.push(corners);
    }

    /// The mesh; a fault if it holds no triangle.
    pub(super) fn finish(self, format: &str) -> Result<Mesh, Fault> {
        if self.mesh.triangles.is_empty() {
            let found = self.mesh.vertices.len();
            return Err(Fault::new("", format!("{format}: {found} vertices and no triangle; a surface is needed")));
        }
        Ok(self.mesh)
    }
}

/// Polygons given by index into a vertex list of the file, which may come later.
pub(super) struct Indexed {
    joiner: Joiner,
    /// What `Joiner` named each vertex of the file.
    names: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    /// The largest index and where it stands (a line, or the number of a face).
    largest: Option<(u32, u64)>,
}

impl Indexed {
    pub(super) fn new() -> Self {
        Indexed { joiner: Joiner::default(), names: Vec::new(), triangles: Vec::new(), largest: None }
    }

    /// Number of vertices so far.
    pub(super) fn count(&self) -> usize {
        self.names.len()
    }

    /// Adds a vertex.
    pub(super) fn vertex(&mut self, p: Vec3, place: impl Fn() -> String) -> Result<(), Fault> {
        let name = self.joiner.vertex(p, place)?;
        self.names.push(name);
        Ok(())
    }

    /// Adds the fan of triangles about a polygon's first corner; `place` is a line or the number of the face.
    pub(super) fn polygon(&mut self, corners: &[u32], place: u64) {
        let largest = corners.iter().copied().max();
        self.largest = self.largest.max(largest.map(|index| (index, place)));
        if let [first, rest @ ..] = corners {
            self.triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
    }

    /// The mesh; a fault if an index is out of range (`place` says where) or there is no triangle.
    /// `base` is the file's index of its first vertex.
    pub(super) fn finish(mut self, format: &str, base: u64, place: impl Fn(u64) -> String) -> Result<Mesh, Fault> {
        let count = self.names.len();
        if let Some((index, at)) = self.largest.filter(|&(index, _)| index as usize >= count) {
            let (index, last) = (u64::from(index) + base, (count as u64 + base).saturating_sub(1));
            let message = match count {
                0 => format!("{}: vertex {index} is named; the file has no vertices", place(at)),
                _ => format!("{}: vertex {index} is named; the file has vertices {base} to {last}", place(at)),
            };
            return Err(Fault::new("", message));
        }
        for t in &self.triangles {
            self.joiner.triangle(t.map(|v| self.names[v as usize]));
        }
        self.joiner.finish(format)
    }
}

/// A quick hash of coordinates' bits: multiply and rotate, mixed once more at the end.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn write(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.write_u64(b.into());
        }
    }

    fn write_u64(&mut self, n: u64) {
        self.0 = (self.0.rotate_left(23) ^ n).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn finish(&self) -> u64 {
        let h = (self.0 ^ self.0 >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        h ^ h >> 32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> String {
        "here".into()
    }

    #[test]
    fn equal_positions_and_both_zeros_are_one_vertex() {
        let mut j = Joiner::default();
        let a = j.vertex([0.0, 1.0, -0.0], place);
        assert_eq!(j.vertex([-0.0, 1.0, 0.0], place), a);
        assert_ne!(j.vertex([0.0, 1.0_f64.next_up(), 0.0], place), a);
        assert_eq!(j.mesh.vertices[0].map(f64::to_bits), [0.0, 1.0, 0.0_f64].map(f64::to_bits));
    }

    #[test]
    fn what_is_not_finite_or_in_range_is_refused() {
        let mut j = Joiner::default();
        assert!(j.vertex([f64::NAN, 0.0, 0.0], place).is_err());
        assert!(j.vertex([0.0, f64::INFINITY, 0.0], place).is_err());
        let mut m = Indexed::new();
        assert_eq!(m.vertex([0.0; 3], place), Ok(()));
        m.polygon(&[0, 1, 0], 7);
        let fault = m.finish("X", 1, |n| format!("X, line {n}")).expect_err("vertex 2 is not there");
        assert_eq!(fault.message, "X, line 7: vertex 2 is named; the file has vertices 1 to 1");
    }

    #[test]
    fn polygons_become_fans() {
        let mut m = Indexed::new();
        for i in 0..5 {
            assert_eq!(m.vertex([f64::from(i), 0.0, 0.0], place), Ok(()));
        }
        m.polygon(&[4, 3, 2, 1, 0], 0);
        let mesh = m.finish("X", 0, |n| n.to_string()).expect("all indices are there");
        assert_eq!(mesh.triangles, [[4, 3, 2], [4, 2, 1], [4, 1, 0]]);
    }
}
