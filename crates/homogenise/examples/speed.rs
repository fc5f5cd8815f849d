use geometry::progress::Silent;
use homogenise::{Material, VoxelCell};
use std::time::Instant;
fn main() {
    let n: usize = std::env::args().nth(1).map_or(64, |s| s.parse().unwrap());
    let kind = std::env::args().nth(2).unwrap_or("sheet".into());
    let t: f64 = std::env::args().nth(3).map_or(0.4640, |s| s.parse().unwrap());
    let tau = std::f64::consts::TAU;
    let mut w = Vec::new();
    for z in 0..n { for y in 0..n { for x in 0..n {
        let mut s = 0.0;
        for i in 0..8 {
            let p = [x, y, z].map(|v| v as f64);
            let p = [0, 1, 2].map(|a| tau * (p[a] + if i >> a & 1 == 1 { 0.75 } else { 0.25 }) / n as f64);
            let f = p[0].sin() * p[1].cos() + p[1].sin() * p[2].cos() + p[2].sin() * p[0].cos();
            let v = if kind == "sheet" { f.abs() - t } else { f - t };
            // grad ~1.5*tau/n per voxel; smooth ramp over a subvoxel
            let h = 0.5 * 1.5 * tau / n as f64;
            s += (0.5 - v / h).clamp(0.0, 1.0) / 8.0;
        }
        w.push(s);
    }}}
    let edges = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let cell = VoxelCell::new([n; 3], edges, w).unwrap();
    let m = Material::isotropic(1.0, 0.3).unwrap();
    let t0 = Instant::now();
    let c = cell.stiffness(&m, 1e-8, &Silent);
    match c { Ok(c) => println!("n {n} rho {:.4} C11 {:.5} C12 {:.5} C44 {:.5} iters {} cases {} res {:.1e}  {:?}", cell.fraction(), c.tensor[0][0], c.tensor[0][1], c.tensor[3][3], c.iterations, c.cases, c.residual, t0.elapsed()),
      Err(e) => println!("{e:?}") }
    let mut broken = cell.clone(); broken.fractions[0] = if broken.fractions[0] > 0.5 { broken.fractions[0] - 1e-4 } else { broken.fractions[0] + 1e-4 };
    broken.fractions[1] = if broken.fractions[1] > 0.5 { broken.fractions[1] - 1e-4 } else { broken.fractions[1] + 1e-4 };
    let t0 = Instant::now();
    if let Ok(c) = broken.stiffness(&m, 1e-8, &Silent) { println!("six: iters {} cases {}  {:?}", c.iterations, c.cases, t0.elapsed()); }
    let t0 = Instant::now();
    let k = cell.conductivity(0.0, 1e-8, &Silent).unwrap();
    println!("k {:.5} iters {} {:?}", k.tensor[0][0], k.iterations, t0.elapsed());
}
