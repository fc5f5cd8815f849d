//! The tube round polylines, as an exact signed distance.

use std::sync::Arc;

use super::primitive::{field, fill_rows};
use crate::csg_tree::{CsgSolid, CsgTree};
use crate::field::{Block, Field};
use crate::implicit::{Implicit, Surface};
use geometry::math::{Aabb, Interval, Vec3, add, dot, norm, scale, sub, unit};

/// All points within a distance of polylines.
#[derive(Clone, Debug, PartialEq)]
pub struct Tube {
    /// The segments: start and end.
    segments: Vec<[Vec3; 2]>,
    /// The distance, mm.
    pub radius: f64,
}

impl Tube {
    /// About polylines of two points or more.
    pub fn new(lines: &[Vec<Vec3>], radius: f64) -> Tube {
        Tube { segments: lines.iter().flat_map(|l| l.windows(2).map(|p| [p[0], p[1]])).collect(), radius }
    }

    /// As a solid.
    pub fn solid(self) -> CsgSolid {
        CsgSolid { surfaces: vec![Surface::distance(Arc::new(self))], tree: CsgTree::Leaf(0) }
    }

    /// What points to `p` from the nearest point of the lines.
    fn offset(&self, p: Vec3) -> Vec3 {
        let one = |[from, to]: &[Vec3; 2]| {
            let (d, a) = (sub(*to, *from), sub(p, *from));
            sub(a, scale(d, (dot(a, d) / dot(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)))
        };
        let nearer = |m: Vec3, v: Vec3| if dot(v, v) < dot(m, m) { v } else { m };
        self.segments.iter().map(one).fold([f64::INFINITY; 3], nearer)
    }

    /// The distance from the lines, mm.
    pub fn from_lines(&self, p: Vec3) -> f64 {
        norm(self.offset(p))
    }

    fn distance(&self, p: Vec3) -> f64 {
        self.from_lines(p) - self.radius
    }

    fn gradient(&self, p: Vec3) -> Vec3 {
        let direction = unit(self.offset(p));
        if direction == [0.0; 3] { [1.0, 0.0, 0.0] } else { direction }
    }

    fn fill_level(&self, block: &Block, level: f64, out: &mut [f32]) {
        fill_rows(block, out, |p| self.distance(p) - level);
    }

    /// The distance changes by no more than that between two points; widened by rounding.
    fn range(&self, b: &Aabb) -> Interval {
        let (center, reach) = (b.center(), norm(b.size()) / 2.0);
        let d = self.from_lines(center);
        let far = norm(center) + self.segments.iter().map(|[a, _]| norm(*a)).fold(0.0, f64::max);
        let reach = reach + 1e-14 * (reach + d + far);
        Interval::new((d - reach).max(0.0) - self.radius, d + reach - self.radius)
    }
}
field!(Tube);

impl Implicit for Tube {
    fn lipschitz(&self) -> f64 {
        1.0
    }

    fn has_creases(&self) -> bool {
        true
    }
}

/// A region less a tube, for what is asked outside of a tube alone; not a distance.
pub struct OutsideTube<'a> {
    /// The region; everything if none.
    pub region: Option<&'a dyn Field>,
    /// The tube.
    pub tube: &'a Tube,
}

impl Field for OutsideTube<'_> {
    fn values(&self, points: &[Vec3], out: &mut [f64]) {
        match self.region {
            Some(region) => region.values(points, out),
            None => out.fill(f64::NEG_INFINITY),
        }
        out.iter_mut().zip(points).for_each(|(o, p)| *o = o.max(-self.tube.distance(*p)));
    }

    fn gradients(&self, points: &[Vec3], values: &mut [f64], gradients: &mut [Vec3]) {
        match self.region {
            Some(region) => region.gradients(points, values, gradients),
            None => values.fill(f64::NEG_INFINITY),
        }
        for ((v, g), p) in values.iter_mut().zip(gradients).zip(points) {
            let d = -self.tube.distance(*p);
            if d > *v {
                (*v, *g) = (d, scale(self.tube.gradient(*p), -1.0));
            }
        }
    }

    fn bound(&self, b: &Aabb) -> Interval {
        let tube = self.tube.range(b);
        let tube = Interval::new(-tube.hi, -tube.lo);
        self.region.map_or(tube, |region| region.bound(b).max(tube))
    }
}

