//! Layers of any solid from its field, without a mesh: contours within a tolerance of the section.
//!
//! The implicit surfaces of the solid are sampled one by one on a square grid in the layer's plane (`plane_grid`), which is refined
//! where it leaves the section undecided (`leaf_cells`). Their roots on the sides of cells are joined (`outline`, `roots`), the
//! arcs between them divided until their chords follow the section (`arcs`), and made polygons of the section's area (`rings`) that
//! do not intersect (`crossings`). Where two surfaces meet, the corner is a point of the polygon.
//!
//! Layers are made in parallel and taken in order; each depends on the solid, the plan and its number alone.

mod adaptive;
mod arcs;
mod crossings;
mod leaf_cells;
mod outline;
mod plane_grid;
mod rings;
mod roots;

use std::ops::Range;

use geometry::fault::{Fault, number};
use geometry::layer::Layer;
use geometry::progress::{Cancellation, Progress, Stopped, checkpoint};
use rayon::prelude::*;

use crate::csg_tree::CsgTree;
use crate::implicit::Surface;
use crate::solid::Solid;
pub use adaptive::Adaptive;
use arcs::{Arc, intersection_guess};
use leaf_cells::LeafCells;
use outline::Outline;
use plane_grid::PlaneGrid;
use rings::{Limits, Rings};
use roots::{SurfacesAtHeight, solve, solve_intersections};

/// Most layers of a part, and most cells of a layer.
const MOST_LAYERS: f64 = 1e7;
const MOST_CELLS: f64 = 4e8;
/// The greatest tolerance, in cells.
const COARSEST: f64 = 0.25;

/// The heights at which layers begin, and the last one's end, mm, rising.
pub type Heights = Vec<f64>;

/// What layers are wanted.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Greatest distance of contours from the section, mm.
    pub tolerance: f64,
    /// Edge of the cells in which the section is looked for, mm.
    pub step: f64,
    /// Thinner layers where the surface is nearer to level.
    pub adaptive: Option<Adaptive>,
    /// Where the first layer begins and the last one ends, mm; the ends of the region where it is not given.
    pub range: [Option<f64>; 2],
}

/// A solid that is ready to be sliced.
pub struct Slicer {
    surfaces: Vec<Surface>,
    tree: CsgTree,
    grid: PlaneGrid,
    heights: Heights,
    tolerance: f64,
    /// The least distance between points, which single precision keeps, mm.
    gap: f64,
}

