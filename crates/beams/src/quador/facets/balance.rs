//! Vertices of a hub's triangles moved off the surface, so that the triangles enclose its volume exactly.
//!
//! Triangles with vertices on a convex surface are inside of it. Between a triangle and the surface the distance is a quadratic
//! function to third order, whose mean is that of its values at the middles of edges. Every vertex is moved along the vector area of
//! its triangles by their mean distance from the surface; so the surface is on both sides of the triangles, and what remains is of
//! higher order. It is balanced by one more distance for all vertices.
//!
//! End circles are polygons of the circle's area, whatever the hub. Moved vertices keep the orientation of all triangles seen from the
//! centre, so that the triangles still cover the sphere of directions once and do not intersect.

use geometry::math::{Vec3, add, cross, dot, norm, scale, sub};
use geometry::roots::secant;

use super::{EdgeCurve, Facets, edge_key, orientation};

/// Least height of a triangle seen from the centre, relative to its size, unless it was lower before: for single precision.
const FLAT: f64 = 1e-4;
/// Number of times that vertices of triangles that would turn over are moved together.
const ROUNDS: usize = 32;

impl Facets<'_> {
    /// Moves the vertices so that the volume below the triangles and of `below_circles` together is that of the hub (mm³), if it is
    /// known; those of the end circle of each half-beam, their number given with its factor in `circles`, away from the axis by that
    /// factor. Gives the greatest distance from the surface, mm, that of end circles excepted; `None` if triangles would
    /// turn over.
    pub(crate) fn balance(&mut self, circles: &[(usize, f64)], below_circles: f64, volume: Option<f64>) -> Option<f64> {
        let from = self.points.clone();
        let mut normals = self.normals();
        let mut ways: Vec<Vec3> = (normals.iter().zip(self.deficits())).map(|(n, by)| scale(*n, by)).collect();
        // The half-beam with whose end circle a vertex is moved.
        let mut with: Vec<Option<usize>> = circles.iter().enumerate().flat_map(|(h, c)| vec![Some(h); c.0]).collect();
        with.resize(from.len(), None);
        let widened = |v: usize, half_beam: usize| {
            let (p, axis) = (from[v], self.hub.half_beams[half_beam].axis);
            scale(sub(p, scale(axis, dot(p, axis))), circles[half_beam].1 - 1.0)
        };
        for v in 0..from.len() {
            if let Some(half_beam) = with[v] {
                ways[v] = widened(v, half_beam);
            }
        }
        for _ in 0..ROUNDS {
            let at = |more: f64| {
                let more = |k: usize| scale(normals[k], if with[k].is_some() { 0.0 } else { more });
                (0..from.len()).map(|k| add(from[k], add(ways[k], more(k)))).collect::<Vec<Vec3>>()
            };
            let more = volume.map_or(0.0, |volume| {
                let off = |more: f64| self.volume_below(&at(more)) + below_circles - volume;
                secant([0.0, 1e-3 * self.chord], off)
            });
            if more.abs() > self.chord {
                return None;
            }
            let moved = at(more);
            let turned = self.turned(&from, &moved);
            if turned.is_empty() {
                self.points = moved;
                return Some(self.greatest_distance());
            }
            // What turned over is moved by what turns nothing over: with an end circle, a linear function, or from the centre.
            for t in turned.into_iter().map(|t| t.map(|v| v as usize)) {
                let half_beam = t.iter().find_map(|v| with[*v]);
                for v in t.into_iter().filter(|v| with[*v].is_none()).collect::<Vec<_>>() {
                    with[v] = half_beam;
                    let up = scale(from[v], 1.0 / norm(from[v]));
                    ways[v] = half_beam.map_or(scale(up, dot(ways[v], up)), |half_beam| widened(v, half_beam));
                    normals[v] = scale(up, dot(normals[v], up));
                }
            }
        }
        None
    }

    /// The direction of the vector area of the triangles of each vertex.
    fn normals(&self) -> Vec<Vec3> {
        let mut areas = vec![[0.0; 3]; self.points.len()];
        for t in &self.triangles {
            let [a, b, c] = self.corners(*t);
            let area = cross(sub(b, a), sub(c, a));
            t.iter().for_each(|v| areas[*v as usize] = add(areas[*v as usize], area));
        }
        areas.into_iter().map(|area| scale(area, 1.0 / norm(area).max(f64::MIN_POSITIVE))).collect()
    }

    /// How far each vertex is to be moved outwards, mm: the mean distance of its triangles from the surface.
    fn deficits(&self) -> Vec<f64> {
        let mut sums = vec![[0.0; 2]; self.points.len()];
        for (t, face) in self.triangles.iter().zip(&self.faces) {
            let [a, b, c] = self.corners(*t);
            let quadric = &self.complex.faces[*face as usize].quadric;
            let inside = |p: Vec3, q: Vec3| {
                let x = scale(add(p, q), 0.5);
                -quadric.at(x) / (2.0 * norm(quadric.half_gradient(x)))
            };
            let area = norm(cross(sub(b, a), sub(c, a)));
            let volume = area * (inside(a, b) + inside(b, c) + inside(c, a)) / 3.0;
            for v in t.map(|v| v as usize) {
                sums[v] = [sums[v][0] + volume, sums[v][1] + area];
            }
        }
        let most = self.chord;
        sums.into_iter().map(|[volume, area]| (volume / area.max(f64::MIN_POSITIVE)).clamp(-most, most)).collect()
    }

    /// The volume between the centre and the triangles with these vertices, mm³.
    fn volume_below(&self, points: &[Vec3]) -> f64 {
        let six = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            orientation(a, b, c)
        };
        self.triangles.iter().map(six).sum::<f64>() / 6.0
    }

    /// Triangles that are turned over, or nearly, with the vertices `to`, unlike with `from`.
    fn turned(&self, from: &[Vec3], to: &[Vec3]) -> Vec<[u32; 3]> {
        let height = |points: &[Vec3], t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            orientation(a, b, c) / (norm(a) * norm(cross(sub(b, a), sub(c, a)))).max(f64::MIN_POSITIVE)
        };
        let low = |t: &&[u32; 3]| height(to, t) < FLAT.min(0.5 * height(from, t));
        self.triangles.iter().filter(low).copied().collect()
    }

    /// The greatest distance from the surface of vertices, of the quarter points of edges and of the centroids of triangles, mm.
    fn greatest_distance(&self) -> f64 {
        let mut most = 0.0f64;
        for t in &self.triangles {
            let [a, b, c] = self.corners(*t);
            most = most.max(self.distance(scale(add(a, add(b, c)), 1.0 / 3.0)));
            for k in 0..3 {
                let (i, j) = (t[k], t[(k + 1) % 3]);
                if self.boundary.get(&edge_key(i, j)) != Some(&EdgeCurve::EndCircle) {
                    most = most.max(self.edge_distance(i, j)).max(self.distance(self.points[i as usize]));
                }
            }
        }
        most
    }
}
