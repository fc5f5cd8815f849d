//! Laws of creeping flow through pores: closed forms, published values, symmetry.

use std::f64::consts::{PI, TAU};

use geometry::math::Mat3;
use geometry::progress::Silent;
use homogenise::{Homogenised, PoreGrid, VELOCITIES, WallLink};

/// The pore where `level` is positive, at coordinates of 0 to 1, less nodes nearer to a wall than a fiftieth of a step; walls by bisection.
fn pore(shape: [usize; 3], level: impl Fn([f64; 3]) -> f64) -> PoreGrid {
    let at = |i: usize, q: usize, s: f64| {
        let place = [i % shape[0], i / shape[0] % shape[1], i / shape[0] / shape[1]];
        let u = [0, 1, 2].map(|a| (place[a] as f64 + 0.5 + s * f64::from(VELOCITIES[q][a])) / shape[a] as f64);
        level(u.map(|v| v - v.floor()))
    };
    let count = shape.iter().product();
    let rise = |i: usize| (1..=6).map(|q| (at(i, q, 1.0) - at(i, 0, 0.0)).abs()).fold(0.0, f64::max);
    let inside: Vec<bool> = (0..count).map(|i| at(i, 0, 0.0) > 0.02 * rise(i)).collect();
    let mut walls = Vec::new();
    for node in (0..count).filter(|i| inside[*i]) {
        for velocity in 1..19 {
            let [x, y, z] = [0, 1, 2].map(|a| {
                let at = [node % shape[0], node / shape[0] % shape[1], node / shape[0] / shape[1]][a] as i32;
                (at + VELOCITIES[velocity][a]).rem_euclid(shape[a] as i32) as usize
            });
            if inside[(z * shape[1] + y) * shape[0] + x] {
                continue;
            }
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if at(node, velocity, middle) > 0.0 { low = middle } else { high = middle }
            }
            walls.push(WallLink { node, velocity, distance: high });
        }
    }
    PoreGrid::new(shape, [0; 3], inside, walls).expect("fits")
}

fn solved(grid: &PoreGrid, viscosity: f64, cyclic: bool, tolerance: f64) -> Homogenised<Mat3> {
    grid.permeability(viscosity, cyclic, tolerance, &Silent).expect("steady")
}

/// Simple cubic balls of this share of the cell: the pore around them.
fn around_balls(n: usize, share: f64) -> PoreGrid {
    let radius = (share * 3.0 / 4.0 / PI).cbrt();
    pore([n; 3], move |u| u.map(|v| (v - 0.5) * (v - 0.5)).iter().sum::<f64>().sqrt() - radius)
}

fn gyroid(u: [f64; 3]) -> f64 {
    let p = u.map(|v| TAU * v);
    p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos()
}

/// Flow between planes, wherever they are between nodes: the parabola of velocities is exact at each node, for any share of the link.
#[test]
fn plane_channels_are_exact() {
    for (n, share) in [(16, 0.5), (16, 0.41), (16, 0.53), (20, 0.61), (24, 0.3)] {
        for axis in 0..3 {
            let made = solved(&slit(n, share, axis), 1.0, false, 1e-11);
            let height = 0.5 * share * n as f64;
            let at = (0..n).map(|i| i as f64 + 0.5 - 0.5 * n as f64).filter(|z| z.abs() < height);
            let sum: f64 = at.map(|z| 0.5 * (height * height - z * z)).sum();
            for i in 0..3 {
                let wanted = if i == axis { 0.0 } else { sum / n as f64 };
                assert!(
                    (made.tensor[i][i] - wanted).abs() < 1e-7 * height * height,
                    "{n} {share}: {:?} {wanted}",
                    made.tensor
                );
            }
        }
    }
    // k = h³ / 12 over the width of the cell, to the error of the midpoint rule: each wall up to h² u'' / 12 in a mean of h³ u'' / 12.
    let k = solved(&slit(64, 0.53, 2), 1.0, false, 1e-10).tensor[0][0] * 64.0 / (0.53f64 * 64.0).powi(3) * 12.0;
    assert!((k - 1.0).abs() < 3.0 / (0.53f64 * 64.0).powi(2), "{k}");
}

