//! Which parts of lines in space the eye sees: those that no sample of the surface around them is in front of.

use super::space_lines::{LineKind, LinePoint, SpaceLine};
use super::{Camera, raster::Raster};
use crate::math::add;

/// A point of the picture, in samples.
pub(super) type PicturePoint = [f64; 2];

/// Distance (samples) between the points of a line that are judged.
const STEP: f64 = 1.0;
/// A line may lie behind what is seen by as many samples' widths: the depth of a slope within a sample.
const BEHIND: f64 = 3.0;
/// Gaps shorter than this (samples) are drawn, and pieces shorter than this are not: both come from samples that are half covered, and from
/// the triangles along a contour.
const GAP: f64 = 8.0;
const PIECE: f64 = 18.0;
/// Deviation (samples) of a simplified polyline.
const SIMPLER: f64 = 0.4;
/// Samples to either side over which a contour is averaged, three times: triangles let it waver within their sagitta.
const EASED: usize = 8;

/// A picture's samples, to compare lines with.
pub(super) struct PictureSamples<'a> {
    pub camera: &'a Camera,
    pub raster: &'a Raster,
}

impl PictureSamples<'_> {
    /// The distance of what a sample sees; infinite where it sees nothing, or is not in the picture.
    fn far(&self, x: i64, y: i64) -> f64 {
        let (width, rows) = (self.raster.width as i64, (self.raster.near.len() / self.raster.width) as i64);
        if !((0..width).contains(&x) && (0..rows).contains(&y)) {
            return f64::INFINITY;
        }
        self.camera.distance_of(f64::from(self.raster.near[(y * width + x) as usize]))
    }

    fn sees(&self, p: &LinePoint) -> bool {
        let [x, y, near] = self.camera.project(p.at);
        let (far, slack) = (self.camera.distance_of(near), BEHIND / self.camera.samples_per_mm(near));
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        if (-1..=1).any(|j| (-1..=1).any(|i| far <= self.far(x + i, y + j) + slack)) {
            return true;
        }
        if p.lift == [0.0; 3] {
            return false;
        }
        let [x, y, _] = self.camera.project(add(p.at, p.lift));
        far <= self.far(x.floor() as i64, y.floor() as i64) + slack
    }

    /// The parts of a line that are seen, in the picture.
    pub(super) fn parts(&self, line: &SpaceLine) -> Vec<Vec<PicturePoint>> {
        let mut samples = self.samples(line);
        let closed = samples.len() > 2 && line.points.first().map(|p| p.at) == line.points.last().map(|p| p.at);
        // A closed line is cut where it is hidden, so that no part is cut where it is seen.
        if closed && let Some(at) = samples.iter().position(|s| !s.1) {
            samples.pop();
            samples.rotate_left(at);
            samples.push(samples[0]);
        }
        let mut runs: Vec<(bool, Vec<PicturePoint>)> = Vec::new();
        for (p, seen) in samples {
            match runs.last_mut() {
                Some((of, points)) if *of == seen => points.push(p),
                _ => runs.push((seen, vec![p])),
            }
        }
        let count = runs.len();
        let mut parts: Vec<Vec<PicturePoint>> = Vec::new();
        let mut open = false;
        for (i, (seen, points)) in runs.into_iter().enumerate() {
            let gap = !seen && i > 0 && i + 1 < count && length(&points) < GAP;
            if seen || gap {
                if !open {
                    parts.push(Vec::new());
                }
                parts.last_mut().expect("one was opened").extend(points);
            }
            open = seen || gap;
        }
        parts.retain(|points| length(points) >= PIECE);
        let smooth = line.kind == LineKind::Contour;
        parts.iter().map(|points| if smooth { simpler(&eased(points)) } else { simpler(points) }).collect()
    }

    /// Points along a line, and whether they are seen.
    fn samples(&self, line: &SpaceLine) -> Vec<(PicturePoint, bool)> {
        let place = |p: &LinePoint| {
            let [x, y, _] = self.camera.project(p.at);
            [x, y]
        };
        let mut found: Vec<(PicturePoint, bool)> =
            line.points.first().map(|p| (place(p), self.sees(p))).into_iter().collect();
        for pair in line.points.windows(2) {
            let [p, q] = [&pair[0], &pair[1]];
            let long = length(&[place(p), place(q)]);
            let steps = (long / STEP).ceil().clamp(1.0, 1e5) as usize;
            for i in 1..=steps {
                let s = i as f64 / steps as f64;
                let mix = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
                let here = LinePoint { at: mix(p.at, q.at), lift: mix(p.lift, q.lift) };
                found.push((place(&here), self.sees(&here)));
            }
        }
        found
    }
}

/// A line of points that are a sample apart, averaged thrice over neighbours; ends stay, a closed line stays closed.
fn eased(points: &[PicturePoint]) -> Vec<PicturePoint> {
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut line = points.to_vec();
    let closed = last > 2 * EASED && points[0] == points[last];
    for _ in 0..3 {
        let mean = |i: usize| {
            let reach = if closed { EASED } else { i.min(last - i).min(EASED) };
            let about = (0..=2 * reach).map(|j| if closed { (last + i + j - reach) % last } else { i + j - reach });
            let sum = about.map(|j| line[j]).fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
            sum.map(|c| c / (2 * reach + 1) as f64)
        };
        line = (0..=last).map(mean).collect();
    }
    line
}

pub(super) fn length(points: &[PicturePoint]) -> f64 {
    points.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum()
}

/// A polyline with fewer points, from which none of the given ones is farther than `SIMPLER` (Douglas and Peucker, 1973).
pub(super) fn simpler(points: &[PicturePoint]) -> Vec<PicturePoint> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len().saturating_sub(1))];
    while let Some((a, b)) = open.pop() {
        keep[a] = true;
        keep[b] = true;
        let (p, q) = (points[a], points[b]);
        let along = [q[0] - p[0], q[1] - p[1]];
        let square = along[0] * along[0] + along[1] * along[1];
        let off = |r: &PicturePoint| {
            let to = [r[0] - p[0], r[1] - p[1]];
            let s = if square > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
            (to[0] - s * along[0]).hypot(to[1] - s * along[1])
        };
        let farthest = (a + 1..b).max_by(|i, j| off(&points[*i]).total_cmp(&off(&points[*j])));
        if let Some(i) = farthest.filter(|i| off(&points[*i]) > SIMPLER) {
            open.extend([(a, i), (i, b)]);
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// A circle that wavers as triangles let a contour waver is one again, and stays closed; a straight line stays as it is, with its ends.
    #[test]
    fn contours_do_not_waver() {
        let wavering = |i: usize| {
            let (angle, radius) =
                (TAU * (i % 1200) as f64 / 1200.0, 200.0 + 2.0 * (TAU * (i % 1200) as f64 / 15.0).sin());
            [radius * angle.cos(), radius * angle.sin()]
        };
        let closed: Vec<PicturePoint> = (0..=1200).map(wavering).collect();
        let found = eased(&closed);
        assert_eq!(found.first(), found.last());
        // A circle of this radius shrinks by the variance of the averages over twice its radius: 3 × 24 / 400.
        assert!(found.iter().all(|p| (p[0].hypot(p[1]) - 200.0).abs() < 0.3));
        let line: Vec<PicturePoint> = (0..50).map(|i| [f64::from(i), 0.5 * f64::from(i)]).collect();
        assert!(eased(&line).iter().zip(&line).all(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1]) < 1e-9));
        assert_eq!(eased(&line[..1]), line[..1]);
        assert!(eased(&[]).is_empty());
    }
}
