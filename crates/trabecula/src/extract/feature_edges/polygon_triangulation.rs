//! Triangulation of simple polygons.

use geometry::mesh::exact::orient2d;

/// The triangulation of a simple polygon whose flattest triangle is as little flat as possible, and so the one that rounding
/// harms least. A nonzero `other` selects a nearly optimal one, each number another.
///
/// Dynamic programming over diagonals: the best triangulation of the part cut off by a diagonal is that of the two parts which
/// a triangle on this diagonal leaves (G. T. Klincsek, Minimal triangulations of polygonal domains, Ann. Discrete Math. 9
/// (1980) 121). Whether a diagonal lies inside need not be tested: if all triangles turn as the polygon does, they cover it
/// once.
pub(super) fn triangles(ring: &[[f64; 2]], other: usize) -> Vec<[usize; 3]> {
    let n = ring.len();
    if n == 3 {
        return vec![[0, 1, 2]];
    }
    let area: f64 = (0..n)
        .map(|i| {
            let (p, q) = (ring[i], ring[(i + 1) % n]);
            p[0] * q[1] - p[1] * q[0]
        })
        .sum();
    let orientation = if area > 0.0 { 1 } else { -1 };
    // For the part from i to j: the height of its flattest triangle, and the apex over the diagonal.
    let mut best = vec![(f64::INFINITY, 0); n * n];
    for reach in 2..n {
        for i in 0..n - reach {
            let j = i + reach;
            let over = |k: usize| {
                let corners = [i, k, j].map(|c| ring[c]);
                let turns = orient2d(corners[0], corners[1], corners[2]) * orientation > 0;
                let own = if turns { height(corners) * weight([i, k, j], other) } else { f64::NEG_INFINITY };
                (own.min(best[i * n + k].0).min(best[k * n + j].0), k)
            };
            let all = (i + 1..j).map(over);
            let found = all.max_by(|a, b| a.0.total_cmp(&b.0));
            best[i * n + j] = found.unwrap_or((f64::NEG_INFINITY, i + 1));
        }
    }
    let mut found = Vec::with_capacity(n);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i > 1 {
            let k = best[i * n + j].1;
            found.push([i, k, j]);
            open.extend([(i, k), (k, j)]);
        }
    }
    found
}

/// Height of a triangle above its longest edge, as a share of that edge.
fn height([a, b, c]: [[f64; 2]; 3]) -> f64 {
    let face = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).powi(2) + (q[1] - p[1]).powi(2);
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    area.abs() / face(a, b).max(face(b, c)).max(face(c, a))
}

/// One, or a factor between a quarter and one that depends on `other`.
fn weight([i, j, k]: [usize; 3], other: usize) -> f64 {
    let mix =
        [i, j, k].iter().fold(other as u64, |h, x| (h ^ *x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29));
    match other {
        0 => 1.0,
        _ => 0.25 + 0.75 * (mix % 1024) as f64 / 1023.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(ring: &[[f64; 2]], t: [usize; 3]) -> f64 {
        let [a, b, c] = t.map(|i| ring[i]);
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
    }

    #[test]
    fn what_is_not_convex_is_covered_once() {
        // A comb, both ways round: triangles that all turn alike and have the area together cover it once.
        let comb = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 3.0],
            [3.0, 1.0],
            [2.5, 3.0],
            [2.0, 1.0],
            [1.0, 3.0],
            [0.5, 1.0],
            [0.0, 3.0],
        ];
        let mut back = comb;
        back.reverse();
        for other in 0..5 {
            for (ring, orientation) in [(&comb, 1.0), (&back, -1.0)] {
                let found = triangles(ring, other);
                let areas: Vec<f64> = found.iter().map(|t| area(ring, *t) * orientation).collect();
                assert_eq!(areas.len(), 7);
                assert!(areas.iter().all(|a| *a > 0.0), "{areas:?}");
                // Its back of 4 by 1 and its teeth: 1, 1, 1.5 and 0.5.
                assert!((areas.iter().sum::<f64>() - 8.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn points_of_one_line_are_not_joined() {
        // Four corners of a square, and two points of a face of it but for 1e-9: cut off by themselves they are nothing.
        let ring = [[0.0, 0.0], [0.3, 1e-9], [0.6, -1e-9], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for other in 0..8 {
            let flattest = triangles(&ring, other).into_iter().map(|t| height(t.map(|i| ring[i])));
            assert!(flattest.fold(f64::INFINITY, f64::min) > 0.1);
        }
    }
}
