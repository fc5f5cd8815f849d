//! Times the stiffness or conductivity of a sheet gyroid: `timed stiffness 64 [cyclic] [fraction]`.

use std::f64::consts::TAU;
use std::time::Instant;

use geometry::progress::Silent;
use homogenise::{Material, VoxelCell};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: usize = args.get(2).and_then(|v| v.parse().ok()).unwrap_or(64);
    let share: f64 = args.get(4).and_then(|v| v.parse().ok()).unwrap_or(0.3);
    let tolerance: f64 = args.get(5).and_then(|v| v.parse().ok()).unwrap_or(1e-8);
    let level = share * 1.535;
    let value = |i: usize| {
        let p = [i % n, i / n % n, i / n / n].map(|v| TAU * (v as f64 + 0.5) / n as f64);
        let f = p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos();
        (0.5 - (f.abs() - level) * n as f64 / 9.4).clamp(0.0, 1.0)
    };
    let mut fractions: Vec<f64> = (0..n * n * n).map(value).collect();
    if args.get(3).is_none_or(|v| v != "cyclic") {
        // Breaks the symmetry of the axes.
        fractions[1] = 0.5 * fractions[1] + 0.1;
    }
    let edges = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let cell = VoxelCell::new([n; 3], edges, fractions).expect("a cell");
    let start = Instant::now();
    match args[1].as_str() {
        "stiffness" => {
            let made =
                cell.stiffness(&Material::isotropic(1.0, 0.3).expect("valid"), tolerance, &Silent).expect("solved");
            println!(
                "{:.3} s, {} cases, {} iterations, {:e}, C11 {}, C44 {}",
                start.elapsed().as_secs_f64(),
                made.cases,
                made.iterations,
                made.residual,
                made.tensor[0][0],
                made.tensor[3][3]
            );
            println!("{:?}", made.tensor);
        }
        _ => {
            let made = cell.conductivity(0.0, tolerance, &Silent).expect("solved");
            println!(
                "{:.3} s, {} cases, {} iterations, {:e}, k {}",
                start.elapsed().as_secs_f64(),
                made.cases,
                made.iterations,
                made.residual,
                made.tensor[0][0]
            );
            println!("{:?}", made.tensor);
        }
    }
}
