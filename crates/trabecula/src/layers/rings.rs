//! Closed polygons of contours: as few points as the tolerance allows, the area of the section, no intersection.
//!
//! Points that the tolerance can do without are left out. Chords lie on one side of a curve, so polygons with their corners on it
//! have a wrong area: every chord knows by how much, and its ends share the shift along their normals that makes up for it.

use super::arcs::{Arc, ArcPoint, Excess, divide};
use super::crossings::conflicts;
use super::roots::SurfacesAtHeight;
use geometry::layer::{Point, length, signed_area};

/// The arcs of closed contours.
pub(super) struct Rings {
    pub arcs: Vec<Arc>,
    /// For each contour one past its last arc.
    pub ends: Vec<u32>,
}

/// A point of a contour before simplification.
#[derive(Clone, Copy)]
struct ContourPoint {
    point: Point,
    /// Outward unit normal; zero where the point must stay.
    normal: Point,
    /// The arc of the chord that follows.
    arc: u32,
    /// The area that this chord's polygon has in excess, mm².
    excess: f64,
}

/// A polygon with, for each of its corners, the arc of the chord that follows.
struct Ring {
    points: Vec<Point>,
    arcs: Vec<u32>,
    /// The contour that it is made of.
    range: [u32; 2],
}

/// How contours may differ from the section.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    /// Greatest distance, mm.
    pub tolerance: f64,
    /// How near roots are found, mm.
    pub accuracy: f64,
    /// Edge of the boxes in which intersections are looked for, mm.
    pub box_edge: f64,
    /// How near contours may come to each other, mm.
    pub near: f64,
}

/// Rounds in which polygons that intersect fall back to plain chords.
const ROUNDS: usize = 8;

impl Rings {
    /// The polygons of all contours, in order.
    pub fn polygons(mut self, plane: SurfacesAtHeight, limits: Limits) -> Vec<Vec<Point>> {
        // Half the tolerance for points left out, and seven tenths for curvature: two thirds of both is how far corners are shifted
        // out, a third is left between them.
        let (inner, excess) = divide(&self.arcs, plane, 0.7 * limits.tolerance, limits.accuracy);
        let mut plain = vec![false; self.arcs.len()];
        let mut rings = Vec::new();
        for round in 0..ROUNDS {
            rings = self.rings(&inner, &excess, &plain, limits.tolerance);
            let segments: Vec<&[Point]> = rings.iter().map(|r| &r.points[..]).collect();
            let found = conflicts(&segments, limits.box_edge, limits.near);
            if found.is_empty() {
                break;
            }
            for (ring, segment) in found {
                self.fall_back(&rings[ring as usize], segment as usize, &mut plain, round);
            }
        }
        let least = limits.tolerance * limits.tolerance;
        // What is thinner than points are shifted may turn inside out.
        let turned = |r: &Ring| signed_area(&r.points) * self.roots_area(r.range) <= 0.0;
        let polygons = rings.into_iter().filter(|r| !turned(r)).map(|r| r.points);
        polygons.filter(|p| p.len() > 2 && signed_area(p).abs() > least).collect()
    }

    /// The area of the polygon through the ends of a contour's arcs, mm².
    fn roots_area(&self, [first, end]: [u32; 2]) -> f64 {
        let ends: Vec<Point> = self.arcs[first as usize..end as usize].iter().map(|a| a.ends[0]).collect();
        signed_area(&ends)
    }

    /// Makes the arcs under a segment of a ring plain chords; later also without their corners.
    fn fall_back(&mut self, ring: &Ring, segment: usize, plain: &mut [bool], round: usize) {
        let [first, end] = ring.range;
        let last = ring.arcs[(segment + 1) % ring.arcs.len()];
        let mut arc = ring.arcs[segment];
        loop {
            plain[arc as usize] = true;
            if round > 2 {
                self.arcs[arc as usize].surface = None;
                self.straighten(arc, [first, end]);
            }
            if arc == last {
                break;
            }
            arc = if arc + 1 == end { first } else { arc + 1 };
        }
    }

    /// Takes the corner at an end of an arc out.
    fn straighten(&mut self, arc: u32, [first, end]: [u32; 2]) {
        let next = if arc + 1 == end { first } else { arc + 1 };
        let before = if arc == first { end - 1 } else { arc - 1 };
        for [a, b] in [[arc, next], [before, arc]] {
            if self.arcs[a as usize].corners[1] && a != b {
                let [from, to] = [self.arcs[a as usize].ends[0], self.arcs[b as usize].ends[1]];
                let middle = [0, 1].map(|k| 0.5 * (from[k] + to[k]));
                self.arcs[a as usize].ends[1] = middle;
                self.arcs[b as usize].ends[0] = middle;
            }
        }
    }

    fn rings(&self, inner: &[ArcPoint], excess: &[Excess], plain: &[bool], tolerance: f64) -> Vec<Ring> {
        let (mut first, mut i, mut e) = (0, 0, 0);
        let mut rings = Vec::with_capacity(self.ends.len());
        for &end in &self.ends {
            let mut knots = Vec::new();
            for a in first..end {
                let (inner, excess) = (entries(inner, &mut i, a), entries(excess, &mut e, a));
                self.knots(a, inner, excess, plain, &mut knots);
            }
            for k in 0..knots.len() {
                // Ends of plain chords stay, those of the arc before too.
                let before = knots[(k + knots.len() - 1) % knots.len()].arc as usize;
                if plain[before] || self.arcs[before].surface.is_none() {
                    knots[k].normal = [0.0; 2];
                }
            }
            let (points, arcs) = simplified(&knots, tolerance);
            rings.push(Ring { points, arcs, range: [first, end] });
            first = end;
        }
        rings
    }

