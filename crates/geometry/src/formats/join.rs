//! Joining of vertices that have the same position, and gathering of triangles.

use rustc_hash::FxHashMap;

use crate::fault::Fault;
use crate::math::Vec3;
use crate::mesh::Mesh;

/// Gathers triangles given by position into a mesh with one vertex per position.
#[derive(Default)]
pub struct Joiner {
    mesh: Mesh,
    known: FxHashMap<[u64; 3], u32>,
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
