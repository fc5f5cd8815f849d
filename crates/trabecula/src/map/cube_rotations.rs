//! The rotations of a cube, and which of them brings a frame nearest to another.

use core::f64::consts::SQRT_2;

use geometry::math::{IDENTITY, Mat3, determinant, product};

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

/// One and twice the cosine of the angle between two frames.
fn agreement(a: &Mat3, b: &Mat3) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}

/// Whether two frames are within an eighth of a turn, as most neighbours are: no turn by a quarter or more brings them nearer.
pub(super) fn is_near(a: &Mat3, b: &Mat3) -> bool {
    agreement(a, b) > 1.0 + SQRT_2
}

/// Of turns by a quarter or more, and none, the one after which a frame is nearest to another.
pub(super) fn nearest_turn(f: &Mat3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    if is_near(f, to) {
        return IDENTITY;
    }
    let all = turns.iter().map(|t| (agreement(&product(f, t), to), t));
    all.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(IDENTITY, |best| *best.1)
}

/// The frame after that turn.
pub(super) fn nearest(f: &Mat3, to: &Mat3, turns: &[Mat3]) -> Mat3 {
    product(f, &nearest_turn(f, to, turns))
}
