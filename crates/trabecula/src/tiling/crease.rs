//! The creases of a lattice over a tetrahedral mesh: how much its surface bends at the faces between tetrahedra.

use schemars::JsonSchema;
use serde::Serialize;

use super::Tiling;
use crate::cell::Part;
use crate::cell::tet::{Bary, Subdivision};
use crate::map::tet_map::NONE;
use geometry::math::{Vec3, add, dot, norm, scale};

/// Steps along the edge of a face on which traces are sampled.
const STEPS: usize = 24;
/// Largest number of faces that are searched.
const FACES: usize = 20_000;
/// Largest number of tetrahedra whose faces are searched with overlap.
const SAMPLED: usize = 256;

/// Angles between walls at the faces of tetrahedra, degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Creases")]
pub struct WallCreases {
    /// Mean along all traces, before smoothing by overlap.
    pub mean: f64,
    /// Maximum, before smoothing by overlap.
    pub max: f64,
    /// Maximum after smoothing by overlap, at sampled points of the faces; None without overlap.
    pub smoothed: Option<f64>,
}

impl Tiling {
    /// The creases without overlap, and what is left of them with it, at the mean level where it varies. `None` for transitions, and where no face is met.
    pub fn creases(&self) -> Option<WallCreases> {
        let [cell] = &self.cells[..] else { return None };
        let levels = self.levels();
        let t = 0.5 * (levels.lo + levels.hi) * cell.scale;
        let sides = match self.part {
            Part::Sheet => vec![-t, t],
            _ => vec![t],
        };
        let traces: Vec<[f64; 3]> = sides.iter().flat_map(|t| self.trace(*t)).collect();
        if traces.is_empty() {
            return None;
        }
        let map = &self.map;
        // ∂f/∂λ is (g, 0): with zero for the corner opposite, in every tetrahedron that has the face.
        let normal = |tet: usize, opposite: usize, g: &[f64; 3]| -> Vec3 {
            let m = map.slopes(tet);
            let last = scale(add(add(m[0], m[1]), m[2]), -1.0);
            let m = [m[0], m[1], m[2], last];
            (0..3).fold([0.0; 3], |s, i| add(s, scale(m[i + usize::from(i >= opposite)], g[i])))
        };
        let (mut sum, mut count, mut max) = (0.0, 0.0, 0.0f64);
        let step = (2 * map.len()).div_ceil(FACES);
        for tet in (0..map.len()).step_by(step) {
            for (face, other) in map.across(tet).into_iter().enumerate() {
                if other == NONE || (step == 1 && (other as usize) < tet) {
                    continue;
                }
                let other = other as usize;
                let back = map.across(other).iter().position(|t| *t as usize == tet);
                let Some(back) = back else { continue };
                for g in &traces {
                    let (a, b) = (normal(tet, face, g), normal(other, back, g));
                    let c = dot(a, b) / (norm(a) * norm(b));
                    let angle = c.clamp(-1.0, 1.0).acos().to_degrees();
                    if angle.is_finite() {
                        (sum, count, max) = (sum + angle, count + 1.0, max.max(angle));
                    }
                }
            }
        }
        (count > 0.0).then(|| WallCreases { mean: sum / count, max, smoothed: self.smoothed() })
    }

    /// The greatest angle between gradients on both sides of faces, at three points of each of some hundred, 1e-7 of the
    /// tetrahedron away.
    fn smoothed(&self) -> Option<f64> {
        const SHARES: [[f64; 3]; 3] = [[0.5, 0.3, 0.2], [0.2, 0.5, 0.3], [0.3, 0.2, 0.5]];
        const AWAY: f64 = 1e-7;
        if self.map.overlap() <= 0.0 {
            return None;
        }
        let step = self.map.len().div_ceil(SAMPLED);
        let mut points = Vec::new();
        for t in (0..self.map.len()).step_by(step) {
            let c = self.map.corners(t);
            for (face, other) in self.map.across(t).into_iter().enumerate() {
                if other == NONE {
                    continue;
                }
                let corners = (0..4).filter(|i| *i != face);
                for share in SHARES {
                    let on = corners.clone().zip(share).fold([0.0; 3], |s, (i, w)| add(s, scale(c[i], w)));
                    let side = |s: f64| add(scale(on, 1.0 - s), scale(c[face], s));
                    points.extend([side(AWAY), side(-AWAY)]);
                }
            }
        }
        let known = self.known(&points);
        let pairs = known.chunks_exact(2).map(|k| {
            let [a, b] = [0, 1].map(|i| k[i].slope);
            (dot(a, b) / (norm(a) * norm(b))).clamp(-1.0, 1.0).acos().to_degrees()
        });
        Some(pairs.filter(|a| a.is_finite()).fold(0.0, f64::max))
    }

    /// ∂f/∂λ of the first three coordinates at points where f = t on the face on which the fourth is zero.
    fn trace(&self, t: f64) -> Vec<[f64; 3]> {
        let cell = &self.cells[0].cell;
        let n = STEPS;
        let bary = |a: usize, b: usize| -> Bary {
            let k = [n - a, a - b, b].map(|v| v as f64 / n as f64);
            [k[0], k[1], k[2], 0.0]
        };
        let at: Vec<Bary> = (0..=n).flat_map(|a| (0..=a).map(move |b| bary(a, b))).collect();
        let v = cell.values(&at);
        let mut found: Vec<Bary> = Vec::new();
        Subdivision { n }.each_triangle(|c, up| {
            let c = c.map(|[a, b]| a * (a + 1) / 2 + b);
            // Triangles of one kind have every edge once.
            for (a, b) in [(0, 1), (1, 2), (0, 2)].into_iter().filter(|_| up) {
                let (x, y) = (v[c[a]] - t, v[c[b]] - t);
                if (x < 0.0) != (y < 0.0) {
                    let s = x / (x - y);
                    found.push(core::array::from_fn(|i| at[c[a]][i] + s * (at[c[b]][i] - at[c[a]][i])));
                }
            }
        });
        let (mut v, mut g) = (vec![0.0; found.len()], vec![[0.0; 4]; found.len()]);
        cell.gradients(&found, &mut v, &mut g);
        g.into_iter().map(|g| [g[0], g[1], g[2]]).collect()
    }
}