/// A polyline through points that keep to a grid, without its steps. `step` (mm) is the grid's.
pub fn smoothed(points: &[Vec3], step: f64) -> Vec<Vec3> {
    // What averages take off bends is averaged and put back (Tukey's twicing).
    let even = averaged(points);
    let off: Vec<Vec3> = points.iter().zip(&even).map(|(p, q)| sub(*p, *q)).collect();
    let line: Vec<Vec3> = even.iter().zip(averaged(&off)).map(|(p, d)| add(*p, d)).collect();
    thinned(&line, TOLERANCE * step)
}

/// Averages over adjacent points that even out the steps of a grid.
const PASSES: usize = 12;
/// How near a polyline with fewer points is to the one that it stands for, in steps.
const TOLERANCE: f64 = 0.25;

/// Points averaged with adjacent ones; ends stay.
fn averaged(points: &[Vec3]) -> Vec<Vec3> {
    let mut line = points.to_vec();
    for _ in 0..PASSES {
        let old = line.clone();
        for (p, near) in line.iter_mut().skip(1).zip(old.windows(3)) {
            *p = add(scale(near[1], 0.5), scale(add(near[0], near[2]), 0.25));
        }
    }
    line
}

/// A polyline with fewer points (Ramer, Douglas and Peucker).
fn thinned(points: &[Vec3], tolerance: f64) -> Vec<Vec3> {
    let n = points.len();
    let chord = Tube::new(&[vec![points[0], points[n - 1]]], 0.0);
    let off = |i: usize| chord.from_lines(points[i]);
    let far = (1..n.max(2) - 1).fold(0, |m, i| if m == 0 || off(i) > off(m) { i } else { m });
    if far == 0 || off(far) <= tolerance {
        return vec![points[0], points[n - 1]];
    }
    let mut kept = thinned(&points[..=far], tolerance);
    kept.pop();
    kept.extend(thinned(&points[far..], tolerance));
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tube_has_known_distances_and_bounds_that_hold() {
        let tube =
            Tube::new(&[vec![[0.0; 3], [4.0, 0.0, 0.0], [4.0, 3.0, 0.0]], vec![[0.0, 9.0, 0.0], [1.0, 9.0, 0.0]]], 1.0);
        let at = [[2.0, 0.0, 3.0], [4.0, 5.0, 0.0], [0.5, 7.0, 0.0], [2.0, 0.0, 0.0]];
        assert_eq!(at.map(|p| tube.value(p)), [2.0, 1.0, 1.0, -1.0]);
        let mut seed = 4;
        for _ in 0..500 {
            let c = [0; 3].map(|_| 6.0 * geometry::random::random(&mut seed));
            let b = Aabb { min: c, max: c }.grown(0.8);
            let range = tube.bound(&b);
            for _ in 0..20 {
                let v = tube.value(c.map(|x| x + 0.8 * geometry::random::random(&mut seed)));
                assert!(range.lo <= v && v <= range.hi);
            }
        }
    }

    #[test]
    fn steps_of_a_grid_are_smoothed_away() {
        let points: Vec<Vec3> = (0..40).map(|i| [f64::from(i), f64::from((3 * i + 5) / 10), 0.0]).collect();
        let line = smoothed(&points, 1.0);
        assert!(line.len() <= 4, "{line:?}");
        let off = |p: &Vec3| (p[1] - 0.3 * p[0]).abs();
        assert!(line.iter().all(|p| off(p) < 0.6), "{line:?}");
        // A quarter of a circle keeps its bend.
        let arc: Vec<Vec3> = (0..=60)
            .map(|i| (f64::from(i) / 240.0 * core::f64::consts::TAU).sin_cos())
            .map(|(s, c)| [9.0 * c, 9.0 * s, 0.0])
            .collect();
        let line = smoothed(&arc, 0.5);
        assert!(line.len() > 4 && line.iter().all(|[x, y, _]| (x.hypot(*y) - 9.0).abs() < 0.2), "{line:?}");
    }
}
