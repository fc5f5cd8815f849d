//! A mesh that is being fitted to its region: the tetrahedra at each node, constraints of the nodes, and excluded balls.

use super::tet_shape::shape;
use crate::field::Field;
use geometry::math::{Vec3, norm, sub};
use geometry::tetmesh::TetMesh;

/// A mesh that is being fitted to a region.
pub(super) struct Work<'a> {
    pub region: &'a dyn Field,
    pub mesh: TetMesh,
    pub around: Around,
    /// Whether each node is on the surface.
    pub on: Vec<bool>,
    /// The number of directions in which an edge (2) or corner (3) of the region holds it.
    pub held: Vec<usize>,
    /// Balls in which nothing is moved: the boundary would meet itself there.
    pub barred: Vec<(Vec3, f64)>,
}

impl<'a> Work<'a> {
    pub fn new(region: &'a dyn Field, mesh: TetMesh, on: Vec<bool>) -> Work<'a> {
        Work { region, around: Around::new(&mesh), held: vec![0; on.len()], on, mesh, barred: Vec::new() }
    }

    /// Whether a position is in one of the excluded balls.
    pub fn bars(&self, p: Vec3) -> bool {
        self.barred.iter().any(|(c, r)| norm(sub(*c, p)) < *r)
    }

    /// The worst shape at node `n`, and the tetrahedron that has it.
    pub fn worst(&self, n: usize) -> (f64, u32) {
        let of = self.around.of(n).iter();
        of.fold((f64::INFINITY, u32::MAX), |m, t| {
            let q = shape(self.mesh.corners(*t as usize));
            if q < m.0 { (q, *t) } else { m }
        })
    }

    /// Bisects an edge, and with it the tetrahedra that have it, by a node at `position`.
    pub fn split(&mut self, edge: [u32; 2], position: Vec3, held: usize) {
        self.around.split(&mut self.mesh, edge, position);
        self.on.push(true);
        self.held.push(held);
    }

    /// Removes the last node, which bisected this edge when there were `count` tetrahedra.
    pub fn unsplit(&mut self, edge: [u32; 2], count: usize) {
        self.around.unsplit(&mut self.mesh, edge, count);
        self.on.pop();
        self.held.pop();
    }
}

/// The tetrahedra at each node.
pub(super) struct Around(Vec<Vec<u32>>);

impl Around {
    pub fn new(mesh: &TetMesh) -> Around {
        let mut count = vec![0; mesh.nodes.len()];
        mesh.tets.iter().flatten().for_each(|n| count[*n as usize] += 1);
        let mut at: Vec<Vec<u32>> = count.into_iter().map(Vec::with_capacity).collect();
        for (i, t) in (0..).zip(&mesh.tets) {
            t.iter().for_each(|n| at[*n as usize].push(i));
        }
        Around(at)
    }

    /// The tetrahedra at node `n`.
    pub fn of(&self, n: usize) -> &[u32] {
        &self.0[n]
    }

    /// The tetrahedra at the edge between two nodes.
    pub fn edge(&self, mesh: &TetMesh, [a, b]: [u32; 2]) -> Vec<u32> {
        let has = |t: &&u32| mesh.tets[**t as usize].contains(&b);
        self.of(a as usize).iter().filter(has).copied().collect()
    }

    /// Bisects an edge, and with it the tetrahedra that have it, by a node at `position`.
    fn split(&mut self, mesh: &mut TetMesh, [a, b]: [u32; 2], position: Vec3) {
        let new = mesh.nodes.len() as u32;
        mesh.nodes.push(position);
        let halved = self.edge(mesh, [a, b]);
        let mut at = halved.clone();
        for t in halved {
            let (old, half) = (mesh.tets[t as usize], mesh.tets.len() as u32);
            let with = |end: u32| old.map(|n| if n == end { new } else { n });
            mesh.tets[t as usize] = with(b);
            mesh.tets.push(with(a));
            at.push(half);
            for n in old.into_iter().filter(|n| *n != a) {
                let of = &mut self.0[n as usize];
                of.retain(|i| n != b || *i != t);
                of.push(half);
            }
        }
        self.0.push(at);
    }

    /// Removes the last node, which bisected this edge when there were `count` tetrahedra.
    fn unsplit(&mut self, mesh: &mut TetMesh, [_, b]: [u32; 2], count: usize) {
        mesh.nodes.pop();
        let new = mesh.nodes.len() as u32;
        for t in self.0.pop().unwrap_or_default() {
            let tet = &mut mesh.tets[t as usize];
            if (t as usize) < count {
                *tet = tet.map(|n| if n == new { b } else { n });
                self.0[b as usize].push(t);
            } else {
                for n in tet.iter().filter(|n| **n != new) {
                    self.0[*n as usize].retain(|i| *i != t);
                }
            }
        }
        mesh.tets.truncate(count);
    }
}
