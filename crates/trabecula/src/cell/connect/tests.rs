use core::f64::consts::TAU;

use super::*;

/// A test function with its gradient by the chain rule through sines and cosines of each axis.
type Plain = fn([f64; 3]) -> f64;

/// Values of `g` (x, y, z in turns) with gradients by differences of sixth order.
fn with_gradients(g: Plain) -> impl Fn(&[Vec3], &mut [f64], &mut [Vec3]) + Sync {
    move |u, v, d| {
        for ((u, v), d) in u.iter().zip(v).zip(d) {
            *v = g(*u);
            for a in 0..3 {
                let h = 2e-3;
                let at = |k: f64| {
                    let mut w = *u;
                    w[a] += k * h;
                    g(w)
                };
                d[a] = (45.0 * (at(1.0) - at(-1.0)) - 9.0 * (at(2.0) - at(-2.0)) + at(3.0)
                    - at(-3.0))
                    / (60.0 * h);
            }
        }
    }
}

fn s(x: f64) -> f64 {
    (TAU * x).sin()
}
fn c(x: f64) -> f64 {
    (TAU * x).cos()
}
pub(super) fn gyroid([x, y, z]: Vec3) -> f64 {
    s(x) * c(y) + s(y) * c(z) + s(z) * c(x)
}
fn diamond([x, y, z]: Vec3) -> f64 {
    s(x) * s(y) * s(z) + s(x) * c(y) * c(z) + c(x) * s(y) * c(z) + c(x) * c(y) * s(z)
}
fn primitive([x, y, z]: Vec3) -> f64 {
    c(x) + c(y) + c(z)
}
fn pairs(x: f64, y: f64, z: f64) -> f64 {
    c(x) * c(y) + c(y) * c(z) + c(z) * c(x)
}
fn iwp([x, y, z]: Vec3) -> f64 {
    2.0 * pairs(x, y, z) - (c(2.0 * x) + c(2.0 * y) + c(2.0 * z))
}
fn neovius([x, y, z]: Vec3) -> f64 {
    3.0 * (c(x) + c(y) + c(z)) + 4.0 * c(x) * c(y) * c(z)
}
fn frd([x, y, z]: Vec3) -> f64 {
    4.0 * c(x) * c(y) * c(z) - pairs(2.0 * x, 2.0 * y, 2.0 * z)
}
fn fks([x, y, z]: Vec3) -> f64 {
    c(2.0 * x) * s(y) * c(z) + c(x) * c(2.0 * y) * s(z) + s(x) * c(y) * c(2.0 * z)
}
fn lidinoid([x, y, z]: Vec3) -> f64 {
    0.5 * (s(2.0 * x) * c(y) * s(z) + s(2.0 * y) * c(z) * s(x) + s(2.0 * z) * c(x) * s(y))
        - 0.5 * pairs(2.0 * x, 2.0 * y, 2.0 * z)
        + 0.15
}
fn split_p([x, y, z]: Vec3) -> f64 {
    1.1 * (s(2.0 * x) * s(z) * c(y) + s(2.0 * y) * s(x) * c(z) + s(2.0 * z) * s(y) * c(x))
        - 0.2 * pairs(2.0 * x, 2.0 * y, 2.0 * z)
        - 0.4 * (c(2.0 * x) + c(2.0 * y) + c(2.0 * z))
}

#[test]
fn thresholds_of_the_named_surfaces() {
    let all: [(&str, Plain); 9] = [
        ("primitive", primitive),
        ("gyroid", gyroid),
        ("diamond", diamond),
        ("iwp", iwp),
        ("neovius", neovius),
        ("frd", frd),
        ("fks", fks),
        ("lidinoid", lidinoid),
        ("split_p", split_p),
    ];
    for (name, f) in all {
        for part in [Part::Lower, Part::Upper, Part::Sheet] {
            let t = std::time::Instant::now();
            let r = connectivity(&with_gradients(f), part);
            println!(
                "{name} {part:?} {:?} necks {} {:?} {:?}",
                r.intervals,
                r.necks.len(),
                r.necks.first(),
                t.elapsed()
            );
        }
    }
}