    /// Adds the points of an arc but its last.
    fn knots(&self, a: u32, inner: &[ArcPoint], excess: &[Excess], plain: &[bool], out: &mut Vec<ContourPoint>) {
        let arc = &self.arcs[a as usize];
        let stays = plain[a as usize] || arc.surface.is_none();
        let movable = !(stays || arc.corners[0]);
        let normal = if movable { super::arcs::unit(arc.gradients[0]) } else { [0.0; 2] };
        let mut area = excess.iter().map(|e| e.area);
        let mut next = || if stays { 0.0 } else { area.next().unwrap_or(0.0) };
        out.push(ContourPoint { point: arc.ends[0], normal, arc: a, excess: next() });
        if !stays {
            out.extend(inner.iter().map(|p| ContourPoint { point: p.point, normal: p.normal, arc: a, excess: next() }));
        }
    }
}

/// The entries of an arc in a sorted list, from `at` on.
trait OnArc {
    fn arc(&self) -> u32;
}

impl OnArc for ArcPoint {
    fn arc(&self) -> u32 {
        self.arc
    }
}

impl OnArc for Excess {
    fn arc(&self) -> u32 {
        self.arc
    }
}

fn entries<'a, T: OnArc>(of: &'a [T], at: &mut usize, arc: u32) -> &'a [T] {
    let first = *at + of[*at..].partition_point(|x| x.arc() < arc);
    let end = first + of[first..].partition_point(|x| x.arc() == arc);
    *at = end;
    &of[first..end]
}

/// A contour with fewer points, its area kept: the points, rounded to single precision, and the arcs that follow.
fn simplified(knots: &[ContourPoint], tolerance: f64) -> (Vec<Point>, Vec<u32>) {
    let n = knots.len();
    let fixed = |k: usize| knots[k % n].normal == [0.0; 2];
    let start = (0..n).find(|k| fixed(*k)).unwrap_or(0);
    let mut kept = vec![start];
    while let Some(&anchor) = kept.last() {
        let end = reach(knots, anchor, start + n, 0.5 * tolerance, &fixed);
        if end >= start + n {
            break;
        }
        kept.push(end);
    }
    let m = kept.len();
    let chord = |i: usize| [kept[i], if i + 1 == m { start + n } else { kept[i + 1] }];
    let at = |k: usize| knots[k % n].point;
    let mut shift = vec![0.0; m];
    let mut weight = vec![0.0; m];
    for i in 0..m {
        let [a, b] = chord(i);
        let mut excess = 0.0;
        let (origin, mut swept) = (at(a), 0.0);
        let cross =
            |p: Point, q: Point| (p[0] - origin[0]) * (q[1] - origin[1]) - (p[1] - origin[1]) * (q[0] - origin[0]);
        for k in a..b {
            excess += knots[k % n].excess;
            swept += cross(at(k), at(k + 1));
        }
        // Area of the chord's polygon less that of the points' own.
        excess -= 0.5 * swept;
        let length = length([at(b)[0] - origin[0], at(b)[1] - origin[1]]);
        for j in [i, (i + 1) % m] {
            shift[j] -= 0.5 * excess;
            weight[j] += 0.5 * length;
        }
    }
    let mut points: Vec<Point> = Vec::with_capacity(m);
    let mut arcs = Vec::with_capacity(m);
    for (i, &k) in kept.iter().enumerate() {
        let knot = &knots[k % n];
        let by = shift[i] / weight[i];
        let by = if by.is_finite() { by.clamp(-0.9 * tolerance, 0.9 * tolerance) } else { 0.0 };
        let p = [0, 1].map(|c| f64::from((knot.point[c] + by * knot.normal[c]) as f32));
        if points.last() != Some(&p) {
            points.push(p);
            arcs.push(knot.arc);
        }
    }
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
        arcs.pop();
    }
    (points, arcs)
}

/// The farthest point to which a chord from `anchor` passes all points between within `most`, and no fixed one.
fn reach(knots: &[ContourPoint], anchor: usize, last: usize, most: f64, fixed: &impl Fn(usize) -> bool) -> usize {
    let at = |k: usize| knots[k % knots.len()].point;
    let origin = at(anchor);
    let mut wedge: Option<[Point; 2]> = None;
    for k in anchor + 1..=last {
        let d = [at(k)[0] - origin[0], at(k)[1] - origin[1]];
        let length = length(d);
        if let Some([low, high]) = wedge {
            let within = low[0] * d[1] - low[1] * d[0] >= 0.0 && d[0] * high[1] - d[1] * high[0] >= 0.0;
            let ahead = (low[0] + high[0]) * d[0] + (low[1] + high[1]) * d[1] > 0.0;
            if !(within && ahead) {
                return k - 1;
            }
        }
        if k == last || fixed(k) {
            return k;
        }
        if length > most {
            // The directions from the anchor that pass this point within `most`.
            let (s, c) = (most / length, (1.0 - (most / length).powi(2)).sqrt());
            let u = [d[0] / length, d[1] / length];
            let mut low = [c * u[0] + s * u[1], c * u[1] - s * u[0]];
            let mut high = [c * u[0] - s * u[1], c * u[1] + s * u[0]];
            if let Some([l, h]) = wedge {
                low = if l[0] * low[1] - l[1] * low[0] > 0.0 { low } else { l };
                high = if high[0] * h[1] - high[1] * h[0] > 0.0 { high } else { h };
            }
            wedge = Some([low, high]);
        }
    }
    last
}
