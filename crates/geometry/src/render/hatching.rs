//! Parallel lines within closed polygons.

use super::visible_parts::PicturePoint;

/// Segments at 45°, `spacing` apart, of the area within closed polygons, by the even-odd rule. Lines that run through a corner count it once.
pub(super) fn hatching(loops: &[Vec<PicturePoint>], spacing: f64) -> Vec<[PicturePoint; 2]> {
    let half = core::f64::consts::FRAC_1_SQRT_2;
    // Along the lines, and across them.
    let turned = |[x, y]: PicturePoint| [(x - y) * half, (x + y) * half];
    let back = |[u, v]: PicturePoint| [(u + v) * half, (v - u) * half];
    let mut hits: Vec<(i64, f64)> = Vec::new();
    for polygon in loops {
        for (i, p) in polygon.iter().enumerate() {
            let [p, q] = [turned(*p), turned(polygon[(i + 1) % polygon.len()])];
            let (low, high) = if p[1] < q[1] { (p, q) } else { (q, p) };
            let (first, end) = ((low[1] / spacing).ceil(), (high[1] / spacing).ceil());
            for k in first as i64..end as i64 {
                let share = (k as f64 * spacing - low[1]) / (high[1] - low[1]);
                hits.push((k, low[0] + share * (high[0] - low[0])));
            }
        }
    }
    hits.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let lines = hits.chunk_by(|a, b| a.0 == b.0);
    lines
        .flat_map(|line| line.chunks_exact(2))
        .map(|pair| [pair[0], pair[1]].map(|(k, u)| back([u, k as f64 * spacing])))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Length times spacing is the area, up to the ends of the lines; a hole is left out.
    #[test]
    fn lines_cover_what_the_polygons_enclose() {
        let square = |a: f64, b: f64| vec![[a, a], [b, a], [b, b], [a, b]];
        let lines = hatching(&[square(0.0, 10.0), square(3.0, 7.0)], 0.05);
        let total: f64 = lines.iter().map(|[p, q]| (q[0] - p[0]).hypot(q[1] - p[1])).sum();
        assert!((total * 0.05 - 84.0).abs() < 0.05 * 56.0 / 2.0, "{total}");
        for [p, q] in lines {
            assert!(((p[0] - q[0]) + (p[1] - q[1])).abs() < 1e-9, "45°");
            let middle = [0, 1].map(|k| (p[k] + q[k]) / 2.0);
            assert!(middle.iter().all(|c| (0.0..=10.0).contains(c)) && !middle.iter().all(|c| (3.1..6.9).contains(c)));
        }
    }
}
