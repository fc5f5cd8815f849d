//! Layer heights by the slope of the surface.
//!
//! A layer of thickness t leaves steps on a surface whose unit normal has the vertical component n: their height over the surface,
//! the cusp, is t |n|. Layers are as thick as a cusp allows.
//!
//! Source: A. Dolenc, I. Mäkelä, Slicing procedures for layered manufacturing techniques, Computer-Aided Design 26 (1994) 119.

use geometry::math::norm;
use rayon::prelude::*;

use super::Slicer;
use super::leaf_cells::LeafCells;
use super::outline::Outline;
use super::roots::{SurfacesAtHeight, solve};

/// The share of a section's contour on which the cusp is kept to: the rest is where the surface is nearly level, as it is about every
/// summit.
const SHARE: f64 = 0.95;

/// How thick layers may be, mm.
#[derive(Clone, Copy, Debug)]
pub struct Adaptive {
    /// Greatest height of steps over the surface.
    pub cusp: f64,
    /// Least thickness.
    pub least: f64,
}

impl Slicer {
    /// The heights of layers between `least` and `layer` thick that keep to the cusp.
    pub(super) fn adapted(&self, [from, to]: [f64; 2], layer: f64, adaptive: Adaptive) -> Vec<f64> {
        let count = ((to - from) / adaptive.least - 1e-9).ceil().max(1.0) as usize;
        let middle = |i: usize| from + (i as f64 + 0.5) * adaptive.least;
        let slopes: Vec<f64> = (0..count).into_par_iter().map(|i| self.slope(middle(i))).collect();
        let most = (layer / adaptive.least + 1e-9).floor().max(1.0) as usize;
        let (mut heights, mut at) = (vec![from], 0);
        while at < count {
            let (mut thick, mut slope) = (1, slopes[at]);
            while thick < most && at + thick < count {
                slope = slope.max(slopes[at + thick]);
                if (thick + 1) as f64 * adaptive.least * slope > adaptive.cusp {
                    break;
                }
                thick += 1;
            }
            at += thick;
            heights.push(if at < count { from + at as f64 * adaptive.least } else { to });
        }
        heights
    }

    /// The vertical component of the unit normal below which it is on most of the contour at a height.
    fn slope(&self, z: f64) -> f64 {
        let plane = SurfacesAtHeight { surfaces: &self.surfaces, z };
        let mut outline = Outline::default();
        let mut cells = LeafCells::new(&self.grid, &self.surfaces, &self.tree, z);
        cells.each_polygon(&mut |cells, block, corners| outline.add(cells, &self.grid, block, corners));
        solve(&mut outline, &self.grid, plane, 0.1 * self.grid.step);
        let mut roots: Vec<u32> = outline.chords(&cells).iter().map(|c| c.ends[0]).collect();
        let surface = |r: &u32| outline.roots[*r as usize].surface;
        roots.sort_by_key(surface);
        let mut slopes = Vec::with_capacity(roots.len());
        for of in roots.chunk_by(|a, b| surface(a) == surface(b)) {
            let points = of.iter().map(|r| outline.roots[*r as usize].position(&self.grid));
            slopes.extend(plane.evaluate(surface(&of[0]), points).gradients.into_iter().map(|g| {
                let length = norm(g);
                if length > 0.0 { g[2].abs() / length } else { 1.0 }
            }));
        }
        slopes.sort_unstable_by(f64::total_cmp);
        slopes.get((SHARE * slopes.len() as f64) as usize).copied().unwrap_or(0.0)
    }
}
