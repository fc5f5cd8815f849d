//! A periodic cell of voxels, and its effective tensors.

use geometry::fault::Fault;
use geometry::math::{Mat3, Vec3, determinant, dot, norm, product, scale, sub, transpose, unit};
use geometry::progress::{Progress, Stage, Stopped};
use rayon::prelude::*;

use crate::cut_voxels::{CutVoxel, CutVoxels};
use crate::element::Element;
use crate::interface::{Interface, cut_element};
use crate::material::{AXES, Material, Voigt, scalar_law, turned};
use crate::solve::System;

/// A periodic cell: a parallelepiped of voxels, each with the share of it that is solid.
#[derive(Clone, Debug)]
pub struct VoxelCell {
    /// Voxels along each edge.
    pub shape: [usize; 3],
    /// The edges of the cell, mm, as columns.
    pub edges: Mat3,
    /// Solid fraction of each voxel, that along the first edge fastest.
    pub fractions: Vec<f64>,
    /// Interfaces through voxels, ascending; where none is known a voxel conducts as the mean of its phases.
    pub interfaces: Vec<Interface>,
}

/// An effective tensor and how it was found.
#[derive(Clone, Copy, Debug)]
pub struct Homogenised<T> {
    /// In world axes.
    pub tensor: T,
    /// Greatest relative residual of the load cases.
    pub residual: f64,
    /// Most iterations of a load case.
    pub iterations: usize,
    /// Load cases that were solved: fewer where the cell is the same along all its edges.
    pub cases: usize,
}

/// The second and third columns of a tensor that a cyclic change of the axes leaves as it is, from the first.
pub(crate) fn fill_cyclic(tensor: &mut Mat3) {
    for from in [0, 1] {
        for i in 0..3 {
            tensor[(i + 1) % 3][from + 1] = tensor[i][from];
        }
    }
}

/// Weights that differ by no more are the same: what rounding leaves of a symmetry.
const SAME: f64 = 1e-7;

impl VoxelCell {
    /// A cell that has been checked.
    ///
    /// # Errors
    /// Numbers that do not fit together, fractions outside 0 to 1, edges that span no volume.
    pub fn new(shape: [usize; 3], edges: Mat3, fractions: Vec<f64>) -> Result<VoxelCell, Fault> {
        let count: usize = shape.iter().product();
        if count == 0 || count != fractions.len() {
            let message = format!("{} numbers for {shape:?} voxels; give one for each", fractions.len());
            return Err(Fault::new("fractions", message));
        }
        if let Some(v) = fractions.iter().find(|v| !(0.0..=1.0).contains(*v)) {
            return Err(Fault::new("fractions", format!("{v}; a solid fraction lies between 0 and 1")));
        }
        let size = determinant(&edges).abs();
        if size.is_nan() || size <= 1e-9 * columns(&edges).map(norm).iter().product::<f64>() {
            return Err(Fault::new("edges", "the edges of the cell span no volume; give three independent ones"));
        }
        Ok(VoxelCell { shape, edges, fractions, interfaces: Vec::new() })
    }

    /// The same cell with interfaces through its voxels.
    ///
    /// # Errors
    /// Voxels that there are none of, or that do not ascend.
    pub fn with_interfaces(self, interfaces: Vec<Interface>) -> Result<VoxelCell, Fault> {
        let ascend = interfaces.windows(2).all(|w| w[0].voxel < w[1].voxel);
        if !ascend || interfaces.last().is_some_and(|i| i.voxel >= self.fractions.len()) {
            return Err(Fault::new("interfaces", "give at most one for each voxel, in the order of the voxels"));
        }
        Ok(VoxelCell { interfaces, ..self })
    }

    /// Mean of the fractions.
    pub fn fraction(&self) -> f64 {
        let rows = self.fractions.chunks(self.shape[0]).map(|row| row.iter().sum::<f64>());
        rows.sum::<f64>() / self.fractions.len() as f64
    }

    /// Whether a cyclic change of the edges changes nothing.
    fn is_cyclic(&self) -> bool {
        let [n, b, c] = self.shape;
        let at = |x: usize, y: usize, z: usize| self.fractions[(z * n + y) * n + x];
        n == b && n == c && (0..n).all(|z| (0..n).all(|y| (0..n).all(|x| (at(x, y, z) - at(y, z, x)).abs() <= SAME)))
    }

