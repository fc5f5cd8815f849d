//! The stiffness of a periodic grid of weighted voxels, applied without being stored.
//!
//! Node (x, y, z) is the lower corner of voxel (x, y, z). A field of NC components is stored by planes of z; in a plane the
//! components follow each other, each with x running fastest. Voxels are taken eight at a time along x: values at their corners become
//! modes (`element.rs`), modes become forces, forces are added to the corners. Runs of eight without any solid are left out.
//!
//! A sweep goes through the planes of voxels in their order, and what is done with the product of a plane of nodes is done while it is in the
//! cache. Threads take runs of planes; the plane of voxels below a run is done twice. Each plane of nodes gets its contributions in a fixed
//! order, so the bits do not depend on the number of threads.

use rayon::prelude::*;

use crate::cut_voxels::CutVoxels;
use crate::element::Element;
use crate::fields::SMALL;
use crate::lanes::{LANES, Real};
use crate::slab::{Blocks, Rows, Slab, slab};

/// A grid of weighted voxels of one element.
pub struct Operator<T, const NC: usize> {
    /// Voxels along each axis.
    pub shape: [usize; 3],
    /// Weight of each voxel, x fastest.
    pub weights: Vec<T>,
    /// Whether a run of eight voxels has any weight.
    active: Vec<bool>,
    blocks: Blocks<T>,
    orthotropic: bool,
    /// Voxels of weight zero with elements of their own; of a scalar alone.
    cut: CutVoxels<T>,
}

impl<T: Real, const NC: usize> Operator<T, NC> {
    /// The operator of these weights, but for voxels with elements of their own.
    pub fn new(shape: [usize; 3], mut weights: Vec<T>, element: &Element, cut: CutVoxels<T>) -> Self {
        let nine = |m: &[[f64; 9]; 9]| m.map(|row| row.map(T::of));
        let active = weights.chunks(shape[0]).flat_map(|row| row.chunks(LANES));
        let active = active.map(|run| run.iter().any(|w| *w != T::default())).collect();
        cut.iter().for_each(|cut| weights[cut.voxel] = T::default());
        Operator {
            shape,
            active,
            cut,
            weights,
            blocks: Blocks {
                linear: nine(&element.linear),
                bilinear: nine(&element.bilinear),
                trilinear: element.trilinear.map(|row| row.map(T::of)),
            },
            orthotropic: element.orthotropic,
        }
    }

    /// Numbers in a plane of nodes.
    pub fn plane(&self) -> usize {
        NC * self.shape[0] * self.shape[1]
    }

    /// Numbers in a field.
    pub fn len(&self) -> usize {
        self.plane() * self.shape[2]
    }

    /// The products A `u`, plane by plane: `finish` is given each and the state of its plane.
    pub fn sweep<U: Real, S: Send>(&self, u: &[U], states: &mut [S], finish: &(impl Fn(&[T], &mut S) + Sync)) {
        let (plane, nz) = (self.plane(), self.shape[2]);
        let part = |first: usize, states: &mut [S]| {
            let (mut lower, mut upper) = (vec![T::default(); plane], vec![T::default(); plane]);
            let mut rows = Rows::new(self.shape[0], NC);
            // What this plane of voxels adds below is the part's before.
            self.slab((first + nz - 1) % nz, u, [&mut upper, &mut lower], &mut rows);
            for (i, state) in states.iter_mut().enumerate() {
                upper.fill(T::default());
                self.slab(first + i, u, [&mut lower, &mut upper], &mut rows);
                finish(&lower, state);
                std::mem::swap(&mut lower, &mut upper);
            }
        };
        if plane * nz <= SMALL {
            return part(0, states);
        }
        let planes = nz.div_ceil(2 * rayon::current_num_threads()).clamp(4, 16);
        states.par_chunks_mut(planes).enumerate().for_each(|(i, states)| part(i * planes, states));
    }

    /// Adds the forces of one plane of voxels to the planes of nodes below and above.
    fn slab<U: Real>(&self, z: usize, u: &[U], out: [&mut [T]; 2], rows: &mut Rows<T>) {
        let [nx, ny, nz] = self.shape;
        let (runs, plane) = (nx.div_ceil(LANES), self.plane());
        let u = [z, (z + 1) % nz].map(|z| &u[z * plane..(z + 1) * plane]);
        let of = Slab {
            shape: [nx, ny],
            weights: &self.weights[z * nx * ny..(z + 1) * nx * ny],
            active: &self.active[z * runs * ny..(z + 1) * runs * ny],
            blocks: &self.blocks,
            cut: &self.cut,
            first: z * runs * ny,
        };
        if self.orthotropic {
            slab::<U, T, NC, true>(&of, u, out, rows);
        } else {
            slab::<U, T, NC, false>(&of, u, out, rows);
        }
    }

