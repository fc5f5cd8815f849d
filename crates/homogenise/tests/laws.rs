//! Laws of effective tensors: closed forms, bounds, symmetry.

use geometry::math::{Mat3, product, rotation, transpose};
use geometry::progress::Silent;
use geometry::random::random;
use homogenise::{Material, Voigt, VoxelCell, bounds, conductivity_bounds, turned};

const UNIT: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn solid() -> Material {
    Material::isotropic(1.0, 0.3).expect("valid")
}

fn stiffness(cell: &VoxelCell, material: &Material) -> Voigt {
    let made = cell.stiffness(material, 1e-11, &Silent).expect("solved");
    assert!(made.residual <= 1e-11);
    made.tensor
}

fn close(a: &[[f64; 6]; 6], b: &[[f64; 6]; 6], by: f64) {
    for (i, (a, b)) in a.iter().flatten().zip(b.iter().flatten()).enumerate() {
        assert!((a - b).abs() <= by, "C{}{}: {a} and {b}", i / 6 + 1, i % 6 + 1);
    }
}

/// Layers across each axis with any fractions: of void and of a softer solid (a weight is a factor of the stiffness).
#[test]
fn laminates_are_exact() {
    let (e, nu) = (1.0, 0.3);
    let c = solid().stiffness;
    for axis in 0..3 {
        for share in [[1.0, 0.0], [1.0, 0.25], [0.7, 0.1]] {
            let layer = |i: usize| share[usize::from([i % 8, i / 8 % 8, i / 64][axis] >= 3)];
            let cell = VoxelCell::new([8; 3], UNIT, (0..512).map(layer).collect()).expect("fits");
            let found = stiffness(&cell, &solid());
            let (low, high) = (3.0 / 8.0, 5.0 / 8.0);
            let mean = low * share[0] + high * share[1];
            let harmonic = if share[1] == 0.0 { 0.0 } else { 1.0 / (low / share[0] + high / share[1]) };
            let (b, d) = ((axis + 1) % 3, (axis + 2) % 3);
            let flat = e / (1.0 - nu * nu);
            let coupling = nu / (1.0 - nu);
            let across = c[0][0] * harmonic;
            let mut exact = [[0.0; 6]; 6];
            exact[axis][axis] = across;
            for (p, q) in [(b, d), (d, b)] {
                exact[p][p] = flat * mean + coupling * coupling * across;
                exact[p][q] = nu * flat * mean + coupling * coupling * across;
                exact[axis][p] = coupling * across;
                exact[p][axis] = coupling * across;
            }
            for i in 0..3 {
                exact[i + 3][i + 3] = c[3][3] * if i == axis { mean } else { harmonic };
            }
            close(&found, &exact, 1e-10);
            let k = cell.conductivity(0.0, 1e-12, &Silent).expect("solved").tensor;
            for i in 0..3 {
                assert!((k[i][i] - if i == axis { harmonic } else { mean }).abs() < 1e-10);
            }
            let k = cell.conductivity(0.01, 1e-12, &Silent).expect("solved").tensor;
            let with = share.map(|s| s + 0.01 * (1.0 - s));
            assert!((k[axis][axis] - 1.0 / (low / with[0] + high / with[1])).abs() < 1e-10);
        }
    }
}

/// A full cell of any shape has the stiffness of its material, any material.
#[test]
fn a_full_cell_is_its_material() {
    let edges = [[1.0, 0.3, 0.1], [0.1, 1.4, -0.2], [0.0, 0.2, 0.7]];
    let cell = VoxelCell::new([4, 6, 8], edges, vec![1.0; 192]).expect("fits");
    let mut c = solid().stiffness;
    c[0][0] *= 2.0;
    (c[0][4], c[4][0]) = (0.1, 0.1);
    let any = Material::general(c).expect("positive definite");
    close(&stiffness(&cell, &any), &c, 1e-12);
}

/// No random cell of solid and void blocks leaves the bounds of Hashin and Shtrikman or of Voigt. (A voxel that is partly solid is a softer
/// solid here, which no mixture of solid and void need be as stiff as; so there are none.)
#[test]
fn bounds_are_never_left() {
    let mut seed = 11;
    let [k, g] = solid().isotropic.expect("isotropic");
    for n in 0..12 {
        let blocks = [[4, 4, 4], [3, 5, 4], [4, 2, 6]][n % 3];
        let least = 0.6 * random(&mut seed);
        let filled: Vec<bool> = (0..blocks.iter().product::<usize>()).map(|_| random(&mut seed) > least).collect();
        let shape = blocks.map(|b| 4 * b);
        let of = |i: usize| {
            let [x, y, z] = [i % shape[0] / 4, i / shape[0] % shape[1] / 4, i / shape[0] / shape[1] / 4];
            if filled[(z * blocks[1] + y) * blocks[0] + x] { 1.0 } else { 0.0 }
        };
        let cell = VoxelCell::new(shape, UNIT, (0..shape.iter().product()).map(of).collect()).expect("fits");
        let c = stiffness(&cell, &solid());
        // The response to a strain that is the same in all directions is bounded as that of an isotropic composite.
        let bulk = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| c[i][j]).sum::<f64>() / 9.0;
        assert!(bulk <= bounds(k, g, cell.fraction())[0] + 1e-12, "{bulk} {}", cell.fraction());
        for i in 0..6 {
            assert!(c[i][i] >= -1e-12 && c[i][i] <= cell.fraction() * solid().stiffness[i][i] + 1e-12);
        }
        for pore in [0.0, 0.03, 20.0] {
            let k = cell.conductivity(pore, 1e-11, &Silent).expect("solved").tensor;
            let mean = (k[0][0] + k[1][1] + k[2][2]) / 3.0;
            let [low, high] = conductivity_bounds(cell.fraction(), pore);
            assert!(low - 1e-10 <= mean && mean <= high + 1e-10, "{low} {mean} {high}");
            let voigt = cell.fraction() + (1.0 - cell.fraction()) * pore;
            assert!((0..3).all(|i| k[i][i] <= voigt + 1e-10));
        }
    }
}