impl Slicer {
    /// Prepares a solid.
    ///
    /// # Errors
    /// A layer, tolerance or range that is not a positive length, above or below the part, or too fine for it; an unbounded region.
    pub fn new(solid: &Solid, plan: &Plan) -> Result<Slicer, Fault> {
        let bounds = solid.region.bounds();
        if bounds.is_empty() || !bounds.is_finite() {
            let found = if bounds.is_empty() { "empty" } else { "not bounded" };
            return Err(Fault::new("region", format!("the region is {found}; there is nothing to slice")));
        }
        for (name, value) in [("layer", plan.layer), ("tolerance", plan.tolerance), ("step", plan.step)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Fault::new(name, format!("{value} mm; it must be a length greater than 0")));
            }
        }
        // Contours nearer than they need be are within the tolerance, too; coarser ones than the cells would miss what these show.
        let plan = &Plan { tolerance: plan.tolerance.min(COARSEST * plan.step), ..*plan };
        let size = bounds.size();
        let farthest = (bounds.min.iter().chain(&bounds.max)).fold(0.0f64, |m, x| m.max(x.abs()));
        let gap = (4.0 * f64::from(f32::EPSILON) * farthest).max(1e-4 * plan.tolerance.min(plan.step));
        if plan.tolerance < 4.0 * gap {
            let message = format!(
                "{} mm; coordinates up to {} mm are held in single precision, so it must be {} mm or more",
                number(plan.tolerance),
                number(farthest),
                number(16.0 * f64::from(f32::EPSILON) * farthest)
            );
            return Err(Fault::new("tolerance", message));
        }
        let step = plan.step.min(0.25 * size[0].max(size[1]));
        if (size[0] / step) * (size[1] / step) > MOST_CELLS {
            let message = format!(
                "{} mm makes more than {MOST_CELLS:.0e} cells of a layer of {} × {} mm; use a larger step, or a smaller part",
                number(step),
                number(size[0]),
                number(size[1])
            );
            return Err(Fault::new("step", message));
        }
        let heights = heights(plan, [bounds.min[2], bounds.max[2]])?;
        let (surfaces, tree) = solid.surfaces();
        let grid = PlaneGrid::new(&bounds, step, &surfaces)?;
        let mut made = Slicer { surfaces, tree, grid, heights, tolerance: plan.tolerance, gap };
        if let (Some(adaptive), &[from, .., to]) = (plan.adaptive, &made.heights[..]) {
            for (name, value) in [("adaptive", adaptive.cusp), ("least", adaptive.least)] {
                if !(value > 0.0 && value.is_finite()) {
                    return Err(Fault::new(name, format!("{value} mm; it must be a length greater than 0")));
                }
            }
            if adaptive.least > plan.layer || (to - from) / adaptive.least > MOST_LAYERS {
                let message = format!(
                    "{} mm; it must be at most the layer height, {} mm, and make no more than {MOST_LAYERS:.0e} layers",
                    number(adaptive.least),
                    number(plan.layer)
                );
                return Err(Fault::new("least", message));
            }
            made.heights = made.adapted([from, to], plan.layer, adaptive);
        }
        Ok(made)
    }

    /// Number of layers.
    pub fn len(&self) -> usize {
        self.heights.len() - 1
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where layers begin, and the last one's end, mm.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// A layer: the section in the middle of its thickness.
    pub fn layer(&self, index: usize) -> Layer {
        let [bottom, top] = [self.heights[index], self.heights[index + 1]];
        let z = 0.5 * (bottom + top);
        // A face of the solid in the plane itself would be decided by rounding: what begins there belongs to the layer, what ends
        // there does not.
        let above = 1e-6 * (top - bottom);
        Layer { z, bottom, top, loops: self.section(z + above) }
    }

    /// The section at a height, mm.
    pub fn at(&self, z: f64) -> Layer {
        let above = 1e-6 * (self.heights[1] - self.heights[0]);
        Layer { z, bottom: z, top: z, loops: self.section(z + above) }
    }

    /// The contours of the section at a height.
    fn section(&self, z: f64) -> Vec<Vec<geometry::layer::Point>> {
        let plane = SurfacesAtHeight { surfaces: &self.surfaces, z };
        let accuracy = 0.02 * self.tolerance;
        let mut outline = Outline::default();
        let mut cells = LeafCells::new(&self.grid, &self.surfaces, &self.tree, z);
        cells.each_polygon(&mut |cells, block, corners| outline.add(cells, &self.grid, block, corners));
        checkpoint();
        solve(&mut outline, &self.grid, plane, accuracy);
        outline.separate(&self.grid, self.gap);
        checkpoint();
        let rings = self.rings(&outline, &cells, plane, accuracy);
        // Two ends that shortest decimals move by half a unit in the last place, a quarter of the gap, along x and y: √2 / 4 of it.
        let limits = Limits { tolerance: self.tolerance, accuracy, box_edge: self.grid.step, near: 0.375 * self.gap };
        rings.polygons(plane, limits)
    }

    /// The arcs of all contours: chords of one surface, and those of two with the corner between them.
    fn rings(&self, outline: &Outline, cells: &LeafCells, plane: SurfacesAtHeight, accuracy: f64) -> Rings {
        let roots = &outline.roots;
        let position = |r: u32| roots[r as usize].position(&self.grid);
        let chords = outline.chords(cells);
        let mut next = vec![None; roots.len()];
        let mut intersections = Vec::new();
        for chord in &chords {
            let ends = chord.ends.map(|r| &roots[r as usize]);
            let surfaces = ends.map(|r| r.surface);
            let corner = (surfaces[0] != surfaces[1]).then(|| {
                let points = chord.ends.map(position);
                intersections.push(intersection_guess(points, surfaces, ends.map(|r| r.gradient), chord.bounds));
                intersections.len() - 1
            });
            next[chord.ends[0] as usize] = Some((chord.ends[1], corner));
        }
        solve_intersections(&mut intersections, plane, accuracy);
        let mut rings = Rings { arcs: Vec::with_capacity(chords.len() + intersections.len()), ends: Vec::new() };
        for first in 0..roots.len() as u32 {
            let mut at = first;
            while let Some((to, corner)) = next[at as usize].take() {
                let (a, b) = (&roots[at as usize], &roots[to as usize]);
                let (p, q) = (position(at), position(to));
                let whole = Arc {
                    ends: [p, q],
                    surface: Some(a.surface),
                    gradients: [a.gradient, b.gradient],
                    corners: [false, false],
                };
                match corner.map(|c| &intersections[c]) {
                    None => rings.arcs.push(whole),
                    Some(m) if m.found => {
                        let [g, h] = m.gradients;
                        let corners = [false, true];
                        rings.arcs.push(Arc { ends: [p, m.point], gradients: [a.gradient, g], corners, ..whole });
                        let second = Arc { ends: [m.point, q], gradients: [h, b.gradient], ..whole };
                        rings.arcs.push(Arc { surface: Some(b.surface), corners: [true, false], ..second });
                    }
                    Some(_) => rings.arcs.push(Arc { surface: None, ..whole }),
                }
                at = to;
            }
            if rings.arcs.len() as u32 > rings.ends.last().copied().unwrap_or(0) {
                rings.ends.push(rings.arcs.len() as u32);
            }
        }
        rings
    }

    /// Makes some layers, maps each with its number by `map` on its thread and passes the results to `take` in order. A few layers
    /// a thread are held at a time.
    ///
    /// # Errors
    /// What `take` reports; `Interrupted` if the progress asks for it.
    pub fn each<T: Send>(
        &self,
        layers: Range<usize>,
        progress: &dyn Progress,
        map: impl Fn(usize, &Layer) -> T + Sync,
        mut take: impl FnMut(T) -> Result<(), Stopped>,
    ) -> Result<(), Stopped> {
        let (start, end) = (layers.start, layers.end.min(self.len()));
        let total = end.saturating_sub(start) as u64;
        let batch = 2 * rayon::current_num_threads();
        let request = Cancellation::current();
        for first in (start..end).step_by(batch) {
            let made =
                (first..end.min(first + batch)).into_par_iter().map(|i| request.enter(|| map(i, &self.layer(i))));
            let made: Vec<T> = made.collect();
            let done = (first - start + made.len()) as u64;
            made.into_iter().try_for_each(&mut take)?;
            if !progress.step(done, total) {
                return Err(Stopped::Interrupted);
            }
        }
        Ok(())
    }
}

