//! Effective figures of a periodic cell: its voxels, three grids of them, and what they tend to; flow through its pore.

mod fractions;
mod limit;
mod permeability;
mod pore_space;

use geometry::fault::Fault;
use geometry::math::{Aabb, Mat3, Vec3, determinant, norm, transpose};
use geometry::progress::{Progress, Stage, Stopped};
use homogenise::{Homogenised, Material, Moduli, Voigt, VoxelCell, bounds, conductivity_bounds};
use rayon::prelude::*;

use crate::csg_tree::CsgSolid;
use crate::field::Field;
use crate::kind::Warning;
use crate::report::{CellGrid, ConductivityReport, StiffnessReport};
use fractions::{fractions, interfaces};
use limit::{Limit, modal_limit};
pub use permeability::SheetSide;

/// A periodic cell.
pub struct UnitCell {
    /// Its path in the design.
    pub path: String,
    /// The solid in coordinates of the cell, 0 to 1 along each edge.
    pub solid: CsgSolid,
    /// Whether it is a sheet: its first surface is towards the upper side, its second towards the lower one.
    pub sheet: bool,
    /// The edges, mm, one row each.
    pub edges: Mat3,
    /// The solid fraction, if it is known beforehand.
    pub fraction: Option<f64>,
    /// The intervals of fraction in which the solid is one piece in space, if they are known.
    pub connected: Option<Vec<[f64; 2]>>,
    /// The thinnest wall or neck, mm.
    pub wall: Option<f64>,
    /// What finds the diameter (mm) of the largest ball that passes in all directions through the pore, or through that on one side of a
    /// sheet; 0 if none does. Only where it is known.
    pub pore: Option<Box<Passing>>,
}

/// The diameter (mm) of a ball that passes through the pore on a side, or on any.
pub type Passing = dyn Fn(Option<SheetSide>) -> f64 + Send + Sync;

/// How the voxels of a cell are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Voxels along the edge of a cube of the cell's volume.
    pub n: usize,
    /// Whether a voxel is solid if its centre is, without fractions.
    pub plain: bool,
}

/// Least number of voxels along an edge.
const LEAST: usize = 8;
/// Relative residual to which systems are solved.
const TOLERANCE: f64 = 1e-8;
/// Voxels across a wall below which the figures are to be doubted.
const ACROSS: f64 = 3.0;

/// Voxels along an edge beyond which none are recommended.
const MOST: f64 = 10_000.0;

/// Why a cell has no such tensor.
#[derive(Debug)]
pub enum NoTensor {
    /// It is in pieces and carries nothing, or its voxels hold no flow: the tensor is at its limit.
    Degenerate(Fault),
    /// It was not found.
    Stopped(Stopped),
}

impl From<Stopped> for NoTensor {
    fn from(why: Stopped) -> NoTensor {
        NoTensor::Stopped(why)
    }
}

impl From<NoTensor> for Stopped {
    fn from(why: NoTensor) -> Stopped {
        match why {
            NoTensor::Degenerate(fault) => Stopped::Refused(fault),
            NoTensor::Stopped(why) => why,
        }
    }
}

/// A tensor of a cell of voxels.
type Solve<'a, T> = dyn Fn(&VoxelCell, &dyn Progress) -> Result<Homogenised<T>, NoTensor> + 'a;

impl UnitCell {
    /// The shapes of the grids: n, and a half and a quarter of it where that is enough.
    fn shapes(&self, n: usize) -> Vec<[usize; 3]> {
        let lengths = self.edges.map(norm);
        let mean = lengths.iter().product::<f64>().cbrt();
        let equal = lengths.iter().all(|l| (l / mean - 1.0).abs() < 1e-9);
        let first = match equal {
            true => [n; 3],
            // Multiples of four, so that the coarser grids have the same proportions.
            false => lengths.map(|l| 4 * ((n as f64 * l / mean / 4.0).round() as usize).max(2)),
        };
        let coarser = [2, 4].map(|by| first.map(|m| m.div_ceil(by)));
        let mut all = vec![first];
        all.extend(coarser.into_iter().filter(|s| s.iter().all(|m| *m >= 4)));
        all
    }

