//! How good a tetrahedron is, while nodes are moved.

use super::super::{TetMesh, quality::dihedral_cosines, volume};
use crate::math::Vec3;

/// The least and the greatest dihedral angle (degrees) that cutting leaves in a lattice that is not bisected.
///
/// Source: Labelle & Shewchuk 2007, whose proof goes through all ways of cutting.
pub const ANGLES: [f64; 2] = [10.7, 164.8];

/// 1 where the worst dihedral angle is one of `ANGLES`, more where all are better (16 in a regular tetrahedron); a small
/// angle and one short of 180 degrees count by the squares of what they are short of. Negative without volume.
pub(super) fn shape(p: [Vec3; 4]) -> f64 {
    // 1 − cos 10.7°, 1 + cos 164.8°.
    const SMALL: f64 = 0.017_387;
    const LARGE: f64 = 0.034_984;
    let v = volume(p);
    if v <= 0.0 {
        return -1.0;
    }
    dihedral_cosines(p).into_iter().fold(f64::INFINITY, |m, c| {
        // NaN, of a face without area, counts as bad.
        let worst = ((1.0 - c) / SMALL).min((1.0 + c) / LARGE);
        if worst.is_nan() { -1.0 } else { m.min(worst) }
    })
}

/// The tetrahedra at each node.
pub(super) struct Around {
    start: Vec<u32>,
    tets: Vec<u32>,
}

impl Around {
    pub fn new(mesh: &TetMesh) -> Around {
        let mut start = vec![0u32; mesh.nodes.len() + 1];
        mesh.tets
            .iter()
            .flatten()
            .for_each(|n| start[*n as usize + 1] += 1);
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut tets = vec![0; 4 * mesh.tets.len()];
        for (i, t) in mesh.tets.iter().enumerate() {
            for n in t {
                tets[next[*n as usize] as usize] = i as u32;
                next[*n as usize] += 1;
            }
        }
        Around { start, tets }
    }

    /// The tetrahedra at node `n`, in ascending order.
    pub fn of(&self, n: usize) -> &[u32] {
        &self.tets[self.start[n] as usize..self.start[n + 1] as usize]
    }

    /// The worst shape at node `n`, and the tetrahedron that has it.
    pub fn worst(&self, mesh: &TetMesh, n: usize) -> (f64, u32) {
        self.of(n).iter().fold((f64::INFINITY, u32::MAX), |m, t| {
            let q = shape(mesh.corners(*t as usize));
            if q < m.0 { (q, *t) } else { m }
        })
    }
}