/// The heights of layers of one thickness; the last one ends with the part.
fn heights(plan: &Plan, [low, high]: [f64; 2]) -> Result<Heights, Fault> {
    for (name, z) in ["from", "to"].into_iter().zip(plan.range) {
        if let Some(z) = z.filter(|z| !z.is_finite()) {
            return Err(Fault::new(name, format!("{z} mm; it must be a finite height")));
        }
    }
    let from = plan.range[0].unwrap_or(low).max(low);
    let to = plan.range[1].unwrap_or(high).min(high);
    if from >= to {
        let range = plan.range.map(|z| z.map_or("its end".to_string(), |z| format!("{} mm", number(z))));
        let message = format!(
            "the part lies between {} and {} mm; no layer is between {} and {}",
            number(low),
            number(high),
            range[0],
            range[1]
        );
        return Err(Fault::new(if plan.range[0].is_some() { "from" } else { "to" }, message));
    }
    if plan.layer > to - from && plan.range == [None; 2] {
        let message = format!(
            "{} mm; the part is only {} mm high. Use a layer height of at most that",
            number(plan.layer),
            number(to - from)
        );
        return Err(Fault::new("layer", message));
    }
    let count = ((to - from) / plan.layer - 1e-9).ceil().max(1.0);
    if count > MOST_LAYERS {
        let message =
            format!("{} mm makes {count:.0} layers; at most {MOST_LAYERS:.0e} are possible", number(plan.layer));
        return Err(Fault::new("layer", message));
    }
    let begins = (0..count as usize).map(|i| from + i as f64 * plan.layer);
    Ok(begins.chain([to]).collect())
}