/// A slit of this share of the cell across an axis.
fn slit(n: usize, share: f64, axis: usize) -> PoreGrid {
    let mut shape = [4; 3];
    shape[axis] = n;
    pore(shape, move |u| 0.5 * share - (u[axis] - 0.5).abs())
}

/// Flow through a square duct of edge a: 0.035144 a² over its own section (the series of cosines).
#[test]
fn square_ducts() {
    let duct =
        |n: usize, share: f64| pore([n, n, 4], move |u| 0.5 * share - (u[0] - 0.5).abs().max((u[1] - 0.5).abs()));
    for share in [0.5, 0.53] {
        let made = solved(&duct(48, share), 1.0, false, 1e-9);
        let k = made.tensor[2][2] / (48.0 * 48.0) / (0.035_144 * share.powi(4));
        assert!((k - 1.0).abs() < 5e-3, "{k}");
        assert!(made.tensor[0][0].abs() < 1e-6 && made.tensor[1][1].abs() < 1e-6);
    }
}

/// Zick and Homsy 1982: the drag of simple cubic balls by their share of the cell.
#[test]
fn balls_on_a_cubic_grid() {
    for (share, drag) in [(0.125, 4.292), (0.343, 15.4), (PI / 6.0, 42.14)] {
        let radius = (share * 3.0 / 4.0 / PI).cbrt();
        let wanted = 1.0 / (6.0 * PI * radius * drag);
        let n = 32;
        let k = solved(&around_balls(n, share), 1.0, true, 1e-6).tensor[0][0] / (n * n) as f64;
        assert!((k / wanted - 1.0).abs() < 0.005, "{share}: {k} and {wanted}");
    }
}

/// The steady flow does not depend on the viscosity, hence on the relaxation times; bits do not depend on threads.
#[test]
fn viscosity_and_threads_change_nothing() {
    let grid = pore([20; 3], |u| gyroid(u) + 0.3);
    let all = [0.1, 0.5, 2.0].map(|v| solved(&grid, v, true, 1e-11).tensor[0][0]);
    assert!(all.iter().all(|k| (k / all[0] - 1.0).abs() < 1e-6), "{all:?}");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| solved(&grid, 1.0, true, 1e-6).tensor)
    };
    assert_eq!(with(1), with(3));
}

/// A pore without symmetry: forces along three axes give a symmetric tensor, to the order of the walls; that of a cubic cell is a number,
/// and found from one force.
#[test]
fn tensors_are_symmetric() {
    let odd = |u: [f64; 3]| {
        let p = u.map(|v| TAU * v);
        gyroid(u) + 0.4 * (p[0] + p[1]).cos() + 0.3 * (p[1] - 2.0 * p[2]).sin() + 0.2
    };
    let raw = |n: usize| pore([n; 3], odd).fluxes(1.0, false, 1e-7, &Silent).expect("steady").tensor;
    let off = [16, 32].map(|n| {
        let k = raw(n);
        let most = (0..3).map(|i| (k[i][(i + 1) % 3] - k[(i + 1) % 3][i]).abs()).fold(0.0, f64::max);
        assert!((0..3).any(|i| k[i][(i + 1) % 3].abs() > 0.05 * k[i][i]), "{k:?}");
        most / k[0][0]
    });
    assert!(off[0] < 2e-3 && off[1] < 0.5 * off[0], "{off:?}");
    let grid = pore([16; 3], gyroid);
    let (one, three) = (solved(&grid, 1.0, true, 1e-10), solved(&grid, 1.0, false, 1e-10));
    assert_eq!((one.cases, three.cases), (1, 3));
    for i in 0..9 {
        assert!((one.tensor[i / 3][i % 3] - three.tensor[i / 3][i % 3]).abs() < 1e-8);
    }
}

