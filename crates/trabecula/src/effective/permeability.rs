//! Permeability of the pore of a periodic cell, with its hydraulic diameter and tortuosity.

use geometry::fault::Fault;
use geometry::math::{Mat3, determinant, norm, transpose};
use geometry::progress::{Progress, Stage, Stopped};
use homogenise::{Homogenised, VoxelCell};

use super::fractions::fractions;
use super::limit::{Limit, limit, modal_limit};
use super::pore_space::{CubicGrid, PoreSpace, wall_area};
use super::{LEAST, NoTensor, TOLERANCE, UnitCell, axis, enough, work};
use crate::csg_tree::{CsgSolid, CsgTree};
use crate::kind::Warning;
use crate::report::{CellGrid, PermeabilityReport};

/// A side of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetSide {
    /// Where the function of the cell is low.
    Lower,
    /// Where it is high.
    Upper,
}

/// Change of the flow by a step, over that of the first, at which it is steady.
const STEADY: f64 = 1e-7;
/// Entries below this share of the largest are those of directions without flow.
const NOTHING: f64 = 1e-5;
/// Steps across the hydraulic diameter below which the figures are to be doubted.
const ACROSS: f64 = 6.0;
/// Steps across the narrowest place of a pore that a flow needs at least to be found.
const OPEN: f64 = 3.0;
/// Strain of a cell, to be whole numbers of steps, that is worth a warning.
const STRAINED: f64 = 0.005;
/// Hydraulic radius of a pore, in steps, over the viscosity with which flow in it becomes steady soonest.
const SOONEST: f64 = 12.0;

/// What was found on a grid.
struct Flow {
    grid: CubicGrid,
    porosity: f64,
    area: f64,
    found: Homogenised<Mat3>,
}

impl UnitCell {
    /// The permeability of the pore, or of that on one side of a sheet.
    ///
    /// # Errors
    /// A side of what is no sheet; too few nodes; an interruption.
    pub fn permeability(
        &self,
        n: usize,
        side: Option<SheetSide>,
        progress: &dyn Progress,
    ) -> Result<PermeabilityReport, NoTensor> {
        self.check(n)?;
        let solids = self.opposite(side).map_err(Stopped::Refused)?;
        let part = |from, to| Stage { whole: progress, from, to };
        let flows = self.flows(n, &solids, &part(0.0, 0.9))?;
        let (conducts, porosity) = self.pore_conducts(n, &solids, &part(0.9, 1.0))?;
        let tensors: Vec<([usize; 3], Vec<f64>)> = flows
            .iter()
            .map(|f| (f.grid.shape, symmetric(&clean(&f.found.tensor)).into_iter().flatten().collect()))
            .collect();
        let limited = modal_limit(&tensors);
        let doubt = limited.doubt(&self.path, n);
        // From two grids alone the step along one axis may be small by chance.
        let least = if flows.len() > 2 { 0.0 } else { limited.error };
        let axis_errors: [f64; 3] = std::array::from_fn(|i| limited.error_along(&axis::<3>(i)).max(least));
        let Limit { tensor, error, order, .. } = limited;
        let k = clean(&std::array::from_fn(|i| std::array::from_fn(|j| tensor[3 * i + j])));
        let areas: Vec<([usize; 3], Vec<f64>)> = flows.iter().map(|f| (f.grid.shape, vec![f.area])).collect();
        let (volume, area) = (determinant(&self.edges).abs(), limit(&areas).tensor[0]);
        let diameter = (area > 0.0).then(|| 4.0 * porosity * volume / area);
        let mean = |t: &Mat3| (t[0][0] + t[1][1] + t[2][2]) / 3.0;
        let finest = &flows[0];
        let across = diameter.map(|d| d / finest.grid.step);
        let lengths = self.edges.map(norm);
        let cube = finest.grid.lean == [0; 3] && lengths.iter().all(|l| (l / lengths[0] - 1.0).abs() < 1e-9);
        let strain = if cube { 0.0 } else { finest.grid.strain };
        // No flow through a pore that is open says that it is too narrow for the grid.
        let lost = (0..3).any(|i| k[i][i] == 0.0).then(|| self.pore.as_ref().map_or(0.0, |pore| pore(side)));
        let lost = lost.filter(|pore| *pore > 0.0);
        let error = if lost.is_some() { 1.0 } else { error };
        Ok(PermeabilityReport {
            k_n: clean(&finest.found.tensor),
            k_cell: cube.then(|| k.map(|row| row.map(|v| v / (lengths[0] * lengths[0])))),
            n,
            error: error + strain,
            axis_errors: std::array::from_fn(|i| match lost {
                _ if k[i][i] > 0.0 => axis_errors[i] + strain,
                Some(_) => 1.0,
                None => 0.0,
            }),
            order,
            residual: flows.iter().map(|f| f.found.residual).fold(0.0, f64::max),
            iterations: finest.found.iterations,
            side: side.map(|s| if s == SheetSide::Lower { "lower".into() } else { "upper".into() }),
            porosity,
            area_per_volume: area / volume,
            hydraulic_diameter: diameter,
            kozeny: (mean(&k) > 0.0 && area > 0.0).then(|| porosity.powi(3) / (mean(&k) * (area / volume).powi(2))),
            conductivity: conducts,
            tortuosity: (mean(&conducts) > 0.0).then(|| porosity / mean(&conducts)),
            fraction: self.fraction.unwrap_or(1.0 - porosity),
            edges: self.edges,
            pore_nodes: across,
            grids: flows.iter().map(grid).collect(),
            warnings: doubt.into_iter().chain(self.doubts(&k, n, (across, lost), &finest.grid, strain)).collect(),
            k,
        })
    }

