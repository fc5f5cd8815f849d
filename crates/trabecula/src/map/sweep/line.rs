//! A cubic spline through control points, and rotation-minimizing frames at its sample points.

use geometry::fault::Fault;
use geometry::math::{Vec3, add, dot, norm, scale, sub, unit};

/// A sample point of the line.
#[derive(Clone, Copy, Debug)]
pub(super) struct SamplePoint {
    /// Parameter of the spline.
    pub t: f64,
    pub position: Vec3,
    pub tangent: Vec3,
    /// N₁, before the twist.
    pub normal: Vec3,
    /// Arc length up to here, mm.
    pub s: f64,
}

/// The normal of a sample point carried to the next one by two reflections.
pub(super) fn carried(sample: &SamplePoint, position: Vec3, tangent: Vec3) -> Vec3 {
    let mirrored = |v: Vec3, n: Vec3| {
        let long = dot(n, n);
        if long > 0.0 { sub(v, scale(n, 2.0 * dot(n, v) / long)) } else { v }
    };
    let step = sub(position, sample.position);
    let (normal, along) = (mirrored(sample.normal, step), mirrored(sample.tangent, step));
    let n = mirrored(normal, sub(tangent, along));
    unit(sub(n, scale(tangent, dot(n, tangent))))
}

/// Where spans begin, and their cubics.
pub(super) type Spans = Vec<(f64, [Vec3; 4])>;

/// The cubic spline through points at the lengths of their chords, natural at the ends or closed, and where it ends.
pub(super) fn spline(points: &[Vec3], closed: bool) -> Result<(Spans, f64), Fault> {
    let n = points.len();
    let count = if closed { n } else { n - 1 };
    let at = |i: usize| points[i % n];
    let chord: Vec<f64> = (0..count).map(|i| norm(sub(at(i + 1), at(i)))).collect();
    let longest = chord.iter().copied().fold(0.0, f64::max);
    if let Some(i) = chord.iter().position(|l| *l <= 1e-9 * longest) {
        let message = format!("points {i} and {} coincide; leave one out", (i + 1) % n);
        return Err(Fault::new("points", message));
    }
    // Second derivatives at the points: a few sweeps over equations whose diagonal is twice the rest.
    let mut bend = vec![[0.0; 3]; count + 1];
    let slope = |i: usize| scale(sub(at(i + 1), at(i)), 1.0 / chord[i]);
    for _ in 0..200 {
        for i in 0..=count {
            let (before, after) = match (i, closed) {
                (0, false) => continue,
                (i, false) if i == count => continue,
                (0, true) => (count - 1, 0),
                (i, _) => (i - 1, i % count),
            };
            let right = scale(sub(slope(after), slope(before)), 6.0);
            let (hb, ha) = (chord[before], chord[after]);
            let near =
                add(scale(bend[before], hb), scale(bend[if closed { (after + 1) % count } else { after + 1 }], ha));
            bend[i] = scale(sub(right, near), 1.0 / (2.0 * (hb + ha)));
            if closed && i == 0 {
                bend[count] = bend[0];
            }
        }
    }
    let mut from = 0.0;
    let mut spans = Vec::with_capacity(count);
    for i in 0..count {
        let h = chord[i];
        let (m0, m1) = (bend[i], bend[if closed { (i + 1) % count } else { i + 1 }]);
        let b = sub(slope(i), scale(add(scale(m0, 2.0), m1), h / 6.0));
        spans.push((from, [at(i), b, scale(m0, 0.5), scale(sub(m1, m0), 1.0 / (6.0 * h))]));
        from += h;
    }
    Ok((spans, from))
}
