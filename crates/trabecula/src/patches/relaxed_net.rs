//! Vertices of a net moved: onto their surfaces, and towards the mean of their neighbours along them.

use rayon::prelude::*;

use super::quad_net::{NetVertex, QuadFace, QuadNet, VertexConstraint};
use crate::field::Field;
use geometry::math::{Aabb, Vec3, add, cross, dot, norm, scale, sub};

/// How much more an edge weighs that turns by an angle of one over a grid cell.
const TURNS: f64 = 2.0;
/// Least sine of the angle at a corner that a move may make smaller.
const LEAST: f64 = 0.35;
/// Rounds at first in which all edges count the same and no move is taken back: they untangle.
const FREE: usize = 4;
/// Rounds in which moves are taken back.
const PASSES: usize = 4;
/// Points evaluated at once.
const BATCH: usize = 256;

/// Values and gradients (per mm) at points.
pub fn gradients(field: &dyn Field, points: &[Vec3]) -> (Vec<f64>, Vec<Vec3>) {
    let (mut v, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    let each = points.par_chunks(BATCH).zip(v.par_chunks_mut(BATCH)).zip(g.par_chunks_mut(BATCH));
    each.for_each(|((p, v), g)| field.gradients(p, v, g));
    (v, g)
}

/// Where Newton's step to the zero of a function leads in the directions in which a vertex may move, no longer than `most` (mm)
/// and within the box.
fn step(vertex: &NetVertex, value: f64, gradient: Vec3, most: f64, bounds: &Aabb) -> Vec3 {
    let mut along = scale(gradient, -value.signum());
    match vertex.constraint {
        VertexConstraint::Surface => {
            // Along a plane of the box that it would cross.
            for a in 0..3 {
                if vertex.at[a] <= bounds.min[a] && along[a] < 0.0 || vertex.at[a] >= bounds.max[a] && along[a] > 0.0 {
                    along[a] = 0.0;
                }
            }
        }
        VertexConstraint::Plane(plane) => along[usize::from(plane / 2)] = 0.0,
        VertexConstraint::Edge(axis) => (0..3).filter(|a| *a != usize::from(axis)).for_each(|a| along[a] = 0.0),
    }
    let square = dot(along, along);
    if square == 0.0 {
        return vertex.at;
    }
    let to = add(vertex.at, scale(along, (value.abs() / square).min(most / square.sqrt())));
    core::array::from_fn(|a| to[a].clamp(bounds.min[a], bounds.max[a]))
}

/// The unit normal, in a plane of the box, of the curve in which a surface of unit normal `n` meets it.
fn within(mut n: Vec3, plane: u8) -> Vec3 {
    n[usize::from(plane / 2)] = 0.0;
    scale(n, 1.0 / norm(n).max(f64::MIN_POSITIVE))
}

impl QuadNet {
    /// The vertices of a surface.
    fn of_surface(&self, surface: u8) -> Vec<usize> {
        (0..self.vertices.len()).filter(|v| self.vertices[*v].surface == surface).collect()
    }

    /// Moves the vertices of each surface onto it by Newton's method, and gives the unit normals there.
    pub fn project(&mut self, surfaces: &[&dyn Field], bounds: &Aabb, steps: usize, most: f64) -> Vec<Vec3> {
        let mut normals = vec![[0.0; 3]; self.vertices.len()];
        for (surface, field) in surfaces.iter().enumerate() {
            let own = self.of_surface(surface as u8);
            for last in (0..=steps).map(|s| s == steps) {
                let points: Vec<Vec3> = own.iter().map(|v| self.vertices[*v].at).collect();
                let (values, slopes) = gradients(*field, &points);
                for ((v, value), slope) in own.iter().zip(values).zip(slopes) {
                    let vertex = &mut self.vertices[*v];
                    if last {
                        normals[*v] = scale(slope, 1.0 / norm(slope).max(f64::MIN_POSITIVE));
                    } else {
                        vertex.at = step(vertex, value, slope, most, bounds);
                    }
                }
            }
        }
        normals
    }

    /// Moves vertices towards the mean of their neighbours, along the surfaces; those in a plane of the box towards the mean of
    /// their neighbours in it. Edges count by their length and by how much the surface turns along them, so that vertices come to
    /// lie closer where it is curved. Unit normals at the end. `spacing` is the grid's (mm).
    pub fn relax(&mut self, surfaces: &[&dyn Field], bounds: &Aabb, rounds: usize, spacing: f64) -> Vec<Vec3> {
        let most = 0.25 * spacing;
        let mut normals = self.project(surfaces, bounds, 3, most);
        for round in 0..rounds {
            let before: Vec<Vec3> = self.vertices.iter().map(|v| v.at).collect();
            let shape = self.shapes(&normals);
            for (v, to) in self.means(&normals, spacing, if round < FREE { 0.0 } else { TURNS }).into_iter().enumerate()
            {
                let Some(to) = to else { continue };
                let vertex = &mut self.vertices[v];
                let to = sub(to, vertex.at);
                let mut along = sub(to, scale(normals[v], dot(to, normals[v])));
                if let VertexConstraint::Plane(plane) = vertex.constraint {
                    along[usize::from(plane / 2)] = 0.0;
                }
                let to = add(vertex.at, scale(along, 0.5));
                vertex.at = core::array::from_fn(|a| to[a].clamp(bounds.min[a], bounds.max[a]));
            }
            normals = self.project(surfaces, bounds, 1, most);
            for _ in 0..if round < FREE { 0 } else { PASSES } {
                let mut back = false;
                for (face, (shape, now)) in self.faces.iter().zip(shape.iter().zip(self.shapes(&normals))) {
                    if now < LEAST && now < *shape {
                        for v in face.corners.map(|v| v as usize) {
                            back |= self.vertices[v].at != before[v];
                            self.vertices[v].at = before[v];
                        }
                    }
                }
                if !back {
                    break;
                }
            }
            normals = self.project(surfaces, bounds, 0, most);
        }
        let normals = self.project(surfaces, bounds, 4, most);
        for e in 0..self.edges.len() {
            let [a, b] = self.edges[e].ends.map(|v| self.vertices[v as usize].at);
            self.edges[e].middle = scale(add(a, b), 0.5);
        }
        normals
    }

    /// The weighted means of neighbours.
    fn means(&self, normals: &[Vec3], spacing: f64, turns: f64) -> Vec<Option<Vec3>> {
        let mut sum = vec![([0.0; 3], 0.0); self.vertices.len()];
        for edge in &self.edges {
            let [a, b] = edge.ends.map(|v| v as usize);
            let length = norm(sub(self.vertices[a].at, self.vertices[b].at)).max(1e-3 * spacing);
            let [n, m] = [a, b].map(|v| match edge.plane {
                Some(plane) => within(normals[v], plane),
                None => normals[v],
            });
            let weight = 1.0 + turns * norm(sub(n, m)) * spacing / length;
            for (v, other) in [(a, b), (b, a)] {
                match self.vertices[v].constraint {
                    VertexConstraint::Plane(_) if edge.plane.is_none() => continue,
                    VertexConstraint::Edge(_) => continue,
                    _ => {}
                }
                let (at, total) = &mut sum[v];
                (*at, *total) = (add(*at, scale(self.vertices[other].at, weight)), *total + weight);
            }
        }
        sum.into_iter().map(|(at, total)| (total > 0.0).then(|| scale(at, 1.0 / total))).collect()
    }

    /// Of each face the least sine of the angles at its corners, seen against the surface's normal; corners on edges of the box do
    /// not move and do not count.
    fn shapes(&self, normals: &[Vec3]) -> Vec<f64> {
        let of = |face: &QuadFace| {
            let sine = |k: usize| {
                let at = [(k + 3) % 4, k, (k + 1) % 4].map(|k| face.corners[k] as usize);
                if matches!(self.vertices[at[1]].constraint, VertexConstraint::Edge(_)) {
                    return 1.0;
                }
                let [a, b, c] = at.map(|v| self.vertices[v].at);
                let (to, on) = (sub(b, a), sub(c, b));
                dot(cross(to, on), normals[at[1]]) / (norm(to) * norm(on)).max(f64::MIN_POSITIVE)
            };
            (0..4).map(sine).fold(1.0, f64::min)
        };
        self.faces.par_iter().with_min_len(64).map(of).collect()
    }
}