    /// Whether a cyclic change of the edges changes nothing in the interfaces of a cell whose fractions it does not change.
    fn has_cyclic_interfaces(&self) -> bool {
        let n = self.shape[0];
        self.interfaces.iter().all(|a| {
            let [x, y, z] = [a.voxel % n, a.voxel / n % n, a.voxel / n / n];
            let Ok(other) = self.interfaces.binary_search_by_key(&((x * n + z) * n + y), |b| b.voxel) else {
                return false;
            };
            let b = &self.interfaces[other];
            let [p, q] = [[a.slope[1], a.slope[2], a.slope[0]], b.slope].map(unit);
            a.alone == b.alone && (0..3).all(|i| (p[i] - q[i]).abs() <= SAME)
        })
    }

    /// The voxels that an interface cuts, where the pore conducts. Where it does not, a voxel conducts by its share alone: there is nothing to
    /// be conducted across, and the nodes in the pore are to be held by something.
    fn cut_voxels(&self, element: &Element, pore: f64) -> CutVoxels<f64> {
        if pore == 0.0 {
            return CutVoxels::none();
        }
        let of = |i: &Interface| {
            let form = cut_element(element, self.fractions[i.voxel], i, pore)?;
            Some(CutVoxel { voxel: i.voxel, form })
        };
        CutVoxels::new(self.interfaces.par_iter().filter_map(of).collect(), self.shape)
    }

    /// Axes in which the first edge is along x and the second in the plane of x and y, as columns; and the edges of a voxel there.
    fn frame(&self) -> (Mat3, Mat3) {
        let (frame, mut voxel) = upper_edges(&self.edges);
        for row in &mut voxel {
            for (v, n) in row.iter_mut().zip(self.shape) {
                *v /= n as f64;
            }
        }
        (frame, voxel)
    }

