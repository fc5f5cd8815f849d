//! The rotations of a cube.

use geometry::math::{Mat3, determinant, product};

/// The 24 rotations of a cube.
pub(super) fn cube() -> Vec<Mat3> {
    let mut all = Vec::new();
    for p in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let mut m = [[0.0; 3]; 3];
            for a in 0..3 {
                m[p[a]][a] = if signs >> a & 1 == 0 { 1.0 } else { -1.0 };
            }
            if determinant(&m) > 0.0 {
                all.push(m);
            }
        }
    }
    all
}

/// Of the frames that differ from `f` by a turn of the cube, the one that is turned least from `to`.
pub(super) fn nearest(f: &Mat3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    let agree = |m: &Mat3| -> f64 { m.as_flattened().iter().zip(to.as_flattened()).map(|(a, b)| a * b).sum() };
    // Turns of the cube are a quarter or more: within an eighth, whose cosine this is, there is no nearer one.
    if agree(f) > 1.0 + core::f64::consts::SQRT_2 {
        return *f;
    }
    let all = turns.iter().map(|t| product(f, t));
    all.max_by(|a, b| agree(a).total_cmp(&agree(b))).unwrap_or(*f)
}