    /// The area of the wall, mm², from grids of n, n/2 and n/4 nodes along the cell.
    ///
    /// # Errors
    /// Too few nodes; an interruption.
    pub fn area(&self, n: usize, progress: &dyn Progress) -> Result<f64, Stopped> {
        self.check(n)?;
        let solids = self.opposite(None).map_err(Stopped::Refused)?;
        let grids = self.grids(n);
        let total: f64 = grids.iter().map(|g| work(&g.shape)).sum();
        let (mut areas, mut done) = (Vec::new(), 0.0);
        for grid in &grids {
            let next = done + work(&grid.shape);
            let stage = Stage { whole: progress, from: done / total, to: next / total };
            areas.push((grid.shape, vec![wall_area(&solids, grid, &stage)?]));
            done = next;
        }
        Ok(limit(&areas).tensor[0])
    }

    /// The cubic grids of about n, n/2 and, where that is enough, n/4 nodes along the cell.
    fn grids(&self, n: usize) -> Vec<CubicGrid> {
        let edges = transpose(&self.edges);
        let mut grids = vec![CubicGrid::near(&edges, n)];
        for by in [2, 4] {
            // A limit takes two.
            if by == 2 || n / by >= LEAST {
                grids.push(grids[0].coarser(by).unwrap_or_else(|| CubicGrid::near(&edges, n / by)));
            }
        }
        grids
    }

    /// What may be wrong.
    fn doubts(
        &self,
        k: &Mat3,
        n: usize,
        (across, lost): (Option<f64>, Option<f64>),
        grid: &CubicGrid,
        strain: f64,
    ) -> Vec<Warning> {
        let mut said = Vec::new();
        let closed: Vec<&str> = (0..3).filter(|i| k[*i][*i] == 0.0).map(|i| ["x", "y", "z"][i]).collect();
        if let Some(pore) = lost {
            let steps = pore / grid.step;
            let need = enough(n, OPEN / steps).map_or(String::new(), |need| format!(": take n = {need}"));
            said.push(format!(
                "no flow was found along {}, though a ball of {pore:.3} mm passes the pore: that is {steps:.1} steps of the grid, which closes it, \
                 and 0 is no figure{need}",
                closed.join(", ")
            ));
        } else if !closed.is_empty() {
            said.push(format!("the pore does not go through along {}: nothing flows there", closed.join(", ")));
        }
        if let Some(across) = across.filter(|a| *a < ACROSS) {
            let need = enough(n, ACROSS / across).map_or(String::new(), |need| format!(": take n = {need}"));
            said.push(format!(
                "the hydraulic diameter is {across:.1} steps of the grid across; below {ACROSS} the figures may be off by more than the error \
                 says{need}"
            ));
        }
        // The two sides of a sheet are apart however thin its wall is.
        if let Some(wall) = self.wall.map(|w| w / grid.step).filter(|w| *w < 2.0 && !self.sheet) {
            let need = enough(n, 2.0 / wall).map_or(String::new(), |need| format!(": take n = {need}"));
            said.push(format!(
                "the thinnest wall or neck is {wall:.1} steps of the grid across; below 2 links may pass through it{need}"
            ));
        }
        if strain > STRAINED {
            said.push(format!(
                "the edges of the cell are no whole numbers of steps of a cubic grid; it was strained by {:.2} % to fit: take a larger n, or \
                 wavelengths in simple ratios",
                100.0 * strain
            ));
        }
        said.into_iter().map(|message| Warning { path: self.path.clone(), message }).collect()
    }