    /// The voxels of a grid.
    fn voxels(&self, shape: [usize; 3], plain: bool, progress: &dyn Progress) -> Result<VoxelCell, Stopped> {
        let fractions = match plain {
            true => self.centres(shape, progress)?,
            false => fractions(&self.solid, &self.edges, shape, progress)?,
        };
        VoxelCell::new(shape, transpose(&self.edges), fractions).map_err(Stopped::Refused)
    }

    /// One where the centre of a voxel is solid.
    fn centres(&self, shape: [usize; 3], progress: &dyn Progress) -> Result<Vec<f64>, Stopped> {
        let [nx, ny, nz] = shape;
        let mut out = vec![0.0; nx * ny * nz];
        out.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
            let points: Vec<Vec3> = (0..nx).map(|x| [at(x, nx), at(row % ny, ny), at(row / ny, nz)]).collect();
            self.solid.values(&points, out);
            out.iter_mut().for_each(|v| *v = f64::from(u8::from(*v <= 0.0)));
        });
        if progress.step(1, 1) { Ok(out) } else { Err(Stopped::Interrupted) }
    }

    /// Refuses numbers of voxels that are too few.
    fn check(&self, n: usize) -> Result<(), Stopped> {
        if n < LEAST {
            let message = format!("n is {n}; at least {LEAST} voxels along an edge are needed");
            return Err(Stopped::Refused(Fault::new("n", message)));
        }
        Ok(())
    }

    /// Whether the solid is known to be in pieces, and the fractions at which it is not.
    fn apart(&self) -> Option<String> {
        let (fraction, connected) = (self.fraction?, self.connected.as_ref()?);
        if connected.iter().any(|[a, b]| fraction >= a - 1e-9 && fraction <= b + 1e-9) {
            return None;
        }
        let listed: Vec<String> = connected.iter().map(|[a, b]| format!("from {a:.4} to {b:.4}")).collect();
        Some(match listed.is_empty() {
            true => "; it holds together at no fraction".into(),
            false => format!("; it is one piece {}", listed.join(" and ")),
        })
    }

    /// Voxels across the thinnest wall, and a warning if these are few.
    fn across(&self, shape: [usize; 3], n: usize, warnings: &mut Vec<Warning>) -> Option<f64> {
        let edges = [0, 1, 2].map(|a| norm(self.edges[a]) / shape[a] as f64);
        let across = self.wall? / edges.into_iter().fold(0.0, f64::max);
        // A neck of a cell that is apart is said to be none by what says so.
        if across < ACROSS && (across > 0.0 || self.apart().is_none()) {
            let message = match enough(n, ACROSS / across) {
                Some(need) => format!(
                    "the thinnest wall is {across:.1} voxels across; below {ACROSS} the figures may be off by more than the error says: \
                     take n = {need}"
                ),
                None => "the thinnest wall or neck is of no thickness, which no number of voxels resolves: the figures are of a cell whose \
                         members may touch; take a greater fraction"
                    .into(),
            };
            warnings.push(Warning { path: self.path.clone(), message });
        }
        Some(across)
    }

    /// The tensor on each grid, the finest first.
    fn on_grids<T: Copy>(
        &self,
        resolution: Resolution,
        progress: &dyn Progress,
        solve: &Solve<T>,
    ) -> Result<Vec<(VoxelCell, Homogenised<T>)>, NoTensor> {
        let shapes = self.shapes(resolution.n);
        let total: f64 = shapes.iter().map(work).sum();
        let (mut made, mut done) = (Vec::new(), 0.0);
        // The coarse ones first: a cell that cannot be solved is found out soon.
        for shape in shapes.iter().rev() {
            let share = |of: f64| (done + of * work(shape)) / total;
            let sampling = Stage { whole: progress, from: share(0.0), to: share(0.15) };
            let voxels = self.voxels(*shape, resolution.plain, &sampling)?;
            let solving = Stage { whole: progress, from: share(0.15), to: share(1.0) };
            match solve(&voxels, &solving) {
                Ok(found) => made.push((voxels, found)),
                // What falls apart on the fewest voxels may hold together on more, and two grids do.
                Err(NoTensor::Degenerate(_)) if shapes.get(2) == Some(shape) => {}
                Err(why) => return Err(why),
            }
            done += work(shape);
        }
        made.reverse();
        Ok(made)
    }

    /// The effective stiffness.
    ///
    /// # Errors
    /// A solid that is not connected; too few voxels; an interruption.
    pub fn stiffness(
        &self,
        material: &Material,
        resolution: Resolution,
        progress: &dyn Progress,
    ) -> Result<StiffnessReport, NoTensor> {
        self.check(resolution.n)?;
        let apart = |why: &str| {
            let message = format!(
                "at a solid fraction of {:.4} the cell falls apart and carries no load{why}",
                self.fraction.unwrap_or_default()
            );
            NoTensor::Degenerate(Fault::new(format!("{}.level", self.path), message))
        };
        if let Some(why) = self.apart() {
            return Err(apart(&why));
        }
        let made = self.on_grids(resolution, progress, &|voxels, progress| {
            if voxels.endless_directions(0.0) == 0 {
                let message = "the solid is in pieces that do not touch, and carries no load; take thicker beams or a greater fraction";
                return Err(NoTensor::Degenerate(Fault::new(&self.path, message)));
            }
            Ok(voxels.stiffness(material, TOLERANCE, progress)?)
        })?;
        let grids: Vec<([usize; 3], Vec<f64>)> =
            made.iter().map(|(v, m)| (v.shape, orthonormal(&m.tensor).into_iter().flatten().collect())).collect();
        let limited = modal_limit(&grids);
        let mut warnings: Vec<Warning> = limited.doubt(&self.path, resolution.n).into_iter().collect();
        let moduli_errors: [f64; 6] = std::array::from_fn(|i| limited.error_of_inverse(&axis::<6>(i)));
        let Limit { tensor, error, order, .. } = limited;
        let c: Voigt = std::array::from_fn(|i| std::array::from_fn(|j| tensor[6 * i + j] / (mandel(i) * mandel(j))));
        let (finest, found) = &made[0];
        let fraction = self.fraction.unwrap_or_else(|| finest.fraction());
        let wall_voxels = self.across(finest.shape, resolution.n, &mut warnings);
        let moduli = Moduli::of(&c);
        if moduli.is_none() {
            let message = "the cell resists some strain not at all: no moduli";
            warnings.push(Warning { path: self.path.clone(), message: message.into() });
        }
        let limits = material.isotropic.map(|[k, g]| bounds(k, g, fraction));
        Ok(StiffnessReport {
            C: c,
            C_n: found.tensor,
            n: resolution.n,
            error,
            order,
            residual: made.iter().map(|m| m.1.residual).fold(0.0, f64::max),
            iterations: found.iterations,
            E: moduli.map(|m| m.young),
            E_error: moduli.map(|_| [0, 1, 2].map(|i| moduli_errors[i])),
            G: moduli.map(|m| m.shear),
            G_error: moduli.map(|_| [3, 4, 5].map(|i| moduli_errors[i])),
            nu: moduli.map(|m| m.poisson),
            zener: moduli.map(|m| m.zener),
            anisotropy: moduli.map(|m| m.universal),
            bulk: moduli.map(|m| m.bulk),
            bulk_bounds: limits.map(|[k, _]| [0.0, k]),
            shear: moduli.map(|m| m.hill_shear),
            shear_bounds: limits.map(|[_, g]| [0.0, g]),
            fraction,
            edges: self.edges,
            wall_voxels,
            grids: made.iter().map(|(v, m)| grid(v, &m.tensor)).collect(),
            warnings,
        })
    }

    /// The effective conductivity, where the pore conducts `pore` times as well as the solid.
    ///
    /// # Errors
    /// A ratio that is negative or not finite; too few voxels; an interruption.
    pub fn conductivity(
        &self,
        pore: f64,
        resolution: Resolution,
        progress: &dyn Progress,
    ) -> Result<ConductivityReport, Stopped> {
        self.check(resolution.n)?;
        if !(pore >= 0.0 && pore.is_finite()) {
            let message = format!(
                "pore is {pore}; the pore's conductivity relative to the solid's is a finite number of at least 0"
            );
            return Err(Stopped::Refused(Fault::new("pore", message)));
        }
        let known = self.apart().filter(|_| pore == 0.0);
        let made = self.on_grids(resolution, progress, &|voxels, progress| {
            let least = if known.is_some() { 0.5 } else { 0.0 };
            if pore == 0.0 && voxels.endless_directions(least) == 0 {
                return Ok(Homogenised { tensor: [[0.0; 3]; 3], residual: 0.0, iterations: 0, cases: 0 });
            }
            if pore == 0.0 || resolution.plain {
                return Ok(voxels.conductivity(pore, TOLERANCE, progress)?);
            }
            let found = interfaces(&self.solid, &self.edges, voxels.shape, &voxels.fractions);
            let cut = voxels.clone().with_interfaces(found).map_err(Stopped::Refused)?;
            Ok(cut.conductivity(pore, TOLERANCE, progress)?)
        })?;
        let grids: Vec<([usize; 3], Vec<f64>)> =
            made.iter().map(|(v, m)| (v.shape, m.tensor.iter().flatten().copied().collect())).collect();
        let limited = modal_limit(&grids);
        let mut warnings: Vec<Warning> = limited.doubt(&self.path, resolution.n).into_iter().collect();
        let axis_errors = std::array::from_fn(|i| limited.error_along(&axis::<3>(i)));
        let Limit { tensor, error, order, .. } = limited;
        let (finest, found) = &made[0];
        if pore == 0.0 && (known.is_some() || tensor.iter().all(|v| *v == 0.0)) {
            let message = format!(
                "the solid is not one piece in space, and conducts nothing in directions in which none goes through{}",
                known.unwrap_or_default()
            );
            warnings.push(Warning { path: self.path.clone(), message });
        }
        let fraction = self.fraction.unwrap_or_else(|| finest.fraction());
        Ok(ConductivityReport {
            k: std::array::from_fn(|i| std::array::from_fn(|j| tensor[3 * i + j])),
            k_n: found.tensor,
            n: resolution.n,
            error,
            axis_errors,
            order,
            residual: made.iter().map(|m| m.1.residual).fold(0.0, f64::max),
            iterations: found.iterations,
            bounds: conductivity_bounds(fraction, pore),
            pore,
            fraction,
            edges: self.edges,
            wall_voxels: self.across(finest.shape, resolution.n, &mut warnings),
            grids: made.iter().map(|(v, m)| grid(v, &m.tensor)).collect(),
            warnings,
        })
    }

    /// The volume of the cell, mm³.
    pub fn volume(&self) -> f64 {
        determinant(&self.edges).abs()
    }

    /// The bounds of the cell about its own corner, mm.
    pub fn bounds(&self) -> Aabb {
        let corner =
            |i: usize| (0..3).filter(|a| i >> a & 1 == 1).fold([0.0; 3], |p, a| geometry::math::add(p, self.edges[a]));
        (0..8).fold(Aabb::EMPTY, |b, i| b.with(corner(i)))
    }
}

