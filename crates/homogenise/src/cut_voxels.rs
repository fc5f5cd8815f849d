//! Voxels of a scalar operator that have elements of their own.

use rayon::prelude::*;

use crate::interface::{Modal, largest_eigenvalue, nodal, sign};
use crate::lanes::{LANES, Real};

/// A voxel and its element.
#[derive(Clone)]
pub struct CutVoxel<T> {
    /// Its index.
    pub voxel: usize,
    /// Its quadratic form over its volume.
    pub form: Modal<T>,
}

/// The voxels of a grid that have elements of their own; the weights of the common element are zero there.
pub struct CutVoxels<T> {
    /// Ascending.
    voxels: Vec<CutVoxel<T>>,
    /// Of each run of eight voxels, the number of those before it; all of them at the end. Nothing if there are none.
    before: Vec<u32>,
}

impl<T: Real> CutVoxels<T> {
    /// Those of a grid, ascending.
    pub fn new(voxels: Vec<CutVoxel<T>>, [nx, ny, nz]: [usize; 3]) -> Self {
        let runs = nx.div_ceil(LANES);
        let mut before = Vec::new();
        if !voxels.is_empty() {
            before = vec![0; runs * ny * nz + 1];
            for cut in &voxels {
                before[cut.voxel / nx * runs + cut.voxel % nx / LANES + 1] += 1;
            }
            (1..before.len()).for_each(|i| before[i] += before[i - 1]);
        }
        CutVoxels { voxels, before }
    }

    /// None.
    pub fn none() -> Self {
        CutVoxels { voxels: Vec::new(), before: Vec::new() }
    }

    /// The same in single precision.
    pub fn single(&self) -> CutVoxels<f32> {
        let of = |c: &CutVoxel<T>| CutVoxel { voxel: c.voxel, form: c.form.map(|row| row.map(|v| v.wide() as f32)) };
        CutVoxels { voxels: self.voxels.iter().map(of).collect(), before: self.before.clone() }
    }

    /// Those in the runs from one to another.
    #[inline(always)]
    pub fn of_runs(&self, from: usize, to: usize) -> &[CutVoxel<T>] {
        if self.before.is_empty() {
            return &[];
        }
        &self.voxels[self.before[from] as usize..self.before[to] as usize]
    }

    /// All.
    pub fn iter(&self) -> impl Iterator<Item = &CutVoxel<T>> {
        self.voxels.iter()
    }

    /// An upper bound of the eigenvalues of D⁻¹A, with D the diagonal of A, of any of them; `known` at least.
    pub fn largest_eigenvalue(&self, known: f64) -> f64 {
        let of = |known, cut: &CutVoxel<T>| largest_eigenvalue(&cut.form.map(|row| row.map(Real::wide)), known);
        self.voxels.par_chunks(1 << 10).map(|cuts| cuts.iter().fold(known, of)).reduce(|| known, f64::max)
    }

    /// The sums over all of them of the forces of the linear modes, where a field has the gradient `own` in addition to its own.
    pub fn flux(&self, shape: [usize; 3], own: &[f64; 9], u: &[T]) -> [f64; 3] {
        let each = self.planes(shape).map(|cuts| {
            let mut sum = [0.0; 3];
            for cut in cuts {
                let at = corners(shape, cut.voxel);
                let mut modes = uniform(own);
                for i in 1..8 {
                    modes[i] += (0..8).map(|p| sign(i, p) * u[at[p]].wide()).sum::<f64>();
                }
                let forces = forces(&cut.form, &modes);
                (0..3).for_each(|a| sum[a] += forces[1 << a]);
            }
            sum
        });
        let each: Vec<[f64; 3]> = each.collect();
        each.into_iter().fold([0.0; 3], |s, v| [0, 1, 2].map(|a| s[a] + v[a]))
    }

    /// Adds their forces in a field with the gradient `own` to the nodes of a plane.
    pub fn add_uniform(&self, shape: [usize; 3], z: usize, own: &[f64; 9], out: &mut [T]) {
        let modes = uniform(own);
        self.add(shape, z, out, &|form| {
            let forces = forces(form, &modes);
            std::array::from_fn(|p| (1..8).map(|i| sign(i, p) * forces[i]).sum())
        });
    }

    /// Adds their entries of the diagonal to the nodes of a plane.
    pub fn add_diagonal(&self, shape: [usize; 3], z: usize, out: &mut [f64]) {
        self.add(shape, z, out, &|form| {
            let nodal = nodal(&form.map(|row| row.map(Real::wide)));
            std::array::from_fn(|p| nodal[p][p])
        });
    }

    /// Adds something of each to those of its corners that are in a plane.
    fn add<U: Real>(&self, shape: [usize; 3], z: usize, out: &mut [U], of: &impl Fn(&Modal<T>) -> [f64; 8]) {
        let plane = shape[0] * shape[1];
        let runs = shape[0].div_ceil(LANES) * shape[1];
        for (z, upper) in [((z + shape[2] - 1) % shape[2], true), (z, false)] {
            for cut in self.of_runs(z * runs, (z + 1) * runs) {
                let (at, each) = (corners(shape, cut.voxel), of(&cut.form));
                for p in (0..8).filter(|p| (p >> 2 == 1) == upper) {
                    out[at[p] % plane] += U::of(each[p]);
                }
            }
        }
    }

    /// Those of each plane.
    fn planes(&self, [nx, ny, nz]: [usize; 3]) -> impl IndexedParallelIterator<Item = &[CutVoxel<T>]> {
        let runs = nx.div_ceil(LANES) * ny;
        (0..nz).into_par_iter().map(move |z| self.of_runs(z * runs, (z + 1) * runs))
    }
}

/// The nodes at the corners of a voxel, x fastest.
fn corners([nx, ny, nz]: [usize; 3], voxel: usize) -> [usize; 8] {
    let [x, y, z] = [voxel % nx, voxel / nx % ny, voxel / nx / ny];
    std::array::from_fn(|p| {
        let [x, y, z] = [(x + (p & 1)) % nx, (y + (p >> 1 & 1)) % ny, (z + (p >> 2)) % nz];
        (z * ny + y) * nx + x
    })
}

/// The modes of a field with a uniform gradient.
fn uniform(own: &[f64; 9]) -> [f64; 8] {
    let mut modes = [0.0; 8];
    (0..3).for_each(|a| modes[1 << a] = own[a]);
    modes
}

fn forces<T: Real>(form: &Modal<T>, modes: &[f64; 8]) -> [f64; 8] {
    std::array::from_fn(|i| (1..8).map(|j| form[i][j].wide() * modes[j]).sum())
}
