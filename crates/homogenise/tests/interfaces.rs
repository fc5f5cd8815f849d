//! Laws of two conducting phases whose interface cuts voxels: layers of any slope, cylinders and balls on a grid, bounds.

use geometry::math::{Mat3, Vec3, apply, dot, norm};
use geometry::progress::Silent;
use homogenise::{Interface, VoxelCell, conductivity_bounds};
use proptest::prelude::*;

const UNIT: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The share of the cube [-1, 1]³ where value + slope · ξ is negative.
fn below(value: f64, slope: Vec3) -> f64 {
    let total: f64 = slope.iter().map(|s| s.abs()).sum();
    if value.abs() >= total {
        return if value < 0.0 { 1.0 } else { 0.0 };
    }
    // Of a slope that is none, one so small that it changes nothing.
    let m = slope.map(|s| s.abs().max(1e-4 * total));
    let all: f64 = m.iter().sum();
    let cube = |v: f64| v.max(0.0).powi(3);
    let corner = |v: f64| {
        let one: f64 = m.iter().map(|m| cube(v - 2.0 * m)).sum();
        let two: f64 = m.iter().map(|m| cube(v - 2.0 * (all - m))).sum();
        (cube(v) - one + two) / (48.0 * m[0] * m[1] * m[2])
    };
    // From the nearer end, where less is cancelled.
    if value > 0.0 { corner(all - value) } else { 1.0 - corner(all + value) }
}

/// Layers: solid where the phase h · x + shift is within `share` / 2 of a whole number. Shares of voxels are exact.
fn layers(h: [i32; 3], share: f64, shift: f64, n: usize) -> VoxelCell {
    let slope = h.map(|v| 0.5 * f64::from(v) / n as f64);
    let rise: f64 = slope.iter().map(|s| s.abs()).sum();
    let (mut fractions, mut interfaces) = (Vec::new(), Vec::new());
    for voxel in 0..n * n * n {
        let at = [voxel % n, voxel / n % n, voxel / n / n].map(|v| (v as f64 + 0.5) / n as f64);
        let phase = dot(h.map(f64::from), at) + shift;
        let near = phase.round();
        let mut solid = 0.0;
        let mut cuts = Vec::new();
        for layer in [near - 1.0, near, near + 1.0] {
            let off = phase - layer;
            solid += below(off - 0.5 * share, slope) - below(off + 0.5 * share, slope);
            cuts.extend([-1.0, 1.0].into_iter().filter(|up| (off - up * 0.5 * share).abs() < rise));
        }
        if let Some(up) = cuts.first() {
            interfaces.push(Interface { voxel, slope: slope.map(|s| up * s), alone: cuts.len() == 1 });
        }
        fractions.push(solid.clamp(0.0, 1.0));
    }
    let cell = VoxelCell::new([n; 3], UNIT, fractions).expect("fits");
    cell.with_interfaces(interfaces).expect("ascend")
}

/// What is solid where a function of the place is negative, given with its gradient: shares from 4³ parts of each voxel.
fn cell_of(n: usize, function: impl Fn(Vec3) -> (f64, Vec3)) -> VoxelCell {
    const PARTS: usize = 4;
    let (mut fractions, mut interfaces) = (Vec::new(), Vec::new());
    let half = 0.5 / n as f64;
    for voxel in 0..n * n * n {
        let at = [voxel % n, voxel / n % n, voxel / n / n].map(|v| (2 * v + 1) as f64 * half - 0.5);
        let part = |i: usize| {
            let off = [i % PARTS, i / PARTS % PARTS, i / PARTS / PARTS];
            let off = off.map(|v| ((2 * v + 1) as f64 / PARTS as f64 - 1.0) * half);
            let (value, gradient) = function([0, 1, 2].map(|a| at[a] + off[a]));
            below(value, gradient.map(|g| g * half / PARTS as f64))
        };
        let solid = (0..PARTS.pow(3)).map(part).sum::<f64>() / PARTS.pow(3) as f64;
        if solid > 0.0 && solid < 1.0 {
            interfaces.push(Interface { voxel, slope: function(at).1, alone: true });
        }
        fractions.push(solid.clamp(0.0, 1.0));
    }
    let cell = VoxelCell::new([n; 3], UNIT, fractions).expect("fits");
    cell.with_interfaces(interfaces).expect("ascend")
}

