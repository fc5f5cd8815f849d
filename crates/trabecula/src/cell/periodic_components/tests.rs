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
                d[a] = (45.0 * (at(1.0) - at(-1.0)) - 9.0 * (at(2.0) - at(-2.0)) + at(3.0) - at(-3.0)) / (60.0 * h);
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
    // Intervals of the lower and the upper part, and the number of necks of each in a period. The first level of each
    // is that of the literature's critical values; those with two digits more were checked by Newton on ∇f = 0.
    type Row = (&'static str, Plain, Vec<[f64; 2]>, Vec<[f64; 2]>, [usize; 2]);
    let r = 2f64.sqrt();
    let all: [Row; 9] = [
        ("primitive", primitive, vec![[-1.0, 3.0]], vec![[1.0, -3.0]], [3, 3]),
        ("gyroid", gyroid, vec![[-r, 1.5]], vec![[r, -1.5]], [12, 12]),
        ("diamond", diamond, vec![[-1.0, r]], vec![[1.0, -r]], [16, 16]),
        ("iwp", iwp, vec![[-3.0, 3.0]], vec![[3.0, -5.0]], [12, 0]),
        ("neovius", neovius, vec![[-0.75, 13.0]], vec![[0.75, -13.0]], [12, 12]),
        // Above 1 loose balls appear about the nodes of the network, which they join at 1.8638.
        ("frd", frd, vec![[-1.0982, 1.0], [1.86383, 2.0]], vec![[1.0, -7.0]], [0, 0]),
        ("fks", fks, vec![[-0.749168, r]], vec![[0.749168, -r]], [48, 48]),
        // Two networks that interpenetrate until 0.15 and 0.6.
        ("lidinoid", lidinoid, vec![[-0.173937, 1.15]], vec![[0.15, -1.35]], [0, 0]),
        ("split_p", split_p, vec![[-0.97047, 1.81]], vec![[0.6, -1.8]], [0, 0]),
    ];
    for (name, f, lower, upper, necks) in all {
        for (part, want, necks) in [(Part::Lower, lower, necks[0]), (Part::Upper, upper, necks[1])] {
            let r = connected(&with_gradients(f), part);
            assert_eq!(r.len(), want.len(), "{name} {part:?}: {:?}", r);
            for (i, w) in r.iter().flatten().zip(want.iter().flatten()) {
                assert!((i - w).abs() < 1e-4, "{name} {part:?}: {:?} not {want:?}", r);
            }
            let found = super::necks(&with_gradients(f), part);
            if necks > 0 {
                assert_eq!(found.len(), necks, "{name} {part:?}: {found:?}");
            }
            for (at, level) in &found {
                assert!((f(*at) - level).abs() < 1e-6);
            }
        }
    }
}

#[test]
fn sheets_are_connected_at_any_thickness() {
    let all: [(Plain, f64); 6] =
        [(primitive, 3.0), (gyroid, 1.5), (diamond, 2f64.sqrt()), (iwp, 5.0), (neovius, 13.0), (lidinoid, 1.35)];
    for (f, top) in all {
        let r = connected(&with_gradients(f), Part::Sheet);
        assert_eq!(r.len(), 1);
        assert!(r[0][0] == 0.0 && (r[0][1] - top).abs() < 1e-6, "{:?}", r);
    }
    // Parallel plates never join; two sets of parallel plates do when their walls cross.
    assert!(connected(&with_gradients(|[x, _, _]| c(x)), Part::Sheet).is_empty());
    let crossed = connected(&with_gradients(|[x, y, z]| c(x) * c(y) * c(z)), Part::Sheet);
    assert_eq!(crossed.len(), 1);
}

#[test]
fn a_sublattice_of_translations_is_not_connected() {
    // Tubes along x alone, and two interpenetrating primitive networks (body-centred), are not connected.
    let tubes: Plain = |[_, y, z]| c(y) + c(z);
    let r = connected(&with_gradients(tubes), Part::Lower);
    assert!(r.len() == 1 && r[0][0].abs() < 1e-6, "{:?}", r);
    let slabs: Plain = |[x, _, _]| c(2.0 * x);
    assert!(connected(&with_gradients(slabs), Part::Lower).iter().all(|i| i[1] - i[0] < 1e-6));
}