/// A cell of balls on a grid, and the same one turned: the tensor turns with it. Its symmetry is used, and changes nothing.
#[test]
fn a_turned_cell_has_the_turned_tensor() {
    let n = 12;
    let inside = |i: usize| {
        let p = [i % n, i / n % n, i / n / n].map(|v| (v as f64 + 0.5) / n as f64 - 0.5);
        let out = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] > 0.33 || p[0] * p[1] * p[2] > 0.02;
        if out { 1.0 } else { 0.0 }
    };
    let fractions: Vec<f64> = (0..n * n * n).map(inside).collect();
    let cell = VoxelCell::new([n; 3], UNIT, fractions.clone()).expect("fits");
    let made = cell.stiffness(&solid(), 1e-11, &Silent).expect("solved");
    assert_eq!(made.cases, 2);
    let r = rotation([20.0, -35.0, 70.0]);
    let other = VoxelCell::new([n; 3], r, fractions.clone()).expect("fits");
    close(&stiffness(&other, &solid()), &turned(&made.tensor, &r), 1e-12);
    // Edges of the same lattice that are not at right angles: the third one leans by a whole cell.
    let lean = [[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let moved = |i: usize| fractions[(i / n) * n + (i % n + i / n / n) % n];
    let skewed = VoxelCell::new([n; 3], lean, (0..n * n * n).map(moved).collect()).expect("fits");
    let lean = skewed.stiffness(&solid(), 1e-11, &Silent).expect("solved");
    assert_eq!(lean.cases, 6);
    // Elements of another shape on the same voids: close, not equal.
    close(&lean.tensor, &made.tensor, 0.06);
    // An anisotropic solid turns with the cell.
    let mut c = solid().stiffness;
    c[2][2] *= 3.0;
    let any = Material::general(c).expect("valid");
    let with = Material::general(turned(&c, &r)).expect("valid");
    let both = [stiffness(&cell, &any), stiffness(&other, &with)];
    close(&both[1], &turned(&both[0], &r), 1e-12);
    let k = other.conductivity(0.1, 1e-11, &Silent).expect("solved").tensor;
    let plain = cell.conductivity(0.1, 1e-11, &Silent).expect("solved").tensor;
    let back = product(&product(&r, &plain), &transpose(&r));
    assert!((0..9).all(|i| (k[i / 3][i % 3] - back[i / 3][i % 3]).abs() < 1e-12));
}

/// Iterations do not grow with the number of voxels, and the bits not with that of threads.
#[test]
fn iterations_do_not_grow_and_bits_do_not_change() {
    let wall = |n: usize| {
        let value = move |i: usize| {
            let p = [i % n, i / n % n, i / n / n].map(|v| std::f64::consts::TAU * (v as f64 + 0.5) / n as f64);
            let f = p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos();
            (0.5 - (f.abs() - 0.464) * n as f64 / 9.4).clamp(0.0, 1.0)
        };
        VoxelCell::new([n; 3], UNIT, (0..n * n * n).map(value).collect()).expect("fits")
    };
    let with = |n: usize, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| wall(n).stiffness(&solid(), 1e-8, &Silent).expect("solved"))
    };
    let (small, large) = (with(24, 1), with(48, 1));
    println!("{} {}", small.iterations, large.iterations);
    assert!(large.iterations <= small.iterations + 4 && large.iterations < 25);
    let again = with(48, 3);
    assert!(large.tensor.iter().flatten().zip(again.tensor.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
}

/// Balls apart from each other carry nothing, and are known to.
#[test]
fn islands_are_known() {
    let n = 8;
    let ball = |i: usize| {
        let p = [i % n, i / n % n, i / n / n].map(|v| v as f64 - 3.5);
        if p.iter().map(|v| v * v).sum::<f64>() < 9.0 { 1.0 } else { 0.0 }
    };
    let cell = VoxelCell::new([n; 3], UNIT, (0..n * n * n).map(ball).collect()).expect("fits");
    assert_eq!(cell.endless_directions(0.0), 0);
    let pores = VoxelCell::new([n; 3], UNIT, cell.fractions.iter().map(|v| 1.0 - v).collect()).expect("fits");
    assert_eq!(pores.endless_directions(0.0), 3);
    let rods = (0..512).map(|i| if i % 8 < 4 && i / 8 % 8 < 4 { 1.0 } else { 0.0 }).collect();
    assert_eq!(VoxelCell::new([n; 3], UNIT, rods).expect("fits").endless_directions(0.5), 1);
}
