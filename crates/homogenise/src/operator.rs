//! The stiffness of a periodic grid of weighted voxels, applied without being stored.
//!
//! Node (x, y, z) is the lower corner of voxel (x, y, z). A field of NC components is stored by planes of z; in a plane the
//! components follow each other, each with x running fastest. Voxels are taken eight at a time along x: values at their corners become
//! modes (`element.rs`), modes become forces, forces are added to the corners. Runs of eight without any solid are left out.
//!
//! Planes of voxels of even z are done in parallel, then those of odd z: no two write to the same plane of nodes at once, and each
//! plane of nodes gets its contributions in a fixed order. So the bits do not depend on the number of threads.

use multiversion::multiversion;
use rayon::prelude::*;

use crate::element::Element;
use crate::lanes::{LANES, Lanes, Real};

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
}

/// The blocks of an element in T.
struct Blocks<T> {
    linear: [[T; 9]; 9],
    bilinear: [[T; 9]; 9],
    trilinear: [[T; 3]; 3],
}

impl<T: Real, const NC: usize> Operator<T, NC> {
    /// The operator of these weights.
    pub fn new(shape: [usize; 3], weights: Vec<T>, element: &Element) -> Self {
        let nine = |m: &[[f64; 9]; 9]| m.map(|row| row.map(T::of));
        let active = weights.chunks(shape[0]).flat_map(|row| row.chunks(LANES));
        Operator {
            shape,
            active: active.map(|run| run.iter().any(|w| *w != T::default())).collect(),
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

    /// `out` = A `u`.
    pub fn apply(&self, u: &[T], out: &mut [T]) {
        let (plane, nz) = (self.plane(), self.shape[2]);
        out.par_chunks_mut(plane).for_each(|p| p.fill(T::default()));
        if nz == 1 {
            // Both faces of the voxels are the same plane of nodes.
            let mut upper = vec![T::default(); plane];
            self.slab(0, [u, u], [out, &mut upper]);
            return out.iter_mut().zip(upper).for_each(|(o, v)| *o += v);
        }
        for first in 0..2 {
            let mut planes: Vec<Option<&mut [T]>> = out.chunks_mut(plane).map(Some).collect();
            // The last plane of voxels of an odd number is adjacent to the first one, and is done by itself.
            let last = nz - 1;
            let zs = (first..nz).step_by(2).filter(|z| nz % 2 == 0 || *z != last);
            let pairs: Vec<_> = zs.map(|z| (z, planes[z].take(), planes[(z + 1) % nz].take())).collect();
            pairs.into_par_iter().for_each(|(z, lower, upper)| {
                if let (Some(lower), Some(upper)) = (lower, upper) {
                    let at = |z: usize| &u[z * plane..(z + 1) * plane];
                    self.slab(z, [at(z), at((z + 1) % nz)], [lower, upper]);
                }
            });
        }
        if nz % 2 == 1 {
            let (head, tail) = out.split_at_mut((nz - 1) * plane);
            self.slab(nz - 1, [&u[(nz - 1) * plane..], &u[..plane]], [tail, &mut head[..plane]]);
        }
    }

    /// Adds the forces of one plane of voxels to the planes of nodes below and above.
    fn slab(&self, z: usize, u: [&[T]; 2], out: [&mut [T]; 2]) {
        let [nx, ny, _] = self.shape;
        let runs = nx.div_ceil(LANES);
        let of = Slab {
            shape: [nx, ny],
            weights: &self.weights[z * nx * ny..(z + 1) * nx * ny],
            active: &self.active[z * runs * ny..(z + 1) * runs * ny],
            blocks: &self.blocks,
        };
        if self.orthotropic {
            slab::<T, NC, true>(&of, u, out);
        } else {
            slab::<T, NC, false>(&of, u, out);
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
                    out[c * plane + i] = if *s > 0.0 { T::of(1.0 / s) } else { T::default() };
                }
            }
        });
        out
    }
}

/// A plane of voxels.
struct Slab<'a, T> {
    shape: [usize; 2],
    weights: &'a [T],
    active: &'a [bool],
    blocks: &'a Blocks<T>,
}

/// Values at a run of nodes, and at the nodes after them.
#[inline(always)]
fn corners<T: Real>(row: &[T], at: usize) -> [Lanes<T>; 2] {
    if at + LANES < row.len() {
        return [Lanes::load(&row[at..]), Lanes::load(&row[at + 1..])];
    }
    let (mut low, mut high) = ([T::default(); LANES], [T::default(); LANES]);
    for i in 0..row.len() - at {
        low[i] = row[at + i];
        high[i] = row[(at + i + 1) % row.len()];
    }
    [Lanes(low), Lanes(high)]
}

/// Adds forces to a run of nodes and the one after each.
#[inline(always)]
fn scatter<T: Real>(row: &mut [T], at: usize, low: Lanes<T>, high: Lanes<T>) {
    let n = row.len();
    let sum = low + high.shifted(T::default());
    if at + LANES <= n {
        let to = &mut row[at..at + LANES];
        for i in 0..LANES {
            to[i] += sum.0[i];
        }
        row[(at + LANES) % n] += high.0[LANES - 1];
    } else {
        for i in 0..n - at {
            row[at + i] += sum.0[i];
        }
        row[0] += high.0[n - at - 1];
    }
}

