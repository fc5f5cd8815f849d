//! Times a sheet gyroid: `timed stiffness|conductivity [voxels along an edge, 64] [cyclic|any] [fraction, 0.3] [tolerance, 1e-8]
//! [conductivity of the pore, 0]`.
//!
//! With `any` one voxel breaks the symmetry of the axes, and all load cases are solved.

use std::f64::consts::TAU;
use std::time::Instant;

use geometry::progress::Silent;
use homogenise::{Interface, Material, VoxelCell};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, usual: f64| args.get(i).and_then(|v| v.parse().ok()).unwrap_or(usual);
    let (n, level, tolerance, pore) =
        (number(1, 64.0) as usize, 1.535 * number(3, 0.3), number(4, 1e-8), number(5, 0.0));
    let value = |i: usize| {
        let p = [i % n, i / n % n, i / n / n].map(|v| TAU * (v as f64 + 0.5) / n as f64);
        let f = p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos();
        (0.5 - (f.abs() - level) * n as f64 / 9.4).clamp(0.0, 1.0)
    };
    let mut fractions: Vec<f64> = (0..n * n * n).map(value).collect();
    if args.get(2).is_none_or(|v| v != "cyclic") {
        fractions[1] = 0.5 * fractions[1] + 0.1;
    }
    let slope = |i: usize| {
        let [(sx, cx), (sy, cy), (sz, cz)] =
            [i % n, i / n % n, i / n / n].map(|v| (TAU * (v as f64 + 0.5) / n as f64).sin_cos());
        let side = (sx * cy + sy * cz + sz * cx).signum();
        [cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz].map(|v| side * v)
    };
    let cut = |i: &usize| fractions[*i] > 0.0 && fractions[*i] < 1.0;
    let interfaces =
        (0..n * n * n).filter(cut).map(|voxel| Interface { voxel, slope: slope(voxel), alone: true }).collect();
    let edges = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let cell =
        VoxelCell::new([n; 3], edges, fractions).expect("a cell").with_interfaces(interfaces).expect("interfaces");
    let start = Instant::now();
    let (cases, iterations, tensor) = if args.first().is_some_and(|v| v == "conductivity") {
        let made = cell.conductivity(pore, tolerance, &Silent).expect("solved");
        (made.cases, made.iterations, format!("{:?}", made.tensor))
    } else {
        let solid = Material::isotropic(1.0, 0.3).expect("valid");
        let made = cell.stiffness(&solid, tolerance, &Silent).expect("solved");
        (made.cases, made.iterations, format!("{:?}", made.tensor))
    };
    println!("{:.3} s, {cases} cases, {iterations} iterations\n{tensor}", start.elapsed().as_secs_f64());
}
