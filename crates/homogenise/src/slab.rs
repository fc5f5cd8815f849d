//! The forces of a plane of voxels, eight voxels at a time.
//!
//! Values at nodes become modes along z, row by row, each row once; then along y and x, voxel by voxel. Forces go the way back. The lanes
//! of a run are the one loop around all arithmetic of a voxel, so that a compiler makes each operation one of vectors.

use multiversion::multiversion;

use crate::cut_voxels::{CutVoxel, CutVoxels};
use crate::lanes::{LANES, Real};

/// The blocks of an element in T.
pub struct Blocks<T> {
    /// Of the linear modes.
    pub linear: [[T; 9]; 9],
    /// Of the bilinear modes.
    pub bilinear: [[T; 9]; 9],
    /// Of the trilinear mode.
    pub trilinear: [[T; 3]; 3],
}

/// A plane of voxels.
pub struct Slab<'a, T> {
    /// Voxels along x and y.
    pub shape: [usize; 2],
    /// Weight of each voxel.
    pub weights: &'a [T],
    /// Whether a run of eight voxels has any weight.
    pub active: &'a [bool],
    /// The element.
    pub blocks: &'a Blocks<T>,
    /// Voxels with elements of their own, of all planes.
    pub cut: &'a CutVoxels<T>,
    /// The number of the first run of the plane.
    pub first: usize,
}

/// Rows that are worked on.
pub struct Rows<T> {
    /// Numbers in a row: whole runs, and one more.
    width: usize,
    /// Sum and difference along z of each component, of an even and an odd row of nodes.
    modes: [Vec<T>; 2],
    /// Forces on the same: of the voxels' lower ends along x, then of the upper ones.
    forces: [Vec<T>; 2],
    /// Whether there are forces in a row.
    loaded: [bool; 2],
}

impl<T: Real> Rows<T> {
    /// Rows of `components` values at `nx` nodes.
    pub fn new(nx: usize, components: usize) -> Self {
        let width = nx.next_multiple_of(LANES) + 1;
        let rows = |n: usize| vec![T::default(); n * components * width];
        Rows { width, modes: [rows(2), rows(2)], forces: [rows(4), rows(4)], loaded: [false; 2] }
    }
}

/// Adds the forces of a plane of voxels to the planes of nodes below and above.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub fn slab<U: Real, T: Real, const NC: usize, const ORTHO: bool>(
    of: &Slab<T>,
    u: [&[U]; 2],
    out: [&mut [T]; 2],
    rows: &mut Rows<T>,
) {
    let [nx, ny] = of.shape;
    let runs = nx.div_ceil(LANES);
    let [lower, upper] = out;
    // The row of nodes in each half of `rows`.
    let mut known = [usize::MAX; 2];
    for y in 0..ny {
        let active = &of.active[y * runs..(y + 1) * runs];
        let (near, far) = (y % 2, (y + 1) % 2);
        if active.contains(&true) {
            for (half, row) in [(near, y), (far, y + 1)] {
                if known[half] != row {
                    known[half] = row;
                    along_z::<U, T, NC>(u, row % ny, of.shape, &mut rows.modes[half], rows.width);
                }
                rows.loaded[half] = true;
            }
            for run in (0..runs).filter(|run| active[*run]) {
                let at = run * LANES;
                let mut weights = [T::default(); LANES];
                let from = &of.weights[y * nx + at..y * nx + nx.min(at + LANES)];
                weights[..from.len()].copy_from_slice(from);
                let number = of.first + y * runs + run;
                let cut = of.cut.of_runs(number, number + 1);
                run_of_voxels::<T, NC, ORTHO>(of.blocks, &weights, cut, rows, [near, far], [at, nx]);
            }
        }
        unload::<T, NC>(rows, near, y, of.shape, lower, upper);
    }
    unload::<T, NC>(rows, ny % 2, 0, of.shape, lower, upper);
}

