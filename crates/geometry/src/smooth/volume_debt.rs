//! The volume that changes take, and who gives it back.

use super::working_mesh::{GAIN, WorkingMesh, sine};
use crate::math::norm;
use crate::remesh::edited_mesh::single;

/// Most times that debts are handed on to neighbours.
const SWEEPS: usize = 8;
/// A debt is settled if it moves the vertex by less than this share of the rounding.
const SETTLED: f64 = 0.5;

impl WorkingMesh {
    /// Lets `vertices` give back a volume (mm³) in equal parts, those that can: vertices of sharp edges cannot.
    pub fn owe(&mut self, volume: f64, vertices: &[u32]) {
        let free = |work: &WorkingMesh, v: &u32| work.mesh.kept_at[*v as usize] == 0;
        let n = vertices.iter().filter(|v| free(self, v)).count();
        for v in vertices {
            if free(self, v) {
                self.owed[*v as usize] += volume / n as f64;
            }
        }
    }

    /// Moves vertices along the derivative of the volume until what they owe is given back. What a vertex of a plane or one
    /// hemmed in cannot give goes to its neighbours.
    pub fn settle(&mut self) {
        for sweep in 0..SWEEPS {
            for v in 0..self.mesh.positions.len() as u32 {
                if self.owed[v as usize] != 0.0 {
                    self.give(v, sweep + 1 < SWEEPS);
                }
            }
        }
    }

    fn give(&mut self, v: u32, hands_on: bool) {
        let ring = self.ring(v);
        if ring.len() < 3 {
            return;
        }
        let (x, owed, slope) = (self.mesh.at(v), self.owed[v as usize], self.slope(&ring));
        if 6.0 * owed.abs() <= SETTLED * self.rounding * norm(slope) {
            return;
        }
        if self.mesh.kept_at[v as usize] == 0 && !self.is_flat(x, &ring, slope) {
            let p = single(self.balanced(x, x, slope, self.payable(x, &ring, slope, owed)));
            let worst = |work: &WorkingMesh, p| {
                let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
                pairs.map(|(a, b)| sine([p, work.mesh.at(*a), work.mesh.at(*b)])).fold(f64::INFINITY, f64::min)
            };
            // No worse than any change was worth.
            if GAIN * worst(self, p) > worst(self, x) {
                self.place(v, &ring, p, slope);
            }
        }
        let left = self.owed[v as usize];
        if hands_on && 6.0 * left.abs() > SETTLED * self.rounding * norm(slope) {
            self.owed[v as usize] = 0.0;
            self.owe(left, &ring);
        }
    }
}
