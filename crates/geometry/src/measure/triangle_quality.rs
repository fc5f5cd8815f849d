//! Angles and aspect ratios of triangles.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::math::{Vec3, cross, dot, norm, sub};
use crate::mesh::Mesh;

/// How well shaped the triangles of a mesh are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "QualityReport")]
pub struct TriangleQuality {
    /// Smallest angle, degrees; 60 at best.
    pub smallest_angle: f64,
    /// Its 5th percentile, degrees.
    pub smallest_angle_p05: f64,
    // Infinity is null in JSON.
    /// Longest edge over 2√3 times the inscribed circle's radius, 1 at best; None for a triangle without area.
    #[schemars(with = "Option<f64>")]
    pub largest_aspect: f64,
}

/// Intervals of angles in a degree by which shapes are counted.
const INTERVALS: f64 = 1000.0;

/// The shapes of some triangles, for [`ShapeCounts`]; two bytes for each.
#[derive(Clone, Debug)]
pub struct Shapes {
    smallest_angle: f64,
    largest_aspect: f64,
    /// For each triangle the interval of its smallest angle.
    intervals: Vec<u16>,
}

impl Default for Shapes {
    fn default() -> Shapes {
        Shapes { smallest_angle: f64::INFINITY, largest_aspect: 1.0, intervals: Vec::new() }
    }
}

impl Shapes {
    /// The smallest angle (degrees) and the largest aspect ratio, and for each triangle the interval of its smallest angle.
    pub fn parts(&self) -> ([f64; 2], &[u16]) {
        ([self.smallest_angle, self.largest_aspect], &self.intervals)
    }

    /// Shapes of these `parts`.
    pub fn of_parts([smallest_angle, largest_aspect]: [f64; 2], intervals: Vec<u16>) -> Shapes {
        Shapes { smallest_angle, largest_aspect, intervals }
    }

    /// Adds the triangle with these corners.
    pub fn push(&mut self, corners: [Vec3; 3]) {
        let (angle, aspect) = shape(corners);
        self.smallest_angle = self.smallest_angle.min(angle);
        self.largest_aspect = self.largest_aspect.max(aspect);
        // At most 60 degrees: 60 000 intervals.
        self.intervals.push((angle * INTERVALS) as u16);
    }
}

/// The shapes of triangles that come in parts, counted: the quality of a mesh that is not held.
#[derive(Clone, Debug, Default)]
pub struct ShapeCounts {
    all: Shapes,
    counts: Vec<u64>,
}

impl ShapeCounts {
    /// The smallest angle (degrees) and the largest aspect ratio, and how many triangles have their smallest angle in each interval;
    /// none of no triangles.
    pub fn parts(&self) -> ([f64; 2], &[u64]) {
        (self.all.parts().0, &self.counts)
    }

    /// Adds counts of these `parts`; intervals beyond the last one are none.
    pub fn add_parts(&mut self, [smallest_angle, largest_aspect]: [f64; 2], counts: impl Iterator<Item = (u16, u64)>) {
        self.all.smallest_angle = self.all.smallest_angle.min(smallest_angle);
        self.all.largest_aspect = self.all.largest_aspect.max(largest_aspect);
        for (interval, count) in counts {
            self.counts.resize(1 << 16, 0);
            let all = &mut self.counts[usize::from(interval)];
            *all = all.wrapping_add(count);
        }
    }

    /// Adds the triangles of a part.
    pub fn add(&mut self, part: &Shapes) {
        self.all.smallest_angle = self.all.smallest_angle.min(part.smallest_angle);
        self.all.largest_aspect = self.all.largest_aspect.max(part.largest_aspect);
        self.counts.resize(1 << 16, 0);
        part.intervals.iter().for_each(|i| self.counts[usize::from(*i)] += 1);
    }

    /// The quality of all triangles; `None` without triangles. The percentile is exact to a thousandth of a degree.
    pub fn quality(&self) -> Option<TriangleQuality> {
        let total: u64 = self.counts.iter().sum();
        let mut below = 0;
        let place = self.counts.iter().position(|n| {
            below += n;
            below > total / 20
        })?;
        let smallest_angle_p05 = ((place as f64 + 0.5) / INTERVALS).max(self.all.smallest_angle);
        let Shapes { smallest_angle, largest_aspect, .. } = self.all;
        Some(TriangleQuality { smallest_angle, smallest_angle_p05, largest_aspect })
    }
}