/// Sums and differences along z of a row of nodes, and the first of them once more at its end.
#[inline(always)]
fn along_z<U: Real, T: Real, const NC: usize>(
    u: [&[U]; 2],
    y: usize,
    [nx, ny]: [usize; 2],
    modes: &mut [T],
    width: usize,
) {
    for c in 0..NC {
        let start = (c * ny + y) * nx;
        let (a, b) = (&u[0][start..start + nx], &u[1][start..start + nx]);
        let (sum, difference) = modes[2 * c * width..2 * (c + 1) * width].split_at_mut(width);
        let (sum, difference) = (&mut sum[..nx + 1], &mut difference[..nx + 1]);
        for i in 0..nx {
            let (a, b) = (T::of(a[i].wide()), T::of(b[i].wide()));
            sum[i] = a + b;
            difference[i] = b - a;
        }
        (sum[nx], difference[nx]) = (sum[0], difference[0]);
    }
}

/// Adds the forces in a row to the nodes below and above, and clears them.
#[inline(always)]
fn unload<T: Real, const NC: usize>(
    rows: &mut Rows<T>,
    half: usize,
    y: usize,
    [nx, ny]: [usize; 2],
    lower: &mut [T],
    upper: &mut [T],
) {
    if !rows.loaded[half] {
        return;
    }
    let width = rows.width;
    for c in 0..NC {
        let start = (c * ny + y) * nx;
        let (lower, upper) = (&mut lower[start..start + nx], &mut upper[start..start + nx]);
        let row = |n: usize| &rows.forces[half][(4 * c + n) * width..][..nx];
        let [sum, sum_end, difference, difference_end] = [row(0), row(1), row(2), row(3)];
        // The upper end of a voxel is the next node.
        let mut add = |i: usize, before: usize| {
            let (s, d) = (sum[i] + sum_end[before], difference[i] + difference_end[before]);
            lower[i] += s - d;
            upper[i] += s + d;
        };
        add(0, nx - 1);
        for i in 1..nx {
            add(i, i - 1);
        }
    }
    rows.forces[half].fill(T::default());
    rows.loaded[half] = false;
}

/// The forces of eight voxels.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn run_of_voxels<T: Real, const NC: usize, const ORTHO: bool>(
    of: &Blocks<T>,
    weights: &[T; LANES],
    cut: &[CutVoxel<T>],
    rows: &mut Rows<T>,
    halves: [usize; 2],
    [at, nx]: [usize; 2],
) {
    let width = rows.width;
    let [near, far] = halves;
    let start = |k: usize| k * width + at;
    // By component and mode along z, at most six: values at the lower and the upper end along x, in the near and the far row.
    let mut values = [[[T::default(); LANES]; 4]; 6];
    for k in 0..2 * NC {
        let (near, far) = (&rows.modes[near], &rows.modes[far]);
        values[k] = [eight(near, start(k)), eight(near, start(k) + 1), eight(far, start(k)), eight(far, start(k) + 1)];
    }
    let mut forces = [[[T::default(); LANES]; 4]; 6];
    for i in 0..LANES {
        let modes = modes_of::<T, NC>(&values, i);
        spread::<T, NC>(&forces_of::<T, NC, ORTHO>(of, &modes, weights[i]), &mut forces, i);
    }
    for cut in cut {
        let i = cut.voxel % nx - at;
        let [modes] = modes_of::<T, 1>(&values, i);
        let mut found = [T::default(); 8];
        for (row, m) in cut.form.iter().zip(modes).skip(1) {
            for (f, v) in found.iter_mut().zip(row) {
                *f += m * *v;
            }
        }
        spread::<T, 1>(&[found], &mut forces, i);
    }
    for k in 0..2 * NC {
        for (row, half) in [(0, near), (1, far)] {
            for end in 0..2 {
                let to = &mut rows.forces[half][start(2 * k + end)..][..LANES];
                to.copy_from_slice(&sum(&eight(to, 0), &forces[k][2 * row + end]));
            }
        }
    }
}