fn conductivity(cell: &VoxelCell, pore: f64) -> Mat3 {
    let made = cell.conductivity(pore, 1e-9, &Silent).expect("solved");
    assert!(made.iterations < 80, "{}", made.iterations);
    made.tensor
}

/// k along a direction.
fn along(k: &Mat3, direction: Vec3) -> f64 {
    dot(direction, apply(k, direction)) / dot(direction, direction)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Layers along an axis, wherever their faces are in the voxels and however thin they are: the mean along them, the harmonic mean
    /// across, for all contrasts.
    #[test]
    fn aligned_layers_are_exact(
        axis in 0..3usize, share in 0.02..0.98, shift in 0.0..1.0, contrast in -4.0..4.0, n in 6..11usize,
    ) {
        let pore = 10f64.powf(contrast);
        let mut h = [0; 3];
        h[axis] = 1;
        let k = conductivity(&layers(h, share, shift, n), pore);
        let (mean, harmonic) = (share + (1.0 - share) * pore, 1.0 / (share + (1.0 - share) / pore));
        for i in 0..3 {
            let exact = if i == axis { harmonic } else { mean };
            // Forces are of the size of the mean, and in balance to 1e-9 of it.
            prop_assert!((k[i][i] - exact).abs() < 1e-8 * mean, "{} {exact}", k[i][i]);
        }
    }

    /// The same bits for any number of threads.
    #[test]
    fn threads_change_no_bit(shift in 0.0..1.0, contrast in -2.0..2.0) {
        let cell = layers([1, 0, 2], 0.4, shift, 32);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| conductivity(&cell, 10f64.powf(contrast))).as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        };
        prop_assert_eq!(with(1), with(3));
    }
}

/// Slanted layers are within hundredths of the means across and along, an eighth of what cut voxels that conduct by their shares alone are off
/// across at least; and nearer on the finer grid, but for what is below a few thousandths.
#[test]
fn slanted_layers_are_near_their_closed_form() {
    for (h, other) in [([1, 0, 1], [1.0, 0.0, -1.0]), ([1, 1, 1], [1.0, -1.0, 0.0]), ([2, 0, 1], [1.0, 0.0, -2.0])] {
        for pore in [0.01, 0.1, 10.0, 100.0] {
            let (share, mut off) = (0.41, [[0.0; 2]; 2]);
            let mean = share + (1.0 - share) * pore;
            let harmonic = 1.0 / (share + (1.0 - share) / pore);
            for (n, off) in [16, 32].into_iter().zip(&mut off) {
                let mut cell = layers(h, share, 0.13, n);
                let k = conductivity(&cell, pore);
                *off = [along(&k, h.map(f64::from)) / harmonic - 1.0, along(&k, other) / mean - 1.0];
                cell.interfaces.clear();
                let plain = along(&conductivity(&cell, pore), h.map(f64::from)) / harmonic - 1.0;
                println!("{h:?} {pore} {n}: {off:?}, {plain:.2e}");
                assert!(plain > 8.0 * off[0].abs());
            }
            assert!(off[1].iter().all(|v| v.abs() < 0.02), "{h:?} {pore} {off:?}");
            assert!((0..2).all(|i| off[1][i].abs() < 0.6 * off[0][i].abs().max(5e-3)), "{h:?} {pore} {off:?}");
        }
    }
}

