//! Roots of implicit surfaces in a layer's plane, many at a time: on sides of polygons, where two surfaces meet, and nearest to a
//! point.

use super::outline::{Outline, SurfaceRoot};
use super::plane_grid::{PlaneGrid, lifted};
use crate::implicit::Surface;
use geometry::layer::{Point, length};
use geometry::math::Vec3;
use geometry::roots::Bracket;

/// Surfaces at a height.
#[derive(Clone, Copy)]
pub(super) struct SurfacesAtHeight<'a> {
    pub surfaces: &'a [Surface],
    pub z: f64,
}

/// Values and gradients in the plane at points.
pub(super) struct PlaneValues {
    pub values: Vec<f64>,
    pub gradients: Vec<Vec3>,
}

/// Points evaluated at once: enough to amortise a call, few enough to stay in the cache.
const BATCH: usize = 1024;

impl SurfacesAtHeight<'_> {
    /// Evaluates a surface at points of the plane.
    pub fn evaluate(&self, surface: u32, points: impl Iterator<Item = Point>) -> PlaneValues {
        let points: Vec<Vec3> = points.map(|p| lifted(p, self.z)).collect();
        let mut out = PlaneValues { values: vec![0.0; points.len()], gradients: vec![[0.0; 3]; points.len()] };
        let field = &self.surfaces[surface as usize].field;
        let parts = out.values.chunks_mut(BATCH).zip(out.gradients.chunks_mut(BATCH));
        for (points, (values, gradients)) in points.chunks(BATCH).zip(parts) {
            field.gradients(points, values, gradients);
        }
        out
    }
}

impl PlaneValues {
    /// The value, the gradient in the plane and its length, of a point.
    pub fn at(&self, i: usize) -> (f64, Point, f64) {
        let [x, y, _] = self.gradients[i];
        (self.values[i], [x, y], length([x, y]))
    }
}

/// Rounds of a bracketed iteration.
const ROUNDS: usize = 40;

/// Solves for the roots of all surfaces on their sides to `accuracy` (mm): Newton's method within a bracket.
pub(super) fn solve(outline: &mut Outline, grid: &PlaneGrid, plane: SurfacesAtHeight, accuracy: f64) {
    let mut order: Vec<u32> = (0..outline.roots.len() as u32).collect();
    order.sort_by_key(|r| outline.roots[*r as usize].surface);
    let roots = &mut outline.roots;
    for of in order
        .chunk_by(|a, b| roots[*a as usize].surface == roots[*b as usize].surface)
        .map(<[u32]>::to_vec)
        .collect::<Vec<_>>()
    {
        let surface = roots[of[0] as usize].surface;
        let bracket = |r: &SurfaceRoot| if r.falls { Bracket::of_signs(0.0, 1.0) } else { Bracket::of_signs(1.0, 0.0) };
        let mut open: Vec<(u32, Bracket)> = of.iter().map(|&r| (r, bracket(&roots[r as usize]))).collect();
        for round in 0..ROUNDS {
            let found = plane.evaluate(surface, open.iter().map(|(r, _)| roots[*r as usize].position(grid)));
            let mut i = 0;
            open.retain_mut(|(r, bracket)| {
                let (value, gradient, _) = found.at(i);
                i += 1;
                // The first evaluation is at a guess, whose gradient is not that of the root.
                !step(&mut roots[*r as usize], bracket, grid, (value, gradient), accuracy) || round == 0
            });
            if open.is_empty() {
                break;
            }
        }
    }
}

/// One step for a root; whether it is near enough.
fn step(
    root: &mut SurfaceRoot,
    bracket: &mut Bracket,
    grid: &PlaneGrid,
    (value, gradient): (f64, Point),
    accuracy: f64,
) -> bool {
    let [p, q] = root.side.map(|n| grid.position(n));
    let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
    let slope = gradient[0] * dx + gradient[1] * dy;
    bracket.narrow(root.at, value);
    root.gradient = gradient;
    let next = bracket.newton_step(root.at, value, slope);
    let moved = (next - root.at).abs() * length([dx, dy]);
    root.at = next;
    moved <= accuracy
}

/// A point where two surfaces meet, looked for from a guess within a box.
pub(super) struct IntersectionPoint {
    pub surfaces: [u32; 2],
    pub point: Point,
    pub bounds: [Point; 2],
    /// The gradients of both there.
    pub gradients: [Point; 2],
    /// Whether it was found.
    pub found: bool,
}

/// Solves for points where two surfaces meet, to `accuracy` (mm), by Newton's method.
pub(super) fn solve_intersections(points: &mut [IntersectionPoint], plane: SurfacesAtHeight, accuracy: f64) {
    let mut open: Vec<usize> = (0..points.len()).collect();
    for _ in 0..ROUNDS / 2 {
        let mut values = vec![[0.0; 2]; open.len()];
        for k in 0..2 {
            let mut order: Vec<usize> = (0..open.len()).collect();
            let surfaces: Vec<u32> = open.iter().map(|m| points[*m].surfaces[k]).collect();
            order.sort_by_key(|i| surfaces[*i]);
            for of in order.chunk_by(|a, b| surfaces[*a] == surfaces[*b]) {
                let surface = surfaces[of[0]];
                let found = plane.evaluate(surface, of.iter().map(|i| points[open[*i]].point));
                for (n, i) in of.iter().enumerate() {
                    let (value, gradient, _) = found.at(n);
                    values[*i][k] = value;
                    points[open[*i]].gradients[k] = gradient;
                }
            }
        }
        let mut i = 0;
        open.retain(|m| {
            let m = &mut points[*m];
            let [v, w] = values[i];
            i += 1;
            let [[a, b], [c, d]] = m.gradients;
            let determinant = a * d - b * c;
            let size = [0, 1].map(|k| m.bounds[1][k] - m.bounds[0][k]);
            let most = size[0].max(size[1]);
            let by = [(-v * d + w * b) / determinant, (-w * a + v * c) / determinant];
            let length = length(by);
            if !length.is_finite() {
                return false;
            }
            let scale = (most / length).min(1.0);
            m.point = [0, 1].map(|k| m.point[k] + scale * by[k]);
            let inside = (0..2).all(|k| m.point[k] >= m.bounds[0][k] && m.point[k] <= m.bounds[1][k]);
            m.found = length <= accuracy && inside;
            length > accuracy
        });
        if open.is_empty() {
            break;
        }
    }
}
