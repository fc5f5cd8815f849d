//! Levels at which a surface on coarse steps encloses what the lattice does.
//!
//! Triangles are chords, and those of a thin strut lie mostly inside it: at five steps along the edge of a tetrahedron a sixth of
//! its volume is lost. In a tetrahedron of one cell at one level the share that should be solid is known, so the level is shifted
//! until the surface on these steps encloses it. The shift is of second order in the step, like the distance of chords.

use rayon::prelude::*;

use super::small_simplices::Template;
use super::tet_surface::{Core, CornerLevels, TetBuffers, TetSurface};
use crate::cell::Part;
use crate::cell::tet::SubdivisionNodes;
use crate::tiling::{NodalLevel, Tiling};

/// Levels at which a shift is found where they vary; between them it is linear.
const KNOTS: usize = 5;
/// The most cuts for one level, and the share of the tetrahedron that is close enough.
const ROUNDS: usize = 6;
const NEAR: f64 = 2e-5;
/// The most that a level is shifted: a share of the range of f, and for a sheet of the level.
const FARTHEST: f64 = 0.1;
const SHEET: f64 = 0.75;

/// A cell on small tetrahedra: its values there and its slopes along their edges, as [`Core`] has them.
pub(super) struct Stencil<'a> {
    pub nodes: &'a SubdivisionNodes,
    pub template: &'a Template,
    pub values: &'a [f64],
    pub slopes: &'a [[f64; 2]],
}

impl Stencil<'_> {
    /// The levels of a lattice of one cell, shifted.
    pub fn shifted(&self, tiling: &Tiling) -> NodalLevel {
        let of = |t: f64| self.shifted_level(tiling, t);
        match &tiling.level {
            NodalLevel::Same(t) => NodalLevel::Same(of(*t)),
            NodalLevel::Nodes(levels) => {
                let range = tiling.levels();
                let step = (range.hi - range.lo) / (KNOTS - 1) as f64;
                let knots = (0..KNOTS).into_par_iter().map(|i| {
                    let t = range.lo + step * i as f64;
                    of(t) - t
                });
                let shifts: Vec<f64> = knots.collect();
                let shift = |t: f64| {
                    if step <= 0.0 {
                        return shifts[0];
                    }
                    let at = ((t - range.lo) / step).clamp(0.0, (KNOTS - 1) as f64);
                    let i = (at as usize).min(KNOTS - 2);
                    shifts[i] + (at - i as f64) * (shifts[i + 1] - shifts[i])
                };
                NodalLevel::Nodes(levels.iter().map(|t| t + shift(*t)).collect::<Vec<f64>>().into())
            }
        }
    }

    /// The level at which the surface encloses the share that the lattice has at level `t`; the best found.
    fn shifted_level(&self, tiling: &Tiling, t: f64) -> f64 {
        let share = |t: f64| tiling.fraction(t);
        let range = tiling.cells[0].cell.range();
        let width = (range.hi - range.lo) / tiling.cells[0].scale;
        let (wanted, nudge) = (share(t), 0.01 * width);
        let rate = (share(t + nudge) - share(t - nudge)) / (2.0 * nudge);
        let farthest = match tiling.part {
            Part::Sheet => (FARTHEST * width).min(SHEET * t),
            _ => FARTHEST * width,
        };
        // A level beyond the cell's values, or none.
        if !(1e-6..1.0 - 1e-6).contains(&wanted) || rate.abs() < 1e-3 / width {
            return t;
        }
        let mut scratch = TetBuffers::default();
        let (mut level, mut best) = (t, (f64::INFINITY, t));
        for _ in 0..ROUNDS {
            let off = wanted - self.enclosed(tiling, level, &mut scratch);
            if off.abs() < best.0 {
                best = (off.abs(), level);
            }
            if off.abs() < NEAR {
                break;
            }
            level = (level + off / rate).clamp(t - farthest, t + farthest);
        }
        best.1
    }

    /// The share of a tetrahedron that the surface at a level encloses with caps on all faces.
    fn enclosed(&self, tiling: &Tiling, level: f64, scratch: &mut TetBuffers) -> f64 {
        let core = Core { values: self.values, slopes: self.slopes, levels: CornerLevels::Same(level) };
        let surface = TetSurface::new(self.nodes, self.template, &core, tiling.part, 15, scratch);
        // Six times the volume, by three of the coordinates; six times that of the tetrahedron is one.
        let cone = |v: &[u32; 3]| {
            let [a, b, c] = v.map(|v| surface.vertices[v as usize]);
            let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
            a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
        };
        surface.triangles.iter().map(|(v, _)| cone(v)).sum::<f64>().abs()
    }
}
