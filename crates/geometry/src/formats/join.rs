//! Joining of vertices that have the same position, and gathering of triangles.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::fault::Fault;
use crate::math::Vec3;
use crate::mesh::Mesh;

/// A multiplicative hasher: keys are coordinates, and a fast join matters more than resisting chosen keys.
#[derive(Default)]
struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }

    fn write_u64(&mut self, n: u64) {
        let x = (self.0.rotate_left(23) ^ n).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = x ^ (x >> 29);
    }

    fn write_usize(&mut self, n: usize) {
        self.write_u64(n as u64);
    }
}

/// Gathers triangles given by position into a mesh with one vertex per position.
#[derive(Default)]
pub struct Joiner {
    mesh: Mesh,
    known: HashMap<[u64; 3], u32, BuildHasherDefault<Mix>>,
}

impl Joiner {
    /// Adds a vertex unless its position is known; gives its index. The coordinates must be finite.
    pub fn vertex(&mut self, p: Vec3) -> Result<u32, Fault> {
        let p = p.map(|x| x + 0.0); // −0 becomes 0
        let next = self.mesh.vertices.len();
        let index = *self.known.entry(p.map(f64::to_bits)).or_insert(next as u32);
        if index as usize == next {
            if next >= u32::MAX as usize {
                return Err(Fault::new("", format!("more than {} vertices: split the mesh", u32::MAX)));
            }
            self.mesh.vertices.push(p);
        }
        Ok(index)
    }

    /// Adds a triangle.
    pub fn triangle(&mut self, corners: [Vec3; 3]) -> Result<(), Fault> {
        let [a, b, c] = corners;
        let t = [self.vertex(a)?, self.vertex(b)?, self.vertex(c)?];
        self.mesh.triangles.push(t);
        Ok(())
    }

    /// Adds a polygon as a fan about its first corner. Fewer than three corners add nothing.
    pub fn fan(&mut self, vertices: &[Vec3], polygon: &[u32]) -> Result<(), Fault> {
        for i in 2..polygon.len() {
            self.triangle([0, i - 1, i].map(|k| vertices[polygon[k] as usize]))?;
        }
        Ok(())
    }

    /// Number of triangles so far.
    pub fn len(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// The mesh.
    pub fn finish(self) -> Mesh {
        self.mesh
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_become_one_vertex_and_unequal_ones_do_not() {
        let mut j = Joiner::default();
        let (a, b, c) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        j.triangle([a, b, c]).unwrap();
        j.triangle([[-0.0, 0.0, -0.0], c, [1.0 + f64::EPSILON, 0.0, 0.0]]).unwrap();
        let mesh = j.finish();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.vertices.len(), 4);
    }
}
