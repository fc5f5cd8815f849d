//! Volume of a combination of half-spaces in the cube [−1, 1]³, by tetrahedra that are cut by one plane after another.

use super::plane_cut::LinearFunction;
use geometry::math::{Vec3, add, cross, dot, scale, sub};

/// The share of the cube where `solid` holds of the signs of the planes (true is negative).
pub fn volume(planes: &[LinearFunction], solid: &dyn Fn(&[bool]) -> bool) -> f64 {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let mut sum = 0.0;
    for order in ORDERS {
        let mut corners = [[-1.0; 3]; 4];
        for (i, axis) in order.into_iter().enumerate() {
            corners[i + 1] = corners[i];
            corners[i + 1][axis] = 1.0;
        }
        sum += cut(corners, planes, &mut Vec::new(), solid);
    }
    sum / 8.0
}

/// The solid volume of a tetrahedron in which the signs of the first planes are known.
fn cut(t: [Vec3; 4], planes: &[LinearFunction], signs: &mut Vec<bool>, solid: &dyn Fn(&[bool]) -> bool) -> f64 {
    let Some(plane) = planes.get(signs.len()) else {
        let size = dot(sub(t[1], t[0]), cross(sub(t[2], t[0]), sub(t[3], t[0]))).abs() / 6.0;
        return if solid(signs) { size } else { 0.0 };
    };
    let with = |t: [Vec3; 4], sign: bool, signs: &mut Vec<bool>| {
        signs.push(sign);
        let sum = cut(t, planes, signs, solid);
        signs.pop();
        sum
    };
    let value = t.map(|p| plane.at(p));
    let (low, high): (Vec<usize>, Vec<usize>) = (0..4).partition(|i| value[*i] < 0.0);
    let between = |a: usize, b: usize| add(t[a], scale(sub(t[b], t[a]), value[a] / (value[a] - value[b])));
    match (&low[..], &high[..]) {
        ([], _) => with(t, false, signs),
        (_, []) => with(t, true, signs),
        ([a], [b, c, d]) | ([b, c, d], [a]) => {
            let tip = low.len() == 1;
            let [p, q, r] = [b, c, d].map(|o| between(*a, *o));
            let rest = [[p, q, r, t[*b]], [q, r, t[*b], t[*c]], [r, t[*b], t[*c], t[*d]]];
            with([t[*a], p, q, r], tip, signs) + rest.into_iter().map(|t| with(t, !tip, signs)).sum::<f64>()
        }
        ([a, b], [c, d]) => {
            let [p, q, r, s] = [between(*a, *c), between(*a, *d), between(*b, *c), between(*b, *d)];
            // Prisms over the triangles (a, p, q) and (b, r, s), and over (c, p, r) and (d, q, s).
            let prism = |[x, y, z]: [Vec3; 3], [u, v, w]: [Vec3; 3]| [[x, y, z, u], [y, z, u, v], [z, u, v, w]];
            let lower = prism([t[*a], p, q], [t[*b], r, s]).into_iter().map(|t| with(t, true, signs)).sum::<f64>();
            let upper = prism([t[*c], p, r], [t[*d], q, s]).into_iter().map(|t| with(t, false, signs)).sum::<f64>();
            lower + upper
        }
        _ => 0.0,
    }
}