/// The same pore in a cell whose third edge leans by whole steps.
#[test]
fn a_cell_that_leans_is_the_same() {
    let n = 16;
    let upright = pore([n; 3], gyroid);
    let lean = PoreGrid::new([n; 3], [0, n as i64, 0], upright.pore.clone(), upright.walls.clone()).expect("fits");
    assert_eq!(solved(&upright, 1.0, false, 1e-8).tensor, solved(&lean, 1.0, false, 1e-8).tensor);
    // Oblique channels: a slit across x + y in a cell of half the volume, whose second edge leans by half.
    let slit = |shape: [usize; 3]| pore(shape, |u| 0.35 - ((u[0] + u[1]).fract() - 0.5).abs());
    let whole = slit([n, n, 4]);
    let half = n * n / 2;
    let keep = |i: usize| i % (n * n) < half;
    let pores: Vec<bool> = (0..n * n * 4).filter(|i| keep(*i)).map(|i| whole.pore[i]).collect();
    let walls = whole.walls.iter().filter(|w| keep(w.node));
    let moved = walls.map(|w| WallLink { node: w.node / (n * n) * half + w.node % (n * n), ..*w }).collect();
    let leaning = PoreGrid::new([n, n / 2, 4], [n as i64 / 2, 0, 0], pores, moved).expect("fits");
    let (a, b) = (solved(&whole, 1.0, false, 1e-9).tensor, solved(&leaning, 1.0, false, 1e-9).tensor);
    assert!((0..9).all(|i| (a[i / 3][i % 3] - b[i / 3][i % 3]).abs() < 1e-7), "{a:?} {b:?}");
    assert!((a[0][1] + a[0][0]).abs() < 1e-6 && a[0][0] > 0.1);
}

/// What does not go through carries no flow: closed pores, and directions across walls.
#[test]
fn closed_pores_carry_nothing() {
    let ball = pore([12; 3], |u| 0.4 - u.map(|v| (v - 0.5) * (v - 0.5)).iter().sum::<f64>().sqrt());
    assert_eq!(solved(&ball, 1.0, false, 1e-8).tensor, [[0.0; 3]; 3]);
    let wavy = pore([16; 3], |u| 0.3 - (u[2] - 0.5 - 0.1 * (TAU * u[0]).sin()).abs());
    let k = solved(&wavy, 1.0, false, 1e-9).tensor;
    assert!(k[2][2].abs() < 1e-7 * k[0][0] && k[1][1] > k[0][0], "{k:?}");
}

/// Two pores with a wall thinner than a step between them do not mix.
#[test]
fn a_wall_between_nodes_is_one() {
    let (lower, upper) = (pore([4, 4, 16], |u| 0.5 - u[2]), pore([4, 4, 16], |u| u[2] - 0.5));
    let mut walls = [lower.walls.clone(), upper.walls.clone()].concat();
    walls.sort_by_key(|w| (w.node, w.velocity));
    let all = PoreGrid::new([4, 4, 16], [0; 3], vec![true; 256], walls).expect("fits");
    let (one, two) = (solved(&lower, 1.0, false, 1e-10), solved(&all, 1.0, false, 1e-10));
    assert!((two.tensor[0][0] / one.tensor[0][0] - 2.0).abs() < 1e-8);
}

#[test]
fn wrong_grids_are_refused() {
    let wall = |node, velocity, distance| WallLink { node, velocity, distance };
    let with = |pore: Vec<bool>, walls| PoreGrid::new([2; 3], [0; 3], pore, walls).err().map(|f| f.message);
    assert!(with(vec![true; 7], vec![]).is_some_and(|m| m.contains("7 values")));
    assert!(with(vec![true; 8], vec![wall(0, 1, 0.0)]).is_some_and(|m| m.contains("crosses a link")));
    assert!(with(vec![true; 8], vec![wall(1, 1, 0.5), wall(0, 1, 0.5)]).is_some_and(|m| m.contains("order")));
}