/// The modes of a voxel of a run.
#[inline(always)]
fn modes_of<T: Real, const NC: usize>(values: &[[[T; LANES]; 4]; 6], i: usize) -> [[T; 8]; NC] {
    let mut modes = [[T::default(); 8]; NC];
    for c in 0..NC {
        for z in 0..2 {
            let k = 2 * c + z;
            let (a, a_end, b, b_end) = (values[k][0][i], values[k][1][i], values[k][2][i], values[k][3][i]);
            let (sum, sum_end, rise, rise_end) = (a + b, a_end + b_end, b - a, b_end - a_end);
            modes[c][4 * z] = sum + sum_end;
            modes[c][4 * z + 1] = sum_end - sum;
            modes[c][4 * z + 2] = rise + rise_end;
            modes[c][4 * z + 3] = rise_end - rise;
        }
    }
    modes
}

/// Adds the forces of the modes of a voxel to its ends.
#[inline(always)]
fn spread<T: Real, const NC: usize>(found: &[[T; 8]; NC], forces: &mut [[[T; LANES]; 4]; 6], i: usize) {
    for c in 0..NC {
        for z in 0..2 {
            let f = &found[c];
            let (flat, flat_end) = (f[4 * z] - f[4 * z + 1], f[4 * z] + f[4 * z + 1]);
            let (rise, rise_end) = (f[4 * z + 2] - f[4 * z + 3], f[4 * z + 2] + f[4 * z + 3]);
            let k = 2 * c + z;
            forces[k][0][i] += flat - rise;
            forces[k][1][i] += flat_end - rise_end;
            forces[k][2][i] += flat + rise;
            forces[k][3][i] += flat_end + rise_end;
        }
    }
}

/// Eight numbers of a row.
#[inline(always)]
fn eight<T: Real>(row: &[T], at: usize) -> [T; LANES] {
    let mut out = [T::default(); LANES];
    out.copy_from_slice(&row[at..at + LANES]);
    out
}

#[inline(always)]
fn sum<T: Real>(a: &[T; LANES], b: &[T; LANES]) -> [T; LANES] {
    let mut out = *a;
    for i in 0..LANES {
        out[i] += b[i];
    }
    out
}

/// Weighted forces of the modes of a voxel; there is none of the constant one.
#[inline(always)]
fn forces_of<T: Real, const NC: usize, const ORTHO: bool>(
    of: &Blocks<T>,
    modes: &[[T; 8]; NC],
    weight: T,
) -> [[T; 8]; NC] {
    let mut out = [[T::default(); 8]; NC];
    block::<T, NC, ORTHO, false>(&of.linear, modes, weight, &mut out);
    block::<T, NC, ORTHO, true>(&of.bilinear, modes, weight, &mut out);
    for c in 0..NC {
        let mut sum = modes[c][7] * of.trilinear[c][c];
        if !ORTHO {
            for d in 0..NC {
                if d != c {
                    sum += modes[d][7] * of.trilinear[c][d];
                }
            }
        }
        out[c][7] = sum * weight;
    }
    out
}

/// The mode ξ_a, or the one without it.
#[inline(always)]
const fn mode<const BILINEAR: bool>(a: usize) -> usize {
    if BILINEAR { 7 ^ (1 << a) } else { 1 << a }
}

/// Weighted forces of the linear or the bilinear modes of each component.
#[inline(always)]
fn block<T: Real, const NC: usize, const ORTHO: bool, const BILINEAR: bool>(
    of: &[[T; 9]; 9],
    modes: &[[T; 8]; NC],
    weight: T,
    out: &mut [[T; 8]; NC],
) {
    for c in 0..NC {
        for a in 0..3 {
            let i = 3 * c + a;
            let mut sum = modes[c][mode::<BILINEAR>(a)] * of[i][i];
            if !ORTHO {
                for d in 0..NC {
                    for b in 0..3 {
                        if 3 * d + b != i {
                            sum += modes[d][mode::<BILINEAR>(b)] * of[i][3 * d + b];
                        }
                    }
                }
            } else if NC == 3 && a == c {
                let (p, q) = ((c + 1) % 3, (c + 2) % 3);
                sum += modes[p % NC][mode::<BILINEAR>(p)] * of[i][4 * p];
                sum += modes[q % NC][mode::<BILINEAR>(q)] * of[i][4 * q];
            } else if NC == 3 {
                sum += modes[a % NC][mode::<BILINEAR>(c)] * of[i][3 * a + c];
            }
            out[c][mode::<BILINEAR>(a)] = sum * weight;
        }
    }
}