    /// The largest entry of the element's linear block.
    pub fn stiffest(&self) -> f64 {
        self.blocks.linear.iter().flatten().fold(0.0f64, |m, v| m.max(v.wide().abs()))
    }

    /// The weighted sums Σ w ∂u/∂ξ over all voxels, times eight: entry `c * 3 + a`.
    pub fn mean_gradient(&self, u: &[T]) -> [f64; 9] {
        let [nx, ny, nz] = self.shape;
        let plane = nx * ny;
        let each: Vec<[f64; 9]> = (0..nz)
            .into_par_iter()
            .map(|z| {
                let mut sum = [0.0; 9];
                let below = (z + nz - 1) % nz;
                for y in 0..ny {
                    let before = (y + ny - 1) % ny;
                    for x in 0..nx {
                        let left = (x + nx - 1) % nx;
                        let w = |i: usize| {
                            let (x, y, z) = ([left, x][i & 1], [before, y][i >> 1 & 1], [below, z][i >> 2 & 1]);
                            self.weights[z * plane + y * nx + x].wide()
                        };
                        let w: [f64; 8] = std::array::from_fn(w);
                        for a in 0..3 {
                            // In the voxel before it along the axis the node is at the far end: its sign is positive there.
                            let slope: f64 = (0..8).map(|i| if i >> a & 1 == 0 { w[i] } else { -w[i] }).sum();
                            for c in 0..NC {
                                sum[3 * c + a] += slope * u[z * NC * plane + c * plane + y * nx + x].wide();
                            }
                        }
                    }
                }
                sum
            })
            .collect();
        each.into_iter().fold([0.0; 9], |s, v| std::array::from_fn(|i| s[i] + v[i]))
    }

    /// The sums over cut voxels of the forces of the linear modes, where `u` has the gradient `modes` in addition to its own.
    pub fn cut_flux(&self, modes: &[f64; 9], u: &[T]) -> [f64; 3] {
        self.cut.flux(self.shape, modes, u)
    }

    /// `out` = A applied to a field with the gradient `modes` (times eight, by ξ) in every voxel.
    pub fn uniform(&self, modes: &[f64; 9], out: &mut [T]) {
        let forces: [f64; 9] =
            std::array::from_fn(|i| (0..3 * NC).map(|j| self.blocks.linear[i][j].wide() * modes[j]).sum());
        let [nx, ny, nz] = self.shape;
        let plane = nx * ny;
        out.par_chunks_mut(NC * plane).enumerate().for_each(|(z, out)| {
            let below = (z + nz - 1) % nz;
            for y in 0..ny {
                let before = (y + ny - 1) % ny;
                for x in 0..nx {
                    let left = (x + nx - 1) % nx;
                    let mut sum = [0.0; NC];
                    for i in 0..8 {
                        let (x, y, z) = ([left, x][i & 1], [before, y][i >> 1 & 1], [below, z][i >> 2 & 1]);
                        let w = self.weights[z * plane + y * nx + x].wide();
                        for (c, s) in sum.iter_mut().enumerate() {
                            for a in 0..3 {
                                *s += if i >> a & 1 == 0 { w * forces[3 * c + a] } else { -w * forces[3 * c + a] };
                            }
                        }
                    }
                    for (c, s) in sum.iter().enumerate() {
                        out[c * plane + y * nx + x] = T::of(*s);
                    }
                }
            }
            self.cut.add_uniform(self.shape, z, modes, out);
        });
    }

    /// One over the diagonal; zero at nodes without solid.
    pub fn inverse_diagonal(&self, element: &Element) -> Vec<T> {
        let [nx, ny, nz] = self.shape;
        let plane = nx * ny;
        let corner = element.diagonal();
        let mut out = vec![T::default(); self.len()];
        out.par_chunks_mut(NC * plane).enumerate().for_each(|(z, out)| {
            let below = (z + nz - 1) % nz;
            let mut diagonal = vec![0.0; NC * plane];
            for i in 0..plane {
                let (x, y) = (i % nx, i / nx);
                let (left, before) = ((x + nx - 1) % nx, (y + ny - 1) % ny);
                let mut sum = [0.0; NC];
                for i in 0..8 {
                    let (x, y, z) = ([left, x][i & 1], [before, y][i >> 1 & 1], [below, z][i >> 2 & 1]);
                    let w = self.weights[z * plane + y * nx + x].wide();
                    for (c, s) in sum.iter_mut().enumerate() {
                        *s += w * corner[(7 - i) * NC + c];
                    }
                }
                for (c, s) in sum.iter().enumerate() {
                    diagonal[c * plane + i] = *s;
                }
            }
            self.cut.add_diagonal(self.shape, z, &mut diagonal);
            for (out, d) in out.iter_mut().zip(diagonal) {
                *out = if d > 0.0 { T::of(1.0 / d) } else { T::default() };
            }
        });
        out
    }
}
