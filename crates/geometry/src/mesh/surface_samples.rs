//! Samples spread evenly over a surface.

use rayon::prelude::*;

use super::Mesh;
use crate::distance::triangle::normal;
use crate::math::{Vec3, add, cross, norm, scale, sub};

/// A point of a surface and the part that it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Its position (mm).
    pub at: Vec3,
    /// The unit normal of its triangle.
    pub normal: Vec3,
    /// The area that it stands for (mm²).
    pub area: f64,
}

impl Mesh {
    /// Centroids of the parts into which triangles are bisected, by their longest edges, until no edge is longer than `spacing`
    /// (mm); in the order of the triangles, for any number of threads.
    pub fn samples(&self, spacing: f64) -> Vec<SurfaceSample> {
        let of = |i: usize| {
            let corners = self.corners(i);
            let normal = normal(corners);
            let mut found = Vec::new();
            let mut todo = vec![corners];
            while let Some(t) = todo.pop() {
                let lengths = [0, 1, 2].map(|k| norm(sub(t[(k + 1) % 3], t[(k + 2) % 3])));
                let k = (0..3).fold(0, |m, k| if lengths[k] > lengths[m] { k } else { m });
                let [p, q, r] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
                if lengths[k] > spacing {
                    let middle = scale(add(q, r), 0.5);
                    todo.extend([[p, q, middle], [p, middle, r]]);
                } else {
                    let area = 0.5 * norm(cross(sub(q, p), sub(r, p)));
                    found.push(SurfaceSample { at: scale(add(add(p, q), r), 1.0 / 3.0), normal, area });
                }
            }
            found
        };
        (0..self.triangles.len()).into_par_iter().flat_map_iter(of).collect()
    }
}