    /// The solids outside which the pores are.
    fn opposite(&self, side: Option<SheetSide>) -> Result<Vec<CsgSolid>, Fault> {
        let leaf = |i: usize| CsgSolid { surfaces: vec![self.solid.surfaces[i].clone()], tree: CsgTree::Leaf(0) };
        match (self.sheet, side) {
            (true, None) => Ok(vec![leaf(1), leaf(0)]),
            (true, Some(SheetSide::Lower)) => Ok(vec![leaf(1)]),
            (true, Some(SheetSide::Upper)) => Ok(vec![leaf(0)]),
            (false, None) => Ok(vec![self.solid.clone()]),
            (false, Some(_)) => {
                let message = "only a sheet has a lower and an upper side; leave the side out";
                Err(Fault::new("side", message))
            }
        }
    }

    /// The flow on each grid, the finest first.
    fn flows(&self, n: usize, solids: &[CsgSolid], progress: &dyn Progress) -> Result<Vec<Flow>, NoTensor> {
        let grids = self.grids(n);
        // Steps grow with the number of nodes along an edge.
        let cost = |g: &CubicGrid| work(&g.shape).powf(4.0 / 3.0);
        let total: f64 = grids.iter().map(cost).sum();
        let (mut made, mut done) = (Vec::new(), 0.0);
        for grid in grids.into_iter().rev() {
            let share = |of: f64| (done + of * cost(&grid)) / total;
            let part = |from: f64, to: f64| Stage { whole: progress, from: share(from), to: share(to) };
            let space = PoreSpace::new(solids, &grid, &part(0.0, 0.1))?;
            if space.grid.walls.is_empty() && space.grid.porosity() > 0.0 {
                let message =
                    format!("no wall is as thick as a step of {} to the cell; take more nodes", grid.shape[0]);
                return Err(NoTensor::Degenerate(Fault::new("n", message)));
            }
            let porosity = space.grid.porosity();
            let radius = porosity * work(&grid.shape) * grid.step * grid.step / space.area.max(grid.step * grid.step);
            let viscosity = (radius / SOONEST).clamp(0.5, 4.0);
            let mut found = space.grid.permeability(viscosity, space.cyclic, STEADY, &part(0.1, 1.0))?;
            found.tensor = grid.to_world(&found.tensor);
            done += cost(&grid);
            made.push(Flow { area: space.area, porosity, found, grid });
        }
        made.reverse();
        Ok(made)
    }

    /// The conductivity of the pore and its share of the cell, each pore by itself.
    fn pore_conducts(&self, n: usize, solids: &[CsgSolid], progress: &dyn Progress) -> Result<(Mat3, f64), Stopped> {
        let (mut whole, mut porosity) = ([[0.0; 3]; 3], 0.0);
        let shapes = self.shapes(n);
        for (place, solid) in solids.iter().enumerate() {
            let share = |at: f64| (place as f64 + at) / solids.len() as f64;
            let mut grids = Vec::new();
            for (i, shape) in shapes.iter().enumerate() {
                let part = |from, to| Stage { whole: progress, from: share(from), to: share(to) };
                let from = i as f64 / shapes.len() as f64;
                let mut open = fractions(solid, &self.edges, *shape, &part(from, from + 0.1))?;
                open.iter_mut().for_each(|w| *w = 1.0 - *w);
                let cell = VoxelCell::new(*shape, transpose(&self.edges), open).map_err(Stopped::Refused)?;
                if i == 0 {
                    porosity += cell.fraction();
                }
                let next = (i + 1) as f64 / shapes.len() as f64;
                let k = match cell.endless_directions(0.5) {
                    0 => [[0.0; 3]; 3],
                    _ => cell.conductivity(0.0, TOLERANCE, &part(from + 0.1, next))?.tensor,
                };
                grids.push((*shape, k.iter().flatten().copied().collect()));
            }
            for (i, v) in limit(&grids).tensor.into_iter().enumerate() {
                whole[i / 3][i % 3] += v;
            }
        }
        let porosity = match self.fraction {
            Some(fraction) if solids.len() == 2 || !self.sheet => 1.0 - fraction,
            _ => porosity,
        };
        Ok((whole, porosity))
    }
}

/// A permeability with zeros where nothing flows.
fn clean(k: &Mat3) -> Mat3 {
    let largest = k.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    k.map(|row| row.map(|v| if v.abs() <= NOTHING * largest { 0.0 } else { v }))
}

fn symmetric(k: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (k[i][j] + k[j][i])))
}

fn grid(flow: &Flow) -> CellGrid {
    CellGrid {
        shape: flow.grid.shape,
        fraction: 1.0 - flow.porosity,
        tensor: flow.found.tensor.iter().map(|row| row.to_vec()).collect(),
    }
}