#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn slab<T: Real, const NC: usize, const ORTHO: bool>(of: &Slab<T>, u: [&[T]; 2], out: [&mut [T]; 2]) {
    slab_inner::<T, NC, ORTHO>(of, u, out);
}

#[inline(always)]
fn slab_inner<T: Real, const NC: usize, const ORTHO: bool>(of: &Slab<T>, u: [&[T]; 2], out: [&mut [T]; 2]) {
    let [nx, ny] = of.shape;
    let runs = nx.div_ceil(LANES);
    for y in 0..ny {
        let rows = [y, (y + 1) % ny];
        for run in 0..runs {
            if !of.active[y * runs + run] {
                continue;
            }
            let at = run * LANES;
            let mut weight = [T::default(); LANES];
            let from = &of.weights[y * nx + at..y * nx + nx.min(at + LANES)];
            weight[..from.len()].copy_from_slice(from);
            let mut modes = [[Lanes::<T>::default(); 8]; NC];
            for c in 0..NC {
                let row = |y: usize, z: usize| &u[z][(c * ny + rows[y]) * nx..(c * ny + rows[y] + 1) * nx];
                modes[c] = to_modes([
                    corners(row(0, 0), at),
                    corners(row(1, 0), at),
                    corners(row(0, 1), at),
                    corners(row(1, 1), at),
                ]);
            }
            let forces = forces::<T, NC, ORTHO>(of.blocks, &modes, Lanes(weight));
            for c in 0..NC {
                let nodes = to_nodes(&forces[c]);
                for (i, [low, high]) in nodes.into_iter().enumerate() {
                    let start = (c * ny + rows[i & 1]) * nx;
                    scatter(&mut out[i >> 1][start..start + nx], at, low, high);
                }
            }
        }
    }
}

/// Sums and differences of the values at the corners, by the monomial's bits (x lowest). Corners: by y, z, then x.
#[inline(always)]
fn to_modes<T: Real>(u: [[Lanes<T>; 2]; 4]) -> [Lanes<T>; 8] {
    let along_x = u.map(|[a, b]| [a + b, b - a]);
    let mut out = [Lanes::default(); 8];
    for x in 0..2 {
        let [a, b, c, d] = along_x.map(|v| v[x]);
        let (near, near_y, far, far_y) = (a + b, b - a, c + d, d - c);
        out[x] = near + far;
        out[x + 2] = near_y + far_y;
        out[x + 4] = far - near;
        out[x + 6] = far_y - near_y;
    }
    out
}

/// The transpose of `to_modes`, of forces without the constant mode.
#[inline(always)]
fn to_nodes<T: Real>(m: &[Lanes<T>; 8]) -> [[Lanes<T>; 2]; 4] {
    let mut out = [[Lanes::default(); 2]; 4];
    for x in 0..2 {
        let (near, far) = (m[x] - m[x + 4], m[x] + m[x + 4]);
        let (near_y, far_y) = (m[x + 2] - m[x + 6], m[x + 2] + m[x + 6]);
        out[0][x] = near - near_y;
        out[1][x] = near + near_y;
        out[2][x] = far - far_y;
        out[3][x] = far + far_y;
    }
    out.map(|[s, d]| [s - d, s + d])
}

/// Weighted forces of the modes.
#[inline(always)]
fn forces<T: Real, const NC: usize, const ORTHO: bool>(
    of: &Blocks<T>,
    modes: &[[Lanes<T>; 8]; NC],
    weight: Lanes<T>,
) -> [[Lanes<T>; 8]; NC] {
    let mut out = [[Lanes::<T>::default(); 8]; NC];
    block::<T, NC, ORTHO>(&of.linear, [1, 2, 4], modes, weight, &mut out);
    block::<T, NC, ORTHO>(&of.bilinear, [6, 5, 3], modes, weight, &mut out);
    for c in 0..NC {
        let mut sum = Lanes::default();
        for d in 0..NC {
            if !ORTHO || c == d {
                sum = sum + modes[d][7].times(of.trilinear[c][d]);
            }
        }
        out[c][7] = sum * weight;
    }
    out
}

/// Weighted forces of three modes of each component.
#[inline(always)]
fn block<T: Real, const NC: usize, const ORTHO: bool>(
    of: &[[T; 9]; 9],
    names: [usize; 3],
    modes: &[[Lanes<T>; 8]; NC],
    weight: Lanes<T>,
    out: &mut [[Lanes<T>; 8]; NC],
) {
    for c in 0..NC {
        for a in 0..3 {
            let i = 3 * c + a;
            let mut sum = modes[c][names[a]].times(of[i][i]);
            if !ORTHO {
                for j in (0..3 * NC).filter(|j| *j != i) {
                    sum = sum + modes[j / 3][names[j % 3]].times(of[i][j]);
                }
            } else if NC == 3 && a == c {
                let (p, q) = ((c + 1) % 3, (c + 2) % 3);
                sum = sum + modes[p % NC][names[p]].times(of[i][4 * p]) + modes[q % NC][names[q]].times(of[i][4 * q]);
            } else if NC == 3 {
                sum = sum + modes[a % NC][names[c]].times(of[i][3 * a + c]);
            }
            out[c][names[a]] = sum * weight;
        }
    }
}