    /// The effective stiffness of the cell, void where it is not solid.
    ///
    /// # Errors
    /// A system that is not solved to `tolerance`; an interruption.
    pub fn stiffness(
        &self,
        material: &Material,
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Homogenised<Voigt>, Stopped> {
        let (frame, voxel) = self.frame();
        let seen = material.seen_from(&frame);
        let element = Element::new(&seen.law(), 3, &voxel);
        let cyclic = material.isotropic.is_some() && is_cube(&voxel) && self.is_cyclic();
        // Gradient by ξ (times eight) of a unit strain, and the strain's entries as gradients.
        let modes = |case: usize| {
            let [i, j] = AXES[case];
            let mut strain = [[0.0; 3]; 3];
            strain[i][j] += 0.5;
            strain[j][i] += 0.5;
            gradient_modes(&product(&strain, &voxel))
        };
        let cases: &[usize] = if cyclic { &[0, 3] } else { &[0, 1, 2, 3, 4, 5] };
        let system = System::new(self.shape, &self.fractions, &element, CutVoxels::none());
        let made = self.solve::<3>(system, &element, cases, &modes, tolerance, progress)?;
        let mut c = [[0.0; 6]; 6];
        for (case, column) in cases.iter().zip(&made.tensor) {
            for i in 0..6 {
                c[i][*case] = column[i];
            }
        }
        if cyclic {
            const NEXT: [usize; 6] = [1, 2, 0, 4, 5, 3];
            for from in [0, 1, 3, 4] {
                for i in 0..6 {
                    c[NEXT[i]][NEXT[from]] = c[i][from];
                }
            }
        }
        let c = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (c[i][j] + c[j][i])));
        Ok(Homogenised {
            tensor: turned(&c, &frame),
            residual: made.residual,
            iterations: made.iterations,
            cases: cases.len(),
        })
    }

    /// The effective conductivity of the cell, where the solid conducts 1 and the pore `pore`.
    ///
    /// # Errors
    /// A system that is not solved to `tolerance`; an interruption.
    pub fn conductivity(
        &self,
        pore: f64,
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Homogenised<Mat3>, Stopped> {
        let (frame, voxel) = self.frame();
        let weights: Vec<f64> = self.fractions.iter().map(|w| w + (1.0 - w) * pore).collect();
        let element = Element::new(&scalar_law(1.0), 1, &voxel);
        let cut = self.cut_voxels(&element, pore);
        let cyclic = is_cube(&voxel) && self.is_cyclic() && (pore == 0.0 || self.has_cyclic_interfaces());
        let modes = |case: usize| {
            let mut row = [[0.0; 3]; 3];
            row[0] = voxel[case];
            gradient_modes(&row)
        };
        let cases: &[usize] = if cyclic { &[0] } else { &[0, 1, 2] };
        let system = System::new(self.shape, &weights, &element, cut);
        let made = self.solve::<1>(system, &element, cases, &modes, tolerance, progress)?;
        let mut k = [[0.0; 3]; 3];
        for (case, column) in cases.iter().zip(&made.tensor) {
            for i in 0..3 {
                k[i][*case] = column[i];
            }
        }
        if cyclic {
            fill_cyclic(&mut k);
        }
        let k: Mat3 = std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (k[i][j] + k[j][i])));
        let k = product(&product(&frame, &k), &transpose(&frame));
        Ok(Homogenised { tensor: k, residual: made.residual, iterations: made.iterations, cases: cases.len() })
    }

    /// The column of the effective tensor of each load case: energies of its field with the uniform field of each case.
    fn solve<const NC: usize>(
        &self,
        mut system: System<NC>,
        element: &Element,
        cases: &[usize],
        modes: &dyn Fn(usize) -> [f64; 9],
        tolerance: f64,
        progress: &dyn Progress,
    ) -> Result<Homogenised<Vec<[f64; 6]>>, Stopped> {
        let mut field = vec![0.0; system.operator.len()];
        let rows = system.operator.weights.chunks(self.shape[0]).map(|row| row.iter().sum::<f64>());
        let total = rows.sum::<f64>();
        let count = self.fractions.len() as f64;
        let mut made = Homogenised { tensor: Vec::new(), residual: 0.0, iterations: 0, cases: cases.len() };
        for (n, &case) in cases.iter().enumerate() {
            let share = |n: usize| n as f64 / cases.len() as f64;
            let stage = Stage { whole: progress, from: share(n), to: share(n + 1) };
            let own = modes(case);
            let solved = system.solve(&own, &mut field, tolerance, &stage)?;
            let mean = system.operator.mean_gradient(&field);
            let whole: [f64; 9] = std::array::from_fn(|i| mean[i] + total * own[i]);
            let cut = if NC == 1 { system.operator.cut_flux(&own, &field) } else { [0.0; 3] };
            let column = std::array::from_fn(|other| {
                if other >= 3 && NC == 1 {
                    return 0.0;
                }
                let test = modes(other);
                let pairs = (0..3 * NC).flat_map(|i| (0..3 * NC).map(move |j| (i, j)));
                let common: f64 = pairs.map(|(i, j)| test[i] * element.linear[i][j] * whole[j]).sum();
                (common + (0..3).map(|a| test[a] * cut[a]).sum::<f64>()) / count
            });
            made.tensor.push(column);
            made.residual = made.residual.max(solved.residual);
            made.iterations = made.iterations.max(solved.iterations);
        }
        Ok(made)
    }
}

/// Axes in which the first of three edges is along x and the second in the plane of x and y, as columns; and the edges there, which are
/// an upper triangular matrix.
pub fn upper_edges(edges: &Mat3) -> (Mat3, Mat3) {
    let [a, b, c] = columns(edges);
    let x = unit(a);
    let y = unit(sub(b, scale(x, dot(b, x))));
    let across = sub(c, scale(x, dot(c, x)));
    let z = unit(sub(across, scale(y, dot(across, y))));
    let axes = transpose(&[x, y, z]);
    let upper = product(&transpose(&axes), edges);
    // Edges at right angles are so to the last digit.
    let size = columns(&upper).map(norm).into_iter().fold(0.0, f64::max);
    (axes, upper.map(|row| row.map(|v| if v.abs() < 1e-14 * size { 0.0 } else { v })))
}

/// The columns of a matrix.
fn columns(m: &Mat3) -> [Vec3; 3] {
    transpose(m)
}

/// Whether a voxel is a cube along the axes.
fn is_cube(voxel: &Mat3) -> bool {
    let edge = voxel[0][0];
    (0..9).all(|i| (voxel[i / 3][i % 3] - if i % 4 == 0 { edge } else { 0.0 }).abs() <= 1e-12 * edge)
}

/// Sums and differences at the corners of a voxel of the field x ↦ G x, given G times the voxel's edges: eight times half of it.
fn gradient_modes(along_edges: &Mat3) -> [f64; 9] {
    std::array::from_fn(|i| 4.0 * along_edges[i / 3][i % 3])
}