/// A unit vector.
fn axis<const N: usize>(i: usize) -> [f64; N] {
    std::array::from_fn(|j| f64::from(u8::from(i == j)))
}

/// Factor of an index of Voigt's order that makes an orthonormal basis of it (Mandel's).
fn mandel(i: usize) -> f64 {
    if i < 3 { 1.0 } else { std::f64::consts::SQRT_2 }
}

/// A stiffness in Mandel's basis, where eigenvectors are those of the tensor.
fn orthonormal(c: &Voigt) -> Voigt {
    std::array::from_fn(|i| std::array::from_fn(|j| c[i][j] * mandel(i) * mandel(j)))
}

/// The multiple of eight from `n` times `more` on; `None` beyond what any machine holds.
fn enough(n: usize, more: f64) -> Option<usize> {
    let need = 8.0 * (n as f64 * more / 8.0).ceil();
    (need <= MOST).then_some(need as usize)
}

fn work(shape: &[usize; 3]) -> f64 {
    shape.iter().product::<usize>() as f64
}

fn grid<const N: usize>(voxels: &VoxelCell, tensor: &[[f64; N]; N]) -> CellGrid {
    CellGrid {
        shape: voxels.shape,
        fraction: voxels.fraction(),
        tensor: tensor.iter().map(|row| row.to_vec()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::enough;

    #[test]
    fn advice_on_voxels_is_a_number_that_exists() {
        assert_eq!(enough(32, 3.0), Some(96));
        assert_eq!((enough(32, f64::INFINITY), enough(32, 1e5), enough(32, f64::NAN)), (None, None, None));
    }
}