/// The quality of a mesh; `None` without triangles. Exact to rounding.
pub fn quality(mesh: &Mesh) -> Option<TriangleQuality> {
    let shapes: Vec<(f64, f64)> = (0..mesh.triangles.len()).into_par_iter().map(|i| shape(mesh.corners(i))).collect();
    let largest_aspect = shapes.iter().fold(1.0, |m: f64, s| m.max(s.1));
    let mut angles: Vec<f64> = shapes.into_iter().map(|s| s.0).collect();
    let smallest_angle = angles.iter().copied().reduce(f64::min)?;
    let place = angles.len() / 20;
    let (_, p05, _) = angles.select_nth_unstable_by(place, f64::total_cmp);
    Some(TriangleQuality { smallest_angle, smallest_angle_p05: *p05, largest_aspect })
}

/// Smallest angle (degrees) and aspect ratio of a triangle.
fn shape([a, b, c]: [Vec3; 3]) -> (f64, f64) {
    let sides = [sub(b, a), sub(c, b), sub(a, c)];
    let lengths = sides.map(norm);
    let twice = norm(cross(sides[0], sides[1]));
    if twice.is_nan() || twice <= 0.0 {
        return (0.0, f64::INFINITY);
    }
    // The smallest angle lies opposite to the shortest side.
    let short = (1..3).fold(0, |s, k| if lengths[k] < lengths[s] { k } else { s });
    let (u, v) = (sides[(short + 1) % 3], sides[(short + 2) % 3]);
    let angle = twice.atan2(-dot(u, v)).to_degrees();
    let longest = lengths.iter().copied().fold(0.0, f64::max);
    // The inscribed circle has the radius 2 · area / perimeter.
    let inner = twice / lengths.iter().sum::<f64>();
    (angle, (longest / (12f64.sqrt() * inner)).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::{cube, torus};

    #[test]
    fn known_triangles() {
        let (angle, aspect) = shape([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.75f64.sqrt(), 0.0]]);
        assert!((angle - 60.0).abs() < 1e-12 && (aspect - 1.0).abs() < 1e-12);
        // 3, 4, 5: the inscribed circle has radius 1.
        let (angle, aspect) = shape([[0.0; 3], [0.0, 3.0, 0.0], [4.0, 0.0, 0.0]]);
        assert!((angle - 0.75f64.atan().to_degrees()).abs() < 1e-12);
        assert!((aspect - 5.0 / 12f64.sqrt()).abs() < 1e-12);
        assert_eq!(shape([[0.0; 3], [1.0; 3], [2.0; 3]]), (0.0, f64::INFINITY));
    }

    #[test]
    fn meshes() {
        let q = quality(&cube([1.0; 3], 2.0)).expect("triangles");
        assert!((q.smallest_angle - 45.0).abs() < 1e-12 && (q.smallest_angle_p05 - 45.0).abs() < 1e-12);
        // Legs 1: the inscribed circle has radius 1 − 1/√2.
        let aspect = 2f64.sqrt() / (12f64.sqrt() * (1.0 - 0.5f64.sqrt()));
        assert!((q.largest_aspect - aspect).abs() < 1e-12);
        assert_eq!(quality(&Mesh::default()), None);
    }

    #[test]
    fn counted_shapes_have_the_quality_of_their_mesh() {
        // Angles from 0.2 degrees up.
        let mesh = torus(200, 7);
        let whole = quality(&mesh).expect("triangles");
        let mut counts = ShapeCounts::default();
        for part in mesh.triangles.chunks(100) {
            let mut shapes = Shapes::default();
            part.iter().for_each(|t| shapes.push(t.map(|v| mesh.vertices[v as usize])));
            counts.add(&shapes);
        }
        let counted = counts.quality().expect("triangles");
        assert_eq!(counted.smallest_angle, whole.smallest_angle);
        assert_eq!(counted.largest_aspect, whole.largest_aspect);
        // Half an interval.
        assert!((counted.smallest_angle_p05 - whole.smallest_angle_p05).abs() <= 0.5 / INTERVALS);
        assert_eq!(ShapeCounts::default().quality(), None);
    }
}