/// Cylinders on a square grid, by the formula of Perrins, McKenzie and McPhedran (Proc. R. Soc. A 369 (1979) 207), which has all terms
/// that matter at these shares.
#[test]
fn cylinders_on_a_grid_conduct_as_rayleigh_found() {
    for share in [0.2f64, 0.4] {
        let radius = (share / std::f64::consts::PI).sqrt();
        for contrast in [0.01, 0.1, 10.0, 100.0] {
            let t = (1.0 + contrast) / (1.0 - contrast);
            let f = share;
            let series =
                t + f - 0.305_827 * f.powi(4) * t / (t * t - 1.402_958 * f.powi(8)) - 0.013_362 * f.powi(8) / t;
            let exact = 1.0 - 2.0 * f / series;
            // The rest is the solid, which conducts 1.
            let outside = |p: Vec3| {
                let r = p[0].hypot(p[1]).max(1e-9);
                (radius - r, [-p[0] / r, -p[1] / r, 0.0])
            };
            let off = [32, 64].map(|n| conductivity(&cell_of(n, outside), contrast)[0][0] / exact - 1.0);
            println!("{share} {contrast}: {off:?}");
            assert!(off[1].abs() < 0.01 && off[1].abs() < 0.7 * off[0].abs().max(1e-3), "{share} {contrast}: {off:?}");
        }
    }
}

/// Balls on a cubic grid, by Rayleigh's series with its first two poles (Phil. Mag. 34 (1892) 481); the next term is below 1e-3 of
/// what balls of this share change.
#[test]
fn balls_on_a_grid_conduct_as_rayleigh_found() {
    let share = 0.15f64;
    let radius = (0.75 * share / std::f64::consts::PI).cbrt();
    for contrast in [0.01, 0.1, 10.0, 100.0] {
        let (first, third) = ((2.0 + contrast) / (1.0 - contrast), (1.0 - contrast) / (4.0 / 3.0 + contrast));
        let exact = 1.0 - 3.0 * share / (first + share - 1.3047 * third * share.powf(10.0 / 3.0));
        let outside = |p: Vec3| {
            let r = norm(p).max(1e-9);
            (radius - r, p.map(|v| -v / r))
        };
        let off = [16, 32].map(|n| conductivity(&cell_of(n, outside), contrast)[0][0] / exact - 1.0);
        println!("{contrast}: {off:?}");
        assert!(off[1].abs() < 5e-3 && off[1].abs() < 0.5 * off[0].abs(), "{contrast}: {off:?}");
    }
}

/// No random cell of balls that overlap leaves the bounds of Hashin and Shtrikman, nor a direction those of Wiener.
#[test]
fn bounds_are_never_left() {
    let mut seed = 5;
    for _ in 0..8 {
        let mut next = || geometry::random::random(&mut seed);
        let balls: Vec<(Vec3, f64)> =
            (0..4).map(|_| ([next(), next(), next()].map(|v| 0.5 * v), 0.22 + 0.05 * next())).collect();
        let nearest = |p: Vec3| {
            let each = balls.iter().map(|(middle, radius)| {
                let off = [0, 1, 2].map(|a| (p[a] - middle[a]) - (p[a] - middle[a]).round());
                let r = norm(off).max(1e-9);
                (r - radius, off.map(|v| v / r))
            });
            each.min_by(|a, b| a.0.total_cmp(&b.0)).expect("some")
        };
        let cell = cell_of(16, nearest);
        for pore in [0.01, 0.1, 10.0, 100.0] {
            let k = conductivity(&cell, pore);
            let mean = (k[0][0] + k[1][1] + k[2][2]) / 3.0;
            let [low, high] = conductivity_bounds(cell.fraction(), pore);
            assert!(low <= mean && mean <= high, "{low} {mean} {high}");
            let f = cell.fraction();
            let wiener = [1.0 / (f + (1.0 - f) / pore), f + (1.0 - f) * pore];
            assert!((0..3).all(|i| wiener[0] <= k[i][i] && k[i][i] <= wiener[1]));
        }
    }
}
