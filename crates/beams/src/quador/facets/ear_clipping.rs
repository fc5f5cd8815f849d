//! Triangulation of faces between the vertices of their boundary polygons.

use core::f64::consts::TAU;

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub, unit};

use super::super::complex::QuadricFace;
use super::refinement::alignment;
use super::{Facets, loop_vertices, orientation};

/// Orientations below this count as collinear: planes of seams may pass through the centre, and vertices are accurate
/// to 1e-7.
const COLLINEAR: f64 = 1e-9;

impl Facets<'_> {
    /// Triangulates a face bounded by seams alone.
    pub(super) fn bounded(&mut self, polylines: &[Vec<u32>], face: &QuadricFace) -> Option<Vec<[u32; 3]>> {
        if face.loops.is_empty() {
            return Some(self.ball());
        }
        let mut loops: Vec<Vec<u32>> = face.loops.iter().map(|l| loop_vertices(polylines, l)).collect();
        loops.retain(|l| l.len() > 2);
        if let [alone] = &loops[..]
            && face.label == 0
        {
            // A cap, or the complement of one: a fan about its centre.
            let middle = self.complex.pole(face);
            let place = |i: u32| self.points[i as usize];
            let number = self.points.len() as u32;
            let fan: Vec<[u32; 3]> =
                (0..alone.len()).map(|k| [number, alone[k], alone[(k + 1) % alone.len()]]).collect();
            if fan.iter().all(|t| orientation(middle, place(t[1]), place(t[2])) > 0.0) {
                self.points.push(middle);
                return Some(fan);
            }
        }
        self.connected(loops, face)
    }

    /// Triangulates a face between several loops.
    pub(super) fn connected(&self, mut loops: Vec<Vec<u32>>, face: &QuadricFace) -> Option<Vec<[u32; 3]>> {
        let mut outline = loops.pop().unwrap_or_default();
        while !loops.is_empty() {
            // Loops are connected along the shortest bridge.
            let gap = |a: u32, b: u32| norm(sub(unit(self.points[a as usize]), unit(self.points[b as usize])));
            let mut best = (f64::INFINITY, 0, 0, 0);
            for (l, inner) in loops.iter().enumerate() {
                for (i, &a) in outline.iter().enumerate() {
                    for (j, &b) in inner.iter().enumerate() {
                        if gap(a, b) < best.0 {
                            best = (gap(a, b), l, i, j);
                        }
                    }
                }
            }
            let (_, l, i, j) = best;
            let inner = loops.swap_remove(l);
            let bridge: Vec<u32> = inner[j..].iter().chain(&inner[..=j]).chain(&outline[i..=i]).copied().collect();
            outline.splice(i + 1..i + 1, bridge);
        }
        self.ears(outline, face)
    }

    /// An octahedron in a hub without beams.
    fn ball(&mut self) -> Vec<[u32; 3]> {
        let (r, n) = (self.hub.radius, self.points.len() as u32);
        for a in 0..6 {
            let mut p = [0.0; 3];
            p[a % 3] = if a < 3 { r } else { -r };
            self.points.push(p);
        }
        let corner = |k: u32| {
            let [x, y, z] = [k & 1, k >> 1 & 1, k >> 2].map(|s| 3 * s);
            let t = [n + x, n + 1 + y, n + 2 + z];
            if k.count_ones().is_multiple_of(2) { t } else { [t[0], t[2], t[1]] }
        };
        (0..8).map(corner).collect()
    }

    /// Triangulates a polygon by ear clipping, the best ear first.
    fn ears(&self, mut outline: Vec<u32>, face: &QuadricFace) -> Option<Vec<[u32; 3]>> {
        let place = |i: u32| self.points[i as usize];
        let worth = |[a, b, c]: [u32; 3]| {
            let [p, q, r] = self.corners([a, b, c]);
            if a == b || b == c || c == a || orientation(unit(p), unit(q), unit(r)) <= COLLINEAR {
                return f64::NEG_INFINITY;
            }
            let edge = |p: Vec3, q: Vec3| dot(sub(p, q), sub(p, q));
            let shape = norm(cross(sub(q, p), sub(r, p))) / (edge(p, q) + edge(q, r) + edge(r, p));
            // Diagonals that leave the surface, and triangles at a large angle to it, are a last resort.
            let off = self.distance(scale(add(p, r), 0.5)) / edge(p, r).sqrt();
            let alignment = (alignment(face, [p, q, r]) - 0.2).max(1e-4);
            shape * alignment / (1.0 + 8.0 * off).powi(2)
        };
        let ear = |o: &[u32], i: usize| [o[(i + o.len() - 1) % o.len()], o[i], o[(i + 1) % o.len()]];
        let mut out = Vec::with_capacity(outline.len());
        let mut worths: Vec<f64> = (0..outline.len()).map(|i| worth(ear(&outline, i))).collect();
        while outline.len() > 3 {
            let n = outline.len();
            let mut order: Vec<usize> = (0..n).filter(|&i| worths[i] > 0.0).collect();
            order.sort_by(|&i, &j| worths[j].total_cmp(&worths[i]));
            let i = order.into_iter().find(|&i| {
                let [a, b, c] = ear(&outline, i);
                let [p, q, r] = self.corners([a, b, c]);
                // Vertices on an edge obstruct too: seams may be straight seen from the centre.
                let [p, q, r] = [p, q, r].map(unit);
                outline.iter().all(|&o| {
                    let x = unit(place(o));
                    o == a
                        || o == b
                        || o == c
                        || orientation(p, q, x) < -COLLINEAR
                        || orientation(q, r, x) < -COLLINEAR
                        || orientation(r, p, x) < -COLLINEAR
                })
            })?;
            out.push(ear(&outline, i));
            outline.remove(i);
            worths.remove(i);
            let n = outline.len();
            for k in [(i + n - 1) % n, i % n] {
                worths[k] = worth(ear(&outline, k));
            }
        }
        if outline.len() == 3 {
            out.push(ear(&outline, 1));
        }
        Some(out)
    }
}

/// Triangulates the strip between a loop around an axis and the end circle, by azimuth.
pub(super) fn strip(axis: Vec3, points: &[Vec3], inner: &[u32], ring: &[u32]) -> Vec<[u32; 3]> {
    let side = super::super::perpendicular::perpendicular(axis);
    let other = cross(axis, side);
    let azimuth = |i: u32| dot(points[i as usize], other).atan2(dot(points[i as usize], side));
    let sorted = |of: &[u32]| {
        let mut v: Vec<(f64, u32)> = of.iter().map(|&i| (azimuth(i), i)).collect();
        v.sort_by(|a, b| a.0.total_cmp(&b.0));
        v
    };
    let (low, high) = (sorted(inner), sorted(ring));
    let at = |of: &[(f64, u32)], k: usize| {
        let (a, i) = of[k % of.len()];
        (a + TAU * (k / of.len()) as f64, i)
    };
    let (mut i, mut j, mut out) = (0, 0, Vec::with_capacity(low.len() + high.len()));
    while i < low.len() || j < high.len() {
        let (l, h) = (at(&low, i).1, at(&high, j).1);
        let ((next_low, l2), (next_high, h2)) = (at(&low, i + 1), at(&high, j + 1));
        let (low_now, high_now) = (at(&low, i).0, at(&high, j).0);
        if j >= high.len() || i < low.len() && (next_low - high_now).abs() < (next_high - low_now).abs() {
            out.push([l, l2, h]);
            i += 1;
        } else {
            out.push([l, h2, h]);
            j += 1;
        }
    }
    out
}
