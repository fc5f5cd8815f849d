//! Intersections among the polygons of a layer.
//!
//! Coordinates are single-precision numbers, so their differences are exact, and orientations are decided by exact arithmetic. Text
//! holds their shortest decimals, up to half a unit in the last place away: segments nearer than that moves them conflict, too.

use geometry::layer::{Point, length};
use robust::{Coord, orient2d};

/// A segment of a ring by number.
type RingSegment = (u32, u32);

/// The segments, as (ring, segment), that are nearer than `near` (mm) to another one elsewhere than about a common corner, or fold
/// back on it. Looked for in boxes of edge `edge` (mm).
pub(super) fn conflicts(rings: &[&[Point]], edge: f64, near: f64) -> Vec<RingSegment> {
    let mut entries: Vec<(u64, RingSegment)> = Vec::new();
    for (r, ring) in rings.iter().enumerate() {
        for i in 0..ring.len() {
            each_box(ends(ring, i), edge, near, &mut |at| entries.push((at, (r as u32, i as u32))));
        }
    }
    entries.sort_unstable();
    let mut found = Vec::new();
    for of in entries.chunk_by(|a, b| a.0 == b.0) {
        for (n, (_, a)) in of.iter().enumerate() {
            for (_, b) in &of[n + 1..] {
                if conflict(rings, *a, *b, near) {
                    found.extend([*a, *b]);
                }
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

fn ends(ring: &[Point], i: usize) -> [Point; 2] {
    [ring[i], ring[if i + 1 == ring.len() { 0 } else { i + 1 }]]
}

/// Calls `found` for the boxes that a segment may come near.
fn each_box([a, b]: [Point; 2], edge: f64, near: f64, found: &mut impl FnMut(u64)) {
    let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
    let row = |y: f64| (y / edge).floor() as i32;
    // Wider than rounding.
    let slack = near.max(1e-6 * edge);
    for j in row(low[1] - slack)..=row(high[1] + slack) {
        let at = |y: f64| {
            let t = if high[1] > low[1] { ((y - low[1]) / (high[1] - low[1])).clamp(0.0, 1.0) } else { 0.0 };
            low[0] + t * (high[0] - low[0])
        };
        let (mut p, mut q) = (at(f64::from(j) * edge - slack), at(f64::from(j + 1) * edge + slack));
        if high[1] - low[1] <= 4.0 * slack {
            (p, q) = (low[0], high[0]);
        }
        let (p, q) = (p.min(q) - slack, p.max(q) + slack);
        for i in row(p)..=row(q) {
            found(u64::from(j as u32) << 32 | u64::from(i as u32));
        }
    }
}

/// Whether two segments meet where they must not, or nearly.
fn conflict(rings: &[&[Point]], a: RingSegment, b: RingSegment, near: f64) -> bool {
    let [a, b] = [a, b].map(|(r, i)| (r as usize, i as usize));
    let ([p, q], [r, s]) = (ends(rings[a.0], a.1), ends(rings[b.0], b.1));
    let apart = (0..2).any(|k| p[k].max(q[k]) + near < r[k].min(s[k]) || r[k].max(s[k]) + near < p[k].min(q[k]));
    if apart {
        return false;
    }
    let count = rings[a.0].len();
    if a.0 == b.0 && (a.1 + 1) % count == b.1 {
        return orientation(p, q, s) == 0.0 && folds([p, q], s);
    }
    if a.0 == b.0 && (b.1 + 1) % count == a.1 {
        return orientation(r, s, q) == 0.0 && folds([r, s], q);
    }
    let [t, u] = [orientation(p, q, r), orientation(p, q, s)];
    let [v, w] = [orientation(r, s, p), orientation(r, s, q)];
    // Where they do not cross, an end is nearest.
    let off = |x: Point, of: [Point; 2]| distance(x, of) < near;
    t * u < 0.0 && v * w < 0.0 || off(r, [p, q]) || off(s, [p, q]) || off(p, [r, s]) || off(q, [r, s])
}

/// The distance of a point from a segment.
fn distance(x: Point, [a, b]: [Point; 2]) -> f64 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [x[0] - a[0], x[1] - a[1]]);
    let along = (d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1]);
    let t = if along.is_finite() { along.clamp(0.0, 1.0) } else { 0.0 };
    length([e[0] - t * d[0], e[1] - t * d[1]])
}

/// Whether a chord that goes on from the second of two points to a third on the same line turns back.
fn folds([p, q]: [Point; 2], s: Point) -> bool {
    (q[0] - p[0]) * (s[0] - q[0]) + (q[1] - p[1]) * (s[1] - q[1]) <= 0.0
}

/// The sign of the orientation of three points.
fn orientation(a: Point, b: Point, c: Point) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    orient2d(a, b, c).signum() * f64::from(u8::from(orient2d(a, b, c) != 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two thin triangles, a unit in the last place apart: their shortest decimals may cross, four units apart they cannot.
    #[test]
    fn segments_that_decimals_may_make_cross_conflict() {
        let unit = f64::from(f32::EPSILON) * 16.0;
        let lower = [[16.0, 20.0], [17.0, 16.0], [20.0, 20.0]];
        for (gap, free) in [(1.0, false), (4.0, true)] {
            let y = 20.0 + gap * unit;
            let upper = [[20.0, y], [18.0, 24.0], [16.0, y]];
            assert_eq!(conflicts(&[&lower, &upper], 1.0, 1.5 * unit).is_empty(), free, "{gap}");
        }
        // Adjacent segments have a corner in common, and conflict only if one folds back on the other.
        assert!(conflicts(&[&lower], 1.0, 1.5 * unit).is_empty());
    }
}
