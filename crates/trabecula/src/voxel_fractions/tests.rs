//! Exact volumes, rates, and laws of the fractions.

use std::f64::consts::PI;
use std::sync::Arc;

use super::*;
use crate::cell::{Cell, Part, Series, named};
use crate::grade::Grade;
use crate::implicit::Implicit;
use crate::lattice::{Lattice, Level};
use crate::map::Affine;
use crate::region::{Cuboid, Cylinder, HalfSpace, Region, Sphere};
use geometry::progress::Silent;

fn region(of: Region) -> CsgSolid {
    let mut surfaces = Vec::new();
    let tree = of.surfaces(0.0, &mut surfaces);
    CsgSolid { surfaces, tree }
}

fn total(solid: &CsgSolid, grid: &VoxelGrid) -> f64 {
    let each = voxel_fractions(solid, grid, &Silent).expect("not interrupted");
    assert!(each.iter().all(|v| (0.0..=1.0).contains(v)));
    each.iter().sum::<f64>() * grid.step.iter().product::<f64>()
}

fn cube(n: usize, size: f64) -> VoxelGrid {
    VoxelGrid { origin: [-0.5 * size; 3], step: [size / n as f64; 3], shape: [n; 3] }
}

/// Any plane is exact, voxel by voxel: against the closed form of a corner that it cuts off, and by its complement.
#[test]
fn planes_are_exact() {
    let mut seed = 5;
    for _ in 0..200 {
        let mut random = || geometry::random::random(&mut seed);
        let normal = [random(), random(), 1e-3 * random()];
        let point = [0.3 * random(), 0.3 * random(), 0.3 * random()];
        let grid = cube(3, 1.0);
        let side =
            |n: Vec3| voxel_fractions(&region(Arc::new(HalfSpace::new(point, n).unwrap())), &grid, &Silent).unwrap();
        let (a, b) = (side(normal), side(normal.map(|v| -v)));
        for (a, b) in a.iter().zip(b) {
            assert!((a + b - 1.0).abs() < 1e-9);
        }
        // By tetrahedra, which share no formula with the closed form.
        let size = geometry::math::norm(normal);
        let plane =
            LinearFunction { value: -geometry::math::dot(normal, point) / size, slope: normal.map(|v| 0.5 * v / size) };
        let exact = volume(&[plane], &|s| s[0]);
        assert!((a.iter().sum::<f64>() / 27.0 - exact).abs() < 1e-9);
    }
}

/// Fractions of a ball and a cylinder, voxel by voxel against eight times finer ones, and their volumes: O(h²) of a voxel's volume in each
/// cut voxel, and as much in the whole.
#[test]
fn curved_surfaces_converge_at_second_order_in_each_voxel() {
    let ball: CsgSolid = region(Arc::new(Sphere::new([0.03, -0.02, 0.05], 1.0).unwrap()));
    let axis = [0.3, -0.2, 1.0];
    let rod = region(Arc::new(Cylinder::new(axis.map(|v| -3.0 * v), axis, 0.8, 7.0).unwrap()));
    for (name, solid) in [("ball", &ball), ("cylinder", &rod)] {
        let worst = |n: usize| {
            let coarse = voxel_fractions(solid, &cube(n, 2.5), &Silent).unwrap();
            let fine = voxel_fractions(solid, &cube(8 * n, 2.5), &Silent).unwrap();
            let mean = |x: usize, y: usize, z: usize| {
                let m = 8 * n;
                let sum = |i: usize| fine[((8 * z + i / 64) * m + 8 * y + i / 8 % 8) * m + 8 * x + i % 8];
                (0..512).map(sum).sum::<f64>() / 512.0
            };
            (0..n * n * n).map(|i| (coarse[i] - mean(i % n, i / n % n, i / n / n)).abs()).fold(0.0, f64::max)
        };
        let (a, b) = (worst(10), worst(20));
        println!("{name} {a:.2e} {b:.2e}");
        // A quarter when h is halved; the worst voxel of a finite set may be less lucky.
        assert!(b < 0.45 * a && b < 4e-3, "{name}: {a:.2e} {b:.2e}");
    }
    let off = |n: usize| (total(&ball, &cube(n, 2.5)) / (4.0 / 3.0 * PI) - 1.0).abs();
    println!("{:.2e} {:.2e} {:.2e}", off(12), off(24), off(48));
    assert!(off(24) < 2e-5 && off(48) < 2e-6);
}

/// A corner of a box, not aligned with the grid, and the edges of a box cut by a ball.
#[test]
fn edges_and_corners_are_cut_by_all_planes() {
    let boxed = region(Arc::new(Cuboid::new([-0.41, -0.33, -0.27], [0.37, 0.29, 0.23]).unwrap()));
    let exact = 0.78 * 0.62 * 0.5;
    assert!((total(&boxed, &cube(7, 1.3)) / exact - 1.0).abs() < 1e-9);
    // A thin plate: two faces in one voxel.
    let plate = region(Arc::new(Cuboid::new([-9.0, -9.0, 0.011], [9.0, 9.0, 0.031]).unwrap()));
    assert!((total(&plate, &cube(6, 1.0)) - 0.02).abs() < 1e-12);
}

/// The fractions of one period add up to the fraction that the level was made for.
#[test]
fn a_cell_sums_to_its_exact_fraction() {
    for (name, part) in
        [("gyroid", Part::Sheet), ("diamond", Part::Lower), ("primitive", Part::Upper), ("iwp", Part::Sheet)]
    {
        let cell = Arc::new(Cell::new(Series::new(named(name).unwrap().terms()).unwrap()));
        let map = Affine::rigid([4.0; 3], [0.0; 3], [0.0; 3], &[]).unwrap();
        let lattice = Lattice::new(cell, Arc::new(map), part, Level::Fraction(Grade::Constant(0.3)));
        let parts: Vec<Surface> = match lattice.parts() {
            of if of.is_empty() => vec![Surface::smooth(Arc::new(lattice))],
            of => of.into_iter().map(Surface::smooth).collect(),
        };
        let tree = CsgTree::Intersection((0..parts.len()).map(CsgTree::Leaf).collect());
        let solid = CsgSolid { surfaces: parts, tree };
        let off = |n: usize| {
            let grid = VoxelGrid { origin: [0.0; 3], step: [4.0 / n as f64; 3], shape: [n; 3] };
            total(&solid, &grid) / 64.0 - 0.3
        };
        let (a, b, c) = (off(16), off(32), off(64));
        println!("{name} {a:.2e} {b:.2e} {c:.2e}");
        // Of second order at least; the level itself is good to 3e-7.
        assert!(b.abs() < 4e-5 && c.abs() < 1e-5, "{name}: {a:.2e} {b:.2e} {c:.2e}");
    }
}
